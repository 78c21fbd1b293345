//! A TIFF of one page for the `tiff` crate, out of one that may have several.
//!
//! It is the file itself with another beginning, which points to a directory behind the file's end. That
//! directory is the chosen page's, as grey of any number of samples: the decoder gives the samples as they
//! are stored, and leaves their meaning to us. If each sample has a plane of its own, the page is one plane:
//! the decoder fails on planes of tiles. The strips of a page packed with LZW, Zstandard, LZMA or WebP, which
//! that crate does not read, or only by a C library, or not always, are behind the end too, unpacked.

use std::io::{Cursor, Read, Seek, SeekFrom};

use lzma_rust2::XzReader;

use super::directory;
use super::directory::{Directory, Numbers};
use super::page::{Packing, Page};
use crate::error::{Error, ErrorKind};
use crate::images::webp;
use crate::{limits, zstandard};

/// LZMA's highest preset uses a dictionary of 64 MiB; the rest is the decoder's own.
const MOST_LZMA_KIB: u32 = (64 << 10) + 256;

/// The file of one page, as a stream.
pub(super) struct SinglePage<'a> {
    start: Vec<u8>,
    file: &'a [u8],
    end: Vec<u8>,
    position: usize,
}

impl<'a> SinglePage<'a> {
    /// The page, or the plane of one sample.
    pub(super) fn new(file: &'a [u8], page: &Page, plane: usize) -> Result<Self, Error> {
        let Directory { numbers, entries, .. } = &page.directory;
        let Numbers { word, .. } = *numbers;
        let mut end = Vec::new();
        let short = |tag: u16, number: u64| (tag, 3_u16, vec![number]);
        let mut changed = vec![short(directory::PHOTOMETRIC, 1)];
        let tags @ [offset_tag, count_tag] = chunk_tags(page);
        let [mut offsets, mut counts] = tags.map(|tag| page.directory.numbers(&mut Cursor::new(file), tag));
        if page.planar {
            let in_plane = offsets.len().min(counts.len()) / page.samples;
            for all in [&mut offsets, &mut counts] {
                *all = all[plane * in_plane..][..in_plane].to_vec();
            }
            changed.extend([
                short(directory::SAMPLES_PER_PIXEL, 1),
                short(directory::PLANAR_CONFIGURATION, 1),
                short(directory::BITS_PER_SAMPLE, page.bits as u64),
                short(directory::SAMPLE_FORMAT, if page.is_float() { 3 } else { 1 }),
            ]);
        }
        // What the file lacks must not be read from behind its end.
        offsets.iter().zip(&counts).try_for_each(|(at, count)| stored(file, *at, *count).map(|_| ()))?;
        if let Some(packing) = page.packing {
            changed.push(short(directory::COMPRESSION, 1));
            (offsets, counts) = unpack(file, page, packing, [&offsets, &counts], &mut end)?;
        }
        if page.planar || page.packing.is_some() {
            let long = if word == 8 { 16 } else { 4 };
            changed.extend([(offset_tag, long, offsets), (count_tag, long, counts)]);
        }
        let beyond =
            |_| Error::new(ErrorKind::TooLarge, "the unpacked image exceeds what a TIFF can address");
        // Values that do not fit into their entry go before the directory.
        let mut lines = Vec::new();
        for entry in entries.iter().filter(|entry| entry.tag != directory::EXTRA_SAMPLES) {
            let Some((_, kind, values)) = changed.iter().find(|(tag, ..)| *tag == entry.tag) else {
                // An offset or a value: both hold where they are copied to.
                lines.push(file.get(entry.place..entry.place + 4 + 2 * word).unwrap_or_default().to_vec());
                continue;
            };
            let size = if *kind == 3 { 2 } else { word };
            let mut bytes: Vec<u8> = values.iter().flat_map(|value| numbers.encode(*value, size)).collect();
            if bytes.len() > word {
                let at = file.len() + end.len();
                end.append(&mut bytes);
                bytes = numbers.encode(at as u64, word);
            }
            bytes.resize(word, 0);
            let head = [numbers.encode(entry.tag.into(), 2), numbers.encode((*kind).into(), 2)].concat();
            lines.push([head, numbers.encode(values.len() as u64, word), bytes].concat());
        }
        let at = file.len() + end.len();
        if word == 4 {
            u32::try_from(at).map_err(beyond)?;
        }
        end.extend(numbers.encode(lines.len() as u64, if word == 8 { 8 } else { 2 }));
        end.extend(lines.concat());
        end.extend(numbers.encode(0, word));
        let start = [&file[..word], &numbers.encode(at as u64, word)].concat();
        Ok(Self { start, file, end, position: 0 })
    }

    pub(super) fn len(&self) -> usize {
        self.file.len() + self.end.len()
    }
}

impl Read for SinglePage<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let part = match self.position {
            at if at < self.start.len() => &self.start[at..],
            at if at < self.file.len() => &self.file[at..],
            at => self.end.get(at - self.file.len()..).unwrap_or_default(),
        };
        let count = part.len().min(buffer.len());
        buffer[..count].copy_from_slice(&part[..count]);
        self.position += count;
        Ok(count)
    }
}

impl Seek for SinglePage<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let to = match to {
            SeekFrom::Start(at) => i128::from(at),
            SeekFrom::Current(by) => self.position as i128 + i128::from(by),
            SeekFrom::End(by) => self.len() as i128 + i128::from(by),
        };
        self.position = usize::try_from(to).map_err(|_| std::io::ErrorKind::InvalidInput)?;
        Ok(self.position as u64)
    }
}

/// The tags of offsets and lengths of strips or tiles.
fn chunk_tags(page: &Page) -> [u16; 2] {
    match page.directory.has(directory::TILE_OFFSETS) {
        true => [directory::TILE_OFFSETS, directory::TILE_BYTE_COUNTS],
        false => [directory::STRIP_OFFSETS, directory::STRIP_BYTE_COUNTS],
    }
}

/// The bytes of a strip or tile.
fn stored(file: &[u8], at: u64, count: u64) -> Result<&[u8], Error> {
    let [at, count] = [at, count].map(|number| usize::try_from(number).unwrap_or(usize::MAX));
    let bytes = at.checked_add(count).and_then(|after| file.get(at..after));
    bytes.ok_or_else(|| Error::truncated("the file ends before its data does"))
}

/// Unpacks every strip or tile behind the file's end; where they are then, and their lengths.
fn unpack(
    file: &[u8],
    page: &Page,
    packing: Packing,
    [offsets, counts]: [&[u64]; 2],
    end: &mut Vec<u8>,
) -> Result<(Vec<u64>, Vec<u64>), Error> {
    let tiles = page.directory.has(directory::TILE_OFFSETS);
    let [width, height] = page.chunk;
    limits::pixels(width, height).map_err(|error| error.within("tile"))?;
    let mut places = (Vec::new(), Vec::new());
    for (index, (offset, count)) in offsets.iter().zip(counts).enumerate() {
        let packed = stored(file, *offset, *count)?;
        // The last strip may be lower.
        let rows = if tiles { height } else { height.min(page.height.saturating_sub(index * height)) };
        let size = page.row_bytes(width).saturating_mul(rows);
        places.0.push((file.len() + end.len()) as u64);
        places.1.push(size as u64);
        end.extend(match packing {
            Packing::Lzw => lzw(packed, size)?,
            Packing::Zstandard => zstandard::decompress(packed, size)?,
            Packing::Lzma => lzma(packed, size)?,
            Packing::WebP => webp(packed, [width, rows], page.samples)?,
        });
        if end.len() > page.decoded_size().saturating_mul(2).saturating_add(file.len()) {
            return Err(Error::damaged("the strips or tiles hold more than the image"));
        }
    }
    Ok(places)
}

/// Unpacks TIFF's LZW of bytes, whose codes grow one entry before the table is full.
fn lzw(packed: &[u8], size: usize) -> Result<Vec<u8>, Error> {
    // A code has at least nine bits and stands for at most 4096 bytes.
    limits::plausible(size, packed.len(), 4096)?;
    let mut decoder = weezl::decode::Decoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    let mut bytes = vec![0; size];
    let (mut from, mut to) = (0, 0);
    // Writers may leave out the code of the end.
    while to < size {
        let result = decoder.decode_bytes(&packed[from..], &mut bytes[to..]);
        from += result.consumed_in;
        to += result.consumed_out;
        match result.status {
            Ok(weezl::LzwStatus::Ok) if result.consumed_in + result.consumed_out > 0 => {}
            Ok(_) => break,
            Err(error) => return Err(Error::damaged(format!("LZW: {error}"))),
        }
    }
    match to == size {
        true => Ok(bytes),
        false => Err(Error::damaged(format!("expected {size} bytes, LZW gives {to}"))),
    }
}

/// Unpacks an XZ stream of LZMA2; memory grows only as bytes come.
fn lzma(packed: &[u8], size: usize) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let reader = XzReader::new_mem_limit(packed, false, MOST_LZMA_KIB);
    let read = reader.take(size as u64).read_to_end(&mut bytes);
    read.map_err(|error| Error::damaged(format!("LZMA: {error}")))?;
    match bytes.len() == size {
        true => Ok(bytes),
        false => Err(Error::damaged(format!("expected {size} bytes, LZMA gives {}", bytes.len()))),
    }
}

/// Decodes a WebP of RGB or RGBA.
fn webp(packed: &[u8], [width, height]: [usize; 2], samples: usize) -> Result<Vec<u8>, Error> {
    let raster = webp::raster(packed).map_err(|error| error.within("WebP"))?;
    if [raster.width, raster.height] != [width, height] || !(raster.channels..=4).contains(&samples) {
        return Err(Error::damaged(format!(
            "a WebP of {} x {} pixels of {} channels stands for {width} x {height} of {samples}",
            raster.width, raster.height, raster.channels
        )));
    }
    if raster.channels == samples {
        return Ok(raster.samples);
    }
    Ok(raster.samples.chunks_exact(3).flat_map(|rgb| [rgb[0], rgb[1], rgb[2], u8::MAX]).collect())
}
