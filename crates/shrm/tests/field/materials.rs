//! Made-up lightings and materials.

use brdf::{BrdfCoefficients, Centre};
use sh::{Degree, Expansion};
use shrm::Reflection;

/// Repeatable numbers in [-1, 1).
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(crate) fn rgb(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.next())
    }
}

pub(crate) fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// Coefficients of size 1 / (l + 1) everywhere.
pub(crate) fn lighting(f: usize, seed: u64) -> Expansion {
    let mut noise = Noise::new(seed);
    let mut sky = Expansion::zero(degree(f));
    for l in 0..=f {
        for row in &mut sky.coefficients_mut()[l * l..(l + 1) * (l + 1)] {
            *row = noise.rgb().map(|v| v / (l + 1) as f64);
        }
    }
    sky
}

/// A tensor of noise, falling with l and p, zero if q > min(l, p); only q = 0 if `azimuth` is false.
pub(crate) fn tensor(f: usize, p: usize, azimuth: bool, seed: u64) -> BrdfCoefficients {
    let mut noise = Noise::new(seed);
    let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
    for l in 0..=f {
        for p_ in 0..=p {
            for q in 0..=p_.min(l) {
                let value = noise.rgb().map(|v| v / ((l + 1) * (p_ + 1)) as f64);
                if q == 0 || azimuth {
                    rho[(l * (p + 1) + p_) * (p + 1) + q] = value;
                }
            }
        }
    }
    BrdfCoefficients::new(Centre::Reflection, degree(f), degree(p), rho).unwrap()
}

pub(crate) fn reflection(f: usize, p: usize, azimuth: bool) -> Reflection {
    let seed = (100 * f + p) as u64 + 1;
    Reflection::convolve(&lighting(f, seed), &tensor(f, p, azimuth, seed + 7))
}
