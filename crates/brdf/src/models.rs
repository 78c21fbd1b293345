//! Reflection models, one file each, and the list of them.

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// Calls a macro with the list of the analytic models, each as `its_module::{ItsType, ItsConstants}`.
///
/// This is the one list of them. What needs an entry for every model makes it from here: [`Material`],
/// [`MODELS`], and the formulas of a renderer.
#[macro_export]
macro_rules! for_each_model {
    ($callback:ident) => {
        $callback! {
            standard::{Standard, StandardConstants},
            lambert::{Lambert, LambertConstants},
            oren_nayar::{OrenNayar, OrenNayarConstants},
            phong::{Phong, PhongConstants},
            blinn_phong::{BlinnPhong, BlinnPhongConstants},
            microfacet::{Microfacet, MicrofacetConstants},
            torrance_sparrow::{TorranceSparrow, TorranceSparrowConstants},
            ggx::{Ggx, GgxConstants},
            ward::{Ward, WardConstants},
            ashikhmin_shirley::{AshikhminShirley, AshikhminShirleyConstants},
            poulin_fournier::{PoulinFournier, PoulinFournierConstants},
            lafortune::{Lafortune, LafortuneConstants},
            kajiya_kay::{KajiyaKay, KajiyaKayConstants},
        }
    };
}

mod ashikhmin_shirley;
mod base_color_response;
mod blinn_phong;
mod charlie;
mod directional_albedo;
mod facets;
mod fresnel;
mod ggx;
mod kajiya_kay;
mod lafortune;
mod lambert;
mod light_sum;
mod lobe;
mod lobe_sampling;
mod material;
mod microfacet;
mod model;
mod oren_nayar;
mod parameter;
mod part;
mod phong;
mod poulin_fournier;
mod standard;
#[cfg(test)]
pub(crate) mod tests;
mod torrance_sparrow;
mod ward;

pub use base_color_response::{BaseColorResponse, ResponseNode};
pub use charlie::CharlieConstants;
pub use fresnel::{Fresnel, FresnelConstants};
pub use lafortune::{LafortuneLobe, LafortuneLobeConstants};
pub use light_sum::LightSum;
pub use lobe::Lobe;
pub use material::{Constants, LayersError, MODELS, Material};
pub use model::{Model, ModelText};
pub(crate) use parameter::colour;
pub use parameter::{Absent, Parameter, ParameterError, Range, Value, ValueType, Values, WEIGHT};
pub use part::Part;
pub use standard::StandardParameters;

macro_rules! reexport {
    ($($module:ident::{$model:ident, $constants:ident}),* $(,)?) => {
        $(pub use $module::{$model, $constants};)*
    };
}
for_each_model!(reexport);
