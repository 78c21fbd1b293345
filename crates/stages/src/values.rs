//! What kinds of several folders use: the values that they exchange, the words of their parameters, numbers
//! in their messages, and how kernels are told to stop.

pub mod artifacts;
mod blended_frames;
mod choices;
mod colour;
mod encoding;
mod exported_maps;
mod light_count;
pub(crate) mod overflow;
pub(crate) mod parts;
pub mod quantity;
mod share;
pub(crate) mod toml_text;
mod until_stopped;
mod vector;
mod window;

pub(crate) use blended_frames::blend;
pub use blended_frames::blended_frames;
pub use choices::{ChosenMaterial, STOPS};
pub(crate) use choices::{
    DistributionName, Lamps, LampsName, MAX_RESOLUTION, MapLayoutName, MapsFormat, NonNegative, PlainName,
    Resolution, SHARE, ToneMapName, ViewName, edge_of,
};
pub use colour::Rgb;
pub(crate) use encoding::image;
pub use encoding::{Container, Encoding, FileFormat, Numbers, Overflow, PrecisionName, Writer};
pub use exported_maps::ExportedMaps;
pub(crate) use light_count::{LIGHTS, LightCount};
pub use overflow::Content;
pub(crate) use overflow::{Excess, LARGEST_HALF, RowsLost, note_floats, rounded, rounded_text, squares};
pub(crate) use parts::PartsName;
pub use share::{WARNED_LOSS, report_loss};
pub(crate) use share::{about, lamps_text, percent, share};
pub(crate) use toml_text::{TomlText, is_integer, table_of};
pub use until_stopped::UntilStopped;
pub use vector::{Place, Vector};
pub(crate) use window::Window;
