//! Files that are written here: a mesh with attributes of one's own.

use containers::{ErrorKind, GlbText, VertexAttribute, read_gltf_attribute, read_recipe, write_glb};
use mesh::Mesh;

use super::read;

fn attribute(name: &str, width: usize, values: Vec<f32>) -> VertexAttribute {
    VertexAttribute { name: name.into(), width, values }
}

fn knot() -> Mesh {
    mesh::shape("torus-knot").unwrap()
}

#[test]
fn every_mesh_comes_back() {
    for name in mesh::SHAPES {
        let mesh = mesh::shape(name).unwrap();
        let found = read(&write_glb(&mesh, &[], GlbText::default()).unwrap()).unwrap().mesh;
        assert_eq!(found.positions(), mesh.positions(), "{name}");
        assert_eq!(
            (found.triangles(), found.coordinates()),
            (mesh.triangles(), mesh.coordinates()),
            "{name}"
        );
        let vectors =
            found.normals().iter().zip(mesh.normals()).map(|(a, b)| (a[..3].to_vec(), b[..3].to_vec()));
        let tangents = found.tangents().iter().zip(mesh.tangents()).map(|(a, b)| (a.to_vec(), b.to_vec()));
        for (found, expected) in vectors.chain(tangents) {
            // Reading makes lengths and right angles exact.
            assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-6), "{name}");
        }
    }
}

#[test]
fn numbers_of_vertices_come_back() {
    let knot = knot();
    let vertices = knot.positions().len();
    let values: Vec<f32> = (0..vertices).map(|vertex| vertex as f32 * 0.5 - 3.0).collect();
    let fours: Vec<f32> = values.iter().flat_map(|value| [*value, 7.0, 8.0, 9.0]).collect();
    let attributes = [attribute("_HEAT", 1, values.clone()), attribute("_FOUR", 4, fours)];
    let recipe = r#"{"kind":"made-up","parameters":{"z":0.1,"a":1e-7}}"#;
    let text = GlbText { recipe: Some(recipe), ..GlbText::default() };
    let file = write_glb(&knot, &attributes, text).unwrap();
    for name in ["_HEAT", "_FOUR"] {
        let found = read_gltf_attribute::<containers::Error>(&file, name, &mut |_| unreachable!());
        assert_eq!(found.unwrap(), values, "{name}");
    }
    assert_eq!(read_recipe(&file).as_deref(), Some(recipe));
    assert_eq!(read_recipe(&write_glb(&knot, &attributes, GlbText::default()).unwrap()), None);
    for length in 0..file.len().min(3000) {
        let _ = read_recipe(&file[..length]);
    }
}

#[test]
fn what_is_no_file_is_refused() {
    let knot = knot();
    let vertices = knot.positions().len();
    let error = |attributes: &[VertexAttribute], text: GlbText<'_>| {
        let error = write_glb(&knot, attributes, text).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unwritable);
        error.to_string()
    };
    let mut holes = vec![0.0; 3 * vertices];
    holes[7] = f32::INFINITY;
    assert_eq!(
        error(&[attribute("_A", 3, holes)], GlbText::default()),
        "glTF: _A: a number of vertex 2 is not finite"
    );
    for width in [0, 5] {
        let wrong = error(&[attribute("_A", width, vec![0.0; width * vertices])], GlbText::default());
        assert!(wrong.contains(&format!("{width} each, for {vertices} vertices")), "{wrong}");
    }
    let recipe = |recipe| GlbText { recipe: Some(recipe), ..GlbText::default() };
    assert_eq!(error(&[], recipe("{")), "glTF: the recipe is not JSON");
    assert!(error(&[], recipe("{}\n")).contains("one line"));
    let empty = Mesh::new(Vec::new(), Vec::new(), Vec::new(), None, Vec::new()).unwrap();
    let refused = write_glb(&empty, &[], GlbText::default()).unwrap_err().to_string();
    assert_eq!(refused, "glTF: a mesh without triangles cannot be written");
}
