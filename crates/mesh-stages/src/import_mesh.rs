//! Reads a mesh, the triangles of a glTF file with a normal and a tangent at every vertex.
//!
//! ```toml
//! [stage.mesh]
//! kind = "import-mesh"
//! source = "assets/meshes/*.{gltf,glb}"
//! ```
//!
//! `source` names glTF 2.0 files, `.gltf` or `.glb`. A glob gives one item per file. Buffer files of a
//! `.gltf` file are part of the mesh: the item reruns when one of them changes.
//!
//! All meshes of the default scene (lists, strips and fans of triangles) become one mesh, placed by their
//! nodes. Points and lines are skipped. The mesh is converted from the file's frame (+Y up) to Specula's:
//! the front of a model, which is +Z in the file, looks along +X, toward the camera of a preview at yaw 0.
//!
//! | missing in the file | what Specula does |
//! | --- | --- |
//! | normals | every triangle is flat, as the glTF specification requires; tangents in the file are then ignored |
//! | tangents | computed by MikkTSpace from the coordinates of the normal texture; without coordinates they point east (Z x N, with the Z axis of the mesh before a node turns it) |
//!
//! Animated meshes are read in their rest pose: a skinned mesh is placed by the joints of its skin, not by
//! its own node. Animations, morph targets, cameras and lights are ignored. The mesh records only the name
//! of each triangle's material: `specula preview` shows each triangle with its own material if the manifest
//! imports the materials of the same file. The look of a surface comes from `import-material`.
//! `export-gltf` with `gltf` writes into a copy of the file, and keeps everything in it. Notes name morph
//! targets, vertex colours and further sets of texture coordinates that are left out.
//! `KHR_mesh_quantization`, `EXT_meshopt_compression` and `EXT_mesh_gpu_instancing` (a mesh at many places)
//! are supported. If a file requires another extension, the error names it (`KHR_draco_mesh_compression`),
//! unless it only concerns materials, textures, lights or animations. At most 4,194,304 triangles are read,
//! counting each instance.
//!
//! Buffers can be in other folders (`../buffers/a.bin`). Their names are percent-encoded, as glTF requires,
//! or exactly as on the disk.

use std::io::{Seek as _, SeekFrom};
use std::path::Path;

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use stages::artifacts;

parameters! {
    /// `import-mesh` has no parameters: everything about a mesh is in its file.
    pub(crate) struct Parameters {}
}

/// The kind `import-mesh`.
pub(crate) struct ImportMesh;

impl Kind for ImportMesh {
    type Parameters = Parameters;

    const NAME: &'static str = "import-mesh";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[mesh::revisions::TANGENTS];
    const TEXT: &'static str = include_str!("import_mesh.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Mesh::TYPE)
    }

    fn check_source(_: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        if context.files.is_folder(path) {
            return Err(folder(&file));
        }
        let find = &mut |other: &str| Ok(context.files.open(Path::new(other))?.seek(SeekFrom::End(0))?);
        containers::check_gltf(&mut context.files.open(path)?, find)
            .map_err(|failure: Failure| failure.context(format!("cannot import {file}")))
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let read = context.files.read(path);
        let bytes =
            read.map_err(|failure| if context.files.is_folder(path) { folder(&file) } else { failure })?;
        let mut beside = |other: &str| context.files.read(Path::new(other));
        let model = containers::read_gltf(&bytes, &mut beside)
            .map_err(|failure: Failure| failure.context(format!("cannot import {file}")))?;
        reporter.check_cancelled()?;
        model.notes.into_iter().for_each(|note| reporter.note(note));
        if model.mesh.triangles().is_empty() {
            reporter.warn("the mesh has no triangles");
        }
        Output::artifact(artifacts::Mesh(model.mesh))
    }
}

fn folder(name: &str) -> Failure {
    Failure::new(format!("{name} is a folder, not a mesh"))
        .help("name a file, or every file in it: source = \"folder/*.{gltf,glb}\"")
}
