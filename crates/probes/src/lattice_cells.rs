//! Free space on a lattice: which of its neighbours are connected, and the spaces that a cube can move about.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::validity::Viewer;

/// How far rays reach beyond the places that they connect, in steps: a surface through a place is met.
const BEYOND: f32 = 0.01;

/// How many places are looked at between two questions whether to stop.
const ASKED: usize = 1 << 12;

/// A lattice of places in the middle of the cells of a box.
pub(crate) struct Cells {
    least: Vec3,
    step: Vec3,
    counts: [usize; 3],
    /// For each axis the number of steps that a surface blocks, between a place and the one before it along
    /// the axis, of all places up to it along all axes.
    blocked: [Vec<u32>; 3],
}

/// Some cells of a lattice in a box: from `least` to `most`, which it does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    pub(crate) least: [usize; 3],
    pub(crate) most: [usize; 3],
}

impl Region {
    /// The region around some places.
    pub(crate) fn around(places: &[[usize; 3]]) -> Option<Self> {
        places.iter().fold(None, |region, at| Some(Self::with(region, *at)))
    }

    fn with(region: Option<Self>, at: [usize; 3]) -> Self {
        let one = Self { least: at, most: at.map(|x| x + 1) };
        region.map_or(one.clone(), |region| region.joined(&one))
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            least: [0, 1, 2].map(|axis| self.least[axis].min(other.least[axis])),
            most: [0, 1, 2].map(|axis| self.most[axis].max(other.most[axis])),
        }
    }

    pub(crate) fn contains(&self, at: [usize; 3]) -> bool {
        (0..3).all(|axis| (self.least[axis]..self.most[axis]).contains(&at[axis]))
    }

    /// Its places, x fastest.
    pub(crate) fn places(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let [x, y, z] = [0, 1, 2].map(|axis| self.least[axis]..self.most[axis]);
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| [x, y, z]))
        })
    }

    fn volume(&self) -> usize {
        (0..3).map(|axis| self.most[axis] - self.least[axis]).product()
    }

    /// The cut of some places into two, whose regions are smallest together: an axis, and the first place
    /// behind the cut. `None` if there is no cut.
    pub(crate) fn tightest_cut(&self, places: &[[usize; 3]]) -> Option<(usize, usize)> {
        let mut best: Option<(usize, (usize, usize))> = None;
        for axis in 0..3 {
            let mut layers: Vec<Option<Self>> = vec![None; self.most[axis] - self.least[axis]];
            for at in places {
                let layer = &mut layers[at[axis] - self.least[axis]];
                *layer = Some(Self::with(layer.take(), *at));
            }
            let join = |sum: &mut Option<Self>, layer: &Option<Self>| {
                *sum = match (sum.take(), layer) {
                    (Some(sum), Some(layer)) => Some(sum.joined(layer)),
                    (sum, layer) => sum.or_else(|| layer.clone()),
                };
                Some(sum.as_ref().map_or(0, Self::volume))
            };
            let below: Vec<usize> = layers.iter().scan(None, join).collect();
            let mut above: Vec<usize> = layers.iter().rev().scan(None, join).collect();
            above.reverse();
            for first in 1..layers.len() {
                let both = below[first - 1] + above[first];
                if best.is_none_or(|(least, _)| both < least) {
                    best = Some((both, (axis, self.least[axis] + first)));
                }
            }
        }
        best.map(|(_, cut)| cut)
    }
}

impl Cells {
    /// The lattice of a box, with steps of about so many metres.
    pub(crate) fn new(
        viewer: &Viewer<'_>,
        bounds: [[f32; 3]; 2],
        step: f32,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let [least, most] = bounds.map(Vec3::from);
        let counts = ((most - least) / step).to_array().map(|count| count.ceil().max(1.0) as usize);
        let step = (most - least) / Vec3::from(counts.map(|count| count as f32));
        let mut cells = Self { least, step, counts, blocked: [const { Vec::new() }; 3] };
        let layers: Vec<[Vec<bool>; 3]> = (0..counts[2])
            .into_par_iter()
            .map(|z| {
                stop.check()?;
                let layer = |axis: usize| {
                    let places = (0..counts[0] * counts[1]).map(|k| [k % counts[0], k / counts[0], z]);
                    let is_blocked = |at: [usize; 3]| {
                        let mut before = at;
                        let Some(other) = at[axis].checked_sub(1) else { return false };
                        before[axis] = other;
                        let [from, to] = [before, at].map(|at| cells.position(at));
                        let beyond = BEYOND * (to - from);
                        !viewer.sees(from - beyond, to + beyond)
                    };
                    places.map(is_blocked).collect()
                };
                Ok([layer(0), layer(1), layer(2)])
            })
            .collect::<Result<_, Stopped>>()?;
        for axis in 0..3 {
            let own: Vec<bool> = layers.iter().flat_map(|layer| layer[axis].iter().copied()).collect();
            cells.blocked[axis] = cells.summed(&own);
        }
        Ok(cells)
    }

    pub(crate) fn counts(&self) -> [usize; 3] {
        self.counts
    }

    pub(crate) fn step(&self) -> Vec3 {
        self.step
    }

    pub(crate) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    pub(crate) fn place(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// Where a place is, in metres.
    pub(crate) fn position(&self, at: [usize; 3]) -> Vec3 {
        self.least + self.step * (Vec3::from(at.map(|x| x as f32)) + 0.5)
    }

    /// The shortest side of a region, in metres.
    pub(crate) fn narrowest(&self, region: &Region) -> f32 {
        let side = |axis: usize| (region.most[axis] - region.least[axis]) as f32 * self.step[axis];
        side(0).min(side(1)).min(side(2))
    }

    /// All places are free: a surface has no thickness.
    pub(crate) fn free(&self) -> Vec<bool> {
        vec![true; self.counts.iter().product()]
    }

    /// For each place, how many of the places up to it along all axes are set.
    fn summed(&self, set: &[bool]) -> Vec<u32> {
        let mut sums: Vec<u32> = set.iter().map(|set| u32::from(*set)).collect();
        for axis in 0..3 {
            for index in 0..sums.len() {
                let mut before = self.place(index);
                if let Some(other) = before[axis].checked_sub(1) {
                    before[axis] = other;
                    sums[index] += sums[self.index(before)];
                }
            }
        }
        sums
    }

    /// How many steps along an axis are blocked that end in a region.
    fn blocked_in(&self, axis: usize, region: &Region) -> u32 {
        let up_to = |corner: usize| {
            let at = [0, 1, 2].map(|k| {
                let end = if corner >> k & 1 == 1 { region.most[k] } else { region.least[k] };
                end.checked_sub(1)
            });
            match at {
                [Some(x), Some(y), Some(z)] => i64::from(self.blocked[axis][self.index([x, y, z])]),
                _ => 0,
            }
        };
        let sign = |corner: usize| if corner.count_ones() % 2 == 1 { 1 } else { -1 };
        (0..8).map(|corner: usize| sign(corner) * up_to(corner)).sum::<i64>() as u32
    }

    /// The cross-section of a region that most steps across it are blocked in: an axis and the first place
    /// behind it, and the share.
    pub(crate) fn wall(&self, region: &Region) -> Option<((usize, usize), f32)> {
        let mut best: Option<((usize, usize), f32)> = None;
        for axis in 0..3 {
            for first in region.least[axis] + 1..region.most[axis] {
                let mut layer = region.clone();
                (layer.least[axis], layer.most[axis]) = (first, first + 1);
                let share = self.blocked_in(axis, &layer) as f32 / layer.volume() as f32;
                if best.is_none_or(|(_, most)| share > most) {
                    best = Some(((axis, first), share));
                }
            }
        }
        best
    }

    /// Whether no surface cuts a region: no step between two of its places is blocked.
    fn is_whole(&self, region: &Region) -> bool {
        (0..3).all(|axis| {
            let mut inner = region.clone();
            inner.least[axis] += 1;
            inner.least[axis] >= inner.most[axis] || self.blocked_in(axis, &inner) == 0
        })
    }

    /// The spaces that a box of so many places along each axis can move about, by number from 1 on: for each
    /// place that of the space whose box reaches it, 0 for none.
    pub(crate) fn opened(&self, sides: [usize; 3], stop: Stop<'_>) -> Result<Vec<u32>, Stopped> {
        let fits = |index: usize| {
            let least = self.place(index);
            let most = [0, 1, 2].map(|axis| least[axis].saturating_add(sides[axis]));
            (0..3).all(|axis| most[axis] <= self.counts[axis]) && self.is_whole(&Region { least, most })
        };
        let all: usize = self.counts.iter().product();
        let block = |block: usize| {
            stop.check()?;
            Ok((block * ASKED..all.min((block + 1) * ASKED)).map(fits).collect())
        };
        let blocks = (0..all.div_ceil(ASKED)).into_par_iter().map(block);
        let fitting = blocks.collect::<Result<Vec<Vec<bool>>, Stopped>>()?.concat();
        // Boxes one step apart overlap, so that nothing is between them.
        let mut spaces = self.joined(&fitting, |_, _| true, stop)?;
        for axis in 0..3 {
            stop.check()?;
            spaces = self.spread(&spaces, axis, sides[axis]);
        }
        Ok(spaces)
    }

    /// Gives `side - 1` places behind each place along an axis its space.
    fn spread(&self, spaces: &[u32], axis: usize, side: usize) -> Vec<u32> {
        let mut spread = spaces.to_vec();
        for index in 0..spaces.len() {
            if spaces[index] == 0 {
                continue;
            }
            let mut at = self.place(index);
            for _ in 1..side {
                at[axis] += 1;
                if at[axis] >= self.counts[axis] || spaces[self.index(at)] != 0 {
                    break;
                }
                spread[self.index(at)] = spaces[index];
            }
        }
        spread
    }

    /// The connected spaces of some places, by number from 1 on.
    pub(crate) fn components(&self, set: &[bool], stop: Stop<'_>) -> Result<Vec<u32>, Stopped> {
        let is_open = |axis, at: [usize; 3]| {
            let one = Region { least: at, most: at.map(|x| x + 1) };
            self.blocked_in(axis, &one) == 0
        };
        self.joined(set, is_open, stop)
    }

    /// Numbers for sets of places: those are together that are neighbours and connected; `is_open` says it of
    /// a place and the one before it along an axis.
    fn joined(
        &self,
        set: &[bool],
        is_open: impl Fn(usize, [usize; 3]) -> bool,
        stop: Stop<'_>,
    ) -> Result<Vec<u32>, Stopped> {
        let mut number = vec![0; set.len()];
        let (mut count, mut waiting, mut looked) = (0, Vec::new(), 0_usize);
        for start in 0..set.len() {
            if !set[start] || number[start] != 0 {
                continue;
            }
            count += 1;
            number[start] = count;
            waiting.push(start);
            while let Some(index) = waiting.pop() {
                if looked.is_multiple_of(ASKED) {
                    stop.check()?;
                }
                looked += 1;
                let at = self.place(index);
                for axis in 0..3 {
                    for is_next in [false, true] {
                        let mut other = at;
                        let along = if is_next { at[axis].checked_add(1) } else { at[axis].checked_sub(1) };
                        let Some(along) = along.filter(|along| *along < self.counts[axis]) else { continue };
                        other[axis] = along;
                        let there = self.index(other);
                        let later = if is_next { other } else { at };
                        if set[there] && number[there] == 0 && is_open(axis, later) {
                            number[there] = count;
                            waiting.push(there);
                        }
                    }
                }
            }
        }
        Ok(number)
    }
}
