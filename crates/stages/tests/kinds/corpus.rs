//! Real files.

use std::f64::consts::PI;

use serde_json::Value;
use sh::{Basis, Degree, Expansion};
use sphere::{Cube, DVec3, Face};

use crate::fixture::{difference, pixels};
use test_data::folder;

use crate::pipeline::Pipeline;

/// The first nine harmonics of Ramamoorthi and Hanrahan's tables: L00 L1-1 L10 L11 L2-2 L2-1 L20 L21 L22 of
/// (x, y, z).
fn harmonics(DVec3 { x, y, z }: DVec3) -> [f64; 9] {
    [
        0.282095,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3.0 * z * z - 1.0),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    ]
}

/// A published table times its scale, and the two tolerances.
fn published(file: &str) -> Option<([[f64; 3]; 9], f64, f64)> {
    let path = folder("published_irradiance", "SPECULA_REFERENCE")?.join("published-irradiance.json");
    let all: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let map = &all["maps"][file];
    let number = |name: &str| map[name].as_f64().unwrap();
    let table: [[f64; 3]; 9] = serde_json::from_value(map["table"].clone()).unwrap();
    let scaled = table.map(|row| row.map(|value| value * number("scale")));
    Some((scaled, number("relative_tolerance"), number("centred_tolerance")))
}

fn largest(table: &[[f64; 3]]) -> f64 {
    table.as_flattened().iter().fold(0.0, |a, b| a.max(b.abs()))
}

const PROBES: [&str; 2] = ["grace_probe.hdr", "rnl_probe.hdr"];

/// What the tables' program adds to each channel of a pixel: half a step of the mantissa.
fn half_a_mantissa(colour: [f32; 3]) -> f32 {
    let largest = colour.iter().fold(0.0_f32, |a, b| a.max(*b));
    if largest > 0.0 { (largest.log2().floor() - 8.0).exp2() } else { 0.0 }
}

/// By how much that makes pictures brighter: half of 1/128 to 1/256 of a pixel's largest channel.
const BRIGHTER: f64 = 1.003;

/// The tables' own rule (`prefilter.c`): pixels looked up at their corners, x to the image's right.
#[test]
fn probes_integrated_at_pixel_corners_give_the_published_tables() {
    let Some(corpus) =
        folder("probes_integrated_at_pixel_corners_give_the_published_tables", "SPECULA_CORPUS")
    else {
        return;
    };
    for file in PROBES {
        let Some((table, tolerance, _)) = published(file) else { return };
        let bytes = std::fs::read(corpus.join("env/probes").join(file)).unwrap();
        let (width, height, colours) = pixels(&bytes);
        let mut sums = [[0.0; 3]; 9];
        for (index, colour) in colours.iter().enumerate() {
            let (i, j) = ((index / width) as f64, (index % width) as f64);
            let u = (j - width as f64 / 2.0) / (width as f64 / 2.0);
            let v = (height as f64 / 2.0 - i) / (height as f64 / 2.0);
            let r = u.hypot(v);
            if r > 1.0 {
                continue;
            }
            let (theta, phi) = (PI * r, v.atan2(u));
            let direction = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let sinc = if theta == 0.0 { 1.0 } else { theta.sin() / theta };
            let solid_angle = (2.0 * PI / width as f64) * (2.0 * PI / height as f64) * sinc;
            for (sum, y) in sums.iter_mut().zip(harmonics(direction)) {
                for channel in 0..3 {
                    let value = colour[channel] + half_a_mantissa(*colour);
                    sum[channel] += f64::from(value) * y * solid_angle;
                }
            }
        }
        let error = difference(&sums, &table) / largest(&table);
        eprintln!("{file}: corners within {error:.1e} of the largest");
        assert!(error < tolerance, "{file}: {error}");
    }
}

/// The coefficients of our expansion in the tables' frame, whose x is -y of ours, y our z, z our x: both
/// products of that function with a harmonic of degree 2 at most are integrated exactly by a lat-long grid of
/// 8 rows.
fn in_the_frame_of_the_tables(lighting: &Expansion) -> Vec<[f64; 3]> {
    let grid = sphere::LatLong::with_rows(8);
    let weights = sh::quadrature::fejer(grid.height);
    let total: f64 = weights.iter().sum();
    let mut sums = vec![[0.0; 3]; 9];
    for row in 0..grid.height {
        for column in 0..grid.width {
            let direction = grid.direction(row, column);
            let DVec3 { x, y, z } = direction.vector();
            let value = lighting.evaluate(direction);
            let weight = 4.0 * PI * weights[row] / total / grid.width as f64;
            for (sum, harmonic) in sums.iter_mut().zip(harmonics(DVec3::new(-y, z, x))) {
                for channel in 0..3 {
                    sum[channel] += weight * value[channel] * harmonic;
                }
            }
        }
    }
    sums
}

#[test]
fn probes_imported_at_pixel_centres_give_the_published_tables() {
    let Some(corpus) = folder("probes_imported_at_pixel_centres_give_the_published_tables", "SPECULA_CORPUS")
    else {
        return;
    };
    let pipeline = Pipeline::new(
        r#"
        [stage.probe]
        kind = "import-environment"
        source = "CORPUS/env/probes/*.hdr"
        layout = "probe"

        [stage.lighting]
        kind = "project-sh"
        input = "probe"
        degree = 2

        [stage.sh]
        kind = "export-sh"
        input = "lighting"
        format = "safetensors"
        window = "none"
        path = "{probe}"
        "#,
        &corpus,
    );
    assert_eq!(pipeline.build(2).ran, 6);
    for file in PROBES {
        let Some((table, _, tolerance)) = published(file) else { return };
        let lighting = pipeline.lighting(&file.replace(".hdr", ".safetensors"));
        let mut found = in_the_frame_of_the_tables(&lighting);
        found.as_flattened_mut().iter_mut().for_each(|value| *value *= BRIGHTER);
        let error = difference(&found, &table) / largest(&table);
        eprintln!("{file}: centres within {error:.1e} of the largest");
        assert!(error < tolerance, "{file}: {error}");
    }
}

/// Six faces against the sum over their own texels by solid angle. Both are midpoint rules of texels of h = 2
/// / 256: for degree 8 they differ by l (l + 1) h^2 / 12 = 4e-4 of the coefficients at most.
#[test]
fn six_faces_keep_their_harmonics() {
    let Some(corpus) = folder("six_faces_keep_their_harmonics", "SPECULA_CORPUS") else { return };
    let pipeline = Pipeline::new(
        r#"
        [stage.environment]
        kind = "import-environment"
        source = "CORPUS/env/pisa_cube"

        [stage.lighting]
        kind = "project-sh"
        input = "environment"
        degree = 8

        [stage.sh]
        kind = "export-sh"
        input = "lighting"
        format = "safetensors"
        path = "sh"
        "#,
        &corpus,
    );
    pipeline.build(2);
    let (cube, degree) = (Cube { edge: 256 }, Degree::new(8).unwrap());
    let basis = Basis::new(degree);
    let mut values = vec![0.0; degree.rows()];
    let mut expected = vec![[0.0; 3]; degree.rows()];
    for face in Face::ALL {
        let bytes = std::fs::read(corpus.join(format!("env/pisa_cube/{}.hdr", face.name()))).unwrap();
        let (_, _, colours) = pixels(&bytes);
        for (index, colour) in colours.iter().enumerate() {
            let (row, column) = (index / 256, index % 256);
            basis.evaluate_into(cube.direction(face, row, column), &mut values);
            let solid_angle = cube.solid_angle(row, column);
            for (sum, y) in expected.iter_mut().zip(&values) {
                for channel in 0..3 {
                    sum[channel] += f64::from(colour[channel]) * y * solid_angle;
                }
            }
        }
    }
    let error =
        difference(pipeline.lighting("sh.safetensors").coefficients(), &expected) / largest(&expected);
    eprintln!("pisa: 81 coefficients within {error:.1e} of the largest");
    assert!(error < 4e-4, "{error}");
}

/// The whole path on five photographs and two materials. Energy is kept at each step: a white matte surface
/// and a highlight that keeps its energy have the mean of the light, over all directions.
#[test]
fn photographs_become_reflection_maps() {
    let Some(corpus) = folder("photographs_become_reflection_maps", "SPECULA_CORPUS") else { return };
    let text = r#"
        [stage.environment]
        kind = "import-environment"
        source = "CORPUS/env/cc0/*.hdr"

        [stage.material]
        kind = "import-material"
        source = "*.material"

        [stage.lighting]
        kind = "project-sh"
        input = "environment"
        degree = 20

        [stage.turned]
        kind = "rotate"
        input = "lighting"
        yaw = 30.0
        pitch = 10.0

        [stage.coefficients]
        kind = "project-brdf"
        input = "material"
        tolerance = 0.01

        [stage.reflection]
        kind = "convolve"
        inputs = { lighting = "turned", brdf = "coefficients" }

        [stage.map]
        kind = "export-reflection-map"
        input = "reflection"
        layout = "lat-long"
        resolution = 64
        precision = "float"
        path = "{environment}/{material}/map"

        [stage.cube]
        kind = "export-reflection-map"
        input = "reflection"
        layout = "cube"
        resolution = 16
        path = "{environment}/{material}/cube"
        "#;
    let make = || {
        Pipeline::new(text, &corpus)
            .file("white.material", b"model = \"lambert\"\nalbedo = 1\n")
            .file("gloss.material", b"model = \"phong\"\nexponent = 20\n")
    };
    let pipeline = make();
    let summary = pipeline.build(2);
    // 5 environments, 2 materials: 5 + 2 + 5 + 5 + 2 + 10 + 10 + 10 items, 10 maps and 60 faces.
    assert_eq!((summary.ran, summary.published), (49, 70));
    assert_eq!(pipeline.build(2).up_to_date, 49);
    let alone = make();
    alone.build(1);
    for environment in ["apartment", "forest", "night", "studio", "sunrise"] {
        let bytes = std::fs::read(corpus.join(format!("env/cc0/{environment}.hdr"))).unwrap();
        let light = mean(&bytes);
        for material in ["white", "gloss"] {
            let file = format!("{environment}/{material}/map.exr");
            let map = pipeline.out(&file);
            assert!(map == alone.out(&file), "{file} depends on the number of threads");
            for channel in 0..3 {
                // Fejér's weights and solid angles differ by (pi / 512)^2 on the photograph, by (pi / 64)^2 /
                // 6 on the map.
                let ratio = mean(&map)[channel] / light[channel];
                assert!((ratio - 1.0).abs() < 2e-3, "{file}: {ratio}");
            }
        }
        let face = pipeline.out(&format!("{environment}/white/cube/nz.exr"));
        assert_eq!((pixels(&face).0, pixels(&face).1), (16, 16));
    }
}

/// The mean radiance of a lat-long picture.
fn mean(bytes: &[u8]) -> [f64; 3] {
    let (width, height, colours) = pixels(bytes);
    let grid = sphere::LatLong { width, height };
    let environment = envmap::Environment::new(grid, colours).unwrap();
    environment.integral().map(|value| value / (4.0 * PI))
}
