//! One outgoing direction: rho_hat sampled over all incident ones, and the first two steps of the projection
//! ([Ram02, eq. 5.22], with the sums over theta_i and theta_o exchanged)
//!
//! > rho_q(theta_i)  = integral over [0, 2 pi] of rho_hat(theta_i, theta_o, phi) cos(q phi) dphi
//! > rho_lq(theta_o) = integral over [0, pi] of rho_q(theta_i) f_lq(theta_i) sin(theta_i) dtheta_i.
//!
//! Panels are halved until both rules agree on the integral of rho_hat^2 over them, so that nodes concentrate
//! at a sharp highlight, wherever it is.

use std::f64::consts::TAU;

use glam::DVec3;
use sh::Stop;
use sphere::Direction;

use super::error::ProjectionError;
use super::incident::{CirclePart, Piece, pieces};
use super::legendre::{F64x16, LANES, Legendre};
use crate::Centre;
use crate::quadrature::{NODES, Panel, RULE};

/// Computes rho_hat toward one view of light from some directions.
pub(super) type RhoHats<'a> = &'a (dyn Fn(Direction, &[Direction], &mut [[f64; 3]]) + Sync);

/// The function that is projected.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) centre: Centre,
    /// rho_hat in the frame of the surface, even in phi about the central direction.
    pub(super) rho_hats: RhoHats<'a>,
    /// Whether the function reflects light from below the horizon.
    pub(super) below: bool,
    /// Whether nobody wants the result any more.
    pub(super) stop: Stop<'a>,
}

impl Source<'_> {
    pub(super) fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let mut value = [[0.0; 3]];
        (self.rho_hats)(outgoing, &[incident], &mut value);
        value[0]
    }
}

/// The place of a value that is NaN, or whose square overflows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NotFinite {
    pub(super) theta_i: f64,
    pub(super) theta_o: f64,
    pub(super) phi: f64,
}

impl From<NotFinite> for ProjectionError {
    fn from(at: NotFinite) -> Self {
        Self::NotFinite {
            theta_i: at.theta_i.to_degrees(),
            theta_o: at.theta_o.to_degrees(),
            phi: at.phi.to_degrees(),
        }
    }
}

/// How finely a slice is sampled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// The error that a panel may make in the slice's energy; infinite if nothing is to be refined.
    pub(super) error: f64,
    /// Panels with less energy than this are not refined for the sake of high degrees.
    pub(super) negligible: f64,
}

/// A projection's moments and energy for one outgoing direction.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    /// rho_lq for l <= F and q <= orders, shape [F+1, orders+1], RGB.
    pub(super) moments: Vec<[f64; 3]>,
    /// The integral of rho_hat^2 over the incident directions, summed over channels.
    pub(super) energy: f64,
    /// The difference of both quadrature rules in the energy.
    pub(super) error: f64,
    /// The largest value of rho_hat.
    pub(super) peak: f64,
    /// The greatest variation of a value along a circle theta_i = const.
    pub(super) swing: f64,
    /// The number of evaluations of rho_hat.
    pub(super) evaluations: usize,
}

/// The greatest width of a panel in theta_i at first.
const WIDEST: f64 = 0.6;
/// A panel of width h integrates cos(k x), times a smooth factor, to 1e-5 for k h up to this.
const PHASE: f64 = 13.0;
/// The most evaluations for one slice; panels that are left unrefined show in its error.
const MOST_EVALUATIONS: usize = 400_000;
/// The most halvings in theta_i and in phi. A highlight of 1e-7 is too sharp for every degree.
const DEEPEST: [usize; 2] = [24, 8];

/// rho_hat toward one outgoing direction.
struct Outgoing<'a> {
    source: Source<'a>,
    theta_o: f64,
    /// The local axes in the frame of the surface.
    axes: [DVec3; 3],
    /// w_o in the frame of the surface.
    view: Direction,
}

impl<'a> Outgoing<'a> {
    fn new(source: Source<'a>, theta_o: f64) -> Self {
        // About N views below the surface never occur. They mirror the upper half, which needs the least
        // degrees.
        let seen = if source.centre == Centre::Normal {
            theta_o.min(std::f64::consts::PI - theta_o)
        } else {
            theta_o
        };
        let local = Direction::from_angles(seen, 0.0);
        let axes = [Direction::X, Direction::Y, Direction::Z]
            .map(|axis| source.centre.surface(axis, local)[0].vector());
        let [_, view] = source.centre.surface(Direction::Z, local);
        Self { source, theta_o, axes, view }
    }

    /// The incident direction, in the frame of the surface.
    fn incident(&self, (cosine, sine): (f64, f64), cos_phi: f64, sin_phi: f64) -> Direction {
        let [x, y, z] = self.axes;
        Direction::from_unit(x * (sine * cos_phi) + y * (sine * sin_phi) + z * cosine)
    }
}

/// The nodes of a panel in theta_i.
struct Columns {
    cosine: F64x16,
    sine: F64x16,
    /// The value rho_q of every node times its weight, per order and channel.
    modes: Vec<[F64x16; 3]>,
    energy: f64,
    error: f64,
    /// The value at the first node, phi = 0 nearly.
    first: [f64; 3],
    peak: f64,
    swing: f64,
}

/// Samples one outgoing direction.
pub(super) fn slice(
    source: Source<'_>,
    theta_o: f64,
    legendre: &Legendre,
    (f, p): (usize, usize),
    fineness: Fineness,
) -> Result<Slice, NotFinite> {
    let outgoing = Outgoing::new(source, theta_o);
    let side = legendre.orders() + 1;
    let mut slice = Slice {
        moments: vec![[0.0; 3]; (f + 1) * side],
        energy: 0.0,
        error: 0.0,
        peak: 0.0,
        swing: 0.0,
        evaluations: 0,
    };
    let (incident, view) = (outgoing.incident((1.0, 0.0), 1.0, 0.0), outgoing.view);
    let top = source.rho_hat(incident, view);
    let widest = (PHASE / f.max(1) as f64).clamp(WIDEST / 3.0, WIDEST);
    let mut columns = Columns {
        cosine: [1.0; LANES],
        sine: [0.0; LANES],
        modes: vec![[[0.0; LANES]; 3]; side],
        energy: 0.0,
        error: 0.0,
        first: [0.0; 3],
        peak: 0.0,
        swing: 0.0,
    };
    for piece in pieces(source.centre, theta_o, source.below) {
        let mut waiting: Vec<Panel> = piece.panels(widest).collect();
        waiting.reverse();
        while let Some(panel) = waiting.pop() {
            columns.fill(&outgoing, &piece, panel, (f, p), fineness, &mut slice.evaluations)?;
            let high = panel.radius() * 2.0 * piece.stretch() * f as f64 > PHASE;
            let refine = columns.error > fineness.error
                || high && columns.energy > fineness.negligible
                || panel.from == 0.0
                    && piece.part == CirclePart::Whole
                    && hidden(&columns, top) > fineness.error;
            if refine && panel.depth < DEEPEST[0] && slice.evaluations < MOST_EVALUATIONS {
                waiting.extend(panel.halves().into_iter().rev());
                continue;
            }
            slice.energy += columns.energy;
            slice.error += columns.error;
            slice.peak = slice.peak.max(columns.peak);
            slice.swing = slice.swing.max(columns.swing);
            if columns.energy > 0.0 {
                columns.project(legendre, &mut slice.moments);
            }
        }
    }
    Ok(slice)
}

/// The energy that a highlight at theta_i = 0 may have between the axis and the first node.
fn hidden(columns: &Columns, top: [f64; 3]) -> f64 {
    let gap: f64 = (0..3).map(|c| math::powi(top[c] - columns.first[c], 2)).sum();
    TAU * gap * math::powi(columns.sine[0], 2) / 2.0
}

impl Columns {
    /// Samples the circles of a panel.
    fn fill(
        &mut self,
        outgoing: &Outgoing<'_>,
        piece: &Piece,
        panel: Panel,
        (f, p): (usize, usize),
        fineness: Fineness,
        evaluations: &mut usize,
    ) -> Result<(), NotFinite> {
        self.modes.fill([[0.0; LANES]; 3]);
        (self.energy, self.error, self.peak, self.swing) = (0.0, 0.0, 0.0, 0.0);
        let mut inner = 0.0;
        let [mut kronrod, mut gauss] = [0.0; 2];
        for (lane, node) in RULE.into_iter().enumerate() {
            let t = panel.at(node);
            let ((theta, slope), (from, to)) = (piece.theta(t), piece.azimuths(t));
            let (sine, cosine) = math::sin_cos(theta);
            (self.sine[lane], self.cosine[lane]) = (sine, cosine);
            let area = panel.radius() * slope * sine;
            let circle = Circle { outgoing, theta, cosine, sine, whole: piece.part == CirclePart::Whole };
            let allowed = fineness.error / (2.0 * area);
            // Small circles have no high orders: f_lq is negligible for q above l sin(theta_i).
            let order = (1.2 * f as f64 * sine + 8.0).min(p as f64).max(1.0);
            let ring = circle.sample(
                Panel::split(from, to, PHASE / order),
                area * node.kronrod,
                allowed,
                lane,
                self,
                evaluations,
            )?;
            kronrod += area * node.kronrod * ring[0];
            gauss += area * node.gauss * ring[0];
            inner += area * node.kronrod * ring[1];
        }
        debug_assert_eq!(NODES + 1, LANES);
        self.energy = kronrod;
        self.error = (kronrod - gauss).abs().max(inner);
        Ok(())
    }

    /// Adds the panel's part of every rho_lq.
    fn project(&self, legendre: &Legendre, moments: &mut [[f64; 3]]) {
        let side = legendre.orders() + 1;
        legendre.visit(&self.cosine, &self.sine, |l, q, value| {
            let modes = &self.modes[q];
            let moment = &mut moments[l * side + q];
            for channel in 0..3 {
                moment[channel] += dot(value, &modes[channel]);
            }
        });
    }
}

/// The sum of products, in four independent sums that fill vector registers.
#[inline]
fn dot(a: &F64x16, b: &F64x16) -> f64 {
    let mut sums = [0.0; 4];
    for i in 0..LANES {
        sums[i % 4] += a[i] * b[i];
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Sines and cosines at a panel's nodes: those of its middle, turned by seven distances to both sides.
fn turns(panel: Panel) -> [(f64, f64); NODES] {
    let (sine, cosine) = math::sin_cos(0.5 * (panel.from + panel.to));
    let mut turns = [(sine, cosine); NODES];
    for i in 0..NODES / 2 {
        let (s, c) = math::sin_cos(panel.radius() * RULE[i].x);
        turns[i] = (sine * c + cosine * s, cosine * c - sine * s);
        turns[NODES - 1 - i] = (sine * c - cosine * s, cosine * c + sine * s);
    }
    turns
}

/// A circle theta_i = const, or an arc of it.
struct Circle<'a> {
    outgoing: &'a Outgoing<'a>,
    theta: f64,
    cosine: f64,
    sine: f64,
    /// Whether the horizon does not cut the circle.
    whole: bool,
}

impl Circle<'_> {
    /// Adds rho_q times `weight` to the modes of a lane. Returns the integral of rho_hat^2 along the circle,
    /// and the difference of both rules in it.
    fn sample(
        &self,
        panels: impl Iterator<Item = Panel>,
        weight: f64,
        allowed: f64,
        lane: usize,
        columns: &mut Columns,
        evaluations: &mut usize,
    ) -> Result<[f64; 2], NotFinite> {
        let mut sum = [0.0; 2];
        let mut range = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let mut waiting: Vec<Panel> = panels.collect();
        waiting.reverse();
        let mut first = lane == 0;
        while let Some(panel) = waiting.pop() {
            let turns = turns(panel);
            let incident = turns
                .map(|(sin_phi, cos_phi)| self.outgoing.incident((self.cosine, self.sine), cos_phi, sin_phi));
            let mut values = [[0.0; 3]; NODES];
            (self.outgoing.source.rho_hats)(self.outgoing.view, &incident, &mut values);
            let mut cosines = [0.0; LANES];
            let [mut kronrod, mut gauss] = [0.0; 2];
            for (i, (node, (_, cos_phi))) in RULE.into_iter().zip(turns).enumerate() {
                let rho = values[i];
                let square: f64 = rho.iter().map(|value| value * value).sum();
                if !square.is_finite() {
                    let phi = panel.at(node);
                    return Err(NotFinite { theta_i: self.theta, theta_o: self.outgoing.theta_o, phi });
                }
                kronrod += node.kronrod * square;
                gauss += node.gauss * square;
                cosines[i] = cos_phi;
            }
            *evaluations += NODES;
            // Both signs of phi.
            let both = 2.0 * panel.radius();
            let difference = both * (kronrod - gauss).abs();
            if std::mem::take(&mut first) {
                columns.first = values[0];
            }
            if difference > allowed && panel.depth < DEEPEST[1] && *evaluations < MOST_EVALUATIONS {
                waiting.extend(panel.halves().into_iter().rev());
                continue;
            }
            sum[0] += both * kronrod;
            sum[1] += difference;
            if kronrod == 0.0 && range[1] == [0.0; 3] {
                continue;
            }
            let mut scaled = [[0.0; LANES]; 3];
            for i in 0..NODES {
                for channel in 0..3 {
                    let value = values[i][channel];
                    scaled[channel][i] = value * weight * both * RULE[i].kronrod;
                    range[0][channel] = range[0][channel].min(value);
                    range[1][channel] = range[1][channel].max(value);
                }
            }
            let (mut before, mut cosine) = (cosines, [1.0; LANES]);
            for mode in &mut columns.modes {
                for channel in 0..3 {
                    mode[channel][lane] += dot(&scaled[channel], &cosine);
                }
                for i in 0..LANES {
                    (before[i], cosine[i]) = (cosine[i], 2.0 * cosines[i] * cosine[i] - before[i]);
                }
            }
        }
        for channel in 0..3 {
            let [low, high] = [range[0][channel], range[1][channel]];
            let peak = low.abs().max(high.abs());
            columns.peak = columns.peak.max(peak);
            columns.swing = columns.swing.max(if self.whole { high - low } else { peak });
        }
        Ok(sum)
    }
}
