use containers::{read_dds, read_ktx2};
use sphere::{Cube, Face};
use stages::artifacts::{Environment, Prefiltered};

use crate::fixture::{Case, case, difference, environment, pixels, sky};

fn export(parameters: &str) -> Case {
    case("export-environment", parameters).input("environment", environment(32, sky))
}

#[test]
fn a_lat_long_image_keeps_its_pixels() {
    let (width, height, found) = pixels(&export("precision = \"float\"").files()[0]);
    assert_eq!((width, height), (64, 32));
    assert_eq!(found, environment(32, sky).0.pixels());
}

#[test]
fn exposure_is_in_stops() {
    let (_, _, found) = pixels(&export("precision = \"float\"\nexposure = -2").files()[0]);
    for (found, was) in found.iter().zip(environment(32, sky).0.pixels()) {
        assert_eq!(*found, was.map(|value| value / 4.0));
    }
}

/// What is written is read back under the same layout. The sky has degree 2, and a texel of 2 / 32 blurs by
/// its square.
#[test]
fn every_layout_is_imported_again() {
    for layout in ["lat-long", "cube", "cube-strip", "cube-cross"] {
        let files = export(&format!("layout = \"{layout}\"\nprecision = \"float\"\nresolution = 32")).files();
        let mut import = case("import-environment", &format!("layout = \"{layout}\"\nresolution = 32"));
        if layout == "cube" {
            for (face, file) in Face::ALL.into_iter().zip(files) {
                import = import.file(&format!("map/{}.exr", face.name()), file);
            }
            import = import.source("map");
        } else {
            import = import.file("map.exr", files.into_iter().next().unwrap()).source("map.exr");
        }
        let error = difference(import.artifact::<Environment>().0.pixels(), environment(32, sky).0.pixels());
        assert!(error < 0.01, "{layout}: {error}");
    }
}

#[test]
fn the_faces_of_a_texture_look_where_the_cube_looks() {
    for (format, read) in [("ktx2", read_ktx2 as fn(&[u8]) -> _), ("dds", read_dds)] {
        let files = export(&format!(
            "layout = \"cube\"\nresolution = 16\nformat = \"{format}\"\nprecision = \"float\""
        ))
        .files();
        assert_eq!(files.len(), 1);
        let texture = read(&files[0]).unwrap();
        assert_eq!((texture.width, texture.height, texture.faces, texture.layers), (16, 16, 6, 0));
        let cube = Cube { edge: 16 };
        let expected: Vec<_> = (0..texture.pixels.len())
            .map(|index| sky(cube.direction(Face::ALL[index / 256], index / 16 % 16, index % 16).vector()))
            .collect();
        let error = difference(&texture.pixels, &expected);
        assert!(error < 0.02, "{format}: {error}");
    }
}

#[test]
fn impossible_parameters_are_errors() {
    for (parameters, words) in [
        ("layout = \"cube-cross\"\nformat = \"ktx2\"", "a texture is \"lat-long\" or \"cube\""),
        (
            "format = \"png\"\nprecision = \"float\"",
            "precision: only format = \"exr\" or \"ktx2\" or \"dds\" uses it",
        ),
        ("precision = \"float\"\noverflow = \"error\"", "overflow: only files of half floats use it"),
    ] {
        let errors = export(parameters).errors();
        assert!(errors.iter().any(|error| error.contains(words)), "{parameters}: {errors:?}");
    }
}

/// Cubes of `prefilter` of any lobe and any roughnesses come back level by level, the texels as they are.
#[test]
fn a_prefiltered_cube_is_written_with_its_levels() {
    for (distribution, roughness) in [("ggx", "0 0.25 0.5 1"), ("charlie", "0.2 0.6 1"), ("lambert", "1")] {
        let list = roughness.replace(' ', ", ");
        let parameters = format!("distribution = \"{distribution}\"\nresolution = 16\nroughness = [{list}]");
        let cube = case("prefilter", &parameters).input("environment", environment(32, sky));
        let cube = (*cube.artifact::<Prefiltered>()).clone();
        let levels: Vec<_> = cube.0.levels.iter().map(|level| level.map.pixels().to_vec()).collect();
        for (format, read) in [("ktx2", read_ktx2 as fn(&[u8]) -> _), ("dds", read_dds)] {
            let parameters =
                format!("layout = \"cube\"\nformat = \"{format}\"\nprecision = \"float\"\nexposure = 1");
            let ran =
                case("export-environment", &parameters).input("environment", cube.clone()).run().unwrap();
            assert_eq!(
                ran.notes,
                [format!("{} levels of the lobe {distribution}, roughness {roughness}", levels.len())]
            );
            let file = ran.files()[0];
            let texture = read(file).unwrap();
            assert_eq!((texture.width, texture.height, texture.faces, texture.layers), (16, 16, 6, 0));
            assert_eq!(texture.levels().len(), levels.len());
            for (found, expected) in texture.levels().zip(&levels) {
                let brighter: Vec<_> = expected.iter().map(|texel| texel.map(|value| 2.0 * value)).collect();
                assert_eq!(found, brighter);
            }
            let says = |words: &str| file.windows(words.len()).any(|bytes| bytes == words.as_bytes());
            let is_ktx2 = format == "ktx2";
            assert_eq!(says(&format!("specula.distribution\0{distribution}")), is_ktx2);
            assert_eq!(says(&format!("specula.roughness\0{roughness}")), is_ktx2);
        }
    }
    let cube = case("prefilter", "resolution = 16").input("environment", environment(32, sky));
    let export = |parameters: &str| {
        let cube = (*cube.artifact::<Prefiltered>()).clone();
        case("export-environment", parameters).input("environment", cube)
    };
    let errors = export("resolution = 8").input_errors();
    for (error, words) in
        errors.iter().zip(["layout = \"cube\"", "format = \"ktx2\" or \"dds\"", "already has a size"])
    {
        assert!(error.ends_with(words), "{errors:?}");
    }
    assert_eq!(errors.len(), 3);
}
