//! Volumes whose walls lie midway between probes.
//!
//! A wall between two probes leaks least if it is midway: three.js reads half a spacing in front of a
//! surface, and then meets a probe of the own side exactly. Each axis is shifted and stretched until the sum
//! of the squared distances of the surfaces across it, in spacings and by their area, is the least.

use crate::leaks::Leaks;
use crate::volume::{Lattice, Volume};

/// The most that a spacing changes.
const MOST_STRETCH: f64 = 0.1;

/// The most that the end of a box moves, in spacings.
const MOST_SHIFT: f64 = 0.5;

/// How far a box reaches beyond its outer surfaces, in spacings: engines test whether a surface is in it.
const MARGIN: f64 = 0.01;

/// Surfaces are across an axis if the cosine between it and their normal is at least this.
const ACROSS: f32 = 0.999;

/// The shifts and the stretches that are tried, each.
const TRIES: i32 = 40;

/// Next to this the changes of an axis count too, as squares: of two that are as good, the smaller is taken.
const OF_CHANGES: f64 = 1e-6;

/// What may change of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Freedom {
    /// Whether its ends may move outward, and not only inward.
    pub may_grow: bool,
    /// Whether it may have a probe more or less along an axis.
    pub may_recount: bool,
}

/// An axis of a grid: where the box begins, the length of cells, and their number.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    first: f64,
    spacing: f64,
    cells: usize,
}

impl Axis {
    fn last(&self) -> f64 {
        self.first + self.cells as f64 * self.spacing
    }
}

impl Volume {
    /// The volume after each of its axes is shifted by at most half a spacing and stretched by at most 10
    /// percent, so that the surfaces that `leaks` was measured at lie midway between probes, as far as
    /// possible. The surfaces that were in the box stay in it.
    #[must_use]
    pub fn aligned(&self, leaks: &Leaks, freedom: Freedom) -> Self {
        let mut aligned = self.clone();
        let points = || leaks.points.iter().filter(|leak| self.contains(leak.point.into()));
        for axis in 0..3 {
            let across = points().filter(|leak| leak.normal[axis].abs() >= ACROSS);
            let mut at: Vec<f32> = across.map(|leak| leak.point[axis]).collect();
            at.sort_by(f32::total_cmp);
            let walls: Vec<(f64, f64)> =
                at.chunk_by(|a, b| a == b).map(|own| (f64::from(own[0]), own.len() as f64)).collect();
            let of_all = points().map(|leak| f64::from(leak.point[axis]));
            let ends = of_all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
            let [least, most] = self.bounds.map(|end| f64::from(end[axis]));
            // Probes at corners have a cell less than there are of them.
            let more = usize::from(self.lattice == Lattice::Corners);
            let cells = self.counts[axis] - more;
            let given = Axis { first: least, spacing: (most - least) / cells.max(1) as f64, cells };
            if cells == 0 || walls.is_empty() {
                continue;
            }
            let shift = if more == 1 { 0.5 } else { 0.0 };
            let search = Search { walls: &walls, ends, given, shift, freedom };
            let best = search.best();
            let candidate = |axis_of: &Axis| {
                let mut changed = aligned.clone();
                changed.counts[axis] = axis_of.cells + more;
                changed.bounds[0][axis] = axis_of.first as f32;
                changed.bounds[1][axis] = axis_of.last() as f32;
                let Self { name, bounds, counts, lattice } = changed;
                Self::new(name, bounds, counts, lattice).ok()
            };
            if let Some(changed) = best.as_ref().and_then(candidate) {
                aligned = changed;
            }
        }
        aligned
    }
}

/// The search for an axis.
struct Search<'a> {
    /// The places of surfaces across the axis, and their weights.
    walls: &'a [(f64, f64)],
    /// The least and the greatest place of all surfaces.
    ends: [f64; 2],
    given: Axis,
    /// Where the middle between two probes is, in spacings from the start of a cell.
    shift: f64,
    freedom: Freedom,
}

impl Search<'_> {
    /// The best axis, if it is better than the one that is given.
    fn best(&self) -> Option<Axis> {
        let Axis { first, spacing, cells } = self.given;
        let counts = match self.freedom.may_recount {
            true => [Some(cells), cells.checked_sub(1), Some(cells + 1)],
            false => [Some(cells), None, None],
        };
        let mut best = (self.cost(&self.given), None);
        let mut consider = |axis: Axis| {
            let cost = self.cost(&axis);
            if self.is_allowed(&axis) && cost < best.0 {
                best = (cost, Some(axis));
            }
        };
        for cells in counts.into_iter().flatten().filter(|cells| *cells > 0) {
            for (stretch, shift) in (0..=TRIES).flat_map(|k| (0..=TRIES).map(move |n| (k, n))) {
                let part = |k: i32| f64::from(2 * k - TRIES) / f64::from(TRIES);
                let spacing = spacing * (1.0 + MOST_STRETCH * part(stretch));
                let tried =
                    Axis { first: first + MOST_SHIFT * self.given.spacing * part(shift), spacing, cells };
                let refined = self.refined(&tried);
                [tried, refined, self.covering(&refined)].into_iter().for_each(&mut consider);
            }
        }
        best.1
    }

    /// The weighted mean of the squared distances between surfaces and the nearest middle between probes, in
    /// spacings, and a little for what is changed.
    fn cost(&self, axis: &Axis) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for (at, weight) in self.walls {
            let distance = (at - axis.first) / axis.spacing - self.middle(axis, *at);
            sum += weight * distance * distance;
            all += weight;
        }
        let moved = (axis.first - self.given.first) / self.given.spacing;
        let stretched = axis.spacing / self.given.spacing - 1.0;
        sum / all + OF_CHANGES * (moved * moved + stretched * stretched)
    }

    /// The middle between probes that is nearest to a place, in spacings from the start of the box.
    fn middle(&self, axis: &Axis, at: f64) -> f64 {
        ((at - axis.first) / axis.spacing - self.shift).round() + self.shift
    }

    /// The axis with the least squares, if each surface stays with the middle that is nearest to it.
    fn refined(&self, axis: &Axis) -> Axis {
        let mut sums = [0.0; 5];
        for (at, weight) in self.walls {
            let k = self.middle(axis, *at);
            for (sum, value) in sums.iter_mut().zip([1.0, k, k * k, *at, k * at]) {
                *sum += weight * value;
            }
        }
        let [one, k, kk, at, kat] = sums;
        let determinant = one * kk - k * k;
        if determinant <= 1e-9 * one * kk {
            return Axis { first: (at - k * axis.spacing) / one, ..*axis };
        }
        let spacing = (one * kat - k * at) / determinant;
        Axis { first: (at - k * spacing) / one, spacing, ..*axis }
    }

    /// The axis with its ends moved outward as far as it takes to hold all surfaces.
    fn covering(&self, axis: &Axis) -> Axis {
        let margin = MARGIN * (1.0 + 1e-6) * axis.spacing * (1.0 + MOST_STRETCH);
        let [least, most] = [self.ends[0] - margin, self.ends[1] + margin];
        let first = if self.given.first < least { axis.first.min(least) } else { axis.first };
        let last = if self.given.last() > most { axis.last().max(most) } else { axis.last() };
        Axis { first, spacing: (last - first) / axis.cells as f64, ..*axis }
    }

    fn is_allowed(&self, axis: &Axis) -> bool {
        let unit = self.given.spacing;
        let [below, above] = [self.given.first - axis.first, axis.last() - self.given.last()];
        let most = if self.freedom.may_grow { MOST_SHIFT * unit } else { 0.0 };
        let is_near = [below, above].iter().all(|out| (-MOST_SHIFT * unit..=most).contains(out));
        let reaches = |out: f64, beyond: f64| out >= 0.0 || beyond >= MARGIN * axis.spacing;
        let covers = reaches(below, self.ends[0] - axis.first) && reaches(above, axis.last() - self.ends[1]);
        let stretch = (axis.spacing / unit - 1.0).abs();
        is_near && covers && stretch <= MOST_STRETCH * (1.0 + 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaks::Leak;

    /// Points of surfaces across x.
    fn leaks(walls: &[f32]) -> Leaks {
        let leak =
            |x: &f32| Leak { point: [*x, 0.5, 0.5], normal: [1.0, 0.0, 0.0], share: 0.0, probes: vec![] };
        Leaks { points: walls.iter().map(leak).collect(), hidden: 0 }
    }

    const FREE: Freedom = Freedom { may_grow: true, may_recount: true };

    /// The largest distance of walls from the middle between probes, in spacings, by the probes' own places.
    fn off(volume: &Volume, walls: &[f32]) -> f32 {
        let probes: Vec<f32> = (0..volume.counts[0]).map(|x| volume.position([x, 0, 0])[0]).collect();
        let spacing = volume.spacing()[0];
        let of_wall = |wall: &f32| {
            let middles = (0..=probes.len()).map(|k| probes[0] + (k as f32 - 0.5) * spacing);
            middles.map(|middle| (middle - wall).abs() / spacing).fold(f32::INFINITY, f32::min)
        };
        walls.iter().map(of_wall).fold(0.0, f32::max)
    }

    #[test]
    fn walls_come_to_lie_midway_between_probes() {
        let walls = [0.2, 2.2, 4.2];
        for lattice in [Lattice::Centres, Lattice::Corners] {
            let bounds = [[0.0; 3], [4.6, 1.0, 1.0]];
            let volume = Volume::with_spacing("hall".into(), bounds, 0.5, lattice).unwrap();
            let aligned = volume.aligned(&leaks(&walls), FREE);
            assert!(off(&volume, &walls) > 0.2 && off(&aligned, &walls) < 0.03, "{aligned:?}");
            // The other axes have no surface across them.
            for axis in [1, 2] {
                assert_eq!(aligned.bounds.map(|end| end[axis]), volume.bounds.map(|end| end[axis]));
            }
            let [old, new] = [&volume, &aligned].map(|volume| volume.spacing()[0]);
            assert!((new / old - 1.0).abs() < 0.1001, "{new}");
            for end in 0..2 {
                assert!((aligned.bounds[end][0] - volume.bounds[end][0]).abs() < 0.5001 * old);
            }
            assert!(aligned.bounds[0][0] < 0.2 && aligned.bounds[1][0] > 4.2);
            // Aligned again, it stays.
            assert_eq!(aligned.aligned(&leaks(&walls), FREE), aligned);
        }
    }

    #[test]
    fn a_volume_keeps_what_may_not_change() {
        let volume =
            Volume::new("hall".into(), [[0.0; 3], [4.6, 1.0, 1.0]], [9, 2, 2], Lattice::Centres).unwrap();
        for walls in [&[0.2, 2.13, 4.31][..], &[0.0, 4.6], &[1.7], &[]] {
            let held = volume.aligned(&leaks(walls), Freedom { may_grow: false, may_recount: false });
            assert_eq!(held.counts, volume.counts);
            assert!(held.bounds[0][0] >= 0.0 && held.bounds[1][0] <= 4.6, "{held:?}");
            assert!(off(&held, walls) <= off(&volume, walls), "{held:?}");
        }
    }
}
