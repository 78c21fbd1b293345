//! A table from scattered measurements of a surface that has a direction, such as brushed metal or cloth.
//!
//! The two steps are those of isotropic measurements: the layered model of `base`, whose highlight may be
//! stretched here in any direction, and its error, ln((f + e) / (f_0 + e)), smoothed over both directions
//! (`lattice`) and fading away from samples. No symmetry is assumed but reciprocity: a twill need not look
//! the same in a mirror.

use rayon::prelude::*;
use sphere::Direction;

use super::base::Base;
use super::lattice::{Lattice, LatticeSite};
use super::residual::{STIFFNESSES, miss};
use super::sample::{Sample, ScatteredError, checked, typical};
use crate::{MeasuredAnisotropic, from_half_and_difference, half_and_difference};

/// A table of a surface that has a direction, made from scattered measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct InterpolatedAnisotropic {
    /// The BRDF.
    pub measured: MeasuredAnisotropic,
    /// The error at samples that a trial left out: see [`super::Interpolated::held_out`].
    pub held_out: f64,
}

/// The shape of tables of surfaces that have a direction: 7.5 degrees in the azimuth of the half vector, on
/// which highlights depend, and 15 in that of the difference, on which they hardly do.
pub const ANISOTROPIC_SHAPE: [usize; 4] = [36, 48, 24, 12];

/// The most samples that are used; if there are more, evenly spaced ones are chosen.
const MOST_SITES: usize = 1 << 12;

/// A table of this shape from scattered measurements of a surface that has a direction: +X the tangent.
///
/// Uses all threads; the result does not depend on their number.
///
/// # Errors
/// The errors of [`super::interpolate`].
///
/// # Example: measurements of a matte surface reproduce it
/// ```
/// use brdf::scattered::{Sample, interpolate_anisotropic};
/// use sphere::Direction;
/// let directions = |i: u32| Direction::from_angles(f64::from(i % 9) * 0.17, f64::from(i) * 2.4);
/// let samples: Vec<_> = (0..100)
///     .map(|i| Sample { incident: directions(i), outgoing: directions(7 * i + 3), value: [0.3, 0.2, 0.1] })
///     .collect();
/// let table = interpolate_anisotropic(&samples, [4, 4, 4, 4])?.measured;
/// let grazing = table.brdf(Direction::from_angles(1.55, 0.0), Direction::from_angles(1.5, 2.0));
/// assert!((grazing[0] - 0.3).abs() < 1e-3);
/// # Ok::<(), brdf::scattered::ScatteredError>(())
/// ```
pub fn interpolate_anisotropic(
    samples: &[Sample],
    shape: [usize; 4],
) -> Result<InterpolatedAnisotropic, ScatteredError> {
    // An impossible shape is refused before its memory is allocated.
    let entries = MeasuredAnisotropic::entries(shape)?;
    let samples = checked(samples, MOST_SITES)?;
    let floor = 0.02 * typical(&samples);
    let base = Base::fit_stretched(&samples, floor);
    let sites: Vec<LatticeSite> = samples
        .iter()
        .map(|sample| {
            let base = base.value(sample.incident, sample.outgoing);
            let angles = half_and_difference(sample.incident, sample.outgoing);
            LatticeSite { angles, value: sample.log_ratio(base, floor) }
        })
        .collect();
    let (stiffness, held_out) = stiffness(&sites, base.width());
    let residual = Lattice::fit(&sites, base.width(), stiffness);
    let angles = samples.iter().flat_map(|sample| [sample.incident.theta(), sample.outgoing.theta()]);
    let reach = angles.fold(0.0, f64::max);
    // Past the last measured angle the BRDF is that of the last angle.
    let value = |directions: [Direction; 2]| {
        let [incident, outgoing] = directions.map(|direction| match direction.theta() <= reach {
            true => direction,
            false => Direction::from_angles(reach, direction.phi()),
        });
        let (base, ratio) =
            (base.value(incident, outgoing), residual.value(half_and_difference(incident, outgoing)));
        [0, 1, 2].map(|channel| ((base[channel] + floor) * math::exp(ratio[channel]) - floor).max(0.0) as f32)
    };
    let [_, n_phi, n_d, n_psi] = shape;
    let values = (0..entries).into_par_iter().with_min_len(n_d * n_psi).map(|entry| {
        let (row, m) = (entry / n_psi, entry % n_psi);
        let place = [row / n_d / n_phi, row / n_d % n_phi, row % n_d, m];
        value(from_half_and_difference(MeasuredAnisotropic::node(shape, place)))
    });
    Ok(InterpolatedAnisotropic { measured: MeasuredAnisotropic::new(shape, values.collect())?, held_out })
}

/// The stiffness that meets every fifth sample best if the fit has not seen it, and the error there.
fn stiffness(sites: &[LatticeSite], width: f64) -> (f64, f64) {
    let (kept, left): (Vec<_>, Vec<_>) = sites.iter().enumerate().partition(|(index, _)| index % 5 != 4);
    let [kept, left] = [kept, left].map(|part| part.into_iter().map(|(_, site)| *site).collect::<Vec<_>>());
    let trials = STIFFNESSES.par_iter().map(|&stiffness| {
        let trial = Lattice::fit(&kept, width, stiffness);
        let (cost, held_out) = miss(left.iter().map(|site| (trial.value(site.angles), site.value)));
        (cost, stiffness, held_out)
    });
    let trials: Vec<(f64, f64, f64)> = trials.collect();
    let best = trials.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((STIFFNESSES[0], 0.0), |(_, stiffness, held_out)| (stiffness, held_out))
}

#[cfg(test)]
mod tests {
    use super::super::{FEWEST, SHAPE, interpolate};
    use super::*;
    use crate::{AshikhminShirley, Fresnel, Ggx, Material};

    /// Pairs at arbitrary places, down to 80 degrees; a third of them near the mirror direction.
    fn pairs(count: u32) -> impl Iterator<Item = [Direction; 2]> {
        let direction = |i: f64| Direction::from_angles((i * 0.618_034).fract().sqrt() * 1.4, i * 2.399_963);
        (0..count).map(move |i| {
            let k = f64::from(i);
            let (light, other) = (direction(k + 0.3), direction(1.7 * k + 40.1));
            let mirrored = Direction::from_angles(
                (light.theta() + 0.25 * (k * 0.755).sin()).clamp(0.0, 1.4),
                light.phi() + std::f64::consts::PI + 0.3 * (k * 0.569).sin(),
            );
            [light, if i % 3 == 0 { mirrored } else { other }]
        })
    }

    fn measure(material: &Material, count: u32) -> Vec<Sample> {
        let sample = |[incident, outgoing]: [Direction; 2]| {
            let rho_hat = material.rho_hat(incident, outgoing);
            Sample { incident, outgoing, value: rho_hat.map(|value| value / incident.vector().z) }
        };
        pairs(count).map(sample).collect()
    }

    fn turned(direction: Direction, angle: f64) -> Direction {
        Direction::from_angles(direction.theta(), direction.phi() + angle)
    }

    /// Neither model is one of the base. Nine of ten places are met twice as well as by a table that ignores
    /// the direction.
    #[test]
    fn brushed_metals_are_met_between_the_samples() {
        let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
        let metal = Ggx::stretched([0.4, 0.65], gold, [1.0, 0.9, 0.8]).unwrap();
        let shirley = AshikhminShirley::new([20.0, 100.0], [0.4, 0.2, 0.1], [0.05; 3]).unwrap();
        for material in [Material::Ggx(metal), Material::AshikhminShirley(shirley)] {
            // Brushed in no special direction: not symmetric in mirrors.
            let samples: Vec<Sample> = measure(&material, 900)
                .into_iter()
                .map(|sample| Sample {
                    incident: turned(sample.incident, 0.4),
                    outgoing: turned(sample.outgoing, 0.4),
                    ..sample
                })
                .collect();
            let found = interpolate_anisotropic(&samples, ANISOTROPIC_SHAPE).unwrap();
            let isotropic = interpolate(&samples, SHAPE).unwrap().measured;
            let misses = |of: &dyn Fn(Direction, Direction) -> [f64; 3]| {
                let mut misses: Vec<f64> = pairs(1300)
                    .skip(900)
                    .map(|[light, view]| {
                        let expected = material.rho_hat(light, view)[0] / light.vector().z;
                        let found = of(turned(light, 0.4), turned(view, 0.4))[0];
                        ((found + 0.01) / (expected + 0.01)).ln().abs()
                    })
                    .collect();
                misses.sort_by(f64::total_cmp);
                [misses[200], misses[360]]
            };
            let [median, most] = misses(&|light, view| found.measured.brdf(light, view));
            let [ignored, most_ignored] = misses(&|light, view| isotropic.brdf(light, view));
            eprintln!(
                "{}: {median:.4} {most:.4}, held out {:.4}; without direction {ignored:.4} {most_ignored:.4}",
                material.name(),
                found.held_out
            );
            assert!(median < 0.03 && most < 0.15, "{}: {median} {most}", material.name());
            assert!(most < 0.5 * most_ignored, "{}: {most} {most_ignored}", material.name());
        }
    }

    #[test]
    fn too_few_and_impossible_samples_are_errors() {
        let matte = |count: u32| -> Vec<Sample> {
            pairs(count).map(|[incident, outgoing]| Sample { incident, outgoing, value: [0.2; 3] }).collect()
        };
        let wrong = |samples: &[Sample], shape| interpolate_anisotropic(samples, shape).unwrap_err();
        assert_eq!(wrong(&matte(15), [2; 4]), ScatteredError::TooFew { found: 15 });
        assert_eq!(FEWEST, 16);
        let mut samples = matte(20);
        samples[7].value[1] = f64::NAN;
        assert_eq!(wrong(&samples, [2; 4]), ScatteredError::Sample { sample: 7 });
        assert!(matches!(wrong(&matte(20), [0, 1, 1, 1]), ScatteredError::Table(_)));
        let black: Vec<Sample> =
            matte(20).into_iter().map(|sample| Sample { value: [0.0; 3], ..sample }).collect();
        let table = interpolate_anisotropic(&black, [2; 4]).unwrap().measured;
        assert!(table.values().as_flattened().iter().all(|value| *value == 0.0));
    }
}
