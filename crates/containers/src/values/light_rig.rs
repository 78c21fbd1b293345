//! Lights as files that renderers load: glTF, USD, scenes of Godot, and CSV.
//!
//! | | glTF | USD | Godot's `.tscn` | CSV |
//! | --- | --- | --- | --- | --- |
//! | light | `KHR_lights_punctual`, directional | `DistantLight` | `DirectionalLight3D` | a row |
//! | frame | +Y up | +Y up, `upAxis` says so | +Y up | Specula's, +Z up |
//! | direction | the node's -Z is the way of the light | the prim's -Z is the way of the light | the node's -Z is the way of the light | toward the light |
//! | size | none; the radius is in `extras` | `inputs:angle`, the diameter in degrees | `light_angular_distance`, the diameter in degrees | the radius in degrees |
//! | strength | `intensity` times `color`: the irradiance of a surface that faces it | the same, with `inputs:normalize` | pi `light_energy` times the linear `light_color` | the irradiance, and the flux |
//! | image of the rest | none | a `DomeLight` | a `WorldEnvironment` | none |
//!
//! Scenes are written in the frame of files, in which the centre of a lat-long image looks along +Z and the
//! middle of its left half along +X, or are turned from there by [`SceneAxes`].
//!
//! The largest channel of `color` is 1. glTF calls the irradiance lux; the unit here is that of the
//! environment times steradians, and nothing is scaled by a luminous efficacy.
//!
//! Without `inputs:normalize` the intensity of a `DistantLight` is its radiance (OpenUSD calls it luminance).
//! With it the radiance is the intensity divided by pi sin^2(angle / 2), or by 1 if the angle is 0 (OpenUSD,
//! "Normalizing Distant Lights - In Depth" in the documentation of UsdLux): the intensity is the irradiance
//! of a surface that faces the light, just as [`sh::Light`] has it, for a point too.

use std::f64::consts::PI;

use serde_json::value::RawValue;
use serde_json::{Value, json};
use sh::Light;
use sphere::{DMat3, DQuat, DVec3, to_file};

use crate::error::{Error, ErrorKind};
use crate::recipe;
use crate::recipe::KEY;

/// How a scene is turned in relation to the frame of files: where its +X, +Y and +Z go. A rotation.
pub type SceneAxes = DMat3;

/// The lights as a glTF document: a node for each, in one scene.
///
/// # Errors
/// If a number is negative or not finite, or the recipe is not JSON.
pub fn write_gltf_lights(lights: &[Light], axes: SceneAxes, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    check(lights, recipe).map_err(|error| error.within("glTF"))?;
    let mut asset = "\"generator\": \"Specula\", \"version\": \"2.0\"".to_owned();
    if let Some(recipe) = recipe {
        // As it is given, byte for byte.
        asset.push_str(&format!(", \"extras\": {{\"{KEY}\": {recipe}}}"));
    }
    let light = |(index, light): (usize, &Light)| {
        let (intensity, color) = strength(light);
        json!({
            "type": "directional", "name": name(index), "intensity": intensity, "color": color,
            "extras": { "angularRadius": light.radius.to_degrees() }
        })
    };
    let node = |(index, light): (usize, &Light)| {
        json!({
            "name": name(index), "rotation": turn(light, axes).to_array(),
            "extensions": { "KHR_lights_punctual": { "light": index } }
        })
    };
    let list = |values: Vec<Value>| {
        let lines: Vec<String> = values.iter().map(|value| format!("    {value}")).collect();
        format!("[\n{}\n  ]", lines.join(",\n"))
    };
    let text = format!(
        "{{\n  \"asset\": {{{asset}}},\n  \"extensionsUsed\": [\"KHR_lights_punctual\"],\n  \"extensions\": \
         {{\"KHR_lights_punctual\": {{\"lights\": {}}}}},\n  \"nodes\": {},\n  \"scene\": 0,\n  \"scenes\": {}\n}}\n",
        list(lights.iter().enumerate().map(light).collect()),
        list(lights.iter().enumerate().map(node).collect()),
        json!([{ "nodes": (0..lights.len()).collect::<Vec<_>>() }])
    );
    Ok(text.into_bytes())
}

/// The beginning of a USD text file.
const USDA: &str = "#usda 1.0\n";

/// The beginning of a scene of Godot 4.
const TSCN: &str = "[gd_scene ";

/// The lights as a USD text file: below the prim `Lights` a `DistantLight` for each and, if `image` names a
/// lat-long image beside the file, a `DomeLight` that shows it.
///
/// OpenUSD lays the centre of a dome's image along +Z and the middle of its left half along +X, as the frame
/// of files does.
///
/// # Errors
/// The errors of [`write_gltf_lights`]; a name that cannot be written between two @.
pub fn write_usda_lights(
    lights: &[Light],
    axes: SceneAxes,
    image: Option<&str>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    check(lights, recipe).map_err(|error| error.within("USD"))?;
    let mut text =
        format!("{USDA}(\n    defaultPrim = \"Lights\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n");
    if let Some(recipe) = recipe {
        let recipe = escaped(recipe);
        text.push_str(&format!("    customLayerData = {{\n        string {KEY} = \"{recipe}\"\n    }}\n"));
    }
    text.push_str(")\n\ndef Scope \"Lights\"\n{\n");
    // USD multiplies row vectors from the left: the rows are where the axes go.
    let transform = |turn: DMat3| {
        let row = |axis: DVec3| format!("({}, {}, {}, 0)", axis.x, axis.y, axis.z);
        let rows = [turn.x_axis, turn.y_axis, turn.z_axis].map(row).join(", ");
        format!(
            "        matrix4d xformOp:transform = ({rows}, (0, 0, 0, 1))\n        uniform token[] xformOpOrder = \
             [\"xformOp:transform\"]\n"
        )
    };
    if let Some(image) = image {
        check_image(image, '@').map_err(|error| error.within("USD"))?;
        text.push_str(&format!(
            "    def DomeLight \"Sky\"\n    {{\n        float inputs:intensity = 1\n        asset inputs:texture:file = \
             @./{image}@\n        token inputs:texture:format = \"latlong\"\n{}    }}\n",
            transform(axes)
        ));
    }
    for (index, light) in lights.iter().enumerate() {
        let (intensity, [r, g, b]) = strength(light);
        text.push_str(&format!(
            "    def DistantLight \"{}\"\n    {{\n        float inputs:angle = {}\n        color3f inputs:color = \
             ({r}, {g}, {b})\n        float inputs:intensity = {intensity}\n        bool inputs:normalize = 1\n{}    }}\n",
            name(index),
            2.0 * light.radius.to_degrees(),
            transform(DMat3::from_quat(turn(light, axes))),
        ));
    }
    text.push_str("}\n");
    Ok(text.into_bytes())
}

/// The lights and the image of the rest as a scene of Godot 4: a `WorldEnvironment` whose sky is the lat-long
/// image with the name `image` beside the file, with a `DirectionalLight3D` for each light below it.
///
/// Godot lays the centre of a lat-long image along its -Z whatever `axes` are, which turn the lights alone.
/// It multiplies the energy of such a light by pi, and takes its colour for sRGB.
///
/// # Errors
/// The errors of [`write_gltf_lights`]; a name that cannot be written between quotation marks.
pub fn write_tscn_lights(
    lights: &[Light],
    axes: SceneAxes,
    image: &str,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    check(lights, recipe).and_then(|()| check_image(image, '"')).map_err(|error| error.within("tscn"))?;
    let mut text = format!(
        "{TSCN}format=3]\n\n[ext_resource type=\"Texture2D\" path=\"{image}\" id=\"1\"]\n\n[sub_resource \
         type=\"PanoramaSkyMaterial\" id=\"1\"]\npanorama = ExtResource(\"1\")\n\n[sub_resource type=\"Sky\" \
         id=\"2\"]\nsky_material = SubResource(\"1\")\n\n[sub_resource type=\"Environment\" id=\"3\"]\nbackground_mode \
         = 2\nsky = SubResource(\"2\")\n\n[node name=\"Sky\" type=\"WorldEnvironment\"]\nenvironment = \
         SubResource(\"3\")\n"
    );
    if let Some(recipe) = recipe {
        text.push_str(&format!("metadata/{KEY} = \"{}\"\n", escaped(recipe)));
    }
    for (index, light) in lights.iter().enumerate() {
        let (intensity, colour) = strength(light);
        let [r, g, b] = colour.map(|channel| envmap::srgb_encode(channel as f32));
        // The basis by its rows.
        let turn = DMat3::from_quat(turn(light, axes)).transpose().to_cols_array();
        let turn = turn.map(|value| value.to_string()).join(", ");
        text.push_str(&format!(
            "\n[node name=\"{}\" type=\"DirectionalLight3D\" parent=\".\"]\ntransform = Transform3D({turn}, 0, 0, 0)\n\
             light_color = Color({r}, {g}, {b}, 1)\nlight_energy = {}\nlight_angular_distance = {}\n",
            name(index),
            intensity / PI,
            2.0 * light.radius.to_degrees(),
        ));
    }
    Ok(text.into_bytes())
}

/// Refuses the name of a file that does not fit between two of a delimiter.
fn check_image(image: &str, delimiter: char) -> Result<(), Error> {
    if image.contains([delimiter, '\\', '\n']) {
        let message = format!("the name of the image, {image:?}, cannot be written");
        return Err(Error::new(ErrorKind::Unwritable, message));
    }
    Ok(())
}

/// A text between quotation marks.
fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

/// Whether bytes are a USD text file.
pub(crate) fn is_usda(bytes: &[u8]) -> bool {
    bytes.starts_with(USDA.as_bytes())
}

/// Whether bytes are a scene of Godot.
pub(crate) fn is_tscn(bytes: &[u8]) -> bool {
    bytes.starts_with(TSCN.as_bytes())
}

/// The recipe of a USD text file, or of a scene of Godot, that is written here.
pub(crate) fn read_text_recipe(bytes: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(bytes).ok()?;
    let starts = [format!("string {KEY} = \""), format!("metadata/{KEY} = \"")];
    let line = text.lines().find_map(|line| {
        let line = line.trim_start();
        starts.iter().find_map(|start| line.strip_prefix(start.as_str())?.strip_suffix('"'))
    })?;
    let (mut found, mut letters) = (String::new(), line.chars());
    while let Some(letter) = letters.next() {
        found.push(if letter == '\\' { letters.next()? } else { letter });
    }
    Some(found)
}

/// The columns of [`write_csv_lights`].
pub const LIGHT_COLUMNS: &str =
    "x,y,z,radius_degrees,irradiance_r,irradiance_g,irradiance_b,flux_r,flux_g,flux_b";

/// The lights as a table, a row for each: the direction toward it, +Z up, its angular radius, the irradiance
/// of a surface that faces it, and the integral of its radiance. Numbers are written so that they come back
/// exactly. The format has no place for a recipe.
///
/// # Errors
/// If a number is negative or not finite.
///
/// # Example: a point has its irradiance as its flux
/// ```
/// let light = sh::Light { direction: sphere::Direction::Z, radius: 0.0, irradiance: [3.0, 2.0, 0.5] };
/// let table = String::from_utf8(containers::write_csv_lights(&[light])?).expect("text");
/// assert_eq!(table.lines().last(), Some("0,0,1,0,3,2,0.5,3,2,0.5"));
/// # Ok::<(), containers::Error>(())
/// ```
pub fn write_csv_lights(lights: &[Light]) -> Result<Vec<u8>, Error> {
    check(lights, None).map_err(|error| error.within("CSV"))?;
    let mut text = format!("{LIGHT_COLUMNS}\n");
    for light in lights {
        let mut numbers = light.direction.vector().to_array().to_vec();
        numbers.push(light.radius.to_degrees());
        numbers.extend(light.irradiance);
        numbers.extend(light.flux());
        let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
        text.push_str(&numbers.join(","));
        text.push('\n');
    }
    Ok(text.into_bytes())
}

/// Refuses what renderers do not take.
pub(crate) fn check(lights: &[Light], recipe: Option<&str>) -> Result<(), Error> {
    recipe::check(recipe)?;
    let unwritable = |message: String| Err(Error::new(ErrorKind::Unwritable, message));
    if recipe.is_some_and(|recipe| serde_json::from_str::<&RawValue>(recipe).is_err()) {
        return unwritable("the recipe is not JSON".into());
    }
    let sound = |light: &Light| {
        light.radius.is_finite() && light.irradiance.iter().all(|value| value.is_finite() && *value >= 0.0)
    };
    match lights.iter().position(|light| !sound(light)) {
        Some(index) => unwritable(format!(
            "light {index}: expected a finite irradiance that is not negative, found {:?}",
            lights[index].irradiance
        )),
        None => Ok(()),
    }
}

fn name(index: usize) -> String {
    format!("Light{index}")
}

/// The largest channel, and the colour of which it is 1.
fn strength(light: &Light) -> (f64, [f64; 3]) {
    let most = light.irradiance.into_iter().fold(0.0, f64::max);
    if most > 0.0 { (most, light.irradiance.map(|value| value / most)) } else { (0.0, [1.0; 3]) }
}

/// The rotation, in the scene's frame, that takes +Z to the direction toward the light: -Z is then its way.
fn turn(light: &Light, axes: SceneAxes) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, axes * to_file(light.direction.vector()))
}

#[cfg(test)]
mod tests;
