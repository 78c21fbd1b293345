//! The taps of a material: where a pixel looks into a scale space, how wide, and with which weight.
//!
//! > B(R, V) ~ sum over j < J of a_j(theta_v) M(d_j, s_j(theta_v))
//!
//! d_j lies in the plane of R and N, turned from R by delta_j(theta_v) toward N.

use sphere::{DVec3, Direction};

use crate::ScaleSpace;

/// The rows of a table: row i is for 1 - cos(theta_v) = i / 64.
pub const ROWS: usize = 65;

/// One look-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tap {
    /// The angle from R toward N, in radians.
    pub delta: f64,
    /// The standard deviation of the blur, in radians.
    pub std: f64,
    /// The weight, RGB.
    pub weight: [f64; 3],
}

/// The taps of a material by the angle between normal and view.
#[derive(Clone, Debug, PartialEq)]
pub struct TapTable {
    /// [`ROWS`] rows of `taps` taps.
    rows: Vec<Vec<Tap>>,
}

impl TapTable {
    /// A table of [`ROWS`] rows; `None` if their number is another or their lengths differ.
    pub fn new(rows: Vec<Vec<Tap>>) -> Option<Self> {
        let is_even = rows.iter().all(|row| row.len() == rows[0].len());
        (rows.len() == ROWS && is_even).then_some(Self { rows })
    }

    /// The rows.
    pub fn rows(&self) -> &[Vec<Tap>] {
        &self.rows
    }

    /// The number J of taps.
    pub fn taps(&self) -> usize {
        self.rows[0].len()
    }

    /// The taps at a cosine between normal and view: linear between rows, the width in its logarithm.
    pub fn at(&self, cosine: f64) -> impl Iterator<Item = Tap> {
        let x = (1.0 - cosine).clamp(0.0, 1.0) * (ROWS - 1) as f64;
        let row = (x as usize).min(ROWS - 2);
        let share = x - row as f64;
        let mix = move |a: f64, b: f64| a + share * (b - a);
        self.rows[row].iter().zip(&self.rows[row + 1]).map(move |(a, b)| Tap {
            delta: mix(a.delta, b.delta),
            std: math::exp(mix(math::ln(a.std), math::ln(b.std))),
            weight: std::array::from_fn(|channel| mix(a.weight[channel], b.weight[channel])),
        })
    }

    /// The radiance toward a view, without the lights beside the scale space.
    pub fn radiance(&self, light: &ScaleSpace, normal: Direction, view: Direction) -> [f64; 3] {
        let (n, v) = (normal.vector(), view.vector());
        let cosine = n.dot(v).max(0.0);
        let r = (2.0 * cosine * n - v).normalize();
        let t = (n - cosine * r).try_normalize().unwrap_or(DVec3::ZERO);
        let mut sum = [0.0; 3];
        for tap in self.at(cosine) {
            let (sine, cosine) = math::sin_cos(tap.delta);
            let direction = Direction::normalised(cosine * r + sine * t);
            let blurred = light.blurred(direction, tap.std);
            (0..3).for_each(|channel| sum[channel] += tap.weight[channel] * blurred[channel]);
        }
        sum
    }
}
