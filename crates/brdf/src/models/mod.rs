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
mod microfacet;
mod oren_nayar;
mod parameter;
mod phong;
#[cfg(test)]
mod tests;
mod torrance_sparrow;
mod ward;

use sphere::Direction;

pub use ashikhmin_shirley::AshikhminShirley;
pub use blinn_phong::BlinnPhong;
pub use fresnel::Fresnel;
pub use ggx::Ggx;
pub use kajiya_kay::KajiyaKay;
pub use lafortune::{Lafortune, LafortuneLobe};
pub use lambert::Lambert;
pub use layers::LayersError;
pub use microfacet::Microfacet;
pub use oren_nayar::OrenNayar;
pub(crate) use parameter::colour;
pub use parameter::{Absent, Parameter, ParameterError, Range, Shape, Value, Values, WEIGHT};
pub use phong::Phong;
pub use torrance_sparrow::TorranceSparrow;
pub use ward::Ward;

use crate::clamped_cosine::ClampedCosine;
use crate::{Centre, Measured};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own revision.
pub const REVISION: u32 = 0;

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

    /// Where rho_hat depends on the angle between incident and central direction alone: its closed form.
    fn radial(&self) -> Option<ClampedCosine> {
        None
    }
}

/// Makes the enum of all models out of their list.
macro_rules! models {
    ($($model:ident),* $(,)?) => {
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

models!(
    Lambert,
    OrenNayar,
    Phong,
    BlinnPhong,
    Microfacet,
    TorranceSparrow,
    Ggx,
    Ward,
    AshikhminShirley,
    Lafortune,
    KajiyaKay,
);

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
