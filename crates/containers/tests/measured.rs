//! Measured BRDFs: real files, analytic models written in each format and read back, and damage.

#![allow(clippy::unwrap_used)] // as in any test

use std::f64::consts::{FRAC_PI_2, PI};

use brdf::Measured;
use brdf::scattered::{SHAPE, Sample, interpolate};
use containers::measured::{Format, read, read_with_notes};
use sphere::{DVec3, Direction};

const CORPUS: [&str; 2] = ["krylon_blue.brdf", "garnet_red.brdf"];

/// A file of the corpus and what it is read as.
fn corpus(test: &str, file: &str) -> Option<(Vec<u8>, Measured)> {
    let path = test_data::folder(test, "SPECULA_CORPUS")?.join("brdf/measured").join(file);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let reading = read_with_notes(file, &bytes, None).unwrap();
    for note in &reading.notes {
        eprintln!("{file}: {note}");
    }
    Some((bytes, reading.measured))
}

/// Albedo under light from theta, by midpoints over the view's hemisphere.
fn albedo(measured: &Measured, theta: f64) -> [f64; 3] {
    let (rows, columns) = (400, 200);
    let light = Direction::from_angles(theta, 0.0);
    let mut sum = [0.0; 3];
    for row in 0..rows {
        // Even steps of sin^2: the cosine is in the measure.
        let view = (((f64::from(row) + 0.5) / f64::from(rows)).sqrt()).asin();
        for column in 0..columns {
            let phi = (f64::from(column) + 0.5) / f64::from(columns) * PI;
            let value = measured.brdf(light, Direction::from_angles(view, phi));
            for channel in 0..3 {
                sum[channel] += value[channel] * PI / f64::from(rows * columns);
            }
        }
    }
    sum
}

fn srgb(value: f64) -> u8 {
    let value = value.clamp(0.0, 1.0);
    let encoded = if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// For a look, where SPECULA_KEEP names a folder: a lit sphere; the plane of incidence, theta_i to the right
/// and theta_o upward from -89 to 89 degrees, a decade of each colour a sixth of its range; its curves of
/// green over theta_o for theta_i = 0, 20, 40, 60, 80 and 88 degrees, six decades high.
fn keep_picture(name: &str, measured: &Measured) {
    let Some(folder) = std::env::var_os("SPECULA_KEEP").map(std::path::PathBuf::from) else { return };
    let side = 480;
    let mut codes = vec![[30; 3]; 3 * side * side];
    let lights =
        [(DVec3::new(-0.5, 0.6, 0.8).normalize(), 3.0), (DVec3::new(0.9, 0.1, -0.35).normalize(), 2.0)];
    for row in 0..side {
        for column in 0..side {
            let place = |at: usize| (at as f64 + 0.5) / side as f64 * 2.2 - 1.1;
            let (x, y) = (place(column), -place(row));
            if x * x + y * y < 1.0 {
                let normal = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
                let across = if normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
                let tangent = normal.cross(across).normalize();
                let bitangent = normal.cross(tangent);
                let local = |v: DVec3| {
                    Direction::normalised(DVec3::new(v.dot(tangent), v.dot(bitangent), v.dot(normal)))
                };
                let mut sum = [0.0; 3];
                for (light, power) in lights {
                    let cosine = light.dot(normal);
                    if cosine > 0.0 {
                        let value = measured.brdf(local(light), local(DVec3::Z));
                        for channel in 0..3 {
                            sum[channel] += power * cosine * value[channel];
                        }
                    }
                }
                codes[row * 3 * side + column] = sum.map(|value| srgb(value * 1.5));
            }
            let angle = |at: usize| ((at as f64 + 0.5) / side as f64 * 178.0 - 89.0).to_radians();
            let (theta_i, theta_o) = (angle(column), angle(side - 1 - row));
            let at = |theta: f64| Direction::from_angles(theta.abs(), if theta < 0.0 { PI } else { 0.0 });
            let value = measured.brdf(at(theta_i), at(theta_o));
            // Decades from 1e-3 to 1e3 between black and white.
            codes[row * 3 * side + side + column] =
                value.map(|value| (255.0 * ((value.max(1e-9).log10() + 3.0) / 6.0).clamp(0.0, 1.0)) as u8);
        }
    }
    for (index, theta_i) in [0.0f64, 20.0, 40.0, 60.0, 80.0, 88.0].into_iter().enumerate() {
        let shade = [
            [255, 255, 255],
            [255, 220, 120],
            [255, 150, 80],
            [255, 90, 90],
            [220, 90, 255],
            [110, 140, 255],
        ][index];
        let mut before: Option<usize> = None;
        for column in 0..side {
            let theta_o = ((column as f64 + 0.5) / side as f64 * 178.0 - 89.0).to_radians();
            let light = Direction::from_angles(theta_i.to_radians(), PI);
            let view = Direction::from_angles(theta_o.abs(), if theta_o < 0.0 { PI } else { 0.0 });
            let value = measured.brdf(light, view)[1];
            let row =
                ((1.0 - (value.max(1e-9).log10() + 3.0) / 6.0).clamp(0.0, 0.999) * side as f64) as usize;
            let from = before.unwrap_or(row);
            for y in row.min(from)..=row.max(from) {
                codes[y * 3 * side + 2 * side + column] = shade;
            }
            before = Some(row);
        }
    }
    let png = containers::write_png(3 * side, side, &codes, None).unwrap();
    std::fs::write(folder.join(format!("measured-{name}.png")), png).unwrap();
}

/// The rows of an irregular file, read without the reader: theta_i, phi_i, theta_o, phi_o and the values.
fn rows(bytes: &[u8]) -> Vec<Vec<f64>> {
    let text = std::str::from_utf8(bytes).unwrap();
    let words = text.lines().flat_map(|line| line.split('#').next().unwrap().split_whitespace());
    let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
    let count = numbers[0] as usize;
    numbers[1 + count..].chunks_exact(4 + count).map(<[f64]>::to_vec).collect()
}

fn directions(row: &[f64]) -> [Direction; 2] {
    [Direction::from_angles(row[0], row[1]), Direction::from_angles(row[2], row[3])]
}

/// Each fifth measurement left out, at 450, 550 and 650 nm, is found again from the others. The miss is a
/// share of the value (plus 0.001 / sr, the noise of the dark readings). Up to 75 degrees it is below 4
/// percent for half of them and below 20 for nine of ten. With the readings at 80 degrees, which contradict
/// one another (zeros beside the highlight's flank), nine of ten are within a half.
#[test]
fn measurements_left_out_are_found_again() {
    for file in CORPUS {
        let Some((bytes, _)) = corpus("measurements_left_out_are_found_again", file) else { return };
        let sample = |row: &Vec<f64>| {
            let [incident, outgoing] = directions(row);
            Sample { incident, outgoing, value: [row[4 + 5], row[4 + 15], row[4 + 25]] }
        };
        let samples: Vec<Sample> = rows(&bytes).iter().map(sample).collect();
        assert_eq!(samples.len(), 1439);
        let (left, kept): (Vec<_>, Vec<_>) =
            samples.iter().enumerate().partition(|(index, _)| index % 5 == 2);
        let kept: Vec<Sample> = kept.into_iter().map(|(_, sample)| *sample).collect();
        let table = interpolate(&kept, SHAPE).unwrap().measured;
        for (degrees, half, nine_tenths) in [(75.0f64, 0.04, 0.20), (90.0, 0.05, 0.50)] {
            let mut misses = Vec::new();
            for (_, sample) in &left {
                let [light, view] = [sample.incident, sample.outgoing];
                if light.theta().max(view.theta()) <= degrees.to_radians() {
                    let found = table.brdf(light, view);
                    misses.extend(
                        (0..3).map(|c| (found[c] - sample.value[c]).abs() / (sample.value[c] + 1e-3)),
                    );
                }
            }
            misses.sort_by(f64::total_cmp);
            let at = |share: f64| misses[(share * misses.len() as f64) as usize];
            eprintln!(
                "{file} to {degrees} degrees: missed by {:.4} (median), {:.4} (nine of ten)",
                at(0.5),
                at(0.9)
            );
            assert!(at(0.5) < half && at(0.9) < nine_tenths, "{file}: {} {}", at(0.5), at(0.9));
        }
    }
}

#[test]
fn the_corpus_is_paint() {
    for file in CORPUS {
        let Some((_, paint)) = corpus("the_corpus_is_paint", file) else { return };
        keep_picture(file, &paint);
        // Matte where light and view are far from the mirror's: the colour of the pigment.
        let at = |theta_i: f64, theta_o: f64, phi: f64| {
            let light = Direction::from_angles(theta_i.to_radians(), 0.0);
            paint.brdf(light, Direction::from_angles(theta_o.to_radians(), phi.to_radians()))
        };
        let [r, g, b] = at(60.0, 10.0, 90.0);
        let (pigment, others) = if file.starts_with("krylon") { (b, r.max(g)) } else { (r, g.max(b)) };
        assert!(pigment > 3.0 * others, "{file}: {r} {g} {b}");
        // The coat's highlight is white, and rises toward grazing.
        let [r, g, b] = at(60.0, 60.0, 180.0);
        assert!(r.min(g).min(b) > 0.8 * r.max(g).max(b), "{file}: {r} {g} {b}");
        let peaks = [20.0, 40.0, 60.0, 80.0].map(|theta| at(theta, theta, 180.0)[1]);
        assert!(peaks.is_sorted(), "{file}: {peaks:?}");
        assert!(peaks[0] > 5.0 * at(20.0, 60.0, 90.0)[1], "{file}: a highlight stands out");
        // No light is made, and it does not change abruptly toward grazing.
        let albedos = [0.0f64, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0, 89.0]
            .map(|theta| albedo(&paint, theta.to_radians()));
        eprintln!("{file}: albedo {albedos:.3?}");
        assert!(albedos.as_flattened().iter().all(|share| (0.0..0.6).contains(share)), "{file}: {albedos:?}");
    }
}

/// The degrees that hold all but a tenth and a twentieth of the energy. Four fifths of it lie past 70
/// degrees, where the coats are all but mirrors: hence the high degrees.
#[test]
fn the_corpus_can_be_projected() {
    for file in CORPUS {
        let Some((_, paint)) = corpus("the_corpus_can_be_projected", file) else { return };
        for tolerance in [0.1, 0.05] {
            let start = std::time::Instant::now();
            let choice = brdf::Choice::Tolerance(sh::Tolerance::new(tolerance).unwrap());
            let projection = brdf::project(&brdf::Material::Measured(paint.clone()), choice).unwrap();
            let (f, p) = (projection.coefficients.f().get(), projection.coefficients.p().get());
            eprintln!(
                "{file} {tolerance}: F {f}, P {p}, {:.4}, {:.2} s",
                projection.captured,
                start.elapsed().as_secs_f64()
            );
            assert!(projection.captured >= 1.0 - tolerance && f < 200 && p < 60, "{file}: {f} {p}");
        }
    }
}

/// Past 80 degrees nothing was measured: off the mirror's direction the BRDF there goes one way (2 percent is
/// the table's ripple) and stays within a factor 2.5 of what it is at 80.
#[test]
fn the_corpus_has_no_lobes_at_grazing() {
    for file in CORPUS {
        let Some((_, paint)) = corpus("the_corpus_has_no_lobes_at_grazing", file) else { return };
        for theta_i in [0.0f64, 20.0, 40.0, 60.0, 75.0] {
            for phi in [0.0f64, 45.0, 90.0, 135.0, 180.0] {
                let light = Direction::from_angles(theta_i.to_radians(), 0.0);
                let curve: Vec<f64> = (0..=38)
                    .map(|step| {
                        let theta_o = (80.0 + 0.25 * f64::from(step)).to_radians();
                        paint.brdf(light, Direction::from_angles(theta_o, phi.to_radians()))[1]
                    })
                    .collect();
                let (first, last) = (curve[0], curve[38]);
                let greatest = curve.iter().fold(0.0, |a: f64, b| a.max(*b));
                let place =
                    format!("{file}, light {theta_i}, azimuth {phi}: {first:.4} {greatest:.4} {last:.4}");
                assert!(greatest <= 1.02 * first.max(last), "{place}");
                assert!(last < 2.5 * first && last > first / 5.0, "{place}");
            }
        }
    }
}

/// Matte under Ward's highlight, reciprocal and symmetric.
fn model(incident: Direction, outgoing: Direction) -> [f64; 3] {
    let half = (incident.vector() + outgoing.vector()).normalize();
    let tan_squared = (1.0 - half.z * half.z) / (half.z * half.z);
    let cosines = incident.vector().z.max(0.02) * outgoing.vector().z.max(0.02);
    let lobe = (-tan_squared / 0.09).exp() / (4.0 * PI * 0.09 * cosines.sqrt());
    [0.1 + 0.2 * lobe, 0.05 + 0.2 * lobe, 0.2 + 0.1 * lobe]
}

/// A model as the MERL database writes it: its nodes, scales and order, -1 where light or view is below the
/// horizon, and for `missing` entries.
fn merl(
    shape: [usize; 3],
    model: impl Fn(Direction, Direction) -> [f64; 3],
    missing: impl Fn([usize; 3]) -> bool,
) -> Vec<u8> {
    let mut channels = [Vec::new(), Vec::new(), Vec::new()];
    for h in 0..shape[0] {
        for d in 0..shape[1] {
            for phi in 0..shape[2] {
                let share = |i: usize, axis: usize| i as f64 / shape[axis] as f64;
                let theta_h = share(h, 0).powi(2) * FRAC_PI_2;
                let (theta_d, phi_d) = (share(d, 1) * FRAC_PI_2, share(phi, 2) * PI);
                // Rusinkiewicz: the difference vector turned about +Y by theta_h; the view is the light's
                // mirror image in h.
                let difference = Direction::from_angles(theta_d, phi_d).vector();
                let (sin, cos) = theta_h.sin_cos();
                let light = DVec3::new(
                    cos * difference.x + sin * difference.z,
                    difference.y,
                    cos * difference.z - sin * difference.x,
                );
                let half = DVec3::new(sin, 0.0, cos);
                let view = half * (2.0 * light.dot(half)) - light;
                let value = if light.z <= 0.0 || view.z <= 0.0 || missing([h, d, phi]) {
                    [-1.0; 3]
                } else {
                    let value = model(Direction::normalised(light), Direction::normalised(view));
                    [value[0] * 1500.0, value[1] * 1500.0 / 1.15, value[2] * 1500.0 / 1.66]
                };
                for channel in 0..3 {
                    channels[channel].extend(value[channel].to_le_bytes());
                }
            }
        }
    }
    let dims = shape.map(|n| (n as i32).to_le_bytes());
    [dims.as_flattened(), &channels[0], &channels[1], &channels[2]].concat()
}

/// Between nodes 1 degree apart the table is linear. Curvature of ln f times f: in sqrt(theta_h), the lobe of
/// width 0.3 moves by at most a few percent of its peak between nodes, whence 2 percent; measured on
/// directions away from the horizon, where cells are cut by it.
#[test]
fn a_model_written_as_merl_is_read_back() {
    let hole = |[h, d, phi]: [usize; 3]| (20..23).contains(&h) && (30..33).contains(&d) && phi < 40;
    let bytes = merl([90, 90, 180], model, hole);
    assert_eq!(bytes.len(), 12 + 90 * 90 * 180 * 24);
    let reading = read_with_notes("gloss.binary", &bytes, None).unwrap();
    assert_eq!(reading.measured.shape(), [90, 90, 180]);
    let note = &reading.notes[0];
    assert!(note.contains("360 of them with light and view above the horizon"), "{note}");
    let mut worst = 0.0f64;
    for i in 0..4000 {
        let i = f64::from(i);
        let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
        let (light, view) = (at(i * 0.754_877, 0.0), at(i * 0.569_840, i * 2.399_963));
        let (found, expected) = (reading.measured.brdf(light, view), model(light, view));
        for channel in 0..3 {
            worst = worst.max((found[channel] / expected[channel] - 1.0).abs());
        }
        assert_eq!(found, reading.measured.brdf(view, light));
    }
    eprintln!("MERL: worst {worst:.4}");
    assert!(worst < 0.02, "{worst}");
}

/// What is below the horizon is reached by interpolation alone; filled from its neighbours, a constant stays
/// one.
#[test]
fn holes_of_merl_are_filled() {
    let bytes = merl([12, 12, 24], |_, _| [0.25; 3], |[h, _, phi]| h == 3 && phi < 20);
    let measured = read("grey.binary", &bytes, None).unwrap();
    assert!(measured.values().as_flattened().iter().all(|value| (value - 0.25).abs() < 1e-6));
    let nothing = merl([2, 2, 2], |_, _| [0.25; 3], |_| true);
    let error = read("none.binary", &nothing, None).unwrap_err();
    assert_eq!(error.to_string(), "merl: every entry is negative: the table holds no measurement");
}

fn table(model: impl Fn(Direction, Direction) -> [f64; 3]) -> String {
    let mut csv = String::from("# by a test\ntheta_i, theta_o, phi, r, g, b\n");
    for theta_i in (0..=80).step_by(10) {
        for theta_o in (0..=theta_i).step_by(10) {
            for phi in (0..=180).step_by(15) {
                let light = Direction::from_angles(f64::from(theta_i).to_radians(), 0.0);
                let view =
                    Direction::from_angles(f64::from(theta_o).to_radians(), f64::from(phi).to_radians());
                let [r, g, b] = model(light, view);
                csv += &format!("{theta_i},{theta_o},{phi},{r},{g},{b}\n");
            }
        }
    }
    csv
}

/// Between samples 10 degrees apart, half of the lobe's width, a tenth of the value is what the interpolation
/// may miss.
#[test]
fn a_table_is_read_back() {
    let reading = read_with_notes("gloss.CSV", table(model).as_bytes(), None).unwrap();
    assert!(reading.format == Format::Table && reading.notes[0].starts_with("585 scattered"), "{reading:?}");
    let mut misses = Vec::new();
    for i in 0..1000 {
        let i = f64::from(i);
        let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
        let (light, view) = (at(i * 0.754_877, 0.0), at(i * 0.569_840, i * 2.399_963));
        let (found, expected) = (reading.measured.brdf(light, view), model(light, view));
        misses.extend((0..3).map(|channel| (found[channel] / expected[channel] - 1.0).abs()));
    }
    misses.sort_by(f64::total_cmp);
    eprintln!("table: {:.4} (median), {:.4} (nine of ten)", misses[1500], misses[2700]);
    assert!(misses[1500] < 0.02 && misses[2700] < 0.1, "{} {}", misses[1500], misses[2700]);
}

fn curet(unit: &str, count: u32, model: impl Fn(Direction, Direction) -> [f64; 3]) -> String {
    let mut text = format!("{unit}\n# theta_v phi_v theta_i phi_i r g b\n");
    for i in 0..count {
        let i = f64::from(i);
        let [theta_v, phi_v, theta_i, phi_i] =
            [(i * 0.754_877).fract() * 1.4, i * 2.399_963, (i * 0.569_840).fract() * 1.4, 0.5];
        let [r, g, b] = model(Direction::from_angles(theta_i, phi_i), Direction::from_angles(theta_v, phi_v));
        let angles =
            [theta_v, phi_v, theta_i, phi_i].map(|a: f64| if unit == "degrees" { a.to_degrees() } else { a });
        text += &format!("{} {} {} {} {r} {g} {b}\n", angles[0], angles[1], angles[2], angles[3]);
    }
    text
}

/// Rough surfaces are what the polynomials are for: a matte that brightens toward the light by a low power.
#[test]
fn a_sample_of_curet_is_read_back() {
    let rough = |incident: Direction, outgoing: Direction| {
        let back = incident.dot(outgoing);
        [0.2 + 0.05 * back, 0.15 + 0.03 * back, 0.1 + 0.02 * back]
    };
    let readings = ["degrees", "radians"]
        .map(|unit| read("felt.curet", curet(unit, 205, rough).as_bytes(), None).unwrap());
    for i in 0..500 {
        let i = f64::from(i);
        let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
        let (light, view) = (at(i * 0.324_717, 1.0), at(i * 0.569_840, i * 2.399_963));
        let expected = rough(light, view);
        for measured in &readings {
            let found = measured.brdf(light, view);
            for channel in 0..3 {
                let miss = (found[channel] / expected[channel] - 1.0).abs();
                assert!(miss < 0.02, "{light:?} {view:?}: {found:?} {expected:?}");
            }
        }
    }
}

fn spectral(rows: usize) -> String {
    let mut text = String::from("# made by a test\n3\n400 550 700\n");
    for i in 0..rows {
        let i = i as f64;
        text += &format!(
            "{:.4} 0 {:.4} {:.4} 0.1 0.2 0.15\n",
            (i * 0.61) % 1.5,
            (i * 0.37) % 1.5,
            (i * 1.1) % 3.1
        );
    }
    text
}

/// A name, a small whole file, and how many of its last bytes may be cut without anyone knowing: digits of
/// the last number.
fn small_files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("a.binary", merl([3, 3, 4], model, |_| false)),
        ("a.brdf", spectral(16).into_bytes()),
        (
            "a.csv",
            table(model)
                .lines()
                .take(2 + 16)
                .map(|line| format!("{line}\n"))
                .collect::<String>()
                .into_bytes(),
        ),
        ("a.curet", curet("radians", 205, model).into_bytes()),
    ]
}

/// Text can be cut within its last number and still be whole to any reader; all other lengths are errors, for
/// each file has the fewest measurements that are read.
#[test]
fn every_truncated_length_is_an_error() {
    for (name, bytes) in small_files() {
        assert!(read(name, &bytes, None).is_ok(), "{name}");
        let text = name != "a.binary";
        let last = if text {
            bytes.trim_ascii_end().iter().rposition(|byte| b" ,".contains(byte)).unwrap() + 2
        } else {
            bytes.len()
        };
        for length in 0..last {
            let error =
                read(name, &bytes[..length], None).expect_err(&format!("{name} cut to {length} bytes"));
            assert!(!error.to_string().is_empty());
        }
    }
    let (name, mut bytes) = small_files().swap_remove(0);
    bytes.push(0);
    let error = read(name, &bytes, None).unwrap_err().to_string();
    assert_eq!(
        error,
        "merl: the header declares 3 x 3 x 4 entries of 24 bytes, 876 bytes in all; the file has 877"
    );
}

/// The error of a file with one thing changed.
fn error_with(name: &str, from: &str, to: &str) -> String {
    let (_, bytes) = small_files().into_iter().find(|(file, _)| *file == name).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains(from), "{name} holds no {from:?}: {text}");
    read(name, text.replacen(from, to, 1).as_bytes(), None).unwrap_err().to_string()
}

#[test]
fn damaged_text_is_told_with_its_line() {
    let header = "theta_i, theta_o, phi, r, g, b";
    for (name, from, to, expected) in [
        ("a.brdf", "\n3\n", "\n0\n", "cornell: line 2: 0 wavelengths; expected 1 to 1024"),
        ("a.brdf", "\n3\n", "\n999999999\n", "cornell: line 2: 999999999 wavelengths; expected 1 to 1024"),
        (
            "a.brdf",
            "\n3\n",
            "\nx\n",
            "cornell: line 2: \"x\" is not a number; expected the count of wavelengths",
        ),
        (
            "a.brdf",
            "400 550",
            "550 400",
            "cornell: line 3: wavelength 400; expected 3 rising wavelengths in nanometres, 100 to 10000",
        ),
        (
            "a.brdf",
            "400 550 700",
            "500 550 700",
            "cornell: the wavelengths run from 500 to 700 nm; expected them to span 450 to 630 nm at least",
        ),
        ("a.brdf", "0.2", "NaN", "cornell: line 4: the BRDF is NaN; expected a finite number, 0 or more"),
        ("a.brdf", "0.2", "-0.2", "cornell: line 4: the BRDF is -0.2; expected a finite number, 0 or more"),
        ("a.brdf", "0.2", "1e99", "cornell: line 4: the BRDF is 1e99; expected a finite number, 0 or more"),
        (
            "a.brdf",
            "0.6100",
            "1.7",
            "cornell: line 5: theta_i is 1.7; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.brdf",
            "0.6100",
            "-0.1",
            "cornell: line 5: theta_i is -0.1; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.csv",
            header,
            "a,b,c",
            "table: line 2: \"a,b,c\" stands first; expected the header \"theta_i,theta_o,phi,r,g,b\"",
        ),
        (
            "a.csv",
            "\n0,0,15,",
            "\n91,0,15,",
            "table: line 4: theta_i is 91; expected 0 to 90 degrees from the normal",
        ),
        ("a.csv", "\n0,0,15,", "\n0,0,inf,", "table: line 4: phi is inf; expected an angle"),
        (
            "a.csv",
            "\n0,0,15,",
            "\n0,0,15,-1,",
            "table: line 4: 7 values; expected 6 (theta_i,theta_o,phi,r,g,b)",
        ),
        ("a.csv", "\n0,0,15,", "\n0,0,", "table: line 4: 5 values; expected 6 (theta_i,theta_o,phi,r,g,b)"),
        (
            "a.curet",
            "radians",
            "grads",
            "curet: line 1: \"grads\" stands first; expected the unit of the angles, \"degrees\" or \"radians\"",
        ),
        (
            "a.curet",
            "\n0 0 0 0.5 ",
            "\n2 0 0 0.5 ",
            "curet: line 3: theta_v is 2; expected 0 to pi/2 radians from the normal",
        ),
        (
            "a.curet",
            "\n0 0 0 0.5 ",
            "\n0 0 0 0.5 1 1 1\n0 0 0 0.5 ",
            "curet: line 208: more than 205 measurements; expected 205",
        ),
    ] {
        assert_eq!(error_with(name, from, to), expected);
    }
    let whole = spectral(16);
    let error =
        read("a.brdf", whole.trim_end().trim_end_matches("0.15").as_bytes(), None).unwrap_err().to_string();
    let expected = "cornell: line 19: the last measurement has 6 of 7 values (4 angles and 3 wavelengths)";
    assert_eq!(error, expected);
    let short = spectral(15);
    let error = read("a.brdf", short.as_bytes(), None).unwrap_err().to_string();
    assert_eq!(error, "cornell: 15 measurements; expected 16 or more");
    let error = read("a.csv", b"theta_i,theta_o,phi,r,g,b\n\xff", None).unwrap_err().to_string();
    assert_eq!(error, "table: byte 26 is not text; expected UTF-8");
}

#[test]
fn damaged_merl_is_told_with_its_byte() {
    let whole = merl([3, 3, 4], model, |_| false);
    let with = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        read("a.binary", &file, None).unwrap_err().to_string()
    };
    assert_eq!(
        with(12 + 8 * 5, &f64::NAN.to_le_bytes()),
        "merl: byte 52: the value is NaN; expected a finite number, negative where nothing was measured"
    );
    for (dim, text) in [(0, "0 x 3 x 4"), (-3, "-3 x 3 x 4")] {
        let expected = format!("merl: bytes 0 to 11 declare a table of {text}; expected 90 x 90 x 180");
        assert_eq!(with(0, &i32::to_le_bytes(dim)), expected);
    }
    let huge = [i32::MAX.to_le_bytes(); 3];
    assert!(with(0, huge.as_flattened()).contains("more than 16777216 entries"));
    assert!(
        with(0, &16_000i32.to_le_bytes())
            .starts_with("merl: the header declares 16000 x 3 x 4 entries of 24 bytes")
    );
    let turn = [90i32, 90, 360].map(i32::to_le_bytes);
    assert!(with(0, turn.as_flattened()).contains("a full turn of phi_d"));
}

#[test]
fn the_ending_says_the_format_unless_it_is_given() {
    let csv = table(model);
    let error = read("gloss.txt", csv.as_bytes(), None).unwrap_err().to_string();
    assert_eq!(
        error,
        "the ending of \"gloss.txt\" is not that of a measured BRDF; expected .binary (merl), .brdf (cornell), .curet (curet), .csv (table)"
    );
    let given = read("gloss.txt", csv.as_bytes(), Some(Format::Table)).unwrap();
    assert_eq!(given, read("gloss.csv", csv.as_bytes(), None).unwrap());
    // As a spreadsheet writes it: a byte order mark and other line ends.
    let exported = format!("\u{feff}{}", csv.replace('\n', "\r\n"));
    assert_eq!(given, read("gloss.csv", exported.as_bytes(), None).unwrap());
    assert_eq!(read("gloss.csv", b"", None).unwrap_err().to_string(), "the file is empty");
}
