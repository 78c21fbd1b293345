//! What kinds of other crates share with the kinds of this one.
//!
//! docs/plugins.md promises these items, and [`artifacts`](crate::artifacts), to everybody who writes a kind.
//! Specula's kinds for meshes use nothing else of this crate.
//!
//! - Values of parameters: [`Place`], [`Vector`], [`Rgb`], [`ChosenMaterial`] and the range [`STOPS`].
//! - Exported texels: [`Numbers`] adds the parameters `precision` and `overflow` to a kind whose `format` is
//!   a [`FileFormat`]. Its [`Encoding`] checks the three and gives a [`Writer`] of files.
//! - Inputs: [`blended_frames`] and [`picture_exposure`].
//! - Kernels that end early: [`UntilStopped`].
//! - Messages: [`report_loss`], with [`WARNED_LOSS`], and [`size`].
//! - The preview: [`ExportedMaps`].

pub use crate::picture::picture_exposure;
pub use crate::values::quantity::size;
pub use crate::values::{
    ChosenMaterial, Container, Content, Encoding, ExportedMaps, FileFormat, Numbers, Overflow, Place,
    PrecisionName, Rgb, STOPS, UntilStopped, Vector, WARNED_LOSS, Writer, blended_frames, report_loss,
};
