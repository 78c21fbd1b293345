//! Brushes a mesh: sets its tangents, the direction in which an anisotropic material is stretched.
//!
//! ```toml
//! [stage.brushed]
//! kind = "brush-mesh"
//! input = "mesh"
//! vector = [0, 0, 1]
//! ```
//!
//! `roughness_x` and `exponent_x` of a material are along the tangent, which mesh files define for their
//! textures. With `vector` the tangent of each vertex is that vector b projected into the surface, T = b -
//! N (N.b), normalised (Kautz, Sloan and Snyder 2002, section 6). Then `turn` turns it about the normal to
//! cos(a) T + sin(a) B, with B = w (N x T) and w the sign of the mesh's tangent. Without `vector`, `turn`
//! turns the mesh's own tangents.
//!
//! `gltf` names a file whose material has `KHR_materials_anisotropy`: its rotation, and the direction in
//! its texture at the mesh's texture coordinates, turn the tangents before `turn` does (anticlockwise from
//! the tangent toward the bitangent, as glTF says). Its strength is not read, because roughness belongs to
//! the material.
//!
//! ```toml
//! [stage.brushed]
//! kind = "brush-mesh"
//! input = "mesh"
//! gltf = "assets/meshes/record.glb"
//! material = "vinyl"
//! ```
//!
//! At vertices whose normal is parallel to the vector, it has no direction in the surface; there the mesh's
//! own tangent stays, and a warning counts these vertices. Put this stage before `precompute-transfer` and
//! `shade-vertices`, which both use the frames of their input mesh.

use std::path::Path;

use containers::{Anisotropy, read_gltf_anisotropy};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use mesh::Mesh;
use stages::artifacts;
use stages::plugin::{ChosenMaterial, Vector};

parameters! {
    /// Parameters of `brush-mesh`.
    pub(crate) struct Parameters {
        /// The vector that is projected into the surface. Default: the mesh's own tangents.
        vector: Option<Vector> = None,
        /// The turn about the normal, in degrees.
        turn: f64 = 0.0,
        /// A glTF file, relative to the manifest, with a material that says how to turn the tangents.
        gltf: Option<String> = None,
        /// The material in that file. Default: the only one.
        material: Option<ChosenMaterial> = None,
    }
}

/// The kind `brush-mesh`.
pub(crate) struct BrushMesh;

impl Kind for BrushMesh {
    type Parameters = Parameters;

    const NAME: &'static str = "brush-mesh";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("brush_mesh.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Mesh>("mesh")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Mesh::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match (&parameters.gltf, &parameters.material) {
            (None, Some(_)) => vec![("material", "also needs the file: gltf = \"...\"".into())],
            _ => Vec::new(),
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = &context.inputs.get::<artifacts::Mesh>("mesh")?.0;
        let vector = parameters.vector.map(|Vector(vector)| vector);
        let turn = parameters.turn.to_radians();
        let (brushed, parallel) = match &parameters.gltf {
            Some(file) => {
                let turns = turns(file, parameters.material.as_ref(), mesh, context)?;
                mesh.brushed(vector, |vertex| turn + turns[vertex])
            }
            None => mesh.brushed(vector, |_| turn),
        };
        if parallel > 0 {
            let of = mesh.positions().len();
            context.reporter.warn(format!(
                "{parallel} of {of} vertices have a normal parallel to the vector and keep their own tangents"
            ));
        }
        Output::artifact(artifacts::Mesh(brushed))
    }
}

/// The turn of each vertex by the anisotropy of a material.
fn turns(
    file: &str,
    material: Option<&ChosenMaterial>,
    mesh: &Mesh,
    context: &Context<'_>,
) -> Result<Vec<f64>, Failure> {
    let bytes = context.files.read(Path::new(file))?;
    let folder = Path::new(file).parent().unwrap_or(Path::new(""));
    let mut beside = |other: &str| context.files.read(&folder.join(other));
    let choice = material.map(|ChosenMaterial(choice)| choice);
    let anisotropy: Anisotropy = read_gltf_anisotropy(&bytes, choice, &mut beside)
        .map_err(|failure: Failure| failure.context(format!("cannot brush with {file}")))?;
    anisotropy.warnings.iter().for_each(|warning| context.reporter.warn(format!("{file}: {warning}")));
    let vertices = mesh.positions().len();
    match mesh.coordinates() {
        Some(coordinates) => Ok(coordinates.iter().map(|place| anisotropy.angle(*place)).collect()),
        None if anisotropy.has_texture() => Err(Failure::new(format!(
            "the mesh has no texture coordinates, but the material of {file} needs them"
        ))
        .help("use `vector` and `turn`, or a mesh with coordinates")),
        None => Ok(vec![anisotropy.angle([0.0; 2]); vertices]),
    }
}
