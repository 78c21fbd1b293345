//! Bakes the shadows that a mesh casts on itself, and the light that it reflects onto itself, for every
//! light at once, as a transfer matrix for each vertex.
//!
//! ```toml
//! [stage.transfer]
//! kind = "precompute-transfer"
//! input = "mesh"
//! degree = 4
//! directions = 4096
//!
//! [stage.room]                       # with the light that its walls reflect
//! kind = "precompute-transfer"
//! inputs = { mesh = "mesh", material = "plaster" }
//! bounces = 3
//! ```
//!
//! > T_ij = integral over s of V(s) Y_i(R_p s) Y_j(s)
//!
//! (Kautz, Sloan and Snyder 2002, section 5), with V = 1 in directions in which the vertex sees the sky,
//! and R_p the rotation into its frame, whose rows are the tangent x, y = N x x, and the normal N. T times
//! the coefficients of a light is the light that reaches the vertex, in its own frame. The material is not
//! part of T, so a new material or a new light needs no rays.
//!
//! Rays start a little above the vertex and are blocked by triangles from either side. Below the vertex's
//! own horizon V is always 1, because materials reflect nothing from there. So an unoccluded vertex has T =
//! R_p, and shading with and without transfer agree, except for rounding. The exceptions are `phong` and
//! `kajiya-kay`, which do reflect light from below the horizon; that light is not shadowed.
//!
//! ## Interreflection
//!
//! With `bounces = n` and a `material`, T also includes the light that reaches the vertex via 1 to n other
//! places of the mesh:
//!
//! > T_ij += integral over the blocked s of Y_i(R_p s) times the radiance under Y_j, toward the vertex, of
//! > the surface that blocks s
//!
//! The material of the surface that is hit gives that radiance, in its own frames, blended between the
//! corners of the triangle; back faces are black. The material is then part of the result, so a new one
//! needs a new bake. `material` also takes a table of `tabulate-brdf`, even one of several materials with a
//! `blend` of `vertex-blend` that says which material is where. If it has colours, red, green and blue each
//! have a transfer. Matte rooms are accurate to 1 percent; glossy corners to 7 percent of the radiance at O
//! = 4, and 1 percent at O = 6. If everything is matte, bounces cost little.
//!
//! ## Degrees
//!
//! `degree` is F, the degree of the environment. `output-degree` is O, the degree of the light that
//! arrives: shadows have edges, which glossy materials show. Compared with exact shadowed radiance, the RMS
//! error of brushed metal next to a sphere is 1.1 % at O = 4, 0.6 % at 6 and 0.15 % at 8. The table of the
//! material should have the degree O.
//!
//! The directions are points of a spiral, with weights that integrate products of harmonics exactly. Next
//! to a sphere, entries of T are within 0.005 with 4,096 of them and within 0.0015 with 16,384. The build
//! warns if vertices do not see the sky at all: they are inside the mesh, or its triangles face inward.
//!
//! ## Forms
//!
//! | `form` | bytes for each vertex, O = F = 4 | use |
//! | --- | --- | --- |
//! | `matrices` | 2 (O+1)^2 (F+1)^2 = 1,250 | everything, rounded by 2.4e-4 of each entry |
//! | `visibility` | 4 (O+F+1)^2 = 324 | exact shadows; the matrix is computed when shading |
//! | `matte` | 4 (F+1)^2 = 100 | only `lambert`: the response of a white matte surface, for which O does not matter |
//!
//! Matrices are stored in 16-bit numbers; entries below 6.1e-5 become 0. For engines, `export-gltf` writes
//! the vectors of `matte` into a glTF file, and the matrices of the two other forms into a texture next to
//! it; docs/relighting.md has the shaders.
//!
//! A transfer of more than 4 GB is refused before the first ray; interreflection keeps the matrices of two
//! bounces in memory, for each channel, in 32-bit numbers. A smaller form, lower degrees or fewer vertices
//! help.

use brdf::{BrdfTable, tabulate};
use containers::tensors::OfMesh;
use engine::{Artifact, Context, Digest, Failure, Kind, Output, Port, Product, choice, parameters};
use sh::{Degree, Stop};
use stages::artifacts;
use stages::plugin::{UntilStopped, blended_frames, size};
use transfer::{
    Directions, Form, Frames, HalfTransfer, MatteTransfer, Occluders, ReflectingMesh, StoredTransfer,
    Transfer, TransferDegrees, TransferError, Visibility, interreflect, interreflect_matte, precompute,
    reflection_bytes,
};

choice! {
    /// The form of a transfer.
    pub(crate) enum FormName {
        /// Matrices of 16-bit numbers.
        Matrices = "matrices",
        /// The coefficients of the visibility.
        Visibility = "visibility",
        /// The response of a white matte surface.
        Matte = "matte",
    }
}

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
        /// How often the mesh reflects light before it arrives; needs a `material` if above 0.
        #[range(0..=64)]
        bounces: usize = 0,
        /// What is stored; see Forms.
        form: FormName = FormName::Matrices,
    }
}

/// The edge of the tables of views that materials reflect with.
const TABLE: usize = 64;

impl Parameters {
    fn output(&self) -> usize {
        self.output_degree.unwrap_or(self.degree)
    }

    /// The least number of directions that are sure to have exact weights.
    fn least(&self) -> usize {
        2 * (self.output() + self.degree + 1).pow(2)
    }

    /// The form of one channel, from matrices.
    fn form(&self, matrices: &Transfer) -> Form {
        match self.form {
            FormName::Matte => Form::Matte(MatteTransfer::of(matrices)),
            FormName::Matrices | FormName::Visibility => Form::Matrices(HalfTransfer::of(matrices)),
        }
    }
}

/// The kind `precompute-transfer`.
pub(crate) struct PrecomputeTransfer;

impl Kind for PrecomputeTransfer {
    type Parameters = Parameters;

    const NAME: &'static str = "precompute-transfer";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[
        transfer::revisions::TRANSFER,
        transfer::revisions::INTERREFLECTION,
        brdf::revisions::MODELS,
        brdf::revisions::TABLE,
    ];
    const TEXT: &'static str = include_str!("precompute_transfer.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Mesh>("mesh"),
            Port::one::<artifacts::Material>("material").or::<artifacts::BrdfTable>().optional(),
            Port::one::<artifacts::VertexBlend>("blend").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Transfer::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        let least = parameters.least();
        if parameters.directions < least {
            errors.push(("directions", format!("degrees O and F need at least {least}")));
        }
        if parameters.form == FormName::Visibility && parameters.bounces > 0 {
            errors.push(("bounces", "form = \"visibility\" holds only shadows".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let mesh = context.inputs.get::<artifacts::Mesh>("mesh")?;
        let digest = Digest::of(&context.inputs.bytes("mesh")?).to_string();
        let (output, input) = (Degree::new(parameters.output())?, Degree::new(parameters.degree)?);
        let degrees = TransferDegrees { output, input };
        let reflecting = reflecting(parameters, output, context)?;
        let frames = match &reflecting {
            Some(table) => blended_frames(context, &mesh.0, table)?,
            None => Frames::of(&mesh.0)?,
        };
        let exact = Degree::new(output.get() + input.get())?;
        let directions = Directions::new(parameters.directions, exact)
            .ok_or_else(|| Failure::new(format!("{} directions are too few", parameters.directions)))?;
        let occluders = Occluders::of(&mesh.0);
        let scene =
            TransferScene { frames: &frames, occluders: &occluders, directions: &directions, degrees };
        let (channels, blind) = reporter.until_stopped(|stop| {
            let found = match &reflecting {
                Some(table) => scene.reflected(parameters, table, stop),
                None => scene.shadowed(parameters, stop),
            };
            found.map_err(failure)
        })?;
        let value = StoredTransfer::new(channels)
            .ok_or_else(|| Failure::new("the channels of the transfer have different shapes"))?;
        if blind > 0 {
            let of = frames.len();
            reporter.warn(format!("{blind} of {of} vertices do not see the sky above their horizon"));
        }
        let (rows, columns) = (output.rows(), input.rows());
        let bytes = size(value.bytes() as u64);
        reporter.note(format!("{} vertices with {rows} x {columns} entries: {bytes}", frames.len()));
        Output::artifact(artifacts::Transfer(OfMesh { value, mesh: digest }))
    }
}

/// The failure of a bake, and what to do about one that is too large.
fn failure(error: TransferError) -> Failure {
    match error {
        TransferError::TooLarge { .. } => Failure::from(error).help(
            "choose a smaller `form`, lower `output-degree` or `degree`, or reduce the mesh's vertices",
        ),
        _ => Failure::from(error),
    }
}

/// Makes the table of the materials that reflect light, if any do.
fn reflecting(
    parameters: &Parameters,
    output: Degree,
    context: &Context<'_>,
) -> Result<Option<BrdfTable>, Failure> {
    let reporter = &context.reporter;
    let connected = context.inputs.type_at("material");
    if parameters.bounces == 0 {
        if connected.is_some() {
            reporter.note("`bounces` is 0: the material is not used");
        }
        if context.inputs.type_at("blend").is_some() {
            reporter.note("`bounces` is 0: the blend is not used");
        }
        return Ok(None);
    }
    match connected {
        Some(artifacts::BrdfTable::TYPE) => {
            Ok(Some(context.inputs.get::<artifacts::BrdfTable>("material")?.0.clone()))
        }
        Some(_) => {
            let material = context.inputs.get::<artifacts::Material>("material")?;
            let made = reporter.until_stopped(|stop| tabulate(&material.0, output, TABLE, stop))?;
            Ok(Some(made.0))
        }
        None => Err(Failure::new("`bounces` needs the material of the mesh, but none is connected")
            .help("connect `material`, or leave `bounces` at 0 for shadows only")),
    }
}

/// The mesh, directions and degrees of a bake.
struct TransferScene<'a> {
    frames: &'a Frames,
    occluders: &'a Occluders,
    directions: &'a Directions,
    degrees: TransferDegrees,
}

type Baked = Result<(Vec<Form>, usize), TransferError>;

impl TransferScene<'_> {
    /// Shadows alone, each form with as little memory as it can.
    fn shadowed(&self, parameters: &Parameters, stop: Stop<'_>) -> Baked {
        let &Self { frames, occluders, directions, degrees } = self;
        let (form, blind) = match parameters.form {
            FormName::Matrices => {
                let (matrices, blind) =
                    HalfTransfer::precompute(frames, occluders, directions, degrees, stop)?;
                (Form::Matrices(matrices), blind)
            }
            FormName::Matte => {
                let (matte, blind) =
                    MatteTransfer::precompute(frames, occluders, directions, degrees.input, stop)?;
                (Form::Matte(matte), blind)
            }
            FormName::Visibility => {
                let (v, blind) = Visibility::precompute(frames, occluders, directions, degrees, stop)?;
                (Form::Visibility(v), blind)
            }
        };
        Ok((vec![form], blind))
    }

    fn reflected(&self, parameters: &Parameters, table: &BrdfTable, stop: Stop<'_>) -> Baked {
        let &Self { frames, occluders, directions, degrees } = self;
        let mesh = ReflectingMesh { frames, occluders, directions, table };
        let bounces = parameters.bounces;
        if parameters.form == FormName::Matte {
            let found = interreflect_matte(mesh, degrees.input, bounces, stop)?;
            if let Some((channels, blind)) = found {
                return Ok((channels.into_iter().map(Form::Matte).collect(), blind));
            }
        }
        let room = reflection_bytes(frames.len(), degrees, table.channels());
        if room > transfer::MOST_BYTES {
            return Err(TransferError::TooLarge { vertices: frames.len(), bytes: room });
        }
        let (shadows, blind) = precompute(frames, occluders, directions, degrees, stop)?;
        let found = interreflect(mesh, &shadows, bounces, stop)?;
        Ok((found.iter().map(|matrices| parameters.form(matrices)).collect(), blind))
    }
}
