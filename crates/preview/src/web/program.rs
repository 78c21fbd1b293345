//! The programs of a page: each is chosen from the same texts by what is defined before them.

use std::collections::{BTreeMap, BTreeSet};

use crate::Mode;

/// The vertex shader of meshes.
const MESH_VERTEX: &str = include_str!("mesh.vert.glsl");
/// The vertex shader of the sky and of differences, for three vertices without attributes.
const SKY_VERTEX: &str = include_str!("sky.vert.glsl");
/// The vertex shader of matte transfer, which shades.
const TRANSFER_VERTEX: &str = include_str!("transfer.vert.glsl");
/// The fragment shader of matte transfer.
const TRANSFER_FRAGMENT: &str = include_str!("transfer.frag.glsl");
/// The fragment shader of everything else.
const FRAGMENT: &str = include_str!("page.frag.glsl");

/// What the fragment shader can show, by the cases of `SHOWN` in fragment.wgsl.
pub(crate) const SHOWN: [&str; 3] = ["SHOWS_SKY", "SHOWS_DIFFERENCE", "SHOWS_MESH"];
/// What is defined if a mesh has the texture of a base colour.
pub(crate) const TEXTURED: &str = "TEXTURED";

/// The modes that the fragment shader has.
pub(crate) const MODES: [Mode; 8] = [
    Mode::LocalShrm,
    Mode::Cabral,
    Mode::KautzMcCool,
    Mode::Prefiltered,
    Mode::Irradiance,
    Mode::Mirror,
    Mode::Taps,
    Mode::Table,
];

/// What is defined if a program has this mode.
pub(crate) fn mode_name(mode: Mode) -> String {
    format!("MODE_{}", mode.name().replace('-', "_").to_uppercase())
}

/// What is defined if a program has this model of materials. A device that draws many pixels at once goes
/// through each formula that a shader has: with all models, a browser without a graphics device took more
/// than a minute for a picture.
pub(crate) fn model_name(model: u32) -> String {
    format!("MODEL_{model}")
}

/// What is defined as the number of vectors of an array that is in a uniform block.
pub(crate) fn vectors_name(array: &str) -> String {
    format!("{}_VECTORS", array.to_uppercase())
}

/// The shaders of a program in GLSL ES 3.00, without the line that says so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WebProgram {
    /// The vertex shader.
    pub vertex: &'static str,
    /// The fragment shader.
    pub fragment: &'static str,
    /// What has to be defined before both, and its value.
    pub defines: BTreeMap<String, usize>,
    /// Functions of the fragment shader that it only declares. They follow it.
    pub functions: String,
}

impl WebProgram {
    /// The program that draws the depth of meshes alone.
    pub fn depth() -> Self {
        Self::defining(MESH_VERTEX, [])
    }

    /// The program that draws the sky.
    pub fn sky() -> Self {
        Self::defining(SKY_VERTEX, [SHOWN[0].to_owned()])
    }

    /// The program that draws the difference of two pictures.
    pub fn difference() -> Self {
        Self::defining(SKY_VERTEX, [SHOWN[1].to_owned()])
    }

    /// The program of meshes in a mode, without models of materials.
    pub(super) fn of_mode(mode: Mode) -> Self {
        Self::defining(MESH_VERTEX, [SHOWN[2].to_owned(), mode_name(mode)])
    }

    /// Adds models of materials.
    pub(super) fn define_models(&mut self, models: &BTreeSet<u32>) {
        self.defines.extend(models.iter().map(|model| (model_name(*model), 1)));
    }

    /// The program of matte transfer.
    pub(super) fn transfer() -> Self {
        Self { fragment: TRANSFER_FRAGMENT, ..Self::defining(TRANSFER_VERTEX, []) }
    }

    fn defining(vertex: &'static str, names: impl IntoIterator<Item = String>) -> Self {
        let defines = names.into_iter().map(|name| (name, 1)).collect();
        Self { vertex, fragment: FRAGMENT, defines, functions: String::new() }
    }
}
