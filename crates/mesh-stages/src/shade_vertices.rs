//! Shades the vertices of a mesh with a BRDF table under soft light, and gives their radiance toward a
//! viewer.
//!
//! ```toml
//! [stage.shaded]
//! kind = "shade-vertices"
//! inputs = { mesh = "mesh", table = "table", lighting = "lighting", transfer = "transfer" }
//! view = [1, 0, 0.3]
//!
//! [stage.sunlit]                     # the sun with sharp shadows, the sky with soft ones
//! kind = "shade-vertices"
//! inputs = { mesh = "mesh", table = "table", lighting = "sky", transfer = "transfer", material = "metal" }
//! camera = [4, 0, 1]
//! ```
//!
//! > B(v) = sum over i of c_i(v) L_i
//!
//! (Kautz, Sloan and Snyder 2002, equation 1 and section 4): c_i comes from `tabulate-brdf`, at the view in
//! the vertex's frame (x the tangent, z the normal, y = z x x); L_i are the coefficients of the light in
//! that frame. The table can be of any material, brushed or not; the mesh's tangents are the direction of
//! brushing (`brush-mesh` sets them). Light and table are truncated to the lower of their degrees.
//!
//! `lighting` is far away and the same for all vertices, or a `light-field`, which differs from place to
//! place.
//!
//! ## Lamps
//!
//! Separate lights (`project-sh`, `circular-lights`), and those of a second lighting at `lights`, are added
//! to the series, up to its degree, so small lamps are not sharp. If you also connect the `material` of the
//! table, the material itself shades them instead (Kautz, Sloan and Snyder 2002, section 7):
//!
//! > B(v) += integral over each disk of L V(s) rho_hat(s, v) ds
//!
//! where the integral is a sum over `shadow-rays` directions spread over the disk, with a ray in each that
//! tests whether the mesh is in the way. Highlights and the edges of shadows are then as sharp as the size
//! of the lamp allows. Lamps in the series, and those of the lightings of a `light-field`, stay soft. If a
//! lamp is much wider than the highlight, it needs more rays, or should be in the series. A table of
//! several materials has no single material, so its lamps stay in the series.
//!
//! ## Shadows
//!
//! If you connect the `transfer` of the same mesh (`precompute-transfer`), the mesh shadows itself: B = sum
//! of c_i (T L)_i.
//!
//! If a table has several materials, `blend`, a number at each vertex (`vertex-blend`), blends between
//! them: 0 is the first material, 1 the last. Another blend or another table needs no new transfer.
//!
//! ## View
//!
//! The viewer is far away in the direction `view`, or at the position `camera`. Results are linear, in the
//! light's unit, and signed, because a series rings below zero near bright lamps; the build reports how
//! many vertices do, as a warning if they are more than 1 %.

use brdf::BrdfTable;
use containers::tensors::OfMesh;
use engine::{
    Artifact, Context, Digest, Failure, Inputs, Kind, Output, Port, Product, Reporter, Steps, parameters,
};
use sh::{Degree, Expansion, Light, Lighting};
use stages::artifacts;
use stages::plugin::{Place, UntilStopped, Vector, blended_frames, report_loss};
use transfer::{Frames, LightField, Occluders, StoredTransfer, Viewer, shade, shade_lights};

parameters! {
    /// Parameters of `shade-vertices`.
    pub(crate) struct Parameters {
        /// The direction from the mesh toward a distant viewer. Default: [1, 0, 0].
        view: Option<Vector> = None,
        /// The position of the viewer, in the mesh's unit, instead of `view`.
        camera: Option<Place> = None,
        /// With `material`: the number of rays toward each lamp, spread over its disk; 0 casts no shadows.
        #[range(0..=4096)]
        shadow_rays: usize = 16,
    }
}

/// The kind `shade-vertices`.
pub(crate) struct ShadeVertices;

impl Kind for ShadeVertices {
    type Parameters = Parameters;

    const NAME: &'static str = "shade-vertices";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] =
        &[transfer::revisions::SHADING, transfer::revisions::LIGHTS, brdf::revisions::MODELS];
    const TEXT: &'static str = include_str!("shade_vertices.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Mesh>("mesh"),
            Port::one::<artifacts::BrdfTable>("table"),
            Port::one::<artifacts::Lighting>("lighting").or::<artifacts::LightField>(),
            Port::one::<artifacts::Transfer>("transfer").optional(),
            Port::one::<artifacts::VertexBlend>("blend").optional(),
            Port::one::<artifacts::Lighting>("lights").optional(),
            Port::one::<artifacts::Material>("material").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::VertexRadiance::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match (parameters.view, parameters.camera) {
            (Some(_), Some(_)) => vec![("camera", "view already sets the viewer".into())],
            _ => Vec::new(),
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let mesh = context.inputs.get::<artifacts::Mesh>("mesh")?;
        let table = &context.inputs.get::<artifacts::BrdfTable>("table")?.0;
        let transfer = context.inputs.optional::<artifacts::Transfer>("transfer")?;
        let digest = Digest::of(&context.inputs.bytes("mesh")?).to_string();
        if let Some(transfer) = &transfer
            && transfer.0.mesh != digest
        {
            return Err(Failure::new("the transfer belongs to another mesh")
                .help("connect the mesh that precompute-transfer used, including its tangents"));
        }
        let viewer = match (parameters.camera, parameters.view) {
            (Some(Place(place)), _) => Viewer::At(place),
            (None, view) => Viewer::Distant(view.unwrap_or(Vector([1.0, 0.0, 0.0])).direction()),
        };
        let material = context.inputs.optional::<artifacts::Material>("material")?;
        if material.is_some() && table.count() > 1 {
            let count = table.count();
            return Err(Failure::new(format!(
                "the table has {count} materials, but lamps are shaded with a single one"
            ))
            .help("leave out `material`; then the lamps are added to the series"));
        }
        let frames = blended_frames(context, &mesh.0, table)?;
        if transfer.as_ref().is_some_and(|transfer| transfer.0.value.len() != frames.len()) {
            return Err(Failure::new("the transfer and the mesh have different numbers of vertices"));
        }
        let (soft, lamps) = light(&context.inputs, material.is_some())?;
        let transfer = transfer.as_ref().map(|transfer| &transfer.0.value);
        let mut value = shade_soft(reporter, &frames, table, viewer, transfer, &soft)?;
        if let Some(material) = &material {
            let occluders = (parameters.shadow_rays > 0).then(|| Occluders::of(&mesh.0));
            let count = if parameters.shadow_rays > 0 { parameters.shadow_rays } else { UNSHADOWED };
            let steps = Steps::new(reporter, frames.len().div_ceil(8));
            let lit = steps.until_stopped(|stop| {
                shade_lights(&frames, occluders.as_ref(), &material.0, viewer, &lamps, count, stop)
            })?;
            for (sum, lit) in value.iter_mut().zip(lit) {
                (0..3).for_each(|channel| sum[channel] += lit[channel]);
            }
            reporter.note(match lamps.len() {
                0 => "there are no separate lamps, so the material is not used".to_owned(),
                1 => "the material shades 1 lamp".to_owned(),
                lamps => format!("the material shades {lamps} lamps"),
            });
        }
        let negative = value.iter().filter(|rgb| rgb.iter().any(|value| *value < 0.0)).count();
        if negative > 0 {
            let part = negative as f64 / value.len() as f64;
            let what = "the vertices are below zero in a channel, which a renderer shows as black";
            let help = "connect `material`, which keeps lamps out of the series, or set non-negative = \"nearest\" in \
                        the light's project-sh";
            report_loss(reporter, part, what, help);
        }
        Output::artifact(artifacts::VertexRadiance(OfMesh { value, mesh: digest }))
    }
}

/// The number of directions over a disk at which light without shadows is taken.
const UNSHADOWED: usize = 16;

/// Light as a series.
enum Soft {
    /// The light is the same for all vertices.
    Distant(Expansion),
    /// The light is blended at each vertex.
    Near(LightField),
}

impl Soft {
    fn degree(&self) -> Degree {
        match self {
            Self::Distant(light) => light.degree(),
            Self::Near(field) => field.degree(),
        }
    }
}

/// The series of all light, and the lamps beside it; with `apart` false they are in the series.
fn light(inputs: &Inputs, apart: bool) -> Result<(Soft, Vec<Light>), Failure> {
    let more = inputs.optional::<artifacts::Lighting>("lights")?;
    let taken = |lighting: Lighting| match apart {
        true => (lighting.series, lighting.lights),
        false => (lighting.whole(), Vec::new()),
    };
    if inputs.type_at("lighting") == Some(artifacts::LightField::TYPE) {
        let field = inputs.get::<artifacts::LightField>("lighting")?.0.clone();
        let Some(more) = more else { return Ok((Soft::Near(field), Vec::new())) };
        let (series, lamps) = taken(more.0.clone());
        return Ok((Soft::Near(field.plus(&series)), lamps));
    }
    let lighting = &inputs.get::<artifacts::Lighting>("lighting")?.0;
    let (series, lamps) = taken(more.map_or_else(|| lighting.clone(), |more| lighting + &more.0));
    Ok((Soft::Distant(series), lamps))
}

/// The radiance of each vertex under a series.
fn shade_soft(
    reporter: &Reporter,
    frames: &Frames,
    table: &BrdfTable,
    viewer: Viewer,
    transfer: Option<&StoredTransfer>,
    soft: &Soft,
) -> Result<Vec<[f32; 3]>, Failure> {
    let Some(transfer) = transfer else {
        note_cut(reporter, ("light", soft.degree()), ("table", table.degree()));
        return Ok(match soft {
            Soft::Distant(light) => shade(frames, table, viewer, light),
            Soft::Near(field) => field.shade(frames, table, viewer),
        });
    };
    let form = transfer.form();
    note_cut(reporter, ("light", soft.degree()), ("transfer's F", form.input()));
    if let Some(output) = form.output() {
        note_cut(reporter, ("table", table.degree()), ("transfer's O", output));
    }
    if table.lit_from_below() {
        reporter.note("light from below the horizon, which this material reflects, is not shadowed");
    }
    let found = match soft {
        Soft::Distant(light) => transfer.shade(frames, table, viewer, light),
        Soft::Near(field) => field.shade_with_transfer(frames, table, viewer, transfer),
    };
    found.map_err(|error| Failure::from(error).help("bake the transfer in another form"))
}

/// Notes that the one of higher degree is cut to the lower.
fn note_cut(reporter: &Reporter, a: (&str, Degree), b: (&str, Degree)) {
    let ((low, least), (high, most)) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    if least < most {
        reporter.note(format!("the {low} ends at degree {}, the {high} at {}", least.get(), most.get()));
    }
}
