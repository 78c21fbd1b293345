//! The pictures that a source consists of: one, the six faces of a cube, or a texture that holds light.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use containers::is_light_texture;
use engine::{Failure, ItemFiles};
use envmap::Layout;

use super::six_faces;
use super::six_faces::{FaceFiles, FaceName};

/// The content of a file.
pub(super) type Bytes = Arc<Vec<u8>>;

/// The pictures of a source.
pub(super) enum SourcePictures {
    /// The source itself, and its content if it was read.
    One(Option<Bytes>),
    /// The faces of a cube, and their files.
    Faces(FaceFiles, Vec<PathBuf>),
    /// A texture that holds light, and its content if it was read.
    Texture(Option<Bytes>),
}

impl SourcePictures {
    /// The pictures of a source whose layout the manifest may name; `reads_whole` as of [`is_texture`].
    pub(super) fn find(
        source: &Path,
        reads_whole: bool,
        layout: Option<Layout>,
        files: &ItemFiles<'_>,
    ) -> Result<Self, Failure> {
        if files.is_folder(source) {
            return match layout {
                None | Some(Layout::Cube) => Self::faces(source, None, files),
                _ => Err(Failure::new(format!(
                    "{} is a folder, but only six cube faces can be read from a folder",
                    name(source)
                ))
                .help("name a file as the source, or remove layout")),
            };
        }
        let (is_texture, bytes) = is_texture(source, reads_whole, files)?;
        if is_texture {
            return Ok(Self::Texture(bytes));
        }
        if layout == Some(Layout::Cube) {
            let face = FaceName::parse(&name(source)).ok_or_else(|| {
                Failure::new(format!(
                    "{} is not a folder of six faces, and its name does not end in a word for a face",
                    name(source)
                ))
                .help("with layout = \"cube\" the source is a folder or one face, such as \"sky_px.hdr\"")
            })?;
            let folder = source.parent().unwrap_or(Path::new(""));
            return Self::faces(folder, Some(&face), files);
        }
        Ok(Self::One(bytes))
    }

    /// The six images of one set in a folder.
    fn faces(folder: &Path, like: Option<&FaceName>, files: &ItemFiles<'_>) -> Result<Self, Failure> {
        let files = six_faces::find(&files.list(folder)?, like, &name(folder))?;
        let paths = files.names.iter().map(|name| folder.join(name)).collect();
        Ok(Self::Faces(files, paths))
    }
}

/// Whether a file is a texture that holds light, by its content, which is returned if all of it was read.
/// What a check reads of it is not recorded as the whole file, which is why a run reads all of it.
fn is_texture(
    path: &Path,
    reads_whole: bool,
    files: &ItemFiles<'_>,
) -> Result<(bool, Option<Bytes>), Failure> {
    /// The number of bytes of the longest signature.
    const SIGNATURE: u64 = 12;
    let whole = || files.read(path).map(|bytes| (is_light_texture(&bytes), Some(bytes)));
    if reads_whole {
        return whole();
    }
    let mut first = Vec::new();
    files.open(path)?.take(SIGNATURE).read_to_end(&mut first)?;
    // What glTF holds is known only by the whole document.
    let is_document = first.starts_with(b"glTF") || first.trim_ascii_start().starts_with(b"{");
    if is_document { whole() } else { Ok((is_light_texture(&first), None)) }
}

/// The last part of a path, for messages.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
