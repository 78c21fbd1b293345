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

use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::{F64x4, LANES, SimdLevel, load, store};
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
    // In small pieces: an idle thread takes what another has not begun.
    let slices: Vec<IncidentSlice> =
        incident.par_iter().with_max_len(4).map(slice).collect::<Result<_, ProjectionError>>()?;
    let total = incident
        .iter()
        .zip(&slices)
        .map(|((theta, weight), slice)| weight * math::sin(*theta) * slice.energy);
    let total: f64 = TAU * total.sum::<f64>();

    let side = grid.p + 1;
    let mut rho = vec![[0.0; 3]; (grid.f + 1) * side * side];
    let legendre = Legendre::new(grid.f, grid.p);
    let level = SimdLevel::detect();
    let columns: Vec<Vec<F64x4>> = (0..grid.p.min(grid.f) + 1)
        .into_par_iter()
        .with_max_len(1)
        .map(|q| {
            level.run(IncidentMoments { incident: &incident, slices: &slices, legendre: &legendre, q, grid })
        })
        .collect();
    for (q, column) in columns.iter().enumerate() {
        let row = vectors_of(q, grid);
        for l in q..=grid.f {
            let values = column[l * row..][..row].iter().flat_map(|vector| vector.0).collect::<Vec<_>>();
            for (p, rgb) in (q..=grid.p).zip(values.chunks_exact(3)) {
                rho[(l * side + p) * side + q] = [rgb[0], rgb[1], rgb[2]];
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

/// Vectors that hold a number for each q.
const VECTORS: usize = (P + 1).div_ceil(LANES);

/// The nodes of the outgoing directions, and the functions at them.
struct OutgoingNodes {
    grid: Grid,
    level: SimdLevel,
    /// The angle theta_o and its weight over the cosine.
    outgoing: Vec<(f64, f64)>,
    /// The view of each theta_o, or its mirror image if it is below the surface.
    seen: Vec<SurfaceView>,
    /// f_pq at each theta_o times 2 pi times its weight, [node, p, q].
    functions: Vec<[F64x4; VECTORS]>,
    /// cos(q phi) at each azimuth times its weight over a whole turn, [azimuth, q].
    cosines: Vec<[F64x4; VECTORS]>,
}

/// rho_hat of one theta_i over the outgoing directions.
struct IncidentSlice {
    /// 2 pi times the integral of rho_hat f_pq cos(q phi), [channel, p, q].
    moments: Vec<[F64x4; VECTORS]>,
    /// The integral of rho_hat^2 over theta_o and phi.
    energy: f64,
}

impl IncidentSlice {
    fn moment(&self, p: usize, q: usize) -> [f64; 3] {
        let side = self.moments.len() / 3;
        std::array::from_fn(|channel| self.moments[channel * side + p][q / LANES].0[q % LANES])
    }
}

impl OutgoingNodes {
    fn new(centre: Centre, grid: Grid) -> Self {
        let (angles, weights) = gauss_legendre(grid.outgoing);
        let side = grid.p + 1;
        let legendre = Legendre::new(grid.p, grid.p);
        let mut functions = vec![[F64x4::ZERO; VECTORS]; grid.outgoing * side];
        for (node, (theta, weight)) in angles.iter().zip(&weights).enumerate() {
            legendre.visit(&[math::cos(*theta); 16], &[math::sin(*theta); 16], |p, q, value| {
                functions[node * side + p][q / LANES].0[q % LANES] = TAU * weight * value[0];
            });
        }
        let cosine =
            |j: usize, q: usize| TAU / grid.azimuths as f64 * math::cos(q as f64 * azimuth(j, grid.azimuths));
        let mut cosines = vec![[F64x4::ZERO; VECTORS]; grid.azimuths];
        for (j, cosines) in cosines.iter_mut().enumerate() {
            (0..side).for_each(|q| cosines[q / LANES].0[q % LANES] = cosine(j, q));
        }
        let visible = |theta: f64| if centre == Centre::Normal { theta.min(PI - theta) } else { theta };
        let seen = |theta: &f64| centre.toward(Direction::from_angles(visible(*theta), 0.0));
        let seen = angles.iter().map(seen).collect();
        let outgoing = angles.into_iter().zip(weights).collect();
        Self { grid, level: SimdLevel::detect(), outgoing, seen, functions, cosines }
    }

    fn slice(&self, source: Source<'_>, theta_i: f64) -> Result<IncidentSlice, NotFinite> {
        let azimuths = self.grid.azimuths;
        let incident: Vec<Direction> =
            (0..azimuths).map(|j| Direction::from_angles(theta_i, azimuth(j, azimuths))).collect();
        let mut energy = 0.0;
        let mut lit = Vec::with_capacity(self.outgoing.len());
        let (mut pairs, mut found) = (Vec::with_capacity(azimuths), vec![[0.0; 3]; azimuths]);
        for ((theta_o, weight), view) in self.outgoing.iter().zip(&self.seen) {
            pairs.clear();
            pairs.extend(incident.iter().map(|incident| [view.incident(*incident), view.outgoing()]));
            (source.rho_hats)(&pairs, &mut found);
            let mut values = Vec::with_capacity(azimuths);
            for (j, (cosines, value)) in self.cosines.iter().zip(&found).enumerate() {
                if !value.iter().all(|value| value.is_finite()) {
                    return Err(NotFinite { theta_i, theta_o: *theta_o, phi: azimuth(j, azimuths) });
                }
                energy += weight * cosines[0].0[0] * value.iter().map(|value| value * value).sum::<f64>();
                if *value != [0.0; 3] {
                    values.push((j, *value));
                }
            }
            lit.push(values);
        }
        let mut moments = vec![[F64x4::ZERO; VECTORS]; 3 * (self.grid.p + 1)];
        self.level.run(OutgoingMoments { nodes: self, lit: &lit, moments: &mut moments });
        Ok(IncidentSlice { moments, energy })
    }
}

/// The integrals over theta_o and phi.
struct OutgoingMoments<'a> {
    nodes: &'a OutgoingNodes,
    /// The azimuths of each theta_o where rho_hat is not zero, with its values.
    lit: &'a [Vec<(usize, [f64; 3])>],
    moments: &'a mut [[F64x4; VECTORS]],
}

impl WithSimd for OutgoingMoments<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let side = self.nodes.grid.p + 1;
        let functions = self.nodes.functions.chunks_exact(side);
        for (values, functions) in self.lit.iter().zip(functions).filter(|(values, _)| !values.is_empty()) {
            for (channel, moments) in self.moments.chunks_exact_mut(side).enumerate() {
                let mut series = [simd.splat_f64s(0.0); VECTORS];
                for (j, value) in values {
                    let (value, cosines) = (simd.splat_f64s(value[channel]), &self.nodes.cosines[*j]);
                    for k in 0..VECTORS {
                        series[k] = simd.mul_add_f64s(load(simd, &cosines[k]), value, series[k]);
                    }
                }
                for (p, (moments, functions)) in moments.iter_mut().zip(functions).enumerate() {
                    for k in 0..=p / LANES {
                        let sum =
                            simd.mul_add_f64s(load(simd, &functions[k]), series[k], load(simd, &moments[k]));
                        store(simd, sum, &mut moments[k]);
                    }
                }
            }
        }
    }
}

/// The middle of an interval of half a turn.
fn azimuth(j: usize, azimuths: usize) -> f64 {
    PI * (j as f64 + 0.5) / azimuths as f64
}

/// Angles theta_i whose terms are added at once: a sum is read and written once for all of them.
const AT_ONCE: usize = 8;

/// Vectors that hold three numbers for each p from q on.
fn vectors_of(q: usize, grid: Grid) -> usize {
    (3 * (grid.p + 1 - q)).div_ceil(LANES)
}

/// The integrals over theta_i for one q, [l, p, channel]: those of the moments times f_lq sin(theta_i).
struct IncidentMoments<'a> {
    incident: &'a [(f64, f64)],
    slices: &'a [IncidentSlice],
    legendre: &'a Legendre,
    q: usize,
    grid: Grid,
}

impl WithSimd for IncidentMoments<'_> {
    type Output = Vec<F64x4>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<F64x4> {
        let Self { incident, slices, legendre, q, grid } = self;
        let row = vectors_of(q, grid);
        let mut sums = vec![F64x4::ZERO; (grid.f + 1) * row];
        let mut functions = vec![[0.0; AT_ONCE]; grid.f + 1];
        for (incident, slices) in incident.chunks(AT_ONCE).zip(slices.chunks(AT_ONCE)) {
            // Angles that are missing in the last block have no moments.
            let (mut cosine, mut sine) = ([1.0; AT_ONCE], [0.0; AT_ONCE]);
            let mut moments = vec![[F64x4::ZERO; AT_ONCE]; row];
            for (i, ((theta, weight), slice)) in incident.iter().zip(slices).enumerate() {
                (sine[i], cosine[i]) = (math::sin(*theta), math::cos(*theta));
                for p in q..=grid.p {
                    for (channel, moment) in slice.moment(p, q).into_iter().enumerate() {
                        let at = 3 * (p - q) + channel;
                        moments[at / LANES][i].0[at % LANES] = moment * weight * sine[i];
                    }
                }
            }
            legendre.order(q, &cosine, &sine, |l, values| functions[l] = *values);
            for (sums, functions) in sums.chunks_exact_mut(row).zip(&functions).skip(q) {
                let functions = functions.map(|value| simd.splat_f64s(value));
                for (sum, moments) in sums.iter_mut().zip(&moments) {
                    let mut total = load(simd, sum);
                    for i in 0..AT_ONCE {
                        total = simd.mul_add_f64s(load(simd, &moments[i]), functions[i], total);
                    }
                    store(simd, total, sum);
                }
            }
        }
        sums
    }
}
