//! Nodes of the outgoing directions, and the integrals of rho_hat over them for one incident angle.

use std::f64::consts::{PI, TAU};

use pulp::{Simd, WithSimd};
use sh::f64x4::{F64x4, LANES, SimdLevel, load, store};
use sh::quadrature::gauss_legendre;
use sphere::Direction;

use super::grid::{Grid, P};
use crate::projection::legendre::Legendre;
use crate::projection::slice::{NotFinite, Source};
use crate::{Centre, SurfaceView, ViewValues};

/// Vectors that hold a number for each even q.
const EVEN: usize = (P / 2 + 1).div_ceil(LANES);

/// Vectors that hold a number for each odd q.
const ODD: usize = P.div_ceil(2).div_ceil(LANES);

/// Vectors that hold a number for each q, first the even and then the odd ones.
const VECTORS: usize = EVEN + ODD;

/// The vector and the lane that hold the number of a q.
fn place(q: usize) -> (usize, usize) {
    let index = q / 2;
    (if q.is_multiple_of(2) { 0 } else { EVEN } + index / LANES, index % LANES)
}

/// The nodes of the outgoing directions, and the functions at them.
pub(super) struct OutgoingNodes {
    grid: Grid,
    level: SimdLevel,
    /// The angle theta_o and its weight over the cosine.
    outgoing: Vec<(f64, f64)>,
    /// The view of each theta_o, or its mirror image if it is below the surface.
    seen: Vec<SurfaceView>,
    /// f_pq at each theta_o up to a right angle times 2 pi times its weight, [node, p, q].
    functions: Vec<[F64x4; VECTORS]>,
    /// cos(q phi) at each azimuth of a quarter of a turn times its weight over a whole one, [azimuth, q].
    cosines: Vec<[F64x4; VECTORS]>,
}

/// rho_hat of one theta_i over the outgoing directions.
pub(super) struct IncidentSlice {
    /// 2 pi times the integral of rho_hat f_pq cos(q phi), [channel, p, q].
    moments: Vec<[F64x4; VECTORS]>,
    /// The integral of rho_hat^2 over theta_o and phi.
    pub(super) energy: f64,
}

impl IncidentSlice {
    pub(super) fn moment(&self, p: usize, q: usize) -> [f64; 3] {
        let side = self.moments.len() / 3;
        let (vector, lane) = place(q);
        std::array::from_fn(|channel| self.moments[channel * side + p][vector].0[lane])
    }
}

impl OutgoingNodes {
    pub(super) fn new(centre: Centre, grid: Grid) -> Self {
        let (angles, weights) = gauss_legendre(grid.outgoing);
        let side = grid.p + 1;
        let legendre = Legendre::new(grid.p, grid.p);
        let mut functions = vec![[F64x4::ZERO; VECTORS]; grid.outgoing / 2 * side];
        for (node, (theta, weight)) in angles.iter().zip(&weights).enumerate().take(grid.outgoing / 2) {
            legendre.visit(&[math::cos(*theta); 16], &[math::sin(*theta); 16], |p, q, value| {
                let (vector, lane) = place(q);
                functions[node * side + p][vector].0[lane] = TAU * weight * value[0];
            });
        }
        let cosine =
            |j: usize, q: usize| TAU / grid.azimuths as f64 * math::cos(q as f64 * azimuth(j, grid.azimuths));
        let mut cosines = vec![[F64x4::ZERO; VECTORS]; grid.azimuths / 2];
        for (j, cosines) in cosines.iter_mut().enumerate() {
            for q in 0..side {
                let (vector, lane) = place(q);
                cosines[vector].0[lane] = cosine(j, q);
            }
        }
        let visible = |theta: f64| if centre == Centre::Normal { theta.min(PI - theta) } else { theta };
        let seen = |theta: &f64| centre.toward(Direction::from_angles(visible(*theta), 0.0));
        let seen = angles.iter().map(seen).collect();
        let outgoing = angles.into_iter().zip(weights).collect();
        Self { grid, level: SimdLevel::detect(), outgoing, seen, functions, cosines }
    }

    /// rho_hat of one theta_i.
    ///
    /// # Errors
    /// If a value is not finite.
    pub(super) fn slice(&self, source: Source<'_>, theta_i: f64) -> Result<IncidentSlice, NotFinite> {
        let azimuths = self.grid.azimuths;
        let incident: Vec<Direction> =
            (0..azimuths).map(|j| Direction::from_angles(theta_i, azimuth(j, azimuths))).collect();
        let mut energy = 0.0;
        let (mut lit, mut bounds) = (Vec::new(), vec![0]);
        let mut values = ViewValues::default();
        for ((theta_o, weight), view) in self.outgoing.iter().zip(&self.seen) {
            values.fill(view, &incident, !source.below, source.rho_hats);
            let values = values.values();
            let mut squares = [0.0; 3];
            for value in values {
                (0..3).for_each(|channel| squares[channel] += value[channel] * value[channel]);
            }
            let squares: f64 = squares.iter().sum();
            if !squares.is_finite() {
                let is_wild =
                    |value: &[f64; 3]| !value.iter().map(|value| value * value).sum::<f64>().is_finite();
                let j = values.iter().position(is_wild).unwrap_or(0);
                return Err(NotFinite { theta_i, theta_o: *theta_o, phi: azimuth(j, azimuths) });
            }
            energy += weight * TAU / azimuths as f64 * squares;
            // Past a quarter of a turn, cosines of even q are the same again, and those of odd q negative.
            for (j, (near, far)) in values.iter().zip(values.iter().rev()).take(azimuths / 2).enumerate() {
                if *near != [0.0; 3] || *far != [0.0; 3] {
                    let sum = std::array::from_fn(|channel| near[channel] + far[channel]);
                    let difference = std::array::from_fn(|channel| near[channel] - far[channel]);
                    lit.push(LitAzimuth { azimuth: j, folded: [sum, difference] });
                }
            }
            bounds.push(lit.len());
        }
        let mut moments = vec![[F64x4::ZERO; VECTORS]; 3 * (self.grid.p + 1)];
        self.level.run(OutgoingMoments { nodes: self, lit: &lit, bounds: &bounds, moments: &mut moments });
        Ok(IncidentSlice { moments, energy })
    }
}

/// An azimuth of the first quarter of a turn and the one as far from half a turn.
struct LitAzimuth {
    azimuth: usize,
    /// The sum of rho_hat at both, and the difference.
    folded: [[f64; 3]; 2],
}

/// The integrals over theta_o and phi.
struct OutgoingMoments<'a> {
    nodes: &'a OutgoingNodes,
    /// The azimuths of each theta_o where rho_hat is not zero.
    lit: &'a [LitAzimuth],
    /// Where those of each theta_o begin, and the end.
    bounds: &'a [usize],
    moments: &'a mut [[F64x4; VECTORS]],
}

impl WithSimd for OutgoingMoments<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let side = self.nodes.grid.p + 1;
        let last = self.bounds.len() - 2;
        let of_node = |node: usize| &self.lit[self.bounds[node]..self.bounds[node + 1]];
        for (node, functions) in self.nodes.functions.chunks_exact(side).enumerate() {
            let pair = [of_node(node), of_node(last - node)];
            if pair.iter().all(|lit| lit.is_empty()) {
                continue;
            }
            let mut series = [[[F64x4::ZERO; VECTORS]; 3]; 2];
            for (series, lit) in series.iter_mut().zip(pair) {
                self.add_series::<S, EVEN>(simd, lit, 0, series);
                self.add_series::<S, ODD>(simd, lit, 1, series);
            }
            let [upper, lower] = &mut series;
            for (upper, lower) in upper.as_flattened_mut().iter_mut().zip(lower.as_flattened_mut()) {
                let (a, b) = (load(simd, upper), load(simd, lower));
                store(simd, simd.add_f64s(a, b), upper);
                store(simd, simd.sub_f64s(a, b), lower);
            }
            let [sums, differences] = &series;
            for (channel, moments) in self.moments.chunks_exact_mut(side).enumerate() {
                for (p, (moments, functions)) in moments.iter_mut().zip(functions).enumerate() {
                    // f_pq past a right angle is the same again if p + q is even, and negative if it is odd.
                    let [even, odd] =
                        if p.is_multiple_of(2) { [sums, differences] } else { [differences, sums] };
                    let odds = EVEN..EVEN + p.div_ceil(2).div_ceil(LANES);
                    for (vectors, series) in [(0..p / 2 / LANES + 1, even), (odds, odd)] {
                        for k in vectors {
                            let (term, factor) = (load(simd, &functions[k]), load(simd, &series[channel][k]));
                            let sum = simd.mul_add_f64s(term, factor, load(simd, &moments[k]));
                            store(simd, sum, &mut moments[k]);
                        }
                    }
                }
            }
        }
    }
}

impl OutgoingMoments<'_> {
    /// The integrals over phi of rho_hat cos(q phi) at one theta_o, [channel, q], for even or for odd q.
    #[inline(always)]
    fn add_series<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        lit: &[LitAzimuth],
        parity: usize,
        series: &mut [[F64x4; VECTORS]; 3],
    ) {
        let first = parity * EVEN;
        let mut sums = [[simd.splat_f64s(0.0); COUNT]; 3];
        for LitAzimuth { azimuth, folded } in lit {
            for k in 0..COUNT {
                let cosine = load(simd, &self.nodes.cosines[*azimuth][first + k]);
                for channel in 0..3 {
                    let value = simd.splat_f64s(folded[parity][channel]);
                    sums[channel][k] = simd.mul_add_f64s(cosine, value, sums[channel][k]);
                }
            }
        }
        for (series, sums) in series.iter_mut().zip(sums) {
            for (k, sum) in sums.into_iter().enumerate() {
                store(simd, sum, &mut series[first + k]);
            }
        }
    }
}

/// The middle of an interval of half a turn.
fn azimuth(j: usize, azimuths: usize) -> f64 {
    PI * (j as f64 + 0.5) / azimuths as f64
}
