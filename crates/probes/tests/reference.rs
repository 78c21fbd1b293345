//! Transport next to values that were computed without this project's code: five scenes, about 30 probes
//! each.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::PI;

use probes::{
    BakeOptions, Lattice, LitProbes, ProbePlaces, Scene, SceneLighting, Surfaces, Transport, Volume, bake,
    bake_lamp,
};
use serde_json::Value;
use sh::{Degree, Expansion, Stop};

/// A scene, its values, and where its probes are.
struct Reference {
    json: Value,
    scene: Scene,
    at: Vec<[f32; 3]>,
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

fn rows(value: &Value) -> Vec<[f64; 3]> {
    numbers(value).as_chunks::<3>().0.to_vec()
}

impl Reference {
    fn load(test: &str, name: &str) -> Option<Self> {
        let json = test_data::reference(test, &format!("probes/{name}.json"))?;
        let folder = test_data::folder(test, "SPECULA_REFERENCE")?;
        let bytes = std::fs::read(folder.join(format!("probes/{name}.glb"))).unwrap();
        let mut read = |_: &str| -> Result<_, containers::Error> { unreachable!("one file") };
        let scene = containers::read_gltf_scene(&bytes, &Default::default(), &mut read).unwrap().scene;
        let place = |probe: &Value| <[f64; 3]>::try_from(numbers(&probe["position"])).unwrap();
        let at = json["probes"].as_array().unwrap().iter().map(|probe| place(probe).map(|x| x as f32));
        Some(Self { at: at.collect(), scene, json })
    }

    /// The reference with every n-th of its probes, for tests of many paths.
    fn thinned(mut self, n: usize) -> Self {
        self.at = self.at.into_iter().step_by(n).collect();
        let probes = self.json["probes"].as_array_mut().unwrap();
        *probes = std::mem::take(probes).into_iter().step_by(n).collect();
        self
    }

    fn probes(&self) -> &[Value] {
        self.json["probes"].as_array().unwrap()
    }

    /// A transport of degree 4 from a sky of degree 2, at the default number of paths.
    fn transport(&self, bounces: Option<u32>) -> Transport {
        let [degree, sky] = [4, 2].map(|degree| Degree::new(degree).unwrap());
        let options = BakeOptions { degree, sky, bounces, ..BakeOptions::default() };
        bake(&Surfaces::new(&self.scene), &self.at, &options, Stop::NEVER).unwrap()
    }

    /// What arrives at a probe under the lighting of the file, without its lamps.
    fn lit(&self, transport: &Transport, probe: usize) -> Vec<[f64; 3]> {
        let sky = rows(&self.json["lighting"]["sky"]);
        let sky = Expansion::from_coefficients(Degree::new(2).unwrap(), sky).unwrap();
        let mut found = vec![[0.0; 3]; 25];
        transport.add_sky(probe, &sky, &mut found);
        for (emitter, material) in self.scene.emitters().into_iter().enumerate() {
            let emission = self.scene.parts().materials[material as usize].emission.unwrap();
            transport.add_emission(probe, emitter, emission.radiance.map(f64::from), true, &mut found);
        }
        found
    }
}

/// The RMS error of many lists of numbers over the RMS of what is expected.
fn relative(pairs: impl Iterator<Item = (Vec<f64>, Vec<f64>)>) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for (found, expected) in pairs {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            difference += (a - b) * (a - b);
            size += b * b;
        }
    }
    (difference / size).sqrt()
}

/// T of degree 2 at a probe, in the order of the files: [channel, row, column].
fn matrix(transport: &Transport, probe: usize) -> Vec<f64> {
    matrix_of(transport, probe, 25)
}

/// T of degree 2 at a probe of a transport with so many rows, in the order of the files.
fn matrix_of(transport: &Transport, probe: usize, rows: usize) -> Vec<f64> {
    let channels = transport.channels();
    let t = &transport.sky()[probe * rows * 9 * channels..];
    let at = |channel: usize, k: usize| f64::from(t[k * channels + channel]);
    (0..channels).flat_map(|channel| (0..81).map(move |k| at(channel, k))).collect()
}

/// Irradiance by 25 rows toward a normal.
fn irradiance(rows: &[[f64; 3]], normal: [f64; 3]) -> [f64; 3] {
    let degree = Degree::new(4).unwrap();
    let factors = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0];
    let factor = |row: usize| factors[(0..5).find(|l| row < (l + 1) * (l + 1)).unwrap()];
    let rows = rows.iter().enumerate().map(|(row, light)| light.map(|light| factor(row) * light)).collect();
    let toward = sphere::Direction::normalised(sphere::DVec3::from(normal));
    Expansion::from_coefficients(degree, rows).unwrap().evaluate(toward)
}

/// Errors at 4096 paths. Those of the files are 0.1 percent, those of truncation at F = 4 2 percent at most.
#[test]
fn transport_is_that_of_the_reference() {
    let mut scenes = 0;
    for name in ["cornell", "rooms", "courtyard", "textures"] {
        let Some(reference) = Reference::load("transport_is_that_of_the_reference", name) else { return };
        let transport = reference.transport(None);
        let expected = |probe: &Value| numbers(&probe["transfer"]["all"]);
        let probes = || reference.probes().iter().enumerate();
        let all = relative(probes().map(|(k, probe)| (matrix(&transport, k), expected(probe))));
        assert!(all < 0.03, "{name}: {all}");

        // Irradiance under a white sky: its standard error is what it says it is. 30 probes of 9 rows, of
        // which the first counts most, are known to some 15 percent, and the estimates as well.
        let factor = |i: usize| if i == 0 { PI } else { [2.0 * PI / 3.0, PI / 4.0][usize::from(i > 3)] };
        let white = |t: &[f64]| -> Vec<f64> { (0..9).map(|i| factor(i) * t[9 * i]).collect() };
        let (mut squares, mut estimates) = (0.0, 0.0);
        for (k, probe) in probes().filter(|_| reference.scene.emitters().is_empty()) {
            let one = (white(&matrix(&transport, k)), white(&expected(probe)));
            if one.1[0] > 1e-3 {
                squares += relative([one].into_iter()).powi(2);
                estimates += f64::from(transport.errors()[k]).powi(2);
            }
        }
        let ratio = (squares / estimates).sqrt();
        assert!(estimates == 0.0 || (0.6..1.6).contains(&ratio), "{name}: {ratio}");

        // One reflection, together with what is seen.
        let one = reference.transport(Some(1));
        let up_to_one = |probe: &Value| -> Vec<f64> {
            let [a, b] = ["bounces_0", "bounces_1"].map(|key| numbers(&probe["transfer"][key]));
            a.iter().zip(b).map(|(a, b)| a + b).collect()
        };
        let error = relative(probes().map(|(k, probe)| (matrix(&one, k), up_to_one(probe))));
        assert!(error < 0.03, "{name}: {error}");

        let mut lit: Vec<Vec<[f64; 3]>> =
            (0..reference.at.len()).map(|k| reference.lit(&transport, k)).collect();
        for lamp in &reference.scene.parts().lamps {
            let options = BakeOptions { degree: Degree::new(4).unwrap(), ..BakeOptions::default() };
            let surfaces = Surfaces::new(&reference.scene);
            let columns = bake_lamp(&surfaces, lamp, &reference.at, &options, Stop::NEVER).unwrap();
            let own = columns.direct.iter().zip(&columns.indirect).map(|(a, b)| f64::from(a + b));
            let own: Vec<f64> =
                own.zip((0..3).cycle()).map(|(x, k)| x * f64::from(lamp.color[k] * lamp.intensity)).collect();
            let nine = |k: usize| own[k * 75..][..27].to_vec();
            let expected = |probe: &Value| numbers(&probe["lights"][&lamp.name]["all"]);
            let error = relative(probes().map(|(k, probe)| (nine(k), expected(probe))));
            assert!(error < 0.03, "{name}, {}: {error}", lamp.name);
            for (sum, own) in lit.iter_mut().flatten().zip(own.as_chunks::<3>().0) {
                (0..3).for_each(|channel| sum[channel] += own[channel]);
            }
        }
        let nine = |k: usize| lit[k][..9].as_flattened().to_vec();
        let expected = |probe: &Value| numbers(&probe["incident"]["all"])[..27].to_vec();
        let error = relative(probes().map(|(k, probe)| (nine(k), expected(probe))));
        assert!(error < 0.03, "{name}, incident: {error}");
        let normals = rows(&reference.json["normals"]);
        let toward = |k: usize| normals.iter().flat_map(|normal| irradiance(&lit[k], *normal)).collect();
        let expected = |probe: &Value| numbers(&probe["irradiance"]["all"]);
        let error = relative(probes().map(|(k, probe)| (toward(k), expected(probe))));
        assert!(error < 0.025, "{name}, irradiance: {error}");
        scenes += 1;
    }
    assert_eq!(scenes, 4);
}

/// The light of each number of reflections on its own: 3 percent at the default, and in cornell 0.7 at 65,536
/// paths, beside the error of the file. That of all light is in the file; a path brings light of one number
/// of reflections alone, so that each of them has no larger one.
#[test]
fn light_of_each_number_of_reflections_is_that_of_the_reference() {
    let test = "light_of_each_number_of_reflections_is_that_of_the_reference";
    let most = test_data::length(test, "paths", 65_536, 4096);
    for (name, paths) in [("cornell", most), ("courtyard", 4096)] {
        let limit = if paths == 4096 { 0.03 } else { 0.007 };
        let Some(reference) = Reference::load(test, name) else { return };
        let reference = reference.thinned(3);
        let surfaces = Surfaces::new(&reference.scene);
        let expected = |key: &str| -> Vec<f64> {
            reference.probes().iter().flat_map(|probe| numbers(&probe["transfer"][key])).collect()
        };
        let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let files = reference.json["relative_standard_error"]["transfer"].as_f64().unwrap();
        let files = files * files * size(&expected("all"));
        let mut before = vec![0.0; expected("all").len()];
        for bounces in 0..=3 {
            let sky = Degree::new(2).unwrap();
            let options = BakeOptions { sky, bounces: Some(bounces), paths, ..BakeOptions::default() };
            let transport = bake(&surfaces, &reference.at, &options, Stop::NEVER).unwrap();
            let found: Vec<f64> =
                (0..reference.at.len()).flat_map(|probe| matrix_of(&transport, probe, 9)).collect();
            let expected = expected(&format!("bounces_{bounces}"));
            let own = found.iter().zip(&before).map(|(up_to, before)| up_to - before);
            let difference: Vec<f64> = own.zip(&expected).map(|(found, expected)| found - expected).collect();
            let (error, most) = (size(&difference), limit * limit * size(&expected) + files);
            assert!(error < most, "{name}, {bounces}: {}", (error / size(&expected)).sqrt());
            before = found;
        }
    }
}

/// The rooms see the sky through a window alone, and a third of their probes are nearer to a wall than 10 cm:
/// RMS over four seeds, light of one, two and three reflections has errors of 3.9, 6.1 and 5.8 percent, the
/// file's own up to 2.7 and 4.7 in the last two. A path that was not split next to its probe had 5.5, 8.4 and
/// 7.7. The goal is 3 percent beside the error of the file. What is left is noise, and not a bias: eight
/// seeds have 0.4, 2.3 and 3.0 percent in common, within the error of the file. It is that of the cache's
/// points and of the parts of paths. With four times the points of as many rays each, the errors are 3.5, 4.8
/// and 3.5, and the caches take four times as long. With 16 parts in place of 4, from twice as far, that take
/// their directions from one sequence in turn, and twice the points of half the rays, they are 2.6, 4.6 and
/// 4.4, and 1024 probes of the benchmark's hall take three times as long.
#[test]
fn probes_next_to_walls_find_a_window() {
    let Some(reference) = Reference::load("probes_next_to_walls_find_a_window", "rooms") else { return };
    let surfaces = Surfaces::new(&reference.scene);
    let (mut squares, mut sizes) = ([0.0; 3], [0.0; 3]);
    for seed in 0..4 {
        let mut before: Vec<f64> = Vec::new();
        for bounces in 0..=3 {
            let sky = Degree::new(2).unwrap();
            let options = BakeOptions { sky, bounces: Some(bounces), seed, ..BakeOptions::default() };
            let transport = bake(&surfaces, &reference.at, &options, Stop::NEVER).unwrap();
            let probes = 0..reference.at.len();
            let found: Vec<f64> = probes.flat_map(|probe| matrix_of(&transport, probe, 9)).collect();
            if let Some(k) = (bounces as usize).checked_sub(1) {
                let key = format!("bounces_{bounces}");
                let expected = reference.probes().iter().flat_map(|probe| numbers(&probe["transfer"][&key]));
                for ((found, before), expected) in found.iter().zip(&before).zip(expected) {
                    squares[k] += (found - before - expected) * (found - before - expected);
                    sizes[k] += expected * expected;
                }
            }
            before = found;
        }
    }
    let errors = [0, 1, 2].map(|k: usize| (squares[k] / sizes[k]).sqrt());
    println!("rooms, one to three reflections: {errors:.3?}");
    assert!(errors.iter().zip([0.045, 0.07, 0.068]).all(|(error, limit)| *error < limit), "{errors:?}");
}

/// Points of the cache stand for the surface around them: a bias, if any, is what seeds have in common. The
/// mean of 16 is within the limit, too, and takes three minutes of a core.
#[test]
fn the_mean_of_seeds_has_no_bias() {
    let test = "the_mean_of_seeds_has_no_bias";
    let paths = test_data::length(test, "paths", 65_536, 4096);
    // At 4096 paths, noise of 1.1 percent is 0.28 in the mean of 16.
    let (seeds, limit) = if paths == 4096 { (16_u32, 0.004) } else { (4, 0.0025) };
    let Some(reference) = Reference::load(test, "courtyard") else { return };
    let reference = reference.thinned(6);
    let surfaces = Surfaces::new(&reference.scene);
    let mut sum = vec![0.0; 81 * reference.at.len()];
    for seed in 0..seeds {
        let sky = Degree::new(2).unwrap();
        let options = BakeOptions { sky, paths, seed: seed.into(), ..BakeOptions::default() };
        let transport = bake(&surfaces, &reference.at, &options, Stop::NEVER).unwrap();
        let found = (0..reference.at.len()).flat_map(|probe| matrix_of(&transport, probe, 9));
        sum.iter_mut().zip(found).for_each(|(sum, found)| *sum += found / f64::from(seeds));
    }
    let expected = reference.probes().iter().flat_map(|probe| numbers(&probe["transfer"]["all"])).collect();
    let error = relative([(sum, expected)].into_iter());
    assert!(error < limit, "{error}");
}

/// What no light reaches gets none: not even by rounding.
#[test]
fn nothing_passes_a_wall() {
    let Some(reference) = Reference::load("nothing_passes_a_wall", "rooms") else { return };
    let transport = reference.transport(None);
    let surfaces = Surfaces::new(&reference.scene);
    let lamp = &reference.scene.parts().lamps[0];
    let columns = bake_lamp(&surfaces, lamp, &reference.at, &BakeOptions::default(), Stop::NEVER).unwrap();
    let mut dark = [0, 0];
    for (k, at) in reference.at.iter().enumerate() {
        let of_lamp = columns.direct[27 * k..][..27].iter().chain(&columns.indirect[27 * k..][..27]);
        if at[1] > 0.01 {
            assert!(matrix(&transport, k).iter().all(|t| *t == 0.0), "{at:?}");
            dark[0] += 1;
        } else {
            assert!(of_lamp.into_iter().all(|t| *t == 0.0), "{at:?}");
            dark[1] += 1;
        }
    }
    assert!(dark.iter().all(|count| *count > 5), "{dark:?}");
}

/// Radiance after n reflections is e (1 + a + ... + a^n), everywhere: at the default, row 0 within 1e-4 of it
/// after some reflections and within 5e-3 after all, with a million paths of a probe within 1e-3 after all.
/// The other rows are 0: within 5e-3 of row 0.
#[test]
fn the_furnace_shines_as_its_closed_form() {
    let Some(reference) = Reference::load("the_furnace_shines_as_its_closed_form", "furnace") else { return };
    let surfaces = Surfaces::new(&reference.scene);
    for (paths, bounces, sum, limit) in [
        (4096, Some(0), 1.0, 1e-4),
        (4096, Some(2), 1.75, 1e-4),
        (4096, None, 2.0, 5e-3),
        (1 << 20, None, 2.0, 1e-3),
    ] {
        let [degree, sky] = [4, 2].map(|degree| Degree::new(degree).unwrap());
        let options = BakeOptions { degree, sky, bounces, paths, ..BakeOptions::default() };
        let at = &reference.at[..if paths == 4096 { reference.at.len() } else { 1 }];
        let transport = bake(&surfaces, at, &options, Stop::NEVER).unwrap();
        let expected = sum * 2.0 * PI.sqrt();
        let mut errors = [0.0_f64; 2];
        for k in 0..at.len() {
            let mut found = vec![[0.0; 3]; 25];
            transport.add_emission(k, 0, [1.0; 3], true, &mut found);
            errors[0] = errors[0].max((found[0][1] / expected - 1.0).abs());
            errors[1] = found[1..9].iter().fold(errors[1], |most, row| most.max(row[1].abs() / expected));
        }
        println!("furnace, {bounces:?} at {paths} paths: row 0 {:.1e}, others {:.1e}", errors[0], errors[1]);
        assert!(errors[0] < limit && errors[1] < 5e-3, "{bounces:?}: {errors:?}");
        assert!(transport.sky().iter().all(|t| *t == 0.0));
    }
}

/// The light of the sky on surfaces between probes that are half and a quarter of a metre apart. A plain try
/// (trilinear, without probes behind walls or inside of something) has errors of 20 and 7 percent in the
/// rooms, and of 3.5 and 3 in the courtyard: no worse than these. Ours has 16.9, 3.2, 2.6 and 1.7 percent,
/// some of it the noise of few paths.
#[test]
fn surfaces_take_their_light_from_probes_on_their_side() {
    let test = "surfaces_take_their_light_from_probes_on_their_side";
    let courtyard = Some([[-3.5, -3.5, -0.5], [3.5, 3.5, 2.5]]);
    for (name, bounds, spacing, paths, limit) in [
        ("rooms", None, 0.5, 4096, 0.2),
        ("rooms", None, 0.25, 2048, 0.07),
        ("courtyard", courtyard, 0.5, 1024, 0.035),
        ("courtyard", courtyard, 0.25, 512, 0.03),
    ] {
        let Some(reference) = Reference::load(test, name) else { return };
        let surfaces = Surfaces::new(&reference.scene);
        let bounds = bounds.unwrap_or(reference.scene.bounds());
        let volume = Volume::with_spacing(name.into(), bounds, spacing, Lattice::Corners).unwrap();
        let places = ProbePlaces::new(&surfaces, vec![volume], &[], Stop::NEVER).unwrap();
        let degree = Degree::new(2).unwrap();
        let options = BakeOptions { sky: degree, paths, ..BakeOptions::default() };
        let transport = bake(&surfaces, places.positions(), &options, Stop::NEVER).unwrap();
        let sky = rows(&reference.json["lighting"]["sky"]);
        let sky = Expansion::from_coefficients(degree, sky).unwrap();
        let lighting = SceneLighting { sky: Some(&sky), ..SceneLighting::default() };
        let lit = LitProbes::new(&places, &transport, &lighting).unwrap();
        let mut pairs = Vec::new();
        for receiver in reference.json["receivers"].as_array().unwrap() {
            let three = |key: &str| <[f64; 3]>::try_from(numbers(&receiver[key])).unwrap();
            let (at, normal) = (three("position"), three("normal"));
            let is_inside =
                |axis: usize| (f64::from(bounds[0][axis])..=f64::from(bounds[1][axis])).contains(&at[axis]);
            if !(0..3).all(is_inside) {
                continue;
            }
            let found = lit.irradiance(&places, at.map(|x| x as f32), normal.map(|x| x as f32)).unwrap();
            let expected = numbers(&receiver["irradiance"]["all_of_the_sky"]);
            // The dark room stays dark.
            assert!(expected[0] > 0.0 || found == [0.0; 3], "{name} {at:?}: {found:?}");
            pairs.push((found.to_vec(), expected));
        }
        assert!(pairs.len() > 50, "{name}: {}", pairs.len());
        let error = relative(pairs.into_iter());
        println!("{name}, {spacing} m: {:.1} %", 100.0 * error);
        assert!(error < limit, "{name}, {spacing} m: {error}");
    }
}
