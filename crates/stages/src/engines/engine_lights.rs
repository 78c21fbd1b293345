//! The suns and lamps that leave an engine's image: as JSON with code, and as a scene that the engine
//! imports.

use containers::{SceneAxes, write_gltf_lights, write_tscn_lights, write_usda_lights};
use engine::Failure;
use serde::Deserialize;
use serde_json::{Value, json};
use sh::Light;
use sphere::{DVec3, Direction, from_file, to_file};

/// What follows the stem in the name of the file of lights beside an image.
const JSON: &str = "-lights.json";

/// What [`lights_json`] writes and a preview reads back.
#[derive(Deserialize)]
struct LightsFile {
    lights: Vec<LightInWorld>,
}

/// A light of the file.
#[derive(Deserialize)]
struct LightInWorld {
    direction: [f64; 3],
    colour: [f64; 3],
    intensity: f64,
    angular_diameter: f64,
}

/// Reads the lights of a JSON file in our frame. `to_file_frame` takes a direction from the engine's world to
/// the frame of files.
///
/// # Errors
/// If the file is not such a JSON, or a light has no direction.
pub(crate) fn read_lights(
    bytes: &[u8],
    to_file_frame: impl Fn(DVec3) -> DVec3,
) -> Result<Vec<Light>, Failure> {
    let file: LightsFile = serde_json::from_slice(bytes)?;
    let light = |light: LightInWorld| {
        let direction = from_file(to_file_frame(DVec3::from_array(light.direction)));
        let direction = Direction::new(direction).ok_or_else(|| Failure::new("a light has no direction"))?;
        let irradiance = light.colour.map(|channel| channel * light.intensity);
        Ok(Light { direction, radius: light.angular_diameter.to_radians() / 2.0, irradiance })
    };
    file.lights.into_iter().map(light).collect()
}

/// How an engine gets the lights beside an image.
#[derive(Clone, Copy)]
pub(crate) struct EngineLights {
    /// The text with the code that makes lights of the engine from the JSON file with this name.
    pub(crate) readme: fn(&str) -> String,
    /// The scene that the engine imports.
    pub(crate) scene: LightScene,
    /// Where a direction of the engine's world comes from in such a scene, in the scene's own frame.
    pub(crate) imported_from: fn(DVec3) -> DVec3,
}

/// A scene with lights.
#[derive(Clone, Copy)]
pub(crate) enum LightScene {
    /// glTF with KHR_lights_punctual: the lights alone.
    Gltf,
    /// USD: the lights, and a dome that shows the image. The engine's importer multiplies intensities and
    /// angles by these.
    Usd { intensity: f64, angle: f64 },
    /// A scene of Godot: the lights, and the image as its sky.
    Godot,
}

impl LightScene {
    /// What follows the stem in the file's name.
    const fn ending(self) -> &'static str {
        match self {
            Self::Gltf => "-lights.gltf",
            Self::Usd { .. } => "-lights.usda",
            Self::Godot => "-lights.tscn",
        }
    }

    /// What the file holds, after its name.
    const fn content(self) -> &'static str {
        match self {
            Self::Gltf => "has the same lights as glTF with KHR_lights_punctual, for a loader of glTF",
            Self::Usd { .. } => {
                "has the image, as a DomeLight, and the same lights as USD, to be imported instead of both"
            }
            Self::Godot => {
                "is a scene with the image as its sky and the same lights, to be instantiated instead of both"
            }
        }
    }
}

impl EngineLights {
    /// What follows the stem in the names of the files.
    pub(crate) fn endings(&self) -> [&'static str; 2] {
        [JSON, self.scene.ending()]
    }

    /// The text beside the files with this stem.
    pub(crate) fn text(&self, stem: &str) -> String {
        let Self { readme, scene, .. } = self;
        format!("{}\n{stem}{} {}.\n", readme(&format!("{stem}{JSON}")), scene.ending(), scene.content())
    }

    /// The files, for the engine of this name, whose image is called so. `world` takes a direction from the
    /// frame of files to the engine's world.
    pub(crate) fn files(
        &self,
        engine: &str,
        world: impl Fn(DVec3) -> DVec3,
        lights: &[Light],
        image: &str,
        recipe: &str,
    ) -> Result<Vec<Vec<u8>>, Failure> {
        // The frame of files has the left of an image along +X and its centre along +Z.
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (self.imported_from)(world(axis)));
        let axes = SceneAxes::from_cols(x, y, z);
        let recipe_text = Some(recipe);
        let scene = match self.scene {
            LightScene::Gltf => write_gltf_lights(lights, axes, recipe_text)?,
            LightScene::Usd { intensity, angle } => {
                let lights: Vec<_> = lights
                    .iter()
                    .map(|light| Light {
                        irradiance: light.irradiance.map(|value| value / intensity),
                        radius: light.radius / angle,
                        ..*light
                    })
                    .collect();
                write_usda_lights(&lights, axes, Some(image), recipe_text)?
            }
            LightScene::Godot => write_tscn_lights(lights, axes, image, recipe_text)?,
        };
        Ok(vec![lights_json(engine, world, lights, recipe)?, scene])
    }
}

/// Lights in an engine's world, as JSON: `lights`, the strongest first, each with its `name`, the `direction`
/// toward it, its `colour`, linear with a largest channel of 1, its `intensity`, the irradiance of a surface
/// that faces it in the unit of the image times steradians, and its `angular_diameter` in degrees.
fn lights_json(
    engine: &str,
    world: impl Fn(DVec3) -> DVec3,
    lights: &[Light],
    recipe: &str,
) -> Result<Vec<u8>, Failure> {
    let light = |(index, light): (usize, &Light)| {
        let intensity = light.irradiance.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        json!({
            "name": format!("light {}", index + 1),
            "direction": world(to_file(light.direction.vector())).to_array(),
            "colour": light.irradiance.map(|value| value / intensity),
            "intensity": intensity,
            "angular_diameter": 2.0 * light.radius.to_degrees(),
        })
    };
    let recipe: Value = serde_json::from_str(recipe)?;
    let lights: Vec<Value> = lights.iter().enumerate().map(light).collect();
    let document = json!({ "engine": engine, "lights": lights, "specula": recipe });
    Ok((serde_json::to_string_pretty(&document)? + "\n").into_bytes())
}
