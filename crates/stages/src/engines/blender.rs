//! Blender.

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;

/// All that is known of Blender.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "blender",
    "Blender.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: None, readme },
);

fn readme(image: &str, _: &str) -> String {
    format!(
        "Blender filters nothing: it samples the image, and shows it behind the scene. In Python:

import bpy
nodes = bpy.context.scene.world.node_tree.nodes
image = nodes.new(\"ShaderNodeTexEnvironment\")
image.image = bpy.data.images.load(\"//{image}\")
bpy.context.scene.world.node_tree.links.new(image.outputs[0], nodes[\"Background\"].inputs[0])
"
    )
}
