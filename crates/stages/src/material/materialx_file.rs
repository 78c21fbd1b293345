//! MaterialX files as materials.

use std::path::Path;

use brdf::Material;
use containers::{MaterialChoice, MaterialxMaterial, read_materialx_material};
use engine::Failure;

use super::material_file::MaterialFile;

/// Whether a file's name is that of a MaterialX file.
pub fn is_materialx_file(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mtlx"))
}

/// The material of a MaterialX file, `choice` if there are several.
pub(crate) fn read_materialx(bytes: &[u8], choice: Option<&MaterialChoice>) -> Result<MaterialFile, Failure> {
    let MaterialxMaterial { material, warnings } = read_materialx_material(bytes, choice)?;
    Ok(MaterialFile { material: Material::Standard(material), notes: Vec::new(), warnings })
}
