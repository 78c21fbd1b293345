//! Two photographed light probes against the coefficients that Ramamoorthi and Hanrahan published (2001).

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic, and reads reference files

use envmap::{Environment, Image, Layout};
use sphere::{AngularProbe, DVec3, Direction, LatLong, to_file};
use test_data::folder;

/// A Radiance picture with new-style run lengths, decoded as (mantissa + 0.5) / 256 x 2^(e - 128).
fn read_rgbe(bytes: &[u8]) -> Image {
    let end = bytes.windows(2).position(|pair| pair == b"\n\n").unwrap() + 2;
    let line = bytes[end..].iter().position(|&byte| byte == b'\n').unwrap();
    let size: Vec<_> = std::str::from_utf8(&bytes[end..end + line]).unwrap().split(' ').collect();
    assert!(size[0] == "-Y" && size[2] == "+X");
    let (height, width): (usize, usize) = (size[1].parse().unwrap(), size[3].parse().unwrap());
    let mut data = bytes[end + line + 1..].iter().copied();
    let mut pixels = Vec::new();
    for _ in 0..height {
        let mut next = || data.next().unwrap();
        assert_eq!((next(), next()), (2, 2));
        assert_eq!(usize::from(next()) * 256 + usize::from(next()), width);
        let mut row = vec![[0; 4]; width];
        for channel in 0..4 {
            let mut column = 0;
            while column < width {
                let count = next();
                let repeated = (count > 128).then(&mut next);
                for _ in 0..count & if count > 128 { 127 } else { 255 } {
                    row[column][channel] = repeated.unwrap_or_else(&mut next);
                    column += 1;
                }
            }
        }
        pixels.extend(row.iter().map(|&[r, g, b, e]| {
            let scale = if e == 0 { 0.0 } else { 2.0_f32.powi(i32::from(e) - 136) };
            [r, g, b].map(|mantissa| (f32::from(mantissa) + 0.5) * scale)
        }));
    }
    Image::new(width, height, pixels).unwrap()
}

/// Y_00 Y_1-1 Y_10 Y_11 Y_2-2 ... Y_22 of (x, y, z).
fn harmonics(v: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = v;
    [
        0.282_094_791_773_878,
        0.488_602_511_902_920 * y,
        0.488_602_511_902_920 * z,
        0.488_602_511_902_920 * x,
        1.092_548_430_592_079 * x * y,
        1.092_548_430_592_079 * y * z,
        0.315_391_565_252_520 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079 * x * z,
        0.546_274_215_296_040 * (x * x - y * y),
    ]
}

fn add(sum: &mut [[f64; 3]; 9], at: DVec3, weight: f64, pixel: [f32; 3]) {
    for (row, harmonic) in sum.iter_mut().zip(harmonics(at)) {
        for channel in 0..3 {
            row[channel] += weight * harmonic * f64::from(pixel[channel]);
        }
    }
}

/// The largest difference from the table, as a part of the table's largest coefficient.
fn error(found: &[[f64; 3]; 9], map: &serde_json::Value) -> f64 {
    let table: Vec<[f64; 3]> = serde_json::from_value(map["table"].clone()).unwrap();
    let scale = map["scale"].as_f64().unwrap();
    let flat = table.as_flattened();
    let largest = flat.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let differences =
        found.as_flattened().iter().zip(flat).map(|(found, value)| (found / scale - value).abs());
    differences.fold(0.0, f64::max) / largest
}

#[test]
fn probes_meet_the_published_tables() {
    const NAME: &str = "probes_meet_the_published_tables";
    let (Some(corpus), Some(reference)) = (folder(NAME, "SPECULA_CORPUS"), folder(NAME, "SPECULA_REFERENCE"))
    else {
        return;
    };
    let text = std::fs::read(reference.join("published-irradiance.json")).unwrap();
    let published: serde_json::Value = serde_json::from_slice(&text).unwrap();
    for name in ["grace_probe.hdr", "rnl_probe.hdr"] {
        let map = &published["maps"][name];
        let image = read_rgbe(&std::fs::read(corpus.join("env/probes").join(name)).unwrap());
        let (edge, probe) = (image.width(), AngularProbe { edge: image.width() });

        // As published: x to the image's right, which is -x_file, and coordinates of pixel corners: half a
        // texel up and to the left of centres.
        let mut corners = [[0.0; 3]; 9];
        // As an importer should: pixel centres, and then our conversion, at two resolutions.
        let mut centres = [[0.0; 3]; 9];
        let mut energy = [0.0; 3];
        for (texel, &pixel) in image.pixels().iter().enumerate() {
            let (row, column) = (texel / edge, texel % edge);
            if let Some(w) = probe.direction_at(column as f64 - 0.5, row as f64 - 0.5) {
                let file = to_file(w.vector());
                let t = file.z.clamp(-1.0, 1.0).acos();
                let sinc = if t > 0.0 { t.sin() / t } else { 1.0 };
                let solid_angle = (2.0 * std::f64::consts::PI / edge as f64).powi(2) * sinc;
                add(&mut corners, DVec3::new(-file.x, file.y, file.z), solid_angle, pixel);
            }
            if let Some(w) = probe.direction(row, column) {
                let (file, solid_angle) = (to_file(w.vector()), probe.solid_angle(row, column));
                add(&mut centres, DVec3::new(-file.x, file.y, file.z), solid_angle, pixel);
                for channel in 0..3 {
                    energy[channel] += solid_angle * f64::from(pixel[channel]);
                }
            }
        }
        let tolerance = |key: &str| map[key].as_f64().unwrap();
        let (at_corners, at_centres) = (error(&corners, map), error(&centres, map));
        eprintln!("{name}: at corners {at_corners:.5}, at centres {at_centres:.5}");
        assert!(at_corners < tolerance("relative_tolerance"), "{name}: {at_corners}");
        assert!(at_centres < tolerance("centred_tolerance"), "{name}: {at_centres}");

        for grid in [None, Some(LatLong::with_rows(512)), Some(LatLong::with_rows(64))] {
            let environment = Environment::from_image(image.clone(), Layout::Probe, grid).unwrap();
            let grid = environment.grid();
            let mut converted = [[0.0; 3]; 9];
            for (texel, &pixel) in environment.pixels().iter().enumerate() {
                let w: Direction = grid.direction(texel / grid.width, texel % grid.width);
                let file = to_file(w.vector());
                let at = DVec3::new(-file.x, file.y, file.z);
                add(&mut converted, at, grid.solid_angle(texel / grid.width), pixel);
            }
            let after = error(&converted, map);
            let kept: Vec<f64> =
                environment.integral().iter().zip(energy).map(|(is, was)| is / was - 1.0).collect();
            eprintln!(
                "{name}: converted to {} x {} {after:.5}, energy off by {kept:?}",
                grid.width, grid.height
            );
            assert!(after < tolerance("centred_tolerance"), "{name}: {after}");
            // Texels that are not lamps blend into their neighbours with weights that may be off by a
            // percent; a total of a thousandth is a tenth of the tolerance above.
            assert!(kept.iter().all(|kept| kept.abs() < 1e-3), "{name}: {kept:?}");
        }
    }
}
