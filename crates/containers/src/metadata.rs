//! What a PNG, JPEG or WebP says about its pixels beside them: which way up they lie, and XMP.
//!
//! | format | orientation | XMP |
//! | --- | --- | --- |
//! | PNG | chunk eXIf | iTXt `XML:com.adobe.xmp`, or ImageMagick's raw profile |
//! | JPEG | APP1 `Exif` | APP1 of Adobe's namespace |
//! | WebP | chunk EXIF | chunk XMP |
//!
//! TIFF has both in tags of its own, TGA an orientation that its decoder applies.

use std::io::{Read, Seek, SeekFrom};

use ::image::metadata::Orientation;

use crate::format::Format;
use crate::png_text;

/// Exif and XMP that are longer are not read.
const MAX_METADATA_BYTES: usize = 4 << 20;

/// The prefix of Exif in a JPEG, which the writers of other formats sometimes put before it too.
const EXIF: &[u8] = b"Exif\0\0";
const XMP_IN_JPEG: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

/// The metadata of a file that concern its pixels.
#[derive(Clone, Debug)]
pub(crate) struct Metadata {
    pub(crate) orientation: Orientation,
    pub(crate) xmp: Option<String>,
}

impl Default for Metadata {
    fn default() -> Self {
        Self { orientation: Orientation::NoTransforms, xmp: None }
    }
}

impl Metadata {
    /// Reads the metadata of a PNG, JPEG or WebP; what is damaged says nothing.
    pub(crate) fn read(file: &mut (impl Read + Seek), format: Format) -> Self {
        let mut found = Self::default();
        let visited = match format {
            Format::Png => png_chunks(file, |name, bytes| match name {
                b"eXIf" => found.take_exif(bytes),
                b"iTXt" | b"zTXt" | b"tEXt" => found.take_xmp(png_text::xmp(name, bytes).as_deref()),
                _ => {}
            }),
            Format::Jpeg => jpeg_segments(file, |marker, bytes| {
                if marker == 0xe1 && bytes.starts_with(EXIF) {
                    found.take_exif(bytes);
                } else if marker == 0xe1 {
                    found.take_xmp(bytes.strip_prefix(XMP_IN_JPEG));
                }
            }),
            Format::WebP => riff_chunks(file, |name, bytes| match name {
                b"EXIF" => found.take_exif(bytes),
                b"XMP " => found.take_xmp(Some(bytes)),
                _ => {}
            }),
            _ => None,
        };
        // A walk ends with the file or with the pixels: what it has found until then counts.
        let _ = visited;
        found
    }

    fn take_exif(&mut self, bytes: &[u8]) {
        let exif = bytes.strip_prefix(EXIF).unwrap_or(bytes);
        self.orientation = Orientation::from_exif_chunk(exif).unwrap_or(self.orientation);
    }

    pub(crate) fn take_xmp(&mut self, bytes: Option<&[u8]>) {
        let text = bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        self.xmp = self.xmp.take().or(text);
    }
}

/// Visits the chunks of a PNG whose content is not long, to its end.
fn png_chunks(file: &mut (impl Read + Seek), mut visit: impl FnMut(&[u8; 4], &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(8)).ok()?;
    loop {
        let [a, b, c, d, name @ ..]: [u8; 8] = array(file)?;
        let length = u32::from_be_bytes([a, b, c, d]);
        let wanted = [b"eXIf", b"iTXt", b"zTXt", b"tEXt"].contains(&&name);
        block(file, length as usize, 4, wanted, |bytes| visit(&name, bytes))?;
    }
}

/// Visits the chunks of a WebP that hold metadata.
fn riff_chunks(file: &mut (impl Read + Seek), mut visit: impl FnMut(&[u8; 4], &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(12)).ok()?;
    loop {
        let [name @ .., a, b, c, d]: [u8; 8] = array(file)?;
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        let wanted = [b"EXIF", b"XMP "].contains(&&name);
        block(file, length, length % 2, wanted, |bytes| visit(&name, bytes))?;
    }
}

/// Visits the segments of a JPEG that stand before its pixels, each with its marker's second byte.
fn jpeg_segments(file: &mut (impl Read + Seek), mut visit: impl FnMut(u8, &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(2)).ok()?;
    loop {
        let [mut start, mut marker]: [u8; 2] = array(file)?;
        // Bytes of 255 may fill the space before a marker.
        while start == 0xff && marker == 0xff {
            [start, marker] = [marker, array::<1>(file)?[0]];
        }
        if start != 0xff || marker == 0xda {
            return None;
        }
        if marker == 0x01 || (0xd0..=0xd8).contains(&marker) {
            continue;
        }
        let length = usize::from(u16::from_be_bytes(array(file)?)).checked_sub(2)?;
        let wanted = (0xe0..=0xef).contains(&marker);
        block(file, length, 0, wanted, |bytes| visit(marker, bytes))?;
    }
}

/// Reads a block of this length if it is wanted and not too long, and goes on to what follows its `padding`.
fn block(
    file: &mut (impl Read + Seek),
    length: usize,
    padding: usize,
    wanted: bool,
    visit: impl FnOnce(&[u8]),
) -> Option<()> {
    let mut rest = length + padding;
    if wanted && length <= MAX_METADATA_BYTES {
        let mut bytes = Vec::new();
        file.by_ref().take(length as u64).read_to_end(&mut bytes).ok()?;
        if bytes.len() < length {
            return None;
        }
        visit(&bytes);
        rest = padding;
    }
    file.seek_relative(i64::try_from(rest).ok()?).ok()
}

fn array<const N: usize>(file: &mut impl Read) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).ok()?;
    Some(bytes)
}
