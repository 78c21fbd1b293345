//! A light that the window has turned is written to the manifest.

use super::*;

const TURN: Aim = Aim { yaw: 0.5, pitch: 0.0 };

/// The lines of the latest proposal, and the other updates.
fn proposal(updates: &Receiver<PreviewUpdate>) -> (Vec<String>, Vec<String>) {
    let (proposed, others) = latest_and_others(updates, |update| match update {
        PreviewUpdate::LightEdit { lines, .. } => Some(lines.clone()),
        _ => None,
    });
    (proposed.unwrap_or_default(), others)
}

#[test]
fn the_light_is_written_as_proposed_and_turned_back_with_the_scene_that_has_it() {
    let project = TestProject::built();
    let before = fs::read_to_string(&project.manifest).unwrap();
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned(), show("gold"), ended()]);
    received(&updates);
    controller.handle_all([PreviewMessage::ProposeLight(TURN)]);
    let (lines, others) = proposal(&updates);
    let new = "[stage.lighting-turned] is new: it turns lighting (yaw = 28.65) for reflection";
    assert_eq!(lines, ["Write the turned light to pipeline.toml?", new]);
    assert_eq!(others, [""; 0]);
    assert_eq!(fs::read_to_string(&project.manifest).unwrap(), before, "nothing is written unasked");

    controller.handle_all([PreviewMessage::SaveLight(TURN, lines)]);
    let toast = format!("toast: wrote the light: {}", project.manifest.display());
    assert_eq!(received(&updates), [toast.as_str(), "light saved", "scene: gold, no maps"]);
    let text = fs::read_to_string(&project.manifest).unwrap();
    assert!(text.contains("yaw = 28.65") && text.contains("lighting = \"lighting-turned\""), "{text}");
    project.build();
    controller.handle_all([planned(), ended()]);
    assert_eq!(received(&updates), ["scene: gold"], "it is turned back once");
}

#[test]
fn a_manifest_that_changed_meanwhile_is_read_again_and_written_only_if_the_proposal_holds() {
    let project = TestProject::built();
    let around = project.surroundings();
    let (mut controller, updates) =
        around.with_window([planned(), show("gold"), ended(), PreviewMessage::ProposeLight(TURN)]);
    let (lines, _) = proposal(&updates);
    let text = fs::read_to_string(&project.manifest).unwrap();
    // Somebody renames the stage behind which another is added.
    let theirs = text
        .replace("stage.lighting]", "stage.sky]")
        .replace("lighting = \"lighting\"", "lighting = \"sky\"");
    fs::write(&project.manifest, &theirs).unwrap();
    controller.handle_all([PreviewMessage::SaveLight(TURN, lines.clone())]);
    let refused =
        "toast: the light was not written: pipeline.toml has changed on the disk; write the light again";
    assert_eq!(received(&updates), [refused]);
    assert_eq!(fs::read_to_string(&project.manifest).unwrap(), theirs);
    // Somebody breaks it.
    fs::write(&project.manifest, format!("{text}\nyaw = ")).unwrap();
    controller.handle_all([PreviewMessage::SaveLight(TURN, lines.clone())]);
    let broken = received(&updates).remove(0);
    assert!(broken.starts_with("toast: the light was not written: "), "{broken}");
    assert!(broken.ends_with("hint: fix the manifest first"), "{broken}");
    // Somebody adds a comment, which stays.
    fs::write(&project.manifest, format!("# Ours.\n{text}")).unwrap();
    controller.handle_all([PreviewMessage::SaveLight(TURN, lines)]);
    assert!(received(&updates)[0].starts_with("toast: wrote the light: "));
    let text = fs::read_to_string(&project.manifest).unwrap();
    assert!(text.starts_with("# Ours.\n") && text.contains("yaw = 28.65"), "{text}");
}

#[test]
fn files_without_a_manifest_have_none_to_write_to() {
    let mut project = TestProject::built();
    project.project.files = vec![project.path("paint/gold.toml")];
    let around = project.surroundings();
    let (_controller, updates) =
        around.with_window([planned(), show("gold"), ended(), PreviewMessage::ProposeLight(TURN)]);
    let line = received(&updates).into_iter().find(|line| line.starts_with("toast: ")).unwrap();
    assert!(
        line.contains("there is no manifest to write to, because the files were opened without one; hint: "),
        "{line}"
    );
}
