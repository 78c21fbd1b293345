//! Prefiltered environments: the radiance that an engine's rough mirror reflects, with V = N = R.
//!
//! Real-time engines look up one mean of the light per roughness,
//!
//! > F(N) = integral of L(w) K(N.w) dw / integral of K(N.w) dw,
//!
//! with a = roughness^2 and mu = N.w > 0 (below the horizon K is 0):
//!
//! | distribution | K(mu) |
//! | --- | --- |
//! | GGX | mu / (1 + a^2 - (1 - a^2) mu)^2 |
//! | Charlie | mu ((1 - mu) / 2)^(1 / (2 a)) |
//! | Lambert | mu |
//!
//! K is what importance sampling of half vectors about N, with weights N.L, converges to (Karis 2013, "Real
//! Shading in Unreal Engine 4"; for Charlie, Estevez and Kulla 2017). At a = 1 GGX is Lambert. All are zonal,
//! so that prefiltering is a convolution, F_lm = k_l L_lm [RH02, eq. 5]: see [`PrefilterKernel::factors`].
//!
//! [`prefilter_series`] does it on coefficients. It is exact but for what L holds past its degree F, where
//! k_l is small enough if F is [`PrefilterKernel::degree`]. [`LightBlocks`] sums over blocks of texels
//! instead, for lobes that are sharper than any degree the light has.

mod blocks;
mod levels;
mod series;
mod zonal;

pub use blocks::LightBlocks;
pub use levels::{LevelMethod, MethodChoice, PrefilterError, Prefiltered, PrefilteredLevel, prefilter};
pub use series::prefilter_series;

use sh::Expansion;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 3;

/// The lobe of a prefilter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Distribution {
    /// The lobe of Trowbridge and Reitz: metals and plastics.
    #[default]
    Ggx,
    /// The inverted Gaussian: cloth.
    Charlie,
    /// The cosine: irradiance divided by pi.
    Lambert,
}

/// A roughness that is not in (0, 1].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("roughness {0} has no prefilter: expected more than 0 and at most 1")]
pub struct RoughnessOutOfRange(pub f64);

/// K(mu) of one distribution and roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrefilterKernel {
    distribution: Distribution,
    alpha: f64,
}

/// From this roughness on the kink at the horizon asks for at least [`HORIZON_DEGREE`].
const HORIZON_ROUGHNESS: f64 = 0.7;

/// The degree that the kink of a cosine at the horizon needs: its |k_l| is below 1e-4 from here on.
const HORIZON_DEGREE: usize = 74;

impl PrefilterKernel {
    /// The sharpest lobe, which is narrower than a texel of any map.
    pub const LEAST_ROUGHNESS: f64 = 0.01;

    /// The kernel of a roughness; Lambert has none and ignores it.
    ///
    /// # Errors
    /// If the roughness is not in (0, 1]. Those below [`PrefilterKernel::LEAST_ROUGHNESS`] become it.
    pub fn new(distribution: Distribution, roughness: f64) -> Result<Self, RoughnessOutOfRange> {
        let is_known = distribution == Distribution::Lambert || (roughness > 0.0 && roughness <= 1.0);
        let roughness = if distribution == Distribution::Lambert { 1.0 } else { roughness };
        let alpha = math::powi(roughness.max(Self::LEAST_ROUGHNESS), 2);
        is_known.then_some(Self { distribution, alpha }).ok_or(RoughnessOutOfRange(roughness))
    }

    /// The distribution.
    pub fn distribution(&self) -> Distribution {
        self.distribution
    }

    /// The square of the roughness.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// K at the cosine `mu`, up to a constant factor: at most about 1.
    pub fn weight(&self, mu: f64) -> f64 {
        if mu <= 0.0 {
            return 0.0;
        }
        match self.distribution {
            Distribution::Ggx => {
                // 1 + a^2 - (1 - a^2) mu, without cancellation; 2 a^2 at the centre.
                let squared = self.alpha * self.alpha;
                let denominator = (1.0 - mu) + squared * (1.0 + mu);
                mu * math::powi(2.0 * squared / denominator, 2)
            }
            // ((1 - mu) / 2)^e is largest at the horizon, where it is 2^-e.
            Distribution::Charlie => mu * math::pow((1.0 - mu).max(0.0), 0.5 / self.alpha),
            Distribution::Lambert => mu,
        }
    }

    /// The Laplacian of [`PrefilterKernel::weight`] on the sphere, above the horizon:
    /// d/dmu ((1 - mu^2) dK/dmu).
    fn laplacian(&self, mu: f64) -> f64 {
        if mu <= 0.0 {
            return 0.0;
        }
        let (slope, curvature) = match self.distribution {
            Distribution::Ggx => {
                let squared = self.alpha * self.alpha;
                let (sum, difference) = (1.0 + squared, 1.0 - squared);
                let denominator = (1.0 - mu) + squared * (1.0 + mu);
                let scale = math::powi(2.0 * squared / denominator, 2);
                (
                    scale * (sum + difference * mu) / denominator,
                    scale * difference * (4.0 * sum + 2.0 * difference * mu) / math::powi(denominator, 2),
                )
            }
            Distribution::Charlie => {
                let (exponent, down) = (0.5 / self.alpha, (1.0 - mu).max(1e-6));
                (
                    math::pow(down, exponent - 1.0) * (down - exponent * mu),
                    math::pow(down, exponent - 2.0) * exponent * ((exponent - 1.0) * mu - 2.0 * down),
                )
            }
            Distribution::Lambert => (1.0, 0.0),
        };
        (1.0 - mu * mu) * curvature - 2.0 * mu * slope
    }

    /// The degree that the light has to hold for a prefilter by [`prefilter_series`].
    ///
    /// GGX: ceil(5 / a), and at least 74 from roughness 0.7 on because of the horizon's kink. Under a
    /// photographed sun, 188,000 times as bright as the mean, what is cut is then below 6e-4 (RMS) and 9e-4
    /// (maximum) of the peak for roughness 0.15 to 0.55. Charlie: 5/4 of the degree past which |k_l| < 1e-3,
    /// which for GGX is the same rule. Lambert: 74.
    pub fn degree(&self) -> usize {
        let is_rough = self.alpha >= HORIZON_ROUGHNESS * HORIZON_ROUGHNESS;
        match self.distribution {
            Distribution::Lambert => HORIZON_DEGREE,
            Distribution::Ggx => {
                let needed = (5.0 / self.alpha).ceil() as usize;
                if is_rough { needed.max(HORIZON_DEGREE) } else { needed }
            }
            Distribution::Charlie => {
                // The lobe is a ring at the horizon, 2 a wide or, for large a, about 1.
                let factors = self.factors((20.0 / self.alpha).ceil() as usize + HORIZON_DEGREE);
                let past = factors.iter().rposition(|k| k.abs() >= 1e-3).unwrap_or(0) + 1;
                let needed = (1.25 * past as f64).ceil() as usize;
                if is_rough { needed.max(HORIZON_DEGREE) } else { needed }
            }
        }
    }

    /// k_l for l = 0 ..= `degree`: k_l = integral of K P_l dmu / integral of K dmu over (0, 1); k_0 = 1.
    ///
    /// By Gauss-Legendre quadrature over panels that resolve the lobe and P_l; accurate to 1e-13
    /// (compared with values made without this code, and with ten times the panels to degree 2000).
    ///
    /// # Example: at roughness 1 GGX is a cosine, whose k_1 is 2/3 and k_2 is 1/4
    /// ```
    /// let k = shrm::PrefilterKernel::new(shrm::Distribution::Ggx, 1.0)?.factors(3);
    /// assert!((k[1] - 2.0 / 3.0).abs() < 1e-14 && (k[2] - 0.25).abs() < 1e-14 && k[3].abs() < 1e-14);
    /// # Ok::<(), shrm::RoughnessOutOfRange>(())
    /// ```
    pub fn factors(&self, degree: usize) -> Vec<f64> {
        zonal::factors(self, degree)
    }

    /// The prefilter of a series, F_lm = k_l L_lm, in all of its degrees.
    ///
    /// # Example: the mean stays
    /// ```
    /// let sky = sh::Expansion::from_coefficients(sh::Degree::new(1)?, vec![[1.0; 3]; 4]).unwrap();
    /// let filtered = shrm::PrefilterKernel::new(shrm::Distribution::Lambert, 1.0)?.convolve(&sky);
    /// assert_eq!(filtered.get(0, 0), [1.0; 3]);
    /// assert!((filtered.get(1, 0)[0] - 2.0 / 3.0).abs() < 1e-14);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn convolve(&self, series: &Expansion) -> Expansion {
        let mut filtered = series.clone();
        multiply(&mut filtered, &self.factors(series.degree().get()));
        filtered
    }
}

/// Multiplies each degree by its factor.
fn multiply(series: &mut Expansion, factors: &[f64]) {
    let degree = series.degree().get();
    let rows = series.coefficients_mut();
    for (l, k) in factors.iter().enumerate().take(degree + 1) {
        rows[l * l..(l + 1) * (l + 1)].as_flattened_mut().iter_mut().for_each(|value| *value *= k);
    }
}
