//! Takes the part of a scene that a computation reads, so that changes of the rest do not rerun it.
//!
//! ```toml
//! [stage.surfaces]
//! kind = "scene-part"
//! input = "scene"
//! part = "surfaces"                  # for bake-probes
//! ```
//!
//! A stage reruns if its input changes, and a scene holds everything that a file says of light. Its parts are
//! scenes, too, which lack what their reader does not read. If a lamp gets another colour, `scene-part` runs,
//! finds the same bytes as before, and what is connected to it does not run.
//!
//! | `part` | for | what changes it |
//! | --- | --- | --- |
//! | `shape` | `place-probes` | triangles, two-sided or not, masks and blends, names, boxes; no albedo, no light |
//! | `surfaces` | `bake-probes` | triangles, albedo, textures, also of emission; not the colour and strength of emission, and no lamp |
//! | `lamps` | `bake-lamps` | triangles, albedo, and the places, cones and ranges of lamps; not their colour and intensity |
//!
//! `light-probes` takes the whole scene: the colours of emission and of lamps enter there. A material whose
//! emission is switched on or off, by a strength of 0, changes `surfaces`: it has one column more or less.
//! The kinds that bake take the whole scene as well; they then rerun with every change of it.

use containers::tensors::StoredScene;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use probes::ScenePart;
use stages::artifacts;

use crate::scene_port::check;

choice! {
    /// A part of a scene.
    pub(crate) enum PartName {
        /// What `place-probes` reads.
        Shape = "shape",
        /// What `bake-probes` reads.
        Surfaces = "surfaces",
        /// What `bake-lamps` reads.
        Lamps = "lamps",
    }
}

parameters! {
    /// Parameters of `scene-part`.
    pub(crate) struct Parameters {
        /// What of the scene is taken.
        part: PartName = PartName::Surfaces,
    }
}

/// The kind `scene-part`.
pub(crate) struct ScenePartKind;

impl Kind for ScenePartKind {
    type Parameters = Parameters;

    const NAME: &'static str = "scene-part";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("scene_part.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Scene>("scene")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Scene::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let stored = &context.inputs.get::<artifacts::Scene>("scene")?.0;
        let part = match parameters.part {
            PartName::Shape => ScenePart::Shape,
            PartName::Surfaces => ScenePart::Surfaces,
            PartName::Lamps => ScenePart::Lamps,
        };
        check(stored, part)?;
        let surfaces = if part == ScenePart::Shape { String::new() } else { stored.surfaces.clone() };
        Output::artifact(artifacts::Scene(StoredScene { scene: stored.scene.part(part), part, surfaces }))
    }
}
