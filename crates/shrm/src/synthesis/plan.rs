//! What all tasks of one synthesis share.

use sh::f64x4::{LANES, SimdLevel};
use sh::wigner::Recurrence;

use super::parity_split_fourier::ParitySplitFourier;
use crate::{Reflection, Terms};

/// The constants of one synthesis.
pub(super) struct SynthesisPlan<'a> {
    pub(super) reflection: &'a Reflection,
    pub(super) level: SimdLevel,
    pub(super) f: usize,
    pub(super) terms: Terms,
    /// Values of a texel: coefficients times channels.
    pub(super) columns: usize,
    /// The same, filled up to whole vectors.
    pub(super) padded: usize,
    pub(super) fourier: ParitySplitFourier,
    pub(super) recurrence: Recurrence,
    /// For each of `padded` values, whether its q is odd.
    pub(super) odd: Vec<bool>,
}

impl<'a> SynthesisPlan<'a> {
    pub(super) fn new(reflection: &'a Reflection, terms: Terms) -> Self {
        let (f, p) = (reflection.brdf().f().get(), reflection.brdf().p().get());
        let mut odd = Vec::new();
        for p in 0..=p {
            match terms {
                Terms::Zonal => odd.extend([false; 3]),
                Terms::All => odd.extend((0..2 * p + 1).flat_map(|place| [(place + p) % 2 == 1; 3])),
            }
        }
        let columns = odd.len();
        let padded = columns.next_multiple_of(LANES);
        odd.resize(padded, false);
        Self {
            reflection,
            level: SimdLevel::detect(),
            f,
            terms,
            columns,
            padded,
            fourier: ParitySplitFourier::new(f),
            recurrence: Recurrence::new(f),
            odd,
        }
    }

    /// Coefficients of a texel.
    pub(super) fn rows(&self) -> usize {
        self.columns / 3
    }

    /// Values of one Fourier series: cosines and sines of every order, for every value of a texel.
    pub(super) fn series(&self) -> usize {
        self.fourier.len() * self.padded
    }
}
