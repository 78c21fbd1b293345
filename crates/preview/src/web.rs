//! What a page in a browser draws looks with: the shaders of [`crate::shading`] in the language of WebGL 2,
//! and the textures that they read.
//!
//! The files `web/*.glsl` are translations of `shading/*.wgsl` by naga, which a test of the feature `gpu`
//! makes anew and compares (`gpu/web_shaders.rs`; `UPDATE_EXPECT=1` writes them). WebGL 2 has no storage
//! buffers: their elements are in uniform blocks or textures (`web/elements.rs`). A compact map is looked up
//! as in engines, by [`taps::LookUp`]: with the filters of the device, whose weights have eight bits, and a
//! third of the code.

mod base_color;
mod elements;
mod specialised;
mod texture;
mod transfer;

use std::collections::BTreeSet;

use brdf::BrdfTable;
use envmap::CubeMap;
use sh::{Degree, Expansion};
use taps::{AnyTable, Language, LookUp, Source, atlas_picture, facet_texels, table_texels};

pub use self::base_color::WebBaseColor;
use self::elements::{Elements, Place};
use self::specialised::specialised;
#[cfg(test)]
#[cfg(feature = "gpu")]
pub(crate) use self::texture::ELEMENTS;
pub use self::texture::{WebTexels, WebTexture};
pub use self::transfer::WebTransfer;
use self::transfer::turned_elements;
use crate::layered_map::LayeredMap;
use crate::shading::harmonics::Harmonics;
use crate::shading::irradiance::Irradiance;
use crate::shading::lamps::PackedLamps;
use crate::shading::material::PackedMaterial;
use crate::shading::table::TableUniforms;
use crate::shading::turned_light::MAX_DEGREE;
use crate::{CompactMap, Light, Look, Mode, RenderError};

/// The vertex shader of meshes.
pub const MESH_VERTEX: &str = include_str!("web/mesh.vert.glsl");
/// The vertex shader of the sky and of differences, for three vertices without attributes.
pub const SKY_VERTEX: &str = include_str!("web/sky.vert.glsl");
/// The fragment shader of the sky.
pub const SKY_FRAGMENT: &str = include_str!("web/sky.frag.glsl");
/// The fragment shader of the difference of two pictures.
pub const DIFFERENCE_FRAGMENT: &str = include_str!("web/difference.frag.glsl");

/// The fragment shader of a mode for every model; `None` of modes that a page does not draw.
pub(crate) fn fragment(mode: Mode) -> Option<&'static str> {
    Some(match mode {
        Mode::LocalShrm => include_str!("web/local-shrm.frag.glsl"),
        Mode::Cabral => include_str!("web/cabral.frag.glsl"),
        Mode::KautzMcCool => include_str!("web/kautz-mccool.frag.glsl"),
        Mode::Prefiltered => include_str!("web/prefiltered.frag.glsl"),
        Mode::Irradiance => include_str!("web/irradiance.frag.glsl"),
        Mode::Mirror => include_str!("web/mirror.frag.glsl"),
        Mode::Taps => include_str!("web/taps.frag.glsl"),
        Mode::Table => include_str!("web/table.frag.glsl"),
        Mode::GlobalShrm | Mode::BruteForce | Mode::ShadowedBruteForce => return None,
        Mode::Transfer | Mode::Samples => return None,
    })
}

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
    /// The vertex shader; `None` if it is [`MESH_VERTEX`].
    pub vertex: Option<String>,
    /// The fragment shader, for the models of the lights' material alone.
    pub fragment: String,
    /// The fragment shader that reads the texture of the base colour ([`WebBaseColor`]) too; `None` if the
    /// mode does not show the material.
    pub textured: Option<String>,
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
        let Some(shader) = fragment(mode) else { return Ok(None) };
        let mut shader = shader.to_owned();
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
        if matches!(mode, Mode::LocalShrm | Mode::Irradiance) {
            let degree = view.uniforms.iter().find(|(name, _)| *name == "map_uniforms.degree");
            let degree = degree.map_or(2, |(_, degree)| *degree as usize);
            let constants = Harmonics::new(degree).constants();
            let constants: Vec<_> = constants.iter().map(|[a, b]| [*a, *b, 0.0, 0.0]).collect();
            shader = view.holding(Elements::Vectors(&constants), &shader, "harmonics_constants");
        }
        if let (Mode::Table, Some(table)) = (mode, look.table()) {
            let light = look.table_light();
            let [light, quarter_turns] = turned_elements(light, light.degree().min(table.degree()));
            shader = view.holding(Elements::Vectors(&light), &shader, "table_light");
            shader = view.holding(Elements::Vectors(&quarter_turns), &shader, "quarter_turns");
        }
        let lamps = match mode {
            Mode::Taps => Some(PackedLamps::beside(look.compact_map()?)),
            mode if mode.adds_lamps() => Some(PackedLamps::beside_map(look, mode)),
            _ => None,
        };
        let mut models = BTreeSet::new();
        if let Some(lamps) = lamps {
            view.cost.lights = lamps.count() as usize;
            models = lamps.material().map(PackedMaterial::models).unwrap_or_default();
            let material = PackedMaterial::new(lamps.material())?;
            shader = view.holding(Elements::Vectors(lamps.elements()), &shader, "lamps");
            shader = view.holding(Elements::Words(material.words()), &shader, "material");
        }
        if mode == Mode::Taps {
            shader = with_look_up(&shader, look.compact_map()?);
        }
        if mode.shows_material() {
            view.textured = Some(specialised(&shader, &models));
            shader = replaced(&shader, "vec3 mesh_radiance(", UNTEXTURED);
        }
        view.fragment = specialised(&shader, &models);
        Ok(Some(view))
    }

    /// Adds elements, and returns the shader that reads them from where they are.
    fn holding(&mut self, elements: Elements<'_>, shader: &str, name: &'static str) -> String {
        let (shader, place) = elements.placed(shader, name);
        match place {
            Place::Block(words) => self.blocks.push((name, words)),
            Place::Texture(texture) => self.textures.push(texture),
        }
        shader
    }

    /// This view with the texture of the material's base colour; unchanged if its mode shows no material.
    #[must_use]
    pub fn with_base_color(mut self, base_color: WebBaseColor) -> Self {
        if let Some(textured) = self.textured.take() {
            self.fragment = textured;
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
        Self { textures: vec![map], cost, fragment: SKY_FRAGMENT.to_owned(), ..Self::default() }
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
            fragment: transfer::FRAGMENT.to_owned(),
            uniforms: vec![("transfer_uniforms.light_rows", degree.rows() as f64)],
            ..Self::default()
        };
        let [light, quarter_turns] = turned_elements(light, degree);
        let shader = view.holding(Elements::Vectors(&light), transfer::VERTEX, "transfer_light");
        view.vertex = Some(view.holding(Elements::Vectors(&quarter_turns), &shader, "quarter_turns"));
        view
    }

    fn layers(map: &LayeredMap<'_>, mode: Mode) -> Self {
        let of = &map.properties;
        let edge = of.edge as usize;
        let texels = WebTexels::Rgb((0..map.count).flat_map(|cube| map.cube(cube)).collect());
        let texture = WebTexture {
            name: "map",
            size: [edge, edge, 6 * map.count],
            is_array: true,
            is_linear: false,
            texels,
        };
        let uniforms = vec![
            ("map_uniforms.centre", f64::from(of.centre)),
            ("map_uniforms.edge", f64::from(of.edge)),
            ("map_uniforms.degree", f64::from(of.degree)),
            ("map_uniforms.zonal", f64::from(u8::from(of.zonal))),
            ("map_uniforms.slices", f64::from(of.slices)),
            ("map_uniforms.coarse_edge", f64::from(of.coarse_edge)),
            ("map_uniforms.share", f64::from(of.share)),
        ];
        // Four texels around a direction, of each cube that is read.
        let cubes = match mode {
            Mode::Cabral => 3,
            Mode::KautzMcCool => 2,
            _ => map.count,
        };
        let cost = Cost { fetches: 4 * cubes, lights: 0 };
        Self { textures: vec![texture], uniforms, cost, ..Self::default() }
    }
}

/// Whether a page can draw the BRDF table of a look: that of one material under distant light.
pub fn shows_table(look: &Look) -> bool {
    let can = |table: &BrdfTable| table.count() == 1 && table.degree().get() <= MAX_DEGREE;
    !look.has_near_light() && look.table().is_some_and(|table| can(table))
}

/// The shader of taps with the look-up of a compact map.
fn with_look_up(shader: &str, map: &CompactMap) -> String {
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
    let own = format!(
        "{}\nvec3 taps_radiance(Surface surface) {{\n    return tap_reflected({arguments});\n}}\n",
        look_up.text()
    );
    replaced(shader, "vec3 taps_radiance(", &own)
}

/// What a surface without a texture shows: the radiance by the base colour of its material.
const UNTEXTURED: &str = "vec3 mesh_radiance(PageVertex at, Surface surface, vec3 radiance) {\n    \
                          return radiance;\n}\n";

/// The shader with a function in place of the one that begins so.
fn replaced(shader: &str, beginning: &str, function: &str) -> String {
    let (before, rest) = shader.split_once(beginning).unwrap_or((shader, ""));
    let (_, after) = rest.split_once("\n}\n").unwrap_or_default();
    [before, function, after].concat()
}
