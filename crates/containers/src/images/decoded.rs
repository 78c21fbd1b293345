//! A picture that was read or written, and what is known of it.

use envmap::Image;

use super::colour_space::ColourSpace;
use super::panorama::Panorama;
use crate::format::Format;

/// The choice of what to read if a file holds several pictures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The OpenEXR layer: a part's name, a channel prefix, or `part.prefix`. The other formats have no
    /// layers.
    pub layer: Option<String>,
    /// The primaries that the values are in, whatever the file says. Without it, the file's own are taken, or
    /// else Rec. 709.
    pub colour_space: Option<ColourSpace>,
}

/// The layout that OpenEXR's `envmap` attribute names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum OpenExrEnvmap {
    /// OpenEXR's lat-long: pixel centres on the poles, the last column repeats the first.
    LatLong,
    /// OpenEXR's cube: six faces below each other.
    Cube,
}

/// A picture and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Linear Rec. 709 values in the file's own units, row 0 at the top of the picture.
    pub image: Image,
    /// The format that the content is in.
    pub format: Format,
    /// OpenEXR's `envmap` attribute.
    pub openexr_envmap: Option<OpenExrEnvmap>,
    /// The part of the sphere that the picture shows, if the file says something of it.
    pub panorama: Option<Panorama>,
    /// Whether the file can hold values above its white, as every one of some formats can
    /// ([`Format::is_high_dynamic_range`]), TIFF in floats, PNG whose cICP says PQ, HLG or linear, and JPEG
    /// with a gain map.
    pub high_dynamic_range: bool,
    /// The gain map of a JPEG, in a few words: its metadata, its size and its stops.
    pub gain_map: Option<String>,
    /// The name of the ICC profile by which the colours were converted, or PNG's cICP as "cICP 9/16". If
    /// other primaries were asked for, only its curve was used.
    pub profile: Option<String>,
    /// Notes of what was ignored or assumed, in whole sentences.
    pub warnings: Vec<String>,
    /// Notes of what was done that hardly changed the picture, in whole sentences.
    pub notes: Vec<String>,
    /// The recipe, if Specula wrote the file.
    pub recipe: Option<String>,
}

impl Decoded {
    /// A picture of which nothing else is known yet, nor whether its format holds high dynamic range.
    pub(crate) fn new(format: Format, image: Image) -> Self {
        Self {
            image,
            format,
            openexr_envmap: None,
            panorama: None,
            high_dynamic_range: false,
            gain_map: None,
            profile: None,
            warnings: Vec::new(),
            notes: Vec::new(),
            recipe: None,
        }
    }
}

/// A file's bytes, and how many values lost their sign.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Encoded {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Negative values that became 0, in a format without a sign.
    pub negative: usize,
}
