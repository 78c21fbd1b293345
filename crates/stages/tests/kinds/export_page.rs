//! Live pages: what their data say, what they hold, and what they leave out. What they draw is compared with
//! the CPU's pictures in a browser, by tests/readers/page.mjs and textured.mjs.

use base64::prelude::{BASE64_STANDARD, Engine};
use brdf::{BaseColorTexture, Standard, StandardParameters, TexturePlacement, Wrap};
use engine::Output;
use mesh::MaterialRange;
use serde_json::{Value, json};
use stages::artifacts::{BrdfTable, Material, Mesh, Reflection, ScaleSpace, Taps, Transfer};

use crate::fixture::{Case, case, environment, lambert, phong, reflection, sky};
use crate::parts::reflected_under;
use crate::small_maps::lighting;
use crate::taps::{fit_taps, scale_space};
use crate::vertices::{pit, table};

const DAY: [(&str, &str); 1] = [("environment", "day")];

/// A material with a name under one environment, in all forms.
pub(crate) fn page(parameters: &str, name: &str) -> Case {
    let pair = [DAY[0], ("material", name)];
    let scales = case("scale-space", "resolution = 16").input("environment", environment(64, sky));
    case("export-page", parameters)
        .keyed_input("environment", &DAY, environment(64, sky))
        .keyed_input("material", &[pair[1]], Material(phong(20.0)))
        .keyed_input("reflection", &pair, reflection(phong(20.0), 4))
        .keyed_input("scale-space", &DAY, (*scales.artifact::<ScaleSpace>()).clone())
        .keyed_input("taps", &[pair[1]], (*fit_taps("taps = 2").artifact::<Taps>()).clone())
        .keyed_input("table", &[pair[1]], table(phong(20.0)))
}

/// The text and the data of a page.
pub(crate) fn read(case: &Case) -> (String, Value) {
    let files = case.files();
    assert_eq!(files.len(), 1);
    let text = String::from_utf8(files[0].clone()).unwrap();
    let data = text.split("id=\"page-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data = serde_json::from_str(data).unwrap();
    (text, data)
}

fn blob(page: &str, place: &Value) -> Vec<u8> {
    let text = page.split(&format!("id=\"blob-{place}\">")).nth(1).unwrap().split('<').next().unwrap();
    miniz_oxide::inflate::decompress_to_vec_zlib(&BASE64_STANDARD.decode(text).unwrap()).unwrap()
}

fn forms(data: &Value) -> Vec<&str> {
    let views = data["pairs"][0]["views"].as_array().unwrap();
    let form =
        |view: &Value| data["modes"][view["mode"].as_u64().unwrap() as usize]["name"].as_str().unwrap();
    views.iter().map(form).collect()
}

#[test]
fn a_page_has_every_form_and_all_that_it_refers_to() {
    let (page, data) = read(&page("resolution = 8\nslices = 4", "copper"));
    let all =
        ["taps", "local-shrm", "cabral", "kautz-mccool", "prefiltered", "table", "irradiance", "mirror"];
    assert_eq!(forms(&data), all);
    assert_eq!(data["left_out"], Value::Array(Vec::new()));
    for view in data["pairs"][0]["views"].as_array().unwrap() {
        let mut shader = String::from_utf8(blob(&page, &view["fragment"])).unwrap();
        assert!(shader.contains("void main()"));
        let defines = view["defines"].as_object().unwrap();
        for name in defines.keys() {
            assert!(
                shader.contains(&format!("({name})")) || shader.contains(&format!("#ifdef {name}\n")),
                "{name}"
            );
        }
        if view["functions"].is_u64() {
            shader += std::str::from_utf8(&blob(&page, &view["functions"])).unwrap();
        }
        for (name, texture) in view["textures"].as_object().unwrap() {
            assert!(shader.contains(&format!(" {name};")), "{name}");
            let texels: u64 =
                texture["size"].as_array().unwrap().iter().map(|side| side.as_u64().unwrap()).product();
            let bytes = match texture["format"].as_str().unwrap() {
                "rgb9e5" | "r32ui" => 4,
                "rgb16f" => 6,
                "rgba16f" => 8,
                _ => 16,
            };
            assert_eq!(blob(&page, &texture["blob"]).len() as u64, texels * bytes, "{name}");
        }
        for (name, block) in view["blocks"].as_object().unwrap() {
            let vectors = format!("{}_VECTORS", name.to_uppercase());
            assert!(shader.contains(&format!(" {name}[{vectors}]; }};")), "{name}");
            assert_eq!(defines[&vectors], blob(&page, &block["blob"]).len() / 16, "{name}");
        }
    }
    // Nothing outside is asked for.
    let text = page.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "");
    assert!(!text.contains("http") && !text.contains("src=\"/") && page.contains("default-src 'none'"));
}

#[test]
fn errors_are_those_of_a_comparison_with_brute_force() {
    let (page_text, data) = read(&page("resolution = 16\nslices = 8", "copper"));
    let of = |form: &str| {
        let place = forms(&data).iter().position(|name| *name == form).unwrap();
        data["pairs"][0]["views"][place]["error"]["p95"].as_f64()
    };
    assert!(
        of("local-shrm").unwrap() < 0.1 && of("taps").unwrap() < 0.3,
        "{:?} {:?}",
        of("local-shrm"),
        of("taps")
    );
    assert!(of("prefiltered").unwrap() > of("local-shrm").unwrap());
    assert_eq!(of("mirror"), None);
    assert_eq!(page_text.matches("<img").count(), 1);
    let (page, data) = read(&page("resolution = 8\nslices = 4\nmeasure = false", "copper"));
    assert!(data["pairs"][0]["views"].as_array().unwrap().iter().all(|view| view["error"].is_null()));
    assert_eq!(page.matches("<img").count(), 0);
}

#[test]
fn a_page_that_would_be_too_large_says_what_it_leaves_out() {
    let case = page("resolution = 64\nslices = 16\nsize-limit = 0.44\nmeasure = false", "copper");
    let (text, data) = read(&case);
    assert!(text.len() < 440_000, "{}", text.len());
    let left = data["left_out"].as_array().unwrap();
    assert!(forms(&data).starts_with(&["taps"]) && !left.is_empty(), "{:?} {left:?}", forms(&data));
    assert!(left.iter().all(|line| line.as_str().unwrap().starts_with("copper under day as ")), "{left:?}");
    let warnings = case.run().unwrap().warnings;
    assert!(warnings.iter().any(|line| line.contains("larger than 0.44 MB")), "{warnings:?}");
}

/// A page has as many coefficients and texels of an SHRM as the exported files: of a metal and of both parts
/// of a lacquer, under a sun in the map and beside it.
#[test]
fn an_shrm_is_as_large_as_that_of_the_files() {
    let metal = StandardParameters { metallic: 1.0, roughness: 0.4, ..Default::default() };
    let lacquer = StandardParameters { roughness: 0.4, ..Default::default() };
    for (parameters, maps) in [(metal, 1), (lacquer, 2)] {
        let material = brdf::Material::Standard(Standard::new(parameters).unwrap());
        let reflection = reflected_under(lighting(true), material, "");
        for lamps in ["baked", "separate"] {
            let parameters = format!("layout = \"cube\"\nformat = \"ktx2\"\nlamps = \"{lamps}\"");
            let exported = case("export-shrm", &parameters).input("reflection", reflection.clone());
            let (files, bytes) = exported.exported();
            let textures = bytes.iter().filter_map(|bytes| containers::read_ktx2(bytes).ok());
            let textures: Vec<_> = textures.collect();
            assert_eq!(textures.len(), maps);
            let pair = [DAY[0], ("material", "it")];
            let case = case("export-page", "measure = false")
                .keyed_input("environment", &DAY, environment(64, sky))
                .keyed_input("shrm", &pair, files)
                .keyed_input::<Reflection>("reflection", &pair, reflection.clone());
            let view = &read(&case).1["pairs"][0]["views"][0];
            let layers: usize = textures.iter().map(|texture| 6 * texture.layers).sum();
            let edge = textures.iter().map(|texture| texture.width).max().unwrap();
            assert_eq!(
                view["textures"]["map"]["size"],
                json!([edge, edge, layers]),
                "{lamps} {}",
                view["note"]
            );
            assert_eq!(view["uniforms"]["map_uniforms.count"].as_f64(), Some(maps as f64));
        }
    }
}

/// An SHRM alone that would not fit has a half or a quarter of its texels along an edge, and is there.
#[test]
fn the_only_form_of_a_pair_is_made_smaller() {
    let reflection = reflection(phong(20.0), 4);
    let exported = case("export-shrm", "layout = \"cube\"\nresolution = 256\nformat = \"ktx2\"");
    let (files, _) = exported.input("reflection", reflection.clone()).exported();
    let edge = |limit: &str| {
        let pair = [DAY[0], ("material", "copper")];
        let case = case("export-page", &format!("size-limit = {limit}\nmeasure = false"))
            .keyed_input("environment", &DAY, environment(64, sky))
            .keyed_input("shrm", &pair, files.clone())
            .keyed_input::<Reflection>("reflection", &pair, reflection.clone());
        let (text, data) = read(&case);
        assert!(text.len() as f64 <= limit.parse::<f64>().unwrap() * 1e6, "{limit}: {}", text.len());
        assert_eq!(forms(&data), ["local-shrm", "irradiance", "mirror"], "{limit}");
        let view = &data["pairs"][0]["views"][0];
        let edge = view["textures"]["map"]["size"][0].as_u64().unwrap();
        assert_eq!(view["uniforms"]["map_uniforms.parts[0].edge"].as_f64(), Some(edge as f64));
        let says = format!("{edge} texels along an edge here, not 256");
        assert_eq!(view["note"].as_str().unwrap().contains(&says), edge < 256, "{view}");
        assert_eq!(data["left_out"].to_string().contains("reflections in more than 1/"), edge < 256);
        edge
    };
    assert_eq!(["0.55", "0.44", "0.41"].map(edge), [256, 128, 64]);
}

/// Twenty photographs and one material: the skies are small, and the material is there.
#[test]
fn skies_leave_room_for_materials() {
    let noise =
        |w: sphere::DVec3| [w.x, w.y, w.z].map(|x| (x * 12_345.678).sin().mul_add(43_758.545, 1e5) % 1.0);
    let taps = fit_taps("taps = 2").artifact::<Taps>();
    let mut case = case("export-page", "size-limit = 1.6\nmeasure = false").keyed_input(
        "taps",
        &[("material", "copper")],
        (*taps).clone(),
    );
    for name in
        ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p", "q", "r", "s", "t"]
    {
        let key = [("environment", name)];
        let scales =
            self::case("scale-space", "resolution = 16").input("environment", environment(64, noise));
        case = case.keyed_input("environment", &key, environment(64, noise)).keyed_input(
            "scale-space",
            &key,
            (*scales.artifact::<ScaleSpace>()).clone(),
        );
    }
    let (_, data) = read(&case);
    assert!(data["skies"][0]["textures"]["map"]["size"][1].as_u64().unwrap() <= 64);
    assert_eq!(forms(&data)[0], "taps");
}

#[test]
fn a_hostile_name_is_text() {
    let name = "</script><script>alert(1)</script>";
    let (text, data) = read(&page("resolution = 8\nslices = 4", name));
    assert_eq!(data["materials"][0], name);
    assert!(!text.contains("<script>alert"));
}

#[test]
fn what_is_missing_is_named() {
    let day = || case("export-page", "").keyed_input("environment", &DAY, environment(16, sky));
    assert_eq!(day().failure(), "no material is connected under an environment");
    let scales = scale_space("resolution = 16").artifact::<ScaleSpace>();
    let alone = day().keyed_input("scale-space", &DAY, (*scales).clone());
    assert_eq!(alone.failure(), "scale-space is connected, but taps is not");
    // A reflection under another light is no pair of this one.
    let other = [("environment", "night"), ("material", "chalk")];
    let other = day().keyed_input("reflection", &other, reflection(lambert(0.8), 2));
    assert_eq!(other.failure(), "no material is connected under an environment");
}

/// Without a material there is nothing to compare with, and maps are shown all the same.
#[test]
fn a_reflection_is_enough() {
    let pair = [DAY[0], ("material", "chalk")];
    let case = case("export-page", "resolution = 8\nslices = 4")
        .keyed_input("environment", &DAY, environment(32, sky))
        .keyed_input::<Reflection>("reflection", &pair, reflection(lambert(0.8), 2));
    let (_, data) = read(&case);
    assert_eq!(forms(&data)[0], "local-shrm");
    assert!(data["pairs"][0]["views"][0]["error"].is_null());
}

#[test]
fn a_table_is_enough() {
    let chalk = [("material", "chalk")];
    let of = |tables: BrdfTable| {
        case("export-page", "")
            .keyed_input("environment", &DAY, environment(64, sky))
            .keyed_input("material", &chalk, Material(lambert(0.8)))
            .keyed_input("table", &chalk, tables)
    };
    let (_, data) = read(&of(table(lambert(0.8))));
    assert_eq!(forms(&data), ["table", "irradiance", "mirror"]);
    let view = &data["pairs"][0]["views"][0];
    assert_eq!(view["note"], "F = 4, 16 x 16 views");
    // Degree 4 holds what a matte surface reflects.
    assert!(view["error"]["p95"].as_f64().unwrap() < 0.02, "{}", view["error"]);
    // A grey table has four coefficients in a texel.
    assert_eq!(view["textures"]["table_map"]["size"], serde_json::json!([16, 16, 7]));
    let two = case("tabulate-brdf", "resolution = 16")
        .keyed_input("materials", &[("material", "a")], Material(lambert(0.5)))
        .keyed_input("materials", &[("material", "b")], Material(lambert(0.8)));
    let failed = of((*two.artifact::<BrdfTable>()).clone());
    assert_eq!(failed.failure(), "no material is connected under an environment");
}

#[test]
fn a_mesh_with_a_matte_transfer_has_it_at_its_vertices() {
    let of = |mesh, parameters: &str| {
        let bake = case("precompute-transfer", parameters).input("mesh", pit());
        let page = page("resolution = 8\nslices = 4\nmeasure = false", "copper");
        page.input("mesh", mesh).input("transfer", (*bake.artifact::<Transfer>()).clone())
    };
    let (page, data) = read(&of(pit(), "form = \"matte\"\ndirections = 512"));
    let all = forms(&data);
    let place = all.iter().position(|form| *form == "transfer").unwrap();
    let view = &data["pairs"][0]["views"][place];
    let shader = String::from_utf8(blob(&page, &view["vertex"])).unwrap();
    assert!(shader.contains("uniform highp sampler2D transfer_vectors;"), "{shader}");
    assert_ne!(data["pairs"][0]["views"][0]["vertex"], view["vertex"], "one shader serves all other forms");
    let parts = |mesh: usize| data["meshes"][mesh]["parts"].as_array().unwrap();
    let vectors = &parts(0)[0]["transfer"];
    assert_eq!(vectors["uniforms"]["transfer_uniforms.rows"], 25.0);
    assert_eq!(vectors["textures"]["transfer_vectors"]["size"], serde_json::json!([1024, 1, 1]));
    assert!(parts(1)[0]["transfer"].is_null(), "our own knot has none");

    let matrices = of(pit(), "directions = 512").failure();
    assert_eq!(matrices, "the transfer of the mesh: it is not matte");
    let other = Mesh(mesh::shape("plane").unwrap());
    let other = of(other, "form = \"matte\"\ndirections = 512").failure();
    assert_eq!(other, "the transfer belongs to no mesh of the page");
}

/// The numbers of a blob of words of four bytes, as the page's script restores them.
fn words(page: &str, entry: &Value) -> Vec<i32> {
    let components = entry["words"][1].as_u64().unwrap() as usize;
    assert_eq!(entry["words"][0], 4);
    let planes = blob(page, &entry["blob"]);
    let count = planes.len() / 4;
    let mut values = vec![0_i32; count];
    for place in 0..count {
        let byte = |k: usize| {
            let component = k * components + place % components;
            planes[component * count / components + place / components]
        };
        let difference = i32::from_be_bytes([0, 1, 2, 3].map(byte));
        let before = place.checked_sub(components).map_or(0, |before| values[before]);
        values[place] = before.wrapping_add(difference);
    }
    values
}

/// Three squares, of the materials red, blue and none, in a page of copper and materials of these names, of
/// which red has a texture of so many texels along a side.
fn dressed(parameters: &str, names: [&str; 2], side: usize) -> Case {
    let plane = mesh::shape("plane").unwrap();
    let range = |material| MaterialRange { material, triangles: 2 };
    let squares = mesh::Mesh::joined(&[plane.clone(), plane.clone(), plane]).unwrap();
    let squares = squares
        .with_materials(vec!["red".into(), "a/blue".into()], &[range(Some(0)), range(Some(1)), range(None)])
        .unwrap();
    // What no compression finds a rule in.
    let noise = |k: usize| {
        let mixed = (k as u32).wrapping_mul(2_654_435_761);
        ((mixed ^ mixed >> 15).wrapping_mul(2_246_822_519) >> 24) as u8
    };
    let texels = (0..side * side).map(|k| [(k * k % 251) as u8, noise(k), 9]).collect();
    let placement = TexturePlacement {
        transform: [[2.0, 0.0, 0.25], [0.0, 1.0, 0.0]],
        wrap: [Wrap::Repeat, Wrap::Clamp],
        factor: [0.5, 1.0, 1.0],
        is_nearest: false,
    };
    let texture = BaseColorTexture::new([side; 2], texels, placement).unwrap();
    let clay = brdf::Material::Standard(Standard::new(StandardParameters::default()).unwrap());
    let mut case = page(&format!("resolution = 8\nslices = 4\nmeasure = false\n{parameters}"), "copper")
        .keyed_input("mesh", &[("mesh", "squares")], Mesh(squares));
    for (name, texture) in names.into_iter().zip([Some(&texture), None]) {
        let key = [("material", name)];
        let output = Material(clay.clone()).output_with_texture(texture).unwrap();
        let Output::Artifact { bytes, .. } = output else { panic!("not an artifact") };
        case = case.keyed_bytes::<Material>("material", &key, bytes).keyed_input(
            "reflection",
            &[DAY[0], key[0]],
            reflection(clay.clone(), 2),
        );
    }
    case
}

fn place(data: &Value, material: &str) -> usize {
    data["materials"].as_array().unwrap().iter().position(|name| name == material).unwrap()
}

fn pair<'d>(data: &'d Value, material: &str) -> &'d Value {
    let pairs = data["pairs"].as_array().unwrap();
    pairs.iter().find(|pair| pair["material"] == place(data, material)).unwrap()
}

#[test]
fn each_part_of_a_mesh_has_its_own_material_and_its_texture() {
    let (page, data) = read(&dressed("", ["red", "squares-a-blue"], 4));
    let parts = data["meshes"][0]["parts"].as_array().unwrap();
    let of = |material: &str| {
        let place = place(&data, material);
        parts.iter().find(|part| part["material"] == place).unwrap()
    };
    assert_eq!(parts.len(), 3);
    assert!(parts.iter().any(|part| part["material"].is_null()));
    assert_eq!(of("squares-a-blue")["coordinates"], serde_json::json!({}));
    // The coordinates of a square, by the placement of the texture.
    let coordinates = of("red")["coordinates"].as_object().unwrap();
    assert_eq!(coordinates.keys().collect::<Vec<_>>(), [&place(&data, "red").to_string()]);
    let plane = mesh::shape("plane").unwrap();
    let expected = plane.coordinates().unwrap().iter();
    let expected: Vec<_> = expected.flat_map(|[u, v]| [2.0 * u + 0.25, *v]).collect();
    let found = words(&page, coordinates.values().next().unwrap());
    assert_eq!(found.iter().map(|step| *step as f32 / 65536.0).collect::<Vec<_>>(), expected);

    let red = &pair(&data, "red")["base_color"];
    let uniforms = words(&page, &red["blocks"]["texture_uniforms"]);
    // Factor, nearest, wrapping, the number of levels, and the first of them.
    assert_eq!(uniforms[..2], [0.5_f32.to_bits() as i32, 1.0_f32.to_bits() as i32]);
    assert_eq!(uniforms[3..11], [0, 0, 2, 3, 0, 0, 4, 4]);
    let texels = &red["textures"]["texture_texels"];
    assert_eq!(texels["size"], serde_json::json!([1024, 1, 1]));
    let planes = blob(&page, &texels["blob"]);
    assert_eq!(planes[..4], [0, 1, 3, 5], "the differences of 0, 1, 4 and 9");
    for material in ["red", "squares-a-blue", "copper"] {
        let pair = pair(&data, material);
        assert_eq!(pair["base_color"].is_object(), material == "red", "{material}");
        for view in pair["views"].as_array().unwrap() {
            let form = data["modes"][view["mode"].as_u64().unwrap() as usize]["name"].as_str().unwrap();
            assert_eq!(view["shows_material"], !matches!(form, "irradiance" | "mirror"), "{material} {form}");
            let shader = String::from_utf8(blob(&page, &view["fragment"])).unwrap();
            for name in ["texture_texels", "base_color_numbers", "texture_uniforms"] {
                assert!(shader.contains(name), "{form}: {name}");
            }
        }
    }
}

/// Names say nothing here: as in the kind `preview`, the mesh shows the texture of whichever material has
/// one.
#[test]
fn a_mesh_whose_materials_are_not_there_shows_any_texture() {
    let (_, data) = read(&dressed("", ["crimson", "navy"], 4));
    let meshes = data["meshes"].as_array().unwrap();
    let textures: Vec<Vec<String>> = meshes
        .iter()
        .map(|mesh| {
            assert_eq!(mesh["parts"].as_array().unwrap().len(), 1);
            mesh["parts"][0]["coordinates"].as_object().unwrap().keys().cloned().collect()
        })
        .collect();
    // Our own meshes show none.
    assert_eq!(textures, [vec![place(&data, "crimson").to_string()], Vec::new(), Vec::new()]);
}

#[test]
fn textures_leave_room_for_forms() {
    let case = dressed("size-limit = 0.6", ["red", "squares-a-blue"], 512);
    let (text, data) = read(&case);
    assert!(text.len() < 600_000, "{}", text.len());
    let left = data["left_out"].as_array().unwrap();
    assert!(left.iter().any(|line| line == "textures in more than 256 texels along a side"), "{left:?}");
    assert!(!pair(&data, "red")["views"].as_array().unwrap().is_empty());
}
