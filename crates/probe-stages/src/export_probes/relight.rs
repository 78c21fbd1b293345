//! The transport of probes for programs that light them themselves: halves, and the JavaScript and WGSL that
//! multiply them by a sky, by lamps and by emission.
//!
//! Columns are the sky in Specula's own convention, as `export-sh` writes it. Rows are in the axes of glTF
//! files, so that what comes out needs no turning. What probes have from others is in their own matrix
//! already.

use containers::tensors::{ProbeLamps, ProbeTransport};
use engine::Failure;
use half::f16;
use serde::Serialize;

use super::axes::{Grid, OF_FILES, Rows};
use super::json::document;
use super::light::check_halves;

/// The files, in the order of their contents.
pub(crate) const NAMES: [&str; 5] =
    ["/transport.bin", "/relight.js", "/relight.wgsl", "/README.txt", "/transport.json"];

/// The rows of a probe.
const ROWS: usize = 9;

/// The members of `transport.json`.
#[derive(Serialize)]
struct File {
    format: &'static str,
    frame: &'static str,
    scale: &'static str,
    numbers: &'static str,
    probes: usize,
    sky: Section,
    emission: Section,
    lamps: Section,
    grids: Vec<GridEntry>,
}

/// A part of `transport.bin`: [probe, row, column, channel].
#[derive(Serialize)]
struct Section {
    columns: usize,
    channels: usize,
    offset: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    names: Vec<String>,
}

/// The probes of a volume, x fastest, and the first of them.
#[derive(Serialize)]
struct GridEntry {
    name: String,
    resolution: [usize; 3],
    first: usize,
}

/// Numbers of a probe: [row, column, channel].
type Matrix = Vec<f32>;

/// The files of a transport, with the indirect light of lamps and all light of emissive materials.
///
/// # Errors
/// If the lamps belong to another transport, or a number has no half.
pub(crate) fn files(
    stored: &ProbeTransport,
    lamps: Option<&ProbeLamps>,
    recipe: &str,
) -> Result<Vec<Vec<u8>>, Failure> {
    let ProbeTransport { transport, places, .. } = stored;
    let (probes, rows) = (transport.len(), transport.degree().rows());
    if let Some(lamps) = lamps {
        let is_own = lamps.places_digest == stored.places_digest && lamps.surfaces == stored.surfaces;
        if !is_own || lamps.degree != transport.degree() {
            return Err(Failure::new("the lamps belong to another transport")
                .help("bake both from the same scene and places, with the same degree"));
        }
    }
    let (mut order, mut grids) = (Vec::new(), Vec::new());
    for volume in places.volumes() {
        let (first, grid) = (order.len(), Grid::of(volume, OF_FILES));
        order.extend(grid.probes().map(|probe| first + probe));
        grids.push(GridEntry { name: volume.name.clone(), resolution: grid.counts, first });
    }
    order.extend(order.len()..probes);
    let (columns, channels) = (transport.sky_degree().rows(), transport.channels());
    let sky = |probe: usize| {
        let length = rows * columns * channels;
        transport.sky()[probe * length..][..ROWS * columns * channels].to_vec()
    };
    let emitters = transport.emitters();
    let emission = |probe: usize| {
        let of = |values: &[f32], emitter: usize, index: usize| {
            values[(probe * emitters + emitter) * 3 * rows..][index]
        };
        from_columns(emitters, |emitter, index| {
            of(transport.direct(), emitter, index) + of(transport.indirect(), emitter, index)
        })
    };
    let lit = lamps.map_or(&[][..], |lamps| &lamps.columns);
    let of_lamps = |probe: usize| {
        from_columns(lit.len(), |lamp, index| {
            lit[lamp].indirect.get(probe * 3 * rows + index).copied().unwrap_or(0.0)
        })
    };
    let mut bytes = Vec::new();
    let mut section = |columns: usize, channels: usize, matrix: &dyn Fn(usize) -> Matrix| {
        let length = ROWS * columns * channels;
        let mut all: Vec<f32> = (0..probes).flat_map(matrix).collect();
        if length > 0 {
            places.dilate(&mut all, length);
        }
        let offset = bytes.len();
        for probe in &order {
            let turned = turned(&all[probe * length..][..length], columns * channels);
            check_halves(&turned, "the transport", "halves end there; a lamp beside a probe may pass it")?;
            bytes.extend(turned.iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()));
        }
        // WGSL reads two halves at a time.
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        Ok::<_, Failure>(Section { columns, channels, offset, names: Vec::new() })
    };
    let sky = section(columns, channels, &sky)?;
    let emission = section(emitters, 3, &emission)?;
    let lamp_section = section(lit.len(), 3, &of_lamps)?;
    let names = lamps.map_or_else(Vec::new, |lamps| lamps.names.clone());
    let file = File {
        format: "specula probe transport 1",
        frame: "columns: Specula's own convention, +Z up; rows: right-handed, +Y up, axes of the glTF file",
        scale: "radiance, orthonormal harmonics without Condon-Shortley phase",
        numbers: "transport.bin",
        probes,
        sky,
        emission,
        lamps: Section { names, ..lamp_section },
        grids,
    };
    let text = |text: &str| text.as_bytes().to_vec();
    Ok(vec![
        bytes,
        text(include_str!("relight.js")),
        text(include_str!("relight.wgsl")),
        text(include_str!("relight.txt")),
        document(&file, recipe)?,
    ])
}

/// The matrix of coloured columns: `value` gives a column's number of a row and channel, [row, channel].
fn from_columns(columns: usize, value: impl Fn(usize, usize) -> f32) -> Matrix {
    let entry = |index: usize| {
        let (row, column, channel) = (index / (3 * columns), index / 3 % columns, index % 3);
        value(column, 3 * row + channel)
    };
    (0..3 * ROWS * columns).map(entry).collect()
}

/// A matrix with its rows in the axes of files; `width` numbers a row.
fn turned(matrix: &[f32], width: usize) -> Matrix {
    let mut turned = vec![0.0; matrix.len()];
    for column in 0..width {
        let rows: Rows = std::array::from_fn(|row| [matrix[row * width + column], 0.0, 0.0]);
        for (row, value) in OF_FILES.rows(&rows).iter().enumerate() {
            turned[row * width + column] = value[0];
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use containers::tensors::TransportPrecision;
    use probes::{Lattice, Transport, TransportParts, Volume};
    use sh::{Degree, Expansion};

    use super::*;
    use crate::testkit::{noise, places};

    /// The file times a sky and an emission is what the kernel lights, in the axes of files.
    #[test]
    fn the_file_times_a_sky_is_the_light() {
        let volume =
            Volume::new("a".into(), [[0.0; 3], [2.0, 1.0, 3.0]], [2, 1, 3], Lattice::Centres).unwrap();
        let (count, degree) = (7, Degree::new(3).unwrap());
        for channels in [1, 3] {
            let values = |length: usize, first: usize| (0..length).map(|k| noise(first + k)).collect();
            let parts = TransportParts {
                degree,
                sky_degree: Degree::new(2).unwrap(),
                channels,
                emitters: 2,
                sky: values(count * 16 * 9 * channels, 0),
                direct: values(count * 2 * 16 * 3, 50_000),
                indirect: values(count * 2 * 16 * 3, 60_000),
                paths: vec![1; count],
                errors: vec![0.0; count],
            };
            let stored = ProbeTransport {
                transport: Transport::from_parts(parts).unwrap(),
                precision: TransportPrecision::Single,
                places: places(vec![volume.clone()], vec![[0.5; 3]]),
                places_digest: String::new(),
                surfaces: String::new(),
            };
            let files = files(&stored, None, "{}").unwrap();
            let json: serde_json::Value = serde_json::from_slice(&files[4]).unwrap();
            let half = |at: usize| f64::from(f16::from_le_bytes([files[0][at], files[0][at + 1]]).to_f32());
            let number = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
            let mut sky = Expansion::zero(Degree::new(2).unwrap());
            for (k, row) in sky.coefficients_mut().iter_mut().enumerate() {
                *row = [0, 1, 2].map(|channel| f64::from(noise(70_000 + 3 * k + channel)));
            }
            let colours = [[0.3, 0.5, 0.9], [0.8, 0.2, 0.1]];
            let grid = Grid::of(&volume, OF_FILES);
            let order: Vec<usize> = grid.probes().chain([6]).collect();
            for (place, probe) in order.into_iter().enumerate() {
                let mut rows = vec![[0.0; 3]; degree.rows()];
                stored.transport.add_sky(probe, &sky, &mut rows);
                for (emitter, colour) in colours.into_iter().enumerate() {
                    stored.transport.add_emission(probe, emitter, colour, true, &mut rows);
                }
                let rows: Rows = std::array::from_fn(|row| rows[row].map(|value| value as f32));
                let expected = OF_FILES.rows(&rows);
                for row in 0..9 {
                    for channel in 0..3 {
                        let mut found = 0.0;
                        for column in 0..9 {
                            let at = ((place * 9 + row) * 9 + column) * channels + channel % channels;
                            let at = number(&json["sky"]["offset"]) + 2 * at;
                            found += half(at) * sky.coefficients()[column][channel];
                        }
                        for (emitter, colour) in colours.iter().enumerate() {
                            let at = ((place * 9 + row) * 2 + emitter) * 3 + channel;
                            found += half(number(&json["emission"]["offset"]) + 2 * at) * colour[channel];
                        }
                        let error = (found - f64::from(expected[row][channel])).abs();
                        assert!(error < 2e-3, "{channels} channels, probe {probe}, row {row}: {error}");
                    }
                }
            }
            assert_eq!(json["grids"][0]["resolution"], serde_json::json!([1, 3, 2]));
            assert_eq!(json["lamps"]["columns"], 0);
        }
    }
}
