//! The errors of a projection.

use sh::Stopped;

/// The most entries (F+1)(P+1)^2 that a projection may have: 4 million, 100 MB.
pub const MOST_COEFFICIENTS: usize = 1 << 22;

/// Why a material could not be projected.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProjectionError {
    /// A highlight, a rise toward grazing views or a cut at the horizon is so sharp that no usable degrees
    /// meet the tolerance: those up to (F+1)(P+1)^2 = 131072 are tried.
    #[error(
        "degrees [{f}, {p}] capture {captured:.4} of the energy, and no usable higher ones meet the tolerance \
         {tolerance}: the material is too sharp; give the degrees or a larger tolerance"
    )]
    TooSharp {
        /// The highest F tried.
        f: usize,
        /// The highest P tried.
        p: usize,
        /// The share of the energy that these degrees capture.
        captured: f64,
        /// The tolerance that was asked for.
        tolerance: f64,
    },
    /// The degrees have more than [`MOST_COEFFICIENTS`] coefficients.
    #[error("degrees [{f}, {p}] make more than {MOST_COEFFICIENTS} coefficients")]
    TooMany {
        /// The degree F in the incident direction.
        f: usize,
        /// The degree P in the outgoing direction.
        p: usize,
    },
    /// The projection was stopped before its end.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The material has a value that is NaN or infinite. Angles are in degrees about the central direction.
    #[error(
        "the material has no finite value at theta_i {theta_i:.2}, theta_o {theta_o:.2}, phi {phi:.2} degrees from \
         its central direction"
    )]
    NotFinite {
        /// The incident direction's angle to the central direction.
        theta_i: f64,
        /// The outgoing direction's angle to the central direction.
        theta_o: f64,
        /// The azimuth between the incident and the outgoing direction.
        phi: f64,
    },
}
