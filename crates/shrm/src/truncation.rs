//! What truncations of a reflected light field lose, measured in directions: the independent check of
//! [`crate::accuracy`], which estimates the same from energies of coefficients.
//!
//! A truncation to degrees (F, P) loses the share
//!
//! > integral of (B - B_FP)^2 / integral of B^2, over central directions and views [RH02, sec. 5.1],
//!
//! all channels together. B comes from the caller, by brute force from light and material; B_FP is the sum of
//! [RH02, eq. 14] up to these degrees. Both are taken at the same places. Half of the central directions are
//! spread evenly, the others follow the square of the field's mean over views, because a small lamp has most
//! of the energy in a small part of the sphere; each counts by the inverse of its density. Views are spread
//! evenly over the sphere, and others at each central direction.

use std::f64::consts::PI;

use brdf::Centre;
use envmap::Environment;
use rayon::prelude::*;
use sampling::{Points, ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight};
use sh::{Basis, Degree, Stop, Stopped, Synthesis, TransformError, rotate_orders};
use sphere::{DVec3, Direction, LatLong, spiral};

use crate::degrees::{add, seen};
use crate::{Plain, Reflection, frame};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Central directions, half of them spread evenly, and views of each.
const PLACES: [usize; 2] = [256, 8];

/// The share of central directions that are spread evenly.
const EVEN: f64 = 0.5;

/// The fewest and the most rows of the image whose texels the other central directions follow: four for each
/// degree, between these.
const ROWS: [usize; 2] = [64, 256];

/// Gives the radiance B at a central direction and a view, both in the world's frame, RGB.
pub type Radiance<'a> = dyn Fn(Direction, Direction) -> [f64; 3] + Sync + 'a;

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The field's mean over views has no image.
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// The field's mean over views has no density.
    #[error(transparent)]
    Density(#[from] sampling::Error),
    /// It was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The share of the energy of B that each truncation [F, P] loses; 0 for a black field. `high` has the field
/// at the highest degrees, whose lamps are not looked at: B has the light of its series. Degrees past the
/// high ones cut nothing.
///
/// A share is known to some percent of itself, from 2048 places, as long as B is known better. `stop` is
/// asked every few milliseconds, on every thread. The result does not depend on the number of threads.
///
/// # Errors
/// If it was stopped, or if the field is not finite.
///
/// # Example: without its degrees above 0, a matte surface under a bright half of the sky loses a quarter
/// ```
/// use brdf::{Choice, Lambert, Material, project};
/// use sh::{Degree, Expansion};
/// let sky = Expansion::from_coefficients(Degree::new(1)?, vec![[1.0; 3], [0.0; 3], [0.5; 3], [0.0; 3]]);
/// let white = Material::Lambert(Lambert::new([1.0; 3])?);
/// let degrees = Choice::Degree { f: Degree::new(1)?, p: Degree::ZERO };
/// let brdf = project(&white, degrees, sh::Stop::NEVER)?.coefficients;
/// let field = shrm::Reflection::convolve(&sky.unwrap(), &brdf);
/// let radiance = |central, view| field.evaluate(central, view);
/// let lost = shrm::truncation::measured_losses(&field, &[[0, 0], [1, 0]], &radiance, sh::Stop::NEVER)?;
/// let known = shrm::accuracy::Accuracy::of(&field, [1.25; 3], 2.0).at(0, 0).truth;
/// assert!((lost[0] - known).abs() < 0.05 * known && lost[1] < 1e-20);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn measured_losses(
    high: &Reflection,
    cuts: &[[usize; 2]],
    radiance: &Radiance<'_>,
    stop: Stop<'_>,
) -> Result<Vec<f64>, MeasureError> {
    let Some(centrals) = centrals(high)? else { return Ok(vec![0.0; cuts.len()]) };
    let at = |(index, (central, weight)): (usize, &(Direction, f64))| {
        stop.check()?;
        Ok(at_central(high, cuts, index, *central, radiance).map(|square| weight * square))
    };
    let squares: Result<Vec<_>, Stopped> = centrals.par_iter().enumerate().map(at).collect();
    let mut sums = vec![0.0; cuts.len() + 1];
    for of_central in squares? {
        sums.iter_mut().zip(of_central.0).for_each(|(sum, square)| *sum += square);
    }
    let whole = sums.pop().unwrap_or(0.0);
    Ok(sums.into_iter().map(|lost| if whole > 0.0 { lost / whole } else { 0.0 }).collect())
}

/// Squares at one central direction, summed over views and channels: the difference of each cut, then B.
struct Squares(Vec<f64>);

impl Squares {
    fn map(self, of: impl Fn(f64) -> f64) -> Self {
        Self(self.0.into_iter().map(of).collect())
    }
}

/// Central directions, and the inverse of their density; `None` if the field is black.
fn centrals(high: &Reflection) -> Result<Option<Vec<(Direction, f64)>>, MeasureError> {
    let mean = high.plain(Plain::Mean);
    let rows = (4 * mean.degree().get()).clamp(ROWS[0], ROWS[1]);
    let grid = LatLong::with_rows(rows);
    let values: Vec<[f64; 3]> = Synthesis::new(grid, mean.degree())?.synthesise(&mean);
    let square = |rgb: &[f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
    let most = values.iter().map(square).fold(0.0, f64::max);
    let pixels = values.iter().map(|rgb| [(square(rgb) / most) as f32; 3]).collect();
    let Some(density) = Environment::new(grid, pixels).filter(|_| most > 0.0) else { return Ok(None) };
    let light = TexelLight::new(&density, SUM)?;
    let tables = ProductTables::new(&light, &Tables::new(Degree::ZERO));
    let sampler = ProductSampler::new(&tables, &[1.0], ProductOptions::default())?;
    let count = PLACES[0] / 2;
    let (mut points, mut directions) = (vec![[0.0; 2]; count], vec![[0.0; 3]; count]);
    let mut densities = vec![0.0; count];
    Points::Sobol { seed: None }.fill(0, &mut points);
    sampler.sample_into(&points, &mut directions, &mut densities);
    let drawn = directions.iter().map(|w| DVec3::from_array(w.map(f64::from)));
    let even = (0..count).map(|index| spiral(index, count));
    let weighed = |direction: Direction| {
        let density = f64::from(sampler.density(direction.vector().to_array().map(|value| value as f32)));
        (direction, 1.0 / (EVEN / (4.0 * PI) + (1.0 - EVEN) * density))
    };
    Ok(Some(even.chain(drawn.map(Direction::normalised)).map(weighed).collect()))
}

/// The squares at one central direction: see [`Squares`].
fn at_central(
    high: &Reflection,
    cuts: &[[usize; 2]],
    index: usize,
    central: Direction,
    radiance: &Radiance<'_>,
) -> Squares {
    let brdf = high.brdf();
    let (most_f, most_p) = (high.lighting().degree().get().min(brdf.f().get()), brdf.p().get());
    let basis = Basis::new(brdf.p());
    let (mut harmonics, mut right) = (Vec::new(), Vec::new());
    for view in 0..PLACES[1] {
        let outgoing = even_view(brdf.centre(), index * PLACES[1] + view);
        let mut y = vec![0.0; brdf.p().rows()];
        basis.evaluate_into(outgoing, &mut y);
        harmonics.push(y);
        right.push(radiance(central, frame(central).apply(outgoing)));
    }
    let light = rotate_orders(high.lighting(), frame(central).inverse(), most_p);
    let mut rows = vec![[0.0; 3]; brdf.p().rows()];
    let mut squares = vec![0.0; cuts.len() + 1];
    for l in 0..=most_f {
        add(&mut rows, &light, brdf, l);
        let ends = cuts.iter().zip(&mut squares).filter(|([f, _], _)| *f.min(&most_f) == l);
        for ([_, p], square) in ends {
            let kept = Degree::new(*p.min(&most_p)).map_or(0, |p| p.rows());
            for (y, right) in harmonics.iter().zip(&right) {
                let mut difference = *right;
                for (row, y) in rows[..kept].iter().zip(y) {
                    (0..3).for_each(|channel| difference[channel] -= row[channel] * y);
                }
                *square += difference.iter().map(|value| value * value).sum::<f64>();
            }
        }
    }
    if let Some(whole) = squares.last_mut() {
        *whole = right.as_flattened().iter().map(|value| value * value).sum();
    }
    Squares(squares)
}

/// A view in the frame of the central direction: evenly over the sphere, of which a field about the normal is
/// the same above and below the horizon.
fn even_view(centre: Centre, index: usize) -> Direction {
    let even = seen(Centre::Reflection, index).vector();
    match centre {
        Centre::Normal => Direction::normalised(DVec3::new(even.x, even.y, even.z.abs())),
        Centre::Reflection | Centre::Tangent => Direction::normalised(even),
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, KajiyaKay, Material, Microfacet, OrenNayar, project};
    use sh::Transform;

    use super::*;
    use crate::accuracy::Accuracy;
    use crate::reference::LightTree;

    /// A sky with a lamp of some texels in it.
    fn sky() -> Environment {
        let grid = LatLong::with_rows(96);
        let texel = |index: usize| {
            let w = grid.direction(index / grid.width, index % grid.width).vector();
            let lamp = if (w - DVec3::new(0.6, 0.0, 0.8)).length() < 0.15 { 30.0 } else { 0.0 };
            [0.5 + 0.4 * w.z, 0.6 + 0.3 * w.y, 0.7 - 0.2 * w.x].map(|soft| (soft + lamp) as f32)
        };
        Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
    }

    /// By brute force, truncations lose what the energies of the coefficients say, for each kind of centre.
    #[test]
    fn brute_force_loses_what_the_coefficients_say() {
        let environment = sky();
        let tree = LightTree::new(&environment);
        let degree = Degree::new(40).unwrap();
        let series = Transform::new(environment.grid(), degree).unwrap().analyse(environment.pixels());
        for material in [
            Material::Microfacet(Microfacet::new(0.3, [0.9, 0.6, 0.3]).unwrap()),
            Material::OrenNayar(OrenNayar::new([0.8; 3], 0.5).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(12.0, [1.0; 3]).unwrap()),
        ] {
            let projection = project(&material, Choice::Full, Stop::NEVER).unwrap();
            let high = Reflection::convolve(&series, &projection.coefficients);
            let energy = sh::image_energy(environment.grid(), environment.pixels());
            let accuracy = Accuracy::of(&high, energy, projection.total);
            let radiance = |central, view| tree.radiance(&material, central, view, 1e-3, 1e-3);
            let cuts = [[0, 24], [2, 24], [6, 24], [40, 0], [40, 1], [40, 2], [4, 2]];
            let found = measured_losses(&high, &cuts, &radiance, Stop::NEVER).unwrap();
            for ([f, p], found) in cuts.into_iter().zip(found) {
                let known = accuracy.at(f, p);
                let off = (found - known.truth).abs();
                assert!(off < 0.1 * known.truth + 1e-3, "{material:?} [{f}, {p}]: {found} {known:?}");
                assert!(
                    found < 1.1 * known.bound_with_p + 1e-3,
                    "{material:?} [{f}, {p}]: {found} {known:?}"
                );
            }
        }
    }
}
