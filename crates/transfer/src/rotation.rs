//! The rotation of coefficients by the frames of eight vertices at a time.
//!
//! R_z(alpha) R_y(beta) R_z(gamma), with the turn about y as a turn about x by 90 degrees, one about z and
//! one about x by -90 degrees: R_y(beta) = R_x(-90) R_z(beta) R_x(90) (the second method of [KSS02, app.]). A
//! turn about z mixes the pairs of each m. The turn about x by 90 degrees takes (x, y, z) to (x, -z, y): it
//! turns functions that are even in y into such that are even in z, and back, so that only a quarter of its
//! entries is not zero ([`column`]). About 350 operations for degree 4.
//!
//! Bands do not mix. Those up to degree 4 stay in registers from the first turn to the last.

use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;
use sh::{Degree, Expansion, rotate};
use sphere::Rotation;

use crate::frames::{Angles, LANES};
use crate::vectors::{load, store};

/// Coefficients of eight vertices, [(F+1)^2][8].
pub(crate) type Lanes = [[f32; LANES]];

/// The turn about x by 90 degrees, for coefficients up to a degree.
pub(crate) struct FrameRotation {
    degree: usize,
    /// The turns of each band, from degree 1 on.
    bands: Vec<Quarter>,
}

/// The entries of the turns about x by 90 degrees and by -90 that [`column`] names: [2 l + 1][l / 2 + 1].
struct Quarter {
    turn: Vec<f32>,
    back: Vec<f32>,
}

/// Cosine and sine of 1 to F times the three angles of a rotation, the first turn first.
pub(crate) type Multiples = Vec<[[[f32; LANES]; 2]; 3]>;

/// The column of the k-th entry that is not zero in a row of the turn about x by 90 degrees, and by -90, in
/// the band of degree l.
#[inline(always)]
fn column(l: usize, row: usize, k: usize) -> Option<usize> {
    // Row l + m is even in z if l + m is even, in y if m >= 0.
    let odd = (l + usize::from(row < l)) % 2;
    if row.is_multiple_of(2) {
        let m = odd + 2 * k;
        (m <= l).then_some(l + m)
    } else {
        let m = 2 - odd + 2 * k;
        (m <= l).then(|| l - m)
    }
}

/// The turns about x by 90 degrees and by -90 of coefficients up to a degree, for shaders that turn a light
/// into the frames of vertices [KSS02, app.]: for each band from degree 1 on the entries [2 l + 1, l / 2 +
/// 1], those of a row that are not zero (0 if they are fewer).
pub fn quarter_turns(degree: Degree) -> Vec<[f32; 2]> {
    let entries =
        |quarter: Quarter| quarter.turn.into_iter().zip(quarter.back).map(|(turn, back)| [turn, back]);
    FrameRotation::new(degree).bands.into_iter().flat_map(entries).collect()
}

impl FrameRotation {
    pub(crate) fn new(degree: Degree) -> Self {
        let rows = degree.rows();
        let turn = Rotation::from_yaw_pitch_roll(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let mut matrix = vec![0.0; rows * rows];
        for column in 0..rows {
            let mut unit = Expansion::zero(degree);
            unit.coefficients_mut()[column] = [1.0; 3];
            for (row, [value, ..]) in rotate(&unit, turn).coefficients().iter().enumerate() {
                matrix[row * rows + column] = *value as f32;
            }
        }
        let band = |l: usize| {
            let entries = |entry: &dyn Fn(usize, usize) -> f32| {
                let places = (0..=2 * l).flat_map(|row| (0..=l / 2).map(move |k| (row, column(l, row, k))));
                places.map(|(row, column)| column.map_or(0.0, |column| entry(row, column))).collect()
            };
            let at = |row: usize, column: usize| matrix[(l * l + row) * rows + l * l + column];
            Quarter { turn: entries(&at), back: entries(&|row, column| at(column, row)) }
        };
        Self { degree: degree.get(), bands: (1..=degree.get()).map(band).collect() }
    }

    /// Makes the memory for the turns.
    pub(crate) fn room(&self) -> Multiples {
        vec![[[[0.0; LANES]; 2]; 3]; self.degree]
    }

    /// Turns functions in the frames of the vertices into the world: one function or several in a row.
    #[inline(always)]
    pub(crate) fn to_world<S: Simd>(&self, simd: S, angles: &Angles, c: &mut Lanes, room: &mut Multiples) {
        multiples(simd, [&angles.gamma, &angles.beta, &angles.alpha], 1.0, room);
        self.turn(simd, room, c);
    }

    /// Turns functions in the world into the frames of the vertices.
    #[inline(always)]
    pub(crate) fn to_local<S: Simd>(&self, simd: S, angles: &Angles, c: &mut Lanes, room: &mut Multiples) {
        multiples(simd, [&angles.alpha, &angles.beta, &angles.gamma], -1.0, room);
        self.turn(simd, room, c);
    }

    #[inline(always)]
    fn turn<S: Simd>(&self, simd: S, room: &Multiples, c: &mut Lanes) {
        let rows = (self.degree + 1) * (self.degree + 1);
        for c in c.chunks_exact_mut(rows) {
            for (index, quarter) in self.bands.iter().enumerate() {
                let l = index + 1;
                let band = &mut c[l * l..][..2 * l + 1];
                match l {
                    1 => turn_fixed::<S, 3>(simd, quarter, room, band),
                    2 => turn_fixed::<S, 5>(simd, quarter, room, band),
                    3 => turn_fixed::<S, 7>(simd, quarter, room, band),
                    4 => turn_fixed::<S, 9>(simd, quarter, room, band),
                    _ => {
                        let mut from: Vec<S::f32s> = band.iter().map(|lanes| load(simd, lanes)).collect();
                        turn_band(simd, quarter, room, &mut from, &mut vec![simd.splat_f32s(0.0); 2 * l + 1]);
                        band.iter_mut().zip(from).for_each(|(lanes, vector)| store(simd, vector, lanes));
                    }
                }
            }
        }
    }

    /// [`FrameRotation::to_world`], for callers that are no kernels.
    pub(crate) fn turn_to_world(&self, angles: &Angles, c: &mut Lanes) {
        SimdLevel::detect().run(Turn { rotation: self, angles, inverse: false, c });
    }

    /// [`FrameRotation::to_local`], for callers that are no kernels.
    pub(crate) fn turn_to_local(&self, angles: &Angles, c: &mut Lanes) {
        SimdLevel::detect().run(Turn { rotation: self, angles, inverse: true, c });
    }
}

struct Turn<'a> {
    rotation: &'a FrameRotation,
    angles: &'a Angles,
    inverse: bool,
    c: &'a mut Lanes,
}

impl WithSimd for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut room = self.rotation.room();
        if self.inverse {
            self.rotation.to_local(simd, self.angles, self.c, &mut room);
        } else {
            self.rotation.to_world(simd, self.angles, self.c, &mut room);
        }
    }
}

/// Cosines and sines of the multiples of angles with a sign, from those of the angles.
#[inline(always)]
fn multiples<S: Simd>(simd: S, angles: [&[[f32; LANES]; 2]; 3], sign: f32, room: &mut Multiples) {
    for (place, [cosine, sine]) in angles.into_iter().enumerate() {
        let (cosine, sine) = (load(simd, cosine), simd.mul_f32s(load(simd, sine), simd.splat_f32s(sign)));
        let (mut x, mut y) = (cosine, sine);
        for multiples in room.iter_mut() {
            let [own_x, own_y] = &mut multiples[place];
            store(simd, x, own_x);
            store(simd, y, own_y);
            (x, y) = mix(simd, (x, y), (cosine, sine));
        }
    }
}

/// The product of complex numbers.
#[inline(always)]
fn mix<S: Simd>(simd: S, (a, b): (S::f32s, S::f32s), (x, y): (S::f32s, S::f32s)) -> (S::f32s, S::f32s) {
    let (re, im) = (simd.mul_f32s(a, x), simd.mul_f32s(a, y));
    (simd.negate_mul_add_f32s(b, y, re), simd.mul_add_f32s(b, x, im))
}

#[inline(always)]
fn turn_fixed<S: Simd, const WIDTH: usize>(simd: S, quarter: &Quarter, room: &Multiples, band: &mut Lanes) {
    let Some(band) = band.first_chunk_mut::<WIDTH>() else { return };
    let mut from: [S::f32s; WIDTH] = std::array::from_fn(|row| load(simd, &band[row]));
    turn_band(simd, quarter, room, &mut from, &mut [simd.splat_f32s(0.0); WIDTH]);
    for (lanes, vector) in band.iter_mut().zip(from) {
        store(simd, vector, lanes);
    }
}

/// Turns a band of degree l, [2 l + 1].
#[inline(always)]
fn turn_band<S: Simd>(simd: S, quarter: &Quarter, room: &Multiples, c: &mut [S::f32s], work: &mut [S::f32s]) {
    about_z(simd, room, 0, c);
    about_x(simd, &quarter.turn, c, work);
    about_z(simd, room, 1, work);
    about_x(simd, &quarter.back, work, c);
    about_z(simd, room, 2, c);
}

/// The turn of a band about z.
#[inline(always)]
fn about_z<S: Simd>(simd: S, room: &Multiples, place: usize, c: &mut [S::f32s]) {
    let l = c.len() / 2;
    for (index, multiples) in room[..l].iter().enumerate() {
        let [x, y] = &multiples[place];
        let (even, odd) = (l + index + 1, l - index - 1);
        (c[even], c[odd]) = mix(simd, (c[even], c[odd]), (load(simd, x), load(simd, y)));
    }
}

/// The turn of a band about x by 90 degrees or back.
#[inline(always)]
fn about_x<S: Simd>(simd: S, entries: &[f32], from: &[S::f32s], to: &mut [S::f32s]) {
    let l = from.len() / 2;
    let entries = &entries[..(2 * l + 1) * (l / 2 + 1)];
    for row in 0..2 * l + 1 {
        let mut sum = simd.splat_f32s(0.0);
        for k in 0..l / 2 + 1 {
            if let Some(column) = column(l, row, k) {
                let entry = simd.splat_f32s(entries[row * (l / 2 + 1) + k]);
                let product = |sum| simd.mul_add_f32s(entry, from[column], sum);
                sum = if k == 0 { simd.mul_f32s(entry, from[column]) } else { product(sum) };
            }
        }
        to[row] = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The entries that are left out of the turn about x are zero, and the others are all in it once.
    #[test]
    fn a_quarter_of_the_entries_is_the_whole_turn() {
        let degree = Degree::new(9).unwrap();
        let turn = Rotation::from_yaw_pitch_roll(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        for l in 0..=degree.get() {
            for from in 0..=2 * l {
                let mut unit = Expansion::zero(degree);
                unit.coefficients_mut()[l * l + from] = [1.0; 3];
                let turned = rotate(&unit, turn);
                for row in 0..=2 * l {
                    let named = (0..=l / 2).filter(|k| column(l, row, *k) == Some(from)).count();
                    let value = turned.coefficients()[l * l + row][0];
                    assert!(named == 1 || named == 0 && value.abs() < 1e-12, "{l} {row} {from}: {value}");
                }
            }
        }
    }
}
