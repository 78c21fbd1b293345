//! What the designer and the program do to the window, without a window.

use super::*;
use crate::testkit;
use preview::{Framing, Show};

fn catalogue() -> Catalog {
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    Catalog {
        environments: names(&["beach", "studio"]),
        materials: names(&["chrome", "gold", "lacquer"]),
        meshes: names(&["sphere", "torus-knot", "plane"]),
        pairs: (0..6).map(|pair| (pair / 3, pair % 3)).collect(),
    }
}

fn subject(environment: &str, material: &str, mesh: &str) -> Subject {
    Subject { environment: environment.into(), material: material.into(), mesh: mesh.into() }
}

/// A state that has a catalogue and shows its first subject.
fn state() -> State {
    let mut state = State::new(InitialView::default());
    let first = subject("beach", "chrome", "sphere");
    assert_eq!(state.hear(PreviewUpdate::Catalog(catalogue())), Some(Effect::Show(first.clone())));
    assert!(state.waits());
    assert_eq!(state.hear(scene(&first)), None);
    assert!(!state.waits());
    state
}

fn scene(subject: &Subject) -> PreviewUpdate {
    PreviewUpdate::Scene {
        subject: subject.clone(),
        scene: testkit::scene(),
        facts: SubjectDetails::default(),
    }
}

#[test]
fn the_first_subject_is_what_was_wished_then_what_was_kept_then_the_first_of_each_list() {
    let kept = ViewSettings { subject: subject("studio", "gold", "gone"), ..ViewSettings::default() }.write();
    let wish = SubjectRequest { material: Some("lacquer".into()), ..SubjectRequest::default() };
    let mut state = State::new(InitialView { state: Some(kept), request: wish });
    let asked = state.hear(PreviewUpdate::Catalog(catalogue()));
    assert_eq!(asked, Some(Effect::Show(subject("studio", "lacquer", "sphere"))));
    assert_eq!(state.toasts[0].title, "gone is not in this pipeline");
    assert_eq!(state.title(), "Specula preview: studio, lacquer");
}

#[test]
fn a_choice_asks_for_the_subject_and_the_old_picture_stays_until_it_comes() {
    let mut state = state();
    let wanted = subject("beach", "gold", "sphere");
    let asked = state.update(Action::Choose(List::Materials, "gold".into()));
    assert_eq!(asked, Some(Effect::Show(wanted.clone())));
    assert!(state.waits());
    assert_eq!(state.shown.as_ref().unwrap().subject.material, "chrome");
    state.hear(scene(&subject("beach", "lacquer", "sphere")));
    assert_eq!(state.shown.as_ref().unwrap().subject.material, "chrome", "nobody asked for lacquer");
    state.hear(scene(&wanted));
    assert_eq!(state.shown.as_ref().unwrap().subject, wanted);
    assert_eq!(state.update(Action::Choose(List::Materials, "gold".into())), None, "it is there");
}

#[test]
fn steps_go_around_the_ends_of_a_list() {
    let mut state = state();
    let mut seen = Vec::new();
    for by in [1, 1, 1, -1, -1] {
        state.update(Action::Step(List::Materials, by));
        seen.push(state.settings.subject.material.clone());
    }
    assert_eq!(seen, ["gold", "lacquer", "chrome", "lacquer", "gold"]);
    let mut empty = State::default();
    assert_eq!(empty.update(Action::Step(List::Meshes, 1)), None);
}

#[test]
fn the_same_subject_made_anew_is_another_edition_and_the_view_stays() {
    let mut state = state();
    state.update(Action::Orbit(Aim { yaw: 1.0, pitch: 0.1 }));
    state.update(Action::Mode(Mode::Cabral));
    let (settings, edition) = (state.settings.clone(), state.shown.as_ref().unwrap().edition);
    state.hear(scene(&settings.subject));
    assert_eq!(state.settings, settings);
    assert_ne!(state.shown.as_ref().unwrap().edition, edition);
}

#[test]
fn a_catalogue_without_the_subject_leads_to_another_and_one_with_it_to_nothing() {
    let mut state = state();
    assert_eq!(state.hear(PreviewUpdate::Catalog(catalogue())), None);
    let mut less = catalogue();
    less.pairs.retain(|(_, material)| *material > 0);
    let asked = state.hear(PreviewUpdate::Catalog(less));
    assert_eq!(asked, Some(Effect::Show(subject("beach", "gold", "sphere"))));
    assert_eq!(state.toasts[0].title, "no stage reflects beach off chrome");
    assert_eq!(state.hear(PreviewUpdate::Catalog(Catalog::default())), None, "there is nothing to ask for");
    assert_eq!(state.title(), "Specula preview");
}

#[test]
fn what_was_wanted_comes_back_when_it_is_there_again() {
    let mut state = state();
    let wanted = subject("studio", "lacquer", "plane");
    for (list, name) in
        [(List::Environments, "studio"), (List::Materials, "lacquer"), (List::Meshes, "plane")]
    {
        state.update(Action::Choose(list, name.into()));
    }
    let mut less = catalogue();
    less.materials.pop();
    less.pairs.retain(|(_, material)| *material < 2);
    let asked = state.hear(PreviewUpdate::Catalog(less.clone()));
    assert_eq!(asked, Some(Effect::Show(subject("studio", "chrome", "plane"))));
    assert_eq!(state.toasts[0].title, "lacquer is not in this pipeline");
    assert!(state.kept().contains("lacquer"), "the next window begins with it, too");
    less.materials.insert(0, "amber".into());
    less.pairs = (0..6).map(|pair| (pair / 3, pair % 3)).collect();
    assert_eq!(state.hear(PreviewUpdate::Catalog(less.clone())), None, "what stands in for it stays");
    assert_eq!(state.hear(PreviewUpdate::Catalog(Catalog::default())), None);
    assert_eq!(state.hear(PreviewUpdate::Catalog(catalogue())), Some(Effect::Show(wanted)));
    // What is chosen in the meantime is what is wanted.
    state.hear(PreviewUpdate::Catalog(less));
    state.update(Action::Choose(List::Materials, "gold".into()));
    assert_eq!(state.hear(PreviewUpdate::Catalog(catalogue())), None);
    assert_eq!(state.settings.subject, subject("studio", "gold", "plane"));
}

#[test]
fn a_window_begins_with_a_pair_that_there_is_near_to_what_was_wished_and_kept() {
    let kept =
        ViewSettings { subject: subject("beach", "chrome", "plane"), ..ViewSettings::default() }.write();
    let first = |wish: SubjectRequest| {
        let pairs = [(0, 1), (1, 0), (1, 2)].into();
        let catalogue = Catalog { pairs, ..catalogue() };
        let settings = InitialView { state: Some(kept.clone()), request: wish };
        settings.subject(&catalogue)
    };
    let some = |name: &str| Some(name.to_owned());
    assert_eq!(
        first(SubjectRequest::default()),
        subject("beach", "gold", "plane"),
        "the first that is as near"
    );
    let wish = SubjectRequest { material: some("lacquer"), ..SubjectRequest::default() };
    assert_eq!(first(wish), subject("studio", "lacquer", "plane"), "the wish counts more");
    let wish =
        SubjectRequest { environment: some("beach"), material: some("lacquer"), ..SubjectRequest::default() };
    assert_eq!(first(wish).environment, "beach");
    let wish = SubjectRequest { mesh: some("sphere"), ..SubjectRequest::default() };
    assert_eq!(first(wish).mesh, "sphere");
}

#[test]
fn a_failure_stays_over_the_last_picture_until_it_is_taken_away_or_put_aside() {
    let mut state = state();
    let failure = Some(vec!["gold.toml:3: unknown key".to_string()]);
    state.hear(PreviewUpdate::Failure(failure.clone()));
    assert!(state.failure.is_some() && !state.failure_aside && state.shown.is_some());
    state.update(Action::Dismiss);
    assert!(state.failure.is_some() && state.failure_aside);
    state.hear(PreviewUpdate::Failure(failure.clone()));
    assert!(state.failure_aside, "it is the same");
    state.hear(PreviewUpdate::Failure(Some(vec!["another".into()])));
    assert!(!state.failure_aside, "it is another");
    state.update(Action::Dismiss);
    state.update(Action::ShowFailure);
    assert!(!state.failure_aside);
    state.hear(PreviewUpdate::Failure(None));
    assert_eq!(state.failure, None);
}

#[test]
fn a_failure_ends_the_wait_for_a_scene_which_is_missing_all_the_same() {
    let mut state = state();
    state.update(Action::Step(List::Environments, 1));
    assert!(state.waits());
    state.hear(PreviewUpdate::Failure(Some(vec!["no".into()])));
    assert!(!state.waits());
    assert_eq!(state.missing(), ["studio"]);
    state.hear(scene(&subject("studio", "chrome", "sphere")));
    assert!(state.missing().is_empty());
}

#[test]
fn a_subject_made_anew_is_the_same_subject_since_it_was_chosen() {
    let mut state = state();
    let first = state.settings.subject.clone();
    state.hear(scene(&first));
    let of = |state: &State| state.shown.as_ref().map(|shown| (shown.since, shown.edition)).unwrap();
    assert_eq!(of(&state), (1, 2));
    state.update(Action::Step(List::Materials, 1));
    state.hear(scene(&state.settings.subject.clone()));
    assert_eq!(of(&state), (3, 3));
}

#[test]
fn toasts_go_by_themselves_once_they_were_seen_the_longer_ones_later() {
    let mut state = state();
    assert_eq!(state.pass(0.0), None);
    state.hear(PreviewUpdate::Toast { title: "short".into(), lines: Vec::new() });
    state.hear(PreviewUpdate::Toast { title: "long".into(), lines: vec![String::new(); 3] });
    assert_eq!(state.pass(10.0), Some(TOAST));
    assert_eq!(state.pass(10.0 + TOAST), Some(3.0 * TOAST_LINE));
    assert_eq!(state.toasts.len(), 1);
    assert_eq!(state.pass(100.0), None);
    for count in 0..20 {
        state.toast(format!("{count}"), Vec::new());
    }
    assert_eq!(state.toasts.len(), TOASTS);
    assert_eq!(state.toasts[0].title, "16", "the oldest go first");
}

#[test]
fn escape_takes_away_help_then_a_picture_to_keep_then_toasts_then_the_failure() {
    let mut state = state();
    state.update(Action::ToggleHelp);
    state.keeping = true;
    state.toast("rebuilt".into(), Vec::new());
    state.hear(PreviewUpdate::Failure(Some(vec!["no".into()])));
    state.update(Action::Dismiss);
    assert!(!state.help && !state.toasts.is_empty() && !state.failure_aside);
    assert_eq!(state.update(Action::Dismiss), Some(Effect::GiveUp));
    state.keeping = false;
    assert!(!state.toasts.is_empty());
    state.update(Action::Dismiss);
    assert!(state.toasts.is_empty() && !state.failure_aside);
    state.update(Action::Dismiss);
    assert!(state.failure_aside);
}

#[test]
fn a_second_mode_splits_the_picture_and_keys_toggle_between_one_and_two() {
    use preview::Show;
    let mut state = state();
    state.update(Action::Mode(Mode::Cabral));
    assert_eq!(state.settings.show(), Show::One(Mode::Cabral));
    state.update(Action::Second(Mode::Mirror));
    assert_eq!(state.settings.show(), Show::Split { left: Mode::Cabral, right: Mode::Mirror, at: 0.5 });
    state.update(Action::Toggle(Arrangement::Difference));
    state.update(Action::Second(Mode::BruteForce));
    let amplify = state.settings.amplify;
    assert_eq!(state.settings.show(), Show::Difference { of: Mode::Cabral, from: Mode::BruteForce, amplify });
    state.update(Action::AmplifyBy(1));
    assert_eq!(state.settings.amplify, 2.0 * amplify);
    state.update(Action::Swap);
    assert_eq!((state.settings.mode, state.settings.second), (Mode::BruteForce, Mode::Cabral));
    state.update(Action::Toggle(Arrangement::Difference));
    assert_eq!(state.settings.show(), Show::One(Mode::BruteForce));
}

#[test]
fn whatever_is_done_stays_within_bounds() {
    let mut state = state();
    for _ in 0..500 {
        for action in [
            Action::ExposeBy(1.0 / 3.0),
            Action::ZoomBy(1.25),
            Action::MoveDivider(0.05),
            Action::AmplifyBy(1),
            Action::Orbit(Aim { yaw: 0.3, pitch: 0.3 }),
            Action::TurnLight(Aim { yaw: -0.3, pitch: 0.3 }),
        ] {
            state.update(action);
        }
    }
    let settings = &state.settings;
    assert_eq!((settings.exposure, settings.zoom, settings.divider), (12.0, 16.0, 1.0));
    assert_eq!(settings.amplify, 256.0);
    assert!(settings.camera.pitch < std::f64::consts::FRAC_PI_2);
    assert!(settings.light.yaw.abs() <= std::f64::consts::PI);
    assert_eq!(settings.clone().within_bounds(), *settings);
    state.update(Action::ResetCamera);
    state.update(Action::ResetLight);
    assert_eq!(state.settings.camera, ViewSettings::default().camera);
    assert_eq!(state.settings.light, Aim::default());
}

#[test]
fn thirds_of_a_stop_lead_back_to_nought() {
    let mut state = state();
    for by in [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0] {
        state.update(Action::ExposeBy(by / 3.0));
    }
    assert_eq!(state.settings.exposure, 0.0);
}

#[test]
fn panels_go_together_and_come_back_together() {
    let mut state = state();
    state.update(Action::ToggleLists);
    assert!(!state.settings.lists && state.settings.inspector);
    state.update(Action::TogglePanels);
    assert!(!state.settings.lists && !state.settings.inspector);
    state.update(Action::TogglePanels);
    assert!(state.settings.lists && state.settings.inspector);
}

#[test]
fn there_is_no_picture_to_keep_before_there_is_one() {
    assert_eq!(State::default().update(Action::Screenshot), None);
    assert_eq!(state().update(Action::Screenshot), Some(Effect::Screenshot));
}

#[test]
fn a_kept_state_that_cannot_be_read_is_told() {
    let state = State::new(InitialView { state: Some("{}".into()), ..InitialView::default() });
    assert_eq!(state.toasts[0].title, "the window's kept state is left out: it has no version");
}

#[test]
fn a_mode_that_is_wished_for_is_shown_alone() {
    let split =
        ViewSettings { arrangement: Arrangement::Split, mode: Mode::Cabral, ..ViewSettings::default() };
    let kept = Some(split.write());
    let settings = |mode| InitialView {
        state: kept.clone(),
        request: SubjectRequest { mode, ..SubjectRequest::default() },
    };
    let framing = Framing { centre: glam::DVec3::ZERO, radius: 1.0 };
    let show = |mode| settings(mode).shot(framing, [8, 8]).show;
    assert_eq!(show(Some(Mode::Mirror)), Show::One(Mode::Mirror));
    assert!(matches!(show(None), Show::Split { left: Mode::Cabral, .. }));
}
