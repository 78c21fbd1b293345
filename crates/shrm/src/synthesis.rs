//! Synthesis of a reflection map: the coefficients b_pq at every texel, in O(F P^2) per texel.
//!
//! For each (p, q) the field of equation 14,
//!
//! > B_pq(alpha, beta) = sum over l, m of L_lm rho_lpq d^l_mq(alpha) e^(i m beta),
//!
//! is a function of spin q on the sphere: its value depends on the frame at the central direction, not on the
//! direction alone. It separates as the scalar transform does. For one colatitude alpha, sums over l with
//! Wigner's d functions ([`spin`]) leave a Fourier series in the azimuth beta of degree F; all rows of B,
//! real and RGB, share its cosines and sines, so that evaluating it at many angles is one product of small
//! matrices ([`parity_split_fourier`]). On a lat-long map that is all ([`lat_long`]). A column of a cube's
//! side face has one azimuth, and there B is a Fourier series of degree F in alpha ([`cube`]).
//!
//! What a row needs is summed in `f64`. The Fourier series after it are in `f32`, as the map is, and belong
//! to a few coefficients at a time ([`plan::Group`]), so that they stay in the processor's caches.
//!
//! The product takes O(F) per texel and row, with four texels for the price of one by symmetry. A fast
//! Fourier transform along lat-long rows would need fewer operations, but of a slower kind: it pays from F =
//! 130 or so only, far past what a map of a view-dependent material needs.
//!
//! Tasks are fixed and each writes texels of its own: results are bit-identical for any number of threads.

mod cube;
mod lat_long;
mod parity_split_fourier;
mod plan;
mod product;
mod spin;

use sh::{Stop, Stopped};

use crate::{MapGrid, Reflection, Shrm, Terms, View};
use plan::SynthesisPlan;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// Why a map could not be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SynthesisError {
    /// The grid has no texel.
    #[error("a map of {0:?} has no texel: its edge or its rows and columns must be at least 1")]
    Empty(MapGrid),
    /// The map would have more values than [`MOST_VALUES`].
    #[error(
        "{texels} texels of {rows} coefficients make more than {MOST_VALUES} values: lower the resolution or the \
         material's degree P"
    )]
    TooLarge {
        /// The number of texels of the grid.
        texels: usize,
        /// The number of coefficients per texel.
        rows: usize,
    },
    /// The synthesis was stopped, because the caller did not want the map any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The most coefficients that a map may have, over all texels: 2^28, 3.2 GB.
pub const MOST_VALUES: usize = 1 << 28;

impl Reflection {
    /// The spherical harmonic reflection map on a grid [RH02, eqs. 6, 7 and 14].
    ///
    /// Shape [texels, rows] RGB. A local map of a material without azimuth ([`Reflection::is_azimuth_free`])
    /// keeps zonal terms only; a global map keeps all. Every texel agrees with [`Reflection::coefficients`]
    /// at its own central direction within rounding to f32 (tests: 1e-6 of the largest, F to 60, P to 8,
    /// poles and edges included). `stop` is asked every few milliseconds, on every thread.
    ///
    /// # Errors
    /// If the grid has no texel, the map would pass [`MOST_VALUES`], or it was stopped.
    ///
    /// # Example: a white surface under a constant sky
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::{Degree, Expansion};
    /// use shrm::{MapGrid, Reflection, View};
    /// let sky = Expansion::from_coefficients(Degree::ZERO, vec![[3.5449077018110318; 3]]).unwrap();
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let degrees = Choice::Degree { f: Degree::ZERO, p: Degree::ZERO };
    /// let brdf = project(&white, degrees, sh::Stop::NEVER)?.coefficients;
    /// let grid = MapGrid::Cube(sphere::Cube { edge: 4 });
    /// let map = Reflection::convolve(&sky, &brdf).synthesise(grid, View::Local, sh::Stop::NEVER)?;
    /// let up = sphere::Direction::Z;
    /// assert!((map.radiance(up, up)[0] - 1.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn synthesise(&self, grid: MapGrid, view: View, stop: Stop<'_>) -> Result<Shrm, SynthesisError> {
        let terms = if self.is_azimuth_free() { Terms::Zonal } else { Terms::All };
        let p = self.brdf().p();
        let rows = if terms == Terms::Zonal && view == View::Local { p.get() + 1 } else { p.rows() };
        let texels = texels(grid).filter(|texels| texels.saturating_mul(rows) <= MOST_VALUES);
        let Some(texels) = texels else {
            return Err(SynthesisError::TooLarge { texels: self::texels(grid).unwrap_or(usize::MAX), rows });
        };
        if texels == 0 {
            return Err(SynthesisError::Empty(grid));
        }
        let plan = SynthesisPlan::new(self, terms, stop);
        let values = match grid {
            MapGrid::LatLong(grid) => lat_long::synthesise(&plan, grid)?,
            MapGrid::Cube(cube) => cube::synthesise(&plan, cube)?,
        };
        let local = Shrm { grid, view: View::Local, centre: self.brdf().centre(), p, terms, values };
        Ok(if view == View::Global { local.to_global() } else { local })
    }
}

/// The number of texels; `None` if it overflows.
fn texels(grid: MapGrid) -> Option<usize> {
    grid.shape().into_iter().try_fold(1_usize, usize::checked_mul)
}
