//! Finds the six faces of a cube map among the names in a folder.
//!
//! The end of a file's name, before the extension and in upper or lower case, says which face it is. The part
//! before that is the prefix, which all six share: `pisa_px.hdr` ... `pisa_nz.hdr`. Names by axes say all.
//! Words such as left and right do not: engines that were built around Quake's skies have at the right of the
//! front what they call left. So words come with the arrangements in use, and the pictures decide: their
//! edges meet in the right one. If they meet in none, the first counts.

use std::collections::BTreeMap;

use containers::Format;
use engine::Failure;
use envmap::Image;
use sphere::{Cube, DVec3, Direction, Face, from_cube, to_cube};

/// A family of names.
struct Family {
    /// The words of the six files: by axes in the order of [`Face::ALL`], otherwise right, left, up, down,
    /// front, back. Specula writes the first word of each of the first family.
    words: [&'static [&'static str]; 6],
    /// The arrangements of the files on the faces of [`Face::ALL`], the likeliest first.
    arrangements: &'static [[usize; 6]],
}

/// The arrangement in which the right of the front is the right.
const INSIDE: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// The right of the front is called left: Unity's skybox of six sides, whose front is +Z and whose left is +X
/// (`Skybox-6-Sided.shader` of Unity's built-in shaders calls its textures "Front [+Z]", "Left [+X]" and so
/// on).
const EXCHANGED: [usize; 6] = [1, 0, 2, 3, 4, 5];

/// Quake and Source: `rt` is +X, `bk` +Y, `lf` -X and `ft` -Y of a frame that is Specula's, the top of `up`
/// lies at `lf` and that of `dn` at `rt` (`suf`, `skytexorder` and `st_to_vec` of Quake II's
/// `ref_gl/gl_warp.c`).
const QUAKE: [usize; 6] = [4, 5, 2, 3, 0, 1];

const FAMILIES: [Family; 4] = [
    // cmft says `posx` and so on (`src/cmft/image.cpp`); AMD's CubeMapGen numbers the faces in this order, of
    // Direct3D.
    Family {
        words: [
            &["px", "posx", "xpos", "+x", "x+", "positivex", "positive_x", "c00"],
            &["nx", "negx", "xneg", "-x", "x-", "negativex", "negative_x", "c01"],
            &["py", "posy", "ypos", "+y", "y+", "positivey", "positive_y", "c02"],
            &["ny", "negy", "yneg", "-y", "y-", "negativey", "negative_y", "c03"],
            &["pz", "posz", "zpos", "+z", "z+", "positivez", "positive_z", "c04"],
            &["nz", "negz", "zneg", "-z", "z-", "negativez", "negative_z", "c05"],
        ],
        arrangements: &[INSIDE],
    },
    Family {
        words: [&["right"], &["left"], &["top", "up"], &["bottom", "down"], &["front"], &["back"]],
        arrangements: &[INSIDE, EXCHANGED, QUAKE],
    },
    Family {
        words: [&["righttex"], &["lefttex"], &["uptex"], &["downtex"], &["fronttex"], &["backtex"]],
        arrangements: &[EXCHANGED, INSIDE],
    },
    Family {
        words: [&["rt"], &["lf"], &["up"], &["dn"], &["ft", "fr"], &["bk"]],
        arrangements: &[QUAKE, EXCHANGED, INSIDE],
    },
];

/// The parts of a file's name: the prefix before the word, the extension, and the face.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FaceName {
    pub(crate) prefix: String,
    pub(crate) extension: String,
    /// The position of the family in [`FAMILIES`], and that of the word there.
    family: usize,
    file: usize,
    /// Whether a letter stands before the word: `group.hdr` is not "up", but `desertup.hdr` is if all six are
    /// there.
    is_joined: bool,
}

impl FaceName {
    /// The face that a file name means: a word that stands alone before one after a letter.
    pub(crate) fn parse(name: &str) -> Option<Self> {
        let all = Self::all(name);
        all.iter().find(|found| !found.is_joined).or(all.first()).cloned()
    }

    /// The faces that a file name can mean, the longest word first: `sky_left` is "left" rather than "ft".
    fn all(name: &str) -> Vec<Self> {
        let Some((stem, extension)) = name.rsplit_once('.') else { return Vec::new() };
        let (lower, extension) = (stem.to_ascii_lowercase(), extension.to_ascii_lowercase());
        if Format::of_ending(&extension).is_none() {
            return Vec::new();
        }
        let mut found = Vec::new();
        for (family, Family { words, .. }) in FAMILIES.iter().enumerate() {
            for (file, words) in words.iter().enumerate() {
                let Some(word) =
                    words.iter().filter(|word| lower.ends_with(**word)).max_by_key(|word| word.len())
                else {
                    continue;
                };
                let prefix = stem[..stem.len() - word.len()].to_owned();
                let is_joined = prefix.chars().next_back().is_some_and(char::is_alphabetic);
                let extension = extension.clone();
                found.push((word.len(), Self { prefix, extension, family, file, is_joined }));
            }
        }
        found.sort_by_key(|(length, _)| std::cmp::Reverse(*length));
        found.into_iter().map(|(_, name)| name).collect()
    }
}

/// The files of a set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FaceFiles {
    /// The names, in the order of the family's words.
    pub(crate) names: [String; 6],
    family: usize,
}

impl FaceFiles {
    /// Six pictures of equal size, in the order of the names, as the faces of [`Face::ALL`]; and a note if
    /// their edges show that the words mean something else than usual.
    pub(crate) fn arrange(&self, images: [Image; 6]) -> ([Image; 6], Option<String>) {
        let arrangements = FAMILIES[self.family].arrangements;
        let (first, rest) = (arrangements[0], &arrangements[1..]);
        let usual = mismatch(&images, first);
        // An arrangement must be clearly better than the usual one: smooth skies meet in all of them.
        let better = rest.iter().map(|arrangement| (mismatch(&images, *arrangement), *arrangement));
        let better = better.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(found, _)| *found < 0.5 * usual);
        let (arrangement, note) = match better {
            None => (first, None),
            Some((_, arrangement)) => {
                let at = |face: usize| self.names[arrangement[face]].as_str();
                let note = format!(
                    "the faces were arranged with {} in front (+Z), {} to its right (+X) and {} to its left, \
                     because then their edges match",
                    at(4),
                    at(0),
                    at(1)
                );
                (arrangement, Some(note))
            }
        };
        (arrangement.map(|file| images[file].clone()), note)
    }
}

/// The disagreement of the edges of six pictures, from 0 to 1: the mean of |a - b| / (a + b) over
/// neighbouring texels on both sides of the twelve edges.
fn mismatch(images: &[Image; 6], arrangement: [usize; 6]) -> f64 {
    let edge = images[0].width();
    if edge < 2 {
        return 0.0;
    }
    let cube = Cube { edge };
    let at = |face: Face, row: usize, column: usize| {
        to_cube(cube.direction(face, row, column).vector()) / face_depth(cube, face, row, column)
    };
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for (position, face) in Face::ALL.into_iter().enumerate() {
        for along in 0..edge {
            let last = edge - 1;
            for (row, column, inner) in [
                (0, along, (1, along)),
                (last, along, (last - 1, along)),
                (along, 0, (along, 1)),
                (along, last, (along, last - 1)),
            ] {
                // A step over the edge, on the plane of the face.
                let (here, inside) = (at(face, row, column), at(face, inner.0, inner.1));
                let beyond: DVec3 = 2.0 * here - inside;
                let (other, s, t) = cube.position(Direction::normalised(from_cube(beyond)));
                let texel = |share: f64| ((share * edge as f64) as usize).min(last);
                let a = images[arrangement[position]].pixels()[row * edge + column];
                let b = images[arrangement[other as usize]].pixels()[texel(t) * edge + texel(s)];
                for (a, b) in a.into_iter().zip(b) {
                    let (a, b) = (f64::from(a).max(0.0), f64::from(b).max(0.0));
                    if a + b > 0.0 && (a + b).is_finite() {
                        sum += (a - b).abs() / (a + b);
                    }
                    count += 1.0;
                }
            }
        }
    }
    sum / count.max(1.0)
}

/// The length of a texel's direction along the axis of its face.
fn face_depth(cube: Cube, face: Face, row: usize, column: usize) -> f64 {
    to_cube(cube.direction(face, row, column).vector()).abs().max_element()
}

/// Whether the name of a file says that it is a face of a cube.
pub fn is_face(name: &str) -> bool {
    FaceName::parse(name).is_some_and(|found| !found.is_joined)
}

/// The complete sets of six faces among the names of a folder's files.
pub fn face_sets(names: &[String]) -> Vec<[String; 6]> {
    let mut sets: BTreeMap<_, BTreeMap<usize, &String>> = BTreeMap::new();
    for name in names {
        for FaceName { prefix, extension, family, file, is_joined } in FaceName::all(name) {
            sets.entry((prefix, extension, family, is_joined)).or_default().insert(file, name);
        }
    }
    let set =
        |faces: BTreeMap<usize, &String>| faces.into_values().cloned().collect::<Vec<_>>().try_into().ok();
    sets.into_values().filter_map(set).collect()
}

/// The files of the one set among the names in a folder.
///
/// With `like`, only files of its set count.
///
/// # Errors
/// If a face is missing, or two files are the same face: what was found and what is missing.
pub(crate) fn find(
    names: &[(String, bool)],
    like: Option<&FaceName>,
    place: &str,
) -> Result<FaceFiles, Failure> {
    let mut sets: BTreeMap<_, Vec<(usize, &str)>> = BTreeMap::new();
    for (name, _) in names.iter().filter(|(_, is_folder)| !is_folder) {
        for found in FaceName::all(name) {
            let FaceName { prefix, extension, family, file, is_joined } = found;
            let is_like = |like: &FaceName| {
                (&like.prefix, &like.extension, like.family) == (&prefix, &extension, family)
            };
            if like.is_none_or(is_like) {
                sets.entry((prefix, extension, family, is_joined)).or_default().push((file, name));
            }
        }
    }
    let is_whole = |found: &[(usize, &str)]| (0..6).all(|file| found.iter().any(|(of, _)| *of == file));
    // A word inside another counts if all six are there; and "up" alone is not a set beside one by axes.
    let whole = sets.values().any(|found| is_whole(found));
    sets.retain(|(.., is_joined), found| is_whole(found) || !whole && !*is_joined);
    if sets.len() > 1 && whole {
        let sets = sets
            .iter()
            .map(|((prefix, extension, ..), faces)| format!("{prefix}*.{extension} ({} files)", faces.len()));
        return Err(Failure::new(format!(
            "{place} holds several sets of faces: {}",
            sets.collect::<Vec<_>>().join(", ")
        ))
        .help("name one face of each set as the source (\"folder/*_px.hdr\") with layout = \"cube\""));
    }
    // Of several that lack a face, the fullest is meant.
    let found = sets.into_iter().max_by_key(|(_, found)| found.len());
    let ((.., family, _), found) = found.unwrap_or_default();
    let mut files = [const { String::new() }; 6];
    let mut missing = Vec::new();
    for (file, (slot, words)) in files.iter_mut().zip(FAMILIES[family].words).enumerate() {
        let mut candidates = found.iter().filter(|(of, _)| *of == file).map(|(_, name)| *name);
        match (candidates.next(), candidates.next()) {
            (Some(name), None) => *slot = name.to_owned(),
            (Some(first), Some(second)) => {
                return Err(Failure::new(format!("{place}: {first} and {second} are the same face")));
            }
            (None, _) => missing.push(words.join(" or ")),
        }
    }
    if missing.is_empty() {
        return Ok(FaceFiles { names: files, family });
    }
    let have = match found.as_slice() {
        [] if names.is_empty() => "the folder is empty".to_owned(),
        [] => format!("none of its {} names ends in a word for a face", names.len()),
        found => format!("found {}", found.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", ")),
    };
    Err(Failure::new(format!("{place} does not hold six faces: {have}; missing: {}", missing.join("; ")))
        .help("a face's file name ends in px, nx, py, ny, pz, nz, in posx ... negz, +X ... -Z or c00 ... c05, in right, left, top, bottom, front, back, or in rt, lf, up, dn, ft, bk"))
}

/// The names of the files among those in a folder, each with whether it is a folder, that are the six faces
/// of one cube; `None` if there are none or several sets.
pub fn six_faces(names: &[(String, bool)]) -> Option<[String; 6]> {
    find(names, None, "").ok().map(|files| files.names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_found_among_other_names() {
        let names =
            ["a_nx.exr", "a_px.exr", "a_py.exr", "b_px.exr", "a_ny.exr", "sky.exr", "a_pz.exr", "a_nz.exr"];
        let sets = face_sets(&names.map(str::to_owned));
        assert_eq!(sets, [["a_px.exr", "a_nx.exr", "a_py.exr", "a_ny.exr", "a_pz.exr", "a_nz.exr"]]);
        assert!(is_face("b_px.exr") && !is_face("sky.exr"));
    }

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
            assert_eq!(find(&listing, None, "sky").unwrap().names, [px, nx, py, ny, pz, nz]);
        }
    }

    #[test]
    fn a_missing_face_is_named_with_the_faces_that_were_found() {
        let failure =
            find(&files(&["px.hdr", "nx.hdr", "py.hdr", "pz.hdr", "nz.hdr"]), None, "sky").unwrap_err();
        let message = failure.to_string();
        assert!(message.contains("found px.hdr, nx.hdr, py.hdr, pz.hdr, nz.hdr"), "{message}");
        assert!(message.contains("missing: ny or negy or yneg or -y"), "{message}");
        let message = find(&files(&["a.hdr"]), None, "sky").unwrap_err().to_string();
        assert!(message.contains("none of its 1 names ends in a word for a face"), "{message}");
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
        assert_eq!(find(&listing, Some(&like), "sky").unwrap().names[5], "b_nz.hdr");
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
    fn a_word_inside_a_word_is_a_face_only_among_six() {
        for name in ["group.hdr", "copy.hdr", "desktop.png"] {
            assert!(FaceName::parse(name).unwrap().is_joined, "{name}");
            assert!(find(&files(&[name]), None, "sky").is_err());
        }
        for name in ["px", "px.txt", "sky.hdr"] {
            assert_eq!(FaceName::parse(name), None, "{name}");
        }
        assert_eq!(FaceName::parse("pisa2px.HDR").unwrap().prefix, "pisa2");
    }

    #[test]
    fn names_of_engines_and_tools_are_found() {
        for names in [
            ["+X", "-X", "+Y", "-Y", "+Z", "-Z"].map(|word| format!("Sky_{word}.exr")),
            ["c00", "c01", "c02", "c03", "c04", "c05"].map(|word| format!("uffizi_{word}.tga")),
            ["rt", "lf", "up", "dn", "ft", "bk"].map(|word| format!("sky_day01_01{word}.tga")),
            ["rt", "lf", "up", "dn", "ft", "bk"].map(|word| format!("desert{word}.tga")),
            ["Right", "Left", "Up", "Down", "Front", "Back"].map(|word| format!("Sunny1{word}.pfm")),
            ["Right", "Left", "Up", "Down", "Front", "Back"].map(|word| format!("_{word}Tex.png")),
            ["right", "left", "top", "bottom", "front", "back"].map(|word| format!("my{word}.jpg")),
        ] {
            let listing = files(&names.each_ref().map(String::as_str));
            assert_eq!(find(&listing, None, "sky").unwrap().names, names);
        }
        assert_eq!(six_faces(&files(&["shift.exr", "group.hdr", "a.exr"])), None);
    }

    /// A sky that differs everywhere, on the faces in the order of [`Face::ALL`].
    fn sky(edge: usize) -> [Image; 6] {
        let cube = Cube { edge };
        Face::ALL.map(|face| {
            let texel = |index: usize| {
                let d = cube.direction(face, index / edge, index % edge).vector();
                [2.0 + d.x + 0.3 * d.y, 2.0 + d.y - 0.4 * d.z, 2.0 + d.z].map(|value| value as f32)
            };
            Image::new(edge, edge, (0..edge * edge).map(texel).collect()).unwrap()
        })
    }

    #[test]
    fn edges_decide_what_words_leave_open() {
        let right = sky(8);
        let words = |family: usize| FaceFiles { names: [const { String::new() }; 6], family };
        for (family, arrangements) in FAMILIES.iter().map(|family| family.arrangements).enumerate() {
            for (position, arrangement) in arrangements.iter().enumerate() {
                // The files of somebody who arranges them so.
                let mut given = right.clone();
                for (face, image) in right.iter().enumerate() {
                    given[arrangement[face]] = image.clone();
                }
                let (found, note) = words(family).arrange(given);
                assert!(found == right, "family {family}, arrangement {position}");
                assert_eq!(note.is_some(), position > 0);
            }
            // One colour has no edges: the first counts.
            let flat = [(); 6].map(|()| Image::new(4, 4, vec![[0.5; 3]; 16]).unwrap());
            assert_eq!(words(family).arrange(flat).1, None);
        }
    }
}
