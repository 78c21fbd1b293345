//! The exposure of the pictures of a light.

use engine::{Context, Failure};

use super::sheet::described;
use crate::light::light;

/// The exposure, in stops, at which `preview` and `contact-sheet` show the light at the port `environment`
/// (an environment or a lighting), and `more` stops beyond it. A note says it.
///
/// # Errors
/// If the port is not connected, or the light has a radiance that is not finite.
pub fn picture_exposure(context: &Context<'_>, more: f64) -> Result<f64, Failure> {
    let usual = light(&context.inputs)?.exposure();
    context.reporter.note(described(usual, more));
    Ok(usual.stops + more)
}
