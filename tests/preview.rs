//! `specula preview` without a window: stills and errors.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use ::preview::{InitialView, Light, Look, Object, Scene};
use envmap::{Environment, Layout, srgb_decode, to_srgb8};

use crate::support::{Project, Run, assert_has};

/// Two materials under one environment, small enough to be built and drawn in a moment.
pub(crate) const TWO_MATERIALS: &str = r#"
schema = 1
[stage]
environment = { kind = "import-environment", source = "assets/environments/studio.exr", resolution = 32 }
material = { kind = "import-material", source = "assets/materials/{gold,satin}.toml" }
lighting = { kind = "project-sh", input = "environment", degree = 8 }
coefficients = { kind = "project-brdf", input = "material", degree = [8, 0] }
reflection = { kind = "convolve", inputs = { lighting = "lighting", brdf = "coefficients" } }
map = { kind = "export-shrm", input = "reflection", resolution = 16 }
"#;

/// A photograph, and the light for an engine that is made of it.
pub(crate) const PHOTOGRAPH: &str = r#"
schema = 1
[stage]
environment = { kind = "import-environment", source = "assets/environments/studio.exr", resolution = 64 }
light = { kind = "export-engine", input = "environment", resolution = 64, path = "{environment}/three" }
"#;

pub(crate) const GOLD: &str = "assets/materials/gold.toml";

/// Runs the binary without a display, as on a server.
pub(crate) fn headless(project: &Project, arguments: &[&str]) -> Command {
    let mut command = project.command(arguments);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    command
}

fn run(project: &Project, arguments: &[&str]) -> Run {
    headless(project, arguments).output().unwrap().into()
}

/// A PNG's width and pixels.
fn pixels(file: &Path) -> (usize, Vec<[f32; 3]>) {
    let bytes = fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    (image.width(), image.pixels().to_vec())
}

fn still(project: &Project, name: &str, arguments: &[&str]) -> Vec<[f32; 3]> {
    let size = ["preview", "--still", name, "--size", "48x32"];
    let done = run(project, &[&size, arguments].concat());
    assert_eq!(done.code, Some(0), "{arguments:?}: {}", done.stderr);
    assert!(done.stdout.is_empty(), "{}", done.stdout);
    assert!(done.stderr.contains(&format!("{name}: ")), "{}", done.stderr);
    let (width, pixels) = pixels(&project.path(name));
    assert_eq!((width, pixels.len()), (48, 48 * 32));
    pixels
}

#[test]
fn a_still_is_built_from_nothing_and_shows_the_requested_item() {
    let project = Project::new(TWO_MATERIALS);
    let gold = still(&project, "gold.png", &["--item", "material=gold,mesh=sphere"]);
    // The middle is gold, and every option changes the picture.
    let [red, _, blue] = gold[16 * 48 + 24];
    assert!(red > 1.2 * blue, "{red} {blue}");
    let others: [&[&str]; 5] = [
        &["--item", "material=satin"],
        &["--item", "material=gold,mesh=torus-knot"],
        &["--item", "material=gold", "--mode", "mirror"],
        &["--item", "material=gold", "--exposure", "-2"],
        &["--item", "material=gold", "--mode", "irradiance", "--backend", "cpu"],
    ];
    for (number, arguments) in others.iter().enumerate() {
        let other = still(&project, &format!("{number}.png"), arguments);
        assert!(other != gold, "{arguments:?} changes the picture");
    }
    still(&project, "again.png", &["--item", "material=gold,environment=studio"]);
    let bytes = |name: &str| fs::read(project.path(name)).unwrap();
    assert!(bytes("again.png") == bytes("gold.png"), "the stills are bit-identical");
    assert!(!project.path("out").exists(), "only what the picture needs was built");
    assert!(!project.path(".specula/preview.json").exists(), "no window, no state");
}

#[test]
fn a_still_shows_the_last_valid_result_of_a_failed_item_and_says_so() {
    let project = Project::new(TWO_MATERIALS);
    let gold = still(&project, "gold.png", &["--item", "material=gold"]);
    project.write(GOLD, "model = \"phong\"\nexponent = -1\n");
    let arguments = ["preview", "--still", "again.png", "--size", "48x32", "--item", "material=gold"];
    run(&project, &arguments).ends(1, ["error: material [gold] failed"]);
    assert!(pixels(&project.path("again.png")).1 == gold, "the last valid picture");

    let fresh = Project::new(TWO_MATERIALS);
    fresh.write(GOLD, "model = \"phong\"\nexponent = -1\n");
    run(&fresh, &arguments).ends(1, ["gold under studio on sphere cannot be shown"]);
    assert!(!fresh.path("again.png").exists());
}

#[test]
fn the_graphics_device_draws_the_same_still() {
    let project = Project::new(TWO_MATERIALS);
    let by_cpu = still(&project, "cpu.png", &[]);
    let by_gpu = still(&project, "gpu.png", &["--backend", "gpu"]);
    let far = by_cpu
        .iter()
        .zip(&by_gpu)
        .filter(|(one, other)| one.iter().zip(other.iter()).any(|(one, other)| (one - other).abs() > 0.05));
    assert!(far.count() <= 8, "both draw the same picture");
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_graphics_device_the_cpu_draws_a_still_with_a_warning() {
    let project = Project::new(TWO_MATERIALS);
    let still = ["preview", "--still", "none.png", "--size", "48x32", "--backend", "gpu"];
    let mut command = headless(&project, &still);
    // There is no driver. Without the feature `gpu` the program does not look for one.
    command.env("VK_DRIVER_FILES", "/dev/null").env("WGPU_BACKEND", "vulkan");
    let output = command.output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert_has(&stderr, ["warning: the graphics device cannot draw this, so the CPU does: ", "drawn by CPU"]);
    assert_eq!(pixels(&project.path("none.png")).0, 48);
}

#[test]
fn a_name_that_does_not_exist_is_an_error_with_the_nearest_name() {
    let project = Project::new(TWO_MATERIALS);
    let cases: [(&[&str], i32, &str, &str); 9] = [
        (&["--item", "material=gould"], 2, "there is no material \"gould\"", "did you mean \"gold\"?"),
        (&["--item", "environment=forest"], 2, "there is no environment \"forest\"", "there is studio"),
        (&["--item", "mesh=sfere"], 2, "there is no mesh \"sfere\"", "did you mean \"sphere\"?"),
        (&["--item", "materials=gold"], 2, "there is no part \"materials\"", "did you mean \"material\"?"),
        (&["--mode", "brute-farce"], 2, "there is no such mode", "did you mean \"brute-force\"?"),
        (&["--still", "gold.jpg"], 2, "the picture is a PNG", "gold.jpg"),
        (&["--still", "gold.png", "--size", "0x10"], 2, "expected two numbers from 1 to", "0x10"),
        (&["--size", "64x64"], 2, "--still", "required"),
        (&["pipelin.toml"], 3, "cannot read the manifest", "did you mean \"pipeline.toml\"?"),
    ];
    for (arguments, code, message, help) in cases {
        let ended = run(&project, &[&["preview"], arguments].concat());
        assert_eq!(ended.code, Some(code), "{arguments:?}: {}", ended.stderr);
        assert!(
            ended.stderr.contains(message) && ended.stderr.contains(help),
            "{arguments:?}: {}",
            ended.stderr
        );
        assert!(ended.stdout.is_empty());
    }
    assert!(!project.path(".specula").exists(), "nothing was built");
}

#[test]
fn a_manifest_without_a_reflection_has_nothing_to_show() {
    let project = Project::new(&TWO_MATERIALS[..TWO_MATERIALS.find("reflection = ").unwrap()]);
    run(&project, &["preview"]).ends(3, ["pipeline.toml has nothing to preview", "convolve"]);
    let broken = Project::new("schema = 1\n[stage.a]\nkind = \"convolv\"\n");
    assert_eq!(run(&broken, &["preview"]).code, Some(3));
}

/// The mirror shows the environment within a texel, the roughest ball the light about the direction that a
/// mirror reflects, and the background the environment.
#[test]
fn white_metal_under_the_exported_file_shows_photographs_alone() {
    let project = Project::new(PHOTOGRAPH);
    let size = [320, 180];
    let picture = |name: &str, arguments: &[&str]| {
        let still = ["preview", "--still", name, "--size", "320x180"];
        let done = run(&project, &[&still, arguments].concat());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        (pixels(&project.path(name)).1, done.stderr)
    };
    let (exported, said) = picture("exported.png", &[]);
    assert_has(&said, ["exported.png: white metal under studio on sphere, prefiltered, 320x180"]);
    let (mirrors, said) = picture("mirror.png", &["--mode", "mirror"]);
    assert_has(&said, ["white metal under studio on sphere, mirror"]);

    let bytes = fs::read(project.path("assets/environments/studio.exr")).unwrap();
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    let grid = sphere::LatLong::with_rows(64);
    let studio = Environment::from_image(image, Layout::LatLong, Some(grid)).unwrap();
    let light = Arc::new(Light::new(studio.clone(), None));
    let look = |roughness| Arc::new(Look::of_white_metal(Arc::clone(&light), roughness, None).unwrap());
    let ball = Arc::new(mesh::shape("sphere").unwrap());
    let scene = Scene::row(Arc::clone(&light), &ball, &[0.0, 0.25, 0.5, 0.75, 1.0].map(look));
    let shot = InitialView::default().shot(&scene, size);
    let eye = shot.camera.eye();
    let ray = |pixel: usize| {
        let at = [pixel % 320, pixel / 320].map(|place| place as f64 + 0.5);
        shot.camera.ray(size, at).normalize()
    };
    let apart = |pixel: usize| {
        let channels = exported[pixel].iter().zip(mirrors[pixel]);
        channels.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max)
    };
    let mut mirror = Vec::new();
    for pixel in 0..320 * 180 {
        let miss = |object: &Object| (object.place.translation - eye).cross(ray(pixel)).length();
        if scene.objects.iter().all(|object| miss(object) > 1.1) {
            assert_eq!(apart(pixel), 0.0, "both have the same background");
        } else if miss(&scene.objects[0]) < 0.8 {
            mirror.push(apart(pixel));
        }
    }
    mirror.sort_by(f32::total_cmp);
    assert!(
        mirror.len() > 500 && mirror[mirror.len() * 3 / 4] < 0.1,
        "{:?}",
        &mirror[mirror.len() * 3 / 4..]
    );

    // At roughness 1 the lobe is the cosine.
    let object = &scene.objects[4];
    let miss = |pixel: &usize| (object.place.translation - eye).cross(ray(*pixel)).length();
    let middle = (0..320 * 180).min_by(|one, other| miss(one).total_cmp(&miss(other))).unwrap();
    let (ray, from) = (ray(middle), eye - object.place.translation);
    let along = from.dot(ray);
    let normal = (from + ray * (-along - (along * along - from.length_squared() + 1.0).sqrt())).normalize();
    let reflected = ray - normal * (2.0 * normal.dot(ray));
    let mut sum = [0.0; 3];
    for (pixel, radiance) in studio.pixels().iter().enumerate() {
        let (row, column) = (pixel / grid.width, pixel % grid.width);
        let cosine = grid.direction(row, column).vector().dot(reflected).max(0.0);
        let angle = std::f64::consts::PI / grid.height as f64;
        let share = cosine * angle * angle * (angle * (row as f64 + 0.5)).sin() / std::f64::consts::PI;
        (0..3).for_each(|channel| sum[channel] += share * f64::from(radiance[channel]));
    }
    let [shown] = to_srgb8(&[sum.map(|value| value as f32)], shot.exposure, shot.tone)[..] else { panic!() };
    let shown = shown.map(|code| srgb_decode(f32::from(code) / 255.0));
    let is_near = (0..3).all(|channel| (exported[middle][channel] - shown[channel]).abs() < 0.02);
    assert!(is_near, "{:?} for {shown:?}", exported[middle]);
}

#[test]
fn a_still_that_cannot_be_written_is_a_system_error() {
    let project = Project::new(TWO_MATERIALS);
    project.write("taken", "a file");
    run(&project, &["preview", "--still", "taken/gold.png", "--size", "8x8"])
        .ends(4, ["cannot write taken/gold.png"]);
}
