//! What every format of pictures has: how its files are known, and what reads them. Each has its own in a
//! module of its name, as `CODEC`.

use std::io::{BufRead, Seek};

use sh::Stop;

use super::decoded::{Decoded, OpenExrEnvmap, ReadOptions};
use super::panorama::Panorama;
use crate::error::Error;
use crate::metadata::Metadata;

/// A file that is open.
pub(crate) trait OpenFile: BufRead + Seek {}

impl<T: BufRead + Seek> OpenFile for T {}

/// How a format of pictures is known and read.
pub(crate) struct Codec {
    /// The format's usual name, as texts have it.
    pub(crate) name: &'static str,
    /// The endings of its files' names, without the dot and in lower case.
    pub(crate) endings: &'static [&'static str],
    /// What its files are known by.
    pub(crate) known_by: KnownBy,
    /// Whether every file can hold values above its white.
    pub(crate) high_dynamic_range: bool,
    /// Whether a file that begins with these bytes, a MiB of them or all, says that it holds values above its
    /// white; asked where not every file can.
    pub(crate) declares_high_dynamic_range: fn(&[u8]) -> bool,
    /// Whether a file can have layers, of which [`ReadOptions`] may name one.
    pub(crate) has_layers: bool,
    /// Reads a whole file. Its errors do not name the format.
    pub(crate) read: fn(&[u8], &ReadOptions, Stop<'_>) -> Result<Decoded, Error>,
    /// Reads the header of a file at its beginning, whose length in bytes is given, and refuses nothing that
    /// `read` accepts.
    pub(crate) header: fn(&mut dyn OpenFile, usize, &ReadOptions) -> Result<HeaderFacts, Error>,
    /// Reads the recipe that a file holds if Specula wrote it.
    pub(crate) recipe: fn(&[u8]) -> Option<String>,
}

/// What the files of a format are known by: the test of a file's first bytes, 256 of them or all.
pub(crate) enum KnownBy {
    /// A signature, which no file of another format begins with.
    Signature(fn(&[u8]) -> bool),
    /// A header that makes sense. It counts if no format has the signature that the file begins with.
    Header(fn(&[u8]) -> bool),
}

#[derive(Default)]
pub(crate) struct HeaderFacts {
    /// Columns and rows as they are stored, before the picture is turned upright.
    pub(crate) size: [usize; 2],
    /// About how often [`Codec::read`] asks whether to stop.
    pub(crate) blocks: usize,
    /// The orientation, and XMP.
    pub(crate) metadata: Metadata,
    /// OpenEXR's `envmap` attribute.
    pub(crate) openexr_envmap: Option<OpenExrEnvmap>,
    /// The part of the sphere that the picture shows, if something else than XMP says so.
    pub(crate) panorama: Option<Panorama>,
}
