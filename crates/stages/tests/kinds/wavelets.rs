//! `largest-wavelets` and `export-wavelets`: errors by definition, files that read back, and messages.

use std::f64::consts::{PI, TAU};

use safetensors::SafeTensors;
use sphere::Direction;
use stages::artifacts::{Environment, Lighting};

use crate::fixture::{Case, case, environment, sky, sky_lighting};
use crate::light_rig::lit;

/// The sky of the fixtures with a lamp of one texel, on an image whose sides are no powers of two.
fn lamp() -> Environment {
    let sky = environment(18, sky).0;
    let mut pixels = sky.pixels().to_vec();
    pixels[5 * sky.grid().width + 7] = [90.0, 60.0, 30.0];
    Environment(envmap::Environment::new(sky.grid(), pixels).unwrap())
}

pub(crate) fn few(parameters: &str) -> Case {
    case("largest-wavelets", parameters).input("environment", lamp())
}

pub(crate) fn exported(parameters: &str) -> Case {
    case("export-wavelets", parameters).input("light", sky_lighting())
}

/// The root mean square of the difference over the sphere, relative to that of `whole`.
fn error(whole: &envmap::Environment, found: &envmap::Environment) -> f64 {
    let grid = whole.grid();
    let squares = |value: &dyn Fn(usize, usize) -> f32| {
        let texel = |k: usize| (0..3).map(|c| f64::from(value(k, c)).powi(2)).sum::<f64>();
        (0..grid.len()).map(|k| grid.solid_angle(k / grid.width) * texel(k)).sum::<f64>()
    };
    let difference = squares(&|k, c| whole.pixels()[k][c] - found.pixels()[k][c]);
    (difference / squares(&|k, c| whole.pixels()[k][c])).sqrt()
}

#[test]
fn few_wavelets_keep_the_light_and_the_note_has_their_error() {
    let whole = lamp().0;
    let mut last = f64::INFINITY;
    for count in [1, 10, 60, 300] {
        let ran = few(&format!("count = {count}")).run().unwrap();
        let found = ran.artifact::<Environment>();
        let error = error(&whole, &found.0);
        let said = format!("{count} of 648 wavelets");
        assert!(ran.notes[0].starts_with(&said), "{:?}", ran.notes);
        let told: f64 = ran.notes[0].rsplit(' ').nth(1).unwrap().parse().unwrap();
        assert!((told / 100.0 - error).abs() < 0.05 * error + 1e-6, "{told} %, {error}");
        assert!(error < last, "{count}: {error}");
        last = error;
        for (found, whole) in found.0.integral().into_iter().zip(whole.integral()) {
            assert!((found / whole - 1.0).abs() < 1e-5, "{found} {whole}");
        }
    }
    // The lamp is there with few of them.
    let ten = few("count = 10").artifact::<Environment>();
    assert!(ten.0.pixels()[5 * whole.grid().width + 7][0] > 45.0);
    // All of them are the light, and more are all.
    let all = few("count = 100000").artifact::<Environment>();
    assert!(error(&whole, &all.0) < 1e-6);
}

#[test]
fn a_tolerance_keeps_the_least_number() {
    let whole = lamp().0;
    for tolerance in [0.3, 0.05, 0.001] {
        let ran = few(&format!("tolerance = {tolerance}")).run().unwrap();
        let found = error(&whole, &ran.artifact::<Environment>().0);
        assert!(found <= tolerance * (1.0 + 1e-5), "{tolerance}: {found}");
        let count: usize = ran.notes[0].split(' ').next().unwrap().parse().unwrap();
        let fewer = few(&format!("count = {}", count - 1)).artifact::<Environment>();
        assert!(error(&whole, &fewer.0) > tolerance, "{count}");
    }
    assert_eq!(few("").run().unwrap().notes[0].split(' ').next(), Some("648"), "1000 is more than all");
}

#[test]
fn what_is_below_zero_is_told() {
    let whole: f64 = lamp().0.integral().iter().sum();
    let mut told = [0; 3];
    for count in 5..60 {
        let ran = few(&format!("count = {count}")).run().unwrap();
        let found = ran.artifact::<Environment>().0.clone();
        let grid = found.grid();
        let texel = |(k, rgb): (usize, &[f32; 3])| {
            grid.solid_angle(k / grid.width) * rgb.iter().map(|v| f64::from(v.min(0.0))).sum::<f64>()
        };
        let percent = -100.0 * found.pixels().iter().enumerate().map(texel).sum::<f64>() / whole;
        let text = "of the light is below zero, which sampling takes as none";
        let (kind, texts) = match percent {
            0.0 => (0, (ran.notes.len(), ran.warnings.len()) == (1, 0)),
            0.0..1.0 => (1, ran.notes[1].ends_with(text) && ran.warnings.is_empty()),
            _ => (2, ran.notes.len() == 1 && ran.warnings[0].contains(text)),
        };
        assert!(texts, "{count}, {percent}: {:?} {:?}", ran.notes, ran.warnings);
        told[kind] += 1;
    }
    assert!(told.iter().all(|count| *count > 0), "{told:?}");
}

/// A tensor of colours.
fn tensor(bytes: &[u8], name: &str) -> (Vec<usize>, Vec<[f32; 3]>) {
    let file = SafeTensors::deserialize(bytes).unwrap();
    let view = file.tensor(name).unwrap();
    let values: Vec<f32> =
        view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    (view.shape().to_vec(), values.as_chunks::<3>().0.to_vec())
}

/// The means over the cells by the rule that the manual gives.
fn restored(rows: usize, haar: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let columns = 2 * rows;
    let at = |row: usize, column: usize| haar[row * columns + column].map(f64::from);
    let add = |a: [f64; 3], b: [f64; 3], sign: f64| [0, 1, 2].map(|c| a[c] + sign * b[c]);
    let mut block = [1.0, -1.0].map(|sign| add(at(0, 0), at(0, 1), sign).map(|v| v * 0.5f64.sqrt())).to_vec();
    let mut size = [1, 2];
    while size[0] < rows {
        let [r, c] = size;
        let mut fine = vec![[0.0; 3]; 4 * r * c];
        for (i, whole) in block.iter().enumerate() {
            let (row, column) = (i / c, i % c);
            let details = [at(row, column + c), at(row + r, column), at(row + r, column + c)];
            for (down, right) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let sign = |odd: usize| if odd % 2 == 1 { -1.0 } else { 1.0 };
                let sum = add(*whole, details[0], sign(right));
                let sum = add(sum, details[1], sign(down));
                let sum = add(sum, details[2], sign(down + right));
                fine[(2 * row + down) * 2 * c + 2 * column + right] = sum.map(|value| value / 2.0);
            }
        }
        (block, size) = (fine, [2 * r, 2 * c]);
    }
    let scale = (4.0 * PI / block.len() as f64).sqrt();
    block.into_iter().map(|value| value.map(|v| v / scale)).collect()
}

#[test]
fn a_mipmap_has_the_means_of_the_series() {
    let Lighting(lighting) = sky_lighting();
    let rows = 8;
    let file = &exported("form = \"mipmap\"\nrows = 8").files()[0];
    let (shape, means) = tensor(file, "level0");
    assert_eq!(shape, [rows, 2 * rows, 3]);
    let fine = 24;
    for (cell, mean) in means.iter().enumerate() {
        let mut sum = [0.0; 3];
        for point in 0..fine * fine {
            let place = |index: usize| (index as f64 + 0.5) / f64::from(fine as u32);
            let z: f64 = 1.0 - 2.0 * ((cell / (2 * rows)) as f64 + place(point / fine)) / rows as f64;
            let azimuth = TAU * ((cell % (2 * rows)) as f64 + place(point % fine)) / (2 * rows) as f64;
            let value = lighting.series.evaluate(Direction::from_angles(z.acos(), azimuth));
            (0..3).for_each(|c| sum[c] += value[c] / f64::from((fine * fine) as u32));
        }
        for (mean, sum) in mean.iter().zip(sum) {
            assert!((f64::from(*mean) - sum).abs() < 2e-3, "{cell}: {mean} {sum}");
        }
    }
    // Each level has the means of the one before, and the last that of the sphere.
    for level in 1..=4 {
        let [(_, finer), (shape, coarse)] = [level - 1, level].map(|l| tensor(file, &format!("level{l}")));
        assert_eq!(shape, [(rows >> level).max(1), ((2 * rows) >> level).max(1), 3]);
        let mean = |values: &[[f32; 3]]| {
            values.iter().map(|rgb| f64::from(rgb[1])).sum::<f64>() / values.len() as f64
        };
        assert!((mean(&finer) - mean(&coarse)).abs() < 1e-6);
    }
    let (_, last) = tensor(file, "level4");
    assert!((f64::from(last[0][0]) - lighting.series.coefficients()[0][0] / (4.0 * PI).sqrt()).abs() < 1e-6);
}

#[test]
fn wavelets_are_restored_as_the_manual_says() {
    for (parameters, light) in [("", None), ("rows = 16", Some(lamp())), ("rows = 1", None)] {
        let with = |more: &str| {
            let text = format!("{parameters}\n{more}");
            match &light {
                Some(light) => case("export-wavelets", &text).input("light", light.clone()),
                None => exported(&text),
            }
        };
        let means = tensor(&with("form = \"mipmap\"").files()[0], "level0").1;
        let file = with("").files();
        let (shape, haar) = tensor(&file[0], "haar");
        let rows = shape[0];
        let restored = restored(rows, &haar);
        let largest = means.as_flattened().iter().fold(0.0f32, |most, value| most.max(value.abs()));
        for (found, expected) in restored.as_flattened().iter().zip(means.as_flattened()) {
            assert!((*found - f64::from(*expected)).abs() < 1e-5 * f64::from(largest), "{found} {expected}");
        }
        if rows == 1 {
            continue;
        }
        // The largest, first the mean, are those of the whole file, and the rest has the error that is said.
        let ran = with("count = 20").run().unwrap();
        let file = ran.files()[0];
        let index = SafeTensors::deserialize(file).unwrap().tensor("index").unwrap().data().to_vec();
        let index: Vec<u32> =
            index.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        let (_, kept) = tensor(file, "haar");
        assert_eq!((index[0], index.len(), kept.len()), (0, 20, 20));
        let square = |rgb: &[f32; 3]| rgb.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>();
        for (index, value) in index.iter().zip(&kept) {
            assert_eq!(haar[*index as usize], *value);
        }
        let least = kept.iter().map(square).fold(f64::INFINITY, f64::min);
        let dropped = || (0..haar.len()).filter(|at| !index.contains(&(*at as u32)));
        assert!(dropped().all(|at| square(&haar[at]) <= least));
        let (_, metadata) = SafeTensors::read_metadata(file).unwrap();
        let told: f64 = metadata.metadata().as_ref().unwrap()["error"].parse().unwrap();
        let rest: f64 = dropped().map(|at| square(&haar[at])).sum();
        let whole: f64 = haar.iter().map(square).sum();
        assert!((told - (rest / whole).sqrt()).abs() < 1e-6, "{told}");
    }
}

#[test]
fn cells_of_an_environment_hold_its_light() {
    let file = &case("export-wavelets", "form = \"mipmap\"").input("light", lamp()).files()[0];
    let (shape, means) = tensor(file, "level0");
    assert_eq!(shape, [16, 32, 3], "the power of two nearest to 18 rows");
    let sum: f64 = means.iter().map(|rgb| f64::from(rgb[0])).sum();
    let integral = lamp().0.integral()[0];
    assert!((sum * 4.0 * PI / means.len() as f64 / integral - 1.0).abs() < 1e-5);
}

#[test]
fn errors_name_the_parameter() {
    let both = "count already gives the number of wavelets; leave out one of the two";
    for (case, expected) in [
        (few("count = 3\ntolerance = 0.1"), both),
        (exported("count = 3\ntolerance = 0.1"), both),
        (exported("rows = 24"), "24 is not a power of two; the nearest is 32"),
        (exported("form = \"mipmap\"\ncount = 3"), "only form = \"haar\" uses it"),
    ] {
        assert!(case.errors().iter().any(|error| error.contains(expected)), "{:?}", case.errors());
    }
    let ran = case("export-wavelets", "").input("light", lit()).run().unwrap();
    assert!(ran.warnings[0].contains("beside the series"), "{:?}", ran.warnings);
    assert!(ran.warnings[0].contains("not written"), "{:?}", ran.warnings);
}
