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
use sh::f64x4::LANES as F64_LANES;
use sh::{Expansion, Stopped, rotate};
use sphere::{Cube, DVec3, Face, Rotation};

use super::parity_split_fourier::{StridedTerms, mirror};
use super::plan::{Group, SynthesisPlan};
use super::product::Product;
use super::spin::Rows;
use crate::Terms;

/// The values of all texels, [texels, rows].
pub(super) fn synthesise(plan: &SynthesisPlan<'_>, cube: Cube) -> Result<Vec<[f32; 3]>, Stopped> {
    let edge = cube.edge;
    let half = edge.div_ceil(2);
    let block = half.div_ceil(16).max(4);
    let mut values = vec![[0.0_f32; 3]; cube.len() * plan.rows()];
    let mut blocks: Vec<ColumnBlock<'_>> = (0..half)
        .step_by(block)
        .map(|first| ColumnBlock { plan, cube, first, last: (first + block).min(half), parts: Vec::new() })
        .collect();
    for row in values.as_flattened_mut().chunks_exact_mut(edge * plan.columns) {
        let (mut left, mut right) = row.split_at_mut(half * plan.columns);
        for block in &mut blocks {
            let (part, rest) = left.split_at_mut((block.last - block.first) * plan.columns);
            let (others, mirrored) = right.split_at_mut(right.len() - block.mirrored() * plan.columns);
            block.parts.push([part, mirrored]);
            (left, right) = (rest, others);
        }
    }
    // One pair after the other, and one group of its coefficients after the other: their series take more
    // memory than the faces.
    let mut buffers = Buffers::new(plan, cube);
    for faces in &PAIRS {
        buffers.fill_rows(plan, faces)?;
        for group in &plan.groups {
            let pair = Pair::new(plan, group, faces, cube, &mut buffers)?;
            blocks.par_iter_mut().with_max_len(1).try_for_each(|block| {
                plan.stop.check()?;
                plan.level.run(Columns { block, pair: &pair });
                Ok(())
            })?;
        }
    }
    Ok(values)
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

/// The memory for one pair of faces, which all pairs use: each writes the same places.
struct Buffers {
    waves: Waves,
    /// Rows alpha_i = pi (i + 1/2) / (F + 1), the southern half from the last row upward.
    north: Vec<f32>,
    south: Vec<f32>,
    /// t_km of one group, shape [terms in beta, F + 1, padded values]: of cos(k alpha) if m + q is even,
    /// otherwise of sin(k alpha).
    terms: Vec<f32>,
    across: Vec<f32>,
}

impl Buffers {
    fn new(plan: &SynthesisPlan<'_>, cube: Cube) -> Self {
        let count = plan.f + 1;
        let rows = count.div_ceil(2) * plan.series();
        let padded = plan.groups.iter().map(|group| group.padded).max().unwrap_or(0);
        Self {
            waves: Waves::new(count),
            north: vec![0.0; rows],
            south: vec![0.0; rows],
            terms: vec![0.0; plan.fourier.len() * count * padded],
            across: vec![0.0; count * cube.edge.div_ceil(2) * 4 * padded],
        }
    }

    /// Computes the rows around a pair of faces.
    fn fill_rows(&mut self, plan: &SynthesisPlan<'_>, faces: &Faces) -> Result<(), Stopped> {
        plan.stop.check()?;
        let lighting: Expansion = rotate(plan.reflection.lighting(), (faces.turn)());
        let count = plan.f + 1;
        let chunk = F64_LANES * plan.series();
        let chunks = self.north.par_chunks_mut(chunk).zip(self.south.par_chunks_mut(chunk));
        chunks.enumerate().try_for_each(|(task, (north, south))| {
            plan.stop.check()?;
            let rows = north.len() / plan.series();
            let alphas: Vec<f64> =
                (0..rows).map(|row| PI * ((task * F64_LANES + row) as f64 + 0.5) / count as f64).collect();
            plan.level.run(Rows { plan, lighting: &lighting, alphas: &alphas, north, south });
            Ok(())
        })
    }
}

/// One group of coefficients around a pair of faces.
struct Pair<'a> {
    group: &'a Group,
    faces: &'a Faces,
    /// The sums over m of t_km at the azimuth of each column of the left half, shape [F + 1, columns, 4
    /// parts, padded values].
    across: &'a [f32],
}

impl<'a> Pair<'a> {
    fn new(
        plan: &SynthesisPlan<'_>,
        group: &'a Group,
        faces: &'a Faces,
        cube: Cube,
        buffers: &'a mut Buffers,
    ) -> Result<Self, Stopped> {
        let (count, columns, padded) = (plan.f + 1, cube.edge.div_ceil(2), group.padded);
        let width = count * padded;
        let Buffers { waves, north, south, terms, across } = buffers;
        let terms = &mut terms[..plan.fourier.len() * width];
        let across = &mut across[..columns * 4 * width];
        let mut odd_orders = vec![false; plan.fourier.len()];
        for m in (1..=plan.f).step_by(2) {
            odd_orders[plan.fourier.cosine(m)] = true;
            odd_orders[plan.fourier.sine(m)] = true;
        }
        let orders = terms.par_chunks_mut(width).zip(odd_orders).enumerate();
        orders.try_for_each(|(place, (terms, odd))| {
            plan.stop.check()?;
            let rows = [&north[..], &south[..]];
            plan.level.run(Colatitude { plan, group, waves, rows, place, odd, terms });
            Ok(())
        })?;
        let mut betas = vec![0.0; columns * plan.fourier.len()];
        for (column, beta) in betas.chunks_exact_mut(plan.fourier.len()).enumerate() {
            let top = cube.direction(Face::PositiveZ, 0, column);
            plan.fourier.angle(math::sin_cos(top.phi()), beta);
        }
        let of_k = across.par_chunks_mut(columns * 4 * padded).enumerate();
        of_k.try_for_each(|(k, across)| {
            plan.stop.check()?;
            let terms = StridedTerms { values: &terms[k * padded..], step: width };
            plan.level.run(Across { plan, group, betas: &betas, terms, across });
            Ok(())
        })?;
        Ok(Self { group, faces, across })
    }
}

/// 2 / (F + 1) cos(k alpha) and sin(k alpha) at the northern rows, from which the mirrored ones follow.
struct Waves {
    /// The values by k and row for even k and for odd k, of cosines and of sines.
    values: [[Vec<f32>; 2]; 2],
    /// The number of northern rows.
    half: usize,
}

impl Waves {
    fn new(count: usize) -> Self {
        let half = count.div_ceil(2);
        let mut values: [[Vec<f32>; 2]; 2] = Default::default();
        for k in 0..count {
            for row in 0..half {
                // The middle row of an odd number is its own mirror.
                let mirrors = if 2 * row + 1 == count { 0.5 } else { 1.0 };
                let size = if k == 0 { 1.0 } else { 2.0 } / count as f64 * mirrors;
                let (sine, cosine) = math::sin_cos(PI * (k * (2 * row + 1)) as f64 / (2 * count) as f64);
                values[0][k % 2].push((size * cosine) as f32);
                values[1][k % 2].push((size * sine) as f32);
            }
        }
        Self { values, half }
    }
}

/// Takes samples at the rows to the series in alpha, for one term in beta.
struct Colatitude<'a> {
    plan: &'a SynthesisPlan<'a>,
    group: &'a Group,
    waves: &'a Waves,
    /// The samples in the north and in the south.
    rows: [&'a [f32]; 2],
    /// The place of the term in beta.
    place: usize,
    /// Whether the order m of the term in beta is odd.
    odd: bool,
    /// The terms in alpha, [k, padded values].
    terms: &'a mut [f32],
}

impl WithSimd for Colatitude<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { plan, group, waves, rows, place, odd, terms } = self;
        let padded = group.padded;
        let [north, south] = rows.map(|rows| rows.chunks_exact(plan.series()));
        let place = group.start + place * padded;
        // Values with m + q even are series of cosines, the others of sines.
        for (sines, waves_of) in waves.values.iter().enumerate() {
            let values = group.of_parity(odd != (sines == 1));
            let width = values.len();
            if width == 0 {
                continue;
            }
            let mut samples = vec![0.0; waves.half * width];
            for (parity, waves_of) in waves_of.iter().enumerate().take(plan.f + 1) {
                // cos(k (pi - alpha)) = (-1)^k cos(k alpha), sines the opposite: sums of mirrored rows, or
                // differences.
                let sign = if parity == sines { 1.0 } else { -1.0 };
                let mirrored = north.clone().zip(south.clone());
                for ((north, south), samples) in mirrored.zip(samples.chunks_exact_mut(width)) {
                    let [north, south] = [north, south].map(|row| &row[place..][values.clone()]);
                    for ((sample, north), south) in samples.iter_mut().zip(north).zip(south) {
                        *sample = north + sign * south;
                    }
                }
                let product = Product {
                    left: waves_of,
                    stride: waves.half,
                    inner: 0..waves.half,
                    right: S::as_simd_f32s(&samples).0,
                    right_step: width / S::F32_LANES,
                    vectors: width / S::F32_LANES,
                };
                let terms = &mut terms[parity * padded + values.start..];
                product.write(simd, S::as_mut_simd_f32s(terms).0, 2 * padded / S::F32_LANES);
            }
        }
    }
}

/// The sums over m of one k.
struct Across<'a> {
    plan: &'a SynthesisPlan<'a>,
    group: &'a Group,
    /// The terms in beta at each column, [columns, terms in beta].
    betas: &'a [f32],
    /// The values of k.
    terms: StridedTerms<'a>,
    across: &'a mut [f32],
}

impl WithSimd for Across<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { plan, group, betas, terms, across } = self;
        plan.fourier.sum(simd, betas, terms, group.padded, across);
    }
}

/// Some columns from the left of every face, and their mirrors from the right.
struct ColumnBlock<'a> {
    plan: &'a SynthesisPlan<'a>,
    cube: Cube,
    /// The first column of the block, which goes up to `last`.
    first: usize,
    last: usize,
    /// For each row of each face, these columns and their mirrors.
    parts: Vec<[&'a mut [f32]; 2]>,
}

impl ColumnBlock<'_> {
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

/// The texels of a block that lie on two faces.
struct Columns<'t, 'a> {
    block: &'t mut ColumnBlock<'a>,
    pair: &'t Pair<'t>,
}

impl WithSimd for Columns<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { block, pair } = self;
        let (plan, edge, group) = (block.plan, block.cube.edge, pair.group);
        let (fourier, padded, half) = (plan.fourier, group.padded, edge.div_ceil(2));
        let mut alphas = vec![0.0; half * fourier.len()];
        let mut places = Vec::with_capacity(half);
        let mut series = vec![0.0; fourier.len() * padded];
        let mut sums = vec![0.0; half * 4 * padded];
        let mut four = vec![0.0; 4 * padded];
        for column in block.first..block.last {
            places.clear();
            for (row, alpha) in alphas.chunks_exact_mut(fourier.len()).enumerate() {
                let v = block.cube.direction(Face::PositiveZ, row, column).vector();
                fourier.angle(((v.x * v.x + v.y * v.y).sqrt(), v.z), alpha);
                places.push(v);
            }
            let across = &pair.across[column * 4 * padded..];
            for mirrored in [false, true] {
                let column = if mirrored { edge - 1 - column } else { column };
                if mirrored && 2 * column + 1 == edge {
                    continue;
                }
                let sums_over_m = StridedTerms { values: across, step: half * 4 * padded };
                circle(plan, group, sums_over_m, mirrored, &mut series);
                let terms = StridedTerms { values: &series, step: padded };
                fourier.sum(simd, &alphas, terms, padded, &mut sums);
                for (row, sums) in sums.chunks_exact(4 * padded).enumerate() {
                    // At alpha, pi - alpha, -alpha and alpha + pi: the last two on the far face.
                    mirror(sums, &mut four);
                    for (i, values) in four.chunks_exact_mut(padded).enumerate() {
                        if i >= 2 {
                            values[group.of_parity(true)].iter_mut().for_each(|value| *value = -*value);
                        }
                        let mut place = places[row];
                        place.y *= if mirrored { -1.0 } else { 1.0 };
                        (place.x, place.y) = if i >= 2 { (-place.x, -place.y) } else { (place.x, place.y) };
                        let (row, height) =
                            if i % 2 == 0 { (row, place.z) } else { (edge - 1 - row, -place.z) };
                        place.z = height;
                        block.put(pair, i >= 2, [row, column], place, values);
                    }
                }
            }
        }
    }
}

impl ColumnBlock<'_> {
    /// Writes a group of a texel, given by its row, column and direction on the near or far side face.
    #[inline(always)]
    fn put(
        &mut self,
        Pair { group, faces, .. }: &Pair<'_>,
        far: bool,
        place: [usize; 2],
        turned: DVec3,
        values: &mut [f32],
    ) {
        let face = if far { faces.far } else { faces.near };
        let [mut row, mut column] = place;
        if faces.over {
            if self.plan.terms == Terms::All {
                spin_by(frame_turn(turned), group, values);
            }
            if far {
                (row, column) = (self.cube.edge - 1 - row, self.cube.edge - 1 - column);
            }
        }
        let out = &mut self.texel(face, row, column)[group.columns.clone()];
        out.iter_mut().zip(&group.places).for_each(|(out, place)| *out = values[*place]);
    }
}

/// The series in alpha of one column from the partial sums over m for each k: at the column's beta, or at
/// -beta.
#[inline(always)]
fn circle(
    plan: &SynthesisPlan<'_>,
    group: &Group,
    across: StridedTerms<'_>,
    mirrored: bool,
    series: &mut [f32],
) {
    let padded = group.padded;
    let sign = if mirrored { -1.0 } else { 1.0 };
    // Even m makes cosines of k if q is even, and sines if it is odd.
    let mut write = |k: usize, [of_even, of_odd]: [usize; 2], term: usize| {
        for (odd, parity) in [(false, of_even), (true, of_odd)] {
            let values = group.of_parity(odd);
            let part = |part: usize| &across.values[k * across.step + part * padded..][values.clone()];
            let (cosines, sines) = (part(parity), part(parity + 2));
            let out = &mut series[term * padded..][values.clone()];
            for ((out, cosine), sine) in out.iter_mut().zip(cosines).zip(sines) {
                *out = cosine + sign * sine;
            }
        }
    };
    for k in 0..=plan.f {
        write(k, [0, 1], plan.fourier.cosine(k));
        if k > 0 {
            write(k, [1, 0], plan.fourier.sine(k));
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
fn spin_by([cosine, sine]: [f64; 2], group: &Group, values: &mut [f32]) {
    let mut turn = [1.0, 0.0];
    let turns: Vec<[f32; 2]> = (0..group.p.end)
        .map(|_| {
            let [x, y]: [f64; 2] = turn;
            turn = [x * cosine - y * sine, y * cosine + x * sine];
            [x as f32, y as f32]
        })
        .collect();
    for &(q, [right, left]) in &group.pairs {
        let ([x, y], c, s) = (turns[q], values[right], values[left]);
        (values[right], values[left]) = (c * x - s * y, c * y + s * x);
    }
}
