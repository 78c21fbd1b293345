//! The widths of a scale space: a fixed ladder, four steps an octave, that the edge of the finest cube cuts
//! off.

use std::f64::consts::FRAC_PI_2;

/// The levels of a scale space whose finest cube has a given edge.
///
/// Level k has the standard deviation s_k = s_0 2^(k / 4) with s_0 = 2.4 / edge radians, and cubes of edge
/// `edge >> (k / 4)`, down to 2: level k is mip k / 4 of layer k % 4 of an array of four cubes. Edges are
/// powers of two, so that the widths of all scale spaces are those of one ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Widths {
    edge: usize,
}

/// The first width of a scale space that shows a highlight, as a share of the highlight's.
const SHARE_OF_HIGHLIGHT: f64 = 0.36;

impl Widths {
    /// The levels of an octave, and the layers of the array.
    pub const PER_OCTAVE: usize = 4;

    /// The standard deviation of the finest level times the edge of its faces.
    pub const SHARPEST: f64 = 2.4;

    /// The smallest and the largest edge.
    pub const EDGES: [usize; 2] = [8, 512];

    /// The levels of the finest scale space that a fit counts on: a tap is never narrower than its first.
    pub const FINEST: Self = Self { edge: 256 };

    /// The levels for an edge; `None` unless it is a power of two within [`Widths::EDGES`].
    pub fn new(edge: usize) -> Option<Self> {
        let [least, most] = Self::EDGES;
        (edge.is_power_of_two() && (least..=most).contains(&edge)).then_some(Self { edge })
    }

    /// The least widths that show a highlight of a standard deviation, in radians, seen head on: the first is
    /// a third of it; the finest there are, if none are fine enough.
    pub fn for_highlight(std: f64) -> Self {
        let [least, most] = Self::EDGES;
        let edge = (Self::SHARPEST / (SHARE_OF_HIGHLIGHT * std.max(1e-6))).ceil().min(most as f64) as usize;
        Self { edge: edge.next_power_of_two().clamp(least, most) }
    }

    /// The edge of the finest cube.
    pub fn edge(self) -> usize {
        self.edge
    }

    /// The number of mips: the last has an edge of 2.
    pub fn mips(self) -> usize {
        self.edge.ilog2() as usize
    }

    /// The number of levels.
    pub fn len(self) -> usize {
        self.mips() * Self::PER_OCTAVE
    }

    /// Whether there is no level, which no edge has.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The edge of level k.
    pub fn edge_of(self, k: usize) -> usize {
        (self.edge >> (k / Self::PER_OCTAVE)).max(1)
    }

    /// The standard deviation of level k, in radians.
    pub fn std(self, k: usize) -> f64 {
        self.std_at(k as f64)
    }

    /// The standard deviation at a place between levels, in radians: s_0 2^(x / 4).
    pub fn std_at(self, x: f64) -> f64 {
        Self::SHARPEST / self.edge as f64 * math::exp2(x / Self::PER_OCTAVE as f64)
    }

    /// The standard deviation that the texels of level k hold, in radians: a bilinear look-up between texels
    /// of side t = pi / (2 edge) blurs by a variance of t^2 / 6 more, which this leaves out.
    pub fn texel_std(self, k: usize) -> f64 {
        let texel = FRAC_PI_2 / self.edge_of(k) as f64;
        (math::powi(self.std(k), 2) - texel * texel / 6.0).sqrt()
    }

    /// The place of a standard deviation between the levels, x = 4 log2(s / s_0), at least 0 and below the
    /// last.
    pub fn place(self, std: f64) -> f64 {
        let x = Self::PER_OCTAVE as f64 * math::log2(std / self.std(0));
        x.clamp(0.0, (self.len() - 1) as f64 - 1e-3)
    }
}

/// The share of level k + 1 at the place k + `part`: linear in the variance.
pub(crate) fn share(part: f64) -> f64 {
    (math::exp2(0.5 * part) - 1.0) * (1.0 + std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sharper_highlight_needs_a_finer_level() {
        let edge = |std: f64| Widths::for_highlight(std).edge();
        // Of GGX, the standard deviation is sqrt(2) times the squared roughness.
        let of_roughness = |roughness: f64| edge(2.0_f64.sqrt() * roughness * roughness);
        assert_eq!([0.4, 0.3, 0.2, 0.15].map(of_roughness), [32, 64, 128, 256]);
        assert_eq!([edge(0.0), edge(10.0)], [512, 8]);
    }

    #[test]
    fn the_ladders_of_all_edges_are_one() {
        let (coarse, fine) = (Widths::new(64).unwrap(), Widths::new(128).unwrap());
        assert_eq!([coarse.len(), fine.len()], [24, 28]);
        for k in 0..coarse.len() {
            assert!((coarse.std(k) / fine.std(k + 4) - 1.0).abs() < 1e-12);
            assert_eq!(coarse.edge_of(k), fine.edge_of(k + 4));
        }
        assert_eq!([Widths::new(48), Widths::new(4), Widths::new(1024)], [None; 3]);
    }

    #[test]
    fn places_are_linear_in_the_variance() {
        let widths = Widths::new(64).unwrap();
        for (k, part) in [(0, 0.0), (3, 0.25), (10, 0.9)] {
            let std = widths.std(k) * (part / 4.0f64).exp2();
            assert!((widths.place(std) - (k as f64 + part)).abs() < 1e-9);
            let share = share(part);
            let variance = (1.0 - share) * widths.std(k).powi(2) + share * widths.std(k + 1).powi(2);
            assert!((variance.sqrt() / std - 1.0).abs() < 1e-9);
        }
        assert_eq!(widths.place(1e-3), 0.0);
    }
}
