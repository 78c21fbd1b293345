//! Panels of the incident angle theta_i, and the integrals over them.

use std::f64::consts::PI;

use pulp::{Simd, WithSimd};
use sh::f64x4::{F64x4, LANES, load, store};
use sh::quadrature::gauss_legendre;

use super::grid::Grid;
use super::outgoing_nodes::IncidentSlice;
use crate::projection::legendre::Legendre;

/// The number of nodes of a panel of theta_i, and of a part of one.
pub(super) const NODES: usize = 8;

/// The widest part of a panel times the highest degree F: its nodes resolve that degree.
const WIDEST_PART: f64 = 17.0;

/// The width of a panel as a share of its distance from the central direction, at most.
const GROWTH: f64 = 1.0;

/// A range of theta_i over which rho_hat is a polynomial through its values at the nodes. The functions that
/// it is integrated with are finer, so that they have nodes in each part of it.
pub(super) struct IncidentPanel {
    pub(super) angles: [f64; NODES],
    /// The weight of each node times sin(theta_i).
    pub(super) weights: [f64; NODES],
    parts: Vec<PanelPart>,
}

/// A part of a panel and its nodes.
struct PanelPart {
    cosine: [f64; NODES],
    sine: [f64; NODES],
    /// The weight of each node times sin(theta_i) times the polynomial that is one at a node of the panel and
    /// zero at the others, [node of the part, node of the panel].
    shares: [[F64x4; NODES / LANES]; NODES],
}

/// The panels over 0 to pi. A right angle, where a surface seen by its normal has its horizon, is an edge.
pub(super) fn incident_panels(grid: Grid) -> Vec<IncidentPanel> {
    let widest_part = WIDEST_PART / grid.f.max(1) as f64;
    let mut edges = vec![0.0];
    let mut edge: f64 = 2e-4;
    while GROWTH * edge < grid.widest_panel {
        edges.push(edge);
        edge += GROWTH * edge;
    }
    edges.push(edge);
    for (from, to) in [(edge, PI / 2.0), (PI / 2.0, PI)] {
        let count = ((to - from) / grid.widest_panel).ceil();
        edges.extend((1..=count as usize).map(|i| from + (to - from) * i as f64 / count));
    }
    let (angles, weights) = gauss_legendre(NODES);
    let (x, weights): ([f64; NODES], [f64; NODES]) =
        (std::array::from_fn(|i| -math::cos(angles[i])), std::array::from_fn(|i| weights[i]));
    let panel = |ends: &[f64]| {
        let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
        let angles = x.map(|x| middle + half * x);
        let count = (2.0 * half / widest_part).ceil().max(1.0);
        let part = |part: usize| {
            // The nodes of the part over -1 to 1 of the panel.
            let at = x.map(|x| (1.0 + x + 2.0 * part as f64) / count - 1.0);
            let angles = at.map(|x| middle + half * x);
            let (cosine, sine) = (angles.map(math::cos), angles.map(math::sin));
            let share = |i: usize| {
                let mut shares = [F64x4::ZERO; NODES / LANES];
                for (node, value) in lagrange(&x, at[i]).into_iter().enumerate() {
                    shares[node / LANES].0[node % LANES] = half / count * weights[i] * sine[i] * value;
                }
                shares
            };
            PanelPart { cosine, sine, shares: std::array::from_fn(share) }
        };
        let weights = std::array::from_fn(|i| half * weights[i] * math::sin(angles[i]));
        IncidentPanel { angles, weights, parts: (0..count as usize).map(part).collect() }
    };
    edges.windows(2).map(panel).collect()
}

/// At x, the polynomials that are one at a node and zero at the others.
fn lagrange(nodes: &[f64; NODES], x: f64) -> [f64; NODES] {
    std::array::from_fn(|node| {
        let others = nodes.iter().enumerate().filter(|(other, _)| *other != node);
        others.map(|(_, other)| (x - other) / (nodes[node] - other)).product()
    })
}

/// Vectors that hold three numbers for each p from q on.
pub(super) fn vectors_of(q: usize, grid: Grid) -> usize {
    (3 * (grid.p + 1 - q)).div_ceil(LANES)
}

/// The integrals over theta_i for one q, [l, p, channel]: those of the moments times f_lq sin(theta_i).
pub(super) struct IncidentMoments<'a> {
    pub(super) panels: &'a [IncidentPanel],
    /// That of each node of each panel.
    pub(super) slices: &'a [IncidentSlice],
    pub(super) legendre: &'a Legendre,
    pub(super) q: usize,
    pub(super) grid: Grid,
}

impl WithSimd for IncidentMoments<'_> {
    type Output = Vec<F64x4>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<F64x4> {
        let Self { panels, slices, legendre, q, grid } = self;
        let row = vectors_of(q, grid);
        let mut sums = vec![F64x4::ZERO; (grid.f + 1) * row];
        let mut moments = vec![[F64x4::ZERO; NODES]; row];
        let mut functions = vec![[0.0; NODES]; grid.f + 1];
        let mut weights = vec![[F64x4::ZERO; NODES / LANES]; grid.f + 1];
        for (panel, slices) in panels.iter().zip(slices.chunks_exact(NODES)) {
            for (node, slice) in slices.iter().enumerate() {
                for p in q..=grid.p {
                    for (channel, moment) in slice.moment(p, q).into_iter().enumerate() {
                        let at = 3 * (p - q) + channel;
                        moments[at / LANES][node].0[at % LANES] = moment;
                    }
                }
            }
            weights.fill([F64x4::ZERO; NODES / LANES]);
            for part in &panel.parts {
                legendre.order(q, &part.cosine, &part.sine, |l, values| functions[l] = *values);
                for (weights, functions) in weights.iter_mut().zip(&functions).skip(q) {
                    for (k, weights) in weights.iter_mut().enumerate() {
                        let mut weight = load(simd, weights);
                        for (value, shares) in functions.iter().zip(&part.shares) {
                            weight =
                                simd.mul_add_f64s(load(simd, &shares[k]), simd.splat_f64s(*value), weight);
                        }
                        store(simd, weight, weights);
                    }
                }
            }
            for (sums, weights) in sums.chunks_exact_mut(row).zip(&weights).skip(q) {
                let mut splat = [simd.splat_f64s(0.0); NODES];
                for (splat, weight) in splat.iter_mut().zip(weights.iter().flat_map(|vector| &vector.0)) {
                    *splat = simd.splat_f64s(*weight);
                }
                for (sum, moments) in sums.iter_mut().zip(&moments) {
                    let mut total = load(simd, sum);
                    for (moment, weight) in moments.iter().zip(splat) {
                        total = simd.mul_add_f64s(load(simd, moment), weight, total);
                    }
                    store(simd, total, sum);
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A highlight times a Legendre function of the highest degree, against Gauss's rule of many nodes.
    #[test]
    fn a_highlight_times_a_fine_function_is_integrated() {
        let highlight = |theta: f64| (-(theta / 0.1).powi(2)).exp() + 0.1 * theta.cos().powi(2);
        let (angles, weights) = gauss_legendre(1000);
        for (f, q) in [(255, 0), (255, 7), (60, 24), (3, 1)] {
            let legendre = Legendre::new(f, q);
            let of = |theta: f64| {
                let mut last = 0.0;
                legendre.order(q, &[theta.cos()], &[theta.sin()], |_, value| last = value[0]);
                last
            };
            let expected: f64 = angles
                .iter()
                .zip(&weights)
                .map(|(theta, weight)| weight * highlight(*theta) * of(*theta))
                .sum();
            let panels = incident_panels(Grid { f, ..Grid::full() });
            let (mut sum, mut plain) = (0.0, 0.0);
            for panel in &panels {
                let values = panel.angles.map(highlight);
                for part in &panel.parts {
                    let mut last = [0.0; NODES];
                    legendre.order(q, &part.cosine, &part.sine, |_, value| last = *value);
                    for (function, shares) in last.iter().zip(&part.shares) {
                        for (value, share) in values.iter().zip(shares.iter().flat_map(|vector| vector.0)) {
                            sum += function * share * value;
                        }
                    }
                }
                plain += panel.weights.iter().zip(values).map(|(weight, value)| weight * value).sum::<f64>();
            }
            assert!((sum - expected).abs() < 2e-7, "{f} {q}: {sum} {expected}");
            let expected: f64 =
                angles.iter().zip(&weights).map(|(theta, weight)| weight * highlight(*theta)).sum();
            assert!((plain - expected).abs() < 1e-9, "{plain} {expected}");
        }
    }
}
