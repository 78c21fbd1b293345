//! Cube maps: along a column of a side face beta is constant, and b_pq is a Fourier series of degree F in
//! alpha.
//!
//! The great circle through a column of a side face runs on through the opposite face's column at beta + pi:
//! b_pq(-alpha, beta) = (-1)^q b_pq(alpha, beta + pi), so that one series serves both. In two dimensions,
//!
//! > b_pq(alpha, beta) = sum over k, m of t_km (cos or sin)(k alpha) (cos or sin)(m beta),
//!
//! with cosines of k if m + q is even and sines if it is odd. The t_km of one pair of faces come from F + 1
//! rows of constant alpha ([`super::spin`]), by a discrete cosine or sine transform that is exact to degree
//! F.
//!
//! Every pair of opposite faces is made the pair at beta = 0 and pi by turning the lighting: about +Z for +-X
//! of the cube coordinates, by 90 degrees about +Y for +-Y. There the frames at the two images C and C' = Q C
//! of a direction differ by a turn about C: with frame(C') = Q frame(C) R_z(psi), b_p,q + i b_p,-q takes the
//! phase e^(i q psi).

use std::f64::consts::{FRAC_PI_2, PI};

use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::LANES;
use sh::{Expansion, rotate};
use sphere::{Cube, DVec3, Face, Rotation};

use super::parity_split_fourier::mirror;
use super::plan::SynthesisPlan;
use super::spin::Rows;
use crate::Terms;

/// The values of all texels, [texels, rows].
pub(super) fn synthesise(plan: &SynthesisPlan<'_>, cube: Cube) -> Vec<[f32; 3]> {
    let edge = cube.edge;
    let pairs: Vec<Pair> = PAIRS.par_iter().map(|pair| Pair::new(plan, pair)).collect();
    let half = edge.div_ceil(2);
    let block = half.div_ceil(16).max(4);
    let mut values = vec![[0.0_f32; 3]; cube.len() * plan.rows()];
    let mut tasks: Vec<Task<'_>> = (0..half)
        .step_by(block)
        .map(|first| Task {
            plan,
            cube,
            pairs: &pairs,
            first,
            last: (first + block).min(half),
            parts: Vec::new(),
        })
        .collect();
    for row in values.as_flattened_mut().chunks_exact_mut(edge * plan.columns) {
        let (mut left, mut right) = row.split_at_mut(half * plan.columns);
        for task in &mut tasks {
            let (part, rest) = left.split_at_mut((task.last - task.first) * plan.columns);
            let (others, mirrored) = right.split_at_mut(right.len() - task.mirrored() * plan.columns);
            task.parts.push([part, mirrored]);
            (left, right) = (rest, others);
        }
    }
    tasks.into_par_iter().with_max_len(1).for_each(|task| plan.level.run(task));
    values
}

/// Two opposite faces, and how the lighting is rotated so that they lie at beta = 0 and pi.
struct Faces {
    near: Face,
    far: Face,
    turn: fn() -> Rotation,
    /// Whether the turn moves the pole: the far face is then upside down, and frames turn.
    over: bool,
}

const PAIRS: [Faces; 3] = [
    Faces { near: Face::PositiveZ, far: Face::NegativeZ, turn: || Rotation::IDENTITY, over: false },
    Faces {
        near: Face::PositiveX,
        far: Face::NegativeX,
        turn: || Rotation::from_yaw_pitch_roll(FRAC_PI_2, 0.0, 0.0),
        over: false,
    },
    Faces {
        near: Face::PositiveY,
        far: Face::NegativeY,
        turn: || Rotation::from_yaw_pitch_roll(0.0, FRAC_PI_2, 0.0),
        over: true,
    },
];

/// The field around a pair of faces.
struct Pair<'a> {
    faces: &'a Faces,
    /// t_km, shape [terms in beta, F + 1, padded values]: of cos(k alpha) if m + q is even, otherwise of
    /// sin(k alpha).
    terms: Vec<f64>,
}

impl<'a> Pair<'a> {
    fn new(plan: &SynthesisPlan<'_>, faces: &'a Faces) -> Self {
        let lighting: Expansion = rotate(plan.reflection.lighting(), (faces.turn)());
        let count = plan.f + 1;
        let half = count.div_ceil(2);
        // Rows alpha_i = pi (i + 1/2) / (F + 1), the southern half from the last row upward.
        let mut north = vec![0.0; half * plan.series()];
        let mut south = vec![0.0; half * plan.series()];
        let chunk = LANES * plan.series();
        for (task, (north, south)) in north.chunks_mut(chunk).zip(south.chunks_mut(chunk)).enumerate() {
            let rows = north.len() / plan.series();
            let alphas: Vec<f64> =
                (0..rows).map(|row| PI * ((task * LANES + row) as f64 + 0.5) / count as f64).collect();
            plan.level.run(Rows { plan, lighting: &lighting, alphas: &alphas, north, south });
        }
        let mut terms = vec![0.0; plan.fourier.len() * count * plan.padded];
        plan.level.run(Colatitude { plan, north: &north, south: &south, terms: &mut terms });
        Self { faces, terms }
    }
}

/// From samples at the rows to the series in alpha, for every term in beta.
struct Colatitude<'a> {
    plan: &'a SynthesisPlan<'a>,
    north: &'a [f64],
    south: &'a [f64],
    terms: &'a mut [f64],
}

impl WithSimd for Colatitude<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { plan, north, south, terms } = self;
        let (f, padded) = (plan.f, plan.padded);
        let count = f + 1;
        let half = count.div_ceil(2);
        // [k, row]: 2 / (F + 1) cos(k alpha), and sin; the middle row of an odd number is its own mirror.
        let mut weights = vec![[0.0; 2]; count * half];
        for k in 0..count {
            for row in 0..half {
                let mirrors = if 2 * row + 1 == count { 0.5 } else { 1.0 };
                let size = if k == 0 { 1.0 } else { 2.0 } / count as f64 * mirrors;
                let (sine, cosine) = (PI * (k * (2 * row + 1)) as f64 / (2 * count) as f64).sin_cos();
                weights[k * half + row] = [size * cosine, size * sine];
            }
        }
        let mut sums = vec![0.0; 2 * half * padded];
        let mut line = vec![0.0; 2 * padded];
        for m in 0..=f {
            let places = [Some(plan.fourier.cosine(m)), (m > 0).then(|| plan.fourier.sine(m))];
            for place in places.into_iter().flatten() {
                // Sums and differences of mirrored rows: cos(k (pi - alpha)) = (-1)^k cos(k alpha), sines the
                // opposite.
                let (plus, minus) = sums.split_at_mut(half * padded);
                for row in 0..half {
                    let from = row * plan.series() + place * padded;
                    let (n, s) = (&north[from..][..padded], &south[from..][..padded]);
                    let plus = &mut plus[row * padded..][..padded];
                    let minus = &mut minus[row * padded..][..padded];
                    for i in 0..padded {
                        (plus[i], minus[i]) = (n[i] + s[i], n[i] - s[i]);
                    }
                }
                let (even, odd) = line.split_at_mut(padded);
                for k in 0..count {
                    let (for_cosines, for_sines) =
                        if k % 2 == 0 { (&*plus, &*minus) } else { (&*minus, &*plus) };
                    even.fill(0.0);
                    odd.fill(0.0);
                    for row in 0..half {
                        let [cosine, sine] = weights[k * half + row];
                        let (c, s) =
                            (&for_cosines[row * padded..][..padded], &for_sines[row * padded..][..padded]);
                        for i in 0..padded {
                            even[i] += cosine * c[i];
                            odd[i] += sine * s[i];
                        }
                    }
                    let out = &mut terms[(place * count + k) * padded..][..padded];
                    for i in 0..padded {
                        out[i] = if plan.odd[i] == (m % 2 == 1) { even[i] } else { odd[i] };
                    }
                }
            }
        }
    }
}

/// Some columns from the left of every face, and their mirrors from the right.
struct Task<'a> {
    plan: &'a SynthesisPlan<'a>,
    cube: Cube,
    pairs: &'a [Pair<'a>],
    /// Columns first .. last.
    first: usize,
    last: usize,
    /// For each row of each face, these columns and their mirrors.
    parts: Vec<[&'a mut [f32]; 2]>,
}

impl Task<'_> {
    /// The number of columns that have a mirror: the middle one of an odd edge has none.
    fn mirrored(&self) -> usize {
        self.last.min(self.cube.edge / 2) - self.first
    }

    fn texel(&mut self, face: Face, row: usize, column: usize) -> &mut [f32] {
        let (edge, columns) = (self.cube.edge, self.plan.columns);
        let mirrored = self.mirrored();
        let [left, right] = &mut self.parts[face as usize * edge + row];
        if column < edge.div_ceil(2) {
            &mut left[(column - self.first) * columns..][..columns]
        } else {
            &mut right[(column + self.first + mirrored - edge) * columns..][..columns]
        }
    }
}

impl WithSimd for Task<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (plan, edge) = (self.plan, self.cube.edge);
        let (fourier, padded, count) = (plan.fourier, plan.padded, plan.f + 1);
        let (width, half) = (count * padded, edge.div_ceil(2));
        let columns = self.first..self.last;
        let direction = |row, column| self.cube.direction(Face::PositiveZ, row, column);
        let mut betas = vec![0.0; columns.len() * fourier.len()];
        let mut alphas = vec![0.0; columns.len() * half * fourier.len()];
        let mut places = Vec::with_capacity(columns.len() * half);
        for (column, (beta, alpha)) in columns
            .clone()
            .zip(betas.chunks_exact_mut(fourier.len()).zip(alphas.chunks_exact_mut(half * fourier.len())))
        {
            let top = direction(0, column);
            fourier.angle(top.phi().sin_cos(), beta);
            for (row, alpha) in alpha.chunks_exact_mut(fourier.len()).enumerate() {
                let v = direction(row, column).vector();
                fourier.angle(((v.x * v.x + v.y * v.y).sqrt(), v.z), alpha);
                places.push(v);
            }
        }
        let mut across = vec![0.0; columns.len() * 4 * width];
        let mut series = vec![0.0; plan.series()];
        let mut sums = vec![0.0; half * 4 * padded];
        let mut four = vec![0.0; 4 * padded];
        let flip: Vec<f64> = plan.odd.iter().map(|odd| if *odd { -1.0 } else { 1.0 }).collect();
        for pair in self.pairs {
            fourier.sum(simd, &betas, &pair.terms, width, &mut across);
            for (index, column) in columns.clone().enumerate() {
                let across = &across[index * 4 * width..][..4 * width];
                let alphas = &alphas[index * half * fourier.len()..][..half * fourier.len()];
                let places = &places[index * half..][..half];
                for mirrored in [false, true] {
                    let column = if mirrored { edge - 1 - column } else { column };
                    if mirrored && 2 * column + 1 == edge {
                        continue;
                    }
                    circle(plan, across, mirrored, &mut series);
                    fourier.sum(simd, alphas, &series, padded, &mut sums);
                    for (row, sums) in sums.chunks_exact(4 * padded).enumerate() {
                        // At alpha, pi - alpha, -alpha and alpha + pi: the last two on the far face.
                        mirror(sums, &mut four);
                        for (i, values) in four.chunks_exact_mut(padded).enumerate() {
                            if i >= 2 {
                                for (value, flip) in values.iter_mut().zip(&flip) {
                                    *value *= flip;
                                }
                            }
                            let mut place = places[row];
                            place.y *= if mirrored { -1.0 } else { 1.0 };
                            (place.x, place.y) =
                                if i >= 2 { (-place.x, -place.y) } else { (place.x, place.y) };
                            let (row, height) =
                                if i % 2 == 0 { (row, place.z) } else { (edge - 1 - row, -place.z) };
                            place.z = height;
                            self.put(pair.faces, i >= 2, [row, column], place, values);
                        }
                    }
                }
            }
        }
    }
}

impl Task<'_> {
    /// Writes a texel, given by its row, column and direction on the near or far side face.
    #[inline(always)]
    fn put(&mut self, faces: &Faces, far: bool, place: [usize; 2], turned: DVec3, values: &mut [f64]) {
        let face = if far { faces.far } else { faces.near };
        let [mut row, mut column] = place;
        if faces.over {
            if self.plan.terms == Terms::All {
                spin_by(frame_turn(turned), self.plan.reflection.brdf().p().get(), values);
            }
            if far {
                (row, column) = (self.cube.edge - 1 - row, self.cube.edge - 1 - column);
            }
        }
        for (out, value) in self.texel(face, row, column).iter_mut().zip(values) {
            *out = *value as f32;
        }
    }
}

/// The series in alpha of one column from the partial sums over m: at the column's beta, or at -beta.
#[inline(always)]
fn circle(plan: &SynthesisPlan<'_>, across: &[f64], mirrored: bool, series: &mut [f64]) {
    let (padded, width) = (plan.padded, across.len() / 4);
    let sign = if mirrored { -1.0 } else { 1.0 };
    for k in 0..=plan.f {
        let part = |part: usize| &across[part * width + k * padded..][..padded];
        let [ce, co, se, so] = [part(0), part(1), part(2), part(3)];
        let cosine = plan.fourier.cosine(k) * padded;
        // Even m makes cosines of k if q is even, and sines if it is odd.
        let out = &mut series[cosine..][..padded];
        for i in 0..padded {
            let (even, odd) = (ce[i] + sign * se[i], co[i] + sign * so[i]);
            out[i] = if plan.odd[i] { odd } else { even };
        }
        if k > 0 {
            let sine = plan.fourier.sine(k) * padded;
            let out = &mut series[sine..][..padded];
            for i in 0..padded {
                let (even, odd) = (ce[i] + sign * se[i], co[i] + sign * so[i]);
                out[i] = if plan.odd[i] { even } else { odd };
            }
        }
    }
}

/// [cos(psi), sin(psi)] with frame(C') = Q frame(C) R_z(psi), Q the turn by 90 degrees about +Y, at C' = Q C.
///
/// frame(C) takes +X and +Y to south and east at C = Q^-1 C' = (-z', y', x'). South at C', turned back, is
/// cos(psi) south + sin(psi) east at C: with C' on the unit sphere, -(x' z', y') / sqrt((x'^2 + y'^2) (z'^2 +
/// y'^2)).
fn frame_turn(turned: DVec3) -> [f64; 2] {
    let y = turned.y * turned.y;
    let size = ((turned.x * turned.x + y) * (turned.z * turned.z + y)).sqrt();
    // C is a pole: beta is 0 there.
    if size == 0.0 { [turned.x, 0.0] } else { [-turned.x * turned.z / size, -turned.y / size] }
}

/// Turns coefficients about their +Z by psi: c' = c cos(q psi) - s sin(q psi), s' = c sin(q psi) + s cos(q
/// psi).
fn spin_by([cosine, sine]: [f64; 2], p: usize, values: &mut [f64]) {
    let (mut x, mut y) = (cosine, sine);
    for q in 1..=p {
        for p in q..=p {
            let middle = p * p + p;
            for channel in 0..3 {
                let (right, left) = (3 * (middle + q) + channel, 3 * (middle - q) + channel);
                let (c, s) = (values[right], values[left]);
                (values[right], values[left]) = (c * x - s * y, c * y + s * x);
            }
        }
        (x, y) = (x * cosine - y * sine, y * cosine + x * sine);
    }
}
