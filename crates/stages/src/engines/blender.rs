//! Blender.

use sphere::DVec3;

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};

/// All that is known of Blender.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "blender",
    "Blender.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: None, readme },
    [DVec3::X, DVec3::Y, DVec3::Z],
    EngineLights {
        readme: lights_readme,
        // As bpy 5.0 imports a DistantLight.
        scene: LightScene::Usd { intensity: 4.0, angle: 2.0 },
        imported_from: |d| DVec3::new(d.x, d.z, -d.y),
    },
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

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image, in Python:

import json, math, mathutils
for entry in json.load(open(bpy.path.abspath(\"//{lights}\")))[\"lights\"]:
    light = bpy.data.lights.new(entry[\"name\"], \"SUN\")
    light.color, light.energy, light.angle = entry[\"colour\"], entry[\"intensity\"], math.radians(entry[\"angular_diameter\"])
    sun = bpy.data.objects.new(entry[\"name\"], light)
    sun.rotation_euler = mathutils.Vector(entry[\"direction\"]).to_track_quat(\"Z\", \"Y\").to_euler()
    bpy.context.scene.collection.objects.link(sun)
"
    )
}
