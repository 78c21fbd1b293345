//! Measured BRDFs: analytic models that are written in each format and read back.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // as in any test

use std::f64::consts::{FRAC_PI_2, PI};

use brdf::scattered::{SHAPE, Sample, interpolate};
use brdf::{Material, Measured};
use containers::measured::{MeasuredFormat, check_curet, read, read_curet, read_with_notes};
use sphere::{DVec3, Direction};

mod corpus;
mod damage;

/// The table of a material that is one.
fn isotropic(material: Material) -> Measured {
    let Material::Measured(measured) = material else { panic!("not an isotropic table: {material:?}") };
    measured
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
    let measured = isotropic(reading.material);
    assert_eq!(measured.shape(), [90, 90, 180]);
    let note = &reading.notes[0];
    assert!(note.contains("360 of them with light and view above the horizon"), "{note}");
    let mut worst = 0.0f64;
    for i in 0..4000 {
        let i = f64::from(i);
        let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
        let (light, view) = (at(i * 0.754_877, 0.0), at(i * 0.569_840, i * 2.399_963));
        let (found, expected) = (measured.brdf(light, view), model(light, view));
        for channel in 0..3 {
            worst = worst.max((found[channel] / expected[channel] - 1.0).abs());
        }
        assert_eq!(found, measured.brdf(view, light));
    }
    eprintln!("MERL: worst {worst:.4}");
    assert!(worst < 0.02, "{worst}");
}

/// What is below the horizon is reached by interpolation alone; filled from its neighbours, a constant stays
/// one.
#[test]
fn holes_of_merl_are_filled() {
    let bytes = merl([12, 12, 24], |_, _| [0.25; 3], |[h, _, phi]| h == 3 && phi < 20);
    let measured = isotropic(read("grey.binary", &bytes, None).unwrap());
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
    assert!(
        reading.format == MeasuredFormat::Table && reading.notes[0].starts_with("585 scattered"),
        "{reading:?}"
    );
    let measured = isotropic(reading.material);
    let mut misses = Vec::new();
    for i in 0..1000 {
        let i = f64::from(i);
        let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
        let (light, view) = (at(i * 0.754_877, 0.0), at(i * 0.569_840, i * 2.399_963));
        let (found, expected) = (measured.brdf(light, view), model(light, view));
        misses.extend((0..3).map(|channel| (found[channel] / expected[channel] - 1.0).abs()));
    }
    misses.sort_by(f64::total_cmp);
    eprintln!("table: {:.4} (median), {:.4} (nine of ten)", misses[1500], misses[2700]);
    assert!(misses[1500] < 0.02 && misses[2700] < 0.1, "{} {}", misses[1500], misses[2700]);
}

/// Brushed along a direction 20 degrees from +X: angles and vectors say the same, and the table depends on
/// the tangent. 400 scattered samples meet the model to a twentieth in the median.
#[test]
fn an_anisotropic_table_is_read_back_from_angles_and_vectors() {
    let brushed = |incident: Direction, outgoing: Direction| {
        let half = (incident.vector() + outgoing.vector()).normalize();
        let (sine, cosine) = 20f64.to_radians().sin_cos();
        let (x, y) = (half.x * cosine + half.y * sine, half.y * cosine - half.x * sine);
        let lobe = (-(x * x / 0.36 + y * y / 0.06) / (half.z * half.z)).exp();
        [0.1 + lobe, 0.1 + 0.5 * lobe, 0.05 + 0.2 * lobe]
    };
    let at = |share: f64, phi: f64| Direction::from_angles(1.4 * share.fract(), phi);
    let mut angles = String::from("theta_i,phi_i,theta_o,phi_o,r,g,b\n");
    let mut vectors = String::from("x_i, y_i, z_i, x_o, y_o, z_o, r, g, b # in any length\n");
    for i in 0..400 {
        let i = f64::from(i);
        let (light, view) = (at(i * 0.754_877, 1.3 * i), at(i * 0.569_840, i * 2.399_963));
        let [r, g, b] = brushed(light, view);
        let [i_a, i_b, o_a, o_b] =
            [light.theta(), light.phi(), view.theta(), view.phi()].map(|angle: f64| angle.to_degrees());
        angles += &format!("{i_a},{i_b},{o_a},{o_b},{r},{g},{b}\n");
        let (l, v) = (light.vector() * 3.0, view.vector());
        vectors += &format!("{},{},{},{},{},{},{r},{g},{b}\n", l.x, l.y, l.z, v.x, v.y, v.z);
    }
    let [one, other] =
        [angles, vectors].map(|csv| read_with_notes("foil.csv", csv.as_bytes(), None).unwrap());
    assert!(one.notes[0].starts_with("400 scattered measurements"), "{:?}", one.notes);
    let (one, other) = (one.material, other.material);
    assert!(matches!(one, Material::MeasuredAnisotropic(_)) && !one.is_isotropic());
    let mut misses = Vec::new();
    for i in 0..500 {
        let i = f64::from(i) + 0.5;
        let (light, view) = (at(i * 0.754_877, 1.3 * i), at(i * 0.569_840, i * 2.399_963));
        let [a, b] = [&one, &other].map(|material| material.rho_hat(light, view)[0] / light.vector().z);
        assert!((a - b).abs() <= 1e-3 * a, "{a} {b}");
        misses.push((a / brushed(light, view)[0] - 1.0).abs());
    }
    misses.sort_by(f64::total_cmp);
    eprintln!("anisotropic table: {:.4} (median), {:.4} (nine of ten)", misses[250], misses[450]);
    assert!(misses[250] < 0.05 && misses[450] < 0.25, "{} {}", misses[250], misses[450]);
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
        .map(|unit| isotropic(read("felt.curet", curet(unit, 205, rough).as_bytes(), None).unwrap()));
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

/// The files that CURET publishes, as a [`curet`] text has one of three samples, in which the others are
/// black.
fn published(text: &str) -> [String; 4] {
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(2)
        .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
        .collect();
    let table = rows.iter().enumerate().map(|(index, row)| {
        format!("{:<3} {:>11.6} {:>11.6} {:>11.6} {:>11.6}\r\n", index + 1, row[0], row[1], row[2], row[3])
    });
    let colour = |channel: usize| {
        let line = |number: usize, value: &dyn Fn(&[f64]) -> f64| {
            let values = rows.iter().map(|row| format!("{:>9.5}", value(row))).collect::<String>();
            format!("{number} {values} \n")
        };
        let black = |_: &[f64]| -0.011;
        line(1, &black) + &line(2, &|row| row[4 + channel]) + &line(3, &black)
    };
    [table.collect::<String>().trim_end().to_owned(), colour(0), colour(1), colour(2)]
}

/// Lines end as they do there: with a carriage return in the table, whose last has no end, and with a blank
/// in the others.
#[test]
fn the_files_that_curet_publishes_are_read_as_they_are() {
    let rough = |incident: Direction, outgoing: Direction| {
        let back = incident.dot(outgoing);
        [0.2 + 0.05 * back, 0.15 + 0.03 * back, 0.1 + 0.02 * back]
    };
    let text = curet("radians", 205, rough);
    let files = published(&text);
    let bytes = files.each_ref().map(|file| file.as_bytes());
    let sample = read_curet(bytes, 2).unwrap();
    assert_eq!(sample.format, MeasuredFormat::Curet);
    assert!(sample.notes.len() == 1 && sample.notes[0].starts_with("205 measurements were fitted"));
    let (found, own) =
        (isotropic(sample.material), isotropic(read("a.curet", text.as_bytes(), None).unwrap()));
    for (found, own) in found.values().as_flattened().iter().zip(own.values().as_flattened()) {
        // Toward grazing, where nothing is measured, the fit amplifies what five digits lose.
        assert!((found - own).abs() < 1e-3, "{found} {own}");
    }
    let black = read_curet(bytes, 3).unwrap();
    assert_eq!(black.notes[0], "615 of 615 values are below zero and count as 0");
    assert!(isotropic(black.material).values().as_flattened().iter().all(|value| *value == 0.0));

    let error = |files: [&str; 4], sample: usize| {
        read_curet(files.map(str::as_bytes), sample).unwrap_err().to_string()
    };
    let [table, red, green, blue] = files.each_ref().map(|file| &file[..]);
    assert_eq!(
        error([table, red, green, blue], 62),
        "curet: rbrdf.dat: there is no sample 62; the last is 3"
    );
    assert_eq!(error([table, red, green, ""], 2), "curet: bbrdf.dat: the file is empty");
    assert_eq!(
        error([table, red, "2 0.1 0.2", blue], 2),
        "curet: gbrdf.dat: line 1: sample 2 has 2 values; expected 205"
    );
    let (cut, _) = table.rsplit_once('\n').unwrap();
    assert_eq!(error([cut, red, green, blue], 2), "curet: table.txt: 204 pairs of directions; expected 205");
    let other = table.replacen("2  ", "3  ", 1);
    assert_eq!(
        error([&other, red, green, blue], 2),
        "curet: table.txt: line 2: its number is 3; expected the numbers 1 to 205 in their order"
    );
    let nan = red.replacen("2  ", "2 nan ", 1);
    assert_eq!(
        error([table, &nan, green, blue], 2),
        "curet: rbrdf.dat: line 2: a value is nan; expected a finite number"
    );
}

#[test]
fn the_ending_says_the_format_unless_it_is_given() {
    let csv = table(model);
    let error = read("gloss.txt", csv.as_bytes(), None).unwrap_err().to_string();
    assert_eq!(
        error,
        "the ending of \"gloss.txt\" is not that of a measured BRDF; expected .binary (merl), .brdf (cornell), .curet (curet), .csv (table)"
    );
    let given = read("gloss.txt", csv.as_bytes(), Some(MeasuredFormat::Table)).unwrap();
    assert_eq!(given, read("gloss.csv", csv.as_bytes(), None).unwrap());
    // As a spreadsheet writes it: a byte order mark and other line ends.
    let exported = format!("\u{feff}{}", csv.replace('\n', "\r\n"));
    assert_eq!(given, read("gloss.csv", exported.as_bytes(), None).unwrap());
    assert_eq!(read("gloss.csv", b"", None).unwrap_err().to_string(), "the file is empty");
}
