//! Why there is no picture.

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A map cannot be made.
    #[error("{0}")]
    Maps(String),
    /// The picture asks for something that its scene lacks.
    #[error("{what}: {missing} is not there")]
    Missing {
        /// What was asked for.
        what: &'static str,
        /// What it needs.
        missing: &'static str,
    },
    /// What is asked for passes a limit of the renderer or of its device: another renderer may do it.
    #[error("{what} asks for {asked}, and this renderer allows {limit}")]
    Limit {
        /// What was asked for.
        what: String,
        /// How much.
        asked: u64,
        /// How much there is.
        limit: u64,
    },
    /// There is no usable graphics device, or it stopped working: another renderer may do it.
    #[error("{0}")]
    Device(String),
    /// The caller no longer wants the picture.
    #[error("cancelled")]
    Cancelled,
}

impl RenderError {
    pub(crate) fn maps(message: impl Into<String>) -> Self {
        Self::Maps(message.into())
    }

    /// Whether the same picture may come out of another renderer.
    pub fn is_of_the_device(&self) -> bool {
        matches!(self, Self::Limit { .. } | Self::Device(_))
    }
}
