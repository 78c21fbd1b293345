//! The degrees of a reflection, chosen for its light ([RH02, sec. 5], with the eye's measure).
//!
//! What a cut at (F, P) loses is a share of the *product* of this light with this material, and the eye reads
//! it in stops: |log2((cut + e) / (uncut + e))|, e being [`BLACK_SHARE`] of the mean radiance, so that black
//! does not count. It is measured, not estimated: at central directions spread over the sphere and at views
//! as a ball shows them to a distant camera, B is evaluated at the highest degrees and at lower ones, with
//! what the lights beside the series add to both. Chosen are the least P whose errors in 95 and in 99 of 100
//! samples stay below `SHOWS`, or which a [`DegreeRule`] takes, and then the least F that adds no more than
//! `SHOWS_BESIDE` to them.

use brdf::{BrdfCoefficients, Centre};
use rayon::prelude::*;
use sh::{Basis, Degree, Expansion, Stop, Stopped, rotate_orders};
use sphere::{Direction, spiral};

use crate::degree_rule::{DegreeRule, MapDegree, rms_of_cuts};
use crate::lamps::{LampPoints, Lamps};
use crate::reflection::MOST_P;
use crate::{Reflection, frame};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// Radiance below this share of the mean counts as black.
pub const BLACK_SHARE: f64 = 0.01;

/// Stops that 5 of 100 samples, and 1 of 100, may exceed by what P cuts.
const SHOWS: [f64; 2] = [0.06, 0.12];

/// The share of the errors that a material may have which its diffuse part may use: that is smooth, so that
/// the highlight needs the rest.
pub const DIFFUSE: f64 = 0.5;

/// Stops that 5 of 100 samples, and 1 of 100, may exceed by what F cuts beside P. F costs little, so it has
/// to lose little.
const SHOWS_BESIDE: [f64; 2] = [0.015, 0.05];

/// The number of central directions of the samples, and of views of each.
pub(crate) const SAMPLES: [usize; 2] = [96, 16];

/// The number of times that [`Reflection::for_light`] asks whether to stop.
pub const STEPS: usize = SAMPLES[0];

/// The degrees F that are tried, besides the highest.
const TRIED_F: [usize; 19] = [2, 4, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60, 80, 100, 120, 150, 180, 215];

/// The degrees P that are tried.
const TRIED_P: [usize; 11] = [0, 1, 2, 3, 4, 5, 6, 8, 10, 12, MOST_P];

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
/// if none do, the highest.
///
/// `lighting` is the light without the lamps, `brdf` has degrees that are high enough
/// ([`brdf::Choice::Full`]).
fn choose(
    lighting: &Expansion,
    brdf: &BrdfCoefficients,
    beside: Beside<'_>,
    allowance: CutAllowance,
    stop: Stop<'_>,
) -> Result<Cut, Stopped> {
    let trial = Trial::new(lighting, brdf, SAMPLES[0], allowance.rule);
    Ok(least(&trial, &trial.all_samples(lighting, brdf, beside, stop)?, allowance))
}

/// Finds the least of the tried degrees at which a cut uses no more than its share of the limits.
fn least(trial: &Trial, samples: &[Sample], allowance: CutAllowance) -> Cut {
    let CutAllowance { share, dark, rule } = allowance;
    let highest = trial.f.len() - 1;
    let measure = |f: usize, p: usize| -> Cut {
        let mut stops: Vec<f64> = samples.iter().flat_map(|sample| sample.stops(trial, f, p, dark)).collect();
        stops.sort_by(f64::total_cmp);
        let at = |share: f64| stops.get((share * stops.len() as f64) as usize).copied().unwrap_or(0.0);
        let degree = |l: usize| Degree::new(l).unwrap_or(Degree::MAX);
        let rms = trial.rms[trial.p[p]];
        let p = degree(trial.p[p]);
        let map = MapDegree { p, p95: at(0.95), p99: at(0.99), rms, is_met: false, enough: None };
        Cut { f: degree(trial.f[f]), map }
    };
    let within = |cut: &Cut, limits: [f64; 2]| cut.map.p95 <= limits[0] && cut.map.p99 <= limits[1];
    let last = trial.p.len() - 1;
    let shows = SHOWS.map(|stops| share * stops);
    let by_rule = rule.and_then(|rule| {
        let measured: Vec<MapDegree> = (0..=last).map(|p| measure(highest, p).map).collect();
        DegreeRule { tolerance: rule.tolerance.scaled(share), ..rule }.choose(&measured)
    });
    let (p, is_met, enough) = match by_rule {
        Some(MapDegree { p, is_met, enough, .. }) => {
            (trial.p.iter().position(|tried| *tried == p.get()).unwrap_or(last), is_met, enough)
        }
        None => {
            let found = (0..=last).find(|p| within(&measure(highest, *p), shows));
            (found.unwrap_or(last), found.is_some(), None)
        }
    };
    let reached = measure(highest, p);
    let MapDegree { p95, p99, .. } = reached.map;
    let limits = [p95 + share * SHOWS_BESIDE[0], p99 + share * SHOWS_BESIDE[1]];
    let cut = (0..highest).map(|f| measure(f, p)).find(|cut| within(cut, limits)).unwrap_or(reached);
    Cut { map: MapDegree { is_met, enough, ..cut.map }, ..cut }
}

/// The light that is added to a field before it is seen: a cut shows less beside more light.
#[derive(Clone, Copy)]
struct Beside<'a> {
    lamps: Option<&'a Lamps>,
    /// The lamps that the diffuse part reflects.
    of_diffuse: Option<&'a LampPoints<'a>>,
    /// The field of the same material's diffuse part, about the normal, as it is cut and before; the other is
    /// about the reflection vector.
    diffuse: Option<[&'a Reflection; 2]>,
}

impl Beside<'_> {
    /// The radiance of the diffuse part: with its cut, and without.
    fn diffuse(&self, central: Direction, outgoing: Direction) -> [[f64; 3]; 2] {
        let Some(fields) = self.diffuse else { return [[0.0; 3]; 2] };
        let view = frame(central).apply(outgoing);
        let normal = central.vector() + view.vector();
        let normal = if normal.length() > 0.0 { Direction::normalised(normal) } else { central };
        let lit = self.of_diffuse.map_or([0.0; 3], |lamps| lamps.radiance(normal, view));
        fields.map(|field| {
            let soft = field.evaluate(normal, view);
            std::array::from_fn(|channel| soft[channel].max(0.0) + lit[channel])
        })
    }
}

/// The degrees that are tried, and those that they are compared with.
struct Trial {
    /// The number of central directions.
    centrals: usize,
    f: Vec<usize>,
    p: Vec<usize>,
    reference_p: usize,
    centre: Centre,
    /// The RMS of what each P leaves out, as a share.
    rms: Vec<f64>,
}

/// Radiance at one central direction and view: what is beside the cut field and beside the field at the
/// highest degrees, that field, and the cut field for each F and P.
struct Sample {
    beside: [[f64; 3]; 2],
    reference: [f64; 3],
    cuts: Vec<[f64; 3]>,
}

impl Trial {
    fn new(lighting: &Expansion, brdf: &BrdfCoefficients, centrals: usize, rule: Option<DegreeRule>) -> Self {
        let (most_f, most_p) = (brdf.f().min(lighting.degree()).get(), brdf.p().get());
        let mut f: Vec<usize> = TRIED_F.into_iter().filter(|f| *f < most_f).collect();
        f.push(most_f);
        let mut p: Vec<usize> = TRIED_P.into_iter().filter(|p| *p < most_p.min(MOST_P)).collect();
        p.push(most_p.min(MOST_P));
        if let Some(rule) = rule {
            p = (0..=most_p.min(rule.most_p.max(MOST_P))).collect();
        }
        let rms = rms_of_cuts(&lighting.to_degree(lighting.degree().min(brdf.f())), brdf);
        Self { centrals, f, p, reference_p: most_p, centre: brdf.centre(), rms }
    }

    /// The samples of all central directions.
    fn all_samples(
        &self,
        lighting: &Expansion,
        brdf: &BrdfCoefficients,
        beside: Beside<'_>,
        stop: Stop<'_>,
    ) -> Result<Vec<Sample>, Stopped> {
        let sample = |index| stop.check().map(|()| self.samples(index, lighting, brdf, beside));
        let samples: Result<Vec<_>, Stopped> = (0..self.centrals).into_par_iter().map(sample).collect();
        Ok(samples?.into_iter().flatten().collect())
    }

    /// The samples of one central direction.
    fn samples(
        &self,
        index: usize,
        lighting: &Expansion,
        brdf: &BrdfCoefficients,
        beside: Beside<'_>,
    ) -> Vec<Sample> {
        let central = spiral(index, self.centrals);
        let most = Degree::new(self.f[self.f.len() - 1]).unwrap_or(Degree::ZERO);
        let light = rotate_orders(&lighting.to_degree(most), frame(central).inverse(), self.reference_p);
        let lights = beside.lamps.map(|lamps| (lamps, lamps.about(central)));
        let side = self.reference_p;
        let degree = Degree::new(side).unwrap_or(Degree::ZERO);
        let basis = Basis::new(degree);
        let mut y = vec![0.0; degree.rows()];
        let views: Vec<(Vec<f64>, [[f64; 3]; 2])> = (0..SAMPLES[1])
            .map(|view| {
                let outgoing = seen(self.centre, index * SAMPLES[1] + view);
                basis.evaluate_into(outgoing, &mut y);
                let lit = lights.as_ref().map_or([0.0; 3], |(lamps, lights)| lamps.seen(lights, outgoing));
                let diffuse = beside.diffuse(central, outgoing);
                (y.clone(), diffuse.map(|soft| std::array::from_fn(|channel| lit[channel] + soft[channel])))
            })
            .collect();
        let mut rows = vec![[0.0; 3]; degree.rows()];
        let mut done = 0;
        let mut cuts: Vec<Vec<[f64; 3]>> = vec![Vec::new(); views.len()];
        let mut reference = vec![[0.0; 3]; views.len()];
        for &f in &self.f {
            for l in done..=f {
                add(&mut rows, &light, brdf, l);
            }
            done = f + 1;
            for (view, (y, _)) in views.iter().enumerate() {
                let (mut sum, mut next) = ([0.0; 3], 0);
                for p in 0..=side {
                    for row in p * p..(p + 1) * (p + 1) {
                        (0..3).for_each(|channel| sum[channel] += rows[row][channel] * y[row]);
                    }
                    if self.p.get(next) == Some(&p) {
                        cuts[view].push(sum);
                        next += 1;
                    }
                }
                reference[view] = sum;
            }
        }
        let sample = |((cuts, reference), (_, beside))| Sample { beside, reference, cuts };
        cuts.into_iter().zip(reference).zip(views).map(sample).collect()
    }
}

impl Sample {
    /// The errors of a cut, one for each channel.
    fn stops(&self, trial: &Trial, f: usize, p: usize, dark: f64) -> [f64; 3] {
        let cut = self.cuts[f * trial.p.len() + p];
        std::array::from_fn(|channel| {
            let seen =
                |value: f64, beside: [f64; 3]| value.max(0.0) + beside[channel] + dark.max(f64::MIN_POSITIVE);
            let [beside_cut, beside_reference] = self.beside;
            let right = seen(self.reference[channel], beside_reference);
            math::log2(seen(cut[channel], beside_cut) / right).abs()
        })
    }
}

/// Adds the terms of one l to the coefficients b_pq: see `evaluation.rs`.
pub(crate) fn add(rows: &mut [[f64; 3]], light: &Expansion, brdf: &BrdfCoefficients, l: usize) {
    for p in 0..=brdf.p().get() {
        for q in 0..=p.min(l) {
            let rho = brdf.get(l, p, q);
            for (row, a) in [(p * p + p + q, l * l + l + q), (p * p + p - q, l * l + l - q)]
                .into_iter()
                .take(if q == 0 { 1 } else { 2 })
            {
                (0..3).for_each(|channel| {
                    rows[row][channel] += rho[channel] * light.coefficients()[a][channel]
                });
            }
        }
    }
}

/// The view of a sample in the frame of the central direction: as a ball shows views to a distant camera, the
/// squared sine of the angle between normal and view is uniform. About R that is uniform over the sphere.
pub(crate) fn seen(centre: Centre, index: usize) -> Direction {
    // A sequence of low discrepancy in two dimensions (R2: Roberts 2018).
    let share = |step: f64| (0.5 + index as f64 * step).fract();
    let (u, phi) = (share(0.754_877_666_246_692_8), std::f64::consts::TAU * share(0.569_840_290_998_053_3));
    match centre {
        Centre::Reflection => Direction::from_angles(math::acos(1.0 - 2.0 * u), phi),
        Centre::Normal => Direction::from_angles(math::asin(u.sqrt()), phi),
        Centre::Tangent => {
            // About the normal +X, seen from the tangent +Z.
            let v = Direction::from_angles(math::asin(u.sqrt()), phi).vector();
            Direction::normalised(sphere::DVec3::new(v.z, v.y, v.x))
        }
    }
}

impl Reflection {
    /// Returns the reflection cut to the least degrees at which the cut does not show, with the lamps beside
    /// it; if it shows at all that were tried, they are the highest. `brdf` has degrees that are high enough
    /// ([`brdf::Choice::Full`]). `stop` is asked [`STEPS`] times, every few milliseconds on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn for_light(
        lighting: &sh::Lighting,
        brdf: &BrdfCoefficients,
        material: &brdf::Material,
        stop: Stop<'_>,
    ) -> Result<(Self, Cut), Stopped> {
        Self::for_light_by(None, lighting, brdf, material, stop)
    }

    /// [`Reflection::for_light`] with the degree P that a rule takes, and the least F beside it.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn for_light_by(
        rule: Option<DegreeRule>,
        lighting: &sh::Lighting,
        brdf: &BrdfCoefficients,
        material: &brdf::Material,
        stop: Stop<'_>,
    ) -> Result<(Self, Cut), Stopped> {
        let (lamps, dark) = (lamps_of(lighting, material), BLACK_SHARE * lighting.mean());
        let beside = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
        let cut = choose(&lighting.series, brdf, beside, CutAllowance { share: 1.0, dark, rule }, stop)?;
        Ok((Self::cut_at(&cut, &lighting.series, brdf, lamps), cut))
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
        Self::parts_for_light_by(None, lighting, parts, stop)
    }

    /// [`Reflection::parts_for_light`] with the degrees P that a rule takes, and the least F beside them.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn parts_for_light_by(
        rule: Option<DegreeRule>,
        lighting: &sh::Lighting,
        [(diffuse, matte), (specular, highlight)]: [(&BrdfCoefficients, &brdf::Material); 2],
        stop: Stop<'_>,
    ) -> Result<([Self; 2], Cut), Stopped> {
        let (series, dark) = (&lighting.series, BLACK_SHARE * lighting.mean());
        let allowance = CutAllowance { share: 1.0, dark, rule };
        let lamps = lamps_of(lighting, matte);
        let alone = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
        let cut = choose(series, diffuse, alone, allowance.of(DIFFUSE), stop)?;
        let f = well_above(cut.f).min(series.degree()).min(diffuse.f());
        let whole = Self::convolve(&series.to_degree(f), &diffuse.cut_to(f, well_above(cut.map.p)));
        let base = Self::cut_at(&cut, series, diffuse, lamps);
        let (lamps, of_diffuse) = (lamps_of(lighting, highlight), base.lamps().map(Lamps::for_views));
        let fields = Some([&base, &whole]);
        let beside = Beside { lamps: Some(&lamps), of_diffuse: of_diffuse.as_ref(), diffuse: fields };
        let cut = choose(series, specular, beside, allowance, stop)?;
        let highlight = Self::cut_at(&cut, series, specular, lamps);
        Ok(([base, highlight], cut))
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
) -> Result<[Vec<[f64; 3]>; 2], Stopped> {
    let (lamps, dark) = (lamps_of(lighting, material), BLACK_SHARE * lighting.mean());
    let beside = Beside { lamps: Some(&lamps), of_diffuse: None, diffuse: None };
    let trial = Trial::new(&lighting.series, brdf, centrals, None);
    let samples = trial.all_samples(&lighting.series, brdf, beside, stop)?;
    let cut = least(&trial, &samples, CutAllowance { share: 1.0, dark, rule: None });
    let place = |degrees: &[usize], degree: Degree| degrees.iter().position(|l| *l == degree.get());
    let [f, p] = [place(&trial.f, cut.f), place(&trial.p, cut.map.p)].map(Option::unwrap_or_default);
    let with =
        |value: [f64; 3], beside: [f64; 3]| std::array::from_fn(|channel| value[channel] + beside[channel]);
    let whole = samples.iter().map(|sample| with(sample.reference, sample.beside[1])).collect();
    let cut =
        samples.iter().map(|sample| with(sample.cuts[f * trial.p.len() + p], sample.beside[0])).collect();
    Ok([whole, cut])
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
    use brdf::{Choice, Fresnel, Ggx, Lambert, Material, Microfacet, Phong, project};
    use sh::{Light, Lighting};

    use super::*;

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
        choose(lighting, &brdf, beside, allowance, Stop::NEVER).unwrap()
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
