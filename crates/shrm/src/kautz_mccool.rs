//! Kautz and McCool's 3D texture: reflection maps for angles between central direction and view (Kautz and
//! McCool 2000; [RH02, app. C]).
//!
//! A BRDF that has no azimuth about the central direction leaves the terms q = 0:
//!
//! > B(alpha, beta, theta_o) = sum over p of B_p0(alpha, beta) Y_p0(theta_o),
//!
//! O(P) for each texel. For every other BRDF this is the mean of B over phi_o, and what has q > 0 is lost. Of
//! a global map the mean about C is, by the addition theorem, B_p0 = Lambda_p sum over q of B~_pq Y_pq(C).
//!
//! Angles between the slices are interpolated linearly.

use brdf::Centre;
use rayon::prelude::*;
use sh::{Basis, Degree, Stop, Stopped, lambda, zonal_into};
use sphere::Direction;

use crate::blocks::for_each;
use crate::mean_lobe::MeanLobe;
use crate::{Fit, FitError, Lamps, MapGrid, Shrm, Terms, View, fit_angles, frame};

/// Reflection maps for some angles theta_o.
#[derive(Clone, Debug, PartialEq)]
pub struct KautzMcCool {
    grid: MapGrid,
    centre: Centre,
    angles: Vec<f64>,
    slices: Vec<[f32; 3]>,
}

impl KautzMcCool {
    /// `count` angles from 0 to pi, both included, in radians: theta_k = pi k / (count - 1). One angle is 0.
    ///
    /// In cos(theta) they are the Chebyshev points, on which a fit is well conditioned up to P = count - 1.
    pub fn even_angles(count: usize) -> Vec<f64> {
        let steps = count.saturating_sub(1).max(1) as f64;
        (0..count).map(|k| std::f64::consts::PI * k as f64 / steps).collect()
    }

    /// The slices of a spherical harmonic reflection map at these angles.
    ///
    /// `None` if there is no angle, or the angles do not rise from 0 or more to pi or less.
    pub fn from_shrm(map: &Shrm, angles: Vec<f64>) -> Option<Self> {
        if !rise(&angles) {
            return None;
        }
        let (grid, rows) = (map.grid(), map.p().get() + 1);
        let zonal = zonal_terms(map);
        let mut slices = vec![[0.0; 3]; angles.len() * grid.len()];
        let pairs = slices.par_chunks_mut(grid.len()).zip(&angles);
        pairs.for_each(|(slice, angle)| {
            let mut y = vec![0.0; rows];
            zonal_into(math::cos(*angle), &mut y);
            for (value, terms) in slice.iter_mut().zip(zonal.chunks_exact(rows)) {
                let mut sum = [0.0; 3];
                for (term, y) in terms.iter().zip(&y) {
                    for channel in 0..3 {
                        sum[channel] += term[channel] * y;
                    }
                }
                *value = sum.map(|value| value as f32);
            }
        });
        Some(Self { grid, centre: map.centre(), angles, slices })
    }

    /// Adds lamps that the map did not hold, in the mean about each texel's central direction. `stop` is
    /// asked once for each of the [`blocks`](crate::blocks) of each slice.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn with_lamps(mut self, lamps: &Lamps, stop: Stop<'_>) -> Result<Self, Stopped> {
        self.add(lamps, stop)?;
        Ok(self)
    }

    fn add(&mut self, lamps: &Lamps, stop: Stop<'_>) -> Result<(), Stopped> {
        let grid = self.grid;
        let mut slices = self.slices.chunks_exact_mut(grid.len()).zip(&self.angles);
        slices.try_for_each(|(slice, angle)| {
            let lobe = MeanLobe::ring(&lamps.material, *angle);
            let ring = lobe.of(&lamps.lights);
            for_each(slice, stop, |texel, value| {
                let lamps = ring.radiance(grid.direction(texel));
                *value = std::array::from_fn(|c| value[c].max(0.0) + lamps[c] as f32);
            })
        })
    }

    /// The slices as a renderer has them, shape [angles, texels]; `None` if their number does not fit, or as
    /// for [`KautzMcCool::from_shrm`].
    pub fn new(grid: MapGrid, centre: Centre, angles: Vec<f64>, slices: Vec<[f32; 3]>) -> Option<Self> {
        let fits = rise(&angles) && !grid.is_empty() && slices.len() == angles.len() * grid.len();
        fits.then_some(Self { grid, centre, angles, slices })
    }

    /// The grid on which the texels of a slice lie.
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// The kind of the texels' directions: reflection vectors, normals or tangents.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The angle theta_o of each slice, in radians, rising.
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// One slice; shape as [`MapGrid::shape`].
    ///
    /// # Panics
    /// If there is no such slice.
    pub fn slice(&self, slice: usize) -> &[[f32; 3]] {
        &self.slices[slice * self.grid.len()..][..self.grid.len()]
    }

    /// All slices, shape [angles, texels].
    pub fn slices(&self) -> &[[f32; 3]] {
        &self.slices
    }

    /// Radiance toward `view` (the world's frame) about a central direction, as a renderer that has only this
    /// texture interpolates it: bilinear in a slice, linear in the angle between central direction and view;
    /// beyond the first and last angle, their slices.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f32; 3] {
        let value = |slice, texel| self.slice(slice)[texel];
        Self::interpolated(self.grid, &self.angles, central, view, value)
    }

    /// [`KautzMcCool::radiance`] of a texture that is not made: `value` returns the value of a slice at a
    /// texel, of which each look-up needs eight.
    ///
    /// # Panics
    /// If there is no angle.
    pub fn interpolated(
        grid: MapGrid,
        angles: &[f64],
        central: Direction,
        view: Direction,
        mut value: impl FnMut(usize, usize) -> [f32; 3],
    ) -> [f32; 3] {
        let angle = math::atan2(central.vector().cross(view.vector()).length(), central.dot(view));
        let above = angles.partition_point(|slice| *slice <= angle);
        let (low, high) = (above.saturating_sub(1), above.min(angles.len() - 1));
        let share = if low == high { 0.0 } else { (angle - angles[low]) / (angles[high] - angles[low]) };
        let taps = grid.taps(central);
        let [a, b] = [low, high].map(|slice| taps.blend_by(|texel| value(slice, texel)));
        [0, 1, 2].map(|channel| (a[channel] + share.clamp(0.0, 1.0) * (b[channel] - a[channel])) as f32)
    }

    /// A local map of zonal terms fitted to the slices, by least squares for each texel ([`fit_angles`]).
    ///
    /// To f32 rounding it is the field, if that has no terms with q > 0 and P is below the number of slices.
    ///
    /// # Errors
    /// The errors of [`fit_angles`].
    pub fn fit(&self, p: Option<Degree>) -> Result<Fit, FitError> {
        fit_angles(self.grid, self.centre, &self.angles, &self.slices, p)
    }
}

/// The share of a map's energy that is in terms with q > 0 about each texel's central direction, and that a
/// 3D texture loses: 0 to 1. Energies are weighted by the solid angles of texels and summed over channels; 0
/// for a black map. With lamps beside the map it is measured at some texels and views. `stop` is asked every
/// few milliseconds, on every thread.
///
/// # Errors
/// If it was stopped.
pub fn azimuthal_share(map: &Shrm, lamps: Option<&Lamps>, stop: Stop<'_>) -> Result<f64, Stopped> {
    if let Some(lamps) = lamps {
        return sampled_share(map, lamps, stop);
    }
    if map.terms() == Terms::Zonal {
        return Ok(0.0);
    }
    let zonal = zonal_terms(map);
    let (mut kept, mut total) = (0.0, 0.0);
    for (texel, terms) in zonal.chunks_exact(map.p().get() + 1).enumerate() {
        let solid_angle = map.grid().solid_angle(texel);
        let energy = |sum: f64, value: f64| sum + value * value;
        kept += solid_angle * terms.as_flattened().iter().copied().fold(0.0, energy);
        let all = map.texel(texel).as_flattened().iter().map(|&value| f64::from(value));
        total += solid_angle * all.fold(0.0, energy);
    }
    Ok(if total > 0.0 { (1.0 - kept / total).clamp(0.0, 1.0) } else { 0.0 })
}

/// Texels at which a share is measured, angles theta_o of each, and azimuths of each angle.
const SAMPLED: [usize; 3] = [256, 16, 12];

/// [`azimuthal_share`] of a soft map with lamps, by sums over views.
fn sampled_share(map: &Shrm, lamps: &Lamps, stop: Stop<'_>) -> Result<f64, Stopped> {
    let [most, angles, azimuths] = SAMPLED;
    let step = map.grid().len().div_ceil(most).max(1);
    let lamps = lamps.for_views();
    let texel = |texel: usize| -> [f64; 2] {
        let central = map.grid().direction(texel);
        let (into_world, mut lookup) = (frame(central), map.lookup());
        let (mut kept, mut total) = (0.0, 0.0);
        for row in 0..angles {
            let theta = std::f64::consts::PI * (row as f64 + 0.5) / angles as f64;
            let (mut sum, mut squares) = ([0.0; 3], 0.0);
            for column in 0..azimuths {
                let phi = std::f64::consts::TAU * column as f64 / azimuths as f64;
                let view = into_world.apply(Direction::from_angles(theta, phi));
                let soft = lookup.texel(texel, view).map(|value| value as f32);
                let value = lamps.added(soft, central, view);
                for channel in 0..3 {
                    sum[channel] += f64::from(value[channel]);
                    squares += math::powi(f64::from(value[channel]), 2);
                }
            }
            kept += math::sin(theta) * sum.iter().map(|sum| sum * sum).sum::<f64>() / azimuths as f64;
            total += math::sin(theta) * squares;
        }
        [kept, total].map(|energy| energy * map.grid().solid_angle(texel))
    };
    let texels = (0..map.grid().len().div_ceil(step)).into_par_iter();
    let sums = texels.map(|index| stop.check().map(|()| texel(index * step)));
    let sums: Result<Vec<[f64; 2]>, Stopped> = sums.collect();
    let [kept, total] = sums?.iter().fold([0.0; 2], |[a, b], [kept, total]| [a + kept, b + total]);
    Ok(if total > 0.0 { (1.0 - kept / total).clamp(0.0, 1.0) } else { 0.0 })
}

/// B_p0 about each texel's central direction, shape [texels, P + 1].
fn zonal_terms(map: &Shrm) -> Vec<[f64; 3]> {
    let p = map.p().get();
    let mut terms = vec![[0.0; 3]; map.grid().len() * (p + 1)];
    let basis = Basis::new(map.p());
    terms.par_chunks_mut(64 * (p + 1)).enumerate().for_each(|(block, terms)| {
        let mut y = vec![0.0; map.p().rows()];
        for (texel, terms) in (block * 64..).zip(terms.chunks_exact_mut(p + 1)) {
            let values = map.texel(texel);
            if map.view() == View::Global {
                basis.evaluate_into(map.grid().direction(texel), &mut y);
            }
            for (p, term) in terms.iter_mut().enumerate() {
                match (map.view(), map.terms()) {
                    (View::Local, Terms::All) => *term = values[p * p + p].map(f64::from),
                    (View::Local, Terms::Zonal) => *term = values[p].map(f64::from),
                    (View::Global, _) => {
                        for row in p * p..(p + 1) * (p + 1) {
                            for channel in 0..3 {
                                term[channel] += lambda(p) * f64::from(values[row][channel]) * y[row];
                            }
                        }
                    }
                }
            }
        }
    });
    terms
}

/// Whether angles can be slices.
fn rise(angles: &[f64]) -> bool {
    let inside = |angle: &f64| (0.0..=std::f64::consts::PI).contains(angle);
    !angles.is_empty() && angles.iter().all(inside) && angles.windows(2).all(|pair| pair[0] < pair[1])
}
