//! MaterialX: a material of a `.mtlx` file, as one that is the same everywhere.
//!
//! Surface shaders of the kinds `standard_surface` (version 1.0.1 of MaterialX 1.39) and `open_pbr_surface`
//! (OpenPBR 1.1) become a [`Standard`] material: [`shaders`] says how. Values are read, also those of
//! connected `constant` nodes. Textures and other nodes are not: a warning names each, and the shader's
//! default stands for it. Warnings also name what our material lacks, such as transmission and emitted light.
//! Each has its line.

mod document;
mod shader;
mod shaders;

use brdf::Standard;
use roxmltree::{Document, ParsingOptions};

use super::gltf::{MaterialChoice, find_material};
use crate::error::{Error, ErrorKind};
use document::{line, named};
use shader::Shader;

/// A material of a file, and what its user should know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialxMaterial {
    /// The material.
    pub material: Standard,
    /// Warnings of what the file says of the material and is not read, in the order of the file's lines.
    pub warnings: Vec<String>,
}

/// The most elements and texts of a file.
const MOST_NODES: u32 = 1 << 20;

/// Reads a material. Without a choice, the file must have one material only.
///
/// # Errors
/// If the file is not XML or not MaterialX, there is no such material, its surface shader is of another kind,
/// or a value has the wrong form. The message names the line.
pub fn read_materialx_material(
    bytes: &[u8],
    choice: Option<&MaterialChoice>,
) -> Result<MaterialxMaterial, Error> {
    let text = std::str::from_utf8(bytes).map_err(|_| Error::damaged("the text is not UTF-8"))?;
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let parsed = Document::parse_with_options(text.trim_start_matches('\u{feff}'), options);
    let document = parsed.map_err(|error| {
        let place = error.pos();
        Error::damaged(format!("line {}, column {}: not valid XML: {error}", place.row, place.col))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "materialx" {
        let name = root.tag_name().name();
        let message = format!("the root element is <{name}>; expected <materialx>");
        return Err(Error::new(ErrorKind::UnknownFormat, message));
    }
    let element = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
    let mut materials: Vec<_> = element("surfacematerial").collect();
    if materials.is_empty() {
        // Shaders alone are materials that no geometry is assigned yet.
        materials = shaders::SHADERS.iter().flat_map(|shader| element(shader.name)).collect();
    }
    if materials.is_empty() {
        let wrong = match element("material").next() {
            Some(old) => {
                let line = line(old);
                format!("line {line}: <material> is of MaterialX before 1.38; expected <surfacematerial>")
            }
            None => {
                let included = root.descendants().filter(|node| node.tag_name().name() == "include");
                let mut included = included.filter_map(|node| node.attribute("href"));
                let other =
                    included.next().map(|file| format!("; it includes {file}, which can be named itself"));
                let wrong = "the file has no <surfacematerial>, <standard_surface> or <open_pbr_surface>";
                format!("{wrong}{}", other.unwrap_or_default())
            }
        };
        return Err(Error::new(ErrorKind::NoSuchMaterial, wrong));
    }
    let names = materials
        .iter()
        .enumerate()
        .map(|(index, node)| node.attribute("name").map_or_else(|| index.to_string(), str::to_owned));
    let names = names.collect::<Vec<_>>();
    let material = materials[find_material(&names, choice)?];
    let shader = match material.has_tag_name("surfacematerial") {
        true => document::surface_shader(material)?,
        false => material,
    };
    let kind = shaders::SHADERS.iter().find(|known| shader.has_tag_name(known.name)).ok_or_else(|| {
        Error::unsupported(format!(
            "line {}: the surface shader of {} is <{}>; expected <standard_surface> or <open_pbr_surface>",
            line(shader),
            named(material),
            shader.tag_name().name()
        ))
    })?;
    let mut read = Shader::read(shader, (kind.inputs)(shader.attribute("version")))?;
    let parameters = (kind.parameters)(&mut read);
    let made = Standard::new(parameters);
    let material = made.map_err(|error| Error::damaged(format!("line {}: {error}", line(shader))))?;
    Ok(MaterialxMaterial { material, warnings: read.warnings() })
}

#[cfg(test)]
mod tests;
