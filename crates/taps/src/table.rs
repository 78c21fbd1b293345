//! The taps of a material: where a pixel looks into a scale space, how wide, and with which weight.
//!
//! > B(R, V) ~ sum over j < J of a_j(theta_v) M(d_j, s_j(theta_v))
//! > + sum over k < K of b_k(theta_v) H(N, y_k(theta_v))
//!
//! d_j lies in the plane of R and N, turned from R by delta_j(theta_v) toward N. H is the light about the
//! normal.

use sphere::{DVec3, Direction};

use crate::ScaleSpace;

/// The rows of a table: row i is for 1 - cos(theta_v) = i / 64.
pub const ROWS: usize = 65;

/// A look-up in the levels of a scale space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tap {
    /// The angle from R toward N, in radians.
    pub delta: f64,
    /// The standard deviation of the blur, in radians.
    pub std: f64,
    /// The weight, RGB.
    pub weight: [f64; 3],
}

/// A look-up in the kernels about the normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NormalTap {
    /// The kernel, 0 (the hemisphere) to 1 (the cosine).
    pub y: f64,
    /// The weight, RGB.
    pub weight: [f64; 3],
}

/// The taps toward one view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TapRow {
    /// The look-ups in the levels.
    pub taps: Vec<Tap>,
    /// The look-ups about the normal.
    pub normals: Vec<NormalTap>,
}

impl TapRow {
    /// The taps between two rows: linear, the width in its logarithm.
    fn between(low: &Self, high: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        let colour = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|channel| mix(a[channel], b[channel]));
        let tap = |(a, b): (&Tap, &Tap)| Tap {
            delta: mix(a.delta, b.delta),
            std: math::exp(mix(math::ln(a.std), math::ln(b.std))),
            weight: colour(a.weight, b.weight),
        };
        let normal = |(a, b): (&NormalTap, &NormalTap)| NormalTap {
            y: mix(a.y, b.y),
            weight: colour(a.weight, b.weight),
        };
        Self {
            taps: low.taps.iter().zip(&high.taps).map(tap).collect(),
            normals: low.normals.iter().zip(&high.normals).map(normal).collect(),
        }
    }
}

/// The taps of a material by the angle between normal and view.
#[derive(Clone, Debug, PartialEq)]
pub struct TapTable {
    rows: Vec<TapRow>,
}

impl TapTable {
    /// A table of [`ROWS`] rows; `None` if their number is another, they have not the same numbers of taps,
    /// or a width is not above 0.
    pub fn new(rows: Vec<TapRow>) -> Option<Self> {
        let counts = |row: &TapRow| (row.taps.len(), row.normals.len());
        let is_even = rows.windows(2).all(|rows| counts(&rows[0]) == counts(&rows[1]));
        let is_wide = rows.iter().flat_map(|row| &row.taps).all(|tap| tap.std > 0.0);
        (rows.len() == ROWS && is_even && is_wide).then_some(Self { rows })
    }

    /// A table of rows that were made alike.
    pub(crate) fn from_rows(rows: Vec<TapRow>) -> Self {
        Self { rows }
    }

    /// The rows, from the view along the normal to the horizon.
    pub fn rows(&self) -> &[TapRow] {
        &self.rows
    }

    /// The number J of look-ups in the levels.
    pub fn taps(&self) -> usize {
        self.rows[0].taps.len()
    }

    /// The number K of look-ups about the normal.
    pub fn normals(&self) -> usize {
        self.rows[0].normals.len()
    }

    /// The taps toward a view at this cosine from the normal: linear between rows, the width in its
    /// logarithm.
    pub fn at(&self, cosine: f64) -> TapRow {
        let x = (1.0 - cosine).clamp(0.0, 1.0) * (ROWS - 1) as f64;
        let row = (x as usize).min(ROWS - 2);
        TapRow::between(&self.rows[row], &self.rows[row + 1], x - row as f64)
    }

    /// The table between this and another with as many taps.
    pub(crate) fn between(&self, other: &Self, share: f64) -> Self {
        let rows = self.rows.iter().zip(&other.rows);
        Self { rows: rows.map(|(low, high)| TapRow::between(low, high, share)).collect() }
    }

    /// The table with other weights.
    pub(crate) fn with_weights(mut self, weight: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for row in &mut self.rows {
            row.taps.iter_mut().for_each(|tap| tap.weight = weight(tap.weight));
            row.normals.iter_mut().for_each(|tap| tap.weight = weight(tap.weight));
        }
        self
    }

    /// The radiance toward a view, RGB, both directions in the world; the lights beside the scale space are
    /// not in it.
    pub fn radiance(&self, light: &ScaleSpace, normal: Direction, view: Direction) -> [f64; 3] {
        let (n, v) = (normal.vector(), view.vector());
        let cosine = n.dot(v).max(0.0);
        let r = (2.0 * cosine * n - v).normalize();
        let toward = (n - cosine * r).try_normalize().unwrap_or(DVec3::ZERO);
        let row = self.at(cosine);
        let mut sum = [0.0; 3];
        let mut add = |weight: [f64; 3], light: [f64; 3]| {
            (0..3).for_each(|channel| sum[channel] += weight[channel] * light[channel]);
        };
        for tap in &row.taps {
            let (s, c) = math::sin_cos(tap.delta);
            add(tap.weight, light.blurred(Direction::normalised(c * r + s * toward), tap.std));
        }
        for tap in &row.normals {
            add(tap.weight, light.about_normal(normal, tap.y));
        }
        sum
    }
}
