//! Reflection models, one file each, and the list of them.

mod lambert;
mod parameter;
mod phong;

use sphere::Direction;

pub use lambert::Lambert;
pub use parameter::ParameterError;
pub use phong::Phong;

use crate::Centre;
use crate::clamped_cosine::ClampedCosine;

/// A material: one of the reflection models, with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// `model = "lambert"`.
    Lambert(Lambert),
    /// `model = "phong"`.
    Phong(Phong),
}

impl Material {
    /// The model's name in material files.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lambert(_) => Lambert::NAME,
            Self::Phong(_) => Phong::NAME,
        }
    }

    /// The direction that rho_hat is taken about.
    pub fn centre(&self) -> Centre {
        match self {
            Self::Lambert(_) => Lambert::CENTRE,
            Self::Phong(_) => Phong::CENTRE,
        }
    }

    /// rho_hat(w_i, w_o), the BRDF times the incident cosine, in 1/sr, RGB.
    ///
    /// Both directions are in the local frame whose +Z is the central direction ([`Material::centre`]). A
    /// radially symmetric model does not look at `outgoing`.
    pub fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        match self {
            Self::Lambert(model) => model.rho_hat(incident, outgoing),
            Self::Phong(model) => model.rho_hat(incident, outgoing),
        }
    }

    /// The lobe that rho_hat is. Both models so far are radially symmetric.
    pub(crate) fn lobe(&self) -> ClampedCosine {
        match self {
            Self::Lambert(model) => model.lobe(),
            Self::Phong(model) => model.lobe(),
        }
    }
}
