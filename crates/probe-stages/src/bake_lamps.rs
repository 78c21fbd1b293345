//! Bakes the transport of light from the lamps of a scene to probes, for each lamp on its own.
//!
//! ```toml
//! [stage.lamp-light]
//! kind = "bake-lamps"
//! inputs = { scene = "lamp-shapes", places = "places" }
//! ```
//!
//! Each lamp of `KHR_lights_punctual` gets a column: the spherical harmonics of what arrives at each probe
//! if its colour times its intensity is 1, apart for what it sends straight there, which is exact, and for
//! what surfaces reflect. `light-probes` multiplies it by the lamp's colour and intensity: another colour,
//! or a lamp that is switched off, traces no ray. For that, `scene` is connected to the part `lamps` of
//! `scene-part`. The factors of `range` and of a spot's cone are those that the extension recommends.
//!
//! ## Suns
//!
//! A sun that is blurred into a sky of degree 4 lights a courtyard from half of the sky. `project-sh` keeps
//! suns beside the series of its lighting; connected to the port `lights`, each of them becomes a lamp of
//! parallel light here, with sharp shadows: the width of its disk is not read. `light-probes` finds it by
//! its direction and takes its irradiance from the lighting.
//!
//! ```toml
//! [stage.suns-and-lamps]
//! kind = "bake-lamps"
//! inputs = { scene = "lamp-shapes", places = "places", lights = "sky" }
//! ```
//!
//! ## What reruns
//!
//! All lamps of a scene are one item. If one is moved, added or removed, or a lighting at `lights` changes,
//! the item runs, and traces only the lamps that its last run had not: the columns of the others are those of
//! that run, as long as the cache has it. A note says how many. A build with `--force` traces all, and so
//! does an item that runs on another machine.
//!
//! `lamps` chooses some by name: a lamp that is not baked is dark, and `light-probes` says so.
//!
//! `degree`, F, has to be that of the transport (`bake-probes`). The paths are as in `bake-probes`.

use std::sync::Arc;

use containers::tensors::ProbeLamps;
use engine::{
    Artifact, Context, Digest, Failure, Kind, Output, Parameters as _, Port, Product, Steps, parameters,
};
use probes::{Lamp, LampColumns, ScenePart, Surfaces, bake_lamp};
use sh::Degree;
use stages::artifacts;
use stages::plugin::UntilStopped;

use crate::baking::Baking;
use crate::name_pattern::NamePattern;
use crate::scene_port::check;
use crate::suns;

parameters! {
    /// Parameters of `bake-lamps`.
    pub(crate) struct Parameters {
        /// F, the degree of the light that arrives.
        #[range(2..=4)]
        degree: usize = 2,
        /// The names of the lamps that are baked.
        lamps: Option<Vec<NamePattern>> = None,
        ..baking: Baking,
    }
}

/// The kind `bake-lamps`.
pub(crate) struct BakeLamps;

impl Kind for BakeLamps {
    type Parameters = Parameters;

    const NAME: &'static str = "bake-lamps";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[probes::revisions::PROBES];
    const TEXT: &'static str = include_str!("bake_lamps.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Scene>("scene"),
            Port::one::<artifacts::ProbePlaces>("places"),
            Port::one::<artifacts::Lighting>("lights").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::ProbeLamps::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.baking.check()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let scene = context.inputs.get::<artifacts::Scene>("scene")?;
        check(&scene.0, ScenePart::Lamps)?;
        let places = context.inputs.get::<artifacts::ProbePlaces>("places")?;
        places.check(&scene)?;
        let (places, stored) = (&places.0, &scene.0);
        let places_digest = context.inputs.digest("places")?.to_string();
        let degree = Degree::new(parameters.degree)?;
        // The degree of the sky is not read.
        let options = parameters.baking.options(parameters.degree, 2)?;
        let all = &stored.scene.parts().lamps;
        let is_chosen = |lamp: &&Lamp| match &parameters.lamps {
            Some(patterns) => patterns.iter().any(|pattern| pattern.matches(&lamp.name)),
            None => true,
        };
        let lights = context.inputs.optional::<artifacts::Lighting>("lights")?;
        let suns: Vec<Lamp> = lights.iter().flat_map(|lighting| &lighting.0.lights).map(suns::lamp).collect();
        if lights.is_some() && suns.is_empty() {
            reporter.note(
                "the lighting at port lights has no lights beside its series; project-sh keeps suns there with \
                 lamps = \"separate\"",
            );
        }
        let mut lamps: Vec<&Lamp> = all.iter().filter(is_chosen).collect();
        if lamps.is_empty() && lights.is_none() {
            let names = all.iter().map(|lamp| lamp.name.as_str()).collect::<Vec<_>>().join(", ");
            reporter.warn(match all.len() {
                0 => "the scene has no lamps (KHR_lights_punctual)".to_owned(),
                _ => format!("`lamps` chooses none of the scene's lamps: {names}"),
            });
        }
        lamps.extend(&suns);
        let surfaces = Surfaces::new(&stored.scene);
        let of_lamp = options.steps(places.len());
        let steps = Steps::new(reporter, lamps.len() * of_lamp);
        // Which of the lamps are baked changes the columns of none.
        let settings = Parameters { lamps: None, ..parameters.clone() }.canonical().to_string();
        let kernel = format!("{} {:?}", Self::REVISION, Self::KERNELS);
        let earlier = context.earlier::<artifacts::ProbeLamps>();
        let mut columns: Vec<LampColumns> = Vec::new();
        let (mut digests, mut as_before) = (Vec::new(), 0);
        for lamp in &lamps {
            let Lamp { name: _, kind, position, direction, color: _, intensity: _, range } = lamp;
            let shape = format!("{kind:?} {position:?} {direction:?} {range:?}");
            let of = [&kernel, &stored.surfaces, &places_digest, &shape, &settings];
            let of = Digest::of(of.map(String::as_str).join(" ").as_bytes());
            let part = steps.part(of_lamp, of_lamp);
            let traced = || {
                let baked = part
                    .until_stopped(|stop| bake_lamp(&surfaces, lamp, places.positions(), &options, stop))?;
                let bytes = 4 * (baked.direct.len() + baked.indirect.len() + 2 * places.len());
                Ok::<_, Failure>((baked, bytes))
            };
            let digest = of.to_string();
            let made = match earlier.as_ref().and_then(|earlier| column_of(&earlier.0, &digest)) {
                Some(column) => {
                    as_before += 1;
                    Arc::new(column.clone())
                }
                None => context.derived.get("bake-lamp", of, &[], traced)?,
            };
            digests.push(digest);
            let what = format!("lamp {}", lamp.name);
            if lamps.len() <= NOTED {
                parameters.baking.report(&what, &made.errors, places, reporter);
            }
            columns.push(Arc::unwrap_or_clone(made));
        }
        if as_before > 0 {
            reporter.note(format!(
                "{as_before} of {} lamps are as they were in the last run, and were not traced",
                lamps.len()
            ));
        }
        Output::artifact(artifacts::ProbeLamps(ProbeLamps {
            names: lamps.iter().map(|lamp| lamp.name.clone()).collect(),
            digests,
            probes: if columns.is_empty() { 0 } else { places.len() },
            columns,
            degree,
            places_digest,
            surfaces: stored.surfaces.clone(),
        }))
    }
}

/// The columns of a lamp that were made from what this is the digest of.
fn column_of<'l>(lamps: &'l ProbeLamps, digest: &str) -> Option<&'l LampColumns> {
    let place = lamps.digests.iter().position(|found| found == digest)?;
    lamps.columns.get(place)
}

/// The most lamps with a note each.
const NOTED: usize = 8;
