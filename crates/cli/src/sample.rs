//! The sample project, which the program carries with it: its manifest and its assets.

pub(crate) const MANIFEST: &str = include_str!("../../../pipeline.toml");

macro_rules! assets {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_bytes!(concat!("../../../", $path)))),*]
    };
}

/// The sample's files, each with its path.
pub(crate) const ASSETS: &[(&str, &[u8])] = assets![
    "assets/environments/sky.exr",
    "assets/environments/studio.exr",
    "assets/materials/chalk.toml",
    "assets/materials/chrome.toml",
    "assets/materials/gold.toml",
    "assets/materials/satin.toml",
    "assets/finishes/copper.toml",
    "assets/finishes/lacquer.toml",
    "assets/finishes/silk.toml",
    "assets/brushed/brass.toml",
    "assets/brushed/hair.toml",
    "assets/brushed/steel.toml",
    "assets/lights/lamps.toml",
    "assets/meshes/knot.glb",
    "assets/white.toml",
];

/// The files in one of the sample's folders.
pub(crate) fn in_folder(folder: &str) -> impl Iterator<Item = (&'static str, &'static [u8])> {
    ASSETS
        .iter()
        .copied()
        .filter(move |(path, _)| path.rsplit_once('/').is_some_and(|(parent, _)| parent == folder))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn every_file_of_the_sample_is_carried() {
        let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
        let mut folders = vec![assets];
        let mut found = 0;
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() { folders.push(path) } else { found += 1 }
            }
        }
        assert_eq!(ASSETS.len(), found);
        assert_eq!(in_folder("assets/finishes").count(), 3);
    }
}
