//! What a page in a browser draws looks with: the shaders of [`crate::shading`] in the language of WebGL 2,
//! and the textures that they read.
//!
//! The files `web/*.glsl` are translations of `shading/*.wgsl` by naga, which a test of the feature `gpu`
//! makes anew and compares (`gpu/web_shaders.rs`; `UPDATE_EXPECT=1` writes them). One fragment shader has all
//! modes and all models of materials; what a program has of it is decided by the preprocessor
//! ([`WebProgram`]). WebGL 2 has no storage buffers: their elements are in uniform blocks or textures
//! (`web/elements.rs`). A compact map is looked up as in engines, by [`taps::LookUp`]: with the filters of
//! the device, whose weights have eight bits, and a third of the code.

mod base_color;
pub(crate) mod elements;
pub(crate) mod program;
mod texture;
mod transfer;

use brdf::BrdfTable;
use envmap::CubeMap;
use sh::{Degree, Expansion};
use taps::{AnyTable, Language, LookUp, Source, atlas_picture, facet_texels, table_texels};

pub use self::base_color::WebBaseColor;
use self::elements::{Elements, Place};
pub use self::program::WebProgram;
use self::program::{MODES, TEXTURED, vectors_name};
#[cfg(test)]
#[cfg(feature = "gpu")]
pub(crate) use self::texture::ELEMENTS;
pub use self::texture::{WebTexels, WebTexture};
pub use self::transfer::WebTransfer;
use self::transfer::turned_elements;
use crate::layered_map::{LayeredMap, MapProperties};
use crate::shading::harmonics::Harmonics;
use crate::shading::irradiance::Irradiance;
use crate::shading::lamps::PackedLamps;
use crate::shading::material::PackedMaterial;
use crate::shading::table::TableUniforms;
use crate::shading::turned_light::MAX_DEGREE;
use crate::{CompactMap, Light, Look, Mode, RenderError};

/// What a pixel of a mode costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// The texels of maps that it reads. Tables of a few kilobytes, which a cache holds, are not counted.
    pub fetches: usize,
    /// The lights beside the map that it adds by the material's model.
    pub lights: usize,
}

impl Cost {
    /// The most of each.
    #[must_use]
    pub fn most(self, other: Self) -> Self {
        Self { fetches: self.fetches.max(other.fetches), lights: self.lights.max(other.lights) }
    }
}

/// What a mode's shader reads of a look, beside the camera and the exposure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WebView {
    /// The shaders, for the models of the lights' material alone.
    pub program: WebProgram,
    /// Whether the mode shows the material, and thus the texture of its base colour ([`WebBaseColor`]).
    pub shows_material: bool,
    /// What a pixel costs.
    pub cost: Cost,
    /// The textures.
    pub textures: Vec<WebTexture>,
    /// The uniform blocks of elements, by the name of their array.
    pub blocks: Vec<(&'static str, Vec<u32>)>,
    /// The values of uniforms, by their names.
    pub uniforms: Vec<(&'static str, f64)>,
}

impl WebView {
    /// What a mode reads of a look; `None` of modes that a page does not draw. [`Mode::Transfer`] is that of
    /// matte meshes, a white one under the light alone ([`WebTransfer`]).
    ///
    /// # Errors
    /// If the look cannot make the map of the mode.
    pub fn of(look: &Look, mode: Mode) -> Result<Option<Self>, RenderError> {
        if mode == Mode::Transfer {
            return Ok(Some(Self::matte_transfer(look.light())));
        }
        if !MODES.contains(&mode) {
            return Ok(None);
        }
        let mut view = match mode {
            Mode::Mirror => Self::sky(look.light()),
            Mode::Irradiance => {
                let rows = Irradiance::new(look.light().lighting());
                let texels = rows.rows().iter().map(|row| row.extend(0.0).to_array()).collect();
                let rows = WebTexture {
                    name: "map",
                    size: [9, 1, 1],
                    is_array: true,
                    is_linear: false,
                    texels: WebTexels::Rgba(texels),
                };
                Self { textures: vec![rows], cost: Cost { fetches: 9, lights: 0 }, ..Self::default() }
            }
            Mode::Taps => Self::taps(look.compact_map()?)?,
            Mode::Table => match look.table().filter(|_| shows_table(look)) {
                Some(table) => Self::table(table, look.table_light()),
                None => return Ok(None),
            },
            mode => match LayeredMap::of(look, mode)? {
                Some(map) => Self::layers(&map, mode),
                None => return Ok(None),
            },
        };
        view.program = WebProgram::of_mode(mode);
        view.shows_material = mode.shows_material();
        if matches!(mode, Mode::LocalShrm | Mode::Irradiance) {
            let degrees = view.uniforms.iter().filter(|(name, _)| name.ends_with(".degree"));
            let degree = degrees.map(|(_, degree)| *degree as usize).max().unwrap_or(2);
            let constants = Harmonics::new(degree).constants();
            let constants: Vec<_> = constants.iter().map(|[a, b]| [*a, *b, 0.0, 0.0]).collect();
            view.hold(Elements::Vectors(&constants), "harmonics_constants");
        }
        if let (Mode::Table, Some(table)) = (mode, look.table()) {
            let light = look.table_light();
            let [light, quarter_turns] = turned_elements(light, light.degree().min(table.degree()));
            view.hold(Elements::Vectors(&light), "table_light");
            view.hold(Elements::Vectors(&quarter_turns), "quarter_turns");
        }
        let lamps = match mode {
            Mode::Taps => Some(PackedLamps::beside(look.compact_map()?)),
            mode if mode.adds_lamps() => Some(PackedLamps::beside_map(look, mode)),
            _ => None,
        };
        if let Some(lamps) = lamps {
            view.cost.lights = lamps.count() as usize;
            view.program.define_models(&lamps.material().map(PackedMaterial::models).unwrap_or_default());
            let material = PackedMaterial::new(lamps.material())?;
            view.hold(Elements::Vectors(lamps.elements()), "lamps");
            view.hold(Elements::Words(material.words()), "material");
        }
        if mode == Mode::Taps {
            view.program.functions = look_up(look.compact_map()?);
        }
        Ok(Some(view))
    }

    /// Adds the elements of an array.
    fn hold(&mut self, elements: Elements<'_>, array: &'static str) {
        match elements.placed(array) {
            Place::Block(words) => {
                self.program.defines.insert(vectors_name(array), words.len() / 4);
                self.blocks.push((array, words));
            }
            Place::Texture(texture) => self.textures.push(texture),
        }
    }

    /// This view with the texture of the material's base colour; unchanged if its mode shows no material.
    #[must_use]
    pub fn with_base_color(mut self, base_color: WebBaseColor) -> Self {
        if self.shows_material {
            self.program.defines.insert(TEXTURED.to_owned(), 1);
            self.cost.fetches += WebBaseColor::FETCHES;
            self.textures.extend(base_color.textures);
            self.blocks.extend(base_color.blocks);
        }
        self
    }

    /// What the shader of the sky reads of a light.
    pub fn sky(light: &Light) -> Self {
        let (grid, texels) = (light.environment().grid(), light.environment().pixels().iter().copied());
        let texels = WebTexels::Rgb(texels.collect());
        let map = WebTexture {
            name: "map",
            size: [grid.width, grid.height, 1],
            is_array: true,
            is_linear: false,
            texels,
        };
        let cost = Cost { fetches: 4, lights: 0 };
        Self { program: WebProgram::sky(), textures: vec![map], cost, ..Self::default() }
    }

    /// The textures of a compact map, for the look-up that engines have.
    fn taps(map: &CompactMap) -> Result<Self, RenderError> {
        let table = map.taps.table();
        let (width, texels) = match table {
            AnyTable::Angle(table) => (taps::ROWS, table_texels(table)),
            AnyTable::View(table) => (table.side(), facet_texels(table)),
        };
        let size = [width, texels.len() / width, 1];
        let texels = WebTexels::Halves(texels);
        let of_levels = |name, levels: &[CubeMap]| {
            let picture =
                atlas_picture(levels).ok_or_else(|| RenderError::maps("the levels make no atlas"))?;
            let size = [picture.width(), picture.height(), 1];
            let texels = WebTexels::Rgb(picture.pixels().to_vec());
            Ok::<_, RenderError>(WebTexture { name, size, is_array: false, is_linear: true, texels })
        };
        let table_texture = WebTexture { name: "tap_table", size, is_array: false, is_linear: true, texels };
        let textures = vec![
            of_levels("tap_levels", map.scales.levels())?,
            of_levels("tap_normals", map.scales.normals())?,
            table_texture,
        ];
        // Four texels of each of two levels or kernels.
        let fetches = 8 * (table.taps() + table.normals());
        Ok(Self { textures, cost: Cost { fetches, lights: 0 }, ..Self::default() })
    }

    /// The map of a BRDF table, as web/table.wgsl reads it.
    fn table(table: &BrdfTable, light: &Expansion) -> Self {
        let (size, rows, channels) = (table.size(), table.degree().rows(), table.channels());
        let values = table.values();
        let views = size * size;
        let is_grey = channels == 1;
        let layers = if is_grey { rows.div_ceil(4) } else { rows };
        let texel = |layer: usize, view: usize| {
            let of = &values[view * rows * channels..][..rows * channels];
            let components =
                if is_grey { &of[4 * layer..rows.min(4 * layer + 4)] } else { &of[3 * layer..][..3] };
            let mut texel = [0.0; 4];
            texel[..components.len()].copy_from_slice(components);
            texel
        };
        let texels = (0..layers).flat_map(|layer| (0..views).map(move |view| (layer, view)));
        let texture = WebTexture {
            name: "table_map",
            size: [size, size, layers],
            is_array: true,
            is_linear: true,
            texels: WebTexels::Halves(texels.map(|(layer, view)| texel(layer, view)).collect()),
        };
        let known = light.degree().min(table.degree()).rows();
        let of = TableUniforms::new(table, known);
        let uniforms = vec![
            ("table_uniforms.rows", f64::from(of.rows)),
            ("table_uniforms.channels", f64::from(of.channels)),
            ("table_uniforms.mirrored", f64::from(of.mirrored)),
            ("table_uniforms.light_rows", f64::from(of.light_rows)),
        ];
        // Four texels around the view, of each coefficient.
        let cost = Cost { fetches: 4 * known, lights: 0 };
        Self { textures: vec![texture], uniforms, cost, ..Self::default() }
    }

    /// What meshes with a matte transfer read of a light, beside their vectors.
    fn matte_transfer(light: &Light) -> Self {
        let light = light.lighting();
        let degree = light.degree().min(Degree::new(MAX_DEGREE).unwrap_or(light.degree()));
        let mut view = Self {
            program: WebProgram::transfer(),
            uniforms: vec![("transfer_uniforms.light_rows", degree.rows() as f64)],
            ..Self::default()
        };
        let [light, quarter_turns] = turned_elements(light, degree);
        view.hold(Elements::Vectors(&light), "transfer_light");
        view.hold(Elements::Vectors(&quarter_turns), "quarter_turns");
        view
    }

    fn layers(map: &LayeredMap<'_>, mode: Mode) -> Self {
        let (edge, count) = (map.edge(), map.count());
        let texels = WebTexels::Rgb(map.cubes().flatten().collect());
        let texture = WebTexture {
            name: "map",
            size: [edge, edge, 6 * count],
            is_array: true,
            is_linear: false,
            texels,
        };
        let mut uniforms = vec![("map_uniforms.count", map.parts().count() as f64)];
        for (names, of) in PART_UNIFORMS.iter().zip(map.parts()) {
            let MapProperties { centre, edge, degree, zonal, slices, first, weight } = of;
            let numbers = [centre, edge, degree, zonal.into(), slices, first].map(f64::from);
            uniforms.extend(names.iter().copied().zip(numbers.into_iter().chain([f64::from(weight)])));
        }
        // Four texels around a direction, of each cube that is read.
        let cubes = match mode {
            Mode::Cabral => 3 * map.parts().count(),
            Mode::KautzMcCool => 2 * map.parts().count(),
            _ => count,
        };
        let cost = Cost { fetches: 4 * cubes, lights: 0 };
        Self { textures: vec![texture], uniforms, cost, ..Self::default() }
    }
}

/// The names of the uniforms of each part of a map, in the order of [`MapProperties`].
const PART_UNIFORMS: [[&str; 7]; LayeredMap::MOST_PARTS] = [
    [
        "map_uniforms.parts[0].centre",
        "map_uniforms.parts[0].edge",
        "map_uniforms.parts[0].degree",
        "map_uniforms.parts[0].zonal",
        "map_uniforms.parts[0].slices",
        "map_uniforms.parts[0].first",
        "map_uniforms.parts[0].weight",
    ],
    [
        "map_uniforms.parts[1].centre",
        "map_uniforms.parts[1].edge",
        "map_uniforms.parts[1].degree",
        "map_uniforms.parts[1].zonal",
        "map_uniforms.parts[1].slices",
        "map_uniforms.parts[1].first",
        "map_uniforms.parts[1].weight",
    ],
];

/// Whether a page can draw the BRDF table of a look: that of one material under distant light.
pub fn shows_table(look: &Look) -> bool {
    let can = |table: &BrdfTable| table.count() == 1 && table.degree().get() <= MAX_DEGREE;
    !look.has_near_light() && look.table().is_some_and(|table| can(table))
}

/// The functions with which the shader looks up a compact map.
fn look_up(map: &CompactMap) -> String {
    let table = map.taps.table();
    let look_up = LookUp {
        language: Language::Glsl,
        source: Source::Atlas,
        cube_coordinates: LookUp::SPECULA,
        rows_from_bottom: false,
        widths: map.scales.widths(),
        taps: table.taps(),
        normals: table.normals(),
        lights: 0,
        table: table.shape(),
    };
    let arguments = match table {
        AnyTable::Angle(_) => "surface.normal, surface.view",
        AnyTable::View(_) => "surface.normal, surface.tangent, surface.view",
    };
    format!(
        "{}\nvec3 taps_radiance(Surface surface) {{\n    return tap_reflected({arguments});\n}}\n",
        look_up.text()
    )
}
