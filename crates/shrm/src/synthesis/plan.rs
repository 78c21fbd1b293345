//! What all tasks of one synthesis share.

use std::ops::Range;

use sh::Stop;
use sh::f64x4::SimdLevel;
use sh::wigner::Recurrence;

use super::parity_split_fourier::ParitySplitFourier;
use crate::{Reflection, Terms};

/// The numbers of a vector of the sums.
pub(super) const LANES: usize = 8;

/// The most values of a group, unless one degree p has more: what is computed of them stays in the nearer
/// caches.
const MOST_VALUES: usize = 128;

/// The constants of one synthesis.
pub(super) struct SynthesisPlan<'a> {
    pub(super) reflection: &'a Reflection,
    pub(super) level: SimdLevel,
    pub(super) f: usize,
    pub(super) terms: Terms,
    /// The number of values of a texel: coefficients times channels.
    pub(super) columns: usize,
    pub(super) groups: Vec<Group>,
    pub(super) fourier: ParitySplitFourier,
    pub(super) recurrence: Recurrence,
    /// For each value of a texel, its place in a series and the numbers from one term to the next.
    places: Vec<[usize; 2]>,
    /// rho_lpq by q, p, channel, the parity of l, and l / 2.
    rho: Vec<f64>,
    /// Asked by every task.
    pub(super) stop: Stop<'a>,
}

/// The coefficients of some degrees p, which are summed together: first those of even q, then those of odd q,
/// each filled up to whole vectors.
pub(super) struct Group {
    /// The degrees.
    pub(super) p: Range<usize>,
    /// The values of a texel that it has.
    pub(super) columns: Range<usize>,
    /// The number of values, filled up.
    pub(super) padded: usize,
    /// Where the values of odd q begin.
    pub(super) odd: usize,
    /// For each of `columns`, its place among the values.
    pub(super) places: Vec<usize>,
    /// For every q > 0 the places of c_pq and of c_p,-q of one channel.
    pub(super) pairs: Vec<(usize, [usize; 2])>,
    /// Where its series begins among those of all groups.
    pub(super) start: usize,
}

impl Group {
    fn new(p: Range<usize>, terms: Terms, start: usize) -> Self {
        let first = |p: usize| if terms == Terms::Zonal { 3 * p } else { 3 * p * p };
        // Whether q is odd, for each value.
        let odd = p.clone().flat_map(|p| match terms {
            Terms::Zonal => vec![false; 3],
            Terms::All => (0..2 * p + 1).flat_map(|place| [(place + p) % 2 == 1; 3]).collect(),
        });
        let odd: Vec<bool> = odd.collect();
        let even = odd.iter().filter(|odd| !**odd).count().next_multiple_of(LANES);
        let mut next = [0, even];
        let places = odd.iter().map(|odd| {
            let place = &mut next[usize::from(*odd)];
            *place += 1;
            *place - 1
        });
        let places: Vec<usize> = places.collect();
        let columns = first(p.start)..first(p.end);
        let mut pairs = Vec::new();
        for p in p.clone().filter(|_| terms == Terms::All) {
            let place = |row: usize, channel: usize| places[3 * row + channel - columns.start];
            let middle = p * p + p;
            for (q, channel) in (1..=p).flat_map(|q| (0..3).map(move |channel| (q, channel))) {
                pairs.push((q, [place(middle + q, channel), place(middle - q, channel)]));
            }
        }
        let padded = next[1].next_multiple_of(LANES);
        Self { columns, p, padded, odd: even, places, pairs, start }
    }

    /// The values of even q, or of odd q.
    pub(super) fn of_parity(&self, odd: bool) -> Range<usize> {
        if odd { self.odd..self.padded } else { 0..self.odd }
    }
}

impl<'a> SynthesisPlan<'a> {
    pub(super) fn new(reflection: &'a Reflection, terms: Terms, stop: Stop<'a>) -> Self {
        let (f, p) = (reflection.brdf().f().get(), reflection.brdf().p().get());
        let fourier = ParitySplitFourier::new(f);
        let mut groups: Vec<Group> = Vec::new();
        let (mut first, mut start) = (0, 0);
        while first <= p {
            let group = |end: usize| Group::new(first..end, terms, start);
            let end = (first + 2..=p + 1).take_while(|end| group(*end).padded <= MOST_VALUES).last();
            let group = group(end.unwrap_or(first + 1));
            (first, start) = (group.p.end, start + group.padded * fourier.len());
            groups.push(group);
        }
        let place = |group: &Group| {
            let of = |place: &usize| [group.start + place, group.padded];
            group.places.iter().map(of).collect::<Vec<_>>()
        };
        let places: Vec<[usize; 2]> = groups.iter().flat_map(place).collect();
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
            columns: places.len(),
            groups,
            fourier,
            recurrence: Recurrence::new(f),
            places,
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

    /// The number of numbers of one Fourier series, of all groups: cosines and sines of every order, for
    /// every value of a texel.
    pub(super) fn series(&self) -> usize {
        self.fourier.len() * self.groups.iter().map(|group| group.padded).sum::<usize>()
    }

    /// The place in a series of a term of a value of a texel.
    #[inline(always)]
    pub(super) fn place(&self, column: usize, term: usize) -> usize {
        let [first, step] = self.places[column];
        first + term * step
    }
}
