//! Reflection models, one file each, and the list of them.

mod ashikhmin_shirley;
mod blinn_phong;
mod facets;
mod fresnel;
mod ggx;
mod kajiya_kay;
mod lafortune;
mod lambert;
mod layers;
mod lobe;
mod microfacet;
mod oren_nayar;
mod parameter;
mod phong;
#[cfg(test)]
mod tests;
mod torrance_sparrow;
mod ward;

use sphere::Direction;

pub use fresnel::Fresnel;
pub use lafortune::LafortuneLobe;
pub use layers::LayersError;
pub use lobe::Lobe;
pub(crate) use parameter::colour;
pub use parameter::{Absent, Parameter, ParameterError, Range, Value, ValueType, Values, WEIGHT};

use crate::clamped_cosine::ClampedCosine;
use crate::{Centre, Measured};

/// Calls a macro with the list of the analytic models, each as `its_module::ItsType`.
///
/// This is the one list of them. What needs an entry for every model makes it from here: [`Material`], [`MODELS`], and
/// the formulas of a renderer.
#[macro_export]
macro_rules! for_each_model {
    ($callback:ident) => {
        $callback! {
            lambert::Lambert,
            oren_nayar::OrenNayar,
            phong::Phong,
            blinn_phong::BlinnPhong,
            microfacet::Microfacet,
            torrance_sparrow::TorranceSparrow,
            ggx::Ggx,
            ward::Ward,
            ashikhmin_shirley::AshikhminShirley,
            lafortune::Lafortune,
            kajiya_kay::KajiyaKay,
        }
    };
}

/// A reflection model: what its file says about it.
pub trait Model: Clone + std::fmt::Debug + PartialEq {
    /// The name in material files.
    const NAME: &'static str;
    /// What it is in one line, for the manual.
    const SUMMARY: &'static str;
    /// Its parameters.
    const PARAMETERS: &'static [Parameter];

    /// The model with these parameters.
    ///
    /// # Errors
    /// Where a parameter has a value that no material can have; the error names it.
    fn from_values(values: &Values) -> Result<Self, ParameterError>;

    /// Its parameters: what [`Model::from_values`] makes the same model of.
    fn values(&self) -> Values;

    /// The direction that rho_hat is taken about.
    fn centre(&self) -> Centre {
        Centre::Reflection
    }

    /// rho_hat, the BRDF times the incident cosine, in 1/sr, RGB. Finite for any two directions.
    ///
    /// Both directions point away from the surface, in its frame: +Z the normal, +X the tangent. What lies below the
    /// horizon (`incident` with z <= 0) is not reflected, except in models whose text says otherwise (phong,
    /// kajiya-kay). `outgoing` has z >= 0.
    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3];

    /// Whether a turn about the normal (of surface, light and view together) changes nothing.
    fn is_isotropic(&self) -> bool {
        true
    }

    /// The constants of rho_hat's formula, for renderers: they depend on the parameters alone.
    fn constants(&self) -> Vec<f64>;

    /// The lobes that a renderer samples in place of rho_hat: one or more.
    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::Cosine]
    }

    /// The closed form of a radially symmetric model, whose rho_hat depends on the angle between the incident and the
    /// central direction alone.
    fn radial(&self) -> Option<ClampedCosine> {
        None
    }
}

macro_rules! models {
    ($($module:ident::$model:ident),* $(,)?) => {
        $(pub use $module::$model;)*

        /// A material: one of the reflection models, with its parameters, a table, or a sum of materials.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Material {
            $(#[doc = concat!("[`", stringify!($model), "`].")] $model($model),)*
            /// A table of measured values.
            Measured(Measured),
            /// The sum of several: see [`Material::layers`], which makes it.
            Layers(Vec<Material>),
        }

        /// Every analytic model: its name, summary and parameters.
        pub const MODELS: &[ModelText] = &[
            $(ModelText { name: $model::NAME, summary: $model::SUMMARY, parameters: $model::PARAMETERS },)*
        ];

        impl Material {
            /// The analytic model of this name with these parameters; `None` where there is no such model.
            ///
            /// # Errors
            /// Where a parameter has a value that no material can have.
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
                    Self::Layers(_) => "layers",
                }
            }

            /// The model's parameters; none of layers, which have their own.
            pub fn values(&self) -> Values {
                match self {
                    $(Self::$model(model) => model.values(),)*
                    Self::Measured(measured) => measured.parameters(),
                    Self::Layers(_) => Values::default(),
                }
            }

            /// The direction that rho_hat is taken about.
            pub fn centre(&self) -> Centre {
                match self {
                    $(Self::$model(model) => model.centre(),)*
                    Self::Measured(measured) => measured.centre(),
                    Self::Layers(layers) => layers::centre(layers),
                }
            }

            /// rho_hat in the frame of the surface: see [`Model::rho_hat`].
            pub fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
                match self {
                    $(Self::$model(model) => model.rho_hat(incident, outgoing),)*
                    Self::Measured(measured) => measured.rho_hat(incident, outgoing),
                    Self::Layers(layers) => layers::rho_hat(layers, incident, outgoing),
                }
            }

            /// Whether a turn about the normal changes nothing.
            pub fn is_isotropic(&self) -> bool {
                match self {
                    $(Self::$model(model) => model.is_isotropic(),)*
                    Self::Measured(_) => true,
                    Self::Layers(layers) => layers.iter().all(Self::is_isotropic),
                }
            }

            /// The constants of rho_hat's formula, for renderers: see each model's file. Those of a measured table are
            /// its shape, its scale and its values; those of layers follow each other.
            pub fn constants(&self) -> Vec<f32> {
                match self {
                    $(Self::$model(model) => model.constants().into_iter().map(|value| value as f32).collect(),)*
                    Self::Measured(measured) => measured.constants(),
                    Self::Layers(layers) => layers.iter().flat_map(Self::constants).collect(),
                }
            }

            /// The lobes that a renderer samples in place of rho_hat, each once.
            pub fn lobes(&self) -> Vec<Lobe> {
                match self {
                    $(Self::$model(model) => model.lobes(),)*
                    Self::Measured(measured) => measured.lobes(),
                    Self::Layers(layers) => layers::lobes(layers),
                }
            }

            /// The closed form of a radially symmetric model.
            pub(crate) fn radial(&self) -> Option<ClampedCosine> {
                match self {
                    $(Self::$model(model) => model.radial(),)*
                    Self::Layers(layers) => match layers.as_slice() {
                        [layer] => layer.radial(),
                        _ => None,
                    },
                    Self::Measured(_) => None,
                }
            }
        }
    };
}

for_each_model!(models);

/// What the manual says about a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelText {
    /// Its name in material files.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
}

impl Material {
    /// rho_hat(w_i, w_o), the BRDF times the incident cosine, in 1/sr, RGB.
    ///
    /// Both directions are in the local frame whose +Z is the central direction ([`Material::centre`]); see
    /// [`Centre::surface`] for where the normal is. `outgoing` may be any direction.
    pub fn rho_hat_about_centre(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let [incident, outgoing] = self.centre().surface(incident, outgoing);
        self.rho_hat(incident, outgoing)
    }
}
