//! XMP in the text chunks of a PNG: iTXt `XML:com.adobe.xmp`, compressed or not, and what ImageMagick writes,
//! `Raw profile type xmp` in hexadecimal digits.

use std::io::Cursor;

use ::png::Decoder;

/// The most bytes that a text is unpacked to.
const MAX_TEXT_BYTES: usize = 4 << 20;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// One pixel of grey.
const HEADER: &[u8] = &[0, 0, 0, 1, 0, 0, 0, 1, 8, 0, 0, 0, 0];

/// The XMP in a chunk iTXt, zTXt or tEXt, if it is one.
pub(crate) fn xmp(name: &[u8; 4], content: &[u8]) -> Option<Vec<u8>> {
    const KEYWORD: &str = "XML:com.adobe.xmp";
    const RAW: &str = "Raw profile type xmp";
    if ![KEYWORD, RAW].iter().any(|keyword| content.starts_with(keyword.as_bytes())) {
        return None;
    }
    // The `png` crate unpacks the chunk: it may stand behind the pixels of its own file, where the crate has
    // to decode them first.
    let file = [SIGNATURE, &chunk(b"IHDR", HEADER), &chunk(name, content), &chunk(b"IDAT", &[])].concat();
    let mut decoder = Decoder::new(Cursor::new(file));
    decoder.ignore_checksums(true);
    let reader = decoder.read_info().ok()?;
    let info = reader.info().clone();
    if let Some(mut text) = info.utf8_text.into_iter().find(|text| text.keyword == KEYWORD) {
        text.decompress_text_with_limit(MAX_TEXT_BYTES).ok()?;
        return text.get_text().ok().map(String::into_bytes);
    }
    if let Some(mut text) = info.compressed_latin1_text.into_iter().find(|text| text.keyword == RAW) {
        text.decompress_text_with_limit(MAX_TEXT_BYTES).ok()?;
        return raw(&text.get_text().ok()?);
    }
    raw(&info.uncompressed_latin1_text.into_iter().find(|text| text.keyword == RAW)?.text)
}

fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let length = (content.len() as u32).to_be_bytes();
    [&length[..], name, content, &[0; 4]].concat()
}

/// The bytes of a raw profile: its name, its length, and lines of digits.
fn raw(text: &str) -> Option<Vec<u8>> {
    let (_name, rest) = text.trim_start().split_once('\n')?;
    let (_length, digits) = rest.trim_start().split_once('\n')?;
    let digits: Vec<u32> =
        digits.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_digit(16)).collect::<Option<_>>()?;
    Some(digits.chunks_exact(2).map(|pair| (pair[0] * 16 + pair[1]) as u8).collect())
}
