//! The materials of glTF files.

use std::path::Path;

use brdf::{BaseColorTexture, StandardParameters, TexturePlacement, Wrap};
use containers::{
    Error, ErrorKind, GltfMaterial, MaterialChoice, gltf_materials, read_gltf_material, write_png,
};

use super::*;

fn material(bytes: &[u8], choice: Option<&MaterialChoice>) -> Result<GltfMaterial, Error> {
    read_gltf_material(bytes, choice, &mut |path| panic!("{path} was asked for"))
}

fn named(name: &str) -> MaterialChoice {
    MaterialChoice::Name(name.into())
}

/// A document with these materials and no binary chunk, as text.
fn file(materials: Value) -> Vec<u8> {
    json!({ "asset": { "version": "2.0" }, "materials": materials }).to_string().into_bytes()
}

fn parameters(materials: Value) -> StandardParameters {
    material(&file(materials), None).unwrap().material.parameters()
}

fn error(document: &Value, binary: &[u8]) -> String {
    material(&glb(document, binary), None).unwrap_err().to_string()
}

/// Four textures in each of the ways in which a file may hold them, and a material that uses each.
///
/// The picture has two texels, of the stored values 0 and 1, 0.2 and 0.6, 0.4 and 0.
fn painted() -> (Value, Vec<u8>) {
    let png = write_png(2, 1, &[[0, 51, 102], [255, 153, 0]], None).unwrap();
    let uri = format!("data:image/png;base64,{}", STANDARD.encode(&png));
    let mut binary = vec![7; 5];
    binary.extend(&png);
    let document = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": binary.len() }, { "uri": format!("data:;base64,{}", STANDARD.encode(&png)), "byteLength": png.len() }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 5, "byteLength": png.len() },
            { "buffer": 1, "byteLength": png.len() },
        ],
        "images": [
            { "bufferView": 0, "mimeType": "image/png", "name": "first" },
            { "uri": uri },
            { "bufferView": 1, "mimeType": "image/png" },
            { "uri": "a%20b.png" },
        ],
        "textures": [{ "source": 0 }, { "source": 1 }, { "extensions": { "EXT_texture_webp": { "source": 2 } } }, { "source": 3 }],
        "materials": [{
            "name": "Painted",
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } },
                "baseColorFactor": [1.0, 0.5, 0.25, 0.1],
                "metallicRoughnessTexture": { "index": 1 },
                "metallicFactor": 0.5,
                "roughnessFactor": 0.9,
            },
            "extensions": {
                "KHR_materials_clearcoat": {
                    "clearcoatFactor": 0.8,
                    "clearcoatTexture": { "index": 2 },
                    "clearcoatRoughnessFactor": 0.5,
                    "clearcoatRoughnessTexture": { "index": 3 },
                },
            },
        }],
    });
    (document, binary)
}

fn linear(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn textures_become_their_mean_times_their_factor() {
    let (document, binary) = painted();
    let png = Arc::new(write_png(1, 1, &[[0, 128, 0]], None).unwrap());
    let mut asked = Vec::new();
    let found = read_gltf_material::<Error>(&glb(&document, &binary), None, &mut |path| {
        asked.push(path.to_owned());
        Ok(Arc::clone(&png))
    })
    .unwrap();
    assert_eq!(asked, ["a b.png"]);
    let parameters = found.material.parameters();
    let expected = StandardParameters {
        base_color: [0.5, (linear(0.2) + linear(0.6)) / 4.0, linear(0.4) / 8.0],
        metallic: 0.2 * 0.5,
        roughness: 0.4 * 0.9,
        clearcoat: 0.5 * 0.8,
        clearcoat_roughness: 0.5 * 128.0 / 255.0,
        ..parameters
    };
    let numbers = |p: StandardParameters| {
        [
            p.base_color[0],
            p.base_color[1],
            p.base_color[2],
            p.metallic,
            p.roughness,
            p.clearcoat,
            p.clearcoat_roughness,
        ]
    };
    for (found, expected) in numbers(parameters).into_iter().zip(numbers(expected)) {
        assert!((found - expected).abs() < 1e-14, "{parameters:?}");
    }
    assert_eq!(
        found.notes,
        [
            "base_color: averaged over 2 x 1 texels of first",
            "metallic and roughness: averaged over 2 x 1 texels of images[1]",
            "clearcoat: averaged over 2 x 1 texels of images[2]",
            "clearcoat_roughness: averaged over 1 x 1 texels of a b.png",
        ]
    );
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let placement = TexturePlacement {
        factor: [1.0, 0.5, 0.25],
        transform: [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
        ..TexturePlacement::default()
    };
    let expected = BaseColorTexture::new([2, 1], vec![[0, 51, 102], [255, 153, 0]], placement);
    assert_eq!(found.base_color, expected);
}

/// Its sampler, its transform, of which a quarter turn takes (u, v) to (v, -u), and its set of coordinates,
/// which must be that of the normal texture, because a mesh keeps those.
#[test]
fn the_texture_of_the_base_colour_is_placed_as_its_reference_says() {
    let (mut document, binary) = painted();
    let turned = json!({ "offset": [0.25, -1.0], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1 });
    document["textures"][0]["sampler"] = 0.into();
    document["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]);
    document["images"][3] = document["images"][1].clone();
    let material = &mut document["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"] =
        json!({ "index": 0, "extensions": { "KHR_texture_transform": turned } });
    let other_set = self::material(&glb(&document, &binary), None).unwrap();
    assert_eq!(other_set.base_color, None);
    assert_eq!(
        other_set.notes[1],
        "base_color: previews show its mean, because its texture has the coordinates 1, and a mesh those of its normal texture, 0"
    );
    document["materials"][0]["normalTexture"] = json!({ "index": 3, "texCoord": 1 });
    let found = self::material(&glb(&document, &binary), None).unwrap();
    assert_eq!((&found.material, found.notes.len()), (&other_set.material, other_set.notes.len() - 1));
    let texture = found.base_color.unwrap();
    let placement = texture.placement();
    assert_eq!((placement.wrap, placement.is_nearest), ([Wrap::Clamp, Wrap::Mirror], true));
    for (at, expected) in [([0.0, 0.0], [0.25, -1.0]), ([1.0, 0.0], [0.25, -3.0]), ([0.0, 1.0], [3.25, -1.0])]
    {
        let found = placement.coordinates(at);
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-6), "{at:?} {found:?}");
    }
    // A picture that ends early is an error, not a texture.
    document["images"][0] = document["images"][3].clone();
    let uri = document["images"][0]["uri"].as_str().unwrap();
    document["images"][0]["uri"] = uri[..uri.len() - 24].into();
    let truncated = error(&document, &binary);
    assert!(truncated.contains("baseColorTexture"), "{truncated}");
}

/// glTF's defaults: a rough white metal, and under an extension those of the extension.
#[test]
fn what_a_file_leaves_out_is_gltfs_default() {
    let expected = StandardParameters {
        metallic: 1.0,
        roughness: 1.0,
        sheen_roughness: 0.1,
        ..StandardParameters::default()
    };
    assert_eq!(parameters(json!([{}])), expected);
    let extensions =
        ["ior", "specular", "clearcoat", "sheen"].map(|name| (format!("KHR_materials_{name}"), json!({})));
    let extensions: serde_json::Map<String, Value> = extensions.into_iter().collect();
    assert_eq!(parameters(json!([{ "extensions": extensions }])), expected);
}

#[test]
fn factors_of_extensions_are_read() {
    let found = parameters(json!([{
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.25 },
        "extensions": {
            "KHR_materials_ior": { "ior": 1.8 },
            "KHR_materials_specular": { "specularFactor": 0.7, "specularColorFactor": [2.0, 1.0, 0.5] },
            "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.6 },
        },
    }]));
    let expected = StandardParameters {
        roughness: 0.25,
        ior: 1.8,
        specular: 0.7,
        specular_color: [2.0, 1.0, 0.5],
        sheen: [0.1, 0.2, 0.3],
        sheen_roughness: 0.6,
        ..StandardParameters::default()
    };
    assert_eq!(found, expected);
}

/// KHR_materials_ior: an index of 0 makes the reflectance at normal incidence 1, times the colour.
#[test]
fn an_index_of_refraction_of_0_is_an_infinite_one() {
    let found = parameters(json!([{ "extensions": {
        "KHR_materials_ior": { "ior": 0 },
        "KHR_materials_specular": { "specularColorFactor": [1.0, 0.5, 0.04] },
    } }]));
    let smooth = ((found.ior - 1.0) / (found.ior + 1.0)).powi(2);
    for (colour, expected) in found.specular_color.into_iter().zip([1.0, 0.5, 0.04]) {
        assert!((smooth * colour - expected).abs() < 1e-15, "{found:?}");
    }
}

#[test]
fn what_the_model_lacks_is_noted_or_warned_of() {
    let found = material(
        &file(json!([{
            "pbrMetallicRoughness": { "roughnessFactor": 0.001 },
            "normalTexture": { "index": 99 },
            "alphaMode": "BLEND",
            "emissiveFactor": [0, 0.5, 0],
            "extensions": {
                "KHR_materials_clearcoat": { "clearcoatFactor": 1 },
                "KHR_materials_sheen": {},
                "KHR_materials_transmission": { "transmissionFactor": 1 },
                "KHR_materials_unlit": {},
            },
        }])),
        None,
    )
    .unwrap();
    assert_eq!(
        found.notes,
        [
            "roughness: 0.001 is taken as 0.01, the least here",
            "clearcoat_roughness: 0.000 is taken as 0.01, the least here"
        ]
    );
    assert_eq!(
        found.warnings,
        [
            "KHR_materials_transmission, KHR_materials_unlit of the material is not read",
            "the alphaMode BLEND of the material is not read: the material is opaque",
            "the light that the material emits is not read"
        ]
    );
}

#[test]
fn one_of_several_materials_is_chosen_by_name_or_number() {
    let several = file(json!([
        { "name": "matt", "pbrMetallicRoughness": { "roughnessFactor": 0.9 } },
        { "pbrMetallicRoughness": { "roughnessFactor": 0.8 } },
        { "name": "twice", "pbrMetallicRoughness": { "roughnessFactor": 0.7 } },
        { "name": "twice", "pbrMetallicRoughness": { "roughnessFactor": 0.6 } },
    ]));
    assert_eq!(gltf_materials(&several).unwrap(), ["matt", "1", "twice", "twice"]);
    for (choice, expected) in [
        (named("matt"), 0.9),
        (named("1"), 0.8),
        (MaterialChoice::Index(1), 0.8),
        (MaterialChoice::Index(3), 0.6),
    ] {
        assert_eq!(material(&several, Some(&choice)).unwrap().material.parameters().roughness, expected);
    }
    let list = "0: matt, 1 (without a name), 2: twice, 3: twice";
    for (choice, expected) in [
        (None, format!("the file has 4 materials; expected `material` to be one of: {list}")),
        (Some(named("mat")), format!("there is no material \"mat\"; expected one of: {list}")),
        (Some(MaterialChoice::Index(4)), format!("there is no material 4; expected 0 to 3 of: {list}")),
        (
            Some(named("twice")),
            "the materials 2 and 3 are both named \"twice\"; name one by its number: material = 2".into(),
        ),
    ] {
        let error = material(&several, choice.as_ref()).unwrap_err();
        assert_eq!((error.kind(), error.to_string()), (ErrorKind::NoSuchMaterial, expected));
    }
    let none = material(&file(json!([])), None).unwrap_err();
    assert_eq!(
        (none.kind(), none.to_string()),
        (ErrorKind::NoSuchMaterial, "the file has no materials".into())
    );
    // A mesh without a name for its material, and many materials.
    let many = file((0..30).map(|k| json!({ "name": format!("m{k}") })).collect());
    assert!(material(&many, None).unwrap_err().to_string().ends_with("19: m19 and 10 more"));
}

#[test]
fn mistakes_are_reported_with_their_place() {
    for (mistaken, expected) in [
        (json!([3]), "materials[0]: 3 is not an object"),
        (json!([{ "name": 3 }]), "materials[0].name: 3 is not a string"),
        (
            json!([{ "pbrMetallicRoughness": { "metallicFactor": 1.5 } }]),
            "materials[0].pbrMetallicRoughness.metallicFactor: 1.5 is not a number from 0 to 1",
        ),
        (
            json!([{ "pbrMetallicRoughness": { "roughnessFactor": "rough" } }]),
            "materials[0].pbrMetallicRoughness.roughnessFactor: \"rough\" is not a number from 0 to 1",
        ),
        (
            json!([{ "pbrMetallicRoughness": { "baseColorFactor": [1, 2, 1, 1] } }]),
            "materials[0].pbrMetallicRoughness.baseColorFactor: this array is not a colour, each channel a number from 0 to 1",
        ),
        (
            json!([{ "extensions": { "KHR_materials_ior": { "ior": 0.5 } } }]),
            "materials[0]: ior: 0.5 is not a number from 1 to 10",
        ),
        (
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": {} } }]),
            "materials[0].pbrMetallicRoughness.baseColorTexture.index is missing",
        ),
        (
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": -1 } } }]),
            "materials[0].pbrMetallicRoughness.baseColorTexture.index: -1 is not a whole number from 0 on",
        ),
        (
            json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 7 } } }]),
            "textures: there is no element 7",
        ),
    ] {
        assert_eq!(material(&file(mistaken), None).unwrap_err().to_string(), expected);
    }
    let version = json!({ "asset": { "version": "1.0" }, "materials": [{}] });
    assert_eq!(error(&version, &[]), "the file is of glTF 1.0; 2.0 is read");
    assert_eq!(error(&json!({}), &[]), "asset.version is missing; expected \"2.0\"");
}

#[test]
fn textures_that_cannot_be_read_are_errors_that_name_them() {
    let at = "materials[0].pbrMetallicRoughness.baseColorTexture";
    let with = |change: &dyn Fn(&mut Value)| {
        let (mut document, binary) = painted();
        change(&mut document);
        error(&document, &binary)
    };
    let webp = "textures[0]: KHR_texture_basisu is not read; expected PNG, JPEG or WebP";
    let found = with(&|document| {
        document["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } });
    });
    assert_eq!(found, webp);
    assert_eq!(
        with(&|document| document["textures"][0] = json!({})),
        "textures[0]: there is no source; expected PNG, JPEG or WebP"
    );
    assert_eq!(
        with(&|document| document["images"][0] = json!({})),
        "images[0]: expected a uri or a bufferView"
    );
    assert_eq!(
        with(&|document| document["bufferViews"][0]["byteLength"] = json!(9999)),
        "bufferViews[0]: 9999 bytes from byte 5 on are more than the 96 of buffer 0"
    );
    let found = with(&|document| document["bufferViews"][0]["byteOffset"] = json!(6));
    assert!(found.starts_with(&format!("{at}: first: ")), "{found}");
    let found = with(&|document| document["images"][0] = json!({ "uri": "/up.png" }));
    assert!(found.starts_with("images[0]: the uri \"/up.png\" does not name a file beside"), "{found}");
    let found = with(&|document| document["images"][0] = json!({ "uri": "data:;base64,!" }));
    assert!(found.starts_with("images[0]: the embedded data are not base64"), "{found}");
}

/// An extension that the file requires concerns a material that has it, and any material if it is unknown.
#[test]
fn extensions_that_a_material_requires_are_read_or_refused() {
    let gloss = "KHR_materials_pbrSpecularGlossiness";
    let with = |required: &[&str], extensions: Value| {
        json!({
            "asset": { "version": "2.0" },
            "extensionsRequired": required,
            "materials": [{ "extensions": extensions }],
        })
    };
    let read = |document: &Value| material(document.to_string().as_bytes(), None);
    for (required, extensions, message) in [
        (
            &[gloss][..],
            json!({ gloss: {} }),
            "the file requires KHR_materials_pbrSpecularGlossiness, which is not read here; convert its materials to metallic and roughness, for example with `gltf-transform metalrough`",
        ),
        (
            &["KHR_materials_ior", "VENDOR_glow", "VENDOR_hair"],
            json!({}),
            "the file requires VENDOR_glow, VENDOR_hair, which is not read here; export it without",
        ),
    ] {
        let document = with(required, extensions);
        let error = read(&document).unwrap_err();
        assert_eq!((error.kind(), error.to_string().as_str()), (ErrorKind::Unsupported, message));
        let find = &mut |_: &str| Ok(());
        let mut text = std::io::Cursor::new(document.to_string());
        assert_eq!(containers::check_gltf_material::<Error>(&mut text, None, find), Err(error));
    }
    for (required, extensions) in [
        (&[gloss][..], json!({})),
        (&["KHR_materials_ior"], json!({ "KHR_materials_ior": { "ior": 1.3 } })),
        (&["KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"], json!({})),
        (&["KHR_texture_transform", "KHR_texture_basisu", "EXT_lights_image_based"], json!({})),
    ] {
        assert!(read(&with(required, extensions)).is_ok(), "{required:?}");
    }
    // What is only used is warned of.
    let mut used = with(&[], json!({ gloss: {} }));
    used["extensionsUsed"] = json!([gloss]);
    assert_eq!(read(&used).unwrap().warnings, [format!("{gloss} of the material is not read")]);
}

#[test]
fn what_changes_a_texture_on_the_mesh_is_warned_of() {
    let (mut document, binary) = painted();
    document["images"][3] = document["images"][1].clone();
    let texture = &mut document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    texture["extensions"]["KHR_texture_transform"] = json!({ "scale": [0.5, 1.0], "offset": [0.5, 0.0] });
    document["meshes"] = json!([{ "primitives": [
        { "material": 0, "attributes": { "COLOR_0": 0 } },
        { "material": 1, "attributes": { "COLOR_0": 0 } },
        { "material": 0, "attributes": { "POSITION": 0 } },
    ] }]);
    let found = material(&glb(&document, &binary), None).unwrap();
    assert_eq!(
        found.warnings,
        [
            "base_color: KHR_texture_transform scales the coordinates by 0.5 and 1, so that a mesh may show a part of first only; the mean is that of all its texels: cut the texture to that part if it differs",
            "the vertex colours (COLOR_0) of 1 primitive, which glTF multiplies the base colour by, are not read"
        ]
    );
    document["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(material(&glb(&document, &binary), None).unwrap().warnings.len(), 1);
}

/// Whatever is cut off or replaced, reading ends with a material or an error.
#[test]
fn damaged_files_are_errors_or_materials() {
    let (mut document, binary) = painted();
    document["images"][3] = document["images"][1].clone();
    let bytes = glb(&document, &binary);
    assert!(material(&bytes, None).is_ok());
    for length in 0..bytes.len() {
        assert!(material(&bytes[..length], None).is_err(), "{length}");
    }
    for at in (0..bytes.len()).step_by(3) {
        for flip in [0x08, 0x80] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            let read = read_gltf_material::<Error>(&changed, None, &mut |_| Ok(Arc::new(vec![1, 2, 3])));
            if let Ok(found) = read {
                assert!(found.material.parameters().roughness >= 0.01);
            }
        }
    }
}

/// Real files. The means were computed from the same pictures by another program.
#[test]
fn materials_of_the_corpus_are_read() {
    let Some(corpus) = test_data::folder("materials_of_the_corpus_are_read", "SPECULA_CORPUS") else {
        return;
    };
    let open = |path: &str, choice: Option<&MaterialChoice>| {
        let path = corpus.join("mesh").join(path);
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut beside = |name: &str| Ok(Arc::new(std::fs::read(folder.join(name)).unwrap()));
        read_gltf_material::<Error>(&std::fs::read(&path).unwrap(), choice, &mut beside).unwrap()
    };
    let helmet = "FlightHelmet/FlightHelmet.gltf";
    let names = gltf_materials(&std::fs::read(corpus.join("mesh").join(helmet)).unwrap()).unwrap();
    assert_eq!(
        names,
        ["HoseMat", "RubberWoodMat", "GlassPlasticMat", "MetalPartsMat", "LeatherPartsMat", "LensesMat"]
    );
    for name in &names {
        let found = open(helmet, Some(&named(name)));
        assert_eq!(found.notes.len(), 2, "{:?}", found.notes);
        // The lenses are transparent.
        assert_eq!(found.warnings.len(), usize::from(name == "LensesMat"), "{:?}", found.warnings);
    }
    let metal = open(helmet, Some(&named("MetalPartsMat")));
    let found = metal.material.parameters();
    let [red, green, blue] = found.base_color;
    for (found, expected) in [red, green, blue, found.metallic, found.roughness]
        .into_iter()
        .zip([0.3987859, 0.3564607, 0.3232780, 0.6674335, 0.5329367])
    {
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
    let file = "FlightHelmet_Materials_MetalPartsMat_BaseColor.png";
    assert_eq!(metal.notes[0], format!("base_color: averaged over 512 x 512 texels of {file}"));
    let cloth = open("SheenCloth.glb", None);
    assert_eq!((cloth.notes.len(), cloth.warnings.len()), (4, 0), "{cloth:?}");
    let cloth = cloth.material.parameters();
    assert!(cloth.metallic == 0.0 && cloth.sheen[2] > 0.25 && (0.43..0.45).contains(&cloth.sheen_roughness));
    let plain = open("suzi.glb", None).material.parameters();
    assert_eq!((plain.base_color, plain.metallic, plain.roughness), ([1.0; 3], 1.0, 1.0));
}
