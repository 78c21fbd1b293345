//! The spherical harmonic transform: images to coefficients (analysis) and back (synthesis).
//!
//! Analysis is a_lm = integral of f Y_lm over the sphere, by the quadrature of the grid; synthesis is f = sum
//! over l, m of a_lm Y_lm at every pixel. Both separate: an FFT along each row ([`fourier`]), sums of
//! Legendre functions along each column of equal m ([`sums`], `legendre`). On pixel-centred rows and past
//! half of their degree, [`resample`] makes the sums along the columns exact.
//!
//! Work is O(W H log W + H degree^2). Tasks are fixed (eight pairs of rows, some orders m) and each
//! writes its own part, so results are bit-identical for any number of threads. What works along the rows has
//! the precision of the pixels, the sums of Legendre functions have double precision.

mod analysis;
mod fourier;
mod grid;
mod plan;
mod precision;
mod resample;
mod sample;
mod spare;
mod sums;
mod synthesis;
#[cfg(test)]
mod tests;

pub use fourier::ImageRows;
pub use grid::{GaussGrid, Grid};
pub use plan::TransformError;
pub use sample::Sample;

use crate::f64x4::SimdLevel;
use crate::{Degree, Expansion, Stop, Stopped, unstopped};
use analysis::Colatitude;
use plan::TransformPlan;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 3;

/// A plan for transforms between images on one grid and expansions of one degree; built once, used often.
///
/// Pixels are RGB, row by row from the top as in [`sphere::LatLong`]; coefficients are those of
/// [`Expansion`]: real orthonormal harmonics in Specula's frame, in the unit of the pixels. Analysis after
/// synthesis returns the coefficients within 1e-12 of the largest (`f64`, degree 511). Pixels of `f32` make
/// an error of at most 1e-6 of the largest coefficient or pixel.
///
/// A plan keeps the memory of finished calls for the next: 24 bytes for each row and m if pixels are `f32`,
/// 48 if they are `f64`, and 24 (degree + 1)^2 (200 or 300 MB at degree 2048 and 4100x2050). Calls from
/// several threads at once each have their own.
///
/// # Example: a constant sky has one non-zero coefficient
/// ```
/// use sh::{Degree, Transform};
/// use sphere::LatLong;
///
/// let grid = LatLong::with_rows(8);
/// let transform = Transform::new(grid, Degree::new(3)?)?;
/// let sky = transform.analyse(&vec![[1.0f32; 3]; grid.len()]);
/// let constant = (4.0 * std::f64::consts::PI).sqrt();
/// assert!((sky.get(0, 0)[0] - constant).abs() < 1e-14);
/// assert!(sky.coefficients()[1..].iter().all(|row| row[0].abs() < 1e-14));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Transform {
    synthesis: Synthesis,
    colatitude: Colatitude,
}

impl Transform {
    /// A plan for `degree` on a [`sphere::LatLong`] or [`GaussGrid`].
    ///
    /// # Errors
    /// If the columns are not more than twice the degree, or the rows not more than the degree.
    pub fn new(grid: impl Into<Grid>, degree: Degree) -> Result<Self, TransformError> {
        Self::at_level(SimdLevel::detect(), grid.into(), degree)
    }

    fn at_level(level: SimdLevel, grid: Grid, degree: Degree) -> Result<Self, TransformError> {
        let (columns, rows, l) = (grid.width(), grid.height(), degree.get());
        if columns <= 2 * l && columns > 0 {
            return Err(TransformError::TooFewColumns { columns, degree: l });
        }
        if rows <= l && rows > 0 {
            return Err(TransformError::TooFewRows { rows, degree: l });
        }
        let synthesis = Synthesis::at_level(level, grid, degree)?;
        let colatitude = Colatitude::new(&synthesis.plan);
        Ok(Self { synthesis, colatitude })
    }

    /// The grid of the pixels.
    pub fn grid(&self) -> &Grid {
        self.synthesis.grid()
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.synthesis.degree()
    }

    /// The coefficients of an image: a_lm = integral of f Y_lm, exact if f is an expansion of this degree.
    ///
    /// # Panics
    /// If the number of pixels is not that of the grid.
    pub fn analyse<T: Sample>(&self, pixels: &[[T; 3]]) -> Expansion {
        unstopped(|stop| self.analyse_rows(&pixels, stop))
    }

    /// [`Transform::analyse`] of an image whose rows are read a few at a time. `stop` is asked before some of
    /// them are read.
    ///
    /// # Errors
    /// If it was stopped.
    ///
    /// # Panics
    /// If the number of pixels is not that of the grid.
    pub fn analyse_rows<T: Sample>(
        &self,
        image: &impl ImageRows<T>,
        stop: Stop<'_>,
    ) -> Result<Expansion, Stopped> {
        let mut expansion = Expansion::zero(self.degree());
        T::analyse(&self.synthesis.plan, &self.colatitude, image, stop, &mut expansion)?;
        Ok(expansion)
    }

    /// The image of an expansion; its degree may be lower than that of the plan.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan.
    pub fn synthesise<T: Sample>(&self, expansion: &Expansion) -> Vec<[T; 3]> {
        self.synthesis.synthesise(expansion)
    }

    /// [`Transform::synthesise`] into memory of the caller.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan, or the number of pixels is not that of the grid.
    pub fn synthesise_into<T: Sample>(&self, expansion: &Expansion, pixels: &mut [[T; 3]]) {
        self.synthesis.synthesise_into(expansion, pixels);
    }
}

/// A plan for synthesis alone: the values of an expansion at the pixels of any grid, however coarse.
///
/// Unlike [`Transform`] it works with any number of rows and columns: values are those of the function at the
/// pixel centres.
pub struct Synthesis {
    plan: TransformPlan,
    degree: Degree,
}

impl Synthesis {
    /// A plan for `degree` on a [`sphere::LatLong`] or [`GaussGrid`].
    ///
    /// # Errors
    /// If the grid has no pixel.
    pub fn new(grid: impl Into<Grid>, degree: Degree) -> Result<Self, TransformError> {
        Self::at_level(SimdLevel::detect(), grid.into(), degree)
    }

    fn at_level(level: SimdLevel, grid: Grid, degree: Degree) -> Result<Self, TransformError> {
        if grid.is_empty() {
            return Err(TransformError::Empty { columns: grid.width(), rows: grid.height() });
        }
        Ok(Self { plan: TransformPlan::new(level, grid, degree.get()), degree })
    }

    /// The grid of the pixels.
    pub fn grid(&self) -> &Grid {
        &self.plan.grid
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The image of an expansion; its degree may be lower than that of the plan.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan.
    pub fn synthesise<T: Sample>(&self, expansion: &Expansion) -> Vec<[T; 3]> {
        let mut pixels = vec![[T::ZERO; 3]; self.plan.grid.len()];
        self.synthesise_into(expansion, &mut pixels);
        pixels
    }

    /// [`Synthesis::synthesise`] into memory of the caller.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan, or the number of pixels is not that of the grid.
    pub fn synthesise_into<T: Sample>(&self, expansion: &Expansion, pixels: &mut [[T; 3]]) {
        assert!(expansion.degree() <= self.degree, "the expansion's degree is past that of the plan");
        T::synthesise(&self.plan, expansion, pixels);
    }
}
