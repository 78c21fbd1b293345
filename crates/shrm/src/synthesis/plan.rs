//! What all tasks of one synthesis share.

use sh::Stop;
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
    /// The number of values of a texel: coefficients times channels.
    pub(super) columns: usize,
    /// The number of values of a texel, filled up to whole vectors.
    pub(super) padded: usize,
    pub(super) fourier: ParitySplitFourier,
    pub(super) recurrence: Recurrence,
    /// For each of `padded` values, whether its q is odd.
    pub(super) odd: Vec<bool>,
    /// rho_lpq by q, p, channel, the parity of l, and l / 2.
    rho: Vec<f64>,
    /// Asked by every task.
    pub(super) stop: Stop<'a>,
}

impl<'a> SynthesisPlan<'a> {
    pub(super) fn new(reflection: &'a Reflection, terms: Terms, stop: Stop<'a>) -> Self {
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
        let brdf = reflection.brdf();
        let mut rho = Vec::with_capacity(3 * (p + 1) * (p + 1) * 2 * (f / 2 + 1));
        for (q, p) in (0..=p).flat_map(|q| (0..=p).map(move |p| (q, p))) {
            for (channel, parity) in [0, 1, 2].into_iter().flat_map(|channel| [(channel, 0), (channel, 1)]) {
                let at = |l: usize| if l <= f && q <= p { brdf.get(l, p, q)[channel] } else { 0.0 };
                rho.extend((0..=f / 2).map(|half| at(2 * half + parity)));
            }
        }
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
            rho,
            stop,
        }
    }

    /// rho_lpq of a channel for all even l, or all odd ones, by l / 2.
    pub(super) fn rho(&self, [q, p]: [usize; 2], channel: usize, parity: usize) -> &[f64] {
        let (side, count) = (self.reflection.brdf().p().get() + 1, self.f / 2 + 1);
        &self.rho[(((q * side + p) * 3 + channel) * 2 + parity) * count..][..count]
    }

    /// The number of coefficients of a texel.
    pub(super) fn rows(&self) -> usize {
        self.columns / 3
    }

    /// The number of values of one Fourier series: cosines and sines of every order, for every value of a
    /// texel.
    pub(super) fn series(&self) -> usize {
        self.fourier.len() * self.padded
    }
}
