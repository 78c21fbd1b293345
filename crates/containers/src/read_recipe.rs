//! Finding the recipe in a file of any format.

use crate::format::Format;
use crate::textures::{babylon_env, ktx1, ktx2};
use crate::values::{gltf, light_rig, lighting_json, tensors, web_page};

/// The recipe in a file of any format that is written here; `None` if there is none.
pub fn read_recipe(bytes: &[u8]) -> Option<String> {
    match Format::sniff(bytes) {
        Some(format) => (format.codec().recipe)(bytes),
        None if bytes.first() == Some(&b'{') => {
            lighting_json::read_recipe(bytes).or_else(|| gltf::read_recipe(bytes))
        }
        None if light_rig::is_usda(bytes) => light_rig::read_usda_recipe(bytes),
        None if web_page::is_web_page(bytes) => web_page::read_recipe(bytes),
        None if gltf::is_glb(bytes) => gltf::read_recipe(bytes),
        None if ktx2::is_ktx2(bytes) => ktx2::read_recipe(bytes),
        None if ktx1::is_ktx1(bytes) => ktx1::read_recipe(bytes),
        None if babylon_env::is_babylon_env(bytes) => babylon_env::read_recipe(bytes),
        None => tensors::read_recipe(bytes),
    }
}
