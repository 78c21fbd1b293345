//! Fits the look-ups, or taps, by which a material reads the scale space of an environment: a table of 4 KB.
//!
//! > B(R, V) ~ sum over j < J of a_j(theta_v) M(d_j, s_j(theta_v)) + sum over k < K of b_k(theta_v) H(N, y_k(theta_v))
//!
//! R is the direction of the mirror's reflection, theta_v the angle between normal and view. Look-up j goes into the
//! level of width s_j (see `scale-space`), in the direction d_j that lies in the plane of R and N, turned from R by
//! delta_j toward N, and weighs a_j, RGB. A highlight has J of them, which stretch and move as it does, and one more
//! into the light about the normal, for what the horizon cuts. A matte base has one look-up about the normal, and a
//! base that is not even, such as oren-nayar, two besides. Layers have the look-ups of each.
//!
//! The fit looks at the BRDF alone, under round spots of light of three sizes in a dim ambient light, at views as a
//! ball shows them, and measures errors in stops. So a table serves every environment. Toward each view the weights
//! add up to the directional albedo of the material in each colour, exactly: no light is lost, and none is made.
//!
//! With `taps = "auto"` J is the least of 2, 3, 4, 6 and 8 whose residual is at most `error`, or the one with the
//! least residual. The residual is that of spots; under a photograph 95 % of views are about as close to the integral
//! (`export-taps` measures it, and docs/taps.md has tables). A material that depends on the direction of its tangent
//! (stretched highlights, kajiya-kay) is replaced by its mean over all turns about the normal, with a warning.
//!
//! ## Example
//!
//! ```toml
//! [stage.taps]
//! kind = "fit-taps"
//! input = "material"
//! ```

use brdf::Centre;
use containers::tensors::MaterialTaps;
use engine::{Artifact, Context, Failure, Kind, OrAuto, Output, Port, Product, Steps, parameters};
use taps::{Fitted, Widths, fit};

use crate::values::{UntilStopped, artifacts};

parameters! {
    /// Parameters of `fit-taps`.
    pub(crate) struct Parameters {
        /// J, the look-ups of each highlight, or "auto".
        #[range(1..=16)]
        taps: OrAuto<usize> = OrAuto::Auto,
        /// The residual, in stops, that `taps = "auto"` accepts.
        #[range(0.0..=10.0)]
        error: f64 = 0.08,
    }
}

/// The numbers of look-ups that are tried.
const TRIED: [usize; 5] = [2, 3, 4, 6, 8];

/// More look-ups have to lower the residual to this share.
const WORTH: f64 = 0.93;

/// The finest scale space that a fit counts on.
const FINEST: usize = 256;

/// The kind `fit-taps`.
pub(crate) struct FitTaps;

impl Kind for FitTaps {
    type Parameters = Parameters;

    const NAME: &'static str = "fit-taps";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[taps::revisions::FIT, brdf::revisions::MODELS];
    const TEXT: &'static str = include_str!("fit_taps.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Material>("material")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Taps::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let material = context.inputs.get::<artifacts::Material>("material")?.0.clone();
        let widths = Widths::new(FINEST).ok_or_else(|| Failure::new("no widths"))?;
        if !material.is_isotropic() || material.centre() == Centre::Tangent {
            reporter.warn(
                "the material depends on the direction of its tangent; its taps are those of its mean over all turns, \
                 and shade-vertices keeps the direction",
            );
        }
        let fitted =
            |taps: usize, steps: &Steps<'_>| steps.until_stopped(|stop| fit(&material, taps, widths, stop));
        let best = match parameters.taps {
            OrAuto::Fixed(taps) => fitted(taps, &Steps::new(reporter, 1))?,
            OrAuto::Auto => {
                let steps = Steps::new(reporter, TRIED.len());
                let mut best: Option<Fitted> = None;
                for taps in TRIED {
                    let next = fitted(taps, &steps)?;
                    let is_best = best.as_ref().is_none_or(|best| next.rms < WORTH * best.rms);
                    let is_same = best.as_ref().is_some_and(|best| best.table.taps() == next.table.taps());
                    if is_best {
                        best = Some(next);
                    }
                    if is_same || best.as_ref().is_some_and(|best| best.rms <= parameters.error) {
                        break;
                    }
                }
                best.ok_or_else(|| Failure::new("no number of taps was tried"))?
            }
        };
        reporter.note(format!(
            "{} taps and {} about the normal; under spots of light within {:.3} stops (RMS)",
            best.table.taps(),
            best.table.normals(),
            best.rms
        ));
        Output::artifact(artifacts::Taps(MaterialTaps { material, fitted: best }))
    }
}
