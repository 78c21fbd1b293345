//! Reads a scene, the surfaces, emission and lamps of a glTF file as light sees them.
//!
//! ```toml
//! [stage.scene]
//! kind = "import-scene"
//! source = "level.glb"
//!
//! [stage.levels]
//! kind = "import-scene"
//! source = "levels/*.{gltf,glb}"
//! volumes = "probes_*"               # nodes that are boxes for probes
//! points = "probe.*"                 # nodes that are single probes
//! ```
//!
//! A scene is what light probes are baked in: `place-probes`, `bake-probes`, `bake-lamps` and `light-probes`
//! take it. `source` names glTF 2.0 files, `.gltf` or `.glb`; a glob gives one item per file. The buffers and
//! pictures of a `.gltf` file are part of it: the item reruns when one of them changes.
//!
//! All nodes of the default scene (or of `scene`) are read, with their transforms, instances
//! (`EXT_mesh_gpu_instancing`) and skins in their rest pose, and converted from the file's frame (+Y up) to
//! Specula's. A node with a negative scale turns the order of its corners, as the specification says, so that
//! fronts stay fronts. At most 4,194,304 triangles are read.
//!
//! | in the file | in the scene |
//! | --- | --- |
//! | base colour: factor, texture, `COLOR_0` | albedo, times 1 - metallic; above 0.95 it is taken as 0.95 (a note counts them): light would never end in a closed room whose walls reflect everything |
//! | metals | matte, with their base colour (`metals = "diffuse"`), or black (`"black"`) |
//! | emissive factor, texture, `KHR_materials_emissive_strength` | a light of its own for each material |
//! | `KHR_materials_unlit` | emits its colour, reflects nothing |
//! | `alphaMode` | rays pass where a `MASK` is cut; a share of 1 - alpha passes `BLEND` (noted) |
//! | `doubleSided` | otherwise the back is black, opaque and dark |
//! | `KHR_materials_transmission` | light passes straight, with the base colour (`transmission = "clear"`), or not (`"opaque"`) |
//! | `KHR_lights_punctual` | lamps: points, spots and directions, in candela and lux |
//! | roughness, normals, occlusion | not read: a file that differs in these alone gives the same scene, byte by byte, and nothing reruns |
//! | `extras.specula_probes` of a node, or a node named like `volumes` | a box for probes: that around its mesh, or around the cube of an empty. Its mesh is not in the scene |
//! | a node named like `points` | a single probe at its origin. Its mesh is not in the scene |
//!
//! Textures have at most 1,024 texels along a side here, since a path sees more of a surface than a texel of
//! a larger one. Files that require Draco, or the specular-glossiness materials, are refused with the name of
//! the extension. Missing buffers and pictures, pictures that cannot be read, numbers that are not finite and
//! scenes without triangles are errors that name the place in the file.
//!
//! Each stage that uses a scene reruns if anything in it changes. `scene-part` takes parts of it, so that a
//! bake does not depend on the colour of a lamp.

use std::path::Path;

use containers::{Metals, SceneOptions, Transmission};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use stages::artifacts;

use crate::name_pattern::NamePattern;
use crate::scene_port::whole;

choice! {
    /// What metals reflect.
    pub(crate) enum MetalsName {
        /// They are matte, with their base colour.
        Diffuse = "diffuse",
        /// They are black.
        Black = "black",
    }
}

choice! {
    /// What surfaces with transmission let through.
    pub(crate) enum TransmissionName {
        /// Light passes straight.
        Clear = "clear",
        /// Nothing passes.
        Opaque = "opaque",
    }
}

parameters! {
    /// Parameters of `import-scene`.
    pub(crate) struct Parameters {
        /// The name of the scene in the file. Default: the file's default scene.
        scene: Option<String> = None,
        /// What metals reflect.
        metals: MetalsName = MetalsName::Diffuse,
        /// What surfaces with `KHR_materials_transmission` let through.
        transmission: TransmissionName = TransmissionName::Clear,
        /// The names of nodes that are boxes for probes, beside those with `extras.specula_probes`.
        volumes: Option<NamePattern> = None,
        /// The names of nodes that are the places of single probes.
        points: Option<NamePattern> = None,
    }
}

/// The kind `import-scene`.
pub(crate) struct ImportScene;

impl Kind for ImportScene {
    type Parameters = Parameters;

    const NAME: &'static str = "import-scene";
    const REVISION: u32 = 2;
    const TEXT: &'static str = include_str!("import_scene.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Scene::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let bytes = context.files.read(path).map_err(|failure| match context.files.is_folder(path) {
            true => Failure::new(format!("{file} is a folder, not a scene"))
                .help("name a file, or every file in it: source = \"folder/*.{gltf,glb}\""),
            false => failure,
        })?;
        let is_box = |name: &str| parameters.volumes.as_ref().is_some_and(|pattern| pattern.matches(name));
        let is_point = |name: &str| parameters.points.as_ref().is_some_and(|pattern| pattern.matches(name));
        let options = SceneOptions {
            scene: parameters.scene.as_deref(),
            metals: match parameters.metals {
                MetalsName::Diffuse => Metals::Diffuse,
                MetalsName::Black => Metals::Black,
            },
            transmission: match parameters.transmission {
                TransmissionName::Clear => Transmission::Clear,
                TransmissionName::Opaque => Transmission::Opaque,
            },
            is_box: Some(&is_box),
            is_point: Some(&is_point),
        };
        let mut beside = |other: &str| context.files.read(Path::new(other));
        let found = containers::read_gltf_scene(&bytes, &options, &mut beside)
            .map_err(|failure: Failure| failure.context(format!("cannot import {file}")))?;
        reporter.check_cancelled()?;
        found.notes.into_iter().for_each(|note| reporter.note(note));
        Output::artifact(artifacts::Scene(whole(found.scene)))
    }
}
