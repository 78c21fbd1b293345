//! What every reflection model has.

use sphere::Direction;

use super::lobe::Lobe;
use super::parameter::{Parameter, ParameterError, Values};
use crate::clamped_cosine::ClampedCosine;
use crate::coefficients::Centre;
use crate::packed::Packed;

/// A reflection model.
pub trait Model: Clone + std::fmt::Debug + PartialEq {
    /// What a renderer needs of a material of this model.
    type Constants: Packed;

    /// The name in material files.
    const NAME: &'static str;
    /// A description in one line, for the manual.
    const SUMMARY: &'static str;
    /// What else the manual says of the model, Markdown; empty for most.
    const DETAILS: &'static str = "";
    /// The parameters of the model.
    const PARAMETERS: &'static [Parameter];

    /// The model with these parameters.
    ///
    /// # Errors
    /// If a parameter is missing or out of its range; the error names it.
    fn from_values(values: &Values) -> Result<Self, ParameterError>;

    /// The values of the parameters, from which [`Model::from_values`] makes the same model.
    fn values(&self) -> Values;

    /// One or more materials of this model, for tests that go through all models. Together they have every
    /// parameter that is not a choice, and none of them makes light.
    ///
    /// # Errors
    /// If a value is out of its range, which a test of all examples would show.
    fn examples() -> Result<Vec<Self>, ParameterError>;

    /// The direction that rho_hat is taken about.
    fn centre(&self) -> Centre {
        Centre::Reflection
    }

    /// rho_hat, the BRDF times the incident cosine, in 1/sr, RGB. Finite for any two directions.
    ///
    /// Both directions point away from the surface, in its frame: +Z the normal, +X the tangent. Light from
    /// below the horizon (`incident` with z <= 0) is not reflected, except by models whose text says
    /// otherwise (phong, kajiya-kay). `outgoing` has z >= 0.
    fn rho_hat(&self, incident: Direction, outgoing: Direction) -> [f64; 3];

    /// [`Model::rho_hat`] of many pairs of the incident and the outgoing direction: the same values, faster
    /// for models that compute several at once.
    fn rho_hats(&self, pairs: &[[Direction; 2]], values: &mut [[f64; 3]]) {
        one_by_one(|incident, outgoing| self.rho_hat(incident, outgoing), pairs.iter().copied(), values);
    }

    /// [`Model::rho_hat`] of light from many directions toward one view: the same values, faster for models
    /// that compute several at once.
    fn rho_hats_toward(&self, outgoing: Direction, incident: &[Direction], values: &mut [[f64; 3]]) {
        one_by_one(|incident, outgoing| self.rho_hat(incident, outgoing), toward(outgoing, incident), values);
    }

    /// Whether no light from below the horizon is reflected: rho_hat is exactly 0 for `incident` with z <= 0.
    fn has_horizon(&self) -> bool {
        true
    }

    /// Whether a turn about the normal (of surface, light and view together) changes nothing.
    fn is_isotropic(&self) -> bool {
        true
    }

    /// The constants of rho_hat's formula, for renderers: they depend on the parameters alone.
    fn constants(&self) -> Self::Constants;

    /// The lobes that a renderer samples in place of rho_hat: one or more.
    fn lobes(&self) -> Vec<Lobe> {
        vec![Lobe::Cosine]
    }

    /// The closed form of a radially symmetric model, whose rho_hat depends on the angle between the incident
    /// and the central direction alone.
    fn radial(&self) -> Option<ClampedCosine> {
        None
    }
}

/// Computes a function of the incident and the outgoing direction for each pair of them.
pub(crate) fn one_by_one(
    rho_hat: impl Fn(Direction, Direction) -> [f64; 3],
    pairs: impl IntoIterator<Item = [Direction; 2]>,
    values: &mut [[f64; 3]],
) {
    for (value, [incident, outgoing]) in values.iter_mut().zip(pairs) {
        *value = rho_hat(incident, outgoing);
    }
}

/// The pairs of many incident directions and one outgoing direction.
pub(crate) fn toward(outgoing: Direction, incident: &[Direction]) -> impl Iterator<Item = [Direction; 2]> {
    incident.iter().map(move |incident| [*incident, outgoing])
}

/// The entry of a model in the manual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelText {
    /// The model's name in material files.
    pub name: &'static str,
    /// The model's description in one line.
    pub summary: &'static str,
    /// What else the manual says of the model, Markdown; empty for most.
    pub details: &'static str,
    /// The model's parameters.
    pub parameters: &'static [Parameter],
}
