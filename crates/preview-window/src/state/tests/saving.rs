//! What is asked before the window closes or the light is written.

use super::*;

/// Two materials are edited: chrome to 5, gold to 6.
fn edited_state() -> State {
    let mut state = state();
    state.apply(material(4.0));
    state.update(exponent(5.0));
    state.update(Action::Choose(List::Materials, "gold".into()));
    let form = Ok(testkit::phong_form(4.0));
    state.apply(PreviewUpdate::Material { material: "gold".into(), form, edited: None });
    state.update(exponent(6.0));
    state
}

fn saved(material: &str, saved: bool) -> PreviewUpdate {
    PreviewUpdate::MaterialSaved { material: material.into(), saved }
}

#[test]
fn closing_with_unsaved_values_asks_and_without_them_does_not() {
    assert_eq!(state().update(Action::Close), Some(Effect::Close));
    let mut state = edited_state();
    assert_eq!(state.update(Action::Close), None);
    let unsaved = Dialog::Unsaved(vec!["chrome".into(), "gold".into()]);
    assert_eq!(state.dialog, Some(unsaved.clone()));
    // Everything else waits for the answer.
    let settings = state.settings.clone();
    for action in
        [Action::Close, Action::Undo, Action::Mode(Mode::Mirror), Action::Drop(vec!["a.exr".into()])]
    {
        assert_eq!(state.update(action), None);
    }
    assert_eq!((&state.settings, &state.dialog), (&settings, &Some(unsaved)));
    assert_eq!(state.update(Action::Dismiss), None);
    assert!(state.dialog.is_none() && state.is_edited("gold"), "Escape cancels");
    state.update(Action::Close);
    assert_eq!(state.update(Action::Answer(Answer::Cancel)), None);
    assert!(state.dialog.is_none());
    // Ctrl-C does not ask.
    assert_eq!(state.apply(PreviewUpdate::Close), Some(Effect::Close));
    state.update(Action::Close);
    assert_eq!(state.apply(PreviewUpdate::Close), Some(Effect::Close), "not even while the window asks");
    let both = vec!["chrome".to_owned(), "gold".to_owned()];
    assert_eq!(state.update(Action::Answer(Answer::Discard)), Some(Effect::DiscardAndClose(both)));
}

#[test]
fn the_window_closes_after_the_last_material_is_saved() {
    let mut state = edited_state();
    state.update(Action::Close);
    let forms =
        vec![("chrome".to_owned(), testkit::phong_form(5.0)), ("gold".into(), testkit::phong_form(6.0))];
    assert_eq!(state.update(Action::Answer(Answer::Save)), Some(Effect::SaveAndClose(forms)));
    assert_eq!(state.apply(saved("chrome", true)), None);
    assert!(!state.is_edited("chrome") && state.is_edited("gold"));
    assert_eq!(state.apply(saved("gold", true)), Some(Effect::Close));
    // A material that is saved on another occasion closes nothing.
    let mut state = edited_state();
    state.update(Action::SaveMaterial);
    assert_eq!(state.apply(saved("gold", true)), None);
    assert!(!state.is_edited("gold"));
}

#[test]
fn a_material_that_cannot_be_saved_keeps_the_window_open_and_is_shown() {
    let mut state = edited_state();
    state.update(Action::Close);
    state.update(Action::Answer(Answer::Save));
    let chrome = Some(Effect::Show(subject("beach", "chrome", "sphere")));
    assert_eq!(state.apply(saved("chrome", false)), chrome);
    assert_eq!(state.apply(saved("gold", true)), None, "it no longer waits");
    assert_eq!(state.unsaved(), ["chrome"]);
    // A file that has changed is found out before anything is written.
    let mut state = edited_state();
    state.apply(material(8.0));
    state.update(Action::Close);
    assert_eq!(
        state.update(Action::Answer(Answer::Save)),
        Some(Effect::Show(subject("beach", "chrome", "sphere")))
    );
    assert_eq!(state.toasts[0].title, "chrome was not saved");
    assert_eq!(state.unsaved(), ["chrome", "gold"]);
}

#[test]
fn a_turned_light_is_written_after_a_question_and_turned_back_with_the_scene_that_has_it() {
    let mut state = state();
    assert_eq!(state.update(Action::SaveLight), None);
    assert_eq!(state.toasts[0].title, "the light is not turned");
    let turn = Aim { yaw: 0.5, pitch: 0.25 };
    state.update(Action::TurnLight(turn));
    assert_eq!(state.update(Action::SaveLight), Some(Effect::ProposeLight(turn)));
    let lines = vec!["Write?".to_owned(), "yaw".into()];
    let proposal = || PreviewUpdate::LightEdit { turn, lines: lines.clone() };
    state.apply(proposal());
    assert_eq!(state.update(Action::Dismiss), None);
    state.apply(proposal());
    assert_eq!(state.update(Action::Answer(Answer::Save)), Some(Effect::SaveLight(turn, lines.clone())));
    state.apply(PreviewUpdate::LightSaved(turn));
    assert_eq!(state.settings.light, turn, "the scene is still the one before");
    state.update(Action::TurnLight(Aim { yaw: 1.0, pitch: 0.0 }));
    state.apply(scene(&state.settings.subject.clone()));
    assert_eq!(state.settings.light, Aim { yaw: 1.0, pitch: 0.0 }, "what was turned since then stays");
    state.apply(scene(&state.settings.subject.clone()));
    assert_eq!(state.settings.light, Aim { yaw: 1.0, pitch: 0.0 }, "once");
}
