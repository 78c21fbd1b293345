//! What is left of a reflection map without azimuth about the central direction: the slices of Kautz and
//! McCool's 3D texture (Kautz and McCool 2000; [RH02, app. C]).
//!
//! A BRDF that has no azimuth about the central direction leaves the terms q = 0:
//!
//! > B(alpha, beta, theta_o) = sum over p of B_p0(alpha, beta) Y_p0(theta_o),
//!
//! O(P) for each texel. For every other BRDF this is the mean of B over phi_o, and what has q > 0 is lost. Of
//! a global map the mean about C is, by the addition theorem, B_p0 = Lambda_p sum over q of B~_pq Y_pq(C).

use rayon::prelude::*;
use sh::{Basis, Stop, Stopped, lambda, zonal_into};
use sphere::Direction;

use crate::{Lamps, Shrm, Terms, View, frame};

/// The slices of a 3D texture, the means of a map about each texel's central direction at angles theta_o in
/// radians; shape [angles, texels]. `stop` is asked once for each slice.
///
/// # Errors
/// If it was stopped.
pub(crate) fn mean_slices(map: &Shrm, angles: &[f64], stop: Stop<'_>) -> Result<Vec<[f32; 3]>, Stopped> {
    let (grid, rows) = (map.grid(), map.p().get() + 1);
    let zonal = zonal_terms(map);
    let mut slices = vec![[0.0; 3]; angles.len() * grid.len()];
    let pairs = slices.par_chunks_mut(grid.len()).zip(angles);
    pairs.try_for_each(|(slice, angle)| {
        stop.check()?;
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
        Ok(())
    })?;
    Ok(slices)
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
