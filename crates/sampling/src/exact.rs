//! Leaves in which points follow f itself: z by inverting its distribution in the leaf, then phi given z.
//!
//! In a leaf, f is a Chebyshev series in theta over the row, theta from the nearer pole, whose coefficients
//! are Taylor series in phi about the column's centre. Both are exact to single precision: a leaf spans less
//! than a period of the highest harmonic, but for the rows at the poles, which have more terms. The density
//! of theta in a leaf, sin(theta) times the integral over its column, is another Chebyshev series. Both
//! distributions are inverted by bracketed Newton iteration, many points abreast, and the density told is f
//! at the point over the leaf's integral.
//!
//! Memory: some 300 bytes for each leaf, so 2.5 MB at degree 19 and 700 MB at degree 255.

use std::array::from_fn;
use std::f64::consts::PI;

use pulp::Simd;
use sh::Basis;
use sh::f64x4::{Lanes, SimdLevel};

use crate::LeafGrid;
use crate::f32x8::{F32x8, LANES, load, store};
use crate::synthesis::{Columns, Fourier};
use crate::tables::{ColumnTable, Tables};

/// Terms of the Taylor series along a column, one for each lane: m h stays below pi / 6, and
/// (pi / 6)^8 / 8! = 1e-7.
const TAYLOR: usize = LANES;

/// Vectors of points abreast: their steps fill each other's latency, and their sums fit into registers.
const VECTORS: usize = 2;

/// Points abreast.
pub(crate) const WIDTH: usize = VECTORS * LANES;

/// The largest number of terms, at degree 2048.
const MOST_TERMS: usize = 64;

/// One row's series.
#[derive(Clone, Copy)]
struct Row {
    terms: usize,
    /// The sum of terms of the rows before.
    start: usize,
    /// theta at the middle, from the nearer pole, and half of its range.
    middle: f64,
    half: f64,
}

/// The series of all leaves.
#[derive(Clone)]
pub(crate) struct ExactLeaves {
    grid: LeafGrid,
    basis: Basis,
    rows: Vec<Row>,
    /// The density of theta: by row, then column, then term.
    densities: Vec<f32>,
    /// f: by row, then column, then term, the lanes being powers of phi.
    series: Vec<F32x8>,
    /// For each m: (m h)^k / k!, h being half a column.
    taylor: Vec<[f32; TAYLOR]>,
}

/// The memory of [`ExactLeaves::draw`], by term, then point.
pub(crate) struct Scratch {
    /// The density of theta and its integral.
    density: [[f32; WIDTH]; MOST_TERMS],
    integral: [[f32; WIDTH]; MOST_TERMS + 1],
    /// T_k at the theta found.
    chebyshev: [[f32; WIDTH]; MOST_TERMS],
}

impl Scratch {
    pub(crate) fn new() -> Self {
        let zeros = [0.0; WIDTH];
        Self { density: [zeros; _], integral: [zeros; _], chebyshev: [zeros; _] }
    }
}

impl ExactLeaves {
    pub(crate) fn new(tables: &Tables) -> Self {
        let (grid, top) = (tables.grid(), tables.degree().get());
        let (rows, columns) = (grid.rows(), grid.columns());
        // theta of an edge from the nearer pole: 1 - cos(theta) = 2 k / rows.
        let edge = |k: usize| 2.0 * math::asin((k as f64 / rows as f64).sqrt());
        let mut start = 0;
        let rows = (0..rows)
            .map(|row| {
                let from_pole = row.min(rows - 1 - row);
                let (near, far) = (edge(from_pole), edge(from_pole + 1));
                let half = 0.5 * (far - near);
                let terms = terms(half * (top + 2) as f64);
                start += terms;
                Row { terms, start: start - terms, middle: 0.5 * (near + far), half }
            })
            .collect();
        let taylor = (0..=top).map(|m| {
            let mut power = 1.0;
            from_fn(|k| {
                let term = power as f32;
                power *= m as f64 * PI / columns as f64 / (k + 1) as f64;
                term
            })
        });
        Self {
            grid,
            basis: Basis::new(tables.degree()),
            rows,
            densities: vec![0.0; start * columns],
            series: vec![F32x8::ZERO; start * columns],
            taylor: taylor.collect(),
        }
    }

    /// Takes another function; `floor` is the density that a uniform share adds, `sign` the sign of f in a
    /// leaf.
    pub(crate) fn update(
        &mut self,
        level: SimdLevel,
        tables: &Tables,
        coefficients: &[f64],
        floor: f32,
        sign: impl Fn(usize, usize) -> f32,
    ) {
        let (rows, columns) = (self.grid.rows(), self.grid.columns());
        let orders = self.basis.degree().get() + 1;
        let width = 2.0 * PI / columns as f64;
        let mut legendre = vec![0.0; orders * (orders + 1) / 2];
        let mut fourier = [(); 2].map(|()| vec![[F32x8::ZERO; 2]; orders]);
        let mut output = [(); 2].map(|()| vec![F32x8::ZERO; columns]);
        for north in 0..rows / 2 {
            let Row { terms, middle, half, .. } = self.rows[north];
            // A_m and B_m at Chebyshev's nodes, by hemisphere, and sin(theta) there.
            let mut values = vec![[vec![[0.0; 2]; orders], vec![[0.0; 2]; orders]]; terms];
            let mut sines = vec![0.0; terms];
            for (j, values) in values.iter_mut().enumerate() {
                let theta = middle + half * math::cos(PI * (j as f64 + 0.5) / terms as f64);
                sines[j] = math::sin(theta);
                self.basis.legendre_into(math::cos(theta), math::sin(theta), &mut legendre);
                let mut legendre = legendre.iter();
                for m in 0..orders {
                    for (l, p) in (m..orders).zip(legendre.by_ref()) {
                        let mirrored = if (l - m) % 2 == 0 { *p } else { -p };
                        let a = coefficients[l * l + l + m];
                        let b = if m > 0 { coefficients[l * l + l - m] } else { 0.0 };
                        for (values, p) in values.iter_mut().zip([*p, mirrored]) {
                            values[m][0] += p * a;
                            values[m][1] += p * b;
                        }
                    }
                }
            }
            // What each node contributes to a term of the series.
            let weight = |k: usize, j: usize| {
                let turn = (k * (2 * j + 1) % (4 * terms)) as f64 / (2 * terms) as f64;
                if k == 0 { 1.0 / terms as f64 } else { 2.0 / terms as f64 * math::cos(PI * turn) }
            };
            let weights: Vec<Vec<f64>> =
                (0..terms).map(|k| (0..terms).map(|j| weight(k, j)).collect()).collect();
            // A_m and B_m of a term in a hemisphere, and those of sin(theta) f.
            let term = |k: usize, hemisphere: usize, m: usize, sines: Option<&[f64]>| -> [f32; 2] {
                let mut sums = [0.0; 2];
                for (j, weight) in weights[k].iter().enumerate() {
                    let factor = weight * sines.map_or(1.0, |sines| sines[j]);
                    let [a, b] = values[j][hemisphere][m];
                    sums = [sums[0] + factor * a, sums[1] + factor * b];
                }
                sums.map(|sum| sum as f32)
            };
            let first = |row: usize| self.rows[row].start * columns;
            let both = [north, rows - 1 - north];
            for block in (0..terms).step_by(LANES) {
                let lanes = LANES.min(terms - block);
                for (hemisphere, fourier) in fourier.iter_mut().enumerate() {
                    for (m, fourier) in fourier.iter_mut().enumerate() {
                        *fourier = [F32x8::ZERO; 2];
                        for lane in 0..lanes {
                            let [a, b] = term(block + lane, hemisphere, m, Some(&sines));
                            (fourier[0].0[lane], fourier[1].0[lane]) = (a, b);
                        }
                    }
                }
                let floors: [f32; LANES] = from_fn(|lane| {
                    let weights = weights.get(block + lane).into_iter().flatten().zip(&sines);
                    let sum: f64 = weights.map(|(weight, sine)| weight * sine).sum();
                    (f64::from(floor) * width * sum) as f32
                });
                synthesise(level, &tables.column_masses, &fourier, &mut output);
                for (row, output) in both.into_iter().zip(&output) {
                    for (column, value) in output.iter().enumerate() {
                        let sign = sign(row, column);
                        let leaf = &mut self.densities[first(row) + column * terms + block..][..lanes];
                        for (lane, to) in leaf.iter_mut().enumerate() {
                            *to = sign * value.0[lane] + floors[lane];
                        }
                    }
                }
            }
            for k in 0..terms {
                for (hemisphere, fourier) in fourier.iter_mut().enumerate() {
                    for (m, (fourier, taylor)) in fourier.iter_mut().zip(&self.taylor).enumerate() {
                        *fourier = along_column(term(k, hemisphere, m, None), taylor);
                    }
                }
                synthesise(level, &tables.column_middles, &fourier, &mut output);
                for (row, output) in both.into_iter().zip(&output) {
                    for (column, value) in output.iter().enumerate() {
                        let sign = sign(row, column);
                        let mut value = value.0.map(|value| sign * value);
                        value[0] += if k == 0 { floor } else { 0.0 };
                        self.series[first(row) + column * terms + k] = F32x8(value);
                    }
                }
            }
        }
    }

    /// f at a place of a leaf that is not flat, over its mean there: the density relative to a uniform one.
    pub(crate) fn relative_density(&self, row: usize, column: usize, [t, s]: [f32; 2]) -> f32 {
        let tau = self.tau(row, self.distance_in_row(row, t));
        let f = polynomial(&self.at_tau(row, column, tau), 2.0 * s - 1.0);
        let (density, _) = self.leaf(row, column);
        let mass = self.rows[row].half as f32 * chebyshev(integral_of_chebyshev(density), 1.0);
        f * self.grid.area() as f32 / mass
    }

    /// The remainders of the uniforms at a place of a leaf that is not flat.
    pub(crate) fn invert(&self, row: usize, column: usize, [t, s]: [f32; 2]) -> [f32; 2] {
        let (density, _) = self.leaf(row, column);
        let tau = self.tau(row, self.distance_in_row(row, t));
        let integral = integral_of_chebyshev(density);
        let below = chebyshev(integral, tau) / chebyshev(integral, 1.0);
        let integral = integral_of_polynomial(&self.at_tau(row, column, tau));
        let left = polynomial(&integral, 2.0 * s - 1.0) / polynomial(&integral, 1.0);
        [if self.is_south(row) { 1.0 - below } else { below }, left]
    }

    /// Places of points in leaves that are not flat, and their densities relative to a uniform one.
    #[inline(always)]
    pub(crate) fn draw<L: Lanes>(
        &self,
        lanes: L,
        scratch: &mut Scratch,
        cells: &[(usize, usize); WIDTH],
        rest: &[[f32; WIDTH]; 2],
    ) -> [[f32; WIDTH]; 3] {
        let most = cells.iter().map(|cell| self.rows[cell.0].terms).max().unwrap_or(1);
        let Scratch { density, integral, chebyshev } = scratch;
        let (mut u, mut first, mut last) = (rest[0], [0.0f32; WIDTH], [0.0f32; WIDTH]);
        for (first, cells) in cells.as_chunks::<LANES>().0.iter().enumerate() {
            let leaves = cells.map(|(row, column)| self.leaf(row, column).0);
            for term in (0..most).step_by(LANES) {
                let terms = lanes.transpose_f32s(leaves.map(|leaf| block(&leaf[term.min(leaf.len())..])));
                for (density, terms) in density[term..].iter_mut().zip(terms) {
                    density[first * LANES..][..LANES].copy_from_slice(&terms);
                }
            }
        }
        let southern = u.iter_mut().zip(cells).filter(|(_, cell)| self.is_south(cell.0));
        southern.for_each(|(u, _)| *u = 1.0 - *u);
        for (k, density) in density[..most].iter().enumerate() {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            for i in 0..WIDTH {
                last[i] += density[i];
                first[i] += sign * density[i];
            }
        }
        integrate_chebyshev(density, most, integral);
        let mut whole = [0.0f32; WIDTH];
        for integral in &integral[..=most] {
            for i in 0..WIDTH {
                whole[i] += integral[i];
            }
        }
        let pair = ChebyshevPair { integral: &integral[..=most], density: &density[..most] };
        let tau = solve(lanes, times(&u, &whole), start(&first, &last, &u), &pair);
        for k in 0..VECTORS {
            let tau = eight(lanes, &tau, k);
            let twice = lanes.add_f32s(tau, tau);
            let (mut before, mut now) = (tau, lanes.splat_f32s(1.0));
            for chebyshev in &mut chebyshev[..most] {
                set_eight(lanes, now, chebyshev, k);
                (before, now) = (now, lanes.mul_add_f32s(twice, now, lanes.neg_f32s(before)));
            }
        }
        let mut by_point = [F32x8::ZERO; WIDTH];
        for (i, &(row, column)) in cells.iter().enumerate() {
            let (_, series) = self.leaf(row, column);
            let mut sum = lanes.splat_f32s(0.0);
            for (term, chebyshev) in series.iter().zip(chebyshev.iter()) {
                sum = lanes.mul_add_f32s(load(lanes, term), lanes.splat_f32s(chebyshev[i]), sum);
            }
            store(lanes, sum, &mut by_point[i]);
        }
        let mut along = [[0.0f32; WIDTH]; TAYLOR];
        let mut total = [[0.0f32; WIDTH]; TAYLOR + 1];
        for (first, points) in by_point.as_chunks::<LANES>().0.iter().enumerate() {
            for (along, powers) in along.iter_mut().zip(lanes.transpose_f32s(points.map(|point| point.0))) {
                along[first * LANES..][..LANES].copy_from_slice(&powers);
            }
        }
        let (mut first, mut last) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
        let (mut below, mut above) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
        for k in 0..TAYLOR {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            for i in 0..WIDTH {
                let value = along[k][i];
                let integral = value * INVERSES[k];
                total[k + 1][i] = integral;
                last[i] += value;
                first[i] += sign * value;
                above[i] += integral;
                below[i] -= sign * integral;
            }
        }
        for i in 0..WIDTH {
            total[0][i] = -below[i];
            above[i] -= below[i];
        }
        let pair = PolynomialPair { integral: &total, density: &along };
        let delta = solve(lanes, times(&rest[1], &above), start(&first, &last, &rest[1]), &pair);
        let (_, f) = pair.at(&delta);
        let (mut middle, mut half) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
        let (mut from_pole, mut is_south) = ([0.0f32; WIDTH], [false; WIDTH]);
        for (i, &(row, _)) in cells.iter().enumerate() {
            (middle[i], half[i]) = (self.rows[row].middle as f32, self.rows[row].half as f32);
            is_south[i] = self.is_south(row);
            from_pole[i] = row.min(self.grid.rows() - 1 - row) as u32 as f32;
        }
        let (rows, area) = (self.grid.rows() as f32, self.grid.area() as f32);
        let mut places = [[0.0; WIDTH]; 3];
        for i in 0..WIDTH {
            let sine = crate::leaf_grid::sin_cos(0.5 * (middle[i] + half[i] * tau[i])).0;
            // d = 1 - cos(theta), in rows.
            let from_pole = sine * sine * rows - from_pole[i];
            places[0][i] = if is_south[i] { 1.0 - from_pole } else { from_pole };
            places[1][i] = 0.5 * (delta[i] + 1.0);
            places[2][i] = (f[i] * area / (half[i] * whole[i])).max(0.0);
        }
        places
    }

    #[inline(always)]
    fn is_south(&self, row: usize) -> bool {
        2 * row >= self.grid.rows()
    }

    /// The share of its row by which a place is away from the edge nearer to the pole.
    fn distance_in_row(&self, row: usize, t: f32) -> f32 {
        if self.is_south(row) { 1.0 - t } else { t }
    }

    fn tau(&self, row: usize, from_pole: f32) -> f32 {
        let Row { middle, half, .. } = self.rows[row];
        let rows = self.grid.rows();
        let share = ((row.min(rows - 1 - row)) as f64 + f64::from(from_pole)) / rows as f64;
        ((2.0 * math::asin(share.clamp(0.0, 1.0).sqrt()) - middle) / half).clamp(-1.0, 1.0) as f32
    }

    /// The density of theta in a leaf, and the series of f.
    #[inline(always)]
    fn leaf(&self, row: usize, column: usize) -> (&[f32], &[F32x8]) {
        let Row { terms, start, .. } = self.rows[row];
        let first = start * self.grid.columns() + column * terms;
        (&self.densities[first..][..terms], &self.series[first..][..terms])
    }

    /// The Taylor series of the density along a column, in half widths.
    fn at_tau(&self, row: usize, column: usize, tau: f32) -> [f32; TAYLOR] {
        let (_, series) = self.leaf(row, column);
        from_fn(|k| {
            let terms = series.iter().map(|term| term.0[k]);
            chebyshev(terms, tau)
        })
    }
}

/// Values in the middles of all columns, from A_m and B_m of both hemispheres.
fn synthesise(
    level: SimdLevel,
    table: &ColumnTable,
    fourier: &[Vec<Fourier>; 2],
    output: &mut [Vec<F32x8>; 2],
) {
    let rows = fourier.each_ref().map(Vec::as_slice);
    let output = output.each_mut().map(Vec::as_mut_slice);
    level.run(Columns { table, rows, at_edges: false, output });
}

/// The Taylor series of A cos(m phi) + B sin(m phi) along a column, as the factors of cos(m phi) and sin(m
/// phi) at the column's centre.
fn along_column([a, b]: [f32; 2], taylor: &[f32; TAYLOR]) -> Fourier {
    let derivatives = [[a, b, -a, -b], [b, -a, -b, a]];
    derivatives.map(|derivatives| F32x8(from_fn(|k| derivatives[k % 4] * taylor[k])))
}

/// 1 / (k + 1).
const INVERSES: [f32; TAYLOR] =
    [1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0];

/// The first numbers of a slice, then zeros.
#[inline(always)]
fn block(values: &[f32]) -> [f32; LANES] {
    let mut block = [0.0; LANES];
    match values.first_chunk() {
        Some(whole) => block = *whole,
        None => block[..values.len()].copy_from_slice(values),
    }
    block
}

/// The k-th vector of some points' numbers.
#[inline(always)]
fn eight<S: Simd>(_: S, values: &[f32; WIDTH], k: usize) -> S::f32s {
    pulp::cast(values.as_chunks::<LANES>().0[k])
}

#[inline(always)]
fn set_eight<S: Simd>(_: S, vector: S::f32s, values: &mut [f32; WIDTH], k: usize) {
    values.as_chunks_mut::<LANES>().0[k] = pulp::cast(vector);
}

#[inline(always)]
fn times(a: &[f32; WIDTH], b: &[f32; WIDTH]) -> [f32; WIDTH] {
    let mut product = [0.0; WIDTH];
    for i in 0..WIDTH {
        product[i] = a[i] * b[i];
    }
    product
}

/// Where shares u of linear densities lie in [-1, 1].
#[inline(always)]
fn start(first: &[f32; WIDTH], last: &[f32; WIDTH], u: &[f32; WIDTH]) -> [f32; WIDTH] {
    let mut start = [0.0; WIDTH];
    for i in 0..WIDTH {
        start[i] = 2.0 * invert_linear(first[i].max(1e-30), last[i].max(1e-30), u[i]) - 1.0;
    }
    start
}

/// Terms of a Chebyshev series of waves of this many radians over half its range: J_n(x) < (x / 2)^n / n! <
/// 2e-8.
fn terms(x: f64) -> usize {
    let (mut n, mut bound) = (0, 1.0);
    while bound > 2e-8 && n < MOST_TERMS {
        n += 1;
        bound *= 0.5 * x / n as f64;
    }
    n.next_multiple_of(4).clamp(8, MOST_TERMS)
}

/// The place in [0, 1] below which a share u of a linear density lies that goes from a to b.
#[inline(always)]
pub(crate) fn invert_linear(a: f32, b: f32, u: f32) -> f32 {
    u * (a + b) / (a + (a * a + u * ((b - a) * (b + a))).max(0.0).sqrt())
}

/// Increasing functions and their derivatives, at many places. A closure would not be compiled for the
/// vectors of the kernel that calls it.
trait Increasing {
    fn at(&self, x: &[f32; WIDTH]) -> ([f32; WIDTH], [f32; WIDTH]);
}

/// Where increasing functions on [-1, 1] reach their targets.
#[inline(always)]
fn solve<S: Simd>(simd: S, target: [f32; WIDTH], start: [f32; WIDTH], f: &impl Increasing) -> [f32; WIDTH] {
    let mut x = start;
    let (mut low, mut high) = ([simd.splat_f32s(-1.0); VECTORS], [simd.splat_f32s(1.0); VECTORS]);
    let zero = simd.splat_f32s(0.0);
    let mut open = [simd.less_than_f32s(zero, simd.splat_f32s(1.0)); VECTORS];
    for _ in 0..24 {
        let (value, slope) = f.at(&x);
        let mut any_open = false;
        for k in 0..VECTORS {
            let place = eight(simd, &x, k);
            let excess = simd.sub_f32s(eight(simd, &value, k), eight(simd, &target, k));
            let is_above = simd.less_than_f32s(zero, excess);
            low[k] = simd.select_f32s(is_above, low[k], place);
            high[k] = simd.select_f32s(is_above, place, high[k]);
            let newton = simd.sub_f32s(place, simd.div_f32s(excess, eight(simd, &slope, k)));
            let middle = simd.mul_f32s(simd.splat_f32s(0.5), simd.add_f32s(low[k], high[k]));
            let is_inside = simd.and_m32s(
                simd.less_than_or_equal_f32s(low[k], newton),
                simd.less_than_or_equal_f32s(newton, high[k]),
            );
            let next = simd.select_f32s(is_inside, newton, middle);
            let moved = simd.abs_f32s(simd.sub_f32s(next, place));
            // A point is not moved on for its neighbours' sake: it would depend on them.
            set_eight(simd, simd.select_f32s(open[k], next, place), &mut x, k);
            // Newton's error is squared by each step.
            open[k] = simd.and_m32s(open[k], simd.less_than_f32s(simd.splat_f32s(1e-4), moved));
            any_open |= simd.first_true_m32s(open[k]) < LANES;
        }
        if !any_open {
            break;
        }
    }
    x
}

/// Series of T_k: the integral from -1 and the density.
struct ChebyshevPair<'a> {
    integral: &'a [[f32; WIDTH]],
    density: &'a [[f32; WIDTH]],
}

impl Increasing for ChebyshevPair<'_> {
    #[inline(always)]
    fn at(&self, tau: &[f32; WIDTH]) -> ([f32; WIDTH], [f32; WIDTH]) {
        let (mut before, mut now) = (*tau, [1.0f32; WIDTH]);
        let (mut value, mut slope) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
        for (integral, density) in self.integral.iter().zip(self.density) {
            for i in 0..WIDTH {
                value[i] = integral[i].mul_add(now[i], value[i]);
                slope[i] = density[i].mul_add(now[i], slope[i]);
                let next = (2.0 * tau[i]).mul_add(now[i], -before[i]);
                (before[i], now[i]) = (now[i], next);
            }
        }
        if let Some(integral) = self.integral.last() {
            for i in 0..WIDTH {
                value[i] = integral[i].mul_add(now[i], value[i]);
            }
        }
        (value, slope)
    }
}

/// The Chebyshev series of the integral from -1 on: its coefficient of T_k is the difference of the density's
/// at k - 1 and k + 1 over 2 k, that of T_0 counting twice.
#[inline(always)]
fn integrate_chebyshev(density: &[[f32; WIDTH]], terms: usize, integral: &mut [[f32; WIDTH]]) {
    let mut constant = [0.0f32; WIDTH];
    for k in 1..=terms {
        let half = 0.5 / k as f32;
        let (down, up) = (if k == 1 { 2.0 * half } else { half }, if k + 1 < terms { half } else { 0.0 });
        let (below, above) = (&density[k - 1], &density[(k + 1).min(terms - 1)]);
        let sign = if k % 2 == 0 { -1.0 } else { 1.0 };
        let to = &mut integral[k];
        for i in 0..WIDTH {
            to[i] = down * below[i] - up * above[i];
            constant[i] += sign * to[i];
        }
    }
    integral[0] = constant;
}

/// [`integrate_chebyshev`] of one series.
fn integral_of_chebyshev(density: &[f32]) -> [f32; MOST_TERMS + 1] {
    let mut wide = [[0.0; WIDTH]; MOST_TERMS];
    density.iter().zip(&mut wide).for_each(|(from, to)| to[0] = *from);
    let mut integral = [[0.0; WIDTH]; MOST_TERMS + 1];
    integrate_chebyshev(&wide, density.len(), &mut integral);
    integral.map(|lanes| lanes[0])
}

fn chebyshev(series: impl IntoIterator<Item = f32>, tau: f32) -> f32 {
    let (mut before, mut now, mut sum) = (tau, 1.0f32, 0.0f32);
    for term in series {
        sum = term.mul_add(now, sum);
        (before, now) = (now, (2.0 * tau).mul_add(now, -before));
    }
    sum
}

/// Power series: the integral from -1 and the density.
struct PolynomialPair<'a> {
    integral: &'a [[f32; WIDTH]; TAYLOR + 1],
    density: &'a [[f32; WIDTH]; TAYLOR],
}

impl Increasing for PolynomialPair<'_> {
    #[inline(always)]
    fn at(&self, x: &[f32; WIDTH]) -> ([f32; WIDTH], [f32; WIDTH]) {
        let (mut value, mut slope) = (self.integral[TAYLOR], [0.0f32; WIDTH]);
        for k in (0..TAYLOR).rev() {
            for i in 0..WIDTH {
                value[i] = value[i].mul_add(x[i], self.integral[k][i]);
                slope[i] = slope[i].mul_add(x[i], self.density[k][i]);
            }
        }
        (value, slope)
    }
}

fn polynomial(series: &[f32], x: f32) -> f32 {
    series.iter().rev().fold(0.0, |sum: f32, term| sum.mul_add(x, *term))
}

/// The series of the integral from -1 on.
fn integral_of_polynomial(series: &[f32; TAYLOR]) -> [f32; TAYLOR + 1] {
    let mut integral = [0.0; TAYLOR + 1];
    for k in 0..TAYLOR {
        integral[k + 1] = series[k] * INVERSES[k];
    }
    integral[0] = -polynomial(&integral, -1.0);
    integral
}
