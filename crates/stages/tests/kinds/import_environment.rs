use std::io::Cursor;

use engine::ReadKind;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
use sphere::{Cube, Face, LatLong, OpenExrCube, OpenExrLatLong};
use stages::artifacts::Environment;

use crate::fixture::{Case, case, difference, environment, exr, sky};

/// A case whose source is one file.
fn import(parameters: &str, file: &str, bytes: impl Into<Vec<u8>>) -> Case {
    case("import-environment", parameters).file(file, bytes).source(file)
}

fn lat_long(rows: usize) -> Vec<u8> {
    exr(2 * rows, rows, environment(rows, sky).0.pixels().to_vec())
}

/// An OpenEXR file with an `envmap` attribute.
fn declared(width: usize, height: usize, map: EnvironmentMap, pixels: &[[f32; 3]]) -> Vec<u8> {
    let attributes = LayerAttributes { environment_map: Some(map), ..LayerAttributes::default() };
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [red, green, blue] = pixels[at.y() * width + at.x()];
        (red, green, blue)
    });
    let layer = Layer::new((width, height), attributes, Encoding::UNCOMPRESSED, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn a_lat_long_image_keeps_its_pixels() {
    let imported = import("", "a.exr", lat_long(8)).artifact::<Environment>();
    assert_eq!(*imported, environment(8, sky));
}

#[test]
fn exposure_is_in_stops() {
    let imported = import("exposure = -1.0", "a.exr", lat_long(8)).artifact::<Environment>();
    assert_eq!(*imported, environment(8, |w| sky(w).map(|value| value / 2.0)));
    assert_eq!(import("exposure = 101", "a.exr", "").errors().len(), 1);
    let bright = exr(2, 1, vec![[1e30; 3]; 2]);
    assert_eq!(import("exposure = 40", "a.exr", bright).failure(), "exposure 40 makes a value infinite");
}

/// One factor a channel, by which the card, or what was white, is grey.
#[test]
fn what_was_white_becomes_grey() {
    let tinted = |w| {
        let [r, g, b] = sky(w);
        [0.9 * r, 0.5 * g, 0.2 * b]
    };
    let file = || exr(16, 8, environment(8, tinted).0.pixels().to_vec());
    let given = environment(8, tinted);
    let imported = |parameters: &str| import(parameters, "a.exr", file()).artifact::<Environment>();
    // The columns 3 to 5 of the rows 2 and 3.
    let card = imported("grey-card = [3, 2, 3, 2]");
    let of_card = |environment: &Environment, c: usize| {
        let sum: f32 = [2, 3]
            .iter()
            .flat_map(|row| (3..6).map(move |column| row * 16 + column))
            .map(|at: usize| environment.0.pixels()[at][c])
            .sum();
        f64::from(sum) / 6.0
    };
    for c in 0..3 {
        assert!((of_card(&card, c) - 0.18).abs() < 1e-6, "{}", of_card(&card, c));
        let factor = 0.18 / of_card(&given, c);
        for (found, given) in card.0.pixels().iter().zip(given.0.pixels()) {
            assert!((f64::from(found[c]) - factor * f64::from(given[c])).abs() < 1e-5);
        }
    }
    let brighter = imported("grey-card = [3, 2, 3, 2]\nexposure = 1.0");
    assert!((of_card(&brighter, 1) - 0.36).abs() < 1e-6);
    // What was white keeps its luminance.
    let balanced = imported("white-balance = [0.9, 0.5, 0.2]");
    let grey = 0.2126 * 0.9 + 0.7152 * 0.5 + 0.0722 * 0.2;
    let expected = environment(8, |w| sky(w).map(|value| value * grey));
    assert!(difference(balanced.0.pixels(), expected.0.pixels()) < 1e-5);
    assert!(difference(imported("white-balance = 6504").0.pixels(), given.0.pixels()) < 1e-5);
    // Orange light was white: red becomes less, blue more.
    let [red, _, blue] =
        [0, 1, 2].map(|c| imported("white-balance = 3000").0.pixels()[0][c] / given.0.pixels()[0][c]);
    assert!(red < 0.8 && blue > 2.0, "{red} {blue}");
}

#[test]
fn a_card_outside_of_the_picture_or_without_light_is_an_error() {
    let failure = |parameters: &str| import(parameters, "a.exr", lat_long(8)).failure();
    assert!(failure("grey-card = [14, 2, 3, 2]").contains("not all within the 16 x 8 picture"));
    assert!(failure("grey-card = [0, 9223372036854775807, 1, 1]").contains("not all within"));
    let black = import("grey-card = [0, 0, 1, 1]", "a.exr", exr(2, 1, vec![[0.0, 1.0, 1.0]; 2]));
    assert!(black.failure().contains("not a grey"));
    for wrong in [
        "white-balance = 1999",
        "white-balance = \"sun\"",
        "white-balance = [1, 0, 1]",
        "grey-card = [1, 2, 3, 0]",
        "grey-card = [1, 2, 3]",
        "grey-card = [-1, 2, 3, 4]",
    ] {
        assert_eq!(import(wrong, "a.exr", "").errors().len(), 1, "{wrong}");
    }
    let both = import("white-balance = 3000\ngrey-card = [0, 0, 1, 1]", "a.exr", "").errors();
    assert_eq!(both, ["white-balance: grey-card measures what was white; remove one of the two"]);
}

#[test]
fn resolution_resizes() {
    let imported = import("resolution = 4", "a.exr", lat_long(8)).artifact::<Environment>();
    assert_eq!(imported.0.grid(), LatLong::with_rows(4));
    // A texel is the mean of four: with the sky's slope below 1 a radian, off by h^2 / 8 times its bend at
    // most.
    assert!(difference(imported.0.pixels(), environment(4, sky).0.pixels()) < 0.1);
    let message = &case("import-environment", "resolution = 0").errors()[0];
    assert_eq!(message, "resolution: 0 is not a whole number from 1 to 8192");
}

/// One sky is imported from OpenEXR's own lat-long and cube, whose pixel centres lie on the poles and the
/// edges.
///
/// Bilinear interpolation and the mean over a texel blur by (h^2 + g^2 / 2) / 12 of the Laplacian (1.8 at
/// most; h = 2 / 15 in the middle of a face, g = pi / 32): 0.003. A texel at a pole is a triangle, whose mean
/// lies g / 6 farther out than its centre, where the sky's slope is 0.36: 0.006.
#[test]
fn openexr_envmap_attribute_is_honoured() {
    let truth = environment(32, sky);
    let map = OpenExrLatLong { width: 64, height: 32 };
    let looks = |row, column| sky(map.direction(row, column).vector()).map(|value| value as f32);
    let pixels: Vec<_> = (0..64 * 32).map(|index| looks(index / 64, index % 64)).collect();
    let file = declared(64, 32, EnvironmentMap::LatitudeLongitude, &pixels);
    let imported = import("", "a.exr", file.clone()).artifact::<Environment>();
    assert_eq!(imported.0.grid(), LatLong::with_rows(32));
    let error = difference(imported.0.pixels(), truth.0.pixels());
    assert!(error < 0.009, "{error}");

    let cube = OpenExrCube { edge: 16 };
    let looks = |row, column| sky(cube.direction(row, column).vector()).map(|value| value as f32);
    let pixels: Vec<_> = (0..16 * 96).map(|index| looks(index / 16, index % 16)).collect();
    let imported =
        import("", "a.exr", declared(16, 96, EnvironmentMap::Cube, &pixels)).artifact::<Environment>();
    let error = difference(imported.0.pixels(), truth.0.pixels());
    assert!(error < 0.009, "{error}");

    // If the manifest contradicts the attribute, the manifest wins, with a warning.
    let ran = import("layout = \"lat-long\"", "a.exr", file).run().unwrap();
    assert_eq!(
        ran.warnings,
        ["the file's envmap attribute says openexr-lat-long, but it is read with layout = \"lat-long\""]
    );
    assert!(difference(ran.artifact::<Environment>().0.pixels(), truth.0.pixels()) > 0.012);
}

/// Six files, each of one colour that identifies its face.
fn faces(names: [&str; 6], edge: usize) -> Case {
    let mut case = case("import-environment", "").source("sets/sky").file("sets/sky/notes.txt", "");
    for (index, name) in names.iter().enumerate() {
        let colour = [index as f32, 1.0, 0.0];
        case = case.file(&format!("sets/sky/{name}"), exr(edge, edge, vec![colour; edge * edge]));
    }
    case
}

const NAMES: [&str; 6] = ["a_px.exr", "a_nx.exr", "a_py.exr", "a_ny.exr", "a_pz.exr", "a_nz.exr"];

#[test]
fn a_folder_is_six_faces() {
    let ran = faces(NAMES, 8).run().unwrap();
    assert_eq!(ran.notes, ["layout cube: 8 x 48 pixels resampled to 32 x 16"]);
    // The engine knows every file and the listing.
    assert_eq!(ran.reads.iter().filter(|read| read.path.extension().is_some_and(|e| e == "exr")).count(), 6);
    assert!(ran.reads.iter().any(|read| read.kind == ReadKind::Names && read.digest.is_some()));
    let environment = ran.artifact::<Environment>();
    for (index, face) in Face::ALL.into_iter().enumerate() {
        let colour = environment.0.radiance(Cube { edge: 1 }.direction(face, 0, 0));
        assert!((colour[0] - index as f64).abs() < 1e-6, "{face:?}: {colour:?}");
    }
}

#[test]
fn one_face_names_its_set() {
    let set = faces(NAMES, 4);
    let whole = set.artifact::<Environment>();
    let one = case("import-environment", "layout = \"cube\"").source("sets/a_px.exr");
    let one = NAMES.iter().enumerate().fold(one, |one, (index, name)| {
        one.file(&format!("sets/{name}"), exr(4, 4, vec![[index as f32, 1.0, 0.0]; 16]))
    });
    let one = one.file("sets/b_px.exr", "another set");
    assert_eq!(one.artifact::<Environment>(), whole);
}

#[test]
fn faces_that_are_missing_or_wrong_are_reported() {
    let failure = faces(["px.exr", "nx.exr", "py.exr", "posy.exr", "pz.exr", "nz.exr"], 2).failure();
    assert_eq!(failure, "sky: posy.exr and py.exr are the same face");
    let failure = faces(["px.exr", "nx.exr", "py.exr", "down.txt", "pz.exr", "nz.exr"], 2).failure();
    assert!(failure.contains("found nx.exr, nz.exr, px.exr, py.exr, pz.exr; missing: ny or"), "{failure}");
    let failure = import("layout = \"cube\"", "sky.exr", lat_long(4)).failure();
    assert!(failure.ends_with("its name does not end in a word for a face"), "{failure}");
}

#[test]
fn crosses_and_strips_are_recognised_by_their_shape() {
    let cube = Cube { edge: 6 };
    let looks = |face, row, column| sky(cube.direction(face, row, column).vector()).map(|value| value as f32);
    let strip: Vec<_> = (0..6 * 36).map(|i| looks(Face::ALL[i / 36], i / 6 % 6, i % 6)).collect();
    let imported = import("layout = \"cube-strip\"", "a.exr", exr(6, 36, strip)).artifact::<Environment>();
    // Texels in the middle of a face span 1/3: where the sky bends most, interpolation and mean have an error
    // of 0.02.
    assert!(difference(imported.0.pixels(), environment(12, sky).0.pixels()) < 0.04);
    let failure = import("layout = \"cube-cross\"", "a.exr", exr(6, 1, vec![[1.0; 3]; 6])).failure();
    assert!(failure.contains("cube cross is 4 cells wide and 3 high"), "{failure}");
}

#[test]
fn a_wrong_aspect_is_an_error_that_names_the_file_and_the_layout_that_fits() {
    let failure = import("", "room.exr", exr(4, 4, vec![[1.0; 3]; 16])).failure();
    assert_eq!(
        failure,
        "cannot import room.exr: a lat-long image is twice as wide as high; this one is 4 x 4: \
         is it layout = \"probe\"?"
    );
}

#[test]
fn bad_pixels_are_counted_placed_and_treated_as_asked() {
    let mut pixels = vec![[1.0; 3]; 8];
    pixels[5] = [f32::NAN, -2.0, f32::INFINITY];
    let file = exr(4, 2, pixels);
    let failure = import("", "a.exr", file.clone()).run().err().unwrap();
    let message = failure.to_string();
    assert!(
        message.contains("1 NaN, the first at row 1, column 1, red (theta 135.0, phi 45.0 degrees)"),
        "{message}"
    );
    assert!(message.contains("1 infinite") && message.contains("1 negative"), "{message}");
    assert!(failure.help.unwrap().contains("bad-pixels = \"zero\""));
    for (policy, expected) in [("zero", [0.0, 0.0, 0.0]), ("clamp", [0.0, 0.0, 1.0])] {
        let ran = import(&format!("bad-pixels = \"{policy}\""), "a.exr", file.clone()).run().unwrap();
        assert_eq!(ran.artifact::<Environment>().0.pixels()[5], expected);
        assert!(ran.warnings[0].starts_with("bad pixels were replaced: 1 NaN"), "{:?}", ran.warnings);
    }
}

#[test]
fn negative_values_become_zero_with_their_share_of_the_light() {
    let mut pixels = vec![[1.0; 3]; 8];
    pixels[5] = [2.0, -0.5, 1.0];
    let ran = import("", "a.exr", exr(4, 2, pixels.clone())).run().unwrap();
    assert_eq!(ran.artifact::<Environment>().0.pixels()[5], [2.0, 0.0, 1.0]);
    // 0.5 of 24.5 channels, all of the same solid angle.
    assert_eq!(
        ran.warnings,
        [
            "1 negative value became 0: 2.0 % of the light; the first was at row 1, column 1, green (theta 135.0, \
          phi 45.0 degrees)"
        ]
    );
    let strict = import("bad-pixels = \"error\"", "a.exr", exr(4, 2, pixels.clone())).failure();
    assert!(strict.contains("1 negative"), "{strict}");
    pixels[5][1] = -20.0;
    let ran = import("", "a.exr", exr(4, 2, pixels)).run().unwrap();
    assert!(ran.warnings[0].contains("Light is never negative"), "{:?}", ran.warnings);
}

/// Luminances by Rec. 709's weights.
fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.212_639 * f64::from(r) + 0.715_169 * f64::from(g) + 0.072_192 * f64::from(b)
}

#[test]
fn colours_outside_of_rec_709_keep_their_luminance() {
    let mut pixels = vec![[0.8, 0.4, 0.2]; 8];
    pixels[5] = [0.02, 2.0, 0.02];
    for name in ["acescg", "ACES - ACEScg", "lin_ap1_scene"] {
        let parameters = format!("colour-space = {name:?}");
        let ran = import(&parameters, "a.exr", exr(4, 2, pixels.clone())).run().unwrap();
        let found = ran.artifact::<Environment>();
        let found = found.0.pixels();
        // As colour-science converts it: 1.098672, 0.350007, 0.159804.
        assert!((f64::from(found[0][0]) - 1.098_672).abs() < 3e-4, "{:?}", found[0]);
        assert!(found[5].iter().all(|value| *value >= 0.0) && found[5][1] > found[5][0], "{:?}", found[5]);
        // Y of AP1's green, adapted: 0.6674 of XYZ of D60; 1.3588 = 2 Y_green + 0.02 (Y_red + Y_blue) of D65.
        let linear =
            import(&format!("{parameters}\nbad-pixels = \"error\""), "a.exr", exr(4, 2, pixels.clone()));
        assert!(linear.run().is_ok(), "what the conversion makes negative is not a bad pixel");
        assert!(ran.warnings[0].contains("1 pixel (12 % of the image, "), "{:?}", ran.warnings);
    }
    let errors = import("colour-space = \"rec601\"", "a.exr", exr(4, 2, pixels)).errors();
    assert!(errors[0].contains("\"rec709\", \"rec2020\", \"acescg\""), "{errors:?}");
    // Luminance is that of the matrix alone: white keeps it at 1.
    let white = import("colour-space = \"xyz\"", "a.exr", exr(2, 1, vec![[0.950_456, 1.0, 1.089_058]; 2]));
    let white = white.artifact::<Environment>().0.pixels()[0];
    assert!((luminance(white) - 1.0).abs() < 1e-5 && (white[0] - 1.0).abs() < 1e-4, "{white:?}");
}

#[test]
fn quake_and_unity_are_arranged_by_their_edges() {
    let edge = 16;
    let cube = Cube { edge };
    let seen = |face: usize| {
        let texel = |index: usize| {
            let direction = cube.direction(Face::ALL[face], index / edge, index % edge);
            sky(direction.vector()).map(|value| value as f32)
        };
        exr(edge, edge, (0..edge * edge).map(texel).collect())
    };
    let truth = environment(2 * edge, sky);
    // Which face each name holds: Quake's axes are Specula's, where +X is the face +Z.
    for (names, faces, notes) in [
        (
            ["sky_rt.exr", "sky_bk.exr", "sky_lf.exr", "sky_ft.exr", "sky_up.exr", "sky_dn.exr"],
            [4, 1, 5, 0, 2, 3],
            1,
        ),
        (
            ["aRight.exr", "aLeft.exr", "aUp.exr", "aDown.exr", "aFront.exr", "aBack.exr"],
            [0, 1, 2, 3, 4, 5],
            1,
        ),
        (
            ["aRight.exr", "aLeft.exr", "aUp.exr", "aDown.exr", "aFront.exr", "aBack.exr"],
            [1, 0, 2, 3, 4, 5],
            2,
        ),
        (["c00.exr", "c01.exr", "c02.exr", "c03.exr", "c04.exr", "c05.exr"], [0, 1, 2, 3, 4, 5], 1),
        (["a+X.exr", "a-X.exr", "a+Y.exr", "a-Y.exr", "a+Z.exr", "a-Z.exr"], [0, 1, 2, 3, 4, 5], 1),
    ] {
        let case = case("import-environment", "").source("sky");
        let case = names
            .iter()
            .zip(faces)
            .fold(case, |case, (name, face)| case.file(&format!("sky/{name}"), seen(face)));
        let ran = case.run().unwrap();
        assert_eq!(ran.notes.len(), notes, "{names:?}: {:?}", ran.notes);
        let found = ran.artifact::<Environment>();
        assert!(difference(found.0.pixels(), truth.0.pixels()) < 0.05, "{names:?}");
    }
}

#[test]
fn a_cube_that_was_exported_comes_back() {
    let truth = environment(64, sky);
    for (format, precision) in [("ktx2", "half"), ("ktx2", "float"), ("dds", "half"), ("dds", "float")] {
        for layout in ["cube", "lat-long"] {
            let parameters = format!("layout = {layout:?}\nformat = {format:?}\nprecision = {precision:?}");
            let written = case("export-environment", &parameters).input("environment", truth.clone());
            let back = import("resolution = 64", &format!("a.{format}"), written.files()[0].clone());
            let found = back.artifact::<Environment>();
            assert!(difference(found.0.pixels(), truth.0.pixels()) < 0.01, "{format} {precision} {layout}");
            assert!(back.check().is_none());
        }
        let back = import("layout = \"probe\"", "a.ktx2", {
            let parameters = "layout = \"cube\"\nformat = \"ktx2\"";
            case("export-environment", parameters).input("environment", truth.clone()).files()[0].clone()
        });
        assert!(back.failure().contains("the file holds a cube, but layout = \"probe\" is not one"));
    }
}

#[test]
fn files_of_other_formats_are_named_in_the_error() {
    for (bytes, expected) in [
        (Vec::new(), "the file is empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n".to_vec(), "git lfs pull"),
        (b"hello".to_vec(), "begins with the bytes 68 65 6c 6c 6f"),
        (lat_long(8)[..400].to_vec(), "OpenEXR"),
    ] {
        let failure = import("", "a.exr", bytes).failure();
        assert!(failure.starts_with("cannot import a.exr: ") && failure.contains(expected), "{failure}");
    }
    assert!(
        case("import-environment", "").source("no.exr").failure().starts_with("cannot read /memory/no.exr: ")
    );
}

#[test]
fn a_png_without_high_dynamic_range_is_warned_of() {
    let png = containers::write_png(2, 1, &[[255, 0, 188]; 2], None).unwrap();
    let ran = import("", "a.png", png).run().unwrap();
    assert!(ran.warnings[0].starts_with("a.png: PNG holds no high dynamic range"), "{:?}", ran.warnings);
    let pixel = ran.artifact::<Environment>().0.pixels()[0];
    // sRGB 188 is linear 0.5029.
    assert!(pixel[0] == 1.0 && pixel[1] == 0.0 && (pixel[2] - 0.5029).abs() < 1e-4, "{pixel:?}");
}
