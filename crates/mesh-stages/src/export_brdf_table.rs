//! Writes a BRDF table: the coefficients c_i(v) of a material, for renderers that shade with them.
//!
//! ```toml
//! [stage.table-file]
//! kind = "export-brdf-table"
//! input = "table"
//! format = "ktx2"
//! path = "{material}/table"
//! ```
//!
//! The manual of `tabulate-brdf` explains them and the layout of the views. To shade a point, rotate the
//! light's coefficients into its frame (x, y the tangents, z the normal), look up the table at the view in
//! that frame, and sum the products of both, row by row. The same numbers serve all points of a mesh.
//!
//! | `format` | the file holds |
//! | --- | --- |
//! | `safetensors` | tensor `c` [Q, N, N, (F+1)^2, channels], 32-bit, one channel if the material is grey, else RGB; Q is the number of materials |
//! | `ktx2` | an array of 2D images with four coefficients per layer, in R, G, B and A: rows 0 to 3, then 4 to 7 and so on, zeros after the last; for an RGB table all layers of red, then green, then blue; then the next material |
//! | `exr` | a layer for each row, RGB: `l0m0` without a name, then `l1mm1` (l = 1, m = -1), `l1m0`, `l1m1` and so on; those of a second material begin with `q1` |
//!
//! Row l*l + l + m is the real orthonormal harmonic Y_lm without the Condon-Shortley phase. The metadata of
//! the file repeat all of this: `frame`, `basis`, `degree`, `channels`, `below` (which texel a view from
//! below the horizon uses) and `incident` (`hemisphere`, or `sphere` if light from below the horizon is
//! reflected), with the prefix `specula.` in KTX2 and OpenEXR. If two parameters of the material vary, `grid`
//! is `Q_a x Q_b`, and material a Q_b + b is at step a of the first and b of the second. Hardware can filter
//! the layers bilinearly; clamp at the edges.
//!
//! ```glsl
//! // The place of a view in the surface's frame.
//! vec2 place(vec3 v) {
//!     v.z = max(v.z, 0.0); // for `below` = mirrored: abs(v.z)
//!     vec2 p = v.z > 0.0 ? v.xy / (1.0 + v.z) : normalize(v.xy);
//!     return vec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y);
//! }
//! ```

use brdf::BrdfTable;
use containers::{Encoded, Error, Texture, brdf_table_metadata, coefficient_names, tensors};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use stages::artifacts;
use stages::plugin::{Container, Content, Encoding, FileFormat, Numbers, Writer};

choice! {
    /// The container.
    pub(crate) enum TableFormat {
        /// Safetensors.
        Safetensors = "safetensors",
        /// KTX2.
        Ktx2 = "ktx2",
        /// OpenEXR.
        Exr = "exr",
    }
}

impl FileFormat for TableFormat {
    fn container(self) -> Container {
        match self {
            Self::Safetensors => Container::Safetensors,
            Self::Ktx2 => Container::Ktx2,
            Self::Exr => Container::Exr,
        }
    }
}

parameters! {
    /// Parameters of `export-brdf-table`.
    pub(crate) struct Parameters {
        /// The container; see the table.
        format: TableFormat = TableFormat::Safetensors,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn encoding(&self) -> Encoding<TableFormat> {
        Encoding::new(self.format, self.numbers)
    }
}

/// The kind `export-brdf-table`.
pub(crate) struct ExportBrdfTable;

impl Kind for ExportBrdfTable {
    type Parameters = Parameters;

    const NAME: &'static str = "export-brdf-table";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[];
    const TEXT: &'static str = include_str!("export_brdf_table.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::BrdfTable>("table")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![parameters.format.container().ending().into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.encoding().check()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let table = &context.inputs.get::<artifacts::BrdfTable>("table")?.0;
        let writer = || parameters.encoding().writer(&texels(table), Content::Values, context);
        let bytes = match parameters.format {
            TableFormat::Safetensors => tensors::encode_brdf_table(table, Some(context.recipe()))?,
            TableFormat::Ktx2 => texture(table, &writer()?)?.bytes,
            TableFormat::Exr => layers(table, &writer()?)?.bytes,
        };
        context.reporter.note(format!("{} bytes", bytes.len()));
        Ok(Output::files(vec![bytes]))
    }
}

/// The file's entries, and the names of its rows.
fn entries(table: &BrdfTable, names: &[String]) -> Vec<(String, String)> {
    let entries = brdf_table_metadata(table).into_iter();
    let entries = entries.map(|(key, value)| (format!("specula.{key}"), value));
    entries.chain([("specula.rows".to_owned(), names.join(" "))]).collect()
}

fn borrowed(entries: &[(String, String)]) -> Vec<(&str, &str)> {
    entries.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}

/// The coefficients as colours; those of a table without colours are grey.
fn texels(table: &BrdfTable) -> Vec<[f32; 3]> {
    let colour = |values: &[f32]| match *values {
        [r, g, b] => [r, g, b],
        _ => [values[0]; 3],
    };
    table.values().chunks_exact(table.channels()).map(colour).collect()
}

/// The texels of one material's map.
fn map(table: &BrdfTable, q: usize) -> std::slice::ChunksExact<'_, f32> {
    let length = table.size() * table.size() * table.texel();
    table.values()[q * length..][..length].chunks_exact(table.texel())
}

/// A layer for four coefficients of one channel.
fn texture(table: &BrdfTable, writer: &Writer<'_>) -> Result<Encoded, Error> {
    let (rows, channels) = (table.degree().rows(), table.channels());
    let blocks = rows.div_ceil(4);
    let mut pixels = Vec::with_capacity(table.count() * channels * blocks * table.size() * table.size());
    for q in 0..table.count() {
        for channel in 0..channels {
            for first in (0..rows).step_by(4) {
                let value = |texel: &[f32], row: usize| {
                    if row < rows { texel[row * channels + channel] } else { 0.0 }
                };
                pixels.extend(map(table, q).map(|texel| [0, 1, 2, 3].map(|k| value(texel, first + k))));
            }
        }
    }
    let (size, layers) = (table.size(), table.count() * channels * blocks);
    let sizes = Texture { width: size, height: size, layers, ..Texture::default() };
    let entries = entries(table, &coefficient_names(table.degree().get()));
    writer.ktx2_rgba(&sizes, &pixels, &borrowed(&entries))
}

/// A layer for each coefficient, the first without a name.
fn layers(table: &BrdfTable, writer: &Writer<'_>) -> Result<Encoded, Error> {
    let (names, channels) = (coefficient_names(table.degree().get()), table.channels());
    let mut layers = Vec::new();
    for q in 0..table.count() {
        for (row, name) in names.iter().enumerate() {
            let colour = |texel: &[f32]| {
                [0, 1, 2].map(|channel| texel[row * channels + if channels == 1 { 0 } else { channel }])
            };
            let name = match (q, row) {
                (0, 0) => String::new(),
                (0, _) => name.clone(),
                _ => format!("q{q}{name}"),
            };
            layers.push((name, map(table, q).map(colour).collect()));
        }
    }
    let entries = entries(table, &names);
    writer.exr_layers([table.size(); 2], &layers, &borrowed(&entries), sh::Stop::NEVER)
}
