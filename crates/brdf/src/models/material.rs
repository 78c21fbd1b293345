//! A material: a reflection model, a measured table, or layers of materials.
//!
//! The rho_hat of `layers` is the sum of those of several materials. No layer absorbs the light of another:
//! the weights of the layers say how much each reflects, and a sum of albedos above 1 makes light. Layers
//! with the same centre keep it. A layer about the normal (lambert, oren-nayar) beside one about the
//! reflection vector is taken about the reflection vector too, which needs more degrees and changes no value.
//! A layer about the tangent has no common centre with others, because its rho_hat depends on the direction
//! of the tangent.

use sphere::{DVec3, Direction};

use super::lobe::Lobe;
use super::model::{Model, ModelText, one_by_one, toward};
use super::parameter::{ParameterError, Values};
use super::part::Part;
use crate::clamped_cosine::ClampedCosine;
use crate::coefficients::{Centre, SurfaceView};
use crate::measured::{Measured, MeasuredConstants};
use crate::measured_anisotropic::{MeasuredAnisotropic, MeasuredAnisotropicConstants};
use crate::packed::{Packed, Shape};

macro_rules! models {
    ($($module:ident::{$model:ident, $constants:ident}),* $(,)?) => {
        use super::{$($module::{$model, $constants}),*};

        /// A material: one of the reflection models, with its parameters, a table, or a sum of materials.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Material {
            $(#[doc = concat!("[`", stringify!($model), "`].")] $model($model),)*
            /// A table of measured values.
            Measured(Measured),
            /// A table of measured values that depend on the tangent.
            MeasuredAnisotropic(MeasuredAnisotropic),
            /// The sum of several materials, made by [`Material::layers`].
            Layers(Vec<Material>),
        }

        /// The constants of the formula of a material that is not a sum.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Constants {
            $(#[doc = concat!("The constants of [`", stringify!($model), "`].")] $model($constants),)*
            /// The constants of a table of measured values.
            Measured(MeasuredConstants),
            /// The constants of a table of measured values that depend on the tangent.
            MeasuredAnisotropic(MeasuredAnisotropicConstants),
        }

        impl Constants {
            /// The shapes of the packed constants, in the order of the variants.
            pub const SHAPES: &[Shape] =
                &[$($constants::SHAPE,)* MeasuredConstants::SHAPE, MeasuredAnisotropicConstants::SHAPE];

            /// Appends the words of the constants.
            pub fn pack(&self, words: &mut Vec<u32>) {
                match self {
                    $(Self::$model(constants) => constants.pack(words),)*
                    Self::Measured(constants) => constants.pack(words),
                    Self::MeasuredAnisotropic(constants) => constants.pack(words),
                }
            }
        }

        /// Every analytic model: its name, texts and parameters.
        pub const MODELS: &[ModelText] = &[
            $(ModelText {
                name: $model::NAME,
                summary: $model::SUMMARY,
                details: $model::DETAILS,
                parameters: $model::PARAMETERS,
            },)*
        ];

        impl Material {
            /// The analytic model of this name with these parameters; `None` if there is no such model.
            ///
            /// # Errors
            /// If a parameter is missing or out of its range.
            pub fn analytic(name: &str, values: &Values) -> Option<Result<Self, ParameterError>> {
                $(if name == $model::NAME {
                    return Some($model::from_values(values).map(Self::$model));
                })*
                None
            }

            /// The model's name in material files.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$model(_) => $model::NAME,)*
                    Self::Measured(_) => Measured::NAME,
                    Self::MeasuredAnisotropic(_) => MeasuredAnisotropic::NAME,
                    Self::Layers(_) => "layers",
                }
            }

            /// The model's parameters; none for layers, each of which has its own.
            pub fn values(&self) -> Values {
                match self {
                    $(Self::$model(model) => model.values(),)*
                    Self::Measured(measured) => measured.parameters(),
                    Self::MeasuredAnisotropic(measured) => measured.parameters(),
                    Self::Layers(_) => Values::default(),
                }
            }

            /// The direction that rho_hat is taken about.
            pub fn centre(&self) -> Centre {
                match self {
                    $(Self::$model(model) => model.centre(),)*
                    Self::Measured(measured) => measured.centre(),
                    Self::MeasuredAnisotropic(measured) => measured.centre(),
                    Self::Layers(layers) => common_centre(layers),
                }
            }

            /// rho_hat in the frame of the surface: see [`Model::rho_hat`].
            pub fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
                match self {
                    $(Self::$model(model) => model.rho_hat(incident, outgoing),)*
                    Self::Measured(measured) => measured.rho_hat(incident, outgoing),
                    Self::MeasuredAnisotropic(measured) => measured.rho_hat(incident, outgoing),
                    Self::Layers(layers) => sum(layers, incident, outgoing),
                }
            }

            /// [`Material::rho_hat`] of many pairs of the incident and the outgoing direction: the same
            /// values, faster.
            ///
            /// # Panics
            /// If there are not as many values as pairs.
            pub fn rho_hats(&self, pairs: &[[Direction; 2]], values: &mut [[f64; 3]]) {
                assert_eq!(pairs.len(), values.len(), "a value for each pair");
                match self {
                    $(Self::$model(model) => model.rho_hats(pairs, values),)*
                    Self::Measured(_) | Self::MeasuredAnisotropic(_) => {
                        let rho_hat = |incident, outgoing| self.rho_hat(incident, outgoing);
                        one_by_one(rho_hat, pairs.iter().copied(), values);
                    }
                    Self::Layers(layers) => {
                        values.fill([0.0; 3]);
                        let mut of_layer = vec![[0.0; 3]; values.len()];
                        for layer in layers {
                            layer.rho_hats(pairs, &mut of_layer);
                            for (sum, value) in values.iter_mut().zip(&of_layer) {
                                (0..3).for_each(|channel| sum[channel] += value[channel]);
                            }
                        }
                    }
                }
            }

            /// [`Material::rho_hat`] of light from many directions toward one view: the same values, faster.
            ///
            /// # Panics
            /// If there are not as many values as directions.
            pub fn rho_hats_toward(
                &self,
                outgoing: Direction,
                incident: &[Direction],
                values: &mut [[f64; 3]],
            ) {
                assert_eq!(incident.len(), values.len(), "a value for each direction");
                match self {
                    $(Self::$model(model) => model.rho_hats_toward(outgoing, incident, values),)*
                    Self::Measured(_) | Self::MeasuredAnisotropic(_) => {
                        let rho_hat = |incident, outgoing| self.rho_hat(incident, outgoing);
                        one_by_one(rho_hat, toward(outgoing, incident), values);
                    }
                    Self::Layers(layers) => {
                        values.fill([0.0; 3]);
                        let mut of_layer = vec![[0.0; 3]; values.len()];
                        for layer in layers {
                            layer.rho_hats_toward(outgoing, incident, &mut of_layer);
                            for (sum, value) in values.iter_mut().zip(&of_layer) {
                                (0..3).for_each(|channel| sum[channel] += value[channel]);
                            }
                        }
                    }
                }
            }

            /// Whether a turn about the normal changes nothing.
            pub fn is_isotropic(&self) -> bool {
                match self {
                    $(Self::$model(model) => model.is_isotropic(),)*
                    Self::Measured(_) => true,
                    Self::MeasuredAnisotropic(_) => false,
                    Self::Layers(layers) => layers.iter().all(Self::is_isotropic),
                }
            }

            /// Whether no light from below the horizon is reflected: see [`Model::has_horizon`].
            pub fn has_horizon(&self) -> bool {
                match self {
                    $(Self::$model(model) => model.has_horizon(),)*
                    Self::Measured(_) | Self::MeasuredAnisotropic(_) => true,
                    Self::Layers(layers) => layers.iter().all(Self::has_horizon),
                }
            }

            /// The constants of rho_hat's formula, for renderers: those of each of the
            /// [leaves](Self::leaves).
            pub fn constants(&self) -> Vec<Constants> {
                match self {
                    $(Self::$model(model) => vec![Constants::$model(model.constants())],)*
                    Self::Measured(measured) => vec![Constants::Measured(measured.constants())],
                    Self::MeasuredAnisotropic(measured) => {
                        vec![Constants::MeasuredAnisotropic(measured.constants())]
                    }
                    Self::Layers(layers) => layers.iter().flat_map(Self::constants).collect(),
                }
            }

            /// The [examples](Model::examples) of every model, in the order of [`MODELS`].
            ///
            /// # Errors
            /// The errors of [`Model::examples`].
            pub fn examples() -> Result<Vec<Self>, ParameterError> {
                let mut examples = Vec::new();
                $(examples.extend($model::examples()?.into_iter().map(Self::$model));)*
                Ok(examples)
            }

            /// The lobes that a renderer samples in place of rho_hat, each once.
            pub fn lobes(&self) -> Vec<Lobe> {
                let lobes: Vec<Lobe> = match self {
                    $(Self::$model(model) => model.lobes(),)*
                    Self::Measured(measured) => measured.lobes(),
                    Self::MeasuredAnisotropic(measured) => measured.lobes(),
                    Self::Layers(layers) if layers.is_empty() => vec![Lobe::Cosine],
                    Self::Layers(layers) => layers.iter().flat_map(Self::lobes).collect(),
                };
                let is_first = |(k, lobe): &(usize, &Lobe)| !lobes[..*k].contains(lobe);
                lobes.iter().enumerate().filter(is_first).map(|(_, lobe)| *lobe).collect()
            }

            /// The closed form of a radially symmetric model.
            pub(crate) fn radial(&self) -> Option<ClampedCosine> {
                match self {
                    $(Self::$model(model) => model.radial(),)*
                    Self::Layers(layers) => match layers.as_slice() {
                        [layer] => layer.radial(),
                        _ => None,
                    },
                    Self::Measured(_) | Self::MeasuredAnisotropic(_) => None,
                }
            }
        }
    };
}

for_each_model!(models);

/// Why materials cannot be layers of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayersError {
    /// There is no layer.
    #[error("there is no layer; expected one or more")]
    None,
    /// One material is taken about the tangent, another is not.
    #[error(
        "{tangent} is taken about the tangent and {other} is not: they have no common centre; expected layers of \
         {tangent} alone, or none"
    )]
    Centres {
        /// The model that is taken about the tangent.
        tangent: &'static str,
        /// A model that is not taken about the tangent.
        other: &'static str,
    },
}

impl Material {
    /// The sum of several materials.
    ///
    /// # Errors
    /// If there is no layer, or one is taken about the tangent and another is not.
    pub fn layers(layers: Vec<Self>) -> Result<Self, LayersError> {
        let (tangent, others): (Vec<_>, Vec<_>) =
            layers.iter().partition(|layer| layer.centre() == Centre::Tangent);
        match (tangent.first(), others.first()) {
            (None, None) => Err(LayersError::None),
            (Some(tangent), Some(other)) => {
                Err(LayersError::Centres { tangent: tangent.name(), other: other.name() })
            }
            _ => Ok(Self::Layers(layers)),
        }
    }

    /// The layers in order, with those of nested layers; a material that is not a sum is its own only layer.
    pub fn leaves(&self) -> Vec<&Self> {
        match self {
            Self::Layers(layers) => layers.iter().flat_map(Self::leaves).collect(),
            leaf => vec![leaf],
        }
    }

    /// Whether mirrors along the tangent, and across it, change nothing: true of all but measured tables that
    /// depend on the tangent.
    pub fn is_orthotropic(&self) -> bool {
        match self {
            Self::MeasuredAnisotropic(_) => false,
            Self::Layers(layers) => layers.iter().all(Self::is_orthotropic),
            _ => true,
        }
    }

    /// The sum of the layers, and parts of layers, that belong to a part; `None` if there are none. The sum
    /// of both parts is the material.
    pub fn part(&self, part: Part) -> Option<Self> {
        let leaf = |leaf: &Self| match leaf {
            Self::Standard(standard) => standard.parts().into_iter().map(Self::Standard).collect(),
            other => vec![other.clone()],
        };
        let mut parts: Vec<Self> = self.leaves().into_iter().flat_map(leaf).collect();
        parts.retain(|leaf| (leaf.centre() == Centre::Normal) == (part == Part::Diffuse));
        match parts.len() {
            0 => None,
            1 => parts.pop(),
            _ => Some(Self::Layers(parts)),
        }
    }

    /// Returns the diffuse and the specular part ([`Material::part`]) of a material that has two centres;
    /// their sum is the material. What the facets of a bare metal of `standard` reflect several times makes
    /// no diffuse part by itself: engines add it to the highlight.
    pub fn split(&self) -> Option<[Self; 2]> {
        let is_matte = |leaf: &Self| match leaf {
            Self::Standard(standard) => standard.has_body(),
            other => other.centre() == Centre::Normal,
        };
        self.leaves().into_iter().any(is_matte).then_some(())?;
        Some([self.part(Part::Diffuse)?, self.part(Part::Specular)?])
    }

    /// The width of the material's narrowest highlight in the light's directions: about the standard
    /// deviation of a bell, in radians, at most 1.
    pub fn highlight_width(&self) -> f64 {
        let width = |lobe: &Lobe| match *lobe {
            Lobe::Cosine => 1.0,
            Lobe::Power { n, .. } => (1.0 + f64::from(n)).sqrt().recip(),
            // A facet turns the reflection by twice its own angle; GGX falls as 1 - 2 tan^2 / alpha^2.
            Lobe::Facets { x, y } => f64::from(x.min(y)),
            Lobe::Band { width } => f64::from(width),
        };
        self.lobes().iter().map(width).fold(1.0, f64::min)
    }

    /// rho_hat in the mean over all turns of the surface about its normal: what a map shows, which is looked
    /// up without the tangent. `turns` is [`Material::turns`]; with one it is [`Material::rho_hat`].
    pub fn mean_over_turns(&self, turns: usize, incident: Direction, outgoing: Direction) -> [f64; 3] {
        if turns == 1 {
            return self.rho_hat(incident, outgoing);
        }
        let mut sum = [0.0; 3];
        for turn in 0..turns {
            let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * turn as f64 / turns as f64);
            let [incident, outgoing] = [incident, outgoing].map(|direction| {
                let v = direction.vector();
                Direction::from_unit(DVec3::new(cosine * v.x - sine * v.y, sine * v.x + cosine * v.y, v.z))
            });
            let value = self.rho_hat(incident, outgoing);
            (0..3).for_each(|channel| sum[channel] += value[channel] / turns as f64);
        }
        sum
    }

    /// [`Material::mean_over_turns`] of light from many directions toward one view: the same values, faster.
    ///
    /// # Panics
    /// If there are not as many values as directions.
    pub fn means_over_turns(
        &self,
        turns: usize,
        outgoing: Direction,
        incident: &[Direction],
        values: &mut [[f64; 3]],
    ) {
        if turns == 1 {
            return self.rho_hats_toward(outgoing, incident, values);
        }
        assert_eq!(incident.len(), values.len(), "a value for each direction");
        let mean = |incident, outgoing| self.mean_over_turns(turns, incident, outgoing);
        one_by_one(mean, toward(outgoing, incident), values);
    }

    /// [`Material::mean_over_turns`] toward each of these views, of light from one direction in the frame of
    /// the central direction.
    pub fn means_toward(&self, turns: usize, views: &[SurfaceView], incident: Direction) -> Vec<[f64; 3]> {
        let pairs: Vec<_> = views.iter().map(|view| [view.incident(incident), view.outgoing()]).collect();
        let mut values = vec![[0.0; 3]; pairs.len()];
        if turns == 1 {
            self.rho_hats(&pairs, &mut values);
        } else {
            let mean = |incident, outgoing| self.mean_over_turns(turns, incident, outgoing);
            one_by_one(mean, pairs, &mut values);
        }
        values
    }

    /// The turns of [`Material::mean_over_turns`]: the more, the longer the highlight is for its width. An
    /// isotropic material, and one about the tangent, needs one. The number is odd, so that a material that
    /// is the same after half a turn is sampled at twice as many. Test: within 1e-3 of the peak for
    /// highlights up to ten times as long as wide.
    pub fn turns(&self) -> usize {
        if self.is_isotropic() || self.centre() == Centre::Tangent {
            return 1;
        }
        let ratio = |lobe: &Lobe| match *lobe {
            Lobe::Facets { x, y } => f64::from(x.min(y) / x.max(y)),
            _ => 1.0,
        };
        let ratio = self.lobes().iter().map(ratio).fold(1.0, f64::min);
        2 * ((2.5 / ratio).ceil() as usize).clamp(9, 60) + 1
    }

    /// rho_hat(w_i, w_o), the BRDF times the incident cosine, in 1/sr, RGB.
    ///
    /// Both directions are in the local frame whose +Z is the central direction ([`Material::centre`]); see
    /// [`Centre::surface`] for the place of the normal. `outgoing` may be any direction.
    pub fn rho_hat_about_centre(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let [incident, outgoing] = self.centre().surface(incident, outgoing);
        self.rho_hat(incident, outgoing)
    }
}

/// The common centre, or the reflection vector if they differ.
fn common_centre(layers: &[Material]) -> Centre {
    // Each is called once: two calls would double the work with every layer in a layer.
    let mut centres = layers.iter().map(Material::centre);
    let first = centres.next().unwrap_or(Centre::Normal);
    if centres.all(|centre| centre == first) { first } else { Centre::Reflection }
}

fn sum(layers: &[Material], incident: Direction, outgoing: Direction) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for layer in layers {
        let value = layer.rho_hat(incident, outgoing);
        (0..3).for_each(|channel| sum[channel] += value[channel]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{KajiyaKay, Lambert, Phong};

    fn lambert() -> Material {
        Material::Lambert(Lambert::new([0.5, 0.25, 0.0]).unwrap())
    }

    fn phong() -> Material {
        Material::Phong(Phong::new(4.0, [0.5; 3]).unwrap())
    }

    fn hair() -> Material {
        Material::KajiyaKay(KajiyaKay::new(4.0, [0.5; 3]).unwrap())
    }

    #[test]
    fn one_common_centre_is_kept() {
        let centre = |layers| Material::layers(layers).unwrap().centre();
        assert_eq!(centre(vec![lambert(), lambert()]), Centre::Normal);
        assert_eq!(centre(vec![phong(), phong()]), Centre::Reflection);
        assert_eq!(centre(vec![hair(), hair()]), Centre::Tangent);
        assert_eq!(centre(vec![lambert(), phong()]), Centre::Reflection);
        let nested = Material::layers(vec![lambert(), lambert()]).unwrap();
        assert_eq!(centre(vec![nested, lambert()]), Centre::Normal);
    }

    #[test]
    fn the_parts_of_a_material_sum_to_it() {
        let plastic = Standard::new(crate::StandardParameters { sheen: [0.2; 3], ..Default::default() });
        let whole = Material::layers(vec![
            lambert(),
            phong(),
            Material::layers(vec![Material::Standard(plastic.unwrap()), lambert()]).unwrap(),
        ])
        .unwrap();
        let [diffuse, specular] = [Part::Diffuse, Part::Specular].map(|part| whole.part(part).unwrap());
        assert_eq!((diffuse.centre(), specular.centre()), (Centre::Normal, Centre::Reflection));
        assert_eq!((diffuse.leaves().len(), specular.leaves().len()), (3, 2));
        for k in 0..40 {
            let incident = Direction::from_angles(0.05 * f64::from(k), 1.3 * f64::from(k));
            let outgoing = Direction::from_angles(1.5 - 0.03 * f64::from(k), 0.2);
            let [a, b, sum] =
                [&diffuse, &specular, &whole].map(|material| material.rho_hat(incident, outgoing));
            assert!(
                (0..3).all(|c| (a[c] + b[c] - sum[c]).abs() <= 1e-13 * sum[c]),
                "{k}: {a:?} {b:?} {sum:?}"
            );
        }
        assert_eq!((lambert().part(Part::Specular), lambert().part(Part::Diffuse)), (None, Some(lambert())));
        assert_eq!((hair().part(Part::Specular), hair().part(Part::Diffuse)), (Some(hair()), None));
        // The parts of a part are itself.
        assert_eq!(specular.part(Part::Specular), Some(specular.clone()));
        assert_eq!(specular.part(Part::Diffuse), None);
    }

    /// Each layer is visited once: with two visits, 64 nested layers would never finish.
    #[test]
    fn layers_in_layers_cost_no_more_than_their_number() {
        let deep = (0..64).fold(lambert(), |layer, _| Material::layers(vec![layer]).unwrap());
        assert_eq!((deep.centre(), deep.is_isotropic()), (Centre::Normal, true));
    }

    #[test]
    fn layers_without_a_common_centre_are_an_error() {
        let error = Material::layers(vec![phong(), hair()]).unwrap_err();
        assert_eq!(error, LayersError::Centres { tangent: "kajiya-kay", other: "phong" });
        assert_eq!(Material::layers(Vec::new()), Err(LayersError::None));
    }

    #[test]
    fn a_horizon_hides_all_light_below_it() {
        for material in Material::examples().unwrap() {
            let mut seen = 0;
            for index in 0..500 {
                let part = |step: f64| (0.5 + f64::from(index) * step).fract();
                let below = -part(0.754_877).max(1e-9);
                let incident = Direction::from_angles(math::acos(below), 6.3 * part(0.569_84));
                let outgoing = Direction::from_angles(1.5 * part(0.672_1), 6.3 * part(0.331_7));
                seen += u32::from(material.rho_hat(incident, outgoing) != [0.0; 3]);
            }
            assert_eq!(seen == 0, material.has_horizon(), "{}: {seen}", material.name());
        }
    }

    /// The centre of the layers does not change the value for a light and a view in the world.
    #[test]
    fn layers_are_summed_in_the_frame_of_the_surface() {
        let both = Material::layers(vec![lambert(), phong()]).unwrap();
        for i in 0..40 {
            let i = f64::from(i);
            let incident = Direction::from_angles((i * 0.618).fract() * 3.0, i);
            let outgoing = Direction::from_angles((i * 0.414).fract() * 1.5, 2.0 * i);
            let parts = [lambert(), phong()].map(|layer| layer.rho_hat(incident, outgoing));
            let sum = [0, 1, 2].map(|channel| parts[0][channel] + parts[1][channel]);
            assert_eq!(both.rho_hat(incident, outgoing), sum);
        }
        assert_eq!(Material::Layers(Vec::new()).rho_hat(Direction::Z, Direction::Z), [0.0; 3]);
    }
}
