//! `matrices` of `export-gltf`: the texture, read by the words of its specification and of its own metadata.

use std::collections::BTreeMap;

use engine::{Artifact, Digest};
use sh::Degree;
use sphere::{DVec3, Direction};
use stages::artifacts::{BrdfTable, Material, Mesh, Transfer, VertexRadiance};

use crate::export_gltf::{Read, baked, export};
use crate::fixture::{case, difference, sky_lighting};
use crate::import_mesh::{square, square_files};
use crate::vertices::pit;

/// The number of a half's bits, which is finite.
fn half(bits: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => mantissa * 2.0_f32.powi(-14),
        _ => (1.0 + mantissa) * 2.0_f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// A KTX2 file of one level with four numbers a texel.
struct Ktx2 {
    width: usize,
    height: usize,
    metadata: BTreeMap<String, String>,
    texels: Vec<[f32; 4]>,
}

impl Ktx2 {
    fn of(file: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let [format, number, width, height, depth, layers, faces, levels, scheme] =
            std::array::from_fn(|k| word(12 + 4 * k));
        assert_eq!((depth, layers, faces, levels, scheme), (0, 0, 1, 1, 0));
        let mut metadata = BTreeMap::new();
        let (mut at, end) = (word(56), word(56) + word(60));
        while at < end {
            let entry = std::str::from_utf8(&file[at + 4..at + 4 + word(at)]).unwrap();
            let (key, value) = entry.trim_end_matches('\0').split_once('\0').unwrap();
            metadata.insert(key.to_owned(), value.to_owned());
            at += 4 + word(at).next_multiple_of(4);
        }
        let level = &file[word(80)..][..word(88)];
        let numbers: Vec<f32> = match (format, number) {
            (97, 2) => level.chunks(2).map(|n| half(u16::from_le_bytes(n.try_into().unwrap()))).collect(),
            (109, 4) => level.chunks(4).map(|n| f32::from_le_bytes(n.try_into().unwrap())).collect(),
            other => panic!("VkFormat {other:?}"),
        };
        let texels: Vec<[f32; 4]> = numbers.chunks(4).map(|texel| texel.try_into().unwrap()).collect();
        assert_eq!(texels.len(), width * height);
        Self { width, height, metadata, texels }
    }

    fn number(&self, key: &str) -> usize {
        self.metadata[&format!("specula.{key}")].parse().unwrap()
    }

    /// The matrices of a vertex, one for each channel: [channel][row][column].
    fn matrices(&self, [column, row]: [f32; 2]) -> Vec<Vec<Vec<f32>>> {
        let [columns, rows] = ["degree", "output-degree"].map(|key| (self.number(key) + 1).pow(2));
        let mut run = self.texels[row as usize * self.width + column as usize..].iter().copied();
        let mut entries = || {
            let texels: Vec<[f32; 4]> = run.by_ref().take(columns.div_ceil(4)).collect();
            let (entries, rest) = texels.as_flattened().split_at(columns);
            assert!(rest.iter().all(|zero| *zero == 0.0));
            entries.to_vec()
        };
        (0..self.number("channels")).map(|_| (0..rows).map(|_| entries()).collect()).collect()
    }
}

fn table(degree: usize) -> BrdfTable {
    let brushed = case("tabulate-brdf", &format!("resolution = 16\ndegree = {degree}"));
    (*brushed.input("material", Material(crate::brdf_table::brushed().0)).artifact::<BrdfTable>()).clone()
}

/// A vertex' frame and place, as the file has them: x, z, and the column and row of its first texel.
fn frames(mesh: &Read) -> impl Iterator<Item = (DVec3, DVec3, [f32; 2])> {
    let [x, z] = ["_TRANSFER_X", "_TRANSFER_Z"].map(|name| mesh.attribute::<4>(name));
    x.into_iter().zip(z).map(|(x, z)| (ours(x), ours(z), [x[3], z[3]]))
}

/// A vector of a file, whose x, y and z are our y, z and x.
fn ours<const N: usize>(vector: [f32; N]) -> DVec3 {
    DVec3::new(vector[2].into(), vector[0].into(), vector[1].into())
}

/// What the shader of docs/relighting.md computes, of what is in the files.
fn relit(mesh: &Read, texture: &Ktx2, table: &BrdfTable, camera: DVec3) -> Vec<[f32; 3]> {
    let positions = mesh.attribute::<3>("POSITION").into_iter().map(ours);
    let light = sky_lighting().0.series;
    let radiance = positions.zip(frames(mesh)).map(|(position, (x, z, place))| {
        let view = (camera - position).normalize();
        let view = DVec3::new(x.dot(view), z.cross(x).dot(view), z.dot(view));
        let mut c = vec![0.0; table.0.texel()];
        table.0.lookup_into(0, Direction::normalised(view), &mut c);
        let matrices = texture.matrices(place);
        [0, 1, 2].map(|channel| {
            let rows = &matrices[channel.min(matrices.len() - 1)];
            let row = |(row, c): (&Vec<f32>, &[f32])| {
                let arriving = row.iter().zip(light.coefficients());
                c[channel] * arriving.map(|(entry, rgb)| entry * rgb[channel] as f32).sum::<f32>()
            };
            rows.iter().zip(c.chunks(3)).map(row).sum()
        })
    });
    radiance.collect()
}

#[test]
fn matrices_shade_as_shade_vertices_does() {
    let camera = DVec3::new(-3.0, 1.0, 2.0);
    // A half rounds an entry of a visibility's matrix by up to 2.4e-4 of itself; those of stored halves not.
    for (parameters, numbers, degree, limit) in [
        ("", "half", 4, 2e-6),
        ("", "float", 3, 2e-6),
        ("degree = 2\noutput-degree = 4", "half", 4, 2e-6),
        ("degree = 2\nbounces = 2", "half", 2, 2e-6),
        ("form = \"visibility\"", "float", 4, 1e-5),
        ("form = \"visibility\"", "half", 4, 1e-3),
    ] {
        let (transfer, table) = (baked(parameters), table(degree));
        let ran = export(&format!("matrices = \"{numbers}\"")).input("transfer", transfer.clone()).run();
        let ran = ran.unwrap();
        let [texture, mesh] = ran.files()[..] else { panic!("two files") };
        let (texture, mesh) = (Ktx2::of(texture), Read::of(mesh));
        assert_eq!(mesh.json["meshes"][0]["extras"]["matrices"], "matrices.ktx2");
        assert_eq!(texture.number("channels"), if parameters.contains("bounces") { 3 } else { 1 });
        assert_eq!(texture.metadata["specula"], r#"{"kind":"export-gltf"}"#);
        let expected = case("shade-vertices", "camera = [-3, 1, 2]")
            .input("mesh", pit())
            .input("table", table.clone())
            .input("lighting", sky_lighting())
            .input("transfer", transfer)
            .artifact::<VertexRadiance>();
        let error = difference(&relit(&mesh, &texture, &table, camera), &expected.0.value);
        assert!(error < limit, "{parameters} {numbers}: {error}");
    }
}

/// Nine vertices of 175 texels lie side by side.
#[test]
fn entries_are_those_of_the_transfer() {
    let transfer = baked("");
    let transfer::Form::Matrices(stored) = transfer.0.value.form() else { panic!("matrices") };
    let ran = export("matrices = \"half\"").input("transfer", transfer.clone()).run().unwrap();
    let (texture, mesh) = (Ktx2::of(ran.files()[0]), Read::of(ran.files()[1]));
    assert_eq!((texture.width, texture.height), (9 * 175, 1));
    assert!(ran.notes[0].starts_with("matrices.ktx2 has 1575 x 1 texels: 13."), "{:?}", ran.notes);
    for (vertex, (x, z, place)) in frames(&mesh).enumerate() {
        let [nx, ny, nz] = pit().0.normals()[vertex];
        let [tx, ty, tz, _] = pit().0.tangents()[vertex];
        assert_eq!((x.as_vec3().to_array(), z.as_vec3().to_array()), ([tx, ty, tz], [nx, ny, nz]));
        assert_eq!(place, [175.0 * vertex as f32, 0.0]);
        let expected = &stored.values()[625 * vertex..][..625];
        assert_eq!(
            texture.matrices(place)[0].concat(),
            expected.iter().map(|e| e.to_f32()).collect::<Vec<_>>()
        );
    }
}

/// A texture of many vertices has several rows; the last one is filled with zeros.
#[test]
fn rows_of_the_texture_follow_each_other() {
    let count = 30;
    let mesh = Mesh(flat(count));
    let values = (0..count * 625).map(|k| (k / 625) as f32).collect();
    let ran = case("export-gltf", "matrices = \"half\"")
        .input("mesh", mesh.clone())
        .input("transfer", of_mesh(matrices(4, values), &mesh))
        .run()
        .unwrap();
    let texture = Ktx2::of(ran.files()[0]);
    assert_eq!((texture.width, texture.height), (23 * 175, 2));
    for vertex in 0..count {
        let place = [vertex % 23 * 175, vertex / 23].map(|place| place as f32);
        assert_eq!(texture.matrices(place)[0], vec![vec![vertex as f32; 25]; 25]);
    }
    assert!(texture.texels[30 * 175..].iter().flatten().all(|number| *number == 0.0));
}

/// Vertices of a plane, of which the first three are a triangle.
fn flat(count: usize) -> mesh::Mesh {
    let normals = vec![[0.0, 0.0, 1.0]; count];
    let positions = (0..count).map(|k| [(k / 2) as f32, (k % 2) as f32, 0.0]).collect();
    mesh::Mesh::new(positions, normals, vec![[1.0, 0.0, 0.0, 1.0]; count], None, vec![[0, 1, 2]]).unwrap()
}

/// Matrices of these entries, of one degree on both sides.
fn matrices(degree: usize, values: Vec<f32>) -> transfer::Form {
    let degree = Degree::new(degree).unwrap();
    let matrices = transfer::Transfer::new(degree, degree, values).unwrap();
    transfer::Form::Matrices(transfer::HalfTransfer::of(&matrices))
}

fn of_mesh(form: transfer::Form, mesh: &Mesh) -> Transfer {
    let value = transfer::StoredTransfer::new(vec![form]).unwrap();
    Transfer(containers::tensors::OfMesh { value, mesh: Digest::of(&mesh.encode().unwrap()).to_string() })
}

#[test]
fn what_has_no_texture_is_an_error() {
    assert_eq!(export("matrices = \"half\"").failure(), "`matrices` needs a transfer, but none is connected");
    assert_eq!(
        export("matrices = \"half\"").input("transfer", baked("form = \"matte\"")).failure(),
        "the transfer is matte, so it has no matrices"
    );
    // In colours a row of a texture has no room for the matrices of one vertex.
    let wide = baked("degree = 8\noutput-degree = 8\nbounces = 1");
    assert_eq!(
        export("matrices = \"half\"").input("transfer", wide).failure(),
        "the matrices of a vertex take 5103 texels, but a row of a texture has 4096"
    );
    // Two vertices of degree 8 lie side by side.
    let (degree, count) = (Degree::new(8).unwrap(), 2 * 8192 + 1);
    let mesh = Mesh(flat(count));
    let visibility = transfer::Visibility::new(degree, degree, vec![0.0; 289 * count]).unwrap();
    let case = case("export-gltf", "matrices = \"half\"").input("mesh", mesh.clone());
    assert_eq!(
        case.input("transfer", of_mesh(transfer::Form::Visibility(visibility), &mesh)).failure(),
        "the matrices of 16385 vertices do not fit into a texture, which has room for 16384"
    );
    let mut broken = vec![1.0; 9];
    broken[4] = f32::NAN;
    assert_eq!(
        export("matrices = \"half\"").input("transfer", of_mesh(matrices(0, broken), &pit())).failure(),
        "a number of the transfer at vertex 4 is not finite"
    );
}

#[test]
fn an_asset_gets_the_same_as_a_file_of_its_own() {
    let with = |parameters: &str| {
        let asset = export("").run().unwrap().files()[0].to_vec();
        let case = export(&format!("matrices = \"half\"\n{parameters}")).file("a.glb", asset);
        let ran = case.input("transfer", baked("")).run().unwrap();
        let mesh = Read::of(ran.files()[1]);
        assert_eq!(mesh.json["meshes"][0]["extras"]["matrices"], "matrices.ktx2");
        (ran.files()[0].to_vec(), frames(&mesh).collect::<Vec<_>>())
    };
    assert_eq!(with("gltf = \"a.glb\""), with(""));
}

/// The square's asset has no normals, so that some of its vertices are corners of two triangles here.
#[test]
fn a_vertex_of_an_asset_has_one_matrix() {
    let mesh = square().artifact::<Mesh>();
    let (text, bytes) = square_files();
    let transfer = of_mesh(matrices(0, vec![1.0; mesh.0.positions().len()]), &mesh);
    let case = case("export-gltf", "gltf = \"a.gltf\"\nmatrices = \"half\"")
        .file("a.gltf", text)
        .file("square.bin", bytes)
        .input("mesh", (*mesh).clone())
        .input("transfer", transfer);
    assert_eq!(case.failure(), "4 vertices of a.gltf became several vertices, each with its own matrix");
}
