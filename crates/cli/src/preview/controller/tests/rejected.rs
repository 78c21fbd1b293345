//! What the window says while the manifest has errors.

use engine::{Diagnostic, Diagnostics};

use super::*;

fn rejected() -> PreviewMessage {
    let errors = vec![Diagnostic::at(7..9, "there is no kind \"x\"")];
    event(Event::Rejected { diagnostics: Diagnostics::new("pipeline.toml", "schema = 1\n", errors) })
}

/// The failure that the last of these messages leads to.
fn failure(
    controller: &mut PreviewController<'_>,
    updates: &Receiver<PreviewUpdate>,
    message: PreviewMessage,
) -> String {
    controller.handle_all([message]);
    received(updates).pop().unwrap_or_default()
}

/// The picture is the same in both cases; whether it still changes is what an artist has to know.
#[test]
fn a_broken_manifest_is_told_from_a_failed_build_and_the_build_that_goes_on_from_one_that_ended() {
    let project = TestProject::new(PIPELINE);
    project.build_only(&["environment", "material"]);
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned(), show("gold")]);
    assert_eq!(received(&updates).last().map(String::as_str), Some("scene: gold, no maps"));
    let place = "pipeline.toml:1:8: there is no kind \"x\"";
    let building = failure(&mut controller, &updates, rejected());
    assert_eq!(
        building,
        format!(
            "failure: pipeline.toml has errors; the last valid one is still being built, and shown; {place}"
        )
    );
    assert!(controller.status.has_build());
    controller.handle_all([finished("lighting", [("environment", "studio")])]);
    assert_eq!(received(&updates), [""; 0]);
    let shown = failure(&mut controller, &updates, ended());
    assert_eq!(
        shown,
        format!("failure: pipeline.toml has errors; the last valid one is still shown; {place}")
    );
    assert_eq!(failure(&mut controller, &updates, event(Event::Accepted)), "no failure");
    // After that a failure of a stage is one.
    controller.handle_all([planned()]);
    let failed = failure(&mut controller, &updates, failed("environment"));
    assert!(
        failed.starts_with("failure: The build failed; this picture shows earlier results; "),
        "{failed}"
    );
}

#[test]
fn before_anything_is_shown_it_says_whether_something_will_be() {
    let project = TestProject::new(PIPELINE);
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned()]);
    let building = failure(&mut controller, &updates, rejected());
    assert!(
        building.starts_with("failure: pipeline.toml has errors; the last valid one is still being built; "),
        "{building}"
    );
}
