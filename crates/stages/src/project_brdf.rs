//! Projects a material into spherical harmonics: the coefficients of its transfer function.
//!
//! > rho_hat(w_i, w_o) = sum over l, p, q of rho_lpq Y*_lq(w_i) Y_pq(w_o)
//!
//! rho_hat is the BRDF times the cosine of the incident angle, about the model's central direction: the normal for
//! lambert, the reflection vector for phong. It is real and even in q, because only isotropic materials are taken.
//! Lambert and phong are radially symmetric: P = 0, and what is left is rho_l.
//!
//! `degree = [F, P]` sets the degrees in the incident and the outgoing direction. Without it the least degrees that
//! hold 1 - `tolerance` of the energy are taken (thesis, equations 5.17 and 5.18), and the build notes them.
//!
//! ## Example
//!
//! ```toml
//! [stage.coefficients]
//! kind = "project-brdf"
//! input = "material"
//! tolerance = 0.03
//! ```

use brdf::{Choice, project};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use sh::Tolerance;

use crate::artifacts;
use crate::degree_choice::DegreePair;
use crate::share::share;

parameters! {
    /// Parameters of `project-brdf`.
    pub(crate) struct Parameters {
        /// The degrees [F, P], instead of a tolerance.
        degree: Option<DegreePair> = None,
        /// The share of the energy that may be lost, above 0 and below 1. Without it and a degree, 0.01.
        tolerance: Option<f64> = None,
    }
}

impl Parameters {
    fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(0.01)
    }
}

/// The kind `project-brdf`.
pub(crate) struct ProjectBrdf;

impl Kind for ProjectBrdf {
    type Parameters = Parameters;

    const NAME: &'static str = "project-brdf";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("project_brdf.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Material>("material")]
    }

    fn product(_: &Parameters, _: &[(&'static str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Brdf::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut faults = Vec::new();
        if let Err(error) = Tolerance::new(parameters.tolerance()) {
            faults.push(("tolerance", error.to_string()));
        }
        if parameters.tolerance.is_some() && parameters.degree.is_some() {
            faults.push(("tolerance", "tolerance: degree already sets the degrees".into()));
        }
        faults
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let material = context.get::<artifacts::Material>("material")?;
        let choice = match parameters.degree {
            Some(DegreePair { f, p }) => Choice::Degree { f, p },
            None => Choice::Tolerance(Tolerance::new(parameters.tolerance())?),
        };
        let projection = project(&material.0, choice)?;
        let coefficients = projection.coefficients;
        context.note(format!(
            "degrees [{}, {}] hold {} of the energy",
            coefficients.f().get(),
            coefficients.p().get(),
            share(projection.captured)
        ));
        Output::artifact(artifacts::Brdf(coefficients))
    }
}
