//! Draws a contact sheet: one picture with an environment, its harmonics, and every material under it.
//!
//! ```toml
//! [stage.sheet]
//! kind = "contact-sheet"
//! inputs = { environment = "environment", lighting = "lighting", reflection = "reflection" }
//! path = "{environment}/sheet"
//! ```
//!
//! A sheet shows
//!
//! - the environment as a lat-long picture;
//! - with `lighting` connected: the energy of each degree (bars, on a logarithmic axis) and the sum up to
//!   it (line), both as shares of the environment's energy, and the environment reconstructed from the
//!   degrees up to each of `degrees`, and from all; separate suns and lamps are not included;
//! - for each item at `reflection`: its reflection map, and a ball in front of the environment, seen along
//!   +X. The ball is looked up by the reflection vector, the normal or the tangent, depending on the
//!   material's centre. If the material changes with the view (P > 0), each point of the ball shows the
//!   light that it reflects toward the camera, and the map shows the mean over all views.
//!
//! All pictures have the same exposure and tone curve, so they can be compared. Negative values, which a
//! truncated series has around bright lights, are black; the captions give the minimum, the maximum and the
//! mean.
//!
//! ## Exposure
//!
//! Contact sheets, reports, previews and their window show an environment with the same exposure: its
//! log-average becomes middle grey, 0.18. If a few lights in a dark environment give most of the light,
//! everything under them would be overexposed; then the mean becomes 0.72 instead, two stops above middle
//! grey. `exposure` is relative to that. The sheet says how many stops it used, and which of the two rules.
//!
//! ## Files
//!
//! `.png`: 8-bit sRGB, 1680 pixels wide. By default there is one sheet per environment, over all materials.

use std::f64::consts::PI;

use brdf::Centre;
use containers::write_png;
use engine::{
    Context, DerivedValues, Failure, ItemKey, Kind, Output, Port, Product, Reporter, Steps, parameters,
};
use envmap::{Environment, ToneMap};
use rayon::prelude::*;
use sh::{Degree, Expansion, Synthesis, energy_per_degree, image_energy};
use shrm::{Lamps, MapGrid, Plain, View};
use sphere::{Cube, LatLong};

use super::sheet::{
    BALL, Harmonics, MAP, MaterialPictures, RECONSTRUCTION, Reconstruction, Sheet, described,
};
use crate::map::disk_means;
use crate::values::{ToneMapName, UntilStopped, artifacts, lamps_text};

parameters! {
    /// Parameters of `contact-sheet`.
    pub(crate) struct Parameters {
        /// How many stops brighter than usual the pictures are; see Exposure.
        #[range(-60.0..=60.0)]
        exposure: f64 = 0.0,
        /// The tone curve of exposed radiance: with a film's shoulder, or cut at white.
        curve: ToneMapName = ToneMapName(ToneMap::Filmic),
        /// The degrees up to which the environment is reconstructed. Those above the lighting's degree are
        /// skipped, and the lighting's own is added.
        degrees: Vec<usize> = vec![2, 5, 10, 20],
    }
}

/// The maximum number of `degrees`.
const MAX_DEGREES: usize = 100;

/// The least and the greatest edge of the cube that a ball is looked up in: four texels for each degree.
const BALL_EDGES: [usize; 2] = [32, 160];

/// Past this P a texel has so many coefficients that the edge is at most [`MANY_EDGE`].
const MAX_P_AT_FULL_EDGE: usize = 4;

/// The largest edge of the cube for a P above [`MAX_P_AT_FULL_EDGE`].
const MANY_EDGE: usize = 64;

/// The kind `contact-sheet`.
pub(crate) struct ContactSheet;

impl Kind for ContactSheet {
    type Parameters = Parameters;

    const NAME: &'static str = "contact-sheet";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        envmap::revisions::LAMPS,
        brdf::revisions::MODELS,
        shrm::revisions::MEAN_LOBE,
    ];
    const TEXT: &'static str = include_str!("contact_sheet.rs");
    const SHOWS_KEYS: bool = true;
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Environment>("environment"),
            Port::one::<artifacts::Lighting>("lighting").optional(),
            Port::many::<artifacts::Reflection>("reflection").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".png".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match parameters.degrees.len() {
            ..=MAX_DEGREES => Vec::new(),
            many => vec![("degrees", format!("{many} degrees are more than {MAX_DEGREES}"))],
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = &context.inputs.get::<artifacts::Environment>("environment")?.0;
        let lighting = context.inputs.optional::<artifacts::Lighting>("lighting")?;
        let reflections = context.inputs.many::<artifacts::Reflection>("reflection")?;
        let own = context.key().cloned().unwrap_or_default();

        let usual = environment.exposure();
        let exposure = usual.stops + parameters.exposure;
        let mut facts = vec![described(usual, parameters.exposure)];
        let ToneMapName(tone) = parameters.curve;
        facts.push(match tone {
            ToneMap::Filmic => "filmic curve".into(),
            ToneMap::Plain => "no curve".into(),
        });
        facts.push("the same for all pictures".into());
        let lighting = match &lighting {
            Some(lighting) => {
                facts.push(format!("lighting of degree {}", lighting.0.series.degree().get()));
                let soft = lighting.0.series.get(0, 0).iter().sum::<f64>() * (4.0 * PI).sqrt();
                let lamps = lamps_text(&lighting.0.lights, soft);
                facts.extend(lamps.map(|lamps| format!("{lamps}, kept as lights")));
                Some(harmonics(parameters, environment, &lighting.0, reporter)?)
            }
            None => None,
        };
        reporter.check_cancelled()?;
        // The maps, and the balls.
        let work = Steps::new(reporter, 2);
        let steps = work.part(1, reflections.len());
        let materials = reflections.par_iter().map(|(key, reflection)| {
            let made = material(&own, key, &reflection.0, &context.derived, reporter)?;
            steps.step()?;
            Ok(made)
        });
        let materials = materials.collect::<Result<Vec<_>, Failure>>()?;

        let steps = work.part(1, materials.len() * BALL);
        let title = if own.is_empty() { "Environment".into() } else { own.to_string() };
        let subtitle = facts.join(" · ");
        let sheet = Sheet { title, subtitle, environment, lighting, materials, exposure, tone };
        let picture = steps.until_stopped(|stop| sheet.draw(stop))?;
        let bytes = write_png(picture.width, picture.height, &picture.pixels, Some(context.recipe()))?;
        Ok(Output::files(vec![bytes]))
    }
}

/// The energies of a lighting's series and its reconstructions: shares of the image, without its lamps if
/// they are beside the series.
fn harmonics(
    parameters: &Parameters,
    environment: &Environment,
    lighting: &sh::Lighting,
    reporter: &Reporter,
) -> Result<Harmonics, Failure> {
    let (beside, lighting) = (!lighting.lights.is_empty(), &lighting.series);
    let energies: Vec<f64> = energy_per_degree(lighting).iter().map(|rgb| rgb.iter().sum()).collect();
    let image = if beside {
        energy(&reporter.until_stopped(|stop| environment.separate_lamps(stop))?.soft)
    } else {
        energy(environment)
    };
    // A black environment has no shares: nothing is missing.
    let total = if image > 0.0 { image } else { 1.0 };
    let energies: Vec<f64> = energies.iter().map(|energy| energy / total).collect();

    let highest = lighting.degree();
    let lower = parameters.degrees.iter().filter_map(|degree| Degree::new(*degree).ok());
    let mut degrees: Vec<Degree> = lower.filter(|degree| *degree < highest).chain([highest]).collect();
    degrees.sort_unstable();
    degrees.dedup();
    let reconstructions = degrees.par_iter().map(|degree| {
        let captured: f64 = energies[..=degree.get()].iter().sum();
        let map = shown(&lighting.to_degree(*degree), RECONSTRUCTION)?;
        // Rounding may hold a little more than all.
        Ok(Reconstruction { degree: degree.get(), captured: captured.min(1.0), map })
    });
    Ok(Harmonics { reconstructions: reconstructions.collect::<Result<_, Failure>>()?, energies })
}

/// The integral of the squared radiance over the sphere, all channels together.
fn energy(environment: &Environment) -> f64 {
    image_energy(environment.grid(), environment.pixels()).iter().sum()
}

/// A material's map and its labels.
fn material(
    own: &ItemKey,
    key: &ItemKey,
    reflection: &shrm::Reflection,
    derived: &DerivedValues<'_>,
    reporter: &Reporter,
) -> Result<MaterialPictures, Failure> {
    let name = name(own, key);
    let brdf = reflection.brdf();
    let (f, p) = (brdf.f(), brdf.p().get());
    let about = match brdf.centre() {
        Centre::Reflection => "reflection vector",
        Centre::Normal => "normal",
        Centre::Tangent => "tangent",
    };
    let detail = format!("F {} · P {p} · by the {about}", f.get());
    let most = if p > MAX_P_AT_FULL_EDGE { MANY_EDGE } else { BALL_EDGES[1] };
    let grid = MapGrid::Cube(Cube { edge: (4 * f.get()).clamp(BALL_EDGES[0], most) });
    let field = reporter.until_stopped(|stop| {
        let field = reflection.synthesise(grid, View::Local, stop);
        field.map_err(|error| Failure::from(error).context(name.clone()))
    })?;
    let mut map = shown(&reflection.plain(Plain::Mean), MAP)?;
    if let Some(lamps) = reflection.lamps() {
        map = lit(&map, lamps, derived)?;
    }
    Ok(MaterialPictures { name, detail, field, lamps: reflection.lamps().cloned(), map })
}

/// The name by which an item differs from others on a sheet: the stems of the keys that are not the sheet's
/// own. If there are several, each has its stage.
fn name(own: &ItemKey, key: &ItemKey) -> String {
    let rest: Vec<_> = key.iter().filter(|(stage, _)| own.get(stage).is_none()).collect();
    match rest.as_slice() {
        [] => "Reflection".into(),
        [(_, stem)] => (*stem).to_owned(),
        several => {
            several.iter().map(|(stage, stem)| format!("{stage} {stem}")).collect::<Vec<_>>().join(" · ")
        }
    }
}

/// A map of the mean over views with the lamps beside it.
fn lit(map: &Environment, lamps: &Lamps, derived: &DerivedValues<'_>) -> Result<Environment, Failure> {
    let disks = disk_means(&lamps.lights, derived);
    let lamps = lamps.plain_over(Plain::Mean, MapGrid::LatLong(map.grid()), &disks);
    let pixels = map.pixels().iter().zip(lamps);
    let pixels =
        pixels.map(|(soft, lamps)| std::array::from_fn(|channel| soft[channel] + lamps[channel])).collect();
    Environment::new(map.grid(), pixels).ok_or_else(|| Failure::new("a map has values above the largest f32"))
}

/// A function at the texels of a grid, or of a whole multiple of it if the degree needs more rows.
fn shown(function: &Expansion, grid: LatLong) -> Result<Environment, Failure> {
    let grid = LatLong::with_rows(grid.height * (function.degree().get() / grid.height + 1));
    let pixels = Synthesis::new(grid, function.degree())?.synthesise(function);
    Environment::new(grid, pixels).ok_or_else(|| {
        Failure::new("a map has values above the largest f32")
            .help("import the environment with a lower exposure")
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brdf::{Choice, Lambert, Phong, project};
    use engine::{Artifact, Digest, Handle};
    use sh::{Stop, Transform};

    use super::*;
    use crate::testkit::NoFiles;

    const DEFAULTS: Parameters =
        Parameters { exposure: 0.0, curve: ToneMapName(ToneMap::Filmic), degrees: Vec::new() };

    fn key(pairs: &[(&str, &str)]) -> ItemKey {
        pairs.iter().copied().collect()
    }

    fn handle<T: Artifact>(value: T) -> Arc<Handle> {
        let handle = Handle::new(T::TYPE, Digest::of(b""), || Err(Failure::new("only in memory")));
        Arc::new(handle.with_value(Arc::new(value)))
    }

    /// A sky that is brighter toward +Z, with a sun of one texel.
    fn sky() -> Environment {
        let grid = LatLong::with_rows(32);
        let mut pixels: Vec<[f32; 3]> =
            (0..grid.len()).map(|i| [0.4, 0.5, 0.9 - i as f32 / (2 * grid.len()) as f32]).collect();
        pixels[8 * grid.width + 20] = [500.0, 450.0, 400.0];
        Environment::new(grid, pixels).unwrap()
    }

    fn lighting(environment: &Environment, degree: usize) -> Expansion {
        let transform = Transform::new(environment.grid(), Degree::new(degree).unwrap()).unwrap();
        transform.analyse(environment.pixels())
    }

    fn reflection(lighting: &Expansion, index: usize) -> shrm::Reflection {
        let material = if index == 0 {
            brdf::Material::Lambert(Lambert::new([0.8; 3]).unwrap())
        } else {
            brdf::Material::Phong(Phong::new(16.0 * index as f64, [0.9; 3]).unwrap())
        };
        let choice = Choice::Degree { f: lighting.degree(), p: Degree::ZERO };
        shrm::Reflection::convolve(lighting, &project(&material, choice, Stop::NEVER).unwrap().coefficients)
    }

    /// The sheet of `sky` with materials of these names.
    fn sheet(parameters: &Parameters, names: &[&str]) -> Vec<u8> {
        let environment = sky();
        let lighting = lighting(&environment, 12);
        let reflections = names.iter().enumerate().map(|(index, name)| {
            let key = key(&[("environment", "sky"), ("material", name)]);
            (key, handle(artifacts::Reflection(reflection(&lighting, index))))
        });
        let reflections = reflections.collect();
        let own = key(&[("environment", "sky")]);
        let context = Context::new(&NoFiles)
            .with_key(own.clone())
            .with_recipe(r#"{"kind":"contact-sheet"}"#.into())
            .with_input("environment", vec![(own.clone(), handle(artifacts::Environment(environment)))])
            .with_input("lighting", vec![(own, handle(artifacts::Lighting(lighting.into())))])
            .with_input("reflection", reflections);
        let Output::Files(mut files) = ContactSheet::run(parameters, &context).unwrap() else {
            panic!("a sheet is a file")
        };
        files.remove(0).unwrap()
    }

    #[test]
    fn a_sheet_is_a_png_with_its_recipe() {
        let bytes = sheet(&DEFAULTS, &["chalk", "gold"]);
        assert_eq!(containers::read_recipe(&bytes).as_deref(), Some(r#"{"kind":"contact-sheet"}"#));
        let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
        assert_eq!(image.width(), 1680);
        assert_eq!(sheet(&DEFAULTS, &["chalk", "gold"]), bytes);
    }

    #[test]
    fn names_are_part_of_the_picture() {
        assert_ne!(sheet(&DEFAULTS, &["chalk"]), sheet(&DEFAULTS, &["Kreide_für_素材"]));
    }

    #[test]
    fn without_materials_and_lighting_the_environment_is_shown() {
        let context = Context::new(&NoFiles)
            .with_input("environment", vec![(ItemKey::default(), handle(artifacts::Environment(sky())))]);
        assert!(ContactSheet::run(&DEFAULTS, &context).is_ok());
    }

    #[test]
    fn energies_are_shares_of_the_image() {
        let environment = sky();
        let lighting = lighting(&environment, 12);
        let parameters = Parameters { degrees: vec![10, 2, 2, 40], ..DEFAULTS };
        let reporter = Reporter::default();
        let shown = harmonics(&parameters, &environment, &lighting.clone().into(), &reporter).unwrap();
        let degrees: Vec<_> = shown.reconstructions.iter().map(|shown| shown.degree).collect();
        assert_eq!(degrees, [2, 10, 12]);
        // Parseval: the image's energy is the expansion's and that of what is left.
        let transform = Transform::new(environment.grid(), lighting.degree()).unwrap();
        let fitted: Vec<[f64; 3]> = transform.synthesise(&lighting);
        let left: Vec<[f32; 3]> = environment
            .pixels()
            .iter()
            .zip(&fitted)
            .map(|(pixel, fitted)| std::array::from_fn(|c| (f64::from(pixel[c]) - fitted[c]) as f32))
            .collect();
        let left = Environment::new(environment.grid(), left).unwrap();
        let captured = shown.reconstructions.last().unwrap().captured;
        // The rule is exact to degree 31, and 2 x 12 is below it; what is left is rounded to f32.
        let expected = 1.0 - energy(&left) / energy(&environment);
        assert!((captured - expected).abs() < 1e-6, "{captured}, not {expected}");
        assert!((shown.energies.iter().sum::<f64>() - captured).abs() < 1e-12);
    }

    #[test]
    fn the_exposure_is_relative_to_the_usual_one() {
        let grid = LatLong::with_rows(16);
        let even = Environment::new(grid, vec![[0.09; 3]; grid.len()]).unwrap().exposure();
        assert_eq!(described(even, 0.0), "exposure +1.0 stops from the log-average");
        assert_eq!(
            described(even, -2.0),
            "exposure −1.0 stops from the log-average, −2.0 stops of them as given"
        );
    }

    #[test]
    fn items_are_named_by_what_distinguishes_them() {
        let own = key(&[("environment", "sky")]);
        assert_eq!(name(&own, &key(&[("environment", "sky"), ("material", "gold")])), "gold");
        assert_eq!(name(&own, &own), "Reflection");
        let several = key(&[("material", "gold"), ("finish", "rough")]);
        assert_eq!(name(&own, &several), "finish rough · material gold");
    }

    #[test]
    fn too_many_degrees_are_an_error() {
        assert!(ContactSheet::check(&DEFAULTS).is_empty());
        let wild = Parameters { degrees: vec![1; 101], ..DEFAULTS };
        let errors = ContactSheet::check(&wild);
        assert_eq!(errors.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["degrees"]);
    }
}
