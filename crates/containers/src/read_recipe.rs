//! Finding the recipe in a file of any format.

use crate::format::Format;
use crate::textures::{babylon_env, container_of};
use crate::values::{gltf, light_rig, lighting_json, tensors, web_page};

/// The recipe in a file of any format that is written here; `None` if there is none.
pub fn read_recipe(bytes: &[u8]) -> Option<String> {
    if let Some(container) = container_of(bytes) {
        return (container.recipe)(bytes);
    }
    match Format::sniff(bytes) {
        Some(format) => (format.codec().recipe)(bytes),
        None if bytes.first() == Some(&b'{') => {
            lighting_json::read_recipe(bytes).or_else(|| gltf::read_recipe(bytes))
        }
        None if light_rig::is_usda(bytes) || light_rig::is_tscn(bytes) => light_rig::read_text_recipe(bytes),
        None if web_page::is_web_page(bytes) => web_page::read_recipe(bytes),
        None if gltf::is_glb(bytes) => gltf::read_recipe(bytes),
        None if babylon_env::is_babylon_env(bytes) => babylon_env::read_recipe(bytes),
        None => tensors::read_recipe(bytes),
    }
}
