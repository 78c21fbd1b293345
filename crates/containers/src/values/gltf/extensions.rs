//! Extensions that a file requires. One that is not read makes the file an error, unless it does not concern
//! what is read of it: a mesh, or one material.

use serde_json::{Map, Value};

use super::element::Element;
use crate::error::Error;

/// Prefixes of the extensions that are read for meshes, or do not concern them.
const OF_MESHES: [&str; 11] = [
    "KHR_mesh_quantization",
    "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_animation_",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_dds",
];

/// Prefixes of the extensions that do not concern materials, beside extensions of other materials. A texture
/// says itself if its picture cannot be read.
const OF_MATERIALS: [&str; 14] = [
    "KHR_mesh_",
    "KHR_draco_",
    "KHR_meshopt_",
    "EXT_mesh_",
    "EXT_meshopt_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_animation_",
    "KHR_node_",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_dds",
    "KHR_materials_variants",
];

/// Refuses a document whose meshes need more than is read.
pub(super) fn check_for_meshes(required: &[String]) -> Result<(), Error> {
    let is_known = |name: &str| OF_MESHES.iter().any(|known| name.starts_with(known));
    refuse(required.iter().map(String::as_str).filter(|name| !is_known(name)).collect())
}

/// Refuses a document of which a material needs more than the extensions that are read of it.
pub(super) fn check_for_material(
    document: &Map<String, Value>,
    material: &Element<'_>,
    read: &[&str],
) -> Result<(), Error> {
    let required = Element::of(document, "extensionsRequired");
    let mut unread = Vec::new();
    for index in 0..required.count() {
        let Some(name) = required.element(index).text()? else { continue };
        let is_of_others =
            name.starts_with("KHR_materials_") && !material.get("extensions").get(name).is_present();
        let is_known = read.contains(&name) || OF_MATERIALS.iter().any(|known| name.starts_with(known));
        if !is_known && !is_of_others {
            unread.push(name);
        }
    }
    refuse(unread)
}

fn refuse(unread: Vec<&str>) -> Result<(), Error> {
    let remedy = match unread.as_slice() {
        [] => return Ok(()),
        ["KHR_materials_pbrSpecularGlossiness"] => {
            "convert its materials to metallic and roughness, for example with `gltf-transform metalrough`"
        }
        names if names.iter().all(|name| name.contains("compression")) => {
            "export it without (compression of meshes switched off)"
        }
        _ => "export it without",
    };
    Err(Error::unsupported(format!(
        "the file requires {}, which is not read here; {remedy}",
        unread.join(", ")
    )))
}
