//! `export-engine` and `test-pattern`.

use containers::{Texture, read_babylon_env, read_gltf_image_based_light, read_image, read_texture};
use engine::Product;
use serde_json::Value;
use sphere::{Cube, DVec3, Face, LatLong, to_cube, to_file};
use stages::artifacts::{Environment, Prefiltered};
use stages::{ENGINES, Engine};

use crate::fixture::{Case, case, difference, environment, kinds, sky};

/// Where a texel looks that lies in this direction.
type LooksAt = fn(DVec3) -> DVec3;

/// The width of the last level and d at c, as they were read back from the engines. For an engine that is not
/// in this list, the tests take what its file says.
const SEEN: [(&str, usize, LooksAt); 5] = [
    ("three", 8, three),
    ("filament", 16, filament),
    ("babylon", 1, babylon),
    ("bevy", 16, bevy),
    ("gltf", 16, babylon),
];

fn three(c: DVec3) -> DVec3 {
    DVec3::new(-c.z, c.y, -c.x)
}

fn filament(c: DVec3) -> DVec3 {
    c
}

fn babylon(c: DVec3) -> DVec3 {
    DVec3::new(-c.x, c.y, c.z)
}

fn bevy(c: DVec3) -> DVec3 {
    DVec3::new(c.z, c.y, c.x)
}

/// Every engine that loads a cube, with each of its formats.
fn cubes() -> Vec<(&'static Engine, &'static str)> {
    let cubes = ENGINES.iter().copied().filter(|engine| engine.loads_cube());
    let cubes =
        cubes.flat_map(|engine| engine.format_names().into_iter().map(move |format| (engine, format)));
    let cubes: Vec<_> = cubes.collect();
    assert!(cubes.len() >= 11);
    assert!(SEEN.iter().all(|(name, ..)| cubes.iter().any(|(engine, _)| engine.name == *name)));
    cubes
}

/// The largest error of a value of about 2. A block of BC6H holds lines of colours, and these fill a plane.
fn largest_error(format: &str) -> f64 {
    match format {
        "rgba32f" => 1e-6,
        "rgba16f" => 0.001,
        "rgb9e5" => 0.01,
        "rgbd" => 0.02,
        "r11g11b10f" => 0.04,
        "bc6h" => 0.0,
        other => panic!("how exact is {other}?"),
    }
}

/// The width of a face of a small cube for an engine.
pub(crate) fn smallest(engine: &Engine) -> usize {
    engine.last_level().map_or(32, |last| (2 * last).max(32))
}

/// d at c, as the manual of `export-engine` has it.
fn direction_at(preset: &str) -> impl Fn(DVec3) -> DVec3 {
    let manual = kinds().get("export-engine").unwrap().manual();
    let (_, table) = manual.split_once("| `preset` | d at c |").unwrap();
    let rows = table
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split_once(" | ("))
        .map(|(names, rest)| (names.to_owned(), rest.split_once(')').unwrap().0.to_owned()));
    let mut rows = rows.filter(|(names, _)| names.split(", ").any(|name| name == format!("`{preset}`")));
    let (_, row) = rows.next().unwrap_or_else(|| panic!("no row for {preset} in {table}"));
    let axes: Vec<_> =
        row.split(", ").map(|axis| (axis.starts_with('-'), axis.chars().last().unwrap())).collect();
    let axes: [(bool, char); 3] = axes.try_into().unwrap();
    move |c| {
        let part = |(is_negative, axis): (bool, char)| {
            let value = c.to_array()["xyz".find(axis).unwrap()];
            if is_negative { -value } else { value }
        };
        DVec3::from_array(axes.map(part))
    }
}

/// The cube in an engine's file, by the reader of its container.
pub(crate) fn cube_of(file: &[u8]) -> Texture {
    if file.starts_with(b"{") {
        return read_gltf_image_based_light(file).unwrap().cube;
    }
    match read_texture(file) {
        Ok(file) => file.texture,
        Err(_) => read_babylon_env(file).unwrap().cube,
    }
}

/// The cube coordinate of a texel, from KTX2's table of faces.
fn coordinate(edge: usize, index: usize) -> DVec3 {
    let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
    to_cube(Cube { edge }.direction(Face::ALL[face], row, column).vector())
}

/// The named file of a case.
pub(crate) fn file(case: &Case, name: &str) -> Vec<u8> {
    let Product::Files(names) = case.product() else { panic!("no files") };
    let index = names.iter().position(|found| found == name).unwrap_or_else(|| panic!("{name} of {names:?}"));
    case.files()[index].clone()
}

fn pattern(preset: &str, format: &str) -> Case {
    let engine = ENGINES.iter().find(|engine| engine.name == preset).unwrap();
    let size = smallest(engine);
    case("test-pattern", &format!("preset = \"{preset}\"\nformat = \"{format}\"\nresolution = {size}"))
}

/// The factor of degree 1 of GGX, by the midpoint rule.
fn slope(roughness: f64) -> f64 {
    if roughness == 0.0 {
        return 1.0;
    }
    let squared = roughness.powi(4);
    let (mut above, mut below) = (0.0, 0.0);
    for step in 0..200_000 {
        // Points crowd where the lobe is.
        let share = (f64::from(step) + 0.5) / 200_000.0;
        let (mu, width) = (1.0 - share.powi(4), 4.0 * share.powi(3));
        let weight = width * mu / (1.0 + squared - (1.0 - squared) * mu).powi(2);
        above += weight * mu;
        below += weight;
    }
    above / below
}

/// The least roughness for which an engine's shader looks up each level; the mirror, then by bisection.
fn levels(engine: &Engine, size: usize, count: usize) -> Vec<f64> {
    let level = |l: usize| {
        if l == 0 {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if engine.level(middle, size).unwrap() < l as f64 { low = middle } else { high = middle }
        }
        high
    };
    (0..count).map(level).collect()
}

/// The texel at c holds 2 + 1.5 k d of the direction that the engine sees there.
#[test]
fn every_texel_looks_where_the_engine_does() {
    for (engine, format) in cubes() {
        let preset = engine.name;
        let direction_at = direction_at(preset);
        let seen = SEEN.iter().find(|(name, ..)| *name == preset);
        let case = pattern(preset, format);
        let cube = cube_of(&case.files()[0]);
        let roughness = levels(engine, cube.width, cube.levels().len());
        for ((level, texels), roughness) in cube.levels().enumerate().zip(roughness) {
            let [edge, ..] = cube.level_size(level);
            let slope = 1.5 * slope(roughness);
            // Half of what a block spans.
            let most = if format == "bc6h" { 3.0 / edge as f64 } else { largest_error(format) };
            for (index, found) in texels.iter().enumerate() {
                let c = coordinate(edge, index);
                assert!(seen.is_none_or(|(.., seen)| seen(c) == direction_at(c)), "{preset} at {c}");
                let d = direction_at(c).to_array();
                for channel in 0..3 {
                    let expected = 2.0 + slope * d[channel];
                    let error = (f64::from(found[channel]) - expected).abs();
                    assert!(error < 2.0 * most, "{preset} {format} level {level}: {found:?}, d {d:?}");
                }
            }
        }
    }
}

#[test]
fn every_level_is_marked_down_to_the_engines_last() {
    for (engine, format) in cubes() {
        let preset = engine.name;
        let case = pattern(preset, format);
        let Product::Files(names) = case.product() else { panic!("no files") };
        let index = names.iter().position(|name| name.contains("-lod")).unwrap();
        let cube = cube_of(&case.files()[index]);
        let last = engine.last_level().unwrap();
        let seen = SEEN.iter().find(|(name, ..)| *name == preset);
        assert!(seen.is_none_or(|(_, seen, _)| *seen == last), "{preset}");
        assert_eq!(cube.level_size(cube.levels().len() - 1)[0], last, "{preset}");
        for (level, texels) in cube.levels().enumerate() {
            let marked = texels.iter().flatten().all(|value| (value - (1 + level) as f32).abs() < 0.03);
            assert!(marked, "{preset} {format}: level {level} is {:?}", texels[0]);
        }
    }
}

/// 2 + d of the pattern, where each engine finds its irradiance over pi.
#[test]
fn irradiance_is_that_of_the_pattern() {
    let sh = String::from_utf8(file(&pattern("filament", "r11g11b10f"), "/pattern-orient-sh.txt")).unwrap();
    let lines: Vec<Vec<f64>> =
        sh.lines().map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect()).collect();
    // 1, y, z, x of Filament's world, which is the frame of files here.
    let expected = [[2.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    assert_eq!(lines.len(), 9);
    for (row, line) in lines.iter().enumerate() {
        for channel in 0..3 {
            let expected = expected.get(row).map_or(0.0, |row| row[channel]);
            assert!((line[channel] - expected).abs() < 1e-12, "{sh}");
        }
    }
    let cube =
        read_texture(&file(&pattern("bevy", "rgba16f"), "/pattern-orient-diffuse.ktx2")).unwrap().texture;
    assert_eq!((cube.width, cube.levels().len()), (32, 1));
    for (index, found) in cube.pixels.iter().enumerate() {
        let d = bevy(coordinate(32, index)).to_array();
        assert!(
            (0..3).all(|channel| (f64::from(found[channel]) - 2.0 - d[channel]).abs() < 0.002),
            "{found:?}"
        );
    }
    let env = read_babylon_env(&pattern("babylon", "rgbd").files()[0]).unwrap().irradiance.unwrap();
    // x is -x of files; degree 1 is convolved twice, and a constant is in the squares.
    let close = |found: [f64; 3], expected: [f64; 3]| (0..3).all(|c| (found[c] - expected[c]).abs() < 1e-12);
    assert!(close(env.x, [-2.0 / 3.0, 0.0, 0.0]) && close(env.y, [0.0, 2.0 / 3.0, 0.0]), "{env:?}");
    assert!(close(env.xx, [2.0; 3]) && close(env.zz, [2.0; 3]) && close(env.xy, [0.0; 3]), "{env:?}");
    let gltf = read_gltf_image_based_light(&pattern("gltf", "rgbd").files()[0]).unwrap().irradiance;
    let (k0, k1) = ((0.25 / std::f64::consts::PI).sqrt(), (0.75 / std::f64::consts::PI).sqrt());
    let e = std::f64::consts::PI;
    assert!(close(gltf[0], [2.0 * e / k0; 3]) && close(gltf[1], [0.0, -e / k1, 0.0]), "{gltf:?}");
    assert!(close(gltf[2], [0.0, 0.0, e / k1]) && close(gltf[3], [e / k1, 0.0, 0.0]), "{gltf:?}");
}

#[test]
fn engines_that_filter_have_the_image_as_it_is() {
    let images = ENGINES.iter().filter(|engine| !engine.loads_cube());
    let images =
        images.flat_map(|engine| engine.format_names().into_iter().map(|format| (engine.name, format)));
    for (preset, format) in images {
        let name = format!("/pattern-orient.{format}");
        let image = read_image(&file(&pattern(preset, format), &name), &Default::default()).unwrap().image;
        let grid = LatLong::with_rows(32);
        for (index, found) in image.pixels().iter().enumerate() {
            let d = to_file(grid.direction(index / 64, index % 64).vector()).to_array();
            let near = |channel: usize| (f64::from(found[channel]) - 2.0 - 1.5 * d[channel]).abs() < 0.02;
            assert!((0..3).all(near), "{preset} {format}: {found:?} {d:?}");
        }
    }
}

/// Each variant at the texel centres of `engines/dfg.json`, read back from halves.
#[test]
fn tables_of_albedos_are_those_of_the_reference() {
    let Some(reference) = test_data::reference("tables_of_albedos", "engines/dfg.json") else { return };
    for format in ["ktx2", "dds", "exr"] {
        let most = if format == "exr" { 1e-5 } else { 1e-3 };
        for variant in ["correlated", "uncorrelated", "karis", "filament"] {
            let parameters =
                format!("variant = \"{variant}\"\nresolution = 6\nsheen = true\nformat = \"{format}\"");
            let file = case("dfg", &parameters).files()[0].clone();
            let pixels = match format {
                "exr" => read_image(&file, &Default::default()).unwrap().image.into_pixels(),
                _ => read_texture(&file).unwrap().texture.pixels,
            };
            let rows = reference["rows"].as_array().unwrap();
            let mut found = 0;
            for row in rows {
                let number = |value: &Value| value.as_f64().unwrap();
                let column = (6.0 * number(&row["NoV"]) - 0.5).round() as usize;
                let roughness = number(&row["roughness"]);
                // Filament's first row is r = 1, the second 11/12, so that the smoothest is missing.
                let (line, names) = match variant {
                    "filament" => ((6.5 - 6.0 * roughness).round() as usize, ["x", "y"]),
                    _ => ((6.0 * roughness - 0.5).round() as usize, ["scale", "bias"]),
                };
                let Some(pixel) = pixels.get(6 * line + column) else { continue };
                let [red, green] = names.map(|name| &row[variant][name]);
                let expected = [red, green, &row["charlie"]].map(number);
                for channel in 0..3 {
                    let error =
                        (f64::from(pixel[channel]) - expected[channel]).abs() / expected[channel].max(1.0);
                    assert!(error < most, "{variant} {format}: {pixel:?} instead of {expected:?}");
                }
                found += 1;
            }
            assert_eq!(found, if variant == "filament" { 30 } else { 36 });
        }
    }
}

pub(crate) fn export(parameters: &str, light: Environment) -> Case {
    case("export-engine", parameters).input("light", light)
}

/// What an engine loads is the light that it was made of, in our frame again.
#[test]
fn a_cube_for_an_engine_is_an_environment_again() {
    let light = environment(64, sky);
    for (engine, format) in cubes() {
        let (preset, most, size) = (engine.name, largest_error(format), smallest(engine));
        let parameters = format!("preset = \"{preset}\"\nformat = \"{format}\"\nresolution = {size}");
        let bytes = export(&parameters, light.clone()).files()[0].clone();
        let import = |parameters: &str, bytes: &[u8]| {
            case("import-environment", parameters).file("a.x", bytes).source("a.x").run().unwrap()
        };
        let named = import(&format!("preset = \"{preset}\""), &bytes);
        let found = named.artifact::<Environment>();
        let truth = environment(64, sky);
        let off = difference(found.0.pixels(), truth.0.pixels());
        // A block of BC6H holds one or two lines of colours.
        assert!(off < if most == 0.0 { 0.3 } else { most + 0.03 }, "{preset} {format}: {off}");
        assert!(named.notes[0].contains(&format!("in the frame of {preset}")), "{:?}", named.notes);
    }
    // The recipe names the preset.
    let cube = Texture { width: 1, height: 1, faces: 6, pixels: vec![[1.0; 3]; 6], ..Texture::default() };
    let recipe = "{\"kind\":\"export-engine\",\"parameters\":{\"preset\":\"three\"}}";
    let bytes = containers::write_ktx2(&cube, containers::Precision::Half, Some(recipe), &[]).unwrap().bytes;
    let ran = case("import-environment", "").file("a.ktx2", bytes).source("a.ktx2").run().unwrap();
    assert!(ran.notes[0].contains("in the frame of three"), "{:?}", ran.notes);
}

#[test]
fn bounds_name_the_largest_value_and_the_error_of_each_level() {
    let bright = environment(32, |w| if w.z > 0.98 { [9e5, 300.0, 1.0] } else { sky(w) });
    let of = |preset: &str, overflow: &str| {
        let parameters = format!("preset = \"{preset}\"\nresolution = 32\noverflow = \"{overflow}\"");
        export(&parameters, bright.clone())
    };
    for (preset, largest) in
        [("three", 65504.0), ("filament", 64512.0), ("bevy", 65408.0), ("babylon", 255.0)]
    {
        let ran = of(preset, "clamp").run().unwrap();
        let said = ran.warnings[0].starts_with("the brightest light is clamped: ")
            && ran.warnings[0].contains(" % of the red light is lost")
            && ran.warnings[0].contains(&format!(" ends at {largest}; "))
            && ran.warnings[0].ends_with("sun = \"light\" makes it a separate light");
        assert!(said, "{:?}", ran.warnings);
        assert_eq!(preset == "babylon", ran.warnings[0].contains("format = \"rgba32f\" keeps it"));
        let bounds = file(&of(preset, "clamp"), "/bounds.json");
        let recipe = containers::read_recipe(&bounds).unwrap();
        assert!(!recipe.contains('\n'), "one line, though the file is laid out for people: {recipe}");
        let bounds: Value = serde_json::from_slice(&bounds).unwrap();
        assert_eq!(bounds["format_largest"], largest);
        assert!(bounds["clamped"].as_u64().unwrap() > 0 && bounds["largest"].as_f64().unwrap() > 8e5);
        let lost: [f64; 3] = serde_json::from_value(bounds["lost_light"].clone()).unwrap();
        assert!(lost[0] > 0.5 && lost[2] == 0.0, "{lost:?}");
        let levels = bounds["levels"].as_array().unwrap();
        assert!(levels.iter().all(|level| level["stored_error"].as_f64().is_some()), "{bounds}");
        assert_eq!((&levels[0]["size"], &levels[0]["method"]), (&32.into(), &"resampled".into()));
        let failure = of(preset, "error").failure();
        assert!(failure.contains("values exceed"), "{failure}");
    }
    let text = String::from_utf8(file(&of("bevy", "clamp"), "/README.txt")).unwrap();
    assert!(
        text.contains("environment-specular.ktx2") && text.contains("environment-diffuse.ktx2"),
        "{text}"
    );
}

/// A quarter of the picture's width, and all levels down to one texel, each looking where the light does.
#[test]
fn the_sky_is_as_sharp_as_the_picture_and_lies_as_the_light_does() {
    let ramp = || environment(64, |w| to_file(w).to_array().map(|x| 2.0 + 1.5 * x));
    for (engine, format) in cubes() {
        let preset = engine.name;
        let of = |more: &str| {
            let size = smallest(engine);
            let text = format!("preset = \"{preset}\"\nformat = \"{format}\"\nresolution = {size}\n{more}");
            export(&text, ramp())
        };
        let Product::Files(names) = of("").product() else { panic!("no files") };
        let name = names.iter().find(|name| name.contains("-skybox.")).unwrap();
        let cube = cube_of(&file(&of(""), name));
        assert_eq!((cube.width, cube.levels().len()), (32, 6), "{preset} {format}");
        let direction_at = direction_at(preset);
        for (level, texels) in cube.levels().enumerate() {
            let [edge, ..] = cube.level_size(level);
            let most = if format == "bc6h" { 3.0 / edge as f64 } else { largest_error(format) + 0.01 };
            // The mean over a texel is less than the value in its middle.
            let shrunk = 1.0 / (edge * edge) as f64;
            for (index, found) in texels.iter().enumerate() {
                let d = direction_at(coordinate(edge, index)).to_array();
                for channel in 0..3 {
                    let error = (f64::from(found[channel]) - 2.0 - 1.5 * d[channel]).abs();
                    assert!(error < 2.0 * most + shrunk, "{preset} {format} {level}: {found:?}, d {d:?}");
                }
            }
        }
        let text = |case: &Case| String::from_utf8(file(case, "/README.txt")).unwrap();
        let name = name.trim_start_matches('/');
        assert!(text(&of("")).contains(name) && !text(&of("skybox = false")).contains("-skybox"));
        let Product::Files(without) = of("skybox = false").product() else { panic!("no files") };
        assert_eq!(without.len() + 1, names.len());
        assert_eq!(cube_of(&file(&of("skybox-resolution = 8"), &format!("/{name}"))).width, 8);
    }
    // Its own bounds, and no warning: it lights nothing.
    let bright = environment(32, |w| if w.z > 0.98 { [9e5; 3] } else { [0.5; 3] });
    let case = export("preset = \"three\"\nresolution = 32\nskybox-resolution = 64", bright);
    assert_eq!(case.run().unwrap().warnings.len(), 1);
    let bounds: Value = serde_json::from_slice(&file(&case, "/bounds.json")).unwrap();
    assert_eq!(bounds["skybox"]["size"], 64);
    assert!(bounds["skybox"]["clamped"].as_u64().unwrap() > 0, "{bounds}");
    for (parameters, why) in [
        ("preset = \"unity\"\nskybox-resolution = 64", "the engine shows the lat-long image itself"),
        ("preset = \"three\"\nskybox = false\nskybox-resolution = 64", "skybox = false leaves it out"),
    ] {
        let errors = export(parameters, environment(16, sky)).errors();
        assert!(errors.len() == 1 && errors[0].contains(why), "{errors:?}");
    }
}

/// The image and the light have all light together, and the light is where the engine sees that part of the
/// image.
#[test]
fn a_sun_can_be_a_light_beside_the_image() {
    let toward = to_file(DVec3::new(0.6, -0.48, 0.64));
    let sunny = || {
        environment(64, |w| {
            let angle = w.dot(DVec3::new(0.6, -0.48, 0.64)).min(1.0).acos();
            if angle < 0.05 { [9e5, 6e5, 1e5] } else { sky(w) }
        })
    };
    let world: [(&str, LooksAt); 4] = [
        // Each engine's axes in those of files: the centre of a lat-long image is +Z, and its left +X.
        ("three", |d| DVec3::new(d.z, d.y, -d.x)),
        ("babylon", |d| DVec3::new(-d.x, d.y, d.z)),
        ("unity", |d| DVec3::new(d.z, d.y, d.x)),
        ("blender", |d| DVec3::new(d.z, d.x, d.y)),
    ];
    let whole = sunny().0.integral();
    for engine in ENGINES {
        let size = if engine.loads_cube() { smallest(engine) } else { 64 };
        let text = format!("preset = \"{}\"\nsun = \"light\"\nresolution = {size}", engine.name);
        let case = export(&text, sunny());
        let ran = case.run().unwrap();
        assert!(ran.notes[0].starts_with("1 light holds 9"), "{:?}", ran.notes);
        let light: Value = serde_json::from_slice(&file(&case, "/environment-lights.json")).unwrap();
        let light = &light["lights"].as_array().filter(|lights| lights.len() == 1).unwrap()[0];
        let numbers = |key: &str| serde_json::from_value::<[f64; 3]>(light[key].clone()).unwrap();
        if let Some((_, world)) = world.iter().find(|(name, _)| *name == engine.name) {
            let away = DVec3::from(numbers("direction")).angle_between(world(toward));
            assert!(away < 0.01, "{}: {away}", engine.name);
        }
        let diameter = light["angular_diameter"].as_f64().unwrap();
        assert!((4.0..8.0).contains(&diameter), "{diameter}");
        let text = String::from_utf8(file(&case, "/README.txt")).unwrap();
        let scene = match engine.name {
            "godot" => "tscn",
            "blender" | "unreal" => "usda",
            _ => "gltf",
        };
        assert!(
            text.contains("environment-lights.json") && text.contains(&format!("-lights.{scene}")),
            "{text}"
        );
        let scene = String::from_utf8(file(&case, &format!("/environment-lights.{scene}"))).unwrap();
        let shows_image = engine.loads_cube()
            || engine.name == "unity"
            || scene.contains("environment.exr")
            || scene.contains("environment.hdr");
        assert!(scene.contains("Light0") && shows_image, "{scene}");
        if engine.name == "blender" {
            let image = read_image(&case.files()[0], &containers::ReadOptions::default()).unwrap().image;
            let rest = envmap::Environment::new(LatLong::with_rows(64), image.pixels().to_vec()).unwrap();
            let intensity = light["intensity"].as_f64().unwrap();
            for (c, colour) in numbers("colour").into_iter().enumerate() {
                // Irradiance is less than flux by the disk's width: by less than 0.1 %.
                let sum = rest.integral()[c] + intensity * colour;
                assert!((sum / whole[c] - 1.0).abs() < 1e-3, "{sum} of {}", whole[c]);
            }
        }
    }
    let count = |lights: &str| {
        let text = format!("preset = \"unreal\"\nsun = \"light\"\nlights = {lights}");
        let json: Value =
            serde_json::from_slice(&file(&export(&text, sunny()), "/environment-lights.json")).unwrap();
        json["lights"].as_array().unwrap().len()
    };
    assert_eq!([count("0"), count("\"all\"")], [0, 1]);
    let errors = export("preset = \"three\"\nlights = 2", sunny()).errors();
    assert_eq!(errors, ["lights: only sun = \"light\" uses it"]);
}

#[test]
fn a_cube_must_have_the_levels_that_the_engine_looks_for() {
    let cube = |parameters: &str| {
        let cube = case("prefilter", parameters).input("environment", environment(32, sky));
        (*cube.artifact::<Prefiltered>()).clone()
    };
    let export = |preset: &str, cube: Prefiltered| {
        case("export-engine", &format!("preset = \"{preset}\"")).input("light", cube)
    };
    let three = cube("preset = \"three\"\nresolution = 32");
    assert_eq!(cube_of(&export("three", three.clone()).files()[0]).levels().len(), 3);
    let failure = export("babylon", three.clone()).failure();
    assert!(
        failure.contains("3 levels; babylon expects 6 in a cube of 32; the nearest size that fits 3 is"),
        "{failure}"
    );
    let failure = export("bevy", cube("roughness = [0.0, 0.5]\nresolution = 32")).failure();
    assert!(failure.contains("level 1 has roughness 0.5000, but bevy expects 1.0000 there"), "{failure}");
    let failure =
        export("three", cube("preset = \"three\"\nresolution = 32\ndistribution = \"charlie\"")).failure();
    assert!(failure.contains("not prefiltered with GGX"), "{failure}");
    let errors = export("unity", three).input_errors();
    assert_eq!(errors, ["preset: unity filters a lat-long image itself; connect an environment"]);
    // Its mirror is the sky.
    let cube = cube("preset = \"three\"\nresolution = 64");
    assert_eq!(cube_of(&file(&export("three", cube), "/environment-skybox.ktx2")).width, 64);
}

#[test]
fn what_an_engine_does_not_load_is_refused() {
    for (parameters, expected) in [
        ("preset = \"three\"\nformat = \"rgb9e5\"", "format: three loads \"rgba16f\" or \"bc6h\""),
        (
            "preset = \"filament\"\nresolution = 100",
            "resolution: the faces for filament are a power of two from 32",
        ),
        ("preset = \"cryengine\"", "\"three\" or \"filament\" or \"babylon\" or \"bevy\" or \"gltf\""),
    ] {
        for errors in
            [export(parameters, environment(16, sky)).errors(), case("test-pattern", parameters).errors()]
        {
            assert!(errors.len() == 1 && errors[0].contains(expected), "{errors:?}");
        }
    }
}

/// A picture of few rows is a mean over few texels, whose irradiance is another: a lamp of one texel becomes
/// as large as eight.
#[test]
fn irradiance_is_that_of_the_whole_picture() {
    let lamp = |direction: sphere::DVec3| [if direction.z > 0.98 { 50.0 } else { 0.2 }; 3];
    for preset in ["unity", "unreal"] {
        let of = |parameters: &str| {
            let parameters = format!("preset = \"{preset}\"\n{parameters}");
            let files = export(&parameters, environment(64, lamp)).files();
            let json: serde_json::Value = serde_json::from_slice(&files[1]).unwrap();
            let (width, height, _) = crate::fixture::pixels(&files[0]);
            (width, height, ["SHAr", "SHBr", "coefficients"].map(|table| json[table].clone()))
        };
        let (whole, reduced) = (of(""), of("resolution = 16"));
        assert_eq!((whole.0, whole.1, reduced.0, reduced.1), (128, 64, 32, 16));
        assert_eq!(whole.2, reduced.2);
        assert!(whole.2[0].is_array() || whole.2[2].is_array());
    }
}
