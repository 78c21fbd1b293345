//! Coefficients up to degrees that are cut later, when the light is known.
//!
//! How many degrees show depends on the light as much as on the material, so this projection makes more than
//! any light needs, quickly: rho_hat is sampled on a fixed grid. Its nodes are those of Gauss and Legendre
//! over the cosine of theta_o; midpoints over half a turn of phi; and panels of theta_i that are narrow about
//! the central direction, where highlights are. On a panel rho_hat is the polynomial through its values at
//! the nodes; the functions that it is integrated with vary faster, and have nodes on parts of the panel. So
//! the work is the same for every material, and what a kink or a peak at grazing views loses is far less than
//! the cut that follows.
//!
//! Functions of phi and of theta_o are even or odd about a right angle, so that the values on both sides are
//! added, or subtracted, before they are multiplied with the functions.
//!
//! A view below the surface (about the normal) is seen by nobody. There the material is continued as its
//! mirror image, which leaves no edge at the horizon to ring.

mod grid;
mod incident_panels;
mod outgoing_nodes;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use rayon::prelude::*;
use sh::f64x4::{F64x4, LANES, SimdLevel};

use super::error::ProjectionError;
use super::legendre::Legendre;
use super::slice::Source;
use super::tabulation::{Table, energies};
use incident_panels::{IncidentMoments, NODES, incident_panels, vectors_of};
use outgoing_nodes::{IncidentSlice, OutgoingNodes};

pub(super) use grid::{F, Grid};

/// The share of the energy that may be lost with the highest degrees.
const NEGLIGIBLE: f64 = 1e-11;

/// The coefficients of rho_hat up to the grid's degrees, the F that is enough, and P.
pub(super) fn full(source: Source<'_>, grid: Grid) -> Result<(Table, usize, usize), ProjectionError> {
    let panels = incident_panels(grid);
    let views = OutgoingNodes::new(source.centre, grid);
    let slice = |theta: &f64| {
        source.stop.check()?;
        Ok(views.slice(source, *theta)?)
    };
    let angles: Vec<f64> = panels.iter().flat_map(|panel| panel.angles).collect();
    // In small pieces: an idle thread takes what another has not begun.
    let slices: Vec<IncidentSlice> =
        angles.par_iter().with_max_len(4).map(slice).collect::<Result<_, ProjectionError>>()?;
    let weights = panels.iter().flat_map(|panel| panel.weights);
    let total: f64 = TAU * weights.zip(&slices).map(|(weight, slice)| weight * slice.energy).sum::<f64>();

    let side = grid.p + 1;
    let mut rho = vec![[0.0; 3]; (grid.f + 1) * side * side];
    let legendre = Legendre::new(grid.f, grid.p);
    let level = SimdLevel::detect();
    let columns: Vec<Vec<F64x4>> = (0..grid.p.min(grid.f) + 1)
        .into_par_iter()
        .with_max_len(1)
        .map(|q| {
            level.run(IncidentMoments { panels: &panels, slices: &slices, legendre: &legendre, q, grid })
        })
        .collect();
    for (q, column) in columns.iter().enumerate() {
        let row = vectors_of(q, grid);
        for l in q..=grid.f {
            let values = &column[l * row..][..row];
            for p in q..=grid.p {
                let value = |channel: usize| {
                    let place = 3 * (p - q) + channel;
                    values[place / LANES].0[place % LANES]
                };
                rho[(l * side + p) * side + q] = std::array::from_fn(value);
            }
        }
    }
    // Rounding leaves traces of an azimuth that the material does not depend on.
    let mut largest = [0.0; 2];
    for row in rho.chunks_exact(side) {
        for (largest, row) in largest.iter_mut().zip([&row[..1], &row[1..]]) {
            *largest = row.as_flattened().iter().fold(*largest, |most: f64, value| most.max(value.abs()));
        }
    }
    if largest[1] < 1e-13 * largest[0] {
        rho.chunks_exact_mut(side).for_each(|row| row[1..].fill([0.0; 3]));
    }
    let energy: Vec<f64> = energies(&rho, grid.p).chunks_exact(side).map(|row| row.iter().sum()).collect();
    let total = total.max(energy.iter().sum());
    Ok((Table { p: grid.p, rho, total, error: 0.0 }, enough(&energy), grid.p))
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
    NODES * incident_panels(Grid::full()).len()
}
