//! Actions and updates, without a window.

mod saving;

use super::*;
use crate::testkit;
use preview::Show;

fn catalog() -> Catalog {
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

/// A state with a catalog that shows its first subject.
fn state() -> State {
    let mut state = State::new(InitialView::default());
    let first = subject("beach", "chrome", "sphere");
    assert_eq!(state.apply(PreviewUpdate::Catalog(catalog())), Some(Effect::Show(first.clone())));
    assert!(state.waits());
    assert_eq!(state.apply(scene(&first)), None);
    assert!(!state.waits());
    state
}

fn scene(subject: &Subject) -> PreviewUpdate {
    PreviewUpdate::Scene {
        subject: subject.clone(),
        scene: testkit::scene(),
        details: SubjectDetails::default(),
    }
}

#[test]
fn the_first_subject_is_the_requested_then_the_saved_then_the_first_of_each_list() {
    let saved =
        ViewSettings { subject: subject("studio", "gold", "gone"), ..ViewSettings::default() }.to_json();
    let request = SubjectRequest { material: Some("lacquer".into()), ..SubjectRequest::default() };
    let mut state = State::new(InitialView { state: Some(saved), request });
    let effect = state.apply(PreviewUpdate::Catalog(catalog()));
    assert_eq!(effect, Some(Effect::Show(subject("studio", "lacquer", "sphere"))));
    assert_eq!(state.toasts[0].title, "gone is not in this pipeline");
    assert_eq!(state.title(), "Specula preview: studio, lacquer");
}

#[test]
fn a_choice_requests_the_subject_and_the_old_picture_stays_until_it_arrives() {
    let mut state = state();
    let wanted = subject("beach", "gold", "sphere");
    let effect = state.update(Action::Choose(List::Materials, "gold".into()));
    assert_eq!(effect, Some(Effect::Show(wanted.clone())));
    assert!(state.waits());
    assert_eq!(state.shown.as_ref().unwrap().subject.material, "chrome");
    state.apply(scene(&subject("beach", "lacquer", "sphere")));
    assert_eq!(state.shown.as_ref().unwrap().subject.material, "chrome", "lacquer was not requested");
    state.apply(scene(&wanted));
    assert_eq!(state.shown.as_ref().unwrap().subject, wanted);
    assert_eq!(state.update(Action::Choose(List::Materials, "gold".into())), None, "it is chosen already");
}

#[test]
fn steps_wrap_around_the_ends_of_a_list() {
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
fn a_rebuilt_subject_has_a_new_scene_and_keeps_the_view() {
    let mut state = state();
    state.update(Action::Orbit(Aim { yaw: 1.0, pitch: 0.1 }));
    state.update(Action::Mode(Mode::Cabral));
    let (settings, scene_id) = (state.settings.clone(), state.shown.as_ref().unwrap().scene_id);
    state.apply(scene(&settings.subject));
    assert_eq!(state.settings, settings);
    assert_ne!(state.shown.as_ref().unwrap().scene_id, scene_id);
}

#[test]
fn only_a_catalog_without_the_subject_leads_to_another() {
    let mut state = state();
    assert_eq!(state.apply(PreviewUpdate::Catalog(catalog())), None);
    let mut less = catalog();
    less.pairs.retain(|(_, material)| *material > 0);
    let effect = state.apply(PreviewUpdate::Catalog(less));
    assert_eq!(effect, Some(Effect::Show(subject("beach", "gold", "sphere"))));
    assert_eq!(state.toasts[0].title, "no stage reflects beach off chrome");
    assert_eq!(
        state.apply(PreviewUpdate::Catalog(Catalog::default())),
        None,
        "there is no subject to request"
    );
    assert_eq!(state.title(), "Specula preview");
}

#[test]
fn the_wanted_subject_comes_back_when_the_catalog_has_it_again() {
    let mut state = state();
    let wanted = subject("studio", "lacquer", "plane");
    for (list, name) in
        [(List::Environments, "studio"), (List::Materials, "lacquer"), (List::Meshes, "plane")]
    {
        state.update(Action::Choose(list, name.into()));
    }
    let mut less = catalog();
    less.materials.pop();
    less.pairs.retain(|(_, material)| *material < 2);
    let effect = state.apply(PreviewUpdate::Catalog(less.clone()));
    assert_eq!(effect, Some(Effect::Show(subject("studio", "chrome", "plane"))));
    assert_eq!(state.toasts[0].title, "lacquer is not in this pipeline");
    assert!(state.to_json().contains("lacquer"), "the next window starts with it as well");
    less.materials.insert(0, "amber".into());
    less.pairs = (0..6).map(|pair| (pair / 3, pair % 3)).collect();
    assert_eq!(state.apply(PreviewUpdate::Catalog(less.clone())), None, "its replacement stays");
    assert_eq!(state.apply(PreviewUpdate::Catalog(Catalog::default())), None);
    assert_eq!(state.apply(PreviewUpdate::Catalog(catalog())), Some(Effect::Show(wanted)));
    // A choice in the meantime replaces it.
    state.apply(PreviewUpdate::Catalog(less));
    state.update(Action::Choose(List::Materials, "gold".into()));
    assert_eq!(state.apply(PreviewUpdate::Catalog(catalog())), None);
    assert_eq!(state.settings.subject, subject("studio", "gold", "plane"));
}

#[test]
fn a_window_starts_with_the_pair_nearest_to_the_requested_and_the_saved_subject() {
    let saved =
        ViewSettings { subject: subject("beach", "chrome", "plane"), ..ViewSettings::default() }.to_json();
    let first = |request: SubjectRequest| {
        let pairs = [(0, 1), (1, 0), (1, 2)].into();
        let catalog = Catalog { pairs, ..catalog() };
        let settings = InitialView { state: Some(saved.clone()), request };
        settings.subject(&catalog)
    };
    let some = |name: &str| Some(name.to_owned());
    assert_eq!(
        first(SubjectRequest::default()),
        subject("beach", "gold", "plane"),
        "the first of the nearest"
    );
    let request = SubjectRequest { material: some("lacquer"), ..SubjectRequest::default() };
    assert_eq!(first(request), subject("studio", "lacquer", "plane"), "the request counts more");
    let request =
        SubjectRequest { environment: some("beach"), material: some("lacquer"), ..SubjectRequest::default() };
    assert_eq!(first(request).environment, "beach");
    let request = SubjectRequest { mesh: some("sphere"), ..SubjectRequest::default() };
    assert_eq!(first(request).mesh, "sphere");
}

#[test]
fn a_failure_covers_the_last_picture_until_it_is_resolved_or_hidden() {
    let mut state = state();
    let failure = Some(vec!["gold.toml:3: unknown key".to_string()]);
    state.apply(PreviewUpdate::Failure(failure.clone()));
    assert!(state.failure.is_some() && !state.failure_hidden && state.shown.is_some());
    state.update(Action::Dismiss);
    assert!(state.failure.is_some() && state.failure_hidden);
    state.apply(PreviewUpdate::Failure(failure.clone()));
    assert!(state.failure_hidden, "it is the same failure");
    state.apply(PreviewUpdate::Failure(Some(vec!["another".into()])));
    assert!(!state.failure_hidden, "it is a new failure");
    state.update(Action::Dismiss);
    state.update(Action::ShowFailure);
    assert!(!state.failure_hidden);
    state.apply(PreviewUpdate::Failure(None));
    assert_eq!(state.failure, None);
    let with_headline = |line: &str| PreviewUpdate::Failure(Some(vec![line.into(), "it is broken".into()]));
    state.apply(with_headline("still being built"));
    state.update(Action::HideFailure);
    state.apply(with_headline("still shown"));
    assert!(state.failure_hidden, "the details are the same");
}

#[test]
fn a_failure_ends_the_wait_for_a_scene_that_stays_missing() {
    let mut state = state();
    state.update(Action::Step(List::Environments, 1));
    assert!(state.waits());
    state.apply(PreviewUpdate::Failure(Some(vec!["no".into()])));
    assert!(!state.waits());
    assert_eq!(state.missing(), ["studio"]);
    state.apply(scene(&subject("studio", "chrome", "sphere")));
    assert!(state.missing().is_empty());
}

#[test]
fn a_rebuilt_subject_keeps_the_number_of_its_first_scene() {
    let mut state = state();
    let first = state.settings.subject.clone();
    state.apply(scene(&first));
    let of =
        |state: &State| state.shown.as_ref().map(|shown| (shown.first_scene_id, shown.scene_id)).unwrap();
    assert_eq!(of(&state), (1, 2));
    state.update(Action::Step(List::Materials, 1));
    state.apply(scene(&state.settings.subject.clone()));
    assert_eq!(of(&state), (3, 3));
}

#[test]
fn toasts_expire_after_they_were_drawn_longer_ones_later() {
    let mut state = state();
    assert_eq!(state.expire_toasts(0.0), None);
    state.apply(PreviewUpdate::Toast { title: "short".into(), lines: Vec::new() });
    state.apply(PreviewUpdate::Toast { title: "long".into(), lines: vec![String::new(); 3] });
    assert_eq!(state.expire_toasts(10.0), Some(TOAST));
    assert_eq!(state.expire_toasts(10.0 + TOAST), Some(3.0 * TOAST_LINE));
    assert_eq!(state.toasts.len(), 1);
    assert_eq!(state.expire_toasts(100.0), None);
    for count in 0..20 {
        state.toast(count.to_string(), Vec::new());
    }
    assert_eq!(state.toasts.len(), TOASTS);
    assert_eq!(state.toasts[0].title, "16", "the oldest go first");
}

#[test]
fn escape_closes_the_help_then_screenshots_then_toasts_then_the_failure() {
    let mut state = state();
    state.update(Action::ToggleHelp);
    state.taking_screenshot = true;
    state.toast("rebuilt".into(), Vec::new());
    state.apply(PreviewUpdate::Failure(Some(vec!["no".into()])));
    state.update(Action::Dismiss);
    assert!(!state.help && !state.toasts.is_empty() && !state.failure_hidden);
    assert_eq!(state.update(Action::Dismiss), Some(Effect::CancelScreenshots));
    state.taking_screenshot = false;
    assert!(!state.toasts.is_empty());
    state.update(Action::Dismiss);
    assert!(state.toasts.is_empty() && !state.failure_hidden);
    state.update(Action::Dismiss);
    assert!(state.failure_hidden);
}

#[test]
fn a_second_mode_splits_the_picture_and_keys_toggle_it() {
    let (mut state, scene) = (state(), testkit::scene());
    let show = |state: &State| state.settings.show(&scene);
    assert_eq!(show(&state), Show::One(Mode::LocalShrm));
    state.update(Action::Mode(Mode::Cabral));
    assert_eq!(show(&state), Show::One(Mode::Cabral));
    state.update(Action::Second(Mode::Mirror));
    assert_eq!(show(&state), Show::Split { left: Mode::Cabral, right: Mode::Mirror, at: 0.5 });
    state.update(Action::Toggle(Arrangement::Difference));
    state.update(Action::Second(Mode::BruteForce));
    let amplify = state.settings.amplify;
    assert_eq!(show(&state), Show::Difference { of: Mode::Cabral, from: Mode::BruteForce, amplify });
    state.update(Action::AmplifyBy(1));
    assert_eq!(state.settings.amplify, 2.0 * amplify);
    state.update(Action::Swap);
    assert_eq!((state.settings.mode, state.settings.second), (Some(Mode::BruteForce), Mode::Cabral));
    state.update(Action::Toggle(Arrangement::Difference));
    assert_eq!(show(&state), Show::One(Mode::BruteForce));
}

#[test]
fn actions_keep_the_settings_within_bounds() {
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
fn thirds_of_a_stop_return_to_zero() {
    let mut state = state();
    for by in [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0] {
        state.update(Action::ExposeBy(by / 3.0));
    }
    assert_eq!(state.settings.exposure, 0.0);
}

#[test]
fn both_panels_hide_and_show_together() {
    let mut state = state();
    state.update(Action::ToggleLists);
    assert!(!state.settings.lists && state.settings.inspector);
    state.update(Action::TogglePanels);
    assert!(!state.settings.lists && !state.settings.inspector);
    state.update(Action::TogglePanels);
    assert!(state.settings.lists && state.settings.inspector);
}

#[test]
fn there_is_no_screenshot_before_there_is_a_scene() {
    assert_eq!(State::default().update(Action::Screenshot), None);
    assert_eq!(state().update(Action::Screenshot), Some(Effect::Screenshot));
}

#[test]
fn unreadable_settings_are_reported() {
    let state = State::new(InitialView { state: Some("{}".into()), ..InitialView::default() });
    assert_eq!(state.toasts[0].title, "the saved settings of the window are ignored: they have no version");
}

#[test]
fn a_requested_mode_is_shown_alone() {
    let mode = Some(Mode::Cabral);
    let split = ViewSettings { arrangement: Arrangement::Split, mode, ..ViewSettings::default() };
    let saved = Some(split.to_json());
    let settings = |mode| InitialView {
        state: saved.clone(),
        request: SubjectRequest { mode, ..SubjectRequest::default() },
    };
    let scene = testkit::scene();
    let show = |mode| settings(mode).shot(&scene, [8, 8]).show;
    assert_eq!(show(Some(Mode::Mirror)), Show::One(Mode::Mirror));
    assert!(matches!(show(None), Show::Split { left: Mode::Cabral, .. }));
}

/// Until a mode is chosen, it is that of the scene, and it is not saved.
#[test]
fn a_scene_with_taps_is_first_shown_by_them() {
    let mut state = state();
    let first = state.settings.subject.clone();
    let shows = |state: &State| state.settings.show(&state.shown.as_ref().unwrap().scene);
    assert_eq!((state.first_mode(), shows(&state)), (Mode::LocalShrm, Show::One(Mode::LocalShrm)));
    let (scene, details) = (testkit::with_taps(), SubjectDetails::default());
    state.apply(PreviewUpdate::Scene { subject: first.clone(), scene, details });
    assert_eq!((state.first_mode(), shows(&state)), (Mode::Taps, Show::One(Mode::Taps)));
    let saved = InitialView { state: Some(state.to_json()), ..InitialView::default() };
    assert_eq!(saved.settings().0.mode, None);
    state.update(Action::Swap);
    assert_eq!((state.settings.mode, state.settings.second), (Some(Mode::BruteForce), Mode::Taps));
    let saved = InitialView { state: Some(state.to_json()), ..InitialView::default() };
    assert_eq!(saved.settings().0.mode, Some(Mode::BruteForce));
    assert_eq!(InitialView::default().shot(&testkit::with_taps(), [8, 8]).show, Show::One(Mode::Taps));
}

/// White metal shows a light alone, by the cube of an engine. What needs a material is not on its way.
#[test]
fn a_light_alone_is_first_shown_by_the_exported_cube() {
    let mut state = state();
    let subject = state.settings.subject.clone();
    let (scene, details) = (testkit::light_alone(), SubjectDetails::default());
    state.apply(PreviewUpdate::Scene { subject, scene, details });
    assert_eq!((state.first_mode(), state.why_brute_force()), (Mode::Prefiltered, None));
    state.update(Action::Mode(Mode::Cabral));
    assert_eq!(state.why_brute_force(), Some("brute force: there is no material in this pipeline"));
}

fn material(exponent: f64) -> PreviewUpdate {
    let form = Ok(testkit::phong_form(exponent));
    PreviewUpdate::Material { material: "chrome".into(), form, edited: None }
}

fn exponent(exponent: f64) -> Action {
    Action::SetParameter(testkit::EXPONENT, Value::Number(exponent))
}

/// The effect that shows chrome with this exponent.
fn shows(exponent: f64) -> Option<Effect> {
    Some(Effect::EditMaterial("chrome".into(), Some(testkit::phong_form(exponent))))
}

#[test]
fn each_change_of_a_material_is_shown_and_none_is_saved_unasked() {
    let mut state = state();
    assert_eq!(state.update(exponent(5.0)), None, "its file is not known yet");
    state.apply(material(4.0));
    assert_eq!(state.update(exponent(5.0)), shows(5.0));
    assert_eq!(state.update(exponent(6.0)), shows(6.0));
    assert_eq!(state.update(Action::EndDrag), None);
    assert_eq!(state.update(exponent(7.0)), shows(7.0));
    assert_eq!(state.update(Action::Undo), shows(6.0));
    assert_eq!(state.update(Action::Undo), Some(Effect::EditMaterial("chrome".into(), None)));
    assert_eq!(state.update(Action::Undo), None);
    assert_eq!(state.update(Action::SaveMaterial), None, "there is nothing to save");
    assert_eq!(state.update(Action::Redo), shows(6.0));
    let save = Some(Effect::SaveMaterial("chrome".into(), testkit::phong_form(6.0)));
    assert_eq!(state.update(Action::SaveMaterial), save);
    state.apply(material(6.0));
    assert!(!state.is_edited("chrome"));
    assert_eq!(
        state.update(Action::Undo),
        Some(Effect::EditMaterial("chrome".into(), Some(testkit::phong_form(4.0))))
    );
    assert_eq!(state.update(Action::Revert), Some(Effect::EditMaterial("chrome".into(), None)));
}

#[test]
fn edits_stay_with_their_material() {
    let mut state = state();
    state.apply(material(4.0));
    state.update(exponent(5.0));
    state.update(Action::Choose(List::Materials, "gold".into()));
    assert!(state.is_edited("chrome") && !state.is_edited("gold"));
    assert_eq!(state.update(Action::Undo), None, "gold has no editor");
    state.update(Action::Choose(List::Materials, "chrome".into()));
    assert_eq!(state.update(Action::Undo), Some(Effect::EditMaterial("chrome".into(), None)));
}

#[test]
fn if_the_file_changes_under_unsaved_values_the_user_chooses() {
    let mut state = state();
    state.apply(material(4.0));
    state.update(exponent(5.0));
    state.apply(material(8.0));
    assert_eq!(state.update(Action::SaveMaterial), None, "first the choice");
    let mut other = state.clone();
    assert_eq!(other.update(Action::LoadFile), Some(Effect::EditMaterial("chrome".into(), None)));
    assert!(!other.is_edited("chrome"));
    state.update(Action::KeepValues);
    let save = Some(Effect::SaveMaterial("chrome".into(), testkit::phong_form(5.0)));
    assert_eq!(state.update(Action::SaveMaterial), save);

    let broken =
        || PreviewUpdate::Material { material: "chrome".into(), form: Err("no".into()), edited: None };
    state.apply(broken());
    assert!(state.is_edited("chrome"), "nothing is lost");
    state.update(Action::LoadFile);
    assert_eq!(state.editors["chrome"], Err("no".into()));
    state.apply(material(4.0));
    assert!(state.editors["chrome"].is_ok());
    state.apply(broken());
    assert_eq!(state.editors["chrome"], Err("no".into()));
}

#[test]
fn the_reason_for_brute_force_says_whether_the_material_must_be_saved_first() {
    let mut state = state();
    assert_eq!(state.why_brute_force(), None);
    let (subject, details) = (state.settings.subject.clone(), SubjectDetails::default());
    state.apply(PreviewUpdate::Scene { subject, scene: testkit::without_maps(), details });
    assert_eq!(state.why_brute_force(), Some("brute force until the maps are made"));
    state.apply(material(4.0));
    state.update(exponent(5.0));
    let unsaved = "brute force until the material is saved and its maps are made";
    assert_eq!(state.why_brute_force(), Some(unsaved));
    state.update(Action::Mode(Mode::BruteForce));
    assert_eq!(state.why_brute_force(), None);
}

#[test]
fn without_a_table_or_a_transfer_the_reason_for_brute_force_is_another() {
    let mut state = state();
    let no_table = Some("brute force: there is no BRDF table of this material");
    for mode in [Mode::Table, Mode::Transfer] {
        state.update(Action::Mode(mode));
        assert_eq!(state.why_brute_force(), no_table);
    }
    state.update(Action::Mode(Mode::Taps));
    assert_eq!(state.why_brute_force(), Some("brute force: the scale space or the taps are not made"));
    state.update(Action::Mode(Mode::Transfer));
    let subject = state.settings.subject.clone();
    let details = SubjectDetails::default();
    state.apply(PreviewUpdate::Scene { subject, scene: testkit::lamps(), details });
    assert_eq!(state.why_brute_force(), Some("brute force: there is no transfer of this mesh"));
    state.update(Action::Mode(Mode::Table));
    assert_eq!(state.why_brute_force(), None);
    state.update(Action::Mode(Mode::Cabral));
    let no_maps = "brute force: there are no maps of this material under this light";
    assert_eq!(state.why_brute_force(), Some(no_maps));
}

/// The disks stay where they were moved when the scene is built again, until the light is reset or another.
#[test]
fn a_disk_of_the_light_is_moved_in_the_window_alone() {
    let mut state = state();
    let update = |subject: Subject| PreviewUpdate::Scene {
        subject,
        scene: testkit::lamps(),
        details: SubjectDetails::default(),
    };
    let here = state.settings.subject.clone();
    state.apply(update(here.clone()));
    let directions = |state: &State| {
        let shown = state.shown.as_ref().unwrap();
        (shown.scene.light.disks().iter().map(|disk| disk.direction).collect::<Vec<_>>(), shown.scene_id)
    };
    let (built, first) = directions(&state);
    let json = state.to_json();
    assert_eq!(state.update(Action::MoveDisk(1, Direction::Y)), None);
    let (moved, second) = directions(&state);
    assert_eq!((moved.clone(), second > first), (vec![built[0], Direction::Y], true));
    assert_eq!(state.to_json(), json, "nothing is saved");
    state.update(Action::MoveDisk(7, Direction::Y));
    assert_eq!(directions(&state), (moved.clone(), second), "there are two");
    state.apply(update(here.clone()));
    assert_eq!(directions(&state).0, moved, "it is built again");
    state.update(Action::ResetLight);
    assert_eq!(directions(&state).0, built);
    state.update(Action::MoveDisk(0, Direction::Y));
    state.update(Action::Choose(List::Environments, "studio".into()));
    state.apply(update(Subject { environment: "studio".into(), ..here }));
    assert_eq!(directions(&state).0, built, "another light");
}

#[test]
fn parts_that_the_program_chooses_are_shown_with_the_next_catalog_and_the_others_stay() {
    let mut state = state();
    let choice = SubjectRequest { material: Some("clay".into()), ..SubjectRequest::default() };
    assert_eq!(state.apply(PreviewUpdate::Choose(choice)), None, "no catalog has it yet");
    assert_eq!(state.settings.subject, subject("beach", "chrome", "sphere"));
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    let dropped = Catalog {
        environments: names(&["beach"]),
        materials: names(&["chrome", "clay"]),
        meshes: names(&["sphere"]),
        pairs: [(0, 0), (0, 1)].into(),
    };
    let effect = state.apply(PreviewUpdate::Catalog(dropped));
    assert_eq!(effect, Some(Effect::Show(subject("beach", "clay", "sphere"))));
    assert!(state.toasts.is_empty() && state.shown.is_some(), "the picture stays meanwhile");
}
