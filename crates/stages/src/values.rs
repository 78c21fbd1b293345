//! What kinds of several folders use: the values that they exchange, the words of their parameters, numbers
//! in their messages, and how kernels are told to stop.

pub mod artifacts;
mod blended_frames;
mod choices;
mod colour;
mod encoding;
mod exported_maps;
pub(crate) mod overflow;
pub(crate) mod parts;
pub mod quantity;
mod share;
pub(crate) mod toml_text;
mod until_stopped;
mod vector;
mod window;

pub(crate) use blended_frames::{blend, blended_frames};
pub(crate) use choices::{
    ChosenMaterial, DistributionName, Lamps, LampsName, MAX_RESOLUTION, MapLayoutName, MapsFormat,
    NonNegative, PlainName, Resolution, SHARE, STOPS, ToneMapName, ViewName, edge_of,
};
pub use colour::Rgb;
pub(crate) use encoding::{Container, Encoding, FileFormat, Numbers, Overflow, Writer, image};
pub use exported_maps::ExportedMaps;
pub(crate) use overflow::{Content, Excess, LARGEST_HALF, note_floats, rounded, rounded_text};
pub(crate) use parts::PartsName;
pub(crate) use share::{LOSS, about, lamps_text, percent, report_loss, share};
pub(crate) use toml_text::{TomlText, is_integer, table_of};
pub(crate) use until_stopped::UntilStopped;
pub(crate) use vector::{Place, Vector};
pub(crate) use window::Window;
