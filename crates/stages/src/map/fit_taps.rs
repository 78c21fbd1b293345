//! Fits the look-ups, or taps, with which a material reads the scale space of an environment: a table of 7
//! KB.
//!
//! ```toml
//! [stage.taps]
//! kind = "fit-taps"
//! input = "material"
//! ```
//!
//! > B(R, V) ~ sum over j < J of a_j(theta_v) M(d_j, s_j(theta_v))
//! > + sum over k < K of b_k(theta_v) H(N, y_k(theta_v))
//!
//! R is the direction of mirror reflection, theta_v the angle between normal and view. Look-up j reads the
//! level of width s_j (see `scale-space`), in the direction d_j in the plane of R and N, turned from R by
//! delta_j toward N, with the weight a_j, RGB. A highlight has J look-ups, which stretch and move as it
//! does, and one more into the light about the normal, for light that the horizon cuts off. A matte base
//! has one look-up about the normal, and an uneven base, such as oren-nayar, two more. Layers have the
//! look-ups of each.
//!
//! The fit uses only the BRDF, under round spots of light of three sizes in a dim ambient light, toward the
//! views of a ball, and measures errors in stops. So a table serves every environment. For each view the
//! weights add up exactly to the directional albedo of the material in each colour: no light is lost or
//! added.
//!
//! With `taps = "auto"` J is the least of 1, 2, 3, 4, 6 and 8 whose residual is at most `error`, or that
//! the next number does not improve by a quarter, because then more look-ups do not help. The residual is
//! that under spots of light. Under an environment another number may be better: `export-taps` measures
//! each, and takes the cheapest that is accurate enough. docs/taps.md has tables.
//!
//! ## Over a parameter
//!
//! With `vary`, the name of a numeric parameter of the material such as `"roughness"`, `vary-rows`
//! additional tables are fitted in even steps from `vary-from` to `vary-to`, for renderers that read the
//! parameter from a texture. All have the same number of taps (`taps`, or 6), each of which changes
//! smoothly from table to table, so that a look-up can interpolate; `export-taps` with `varied = true`
//! writes them. For all metals and dielectrics at once, by their reflectance head on, see `form = "taps"`
//! of `dfg`.
//!
//! ## Brushed metal
//!
//! If a material depends on the direction of its tangent, so do its taps: each looks along the view
//! mirrored about a facet, which is tilted against the surface along the tangent and across it. With
//! `taps = "auto"`, J is 4 and 8, and `export-taps` takes one of the two. For shaders without tangents
//! there are also taps of the mean over all rotations about the normal. Materials that reflect in a cone
//! about the tangent, such as kajiya-kay, have only these, with a warning.

use std::sync::Arc;

use brdf::{Centre, Material};
use containers::tensors::{MaterialTaps, VariedTaps};
use engine::{Artifact, Context, Failure, Kind, OrAuto, Output, Port, Product, Reporter, parameters};
use taps::{AnyTable, Widths, fit, fit_varied};

use super::compact::{ERROR, facet_fits, fits};
use super::varied_taps::{STEPS, members};
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
        /// The name of a numeric parameter of the material; see Over a parameter.
        vary: Option<String> = None,
        /// The first value of `vary`.
        #[range(-1e6..=1e6)]
        vary_from: f64 = 0.0,
        /// The last value of `vary`.
        #[range(-1e6..=1e6)]
        vary_to: f64 = 1.0,
        /// The number of tables.
        #[range(2..=129)]
        vary_rows: usize = STEPS,
    }
}

/// The taps of tables over a parameter with `taps = "auto"`.
const VARIED_TAPS: usize = 6;

impl Parameters {
    /// The taps over the parameter `vary`, if it is given.
    fn varied(&self, material: &Material, reporter: &Reporter) -> Result<Option<VariedTaps>, Failure> {
        let Some(parameter) = &self.vary else { return Ok(None) };
        let members = members(material, parameter, &(self.vary_from..=self.vary_to), self.vary_rows)?;
        let taps = match self.taps {
            OrAuto::Fixed(taps) => taps,
            OrAuto::Auto => VARIED_TAPS,
        };
        let range = [self.vary_from, self.vary_to];
        let fitted = reporter.until_stopped(|stop| {
            fit_varied(&members, range, taps, Widths::FINEST, stop).map_err(Failure::from)
        })?;
        let fitted = fitted.ok_or_else(|| {
            Failure::new(format!("the material has a part at some values of {parameter:?} and not at others"))
        })?;
        let most = fitted.rms.iter().copied().fold(0.0, f64::max);
        reporter
            .note(format!("{} tables over {parameter}, each within {most:.3} stops (RMS)", self.vary_rows));
        Ok(Some(VariedTaps { parameter: parameter.clone(), fitted }))
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

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let is_empty = parameters.vary.is_some() && parameters.vary_from >= parameters.vary_to;
        let wrong = || ("vary-to", "expected a number above `vary-from`".to_owned());
        is_empty.then(wrong).into_iter().collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let material = context.inputs.get::<artifacts::Material>("material")?.0.clone();
        if material.centre() == Centre::Tangent {
            reporter.warn(
                "the material reflects in a cone about its tangent, which a few taps cannot represent; its \
                 taps are those of its mean over all rotations, and shade-vertices keeps the direction",
            );
        }
        let varied = parameters.varied(&material, reporter)?;
        let mut made = match parameters.taps {
            OrAuto::Fixed(taps) => {
                let fitted = reporter.until_stopped(|stop| fit(&material, taps, Widths::FINEST, stop))?;
                let facets = facet_fits(&material, &[taps], reporter)?;
                MaterialTaps { material, fitted, others: Vec::new(), varied: None, facets }
            }
            OrAuto::Auto => {
                Arc::unwrap_or_clone(fits(&material, parameters.error, &context.derived, reporter)?)
            }
        };
        let (table, rms) = match made.facets.last() {
            Some(fitted) => (AnyTable::View(&fitted.table), fitted.rms),
            None => (AnyTable::Angle(&made.fitted.table), made.fitted.rms),
        };
        let (taps, normals) = (table.taps(), table.normals());
        reporter.note(format!(
            "{taps} taps and {normals} about the normal; under spots of light within {rms:.3} stops (RMS)"
        ));
        made.varied = varied;
        Output::artifact(artifacts::Taps(made))
    }
}
