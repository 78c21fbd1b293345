//! What a picture's header says, without its pixels.

use std::io::{BufRead, Seek};

use super::codec::HeaderFacts;
use super::decoded::{OpenExrEnvmap, ReadOptions};
use super::gpano;
use super::orientation::upright_size;
use super::panorama::Panorama;
use super::recognition::identify;
use crate::error::Error;
use crate::file_part::{beginning, length, rewind};
use crate::format::Format;

/// As many bytes as tell one format from another, and a Git LFS pointer from a file.
const SIGNATURE: u64 = 256;

/// Bytes of a file in which its segments before the pixels are sought.
const LONGEST_HEADER: u64 = 1 << 20;

/// The facts in the header of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageHeader {
    /// The format that the content is in.
    pub format: Format,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// About how often [`crate::images::read_image::read_image_until`] asks whether to stop: once for each
    /// block of an OpenEXR or Radiance picture, and never for other formats.
    pub blocks: usize,
    /// OpenEXR's `envmap` attribute.
    pub openexr_envmap: Option<OpenExrEnvmap>,
    /// The part of the sphere that the picture shows, if the file says something of it.
    pub panorama: Option<Panorama>,
}

/// Reads the header of a picture of any format that [`crate::images::read_image::read_image`] reads, and as
/// little else of the file as that takes.
///
/// # Errors
/// What [`crate::images::read_image::read_image`] refuses because of the header: another format, a header
/// that is truncated or damaged, or declares more pixels than are read or than the file can hold, an
/// unsupported kind of picture, or no layer of the wanted name. Damage of the pixels is not found.
pub fn read_image_header(
    file: &mut (impl BufRead + Seek),
    options: &ReadOptions,
) -> Result<ImageHeader, Error> {
    let length = length(file)?;
    let format = identify(&beginning(file, SIGNATURE)?)?;
    rewind(file)?;
    let codec = format.codec();
    let header = (codec.header)(file, length, options).map_err(|error| error.within(codec.name))?;
    let HeaderFacts { size: stored, blocks, metadata, openexr_envmap, panorama } = header;
    let size @ [width, height] = upright_size(stored, metadata.orientation);
    let panorama = panorama.or_else(|| gpano::of_xmp(metadata.xmp.as_deref()?, size));
    Ok(ImageHeader { format, width, height, blocks, openexr_envmap, panorama })
}

/// Whether the header of a picture says that it holds light brighter than its white, though not every file of
/// its format does: by PNG's cICP, or by a JPEG's gain map.
pub fn declares_high_dynamic_range(file: &mut (impl BufRead + Seek)) -> bool {
    let Ok(start) = beginning(file, LONGEST_HEADER) else { return false };
    Format::sniff(&start).is_some_and(|format| (format.codec().declares_high_dynamic_range)(&start))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Cursor;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use envmap::Image;
    use sh::Stop;

    use super::*;
    use crate::images::open_exr::write_exr;
    use crate::images::png::write_png;
    use crate::images::radiance::write_rgbe;
    use crate::images::read_image::{read_image, read_image_until};
    use crate::precision::Precision;

    /// Files of 8 x 4 pixels.
    fn written() -> Vec<Vec<u8>> {
        let image = Image::new(8, 4, vec![[0.5; 3]; 32]).unwrap();
        vec![
            write_rgbe(&image, None).unwrap().bytes,
            write_exr(&image, Precision::Half, None).unwrap().bytes,
            write_png(8, 4, &[[9; 3]; 32], None).unwrap(),
        ]
    }

    #[test]
    fn a_header_has_the_size_of_its_picture() {
        for bytes in written() {
            let header = read_image_header(&mut Cursor::new(&bytes), &ReadOptions::default()).unwrap();
            assert_eq!((header.width, header.height), (8, 4), "{header:?}");
        }
    }

    #[test]
    fn a_header_says_how_often_reading_asks_whether_to_stop() {
        let image = Image::new(300, 150, vec![[0.5; 3]; 45_000]).unwrap();
        let exr = write_exr(&image, Precision::Half, None).unwrap().bytes;
        let files = [(write_rgbe(&image, None).unwrap().bytes, 150), (exr, 10)];
        for (bytes, expected) in files {
            let asked = AtomicUsize::new(0);
            let ask = || {
                asked.fetch_add(1, Ordering::Relaxed);
                false
            };
            read_image_until(&bytes, &ReadOptions::default(), Stop::when(&ask)).unwrap();
            let header = read_image_header(&mut Cursor::new(&bytes), &ReadOptions::default()).unwrap();
            assert_eq!([asked.into_inner(), header.blocks], [expected; 2], "{header:?}");
        }
    }

    /// The smallest file of each format among those of other programs.
    fn smallest() -> Vec<Vec<u8>> {
        let folder = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).unwrap();
        let mut files: Vec<Vec<u8>> = folder.map(|entry| fs::read(entry.unwrap().path()).unwrap()).collect();
        files.sort_by_key(Vec::len);
        let of = |format: Format| {
            let is_read = |bytes: &&Vec<u8>| {
                read_image(bytes, &ReadOptions::default()).is_ok_and(|read| read.format == format)
            };
            let found = files.iter().find(is_read);
            found.unwrap_or_else(|| panic!("crates/containers/tests/data lacks a file of {}", format.name()))
        };
        Format::ALL.iter().map(|format| of(*format).clone()).collect()
    }

    /// A check must not refuse what a run accepts, and has the run's message.
    #[test]
    fn a_truncated_or_damaged_file_is_refused_only_as_it_is_when_it_is_read() {
        for bytes in written().into_iter().chain(smallest()) {
            for cut in 0..bytes.len() {
                let header = read_image_header(&mut Cursor::new(&bytes[..cut]), &ReadOptions::default());
                if header.is_err() {
                    assert!(read_image(&bytes[..cut], &ReadOptions::default()).is_err(), "{cut}");
                }
                let mut damaged = bytes.clone();
                damaged[cut] ^= 0x55;
                let header = read_image_header(&mut Cursor::new(&damaged), &ReadOptions::default());
                if let Err(error) = header {
                    let read = read_image(&damaged, &ReadOptions::default()).unwrap_err();
                    assert_eq!(error.kind(), read.kind(), "{cut}: {error}, {read}");
                }
            }
        }
    }
}
