//! Fits the look-ups, or taps, by which a material reads the scale space of an environment: a table of 4 KB.
//!
//! > B(R, V) ~ sum over j < J of a_j(theta_v) M(d_j, s_j(theta_v))
//! > + sum over k < K of b_k(theta_v) H(N, y_k(theta_v))
//!
//! R is the direction of the mirror's reflection, theta_v the angle between normal and view. Look-up j goes
//! into the level of width s_j (see `scale-space`), in the direction d_j that lies in the plane of R and N,
//! turned from R by delta_j toward N, and weighs a_j, RGB. A highlight has J of them, which stretch and move
//! as it does, and one more into the light about the normal, for what the horizon cuts. A matte base has one
//! look-up about the normal, and a base that is not even, such as oren-nayar, two besides. Layers have the
//! look-ups of each.
//!
//! The fit looks at the BRDF alone, under round spots of light of three sizes in a dim ambient light, at
//! views as a ball shows them, and measures errors in stops. So a table serves every environment. Toward each
//! view the weights add up to the directional albedo of the material in each colour, exactly: no light is
//! lost, and none is made.
//!
//! With `taps = "auto"` J is the least of 1, 2, 3, 4, 6 and 8 whose residual is at most `error`, or which the
//! next number does not lower by a quarter: what is left then is no matter of more look-ups. The residual is
//! that of spots of light. Under an environment another number may do: `export-taps` measures each, and takes
//! the cheapest that is accurate enough. docs/taps.md has tables.
//!
//! A material that depends on the direction of its tangent (stretched highlights, kajiya-kay) is replaced by
//! its mean over all turns about the normal, with a warning.
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
use engine::{Artifact, Context, Failure, Kind, OrAuto, Output, Port, Product, parameters};
use taps::{Widths, fit};

use super::compact::{ERROR, fits};
use crate::values::{UntilStopped, artifacts};

parameters! {
    /// Parameters of `fit-taps`.
    pub(crate) struct Parameters {
        /// J, the look-ups of each highlight, or "auto".
        #[range(1..=16)]
        taps: OrAuto<usize> = OrAuto::Auto,
        /// The residual, in stops, that `taps = "auto"` accepts.
        #[range(0.0..=10.0)]
        error: f64 = ERROR,
    }
}

/// The kind `fit-taps`.
pub(crate) struct FitTaps;

impl Kind for FitTaps {
    type Parameters = Parameters;

    const NAME: &'static str = "fit-taps";
    const REVISION: u32 = 2;
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
        if !material.is_isotropic() || material.centre() == Centre::Tangent {
            reporter.warn(
                "the material depends on the direction of its tangent; its taps are those of its mean over all turns, \
                 and shade-vertices keeps the direction",
            );
        }
        let made = match parameters.taps {
            OrAuto::Fixed(taps) => {
                let fitted = reporter.until_stopped(|stop| fit(&material, taps, Widths::FINEST, stop))?;
                MaterialTaps { material, fitted, others: Vec::new() }
            }
            OrAuto::Auto => fits(&material, parameters.error, reporter)?,
        };
        reporter.note(format!(
            "{} taps and {} about the normal; under spots of light within {:.3} stops (RMS)",
            made.fitted.table.taps(),
            made.fitted.table.normals(),
            made.fitted.rms
        ));
        Output::artifact(artifacts::Taps(made))
    }
}
