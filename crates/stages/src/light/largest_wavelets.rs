//! Keeps the largest wavelets of an environment, for renderers that have a limit of them, and to see what a
//! few of them make of the light.
//!
//! ```toml
//! [stage.few]
//! kind = "largest-wavelets"
//! input = "environment"
//! count = 500
//! ```
//!
//! Haar wavelets divide the environment into blocks of texels. Unlike spherical harmonics they are local: a
//! few of them hold a small lamp with sharp edges, and it does not ring all over the sphere. The result is an
//! environment of the same size in which large even areas are single blocks. Every stage that takes an
//! environment takes it.
//!
//! The wavelets are orthonormal over the sphere: their blocks are those of the lat-long image, each texel
//! counts by its solid angle, and an image of any size will do. So the squared error, integrated over the
//! sphere, is the sum of the squares of the wavelets that were dropped, and the largest ones are the best to
//! keep. The three channels of a wavelet are kept together. One of the wavelets is the mean of the light; it
//! is always kept, and all others have the mean 0. Thus the light as a whole stays the same, however few are
//! kept.
//!
//! The build notes the number of wavelets, their share of all, and the error: the root mean square over the
//! sphere, relative to that of the light. The sum of a few wavelets is below zero in places. That light is
//! kept, so that the sum stays right; the build notes its share, as a warning if it is more than 1 %.
//!
//! Errors of photographs of 1024 x 512 texels, and in brackets the share of the light that is below zero:
//!
//! | wavelets | a flat with windows | a forest | a street at night | a studio with softboxes | a sunrise |
//! | --- | --- | --- | --- | --- | --- |
//! | 100 | 30 % (0.02 %) | 70 % (1.7 %) | 30 % (0.4 %) | 13 % (8 %) | 0.07 % (0.005 %) |
//! | 1,000 | 15 % (0.02 %) | 50 % (1.0 %) | 11 % (0.07 %) | 1.1 % (0.2 %) | 0.02 % (0.001 %) |
//! | 10,000 | 3.8 % | 22 % (0.5 %) | 2.8 % | 0.05 % | 0.006 % |
//!
//! With a sun in the picture the error is mostly that of the sun: `tolerance = 0.05` keeps 20 wavelets of the
//! sunrise, of which nine tenths of the light is below zero. Take the sun out first (`subtract-lights`) if
//! the sky matters. Leaves need many wavelets, though their light as a whole is in a few.
//!
//! `export-wavelets` writes the wavelets themselves.

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use sampling::Haar;

use super::kept_wavelets::{KeptWavelets, Wanted, given_twice};
use crate::values::{artifacts, report_loss};

parameters! {
    /// Parameters of `largest-wavelets`.
    pub(crate) struct Parameters {
        /// The number of wavelets, that of the mean included. Default: 1000, unless `tolerance` is given.
        #[range(1..)]
        count: Option<usize> = None,
        /// The largest error, instead of a number: the root mean square over the sphere, relative to that of
        /// the light. As many wavelets are kept as it needs.
        #[range(0.0..1.0)]
        tolerance: Option<f64> = None,
    }
}

/// The number of wavelets, unless one is given.
const DEFAULT_COUNT: usize = 1000;

impl Parameters {
    fn wanted(&self) -> Wanted {
        let count = Wanted::Count(self.count.unwrap_or(DEFAULT_COUNT));
        self.tolerance.map_or(count, Wanted::Error)
    }
}

/// The kind `largest-wavelets`.
pub(crate) struct LargestWavelets;

impl Kind for LargestWavelets {
    type Parameters = Parameters;

    const NAME: &'static str = "largest-wavelets";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sampling::revisions::HAAR];
    const TEXT: &'static str = include_str!("largest_wavelets.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Environment::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        given_twice(parameters.count, parameters.tolerance).into_iter().collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = &context.inputs.get::<artifacts::Environment>("environment")?.0;
        let grid = environment.grid();
        let heights: Vec<f64> = (0..grid.height).map(|row| grid.solid_angle(row)).collect();
        let mut haar = Haar::new(&heights, &vec![1.0; grid.width], environment.pixels().to_vec());
        reporter.check_cancelled()?;
        let kept = KeptWavelets::of(&haar, parameters.wanted());
        reporter.check_cancelled()?;
        haar.keep(&kept.indices);
        let pixels = haar.values();
        let below = pixels.chunks(grid.width).zip(&heights).map(|(row, height)| {
            height * row.as_flattened().iter().map(|value| f64::from(value.min(0.0))).sum::<f64>()
        });
        let below: f64 = below.sum();
        let whole: f64 = environment.integral().iter().sum();
        reporter.note(kept.note());
        if below < 0.0 && whole > 0.0 {
            let what = "the light is below zero, which sampling takes as none";
            let help = "keep more wavelets, or take suns and lamps out first (subtract-lights)";
            report_loss(reporter, -below / whole, what, help);
        }
        let few = envmap::Environment::new(grid, pixels);
        let few = few.ok_or_else(|| Failure::new("the light has values above the largest 32-bit float"))?;
        Output::artifact(artifacts::Environment(few))
    }
}
