//! The reflected light field B in spherical harmonics: lighting times BRDF (paper 1, equation 7).

use brdf::BrdfCoefficients;
use sh::Expansion;

/// B_lmpq = L_lm rho_lpq, held as its two factors, both cut to the smaller degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflection {
    lighting: Expansion,
    brdf: BrdfCoefficients,
}

impl Reflection {
    /// The lighting's coefficients, L_lm.
    pub fn lighting(&self) -> &Expansion {
        &self.lighting
    }

    /// The BRDF's coefficients, rho_lpq.
    pub fn brdf(&self) -> &BrdfCoefficients {
        &self.brdf
    }
}
