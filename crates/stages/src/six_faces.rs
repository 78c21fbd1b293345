//! Finds the six faces of a cube map among the names in a folder.
//!
//! The end of a file's name, before the extension and in upper or lower case, says which face it is:
//!
//! | face | ends in one of |
//! | --- | --- |
//! | +X | `px`, `posx`, `right` |
//! | -X | `nx`, `negx`, `left` |
//! | +Y | `py`, `posy`, `top`, `up` |
//! | -Y | `ny`, `negy`, `bottom`, `down` |
//! | +Z | `pz`, `posz`, `front` |
//! | -Z | `nz`, `negz`, `back` |
//!
//! The part before that is the prefix, which all six share: `pisa_px.hdr` ... `pisa_nz.hdr`.

use std::collections::BTreeMap;

use engine::Failure;
use sphere::Face;

/// The words at the end of a face's file name. Specula writes the first word of each.
const WORDS: [(Face, &[&str]); 6] = [
    (Face::PositiveX, &["px", "posx", "right"]),
    (Face::NegativeX, &["nx", "negx", "left"]),
    (Face::PositiveY, &["py", "posy", "top", "up"]),
    (Face::NegativeY, &["ny", "negy", "bottom", "down"]),
    (Face::PositiveZ, &["pz", "posz", "front"]),
    (Face::NegativeZ, &["nz", "negz", "back"]),
];

/// The extensions of files that can be a face.
const EXTENSIONS: [&str; 11] =
    ["exr", "hdr", "pic", "rgbe", "png", "jpg", "jpeg", "tif", "tiff", "tga", "webp"];

/// The parts of a file's name: the prefix before the word, the extension, and the face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FaceName {
    pub(crate) prefix: String,
    pub(crate) extension: String,
    pub(crate) face: Face,
}

impl FaceName {
    /// The face of a file name, if it has one.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let (stem, extension) = name.rsplit_once('.')?;
        let (lower, extension) = (stem.to_ascii_lowercase(), extension.to_ascii_lowercase());
        if !EXTENSIONS.contains(&extension.as_str()) {
            return None;
        }
        let candidates = WORDS.iter().flat_map(|(face, words)| words.iter().map(move |word| (*face, *word)));
        // `posx` ends in no other word, but "pop-up" style prefixes exist: the longest word wins.
        let (face, word) =
            candidates.filter(|(_, word)| lower.ends_with(word)).max_by_key(|(_, word)| word.len())?;
        let prefix = stem[..stem.len() - word.len()].to_owned();
        // A word inside another word does not count: `group.hdr` is not "up", and `copy.hdr` is not "py".
        let joined = prefix.chars().next_back().is_some_and(|last| last.is_alphabetic());
        (!joined).then_some(Self { prefix, extension, face })
    }
}

/// The names of the six faces in file order (+X -X +Y -Y +Z -Z), from the names in a folder.
///
/// With `prefix`, only files with this prefix and extension count.
///
/// # Errors
/// If a face is missing, or two files are the same face: what was found and what is missing.
pub(crate) fn find(
    names: &[(String, bool)],
    like: Option<&FaceName>,
    place: &str,
) -> Result<[String; 6], Failure> {
    let mut sets: BTreeMap<(String, String), Vec<(Face, &str)>> = BTreeMap::new();
    for (name, folder) in names {
        let Some(found) = FaceName::parse(name).filter(|_| !folder) else { continue };
        if like.is_none_or(|like| like.prefix == found.prefix && like.extension == found.extension) {
            sets.entry((found.prefix, found.extension)).or_default().push((found.face, name));
        }
    }
    if sets.len() > 1 {
        let sets = sets
            .iter()
            .map(|((prefix, extension), faces)| format!("{prefix}*.{extension} ({} files)", faces.len()));
        return Err(Failure::new(format!(
            "{place} holds several sets of faces: {}",
            sets.collect::<Vec<_>>().join(", ")
        ))
        .help("name one face of each set as the source (\"folder/*_px.hdr\") with layout = \"cube\""));
    }
    let found = sets.into_values().next().unwrap_or_default();
    let mut faces = [const { String::new() }; 6];
    let mut missing = Vec::new();
    for (slot, (face, words)) in faces.iter_mut().zip(WORDS) {
        let mut files = found.iter().filter(|(of, _)| *of == face).map(|(_, name)| *name);
        match (files.next(), files.next()) {
            (Some(name), None) => *slot = name.to_owned(),
            (Some(first), Some(second)) => {
                return Err(Failure::new(format!("{place}: {first} and {second} are the same face")));
            }
            (None, _) => missing.push(words.join(" or ")),
        }
    }
    if missing.is_empty() {
        return Ok(faces);
    }
    let have = match found.as_slice() {
        [] if names.is_empty() => "the folder is empty".to_owned(),
        [] => format!("none of its {} names ends in a face's word", names.len()),
        found => format!("found {}", found.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", ")),
    };
    Err(Failure::new(format!("{place} does not hold six faces: {have}; missing: {}", missing.join("; ")))
        .help("a face's file name ends in px, nx, py, ny, pz, nz, in posx ... negz, or in right, left, top, bottom, front, back"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(names: &[&str]) -> Vec<(String, bool)> {
        names.iter().map(|name| ((*name).to_owned(), false)).collect()
    }

    #[test]
    fn every_family_of_names_gives_file_order() {
        for names in [
            ["nx.hdr", "ny.hdr", "nz.hdr", "px.hdr", "py.hdr", "pz.hdr"],
            ["a_negx.exr", "a_negy.exr", "a_negz.exr", "a_posx.exr", "a_posy.exr", "a_posz.exr"],
            ["s-Left.png", "s-Bottom.png", "s-Back.png", "s-Right.png", "s-Top.png", "s-Front.png"],
        ] {
            let mut listing = files(&names);
            listing.push(("readme.txt".into(), false));
            listing.push(("thumbs".into(), true));
            let [nx, ny, nz, px, py, pz] = names;
            assert_eq!(find(&listing, None, "sky").unwrap(), [px, nx, py, ny, pz, nz]);
        }
    }

    #[test]
    fn a_missing_face_is_named_with_the_faces_that_were_found() {
        let failure =
            find(&files(&["px.hdr", "nx.hdr", "py.hdr", "pz.hdr", "nz.hdr"]), None, "sky").unwrap_err();
        let message = failure.to_string();
        assert!(message.contains("found px.hdr, nx.hdr, py.hdr, pz.hdr, nz.hdr"), "{message}");
        assert!(message.ends_with("missing: ny or negy or bottom or down"), "{message}");
        let message = find(&files(&["a.hdr"]), None, "sky").unwrap_err().to_string();
        assert!(message.contains("none of its 1 names ends in a face's word"), "{message}");
    }

    #[test]
    fn two_sets_in_a_folder_are_distinguished_by_a_face() {
        let names =
            ["a_px", "a_nx", "a_py", "a_ny", "a_pz", "a_nz", "b_px", "b_nx", "b_py", "b_ny", "b_pz", "b_nz"];
        let names = names.map(|name| format!("{name}.hdr"));
        let listing = files(&names.each_ref().map(String::as_str));
        let message = find(&listing, None, "sky").unwrap_err().to_string();
        assert_eq!(message, "sky holds several sets of faces: a_*.hdr (6 files), b_*.hdr (6 files)");
        let like = FaceName::parse("b_px.hdr").unwrap();
        assert_eq!(find(&listing, Some(&like), "sky").unwrap()[5], "b_nz.hdr");
    }

    #[test]
    fn two_files_of_one_face_are_an_error() {
        let names = files(&["px.hdr", "posx.hdr"]);
        assert!(
            find(&names, None, "sky")
                .unwrap_err()
                .to_string()
                .contains("px.hdr and posx.hdr are the same face")
        );
    }

    #[test]
    fn a_word_inside_a_word_is_not_a_face() {
        for name in ["group.hdr", "copy.hdr", "px", "px.txt", "sky.hdr", "desktop.png"] {
            assert_eq!(FaceName::parse(name), None, "{name}");
        }
        assert_eq!(FaceName::parse("pisa2px.HDR").unwrap().prefix, "pisa2");
    }
}
