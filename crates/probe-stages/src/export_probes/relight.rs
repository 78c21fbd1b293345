//! The transport of probes for programs that light them themselves: halves, and the JavaScript and WGSL that
//! multiply them by a sky, by lamps and by emission.
//!
//! Columns are the sky in Specula's own convention, as `export-sh` writes it. Rows are in the axes of glTF
//! files, so that what comes out needs no turning. What probes have from others is in their own matrix
//! already.

use engine::{Failure, Reporter};
use half::f16;
use probes::{ClusteredComponents, ProbePlaces};
use serde::Serialize;
use stages::plugin::UntilStopped;

use super::axes::{Grid, IRRADIANCE, OF_FILES, Rows};
use super::columns::Columns;
use super::light::check_halves;
use crate::json::document;

/// The files, in the order of their contents.
pub(crate) const NAMES: [&str; 5] =
    ["/transport.bin", "/relight.js", "/relight.wgsl", "/README.txt", "/transport.json"];

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

/// A part of `transport.bin`: [probe, row, column, channel], or [cluster, 1 + components, row, column,
/// channel].
#[derive(Serialize)]
struct Section {
    columns: usize,
    channels: usize,
    offset: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    names: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cpca: Option<Clusters>,
}

/// How the matrices of probes are made of those of clusters.
#[derive(Serialize)]
struct Clusters {
    clusters: usize,
    components: usize,
    /// Where the weights begin, halves: [probe, component].
    weights: usize,
    /// Where the clusters of the probes begin, a byte each.
    cluster_of: usize,
    /// The bytes of a probe, with its share of the clusters.
    bytes: f64,
    /// The error of irradiance: see the manual.
    error: f64,
    /// That of the probe with the largest.
    worst: f64,
}

/// The probes of a volume, x fastest, and the first of them.
#[derive(Serialize)]
struct GridEntry {
    name: String,
    resolution: [usize; 3],
    first: usize,
}

/// The files of a transport; that of the sky is compressed to so many bytes a probe, if a number is given.
///
/// # Errors
/// If a number has no half, or too few probes are to be compressed.
pub(crate) fn files(
    [sky, emission, lamps]: &[Columns; 3],
    places: &ProbePlaces,
    most_bytes: Option<usize>,
    recipe: &str,
    reporter: &Reporter,
) -> Result<Vec<Vec<u8>>, Failure> {
    let (mut order, mut grids) = (Vec::new(), Vec::new());
    for volume in places.volumes() {
        let (first, grid) = (order.len(), Grid::of(volume, OF_FILES));
        order.extend(grid.probes().map(|probe| first + probe));
        grids.push(GridEntry { name: volume.name.clone(), resolution: grid.counts, first });
    }
    order.extend(order.len()..places.len());
    let turned = |columns: &Columns| -> Vec<f32> {
        let length = columns.length();
        let width = columns.count * columns.channels;
        let own = |probe: &usize| rows_of_files(&columns.numbers[probe * length..][..length], width);
        order.iter().flat_map(own).collect()
    };
    let mut numbers = Numbers(Vec::new());
    let (of_sky, cpca) = match most_bytes {
        None => (turned(sky), None),
        Some(most) => {
            let (vectors, clusters) = compressed(&turned(sky), sky, most, &mut numbers, reporter)?;
            (vectors, Some(clusters))
        }
    };
    let sky = Section { cpca, ..numbers.section(sky, &of_sky)? };
    let (emission, lamps) =
        (numbers.section(emission, &turned(emission))?, numbers.section(lamps, &turned(lamps))?);
    let file = File {
        format: "specula probe transport 1",
        frame: "columns: Specula's own convention, +Z up; rows: right-handed, +Y up, axes of the glTF file",
        scale: "radiance, orthonormal harmonics without Condon-Shortley phase",
        numbers: "transport.bin",
        probes: places.len(),
        sky,
        emission,
        lamps,
        grids,
    };
    let text = |text: &str| text.as_bytes().to_vec();
    Ok(vec![
        numbers.0,
        text(include_str!("relight.js")),
        text(include_str!("relight.wgsl")),
        text(include_str!("relight.txt")),
        document(&file, recipe)?,
    ])
}

/// `transport.bin` as it grows.
struct Numbers(Vec<u8>);

impl Numbers {
    /// Adds halves, and returns where they begin.
    fn halves(&mut self, values: &[f32]) -> Result<usize, Failure> {
        check_halves(values, "the transport", "halves end there; a lamp beside a probe may pass it")?;
        Ok(self.bytes(values.iter().flat_map(|value| f16::from_f32(*value).to_le_bytes())))
    }

    /// Adds bytes, and returns where they begin: at a multiple of 4, because WGSL reads 4 at a time.
    fn bytes(&mut self, bytes: impl Iterator<Item = u8>) -> usize {
        let offset = self.0.len();
        self.0.extend(bytes);
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        offset
    }

    fn section(&mut self, columns: &Columns, numbers: &[f32]) -> Result<Section, Failure> {
        let Columns { count, channels, names, .. } = columns;
        let offset = self.halves(numbers)?;
        Ok(Section { columns: *count, channels: *channels, offset, names: names.clone(), cpca: None })
    }
}

/// Compresses the matrices of the sky: adds the weights and the clusters of probes to a file, and returns the
/// matrices of the clusters.
fn compressed(
    matrices: &[f32],
    sky: &Columns,
    most_bytes: usize,
    file: &mut Numbers,
    reporter: &Reporter,
) -> Result<(Vec<f32>, Clusters), Failure> {
    let (factors, length) = (importance(sky), sky.length());
    let found =
        reporter.until_stopped(|stop| ClusteredComponents::new(matrices, &factors, most_bytes, stop))?;
    let mut found = found.ok_or_else(|| {
        let message = format!(
            "{} probes are too few for cpca: with their matrices, clusters take more than {most_bytes} bytes a probe",
            matrices.len() / length
        );
        Failure::new(message).help("leave out `compression`, or raise `bytes`")
    })?;
    let (weights, cluster_of) = (file.halves(&found.weights)?, file.bytes(found.clusters.iter().copied()));
    // The errors are those of what the file holds.
    for values in [&mut found.weights, &mut found.vectors] {
        values.iter_mut().for_each(|value| *value = f16::from_f32(*value).to_f32());
    }
    let squares = |numbers: &[f32]| -> f64 {
        let scaled = numbers.iter().zip(&factors).map(|(x, factor)| f64::from(*x) * f64::from(*factor));
        scaled.map(|x| x * x).sum()
    };
    let of_probe = |(own, decoded): (&[f32], &[f32])| {
        squares(&own.iter().zip(decoded).map(|(a, b)| a - b).collect::<Vec<f32>>())
    };
    let decoded = found.decoded(length);
    let errors: Vec<f64> =
        matrices.chunks_exact(length).zip(decoded.chunks_exact(length)).map(of_probe).collect();
    let probes = found.clusters.len();
    let all: f64 = matrices.chunks_exact(length).map(squares).sum::<f64>() / probes as f64;
    let relative = |square: f64| (square / all.max(f64::MIN_POSITIVE)).sqrt();
    let bytes = probes + 2 * (found.weights.len() + found.vectors.len());
    let clusters = Clusters {
        clusters: found.vectors.len() / (length * (1 + found.components)),
        components: found.components,
        weights,
        cluster_of,
        bytes: bytes as f64 / probes as f64,
        error: relative(errors.iter().sum::<f64>() / probes as f64),
        worst: relative(errors.into_iter().fold(0.0, f64::max)),
    };
    reporter.note(format!(
        "cpca: {:.1} bytes a probe in place of {}, with {} clusters of {} components; the error of irradiance is \
         {:.2} % (RMS), {:.2} % at the worst probe",
        clusters.bytes,
        2 * length,
        clusters.clusters,
        clusters.components,
        100.0 * clusters.error,
        100.0 * clusters.worst
    ));
    Ok((found.vectors, clusters))
}

/// How much each number of a matrix counts: the factor of its row in irradiance over pi, times that of its
/// column in skies, whose harmonics of degree l have a variance of (l + 1)^-3 in photographs.
fn importance(sky: &Columns) -> Vec<f32> {
    let factor = |index: usize| {
        let (row, column) = (index / (sky.count * sky.channels), index / sky.channels % sky.count);
        let l = (column.isqrt() + 1) as f64;
        (IRRADIANCE[row.isqrt()] / (l * l.sqrt())) as f32
    };
    (0..sky.length()).map(factor).collect()
}

/// A matrix with its rows in the axes of files; `width` numbers a row.
fn rows_of_files(matrix: &[f32], width: usize) -> Vec<f32> {
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
    use containers::tensors::{ProbeTransport, TransportPrecision};
    use engine::Cancel;
    use probes::{Lattice, Transport, TransportParts, Volume};
    use sh::{Degree, Expansion};

    use super::*;
    use crate::export_probes::columns::columns;
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
                record: None,
            };
            let all = columns(&stored, None, None).unwrap();
            let reporter = Reporter::new(Cancel::default());
            let files = files(&all, &stored.places, None, "{}", &reporter).unwrap();
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

    /// Smooth matrices of 625 probes in 20 bytes each: the clusters and weights of the file are the matrices,
    /// with the error that the file names.
    #[test]
    fn compressed_matrices_have_the_error_that_the_file_names() {
        let counts = [25, 25, 1];
        let volume = Volume::new("a".into(), [[0.0; 3], [5.0, 5.0, 1.0]], counts, Lattice::Centres).unwrap();
        let sky = Columns { count: 4, channels: 1, names: Vec::new(), numbers: Vec::new() };
        let matrix = |probe: usize| {
            let [x, y, _] = volume.cell(probe).map(|k| k as f32 / 25.0);
            (0..36).map(move |k| {
                let smooth = noise(k) + noise(100 + k) * x + noise(200 + k) * y + noise(300 + k) * x * x * y;
                smooth + 0.01 * noise(1000 + 36 * probe + k)
            })
        };
        let sky = Columns { numbers: (0..625).flat_map(matrix).collect(), ..sky };
        let none = Columns { count: 0, channels: 3, numbers: Vec::new(), ..sky.clone() };
        let places = places(vec![volume.clone()], Vec::new());
        let reporter = Reporter::new(Cancel::default());
        let all = [sky.clone(), none.clone(), none];
        let files = files(&all, &places, Some(20), "{}", &reporter).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&files[4]).unwrap();
        let number = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
        let cpca = &json["sky"]["cpca"];
        let [clusters, components] = ["clusters", "components"].map(|key| number(&cpca[key]));
        assert!(components > 2 && cpca["bytes"].as_f64().unwrap() <= 20.0, "{cpca}");
        let used = 625 + 2 * (625 * components + clusters * (1 + components) * 36);
        assert!((used as f64 / 625.0 - cpca["bytes"].as_f64().unwrap()).abs() < 1e-9);
        let half = |at: usize| f64::from(f16::from_le_bytes([files[0][at], files[0][at + 1]]).to_f32());
        let factor = |k: usize| {
            [1.0, 2.0 / 3.0, 0.25][(k / 4).isqrt()]
                * if k.is_multiple_of(4) { 1.0 } else { 8_f64.sqrt().recip() }
        };
        let (mut errors, mut all) = (Vec::new(), 0.0);
        for (place, probe) in Grid::of(&volume, OF_FILES).probes().enumerate() {
            let cluster = usize::from(files[0][number(&cpca["cluster_of"]) + place]);
            let at = number(&json["sky"]["offset"]) + 2 * 36 * (1 + components) * cluster;
            let weight = |k: usize| half(number(&cpca["weights"]) + 2 * (components * place + k));
            let own = rows_of_files(&sky.numbers[36 * probe..][..36], 4);
            let squares = |value: &dyn Fn(usize) -> f64| -> f64 {
                (0..36).map(|k| (factor(k) * value(k)).powi(2)).sum()
            };
            all += squares(&|k| f64::from(own[k]));
            errors.push(squares(&|k| {
                let of = |part: usize| half(at + 2 * (36 * part + k));
                (0..components).fold(of(0), |sum, part| sum + weight(part) * of(1 + part)) - f64::from(own[k])
            }));
        }
        let error = (errors.iter().sum::<f64>() / all).sqrt();
        let worst = (625.0 * errors.iter().fold(0.0, |a: f64, b| a.max(*b)) / all).sqrt();
        let named = ["error", "worst"].map(|key| cpca[key].as_f64().unwrap());
        assert!(
            (error / named[0] - 1.0).abs() < 1e-3 && (worst / named[1] - 1.0).abs() < 1e-3,
            "{error} {cpca}"
        );
        // The noise alone, of which each of 36 numbers has 0.006, is all that may be missing.
        assert!(error < 0.01, "{error}");
        assert!(reporter.notes()[0].starts_with("cpca: "), "{:?}", reporter.notes());
    }
}
