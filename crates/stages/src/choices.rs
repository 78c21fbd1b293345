//! Choices and ranges that parameters of several kinds have in common.

use std::ops::{Bound, RangeInclusive};

use containers::Precision;
use engine::{OrAuto, choice};
use envmap::ToneMap;
use shrm::{MapLayout, View};

/// A share above 0 and below 1.
pub(crate) const SHARE: (Bound<f64>, Bound<f64>) = (Bound::Excluded(0.0), Bound::Excluded(1.0));

/// Stops: factors of two.
pub(crate) const STOPS: RangeInclusive<f64> = -100.0..=100.0;

/// The largest resolution of a map: what a texture unit takes.
pub(crate) const MOST: usize = 4096;

/// The edge of a cube's face or the rows of a lat-long map; `"auto"` is the least that meets an error.
pub(crate) type Resolution = OrAuto<usize>;

/// The edge of a cube's face that is as fine as a map, if its resolution is fixed: a face looks at half of
/// the angle of a lat-long map's rows.
pub(crate) fn edge_of(resolution: Option<Resolution>, layout: MapLayout) -> Option<usize> {
    match (resolution, layout) {
        (Some(Resolution::Fixed(edge)), MapLayout::Cube) => Some(edge),
        (Some(Resolution::Fixed(rows)), MapLayout::LatLong) => Some(rows.div_ceil(2)),
        (Some(Resolution::Auto) | None, _) => None,
    }
}

choice! {
    /// The layout of the texels of a map.
    pub(crate) enum MapLayoutName: MapLayout {
        /// Six faces.
        Cube = "cube",
        /// Rows of latitude.
        LatLong = "lat-long",
    }
}

choice! {
    /// The frame in which the views of a map are given.
    pub(crate) enum ViewName: View {
        /// The view in the frame of the texel.
        Local = "local",
        /// The view in the world.
        Global = "global",
    }
}

choice! {
    /// The numbers of a file.
    pub(crate) enum PrecisionName: Precision {
        /// 16 bits.
        Half = "half",
        /// 32 bits.
        Float = "float",
    }
}

choice! {
    /// What happens to values past the largest half.
    pub(crate) enum Overflow {
        /// Each becomes the largest half.
        Clamp = "clamp",
        /// The item fails.
        Error = "error",
    }
}

choice! {
    /// The curve from exposed radiance to what is shown.
    pub(crate) enum ToneMapName: ToneMap {
        /// A film-like shoulder: highlights keep their shape.
        Filmic = "filmic",
        /// None: what is brighter than white is white.
        Plain = "plain",
    }
}

choice! {
    /// How a set of maps is written.
    pub(crate) enum MapsFormat {
        /// One KTX2 texture.
        Ktx2 = "ktx2",
        /// One DDS texture.
        Dds = "dds",
        /// An OpenEXR picture for each map.
        Exr = "exr",
    }
}
