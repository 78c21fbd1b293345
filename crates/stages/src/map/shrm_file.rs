//! The file of a spherical harmonic reflection map, and its entries.

use std::ops::Range;

use containers::{Encoded, Texture, row_names, shrm_metadata, tensors};
use engine::{Context, Failure};
use sh::{Light, Stop};
use shrm::{Shrm, Terms};

use crate::values::{Container, Content, Encoding, FileFormat, UntilStopped, Writer};

/// The file of one map, with the lights that it does not hold.
pub(super) fn file<F: FileFormat + Copy>(
    map: &Shrm,
    beside: &[Light],
    encoding: Encoding<F>,
    context: &Context<'_>,
) -> Result<Vec<u8>, Failure> {
    let writer = encoding.writer(map.values(), Content::Values, context)?;
    Ok(match encoding.container() {
        Container::Safetensors => tensors::encode_shrm(map, beside, Some(context.recipe()))?,
        Container::Exr => context.reporter.until_stopped(|stop| layers(map, beside, &writer, stop))?.bytes,
        _ => {
            too_many_layers(map).into_iter().for_each(|warning| context.reporter.warn(warning));
            texture(map, beside, &writer)?.bytes
        }
    })
}

/// The most layers of a texture array in WebGPU and WebGL 2; each face of a cube counts.
const MOST_LAYERS: usize = 256;

/// A warning if the map has more layers than browsers take.
fn too_many_layers(map: &Shrm) -> Option<String> {
    let ([faces, ..], rows) = (map.grid().shape(), map.rows());
    let layers = faces * rows;
    if layers <= MOST_LAYERS {
        return None;
    }
    let most = match map.terms() {
        Terms::All => (MOST_LAYERS / faces).isqrt() - 1,
        Terms::Zonal => MOST_LAYERS / faces - 1,
    };
    let flat = if faces > 1 && rows <= MOST_LAYERS {
        format!(", or layout = \"lat-long\", which has {rows}")
    } else {
        String::new()
    };
    Some(format!(
        "WebGPU and WebGL 2 cannot load this file: it has {layers} layers, and their texture arrays at most \
         {MOST_LAYERS}; set most-p = {most} or less{flat}"
    ))
}

/// The file's entries, and the names of its rows.
fn entries(map: &Shrm, beside: &[Light], rows: &[String]) -> Vec<(String, String)> {
    let entries = shrm_metadata(map).map(|(key, value)| (format!("specula.{key}"), value));
    let rows = ("specula.rows".to_owned(), rows.join(" "));
    entries.into_iter().chain([rows]).chain(lamp_entries(beside)).collect()
}

/// The entries of lights that the map does not hold.
pub(super) fn lamp_entries(beside: &[Light]) -> Vec<(String, String)> {
    let light = |light: &Light| {
        let ([x, y, z], [r, g, b]) = (light.direction.vector().to_array(), light.irradiance);
        serde_json::json!([x, y, z, light.radius, r, g, b])
    };
    let lights: serde_json::Value = beside.iter().map(light).collect();
    let lamps = [
        ("specula.lamps".to_owned(), "separate".to_owned()),
        ("specula.lights".to_owned(), lights.to_string()),
    ];
    lamps.into_iter().filter(|_| !beside.is_empty()).collect()
}

fn borrowed(entries: &[(String, String)]) -> Vec<(&str, &str)> {
    entries.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}

/// One of the coefficients that a map keeps, at a range of texels.
fn row(map: &Shrm, row: usize, texels: Range<usize>) -> impl Iterator<Item = [f32; 3]> {
    texels.map(move |texel| map.texel(texel)[row])
}

/// A layer for each coefficient that the map keeps.
fn texture(map: &Shrm, beside: &[Light], writer: &Writer<'_>) -> Result<Encoded, Failure> {
    let [faces, height, width] = map.grid().shape();
    let layers = map.rows();
    let pixels = (0..layers).flat_map(|layer| row(map, layer, 0..map.grid().len())).collect();
    let texture = Texture { width, height, layers, faces, pixels, ..Texture::default() };
    let entries = entries(map, beside, &row_names(map.p().get(), map.terms()));
    writer.texture(&texture, &borrowed(&entries))
}

/// A layer for each of the (P+1)^2 coefficients, the first without a name.
fn layers(
    map: &Shrm,
    beside: &[Light],
    writer: &Writer<'_>,
    stop: Stop<'_>,
) -> Result<Encoded, containers::Error> {
    let [faces, height, width] = map.grid().shape();
    let names = row_names(map.p().get(), Terms::All);
    let kept = row_names(map.p().get(), map.terms());
    let texels = map.grid().len();
    let layers: Vec<(String, Vec<[f32; 3]>)> = names
        .iter()
        .enumerate()
        .map(|(position, name)| {
            let pixels = match kept.iter().position(|kept| kept == name) {
                Some(layer) => row(map, layer, 0..texels).collect(),
                None => vec![[0.0; 3]; texels],
            };
            (if position == 0 { String::new() } else { name.clone() }, pixels)
        })
        .collect();
    let entries = entries(map, beside, &names);
    writer.exr_layers([width, faces * height], &layers, &borrowed(&entries), stop)
}
