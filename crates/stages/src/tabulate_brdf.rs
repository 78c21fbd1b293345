//! Tabulates a material for every view: the coefficients with which any soft light shades a surface.
//!
//! > c_i(v) = integral over s of rho_hat(s, v) Y_i(s)
//!
//! rho_hat is the BRDF times the cosine of the incident angle, as a function of the incident direction s and
//! the view v in the frame of the surface: x is the tangent, z the normal (Kautz, Sloan and Snyder 2002,
//! section 3). Under light with the coefficients L_i in that frame the surface has the radiance sum of L_i
//! c_i(v): 25 products for degree 4. Unlike `project-brdf` the table holds any material, brushed or not,
//! and keeps the view sharp; it suits low-frequency light on curved surfaces, where degree 4 shows little of
//! a lamp's shape. The errors under a lighting of six soft lamps, as a share of the radiance of a sphere:
//!
//! | ashikhmin-shirley, exponents | degree 2 | 4 | 6 | 8 | 14 |
//! | --- | --- | --- | --- | --- | --- |
//! | 12 along, 4 across | 6.9 % | 1.8 % | 0.5 % | 0.09 % | 0.001 % |
//! | 24, 8 | 10 % | 2.5 % | 0.7 % | 0.13 % | 0.001 % |
//! | 48, 16 | 14 % | 3.8 % | 1.3 % | 0.22 % | 0.003 % |
//!
//! ## The map of views
//!
//! The views are the texels of a parabolic map of the hemisphere: x = v_x / (1 + v_z) and y alike run from -1
//! to 1, row 0 is at +y, and a texel's centre is its view. Texels outside the unit disk repeat its rim, so
//! that a bilinear look-up has no dark edge. The rim, and every view lower than 0.25 degrees, is taken at
//! 0.25 degrees above the horizon. A view from below the horizon, which interpolated normals make, is looked
//! up on the rim (`below` is `clamped`); for kajiya-kay, which has no horizon, at its mirror image
//! (`mirrored`).
//!
//! Every entry is integrated by rules that are refined until they agree, at the horizon and near grazing too:
//! to 1e-7 of the greatest coefficient for smooth models; the build notes the error. `phong` and
//! `kajiya-kay` reflect light from below the horizon, and their tables hold it. `phong` and `lambert` are
//! closed forms.
//!
//! ## Example
//!
//! ```toml
//! [stage.table]
//! kind = "tabulate-brdf"
//! input = "material"
//! degree = 4
//! ```

use brdf::tabulate_unless;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use sh::Degree;

use crate::artifacts;
use crate::quantity::size;

parameters! {
    /// Parameters of `tabulate-brdf`.
    pub(crate) struct Parameters {
        /// F, the degree over the incident direction: (F + 1)^2 coefficients for each view.
        #[range(0..=14)]
        degree: usize = 4,
        /// N: the map has N x N views.
        #[range(2..=512)]
        resolution: usize = 128,
    }
}

/// Past this share of the greatest coefficient, the error is worth a warning.
const UNCERTAIN: f64 = 1e-4;

/// The kind `tabulate-brdf`.
pub(crate) struct TabulateBrdf;

impl Kind for TabulateBrdf {
    type Parameters = Parameters;

    const NAME: &'static str = "tabulate-brdf";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[brdf::revisions::MODELS, brdf::revisions::TABLE];
    const TEXT: &'static str = include_str!("tabulate_brdf.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Material>("material")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::BrdfTable::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let material = &context.get::<artifacts::Material>("material")?.0;
        let degree = Degree::new(parameters.degree)?;
        let stop = || context.check_cancelled().is_err();
        let found = tabulate_unless(material, degree, parameters.resolution, &stop);
        context.check_cancelled()?;
        let (table, error) = found?;
        let greatest = table.values().iter().fold(0.0f32, |most, value| most.max(value.abs()));
        if error > UNCERTAIN * f64::from(greatest) {
            context.warn(format!(
                "the material changes too fast to be integrated exactly: coefficients of up to {greatest:.3} are \
                 uncertain by up to {error:.1e}"
            ));
        }
        let colour = if table.channels() == 1 { "grey" } else { "RGB" };
        context.note(format!(
            "{} coefficients, {colour}, for {} x {} views: {}, within {error:.0e}",
            degree.rows(),
            table.size(),
            table.size(),
            size(4 * table.values().len() as u64)
        ));
        Output::artifact(artifacts::BrdfTable(table))
    }
}
