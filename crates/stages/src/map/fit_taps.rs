//! Fits the look-ups, or taps, by which a material reads the scale space of an environment: a table of 4 KB.
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
//! ## Over a parameter
//!
//! With `vary`, the name of a number of the material such as `"roughness"`, `vary-rows` tables are fitted
//! besides, in even steps from `vary-from` to `vary-to`, for a renderer that takes the parameter from a
//! texture. All have as many taps (`taps`, or 6), each of which changes smoothly from table to table, so that
//! a look-up may interpolate; `export-taps` with `varied = true` writes them. For all metals and dielectrics
//! at once, by their reflectance head on, see `form = "taps"` of `dfg`.
//!
//! ## Brushed metal
//!
//! A material that depends on the direction of its tangent has taps that know it: each looks along the view
//! mirrored about a facet, which is tilted against the surface along the tangent and across it. J is 4 and 8
//! with `taps = "auto"`, and `export-taps` takes one of the two. For shaders without tangents there are taps
//! of its mean over all turns about the normal as well. Materials that reflect in a cone about the tangent,
//! as kajiya-kay does, have these alone, with a warning.

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
        /// The name of a number of the material; see Over a parameter.
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
                "the material reflects in a cone about its tangent, which no few taps are; its taps are those of its \
                 mean over all turns, and shade-vertices keeps the direction",
            );
        }
        let varied = parameters.varied(&material, reporter)?;
        let mut made = match parameters.taps {
            OrAuto::Fixed(taps) => {
                let fitted = reporter.until_stopped(|stop| fit(&material, taps, Widths::FINEST, stop))?;
                let facets = facet_fits(&material, &[taps], reporter)?;
                MaterialTaps { material, fitted, others: Vec::new(), varied: None, facets }
            }
            OrAuto::Auto => fits(&material, parameters.error, reporter)?,
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
