//! Prints the errors of transport next to the reference values in `SPECULA_REFERENCE`, at a number of paths.
//!
//! The arguments are the paths, the number of seeds whose mean is taken (4096 and 1 without them), and the
//! only scene: `cargo run --release -p probes --example reference_errors -- 65536 1 rooms`.

#![allow(clippy::unwrap_used, reason = "the folder is that of the tests")]

use std::f64::consts::PI;
use std::time::Instant;

use probes::{BakeOptions, Scene, Surfaces, bake, bake_lamp};
use serde_json::Value;
use sh::{Degree, Stop};

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

/// The RMS error over the RMS of the expected values.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let difference: f64 = found.iter().zip(expected).map(|(a, b)| (a - b) * (a - b)).sum();
    let size: f64 = expected.iter().map(|b| b * b).sum();
    if size > 0.0 { (difference / size).sqrt() } else { difference.sqrt() }
}

/// T of degree 2 in the order of the reference: [channel][row][column].
fn transfer(surfaces: &Surfaces<'_>, at: &[[f32; 3]], options: &BakeOptions) -> (Vec<Vec<f64>>, Vec<f32>) {
    let baked = bake(surfaces, at, options, Stop::NEVER).unwrap();
    let (columns, channels) = (options.sky.rows(), baked.channels());
    let probe = |t: &[f32]| {
        let mut found = Vec::new();
        for channel in 0..channels {
            for i in 0..9 {
                found.extend((0..9).map(|j| f64::from(t[(i * columns + j) * channels + channel])));
            }
        }
        found
    };
    let length = options.degree.rows() * columns * channels;
    (baked.sky().chunks_exact(length).map(probe).collect(), baked.errors().to_vec())
}

/// The mean of what is baked with each seed.
fn over_seeds(seeds: u32, options: &BakeOptions, bake: impl Fn(&BakeOptions) -> Vec<f64>) -> Vec<f64> {
    let all: Vec<Vec<f64>> =
        (0..seeds).map(|seed| bake(&BakeOptions { seed: seed.into(), ..*options })).collect();
    (0..all[0].len()).map(|k| all.iter().map(|found| found[k]).sum::<f64>() / f64::from(seeds)).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, without: u32| arguments.get(at).map_or(without, |text| text.parse().unwrap());
    let (paths, seeds) = (number(0, 4096), number(1, 1));
    for name in ["cornell", "rooms", "courtyard", "furnace", "textures"] {
        if arguments.get(2).is_some_and(|only| only != name) {
            continue;
        }
        let Some(folder) = test_data::folder("reference_errors", "SPECULA_REFERENCE") else { return };
        let folder = folder.join("probes");
        let bytes = std::fs::read(folder.join(format!("{name}.glb"))).unwrap();
        let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        let mut read = |_: &str| -> Result<_, containers::Error> { unreachable!("one file") };
        let scene: Scene = containers::read_gltf_scene(&bytes, &Default::default(), &mut read).unwrap().scene;
        let surfaces = Surfaces::new(&scene);
        let probes = json["probes"].as_array().unwrap();
        let at: Vec<[f32; 3]> = probes
            .iter()
            .map(|probe| <[f64; 3]>::try_from(numbers(&probe["position"])).unwrap().map(|x| x as f32))
            .collect();
        let base = BakeOptions { paths, sky: Degree::new(2).unwrap(), ..BakeOptions::default() };
        let mean = |options: &BakeOptions| {
            let mut sum: Vec<Vec<f64>> = Vec::new();
            let mut errors = Vec::new();
            for seed in 0..seeds {
                let (found, estimated) =
                    transfer(&surfaces, &at, &BakeOptions { seed: seed.into(), ..*options });
                errors = estimated;
                if sum.is_empty() {
                    sum = vec![vec![0.0; found[0].len()]; found.len()];
                }
                for (sum, found) in sum.iter_mut().flatten().zip(found.iter().flatten()) {
                    *sum += found / f64::from(seeds);
                }
            }
            (sum, errors)
        };
        let started = Instant::now();
        if json["channels_of_transfer"] != 0 {
            let (found, estimated) = mean(&base);
            let expected = |key: &str| -> Vec<Vec<f64>> {
                probes.iter().map(|probe| numbers(&probe["transfer"][key])).collect()
            };
            let flat = |of: &[Vec<f64>]| of.concat();
            let all = expected("all");
            println!("{name}: all {:.5}", relative(&flat(&found), &flat(&all)));
            // Irradiance under a white sky, next to its estimated error.
            let white = |t: &[f64]| -> Vec<f64> {
                let factor =
                    |i: usize| [PI, 2.0 * PI / 3.0, PI / 4.0][usize::from(i > 0) + usize::from(i > 3)];
                (0..9).map(|i| t[i * 9] * factor(i)).collect()
            };
            let (mut square, mut estimate, mut count) = (0.0, 0.0, 0.0);
            for ((found, all), error) in found.iter().zip(&all).zip(&estimated) {
                let (found, all) = (white(found), white(all));
                if all[0] > 1e-3 {
                    square += relative(&found, &all).powi(2);
                    estimate += f64::from(error * error);
                    count += 1.0;
                }
            }
            println!(
                "    irradiance of white: {:.5}, estimated {:.5}",
                (square / count).sqrt(),
                (estimate / count).sqrt()
            );
            let mut before = vec![vec![0.0; found[0].len()]; found.len()];
            let mut sums = before.clone();
            for k in 0..=3 {
                let (found, _) = mean(&BakeOptions { bounces: Some(k), ..base });
                let own: Vec<f64> = flat(&found).iter().zip(flat(&before)).map(|(a, b)| a - b).collect();
                let expected = flat(&expected(&format!("bounces_{k}")));
                sums.iter_mut().flatten().zip(&expected).for_each(|(sum, value)| *sum += value);
                let up_to = relative(&flat(&found), &flat(&sums));
                // The standard error of the file for all light, next to the light of this bounce.
                let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
                let files = json["relative_standard_error"]["transfer"].as_f64().unwrap();
                let files = files * size(&flat(&all)) / size(&expected);
                let error = relative(&own, &expected);
                println!("    bounces {k}: {error:.5} (the file's up to {files:.5}), up to {k}: {up_to:.5}");
                before = found;
            }
        }
        println!("    {:.2} s", started.elapsed().as_secs_f64());
        let keys = ["bounces_0", "bounces_1", "bounces_2", "bounces_3", "all"];
        let options = |key: &str| {
            let bounces = key.strip_prefix("bounces_").map(|k| k.parse().unwrap());
            BakeOptions { bounces, ..base }
        };
        let report = |light: &str, found: [Vec<f64>; 5]| {
            let mut before = vec![0.0; found[0].len()];
            for (key, found) in keys.iter().zip(found) {
                let expected: Vec<f64> =
                    probes.iter().flat_map(|probe| numbers(&probe["lights"][light][*key])).collect();
                let own: Vec<f64> = match *key {
                    "all" => found.clone(),
                    _ => found.iter().zip(&before).map(|(a, b)| a - b).collect(),
                };
                println!("    {light} {key}: {:.5}", relative(&own, &expected));
                before = found;
            }
        };
        for lamp in &scene.parts().lamps {
            let found = keys.map(|key| {
                over_seeds(seeds, &options(key), |options| {
                    let columns = bake_lamp(&surfaces, lamp, &at, options, Stop::NEVER).unwrap();
                    let light = columns.direct.iter().zip(&columns.indirect).enumerate();
                    let color = |k: usize| f64::from(lamp.color[k % 3] * lamp.intensity);
                    light.map(|(k, (a, b))| f64::from(a + b) * color(k)).collect()
                })
            });
            report(&lamp.name, found);
        }
        for (column, material) in scene.emitters().into_iter().enumerate() {
            let material = &scene.parts().materials[material as usize];
            let radiance = material.emission.unwrap().radiance.map(f64::from);
            let found = keys.map(|key| {
                over_seeds(seeds, &options(key), |options| {
                    let baked = bake(&surfaces, &at, options, Stop::NEVER).unwrap();
                    let rows = (0..at.len()).flat_map(|probe| {
                        let mut rows = [[0.0; 3]; 9];
                        baked.add_emission(probe, column, radiance, true, &mut rows);
                        rows.as_flattened().to_vec()
                    });
                    rows.collect()
                })
            });
            report(&material.name, found);
        }
        // In the furnace, rows next to row 0.
        if let Some(closed) = json["closed_form"].as_object() {
            for bounces in [Some(0), Some(1), Some(2), Some(3), None] {
                let baked = bake(&surfaces, &at, &BakeOptions { bounces, ..base }, Stop::NEVER).unwrap();
                let exact = match bounces {
                    Some(n) => 2.0 - 0.5_f64.powi(n as i32),
                    None => 2.0,
                } * 2.0
                    * PI.sqrt();
                let (mut first, mut others) = (0.0_f64, 0.0_f64);
                for probe in 0..at.len() {
                    let mut rows = [[0.0; 3]; 9];
                    baked.add_emission(probe, 0, [1.0; 3], true, &mut rows);
                    first = first.max((rows[0][0] / exact - 1.0).abs());
                    others = rows[1..].iter().fold(others, |most, row| most.max((row[0] / exact).abs()));
                }
                println!("    furnace {bounces:?}: row 0 {first:.6}, others {others:.6}");
            }
            let _ = closed;
        }
    }
}
