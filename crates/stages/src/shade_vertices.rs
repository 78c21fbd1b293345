//! Shades the vertices of a mesh with a BRDF table under soft light: their radiance toward a viewer.
//!
//! > B(v) = sum over i of c_i(v) L_i
//!
//! (Kautz, Sloan and Snyder 2002, equation 1 and section 4): c_i from `tabulate-brdf`, at the view in the
//! vertex' frame (x the tangent, z the normal, y = z x x); L_i the coefficients of the light in that frame.
//! The table may be that of any material, brushed or not; the mesh's tangents are the direction of brushing
//! (`brush-mesh` sets them). Light and table are cut to the lower of their degrees. Lights beside the series
//! are taken into it, to that degree: nothing of a small lamp is sharp.
//!
//! With `transfer` connected, of the same mesh (`precompute-transfer`), what the mesh itself hides is
//! missing: B = sum of c_i (T L)_i.
//!
//! A table of several materials is blended between them by `blend`, a number at each vertex (`vertex-blend`):
//! 0 is the first material, 1 the last. Another blend, or another table, needs no new transfer.
//!
//! The viewer is far away in the direction `view`, or at the place `camera`. Results are linear, in the
//! light's unit, and signed: a series rings below zero near bright lamps; the build notes how much does.
//!
//! ## Example
//!
//! ```toml
//! [stage.shaded]
//! kind = "shade-vertices"
//! inputs = { mesh = "mesh", table = "table", lighting = "lighting", transfer = "transfer" }
//! view = [1, 0, 0.3]
//! ```

use brdf::BelowHorizon;
use containers::tensors::OfMesh;
use engine::{Artifact, Context, Digest, Failure, Kind, Output, Port, Product, parameters};
use transfer::{Viewer, shade};

use crate::artifacts;
use crate::blended_frames::blended_frames;
use crate::share::share;
use crate::vector::Vector;

parameters! {
    /// Parameters of `shade-vertices`.
    pub(crate) struct Parameters {
        /// The direction from the mesh toward a viewer far away. Default: [1, 0, 0].
        view: Option<Vector> = None,
        /// The place of the viewer, in the mesh's unit, instead of `view`.
        camera: Option<Vector> = None,
    }
}

/// The kind `shade-vertices`.
pub(crate) struct ShadeVertices;

impl Kind for ShadeVertices {
    type Parameters = Parameters;

    const NAME: &'static str = "shade-vertices";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[transfer::revisions::SHADING];
    const TEXT: &'static str = include_str!("shade_vertices.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Mesh>("mesh"),
            Port::one::<artifacts::BrdfTable>("table"),
            Port::one::<artifacts::Lighting>("lighting"),
            Port::one::<artifacts::Transfer>("transfer").optional(),
            Port::one::<artifacts::VertexBlend>("blend").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::VertexRadiance::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match (parameters.view, parameters.camera) {
            (Some(_), Some(_)) => vec![("camera", "view already places the viewer".into())],
            _ => Vec::new(),
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = context.get::<artifacts::Mesh>("mesh")?;
        let table = &context.get::<artifacts::BrdfTable>("table")?.0;
        let lighting = &context.get::<artifacts::Lighting>("lighting")?.0;
        let transfer = context.optional::<artifacts::Transfer>("transfer")?;
        let digest = Digest::of(&context.bytes("mesh")?).to_string();
        if let Some(transfer) = &transfer
            && transfer.0.mesh != digest
        {
            return Err(Failure::new("the transfer is of another mesh")
                .help("connect the mesh that precompute-transfer was given, tangents included"));
        }
        let viewer = match (parameters.camera, parameters.view) {
            (Some(Vector(place)), _) => Viewer::At(place),
            (None, view) => Viewer::Distant(view.unwrap_or(Vector([1.0, 0.0, 0.0])).direction()),
        };
        let (frames, light) = (blended_frames(context, &mesh.0, table)?, lighting.whole());
        let degrees = [table.degree(), light.degree()].map(|degree| degree.get());
        if degrees[0] > degrees[1] {
            context.note(format!("the light ends at degree {}, the table at {}", degrees[1], degrees[0]));
        }
        let value = match &transfer {
            Some(transfer) => {
                if table.below() == BelowHorizon::Mirrored {
                    context
                        .note("light from below the horizon, which this material reflects, is not shadowed");
                }
                let found = transfer.0.value.shade(&frames, table, viewer, &light);
                found.map_err(|error| Failure::from(error).help("bake the transfer in another form"))?
            }
            None => shade(&frames, table, viewer, &light),
        };
        let negative = value.iter().filter(|rgb| rgb.iter().any(|value| *value < 0.0)).count();
        if negative > 0 {
            let part = negative as f64 / value.len() as f64;
            context.note(format!("{} of the vertices are below zero in a channel", share(part)));
        }
        Output::artifact(artifacts::VertexRadiance(OfMesh { value, mesh: digest }))
    }
}
