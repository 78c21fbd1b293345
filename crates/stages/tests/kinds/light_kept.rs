//! The light of the corpus' photographs in every file that is written of them.

use containers::{read_image, read_texture};
use serde_json::Value;
use shrm::MapGrid;
use sphere::{Cube, LatLong};
use stages::ENGINES;
use stages::artifacts::Environment;

use crate::engines::{cube_of, export, file, smallest};
use crate::fixture::case;

/// The light of a map's texels, by channel.
fn flux(pixels: &[[f32; 3]], grid: MapGrid) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (texel, pixel) in pixels.iter().enumerate() {
        let solid_angle = grid.solid_angle(texel);
        (0..3).for_each(|channel| sum[channel] += solid_angle * f64::from(pixel[channel]));
    }
    sum
}

/// The corpus' photographs; one holds the sun's disc, at 2.2e5.
fn photographs(test: &str) -> Option<Vec<(&'static str, Environment)>> {
    let corpus = test_data::folder(test, "SPECULA_CORPUS")?;
    let read = |name: &'static str| {
        let bytes = std::fs::read(corpus.join(format!("env/cc0/{name}.hdr"))).unwrap();
        let image = read_image(&bytes, &Default::default()).unwrap().image;
        (name, Environment(envmap::Environment::from_image(image, envmap::Layout::LatLong, None).unwrap()))
    };
    Some(["studio", "apartment", "forest", "night", "sunrise"].map(read).into())
}

/// Every format of every engine has the light of the photograph, or a warning says which share it lacks.
#[test]
fn no_engines_file_loses_light_silently() {
    let photographs = photographs("no_engines_file_loses_light_silently").unwrap_or_default();
    std::thread::scope(|scope| {
        for (name, environment) in photographs {
            scope.spawn(move || no_format_loses_light_silently(name, environment));
        }
    });
}

fn no_format_loses_light_silently(name: &str, environment: Environment) {
    // Images of a quarter of the pixels are written faster, and the sun's disc still exceeds a half in them.
    let grid = LatLong { width: 512, height: 256 };
    let smaller = Environment(environment.0.downsampled(grid).unwrap());
    let largest = smaller.0.pixels().as_flattened().iter().fold(0.0_f32, |a, b| a.max(*b));
    assert_eq!(largest > 65504.0, name == "sunrise", "{name}: {largest}");
    let given = flux(environment.0.pixels(), MapGrid::LatLong(environment.0.grid()));
    for engine in ENGINES {
        let (preset, is_cube) = (engine.name, engine.loads_cube());
        let environment = if is_cube { &environment } else { &smaller };
        // An engine of cubes gets the smallest that it loads, which is made fast: its texels are means.
        let edge = smallest(engine);
        let size = if is_cube { format!("resolution = {edge}\nskybox = false") } else { String::new() };
        for format in engine.format_names() {
            let case =
                export(&format!("preset = \"{preset}\"\nformat = \"{format}\"\n{size}"), environment.clone());
            let (ran, files) = (case.run().unwrap(), case.files());
            let found = if is_cube {
                flux(&cube_of(&files[0]).pixels, MapGrid::Cube(Cube { edge }))
            } else {
                let image = read_image(&files[0], &Default::default()).unwrap().image;
                flux(image.pixels(), MapGrid::LatLong(environment.0.grid()))
            };
            let bounds: Value = serde_json::from_slice(&file(&case, "/bounds.json")).unwrap();
            let lost: [f64; 3] = serde_json::from_value(bounds["lost_light"].clone()).unwrap();
            let levels: Vec<[f64; 3]> = bounds["levels"]
                .as_array()
                .unwrap()
                .iter()
                .map(|level| serde_json::from_value(level["rounded_light"].clone()).unwrap())
                .collect();
            let warned = |text: &str| ran.warnings.iter().any(|warning| warning.contains(text));
            let rounded = levels[0];
            // The sun's disc lies in one of these large texels, whose mean does not know where in it.
            let most = if name == "sunrise" { 3e-3 } else { 1e-3 };
            for channel in 0..3 {
                let ratio = found[channel] / given[channel];
                eprintln!(
                    "{name} {preset} {format} {channel}: {ratio:.5}, said {:.5} and {:.5} by rounding",
                    1.0 - lost[channel],
                    rounded[channel]
                );
                assert!(
                    (ratio + lost[channel] - rounded[channel] * (1.0 - lost[channel]) - 1.0).abs() < most,
                    "{name} {preset} {format}: {ratio} {lost:?}"
                );
            }
            let is_lost = warned("light is lost");
            assert_eq!(is_lost, lost.iter().any(|lost| *lost > 0.0), "{name} {preset} {format}");
            assert!(!is_lost || is_cube, "{name} {preset} {format}: its container holds all light");
            let is_rounded = levels.as_flattened().iter().any(|share| share.abs() > 1e-3);
            assert_eq!(warned("rounding changes"), is_rounded, "{name} {preset} {format} {levels:?}");
        }
    }
}

/// What `convert` writes has the light of the photograph, whatever the container.
#[test]
fn no_converted_photograph_loses_light() {
    for (name, environment) in photographs("no_converted_photograph_loses_light").unwrap_or_default() {
        let given = flux(environment.0.pixels(), MapGrid::LatLong(environment.0.grid()));
        for (format, layout) in [
            ("exr", "lat-long"),
            ("rgbe", "lat-long"),
            ("ktx2", "lat-long"),
            ("exr", "cube"),
            ("dds", "cube"),
        ] {
            let parameters = format!("format = \"{format}\"\nlayout = \"{layout}\"");
            let case = case("export-environment", &parameters).input("environment", environment.clone());
            let texels: Vec<[f32; 3]> = case
                .files()
                .iter()
                .flat_map(|file| match format {
                    "exr" | "rgbe" => read_image(file, &Default::default()).unwrap().image.into_pixels(),
                    _ => read_texture(file).unwrap().texture.pixels,
                })
                .collect();
            let grid = match layout {
                "cube" => MapGrid::Cube(Cube { edge: 256 }),
                _ => MapGrid::LatLong(environment.0.grid()),
            };
            assert_eq!(texels.len(), grid.len(), "{name} {format} {layout}");
            let found = flux(&texels, grid);
            for channel in 0..3 {
                let ratio = found[channel] / given[channel];
                assert!((ratio - 1.0).abs() < 1e-3, "{name} {format} {layout}: {ratio}");
            }
        }
    }
}
