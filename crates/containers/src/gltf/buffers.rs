//! The bytes that a glTF file points to: its own second chunk, embedded as text, or in files beside it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::ReadBeside;
use super::document::Document;
use crate::error::Error;

/// The content of the buffers that are needed, by index, and how much of it the document tells of: all of it is there.
pub(super) struct Buffers<'a> {
    contents: BTreeMap<usize, (Content<'a>, usize)>,
}

enum Content<'a> {
    Here(Cow<'a, [u8]>),
    Beside(Arc<Vec<u8>>),
}

impl<'a> Buffers<'a> {
    /// Loads what these accessors point to. What points nowhere is left to be told by who reads it.
    pub(super) fn load<E: From<Error>>(
        document: &Document,
        accessors: impl Iterator<Item = usize>,
        chunk: Option<&'a [u8]>,
        read: &mut ReadBeside<'_, E>,
    ) -> Result<Self, E> {
        let mut contents = BTreeMap::new();
        for accessor in accessors.filter_map(|accessor| document.accessors.get(accessor)) {
            let sparse = accessor.sparse.as_ref();
            let views = [
                accessor.buffer_view,
                sparse.map(|s| s.indices.buffer_view),
                sparse.map(|s| s.values.buffer_view),
            ];
            for view in views.into_iter().flatten().filter_map(|view| document.buffer_views.get(view)) {
                let Some(buffer) = document.buffers.get(view.buffer) else { continue };
                if contents.contains_key(&view.buffer) {
                    continue;
                }
                let here = |error: Error| error.within(format!("buffers[{}]", view.buffer));
                let content = match (&buffer.uri, chunk) {
                    (Some(uri), _) if uri.starts_with("data:") => {
                        Content::Here(Cow::Owned(embedded(uri).map_err(here)?))
                    }
                    (Some(uri), _) => Content::Beside(read(&relative(uri).map_err(here)?)?),
                    (None, Some(chunk)) if view.buffer == 0 => Content::Here(Cow::Borrowed(chunk)),
                    (None, _) => {
                        return Err(here(Error::damaged("there is neither a uri nor a binary chunk")).into());
                    }
                };
                let (length, found) = (buffer.byte_length, content.bytes().len());
                if found < length {
                    let missing = format!("byteLength is {length}, and there are {found} bytes");
                    let named = buffer.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
                    let missing = named.map_or(missing.clone(), |uri| format!("{uri}: {missing}"));
                    return Err(here(Error::truncated(missing)).into());
                }
                contents.insert(view.buffer, (content, length));
            }
        }
        Ok(Self { contents })
    }

    /// The bytes of a buffer; what a file or a chunk holds beyond them is not of it.
    pub(super) fn get(&self, buffer: usize) -> Option<&[u8]> {
        let (content, length) = self.contents.get(&buffer)?;
        content.bytes().get(..*length)
    }
}

impl Content<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Here(bytes) => bytes,
            Self::Beside(bytes) => bytes,
        }
    }
}

/// The bytes of a `data:` URI (RFC 2397), which glTF embeds in base 64.
fn embedded(uri: &str) -> Result<Vec<u8>, Error> {
    match uri.split_once(',') {
        Some((head, text)) if head.ends_with(";base64") => base_64(text),
        _ => Err(Error::unsupported("the uri holds data that is not in base 64")),
    }
}

/// Bytes of base 64 (RFC 4648, section 4).
fn base_64(text: &str) -> Result<Vec<u8>, Error> {
    let digits = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    for (group, four) in digits.chunks(4).enumerate() {
        let mut bits = 0_u32;
        for (place, &digit) in four.iter().enumerate() {
            let value = match digit {
                b'A'..=b'Z' => digit - b'A',
                b'a'..=b'z' => digit - b'a' + 26,
                b'0'..=b'9' => digit - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => {
                    let at = 4 * group + place;
                    return Err(Error::damaged(format!(
                        "character {at} of the embedded data is not of base 64"
                    )));
                }
            };
            bits |= u32::from(value) << (18 - 6 * place);
        }
        // Two characters hold one byte, three two; one alone holds none.
        bytes.extend(&bits.to_be_bytes()[1..four.len()]);
    }
    Ok(bytes)
}

/// The path that a URI names beside the file.
fn relative(uri: &str) -> Result<String, Error> {
    let path = percent_decoded(uri)
        .ok_or_else(|| Error::damaged(format!("the uri {uri:?} is not percent-encoded UTF-8")))?;
    let scheme = path.split(['/', '\\']).next().is_some_and(|first| first.contains(':'));
    if scheme || path.starts_with(['/', '\\']) || path.contains('\0') || path.is_empty() {
        return Err(Error::unsupported(format!("the uri {uri:?} names no file beside this one")));
    }
    if path.split(['/', '\\']).any(|part| part == "..") {
        return Err(Error::unsupported(format!(
            "the uri {uri:?} goes up a folder; files are read from the folder of this one, and below, by paths without \"..\""
        )));
    }
    Ok(path)
}

fn percent_decoded(uri: &str) -> Option<String> {
    let (mut bytes, mut rest) = (Vec::with_capacity(uri.len()), uri.as_bytes());
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let (digits, tail) = rest.split_at_checked(2)?;
        let digits = str::from_utf8(digits).ok().filter(|digits| !digits.starts_with('+'))?;
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        rest = tail;
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_of_every_length_is_read() {
        // The vectors of RFC 4648, section 10, with and without padding.
        for (text, expected) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base_64(text).unwrap(), expected.as_bytes());
        }
        assert_eq!(base_64("+/A").unwrap(), [0xfb, 0xf0]);
        assert_eq!(
            base_64("Zm9*").unwrap_err().to_string(),
            "character 3 of the embedded data is not of base 64"
        );
    }

    #[test]
    fn paths_are_decoded_and_stay_in_the_folder() {
        assert_eq!(relative("a%20b/%C3%A4.bin").unwrap(), "a b/ä.bin");
        assert_eq!(relative("100%25.bin").unwrap(), "100%.bin");
        for upward in ["../a.bin", "a/../b.bin", "a/%2e%2e/b.bin", "..\\a", "a/.."] {
            let message = relative(upward).unwrap_err().to_string();
            assert!(message.contains("goes up a folder"), "{message}");
        }
        for foreign in
            ["/etc/passwd", "%2Fetc", "C:/a.bin", "http://a/b.bin", "\\\\host\\a", "file:a", "%00", ""]
        {
            let message = relative(foreign).unwrap_err().to_string();
            assert!(message.ends_with("names no file beside this one"), "{message}");
        }
        for broken in ["%", "%4", "%zz", "%+1", "%ff"] {
            assert!(
                relative(broken).unwrap_err().to_string().contains("not percent-encoded UTF-8"),
                "{broken}"
            );
        }
    }
}
