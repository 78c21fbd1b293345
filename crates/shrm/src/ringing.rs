//! What a cut shows of itself: how far a reflection at some degrees is from one at more.

use rayon::prelude::*;
use sh::{Basis, Stop, Stopped, rotate_orders};
use sphere::spiral;

use crate::degrees::{SAMPLES, add, seen};
use crate::mean_lobe::MeanLobe;
use crate::{Plain, Reflection, frame, stops};

/// How far a reflection is from another, at views as a ball shows them to a distant camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutError {
    /// The error in stops that 95 of 100 samples stay below.
    pub p95: f64,
    /// The error in stops that 99 of 100 samples stay below.
    pub p99: f64,
    /// The share of samples below zero by more than a tenth of what counts as black.
    pub negative: f64,
}

/// The radiance of a reflection, lamps included, at fixed central directions and views.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples(Vec<[f64; 3]>);

impl Samples {
    /// The error of these samples if `reference` is right. Radiance below zero is black, and `dark` is what
    /// counts as black: see [`crate::degrees`].
    pub fn error(&self, reference: &Self, dark: f64) -> CutError {
        let pairs = self.0.as_flattened().iter().zip(reference.0.as_flattened());
        let mut stops: Vec<f64> = pairs.map(|(cut, right)| stops::error(*cut, *right, dark)).collect();
        let [p95, p99] = stops::quantiles(&mut stops);
        CutError { p95, p99, negative: self.negative(dark) }
    }

    /// The share of samples below zero by more than a tenth of `dark`.
    pub fn negative(&self, dark: f64) -> f64 {
        let values = self.0.as_flattened();
        values.iter().filter(|value| **value < -0.1 * dark).count() as f64 / values.len().max(1) as f64
    }
}

impl Reflection {
    /// The radiance of the reflection where [`Reflection::for_light`] looks. `stop` is asked every few
    /// milliseconds, on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn samples(&self, stop: Stop<'_>) -> Result<Samples, Stopped> {
        let (f, p) = (self.brdf().f().get(), self.brdf().p());
        let basis = Basis::new(p);
        let at = |index: usize| {
            stop.check()?;
            let central = spiral(index, SAMPLES[0]);
            let light = rotate_orders(self.lighting(), frame(central).inverse(), p.get());
            let mut rows = vec![[0.0; 3]; p.rows()];
            (0..=f).for_each(|l| add(&mut rows, &light, self.brdf(), l));
            let lights = self.lamps().map(|lamps| (lamps, lamps.about(central)));
            let mut y = vec![0.0; p.rows()];
            let radiance = |view: usize| {
                let outgoing = seen(self.brdf().centre(), index * SAMPLES[1] + view);
                basis.evaluate_into(outgoing, &mut y);
                let mut sum =
                    lights.as_ref().map_or([0.0; 3], |(lamps, lights)| lamps.seen(lights, outgoing));
                for (row, y) in rows.iter().zip(&y) {
                    (0..3).for_each(|channel| sum[channel] += row[channel] * y);
                }
                sum
            };
            Ok((0..SAMPLES[1]).map(radiance).collect::<Vec<_>>())
        };
        let samples: Result<Vec<_>, Stopped> = (0..SAMPLES[0]).into_par_iter().map(at).collect();
        Ok(Samples(samples?.concat()))
    }

    /// The radiance that one plain map, looked up by the central direction, shows in place of
    /// [`Reflection::samples`].
    pub fn plain_samples(&self, plain: Plain) -> Samples {
        let field = self.plain(plain);
        let lobe = self.lamps().map(|lamps| (MeanLobe::plain(&lamps.material, plain), &lamps.lights));
        let lit = lobe.as_ref().map(|(lobe, lights)| lobe.of(lights));
        let at = |index: usize| {
            let central = spiral(index, SAMPLES[0]);
            let mut sum = field.evaluate(central);
            if let Some(lit) = &lit {
                let lamps = lit.radiance(central);
                (0..3).for_each(|channel| sum[channel] += lamps[channel]);
            }
            std::iter::repeat_n(sum, SAMPLES[1])
        };
        Samples((0..SAMPLES[0]).flat_map(at).collect())
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Material, Phong, project};
    use sh::{Degree, Expansion, Window};
    use sphere::Direction;

    use super::*;

    /// A sun alone, reflected by a lobe that degree 6 cuts: the error at the samples is the difference of
    /// the closed sums, and a window takes the negative values away.
    #[test]
    fn a_cut_sun_rings_and_a_window_calms_it() {
        let sun = Expansion::zonal(Direction::from_angles(0.7, 0.3), Degree::new(40).unwrap(), |_| [1.0; 3]);
        let lobe = Material::Phong(Phong::new(60.0, [1.0; 3]).unwrap());
        let brdf = project(&lobe, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let reference = Reflection::convolve(&sun, &brdf);
        let cut = Reflection::convolve(&sun.to_degree(Degree::new(6).unwrap()), &brdf);
        let dark = 0.01;
        let [right, found] = [&reference, &cut].map(|field| field.samples(Stop::NEVER).unwrap());
        let values: Vec<f64> = (0..SAMPLES[0])
            .map(|index| {
                let central = spiral(index, SAMPLES[0]);
                cut.evaluate(central, central)[0]
            })
            .collect();
        let below = values.iter().filter(|value| **value < -0.1 * dark).count() as f64 / values.len() as f64;
        let error = found.error(&right, dark);
        assert!((error.negative - below).abs() < 1e-12 && below > 0.1, "{error:?} {below}");
        assert!(error.p95 > 0.5 && error.p99 >= error.p95, "{error:?}");
        assert_eq!(right.error(&right, dark).p99, 0.0);
        let calm = cut.windowed(Window::Hanning).samples(Stop::NEVER).unwrap();
        assert!(calm.negative(dark) < 0.2 * below, "{}", calm.negative(dark));
    }
}
