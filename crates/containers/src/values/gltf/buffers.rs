//! The bytes that a glTF file points to: its own second chunk, embedded as text, or in files beside it.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::buffer::View;
use percent_encoding::percent_decode_str;
use serde::Deserialize;

use super::document::{Document, size};
use super::meshopt::{Compression, Filter, Mode};
use crate::error::Error;

/// Gives the content of a file beside another, by its path.
pub type ReadBeside<'a, E> = dyn FnMut(&str) -> Result<Arc<Vec<u8>>, E> + 'a;

const MESHOPT: &str = "EXT_meshopt_compression";

/// The extensions of buffer views that name a buffer, too.
pub(super) const COMPRESSIONS: [&str; 2] = [MESHOPT, "KHR_meshopt_compression"];

/// The content of the buffer views that are needed.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    chunk: Option<&'a [u8]>,
    /// The contents of buffers, by the index of a buffer.
    contents: BTreeMap<usize, Content<'a>>,
    /// The decompressed bytes of buffer views, by the index of a view.
    decompressed: BTreeMap<usize, Vec<u8>>,
}

enum Content<'a> {
    Here(Cow<'a, [u8]>),
    Beside(Arc<Vec<u8>>),
}

/// EXT_meshopt_compression, section "JSON schema updates".
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Meshopt {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: String,
    filter: Option<String>,
}

impl<'a> Buffers<'a> {
    /// Loads what these accessors point to.
    pub(super) fn load<E: From<Error>>(
        document: &'a Document,
        accessors: impl Iterator<Item = usize>,
        chunk: Option<&'a [u8]>,
        read: &mut ReadBeside<'_, E>,
    ) -> Result<Self, E> {
        let mut buffers = Self { document, chunk, contents: BTreeMap::new(), decompressed: BTreeMap::new() };
        for view in accessors.flat_map(|accessor| views(document, accessor)) {
            buffers.load_view(view, read)?;
        }
        Ok(buffers)
    }

    /// Loads every buffer, whether its bytes are needed here or not, except those that have none: extensions
    /// of compression call them fallback buffers.
    pub(super) fn load_all<E: From<Error>>(
        document: &'a Document,
        chunk: Option<&'a [u8]>,
        read: &mut ReadBeside<'_, E>,
    ) -> Result<Self, E> {
        let mut buffers = Self { document, chunk, contents: BTreeMap::new(), decompressed: BTreeMap::new() };
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let others = buffer.extensions.as_ref().map(|extensions| &extensions.others);
            let is_fallback = |name: &&str| {
                let extension = others.and_then(|others| others.get(*name));
                extension.and_then(|extension| extension.get("fallback")).is_some_and(|flag| *flag == true)
            };
            let is_chunk = index == 0 && chunk.is_some();
            if buffer.uri.is_some() || is_chunk || !COMPRESSIONS.iter().any(is_fallback) {
                buffers.load_buffer(index, read)?;
            }
        }
        Ok(buffers)
    }

    /// The bytes of a buffer, if it has some.
    pub(super) fn whole(&self, index: usize) -> Option<&[u8]> {
        let length = size(self.document.root.buffers.get(index)?.byte_length.0);
        self.contents.get(&index).and_then(|content| content.bytes().get(..length))
    }

    /// Checks that the buffers of these accessors are there and long enough, without reading them; `find`
    /// gives the length of a file beside the document.
    pub(super) fn check<E: From<Error>>(
        document: &'a Document,
        accessors: impl Iterator<Item = usize>,
        has_chunk: bool,
        find: &mut dyn FnMut(&str) -> Result<u64, E>,
    ) -> Result<(), E> {
        let mut needed = BTreeSet::new();
        for view in accessors.flat_map(|accessor| views(document, accessor)) {
            let Some(found) = document.root.buffer_views.get(view) else { continue };
            let meshopt = meshopt(found).map_err(|error| error.within(format!("bufferViews[{view}]")))?;
            needed.insert(meshopt.map_or(found.buffer.value(), |meshopt| meshopt.buffer));
        }
        for index in needed {
            let Some(buffer) = document.root.buffers.get(index) else { continue };
            let here = |error: Error| error.within(format!("buffers[{index}]"));
            match &buffer.uri {
                Some(uri) if uri.starts_with("data:") => {}
                Some(uri) => {
                    let (found, _) = find_beside(uri, &here, find)?;
                    let length = buffer.byte_length.0;
                    if found < length {
                        return Err(here(too_short(Some(uri), length, found)).into());
                    }
                }
                None if index == 0 && has_chunk => {}
                None => {
                    return Err(here(Error::damaged("there is neither a uri nor a binary chunk")).into());
                }
            }
        }
        Ok(())
    }

    fn load_view<E: From<Error>>(&mut self, index: usize, read: &mut ReadBeside<'_, E>) -> Result<(), E> {
        let Some(view) = self.document.root.buffer_views.get(index) else { return Ok(()) };
        let here = |error: Error| error.within(format!("bufferViews[{index}]"));
        let Some(meshopt) = meshopt(view).map_err(here)? else {
            return self.load_buffer(view.buffer.value(), read);
        };
        if self.decompressed.contains_key(&index) {
            return Ok(());
        }
        self.load_buffer(meshopt.buffer, read)?;
        let bytes = self.range(meshopt.buffer, meshopt.byte_offset, meshopt.byte_length).map_err(here)?;
        let decoded = meshopt.compression().and_then(|compression| compression.decode(bytes));
        let decoded = decoded.map_err(|error| here(error.within(MESHOPT)))?;
        self.decompressed.insert(index, decoded);
        Ok(())
    }

    fn load_buffer<E: From<Error>>(&mut self, index: usize, read: &mut ReadBeside<'_, E>) -> Result<(), E> {
        let Some(buffer) = self.document.root.buffers.get(index) else { return Ok(()) };
        if self.contents.contains_key(&index) {
            return Ok(());
        }
        let here = |error: Error| error.within(format!("buffers[{index}]"));
        let content = match (&buffer.uri, self.chunk) {
            (Some(uri), _) if uri.starts_with("data:") => Content::Here(embedded(uri).map_err(here)?.into()),
            (Some(uri), _) => Content::Beside(find_beside(uri, &here, read)?.0),
            (None, Some(chunk)) if index == 0 => Content::Here(chunk.into()),
            (None, _) => {
                return Err(here(Error::damaged("there is neither a uri nor a binary chunk")).into());
            }
        };
        let (length, found) = (size(buffer.byte_length.0), content.bytes().len());
        if found < length {
            let named = buffer.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
            return Err(here(too_short(named, length as u64, found as u64)).into());
        }
        self.contents.insert(index, content);
        Ok(())
    }

    /// The bytes of a buffer view, decompressed.
    pub(super) fn view(&self, index: usize) -> Result<(&View, &[u8]), Error> {
        let view = self.document.root.buffer_views.get(index);
        let view = view.ok_or_else(|| Error::damaged(format!("there is no buffer view {index}")))?;
        if let Some(decompressed) = self.decompressed.get(&index) {
            return Ok((view, decompressed));
        }
        let offset = view.byte_offset.unwrap_or_default().0;
        let bytes = self.range(view.buffer.value(), offset, view.byte_length.0);
        Ok((view, bytes.map_err(|error| error.within(format!("bufferViews[{index}]")))?))
    }

    /// A part of a buffer. What a file or a chunk holds beyond the buffer's length does not belong to it.
    fn range(&self, buffer: usize, offset: u64, length: u64) -> Result<&[u8], Error> {
        let content = self.contents.get(&buffer).zip(self.document.root.buffers.get(buffer));
        let (content, declared) =
            content.ok_or_else(|| Error::damaged(format!("there is no buffer {buffer}")))?;
        let bytes = content.bytes();
        let bytes = bytes.get(..size(declared.byte_length.0)).unwrap_or(bytes);
        let part = bytes.get(size(offset)..).and_then(|bytes| bytes.get(..size(length)));
        part.ok_or_else(|| {
            Error::truncated(format!(
                "{length} bytes from byte {offset} on are more than the {} of buffer {buffer}",
                bytes.len()
            ))
        })
    }
}

/// The buffer views of an accessor.
fn views(document: &Document, accessor: usize) -> impl Iterator<Item = usize> + use<'_> {
    let accessor = document.root.accessors.get(accessor);
    let sparse = accessor.and_then(|accessor| accessor.sparse.as_ref());
    let sparse = sparse.map(|sparse| [sparse.indices.buffer_view, sparse.values.buffer_view]);
    let own = accessor.and_then(|accessor| accessor.buffer_view);
    own.into_iter().chain(sparse.into_iter().flatten()).map(|view| view.value())
}

fn too_short(name: Option<&str>, length: u64, found: u64) -> Error {
    let missing = format!("byteLength is {length}, and there are {found} bytes");
    Error::truncated(name.map_or(missing.clone(), |name| format!("{name}: {missing}")))
}

impl Content<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Here(bytes) => bytes,
            Self::Beside(bytes) => bytes,
        }
    }
}

/// How a buffer view is compressed, if it is.
fn meshopt(view: &View) -> Result<Option<Meshopt>, Error> {
    let extension = view.extensions.as_ref().and_then(|extensions| extensions.others.get(MESHOPT));
    let meshopt = extension.map(Meshopt::deserialize).transpose();
    meshopt.map_err(|error| Error::damaged(error.to_string()).within(MESHOPT))
}

impl Meshopt {
    fn compression(&self) -> Result<Compression, Error> {
        let mode = match self.mode.as_str() {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            other => return Err(Error::unsupported(format!("the mode {other:?} is not read"))),
        };
        let filter = match self.filter.as_deref() {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some(other) => return Err(Error::unsupported(format!("the filter {other:?} is not read"))),
        };
        Ok(Compression { mode, filter, count: self.count, stride: self.byte_stride })
    }
}

/// The bytes of a `data:` URI (RFC 2397), which glTF embeds in base64.
pub(super) fn embedded(uri: &str) -> Result<Vec<u8>, Error> {
    let config = GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    match uri.split_once(',') {
        Some((head, text)) if head.ends_with(";base64") => GeneralPurpose::new(&STANDARD, config)
            .decode(text)
            .map_err(|error| Error::damaged(format!("the embedded data are not base64: {error}"))),
        _ => Err(Error::unsupported("the uri holds data that is not in base64")),
    }
}

/// Finds the file that a URI names: what `find` gives of it, and its path from the document's folder. `here`
/// says where in the document a mistake is.
///
/// Some exporters write names as they are, not percent-encoded: if there is no file of the decoded name, one
/// of the name as it stands is meant.
pub(super) fn find_beside<T, E: From<Error>>(
    uri: &str,
    here: &dyn Fn(Error) -> Error,
    find: &mut dyn FnMut(&str) -> Result<T, E>,
) -> Result<(T, String), E> {
    let as_written = relative(uri).map_err(here)?;
    let decoded = percent_decode_str(uri).decode_utf8().ok().and_then(|decoded| relative(&decoded).ok());
    let (first, second) = match decoded {
        Some(decoded) if decoded != as_written => (decoded, Some(as_written)),
        _ => (as_written, None),
    };
    find(&first).map(|found| (found, first)).or_else(|error| {
        let found = second.and_then(|path| find(&path).ok().map(|found| (found, path)));
        found.ok_or(error)
    })
}

/// A path beside the file, without needless steps: it may lead up to other folders, but does not begin at the
/// root. Backslashes separate folders, too.
fn relative(path: &str) -> Result<String, Error> {
    let slashed = path.replace('\\', "/");
    let scheme = slashed.split('/').next().is_some_and(|first| first.contains(':'));
    let mut parts: Vec<&str> = Vec::new();
    for part in slashed.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.last().is_some_and(|last| *last != "..") => _ = parts.pop(),
            part => parts.push(part),
        }
    }
    if scheme
        || slashed.starts_with('/')
        || path.contains('\0')
        || parts.last().is_none_or(|last| *last == "..")
    {
        return Err(Error::unsupported(format!("the uri {path:?} does not name a file beside this one")));
    }
    Ok(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_read_with_and_without_padding() {
        // The vectors of RFC 4648, section 10.
        for (text, expected) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmE=", "fooba"),
        ] {
            assert_eq!(embedded(&format!("data:;base64,{text}")).unwrap(), expected.as_bytes());
        }
        assert_eq!(embedded("data:a/b;base64,+/A").unwrap(), [0xfb, 0xf0]);
        let message = embedded("data:;base64,Zm9*").unwrap_err().to_string();
        assert_eq!(message, "the embedded data are not base64: Invalid symbol 42, offset 3.");
    }

    /// What is found if these files are there, and what was looked for.
    fn found(uri: &str, there: &[&str]) -> (Result<String, String>, Vec<String>) {
        let mut tried = Vec::new();
        let found = find_beside::<(), Error>(uri, &|error| error, &mut |path| {
            tried.push(path.to_owned());
            match there.contains(&path) {
                true => Ok(()),
                false => Err(Error::damaged(format!("{path} is missing"))),
            }
        });
        (found.map(|((), path)| path).map_err(|error| error.to_string()), tried)
    }

    #[test]
    fn a_uri_names_a_file_beside_this_one() {
        for (uri, path) in [
            ("a%20b/%C3%A4.bin", "a b/ä.bin"),
            ("a b/ä.bin", "a b/ä.bin"),
            ("100%25.bin", "100%.bin"),
            ("../textures/a.png", "../textures/a.png"),
            ("%2e%2e/textures/a.png", "../textures/a.png"),
            ("./a/../b.bin", "b.bin"),
            ("../a/../../b.bin", "../../b.bin"),
            ("textures\\a.png", "textures/a.png"),
            // Names as they are on the disk.
            ("100%.png", "100%.png"),
            ("50%_grey.png", "50%_grey.png"),
            ("%ff.png", "%ff.png"),
        ] {
            assert_eq!(found(uri, &[path]), (Ok(path.to_owned()), vec![path.to_owned()]), "{uri}");
        }
        let both = vec!["a b.png".to_owned(), "a%20b.png".to_owned()];
        assert_eq!(found("a%20b.png", &["a%20b.png"]), (Ok("a%20b.png".into()), both.clone()));
        assert_eq!(found("a%20b.png", &[]), (Err("a b.png is missing".into()), both));
        for foreign in [
            "/etc/passwd",
            "C:/a.bin",
            "http://a/b.bin",
            "\\\\host\\a",
            "file:a",
            "a\0",
            "",
            "..",
            "a/..",
            "../..",
        ] {
            let (error, tried) = found(foreign, &[]);
            assert!(error.unwrap_err().ends_with("does not name a file beside this one"), "{foreign}");
            assert_eq!(tried, Vec::<String>::new(), "{foreign}");
        }
        // What would be foreign when decoded is a name.
        assert_eq!(found("%2Fetc", &["%2Fetc"]).0, Ok("%2Fetc".into()));
    }
}
