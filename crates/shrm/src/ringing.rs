//! What a cut shows of itself: how far a reflection at some degrees is from one at more, and what would help.

use brdf::{Choice, Material, ProjectionError, project};
use rayon::prelude::*;
use sh::{Basis, Degree, Lighting, Stop, Stopped, Window, rotate_orders};
use sphere::spiral;

use crate::degrees::{SAMPLES, add, samples_for_light, seen};
use crate::lamps::in_frame;
use crate::mean_lobe::MeanLobe;
use crate::{Plain, Reflection, frame};

pub use crate::samples::{CutError, Samples};

/// Central directions of a [`CutStudy`]: fewer than those of [`Reflection::samples`] are enough for an
/// estimate.
const STUDIED: usize = 64;

/// The degree that holds a highlight well enough for an estimate, times its width in radians: GGX falls with
/// exp(-width l), others faster.
const HOLDS: f64 = 8.0;

/// What a cut at given degrees shows, at views as a ball shows them to a distant camera, and what is left of
/// it after each remedy: estimates from coefficients of the material that are made for them
/// ([`Choice::Sketch`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutStudy {
    /// The error of the cut against the uncut light and material.
    pub error: CutError,
    /// The error with the degrees that [`Reflection::for_light`] chooses.
    pub by_light: CutError,
    /// The error of the cut with the window of Lanczos on its series.
    pub lanczos: CutError,
    /// The error of the cut with the window of Hanning.
    pub hanning: CutError,
    /// The share of samples at which the uncut light itself is below zero by more than a tenth of what counts
    /// as black.
    pub negative_light: f64,
}

/// Why there is no [`CutStudy`].
#[derive(Debug, thiserror::Error)]
pub enum CutStudyError {
    /// The material has no coefficients.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
    /// It was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl CutStudy {
    /// The study of a cut of this light and material, which has all light in its series; `None` if it does
    /// not show. `shows` is asked of an error, and `dark` is what counts as black: see [`crate::degrees`].
    ///
    /// A window changes what rings, and what is cut where it is sharp. So `shows` is first asked of the error
    /// that the cut has if its window of Hanning is right, which is cheap, and only then of the true one.
    /// `stop` is asked every few milliseconds, on every thread.
    ///
    /// # Errors
    /// If the material has a value that is not finite, or it was stopped.
    pub fn of(
        cut: &Reflection,
        (lighting, material): (&Lighting, &Material),
        dark: f64,
        shows: impl Fn(&CutError) -> bool,
        stop: Stop<'_>,
    ) -> Result<Option<Self>, CutStudyError> {
        let windows = [Window::None, Window::Lanczos, Window::Hanning];
        let samples = cut.samples_with(&windows, STUDIED, stop)?;
        let [found, lanczos, hanning] = &samples[..] else { return Ok(None) };
        if !shows(&found.error(hanning, dark)) {
            return Ok(None);
        }
        let enough = (HOLDS / material.highlight_width()).ceil() as usize;
        let f = lighting.series.degree().min(Degree::new(enough).unwrap_or(Degree::MAX));
        let full = project(material, Choice::Sketch { f }, stop)?.coefficients;
        let [whole, by_light] = samples_for_light(lighting, &full, material, STUDIED, stop)?;
        let error = found.error(&whole, dark);
        Ok(shows(&error).then(|| Self {
            error,
            by_light: by_light.error(&whole, dark),
            lanczos: lanczos.error(&whole, dark),
            hanning: hanning.error(&whole, dark),
            negative_light: whole.negative(dark),
        }))
    }
}

impl Reflection {
    /// The radiance of the reflection where [`Reflection::for_light`] looks. `stop` is asked every few
    /// milliseconds, on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn samples(&self, stop: Stop<'_>) -> Result<Samples, Stopped> {
        let samples = self.samples_with(&[Window::None], SAMPLES[0], stop)?;
        Ok(samples.into_iter().next().unwrap_or(Samples(Vec::new())))
    }

    /// The samples of the reflection at some central directions, with each window on its series: the light is
    /// rotated once for all of them.
    fn samples_with(
        &self,
        windows: &[Window],
        centrals: usize,
        stop: Stop<'_>,
    ) -> Result<Vec<Samples>, Stopped> {
        let (f, p) = (self.brdf().f(), self.brdf().p());
        let basis = Basis::new(p);
        let lamps = self.lamps().map(|lamps| (lamps, lamps.points()));
        let at = |index: usize| {
            stop.check()?;
            let central = spiral(index, centrals);
            let light = rotate_orders(self.lighting(), frame(central).inverse(), p.get());
            let mut rows = vec![vec![[0.0; 3]; p.rows()]; windows.len()];
            let mut of_l = vec![[0.0; 3]; p.rows()];
            for l in 0..=f.get() {
                of_l.fill([0.0; 3]);
                add(&mut of_l, &light, self.brdf(), l);
                for (rows, window) in rows.iter_mut().zip(windows) {
                    let factor = window.factor(l, f);
                    for (row, value) in rows.iter_mut().zip(&of_l) {
                        (0..3).for_each(|channel| row[channel] += factor * value[channel]);
                    }
                }
            }
            let lights = lamps.as_ref().map(|(lamps, points)| (lamps, in_frame(points, central)));
            let mut y = vec![0.0; p.rows()];
            let mut radiance = vec![Vec::with_capacity(SAMPLES[1]); windows.len()];
            for view in 0..SAMPLES[1] {
                let outgoing = seen(self.brdf().centre(), index * SAMPLES[1] + view);
                basis.evaluate_into(outgoing, &mut y);
                let lit = lights.as_ref().map_or([0.0; 3], |(lamps, lights)| lamps.seen(lights, outgoing));
                for (radiance, rows) in radiance.iter_mut().zip(&rows) {
                    let mut sum = lit;
                    for (row, y) in rows.iter().zip(&y) {
                        (0..3).for_each(|channel| sum[channel] += row[channel] * y);
                    }
                    radiance.push(sum);
                }
            }
            Ok(radiance)
        };
        let by_central: Result<Vec<_>, Stopped> = (0..centrals).into_par_iter().map(at).collect();
        let by_central = by_central?;
        let of_window =
            |k: usize| by_central.iter().flat_map(|radiance| radiance[k].iter().copied()).collect();
        Ok((0..windows.len()).map(|k| Samples(of_window(k))).collect())
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
    use brdf::{Fresnel, Ggx, Phong};
    use sh::{Expansion, Light};
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

    /// The study's estimates are near the errors at the samples of the choice of degrees, and a cut that does
    /// not show has no study.
    #[test]
    fn a_study_has_the_errors_of_the_cut_and_of_its_remedies() {
        let degree = Degree::new(30).unwrap();
        let mut rows = vec![[0.0; 3]; degree.rows()];
        rows[0] = [3.5; 3];
        (1..=30).for_each(|l| rows[l * l + l + 1] = [0.6 / (l * l) as f64; 3]);
        let series = Expansion::from_coefficients(degree, rows).unwrap();
        let lamp = |k| Light::from_flux(spiral(k, 9), 0.05, [0.4, 0.3, 0.2]);
        let lighting = Lighting { series, lights: (0..9).map(lamp).collect() };
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        let material = Material::Ggx(Ggx::new(0.3, metal, [1.0; 3]).unwrap());
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let (dark, limit) = (0.01 * lighting.mean(), |error: &CutError| error.p95 > 0.1);
        let [low, high] = [[8, 2], [60, 16]].map(|[f, p]| {
            let cut = full.cut_to(Degree::new(f).unwrap(), Degree::new(p).unwrap());
            Reflection::convolve(&lighting.whole(), &cut)
        });
        let study = |cut| CutStudy::of(cut, (&lighting, &material), dark, limit, Stop::NEVER).unwrap();
        let found = study(&low).unwrap();
        let whole = Reflection::convolve(&lighting.series, &full)
            .with_lamps(crate::Lamps { lights: lighting.lights.clone(), material: material.clone() });
        let samples = |field: &Reflection| field.samples(Stop::NEVER).unwrap();
        let right = samples(&whole);
        let near = |found: &CutError, field: &Reflection| {
            let expected = samples(field).error(&right, dark);
            assert!((found.p95 - expected.p95).abs() < 0.15 * expected.p95 + 0.01, "{found:?} {expected:?}");
            assert!((found.negative - expected.negative).abs() < 0.03, "{found:?} {expected:?}");
        };
        near(&found.error, &low);
        near(&found.lanczos, &low.windowed(Window::Lanczos));
        near(&found.hanning, &low.windowed(Window::Hanning));
        assert!(found.by_light.p95 < 0.1 && found.negative_light == 0.0, "{found:?}");
        // All light without a lamp is soft, and the cut holds it.
        let soft = Lighting { lights: Vec::new(), ..lighting.clone() };
        let cut = Reflection::convolve(&soft.series, &high.brdf().clone());
        assert_eq!(CutStudy::of(&cut, (&soft, &material), dark, limit, Stop::NEVER).unwrap(), None);
    }
}
