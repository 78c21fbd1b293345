//! Synthesis of a reflection map: the coefficients b_pq at every texel, in O(F P^2) per texel.
//!
//! For each (p, q) the field of equation 14,
//!
//! > B_pq(alpha, beta) = sum over l, m of L_lm rho_lpq d^l_mq(alpha) e^(i m beta),
//!
//! is a function of spin q on the sphere: its value depends on the frame at the central direction, not on
//! the direction alone. It separates as the scalar transform does. For one colatitude alpha, sums over l with Wigner's
//! d functions ([`spin`]) leave a Fourier series in the azimuth beta of degree F; all rows of B, real and RGB, share its
//! cosines and sines, so that evaluating it at many angles is one product of small matrices ([`quarters`]). On a
//! lat-long map that is all ([`lat_long`]). A column of a cube's side face has one azimuth, and there B is a Fourier
//! series of degree F in alpha ([`cube`]).
//!
//! The product takes O(F) per texel and row, with four texels for the price of one by symmetry. A fast
//! Fourier transform along lat-long rows would need fewer operations, but of a slower kind: it pays from F = 130 or so
//! only, far past what a map of a view-dependent material needs.
//!
//! Tasks are fixed and each writes texels of its own: results are bit-identical for any number of threads.

mod cube;
mod lat_long;
mod quarters;
mod spin;

use pulp::{Arch, Simd, WithSimd};

use crate::{MapGrid, Reflection, Shrm, Terms, View};
use quarters::Quarters;
use spin::Spin;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own revision.
pub const REVISION: u32 = 0;

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
        /// Texels of the grid.
        texels: usize,
        /// Coefficients per texel.
        rows: usize,
    },
}

/// The most coefficients that a map may have, over all texels: 2^28, 3.2 GB.
pub const MOST_VALUES: usize = 1 << 28;

impl Reflection {
    /// The spherical harmonic reflection map on a grid (paper 1, equations 6, 7 and 14).
    ///
    /// Shape [texels, rows] RGB. A local map of a material without azimuth ([`Reflection::is_azimuth_free`]) keeps zonal
    /// terms only; a global map keeps all. Every texel agrees with [`Reflection::coefficients`] at its own
    /// central direction within rounding to f32 (tests: 1e-6 of the largest, F to 60, P to 8, poles and edges included).
    ///
    /// # Errors
    /// Where the grid has no texel, or the map would pass [`MOST_VALUES`].
    ///
    /// # Example: a white surface under a constant sky
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use sh::{Degree, Expansion};
    /// use shrm::{MapGrid, Reflection, View};
    /// let sky = Expansion::from_rows(Degree::ZERO, vec![[3.5449077018110318; 3]]).unwrap();
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let brdf = project(&white, Choice::Degree { f: Degree::ZERO, p: Degree::ZERO })?.coefficients;
    /// let grid = MapGrid::Cube(sphere::Cube { edge: 4 });
    /// let map = Reflection::convolve(&sky, &brdf).synthesise(grid, View::Local)?;
    /// let up = sphere::Direction::Z;
    /// assert!((map.radiance(up, up)[0] - 1.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn synthesise(&self, grid: MapGrid, view: View) -> Result<Shrm, SynthesisError> {
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
        let plan = Plan::new(self, terms);
        let values = match grid {
            MapGrid::LatLong(grid) => lat_long::synthesise(&plan, grid),
            MapGrid::Cube(cube) => cube::synthesise(&plan, cube),
        };
        let local = Shrm { grid, view: View::Local, centre: self.brdf().centre(), p, terms, values };
        Ok(if view == View::Global { local.to_global() } else { local })
    }
}

/// The number of texels, where it can be counted.
fn texels(grid: MapGrid) -> Option<usize> {
    grid.shape().into_iter().try_fold(1_usize, usize::checked_mul)
}

/// What all tasks of one synthesis share.
struct Plan<'a> {
    reflection: &'a Reflection,
    arch: Arch,
    lanes: usize,
    f: usize,
    terms: Terms,
    /// Values of a texel: coefficients times channels.
    columns: usize,
    /// The same, filled up to whole vectors.
    padded: usize,
    quarters: Quarters,
    /// For each of `padded` values, whether its q is odd.
    odd: Vec<bool>,
}

impl<'a> Plan<'a> {
    fn new(reflection: &'a Reflection, terms: Terms) -> Self {
        struct Lanes;
        impl WithSimd for Lanes {
            type Output = usize;
            fn with_simd<S: Simd>(self, _: S) -> usize {
                S::F64_LANES
            }
        }
        let (f, p) = (reflection.brdf().f().get(), reflection.brdf().p().get());
        let arch = Arch::new();
        let mut odd = Vec::new();
        for p in 0..=p {
            match terms {
                Terms::Zonal => odd.extend([false; 3]),
                Terms::All => odd.extend((0..2 * p + 1).flat_map(|place| [(place + p) % 2 == 1; 3])),
            }
        }
        let columns = odd.len();
        let lanes = arch.dispatch(Lanes);
        let padded = columns.next_multiple_of(lanes);
        odd.resize(padded, false);
        Self { reflection, arch, lanes, f, terms, columns, padded, quarters: Quarters::new(f), odd }
    }

    fn rows(&self) -> usize {
        self.columns / 3
    }

    /// Values in a vector of this CPU.
    fn lanes(&self) -> usize {
        self.lanes
    }

    /// Values of one Fourier series: cosines and sines of every order, for every value of a texel.
    fn series(&self) -> usize {
        self.quarters.len() * self.padded
    }
}
