//! What a preview shows of photographs without a material: white metal under what is exported of them.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use containers::{Precision, write_exr};
use engine::{BuildOptions, Cancel, Plan, ResultsSnapshot};
use preview::{Aim, Background, Camera, Cpu, Mode, Object, PointSet, Renderer, Scene, Shot, Show};
use sphere::{DVec3, LatLong, Rotation};
use stages::{PreviewCatalog, ROUGHNESSES, SceneCache};

use crate::preview_catalog::{build, load, project};

/// A project of photographs without a material, of one smooth light, and these stages.
fn photographs(stages: &str) -> (tempfile::TempDir, Plan) {
    let folder = tempfile::tempdir().unwrap();
    photograph(folder.path(), smooth);
    let sources = "schema = 1\n[stage.environment]\nkind = \"import-environment\"\nsource = \"*.exr\"\n";
    fs::write(folder.path().join("pipeline.toml"), format!("{sources}{stages}")).unwrap();
    let plan = load(folder.path());
    (folder, plan)
}

/// Writes the photograph of a light.
fn photograph(folder: &Path, light: impl Fn(DVec3) -> [f64; 3]) {
    let grid = LatLong::with_rows(64);
    let direction = |pixel: usize| grid.direction(pixel / grid.width, pixel % grid.width).vector();
    let pixels = (0..grid.len()).map(|pixel| light(direction(pixel)).map(|value| value as f32)).collect();
    let image = envmap::Image::new(grid.width, grid.height, pixels).unwrap();
    fs::write(folder.join("sky.exr"), write_exr(&image, Precision::Float, None).unwrap().bytes).unwrap();
}

/// Another colour from each side.
fn smooth(d: DVec3) -> [f64; 3] {
    [0.3 + d.x.max(0.0), 0.3 + d.y.max(0.0), 0.3 + (-0.6 * d.x + 0.8 * d.z).max(0.0)]
}

/// The light about a direction as `prefilter` defines it, summed over the sphere without any of our kernels.
fn about(r: DVec3, roughness: f64) -> [f64; 3] {
    if roughness == 0.0 {
        return smooth(r);
    }
    let a2 = roughness.powi(4);
    let (mut sum, mut whole) = ([0.0; 3], 0.0);
    for row in 0..256 {
        let z: f64 = 1.0 - (row as f64 + 0.5) / 128.0;
        for column in 0..256 {
            let phi = (column as f64 + 0.5) / 256.0 * std::f64::consts::TAU;
            let level = (1.0 - z * z).sqrt();
            let w = DVec3::new(level * phi.cos(), level * phi.sin(), z);
            let mu = r.dot(w).max(0.0);
            let weight = mu / (1.0 + a2 - (1.0 - a2) * mu).powi(2);
            whole += weight;
            let light = smooth(w);
            (0..3).for_each(|channel| sum[channel] += weight * light[channel]);
        }
    }
    sum.map(|value| value / whole)
}

/// The radiance of each sphere of a row where a ray through its middle meets it, and the direction that is
/// reflected there.
fn middles(scene: &Scene, mode: Mode) -> Vec<([f64; 3], DVec3)> {
    let size = [500, 100];
    let camera = Camera::new(scene.framing());
    let shot = Shot {
        size,
        samples: 1,
        camera,
        turn: Rotation::IDENTITY,
        show: Show::One(mode),
        background: Background::Environment,
        exposure: 0.0,
        tone: envmap::ToneMap::Plain,
        light_samples: 256,
        points: PointSet::Even,
    };
    let picture = Cpu::new().render(scene, &shot, sh::Stop::NEVER).unwrap();
    let eye = camera.eye();
    let middle = |object: &Object| {
        let centre = object.place.translation;
        // The pixel whose ray passes the centre most closely.
        let ray = |pixel: usize| {
            let at = [pixel % 500, pixel / 500].map(|place| place as f64 + 0.5);
            camera.ray(size, at).normalize()
        };
        let miss = |pixel: &usize| (centre - eye).cross(ray(*pixel)).length();
        let pixel = (0..500 * 100).min_by(|one, other| miss(one).total_cmp(&miss(other))).unwrap();
        let (ray, from) = (ray(pixel), eye - centre);
        let along = from.dot(ray);
        let far = -along - (along * along - from.length_squared() + 1.0).sqrt();
        let normal = (from + ray * far).normalize();
        let [red, green, blue, _] = picture.radiance[pixel].map(f64::from);
        ([red, green, blue], ray - normal * (2.0 * normal.dot(ray)))
    };
    scene.objects.iter().map(middle).collect()
}

/// Every engine's file, and cubes with levels, in every container: what lights white metal is the light about
/// the direction of a mirror, from the right side. Of whole levels, such as the mirror and for most engines
/// the roughest, it is within a texel of 1.4 degrees; between levels an engine interpolates, which is its own
/// error.
#[test]
fn white_metal_is_lit_by_the_exported_files() {
    let engines = [
        "preset = \"three\"\nformat = \"rgba16f\"",
        "preset = \"three\"\nformat = \"bc6h\"",
        "preset = \"filament\"",
        "preset = \"babylon\"",
        "preset = \"babylon\"\nformat = \"rgba32f\"",
        "preset = \"bevy\"",
        "preset = \"gltf\"",
    ];
    let engines = engines.map(|preset| {
        format!(
            "[stage.light]\nkind = \"export-engine\"\ninput = \"environment\"\n{preset}\nresolution = 128\n\
             path = \"{{environment}}\"\n"
        )
    });
    let textures = ["format = \"ktx2\"\ntexels = \"rgb9e5\"", "format = \"dds\""].map(|format| {
        format!(
            "[stage.prefiltered]\nkind = \"prefilter\"\ninput = \"environment\"\nresolution = 64\n\
             roughness = [0.0, 0.2, 0.4, 0.7, 1.0]\n[stage.light]\nkind = \"export-environment\"\n\
             input = \"prefiltered\"\nlayout = \"cube\"\n{format}\n"
        )
    });
    for stages in engines.iter().chain(&textures) {
        let (_folder, plan) = photographs(stages);
        let results = build(&plan);
        let catalog = PreviewCatalog::of(plan);
        let entry = catalog.entry("sky", "white metal").unwrap().unwrap();
        let scene = SceneCache::default().scene(&catalog, &results, entry, "sphere").unwrap();
        assert_eq!((scene.objects.len(), scene.first_mode()), (5, Mode::Prefiltered), "{stages}");
        let middles = middles(&scene, Mode::Prefiltered);
        for ((object, (found, reflected)), roughness) in scene.objects.iter().zip(&middles).zip(ROUGHNESSES) {
            let expected = about(*reflected, roughness);
            let (_, level) = object.look.prefiltered_cube().unwrap();
            let allowed = if level.fract() == 0.0 { 0.02 } else { 0.06 };
            for channel in 0..3 {
                let apart = (found[channel] - expected[channel]).abs();
                assert!(apart < allowed, "{stages}\nroughness {roughness}: {found:?} for {expected:?}");
            }
        }
    }
}

/// An engine that filters the image itself, or a sky for no engine: the metal is lit by the image.
#[test]
fn without_a_cube_white_metal_is_lit_by_the_image() {
    let image = "[stage.light]\nkind = \"export-engine\"\ninput = \"environment\"\npreset = \"blender\"\n\
                 path = \"{environment}\"\n";
    let sky = "[stage.sky]\nkind = \"export-environment\"\ninput = \"environment\"\n";
    for stages in [image, sky, ""] {
        let (_folder, plan) = photographs(stages);
        let results = build(&plan);
        let catalog = PreviewCatalog::of(plan);
        let entry = catalog.entry("sky", "white metal").unwrap().unwrap();
        let scene = SceneCache::default().scene(&catalog, &results, entry, "sphere").unwrap();
        assert_eq!(scene.first_mode(), Mode::BruteForce, "{stages}");
        assert!(!scene.offers(Mode::Prefiltered) && scene.offers(Mode::Mirror));
        let notes = catalog.facts(&results, entry).notes;
        let is_said = notes.iter().any(|note| note.starts_with("light: blender filters the image itself"));
        assert_eq!(is_said, stages == image, "{notes:?}");
        // The mirror needs no more than a few samples.
        let (found, reflected) = middles(&scene, Mode::BruteForce)[0];
        let expected = smooth(reflected);
        assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 0.05), "{found:?} for {expected:?}");
    }
}

/// Lights that leave the image light the metal beside it: the picture is that of the whole photograph, summed
/// over its texels. What the engine interpolates between levels is its own error, as above.
#[test]
fn lights_beside_the_image_light_white_metal() {
    let stage = |preset: &str| {
        format!(
            "[stage.light]\nkind = \"export-engine\"\ninput = \"environment\"\n{preset}\nsun = \"light\"\n\
             path = \"{{environment}}\"\n"
        )
    };
    let scene = |folder: &Path| {
        let plan = load(folder);
        let results = build(&plan);
        let catalog = PreviewCatalog::of(plan);
        let entry = catalog.entry("sky", "white metal").unwrap().unwrap();
        let notes = catalog.facts(&results, entry).notes;
        (SceneCache::default().scene(&catalog, &results, entry, "sphere").unwrap(), notes)
    };
    // Toward the highlight of the piece in the middle.
    let (folder, _) = photographs(&stage("preset = \"three\""));
    let toward = middles(&scene(folder.path()).0, Mode::Mirror)[2].1;
    let sun = move |d: DVec3| match d.dot(toward) > 0.999 {
        true => smooth(d).map(|value| value + 1000.0),
        false => smooth(d),
    };
    let cubes = [
        "preset = \"three\"\nresolution = 64\nskybox-resolution = 16",
        "preset = \"babylon\"\nformat = \"rgba32f\"\nresolution = 64\nskybox = false",
    ];
    for preset in cubes {
        let (folder, _) = photographs(&stage(preset));
        photograph(folder.path(), sun);
        let (scene, notes) = scene(folder.path());
        assert!(!notes.iter().any(|note| note.contains("the metal")), "{notes:?}");
        let [found, expected] = [Mode::Prefiltered, Mode::BruteForce].map(|mode| middles(&scene, mode));
        // The first is a mirror, whose sun is a disk here and texels there.
        for k in 1..5 {
            for channel in 0..3 {
                let (found, expected) = (found[k].0[channel], expected[k].0[channel]);
                let allowed = 0.06 + 0.05 * expected;
                assert!((found - expected).abs() < allowed, "{preset}\n{k}: {found} for {expected}");
            }
        }
        let [of_sun, without] = [found[2].0[0], smooth(found[2].1)[0]];
        assert!(of_sun > 3.0 * without, "{preset}: {of_sun}, and {without} without the sun");
    }
    // The image that an engine filters itself has the sun again, too.
    let (folder, _) = photographs(&stage("preset = \"blender\""));
    photograph(folder.path(), sun);
    let (by_image, _) = scene(folder.path());
    let (whole, _) = photographs("");
    photograph(whole.path(), sun);
    let [found, expected] = [by_image, scene(whole.path()).0].map(|scene| middles(&scene, Mode::BruteForce));
    for k in 1..5 {
        let (found, expected) = (found[k].0[0], expected[k].0[0]);
        assert!((found - expected).abs() < 0.06 + 0.05 * expected, "{k}: {found} for {expected}");
    }
}

/// Each export is an entry, steps are none, and a material ends it: then there are reflections to show.
#[test]
fn exports_of_light_are_told_apart_by_their_stages() {
    let export = |stage: &str, input: &str| {
        format!(
            "[stage.{stage}]\nkind = \"export-engine\"\ninput = \"{input}\"\npreset = \"{stage}\"\n\
             path = \"{{environment}}/{stage}\"\n"
        )
    };
    let turned = "[stage.turned]\nkind = \"rotate\"\ninput = \"environment\"\nyaw = 90.0\n";
    let two = [export("three", "turned"), turned.into(), export("babylon", "turned")].concat();
    let (_folder, plan) = photographs(&two);
    let catalog = PreviewCatalog::of(plan);
    assert_eq!(catalog.environments(), ["sky"]);
    assert_eq!(catalog.materials(), ["white metal (three)", "white metal (babylon)"]);
    let entry = catalog.entry("sky", "white metal (three)").unwrap().unwrap();
    let stages = catalog.stages(entry, "sphere").into_iter().collect::<Vec<_>>();
    assert_eq!(stages, ["environment", "three", "turned"]);
    assert!(catalog.material_file(entry).unwrap_err().contains("no material to edit"));
    let text = fs::read_to_string(&catalog.plan().manifest).unwrap();
    let edit = catalog.with_turned_light(entry, Aim { yaw: 0.5, pitch: 0.0 }, &text).unwrap();
    assert!(edit.text.contains("yaw = 118.65"), "{}", edit.text);
    // Watched alone, an export of a pipeline with materials has a preview.
    let (_folder, plan) = project(&export("three", "environment"));
    assert!(PreviewCatalog::of(plan).is_empty());
    let (_folder, plan) = project(&export("three", "environment"));
    let catalog = PreviewCatalog::among(plan, &["three".into()]);
    assert_eq!((catalog.environments().len(), catalog.materials().len()), (2, 1));
    // Without a `rotate` stage, one is added, and all that is made of the light reads it.
    let (_folder, plan) = photographs(&export("three", "environment"));
    let catalog = PreviewCatalog::of(plan);
    let entry = catalog.entry("sky", "white metal").unwrap().unwrap();
    let text = fs::read_to_string(&catalog.plan().manifest).unwrap();
    let edit = catalog.with_turned_light(entry, Aim { yaw: 0.5, pitch: 0.0 }, &text).unwrap();
    assert!(edit.text.contains("input = \"environment-turned\""), "{}", edit.text);
}

/// Until the export has the new light, the environment itself lights the metal.
#[test]
fn white_metal_follows_the_photograph() {
    let export = "[stage.light]\nkind = \"export-engine\"\ninput = \"environment\"\nresolution = 16\n\
                  path = \"{environment}\"\n";
    let (folder, plan) = photographs(export);
    let mut scenes = SceneCache::default();
    let mut scene = |plan: Plan, results: &ResultsSnapshot| {
        let catalog = PreviewCatalog::of(plan);
        let entry = catalog.entry("sky", "white metal").unwrap().unwrap();
        scenes.scene(&catalog, results, entry, "sphere").unwrap()
    };
    let results = build(&plan);
    let first = scene(plan, &results);
    let again = scene(load(folder.path()), &results);
    assert!(Arc::ptr_eq(&first.objects[4].look, &again.objects[4].look), "nothing is read twice");
    photograph(folder.path(), |d| smooth(d).map(|value| 2.0 * value));
    let plan = load(folder.path());
    let options = BuildOptions { stages: vec!["environment".into()], ..BuildOptions::default() };
    engine::build(&plan, &options, &Cancel::default(), &|_| ()).unwrap();
    let results = ResultsSnapshot::open(&plan).unwrap();
    assert_eq!(scene(plan, &results).first_mode(), Mode::BruteForce);
    let plan = load(folder.path());
    let results = build(&plan);
    let brighter = scene(plan, &results);
    let rough = |scene: &Scene| middles(scene, Mode::Prefiltered)[4].0;
    let (before, after) = (rough(&first), rough(&brighter));
    assert!((0..3).all(|c| (after[c] / before[c] - 2.0).abs() < 0.01), "{before:?} {after:?}");
}
