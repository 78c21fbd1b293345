//! What meshes, light and memory may be wrong with, at the kinds that shade vertices: each has a clear end.

use engine::Cancel;
use sh::{Degree, Expansion};
use stages::artifacts::{BrdfTable, LightField, Lighting, Material, Mesh, Transfer, VertexRadiance};

use crate::fixture::{Case, case, lambert, sky_lighting};
use crate::vertices::pit;

/// What is baked in each form, with and without bounces.
const FORMS: [&str; 5] = [
    "form = \"matrices\"",
    "form = \"visibility\"",
    "form = \"matte\"",
    "bounces = 2",
    "bounces = 2\nform = \"matte\"",
];

fn bake(parameters: &str, mesh: mesh::Mesh) -> Case {
    let case = case("precompute-transfer", parameters).input("mesh", Mesh(mesh));
    if parameters.contains("bounces") { case.input("material", Material(lambert(0.8))) } else { case }
}

fn shade(mesh: mesh::Mesh, degree: usize) -> Case {
    let table = case("tabulate-brdf", &format!("resolution = 8\ndegree = {degree}"));
    let table = table.input("material", Material(lambert(0.8))).artifact::<BrdfTable>();
    case("shade-vertices", "").input("mesh", Mesh(mesh)).input("table", (*table).clone())
}

/// Vertices far apart, without a triangle.
fn dust(count: usize) -> mesh::Mesh {
    let positions = (0..count).map(|vertex| [vertex as f32, 0.0, 0.0]).collect();
    let (normals, tangents) = (vec![[0.0, 0.0, 1.0]; count], vec![[1.0, 0.0, 0.0, 1.0]; count]);
    mesh::Mesh::new(positions, normals, tangents, None, Vec::new()).unwrap()
}

#[test]
fn an_empty_mesh_has_no_values() {
    let empty = || mesh::Mesh::joined(&[]).unwrap();
    let brushed = case("brush-mesh", "vector = [0, 0, 1]\nturn = 5").input("mesh", Mesh(empty()));
    assert!(brushed.artifact::<Mesh>().0.positions().is_empty());
    let lamp = sh::Light::from_flux(sphere::Direction::Z, 0.1, [1.0; 3]);
    let lighting = || Lighting(sh::Lighting { lights: vec![lamp], ..sky_lighting().0 });
    for form in FORMS {
        let transfer = bake(form, empty()).artifact::<Transfer>();
        assert!(transfer.0.value.is_empty(), "{form}");
        let shaded = shade(empty(), 4)
            .input("lighting", lighting())
            .input("transfer", (*transfer).clone())
            .input("material", Material(lambert(0.8)));
        assert!(shaded.artifact::<VertexRadiance>().0.value.is_empty(), "{form}");
    }
    let near = crate::light_field::near("points = { open = [-1, 0, 0], wall = [1, 0, 0] }");
    let shaded = shade(empty(), 4).input("lighting", (*near.artifact::<LightField>()).clone());
    assert!(shaded.artifact::<VertexRadiance>().0.value.is_empty());
}

/// The pit with triangles that are lines and points: they block nothing, and nothing is NaN.
#[test]
fn slivers_change_nothing() {
    let Mesh(pit) = pit();
    let slivers = [vec![[0, 0, 1], [4, 4, 4], [5, 6, 5]], pit.triangles().to_vec()].concat();
    let with = mesh::Mesh::new(
        pit.positions().to_vec(),
        pit.normals().to_vec(),
        pit.tangents().to_vec(),
        None,
        slivers,
    );
    let with = with.unwrap();
    // A ray may start a little further inside, where a vertex has more triangles.
    for form in FORMS {
        let shaded = |mesh: &mesh::Mesh| {
            let transfer = bake(form, mesh.clone()).artifact::<Transfer>();
            let case = shade(mesh.clone(), 4).input("lighting", sky_lighting());
            case.input("transfer", (*transfer).clone()).artifact::<VertexRadiance>().0.value.clone()
        };
        let error = crate::fixture::difference(&shaded(&with), &shaded(&pit));
        assert!(error < 0.02, "{form}: {error}");
    }
}

#[test]
fn a_transfer_that_is_too_large_is_refused_before_the_first_ray() {
    // 81 x 81 numbers a vertex.
    let large = "degree = 8\ndirections = 600\n";
    for (more, count, bytes) in
        [("", 305_000, 305_000u64 * 81 * 81 * 2), ("bounces = 1", 51_000, 3 * 51_000 * 81 * 81 * 4)]
    {
        let failure = bake(&format!("{large}{more}"), dust(count)).run().err().unwrap();
        let expected = format!("the transfer of {count} vertices takes {bytes} bytes, more than 4000000000");
        assert_eq!(failure.to_string(), expected, "{more}");
        assert!(
            format!("{failure:?}").contains("choose a smaller `form`, lower `output-degree`"),
            "{failure:?}"
        );
    }
}

#[test]
fn a_cancelled_bake_or_shading_stops() {
    let cancel = Cancel::default();
    cancel.cancel();
    for form in FORMS {
        let failure = bake(form, pit().0).cancelled_by(&cancel).run().err().unwrap();
        assert!(failure.cancelled, "{form}: {failure}");
    }
    let lamp = sh::Light::from_flux(sphere::Direction::Z, 0.1, [1.0; 3]);
    let lighting = Lighting(sh::Lighting { lights: vec![lamp], ..sky_lighting().0 });
    let shaded = shade(pit().0, 4).input("lighting", lighting).input("material", Material(lambert(0.8)));
    assert!(shaded.cancelled_by(&cancel).run().err().unwrap().cancelled);
}

#[test]
fn degrees_that_differ_are_cut_to_the_lower_with_a_note() {
    let light = |degree: usize| {
        let mut series = Expansion::zero(Degree::new(degree).unwrap());
        series.coefficients_mut()[0] = [3.545; 3];
        Lighting(series.into())
    };
    let notes = |table: usize, of_light: usize, transfer: Option<&str>| {
        let case = shade(pit().0, table).input("lighting", light(of_light));
        let case = match transfer {
            Some(text) => case.input("transfer", (*bake(text, pit().0).artifact::<Transfer>()).clone()),
            None => case,
        };
        let ran = case.run().unwrap();
        let value = &ran.artifact::<VertexRadiance>().0.value;
        assert!(value.as_flattened().iter().all(|value| value.is_finite()));
        ran.notes.iter().filter(|note| note.contains("ends at")).cloned().collect::<Vec<_>>()
    };
    assert!(notes(4, 4, None).is_empty() && notes(4, 4, Some("")).is_empty());
    assert_eq!(notes(4, 2, None), ["the light ends at degree 2, the table at 4"]);
    assert_eq!(notes(4, 30, None), ["the table ends at degree 4, the light at 30"]);
    let wide = "degree = 2\noutput-degree = 6\ndirections = 256";
    let expected = [
        "the transfer's F ends at degree 2, the light at 4",
        "the table ends at degree 4, the transfer's O at 6",
    ];
    assert_eq!(notes(4, 4, Some(wide)), expected);
    let low = "degree = 4\noutput-degree = 2\ndirections = 256\nform = \"visibility\"";
    let expected = [
        "the light ends at degree 1, the transfer's F at 4",
        "the transfer's O ends at degree 2, the table at 4",
    ];
    assert_eq!(notes(4, 1, Some(low)), expected);
    // A matte transfer has no O.
    assert!(notes(2, 4, Some("form = \"matte\"")).is_empty());
}

#[test]
fn a_disk_has_an_angle_above_0_up_to_180_degrees() {
    let disk = |angle: &str| {
        let text = format!("[[light]]\ndirection = [0, 0, 1]\nradiance = 1\nangular_radius = {angle}\n");
        case("circular-lights", "").file("a.toml", text).source("a.toml")
    };
    for bad in ["0", "-5", "180.5", "nan", "inf"] {
        let failure = disk(bad).failure();
        assert!(failure.contains("a.toml:4:18"), "{bad}: {failure}");
    }
    for good in ["1e-3", "90", "180"] {
        let lighting = disk(good).artifact::<Lighting>();
        assert!(lighting.0.mean() > 0.0, "{good}");
    }
}

/// A file without coordinates has tangents that point east, and a vector still brushes it.
#[test]
fn a_mesh_without_coordinates_is_brushed_by_a_vector() {
    let numbers = [0.0f32, -1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0, -1.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let text = r#"{
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "uri": "a.bin", "byteLength": 36 }]
    }"#;
    let bare = case("import-mesh", "").file("a.gltf", text).file("a.bin", bytes).source("a.gltf");
    let bare = bare.artifact::<Mesh>();
    assert!(bare.0.coordinates().is_none());
    assert_eq!(bare.0.tangents()[0], [-1.0, 0.0, 0.0, 1.0]);
    let brushed = case("brush-mesh", "vector = [0, 0, 1]").input("mesh", (*bare).clone());
    assert_eq!(brushed.artifact::<Mesh>().0.tangents()[0], [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn vertices_that_see_nothing_are_counted_in_every_form() {
    let sphere = mesh::shape("sphere").unwrap();
    // A floor inside a sphere.
    let floor = mesh::Mesh::new(
        vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]],
        vec![[0.0, 0.0, 1.0]; 3],
        vec![[1.0, 0.0, 0.0, 1.0]; 3],
        None,
        vec![[0, 1, 2]],
    );
    let few: Vec<[u32; 3]> = sphere.triangles().to_vec();
    let shell = mesh::Mesh::new(
        sphere.positions().to_vec(),
        sphere.normals().to_vec(),
        sphere.tangents().to_vec(),
        None,
        few,
    );
    let joined = mesh::Mesh::joined(&[floor.unwrap(), shell.unwrap()]).unwrap();
    for form in FORMS {
        let ran = bake(&format!("degree = 0\ndirections = 16\n{form}"), joined.clone()).run().unwrap();
        let of = joined.positions().len();
        let expected = format!("3 of {of} vertices do not see the sky above their horizon");
        assert_eq!(ran.warnings, [expected], "{form}");
    }
}
