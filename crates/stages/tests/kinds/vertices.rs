//! `brush-mesh`, `precompute-transfer` and `shade-vertices`.

use sh::{Degree, Stop};
use stages::artifacts::{BrdfTable, Lighting, Material, Mesh, Transfer, VertexBlend, VertexRadiance};
use transfer::{
    Directions, Frames, Occluders, ReflectingMesh, TransferDegrees, Viewer, interreflect, precompute,
    shade_with_transfer,
};

use crate::fixture::{Case, case, lambert, phong, sky_lighting};

/// A floor at z = 0 and a wall at x = 1 that faces it, with coordinates.
pub(crate) fn pit() -> Mesh {
    let floor = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.5, 0.0, 0.0]];
    let wall = [[1.0, -4.0, -0.5], [1.0, 4.0, -0.5], [1.0, 4.0, 4.0], [1.0, -4.0, 4.0]];
    let normals = [vec![[0.0, 0.0, 1.0]; 5], vec![[-1.0, 0.0, 0.0]; 4]].concat();
    let tangents = [vec![[1.0, 0.0, 0.0, 1.0]; 5], vec![[0.0, 1.0, 0.0, -1.0]; 4]].concat();
    let triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [5, 7, 6], [5, 8, 7]];
    let positions = floor.into_iter().chain(wall).collect();
    Mesh(mesh::Mesh::new(positions, normals, tangents, Some(vec![[0.0; 2]; 9]), triangles).unwrap())
}

pub(crate) fn table(material: brdf::Material) -> BrdfTable {
    let table = case("tabulate-brdf", "resolution = 16").input("material", Material(material));
    (*table.artifact::<BrdfTable>()).clone()
}

fn baked(parameters: &str) -> Case {
    case("precompute-transfer", parameters).input("mesh", pit())
}

/// The pit with its coordinates at the four corners of a picture and at its centre.
pub(crate) fn pit_with_coordinates() -> Mesh {
    let Mesh(pit) = pit();
    let corners = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75], [0.5, 0.5]];
    let coordinates = (0..9).map(|vertex| corners[vertex % 5]).collect();
    let mesh = mesh::Mesh::new(
        pit.positions().to_vec(),
        pit.normals().to_vec(),
        pit.tangents().to_vec(),
        Some(coordinates),
        pit.triangles().to_vec(),
    );
    Mesh(mesh.unwrap())
}

/// A picture of 2 x 2 texels that holds 0, 1, 0.2 and 0.6 in red, and 1 less that in green.
pub(crate) fn picture() -> Vec<u8> {
    let texels = [0u8, 255, 51, 153].map(|red| [red, 255 - red, 0]);
    containers::write_png(2, 2, &texels, None).unwrap()
}

/// The blend of the pit by the picture.
pub(crate) fn blend(parameters: &str) -> Case {
    case("vertex-blend", &format!("texture = \"noise.png\"\n{parameters}"))
        .file("noise.png", picture())
        .input("mesh", pit_with_coordinates())
}

/// The pit under a soft sky, with its shadows or without.
pub(crate) fn shaded(shadows: bool) -> Case {
    let case = case("shade-vertices", "camera = [-3, 1, 2]")
        .input("mesh", pit())
        .input("table", table(lambert(0.8)))
        .input("lighting", sky_lighting());
    if !shadows {
        return case;
    }
    case.input("transfer", (*baked("directions = 512").artifact::<Transfer>()).clone())
}

pub(crate) fn radiance(case: &Case) -> Vec<[f32; 3]> {
    case.artifact::<VertexRadiance>().0.value.clone()
}

#[test]
fn a_wall_shadows_the_floor_before_it() {
    let ran = baked("directions = 512").run().unwrap();
    let transfer = ran.artifact::<Transfer>();
    assert_eq!((transfer.0.value.len(), transfer.0.value.form().output().unwrap().get()), (9, 4));
    assert_eq!(ran.notes, ["9 vertices with 25 x 25 entries: 11.2 kB"]);
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    let (open, shadowed) = (radiance(&shaded(false)), radiance(&shaded(true)));
    assert_eq!((open.len(), shadowed.len()), (9, 9));
    // The vertex half way to the wall loses up to a half of the light, the far ones less.
    assert!((0.5..0.8).contains(&(shadowed[4][1] / open[4][1])), "{:?} {:?}", open[4], shadowed[4]);
    assert!((0.7..0.95).contains(&(shadowed[0][1] / open[0][1])), "{:?} {:?}", open[0], shadowed[0]);
    // Nothing is before the wall's upper corner but the floor, far below.
    assert!((0.9..1.01).contains(&(shadowed[7][1] / open[7][1])), "{:?} {:?}", open[7], shadowed[7]);
}

#[test]
fn a_matte_floor_has_the_irradiance_of_the_sky() {
    // The sky is 1 + 0.5 z and more: the floor's irradiance is pi (1 + 0.5 2 / 3), times 0.8 / pi.
    let green = radiance(&shaded(false))[0][1];
    assert!((green - 0.8 * (1.0 + 0.5 * 2.0 / 3.0)).abs() < 1e-4, "{green}");
    let ran = shaded(false).run().unwrap();
    assert_eq!(ran.notes, ["the light ends at degree 2, the table at 4"]);
}

/// A lamp over a sphere rings below zero on the other side. The window that is named leaves nothing below
/// zero, and one that is a twentieth weaker does.
#[test]
fn the_weakest_window_leaves_no_vertex_below_zero() {
    let degree = Degree::new(4).unwrap();
    let lamp =
        sh::Light { direction: sphere::Direction::Z, radius: 0.1, irradiance: [1.0; 3] }.series(degree);
    let (mesh, table) = (mesh::shape("sphere").unwrap(), table(phong(20.0)));
    let with = |window: &str| {
        case("shade-vertices", &format!("view = [1, 0, 0]\nwindow = \"{window}\""))
            .input("mesh", Mesh(mesh.clone()))
            .input("table", table.clone())
            .input("lighting", Lighting(lamp.clone().into()))
            .run()
            .unwrap()
    };
    let below = |values: &[[f32; 3]]| values.iter().flatten().any(|value| *value < 0.0);
    let (plain, windowed) = (with("none"), with("non-negative"));
    assert!(below(&plain.artifact::<VertexRadiance>().0.value));
    assert!(!below(&windowed.artifact::<VertexRadiance>().0.value));
    let lambda = |text: &str| -> f64 {
        let after = text.split("lambda = ").nth(1).unwrap();
        after.split(' ').next().unwrap().parse().unwrap()
    };
    let offered = lambda(&plain.warnings[0]);
    assert!(plain.warnings[0].contains("or window = \"non-negative\", a window of"), "{:?}", plain.warnings);
    assert_eq!(lambda(windowed.notes.last().unwrap()), offered, "{:?}", windowed.notes);
    assert!(windowed.warnings.is_empty(), "{:?}", windowed.warnings);
    let frames = Frames::of(&mesh).unwrap();
    let viewer = Viewer::Distant(sphere::Direction::X);
    for (factor, expected) in [(0.95, true), (1.02, false)] {
        let window = sh::Window::Laplacian(sh::Penalty::new(factor * offered).unwrap());
        let value = transfer::shade(&frames, &table.0, viewer, &window.apply(&lamp));
        assert_eq!(below(&value), expected, "{factor} of {offered}");
    }
}

#[test]
fn degrees_and_rays_are_checked_before_the_first_one() {
    let wide = baked("degree = 2\noutput-degree = 4\ndirections = 256").artifact::<Transfer>();
    let form = wide.0.value.form();
    assert_eq!((form.output().unwrap().get(), form.input().get()), (4, 2));
    assert_eq!(
        baked("degree = 8\ndirections = 500").errors(),
        ["directions: degrees O and F need at least 578"]
    );
    let empty = case("precompute-transfer", "").input("mesh", Mesh(mesh::Mesh::joined(&[]).unwrap()));
    assert!(empty.artifact::<Transfer>().0.value.is_empty());
    // A triangle over the vertices of a box that is closed sees nothing.
    let sphere = mesh::shape("sphere").unwrap();
    let mut normals = sphere.normals().to_vec();
    normals[5000] = normals[5000].map(|axis| -axis);
    let (positions, tangents) = (sphere.positions().to_vec(), sphere.tangents().to_vec());
    let inside = mesh::Mesh::new(positions, normals, tangents, None, sphere.triangles().to_vec());
    let small = "degree = 0\ndirections = 64";
    let ran = case("precompute-transfer", small).input("mesh", Mesh(inside.unwrap())).run().unwrap();
    assert!(ran.warnings[0].starts_with("1 of 33153 vertices do not see the sky"), "{:?}", ran.warnings);
}

#[test]
fn a_transfer_of_another_mesh_is_an_error() {
    let brushed = case("brush-mesh", "turn = 30").input("mesh", pit()).artifact::<Mesh>();
    let other = case("shade-vertices", "")
        .input("mesh", (*brushed).clone())
        .input("table", table(lambert(0.8)))
        .input("lighting", sky_lighting())
        .input("transfer", (*baked("").artifact::<Transfer>()).clone());
    assert_eq!(other.failure(), "the transfer belongs to another mesh");
    assert_eq!(
        case("shade-vertices", "view = [1, 0, 0]\ncamera = [1, 0, 0]").errors(),
        ["camera: view already sets the viewer"]
    );
}

#[test]
fn brushing_turns_tangents_and_counts_where_it_cannot() {
    let ran = case("brush-mesh", "vector = [0, 0, 2]").input("mesh", pit()).run().unwrap();
    let mesh = ran.artifact::<Mesh>();
    assert_eq!(
        ran.warnings,
        ["5 of 9 vertices have a normal parallel to the vector and keep their own tangents"]
    );
    assert_eq!(mesh.0.tangents()[0], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(mesh.0.tangents()[6], [0.0, 0.0, 1.0, -1.0]);
    assert_eq!(case("brush-mesh", "vector = [0, 0, 0]").errors().len(), 1);
    // A brushed metal shows the direction; chalk does not.
    let metal = brdf::Material::Ward(brdf::Ward::new([0.15, 0.5], [1.0; 3]).unwrap());
    for (material, differs) in [(metal, true), (lambert(0.8), false)] {
        let shade = |mesh: Mesh| {
            let lamp = sh::Light::from_flux(sphere::Direction::from_angles(0.8, 0.3), 0.3, [3.0; 3]);
            let series = sh::Expansion::zero(Degree::new(4).unwrap());
            let lighting = Lighting(sh::Lighting { series, lights: vec![lamp] });
            let case = case("shade-vertices", "view = [-1, 0, 1]").input("mesh", mesh);
            radiance(&case.input("table", table(material.clone())).input("lighting", lighting))
        };
        let turned = case("brush-mesh", "turn = 90").input("mesh", pit()).artifact::<Mesh>();
        let (before, after) = (shade(pit()), shade((*turned).clone()));
        let change = (before[0][0] - after[0][0]).abs();
        assert_eq!(change > 0.05, differs, "{before:?} {after:?}");
    }
}

/// A square with a normal texture on its coordinates, an attribute, and a material whose anisotropy is turned
/// by 30 degrees; its texture has the direction (0, 1), a quarter more.
fn anisotropic(extension: &str) -> (String, Vec<u8>) {
    let mut bytes: Vec<u8> = [0.0f32, -1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0]
        .into_iter()
        .chain([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
        .chain([0.5, -0.25, 1.0, 2.0])
        .flat_map(f32::to_le_bytes)
        .collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    let text = r#"{
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "_BLEND": 3 }, "indices": 2, "material": 0 }
        ] }],
        "materials": [{ "name": "metal", "extensions": EXTENSIONS }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "direction.png" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 0, "byteOffset": 96, "componentType": 5121, "count": 6, "type": "SCALAR" },
            { "bufferView": 0, "byteOffset": 80, "componentType": 5126, "count": 4, "type": "SCALAR" }
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 102 }],
        "buffers": [{ "uri": "square.bin", "byteLength": 102 }]
    }"#;
    (text.replace("EXTENSIONS", extension), bytes)
}

fn with_square(case: Case, extension: &str) -> Case {
    let (text, bytes) = anisotropic(extension);
    let direction = containers::write_png(1, 1, &[[128, 255, 255]], None).unwrap();
    case.file("a/square.gltf", text).file("a/square.bin", bytes).file("a/direction.png", direction)
}

#[test]
fn anisotropy_of_gltf_turns_the_tangents() {
    let turned = r#"{ "KHR_materials_anisotropy": { "anisotropyRotation": 0.5235987755982988 } }"#;
    let textured = r#"{ "KHR_materials_anisotropy": {
        "anisotropyRotation": 0.5235987755982988, "anisotropyTexture": { "index": 0 } } }"#;
    let mesh = || with_square(case("import-mesh", ""), turned).source("a/square.gltf").artifact::<Mesh>();
    for (extension, degrees) in [(turned, 30.0f64), (textured, 120.0)] {
        let brushed = with_square(case("brush-mesh", "gltf = \"a/square.gltf\"\nturn = 10"), extension);
        let brushed = brushed.input("mesh", (*mesh()).clone()).artifact::<Mesh>();
        let expected = case("brush-mesh", &format!("turn = {}", degrees + 10.0));
        let expected = expected.input("mesh", (*mesh()).clone()).artifact::<Mesh>();
        for (found, expected) in brushed.0.tangents().iter().zip(expected.0.tangents()) {
            // 128 of 255 is half a code past 0.
            assert!((0..4).all(|axis| (found[axis] - expected[axis]).abs() < 5e-3), "{found:?} {expected:?}");
        }
    }
    let none =
        with_square(case("brush-mesh", "gltf = \"a/square.gltf\""), "{}").input("mesh", (*mesh()).clone());
    let failure = none.failure();
    assert!(failure.starts_with("cannot brush with a/square.gltf"), "{failure}");
    let bare =
        mesh::Mesh::new(vec![[0.0; 3]], vec![[0.0, 0.0, 1.0]], vec![[1.0, 0.0, 0.0, 1.0]], None, vec![]);
    let bare = with_square(case("brush-mesh", "gltf = \"a/square.gltf\""), textured)
        .input("mesh", Mesh(bare.unwrap()));
    assert!(bare.failure().starts_with("the mesh has no texture coordinates"), "{}", bare.failure());
    assert_eq!(
        case("brush-mesh", "material = 0").errors(),
        ["material: also needs the file: gltf = \"...\""]
    );
}

/// What the pit looks like with a transfer that was baked with these parameters.
fn shaded_with(parameters: &str, material: brdf::Material) -> (Vec<[f32; 3]>, Vec<String>) {
    let bake = baked(&format!("directions = 1024\n{parameters}"));
    let bake =
        if parameters.contains("bounces") { bake.input("material", Material(lambert(0.8))) } else { bake };
    let ran = bake.run().unwrap();
    let shade = case("shade-vertices", "camera = [-3, 1, 2]")
        .input("mesh", pit())
        .input("table", table(material))
        .input("lighting", sky_lighting())
        .input("transfer", (*ran.artifact::<Transfer>()).clone());
    (radiance(&shade), ran.notes)
}

/// What the pit of a matte material looks like with matrices of 32-bit numbers, which are not stored.
fn shaded_exactly(bounces: usize) -> Vec<[f32; 3]> {
    let Mesh(pit) = pit();
    let (frames, occluders) = (Frames::of(&pit).unwrap(), Occluders::of(&pit));
    let [four, eight] = [4, 8].map(|degree| Degree::new(degree).unwrap());
    let directions = Directions::new(1024, eight).unwrap();
    let degrees = TransferDegrees { output: four, input: four };
    let (shadows, _) = precompute(&frames, &occluders, &directions, degrees, Stop::NEVER).unwrap();
    let BrdfTable(table) = table(lambert(0.8));
    let mesh =
        ReflectingMesh { frames: &frames, occluders: &occluders, directions: &directions, table: &table };
    let found = interreflect(mesh, &shadows, bounces, Stop::NEVER);
    let [matrices] = <[_; 1]>::try_from(found.unwrap()).unwrap();
    let viewer = Viewer::At([-3.0, 1.0, 2.0]);
    shade_with_transfer(&frames, &table, viewer, &matrices, &sky_lighting().0.series)
}

#[test]
fn light_from_below_the_horizon_is_said_not_to_be_shadowed() {
    let bake = baked("directions = 1024").artifact::<Transfer>();
    let fibre = brdf::Material::KajiyaKay(brdf::KajiyaKay::new(8.0, [0.5; 3]).unwrap());
    for (material, is_noted) in [(crate::fixture::phong(8.0), true), (fibre, true), (lambert(0.8), false)] {
        let shade = case("shade-vertices", "camera = [-3, 1, 2]")
            .input("mesh", pit())
            .input("table", table(material))
            .input("lighting", sky_lighting())
            .input("transfer", (*bake).clone());
        let notes = shade.run().unwrap().notes;
        let expected = "light from below the horizon, which this material reflects, is not shadowed";
        assert_eq!(notes.iter().any(|note| note == expected), is_noted, "{notes:?}");
    }
}

#[test]
fn every_form_shades_as_matrices_do() {
    let expected = shaded_exactly(0);
    let forms = [
        ("matrices", "9 vertices with 25 x 25 entries: 11.2 kB", 1e-3),
        ("visibility", "9 vertices with 25 x 25 entries: 2.9 kB", 1e-5),
        ("matte", "9 vertices with 25 x 25 entries: ", 2e-2),
    ];
    for (form, note, limit) in forms {
        let (found, notes) = shaded_with(&format!("form = \"{form}\""), lambert(0.8));
        let error = crate::fixture::difference(&found, &expected);
        assert!(error < limit, "{form}: {error}");
        assert!(notes.last().unwrap().starts_with(note), "{notes:?}");
    }
    let bake = baked("form = \"matte\"").artifact::<Transfer>();
    let shiny = case("shade-vertices", "")
        .input("mesh", pit())
        .input("table", table(crate::fixture::phong(8.0)))
        .input("lighting", sky_lighting())
        .input("transfer", (*bake).clone());
    assert_eq!(
        shiny.failure(),
        "the table is not that of `lambert`, and a matte transfer is of no other material"
    );
}

#[test]
fn a_blend_comes_from_an_attribute_of_the_file() {
    let of = |text: &str| with_square(case("vertex-blend", text), "{}");
    let mesh = with_square(case("import-mesh", ""), "{}").source("a/square.gltf").artifact::<Mesh>();
    let ran =
        of("attribute = \"_BLEND\"\ngltf = \"a/square.gltf\"").input("mesh", (*mesh).clone()).run().unwrap();
    // Flat triangles have three vertices each; what lies outside is clamped.
    assert_eq!(
        ran.artifact::<VertexBlend>().0.value,
        [0.5, 0.0, 1.0, 0.5, 1.0, 1.0].map(|first| [first, 0.0])
    );
    assert_eq!(ran.warnings, ["2 of 6 vertices are outside of 0 to 1"]);
    let failure = |text: &str, mesh: Mesh| of(text).input("mesh", mesh).failure();
    let missing = failure("attribute = \"_NOISE\"\ngltf = \"a/square.gltf\"", (*mesh).clone());
    assert!(missing.starts_with("cannot read _NOISE of a/square.gltf"), "{missing}");
    let other = failure("attribute = \"_BLEND\"\ngltf = \"a/square.gltf\"", pit());
    assert_eq!(other, "a/square.gltf has 6 vertices, and the mesh has 9");
    let bare =
        mesh::Mesh::new(vec![[0.0; 3]], vec![[0.0, 0.0, 1.0]], vec![[1.0, 0.0, 0.0, 1.0]], None, vec![]);
    let bare = case("vertex-blend", "texture = \"n.png\"")
        .file("n.png", picture())
        .input("mesh", Mesh(bare.unwrap()));
    assert_eq!(bare.failure(), "the mesh has no texture coordinates");
    assert_eq!(failure("", pit()), "nothing says which material is where");
    assert_eq!(of("attribute = \"_A\"").errors().len(), 1);
}

#[test]
fn a_wall_lights_the_floor_before_it() {
    let shadows = shaded_with("", lambert(0.8)).0;
    let one = shaded_with("bounces = 1", lambert(0.8)).0;
    let two = shaded_with("bounces = 2", lambert(0.8)).0;
    // A wall as bright as the sky would give back all that it hides; this one reflects less.
    assert!(one[4][1] > shadows[4][1] * 1.1 && two[4][1] > one[4][1], "{shadows:?} {one:?} {two:?}");
    assert!(two[4][1] < radiance(&shaded(false))[4][1]);
    assert!(crate::fixture::difference(&one, &shaded_exactly(1)) < 2e-3);
    // A red wall: the floor before it gets more red, and blue as with shadows alone.
    let red = brdf::Material::Lambert(brdf::Lambert::new([0.8, 0.4, 0.0]).unwrap());
    let bake = |table_of: bool| {
        let case = baked("directions = 1024\nbounces = 1");
        let case = if table_of {
            case.input("material", table(red.clone()))
        } else {
            case.input("material", Material(red.clone()))
        };
        case.artifact::<Transfer>()
    };
    assert_eq!(bake(false).0.value.channels().len(), 3);
    let shade = || {
        let case = case("shade-vertices", "camera = [-3, 1, 2]").input("mesh", pit());
        case.input("table", table(lambert(0.8))).input("lighting", sky_lighting())
    };
    let [by_material, by_table] =
        [false, true].map(|of| radiance(&shade().input("transfer", (*bake(of)).clone())));
    assert!(crate::fixture::difference(&by_material, &by_table) < 1e-5);
    assert!((by_material[4][0] - one[4][0]).abs() < 1e-5, "red is reflected by 0.8");
    assert!((by_material[4][2] - shadows[4][2]).abs() < 1e-6, "blue is not");
    assert!(by_material[4][1] > shadows[4][1] && by_material[4][1] < one[4][1]);
}

#[test]
fn interreflection_needs_a_material() {
    assert_eq!(
        baked("bounces = 1").failure(),
        "`bounces` needs the material of the mesh, but none is connected"
    );
    let unused = baked("").input("material", Material(lambert(0.8))).run().unwrap();
    assert_eq!(unused.notes[0], "`bounces` is 0: the material is not used");
    assert_eq!(
        baked("form = \"visibility\"\nbounces = 1").errors(),
        ["bounces: form = \"visibility\" holds only shadows"]
    );
}

#[test]
fn a_form_that_there_is_no_more_is_answered_with_those_that_there_are() {
    for gone in ["half", "clusters"] {
        let expected = format!("form: {gone:?} is not \"matrices\" or \"visibility\" or \"matte\"");
        assert_eq!(baked(&format!("form = {gone:?}")).errors(), [expected]);
    }
    assert_eq!(
        baked("clusters = 3\ncomponents = 1").errors(),
        ["unknown key \"clusters\"", "unknown key \"components\""]
    );
}
