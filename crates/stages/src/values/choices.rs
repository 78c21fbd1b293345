//! Choices and ranges that parameters of several kinds have in common.

use std::ops::{Bound, RangeInclusive};

use containers::MaterialChoice;
use engine::{Diagnostic, OrAuto, Parameter, Value, ValueKind, choice, unexpected};
use envmap::ToneMap;
use shrm::{Distribution, MapLayout, Plain, View};

use super::encoding::{Container, FileFormat};

/// The range of a share: above 0 and below 1.
pub(crate) const SHARE: (Bound<f64>, Bound<f64>) = (Bound::Excluded(0.0), Bound::Excluded(1.0));

/// The range of a parameter that counts stops, which are factors of two.
pub const STOPS: RangeInclusive<f64> = -100.0..=100.0;

/// The largest resolution of a map: what a texture unit takes.
pub(crate) const MAX_RESOLUTION: usize = 4096;

/// The edge of a cube's face or the rows of a lat-long map; `"auto"` is the least that meets an error.
pub(crate) type Resolution = OrAuto<usize>;

/// A material of a glTF file in a manifest, by its name or its number.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenMaterial(pub MaterialChoice);

impl Parameter for ChosenMaterial {
    fn expected() -> String {
        "the name of a material, or its number, counted from 0".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let choice = match &value.kind {
            ValueKind::String(name) => Some(MaterialChoice::Name(name.clone())),
            ValueKind::Integer(number) => usize::try_from(*number).ok().map(MaterialChoice::Index),
            _ => None,
        };
        choice.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        match &self.0 {
            MaterialChoice::Name(name) => name.as_str().into(),
            MaterialChoice::Index(number) => (*number).into(),
        }
    }

    fn schema() -> serde_json::Value {
        serde_json::json!({ "type": ["string", "integer"], "minimum": 0 })
    }
}

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

impl FileFormat for MapsFormat {
    fn container(self) -> Container {
        match self {
            Self::Ktx2 => Container::Ktx2,
            Self::Dds => Container::Dds,
            Self::Exr => Container::Exr,
        }
    }
}

choice! {
    /// Where the light of suns and lamps is.
    pub(crate) enum LampsName {
        /// In the map, which holds all light.
        Baked = "baked",
        /// Beside the map, as `lights` that the renderer adds.
        Separate = "separate",
    }
}

choice! {
    /// How negative values are avoided.
    pub(crate) enum NonNegative {
        /// By the nearest function without them, in least squares.
        Nearest = "nearest",
        /// By the nearest one that has the same mean.
        NearestSameMean = "nearest-same-mean",
    }
}

impl NonNegative {
    /// The rule for the mean of the function.
    pub(crate) fn mean(self) -> sh::Mean {
        match self {
            Self::Nearest => sh::Mean::Free,
            Self::NearestSameMean => sh::Mean::Kept,
        }
    }
}

choice! {
    /// Which map represents a material that changes with the view.
    pub(crate) enum PlainName: Plain {
        /// The mean over all views.
        Mean = "mean",
        /// The surface viewed straight on.
        HeadOn = "head-on",
    }
}

choice! {
    /// Where suns and lamps go.
    pub(crate) enum Lamps {
        /// They become lights beside the series.
        Separate = "separate",
        /// They stay in the series.
        Series = "series",
    }
}

choice! {
    /// The lobe.
    pub(crate) enum DistributionName: Distribution {
        /// GGX: metal, plastic, nearly everything.
        Ggx = "ggx",
        /// Charlie: sheen, of cloth.
        Charlie = "charlie",
        /// A cosine: irradiance over pi.
        Lambert = "lambert",
    }
}
