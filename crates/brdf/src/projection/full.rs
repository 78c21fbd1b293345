//! Coefficients up to degrees that are cut later, when the light is known.
//!
//! How many degrees show depends on the light as much as on the material, so this projection makes more than
//! any light needs, quickly: rho_hat is sampled on a fixed grid. Its nodes are those of Gauss and Legendre
//! over the cosine of theta_o; midpoints over half a turn of phi; and panels of theta_i that are narrow about
//! the central direction, where highlights are, and nowhere wider than the highest degree resolves. So the
//! work is the same for every material, and what a kink or a peak at grazing views loses is far less than the
//! cut that follows.
//!
//! A view below the surface (about the normal) is seen by nobody. There the material is continued as its
//! mirror image, which leaves no edge at the horizon to ring.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;
use sh::quadrature::gauss_legendre;
use sphere::Direction;

use super::error::ProjectionError;
use super::legendre::Legendre;
use super::slice::{NotFinite, Source};
use super::tabulation::{Table, energies};
use crate::{Centre, SurfaceView};

/// The highest F: finer than what a soft light and a highlight of GGX roughness 0.1 share.
pub(super) const F: usize = 255;

/// The highest P: above the 16 that maps have, so that a cut at 16 can be compared with something.
const P: usize = 24;

/// The number of nodes of a panel of theta_i.
const NODES: usize = 6;

/// The widest panel times the highest degree F: 6 nodes on it resolve that degree (two nodes for each half
/// wave).
const WIDEST: f64 = 0.05 * 255.0;

/// The widest panel of any degree.
const WIDEST_EVER: f64 = 0.2;

/// The degrees and the nodes of a projection.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    /// The highest F.
    f: usize,
    /// The highest P.
    p: usize,
    /// The number of nodes of theta_o.
    outgoing: usize,
    /// The number of nodes of phi over half a turn.
    azimuths: usize,
}

impl Grid {
    /// The grid of [`super::Choice::Full`].
    pub(super) const fn full() -> Self {
        Self { f: F, p: P, outgoing: 80, azimuths: 48 }
    }

    /// A coarse grid up to this F: a tenth of the work.
    pub(super) fn sketch(f: usize) -> Self {
        Self { f: f.min(F), p: 20, outgoing: 48, azimuths: 32 }
    }

    /// The widest panel of theta_i.
    fn widest(self) -> f64 {
        (WIDEST / self.f.max(1) as f64).min(WIDEST_EVER)
    }
}

/// The share of the energy that may be lost with the highest degrees.
const NEGLIGIBLE: f64 = 1e-11;

/// The coefficients of rho_hat up to the grid's degrees, the F that is enough, and P.
pub(super) fn full(source: Source<'_>, grid: Grid) -> Result<(Table, usize, usize), ProjectionError> {
    let incident = incident_nodes(grid.widest());
    let views = OutgoingNodes::new(source.centre, grid);
    let slice = |(theta, _): &(f64, f64)| {
        source.stop.check()?;
        Ok(views.slice(source, *theta)?)
    };
    let slices: Vec<IncidentSlice> =
        incident.par_iter().map(slice).collect::<Result<_, ProjectionError>>()?;
    let total = incident
        .iter()
        .zip(&slices)
        .map(|((theta, weight), slice)| weight * math::sin(*theta) * slice.energy);
    let total: f64 = TAU * total.sum::<f64>();

    let side = grid.p + 1;
    let mut rho = vec![[0.0; 3]; (grid.f + 1) * side * side];
    let columns: Vec<Vec<[f64; 3]>> = (0..=grid.p.min(grid.f))
        .into_par_iter()
        .map(|q| incident_moments(&incident, &slices, q, grid))
        .collect();
    for (q, column) in columns.iter().enumerate() {
        for l in q..=grid.f {
            for p in q..=grid.p {
                rho[(l * side + p) * side + q] = column[l * side + p];
            }
        }
    }
    // Rounding leaves traces of an azimuth that the material does not depend on.
    let largest = |azimuth: bool| {
        let entries = rho.iter().enumerate().filter(|(index, _)| (index % side > 0) == azimuth);
        entries.flat_map(|(_, rgb)| rgb).fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    if largest(true) < 1e-13 * largest(false) {
        rho.iter_mut().enumerate().filter(|(index, _)| index % side > 0).for_each(|(_, rgb)| *rgb = [0.0; 3]);
    }
    let energy: Vec<f64> = energies(&rho, grid.p).chunks_exact(side).map(|row| row.iter().sum()).collect();
    let evaluations = incident.len() * grid.outgoing * grid.azimuths;
    let total = total.max(energy.iter().sum());
    Ok((Table { p: grid.p, rho, total, error: 0.0, evaluations }, enough(&energy), grid.p))
}

/// The least degree that loses at most the negligible share of these energies.
pub(super) fn enough(energy: &[f64]) -> usize {
    let (whole, mut left) = (energy.iter().sum::<f64>(), 0.0);
    let last = (0..energy.len()).rev().find(|l| {
        left += energy[*l];
        left > NEGLIGIBLE * whole
    });
    last.unwrap_or(0)
}

/// The number of times that [`full`] asks whether to stop.
pub(super) fn steps() -> usize {
    incident_nodes(Grid::full().widest()).len()
}

/// Nodes and weights of theta_i over 0 to pi, on panels that are no wider than this.
fn incident_nodes(widest: f64) -> Vec<(f64, f64)> {
    let mut edges = vec![0.0];
    let mut edge: f64 = 2e-4;
    while edge < PI - widest / 2.0 {
        edges.push(edge);
        edge += (0.6 * edge).min(widest);
    }
    edges.push(PI);
    let (angles, weights) = gauss_legendre(NODES);
    let panel = |ends: &[f64]| {
        let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
        let node = |(angle, weight): (&f64, &f64)| (middle - half * math::cos(*angle), half * weight);
        angles.iter().zip(&weights).map(node).collect::<Vec<_>>()
    };
    edges.windows(2).flat_map(panel).collect()
}

/// The nodes of the outgoing directions, and the functions at them.
struct OutgoingNodes {
    grid: Grid,
    /// The angle theta_o and its weight over the cosine.
    outgoing: Vec<(f64, f64)>,
    /// The view of each theta_o, or its mirror image if it is below the surface.
    seen: Vec<SurfaceView>,
    /// f_pq at each theta_o, [node, p, q].
    functions: Vec<f64>,
    /// cos(q phi) at each azimuth times its weight over a whole turn, [azimuth, q].
    cosines: Vec<f64>,
}

/// rho_hat of one theta_i over the outgoing directions.
struct IncidentSlice {
    /// 2 pi times the integral of rho_hat f_pq cos(q phi), [p, q].
    moments: Vec<[f64; 3]>,
    /// The integral of rho_hat^2 over theta_o and phi.
    energy: f64,
}

impl OutgoingNodes {
    fn new(centre: Centre, grid: Grid) -> Self {
        let (angles, weights) = gauss_legendre(grid.outgoing);
        let side = grid.p + 1;
        let legendre = Legendre::new(grid.p, grid.p);
        let mut functions = vec![0.0; grid.outgoing * side * side];
        for (node, theta) in angles.iter().enumerate() {
            legendre.visit(&[math::cos(*theta); 16], &[math::sin(*theta); 16], |p, q, value| {
                functions[(node * side + p) * side + q] = value[0];
            });
        }
        let cosine =
            |j: usize, q: usize| TAU / grid.azimuths as f64 * math::cos(q as f64 * azimuth(j, grid.azimuths));
        let cosines = (0..grid.azimuths).flat_map(|j| (0..=grid.p).map(move |q| cosine(j, q))).collect();
        let visible = |theta: f64| if centre == Centre::Normal { theta.min(PI - theta) } else { theta };
        let seen = |theta: &f64| centre.toward(Direction::from_angles(visible(*theta), 0.0));
        let seen = angles.iter().map(seen).collect();
        Self { grid, outgoing: angles.into_iter().zip(weights).collect(), seen, functions, cosines }
    }

    fn slice(&self, source: Source<'_>, theta_i: f64) -> Result<IncidentSlice, NotFinite> {
        let Grid { p: most_p, azimuths, .. } = self.grid;
        let side = most_p + 1;
        let mut moments = vec![[0.0; 3]; side * side];
        let (mut energy, mut series) = (0.0, vec![[0.0; 3]; side]);
        let incident: Vec<Direction> =
            (0..azimuths).map(|j| Direction::from_angles(theta_i, azimuth(j, azimuths))).collect();
        for (node, ((theta_o, weight), view)) in self.outgoing.iter().zip(&self.seen).enumerate() {
            series.fill([0.0; 3]);
            for (j, cosines) in self.cosines.chunks_exact(side).enumerate() {
                let value = (source.rho_hat)(view.incident(incident[j]), view.outgoing());
                if !value.iter().all(|value| value.is_finite()) {
                    return Err(NotFinite { theta_i, theta_o: *theta_o, phi: azimuth(j, azimuths) });
                }
                energy += weight * cosines[0] * value.iter().map(|value| value * value).sum::<f64>();
                for (sum, cosine) in series.iter_mut().zip(cosines) {
                    (0..3).for_each(|channel| sum[channel] += cosine * value[channel]);
                }
            }
            for p in 0..=most_p {
                for q in 0..=p {
                    let factor = TAU * weight * self.functions[(node * side + p) * side + q];
                    (0..3).for_each(|channel| moments[p * side + q][channel] += factor * series[q][channel]);
                }
            }
        }
        Ok(IncidentSlice { moments, energy })
    }
}

/// The middle of an interval of half a turn.
fn azimuth(j: usize, azimuths: usize) -> f64 {
    PI * (j as f64 + 0.5) / azimuths as f64
}

/// The integrals over theta_i for one q, [l, p]: those of the moments times f_lq sin(theta_i).
fn incident_moments(
    incident: &[(f64, f64)],
    slices: &[IncidentSlice],
    q: usize,
    grid: Grid,
) -> Vec<[f64; 3]> {
    let side = grid.p + 1;
    let mut sums = vec![[0.0; 3]; (grid.f + 1) * side];
    let legendre = Legendre::new(grid.f, grid.p);
    for ((theta, weight), slice) in incident.iter().zip(slices) {
        let moments: Vec<[f64; 3]> = (q..=grid.p)
            .map(|p| slice.moments[p * side + q].map(|moment| moment * weight * math::sin(*theta)))
            .collect();
        legendre.order(q, math::cos(*theta), math::sin(*theta), |l, value| {
            for (sum, moment) in sums[l * side + q..][..side - q].iter_mut().zip(&moments) {
                (0..3).for_each(|channel| sum[channel] += value * moment[channel]);
            }
        });
    }
    sums
}
