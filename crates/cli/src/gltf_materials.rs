//! Material files for the materials of glTF files: each names its file and its material, so that what a build
//! makes of it follows the asset.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use containers::MaterialChoice;
use engine::Failure;

/// How many material files are written at most; an asset of a game may have hundreds.
const MATERIAL_LIMIT: usize = 32;

/// Material files for glTF files.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct GltfMaterials {
    /// The name of each file and its text.
    pub(crate) files: Vec<(String, String)>,
    /// The glTF files of which materials are left out, each with the reason.
    pub(crate) left_out: Vec<(PathBuf, String)>,
}

impl GltfMaterials {
    /// Material files for every material of these files. `place` gives a glTF file's path as a material file
    /// names it.
    pub(crate) fn of(meshes: &[PathBuf], place: impl Fn(&Path) -> String) -> Self {
        let mut materials = Self::default();
        let mut more = 0;
        for mesh in meshes {
            // A file that cannot be read as a whole is reported as a mesh.
            let names =
                engine::read_file(mesh).ok().and_then(|bytes| containers::gltf_materials(&bytes).ok());
            let names = names.unwrap_or_default();
            for (index, name) in names.iter().enumerate() {
                // Names of their own, which no other material of the file has, last when materials move.
                let is_number = *name == index.to_string();
                let is_unique = names.iter().filter(|other| *other == name).count() == 1;
                let choice = match is_unique && !is_number {
                    true => MaterialChoice::Name(name.clone()),
                    false => MaterialChoice::Index(index),
                };
                if let Err(failure) = check(mesh, &choice) {
                    materials.left_out.push((mesh.clone(), format!("its material {name}: {failure}")));
                } else if materials.files.len() == MATERIAL_LIMIT {
                    more += 1;
                } else {
                    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy();
                    let stem =
                        if meshes.len() > 1 || is_number { format!("{stem}-{name}") } else { name.clone() };
                    let file = materials.unlike(&stem);
                    materials.files.push((file, text(mesh, name, &choice, &place(mesh))));
                }
            }
            if more > 0 {
                let reason = format!("{more} of its materials: at most {MATERIAL_LIMIT} files are written");
                materials.left_out.push((mesh.clone(), reason));
                more = 0;
            }
        }
        materials
    }

    /// A name for a file that no other has, on no file system.
    fn unlike(&self, stem: &str) -> String {
        let plain =
            |letter: char| if letter.is_alphanumeric() || "-_ ".contains(letter) { letter } else { '-' };
        let stem: String = stem.chars().map(plain).collect();
        let names = (1..).map(|number| match number {
            1 => format!("{stem}.toml"),
            _ => format!("{stem}-{number}.toml"),
        });
        let is_new = |name: &String| {
            let name = name.to_lowercase();
            self.files.iter().all(|(known, _)| known.to_lowercase() != name)
        };
        names.into_iter().find(is_new).unwrap_or_default()
    }
}

/// Whether `import-material` can read a material, as its JSON says.
fn check(mesh: &Path, choice: &MaterialChoice) -> Result<(), Failure> {
    let folder = mesh.parent().unwrap_or(Path::new(""));
    let find = &mut |other: &str| {
        let there = fs::metadata(folder.join(other)).map(drop);
        there.map_err(|error| Failure::new(format!("cannot read {other}: {error}")))
    };
    containers::check_gltf_material(&mut File::open(mesh)?, Some(choice), find)
}

fn text(mesh: &Path, name: &str, choice: &MaterialChoice, place: &str) -> String {
    let file = mesh.file_name().unwrap_or_default().to_string_lossy();
    let choice = match choice {
        MaterialChoice::Name(name) => quoted(name),
        MaterialChoice::Index(index) => index.to_string(),
    };
    let plain = |text: &str| text.replace(char::is_control, " ");
    format!(
        "# The material {} of {}: its factors, each times the mean of its texture.\nmodel = \"gltf\"\nfile = {}\nmaterial = {choice}\n",
        plain(name),
        plain(&file),
        quoted(place)
    )
}

/// A text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_material_has_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, materials: &str| {
            let path = folder.path().join(name);
            let text = format!(r#"{{ "asset": {{ "version": "2.0" }}, "materials": [{materials}] }}"#);
            fs::write(&path, text).unwrap();
            path
        };
        let helmet = write(
            "helmet.gltf",
            r#"{ "name": "Lens/1" }, {}, { "name": "lens-1" }, { "name": "Twin" }, { "name": "Twin" },
               { "name": "Lost", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }"#,
        );
        let of = |meshes: &[PathBuf]| GltfMaterials::of(meshes, |mesh| format!("../{}", mesh.display()));
        let found = of(std::slice::from_ref(&helmet));
        let names: Vec<&str> = found.files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["Lens-1.toml", "helmet-1.toml", "lens-1-2.toml", "Twin.toml", "Twin-2.toml"]);
        let lines = |index: usize| found.files[index].1.lines().skip(1).collect::<Vec<_>>();
        assert_eq!(lines(0)[0], "model = \"gltf\"");
        assert_eq!(lines(0)[2], "material = \"Lens/1\"");
        assert_eq!((lines(1)[2], lines(4)[2]), ("material = 1", "material = 4"));
        assert_eq!(found.left_out.len(), 1);
        assert!(found.left_out[0].1.starts_with("its material Lost: "), "{:?}", found.left_out);
        let bare = write("bare.gltf", "");
        assert_eq!(of(&[bare.clone(), helmet]).files[0].0, "helmet-Lens-1.toml");
        let many = write("many.gltf", &["{}"; 40].join(","));
        let found = of(&[bare, many]);
        assert_eq!((found.files.len(), found.left_out.len()), (32, 1));
        assert!(found.left_out[0].1.starts_with("8 of its materials"), "{:?}", found.left_out);
    }
}
