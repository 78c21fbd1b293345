//! `standard`: the material of glTF 2.0 and of most tools for artists, which keeps all light.
//!
//! The layers and their parameters are those of glTF 2.0 (Appendix B) and its extensions KHR_materials_ior,
//! KHR_materials_specular, KHR_materials_sheen and KHR_materials_clearcoat. From the top:
//!
//! - a clear coat of GGX facets (as in `ggx`) with F_0 = 0.04, times `clearcoat`,
//! - the sheen of upright fibres ("Charlie": Conty Estevez and Kulla, "Production Friendly Microfacet Sheen
//!   BRDF", 2017), times `sheen`,
//! - the highlight of GGX facets with Schlick's F = F_0 + (F_90 - F_0) (1 - L.h)^5: for a dielectric F_0 =
//!   min(((ior - 1) / (ior + 1))^2 `specular_color`, 1) `specular` and F_90 = `specular`, for a metal F_0 =
//!   `base_color` and F_90 = 1; `metallic` mixes the two,
//! - the matte base of a dielectric, of `base_color`.
//!
//! Alpha is the square of each roughness. A layer receives what those above it leave of light and view, the
//! lesser of the two, as glTF's scaling of the base under sheen does: u under the coat, s under coat and
//! sheen. Below a `sheen_roughness` of 0.25 the published sheen reflects more light than it receives; it is
//! divided by the excess.
//!
//! glTF leaves open what happens to light that facets reflect more than once. Here none is lost: in all,
//!
//! BRDF = `clearcoat` D_c G_c F_c / (4 N.L N.V) + min(u_L, u_V) `sheen` sheen + min(s_L, s_V) D G F / (4 N.L
//! N.V) + F_m w_L w_V / (pi mean(w)) + `base_color` (1 - `metallic`) t_L t_V / (pi mean(t))
//!
//! where w is what coat, sheen and highlight would leave if the facets reflected everything, F_m = Favg^2
//! Eavg / (1 - Favg (1 - Eavg)) is the share of light that remains after several reflections, Favg = F_0 +
//! (F_90 - F_0) / 21, Eavg the mean albedo of the facets (Kulla and Conty, "Revisiting Physically Based
//! Shading at Imageworks", 2017), and t is what all of these leave of the greatest channel of a dielectric.
//! u, s, w and t are functions of one cosine, tabulated when the model is made; mean(w) is twice the integral
//! of w(x) x.
//!
//! The model is reciprocal. A white material reflects all light, at any roughness and with any coat: every
//! view sees 1 within 0.2 percent. The two last terms, and sheen, vary slowly and belong to the normal; the
//! others are highlights about the reflection vector ([`Standard::parts`]).

mod vectors;

use std::f64::consts::PI;

use glam::{Vec3, Vec4};
use sh::f64x4::SimdLevel;
use sphere::Direction;

use super::base_color_response::{BaseColorResponse, several};
use super::charlie::{Charlie, CharlieConstants, CharlieQuadrature};
use super::directional_albedo::{Facets, Tables};
use super::facets::HalfVector;
use super::lobe::Lobe;
use super::model::{Model, one_by_one, toward};
use super::parameter::{Parameter, ParameterError, ROUGHNESS, Range, Value, Values, WEIGHT};
use super::part::Part;
use crate::coefficients::Centre;
use crate::packed::{self, packed};
use vectors::{Coat, RhoHats, Toward};

/// A share of light. Above 1 a material would make light.
const SHARE: Range = Range { least: 0.0, most: 1.0, words: "a number from 0 to 1" };

const BASE_COLOR: Parameter =
    Parameter::colour("base_color", "the colour of the matte base, or of the metal", SHARE).or(1.0);
const METALLIC: Parameter =
    Parameter::number("metallic", "0 for a dielectric, 1 for a metal, or between for a mixture", SHARE)
        .or(0.0);
const ROUGH: Parameter =
    Parameter::number("roughness", "the width of the highlight: alpha is its square", ROUGHNESS);
const IOR: Parameter = Parameter::number(
    "ior",
    "the index of refraction of the dielectric (glass 1.5, water 1.33)",
    Range { least: 1.0, most: 10.0, words: "a number from 1 to 10" },
)
.or(1.5);
const SPECULAR: Parameter =
    Parameter::number("specular", "the weight of the dielectric's highlight", SHARE).or(1.0);
const SPECULAR_COLOR: Parameter = Parameter::colour(
    "specular_color",
    "a factor on the dielectric's reflectance at normal incidence; the product is at most 1",
    WEIGHT,
)
.or(1.0);
const CLEARCOAT: Parameter = Parameter::number("clearcoat", "the weight of the clear coat", SHARE).or(0.0);
const CLEARCOAT_ROUGHNESS: Parameter =
    Parameter::number("clearcoat_roughness", "the width of the coat's highlight", ROUGHNESS).or(0.01);
const SHEEN: Parameter = Parameter::colour("sheen", "the colour of the sheen", SHARE).or(0.0);
const SHEEN_ROUGHNESS: Parameter = Parameter::number(
    "sheen_roughness",
    "how far the fibres of the sheen lean: small values shine toward grazing only",
    Range { least: 0.1, most: 1.0, words: "a number from 0.1 to 1" },
)
.or(0.5);

/// The parameters of [`Standard`]; the default is a white dielectric without coat or sheen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardParameters {
    /// The colour of the matte base, or of the metal, RGB, each 0 to 1.
    pub base_color: [f64; 3],
    /// 0 for a dielectric, 1 for a metal.
    pub metallic: f64,
    /// The square root of the highlight's alpha, 0.01 to 1.
    pub roughness: f64,
    /// The dielectric's index of refraction, 1 to 10.
    pub ior: f64,
    /// The weight of the dielectric's highlight, 0 to 1.
    pub specular: f64,
    /// The factor of the dielectric's reflectance at normal incidence, RGB, each 0 to 1e6.
    pub specular_color: [f64; 3],
    /// The weight of the coat, 0 to 1.
    pub clearcoat: f64,
    /// The square root of the coat's alpha, 0.01 to 1.
    pub clearcoat_roughness: f64,
    /// The colour of the sheen, RGB, each 0 to 1.
    pub sheen: [f64; 3],
    /// The square root of the sheen's alpha, 0.1 to 1.
    pub sheen_roughness: f64,
}

impl Default for StandardParameters {
    fn default() -> Self {
        Self {
            base_color: [1.0; 3],
            metallic: 0.0,
            roughness: 0.5,
            ior: 1.5,
            specular: 1.0,
            specular_color: [1.0; 3],
            clearcoat: 0.0,
            clearcoat_roughness: 0.01,
            sheen: [0.0; 3],
            sheen_roughness: 0.5,
        }
    }
}

impl StandardParameters {
    fn checked(self) -> Result<Self, ParameterError> {
        BASE_COLOR.checked_colour(self.base_color)?;
        METALLIC.checked(self.metallic)?;
        ROUGH.checked(self.roughness)?;
        IOR.checked(self.ior)?;
        SPECULAR.checked(self.specular)?;
        SPECULAR_COLOR.checked_colour(self.specular_color)?;
        CLEARCOAT.checked(self.clearcoat)?;
        CLEARCOAT_ROUGHNESS.checked(self.clearcoat_roughness)?;
        SHEEN.checked_colour(self.sheen)?;
        SHEEN_ROUGHNESS.checked(self.sheen_roughness)?;
        Ok(self)
    }

    /// F_0 of the dielectric.
    fn dielectric(&self) -> [f64; 3] {
        let smooth = math::powi((self.ior - 1.0) / (self.ior + 1.0), 2);
        self.specular_color.map(|colour| (smooth * colour).min(1.0) * self.specular)
    }
}

/// The material of glTF 2.0, or one of its [parts](Standard::parts).
#[derive(Clone, Debug, PartialEq)]
pub struct Standard {
    parameters: StandardParameters,
    /// The part of the material that this is; `None` for the whole.
    part: Option<Part>,
    formula: Box<Formula>,
}

/// The constants of rho_hat.
#[derive(Clone, Debug, PartialEq)]
struct Formula {
    /// alpha^2 of the highlight, whose F_0 and F_90 follow.
    alpha2: f64,
    f_0: [f64; 3],
    f_90: f64,
    /// alpha^2 of the coat, whose weight follows.
    coat_alpha2: f64,
    coat: f64,
    charlie: Charlie,
    sheen: [f64; 3],
    /// The factor F_m / (pi mean(w)) of the light that facets reflect several times.
    multiple: [f64; 3],
    /// The factor of t_L t_V.
    diffuse: [f64; 3],
    /// The tables of u, s, w and t.
    tables: Tables,
    /// For renderers that change the base colour: the albedos of the highlight by F_0 and by F_90, of the
    /// coat, and of white sheen.
    albedos: Tables,
    /// The mean albedo of facets that reflect everything.
    whole: f64,
}

/// F_0 of the coat; its F_90 is 1.
const COAT: f64 = 0.04;

impl Standard {
    /// The material with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of the range that [`StandardParameters`] states.
    pub fn new(parameters: StandardParameters) -> Result<Self, ParameterError> {
        let parameters = parameters.checked()?;
        Ok(Self { parameters, part: None, formula: Box::new(Formula::new(&parameters)) })
    }

    /// The material's parameters.
    pub fn parameters(&self) -> StandardParameters {
        self.parameters
    }

    /// The part of the material that this is; `None` for the whole.
    pub fn part(&self) -> Option<Part> {
        self.part
    }

    /// How the light that the material reflects depends on its base colour.
    pub fn base_color_response(&self) -> BaseColorResponse {
        let &StandardParameters { base_color, metallic, specular, sheen, .. } = &self.parameters;
        let Formula { tables, albedos, whole, f_90, .. } = &*self.formula;
        let dielectric = self.parameters.dielectric();
        let nodes = tables
            .nodes()
            .zip(albedos.nodes())
            .map(|([_, _, w, t], [scale, bias, coat, fibres])| [t, w, scale, bias, coat, fibres]);
        BaseColorResponse {
            base_color,
            metallic,
            dielectric,
            f_90: *f_90,
            sheen,
            dielectric_several: dielectric.map(|f_0| several(f_0, specular, *whole)),
            whole: *whole,
            matte: tables.zonal(3),
            nodes: nodes.collect(),
        }
    }

    /// Whether the material has a matte base or sheen.
    pub fn has_body(&self) -> bool {
        [self.formula.diffuse, self.formula.sheen].as_flattened().iter().any(|value| *value > 0.0)
    }

    /// The material as parts with a centre each, whose rho_hat sum to the whole's: the highlights of base and
    /// coat about the reflection vector, and the body (matte base, multiple scattering, sheen) about the
    /// normal. A part that reflects nothing is left out. The parts of a part are itself.
    ///
    /// A part has the parameters of the whole, from which [`Model::from_values`] makes the whole again.
    pub fn parts(&self) -> Vec<Self> {
        if self.part.is_some() {
            return vec![self.clone()];
        }
        let formula = &*self.formula;
        let black = [0.0; 3];
        let specular = Formula { sheen: black, multiple: black, diffuse: black, ..formula.clone() };
        let diffuse = Formula { f_0: black, f_90: 0.0, coat: 0.0, ..formula.clone() };
        let reflects = |formula: &Formula| {
            formula.f_90 > 0.0
                || formula.coat > 0.0
                || [formula.f_0, formula.sheen, formula.multiple, formula.diffuse]
                    .as_flattened()
                    .iter()
                    .any(|value| *value > 0.0)
        };
        [(Part::Specular, specular), (Part::Diffuse, diffuse)]
            .into_iter()
            .filter(|(_, formula)| reflects(formula))
            .map(|(part, formula)| Self {
                parameters: self.parameters,
                part: Some(part),
                formula: Box::new(formula),
            })
            .collect()
    }
}

impl Formula {
    fn new(parameters: &StandardParameters) -> Self {
        let &StandardParameters { base_color, metallic, specular, clearcoat, sheen, .. } = parameters;
        let mix = |dielectric: f64, metal: f64| dielectric + (metal - dielectric) * metallic;
        let dielectric = parameters.dielectric();
        let charlie = Charlie::new(parameters.sheen_roughness);
        let sheen_most = greatest(sheen);

        // u and s.
        let coat = (clearcoat > 0.0).then(|| Facets::new(math::powi(parameters.clearcoat_roughness, 2)));
        let fibres = (sheen_most > 0.0).then(|| CharlieQuadrature::new(charlie));
        let left = Tables::new(|view| {
            let coat = coat.as_ref().map_or(0.0, |coat| {
                let albedo = coat.albedo(view, |_| 1.0);
                clearcoat * (COAT * albedo.scale + albedo.bias)
            });
            let sheen = fibres.as_ref().map_or(0.0, |fibres| fibres.albedo(view, |_| 1.0));
            let under_coat = (1.0 - coat).max(0.0);
            [under_coat, under_coat / sheen.max(1.0), under_coat * (1.0 - sheen_most * sheen.min(1.0)), 0.0]
        });

        // w, and the albedos of which t is made.
        let facets = Facets::new(math::powi(parameters.roughness, 2));
        let mut albedos = Vec::new();
        let layers = Tables::new(|view| {
            let [under_coat, u, s, _] = left.at(view);
            let facets = facets.albedo(view, |light| left.at(light)[2].min(s));
            let fibres =
                fibres.as_ref().map_or(0.0, |fibres| fibres.albedo(view, |light| left.at(light)[1].min(u)));
            let w = (under_coat - sheen_most * fibres - facets.scale - facets.bias).max(0.0);
            albedos.push((facets, fibres, under_coat));
            [w, facets.whole, 0.0, 0.0]
        });
        let [w_mean, whole, ..] = layers.means();
        let of_dielectric = dielectric.map(|f_0| several(f_0, specular, whole));

        let mut parts = albedos.iter();
        let of_layers = Tables::new(|_| {
            let (facets, fibres, under_coat) = parts.next().copied().unwrap_or_default();
            [facets.scale, facets.bias, 1.0 - under_coat, fibres]
        });
        let mut albedos = albedos.into_iter();
        let tables = Tables::new(|view| {
            let [[_, u, s, _], [w, ..]] = [left.at(view), layers.at(view)];
            let (facets, fibres, under_coat) = albedos.next().unwrap_or_default();
            let reflected = [0, 1, 2].map(|channel| {
                let highlight = dielectric[channel] * facets.scale + specular * facets.bias;
                sheen[channel] * fibres + highlight + of_dielectric[channel] * w
            });
            [u, s, w, (under_coat - greatest(reflected)).max(0.0)]
        });
        let [.., t_mean] = tables.means();
        // A mean of 0 is that of a function that is 0 everywhere.
        let over = |mean: f64| if mean > 0.0 { 1.0 / (PI * mean) } else { 0.0 };
        let channels = [0, 1, 2];
        Self {
            alpha2: math::powi(parameters.roughness, 4),
            f_0: channels.map(|channel| mix(dielectric[channel], base_color[channel])),
            f_90: mix(specular, 1.0),
            coat_alpha2: math::powi(parameters.clearcoat_roughness, 4),
            coat: clearcoat,
            charlie,
            sheen,
            multiple: channels.map(|channel| {
                mix(of_dielectric[channel], several(base_color[channel], 1.0, whole)) * over(w_mean)
            }),
            diffuse: base_color.map(|colour| (1.0 - metallic) * colour * over(t_mean)),
            tables,
            albedos: of_layers,
            whole,
        }
    }

    fn has_sheen(&self) -> bool {
        greatest(self.sheen) > 0.0
    }
}

fn greatest(rgb: [f64; 3]) -> f64 {
    rgb.into_iter().fold(0.0, f64::max)
}

packed! {
    /// The constants of the formula of `standard`.
    pub struct StandardConstants as standard {
        /// alpha^2 of the highlight.
        alpha2: f32,
        /// F_0 of the highlight, times alpha^2 / (2 pi).
        f_0: Vec3,
        /// F_90 of the highlight, times alpha^2 / (2 pi).
        f_90: f32,
        /// alpha^2 of the coat.
        coat_alpha2: f32,
        /// F_0 of the coat, times its weight and alpha^2 / (2 pi).
        coat_0: f32,
        /// F_90 of the coat, times its weight and alpha^2 / (2 pi).
        coat_90: f32,
        /// The colour of the sheen, times its scale.
        sheen: Vec3,
        /// The sheen without its scale.
        charlie: CharlieConstants,
        /// The factor of w_L w_V.
        multiple: Vec3,
        /// The factor of t_L t_V.
        diffuse: Vec3,
        /// u, s, w and t at the nodes, which are equal steps of the cosine's root from 0 to 1.
        tables: Vec<Vec4>,
    }
}

impl Model for Standard {
    type Constants = StandardConstants;

    const NAME: &'static str = "standard";
    const SUMMARY: &'static str =
        "the material of glTF: a dielectric or a metal, with a coat, sheen or neither";
    const DETAILS: &'static str = "\
Start here: these are the parameters of glTF 2.0 and of most tools for artists. Light that the highlight
loses between facets is added to the body of the material, so that a white material is white at any
roughness. A file without `metallic` is a dielectric, such as plastic or varnished wood; in a glTF file
without `metallicFactor` the material is a metal, and is imported as one.";
    const PARAMETERS: &'static [Parameter] = &[
        BASE_COLOR,
        METALLIC,
        ROUGH,
        IOR,
        SPECULAR,
        SPECULAR_COLOR,
        CLEARCOAT,
        CLEARCOAT_ROUGHNESS,
        SHEEN,
        SHEEN_ROUGHNESS,
    ];

    fn from_values(values: &Values) -> Result<Self, ParameterError> {
        Self::new(StandardParameters {
            base_color: values.colour("base_color")?,
            metallic: values.number("metallic")?,
            roughness: values.number("roughness")?,
            ior: values.number("ior")?,
            specular: values.number("specular")?,
            specular_color: values.colour("specular_color")?,
            clearcoat: values.number("clearcoat")?,
            clearcoat_roughness: values.number("clearcoat_roughness")?,
            sheen: values.colour("sheen")?,
            sheen_roughness: values.number("sheen_roughness")?,
        })
    }

    fn values(&self) -> Values {
        let parameters = &self.parameters;
        Values::default()
            .with("base_color", Value::Colour(parameters.base_color))
            .with("metallic", Value::Number(parameters.metallic))
            .with("roughness", Value::Number(parameters.roughness))
            .with("ior", Value::Number(parameters.ior))
            .with("specular", Value::Number(parameters.specular))
            .with("specular_color", Value::Colour(parameters.specular_color))
            .with("clearcoat", Value::Number(parameters.clearcoat))
            .with("clearcoat_roughness", Value::Number(parameters.clearcoat_roughness))
            .with("sheen", Value::Colour(parameters.sheen))
            .with("sheen_roughness", Value::Number(parameters.sheen_roughness))
    }

    fn centre(&self) -> Centre {
        if self.part == Some(Part::Diffuse) { Centre::Normal } else { Centre::Reflection }
    }

    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let Some(half) = HalfVector::new(incident, outgoing) else { return [0.0; 3] };
        let formula = &*self.formula;
        let [of_light, of_view] = [half.light, half.view].map(|cosine| formula.tables.at(cosine));
        let grazing = math::powi((1.0 - half.facet()).max(0.0), 5);
        let coat = match formula.coat > 0.0 {
            true => formula.coat * (COAT + (1.0 - COAT) * grazing) * half.ggx(formula.coat_alpha2),
            false => 0.0,
        };
        let highlight = match self.part {
            Some(Part::Diffuse) => 0.0,
            _ => of_light[1].min(of_view[1]) * half.ggx(formula.alpha2),
        };
        let sheen = match formula.has_sheen() {
            true => {
                let brdf = formula.charlie.brdf(half.sin2(), half.light, half.view);
                of_light[0].min(of_view[0]) * brdf * half.light
            }
            false => 0.0,
        };
        let [several, matte] = [2, 3].map(|column| of_light[column] * of_view[column] * half.light);
        [0, 1, 2].map(|channel| {
            let fresnel = formula.f_0[channel] + (formula.f_90 - formula.f_0[channel]) * grazing;
            coat + highlight * fresnel
                + formula.sheen[channel] * sheen
                + formula.multiple[channel] * several
                + formula.diffuse[channel] * matte
        })
    }

    fn rho_hats(&self, pairs: &[[Direction; 2]], values: &mut [[f64; 3]]) {
        if self.formula.has_sheen() {
            return one_by_one(
                |incident, outgoing| self.rho_hat(incident, outgoing),
                pairs.iter().copied(),
                values,
            );
        }
        SimdLevel::detect().run(self.vectors(pairs, values));
    }

    fn rho_hats_toward(&self, outgoing: Direction, incident: &[Direction], values: &mut [[f64; 3]]) {
        if self.formula.has_sheen() {
            return one_by_one(
                |incident, outgoing| self.rho_hat(incident, outgoing),
                toward(outgoing, incident),
                values,
            );
        }
        SimdLevel::detect().run(self.vectors(Toward { outgoing, incident }, values));
    }

    fn constants(&self) -> StandardConstants {
        let formula = &*self.formula;
        let [peak, coat] =
            [(formula.alpha2, 1.0), (formula.coat_alpha2, formula.coat)].map(|(a2, w)| w * 0.5 * a2 / PI);
        StandardConstants {
            alpha2: formula.alpha2 as f32,
            f_0: packed::rgb(formula.f_0.map(|f_0| f_0 * peak)),
            f_90: (formula.f_90 * peak) as f32,
            coat_alpha2: formula.coat_alpha2 as f32,
            coat_0: (COAT * coat) as f32,
            coat_90: coat as f32,
            sheen: packed::rgb(formula.sheen.map(|sheen| sheen * formula.charlie.scale())),
            charlie: formula.charlie.constants(),
            multiple: packed::rgb(formula.multiple),
            diffuse: packed::rgb(formula.diffuse),
            tables: formula.tables.constants(),
        }
    }

    fn examples() -> Result<Vec<Self>, ParameterError> {
        // A coat and sheen over a mixture of metal and dielectric, in colours: every term at once.
        let coated = StandardParameters {
            base_color: [0.9, 0.5, 0.2],
            metallic: 0.6,
            roughness: 0.4,
            ior: 1.7,
            specular: 0.8,
            specular_color: [1.0, 0.7, 0.4],
            clearcoat: 0.7,
            clearcoat_roughness: 0.15,
            sheen: [0.3, 0.5, 0.1],
            sheen_roughness: 0.4,
        };
        Ok(vec![Self::new(coated)?, Self::new(StandardParameters::default())?])
    }

    fn lobes(&self) -> Vec<Lobe> {
        let highlights = [Some(self.parameters.roughness), self.coat_roughness()];
        let highlights =
            highlights.into_iter().flatten().map(|roughness| Lobe::facets([math::powi(roughness, 2); 2]));
        match self.part {
            None => highlights.chain([Lobe::Cosine]).collect(),
            Some(Part::Specular) => highlights.collect(),
            Some(Part::Diffuse) => vec![Lobe::Cosine],
        }
    }
}

impl Standard {
    /// The kernel of rho_hat without sheen for these pairs of directions.
    fn vectors<'a, P>(&'a self, pairs: P, values: &'a mut [[f64; 3]]) -> RhoHats<'a, P> {
        let &Formula { alpha2, f_0, f_90, coat_alpha2, coat, multiple, diffuse, ref tables, .. } =
            &*self.formula;
        let alpha2 = (self.part != Some(Part::Diffuse)).then_some(alpha2);
        let coat = (coat > 0.0).then_some(Coat { weight: coat, f_0: COAT, alpha2: coat_alpha2 });
        RhoHats { alpha2, f_0, f_90, coat, multiple, diffuse, tables, pairs, values }
    }

    fn coat_roughness(&self) -> Option<f64> {
        (self.parameters.clearcoat > 0.0).then_some(self.parameters.clearcoat_roughness)
    }
}

#[cfg(test)]
mod tests;
