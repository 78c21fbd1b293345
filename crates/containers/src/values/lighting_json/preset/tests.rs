use std::f64::consts::TAU;

use serde_json::Value;
use sh::Basis;

use super::*;
use crate::values::lighting_json::{decode, encode};

fn lighting(degree: usize) -> Expansion {
    let degree = Degree::new(degree).unwrap();
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    Expansion::from_coefficients(degree, (0..degree.rows()).map(|_| [random(), random(), random()]).collect())
        .unwrap()
}

/// Where the engine's own code looks at (u, v) of a lat-long image, v downward.
fn looks(preset: Preset, u: f64, v: f64) -> [f64; 3] {
    let (sine, up) = (PI * v).sin_cos();
    let turn = TAU * (u - 0.5);
    let (s, c) = (sine * turn.sin(), sine * turn.cos());
    match preset {
        // phi = 2 pi (0.5 - u).
        Preset::Specula => [c, -s, up],
        // vecFromLatLong: (-sin(theta) sin(2 pi u), cos(theta), -sin(theta) cos(2 pi u)).
        Preset::DirectX => [-sine * (TAU * u).sin(), up, -sine * (TAU * u).cos()],
        // u = (1 + atan2(x, -y) / pi) / 2, v = acos(z) / pi, on the axes that the texture is sampled
        // with.
        Preset::Unreal => [s, -c, up],
        // u = 0.5 - atan2(z, x) / (2 pi).
        Preset::Unity => [c, up, -s],
        // u = (atan2(x, z) / pi + 1) / 2 before x is mirrored.
        Preset::Filament => [-s, up, c],
        // u = atan2(z, x) / (2 pi) + 0.5.
        Preset::Three => [c, up, s],
        // u = atan2(z', x') / (2 pi) + 0.5, and the front face, +z, has x' = 1 and z' to the right, +x.
        Preset::Babylon | Preset::BabylonEnv | Preset::Gltf => [s, up, c],
    }
}

/// The associated Legendre function with the phase, times the constants, from Rodrigues' formula.
fn with_phase(l: usize, m: isize, [x, y, z]: [f64; 3]) -> f64 {
    let order = m.unsigned_abs();
    // (z^2 - 1)^l / (2^l l!), derived l + |m| times.
    let mut polynomial = vec![0.0; 2 * l + 1];
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    for k in 0..=l {
        let binomial = factorial(l) / (factorial(k) * factorial(l - k));
        let sign = if (l - k).is_multiple_of(2) { 1.0 } else { -1.0 };
        polynomial[2 * k] = sign * binomial / (2.0_f64.powi(l as i32) * factorial(l));
    }
    for _ in 0..l + order {
        polynomial = polynomial.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
    }
    let derivative = polynomial.iter().rev().fold(0.0, |sum, c| sum * z + c);
    let constant = ((2 * l + 1) as f64 * factorial(l - order) / (4.0 * PI * factorial(l + order))).sqrt();
    // (x + i y)^|m| is sin^|m|(theta) e^(i |m| phi).
    let (mut cosine, mut sine) = (1.0, 0.0);
    for _ in 0..order {
        (cosine, sine) = (cosine * x - sine * y, sine * x + cosine * y);
    }
    let sign = if order.is_multiple_of(2) { 1.0 } else { -1.0 };
    let azimuth = if m < 0 { sine } else { cosine } * if m == 0 { 1.0 } else { 2.0_f64.sqrt() };
    sign * constant * derivative * azimuth
}

fn row(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Evaluates a preset's file as that engine's shader does.
fn shaded(preset: Preset, file: &Value, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let coefficients =
        || -> Vec<Vec<f64>> { file["coefficients"].as_array().unwrap().iter().map(row).collect() };
    let sum = |basis: &[f64]| {
        let rows = coefficients();
        assert_eq!(rows.len(), basis.len());
        [0, 1, 2].map(|c| rows.iter().zip(basis).map(|(row, y)| row[c] * y).sum())
    };
    let polynomials = [1.0, y, z, x, y * x, y * z, 3.0 * z * z - 1.0, z * x, x * x - y * y];
    // The constants as printed in SphericalHarmonics3.js and SHCommon.ush.
    let printed = [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274];
    let signs = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0];
    let product = |a: [f64; 9], b: [f64; 9]| -> [f64; 9] { std::array::from_fn(|i| a[i] * b[i]) };
    match preset {
        Preset::Specula => {
            let expansion = decode(&serde_json::to_vec(file).unwrap()).unwrap();
            Basis::new(expansion.degree()).evaluate(&expansion, Direction::new(DVec3::new(x, y, z)).unwrap())
        }
        Preset::DirectX => {
            let degree = file["degree"].as_u64().unwrap() as usize;
            let lm = (0..=degree).flat_map(|l| (-(l as isize)..=l as isize).map(move |m| (l, m)));
            sum(&lm.map(|(l, m)| with_phase(l, m, [x, y, z])).collect::<Vec<_>>())
        }
        Preset::Unreal => sum(&product(product(printed, signs), polynomials)),
        Preset::Three => sum(&product(printed, polynomials)),
        Preset::Filament => sum(&polynomials),
        // preScaleForRendering multiplies by the signed constants; the shader sums the polynomials.
        Preset::Babylon => sum(&product(product(printed, signs), polynomials)),
        // The shader sums the polynomial as it stands.
        Preset::BabylonEnv => {
            let names = ["x", "y", "z", "xx", "yy", "zz", "yz", "zx", "xy"];
            let values = [x, y, z, x * x, y * y, z * z, y * z, z * x, x * y];
            let terms = names.map(|name| row(&file[name]));
            [0, 1, 2].map(|c| terms.iter().zip(values).map(|(row, value)| row[c] * value).sum())
        }
        Preset::Gltf => sum(&product(product(printed, signs), polynomials)),
        Preset::Unity => {
            let dot =
                |name: &str, v: [f64; 4]| -> f64 { row(&file[name]).iter().zip(v).map(|(a, b)| a * b).sum() };
            let (a, b) = ([x, y, z, 1.0], [x * y, y * z, z * z, z * x]);
            let c = row(&file["SHC"]);
            [("SHAr", "SHBr"), ("SHAg", "SHBg"), ("SHAb", "SHBb")]
                .map(|(linear, quadratic)| dot(linear, a) + dot(quadratic, b))
                .into_iter()
                .zip(c)
                .map(|(sum, c)| sum + c * (x * x - y * y))
                .collect::<Vec<_>>()
                .try_into()
                .unwrap()
        }
    }
}

#[test]
fn each_sh_preset_matches_its_definition() {
    for preset in Preset::ALL {
        for degree in [0, 1, 2, 5, 7] {
            let lighting = lighting(degree);
            let file: Value =
                serde_json::from_slice(&encode(&lighting.clone().into(), preset, None).unwrap()).unwrap();
            assert_eq!(file["preset"], preset.name());
            let kept = Degree::new(preset.degree(lighting.degree())).unwrap();
            assert_eq!(file["degree"], kept.get());
            let mut expected = lighting.to_degree(kept);
            if matches!(preset, Preset::Unity | Preset::Filament | Preset::Babylon) {
                scale(&mut expected, |l, _| [PI, TAU / 3.0, PI / 4.0][l] / PI);
            }
            if preset == Preset::Gltf {
                scale(&mut expected, |l, _| [PI, TAU / 3.0, PI / 4.0][l]);
            }
            if preset == Preset::BabylonEnv {
                // Irradiance over pi, times the cosine's factors over pi once more.
                scale(&mut expected, |l, _| [1.0, 4.0 / 9.0, 1.0 / 16.0][l]);
            }
            let basis = Basis::new(kept);
            for i in 0..60 {
                let (u, v) = ((i as f64 * 0.618_034) % 1.0, (i as f64 + 0.5) / 60.0);
                let ours = basis.evaluate(&expected, Direction::from_angles(PI * v, TAU * (0.5 - u)));
                let theirs = shaded(preset, &file, looks(preset, u, v));
                // Six printed digits of nine constants, coefficients below 0.5; else rounding.
                let tolerance = match preset {
                    Preset::Unreal | Preset::Three | Preset::Babylon => 9.0 * 0.5 * 1.5e-6,
                    Preset::Gltf => PI * 9.0 * 0.5 * 1.5e-6,
                    _ => 1e-13,
                };
                for c in 0..3 {
                    let error = (ours[c] - theirs[c]).abs();
                    assert!(error < tolerance, "{} at ({u}, {v}): {ours:?} {theirs:?}", preset.name());
                }
            }
        }
    }
}

#[test]
fn each_sh_preset_is_reverted() {
    for preset in Preset::ALL {
        for degree in [1, 2, 5] {
            let kept = Degree::new(preset.degree(Degree::new(degree).unwrap())).unwrap();
            let lighting = lighting(degree).to_degree(kept);
            let tables = preset.convert(&lighting);
            let rows: Vec<_> = tables.iter().map(|table| table.rows.clone()).collect();
            // Unity's last vector has four numbers as the others.
            let found = preset.revert(&rows).unwrap();
            let pairs =
                found.coefficients().as_flattened().iter().zip(lighting.coefficients().as_flattened());
            for (found, expected) in pairs {
                assert!((found - expected).abs() < 1e-14, "{}: {found} {expected}", preset.name());
            }
            let broken = preset.revert(&[vec![vec![1.0; 3]; 5]]).unwrap_err().to_string();
            assert!(broken.contains(preset.name()), "{broken}");
        }
    }
    let error = Preset::Gltf.revert(&[vec![vec![1.0; 3]; 16]]).unwrap_err().to_string();
    assert!(error.contains("A_3 is 0"), "{error}");
}

/// Constants as they stand in DirectXMath's `sh_eval_basis_5`.
#[test]
fn the_phase_is_that_of_directx() {
    for (l, m, w, expected) in [
        (1, -1, [0.0, 1.0, 0.0], -0.488_602_511_902_919_9),
        (1, 1, [1.0, 0.0, 0.0], -0.488_602_511_902_919_9),
        (2, 2, [1.0, 0.0, 0.0], 0.546_274_215_296_039_6),
        (3, 3, [1.0, 0.0, 0.0], -0.590_043_589_926_643_5),
        (4, 4, [1.0, 0.0, 0.0], 0.625_835_735_449_176),
        (5, 5, [1.0, 0.0, 0.0], -0.656_382_056_840_170_2),
    ] {
        assert!((with_phase(l, m, w) - expected).abs() < 1e-15, "({l}, {m})");
    }
}

#[test]
fn a_change_of_frame_leaves_no_dust() {
    // One coefficient of degree 1 stays one coefficient, exactly; so does x^2 - y^2 of Unreal's frame.
    let alone = |row: usize| {
        let mut lighting = Expansion::zero(Degree::new(2).unwrap());
        lighting.coefficients_mut()[row] = [1.0; 3];
        lighting
    };
    let cases = [Preset::DirectX, Preset::Unreal, Preset::Three].map(|preset| (preset, 2));
    for (preset, row) in cases.into_iter().chain([(Preset::Unreal, 8)]) {
        let mut values: Vec<f64> =
            preset.convert(&alone(row))[0].rows.iter().map(|row| row[0].abs()).collect();
        values.sort_by(f64::total_cmp);
        assert_eq!(values, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "{}", preset.name());
    }
}

/// T is orthogonal to the last digits in every degree, so that rounding was undone and not made worse.
#[test]
fn a_change_of_frame_keeps_the_norm() {
    for preset in [Preset::DirectX, Preset::Unreal] {
        let lighting = lighting(5).to_degree(Degree::new(preset.degree(Degree::new(5).unwrap())).unwrap());
        let norm = |rows: &[[f64; 3]]| rows.as_flattened().iter().map(|value| value * value).sum::<f64>();
        let turned = frame::seen_in(&lighting, preset.frame().unwrap());
        assert!((norm(turned.coefficients()) / norm(lighting.coefficients()) - 1.0).abs() < 1e-15 * 36.0);
    }
}

#[test]
fn names_are_unique_and_known() {
    for preset in Preset::ALL {
        assert_eq!(Preset::from_name(preset.name()), Some(preset));
    }
    assert_eq!(Preset::from_name("godot"), None);
}

#[test]
fn specula_json_comes_back_bit_for_bit() {
    for degree in [0, 3, 12] {
        let lighting = lighting(degree);
        let recipe = r#"{"kind":"project-sh","parameters":{"degree":0.1}}"#;
        let bytes = encode(&lighting.clone().into(), Preset::Specula, Some(recipe)).unwrap();
        assert_eq!(decode(&bytes).unwrap(), lighting);
        assert_eq!(super::super::read_recipe(&bytes).as_deref(), Some(recipe));
    }
    let error = decode(&encode(&lighting(2).into(), Preset::Three, None).unwrap()).unwrap_err();
    assert_eq!(error.to_string(), "`preset`: expected `specula`, found `three`");
}
