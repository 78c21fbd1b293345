//! Bakes the shadows that a mesh casts onto itself, for every light at once: a transfer matrix for each
//! vertex.
//!
//! > T_ij = integral over s of V(s) Y_i(R_p s) Y_j(s)
//!
//! (Kautz, Sloan and Snyder 2002, section 5), with V = 1 where the vertex sees the sky, and R_p the rotation
//! into its frame, whose rows are the tangent x, y = N x x, and the normal N. T times the coefficients of a
//! light is what arrives at the vertex, in its own frame. The material is not part of it: a new material, or
//! a new light, casts no ray.
//!
//! Rays start a little above the vertex and are blocked by triangles from either side. Below the vertex' own
//! horizon V is 1, always: materials reflect nothing from there. So an open vertex has T = R_p exactly, and
//! shading with and without transfer agree. The exceptions are `phong` and `kajiya-kay`, which do reflect
//! light from below the horizon; there it is not shadowed.
//!
//! ## Degrees
//!
//! `degree` is F, that of the light. `output-degree` is O, that of the light that arrives: shadows have
//! edges, which a glossy material shows. Against the shadowed radiance itself, the RMS error of brushed metal
//! next to a sphere is 1.1 % at O = 4, 0.6 % at 6 and 0.15 % at 8. The table of the material should have the
//! degree O. Each vertex takes 4 (O+1)^2 (F+1)^2 bytes: 2,500 for O = F = 4, 8,100 for O = 8.
//!
//! The directions are points of a spiral, with weights that integrate products of harmonics exactly. Next to
//! a sphere, entries of T are within 0.005 with 4,096 of them and within 0.0015 with 16,384. The build warns
//! if vertices see nothing of the sky: they are inside the mesh, or its triangles face inward.
//!
//! ## Example
//!
//! ```toml
//! [stage.transfer]
//! kind = "precompute-transfer"
//! input = "mesh"
//! degree = 4
//! directions = 4096
//! ```

use containers::tensors::OfMesh;
use engine::{Artifact, Context, Digest, Failure, Kind, Output, Port, Product, parameters};
use sh::Degree;
use transfer::{Directions, Frames, Occluders, TransferError, precompute_unless};

use crate::artifacts;
use crate::quantity::size;

parameters! {
    /// Parameters of `precompute-transfer`.
    pub(crate) struct Parameters {
        /// F, the degree of the light.
        #[range(0..=8)]
        degree: usize = 4,
        /// O, the degree of the light that arrives; see Degrees. Default: `degree`.
        #[range(0..=8)]
        output_degree: Option<usize> = None,
        /// The number of rays for each vertex, over the whole sphere; at least 2 (O + F + 1)^2.
        #[range(1..=65536)]
        directions: usize = 1024,
    }
}

impl Parameters {
    fn output(&self) -> usize {
        self.output_degree.unwrap_or(self.degree)
    }

    /// The least number of directions that are sure to have exact weights.
    fn least(&self) -> usize {
        2 * (self.output() + self.degree + 1).pow(2)
    }
}

/// The kind `precompute-transfer`.
pub(crate) struct PrecomputeTransfer;

impl Kind for PrecomputeTransfer {
    type Parameters = Parameters;

    const NAME: &'static str = "precompute-transfer";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[transfer::revisions::TRANSFER];
    const TEXT: &'static str = include_str!("precompute_transfer.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Mesh>("mesh")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Transfer::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let least = parameters.least();
        if parameters.directions < least {
            return vec![("directions", format!("degrees O and F need {least} or more"))];
        }
        Vec::new()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let mesh = context.get::<artifacts::Mesh>("mesh")?;
        let digest = Digest::of(&context.bytes("mesh")?).to_string();
        let degrees = (Degree::new(parameters.output())?, Degree::new(parameters.degree)?);
        let frames = Frames::of(&mesh.0)?;
        let exact = Degree::new(degrees.0.get() + degrees.1.get())?;
        let directions = Directions::new(parameters.directions, exact)
            .ok_or_else(|| Failure::new(format!("{} directions are too few", parameters.directions)))?;
        let stop = || context.check_cancelled().is_err();
        let found = precompute_unless(&frames, &Occluders::of(&mesh.0), &directions, degrees, &stop);
        context.check_cancelled()?;
        let (value, blind) = found.map_err(|error| match error {
            TransferError::TooLarge { .. } => {
                Failure::from(error).help("lower `output-degree` or `degree`, or reduce the mesh's vertices")
            }
            _ => Failure::from(error),
        })?;
        if blind > 0 {
            let of = frames.len();
            context.warn(format!("{blind} of {of} vertices see nothing of the sky above their horizon"));
        }
        context.note(format!(
            "{} vertices with {} x {} entries: {}",
            frames.len(),
            degrees.0.rows(),
            degrees.1.rows(),
            size(4 * value.values().len() as u64)
        ));
        Output::artifact(artifacts::Transfer(OfMesh { value, mesh: digest }))
    }
}
