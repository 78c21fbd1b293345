//! Bad pixels of pictures that are imported: the policies, and what is said of them.

use engine::{Reporter, choice};
use envmap::{BadPixels, Coverage, Finding, Image, repair};

use crate::values::percent;

choice! {
    /// What happens to NaN, infinite and negative values.
    pub(crate) enum BadPixelsName: BadPixels {
        /// Negative values become 0, with a warning; NaN and infinite ones are an error.
        ZeroNegative,
        /// The item fails.
        Error,
        /// The value becomes 0.
        Zero,
        /// The value becomes the nearest that is not bad.
        Clamp,
    }
}

/// The share of negative light from which an image is more likely not one of light.
const SUSPICIOUS: f64 = 0.3;

/// The image without bad pixels, after a warning if it had any.
///
/// # Errors
/// The errors of [`repair`].
pub(crate) fn repaired(
    image: Image,
    coverage: impl Into<Coverage>,
    policy: BadPixels,
    reporter: &Reporter,
) -> Result<Image, envmap::Error> {
    let (image, found) = repair(image, coverage, policy)?;
    match found.negative {
        Some(Finding { count, first }) if policy == BadPixels::ZeroNegative => {
            let share = percent(found.negative_share);
            let values = if count == 1 { "value" } else { "values" };
            let mut message =
                format!("{count} negative {values} became 0: {share} of the light; the first was at {first}");
            if found.negative_share > SUSPICIOUS {
                message +=
                    ". Light is never negative: check that the image is not one of normals or differences";
            }
            reporter.warn(message);
        }
        _ if !found.is_clean() => reporter.warn(format!("bad pixels were replaced: {found}")),
        _ => {}
    }
    Ok(image)
}
