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
//! place, or light probes (`light-probes`), of which those around a vertex are blended that see it.
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
//! If a table has several materials, `blend`, a number at each vertex (`vertex-blend`), or two, blends
//! between them: 0 is the first material, 1 the last. Another blend or another table needs no new transfer.
//!
//! ## View
//!
//! The viewer is far away in the direction `view`, or at the position `camera`. Results are linear, in the
//! light's unit, and signed, because a series rings below zero near bright lamps; the build reports how
//! many vertices do, as a warning if they are more than 1 %.
//!
//! ## Window
//!
//! `window = "non-negative"` softens the series of the light by the weakest window that leaves no vertex
//! below zero for this viewer: the coefficients of degree l are divided by 1 + lambda l^2 (l + 1)^2 (Sloan
//! 2008, "Stupid spherical harmonics (SH) tricks"). A note names lambda and what the highest degree keeps,
//! as the warning does without the window. Other views may need more: take the one that needs most, or
//! soften the light for all of them with `window` of `project-sh`.

use brdf::BrdfTable;
use containers::tensors::OfMesh;
use engine::{
    Artifact, Context, Digest, Failure, Inputs, Kind, Output, Port, Product, Reporter, Steps, choice,
    parameters,
};
use sh::{Degree, Expansion, Light, Lighting, Penalty, Window};
use stages::artifacts;
use stages::plugin::{Place, UntilStopped, Vector, WARNED_LOSS, blended_frames, report_loss};
use transfer::{Frames, LightField, Occluders, StoredTransfer, Viewer, shade, shade_lights};

use crate::vertex_probes::VertexProbes;
use crate::viewer::{given_twice, viewer};

choice! {
    /// A window for the series of the light.
    pub(crate) enum WindowName {
        /// No window.
        None = "none",
        /// The weakest that leaves no vertex below zero.
        NonNegative = "non-negative",
    }
}

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
        /// What softens the series of the light; see Window.
        window: WindowName = WindowName::None,
    }
}

/// The kind `shade-vertices`.
pub(crate) struct ShadeVertices;

impl Kind for ShadeVertices {
    type Parameters = Parameters;

    const NAME: &'static str = "shade-vertices";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[
        transfer::revisions::SHADING,
        transfer::revisions::LIGHTS,
        brdf::revisions::MODELS,
        probes::revisions::BLEND,
    ];
    const TEXT: &'static str = include_str!("shade_vertices.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Mesh>("mesh"),
            Port::one::<artifacts::BrdfTable>("table"),
            Port::one::<artifacts::Lighting>("lighting")
                .or::<artifacts::LightField>()
                .or::<artifacts::Probes>(),
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
        given_twice(parameters.camera, parameters.view).into_iter().collect()
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
        let viewer = viewer(parameters.camera, parameters.view);
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
        let (soft, lamps) = light(&context.inputs, &frames, material.is_some())?;
        let transfer = transfer.as_ref().map(|transfer| &transfer.0.value);
        note_cuts(reporter, table, transfer, &soft);
        let shaded = |soft: &Soft| shade_soft(&frames, table, viewer, transfer, soft);
        let mut value = shaded(&soft)?;
        let mut of_lamps = vec![[0.0; 3]; value.len()];
        if let Some(material) = &material {
            let occluders = (parameters.shadow_rays > 0).then(|| Occluders::of(&mesh.0));
            let count = if parameters.shadow_rays > 0 { parameters.shadow_rays } else { UNSHADOWED };
            let steps = Steps::new(reporter, frames.len().div_ceil(8));
            of_lamps = steps.until_stopped(|stop| {
                shade_lights(&frames, occluders.as_ref(), &material.0, viewer, &lamps, count, stop)
            })?;
            add(&mut value, 1.0, &of_lamps);
            reporter.note(match lamps.len() {
                0 => "there are no separate lamps, so the material is not used".to_owned(),
                1 => "the material shades 1 lamp".to_owned(),
                lamps => format!("the material shades {lamps} lamps"),
            });
        }
        let negative = negative(&value);
        if negative > 0 {
            let part = negative as f64 / value.len() as f64;
            let what = "the vertices are below zero in a channel, which a renderer shows as black";
            let softened = match (parameters.window, part > WARNED_LOSS) {
                (WindowName::None, false) => None,
                _ => Softened::least(&soft, &of_lamps, reporter, shaded)?,
            };
            let name = softened.as_ref().map(Softened::name);
            match (parameters.window, softened, name) {
                (WindowName::NonNegative, Some(softened), Some(name)) => {
                    reporter.note(format!("{:.1} % of {what}, without {name}", 100.0 * part));
                    value = softened.value;
                }
                (_, _, name) => {
                    let window = name
                        .map(|name| format!(", or window = \"non-negative\", {name}"))
                        .unwrap_or_default();
                    let help = format!(
                        "connect `material`, which keeps lamps out of the series, or set non-negative = \
                         \"nearest\" in the light's project-sh{window}"
                    );
                    report_loss(reporter, part, what, &help);
                }
            }
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
    /// The light is that of probes around each vertex, with light that is the same for all.
    Probes(VertexProbes, Expansion),
}

impl Soft {
    fn degree(&self) -> Degree {
        match self {
            Self::Distant(light) => light.degree(),
            Self::Near(field) => field.degree(),
            Self::Probes(_, beside) => VertexProbes::degree().max(beside.degree()),
        }
    }

    /// The light without other degrees than `l`.
    fn only(&self, l: usize) -> Self {
        let only = |light: &Expansion| {
            let mut band = Expansion::zero(light.degree());
            if l <= light.degree().get() {
                let rows = l * l..(l + 1) * (l + 1);
                band.coefficients_mut()[rows.clone()].copy_from_slice(&light.coefficients()[rows]);
            }
            band
        };
        match self {
            Self::Distant(light) => Self::Distant(only(light)),
            Self::Near(field) => Self::Near(field.with_lights(only)),
            Self::Probes(probes, beside) => Self::Probes(probes.only(l), only(beside)),
        }
    }
}

/// The number of vertices that are below zero in a channel.
fn negative(value: &[[f32; 3]]) -> usize {
    value.iter().filter(|rgb| rgb.iter().any(|value| *value < 0.0)).count()
}

fn add(sums: &mut [[f32; 3]], factor: f64, values: &[[f32; 3]]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        (0..3).for_each(|channel| sum[channel] += factor as f32 * value[channel]);
    }
}

/// Vertices under light that a window softens.
struct Softened {
    penalty: Penalty,
    /// The share of the highest degree's coefficients that is left.
    kept: f64,
    value: Vec<[f32; 3]>,
}

impl Softened {
    /// The vertices under the weakest window that leaves none below zero, up to a hundredth of its penalty;
    /// `None` if even the mean of the light does not. `lamps` are added without a window.
    fn least(
        soft: &Soft,
        lamps: &[[f32; 3]],
        reporter: &Reporter,
        shaded: impl Fn(&Soft) -> Result<Vec<[f32; 3]>, Failure>,
    ) -> Result<Option<Self>, Failure> {
        /// The penalties between which the weakest is looked for: what changes nothing, and what leaves the
        /// mean.
        const PENALTIES: [f64; 2] = [1e-9, 1e6];
        // Radiance is linear in the light, so that each degree is shaded once.
        let degrees = (0..=soft.degree().get()).map(|l| {
            reporter.check_cancelled()?;
            shaded(&soft.only(l))
        });
        let degrees: Vec<Vec<[f32; 3]>> = degrees.collect::<Result<_, _>>()?;
        let softened = |lambda: f64| -> Result<Self, Failure> {
            let penalty = Penalty::new(lambda).map_err(|error| Failure::new(error.to_string()))?;
            let factor = |l: usize| Window::Laplacian(penalty).factor(l, soft.degree());
            let mut value = lamps.to_vec();
            degrees.iter().enumerate().for_each(|(l, of_degree)| add(&mut value, factor(l), of_degree));
            Ok(Self { penalty, kept: factor(soft.degree().get()), value })
        };
        let [mut low, mut high] = PENALTIES;
        let mut best = softened(high)?;
        if negative(&best.value) > 0 {
            return Ok(None);
        }
        while high > 1.01 * low {
            let middle = (low * high).sqrt();
            let found = softened(middle)?;
            if negative(&found.value) > 0 {
                low = middle;
            } else {
                (high, best) = (middle, found);
            }
        }
        Ok(Some(best))
    }

    fn name(&self) -> String {
        let (lambda, kept) = (self.penalty.get(), 100.0 * self.kept);
        format!("a window of lambda = {lambda:.2e} that leaves {kept:.1} % of the highest degree")
    }
}

/// The series of all light, and the lamps beside it; with `apart` false they are in the series.
fn light(inputs: &Inputs, frames: &Frames, apart: bool) -> Result<(Soft, Vec<Light>), Failure> {
    let more = inputs.optional::<artifacts::Lighting>("lights")?;
    let taken = |lighting: Lighting| match apart {
        true => (lighting.series, lighting.lights),
        false => (lighting.whole(), Vec::new()),
    };
    if inputs.type_at("lighting") == Some(artifacts::Probes::TYPE) {
        let probes = &inputs.get::<artifacts::Probes>("lighting")?.0;
        let probes = VertexProbes::of(probes, frames.positions(), |vertex| frames.normal(vertex))?;
        let none = || (Expansion::zero(Degree::ZERO), Vec::new());
        let (beside, lamps) = more.map_or_else(none, |more| taken(more.0.clone()));
        return Ok((Soft::Probes(probes, beside), lamps));
    }
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
    frames: &Frames,
    table: &BrdfTable,
    viewer: Viewer,
    transfer: Option<&StoredTransfer>,
    soft: &Soft,
) -> Result<Vec<[f32; 3]>, Failure> {
    let not_matte = |error| Failure::from(error).help("bake the transfer in another form");
    let distant = |light: &Expansion| match transfer {
        None => Ok(shade(frames, table, viewer, light)),
        Some(transfer) => transfer.shade(frames, table, viewer, light).map_err(not_matte),
    };
    match (soft, transfer) {
        (Soft::Distant(light), _) => distant(light),
        (Soft::Near(field), None) => Ok(field.shade(frames, table, viewer)),
        (Soft::Near(field), Some(transfer)) => {
            field.shade_with_transfer(frames, table, viewer, transfer).map_err(not_matte)
        }
        (Soft::Probes(probes, beside), _) => {
            let mut sum = probes.under(distant)?;
            if beside.coefficients().iter().any(|row| *row != [0.0; 3]) {
                add(&mut sum, 1.0, &distant(beside)?);
            }
            Ok(sum)
        }
    }
}

/// Notes what of light and table is not used.
fn note_cuts(reporter: &Reporter, table: &BrdfTable, transfer: Option<&StoredTransfer>, soft: &Soft) {
    let Some(transfer) = transfer else {
        return note_cut(reporter, ("light", soft.degree()), ("table", table.degree()));
    };
    let form = transfer.form();
    note_cut(reporter, ("light", soft.degree()), ("transfer's F", form.input()));
    if let Some(output) = form.output() {
        note_cut(reporter, ("table", table.degree()), ("transfer's O", output));
    }
    if table.lit_from_below() {
        reporter.note("light from below the horizon, which this material reflects, is not shadowed");
    }
}

/// Notes that the one of higher degree is cut to the lower.
fn note_cut(reporter: &Reporter, a: (&str, Degree), b: (&str, Degree)) {
    let ((low, least), (high, most)) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    if least < most {
        reporter.note(format!("the {low} ends at degree {}, the {high} at {}", least.get(), most.get()));
    }
}
