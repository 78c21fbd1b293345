//! How `specula inspect` describes meshes: glTF files and mesh artifacts.

use std::path::Path;
use std::sync::Arc;

use engine::{Failure, path_text};
use mesh::Mesh;
use serde_json::{Value, json};

use super::facts::Facts;

/// A mesh file; `None` if its name is not that of a mesh file.
pub(super) fn of_file(file: &Path, bytes: &[u8]) -> Option<Result<Facts, Failure>> {
    let ending = file.extension()?;
    let named = ["gltf", "glb"].iter().any(|known| ending.eq_ignore_ascii_case(known));
    named.then(|| {
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut read = |path: &str| {
            let path = folder.join(path);
            let cannot = |error| Failure::from(error).context(format!("cannot read {}", path_text(&path)));
            engine::read_file(&path).map(Arc::new).map_err(cannot)
        };
        if let Some(facts) = lights(bytes) {
            return Ok(facts);
        }
        if let Some(facts) = image_based_light(bytes)? {
            return Ok(facts);
        }
        let model = containers::read_gltf(bytes, &mut read)
            .map_err(|failure: Failure| failure.context(path_text(file)))?;
        let mut facts: Facts = vec![("what", "mesh".into()), ("format", "glTF 2.0".into())];
        facts.extend(size(&model.mesh));
        if let Ok(materials) = containers::gltf_materials(bytes)
            && !materials.is_empty()
        {
            facts.push(("materials", materials.join(", ").into()));
        }
        if !model.notes.is_empty() {
            facts.push(("notes", json!(model.notes)));
        }
        facts.extend(end(bytes));
        Ok(facts)
    })
}

/// The size of a file, and how it was made.
fn end(bytes: &[u8]) -> Facts {
    let mut facts: Facts = vec![("bytes", bytes.len().into())];
    if let Some(recipe) = containers::read_recipe(bytes) {
        facts.push(("recipe", serde_json::from_str(&recipe).unwrap_or_else(|_| recipe.into())));
    }
    facts
}

/// A document that holds lights and no mesh, such as `export-light-rig` writes.
fn lights(bytes: &[u8]) -> Option<Facts> {
    let document = containers::gltf_document(bytes)?;
    let lights = document.pointer("/extensions/KHR_lights_punctual/lights")?.as_array()?.len();
    if document.get("meshes").is_some() {
        return None;
    }
    let mut facts: Facts =
        vec![("what", "scene of lights".into()), ("format", "glTF 2.0".into()), ("lights", lights.into())];
    facts.extend(end(bytes));
    Some(facts)
}

/// A document that holds an image-based light and no mesh.
fn image_based_light(bytes: &[u8]) -> Result<Option<Facts>, Failure> {
    let Some(document) = containers::gltf_document(bytes) else { return Ok(None) };
    let lights = document.pointer("/extensions/EXT_lights_image_based/lights").and_then(Value::as_array);
    let Some(lights) = lights.filter(|_| document.get("meshes").is_none()) else { return Ok(None) };
    let mut facts: Facts = vec![
        ("what", "image-based light (EXT_lights_image_based)".into()),
        ("format", "glTF 2.0".into()),
        ("lights", lights.len().into()),
    ];
    if let Some(first) = lights.first() {
        for (label, member) in [("intensity", "intensity"), ("rotation", "rotation")] {
            facts.extend(first.get(member).map(|value| (label, value.clone())));
        }
        let rows = first.get("irradianceCoefficients").and_then(Value::as_array).map_or(0, Vec::len);
        facts.push(("irradiance", format!("{rows} coefficients").into()));
    }
    match containers::read_gltf_image_based_light(bytes) {
        Ok(light) => {
            facts.extend(super::texture::light(&light.cube));
            let values = light.cube.levels().flatten().map(|pixel| pixel.map(f64::from));
            facts.extend(super::facts::range("linear Rec. 709", values));
        }
        Err(error) => facts.push(("images", format!("not read: {error}").into())),
    }
    facts.extend(end(bytes));
    Ok(Some(facts))
}

/// The size and the place of a mesh.
pub(super) fn size(mesh: &Mesh) -> Facts {
    let (centre, radius) = mesh.bounds();
    let [x, y, z] = centre;
    vec![
        ("triangles", mesh.triangles().len().into()),
        ("vertices", mesh.positions().len().into()),
        ("coordinates", if mesh.coordinates().is_some() { "one set" } else { "none" }.into()),
        ("frame", "right-handed, +Z up; the front looks along +X".into()),
        ("around", format!("[{x:.6}, {y:.6}, {z:.6}], radius {radius:.6}").into()),
    ]
}
