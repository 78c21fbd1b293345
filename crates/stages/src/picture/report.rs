//! Writes a report on which export to use for which material, as one web page with pictures and numbers.
//!
//! ```toml
//! [stage.report]
//! kind = "report"
//! inputs = { environment = "environment", material = "material", reflection = "reflection", shrm = "shrm" }
//! path = "report"
//! ```
//!
//! The page begins with a sentence for each material: the export (a plain reflection map, Kautz-McCool's 3D
//! texture, Cabral's view maps, or a spherical harmonic reflection map) that serves under all environments,
//! its size, and its error under the worst of them; the reason is folded below. A table has a line for each
//! pair of a material and an environment. Below it are, for each pair, a sphere with every export and the
//! ground truth, with pictures of the differences, and all figures of each export.
//!
//! ## Errors
//!
//! Errors are in stops, factors of two, because the eye compares: |log2((value + e) / (truth + e))| for each
//! pixel and channel of the sphere, e being 1 % of the environment's mean radiance, so that black is black.
//! The report shows within how many stops 95 % and 99 % of these samples are, and the share of negative
//! samples (below -e / 10), which renderers show as black. An export is good if the first is at most `accept`
//! and the second at most 10 / 3 of it: 0.15 and 0.5 stops by default. The relative RMS error is shown too,
//! but the brightest pixels decide it: a picture with rings everywhere can have 5 %.
//!
//! The figures are statistics: not every pixel is measured, but every second, fourth, ... of them, and twice
//! as many until the standard error of the first figure is at most 2 % of it, or of `accept` if that is
//! larger, and the second is known as well or surely within its limit, or beyond it. An SHRM with lamps in
//! it is measured at as many pixels as two seconds of work allow. The JSON file has the standard errors.
//! Pixels that were not measured are shown as means of those around them, and a picture with fewer measured
//! pixels than the others is smaller.
//!
//! The ground truth adds up all light for each pixel by the material's own BRDF, to about 0.01 stops. Where
//! the reflection is smooth, blocks of texels are added as one; no sun is blurred or moved.
//!
//! A sphere of a material that depends on its tangent, such as brushed metal, is brushed along +Z, projected
//! into the surface. Taps know that direction. The other exports do not, and their errors say what that
//! costs. What reflects in a cone about the tangent, as kajiya-kay does, is looked up by it; its taps are
//! those of the mean over all turns.
//!
//! ## Advice
//!
//! Advised is the smallest export that is good under every environment. If there is none, it is the one whose
//! error under its worst environment is the least, and the page names that environment and the errors there.
//!
//! Where no export is good, or the cut at given degrees shows, the report measures SHRMs that might help:
//! without given degrees, of a higher P (`accept` and `most-p` of `export-shrm`), of twice the resolution,
//! and of the highest degrees. It names what was good, or says what all of it reached.
//!
//! In light with suns or lamps an SHRM has two forms: with all light in the map, and with `lamps =
//! "separate"`, where the file lists them as lights. The second is smaller and more exact, and is advised
//! for renderers that can evaluate the material's BRDF; the advice then also names the best export for the
//! others.
//!
//! A material with a matte base under a highlight also has a plain map of each part, the way engines look
//! them up: see Two maps in `export-reflection-map`.
//!
//! ## The trade
//!
//! For each pair, two charts show the error of 95 % of the samples against the bytes of the maps and against
//! the look-ups of a pixel, as figure 7 of Ramamoorthi and Hanrahan (2002): plain map, split sum,
//! Kautz-McCool, Cabral, an SHRM of P = 0, 1, 2, 3, 4, 6, 8 and 16, 4, 8 and 16 principal components
//! (`form = "components"` of `export-shrm`), and 1, 2, 3, 4, 6 and 8 taps (of brushed metal 4 and 8) with 0,
//! 4, 8 and all lights beside them. A table has the numbers. The split sum is what engines do: the light as
//! the lobe that is seen head on blurs it, times the directional albedo toward the view.
//!
//! Bytes are those of the exports at `resolution`; taps and components have that of their kinds by default.
//! An SHRM is one map here, also of a material with two parts.
//! Taps and the split sum need their bytes once for an environment, the others once for each pair. A bilinear
//! look-up counts once for each layer or level: 2 for each tap, (P + 1)^2 for an SHRM, or P + 1 if nothing
//! changes around the central direction. Small tables that stay in the cache are not counted.
//!
//! A line of advice names the cheapest taps and lights, at 20 operations for a tap and 35 for a light, whose
//! errors are at most 0.1 and 0.25 stops, or the best. In the JSON file each of `pairs` has `trade`: `series`
//! with `technique`, `lights` and `points`, of which each has `degree`, the errors, `bytes`, `fetches` and
//! `one_of`, and `advice`. SHRMs with lamps in them are measured at fewer pixels, as `one_of` says. `trade =
//! false` leaves all of it out, and saves about a quarter of the time.
//!
//! ## BRDF tables
//!
//! `sections = ["tables"]` writes another part of the page, on tables of `tabulate-brdf` (`["maps",
//! "tables"]` writes both): which degree a material needs under each environment. A row for each material
//! shows a sphere whose light and table have 9, 25, 49 and 225 coefficients (degrees 2, 4, 6 and 14), 225
//! under a Hanning window, and brute force, as figure 6 of Kautz, Sloan and Snyder (2002). Above them is the
//! light at that degree. The sphere is brushed along +Z, projected into the surface; no maps are involved, so
//! `reflection` is not used, and an anisotropic material keeps its direction.
//!
//! Below the spheres is the relative RMS error, to which brute force and the table's map of views add up to
//! 0.7 % of their own; the errors of all degrees are in the JSON file. Advised is the least degree whose
//! error is at most `table-error`; where there is none, the light is too sharp for a table: its suns and
//! lamps ring. A second table has the share of the material's energy, of rho_hat over all views within 75
//! degrees of the normal, that the degrees up to each hold. It needs no light, and says how the series of the
//! material itself ends. A material takes some seconds; one of `poulin-fournier`, or one that was measured
//! with its direction, some minutes.
//!
//! ## Sampling
//!
//! `sections = ["sampling"]` adds the noise of renderers that follow rays. An estimate is the mean of light
//! times material over a density of directions, at 16 surfaces that face all ways. Directions follow the
//! light, the material, both (half of the samples each, in the balance heuristic), or their product; they are
//! made of random points or of stratified ones, the Sobol (0, 2)-sequence in Owen's scrambling. The figure is
//! the relative RMS error of 8 estimates at each surface, of 4 to 256 samples, compared with the sum over all
//! texels.
//!
//! ## Light rigs
//!
//! `sections = ["rigs"]` adds what is lost if the lights of `sample-light` shine in place of an environment:
//! spheres under 1 to 256 directional lights, and their relative RMS errors compared with brute force.
//!
//! ## Degrees
//!
//! `sections = ["degrees"]` shows what degrees F and P lose, as section 5.1 of Ramamoorthi and Hanrahan
//! (2002): shares of energy, which is the integral of the square of light, of rho_hat or of reflected light.
//!
//! - A chart of the share that F = 30 and P = 0 to 5 hold of each material's energy, as their figure 8.
//! - For each environment, spheres of every material under light that is blurred more and more, by a Hanning
//!   window of degree 64 to 2, as their figure 5. A ring marks those that look like the sphere under the
//!   light itself, within `accept`. If the series has no lamps, the blurred light still has them.
//! - For each pair, charts of the energy that a truncation keeps, against F at the highest P and against P
//!   at the highest F, as their figure 6: of the light alone, of the material alone, the lesser of both,
//!   the bound of their appendix B as it is printed and the bound that holds, and the truth. Lines mark the
//!   tolerance, the degrees of the reflection, and those that the paper's rule takes: the least P, then the
//!   least F, with which the material alone loses at most `energy-tolerance`. A table has both truncations.
//! - Spheres of the reflection at P = 0, 1, 2, 3 and its own, with their differences from brute force, as
//!   their figure 7.
//!
//! The truth is not made of coefficients: at 2048 pairs of a central direction and a view, brute force is
//! compared with the truncated series. It is known to some percent of itself, and losses below 0.001 % are
//! not resolved. A bound at or above the truth is safe; the lesser share often is, but need not be. Light
//! has no P: of what P cuts, the lesser share is that of the material. If lamps are beside the series, they
//! are not truncated, and the light is that without them; `degree` puts them into the series, as the paper
//! has them.
//!
//! The JSON file has `degrees`: `materials`, and `pairs` with `by_f`, `by_p`, `chosen` and `rule`. Each
//! truncation has what is lost by `light`, `material`, `min`, `printed`, `bound`, `product` (of the
//! coefficients) and `truth`.
//!
//! ## Light probes
//!
//! ```toml
//! [stage.probe-report]
//! kind = "report"
//! inputs = { places = "places", scene = "scene" }
//! path = "probes"
//! ```
//!
//! `places` of `place-probes` adds a picture of the probes from above and one from a side: circles stand
//! where the grid has them, diamonds were moved, squares are filled from neighbours, and crosses found
//! nothing. The worst are drawn last, over those that are behind or in front of them. With `scene`, the one
//! that the probes were placed in, surfaces that are seen edge-on are lines, as walls are from above. Leaks
//! are lines, too: at 2,000 points, spread evenly over the surfaces, from a point to the probe that gives it
//! most light in three.js without seeing it. A table has the mean share of such light by weight, and the
//! worst, in three.js, in Bevy, and blended by visibility. `probes` in the JSON file has all repaired probes,
//! with the node and the material that they were inside of. Environments and materials are optional then.
//!
//! ## What is compared
//!
//! Connect the stages that export the maps, so that sizes are those of your files: `taps` to an
//! `export-taps`, `reflection-map`, `kautz-mccool` and `cabral` to the exports of these names, `shrm` to an
//! `export-shrm`, and `shrm-separate` to a second one that has the other word for `lamps`. The report then
//! runs after them, and again if a size or a parameter changes. What is not connected has the size of half
//! floats at `resolution`, marked with ~.
//!
//! An SHRM is measured as its file holds it: with the parameters of the connected stage, which say the degree
//! P, the layout and the resolution. One that is not connected is a cube of `resolution` in KTX2, with the
//! defaults of `export-shrm` for P: the least that its `accept` takes, unless `project-brdf` names degrees.
//!
//! If a material has a matte base under a highlight, its SHRM, Kautz-McCool and Cabral exports are two maps,
//! one of each part, whose light and sizes add up, unless the connected stage has `parts = "together"`. Two
//! files of a stage at `reflection-map` are those of the plain map of each part.
//!
//! Connect `environment` and `material`, which all sections but that of probes need, and `reflection` to what
//! your graph exports: then degrees, windows and lamps are those of your files. There must be one reflection
//! for each pair. If the lighting was turned, connect the environment turned in the same way: `rotate` turns
//! both. Without `reflection` the report makes it as the stages do by default, or at `degree` or to
//! `tolerance`, as in `project-brdf`, with the lamps in the series, as `lamps = "series"` of `project-sh`
//! leaves them. Set `resolution` to that of your exports.
//!
//! ## Files
//!
//! `.json`: all figures, for scripts; `.html`: the page, which needs no other file. By default there is one
//! report on everything; `per = ["environment"]` makes one for each environment.

mod advice;
mod chart;
mod cuts;
mod degree_figures;
mod degree_pictures;
mod degrees;
mod degrees_section;
mod errors;
mod explicit_maps;
mod exported;
mod figures;
mod lit;
mod markup;
mod noise;
mod page;
mod picture;
mod probe_figures;
mod probes_section;
mod readers;
mod reflections;
mod rig_pictures;
mod rigs;
mod rigs_section;
mod sampling_section;
mod shrm_maps;
mod sphere;
mod studied;
mod study;
mod summary_section;
mod tables;
mod tables_section;
mod taps_on_sphere;
mod trade;
mod trade_advice;
mod trade_section;

use std::borrow::Cow;
use std::ops::Bound;

use brdf::{Centre, Choice};
use engine::{
    Context, ExportedFiles, Failure, ItemKey, Kind, Output, Port, Product, Reporter, Steps, choice,
    parameters,
};
use serde_json::value::RawValue;
use sh::Tolerance;

use crate::material::DegreePair;
use crate::picture::report_schema::REPORT_SCHEMA;
use crate::values::{SHARE, artifacts, percent};
use degree_figures::DegreeFigures;
use degrees::{SeriesOf, Truncated};
use exported::Exported;
use figures::{Follows, Limits, MaterialFigures, Method, NOTED, NoisePair, PairFigures, Report, Settings};
use lit::Lit;
use page::PagePictures;
use probes_section::ProbePicture;
use reflections::Reflections;
use studied::Studied;
use study::StudiedReflection;
use trade::{TradePair, Traded};

choice! {
    /// A part of the report.
    pub(crate) enum Section {
        /// Which export of reflection maps to use.
        Maps = "maps",
        /// Which degree of BRDF tables to use.
        Tables = "tables",
        /// The noise of samples that follow light, a material, or their product.
        Sampling = "sampling",
        /// What a few lights in place of an environment lose.
        Rigs = "rigs",
        /// What truncations to degrees F and P lose.
        Degrees = "degrees",
    }
}

parameters! {
    /// Parameters of `report`.
    pub(crate) struct Parameters {
        /// The error in stops within which 95 % of the samples of a good export are; 99 % are within 10 / 3
        /// of it.
        #[range(ACCEPT)]
        accept: f64 = 0.15,
        /// Without `reflection`: the degrees [F, P] of every material. Default: those that `convolve` finds
        /// for each light.
        degree: Option<DegreePair> = None,
        /// Without `reflection`: the share of a material's energy that may be lost.
        #[range(SHARE)]
        tolerance: Option<f64> = None,
        /// Texels along the edge of a cube's face, for the exports that are compared.
        #[range(4..=512)]
        resolution: usize = 64,
        /// Pixels along the edge of a picture of a sphere, of which as many are measured as the figures need.
        #[range(24..=256)]
        sphere: usize = 96,
        /// The factor by which the second row of differences is amplified.
        #[range(1.0..=100.0)]
        amplify: f64 = 8.0,
        /// What the report is about.
        sections: Vec<Section> = vec![Section::Maps],
        /// The relative RMS error of a sphere up to which the degree of a BRDF table is good.
        #[range(ACCEPT)]
        table_error: f64 = 0.02,
        /// The share of a material's energy that the paper's rule may lose; see Degrees. Default:
        /// `tolerance`, or 0.03.
        #[range(SHARE)]
        energy_tolerance: Option<f64> = None,
        /// Whether the errors of all techniques against their bytes and look-ups are measured, too; see The
        /// trade.
        trade: bool = true,
    }
}

/// The share of a material's energy that the paper's rule may lose: that of [RH02, fig. 7].
const ENERGY_TOLERANCE: f64 = 0.03;

/// The range of the errors in stops that may be accepted.
const ACCEPT: (Bound<f64>, Bound<f64>) = (Bound::Excluded(0.0), Bound::Included(3.0));

impl Parameters {
    /// The degrees, if they are given.
    fn choice(&self) -> Result<Option<Choice>, Failure> {
        Ok(match (self.degree, self.tolerance) {
            (Some(DegreePair { f, p }), _) => Some(Choice::Degree { f, p }),
            (None, Some(tolerance)) => Some(Choice::Tolerance(Tolerance::new(tolerance)?)),
            (None, None) => None,
        })
    }
}

/// The kind `report`.
pub(crate) struct ReportKind;

impl Kind for ReportKind {
    type Parameters = Parameters;

    const NAME: &'static str = "report";
    const REVISION: u32 = 11;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        sh::revisions::ROTATION,
        brdf::revisions::MODELS,
        brdf::revisions::PROJECTION,
        brdf::revisions::TABLE,
        transfer::revisions::SHADING,
        shrm::revisions::SYNTHESIS,
        shrm::revisions::MEAN_LOBE,
        taps::revisions::SCALE_SPACE,
        taps::revisions::FIT,
        shrm::revisions::DEGREES,
        shrm::revisions::BAKING,
        shrm::revisions::REFERENCE,
        shrm::revisions::COMPONENTS,
        shrm::revisions::TRUNCATION,
        envmap::revisions::RESAMPLING,
        envmap::revisions::LAMPS,
        sampling::revisions::RIG,
        probes::revisions::BLEND,
        probes::revisions::LEAKS,
    ];
    const TEXT: &'static str = include_str!("report.rs");
    const SHOWS_KEYS: bool = true;
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        let exports = Method::ALL.into_iter().filter_map(Method::port);
        [
            Port::many::<artifacts::Environment>("environment").optional(),
            Port::many::<artifacts::Material>("material").optional(),
            Port::many::<artifacts::Reflection>("reflection").optional(),
            Port::one::<artifacts::ProbePlaces>("places").optional(),
            Port::one::<artifacts::Scene>("scene").optional(),
        ]
        .into_iter()
        .chain(exports.map(|name| Port::many::<ExportedFiles>(name).optional()))
        .collect()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".json".into(), ".html".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.tolerance.is_some() && parameters.degree.is_some() {
            errors.push(("tolerance", "degree already sets the degrees".into()));
        }
        if parameters.sections.is_empty() {
            errors.push((
                "sections",
                "the list is empty; name \"maps\", \"tables\", \"sampling\", \"rigs\" or \"degrees\"".into(),
            ));
        }
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let has = |port: &str| types.iter().any(|(own, _)| *own == port);
        let mut errors = Vec::new();
        for port in ["environment", "material"] {
            let is_used = !has("places") || parameters.sections != [Section::Maps] || has(other(port));
            if !has(port) && is_used {
                errors.push(("sections", format!("need the port {port}; of probes alone, connect `places`")));
            }
        }
        if has("scene") && !has("places") {
            errors.push(("sections", "without `places` there are no probes to show in the `scene`".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let own = context.key().cloned().unwrap_or_default();
        let environments = context.inputs.many::<artifacts::Environment>("environment")?;
        let materials = context.inputs.many::<artifacts::Material>("material")?;
        let reflections =
            Reflections { all: context.inputs.many("reflection")?, choice: parameters.choice()? };
        if !reflections.all.is_empty() && reflections.choice.is_some() {
            return Err(Failure::new("`degree` and `tolerance` have no effect on a connected reflection")
                .help("leave them out, or leave the port reflection unconnected"));
        }
        let exported = Exported::of(&context.inputs)?;
        let settings = Settings {
            limits: Limits::new(parameters.accept),
            resolution: parameters.resolution,
            sphere: parameters.sphere,
            amplify: parameters.amplify,
            table_error: parameters.table_error,
        };
        let has = |section| parameters.sections.contains(&section);
        let lit = environments.iter().map(|(key, environment)| {
            let exposure = environment.0.exposure().stops;
            let name = name(key, "environment");
            (key, Lit::new(name, &environment.0, exposure))
        });
        let lit: Vec<_> = lit.collect();

        // One pair after another: each uses all threads.
        let count = materials.len() * lit.len();
        let sections = [Section::Maps, Section::Tables, Section::Sampling, Section::Rigs, Section::Degrees];
        let trades = has(Section::Maps) && parameters.trade;
        let parts = sections.into_iter().filter(|section| has(*section)).count() + usize::from(trades);
        let steps = Steps::new(reporter, count * parts);
        let mut pictures = PagePictures::default();
        let (mut pairs, mut figures): (Vec<PairFigures>, Vec<_>) = Default::default();
        let mut degrees = DegreeFigures::default();
        let series: Vec<_> = lit.iter().map(|_| SeriesOf::default()).collect();
        let tolerance = parameters.energy_tolerance.or(parameters.tolerance).unwrap_or(ENERGY_TOLERANCE);
        let reflects = has(Section::Maps) || has(Section::Degrees);
        for (key, material) in materials.iter().filter(|_| reflects) {
            let own = Cow::Borrowed(&material.0);
            let studied = Studied::new(name(key, "material"), own, context.derived);
            let first = pairs.len();
            if has(Section::Degrees) {
                degrees.materials.push(degrees::captured(&studied, reporter)?);
            }
            let traded = match trades {
                true => Some(Traded::new(&studied, reporter)?),
                false => None,
            };
            for ((environment_key, lit), series) in lit.iter().zip(&series) {
                reporter.check_cancelled()?;
                let made = reflections.of(lit, environment_key, &studied, key, reporter)?;
                let of_pair =
                    |failure: Failure| failure.context(format!("{} under {}", studied.name, lit.name));
                if has(Section::Degrees) {
                    let (material, reflection, settings) = (&studied, &made, &settings);
                    let of = Truncated { lit, series, material, reflection, tolerance, settings };
                    let (found, shown) = of.measure(&steps).map_err(of_pair)?;
                    degrees.pairs.push(found);
                    pictures.degrees.pairs.push(shown);
                }
                if !has(Section::Maps) {
                    continue;
                }
                let is_default = reflections.all.is_empty() && reflections.choice.is_none();
                let files = exported.files(environment_key, key);
                let made = StudiedReflection { reflection: &made, is_default, files };
                let found = study::pair(lit, &studied, made, &settings, &steps).map_err(of_pair)?;
                let mut pair = found.figures;
                if let Some(traded) = &traded {
                    let (scene, soft, exports) = (&found.scene, &found.soft, &pair.exports[..]);
                    let (material, reflection, settings) = (&studied, made.reflection, &settings);
                    let of = TradePair { lit, material, traded, reflection, scene, soft, exports, settings };
                    pair.trade = Some(of.measure().map_err(of_pair)?);
                    steps.step()?;
                }
                pairs.push(pair);
                pictures.maps.push(found.pictures);
            }
            if !has(Section::Maps) {
                continue;
            }
            let own: Vec<_> = pairs[first..].iter().collect();
            figures.push(MaterialFigures {
                model: material.0.name().to_owned(),
                centre: match material.0.centre() {
                    Centre::Reflection => "reflection vector",
                    Centre::Normal => "normal",
                    Centre::Tangent => "tangent",
                },
                advice: advice::of_material(&own, &settings.limits),
                name: studied.name,
            });
        }
        for ((_, lit), series) in lit.iter().zip(&series).filter(|_| has(Section::Degrees)) {
            pictures.degrees.lights.push((lit.name.clone(), series.pictures(lit, reporter)?));
        }
        let lit: Vec<&Lit<'_>> = lit.iter().map(|(_, lit)| lit).collect();
        let named: Vec<_> =
            materials.iter().map(|(key, material)| (name(key, "material"), &material.0)).collect();
        let (mut tables, mut noise, mut rigs) = (Vec::new(), Vec::new(), Vec::new());
        if has(Section::Tables) {
            (tables, pictures.tables) = tables::study(&lit, &named, &settings, &steps)?;
        }
        if has(Section::Sampling) {
            noise = noise::study(&lit, &named, &steps)?;
        }
        if has(Section::Rigs) {
            (rigs, pictures.rigs) = rigs::study(&lit, &named, &settings, &steps)?;
        }
        let places = context.inputs.optional::<artifacts::ProbePlaces>("places")?;
        let scene = context.inputs.optional::<artifacts::Scene>("scene")?;
        if let (Some(places), Some(scene)) = (&places, &scene) {
            places.check(scene)?;
        }
        let scene = scene.as_ref().map(|scene| &scene.0.scene);
        let mut probes = None;
        if let Some(places) = &places {
            let (figures, leaks) = probe_figures::figures(&places.0, scene, reporter)?;
            probes = Some(figures);
            pictures.probes = Some(ProbePicture { places: &places.0, scene, leaks });
        }
        reporter.check_cancelled()?;
        let specula = RawValue::from_string(context.recipe().to_owned())?;
        let (schema, materials, sampling) = (REPORT_SCHEMA, figures, noise);
        let report =
            Report { schema, specula, settings, materials, pairs, tables, sampling, rigs, degrees, probes };
        note(&report, reporter);
        let subject =
            if report.pairs.is_empty() && report.probes.is_some() { "Light probes" } else { "Reflections" };
        let title = if own.is_empty() { subject.to_owned() } else { own.to_string() };
        let page = page::page(&title, &report, &pictures, context.recipe())?;
        let mut json = serde_json::to_vec_pretty(&report)?;
        json.push(b'\n');
        Ok(Output::files(vec![json, page.into_bytes()]))
    }
}

/// Notes how many pairs have a good export, and the degrees of tables.
fn note(report: &Report, reporter: &Reporter) {
    for table in &report.tables {
        let error = percent(report.settings.table_error);
        reporter.note(match table.advised {
            Some(degree) => format!("{}: a table of degree {degree} is within {error} RMS", table.material),
            None => {
                format!("{}: no table up to degree {} is within {error} RMS", table.material, cuts::MAX_CUT)
            }
        });
    }
    if !report.sampling.is_empty() {
        let least = |pair: &&NoisePair| pair.least(NOTED) == Some(Follows::Product);
        reporter.note(format!(
            "at {NOTED} samples, the product of light and material has the least noise in {} of {} pairs",
            report.sampling.iter().filter(least).count(),
            report.sampling.len()
        ));
    }
    if report.pairs.is_empty() {
        return;
    }
    let good = report.pairs.iter().filter(|pair| pair.advice.good).count();
    let Limits { p95, p99 } = report.settings.limits;
    reporter.note(format!(
        "{good} of {} pairs have a good export: 95 % of samples within {p95:.2} stops, 99 % within {p99:.2}",
        report.pairs.len()
    ));
}

/// The port that a port is used with.
fn other(port: &str) -> &'static str {
    if port == "environment" { "material" } else { "environment" }
}

/// An item's name on the page: the stems of its key.
fn name(key: &ItemKey, otherwise: &str) -> String {
    if key.is_empty() {
        return otherwise.to_owned();
    }
    key.stems().collect::<Vec<_>>().join(" · ")
}
