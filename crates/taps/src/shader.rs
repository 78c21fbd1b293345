//! The look-up of taps as text for shaders, from one source for every language ([`shading_language`]).
//!
//! All names begin with `tap_` or `TAP_`, because the text becomes a part of a renderer's own shader.

use envmap::{Atlas, CubeMap, Image};

use crate::{FacetNode, FacetTable, FacetTap, ROWS, TapRow, TapTable, VariedTable, Weights, Widths};
pub use shading_language::Language;
use shading_language::Resource;
use shading_language::ResourceKind::{Cubes, Layers, Picture, Sampler, Vectors};

/// The textures that hold a scale space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Two arrays of cubes: the levels, with mips, and the light about normals.
    CubeArray,
    /// Two pictures without mips, in which each face has a border, for renderers without arrays of cubes.
    Atlas,
}

/// What a look-up is written for.
///
/// # Example: a world whose cubes are looked up with (z, y, x)
/// ```
/// use taps::{Language, LookUp, Source, TableShape, Widths};
/// let look_up = LookUp {
///     language: Language::Glsl,
///     source: Source::Atlas,
///     cube_coordinates: ["d.z", "d.y", "d.x"],
///     rows_from_bottom: false,
///     widths: Widths::new(64).unwrap(),
///     taps: 6,
///     normals: 1,
///     lights: 0,
///     table: TableShape::Angle,
/// };
/// assert!(look_up.functions().contains("vec3 tap_reflected(vec3 N, vec3 V) {"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookUp {
    /// The language.
    pub language: Language,
    /// The textures.
    pub source: Source,
    /// The cube coordinates (-y, z, x of Specula's frame) of a direction `d` of the renderer's world.
    pub cube_coordinates: [&'static str; 3],
    /// Whether the renderer turns pictures over, so that a place of 0 is at the bottom.
    pub rows_from_bottom: bool,
    /// The levels of the scale space.
    pub widths: Widths,
    /// The number J of look-ups in the levels.
    pub taps: usize,
    /// The number K of look-ups about the normal.
    pub normals: usize,
    /// The number of lights beside the levels; with none there is no function for them.
    pub lights: usize,
    /// What the table is.
    pub table: TableShape,
}

/// The table of taps, and what the function that looks it up takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableShape {
    /// By the angle between normal and view, [`table_texels`]: `tap_reflected(N, V)`.
    Angle,
    /// By the view in the frame of the surface, [`facet_texels`]: `tap_reflected(N, T, V)`. T is the tangent,
    /// of which the look-up takes what is at a right angle to N.
    Facets {
        /// Whether the table is over a quarter of the disc of views.
        is_quarter: bool,
    },
    /// So many tables over a parameter, [`varied_texels`]: `tap_reflected(N, V, v)` with [`Weights::Colour`],
    /// and `tap_reflected(N, V, roughness, F0)` with [`Weights::ScaleBias`].
    Varied(Weights, usize),
}

impl TableShape {
    fn is_varied(self) -> bool {
        matches!(self, Self::Varied(..))
    }
}

impl LookUp {
    /// The cube coordinates of a direction of Specula's own frame.
    pub const SPECULA: [&'static str; 3] = ["-d.y", "d.z", "d.x"];

    /// A whole text: the declarations and the functions.
    pub fn text(&self) -> String {
        self.source().text(self.language)
    }

    /// The declarations of the textures and, if there are some, the lights. A renderer that has its own way
    /// to bind textures declares these names itself.
    pub fn declarations(&self) -> String {
        self.source().declarations(self.language)
    }

    /// The constants and functions; `tap_reflected(N, V)`, or what [`TableShape`] says, is what a shader
    /// calls, and `tap_lights(N, V)` if there are lights. The latter calls `tap_brdf(N, V, L, radius)`, which
    /// stands before this text.
    pub fn functions(&self) -> String {
        self.source().functions(self.language)
    }

    fn source(&self) -> shading_language::Source {
        let levels = if self.source == Source::CubeArray { Cubes } else { Picture };
        let table = if self.table.is_varied() { Layers } else { Picture };
        let mut resources = vec![
            Resource { name: "tap_levels", kind: levels },
            Resource { name: "tap_normals", kind: levels },
            Resource { name: "tap_table", kind: table },
            Resource {
                name: "tap_sampler",
                kind: Sampler("linear, also between mips, and clamped at edges"),
            },
        ];
        if self.lights > 0 {
            let names = ["tap_light_directions", "tap_light_irradiances"];
            resources.extend(names.map(|name| Resource { name, kind: Vectors(self.lights) }));
        }
        shading_language::Source {
            functions: self.wgsl(),
            resources,
            rows_from_bottom: self.rows_from_bottom,
        }
    }

    /// The constants and functions in WGSL, before their look-ups in textures are translated.
    fn wgsl(&self) -> String {
        let source = match self.source {
            Source::CubeArray => include_str!("shader/cube_array.wgsl"),
            Source::Atlas => include_str!("shader/atlas.wgsl"),
        };
        let lights = if self.lights > 0 { include_str!("shader/lights.wgsl") } else { "" };
        let (row, reflected) = match self.table {
            TableShape::Angle => (include_str!("shader/row.wgsl"), include_str!("shader/reflected.wgsl")),
            TableShape::Facets { .. } => {
                (include_str!("shader/facets.wgsl"), include_str!("shader/facets_look_up.wgsl"))
            }
            TableShape::Varied(Weights::Colour, _) => {
                (include_str!("shader/varied_row.wgsl"), include_str!("shader/varied.wgsl"))
            }
            TableShape::Varied(Weights::ScaleBias, _) => {
                (include_str!("shader/varied_row.wgsl"), include_str!("shader/by_reflectance.wgsl"))
            }
        };
        let mirror = match self.table {
            TableShape::Facets { is_quarter: true } => {
                "vec2f(2.0 * step(0.0, disc.x) - 1.0, 2.0 * step(0.0, disc.y) - 1.0)"
            }
            _ => "vec2f(1.0, 1.0)",
        };
        let across = if self.is_left_handed() { "cross(X, N)" } else { "cross(N, X)" };
        let reflected = reflected.replace("MIRROR", mirror).replace("ACROSS", across);
        let look_up = include_str!("shader/look_up.wgsl");
        let parts = [&self.constants(), source, row, look_up, &reflected, lights];
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        let text = parts.map(str::trim_end).collect::<Vec<_>>().join("\n\n") + "\n";
        let [x, y, z] = self.cube_coordinates;
        text.replace("CUBE_COORDINATES", &format!("vec3f({x}, {y}, {z})"))
    }

    /// Whether the axes of the renderer's world are left-handed, as those of cube coordinates are, so that a
    /// cross product points the other way.
    fn is_left_handed(&self) -> bool {
        let axes = self.cube_coordinates.map(|coordinate| coordinate.trim_start_matches('-'));
        let swaps = (0..3).flat_map(|i| (i + 1..3).map(move |k| axes[i] > axes[k]));
        let minuses = self.cube_coordinates.iter().map(|coordinate| coordinate.starts_with('-'));
        swaps.chain(minuses).filter(|is_turned| *is_turned).count() % 2 == 0
    }

    /// The constants of a material and a scale space.
    fn constants(&self) -> String {
        let edge = self.widths.edge();
        let sharpest = math::log2(self.widths.std(0));
        let (each, one) = match self.table {
            TableShape::Angle => ("two rows", "row"),
            TableShape::Facets { .. } => ("two pictures", "picture"),
            TableShape::Varied(Weights::Colour, _) => ("two layers", "layer"),
            TableShape::Varied(Weights::ScaleBias, _) => ("one layer", "layer"),
        };
        let rows = match self.table {
            TableShape::Varied(_, tables) => tables,
            _ => 2 * self.taps + self.normals,
        };
        let mut text = format!(
            "// Compact reflection maps of Specula: docs/taps.md.
const TAP_COUNT: i32 = {};  // look-ups between levels, each of {each} of the table
const TAP_NORMALS: i32 = {};  // look-ups about the normal, each of one {one}
const TAP_ROWS: i32 = {};
const TAP_SHARPEST: f32 = {sharpest:.7};  // log2 of the width of level 0, which is 2.4 / {edge} radians
const TAP_LAST: f32 = {}.0;  // the last level
",
            self.taps,
            self.normals,
            rows,
            self.widths.len() - 1,
        );
        if self.source == Source::Atlas {
            let Atlas { width, height, .. } =
                atlas(edge, self.widths.len()).unwrap_or_else(|| unreachable!("edges of octaves are halves"));
            text += &format!("const TAP_EDGE: f32 = {edge}.0;  // of a face of level 0, in texels\n");
            text += &format!(
                "const TAP_SIZE: vec2f = vec2f({width}.0, {height}.0);  // of the levels' picture\n"
            );
        }
        if let TableShape::Facets { is_quarter } = self.table {
            let (side, first) =
                if is_quarter { (FacetTable::QUARTER, "0.0") } else { (FacetTable::WHOLE, "-1.0") };
            text += &format!(
                "const TAP_SIDE: f32 = {side}.0;  // texels along an edge of each of the table's pictures\n"
            );
            text += &format!(
                "const TAP_FIRST: f32 = {first};  // the first place in the disc of views, which ends at 1\n"
            );
        }
        if self.lights > 0 {
            text += &format!("const TAP_LIGHTS: i32 = {};\n", self.lights);
        }
        text
    }
}

/// The table that shaders look up: a picture of 65 columns, column i for 1 - cos(theta_v) = i / 64, and of
/// two rows for each look-up between levels and one for each about the normal.
///
/// Rows 2 j and 2 j + 1 are (delta, log2 of the width, 0, 0) and (r, g, b, 0) of look-up j, both angles in
/// radians. The last rows are (r, g, b, y) of those about the normal. Widths, and not places between levels,
/// let one table serve scale spaces of every edge.
pub fn table_texels(table: &TapTable) -> Vec<[f32; 4]> {
    let row = |texel: &dyn Fn(usize) -> [f64; 4]| -> Vec<[f32; 4]> {
        (0..table.rows().len()).map(|column| texel(column).map(|value| value as f32)).collect()
    };
    let rows = table.rows();
    let taps = (0..table.taps()).flat_map(|j| {
        let shape = row(&|column| {
            let tap = rows[column].taps[j];
            [tap.delta, math::log2(tap.std), 0.0, 0.0]
        });
        let weight = row(&|column| {
            let [r, g, b] = rows[column].taps[j].weight;
            [r, g, b, 0.0]
        });
        [shape, weight]
    });
    let normals = (0..table.normals()).map(|j| {
        row(&|column| {
            let tap = rows[column].normals[j];
            let [r, g, b] = tap.weight;
            [r, g, b, tap.y]
        })
    });
    taps.chain(normals).flatten().collect()
}

/// The array of pictures that shaders look up for taps over a parameter: 65 columns as in [`table_texels`],
/// a row for each table, and the number of layers.
///
/// With [`Weights::Colour`] its layers are the rows of [`table_texels`]. With [`Weights::ScaleBias`] layer j
/// is (delta, log2 of the width, scale, bias) of look-up j, and the last layers (y, 0, scale, bias) of those
/// about the normal.
pub fn varied_texels(varied: &VariedTable) -> (usize, Vec<[f32; 4]>) {
    let tables: Vec<Vec<[f32; 4]>> = match varied.weights() {
        Weights::Colour => varied.tables().iter().map(table_texels).collect(),
        Weights::ScaleBias => varied.tables().iter().map(scale_bias_texels).collect(),
    };
    let layers = tables[0].len() / ROWS;
    let rows = (0..layers).flat_map(|layer| tables.iter().map(move |table| &table[layer * ROWS..][..ROWS]));
    (layers, rows.flatten().copied().collect())
}

fn scale_bias_texels(table: &TapTable) -> Vec<[f32; 4]> {
    let layer = |texel: &dyn Fn(&TapRow) -> [f64; 4]| -> Vec<[f32; 4]> {
        table.rows().iter().map(|row| texel(row).map(|value| value as f32)).collect()
    };
    let taps = (0..table.taps()).map(|j| {
        layer(&|row| {
            let tap = row.taps[j];
            [tap.delta, math::log2(tap.std), tap.weight[0], tap.weight[1]]
        })
    });
    let normals = (0..table.normals()).map(|j| {
        layer(&|row| {
            let tap = row.normals[j];
            [tap.y, 0.0, tap.weight[0], tap.weight[1]]
        })
    });
    taps.chain(normals).flatten().collect()
}

/// The table of facets that shaders look up: pictures of the square of nodes, below each other, two for each
/// look-up between levels and one for each about the normal.
///
/// Pictures 2 j and 2 j + 1 are (p, q, log2 of the width, 0) and (r, g, b, 0) of look-up j, the width in
/// radians. The last pictures are (r, g, b, y) of those about the normal.
pub fn facet_texels(table: &FacetTable) -> Vec<[f32; 4]> {
    let picture = |texel: &dyn Fn(&FacetNode) -> [f64; 4]| -> Vec<[f32; 4]> {
        table.nodes().iter().map(|node| texel(node).map(|value| value as f32)).collect()
    };
    let taps = (0..table.taps()).flat_map(|j| {
        let shape = picture(&|node| {
            let FacetTap { slope: [p, q], std, .. } = node.taps[j];
            [p, q, math::log2(std), 0.0]
        });
        let weight = picture(&|node| {
            let [r, g, b] = node.taps[j].weight;
            [r, g, b, 0.0]
        });
        [shape, weight]
    });
    let normals = (0..table.normals()).map(|j| {
        picture(&|node| {
            let tap = node.normals[j];
            let [r, g, b] = tap.weight;
            [r, g, b, tap.y]
        })
    });
    taps.chain(normals).flatten().collect()
}

/// The picture of all levels, or of the light about normals, for renderers without arrays of cubes. Its
/// places are those of [`Atlas`]; 64 texels and 24 levels make 400 x 432, the light about normals 72 x 108.
pub fn atlas_picture(levels: &[CubeMap]) -> Option<Image> {
    let bordered: Vec<_> = levels.iter().map(CubeMap::bordered).collect();
    atlas(levels.first()?.cube().edge, levels.len())?.pack(&bordered)
}

fn atlas(edge: usize, levels: usize) -> Option<Atlas> {
    Atlas::new(edge, Widths::PER_OCTAVE, levels)
}

#[cfg(test)]
mod tests;
