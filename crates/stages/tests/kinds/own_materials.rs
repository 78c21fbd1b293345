//! Meshes in the materials of their own glTF files, as a preview shows them.

use std::fs;
use std::sync::Arc;

use brdf::Material;
use engine::Plan;
use preview::{Mode, Scene};
use serde_json::json;
use stages::{PreviewCatalog, SceneCache};

use crate::preview_catalog::{REFLECTION, build, build_only, load, project};

const MESHES: &str = "[stage.mesh]\nkind = \"import-mesh\"\nsource = \"mesh/*.gltf\"\n\
                      [stage.brushed]\nkind = \"brush-mesh\"\ninput = \"mesh\"\nturn = 90.0\n";

/// The project of `preview_catalog` with a glTF file of two triangles: one red, one of a material without a
/// name. No triangle has its third material.
fn dressed() -> (tempfile::TempDir, Plan) {
    let (folder, _) = project(REFLECTION);
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0_f32]];
    let mut bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 2, 1, 3_u16].into_iter().flat_map(u16::to_le_bytes));
    let primitive = |indices: usize, material: usize| json!({ "attributes": { "POSITION": 0 }, "indices": indices, "material": material });
    let indices = |start: usize| {
        let start = 6 * start;
        json!({ "bufferView": 1, "byteOffset": start, "componentType": 5123, "count": 3, "type": "SCALAR" })
    };
    let colour =
        |rgba: [f64; 4]| json!({ "baseColorFactor": rgba, "roughnessFactor": 1, "metallicFactor": 0 });
    let document = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "uri": "two.bin", "byteLength": bytes.len() }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 12 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [0, 0, 0], "max": [1, 1, 0] },
            indices(0), indices(1),
        ],
        "materials": [
            { "name": "red", "pbrMetallicRoughness": colour([0.75, 0.125, 0.0625, 1.0]) },
            { "pbrMetallicRoughness": colour([0.1, 0.2, 0.8, 1.0]) },
            { "name": "unused", "pbrMetallicRoughness": colour([1.0; 4]) },
        ],
        "meshes": [{ "primitives": [primitive(1, 1), primitive(2, 0)] }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
    });
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    write("mesh/two.bin", &bytes);
    write("mesh/two.gltf", document.to_string().as_bytes());
    for (name, material) in [("red", "\"red\""), ("blue", "1"), ("unused", "\"unused\"")] {
        let text = format!("model = \"gltf\"\nfile = \"../mesh/two.gltf\"\nmaterial = {material}\n");
        write(&format!("paint/{name}.toml"), text.as_bytes());
    }
    let manifest = fs::read_to_string(folder.path().join("pipeline.toml")).unwrap();
    write("pipeline.toml", format!("{manifest}{MESHES}").as_bytes());
    let plan = load(folder.path());
    (folder, plan)
}

/// The base colour of each object's material; `None` for one of another model.
fn colours(scene: &Scene) -> Vec<Option<[f64; 3]>> {
    let colour = |material: &Material| match material {
        Material::Standard(standard) => Some(standard.parameters().base_color),
        _ => None,
    };
    scene.objects.iter().map(|object| object.look.material().and_then(colour)).collect()
}

#[test]
fn a_mesh_is_shown_in_its_own_materials() {
    let (_folder, plan) = dressed();
    let catalog = PreviewCatalog::of(plan.clone());
    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let mut show = |material: &str, mesh: &str| {
        let entry = catalog.entry("east", material).unwrap().unwrap();
        scenes.scene(&catalog, &results, entry, mesh).unwrap()
    };
    let (red, blue) = ([0.75, 0.125, 0.0625], [0.1, 0.2, 0.8]);
    for mesh in ["two (mesh)", "two (brushed)"] {
        let scene = show("red", mesh);
        assert_eq!(colours(&scene), [Some(red), Some(blue)], "the chosen material comes first");
        let [first, second] = &scene.objects[..] else { panic!("two objects") };
        let whole = first.whole.as_ref().unwrap();
        assert!(Arc::ptr_eq(whole, second.whole.as_ref().unwrap()) && whole.triangles().len() == 2);
        assert_eq!([first, second].map(|object| object.mesh.triangles().len()), [1, 1]);
        // The first primitive is blue.
        assert_eq!(second.mesh.positions()[0], whole.positions()[whole.triangles()[0][0] as usize]);
        assert!(Arc::ptr_eq(first.look.light(), second.look.light()) && scene.offers(Mode::LocalShrm));
        let again = show("red", mesh);
        for (one, other) in scene.objects.iter().zip(&again.objects) {
            assert!(Arc::ptr_eq(&one.mesh, &other.mesh) && Arc::ptr_eq(&one.look, &other.look));
        }
        assert_eq!(colours(&show("blue", mesh)), [Some(blue), Some(red)]);
        // What is none of its own covers all of it, also a material that no triangle has.
        assert_eq!(colours(&show("gold", mesh)), [None]);
        let all = show("unused", mesh);
        assert_eq!(colours(&all), [Some([1.0; 3])]);
        assert!(all.objects[0].whole.is_none() && all.objects[0].mesh.triangles().len() == 2);
    }
    assert_eq!(colours(&show("red", "sphere")), [Some(red)]);
}

#[test]
fn a_mesh_needs_what_its_own_materials_need() {
    let (folder, plan) = dressed();
    let catalog = PreviewCatalog::of(plan.clone());
    let entry = |material: &str| catalog.entry("east", material).unwrap().unwrap();
    let (red, blue) = (entry("red"), entry("blue"));
    for needed in [catalog.parts(red, "two (mesh)"), catalog.items(red, "two (mesh)")] {
        assert!(needed.contains(&blue.material.unwrap()) && needed.contains(&blue.reflection.unwrap()));
        assert!(!needed.contains(&entry("gold").material.unwrap()));
    }
    assert!(!catalog.parts(red, "sphere").contains(&blue.material.unwrap()));

    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let scene = scenes.scene(&catalog, &results, red, "two (mesh)").unwrap();
    assert_eq!((scene.has_maps(), scene.objects.len()), (true, 2));
    // An edited material, without its maps, beside the others.
    let edited = Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap());
    let scene = SceneCache::default().edited(&catalog, &results, red, "two (mesh)", &edited).unwrap();
    assert_eq!(colours(&scene), [None, Some([0.1, 0.2, 0.8])]);
    assert!(!scene.objects[0].look.has_maps() && scene.objects[1].look.has_maps());

    // A file of the same name with another material is none of the mesh's own.
    fs::write(folder.path().join("paint/blue.toml"), "model = \"lambert\"\nalbedo = 0.5\n").unwrap();
    let plan = load(folder.path());
    let results = build_only(&plan, &["reflection", "mesh"]);
    let catalog = PreviewCatalog::of(plan);
    let red = catalog.entry("east", "red").unwrap().unwrap();
    let scene = scenes.scene(&catalog, &results, red, "two (mesh)").unwrap();
    assert_eq!(colours(&scene), [Some([0.75, 0.125, 0.0625])], "no other material is its own");
}

/// The project of [`dressed`] with coordinates, and a texture of the red material.
fn textured() -> (tempfile::TempDir, Plan) {
    let (folder, _) = dressed();
    let path = |name: &str| folder.path().join(name);
    let mut bytes = fs::read(path("mesh/two.bin")).unwrap();
    bytes.extend([0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0_f32].into_iter().flat_map(f32::to_le_bytes));
    let text = fs::read_to_string(path("mesh/two.gltf")).unwrap();
    let mut document: serde_json::Value = serde_json::from_str(&text).unwrap();
    document["buffers"][0]["byteLength"] = bytes.len().into();
    let push = |list: &mut serde_json::Value, value| list.as_array_mut().unwrap().push(value);
    push(&mut document["bufferViews"], json!({ "buffer": 0, "byteOffset": 60, "byteLength": 32 }));
    let coordinates = json!({ "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" });
    push(&mut document["accessors"], coordinates);
    for primitive in document["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive["attributes"]["TEXCOORD_0"] = 3.into();
    }
    document["images"] = json!([{ "uri": "checker.png" }]);
    document["textures"] = json!([{ "source": 0 }]);
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let checker = containers::write_png(2, 1, &[[255; 3], [0; 3]], None).unwrap();
    fs::write(path("mesh/checker.png"), checker).unwrap();
    fs::write(path("mesh/two.bin"), bytes).unwrap();
    fs::write(path("mesh/two.gltf"), document.to_string()).unwrap();
    let plan = load(folder.path());
    (folder, plan)
}

/// A texture is that of the material on its own triangles: no other triangle and no other mesh has it.
#[test]
fn a_mesh_has_the_textures_of_its_own_materials() {
    let sizes = |scene: &Scene| -> Vec<Option<[usize; 2]>> {
        let size = |object: &preview::Object| object.look.base_color().map(|texture| texture.size());
        scene.objects.iter().map(size).collect()
    };
    let (folder, plan) = textured();
    let (catalog, results) = (PreviewCatalog::of(plan.clone()), build(&plan));
    let mut scenes = SceneCache::default();
    let mut show = |material: &str, mesh: &str| {
        let entry = catalog.entry("east", material).unwrap().unwrap();
        scenes.scene(&catalog, &results, entry, mesh).unwrap()
    };
    let red = [0.375, 0.0625, 0.03125];
    for mesh in ["two (mesh)", "two (brushed)"] {
        let scene = show("red", mesh);
        assert_eq!((colours(&scene)[0], sizes(&scene)), (Some(red), vec![Some([2, 1]), None]));
        assert_eq!(sizes(&show("blue", mesh)), [None, Some([2, 1])]);
        assert_eq!(sizes(&show("gold", mesh)), [None]);
    }
    let ball = show("red", "sphere");
    assert_eq!((colours(&ball), sizes(&ball)), (vec![Some(red)], vec![None]));
    let edited = Material::Lambert(brdf::Lambert::new([0.5; 3]).unwrap());
    let entry = catalog.entry("east", "red").unwrap().unwrap();
    let scene = SceneCache::default().edited(&catalog, &results, entry, "two (mesh)", &edited).unwrap();
    assert_eq!(sizes(&scene), [None, None]);

    // Without the blue material, the red one stands for it, and its texture does not.
    fs::remove_file(folder.path().join("paint/blue.toml")).unwrap();
    let plan = load(folder.path());
    let results = build_only(&plan, &["reflection", "mesh"]);
    let catalog = PreviewCatalog::of(plan);
    let entry = catalog.entry("east", "red").unwrap().unwrap();
    let scene = SceneCache::default().scene(&catalog, &results, entry, "two (mesh)").unwrap();
    assert_eq!((colours(&scene), sizes(&scene)), (vec![Some(red); 2], vec![Some([2, 1]), None]));
    assert!(scene.objects.iter().all(|object| object.mesh.triangles().len() == 1));
}
