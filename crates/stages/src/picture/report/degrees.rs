//! Degrees in a report: what truncations of light, of a material and of their reflection lose, as in
//! [RH02, sec. 5.1, figs. 5 to 8, app. B].
//!
//! The light is that which the reflection's series holds: the environment, without its lamps if they are
//! beside the series. Its texels are areas of one radiance, in its coefficients as in brute force, so that
//! both sides of a comparison have the same light.

use std::borrow::Cow;
use std::cell::OnceCell;

use engine::{Failure, Reporter, Steps};
use envmap::{Environment, ToneMap, to_srgb8};
use sh::{CellGrid, CellTransform, Degree, Expansion, Synthesis, Window, energy_per_degree};
use shrm::accuracy::{Accuracy, TruncationEstimate};
use shrm::reference::LightTree;
use shrm::truncation::measured_losses;
use shrm::{MOST_P, MapGrid, Reflection, View};
use sphere::{Cube, Direction};

use crate::light::MAX_UNCUT_DEGREE;
use crate::picture::report::degree_figures::{
    BLURS, BlurredSphere, CAPTURED_F, CAPTURED_P, CapturedEnergy, DegreePair, DegreeSphere, Truncation,
};
use crate::picture::report::degree_pictures::{PICTURE, PairPictures, Pixels};
use crate::picture::report::figures::Settings;
use crate::picture::report::lit::{Lit, TRUTH, brute_force};
use crate::picture::report::readers::{Reader, add, lamps_seen};
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::studied::Studied;
use crate::values::UntilStopped;

/// The degrees P of spheres beside that of the reflection: those of [RH02, fig. 7].
const SHOWN_P: [usize; 4] = [0, 1, 2, 3];

/// The least degree F at which a chart ends: that of [RH02, fig. 6].
const LEAST_END: usize = 30;

/// The degree P at which a chart ends, if no choice is past it.
const LEAST_P_END: usize = 8;

/// A degree P, and the radiance of a sphere's pixels at it.
type Cut = (usize, Vec<[f32; 3]>);

/// Light as a series, and as the image that it is the series of.
struct Series<'a> {
    environment: Cow<'a, Environment>,
    series: Expansion,
    /// The integral of L^2 over the sphere, RGB.
    energy: [f64; 3],
}

/// The light of an environment, with and without its lamps, made once.
#[derive(Default)]
pub(crate) struct SeriesOf<'a> {
    whole: OnceCell<Series<'a>>,
    soft: OnceCell<Series<'a>>,
}

impl<'a> Series<'a> {
    fn new(environment: Cow<'a, Environment>, reporter: &Reporter) -> Result<Self, Failure> {
        reporter.check_cancelled()?;
        let (grid, degree) = (environment.grid(), Degree::new(MAX_UNCUT_DEGREE)?);
        let rows = CellTransform::new(CellGrid::lat_long(grid), degree).project(environment.pixels());
        let series = Expansion::from_coefficients(degree, rows)
            .ok_or_else(|| Failure::new("the light has no coefficients"))?;
        let mut energy = [0.0; 3];
        for (row, texels) in environment.pixels().chunks(grid.width.max(1)).enumerate() {
            let area = grid.solid_angle(row);
            for texel in texels {
                (0..3).for_each(|channel| energy[channel] += area * math::powi(f64::from(texel[channel]), 2));
            }
        }
        Ok(Self { environment, series, energy })
    }
}

impl<'a> SeriesOf<'a> {
    fn of(&self, lit: &Lit<'a>, lamps: bool, reporter: &Reporter) -> Result<&Series<'a>, Failure> {
        let cell = if lamps { &self.whole } else { &self.soft };
        if let Some(made) = cell.get() {
            return Ok(made);
        }
        let environment = match lamps {
            true => Cow::Borrowed(lit.environment),
            false => {
                let separated = reporter.until_stopped(|stop| lit.environment.separate_lamps(stop))?;
                Cow::Owned(separated.soft)
            }
        };
        let made = Series::new(environment, reporter)?;
        Ok(cell.get_or_init(|| made))
    }

    /// Pictures of the environment and of its light at each of [`BLURS`].
    pub(crate) fn pictures(&self, lit: &Lit<'a>, reporter: &Reporter) -> Result<Vec<Pixels>, Failure> {
        let shown = |pixels: &[[f32; 3]]| to_srgb8(pixels, lit.exposure, ToneMap::Filmic);
        let mut pictures = vec![shown(lit.environment.resized(PICTURE)?.pixels())];
        let series = &self.of(lit, true, reporter)?.series;
        for degree in BLURS {
            let blurred = blurred(series, degree)?;
            let pixels: Vec<[f32; 3]> = Synthesis::new(PICTURE, blurred.degree())?.synthesise(&blurred);
            pictures.push(shown(&pixels));
        }
        Ok(pictures)
    }
}

/// Light under the window of Hanning.
fn blurred(series: &Expansion, degree: usize) -> Result<Expansion, Failure> {
    Ok(Window::Hanning.apply(&series.to_degree(Degree::new(degree)?)))
}

/// A material under an environment, and its reflection.
pub(crate) struct Truncated<'a, 'e> {
    pub(crate) lit: &'a Lit<'e>,
    pub(crate) series: &'a SeriesOf<'e>,
    pub(crate) material: &'a Studied<'a>,
    pub(crate) reflection: &'a Reflection,
    /// The share of the material's energy that the paper's rule may lose.
    pub(crate) tolerance: f64,
    pub(crate) settings: &'a Settings,
}

/// The share of a material's energy that low degrees hold.
pub(crate) fn captured(material: &Studied<'_>, reporter: &Reporter) -> Result<CapturedEnergy, Failure> {
    let projection = material.projection(reporter)?;
    let side = projection.coefficients.p().get() + 1;
    let held = |p: usize| -> f64 {
        let rows = projection.energy_lp.chunks_exact(side).take(CAPTURED_F + 1);
        let held: f64 = rows.flat_map(|row| row.iter().take(p + 1)).sum();
        if projection.total > 0.0 { (held / projection.total).min(1.0) } else { 1.0 }
    };
    Ok(CapturedEnergy { material: material.name.clone(), by_p: (0..=CAPTURED_P).map(held).collect() })
}

impl Truncated<'_, '_> {
    /// The figures of a pair and its pictures. It takes a step.
    pub(crate) fn measure(&self, steps: &Steps<'_>) -> Result<(DegreePair, PairPictures), Failure> {
        let reporter = steps.reporter();
        let sphere = Sphere::new(self.settings.sphere);
        let truth = brute_force(self.lit, &self.material.material, &sphere.brushed(), steps)?;
        let shown =
            |values: &[[f32; 3]]| sphere.picture(&to_srgb8(values, self.lit.exposure, ToneMap::Filmic));
        let mut pair = self.curves(reporter)?;
        let mut pictures = PairPictures { truth: shown(&truth), cuts: Vec::new(), blurred: Vec::new() };
        let central = sphere.central(self.reflection.brdf().centre());
        for (p, values) in self.cuts(&central, reporter)? {
            let errors = sphere.errors(&values, &truth, self.lit.dark, Lattice::ALL);
            let held = pair.by_p.get(p).or(pair.by_p.last()).map_or(0.0, |cut| 1.0 - cut.material);
            pair.spheres.push(DegreeSphere { p, held, errors });
            pictures.cuts.push(shown(&values));
        }
        for degree in BLURS {
            let values = self.under_blurred(degree, &central, reporter)?;
            let errors = sphere.errors(&values, &truth, self.lit.dark, Lattice::ALL);
            let alike = self.settings.limits.excess(&errors) <= 1.0;
            pair.blurred.push(BlurredSphere { degree, alike, errors });
            pictures.blurred.push(shown(&values));
        }
        Ok((pair, pictures))
    }

    /// What truncations lose.
    fn curves(&self, reporter: &Reporter) -> Result<DegreePair, Failure> {
        let lamps = self.reflection.lamps().map_or(0, |lamps| lamps.lights.len());
        let Series { environment, series, energy } = self.series.of(self.lit, lamps == 0, reporter)?;
        let projection = self.material.projection(reporter)?;
        let high = Reflection::convolve(series, &projection.coefficients);
        let accuracy = Accuracy::of(&high, *energy, projection.total);
        let [most_f, most_p] = [accuracy.f(), accuracy.p()];
        let brdf = self.reflection.brdf();
        let chosen = [brdf.f().get(), brdf.p().get()];
        let rule = accuracy.least_degrees(self.tolerance);
        let [end_f, end_p] = [0, 1].map(|axis| {
            let marked = chosen[axis].max(rule.map_or(0, |rule| rule[axis]));
            // Without coefficients past P = 0 there is nothing to show of P.
            let least = if axis == 0 { LEAST_END } else { LEAST_P_END * usize::from(most_p > 0) };
            (marked + marked / 4).max(least)
        });
        let by_f = (0..=end_f).map(|f| [f, most_p]);
        let by_p = (0..=end_p).map(|p| [most_f, p]);
        let cuts: Vec<[usize; 2]> = by_f.chain(by_p).chain([chosen]).chain(rule).collect();
        let tree = LightTree::new(environment);
        let (material, dark) = (&*self.material.material, self.lit.dark);
        let radiance =
            |central: Direction, view: Direction| tree.radiance(material, central, view, TRUTH, dark);
        let losses = reporter.until_stopped(|stop| measured_losses(&high, &cuts, &radiance, stop))?;
        // The light goes on where the material has no coefficients.
        let held: Vec<f64> = energy_per_degree(series).iter().map(|rgb| rgb.iter().sum()).collect();
        let total = energy.iter().sum::<f64>().max(held.iter().sum());
        let light = |f: usize| {
            let left = total - held.iter().take(f + 1).sum::<f64>();
            if total > 0.0 { (left / total).max(0.0) } else { 0.0 }
        };
        let measured = |(cut, truth): (&[usize; 2], f64)| {
            let [f, p] = *cut;
            Truncation { light: light(f), ..of_estimate(*cut, accuracy.at(f, p), truth) }
        };
        let mut all = cuts.iter().zip(losses).map(measured);
        let by_f: Vec<Truncation> = all.by_ref().take(end_f + 1).collect();
        let by_p: Vec<Truncation> = all.by_ref().take(end_p + 1).collect();
        let chosen = all.next().ok_or_else(|| Failure::new("nothing was measured"))?;
        Ok(DegreePair {
            environment: self.lit.name.clone(),
            material: self.material.name.clone(),
            lamps,
            tolerance: self.tolerance,
            highest: [most_f, most_p],
            for_light: self.reflection.is_for_light(),
            chosen,
            rule: all.next(),
            by_f,
            by_p,
            spheres: Vec::new(),
            blurred: Vec::new(),
        })
    }

    /// The degrees P that are shown, and the radiance of the reflection cut there, lamps included.
    fn cuts(&self, central: &[Direction], reporter: &Reporter) -> Result<Vec<Cut>, Failure> {
        let grid = MapGrid::Cube(Cube { edge: self.settings.resolution });
        let field = self.reflection;
        let map = reporter.until_stopped(|stop| field.synthesise(grid, View::Local, stop))?;
        let own = field.brdf().p().get();
        let lamps = field.lamps().map(|lamps| lamps_seen(central, lamps));
        let mut cuts = Vec::new();
        for p in SHOWN_P.into_iter().filter(|p| *p < own).chain([own]) {
            let mut values = Reader::of(central, field).shrm(&map.cut(Degree::new(p)?));
            if let Some(lamps) = &lamps {
                add(&mut values, lamps);
            }
            cuts.push((p, values));
        }
        Ok(cuts)
    }

    /// The radiance of the material under blurred light.
    fn under_blurred(
        &self,
        degree: usize,
        central: &[Direction],
        reporter: &Reporter,
    ) -> Result<Vec<[f32; 3]>, Failure> {
        let light = blurred(&self.series.of(self.lit, true, reporter)?.series, degree)?;
        let brdf = &self.material.projection(reporter)?.coefficients;
        let field = Reflection::convolve(&light, &brdf.cut_to(Degree::MAX, Degree::new(MOST_P)?));
        // Four texels for each degree.
        let edge = (4 * field.brdf().f().get()).clamp(16, self.settings.resolution.max(16));
        let grid = MapGrid::Cube(Cube { edge });
        let map = reporter.until_stopped(|stop| field.synthesise(grid, View::Local, stop))?;
        Ok(Reader { central, least: 0.0 }.shrm(&map))
    }
}

/// A truncation at degrees that may be past the highest ones, which then cut nothing.
fn of_estimate([f, p]: [usize; 2], estimate: TruncationEstimate, truth: f64) -> Truncation {
    let TruncationEstimate { truth: product, by_light, by_brdf, by_min, bound_printed, bound_with_p, .. } =
        estimate;
    Truncation {
        f,
        p,
        coefficients: (p + 1) * (p + 1),
        light: by_light,
        material: by_brdf,
        min: by_min,
        printed: bound_printed,
        bound: bound_with_p,
        product,
        truth,
    }
}
