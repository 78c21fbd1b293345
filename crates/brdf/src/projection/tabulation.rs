//! The coefficients up to given degrees: slices over theta_o, and the third step of the projection
//! [Ram02, eqs. 5.18 and 5.22]
//!
//! > rho_lpq = 2 pi * integral over [0, pi] of rho_lq(theta_o) f_pq(theta_o) sin(theta_o) dtheta_o
//! > energy  = 2 pi * integral over [0, pi] of sin(theta_o) * (integral of rho_hat^2 over w_i) dtheta_o.
//!
//! [Ram02, sec. 5.5] tabulates rho_hat on a fixed grid of S x T x T. Here each of the three integrals is a
//! sum over panels of 15 nodes, which are halved until all of them meet [`ACCURACY`]: there are few if
//! rho_hat is smooth, and many around a highlight, a horizon or the kinks of a measured table.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::error::ProjectionError;
use super::legendre::{LANES, Legendre};
use super::slice::{Fineness, Slice, Source, slice};
use crate::quadrature::{NODES, Node, Panel, RULE};

/// The greatest difference of the two rules on a panel, relative to all energy, unless a tolerance asks for
/// less. The sum of 15 nodes is far more accurate: if rho_hat is smooth, coefficients are within 1e-6 of
/// their norm.
pub(super) const ACCURACY: f64 = 1e-4;

/// High degrees do not refine panels that have less than this share of the energy.
const NEGLIGIBLE: f64 = 1e-13;

/// Panels in theta_o are at most this wide; P h is at most 14.
const WIDEST: f64 = PI / 2.0;
const PHASE: f64 = 14.0;
const DEEPEST: usize = 8;

/// The most moments of the slices that are held at once.
const MOST_MOMENTS: usize = 1 << 21;

/// Values that differ by less than this share of the largest count as equal.
const EQUAL: f64 = 1e-10;

/// Coefficients with p > 0 that hold no more than this share of the energy are rounding errors.
const NOTHING: f64 = 1e-18;

/// rho_lpq up to (F, P), and the energy of all degrees.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) p: usize,
    /// The coefficients, shape [F+1, P+1, P+1], RGB.
    pub(super) rho: Vec<[f64; 3]>,
    /// The integral of rho_hat^2 over both directions, summed over channels.
    pub(super) total: f64,
    /// The differences of both quadrature rules, summed over panels and relative to `total`.
    pub(super) error: f64,
}

/// How far the two quadrature rules may differ on a panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct AllowedDifference {
    /// The energy that the difference is relative to: what [`coarse`] finds.
    pub(super) scale: f64,
    /// The greatest difference, as a share of `scale`.
    pub(super) accuracy: f64,
}

/// Projects to degrees (F, P). If `allowed.scale` proves to be far above the energy, the projection is made
/// again with the energy that was found.
pub(super) fn tabulate(
    source: Source<'_>,
    f: usize,
    p: usize,
    allowed: AllowedDifference,
) -> Result<Table, ProjectionError> {
    let mut scale = allowed.scale;
    loop {
        let allowed = AllowedDifference { scale: scale.max(f64::MIN_POSITIVE), ..allowed };
        let table = pass(source, (f, p), allowed)?;
        // A coarse sum that hits a highlight by chance is too large, and the errors that it allows are too.
        if table.total >= scale / 4.0 {
            return Ok(table);
        }
        scale = table.total;
    }
}

/// The energy by one coarse sum: Gauss' 7 outgoing directions, without any refinement.
pub(super) fn coarse(source: Source<'_>) -> Result<f64, ProjectionError> {
    let panel = Panel { from: 0.0, to: PI, depth: 0 };
    let nodes: Vec<Node> = RULE.into_iter().filter(|node| node.gauss > 0.0).collect();
    let legendre = Legendre::new(0, 0);
    let fineness = Fineness { error: f64::INFINITY, negligible: f64::INFINITY };
    let parts: Vec<f64> = nodes
        .into_par_iter()
        .map(|node| {
            let theta_o = panel.at(node);
            let slice = slice(source, theta_o, &legendre, (0, 0), fineness)?;
            Ok(TAU * panel.radius() * math::sin(theta_o) * node.gauss * slice.energy)
        })
        .collect::<Result<_, ProjectionError>>()?;
    Ok(parts.into_iter().sum())
}

/// Sum over q of both signs and over channels of |rho_lpq|^2, shape [F+1, P+1].
pub(super) fn energies(rho: &[[f64; 3]], p: usize) -> Vec<f64> {
    rho.chunks_exact(p + 1)
        .map(|row| {
            let square = |rgb: &[f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
            square(&row[0]) + 2.0 * row[1..].iter().map(square).sum::<f64>()
        })
        .collect()
}

/// One pass with errors relative to the scale.
fn pass(
    source: Source<'_>,
    (f, p): (usize, usize),
    AllowedDifference { scale, accuracy }: AllowedDifference,
) -> Result<Table, ProjectionError> {
    let incident = Legendre::new(f, p);
    let outgoing = Legendre::new(p, f);
    let side = p + 1;
    let mut table = Table { p, rho: vec![[0.0; 3]; (f + 1) * side * side], total: 0.0, error: 0.0 };
    let (mut peak, mut swing): (f64, f64) = (0.0, 0.0);
    let mut waiting: Vec<Panel> = Panel::split(0.0, PI, WIDEST.min(PHASE / p.max(1) as f64)).collect();
    let at_once = (MOST_MOMENTS / (NODES * (f + 1) * (incident.orders() + 1))).max(1);
    while !waiting.is_empty() {
        let panels: Vec<Panel> = waiting.drain(..at_once.min(waiting.len())).collect();
        let slices: Vec<Slice> = (0..panels.len() * NODES)
            .into_par_iter()
            .map(|index| {
                source.stop.check()?;
                let panel = panels[index / NODES];
                let theta_o = panel.at(RULE[index % NODES]);
                let share = scale / (TAU * math::sin(theta_o) * 2.0 * panel.radius());
                let fineness = Fineness { error: accuracy * share, negligible: NEGLIGIBLE * share };
                Ok(slice(source, theta_o, &incident, (f, p), fineness)?)
            })
            .collect::<Result<_, ProjectionError>>()?;
        for (panel, slices) in panels.into_iter().zip(slices.chunks_exact(NODES)) {
            let part = PanelSum::new(panel, slices, &outgoing, f, incident.orders());
            if !part.is_within(accuracy * scale) && panel.depth < DEEPEST {
                waiting.extend(panel.halves());
                continue;
            }
            table.total += part.energy;
            table.error += part.error;
            part.add_to(&mut table.rho, f, p);
            for slice in slices {
                (peak, swing) = (peak.max(slice.peak), swing.max(slice.swing));
            }
        }
    }
    let beyond: f64 = energies(&table.rho, p).chunks_exact(side).flat_map(|row| &row[1..]).sum();
    if beyond <= NOTHING * table.total {
        // The same from every view: the coefficients with p > 0 are rounding errors.
        table.rho.chunks_exact_mut(side * side).for_each(|row| row[1..].fill([0.0; 3]));
    }
    if swing <= EQUAL * peak {
        // Independent of the azimuth: the coefficients with q > 0 are rounding errors.
        table.rho.chunks_exact_mut(side).for_each(|row| row[1..].fill([0.0; 3]));
    }
    if table.total > 0.0 {
        table.error /= table.total;
    }
    Ok(table)
}

/// A panel's part of all coefficients.
struct PanelSum {
    /// The panel's part by both rules, shape [q, p - q, F+1 - q]; the second is their difference.
    rho: Vec<[[f64; 3]; 2]>,
    energy: f64,
    difference: f64,
    error: f64,
    /// The energy of the rules' differences in all coefficients.
    norm: f64,
}

impl PanelSum {
    fn new(panel: Panel, slices: &[Slice], outgoing: &Legendre, f: usize, orders: usize) -> Self {
        let (mut cosine, mut sine, mut area) = ([1.0; LANES], [0.0; LANES], [0.0; NODES]);
        for (i, node) in RULE.into_iter().enumerate() {
            (sine[i], cosine[i]) = math::sin_cos(panel.at(node));
            area[i] = TAU * panel.radius() * sine[i];
        }
        let [mut energy, mut difference, mut error] = [0.0; 3];
        for (i, node) in RULE.into_iter().enumerate() {
            energy += area[i] * node.kronrod * slices[i].energy;
            difference += area[i] * (node.kronrod - node.gauss) * slices[i].energy;
            error += area[i] * node.kronrod * slices[i].error;
        }
        let mut rho = Vec::new();
        let mut norm = 0.0;
        outgoing.visit(&cosine, &sine, |_, q, value| {
            let signs = if q == 0 { 1.0 } else { 2.0 };
            for l in q..=f {
                let mut sums = [[0.0; 3]; 2];
                for (i, node) in RULE.into_iter().enumerate() {
                    let moment = slices[i].moments[l * (orders + 1) + q];
                    let weights = [node.kronrod, node.kronrod - node.gauss];
                    for (sum, weight) in sums.iter_mut().zip(weights) {
                        for channel in 0..3 {
                            sum[channel] += area[i] * weight * value[i] * moment[channel];
                        }
                    }
                }
                norm += signs * sums[1].iter().map(|value| value * value).sum::<f64>();
                rho.push(sums);
            }
        });
        Self { rho, energy, difference: difference.abs(), error: error + difference.abs(), norm }
    }

    fn is_within(&self, energy: f64) -> bool {
        self.difference <= energy && self.norm <= energy
    }

    /// Adds the panel to the tensor.
    fn add_to(&self, tensor: &mut [[f64; 3]], f: usize, p: usize) {
        let mut parts = self.rho.iter();
        for q in 0..=p.min(f) {
            for p_of in q..=p {
                for l in q..=f {
                    let Some([part, _]) = parts.next() else { return };
                    let value = &mut tensor[(l * (p + 1) + p_of) * (p + 1) + q];
                    for channel in 0..3 {
                        value[channel] += part[channel];
                    }
                }
            }
        }
    }
}
