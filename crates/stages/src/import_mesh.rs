//! Reads a mesh: the triangles of a glTF file, with a normal and a tangent at every vertex.
//!
//! `source` names glTF 2.0 files, `.gltf` or `.glb`. A glob gives one item per file. Buffers that lie beside a `.gltf` file
//! become part of the mesh: the item is rerun when one of them changes.
//!
//! All meshes of the default scene become one, where their nodes put them: lists, strips and fans of triangles. Points
//! and lines are left out. The mesh is turned from the file's frame (+Y up) into Specula's: the front of a model, which is
//! +Z in the file, looks along +X, toward the camera of a preview that stands at yaw 0.
//!
//! | what the file leaves out | what is made of it |
//! | --- | --- |
//! | normals | every triangle is flat, as the glTF specification asks; tangents of the file are then ignored |
//! | tangents | those of MikkTSpace, from the coordinates of the normal texture; without coordinates they lead east (Z x N), Z the mesh's own before a node turns it |
//!
//! What moves is seen as it rests: a skinned mesh is where the joints of its skin are, and its own node does not count.
//! Animations, morph targets, cameras and lights are ignored, and materials and textures too: what a surface looks like is
//! the matter of materials here. `KHR_mesh_quantization` and `EXT_meshopt_compression` are read. A file
//! that needs another extension for its triangles, such as `KHR_draco_mesh_compression`, is an error that names the
//! extension. At most 4,194,304 triangles are read.
//!
//! ## Example
//!
//! ```toml
//! [stage.mesh]
//! kind = "import-mesh"
//! source = "assets/meshes/*.{gltf,glb}"
//! ```

use std::path::Path;

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};

use crate::artifacts;

parameters! {
    /// `import-mesh` has no parameters: what a mesh is, its file says.
    pub(crate) struct Parameters {}
}

/// The kind `import-mesh`.
pub(crate) struct ImportMesh;

impl Kind for ImportMesh {
    type Parameters = Parameters;

    const NAME: &'static str = "import-mesh";
    const REVISION: u32 = 3;
    const TEXT: &'static str = include_str!("import_mesh.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Mesh::TYPE)
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let path = context.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let bytes = context.read(path).map_err(|failure| match context.is_folder(path) {
            true => Failure::new(format!("{file} is a folder, not a mesh"))
                .help("name a file, or every file in it: source = \"folder/*.{gltf,glb}\""),
            false => failure,
        })?;
        let mut beside = |other: &str| context.read(Path::new(other));
        let model = containers::read_gltf(&bytes, &mut beside)
            .map_err(|failure: Failure| failure.context(format!("cannot import {file}")))?;
        context.check_cancelled()?;
        model.notes.into_iter().for_each(|note| context.note(note));
        if model.mesh.triangles().is_empty() {
            context.warn("the mesh has no triangles");
        }
        Output::artifact(artifacts::Mesh(model.mesh))
    }
}
