//! Writes a report on which export to use for which material, as one web page with pictures and numbers.
//!
//! The page begins with a table: for each material under each environment the advised export (a plain
//! reflection map, Kautz-McCool's 3D texture, Cabral's view maps, or a spherical harmonic reflection map),
//! its error, its size and the reason. Below it are
//!
//! - the degrees F and P that each material needs, and the share of its energy that each P holds;
//! - for each pair, a sphere with every export and the ground truth, which adds up all light for each pixel
//!   (brute force), with pictures of the differences and the relative RMS error;
//! - the accuracy against F: measured, and by three estimates that need no picture (the BRDF's energy, the
//!   better of BRDF and lighting, and a guaranteed bound);
//! - the same sphere with more and fewer degrees in the view;
//! - the size of each export.
//!
//! The report advises the smallest export with an error of at most `accept`. If there is none, it names the
//! smallest of those that come closest, and what would help: the least degrees, P first, with which an SHRM
//! is good enough on that sphere, or more texels. The page says how much of the SHRM's error comes from its
//! degrees, and how much from its texels.
//!
//! A tolerance is a share of energy, the square of an error: a `tolerance` of 0.03 is an RMS error of 17 %
//! under one small lamp, and less under soft light. For an error of 5 % use the degrees that the page
//! suggests; a tolerance of 0.0025 needs more than most light requires.
//!
//! ## What is compared
//!
//! Connect `environment` and `material`. Their degrees come from `tolerance` or `degree`, as in
//! `project-brdf`. If `brdf` is connected, the report shows the coefficients that your graph exports; there
//! must be one for each material. The lighting is that of each environment: a turn, a window or a lower
//! degree upstream of your exports is not part of the report. Set `resolution` to that of your exports.
//!
//! Brute force is slow, so the environments are scaled to twice as many rows as the degree F, at least 32 and
//! at most `reference-rows`. All exports on the page are made from the same scaled environment, so scaling
//! does not add to the errors. The page says the size. On two cores a pair takes about a second, and up to
//! ten with a measured material of high degrees; fewer `reference-rows` or a smaller `sphere` save time.
//!
//! ## Files
//!
//! `.json`: all figures, for scripts; `.html`: the page, which needs no other file. By default there is one
//! report on everything; `per = ["environment"]` makes one for each environment.
//!
//! ## Example
//!
//! ```toml
//! [stage.report]
//! kind = "report"
//! inputs = { environment = "environment", material = "material", brdf = "coefficients" }
//! path = "report"
//! ```

mod advice;
mod figures;
mod page;
mod picture;
mod plot;
mod sphere;
mod study;

use brdf::Choice;
use engine::{Context, Failure, ItemKey, Kind, Output, Port, Product, parameters};
use rayon::prelude::*;
use serde_json::value::RawValue;
use sh::Tolerance;

use crate::artifacts;
use crate::choices::SHARE;
use crate::contact_sheet::exposure_of;
use crate::degree_pair::DegreePair;
use crate::sheet::percent;
use figures::{MaterialFigures, PairFigures, Report, Settings};
use study::{Exported, ExposedEnvironment};

parameters! {
    /// Parameters of `report`.
    pub(crate) struct Parameters {
        /// The highest relative RMS error of an export that is good enough.
        #[range(SHARE)]
        accept: f64 = 0.05,
        /// The degrees [F, P] of every material. Default: those that meet the tolerance.
        degree: Option<DegreePair> = None,
        /// The share of a material's energy that may be lost. Default, if there is no degree either: 0.03.
        #[range(SHARE)]
        tolerance: Option<f64> = None,
        /// Texels along the edge of a cube's face, for the exports that are compared.
        #[range(4..=512)]
        resolution: usize = 64,
        /// Pixels along the edge of a picture of a sphere.
        #[range(32..=256)]
        sphere: usize = 96,
        /// The maximum number of rows of an environment for brute force.
        #[range(32..=512)]
        reference_rows: usize = 96,
        /// The factor by which the second row of differences is amplified.
        #[range(1.0..=100.0)]
        amplify: f64 = 8.0,
    }
}

impl Parameters {
    fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(0.03)
    }
}

/// The kind `report`.
pub(crate) struct ReportKind;

impl Kind for ReportKind {
    type Parameters = Parameters;

    const NAME: &'static str = "report";
    const REVISION: u32 = 4;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        brdf::revisions::MODELS,
        brdf::revisions::PROJECTION,
        shrm::revisions::SYNTHESIS,
        shrm::revisions::REFERENCE,
        envmap::revisions::RESAMPLING,
    ];
    const TEXT: &'static str = include_str!("report.rs");
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::many::<artifacts::Environment>("environment"),
            Port::many::<artifacts::Material>("material"),
            Port::many::<artifacts::Brdf>("brdf").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".json".into(), ".html".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match (parameters.tolerance, parameters.degree) {
            (Some(_), Some(_)) => vec![("tolerance", "degree already sets the degrees".into())],
            _ => Vec::new(),
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let own = context.key().cloned().unwrap_or_default();
        let environments = context.many::<artifacts::Environment>("environment")?;
        let materials = context.many::<artifacts::Material>("material")?;
        let coefficients = context.many::<artifacts::Brdf>("brdf")?;

        let settings = Settings {
            accept: parameters.accept,
            resolution: parameters.resolution,
            sphere: parameters.sphere,
            reference_rows: parameters.reference_rows,
            amplify: parameters.amplify,
        };
        let materials = materials.iter().map(|(key, material)| {
            context.check_cancelled()?;
            let name = name(key, "material");
            let exported = match coefficients.iter().find(|(other, _)| holds(other, key)) {
                Some((_, coefficients)) => Exported::Made(&coefficients.coefficients),
                None if coefficients.is_empty() => choice(parameters)?,
                None => {
                    return Err(Failure::new(format!(
                        "{name}: the port brdf receives no coefficients of this material"
                    ))
                    .help("connect a project-brdf of the same materials, or leave brdf unconnected"));
                }
            };
            study::material(name.clone(), &material.0, exported).map_err(|failure| failure.context(name))
        });
        let materials = materials.collect::<Result<Vec<_>, Failure>>()?;
        let environments: Vec<_> = environments
            .iter()
            .map(|(key, environment)| ExposedEnvironment {
                name: name(key, "environment"),
                environment: &environment.0,
                exposure: exposure_of(&environment.0).0,
            })
            .collect();
        let pairs: Vec<_> = materials
            .iter()
            .flat_map(|material| environments.iter().map(move |environment| (material, environment)))
            .collect();
        let measured = pairs
            .par_iter()
            .map(|(material, environment)| study::pair(environment, material, &settings, context));
        let (figures, pictures): (Vec<PairFigures>, Vec<_>) =
            measured.collect::<Result<Vec<_>, Failure>>()?.into_iter().unzip();
        context.check_cancelled()?;

        let materials = materials.into_iter().map(|material| {
            let own: Vec<_> = figures.iter().filter(|pair| pair.material == material.figures.name).collect();
            let verdict = advice::verdict(&material.figures, &own, parameters.accept);
            MaterialFigures { verdict, ..material.figures }
        });
        let materials = materials.collect();
        let specula = RawValue::from_string(context.recipe().to_owned())?;
        let report = Report { schema: 1, specula, settings, materials, pairs: figures };
        let good = report.pairs.iter().filter(|pair| pair.advice.good).count();
        context.note(format!(
            "{good} of {} pairs have an export with an error of at most {}",
            report.pairs.len(),
            percent(parameters.accept)
        ));
        let title = if own.is_empty() { "Reflections".to_owned() } else { own.to_string() };
        let page = page::page(&title, &report, &pictures, context.recipe())?;
        let mut json = serde_json::to_vec_pretty(&report)?;
        json.push(b'\n');
        Ok(Output::Files(vec![json, page.into_bytes()]))
    }
}

/// How the degrees are chosen if no coefficients are connected.
fn choice(parameters: &Parameters) -> Result<Exported<'static>, Failure> {
    Ok(match parameters.degree {
        Some(DegreePair { f, p }) => Exported::Choose(Choice::Degree { f, p }, "given by `degree`".into()),
        None => {
            let share = parameters.tolerance();
            let reason = format!("the lowest that lose at most {} of the energy", percent(share));
            Exported::Choose(Choice::Tolerance(Tolerance::new(share)?), reason)
        }
    })
}

/// Whether a key names everything that another one does.
fn holds(key: &ItemKey, part: &ItemKey) -> bool {
    part.iter().all(|(stage, stem)| key.get(stage) == Some(stem))
}

/// An item's name on the page: the stems of its key.
fn name(key: &ItemKey, otherwise: &str) -> String {
    if key.is_empty() {
        return otherwise.to_owned();
    }
    key.stems().collect::<Vec<_>>().join(" · ")
}
