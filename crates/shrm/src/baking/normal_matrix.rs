//! The matrix of a fit's normal equations, factored: with it the method of conjugate gradients needs one or
//! two steps.
//!
//! The product of two harmonics up to degree P is a sum of harmonics up to 2 P, with the coefficients of
//! Gaunt. So the matrix, the sums over the views of weight times Y_i Y_j, follows from the sums of weight
//! times each of (2 P + 1)^2 harmonics: a twentieth of the work for P = 4.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use brdf::Centre;
use pulp::Simd;
use sh::quadrature::gauss_legendre;
use sh::{Basis, Degree};
use sphere::Direction;

use super::view_grid::ViewGrid;
use super::view_sums::{F32x8, LANES, adjoin, load, store};
use crate::Terms;

/// The highest P whose matrices are factored: the work grows with its sixth power.
const HIGHEST_P: usize = 6;

/// The least pivot of a matrix, as a share of the diagonal: rounding leaves less than this undetermined.
const LEAST_PIVOT: f32 = 1e-5;

/// Products of two harmonics as sums of harmonics.
struct Products {
    /// The number of terms of each pair of unknowns i >= j.
    counts: Vec<usize>,
    /// The terms of all pairs: the place among the harmonics up to 2 P, and the coefficient of Gaunt.
    terms: Vec<(usize, f32)>,
}

/// What the matrices of all fits of a degree share.
pub(super) struct NormalMatrix {
    /// The views with the harmonics up to 2 P.
    views: ViewGrid,
    /// The place of each unknown among the cosines and sines of all pairs.
    unknowns: Vec<usize>,
    products: &'static Products,
}

/// Cholesky's lower factor of a matrix: the rows up to the diagonal, and the reciprocals of the diagonal.
pub(super) struct Factor {
    rows: Vec<F32x8>,
    reciprocals: Vec<F32x8>,
}

/// The rows of coefficients, each after its place among the cosines and sines of all pairs.
fn places(views: &ViewGrid) -> Vec<(usize, usize)> {
    let rows = views.rows_of_pairs();
    rows.as_flattened().iter().enumerate().filter_map(|(place, row)| row.map(|row| (place, row))).collect()
}

impl NormalMatrix {
    /// The matrices of fits of these harmonics, if they are few.
    pub(super) fn new(views: &ViewGrid, centre: Centre) -> Option<Self> {
        let (p, terms) = (views.p, views.terms);
        if p > HIGHEST_P {
            return None;
        }
        static PRODUCTS: [[OnceLock<Products>; HIGHEST_P + 1]; 2] =
            [const { [const { OnceLock::new() }; HIGHEST_P + 1] }; 2];
        let twice = views.to_degree(2 * p, centre);
        let products = PRODUCTS[usize::from(terms == Terms::Zonal)][p]
            .get_or_init(|| Products::new(terms, [p, 2 * p].map(degree), [&places(views), &places(&twice)]));
        let unknowns = places(views).into_iter().map(|(place, _)| place).collect();
        Some(Self { views: twice, unknowns, products })
    }

    /// The factor of the matrix of these weights.
    #[inline(always)]
    pub(super) fn factor<S: Simd>(&self, simd: S, weight: &[F32x8]) -> Factor {
        let count = self.unknowns.len();
        let mut sums = vec![[F32x8::ZERO; 2]; self.views.counts().sum()];
        adjoin(simd, &self.views, weight, &mut sums);
        let sums = sums.as_flattened();
        let mut rows = vec![F32x8::ZERO; count * (count + 1) / 2];
        let mut terms = &self.products.terms[..];
        for (entry, count) in rows.iter_mut().zip(&self.products.counts) {
            let (of_entry, others) = terms.split_at(*count);
            terms = others;
            let mut sum = simd.splat_f32s(0.0);
            for (place, gaunt) in of_entry {
                sum = simd.mul_add_f32s(simd.splat_f32s(*gaunt), load(simd, &sums[*place]), sum);
            }
            store(simd, sum, entry);
        }
        let mut reciprocals = vec![F32x8::ZERO; count];
        for i in 0..count {
            let (above, row) = rows.split_at_mut(i * (i + 1) / 2);
            let diagonal = row[i];
            for j in 0..=i {
                let (done, rest) = row.split_at_mut(j);
                let other = if j == i { &*done } else { &above[j * (j + 1) / 2..][..j] };
                let mut entry = load(simd, &rest[0]);
                for (a, b) in done.iter().zip(other) {
                    entry = simd.negate_mul_add_f32s(load(simd, a), load(simd, b), entry);
                }
                if j < i {
                    entry = simd.mul_f32s(entry, load(simd, &reciprocals[j]));
                    store(simd, entry, &mut rest[0]);
                    continue;
                }
                let mut pivot = F32x8::ZERO;
                store(simd, entry, &mut pivot);
                for lane in 0..LANES {
                    let pivot = pivot.0[lane].max(LEAST_PIVOT * diagonal.0[lane]);
                    reciprocals[i].0[lane] = if pivot > 0.0 { pivot.sqrt().recip() } else { 0.0 };
                }
            }
        }
        Factor { rows, reciprocals }
    }

    /// The solution of the matrix's equations for this gradient.
    #[inline(always)]
    pub(super) fn solve<S: Simd>(
        &self,
        simd: S,
        factor: &Factor,
        gradient: &[[F32x8; 2]],
        out: &mut [[F32x8; 2]],
    ) {
        let (gradient, out) = (gradient.as_flattened(), out.as_flattened_mut());
        let count = self.unknowns.len();
        let row = |i: usize| &factor.rows[i * (i + 1) / 2..][..i];
        let mut values = vec![F32x8::ZERO; count];
        for i in 0..count {
            let mut value = load(simd, &gradient[self.unknowns[i]]);
            for (entry, done) in row(i).iter().zip(&values) {
                value = simd.negate_mul_add_f32s(load(simd, entry), load(simd, done), value);
            }
            store(simd, simd.mul_f32s(value, load(simd, &factor.reciprocals[i])), &mut values[i]);
        }
        for i in (0..count).rev() {
            let value = simd.mul_f32s(load(simd, &values[i]), load(simd, &factor.reciprocals[i]));
            store(simd, value, &mut out[self.unknowns[i]]);
            for (entry, other) in row(i).iter().zip(&mut values) {
                let less = simd.negate_mul_add_f32s(load(simd, entry), value, load(simd, other));
                store(simd, less, other);
            }
        }
    }
}

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap_or(Degree::MAX)
}

impl Products {
    /// The products of the unknowns, as sums of harmonics of twice the degree: both as [`places`] has them.
    fn new(terms: Terms, [p, twice]: [Degree; 2], [unknowns, sums]: [&[(usize, usize)]; 2]) -> Self {
        // Y_pq = f_pq(theta) t_q(phi): Gauss and Legendre for the products of three f, and equal steps of phi
        // for those of three t.
        let (angles, weights) = gauss_legendre(twice.get() + 1);
        let basis = Basis::new(twice);
        let functions: Vec<Vec<f64>> = angles
            .iter()
            .map(|theta| {
                let mut y = vec![0.0; twice.rows()];
                basis.evaluate_into(Direction::from_angles(*theta, 0.0), &mut y);
                y
            })
            .collect();
        let f = |node: usize, (p, q): (usize, isize)| functions[node][p * p + p + q.unsigned_abs()];
        let steps = 2 * twice.get() + 2;
        let t = |step: usize, q: isize| {
            let phi = TAU * step as f64 / steps as f64 * q.unsigned_abs() as f64;
            if q < 0 { math::sin(phi) } else { math::cos(phi) }
        };
        let turn = |orders: [isize; 3]| {
            let at = |step: usize| orders.iter().map(|q| t(step, *q)).product::<f64>();
            TAU / steps as f64 * (0..steps).map(at).sum::<f64>()
        };
        let place = |q: isize, degree: Degree| (q + degree.get() as isize) as usize;
        let side = |degree: Degree| -(degree.get() as isize)..=degree.get() as isize;
        let turns: Vec<Vec<Vec<f64>>> = side(p)
            .map(|a| side(p).map(|b| side(twice).map(|c| turn([a, b, c])).collect()).collect())
            .collect();
        let (mut counts, mut all) = (Vec::new(), Vec::new());
        for (i, (_, row)) in unknowns.iter().enumerate() {
            for (_, other) in &unknowns[..=i] {
                let before = all.len();
                let (a, b) = (of_row(*row, terms), of_row(*other, terms));
                for (at, sum) in sums {
                    let c = of_row(*sum, terms);
                    let turn = turns[place(a.1, p)][place(b.1, p)][place(c.1, twice)];
                    if turn.abs() < 1e-9 {
                        continue;
                    }
                    let along = |node: usize| weights[node] * f(node, a) * f(node, b) * f(node, c);
                    let gaunt = turn * (0..angles.len()).map(along).sum::<f64>();
                    if gaunt.abs() > 1e-9 {
                        all.push((*at, gaunt as f32));
                    }
                }
                counts.push(all.len() - before);
            }
        }
        Self { counts, terms: all }
    }
}

/// p and q of a row of coefficients.
fn of_row(row: usize, terms: Terms) -> (usize, isize) {
    match terms {
        Terms::Zonal => (row, 0),
        Terms::All => (row.isqrt(), row as isize - (row.isqrt() * (row.isqrt() + 1)) as isize),
    }
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;
    use sh::f64x4::SimdLevel;

    use super::*;

    /// Solves for the gradient of a solution.
    struct Solved<'a>(&'a NormalMatrix, &'a [F32x8], &'a [[F32x8; 2]], &'a mut [[F32x8; 2]]);

    impl WithSimd for Solved<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let factor = self.0.factor(simd, self.1);
            self.0.solve(simd, &factor, self.2, self.3);
        }
    }

    /// The matrix is that of the sums over all views, so that its solution is the one that the gradient was
    /// made from.
    #[test]
    fn the_solution_is_that_of_the_sums_over_views() {
        for (p, terms) in [(2, Terms::All), (4, Terms::All), (5, Terms::Zonal), (6, Terms::All)] {
            let views = ViewGrid::new(p, p, terms, Centre::Reflection);
            let matrix = NormalMatrix::new(&views, Centre::Reflection).unwrap();
            let places = places(&views);
            let noise = |i: usize| ((i * 2_654_435_761) >> 7) % 1000;
            let weight: Vec<F32x8> = (0..views.len())
                .map(|k| F32x8(std::array::from_fn(|lane| 0.05 + noise(8 * k + lane) as f32 / 1e3)))
                .collect();
            let mut expected = vec![[F32x8::ZERO; 2]; views.rows_of_pairs().len()];
            for (place, _) in &places {
                expected.as_flattened_mut()[*place] = F32x8([noise(*place + 3) as f32 / 500.0 - 1.0; LANES]);
            }
            // The gradient in double precision, from the harmonics of the basis.
            let basis = Basis::new(degree(p));
            let mut gradient = vec![[[0.0; LANES]; 2]; expected.len()];
            let mut y = vec![0.0; degree(p).rows()];
            let columns = views.len() / views.rows.len();
            for (k, weight) in weight.iter().enumerate() {
                let azimuth = views.azimuths(k % columns / 4)[k % 4];
                basis.evaluate_into(Direction::from_angles(views.rows[k / columns].0, azimuth), &mut y);
                let value = |row: usize| y[if terms == Terms::Zonal { row * row + row } else { row }];
                let seen: f64 = places
                    .iter()
                    .map(|(at, row)| f64::from(expected.as_flattened()[*at].0[0]) * value(*row))
                    .sum();
                for (place, row) in &places {
                    for lane in 0..LANES {
                        gradient.as_flattened_mut()[*place][lane] +=
                            f64::from(weight.0[lane]) * seen * value(*row);
                    }
                }
            }
            let gradient: Vec<[F32x8; 2]> =
                gradient.iter().map(|pair| pair.map(|lanes| F32x8(lanes.map(|v| v as f32)))).collect();
            let mut found = vec![[F32x8::ZERO; 2]; expected.len()];
            SimdLevel::detect().run(Solved(&matrix, &weight, &gradient, &mut found));
            for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
                for (found, expected) in found.0.iter().zip(expected.0) {
                    assert!((found - expected).abs() < 1e-3, "{p}: {found} {expected}");
                }
            }
        }
    }
}
