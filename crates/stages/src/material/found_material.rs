//! What is found in the file of a material.

use brdf::{BaseColorTexture, Material};
use containers::GltfMaterial;

/// A material, and notes on its files.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialFile {
    /// The material.
    pub material: Material,
    /// The picture of its base colour, of a material of a glTF file that has one.
    pub base_color: Option<BaseColorTexture>,
    /// Notes on measured files (values that were missing, out of gamut or interpolated) and on textures that
    /// were averaged.
    pub notes: Vec<String>,
    /// The statements of a glTF or MaterialX file about the material that are not read.
    pub warnings: Vec<String>,
}

impl From<Material> for MaterialFile {
    /// A material of which there is nothing to say.
    fn from(material: Material) -> Self {
        Self { material, base_color: None, notes: Vec::new(), warnings: Vec::new() }
    }
}

impl From<GltfMaterial> for MaterialFile {
    fn from(found: GltfMaterial) -> Self {
        let GltfMaterial { material, base_color, notes, warnings } = found;
        Self { material: Material::Standard(material), base_color, notes, warnings }
    }
}
