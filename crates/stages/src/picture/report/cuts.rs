//! What the section on BRDF tables shows: cuts of light and table, and their pictures.

use sh::Window;
use sphere::LatLong;

/// The highest degree that is tried: that of [KSS02, fig. 6].
pub(crate) const MAX_CUT: usize = 14;

/// The degrees whose pictures are shown, and their windows.
pub(crate) const SHOWN: [(usize, Window); 5] = [
    (2, Window::None),
    (4, Window::None),
    (6, Window::None),
    (MAX_CUT, Window::None),
    (MAX_CUT, Window::Hanning),
];

/// The grid of a picture of light.
pub(crate) const PICTURE: LatLong = LatLong::with_rows(66);

/// 8-bit sRGB pictures of the section.
#[derive(Default)]
pub(crate) struct TablePictures {
    /// The light of each of [`SHOWN`], and the environment itself, for each environment.
    pub(crate) lights: Vec<Vec<Vec<[u8; 3]>>>,
    /// The spheres of each of [`SHOWN`], and by brute force, for each material under each environment.
    pub(crate) spheres: Vec<Vec<Vec<Vec<[u8; 3]>>>>,
}
