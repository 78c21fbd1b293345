//! `KHR_lights_punctual`: the lamps of a scene.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DAffine3, DVec3};
use probes::{Lamp, LampKind};
use serde_json::{Map, Value};

use super::element::Element;
use crate::error::Error;

const NAME: &str = "KHR_lights_punctual";
const AMOUNT: brdf::Range = brdf::Range { least: 0.0, most: f32::MAX as f64, words: "a number of 0 or more" };
const ANGLE: brdf::Range =
    brdf::Range { least: 0.0, most: FRAC_PI_2 + 1e-5, words: "an angle from 0 to pi / 2 in radians" };

/// The lamps of the nodes that are in the scene, in the order of the nodes; `places` are the maps from each
/// node's coordinates to the scene's, in Specula's frame.
pub(super) fn lamps(json: &Map<String, Value>, places: &[Option<DAffine3>]) -> Result<Vec<Lamp>, Error> {
    let nodes = Element::of(json, "nodes");
    let lights = Element::of(json, "extensions").get(NAME).get("lights");
    let mut lamps = Vec::new();
    for (index, place) in places.iter().enumerate() {
        let Some(place) = place else { continue };
        let node = nodes.at(index)?;
        let Some(light) = node.get("extensions").get(NAME).get("light").index()? else { continue };
        let light = lights.at(light)?;
        let name = node.get("name").text()?.or(light.get("name").text()?);
        lamps.push(lamp(&light, name.map_or_else(|| node.path().to_owned(), str::to_owned), place)?);
    }
    Ok(lamps)
}

fn lamp(light: &Element<'_>, name: String, place: &DAffine3) -> Result<Lamp, Error> {
    let kind = light.get("type");
    let kind = match kind.text()? {
        Some("point") => LampKind::Point,
        Some("directional") => LampKind::Directional,
        Some("spot") => {
            let spot = light.get("spot");
            LampKind::Spot {
                inner: spot.get("innerConeAngle").number(0.0, ANGLE)? as f32,
                outer: spot.get("outerConeAngle").number(FRAC_PI_4, ANGLE)? as f32,
            }
        }
        other => {
            return Err(Error::damaged(format!(
                "{}: expected \"point\", \"spot\" or \"directional\", found {other:?}",
                kind.path()
            )));
        }
    };
    // The light goes along the node's local -Z.
    let way = place.matrix3 * sphere::from_file(DVec3::NEG_Z);
    let direction = way.try_normalize().unwrap_or_else(|| sphere::from_file(DVec3::NEG_Z));
    // A range of 0 is no end: some exporters write it for one that is absent.
    let range = light.get("range").number(0.0, AMOUNT)? as f32;
    Ok(Lamp {
        name,
        kind,
        position: place.translation.as_vec3().to_array(),
        direction: direction.as_vec3().to_array(),
        color: light.get("color").colour([1.0; 3], AMOUNT)?.map(|channel| channel as f32),
        intensity: light.get("intensity").number(1.0, AMOUNT)? as f32,
        range: (range > 0.0).then_some(range),
    })
}

/// A note of the lamps that have no light.
pub(super) fn dark_lamps(lamps: &[Lamp]) -> Option<String> {
    let is_dark = |lamp: &&Lamp| lamp.color.iter().all(|channel| channel * lamp.intensity == 0.0);
    let names: Vec<&str> = lamps.iter().filter(is_dark).map(|lamp| lamp.name.as_str()).collect();
    let listed = || format!("lamps without light, whose intensity or colour is 0: {}", names.join(", "));
    (!names.is_empty()).then(listed)
}
