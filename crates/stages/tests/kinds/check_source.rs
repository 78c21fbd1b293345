//! What `check_source` finds: each error below is one of the text or of a header. That it refuses nothing
//! that runs, and has the message of the run, is checked for every case of every kind (`fixture.rs`).

use containers::{Precision, write_exr, write_png, write_rgbe};
use envmap::Image;

use crate::fixture::{Case, case};

fn image(width: usize, height: usize) -> Image {
    Image::new(width, height, vec![[0.5; 3]; width * height]).unwrap()
}

fn hdr(width: usize, height: usize) -> Vec<u8> {
    write_rgbe(&image(width, height), None).unwrap().bytes
}

fn environment(parameters: &str, name: &str, bytes: impl Into<Vec<u8>>) -> Case {
    case("import-environment", parameters).file(name, bytes).source(name)
}

fn material(text: &str) -> Case {
    case("import-material", "").file("copper.toml", text).source("copper.toml")
}

/// Checks that a source is refused without a run, with these words, and by a run in the same way.
fn refuse(case: &Case, words: &str) {
    let found = case.check().unwrap_or_else(|| panic!("nothing is found; expected {words:?}"));
    assert!(found.to_string().contains(words), "{found}");
    assert_eq!(case.run().err(), Some(found));
}

#[test]
fn materials_are_read_but_what_they_name_only_by_its_header() {
    refuse(&material("model = \"ggx\"\nior = 1.5"), "copper.toml:1:1: \"roughness\" is missing");
    refuse(&material("model = "), "copper.toml:1:");
    let measured = |file: &str, bytes: &[u8]| {
        material(&format!("model = \"measured\"\nfile = \"{file}\"")).file(file, bytes)
    };
    refuse(&material("model = \"measured\"\nfile = \"gone.binary\""), "gone.binary");
    refuse(&measured("a.binary", &[90, 0, 0, 0, 90, 0, 0, 0, 180, 0, 0, 0, 7]), "the file has 13");
    refuse(&measured("a.csv", b"theta,phi\n1,2\n"), "stands first; expected the header");
    refuse(&measured("a.csv", b"theta_i,theta_o,phi,r,g,b\n1,2,3,4,5\n"), "line 2");
    refuse(&measured("a.brdf", b"2\n400 300\n"), "expected 2 rising wavelengths");
    refuse(&measured("a.curet", b"grads\n"), "expected the unit of the angles");
    refuse(&measured("a.csv", b"version https://git-lfs.github.com/spec/v1\n"), "git lfs pull");
    let table = case("import-material", "").file("a.binary", [90, 0]).source("a.binary");
    refuse(&table, "expected a header of 12");
    refuse(&case("import-material", "").file("m/a.toml", "").source("m"), "m is a folder, not a material");
    // What only the numbers show is left to the run.
    let lines = "1,2,3,4,5,6\n".repeat(20_000);
    let late = measured("a.csv", format!("theta_i,theta_o,phi,r,g,b\n{lines}oops\n").as_bytes());
    assert_eq!(late.check(), None);
}

#[test]
fn materials_of_gltf_files_are_read_without_their_textures() {
    let gltf = |materials: &str, rest: &str| {
        let text = format!("{{ \"asset\": {{ \"version\": \"2.0\" }}, \"materials\": [{materials}]{rest} }}");
        case("import-material", "").file("a.gltf", text).source("a.gltf")
    };
    refuse(&gltf("", ""), "the file has no materials");
    refuse(&gltf("{}, {}", ""), "expected `material` to be one of");
    refuse(&gltf("{ \"pbrMetallicRoughness\": { \"roughnessFactor\": 7 } }", ""), "roughnessFactor");
    let textured = "{ \"pbrMetallicRoughness\": { \"baseColorTexture\": { \"index\": 0 } } }";
    let rest = ", \"textures\": [{ \"source\": 0 }], \"images\": [{ \"uri\": \"a.png\" }]";
    refuse(&gltf(textured, rest), "a.png");
    refuse(&gltf(textured, ""), "textures: there is no element 0");
    // A texture that is no picture is found when it is averaged.
    assert_eq!(gltf(textured, rest).file("a.png", "no picture").check(), None);
}

#[test]
fn environments_are_known_by_their_headers() {
    assert_eq!(environment("", "sky.hdr", hdr(8, 4)).check(), None);
    refuse(&environment("", "sky.hdr", hdr(8, 3)), "cannot import sky.hdr");
    refuse(&environment("layout = \"probe\"", "sky.hdr", hdr(8, 4)), "cannot import sky.hdr");
    refuse(
        &environment("", "sky.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4"),
        "cannot import sky.hdr",
    );
    refuse(&environment("", "sky.exr", "no picture"), "cannot import sky.exr");
    refuse(&environment("", "sky.exr", ""), "the file is empty");
    let exr = write_exr(&image(8, 4), Precision::Half, None).unwrap().bytes;
    refuse(&environment("layer = \"diffuse\"", "sky.exr", exr.clone()), "there is no layer `diffuse`");
    refuse(&environment("", "sky.exr", &exr[..40]), "cannot import sky.exr");
    let png = write_png(8, 3, &[[9; 3]; 24], None).unwrap();
    refuse(&environment("", "sky.png", png), "cannot import sky.png");
    // Half of the pixels are missing: the header is right.
    let whole = hdr(64, 32);
    assert_eq!(environment("", "sky.hdr", &whole[..whole.len() / 2]).check(), None);
}

#[test]
fn faces_are_compared() {
    let faces = ["px", "nx", "py", "ny", "pz", "nz"];
    let cube = |edge_of: &dyn Fn(&str) -> usize| {
        let cube = case("import-environment", "").source("cube");
        faces.iter().fold(cube, |cube, face| {
            cube.file(&format!("cube/{face}.hdr"), hdr(edge_of(face), edge_of(face)))
        })
    };
    assert_eq!(cube(&|_| 4).check(), None);
    refuse(&cube(&|face| if face == "ny" { 8 } else { 4 }), "8 x 8");
    let five = case("import-environment", "").file("cube/px.hdr", hdr(4, 4)).source("cube");
    refuse(&five, "cube");
}

#[test]
fn lights_meshes_and_maps_are_read() {
    let lights =
        case("circular-lights", "").file("a.toml", "[[light]]\ndirection = [0, 0, 1]").source("a.toml");
    refuse(&lights, "\"angular_radius\" or \"solid_angle\" is missing");
    let mesh = |text: &str| case("import-mesh", "").file("a.gltf", text).source("a.gltf");
    refuse(&mesh("{}"), "cannot import a.gltf");
    refuse(&mesh("solid"), "this is not a glTF file");
    let square = crate::import_mesh::square();
    assert_eq!(square.check(), None);
    refuse(&square.file("meshes/square.bin", vec![0; 85]), "byteLength is 86, and there are 85 bytes");
    let glb = |length: u8| [&b"glTF"[..], &[2, 0, 0, 0, length, 0, 0, 0, 2, 0, 0, 0], b"JSON{}"].concat();
    let binary = |bytes: Vec<u8>| case("import-mesh", "").file("a.glb", bytes).source("a.glb");
    refuse(&binary(glb(22)), "the JSON is not that of glTF 2.0");
    refuse(&binary(glb(23)), "the header declares 23 bytes, and there are 22");
    let index = r#"{ "format": "explicit-reflection-maps", "version": 1, "views": "global", "layout": "lat-long",
        "maps": [{ "file": "a.hdr", "view": [0, 0, 1] }, { "file": "b.hdr", "view": [1, 0, 0] }] }"#;
    let maps = |a: Vec<u8>, b: Vec<u8>| {
        let maps = case("import-reflection-maps", "").file("maps.json", index).source("maps.json");
        maps.file("a.hdr", a).file("b.hdr", b)
    };
    assert_eq!(maps(hdr(8, 4), hdr(8, 4)).check(), None);
    refuse(&maps(hdr(8, 4), hdr(8, 3)), "cannot import maps.json: b.hdr: a lat-long map is twice as wide");
    refuse(&maps(hdr(8, 4), hdr(4, 2)), "b.hdr: 4 x 2 texels, but a.hdr has 8 x 4");
    let none = case("import-reflection-maps", "").file("maps.json", index).source("maps.json");
    refuse(&none, "a.hdr: cannot read");
}
