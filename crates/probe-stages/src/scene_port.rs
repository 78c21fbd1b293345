//! Scenes at ports: which part of one a kind takes, and what its surfaces are known by.

use containers::tensors::{StoredScene, encode_scene};
use engine::{Digest, Failure};
use probes::{Scene, ScenePart};

/// The word for a part in messages and manifests.
pub(crate) fn word(part: ScenePart) -> &'static str {
    match part {
        ScenePart::All => "all",
        ScenePart::Shape => "shape",
        ScenePart::Surfaces => "surfaces",
        ScenePart::Lamps => "lamps",
    }
}

/// A whole scene, with the digest of its surfaces.
pub(crate) fn whole(scene: Scene) -> StoredScene {
    let surfaces = scene.part(ScenePart::Surfaces);
    let surfaces = StoredScene { scene: surfaces, part: ScenePart::Surfaces, surfaces: String::new() };
    let surfaces = Digest::of(&encode_scene(&surfaces, None)).to_string();
    StoredScene { scene, part: ScenePart::All, surfaces }
}

/// An error if a port has a part of a scene that lacks what its kind reads.
pub(crate) fn check(stored: &StoredScene, usable: ScenePart) -> Result<(), Failure> {
    if [ScenePart::All, usable].contains(&stored.part) {
        return Ok(());
    }
    let (found, usable) = (word(stored.part), word(usable));
    let expected = if usable == "all" {
        "the stage of import-scene itself".to_owned()
    } else {
        format!("the stage of import-scene, or scene-part with part = \"{usable}\"")
    };
    Err(Failure::new(format!(
        "port scene has the part \"{found}\" of a scene, which lacks what is read here"
    ))
    .help(format!("connect {expected}")))
}
