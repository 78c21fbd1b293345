//! Measures materials and pairs: calls the kernels and fills the figures.

use brdf::{BrdfCoefficients, Centre, Choice, Projection, project};
use engine::{Context, Failure};
use envmap::{Environment, ToneMap, to_srgb8};
use rayon::prelude::*;
use sh::{Degree, Expansion, Transform, image_energy};
use shrm::accuracy::Estimate;
use shrm::reference::{Cull, Reference};
use shrm::{Cabral, KautzMcCool, MapGrid, Reflection, Shrm, View};
use sphere::{Cube, Direction, LatLong};

use crate::report::advice::advise;
use crate::report::figures::{
    Accuracy, Export, Help, MaterialFigures, Method, PairFigures, PerP, Settings, ShrmError,
};
use crate::report::page::Pictures;
use crate::report::sphere::Sphere;

/// The degrees up to which every material is examined: the F of figures 7 and 8 of the paper, and its highest
/// P.
const HIGH: [usize; 2] = [30, 5];
/// How far above the exports' P that is, if the exports' P is 5 or more.
const FURTHER: usize = 4;
/// The degrees in the view that the spheres of figure 7 have.
const SHOWN_P: [usize; 7] = [0, 1, 2, 4, 8, 12, 16];
/// The fewest rows of an environment that is rendered.
const FEWEST_ROWS: usize = 32;
/// The angles of a Kautz-McCool texture, as `export-kautz-mccool` has them by default.
const SLICES: usize = 16;
/// The share of a lobe that may be ignored: far below what a picture shows.
const CULLED: f64 = 1e-5;

/// The work for the parts of an SHRM's error: pixels times (F + 1)^3, about a tenth of a second.
const PARTS_WORK: usize = 1 << 26;

/// The fewest pixels for the parts of an SHRM's error.
const FEWEST_PARTS: usize = 800;
/// How many degrees are tried in the search for those that are good enough.
const TRIES: usize = 6;

/// A material, projected.
pub(crate) struct ProjectedMaterial<'a> {
    pub(crate) figures: MaterialFigures,
    material: &'a brdf::Material,
    /// At the degrees of the exports.
    exported: BrdfCoefficients,
    /// At the degrees of [`HIGH`], or higher ones if the exports have them.
    high: Projection,
}

/// Projects a material; `exported` is what the graph made of it, or the choice of degrees and its reason.
pub(crate) fn material<'a>(
    name: String,
    material: &'a brdf::Material,
    exported: Exported<'_>,
) -> Result<ProjectedMaterial<'a>, Failure> {
    let (exported, chosen) = match exported {
        Exported::Made(coefficients) => {
            (coefficients.clone(), "those of the connected coefficients".to_owned())
        }
        Exported::Choose(choice, reason) => (project(material, choice)?.coefficients, reason),
    };
    let (f, p) = (exported.f(), exported.p());
    let high_p = if p.get() < HIGH[1] { HIGH[1] } else { p.get() + FURTHER };
    let high_f = f.get().max(HIGH[0]);
    let choice = Choice::Degree { f: Degree::new(high_f)?, p: Degree::new(high_p)? };
    let high = project(material, choice)?;
    let captured = Captured::of(&high);
    let per_p = (0..=high_p).map(|p| captured.share(high_f, p)).collect();
    let figures = MaterialFigures {
        name,
        model: material.name().to_owned(),
        centre: match exported.centre() {
            Centre::Reflection => "reflection vector",
            Centre::Normal => "normal",
            Centre::Tangent => "tangent",
        },
        f: f.get(),
        p: p.get(),
        captured: captured.share(f.get(), p.get()),
        chosen,
        view_dependent: exported.highest().0 > 0,
        high_f,
        captured_per_p: per_p,
        verdict: String::new(),
    };
    Ok(ProjectedMaterial { figures, material, exported, high })
}

/// The origin of the exports' coefficients.
pub(crate) enum Exported<'a> {
    /// Made by another stage.
    Made(&'a BrdfCoefficients),
    /// Chosen here, with the reason in words.
    Choose(Choice, String),
}

/// Sums of a projection's energy.
struct Captured<'a> {
    energy: &'a [f64],
    /// Entries for each l.
    side: usize,
    total: f64,
}

impl<'a> Captured<'a> {
    fn of(projection: &'a Projection) -> Self {
        Self {
            energy: &projection.energy_lp,
            side: projection.coefficients.p().get() + 1,
            total: projection.total,
        }
    }

    /// The share up to degrees F and P; 1 for a black material.
    fn share(&self, f: usize, p: usize) -> f64 {
        if self.total <= 0.0 {
            return 1.0;
        }
        let rows = self.energy.chunks_exact(self.side).take(f + 1);
        (rows.flat_map(|row| row.iter().take(p + 1)).sum::<f64>() / self.total).min(1.0)
    }
}

/// An environment and its exposure.
pub(crate) struct ExposedEnvironment<'a> {
    pub(crate) name: String,
    pub(crate) environment: &'a Environment,
    /// Stops.
    pub(crate) exposure: f64,
}

/// Renders a material under an environment in every way.
pub(crate) fn pair(
    lit: &ExposedEnvironment<'_>,
    material: &ProjectedMaterial<'_>,
    settings: &Settings,
    context: &Context<'_>,
) -> Result<(PairFigures, Pictures), Failure> {
    let figures = &material.figures;
    let sphere = Sphere::new(settings.sphere);
    let central = sphere.central(material.exported.centre());
    let view = Sphere::view();

    let environment = scaled(lit.environment, figures.f, settings.reference_rows)?;
    let grid = environment.grid();
    let highest = Degree::new(figures.high_f.min(grid.height - 1))?;
    let lighting = Transform::new(grid, highest)?.analyse(environment.pixels());

    let tolerance = sh::Tolerance::new(CULLED)?;
    let reference = Reference::new(&environment, material.material, Cull::Energy(tolerance));
    let mut truth = vec![[0.0_f32; 3]; central.len()];
    for (pixels, central) in truth.chunks_mut(512).zip(central.chunks(512)) {
        context.check_cancelled()?;
        let radiance = |central: &Direction| reference.radiance(*central, view).map(|value| value as f32);
        pixels.par_iter_mut().zip(central).for_each(|(pixel, central)| *pixel = radiance(central));
    }
    let shown = |values: &[[f32; 3]]| sphere.picture(&to_srgb8(values, lit.exposure, ToneMap::Filmic));

    let map = |brdf: &BrdfCoefficients| synthesise(&lighting, brdf, settings.resolution);
    let look = |of: &(dyn Fn(Direction) -> [f32; 3] + Sync)| -> Vec<[f32; 3]> {
        central.par_iter().map(|central| of(*central)).collect()
    };
    let full = map(&material.exported)?;
    let plain = map(&with_p(&material.exported, 0))?;
    // Slices of a 3D texture are lat-long images, as dense at the equator as the cubes.
    let rows = LatLong::with_rows(2 * settings.resolution);
    let field = Reflection::convolve(&lighting, &material.exported);
    let kautz = field.synthesise(MapGrid::LatLong(rows), View::Local)?;
    let kautz = KautzMcCool::from_shrm(&kautz, KautzMcCool::even_angles(SLICES))
        .ok_or_else(|| Failure::new("a 3D texture needs at least 2 angles"))?;
    let cabral = Cabral::from_shrm(&full);
    context.check_cancelled()?;

    let mut pictures = Pictures { truth: shown(&truth), exports: Vec::new(), per_p: Vec::new() };
    let n = settings.resolution;
    let faces = format!("6 faces of {n} × {n}");
    let mut exports = Vec::new();
    for method in Method::ALL {
        let (values, texels, texture) = match method {
            Method::ReflectionMap => (look(&|c| plain.radiance(c, view)), 6 * n * n, faces.clone()),
            Method::KautzMccool => {
                let size = format!("{SLICES} angles × {} × {}", rows.width, rows.height);
                (look(&|c| kautz.radiance(c, view)), SLICES * rows.len(), size)
            }
            Method::Cabral => {
                (look(&|c| cabral.radiance(c, view)), 12 * 6 * n * n, format!("12 views × {faces}"))
            }
            Method::Shrm => {
                let terms = full.rows();
                let size =
                    format!("{terms} {} × {faces}", if terms == 1 { "coefficient" } else { "coefficients" });
                (look(&|c| full.radiance(c, view)), terms * 6 * n * n, size)
            }
        };
        let rms = sphere.relative_rms(&values, &truth);
        exports.push(Export { method, rms, bytes: (8 * texels) as u64, texture });
        pictures.exports.push(shown(&values));
    }
    context.check_cancelled()?;

    let captured = Captured::of(&material.high);
    let mut per_p = Vec::new();
    // If nothing changes with the view, every P gives the same picture.
    let mut changes = material.high.energy_lp.chunks_exact(material.high.coefficients.p().get() + 1);
    let most = if changes.any(|row| row[1..].iter().any(|energy| *energy > 0.0)) {
        material.high.coefficients.p().get()
    } else {
        0
    };
    for p in SHOWN_P.into_iter().filter(|p| *p <= most) {
        let cut = map(&with_p(&material.high.coefficients, p))?;
        let values = look(&|c| cut.radiance(c, view));
        let rms = sphere.relative_rms(&values, &truth);
        per_p.push(PerP { p, captured: captured.share(figures.high_f, p), rms });
        pictures.per_p.push(shown(&values));
        context.check_cancelled()?;
    }

    let known = Reflection::convolve(&lighting, &material.high.coefficients);
    let light = image_energy(environment.grid(), environment.pixels());
    let known = shrm::accuracy::Accuracy::of(&known, light, material.high.total);
    let (f, p) = (figures.f, figures.p);
    let shrm = parts(&sphere, &central, &truth, &field, &full);
    let help = if exports.iter().all(|export| export.rms > settings.accept) {
        let estimated = known.at(f, p).truth.sqrt();
        let measure = |f: usize, p: usize| -> Result<f64, Failure> {
            context.check_cancelled()?;
            let cut = map(&with_p(&material.high.coefficients.cut(Degree::new(f)?), p))?;
            Ok(sphere.relative_rms(&look(&|c| cut.radiance(c, view)), &truth))
        };
        Some(help(&known, shrm, estimated, settings, measure)?)
    } else {
        None
    };
    let advice = advise(figures, &exports, &shrm, help.as_ref(), settings.accept);
    let accuracy = curve(known.curve(p));
    let accuracy_per_p = curve((0..=known.p()).map(|p| known.at(f, p)).collect());
    let figures = PairFigures {
        environment: lit.name.clone(),
        material: figures.name.clone(),
        rendered: [grid.width, grid.height],
        exports,
        shrm,
        help,
        per_p,
        accuracy,
        accuracy_per_p,
        advice,
    };
    Ok((figures, pictures))
}

/// The parts of the SHRM's error: over all pixels up to about F = 26, and over a sample of them above that,
/// because high degrees take long to evaluate.
fn parts(
    sphere: &Sphere,
    central: &[Direction],
    truth: &[[f32; 3]],
    field: &Reflection,
    map: &Shrm,
) -> ShrmError {
    let view = Sphere::view();
    let terms = field.brdf().f().get() + 1;
    let samples = (PARTS_WORK / (terms * terms * terms)).max(FEWEST_PARTS);
    let step = central.len().div_ceil(samples);
    let some: Vec<_> = (0..central.len()).step_by(step).filter(|pixel| sphere.sees(*pixel)).collect();
    let values = some.par_iter().map(|&pixel| {
        let exact = field.evaluate(central[pixel], view);
        let texels = map.radiance(central[pixel], view);
        let (mut degrees, mut blur, mut whole) = (0.0, 0.0, 0.0);
        for channel in 0..3 {
            let truth = f64::from(truth[pixel][channel]);
            degrees += (exact[channel] - truth).powi(2);
            blur += (f64::from(texels[channel]) - exact[channel]).powi(2);
            whole += truth * truth;
        }
        [degrees, blur, whole]
    });
    // Summed in the order of pixels, for the same bits on any number of threads.
    let values: Vec<[f64; 3]> = values.collect();
    let [degrees, texels, whole] = [0, 1, 2].map(|i| values.iter().map(|value| value[i]).sum::<f64>());
    let share = |error: f64| if error == 0.0 { 0.0 } else { (error / whole).sqrt() };
    ShrmError { degrees: share(degrees), texels: share(texels) }
}

/// What would bring an SHRM's error below `accept`: more texels if the degrees are high enough, or else the
/// least degrees, P first, that `measure` finds good enough. `estimated` is the error of the current degrees
/// by their energies; its ratio to the measured error guides the search.
fn help(
    known: &shrm::accuracy::Accuracy,
    shrm: ShrmError,
    estimated: f64,
    settings: &Settings,
    mut measure: impl FnMut(usize, usize) -> Result<f64, Failure>,
) -> Result<Help, Failure> {
    let accept = settings.accept;
    if shrm.degrees < 0.9 * accept {
        // The error of bilinear texels falls with the square of their number.
        let left = (accept * accept - shrm.degrees * shrm.degrees).sqrt();
        let texels = settings.resolution as f64 * (shrm.texels / left).sqrt();
        return Ok(Help::Resolution { texels: (texels.ceil() as usize + 1).next_multiple_of(8) });
    }
    let least = |error: f64| {
        let enough = |f: usize, p: usize| known.at(f, p).truth <= error * error;
        let p = (0..=known.p()).find(|p| enough(known.f(), *p))?;
        Some(((0..=known.f()).find(|f| enough(*f, p))?, p))
    };
    let mut error = 0.95 * accept * (estimated / shrm.degrees).clamp(0.1, 10.0);
    let mut tried = None;
    for _ in 0..TRIES {
        let degrees = least(error).unwrap_or((known.f(), known.p()));
        if tried.is_some_and(|(before, _)| before == degrees) {
            error *= 0.7;
            continue;
        }
        let rms = measure(degrees.0, degrees.1)?;
        let (f, p) = degrees;
        if rms <= accept {
            return Ok(Help::Degrees { f, p, rms });
        }
        tried = Some((degrees, rms));
        if degrees == (known.f(), known.p()) {
            break;
        }
        error *= 0.9 * accept / rms;
    }
    let (f, p) = (known.f(), known.p());
    let rms = match tried {
        Some((degrees, rms)) if degrees == (f, p) => rms,
        _ => measure(f, p)?,
    };
    Ok(if rms <= accept { Help::Degrees { f, p, rms } } else { Help::Missed { f, p, rms } })
}

/// Accuracies, 1 - error.
fn curve(estimates: Vec<Estimate>) -> Accuracy {
    let of = |error: fn(&Estimate) -> f64| estimates.iter().map(|estimate| 1.0 - error(estimate)).collect();
    Accuracy {
        truth: of(|e| e.truth),
        brdf: of(|e| e.by_brdf),
        better: of(|e| e.by_min),
        bound: of(|e| e.bound_with_p),
        bound_as_printed: of(|e| e.bound_printed),
    }
}

/// The environment, small enough that all its light can be added up for every pixel: twice as many rows as
/// the degree F of the material, which blurs finer detail.
fn scaled(environment: &Environment, f: usize, most: usize) -> Result<Environment, Failure> {
    let rows = (2 * f + 2).next_multiple_of(16).max(FEWEST_ROWS).min(most);
    if rows >= environment.grid().height {
        return Ok(environment.clone());
    }
    Ok(environment.downsampled(LatLong::with_rows(rows))?)
}

/// A cube map of these coefficients, local.
fn synthesise(lighting: &Expansion, brdf: &BrdfCoefficients, edge: usize) -> Result<Shrm, Failure> {
    let grid = MapGrid::Cube(Cube { edge });
    Ok(Reflection::convolve(lighting, brdf).synthesise(grid, View::Local)?)
}

/// The same coefficients up to a lower degree in the view.
fn with_p(brdf: &BrdfCoefficients, p: usize) -> BrdfCoefficients {
    let (from, to) = (brdf.p().get(), p.min(brdf.p().get()));
    let degree = Degree::new(to).unwrap_or(brdf.p());
    let mut rho = Vec::with_capacity((brdf.f().get() + 1) * (to + 1) * (to + 1));
    for l in 0..=brdf.f().get() {
        for p in 0..=to {
            rho.extend((0..=to).map(|q| brdf.get(l, p, q)));
        }
    }
    debug_assert!(to <= from);
    BrdfCoefficients::new(brdf.centre(), brdf.f(), degree, rho).unwrap_or_else(|| brdf.clone())
}
