//! Measures how much light leaks between probes, and fails if that is too much.
//!
//! ```toml
//! [stage.leaks]
//! kind = "check-probes"
//! inputs = { places = "places", scene = "shape" }
//! leak-limit = 0.02
//! path = "leaks"
//! ```
//!
//! Engines blend the eight probes around a place, whether there is a wall between them or not. At `points`
//! points of the surfaces, spread evenly over their area, this kind asks which of the probes that light the
//! point cannot see it, as where a wall without thickness stands between two rows of probes. The share of
//! their weight in the blend is what leaks: the share of light that comes from them if all probes are equally
//! bright. Light has no part in it, so that it is known before anything is baked.
//!
//! | `blend` | what is asked |
//! | --- | --- |
//! | `three` | what three.js 187 does: the box of the place half a spacing in front of the surface, blended there |
//! | `bevy` | what Bevy does: all boxes that contain the point |
//! | `visible` | what `shade-vertices` and `export-gltf` do: the corners of a cell that see the point |
//!
//! Points in no volume, and those that no probe near them sees, such as the bottom of a crate, are left out;
//! a warning says if fewer than half of `points` remain.
//! A note has the mean share and the worst points. With `leak-limit`, a mean share above it is an error,
//! which fails the build. Boxes that end at walls (`split = "rooms"` or `boxes` of `place-probes`), or walls
//! in the middle between rows of probes, make it smaller; `report` draws the leaks.
//!
//! `scene` is best connected to the part `shape` of `scene-part`, as for `place-probes`. A scene with other
//! triangles than the one in which the probes were placed is an error.
//!
//! ## Files
//!
//! `.json`: `format`, `blend`; `points`, the number of points that were measured, and `hidden`, the number of
//! those in volumes that no probe sees; `mean` and
//! `limit`; and `worst`, up to 100 points of surfaces with their `place` and `normal` in metres in Specula's
//! frame, the `share` that leaks there, and the `probes` it comes from, each with its weight.

use engine::{Context, Failure, Kind, Output, Port, Product, Steps, choice, parameters};
use probes::{Blend, LEAK_POINTS, Leak, Leaks, ProbePlaces, ScenePart, Surfaces, leaks};
use serde::Serialize;
use stages::artifacts;
use stages::plugin::UntilStopped;

use crate::baking::place_text;
use crate::json::document;
use crate::scene_port::check;

/// The points that the file lists, and those that messages name.
const LISTED: usize = 100;
const NAMED: usize = 3;

choice! {
    /// How probes are blended.
    pub(crate) enum BlendName {
        /// As three.js does.
        Three = "three",
        /// As Bevy does.
        Bevy = "bevy",
        /// By what the probes see.
        Visible = "visible",
    }
}

parameters! {
    /// Parameters of `check-probes`.
    pub(crate) struct Parameters {
        /// Who blends the probes; see the table.
        blend: BlendName = BlendName::Three,
        /// The points of surfaces.
        #[range(1..=1000000)]
        points: usize = LEAK_POINTS,
        /// The mean share that may leak, from 0 to 1. Default: any.
        #[range(0.0..=1.0)]
        leak_limit: Option<f64> = None,
    }
}

/// The members of the file.
#[derive(Serialize)]
struct File<'a> {
    format: &'static str,
    blend: &'static str,
    points: usize,
    hidden: usize,
    mean: f64,
    limit: Option<f64>,
    worst: Vec<Entry<'a>>,
}

/// A point at which light leaks.
#[derive(Serialize)]
struct Entry<'a> {
    place: [f32; 3],
    normal: [f32; 3],
    share: f32,
    probes: &'a [(u32, f32)],
}

/// The kind `check-probes`.
pub(crate) struct CheckProbes;

impl Kind for CheckProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "check-probes";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] =
        &[probes::revisions::PROBES, probes::revisions::BLEND, probes::revisions::LEAKS];
    const TEXT: &'static str = include_str!("check_probes.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::ProbePlaces>("places"), Port::one::<artifacts::Scene>("scene")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".json".into()])
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let places = context.inputs.get::<artifacts::ProbePlaces>("places")?;
        let scene = context.inputs.get::<artifacts::Scene>("scene")?;
        check(&scene.0, ScenePart::Shape)?;
        places.check(&scene)?;
        let (places, stored) = (&places.0, &scene.0);
        let blend = match parameters.blend {
            BlendName::Three => Blend::Three,
            BlendName::Bevy => Blend::Bevy,
            BlendName::Visible => Blend::Visible,
        };
        let surfaces = Surfaces::new(&stored.scene);
        let steps = Steps::new(&context.reporter, parameters.points);
        let found = steps.until_stopped(|stop| leaks(&surfaces, places, blend, parameters.points, stop))?;
        if found.points.is_empty() {
            return Err(Failure::new(
                "no point of a surface is in a volume of probes and seen by one of them",
            )
            .help("connect the scene in which the probes were placed, or larger `boxes`"));
        }
        if found.points.len() < parameters.points / 2 {
            let (found, wanted) = (found.points.len(), parameters.points);
            context
                .reporter
                .warn(format!("only {found} of {wanted} points are in a volume and seen by a probe"));
        }
        let text = describe(&found, places, blend.label());
        let mean = found.mean();
        if let Some(limit) = parameters.leak_limit.filter(|limit| mean > *limit) {
            return Err(Failure::new(format!("{text}; leak-limit is {limit}")).help(
                "split = \"rooms\" of place-probes ends boxes at the walls; walls in the middle between rows of probes, or a \
                 smaller spacing, help too",
            ));
        }
        context.reporter.note(text);
        let worst = found.worst().into_iter().take(LISTED).map(|leak| Entry {
            place: leak.point,
            normal: leak.normal,
            share: leak.share,
            probes: &leak.probes,
        });
        let file = File {
            format: "specula leaks 1",
            blend: blend.word(),
            points: found.points.len(),
            hidden: found.hidden,
            mean,
            limit: parameters.leak_limit,
            worst: worst.collect(),
        };
        Ok(Output::files(vec![document(&file, context.recipe())?]))
    }
}

/// How much leaks, and where most.
fn describe(found: &Leaks, places: &ProbePlaces, name: &str) -> String {
    let point = |leak: &&Leak| {
        let [x, y, z] = leak.point;
        let from = leak.probes.first().map_or_else(String::new, |(probe, _)| {
            format!(" from probe {}", place_text(places, *probe as usize))
        });
        format!("{:.0} % at [{x:.2}, {y:.2}, {z:.2}]{from}", 100.0 * leak.share)
    };
    let worst: Vec<String> = found.worst().iter().take(NAMED).map(point).collect();
    let worst = if worst.is_empty() { String::new() } else { format!(": {}", worst.join(", ")) };
    format!(
        "{:.2} % of the probes' light leaks, by weight ({name}), at {} points{worst}",
        100.0 * found.mean(),
        found.points.len()
    )
}
