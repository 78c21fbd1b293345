//! The degrees of a reflection, chosen for its light ([RH02, sec. 5], with the eye's measure).
//!
//! What a cut at (F, P) loses is a share of the *product* of this light with this material, and the eye reads
//! it in stops: |log2((cut + e) / (uncut + e))|, e being [`BLACK_SHARE`] of the mean radiance, so that black
//! does not count. It is measured, not estimated: at central directions spread over the sphere and at views
//! as a ball shows them to a distant camera, B is evaluated at the highest degrees that it has and at lower
//! ones, with what the lights beside the series add to both. Chosen are the least P whose errors in 95 and in
//! 99 of 100 samples stay below `SHOWS`, or which a [`DegreeRule`] takes, and then the least F that adds no
//! more than `SHOWS_BESIDE` to them.

use std::f64::consts::PI;
use std::sync::Arc;

use brdf::BrdfCoefficients;
use rayon::prelude::*;
use sh::{Degree, Expansion, Stop, Stopped, Window};

use crate::degree_rule::{DegreeRule, MapDegree, energy_per_central_degree};
use crate::lamps::Lamps;
use crate::samples::Samples;
use crate::turned_light::{TurnedLight, VIEWS};
use crate::{Reflection, stops};
use trial::{Beside, Sample, Trial};

pub(crate) use trial::seen;

pub use crate::stops::BLACK_SHARE;

mod trial;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 4;

/// Stops that 5 of 100 samples, and 1 of 100, may exceed by what P cuts.
const SHOWS: [f64; 2] = [0.06, 0.12];

/// The share of the errors that a material may have which its diffuse part may use: that is smooth, so that
/// the highlight needs the rest.
pub const DIFFUSE: f64 = 0.5;

/// Stops that 5 of 100 samples, and 1 of 100, may exceed by what F cuts beside P. F costs little, so it has
/// to lose little.
const SHOWS_BESIDE: [f64; 2] = [0.015, 0.05];

/// The RMS radiance over all central directions and views, as a share of the radiance that counts as black,
/// above which degrees F belong to the reference of the choice.
const UNSEEN: f64 = 0.1;

/// The number of central directions of the samples, and of views of each.
pub(crate) const SAMPLES: [usize; 2] = [96, VIEWS];

/// The number of times that [`Reflection::for_light`] asks whether to stop.
pub const STEPS: usize = SAMPLES[0];

/// Degrees and the error of a cut at them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The degree in the central direction.
    pub f: Degree,
    /// The degree in the view, and the errors of the cut; the RMS is that of P alone.
    pub map: MapDegree,
}

impl Cut {
    /// Whether the cut is seen, because no degrees that were tried are enough.
    pub fn shows(&self) -> bool {
        let MapDegree { p95, p99, .. } = self.map;
        p95 > SHOWS[0] + SHOWS_BESIDE[0] || p99 > SHOWS[1] + SHOWS_BESIDE[1]
    }
}

/// The errors that a cut may have.
#[derive(Clone, Copy)]
struct CutAllowance {
    /// The share of the limits that the cut may use.
    share: f64,
    /// The radiance e, next to which black does not count.
    dark: f64,
    /// What P has to meet, in place of `SHOWS`.
    rule: Option<DegreeRule>,
}

impl CutAllowance {
    fn of(self, share: f64) -> Self {
        Self { share, ..self }
    }
}

/// The least degrees at which a cut of this light on this material uses no more than its share of the limits;
/// if none do, the highest. Also the samples that the cut was compared with, and what is beside the cut.
///
/// `turned` is the light without the lamps, `brdf` has degrees that are high enough
/// ([`brdf::Choice::Full`]).
fn choose(
    lighting: &Expansion,
    turned: &TurnedLight,
    brdf: &BrdfCoefficients,
    beside: Beside<'_>,
    allowance: CutAllowance,
    stop: Stop<'_>,
) -> Result<(Cut, Samples, Samples), Stopped> {
    let trial = Trial::new(lighting, brdf, turned.len(), allowance.rule);
    let samples = trial.all_samples(turned, brdf, beside, stop)?;
    let lit = Samples(samples.iter().map(|sample| sample.beside[0]).collect());
    Ok((least(&trial, &samples, allowance), uncut(&samples), lit))
}

/// The coefficients without the degrees F at which the field has next to nothing: a soft light, or a rough
/// material, has no fine details.
fn without_unseen_degrees(lighting: &Expansion, brdf: &BrdfCoefficients, dark: f64) -> BrdfCoefficients {
    let mut left = 0.0;
    // The mean square is the energy of [RH02, eq. 14] over (4 pi)^2.
    let most = math::powi(UNSEEN * dark * 4.0 * PI, 2);
    let energies = energy_per_central_degree(lighting, brdf);
    let is_seen = |energy: &f64| {
        left += energy;
        left > most
    };
    let f = energies.iter().rposition(is_seen).unwrap_or(0);
    brdf.cut(Degree::new(f).unwrap_or(Degree::MAX))
}

/// The radiance at the highest degrees.
fn uncut(samples: &[Sample]) -> Samples {
    let with = |sample: &Sample| std::array::from_fn(|c| sample.reference[c] + sample.beside[1][c]);
    Samples(samples.iter().map(with).collect())
}

/// Finds the least of the tried degrees at which a cut uses no more than its share of the limits.
fn least(trial: &Trial, samples: &[Sample], allowance: CutAllowance) -> Cut {
    let CutAllowance { share, dark, rule } = allowance;
    let highest = trial.f.len() - 1;
    let measure = |f: usize, p: usize| -> Cut {
        let mut stops: Vec<f64> = samples.iter().flat_map(|sample| sample.stops(trial, f, p, dark)).collect();
        let [p95, p99] = stops::quantiles(&mut stops);
        let degree = |l: usize| Degree::new(l).unwrap_or(Degree::MAX);
        let rms = trial.rms[trial.p[p]];
        let p = degree(trial.p[p]);
        let map = MapDegree { p, p95, p99, rms, is_met: false, enough: None, field: p };
        Cut { f: degree(trial.f[f]), map }
    };
    let within = |cut: &Cut, limits: [f64; 2]| cut.map.p95 <= limits[0] && cut.map.p99 <= limits[1];
    let last = trial.p.len() - 1;
    let shows = SHOWS.map(|stops| share * stops);
    let of_p = (0..trial.p.len()).into_par_iter().with_max_len(1);
    let by_rule = rule.and_then(|rule| {
        let measured: Vec<MapDegree> = of_p.clone().map(|p| measure(highest, p).map).collect();
        DegreeRule { tolerance: rule.tolerance.scaled(share), ..rule }.choose(&measured)
    });
    let (p, is_met, enough) = match by_rule {
        Some(MapDegree { p, is_met, enough, .. }) => {
            (trial.p.iter().position(|tried| *tried == p.get()).unwrap_or(last), is_met, enough)
        }
        None => {
            let found = of_p.find_first(|p| within(&measure(highest, *p), shows));
            (found.unwrap_or(last), found.is_some(), None)
        }
    };
    let reached = measure(highest, p);
    let MapDegree { p95, p99, .. } = reached.map;
    let limits = [p95 + share * SHOWS_BESIDE[0], p99 + share * SHOWS_BESIDE[1]];
    let of_f = (0..highest).into_par_iter().with_max_len(1).map(|f| measure(f, p));
    let cut = of_f.find_first(|cut| within(cut, limits)).unwrap_or(reached);
    Cut { map: MapDegree { is_met, enough, ..cut.map }, ..cut }
}

/// Adds the terms of one l to the coefficients b_pq: see `evaluation.rs`.
pub(crate) fn add(rows: &mut [[f64; 3]], light: &Expansion, brdf: &BrdfCoefficients, l: usize) {
    let side = brdf.p().get() + 1;
    let rho = &brdf.rho()[l * side * side..][..side * side];
    let (sines, cosines) = light.coefficients()[l * l..(l + 1) * (l + 1)].split_at(l);
    for (p, rho) in rho.chunks_exact(side).enumerate() {
        let (below, above) = rows[p * p..(p + 1) * (p + 1)].split_at_mut(p);
        let sum = |((row, rho), light): ((&mut [f64; 3], &[f64; 3]), &[f64; 3])| {
            (0..3).for_each(|channel| row[channel] += rho[channel] * light[channel]);
        };
        above.iter_mut().zip(rho).zip(cosines).for_each(sum);
        below.iter_mut().rev().zip(&rho[1..]).zip(sines.iter().rev()).for_each(sum);
    }
}

/// Gives the turned light that serves coefficients of a material.
pub type TurnedLights<'a> = dyn Fn(&Expansion, &BrdfCoefficients) -> Result<Arc<TurnedLight>, Stopped> + 'a;

/// A reflection at degrees that were chosen for its light.
#[derive(Clone, Debug)]
pub struct ForLight<R> {
    /// The reflection, or those of the material's parts.
    pub reflection: R,
    /// The degrees, and what the cut at them loses.
    pub cut: Cut,
    /// The radiance without a cut where [`Reflection::samples`] looks.
    pub uncut: Samples,
    /// The radiance of the lamps alone there.
    lit: Samples,
    /// The light that the degrees were chosen with.
    turned: Arc<TurnedLight>,
}

impl ForLight<Reflection> {
    /// The radiance of the reflection where [`Reflection::samples`] looks, with each of some windows on its
    /// series. `stop` is asked every few milliseconds, on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn samples(&self, windows: &[Window], stop: Stop<'_>) -> Result<Vec<Samples>, Stopped> {
        let (brdf, turned) = (self.reflection.brdf(), &*self.turned);
        let f = self.reflection.lighting().degree();
        let trial = Trial::new(self.reflection.lighting(), brdf, turned.len(), None).of_one(f, brdf.p());
        let of_window = |window: &Window| {
            let windowed = brdf.scaled(|l| window.factor(l, f));
            let beside = Beside { lamps: None, of_diffuse: None, diffuse: None };
            let samples = trial.all_samples(turned, &windowed, beside, stop)?;
            let seen = samples.iter().zip(&self.lit.0);
            let seen = seen.map(|(sample, lit)| std::array::from_fn(|c| sample.reference[c] + lit[c]));
            Ok(Samples(seen.collect()))
        };
        windows.iter().map(of_window).collect()
    }
}

impl TurnedLight {
    /// The turned light for the choice of degrees, of some F and P ([`TurnedLight::needed`] or more). `stop`
    /// is asked [`STEPS`] times, every few milliseconds on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn for_choice(series: &Expansion, degrees: [Degree; 2], stop: Stop<'_>) -> Result<Self, Stopped> {
        Self::new(series, degrees, SAMPLES[0], stop)
    }
}

impl Reflection {
    /// Returns the reflection cut to the least degrees at which the cut does not show, with the lamps beside
    /// it; if it shows at all that were tried, they are the highest. `brdf` has degrees that are high enough
    /// ([`brdf::Choice::Full`]). `stop` is asked twice [`STEPS`] times, every few milliseconds on every
    /// thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn for_light(
        lighting: &sh::Lighting,
        brdf: &BrdfCoefficients,
        material: &brdf::Material,
        stop: Stop<'_>,
    ) -> Result<(Self, Cut), Stopped> {
        let turn = |series: &Expansion, brdf: &_| {
            TurnedLight::for_choice(series, TurnedLight::needed(series, brdf), stop).map(Arc::new)
        };
        let found = Self::for_light_by(None, (lighting, &turn), brdf, material, stop)?;
        Ok((found.reflection, found.cut))
    }

    /// [`Reflection::for_light`] with the degree P that a rule takes, and the least F beside it. The light
    /// comes with its [`TurnedLight`], which asks by itself whether to stop.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn for_light_by(
        rule: Option<DegreeRule>,
        (lighting, turned): (&sh::Lighting, &TurnedLights<'_>),
        brdf: &BrdfCoefficients,
        material: &brdf::Material,
        stop: Stop<'_>,
    ) -> Result<ForLight<Self>, Stopped> {
        let (lamps, dark) = (lamps_of(lighting, material), BLACK_SHARE * lighting.mean());
        let beside = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
        let (series, allowance) = (&lighting.series, CutAllowance { share: 1.0, dark, rule });
        let brdf = &without_unseen_degrees(series, brdf, dark);
        let light = turned(series, brdf)?;
        let (cut, uncut, lit) = choose(series, &light, brdf, beside, allowance, stop)?;
        Ok(ForLight { reflection: Self::cut_at(&cut, series, brdf, lamps), cut, uncut, lit, turned: light })
    }

    /// Cuts the reflections of the diffuse and the specular part of a material to degrees at which the cut of
    /// their sum does not show. The cut that is returned has the degrees of the specular part and the errors
    /// of the sum. `stop` is asked twice as often as by [`Reflection::for_light`].
    ///
    /// # Errors
    /// If it was stopped.
    pub fn parts_for_light(
        lighting: &sh::Lighting,
        parts: [(&BrdfCoefficients, &brdf::Material); 2],
        stop: Stop<'_>,
    ) -> Result<([Self; 2], Cut), Stopped> {
        let turn = |series: &Expansion, brdf: &_| {
            TurnedLight::for_choice(series, TurnedLight::needed(series, brdf), stop).map(Arc::new)
        };
        let found = Self::parts_for_light_by(None, (lighting, &turn), parts, stop)?;
        Ok((found.reflection, found.cut))
    }

    /// [`Reflection::parts_for_light`] with the degrees P that a rule takes, and the least F beside them.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn parts_for_light_by(
        rule: Option<DegreeRule>,
        (lighting, turned): (&sh::Lighting, &TurnedLights<'_>),
        [(diffuse, matte), (specular, highlight)]: [(&BrdfCoefficients, &brdf::Material); 2],
        stop: Stop<'_>,
    ) -> Result<ForLight<[Self; 2]>, Stopped> {
        let (series, dark) = (&lighting.series, BLACK_SHARE * lighting.mean());
        let allowance = CutAllowance { share: 1.0, dark, rule };
        let [diffuse, specular] = [diffuse, specular].map(|part| without_unseen_degrees(series, part, dark));
        let (diffuse, specular) = (&diffuse, &specular);
        let lamps = lamps_of(lighting, matte);
        let alone = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
        let light = turned(series, diffuse)?;
        let (cut, ..) = choose(series, &light, diffuse, alone, allowance.of(DIFFUSE), stop)?;
        let f = well_above(cut.f).min(series.degree()).min(diffuse.f());
        let whole = Self::convolve(&series.to_degree(f), &diffuse.cut_to(f, well_above(cut.map.p)));
        let base = Self::cut_at(&cut, series, diffuse, lamps);
        let (lamps, of_diffuse) = (lamps_of(lighting, highlight), base.lamps().map(Lamps::for_views));
        let fields = Some([&base, &whole]);
        let beside = Beside { lamps: Some(&lamps), of_diffuse: of_diffuse.as_ref(), diffuse: fields };
        let light = turned(series, specular)?;
        let (cut, uncut, lit) = choose(series, &light, specular, beside, allowance, stop)?;
        let highlight = Self::cut_at(&cut, series, specular, lamps);
        Ok(ForLight { reflection: [base, highlight], cut, uncut, lit, turned: light })
    }

    fn cut_at(cut: &Cut, series: &Expansion, brdf: &BrdfCoefficients, lamps: Lamps) -> Self {
        Self::convolve(&series.to_degree(cut.f), &brdf.cut_to(cut.f, cut.map.p))
            .marked_for_light()
            .with_lamps(lamps)
    }
}

/// The radiance of the uncut reflection of a light and of the one that [`Reflection::for_light`] would cut,
/// lamps included, at this many central directions: in the order of [`Reflection::samples`].
pub(crate) fn samples_for_light(
    lighting: &sh::Lighting,
    brdf: &BrdfCoefficients,
    material: &brdf::Material,
    centrals: usize,
    stop: Stop<'_>,
) -> Result<[Samples; 2], Stopped> {
    let (lamps, dark) = (lamps_of(lighting, material), BLACK_SHARE * lighting.mean());
    let beside = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
    let series = &lighting.series;
    let turned = TurnedLight::new(series, TurnedLight::needed(series, brdf), centrals, stop)?;
    let trial = Trial::new(series, brdf, centrals, None);
    let samples = trial.all_samples(&turned, brdf, beside, stop)?;
    let cut = least(&trial, &samples, CutAllowance { share: 1.0, dark, rule: None });
    let place = |degrees: &[usize], degree: Degree| degrees.iter().position(|l| *l == degree.get());
    let [f, p] = [place(&trial.f, cut.f), place(&trial.p, cut.map.p)].map(Option::unwrap_or_default);
    let with =
        |value: [f64; 3], beside: [f64; 3]| std::array::from_fn(|channel| value[channel] + beside[channel]);
    let cut = samples.iter().map(|sample| with(sample.cuts[f * trial.p.len() + p], sample.beside[0]));
    let cut = Samples(cut.collect());
    Ok([uncut(&samples), cut])
}

/// A degree beside which a cut at this one is measured, where the field is smooth.
fn well_above(degree: Degree) -> Degree {
    Degree::new(2 * degree.get() + 8).unwrap_or(Degree::MAX)
}

/// The lights beside a series, which a material reflects.
fn lamps_of(lighting: &sh::Lighting, material: &brdf::Material) -> Lamps {
    Lamps { lights: lighting.lights.clone(), material: material.clone() }
}

#[cfg(test)]
mod tests {
    use brdf::{Centre, Choice, Fresnel, Ggx, Lambert, Material, Microfacet, Phong, project};
    use sh::{Light, Lighting};
    use sphere::{Direction, spiral};

    use super::*;
    use crate::frame;

    fn sky(degree: usize) -> Expansion {
        let degree = Degree::new(degree).unwrap();
        let mut rows = vec![[0.0; 3]; degree.rows()];
        rows[0] = [3.5; 3];
        for l in 1..=degree.get() {
            // As rough as a photograph without its lamps.
            rows[l * l + l] = [2.0 / l as f64; 3];
            rows[l * l] = [1.0 / l as f64; 3];
        }
        Expansion::from_coefficients(degree, rows).unwrap()
    }

    fn chosen(material: &Material, lighting: &Expansion) -> Cut {
        let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let beside = Beside { lamps: None, of_diffuse: None, diffuse: None };
        let allowance = CutAllowance { share: 1.0, dark: BLACK_SHARE, rule: None };
        let needed = TurnedLight::needed(lighting, &brdf);
        let turned = TurnedLight::for_choice(lighting, needed, Stop::NEVER).unwrap();
        choose(lighting, &turned, &brdf, beside, allowance, Stop::NEVER).unwrap().0
    }

    fn microfacet(sigma: f64) -> Material {
        Material::Microfacet(Microfacet::new(sigma, [1.0; 3]).unwrap())
    }

    #[test]
    fn a_matte_surface_needs_few_degrees_and_no_view() {
        let cut = chosen(&Material::Lambert(Lambert::new([0.8; 3]).unwrap()), &sky(60));
        assert!(cut.map.p.get() == 0 && (2..=4).contains(&cut.f.get()), "{cut:?}");
    }

    #[test]
    fn sharper_materials_get_higher_degrees() {
        let degrees = [0.5, 0.2, 0.1].map(|sigma| chosen(&microfacet(sigma), &sky(60)).f.get());
        assert!(degrees[0] < degrees[1] && degrees[1] < degrees[2], "{degrees:?}");
        let degrees =
            [8.0, 64.0, 512.0].map(|s| chosen(&Material::Phong(Phong::new(s, [1.0; 3]).unwrap()), &sky(60)));
        assert!(degrees[0].f < degrees[1].f && degrees[1].f < degrees[2].f, "{degrees:?}");
    }

    /// The product decides: light without detail needs none of the material's degrees.
    #[test]
    fn smooth_light_needs_few_degrees_of_a_sharp_material() {
        let (smooth, rough) = (chosen(&microfacet(0.1), &sky(3)), chosen(&microfacet(0.1), &sky(60)));
        assert!(smooth.f.get() <= 3 && rough.f.get() > 3, "{smooth:?} {rough:?}");
    }

    #[test]
    fn the_errors_are_those_of_the_reflection_that_is_made() {
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        let material = Material::Ggx(Ggx::new(0.4, metal, [1.0; 3]).unwrap());
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let sun = Light::from_flux(Direction::from_angles(0.9, 0.2), 0.01, [5.0; 3]);
        let lighting = Lighting { series: sky(40), lights: vec![sun] };
        let (cut_field, cut) = Reflection::for_light(&lighting, &full, &material, Stop::NEVER).unwrap();
        assert!(cut_field.is_for_light() && cut_field.lamps().is_some());
        assert_eq!((cut_field.brdf().f(), cut_field.brdf().p()), (cut.f, cut.map.p));
        let whole = Reflection::convolve(&lighting.series, &full);
        let (lamps, dark) = (cut_field.lamps().unwrap(), BLACK_SHARE * lighting.mean());
        // Other samples than those of the choice.
        let mut stops = Vec::new();
        for texel in 0..60 {
            let central = spiral(texel, 60);
            for k in 0..10 {
                let local = seen(Centre::Reflection, 7919 + 10 * texel + k);
                let view = Direction::normalised(frame(central).matrix() * local.vector());
                let lit = lamps.radiance(central, view)[1] + dark;
                let [a, b] =
                    [&cut_field, &whole].map(|field| field.evaluate(central, view)[1].max(0.0) + lit);
                stops.push((a / b).log2().abs());
            }
        }
        stops.sort_by(f64::total_cmp);
        // Both are quantiles of 600 and of 3000 samples.
        assert!(
            stops[570] < 1.5 * cut.map.p95 + 0.01 && stops[594] < 2.0 * cut.map.p99 + 0.02,
            "{cut:?} {} {}",
            stops[570],
            stops[594]
        );
    }

    /// What the choice sums is what [`Reflection::samples`] sums, with each window, and a turned light of
    /// higher degrees gives the same.
    #[test]
    fn the_samples_of_the_choice_are_those_of_the_reflections() {
        let material = Material::Ggx(
            Ggx::new(0.3, Fresnel::Conductor { n: [0.2; 3], k: [3.9, 2.4, 2.1] }, [1.0; 3]).unwrap(),
        );
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let sun = Light::from_flux(Direction::from_angles(0.9, 0.2), 0.01, [5.0; 3]);
        let lighting = Lighting { series: sky(70), lights: vec![sun] };
        let near = |found: &Samples, expected: &Samples| {
            assert_eq!(found.0.len(), SAMPLES[0] * SAMPLES[1]);
            for (found, expected) in found.0.as_flattened().iter().zip(expected.0.as_flattened()) {
                assert!((found - expected).abs() < 1e-10 * expected.abs().max(1.0), "{found} {expected}");
            }
        };
        let degrees = TurnedLight::needed(&lighting.series, &full);
        let [wide, narrow] = [degrees, [Degree::new(64).unwrap(), degrees[1]]].map(|degrees| {
            Arc::new(TurnedLight::new(&lighting.series, degrees, SAMPLES[0], Stop::NEVER).unwrap())
        });
        assert_eq!(degrees[0].get(), 70);
        let smooth = full.cut(Degree::new(60).unwrap());
        let mut cuts = Vec::new();
        for (turned, brdf) in [(&wide, &full), (&wide, &smooth), (&narrow, &smooth)] {
            let lights = |_: &_, _: &_| Ok(Arc::clone(turned));
            let found =
                Reflection::for_light_by(None, (&lighting, &lights), brdf, &material, Stop::NEVER).unwrap();
            let lamps = found.reflection.lamps().unwrap().clone();
            let dark = BLACK_SHARE * lighting.mean();
            let whole = without_unseen_degrees(&lighting.series, brdf, dark);
            let whole = Reflection::convolve(&lighting.series, &whole).with_lamps(lamps);
            near(&found.uncut, &whole.samples(Stop::NEVER).unwrap());
            let windows = [Window::None, Window::Lanczos, Window::Hanning];
            let samples = found.samples(&windows, Stop::NEVER).unwrap();
            for (samples, window) in samples.iter().zip(windows) {
                near(samples, &found.reflection.windowed(window).samples(Stop::NEVER).unwrap());
            }
            cuts.push((found.cut.f, found.cut.map.p));
        }
        assert_eq!(cuts[1], cuts[2]);
    }

    /// The RMS of what is left out, over central directions and views that are spread evenly.
    #[test]
    fn degrees_that_are_left_out_have_next_to_nothing() {
        let material = microfacet(0.15);
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let (light, dark) = (sky(120), 0.015);
        let seen = without_unseen_degrees(&light, &full, dark);
        assert!((20..110).contains(&seen.f().get()), "{}", seen.f().get());
        let whole = Reflection::convolve(&light, &full);
        let rms = |f: usize| {
            let cut = Reflection::convolve(&light, &full.cut(Degree::new(f).unwrap()));
            let (centrals, views) = (80, 12);
            let squares = (0..centrals * views).map(|index| {
                let central = spiral(index / views, centrals);
                let view = spiral((7919 * index) % (centrals * views), centrals * views);
                let [a, b] = [&whole, &cut].map(|field| field.evaluate(central, view));
                (0..3).map(|channel| math::powi(a[channel] - b[channel], 2)).sum::<f64>()
            });
            (squares.sum::<f64>() / (centrals * views) as f64).sqrt() / dark
        };
        let f = seen.f().get();
        assert!(rms(f) < 1.1 * UNSEEN && rms(f - 4) > 0.9 * UNSEEN, "{} {}", rms(f), rms(f - 4));
    }

    /// Beside a bright base a highlight needs fewer degrees than alone, and the sum of the two fields is as
    /// near to that of the uncut ones as a cut of one field has to be.
    #[test]
    fn a_highlight_beside_a_base_has_the_degrees_that_their_sum_needs() {
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        let highlight = Material::Ggx(Ggx::new(0.4, metal, [0.1; 3]).unwrap());
        let base = Material::Lambert(Lambert::new([0.7; 3]).unwrap());
        let [whole_base, whole_highlight] =
            [&base, &highlight].map(|part| project(part, Choice::Full, Stop::NEVER).unwrap().coefficients);
        let lighting = Lighting { series: sky(40), lights: Vec::new() };
        let parts = [(&whole_base, &base), (&whole_highlight, &highlight)];
        let (cut, errors) = Reflection::parts_for_light(&lighting, parts, Stop::NEVER).unwrap();
        let (alone, _) = Reflection::for_light(&lighting, &whole_highlight, &highlight, Stop::NEVER).unwrap();
        let degrees = |field: &Reflection| [field.brdf().f(), field.brdf().p()];
        assert!(degrees(&cut[1])[1] < degrees(&alone)[1], "{:?} {:?}", degrees(&cut[1]), degrees(&alone));
        let uncut = [&whole_base, &whole_highlight].map(|brdf| Reflection::convolve(&lighting.series, brdf));
        let dark = BLACK_SHARE * lighting.mean();
        let mut stops = Vec::new();
        for texel in 0..60 {
            let central = spiral(texel, 60);
            for k in 0..10 {
                let local = seen(Centre::Reflection, 7919 + 10 * texel + k);
                let view = Direction::normalised(frame(central).matrix() * local.vector());
                let normal = Direction::normalised(central.vector() + view.vector());
                let [a, b] = [&cut, &uncut].map(|[base, highlight]| {
                    base.evaluate(normal, view)[1] + highlight.evaluate(central, view)[1] + dark
                });
                stops.push((a / b).log2().abs());
            }
        }
        stops.sort_by(f64::total_cmp);
        let limits = [1.5 * errors.map.p95 + 0.01, 2.0 * errors.map.p99 + 0.02];
        assert!(stops[570] < limits[0] && stops[594] < limits[1], "{errors:?} {} {}", stops[570], stops[594]);
    }
}
