//! Projects a material into spherical harmonics: the coefficients of its transfer function.
//!
//! ```toml
//! [stage.coefficients]
//! kind = "project-brdf"
//! input = "material"
//! ```
//!
//! > rho_hat(w_i, w_o) = sum over l, p, q of rho_lpq Y*_lq(w_i) Y_pq(w_o)
//!
//! rho_hat is the BRDF times the cosine of the incident angle, as a function of the incident and the
//! outgoing direction about the model's central direction: the reflection vector R of the view for most
//! models, the normal for lambert alone, the tangent for kajiya-kay. About R a highlight stays in place for
//! every view, so few degrees in the outgoing direction (P) are needed in addition to those in the incident
//! one (F). rho_lpq is real and the same for q and -q, because materials are isotropic: an anisotropic
//! material is replaced by its mean over all rotations about the normal, with a warning; `tabulate-brdf`
//! keeps its direction.
//!
//! The integrals ([RH02, eq. 13 and app. C]; [Ram02, eq. 5.22])
//!
//! > rho_lpq = 2 pi * integral of rho_hat f_lq(theta_i) f_pq(theta_o) cos(q phi) sin(theta_i) sin(theta_o)
//!
//! are computed over panels that are halved until two quadrature rules agree. Light from below the
//! surface's horizon (N.L <= 0, with N half way between R and the view) is not reflected; that edge lies
//! between panels, so it costs no accuracy. For smooth models the coefficients are accurate to 1e-6 of
//! their norm. Only phong and lambert are radially symmetric: P = 0, in closed form.
//! Without `degree` and `tolerance` the panels are fixed; the coefficients are then within 0.2 % of their
//! norm.
//!
//! ## Degrees
//!
//! How many degrees are visible depends on the light as much as on the material. So without `degree` and
//! `tolerance` there are more than enough coefficients (F up to 255, P = 24), and `convolve` takes as few
//! as it can for each light. This takes less than a second for any material. The build notes how much
//! energy they hold.
//!
//! `degree = [F, P]` sets the degrees for every light. `tolerance` is the share of the energy (the integral
//! of rho_hat squared over all directions) that may be lost [Ram02, eqs. 5.17 and 5.18]: first P is lowered
//! until the tolerance is reached, then F. An error is the square root of an energy: a tolerance of 0.03 is
//! an RMS error of 17 % under one small lamp, and less under soft light. A `report` finds the degrees for
//! the error that you accept. The build notes the degrees, the energy that they hold, and how much of it
//! each p adds. If P is too low, a map cannot show how a highlight changes toward grazing views.
//!
//! | material, `tolerance = 0.03` | F | P |
//! | --- | --- | --- |
//! | microfacet, sigma 0.1 | 23 | 2 |
//! | microfacet, sigma 0.2 | 11 | 2 |
//! | microfacet, sigma 0.5 | 4 | 2 |
//! | kajiya-kay, exponent 32 | 9 | 8 |
//! | lafortune, the skin of `examples/skin` | 10 | 4 |
//!
//! A tolerance below 0.001 resolves the edge at the horizon, and needs a high F and a high P. So do models
//! that reflect most toward grazing views (ggx, torrance-sparrow and ward with low roughness): most of
//! their energy is in views that few pixels have, so it is better to set a `degree`, such as `[30, 8]`. P
//! above 32, and degrees with more than 131072 coefficients (F+1)(P+1)^2, are not tried. If none of the
//! tried degrees meets the tolerance, the best are kept with a warning, provided that they hold half of the
//! energy. Otherwise the item fails, as it does if a value is not finite.
//!
//! ## No negative values
//!
//! A truncated series rings, also below zero. `non-negative = "nearest"` replaces rho_hat with the nearest
//! function that is never negative: among all g >= 0 of the same degrees, the one with the least integral
//! of (g - rho_hat)^2 over both directions, separately for each colour channel. The two parts of a material
//! are replaced separately, so their sum differs slightly from the whole. The total reflection may
//! increase; `"nearest-same-mean"` takes the nearest function that reflects equally much, which changes
//! rho_hat more. The build notes the change in L2, which is the root of the integral of (g - rho_hat)^2
//! over that of rho_hat^2, and the minimum before and after.
//!
//! If coefficients are truncated later, they can become negative again. So you must set `degree` or
//! `tolerance`; `convolve` with a lighting of at least F degrees then keeps them as they are. The number of
//! rho_lpq with q <= min(l, p) must be at most 1500, for example [30, 8], [23, 10] or [15, 15]; more is an
//! error, because the time grows with its third power: a second for [23, 2], about half a minute for [30,
//! 8]. If the nearest function is black although the material is not, the material has no mass, and the
//! item fails.
//!
//! ## Parts
//!
//! A material with a matte base under a highlight has two centres: engines look the base up by the normal,
//! the highlight by the reflection vector. So this stage also projects the coefficients of both parts, each
//! about its own centre, in addition to those of the whole about the reflection vector. Exports write a map
//! of each part, unless they have `parts = "together"`.
//!
//! The diffuse part contains matte layers; in `standard` also sheen and multiple reflections between
//! facets. The specular part is the rest, and the sum of both is the material. If `standard` has no matte
//! base and no sheen, it is a bare metal and has one part. `part = "diffuse"` or `part = "specular"`
//! projects only that part, for graphs that treat the parts differently; it is black if the material lacks
//! the part.
//!
//! ```toml
//! [stage.diffuse]
//! kind = "project-brdf"
//! input = "material"
//! part = "diffuse"
//! ```
//!
//! A `report` compares two maps with one. Models with a single formula (lafortune, ashikhmin-shirley,
//! measured tables) belong to the specular part as a whole.

use brdf::{
    BrdfCoefficients, Choice, Lambert, MOST_UNKNOWNS, Material, NearestBrdfError, Part, Projection,
    ProjectionError, nearest_non_negative, project, unknowns,
};
use containers::tensors::{Brdf, DegreeSource};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, Steps, choice, parameters};
use sh::{Stop, Tolerance};

use super::degree_pair::DegreePair;
use crate::values::{NonNegative, SHARE, UntilStopped, artifacts, share};

choice! {
    /// Which part of a material is projected.
    pub(crate) enum PartName {
        /// All of it.
        All = "all",
        /// What is taken about the normal.
        Diffuse = "diffuse",
        /// The rest.
        Specular = "specular",
    }
}

impl PartName {
    /// Returns this part of a material; `None` if it has no such part.
    fn of(self, material: &Material) -> Option<Material> {
        match self {
            Self::All => Some(material.clone()),
            Self::Diffuse => material.part(Part::Diffuse),
            Self::Specular => material.part(Part::Specular),
        }
    }
}

parameters! {
    /// Parameters of `project-brdf`.
    pub(crate) struct Parameters {
        /// Which part of the material is projected; see Parts.
        part: PartName = PartName::All,
        /// The degrees [F, P]. Default: those that meet the tolerance or, without one, those that
        /// `convolve` finds for each light.
        degree: Option<DegreePair> = None,
        /// The share of the energy that may be lost.
        #[range(SHARE)]
        tolerance: Option<f64> = None,
        /// Whether and how negative values are avoided; see No negative values.
        non_negative: Option<NonNegative> = None,
    }
}

/// The share of the energy past which the difference of the two rules of quadrature is told.
const UNCERTAIN: f64 = 0.02;

/// The most p that are listed one by one.
const MOST_TOLD: usize = 13;

/// `degrees [11, 2] hold 97.2 % of the energy; p = 0, 1, ...: 87.2, 7.0, 3.0 %`
fn described(projection: &Projection) -> String {
    let coefficients = &projection.coefficients;
    let (f, p) = (coefficients.f().get(), coefficients.p().get());
    let mut line = format!("degrees [{f}, {p}] hold {} of the energy", share(projection.captured));
    if p > 0 {
        let parts: Vec<_> = projection
            .energy_per_p()
            .iter()
            .take(MOST_TOLD)
            .map(|part| format!("{:.1}", 100.0 * part))
            .collect();
        line += &format!("; p = 0, 1, ...: {} %", parts.join(", "));
    }
    line
}

/// The kind `project-brdf`.
pub(crate) struct ProjectBrdf;

impl Kind for ProjectBrdf {
    type Parameters = Parameters;

    const NAME: &'static str = "project-brdf";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[
        brdf::revisions::MODELS,
        brdf::revisions::PROJECTION,
        brdf::revisions::NON_NEGATIVE,
        sh::revisions::NEAREST,
    ];
    const TEXT: &'static str = include_str!("project_brdf.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Material>("material")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Brdf::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.tolerance.is_some() && parameters.degree.is_some() {
            errors.push(("tolerance", "degree already sets the degrees".into()));
        }
        if parameters.non_negative.is_some() {
            match (parameters.degree, parameters.tolerance) {
                (Some(DegreePair { f, p }), _) => {
                    let count = unknowns(f.get(), p.get());
                    if count > MOST_UNKNOWNS {
                        let text = format!(
                            "{count} coefficients are more than the {MOST_UNKNOWNS} for non-negative"
                        );
                        errors.push(("degree", text));
                    }
                }
                (None, None) => errors.push(("non-negative", "needs a degree or a tolerance".into())),
                (None, Some(_)) => {}
            }
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let material = &context.inputs.get::<artifacts::Material>("material")?.0;
        let material = match parameters.part.of(material) {
            Some(part) => part,
            None => {
                reporter.note(format!("{} has no such part: it is black", material.name()));
                Material::Lambert(Lambert::new([0.0; 3])?)
            }
        };
        let (choice, degrees) = match (parameters.degree, parameters.tolerance) {
            (Some(DegreePair { f, p }), _) => (Choice::Degree { f, p }, DegreeSource::Named),
            (None, Some(tolerance)) => {
                (Choice::Tolerance(Tolerance::new(tolerance)?), DegreeSource::Tolerance(tolerance))
            }
            (None, None) => (Choice::Full, DegreeSource::Light),
        };
        // How far a search for degrees is, nobody knows.
        let total = choice.steps().unwrap_or(usize::MAX / 2);
        let split = material.split();
        let work = Steps::new(reporter, if split.is_some() { 2 } else { 1 });
        let steps = work.part(1, total);
        let projection = steps.until_stopped(|stop| project(&material, choice, stop))?;
        let parts = match split {
            Some(split) => {
                let steps = work.part(1, 2 * total);
                Some(steps.until_stopped(|stop| parts(&split, &projection, choice, stop))?)
            }
            None => None,
        };
        if projection.anisotropic {
            reporter.warn(format!(
                "{} is anisotropic; it is replaced by its mean over all rotations about the normal \
                 (tabulate-brdf keeps its direction)",
                material.name()
            ));
        }
        if let Some(tolerance) = parameters.tolerance
            && projection.captured < 1.0 - tolerance - 1e-9
        {
            reporter.warn(format!(
                "tolerance {tolerance} is missed: the highest degrees hold {} of the energy instead of {}, \
                 and most of the rest is at grazing views; leave out `tolerance`, so that `convolve` chooses \
                 degrees for each light",
                share(projection.captured),
                share(1.0 - tolerance)
            ));
        }
        if projection.uncertainty > UNCERTAIN {
            reporter.warn(format!(
                "the material changes too fast to be sampled exactly: up to {:.1} % of its reflection may be \
                 wrong; a larger roughness avoids that",
                100.0 * projection.uncertainty
            ));
        }
        reporter.note(described(&projection));
        if let Some([diffuse, specular]) = &parts {
            let [diffuse, specular] = [diffuse, specular].map(|part| [part.f().get(), part.p().get()]);
            reporter.note(format!("its parts: diffuse {diffuse:?}, specular {specular:?}"));
        }
        let (mut coefficients, mut parts) = (projection.coefficients, parts);
        if let Some(choice) = parameters.non_negative {
            let nearest = |name, given: &_| nearest(name, given, choice.mean(), reporter);
            coefficients = nearest("nearest non-negative function", &coefficients)?;
            if let Some([diffuse, specular]) = &mut parts {
                *diffuse = nearest("of the diffuse part", diffuse)?;
                *specular = nearest("of the specular part", specular)?;
            }
        }
        Output::artifact(artifacts::Brdf(Brdf { coefficients, material: Some(material), degrees, parts }))
    }
}

/// The nearest function that is nowhere negative.
fn nearest(
    name: &str,
    coefficients: &BrdfCoefficients,
    mean: sh::Mean,
    reporter: &Reporter,
) -> Result<BrdfCoefficients, Failure> {
    let found = reporter.until_stopped(|stop| {
        nearest_non_negative(coefficients, mean, stop).map_err(|error| match error {
            NearestBrdfError::TooMany { .. } => {
                Failure::from(error).help("give lower degrees, or a larger tolerance")
            }
            _ => Failure::from(error),
        })
    })?;
    reporter.note(format!(
        "{name}: a change of {:.3} % in L2; minimum {:.4} before, {:.4} after",
        100.0 * found.change,
        found.before,
        found.after
    ));
    Ok(found.coefficients)
}

/// The coefficients of a material's two parts: at degrees that are chosen for a light later, or at those of
/// the whole.
fn parts(
    [diffuse, specular]: &[Material; 2],
    whole: &Projection,
    choice: Choice,
    stop: Stop<'_>,
) -> Result<[BrdfCoefficients; 2], ProjectionError> {
    let choice = match choice {
        Choice::Full => Choice::Full,
        _ => Choice::Degree { f: whole.coefficients.f(), p: whole.coefficients.p() },
    };
    let project = |part: &Material| project(part, choice, stop);
    let (diffuse, specular) = rayon::join(|| project(diffuse), || project(specular));
    Ok([diffuse?.coefficients, specular?.coefficients])
}
