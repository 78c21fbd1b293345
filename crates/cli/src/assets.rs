//! What files are: light, materials or meshes; and the sources that name them in a manifest.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use engine::path_text;

use containers::{Format, is_texture_ending};
use stages::Preset;

/// Files by what they are, each list sorted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Assets {
    pub(crate) environments: Vec<PathBuf>,
    pub(crate) materials: Vec<PathBuf>,
    pub(crate) meshes: Vec<PathBuf>,
}

/// Environments that one stage can import.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Environments {
    /// The layout that the stage has to name; `None` if the files show it: lat-long images, and those of
    /// OpenEXR that say what they are.
    pub(crate) layout: Option<&'static str>,
    /// Images, folders of six faces, or a face of each cube.
    pub(crate) sources: Vec<PathBuf>,
}

/// Files by what they are, and those that are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Recognised {
    pub(crate) environments: Vec<Environments>,
    pub(crate) materials: Vec<PathBuf>,
    pub(crate) meshes: Vec<PathBuf>,
    /// The files that are left out, each with the reason.
    pub(crate) left_out: Vec<(PathBuf, String)>,
}

impl Recognised {
    pub(crate) fn environment_count(&self) -> usize {
        self.environments.iter().map(|group| group.sources.len()).sum()
    }
}

/// Folders that a search does not enter.
const NOT_SEARCHED: [&str; 3] = ["out", "target", "node_modules"];

/// How many folders deep a search goes.
const DEEPEST: usize = 8;

impl Assets {
    /// Sorts files that somebody named. A folder stands for the files in it and below it.
    ///
    /// # Errors
    /// If one does not exist, or is nothing that can be shown.
    pub(crate) fn named(files: &[PathBuf]) -> Result<Self, String> {
        let mut assets = Self::default();
        for file in files {
            let kind = fs::metadata(file).map_err(|error| {
                let advice = no_preset(file, &error).map(|advice| format!("; {advice}")).unwrap_or_default();
                format!("cannot read {}: {error}{advice}", path_text(file))
            })?;
            if kind.is_dir() {
                let found = Self::found(file);
                if found == Self::default() {
                    return Err(format!("{} contains no HDR image, material or glTF mesh", path_text(file)));
                }
                assets = assets.and(found);
            } else if !assets.add(file, true) {
                return Err(format!(
                    "{} is not an image of an environment, a material or a glTF mesh",
                    path_text(file)
                ));
            }
        }
        Ok(assets)
    }

    /// Adds the files of `others` that these lack.
    pub(crate) fn and(mut self, others: Self) -> Self {
        let Self { environments, materials, meshes } = others;
        let lists = [&mut self.environments, &mut self.materials, &mut self.meshes];
        for (list, others) in lists.into_iter().zip([environments, materials, meshes]) {
            for file in others {
                if !list.contains(&file) {
                    list.push(file);
                }
            }
        }
        self
    }

    /// All files: environments, then materials, then meshes.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        [&self.environments[..], &self.materials, &self.meshes].concat()
    }

    /// The images in a folder, not below it; the folder itself if they are the six faces of a cube.
    ///
    /// # Errors
    /// If they are the faces of several cubes, or faces among other images.
    pub(crate) fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, String> {
        let mut assets = Self::default();
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.path().is_file() {
                assets.add(&entry.path(), true);
            }
        }
        assets.environments.sort();
        match six_faces(folder) {
            Some(faces) if assets.environments.len() == faces.len() => Ok(vec![folder.to_path_buf()]),
            Some(faces) => Err(format!(
                "{} contains other images in addition to the six faces {}; name a folder with only the \
                 faces, or one face with --from cube",
                path_text(folder),
                faces.join(", ")
            )),
            None => Ok(assets.environments),
        }
    }

    /// The files in a folder and below it. Only images of high dynamic range count: others are usually
    /// textures.
    pub(crate) fn found(folder: &Path) -> Self {
        let mut assets = Self::default();
        assets.search(folder, DEEPEST);
        for list in [&mut assets.environments, &mut assets.materials, &mut assets.meshes] {
            list.sort();
        }
        assets
    }

    fn search(&mut self, folder: &Path, deeper: usize) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            if name.starts_with('.') || NOT_SEARCHED.contains(&&*name) {
                continue;
            }
            match entry.file_type() {
                Ok(kind) if kind.is_dir() && deeper > 0 => self.search(&path, deeper - 1),
                Ok(kind) if kind.is_file() => _ = self.add(&path, false),
                _ => {}
            }
        }
    }

    /// Whether a file that somebody named is an image or a texture of an environment.
    pub(crate) fn is_environment(file: &Path) -> bool {
        let mut assets = Self::default();
        assets.add(file, true) && !assets.environments.is_empty()
    }

    /// Adds a file to its list; false if it belongs to none.
    fn add(&mut self, file: &Path, is_named: bool) -> bool {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        // Whoever names a file means it. Others are light if they hold more of it than a screen shows, and
        // textures if they are cubes.
        let is_image = Format::of_ending(&ending)
            .is_some_and(|format| is_named || format.is_high_dynamic_range() || is_bright(file))
            || is_texture_ending(&ending) && (is_named || is_cube(file));
        let list = if is_image {
            &mut self.environments
        } else if stages::is_gltf_file(&name) {
            &mut self.meshes
        } else if stages::is_measured_file(&name)
            || stages::is_materialx_file(&name)
            || is_material(file, &ending)
        {
            &mut self.materials
        } else {
            return false;
        };
        list.push(file.to_path_buf());
        true
    }
}

/// The names of the files in a folder that are the six faces of one cube.
fn six_faces(folder: &Path) -> Option<[String; 6]> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names: Vec<_> = entries
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), !entry.path().is_file()))
        .collect();
    stages::six_faces(&names)
}

/// Whether a texture's header declares a cube.
fn is_cube(file: &Path) -> bool {
    let mut header = Vec::new();
    let read = fs::File::open(file).and_then(|file| file.take(256).read_to_end(&mut header));
    read.is_ok() && containers::declares_cube(&header)
}

/// Whether an image's header declares high dynamic range.
fn is_bright(file: &Path) -> bool {
    fs::File::open(file)
        .is_ok_and(|file| containers::declares_high_dynamic_range(&mut io::BufReader::new(file)))
}

/// The preset that a path names, if no file or folder has this name.
pub(crate) fn preset(path: &Path) -> Option<&'static Preset> {
    let name = path.to_str().filter(|_| !path.exists())?;
    Preset::named(name).ok()
}

/// A file and its bytes; those of a material file if the path names a preset and no file.
///
/// # Errors
/// If there is neither: a message, and advice if the path could be meant as the name of a preset.
pub(crate) fn file_or_preset(path: &Path) -> Result<(PathBuf, Vec<u8>), (String, Option<String>)> {
    if let Some(preset) = preset(path) {
        return Ok((path.with_extension("toml"), preset.text.as_bytes().to_vec()));
    }
    match engine::read_file(path) {
        Ok(bytes) => Ok((path.to_path_buf(), bytes)),
        Err(error) => Err((format!("cannot read {}: {error}", path_text(path)), no_preset(path, &error))),
    }
}

/// Advice for a path that does not exist and could be meant as the name of a preset.
fn no_preset(path: &Path, error: &io::Error) -> Option<String> {
    let is_word = path.extension().is_none() && path.components().count() == 1;
    let name = path.to_str().filter(|_| is_word && error.kind() == io::ErrorKind::NotFound)?;
    Preset::named(name).err().filter(|advice| advice.contains("did you mean"))
}

/// Whether a file is a TOML file that names a model or a preset, as materials do.
fn is_material(file: &Path, ending: &str) -> bool {
    let text = || engine::read_file(file).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    ending == "toml"
        && text().is_some_and(|text| {
            toml::from_str::<toml::Table>(&text).is_ok_and(|table| {
                table.contains_key("model") || table.get("material").is_some_and(toml::Value::is_str)
            })
        })
}

/// Whether a file is a manifest rather than a material.
pub(crate) fn is_manifest(file: &Path) -> bool {
    let ending = file.extension().unwrap_or_default();
    ending.eq_ignore_ascii_case("toml") && !is_material(file, "toml")
}

/// A `source` that names these files and no others, relative to the manifest's folder `base`. All paths are
/// absolute, or all are relative to the same folder.
pub(crate) fn source_of(files: &[PathBuf], base: &Path) -> String {
    let Some(first) = files.first() else { return String::new() };
    let mut common = first.parent().unwrap_or(Path::new(""));
    while !files.iter().all(|file| file.starts_with(common)) {
        common = common.parent().unwrap_or(Path::new(""));
    }
    let folder = slashed(&relative(common, base));
    let folder = if folder.is_empty() { String::new() } else { format!("{folder}/") };
    let below = |file: &PathBuf| slashed(file.strip_prefix(common).unwrap_or(file));
    match files {
        [file] if !below(file).contains(SPECIAL) => folder + &below(file),
        [file] => folder + &literal(&below(file)),
        files => {
            let names = files.iter().map(|file| literal(&below(file))).collect::<Vec<_>>();
            format!("{folder}{{{}}}", names.join(","))
        }
    }
}

/// A `source` that names the files of these kinds wherever they are in their folder, and those that join them
/// later. If other files have the same endings, it names the folders of these files alone, or the files
/// themselves where the others are among them.
pub(crate) fn glob_of(files: &[PathBuf], base: &Path) -> String {
    let Some(first) = files.first() else { return String::new() };
    let mut common = first.parent().unwrap_or(Path::new(""));
    while !files.iter().all(|file| file.starts_with(common)) {
        common = common.parent().unwrap_or(Path::new(""));
    }
    let mut endings: Vec<_> =
        files.iter().filter_map(|file| Some(file.extension()?.to_string_lossy().into_owned())).collect();
    endings.sort();
    endings.dedup();
    let is_deep = files.iter().any(|file| file.parent() != Some(common));
    let endings = if let [one] = &endings[..] { one.clone() } else { format!("{{{}}}", endings.join(",")) };
    let folder = slashed(&relative(common, base));
    let folder = if folder.is_empty() { folder } else { format!("{folder}/") };
    let among = |folder: &Path, deeper: usize| is_other_among(files, folder, deeper);
    if !among(common, if is_deep { DEEPEST } else { 0 }) {
        return format!("{folder}{}*.{endings}", if is_deep { "**/" } else { "" });
    }
    let folders: BTreeSet<&Path> = files.iter().filter_map(|file| file.parent()).collect();
    if folders.iter().any(|folder| among(folder, 0)) {
        return source_of(files, base);
    }
    let below = |folder: &Path| match slashed(folder.strip_prefix(common).unwrap_or(folder)) {
        here if here.is_empty() => format!("*.{endings}"),
        below => format!("{}/*.{endings}", literal(&below)),
    };
    format!("{folder}{{{}}}", folders.into_iter().map(below).collect::<Vec<_>>().join(","))
}

/// Whether a folder, or one below it, has a file that is not one of these but ends like one.
fn is_other_among(files: &[PathBuf], folder: &Path, deeper: usize) -> bool {
    // The folder of files without one is the present one.
    let read = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    fs::read_dir(read).into_iter().flatten().flatten().any(|entry| {
        let path = folder.join(entry.file_name());
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => deeper > 0 && is_other_among(files, &path, deeper - 1),
            Ok(kind) => {
                let ends_alike = files.iter().any(|file| file.extension() == path.extension());
                kind.is_file() && ends_alike && !files.contains(&path)
            }
            Err(_) => false,
        }
    })
}

/// Characters that a glob does not take as they are.
const SPECIAL: [char; 7] = ['*', '?', '[', ']', '{', '}', ','];

/// A name as a glob that matches only it.
fn literal(name: &str) -> String {
    let of = |letter: char| if SPECIAL.contains(&letter) { format!("[{letter}]") } else { letter.into() };
    name.chars().map(of).collect()
}

/// A path relative to a folder if it is below it, or as it is.
fn relative(path: &Path, base: &Path) -> PathBuf {
    path.strip_prefix(base).unwrap_or(path).to_path_buf()
}

/// A path as manifests write it.
pub(crate) fn slashed(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn sources_name_files() {
        let base = Path::new("/project");
        for (files, source) in [
            (&["/project/a/sky.hdr"][..], "a/sky.hdr"),
            (&["/else/sky.hdr"], "/else/sky.hdr"),
            (&["/project/sky[1].hdr"], "sky[[]1[]].hdr"),
            (&["/project/a/sky.hdr", "/project/a/b/sun, low.exr"], "a/{sky.hdr,b/sun[,] low.exr}"),
        ] {
            assert_eq!(source_of(&paths(files), base), source);
        }
        for (files, glob) in [
            (&["a/sky.hdr"][..], "a/*.hdr"),
            (&["a/sky.hdr", "a/b/sun.exr"], "a/**/*.{exr,hdr}"),
            (&["sky.hdr", "sun.hdr"], "*.hdr"),
        ] {
            assert_eq!(glob_of(&paths(files), Path::new("")), glob);
        }
    }

    #[test]
    fn a_glob_leaves_out_what_is_something_else() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, "").unwrap();
            path
        };
        let files = [write("brushed/brass.toml"), write("gold.toml"), write("metals/iron.toml")];
        assert_eq!(glob_of(&files, folder.path()), "**/*.toml");
        write("lights/lamps.toml");
        assert_eq!(glob_of(&files, folder.path()), "{*.toml,brushed/*.toml,metals/*.toml}");
        assert_eq!(glob_of(&files[..1], folder.path()), "brushed/*.toml");
        write("metals/lamps.toml");
        assert_eq!(glob_of(&files, folder.path()), "{brushed/brass.toml,gold.toml,metals/iron.toml}");
    }

    #[test]
    fn files_are_known_by_their_names_and_materials_by_their_model() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, text).unwrap();
            path
        };
        let sky = write("light/Sky.HDR", "");
        let gold = write("gold.toml", "model = \"phong\"\n");
        let pot = write("pot.toml", "material = \"copper\"\n");
        let knot = write("mesh/knot.glb", "");
        let paint = write("paint.binary", "");
        let texture = write("texture.png", "");
        // JPEG with a gain map is light, other JPEG are not.
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../containers/tests/data");
        let sunrise = folder.path().join("light/sunrise.jpg");
        fs::copy(data.join("ultra-hdr.jpg"), &sunrise).unwrap();
        fs::copy(data.join("gradient.jpg"), folder.path().join("light/texture.jpg")).unwrap();
        write("out/map.exr", "");
        write(".specula/map.exr", "");
        let manifest = write("pipeline.toml", "schema = 1\n");
        let found = Assets::found(folder.path());
        assert_eq!(found.environments, [sky, sunrise]);
        assert_eq!((found.materials, found.meshes), (vec![gold.clone(), paint, pot], vec![knot]));
        assert_eq!(Assets::named(std::slice::from_ref(&texture)).unwrap().environments, [texture]);
        assert!(is_manifest(&manifest) && !is_manifest(&gold));
        // What has the ending of no format that is read is nothing.
        assert!(Assets::named(&[write("sky.bmp", "")]).unwrap_err().contains("is not an image"));
        assert!(Assets::named(&[manifest]).unwrap_err().contains("is not an image"));
        assert!(Assets::named(&[folder.path().join("none.hdr")]).unwrap_err().contains("cannot read"));
    }
}
