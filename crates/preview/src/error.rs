//! The errors of rendering.

use sh::Stopped;

/// Why a picture cannot be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A map cannot be made.
    #[error("{0}")]
    Maps(String),
    /// The scene lacks something that the shot needs.
    #[error("{what} needs {missing}")]
    Missing {
        /// The thing that cannot be drawn.
        what: &'static str,
        /// The thing that the scene lacks for it.
        missing: &'static str,
    },
    /// Something exceeds a limit of the renderer or of its device. Another renderer may draw the picture.
    #[error("{what}: {asked} is more than this renderer's limit of {limit}")]
    Limit {
        /// The quantity: `the environment: the width of the texture`.
        what: String,
        /// The value that was needed.
        asked: u64,
        /// The largest value that is possible.
        limit: u64,
    },
    /// There is no usable graphics device, or it stopped working. Another renderer may draw the picture.
    #[error("{0}")]
    Device(String),
    /// The caller cancelled the picture.
    #[error("cancelled")]
    Cancelled,
}

impl From<Stopped> for RenderError {
    fn from(_: Stopped) -> Self {
        Self::Cancelled
    }
}

impl RenderError {
    pub(crate) fn maps(message: impl Into<String>) -> Self {
        Self::Maps(message.into())
    }

    /// Whether another renderer may be able to draw the same picture.
    pub fn is_of_the_device(&self) -> bool {
        matches!(self, Self::Limit { .. } | Self::Device(_))
    }
}
