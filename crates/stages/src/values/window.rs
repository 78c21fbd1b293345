//! The windows of series, which are cut at some degree and so ring around bright lights.

use engine::choice;

choice! {
    /// A window, which reduces ringing. Each kind takes those that its series can have.
    pub(crate) enum Window {
        /// The least that helps, or none.
        Auto = "auto",
        /// Nothing.
        None = "none",
        /// Half a cosine period.
        Hanning = "hanning",
        /// The main lobe of a sinc.
        Lanczos = "lanczos",
        /// A penalty on the squared Laplacian.
        Laplacian = "laplacian",
        /// The weakest penalty that leaves nothing negative.
        NonNegative = "non-negative",
    }
}

impl Window {
    /// The kernel's window, if nothing else determines it: neither the series nor another parameter.
    pub(crate) fn fixed(self) -> Option<sh::Window> {
        match self {
            Self::None => Some(sh::Window::None),
            Self::Hanning => Some(sh::Window::Hanning),
            Self::Lanczos => Some(sh::Window::Lanczos),
            Self::Auto | Self::Laplacian | Self::NonNegative => None,
        }
    }
}
