//! `export-gltf`: what a reader of the file finds.

use containers::tensors::OfMesh;
use engine::{Artifact, Digest};
use serde_json::Value;
use sh::{Basis, Degree, Expansion};
use sphere::{DVec3, Direction};
use stages::artifacts::{BrdfTable, LightField, Lighting, Material, Mesh, Transfer, VertexRadiance};

use crate::fixture::{Case, case, difference, environment, lambert, phong, sky, sky_lighting};
use crate::import_mesh::{square, square_files};
use crate::vertices::{pit, shaded};

pub(crate) fn export(parameters: &str) -> Case {
    case("export-gltf", parameters).input("mesh", pit())
}

fn radiance() -> VertexRadiance {
    (*shaded(false).artifact::<VertexRadiance>()).clone()
}

pub(crate) fn baked(parameters: &str) -> Transfer {
    let bake = case("precompute-transfer", &format!("directions = 1024\n{parameters}")).input("mesh", pit());
    let bake = match parameters.contains("bounces") {
        true => bake.input("material", Material(coloured())),
        false => bake,
    };
    (*bake.artifact::<Transfer>()).clone()
}

fn coloured() -> brdf::Material {
    brdf::Material::Lambert(brdf::Lambert::new([0.9, 0.5, 0.1]).unwrap())
}

/// Radiance and a transfer, as most files have them.
pub(crate) fn knot() -> Case {
    export("exposure = -0.5").input("radiance", radiance()).input("transfer", baked("form = \"matte\""))
}

/// A binary glTF, read by the words of its specification.
pub(crate) struct Read {
    pub(crate) json: Value,
    binary: Vec<u8>,
}

impl Read {
    pub(crate) fn of(file: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        let (json, end) = (word(12), 20 + word(12));
        assert_eq!((&file[16..20], &file[end + 4..end + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
        assert_eq!((json % 4, word(end) % 4, end + 8 + word(end)), (0, 0, file.len()));
        let json: Value = serde_json::from_slice(&file[20..end]).unwrap();
        let binary = file[end + 8..].to_vec();
        assert_eq!(json["buffers"][0]["byteLength"], binary.len());
        Self { json, binary }
    }

    pub(crate) fn attributes(&self) -> &serde_json::Map<String, Value> {
        self.json["meshes"][0]["primitives"][0]["attributes"].as_object().unwrap()
    }

    fn accessor(&self, index: &Value) -> (&Value, &[u8]) {
        let accessor = &self.json["accessors"][index.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [first, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        assert_eq!(first % 4, 0);
        (accessor, &self.binary[first..first + length])
    }

    /// The numbers of an attribute of the pit's nine vertices.
    pub(crate) fn attribute<const N: usize>(&self, name: &str) -> Vec<[f32; N]> {
        let (accessor, bytes) = self.accessor(&self.attributes()[name]);
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        assert_eq!((&accessor["componentType"], &accessor["type"]), (&5126.into(), &kind.into()), "{name}");
        assert_eq!((accessor["count"].clone(), bytes.len()), (9.into(), 9 * 4 * N), "{name}");
        let numbers: Vec<f32> =
            bytes.chunks(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect();
        numbers.chunks(N).map(|vertex| vertex.try_into().unwrap()).collect()
    }

    /// Every number of the binary part, indices included.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let views = self.json["bufferViews"].as_array().unwrap();
        let mut numbers = Vec::new();
        for accessor in self.json["accessors"].as_array().unwrap() {
            let view = &views[accessor["bufferView"].as_u64().unwrap() as usize];
            let [first, length] =
                ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
            for word in self.binary[first..first + length].chunks(4) {
                let word: [u8; 4] = word.try_into().unwrap();
                let is_float = accessor["componentType"] == 5126;
                numbers.push(if is_float {
                    f32::from_le_bytes(word).into()
                } else {
                    u32::from_le_bytes(word).into()
                });
            }
        }
        numbers
    }

    /// The coefficients of the vectors, [V][25].
    fn transfer(&self, prefix: &str) -> Vec<Vec<f32>> {
        let parts: Vec<Vec<[f32; 4]>> =
            (0..7).map(|part| self.attribute(&format!("{prefix}_TRANSFER_{part}"))).collect();
        (0..9).map(|vertex| parts.iter().flat_map(|part| part[vertex]).collect()).collect()
    }

    /// Red, green and blue, and a fourth number 0 if there is one.
    fn colours(&self, name: &str) -> Vec<[f32; 3]> {
        let (accessor, _) = self.accessor(&self.attributes()[name]);
        if accessor["type"] == "VEC3" {
            return self.attribute(name);
        }
        let vectors: Vec<[f32; 4]> = self.attribute(name);
        assert!(vectors.iter().all(|vector| vector[3] == 0.0), "{name}");
        vectors.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect()
    }

    /// The light at each vertex, of a degree.
    fn light(&self, degree: usize) -> Vec<Expansion> {
        let degree = Degree::new(degree).unwrap();
        let name = |row: usize| format!("_SH_DEGREE_{}_COEF_{}", row.isqrt(), row - row.isqrt().pow(2));
        let rows: Vec<Vec<[f32; 3]>> = (0..degree.rows()).map(|row| self.colours(&name(row))).collect();
        let vertex =
            |vertex: usize| rows.iter().map(|row: &Vec<[f32; 3]>| row[vertex].map(f64::from)).collect();
        (0..9).map(|index| Expansion::from_coefficients(degree, vertex(index)).unwrap()).collect()
    }
}

fn read(case: &Case) -> (Read, Vec<String>) {
    let ran = case.run().unwrap();
    let read = Read::of(ran.files()[0]);
    (read, [ran.warnings, ran.notes].concat())
}

#[test]
fn the_mesh_comes_back() {
    let file = &knot().files()[0];
    let found = containers::read_gltf::<containers::Error>(file, &mut |_| unreachable!()).unwrap();
    let notes = vec!["the primitive has vertex colours (COLOR_0), which are left out".to_owned()];
    // All of it has the material of the file.
    let all = mesh::MaterialRange { material: Some(0), triangles: 6 };
    let expected = pit().0.with_materials(vec!["0".into()], &[all]).unwrap();
    assert_eq!((found.mesh, found.notes), (expected, notes));
    assert_eq!(containers::read_recipe(file).as_deref(), Some(r#"{"kind":"export-gltf"}"#));
    let read = Read::of(file);
    let positions: Vec<[f32; 3]> = read.attribute("POSITION");
    // The file's frame: +Y is up, and our +X, the front, is its +Z.
    assert_eq!(positions[0], [-1.0, 0.0, -1.0]);
    let (accessor, _) = read.accessor(&read.attributes()["POSITION"]);
    assert_eq!(accessor["min"], serde_json::json!([-4.0, -0.5, -1.0]));
    assert_eq!(accessor["max"], serde_json::json!([4.0, 4.0, 1.0]));
    assert_eq!(read.attribute::<3>("NORMAL")[5], [0.0, 0.0, -1.0]);
    assert_eq!(read.attribute::<4>("TANGENT")[5], [1.0, 0.0, 0.0, -1.0]);
    assert_eq!(read.attribute::<2>("TEXCOORD_0").len(), 9);
    assert_eq!(read.json["asset"]["generator"], "Specula");
}

#[test]
fn a_mesh_alone_has_a_matte_material() {
    let (read, notes) = read(&export(""));
    let names: Vec<&String> = read.attributes().keys().collect();
    assert_eq!(names, ["NORMAL", "POSITION", "TANGENT", "TEXCOORD_0"]);
    assert_eq!(read.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 0.0);
    assert!(read.json.get("extensionsUsed").is_none() && read.json["meshes"][0].get("extras").is_none());
    assert_eq!(notes.len(), 1);
    assert!(notes[0].starts_with("9 vertices: "), "{notes:?}");
}

/// Items of a fixture have the key {environment: sky}, and so has the asset.
#[test]
fn the_asset_that_came_in_is_kept() {
    let mesh = square().artifact::<Mesh>();
    let (text, bytes) = square_files();
    let digest = Digest::of(&mesh.encode().unwrap()).to_string();
    // Vertices of the asset that are several here have the same place, and so the same number.
    let radiance = VertexRadiance(OfMesh { value: mesh.0.positions().to_vec(), mesh: digest });
    let export = |parameters: &str| {
        case("export-gltf", parameters)
            .file("meshes/sky.gltf", text)
            .file("meshes/square.bin", bytes.clone())
            .input("mesh", (*mesh).clone())
    };
    let ran = export("gltf = \"meshes/{environment}.gltf\"").input("radiance", radiance).run().unwrap();
    assert_eq!((&ran.warnings, ran.notes.len()), (&Vec::new(), 1));
    let read = Read::of(ran.files()[0]);
    let asset: Value = serde_json::from_str(text).unwrap();
    for kept in ["nodes", "scenes"] {
        assert_eq!(read.json[kept], asset[kept]);
    }
    assert!(read.json.get("materials").is_none());
    for primitive in 0..2 {
        let attributes = &read.json["meshes"][0]["primitives"][primitive]["attributes"];
        let names: Vec<&String> = attributes.as_object().unwrap().keys().collect();
        assert_eq!(names, ["POSITION", "TEXCOORD_0", "_RADIANCE"]);
        let (accessor, numbers) = read.accessor(&attributes["_RADIANCE"]);
        assert_eq!(accessor["count"], 4);
        // The first vertex of the file, (0, -1, 1), where its node puts it, in our frame.
        let first = [1.0_f32, 0.0, 1.0].iter().flat_map(|number| number.to_le_bytes());
        assert_eq!(numbers[..12], first.collect::<Vec<u8>>());
    }
    assert_eq!(
        export("gltf = \"meshes/{mesh}.gltf\"").failure(),
        "gltf = \"meshes/{mesh}.gltf\" names {mesh}, but this stage depends on no source stage with that name"
    );
    assert_eq!(
        export("gltf = \"a.glb\"\nexposure = 1").errors(),
        ["exposure: has no effect with gltf, because COLOR_0 is not written"]
    );
    let other =
        case("export-gltf", "gltf = \"a.gltf\"").file("a.gltf", text).file("square.bin", bytes.clone());
    assert!(other.input("mesh", pit()).failure().contains("the file holds another mesh"));
}

#[test]
fn only_colours_are_clamped() {
    let mut given = radiance();
    given.0.value[0] = [-0.25, 0.5, 3.0];
    let (read, notes) = read(&export("exposure = 1").input("radiance", given.clone()));
    let colours: Vec<[f32; 3]> = read.attribute("COLOR_0");
    assert_eq!(read.attribute::<3>("_RADIANCE"), given.0.value);
    assert_eq!(colours[0], [0.0, 1.0, 1.0]);
    let expected: Vec<[f32; 3]> =
        given.0.value.iter().map(|rgb| rgb.map(|value| (2.0 * value).clamp(0.0, 1.0))).collect();
    assert_eq!(colours, expected);
    let above = given.0.value.as_flattened().iter().filter(|value| **value > 0.5).count();
    let clamped = format!(
        "the numbers of COLOR_0 are clamped: 1 of 27 were below 0 and turn black, {above} were above 1"
    );
    assert!(notes[0].contains(&clamped) && notes[0].contains("; lower `exposure`"), "{notes:?}");
    assert_eq!(read.json["extensionsUsed"], serde_json::json!(["KHR_materials_unlit"]));
    assert!(read.json["materials"][0]["extensions"].get("KHR_materials_unlit").is_some());
}

/// Blender before 5.1 fails to read attributes of different widths.
#[test]
fn attributes_of_our_own_have_one_width() {
    let (read, _) = read(&knot().input("lighting", sky_lighting()));
    assert_eq!(read.colours("_RADIANCE"), radiance().0.value);
    for name in read.attributes().keys().filter(|name| name.starts_with('_')) {
        assert_eq!(read.attribute::<4>(name).len(), 9, "{name}");
    }
    assert_eq!(read.attribute::<3>("COLOR_0").len(), 9);
}

#[test]
fn an_environment_gives_the_exposure_of_its_pictures() {
    let sky = environment(16, sky);
    let stops = sky.0.exposure().stops + 0.25;
    let (read, notes) =
        read(&export("exposure = 0.25").input("radiance", radiance()).input("environment", sky));
    assert!(notes[0].starts_with("exposure ") && notes[0].ends_with("as given"), "{notes:?}");
    let expected: Vec<[f32; 3]> = radiance()
        .0
        .value
        .iter()
        .map(|rgb| rgb.map(|value| ((f64::from(value) * stops.exp2()) as f32).clamp(0.0, 1.0)))
        .collect();
    assert_eq!(read.attribute::<3>("COLOR_0"), expected);
}

/// What a shader computes: albedo times the sum of t_j L_j.
fn relit(t: &[f32], light: &Expansion, channel: usize) -> f32 {
    let rows = t.iter().zip(light.coefficients());
    rows.map(|(t, rgb)| t * rgb[channel] as f32).sum()
}

#[test]
fn matte_transfer_relights_as_shade_vertices_does() {
    let light = sky_lighting();
    for parameters in ["form = \"matte\"", "form = \"matte\"\nbounces = 2"] {
        let transfer = baked(parameters);
        let (read, _) = read(&export("").input("transfer", transfer.clone()));
        let table = case("tabulate-brdf", "resolution = 16").input("material", Material(lambert(0.8)));
        let expected = case("shade-vertices", "")
            .input("mesh", pit())
            .input("table", (*table.artifact::<BrdfTable>()).clone())
            .input("lighting", light.clone())
            .input("transfer", transfer)
            .artifact::<VertexRadiance>();
        let prefixes = match parameters.contains("bounces") {
            true => ["_RED", "_GREEN", "_BLUE"],
            false => [""; 3],
        };
        let channels = prefixes.map(|prefix| read.transfer(prefix));
        assert!(channels[0].iter().all(|t| t[25..] == [0.0; 3]));
        let found: Vec<[f32; 3]> = (0..9)
            .map(|vertex| [0, 1, 2].map(|k| 0.8 * relit(&channels[k][vertex], &light.0.series, k)))
            .collect();
        assert!(difference(&found, &expected.0.value) < 1e-6, "{parameters}");
        assert!(
            read.json["meshes"][0]["extras"]["basis"].as_str().unwrap().contains("(z, x, y) of this file")
        );
    }
}

/// The vectors of a fixed view and a light, or the light in the frames and c_i of the table, are what
/// `shade-vertices` has.
#[test]
fn what_is_fixed_shades_as_shade_vertices_does() {
    let (light, brushed) = (sky_lighting(), crate::brdf_table::brushed());
    let table = |material: Material| {
        let table = case("tabulate-brdf", "resolution = 16").input("material", material);
        (*table.artifact::<BrdfTable>()).clone()
    };
    for (table, transfer) in [
        (table(Material(phong(8.0))), None),
        (table(brushed.clone()), None),
        (table(brushed), Some(baked(""))),
        (table(Material(lambert(0.8))), Some(baked(""))),
    ] {
        let with = |kind, parameters: &str| {
            let case = case(kind, parameters).input("mesh", pit()).input("table", table.clone());
            match &transfer {
                Some(transfer) => case.input("transfer", transfer.clone()),
                None => case,
            }
        };
        for viewer in ["camera = [-3, 1, 2]", "view = [1, 1, 1]", ""] {
            let expected = with("shade-vertices", viewer).input("lighting", light.clone());
            let expected = expected.artifact::<VertexRadiance>().0.value.clone();
            let (read, _) = read(&with("export-gltf", viewer));
            let prefixes = match table.0.channels() {
                1 => [""; 3],
                _ => ["_RED", "_GREEN", "_BLUE"],
            };
            let channels = prefixes.map(|prefix| read.transfer(prefix));
            let found: Vec<[f32; 3]> = (0..9)
                .map(|vertex| [0, 1, 2].map(|k| relit(&channels[k][vertex], &light.0.series, k)))
                .collect();
            assert!(difference(&found, &expected) < 2e-6, "{viewer}: {found:?} {expected:?}");
        }
        // The other way round: the light in the frame of the vertex, and c_i at the view there.
        let camera = DVec3::new(-3.0, 1.0, 2.0);
        let expected = with("shade-vertices", "camera = [-3, 1, 2]").input("lighting", light.clone());
        let expected = expected.artifact::<VertexRadiance>().0.value.clone();
        let case = export("light-frame = \"vertex\"").input("lighting", light.clone());
        let (read, _) = read(&match &transfer {
            Some(transfer) => case.input("transfer", transfer.clone()),
            None => case,
        });
        let degree = if transfer.is_some() { 4 } else { 2 };
        let mesh = pit().0;
        for (vertex, local) in read.light(degree).iter().enumerate() {
            let at = |values: &[[f32; 3]]| DVec3::from_array(values[vertex].map(f64::from));
            let (place, normal) = (at(mesh.positions()), at(mesh.normals()));
            let [x, y, z, _] = mesh.tangents()[vertex].map(f64::from);
            let tangent = DVec3::new(x, y, z);
            let view = (camera - place).normalize();
            let view = DVec3::new(view.dot(tangent), view.dot(normal.cross(tangent)), view.dot(normal));
            let mut c = vec![0.0; table.0.texel()];
            table.0.lookup_into(0, Direction::normalised(view), &mut c);
            let found: [f32; 3] = std::array::from_fn(|k| {
                let rows = local.coefficients().iter().enumerate();
                let channels = table.0.channels();
                rows.map(|(row, rgb)| c[row * channels + k.min(channels - 1)] * rgb[k] as f32).sum()
            });
            for (found, expected) in found.iter().zip(expected[vertex]) {
                assert!((found - expected).abs() < 2e-6, "{vertex}: {found} {expected}");
            }
        }
    }
}

#[test]
fn what_a_fixed_view_needs_is_told() {
    let table = case("tabulate-brdf", "resolution = 8").input("material", Material(lambert(0.8)));
    let table = (*table.artifact::<BrdfTable>()).clone();
    let matte = export("").input("table", table.clone()).input("transfer", baked("form = \"matte\""));
    assert!(matte.failure().contains("a matte transfer has no matrices, which the table needs"));
    assert_eq!(export("view = [1, 0, 0]").input_errors(), ["view: only an input `table` uses it"]);
    let errors = export("light-frame = \"vertex\"").input_errors();
    assert_eq!(errors, ["light-frame: only an input `lighting` uses it"]);
    let both = export("view = [1, 0, 0]\ncamera = [1, 0, 0]").input("table", table);
    assert_eq!(both.errors(), ["camera: view already sets the viewer"]);
}

#[test]
fn light_at_the_vertices_is_what_arrives_past_the_mesh() {
    let light = sky_lighting();
    let with = |transfer: Option<Transfer>, parameters: &str| {
        let case = export(parameters).input("lighting", light.clone());
        read(&match transfer {
            Some(transfer) => case.input("transfer", transfer),
            None => case,
        })
        .0
    };
    // Without matrices, the light itself, of its own degree.
    for found in [with(None, ""), with(Some(baked("form = \"matte\"")), "")] {
        assert!(found.attributes().get("_SH_DEGREE_3_COEF_0").is_none());
        for vertex in found.light(2) {
            assert!(difference(vertex.coefficients(), light.0.series.coefficients()) < 1e-6);
        }
    }
    assert!(with(None, "degree = 1").attributes().get("_SH_DEGREE_2_COEF_0").is_none());
    // With matrices: the sky where a vertex sees it, and nothing of it where the wall is.
    let found = with(Some(baked("degree = 8")), "degree = 8").light(8);
    let basis = Basis::new(Degree::new(8).unwrap());
    let mut y = vec![0.0; 81];
    let mut at = |vertex: &Expansion, direction: DVec3| {
        basis.evaluate_into(Direction::normalised(direction), &mut y);
        vertex.coefficients().iter().zip(&y).map(|(rgb, y)| rgb[1] * y).sum::<f64>()
    };
    // Vertex 4 lies on the floor, half a unit before the wall.
    let (wall, away) = (DVec3::new(1.0, 0.0, 0.5), DVec3::new(-1.0, 0.0, 0.5));
    let (hidden, open) = (at(&found[4], wall), at(&found[4], away));
    assert!(hidden.abs() < 0.15 && (open - sky(away.normalize())[1]).abs() < 0.15, "{hidden} {open}");
    // A mesh of one slanted triangle hides nothing: the light of the world at every vertex.
    let slanted = |normal: [f32; 3], tangent: [f32; 4]| {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]];
        let mesh = mesh::Mesh::new(
            corners.iter().cycle().take(9).copied().collect(),
            vec![normal; 9],
            vec![tangent; 9],
            None,
            vec![[0, 1, 2]],
        );
        Mesh(mesh.unwrap())
    };
    let mesh = || slanted([0.0, -0.8, 0.6], [0.6, 0.48, 0.64, -1.0]);
    // Each entry of matrices is rounded by 2.4e-4; up to five of a row, and of a column, are not 0.
    for (form, limit) in [("visibility", 1e-5), ("matrices", 2e-3)] {
        let parameters = format!("degree = 2\ndirections = 256\nform = \"{form}\"");
        let bake = case("precompute-transfer", &parameters).input("mesh", mesh());
        let case = case("export-gltf", "").input("mesh", mesh()).input("lighting", light.clone());
        let (found, _) = read(&case.input("transfer", (*bake.artifact::<Transfer>()).clone()));
        for vertex in found.light(2) {
            let error = difference(vertex.coefficients(), light.0.series.coefficients());
            assert!(error < limit, "{form}: {error}");
        }
    }
}

#[test]
fn a_light_field_gives_each_vertex_the_light_of_its_place() {
    let points = "points = { open = [-1, 0, 0], wall = [1, 0, 0] }";
    let field = crate::light_field::near(points).artifact::<LightField>();
    let of = |transfer: Option<Transfer>| {
        let case = export("").input("lighting", (*field).clone());
        let case = match transfer {
            Some(transfer) => case.input("transfer", transfer),
            None => case,
        };
        read(&case).0.light(4)
    };
    let (open, past) = (of(None), of(Some(baked(""))));
    // Skies of radiance 1 and 3; weights are inverse squares of the distances, 1.5 and 0.5 for vertex 4.
    let middle = (4.0 * std::f64::consts::PI).sqrt() * (1.0 / 2.25 + 3.0 / 0.25) / (1.0 / 2.25 + 1.0 / 0.25);
    assert!((open[4].coefficients()[0][1] - middle).abs() < 1e-5, "{:?}", open[4].coefficients()[0]);
    // A constant sky past the mesh is what the mesh lets through of a sky of radiance 1, times its radiance.
    let white = {
        let mut series = Expansion::zero(Degree::new(4).unwrap());
        series.coefficients_mut()[0] = [(4.0 * std::f64::consts::PI).sqrt(); 3];
        export("").input("lighting", Lighting(series.into())).input("transfer", baked(""))
    };
    for (vertex, (white, past)) in read(&white).0.light(4).iter().zip(&past).enumerate() {
        let radiance = open[vertex].coefficients()[0][1] / (4.0 * std::f64::consts::PI).sqrt();
        let scaled: Vec<[f64; 3]> =
            white.coefficients().iter().map(|rgb| rgb.map(|value| radiance * value)).collect();
        let error = difference(past.coefficients(), &scaled);
        assert!(error < 1e-5, "{vertex}: {error}");
    }
}

#[test]
fn what_does_not_fit_is_an_error() {
    let triangle = |vertices: usize, triangles: Vec<[u32; 3]>| {
        let mesh = mesh::Mesh::new(
            (0..vertices).map(|k| [k as f32, (k % 2) as f32, 0.0]).collect(),
            vec![[0.0, 0.0, 1.0]; vertices],
            vec![[1.0, 0.0, 0.0, 1.0]; vertices],
            None,
            triangles,
        );
        Mesh(mesh.unwrap())
    };
    let on = |mesh: Mesh| case("export-gltf", "").input("mesh", mesh);
    assert_eq!(on(triangle(0, Vec::new())).failure(), "the mesh has no triangles");
    let other = || on(triangle(9, vec![[0, 1, 2]]));
    assert_eq!(other().input("radiance", radiance()).failure(), "the radiance belongs to another mesh");
    assert_eq!(
        other().input("transfer", baked("form = \"matte\"")).failure(),
        "the transfer belongs to another mesh"
    );
    for form in ["matrices", "visibility"] {
        let transfer = baked(&format!("form = \"{form}\""));
        assert_eq!(
            export("").input("transfer", transfer.clone()).failure(),
            "the transfer is not matte, so it has no vectors to write"
        );
        assert!(export("").input("transfer", transfer).input("lighting", sky_lighting()).run().is_ok());
    }
    let mut broken = radiance();
    broken.0.value[4][1] = f32::NAN;
    assert_eq!(
        export("").input("radiance", broken).failure(),
        "glTF: COLOR_0: a number of vertex 4 is not finite"
    );
    let mut short = radiance();
    short.0.value.pop();
    assert_eq!(
        export("").input("radiance", short).failure(),
        "glTF: COLOR_0: 24 numbers, 3 each, for 9 vertices"
    );
    let bright = Expansion::from_coefficients(Degree::ZERO, vec![[1e300; 3]]).unwrap();
    assert_eq!(
        export("").input("lighting", Lighting(bright.into())).failure(),
        "glTF: _SH_DEGREE_0_COEF_0: a number of vertex 0 is not finite"
    );
}
