//! Brushes a mesh: sets the direction in which an anisotropic material is stretched, its tangents.
//!
//! `roughness_x` and `exponent_x` of a material are along the tangent, which a file gives for its textures'
//! sake. With `vector` the tangent of each vertex is that vector projected into the surface, T = b - N (N.b),
//! normalised (Kautz, Sloan and Snyder 2002, section 6). `turn` then turns it about the normal: to cos(a) T +
//! sin(a) B, B = w (N x T), w the sign of the mesh's tangent. Without `vector` the mesh's own tangents are
//! turned.
//!
//! Where the vector is parallel to the normal it has no direction in the surface; there the mesh's own
//! tangent stays, and a warning counts those vertices. Put this stage before `precompute-transfer` and
//! `shade-vertices`, both of which take the frames of the mesh that arrives.
//!
//! ## Example
//!
//! ```toml
//! [stage.brushed]
//! kind = "brush-mesh"
//! input = "mesh"
//! vector = [0, 0, 1]
//! ```

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};

use crate::artifacts;
use crate::vector::Vector;

parameters! {
    /// Parameters of `brush-mesh`.
    pub(crate) struct Parameters {
        /// The vector that is projected into the surface. Default: the mesh's own tangents.
        vector: Option<Vector> = None,
        /// The turn about the normal, in degrees.
        turn: f64 = 0.0,
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

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = &context.get::<artifacts::Mesh>("mesh")?.0;
        let vector = parameters.vector.map(|Vector(vector)| vector);
        let (brushed, parallel) = mesh.brushed(vector, parameters.turn.to_radians());
        if parallel > 0 {
            let of = mesh.positions().len();
            context.warn(format!(
                "{parallel} of {of} vertices have a normal parallel to the vector and keep their own tangents"
            ));
        }
        Output::artifact(artifacts::Mesh(brushed))
    }
}
