//! Questions over the window, answered with the keyboard and the pointer.

use super::*;

/// A window in which chrome is edited.
fn edited(size: [f32; 2]) -> Session {
    let mut session = Session::with_picture(size);
    let form = Ok(testkit::phong_form(4.0));
    session.state.apply(PreviewUpdate::Material { material: "chrome".into(), form, edited: None });
    session.state.update(Action::SetParameter(testkit::EXPONENT, Value::Number(5.0)));
    session.state.update(Action::EndDrag);
    session.effects.clear();
    session
}

const COMMAND: Modifiers = Modifiers::COMMAND;

/// Asks by the key for closing, and waits until the dialog is drawn.
fn ask(session: &mut Session) -> Drawn {
    session.press(Key::Q, Modifiers { ctrl: true, ..COMMAND });
    session.settle()
}

#[test]
fn enter_saves_and_escape_cancels() {
    for size in [[720.0, 400.0], [1280.0, 800.0], [2560.0, 1440.0]] {
        let mut session = edited(size);
        assert!(ask(&mut session).has("Save the changes of chrome?"));
        session.press(Key::Escape, Modifiers::NONE);
        assert!(!session.settle().has("Save the changes"), "Escape cancels");
        assert!(session.effects.is_empty() && session.state.is_edited("chrome"));
        ask(&mut session);
        session.press(Key::Enter, Modifiers::NONE);
        let save = Effect::SaveAndClose(vec![("chrome".into(), testkit::phong_form(5.0))]);
        assert_eq!(session.effects, [save], "{size:?}");
    }
}

#[test]
fn tab_and_the_pointer_reach_the_other_answers() {
    let mut session = edited([1280.0, 800.0]);
    ask(&mut session);
    session.press(Key::Tab, Modifiers::NONE);
    session.settle();
    session.press(Key::Enter, Modifiers::NONE);
    assert_eq!(session.effects, [Effect::DiscardAndClose(vec!["chrome".into()])]);
    for (answer, effects) in [
        ("Cancel (Esc)", vec![]),
        ("Discard", vec![Effect::DiscardAndClose(vec!["chrome".into()])]),
        ("Save", vec![Effect::SaveAndClose(vec![("chrome".into(), testkit::phong_form(5.0))])]),
    ] {
        let mut session = edited([1280.0, 800.0]);
        ask(&mut session);
        session.click(answer);
        assert_eq!(session.effects, effects, "{answer}");
        assert_eq!(session.state.dialog, None);
    }
}

#[test]
fn nothing_below_a_dialog_reacts_and_nothing_is_repainted() {
    let mut session = edited([1280.0, 800.0]);
    assert_eq!(ask(&mut session).repaint_after, Duration::MAX);
    let settings = session.state.settings.clone();
    session.click("lists");
    session.press(Key::Num7, Modifiers::NONE);
    session.press(Key::Z, Modifiers { ctrl: true, ..COMMAND });
    assert_eq!(session.state.settings, settings);
    assert!(session.state.dialog.is_some() && session.effects.is_empty());
}

#[test]
fn a_dialog_fits_into_a_window_of_any_size() {
    let changes = vec!["[stage.lighting-turned] is new: it turns lighting for reflection".repeat(3); 20];
    let lines = [vec!["Write the turned light to pipeline.toml?".to_owned()], changes].concat();
    for size in [[720.0, 400.0], [1280.0, 800.0], [6000.0, 4000.0]] {
        let mut session = Session::with_picture(size);
        let turn = Aim { yaw: 1.0, pitch: 0.0 };
        session.state.apply(PreviewUpdate::LightEdit { turn, lines: lines.clone() });
        let drawn = session.settle();
        let window = Rect::from_min_size(Pos2::ZERO, size.into());
        for text in [&lines[0], "Write", "Cancel (Esc)"] {
            assert!(window.contains(drawn.place(text)), "{text} in {size:?}");
        }
        session.press(Key::Enter, Modifiers::NONE);
        assert_eq!(session.effects, [Effect::SaveLight(turn, lines.clone())]);
    }
}

#[test]
fn the_inspector_writes_and_resets_a_turned_light() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    session.click("write");
    assert!(session.effects.is_empty(), "there is nothing to write");
    let turn = Aim { yaw: 0.5, pitch: 0.0 };
    session.state.update(Action::TurnLight(turn));
    assert!(session.settle().has("28.6°, 0.0°, not written"));
    session.click("write");
    assert_eq!(session.effects, [Effect::ProposeLight(turn)]);
    session.click("reset");
    assert!(!session.settle().has("not written"));
}
