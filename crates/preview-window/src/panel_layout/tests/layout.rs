//! Where the picture, its captions and the controls over it are, in a window of any size.

use super::*;
use crate::inspector::missing;

#[test]
fn without_panels_the_picture_fills_the_width() {
    let mut session = Session::new([1280.0, 800.0]);
    assert!(session.settle().picture[0] < 1280);
    session.press(Key::H, Modifiers::NONE);
    assert_eq!(session.settle().picture[0], 1280);
}

#[test]
fn nothing_is_repainted_when_nothing_changes() {
    let mut session = Session::new([1280.0, 800.0]);
    assert_eq!(session.settle().repaint_after, Duration::MAX);
    session.state.apply(PreviewUpdate::Failure(Some(vec!["no".into()])));
    session.state.toast("saved".into(), vec!["there".into()]);
    session.state.update(Action::ToggleHelp);
    session.state.update(Action::Arrange(Arrangement::Difference));
    assert_eq!(session.settle().repaint_after, Duration::MAX);
}

#[test]
fn a_window_of_any_size_is_drawn() {
    for size in [[1.0, 1.0], [120.0, 90.0], [480.0, 320.0], [6000.0, 4000.0]] {
        let mut session = Session::with_picture(size);
        for action in [
            Action::Second(Mode::BruteForce),
            Action::Toggle(Arrangement::Difference),
            Action::ToggleHelp,
            Action::TogglePanels,
        ] {
            session.state.update(action);
            session.show();
            session.settle();
        }
        session.render_error = Some(RenderError::Maps("too large".into()));
        session.state.apply(PreviewUpdate::Failure(Some(vec!["a long line ".repeat(50); 40])));
        session.settle();
        session.state.apply(PreviewUpdate::Catalog(Catalog::default()));
        let drawn = session.settle();
        assert!(drawn.picture[0] > 0 && drawn.picture[1] > 0);
    }
}

#[test]
fn controls_above_the_picture_do_not_overlap_and_stay_in_the_window() {
    for size in SIZES {
        for arrangement in [Arrangement::One, Arrangement::Split, Arrangement::Difference] {
            let mut session = Session::with_picture(size);
            session.state.update(Action::Arrange(arrangement));
            // The longest name and the longest number.
            session.state.update(Action::Second(Mode::KautzMcCool));
            session.state.update(Action::Arrange(arrangement));
            session.state.update(Action::Expose(-12.0));
            session.state.update(Action::Amplify(256.0));
            session.show();
            let drawn = session.settle();
            let controls = session.controls();
            assert!(controls.len() >= 5, "{size:?} {arrangement:?}: {controls:?}");
            let middle = controls[0].center().y;
            assert!(
                controls.iter().all(|one| (one.center().y - middle).abs() < 6.0),
                "one row: {controls:?}"
            );
            let inside = Rect::from_min_size(Pos2::ZERO, size.into());
            for (at, one) in controls.iter().enumerate() {
                assert!(inside.contains_rect(*one), "{size:?} {arrangement:?}: {one:?}");
                let overlapped = controls[..at].iter().find(|other| other.shrink(0.5).intersects(*one));
                assert_eq!(overlapped, None, "{size:?} {arrangement:?}: {one:?} overlaps it");
            }
            let picture = session.picture();
            assert!(picture.width() >= 295.0 && picture.height() >= 240.0, "{size:?}: {picture:?}");
            // What has no room is in a menu.
            let drawn = if drawn.has("more") {
                session.click("more");
                session.settle()
            } else {
                assert!(size[0] >= 1280.0 || arrangement == Arrangement::One, "{size:?} {arrangement:?}");
                drawn
            };
            for text in ["screenshot", "lists", "inspector", "-12.00 stops"] {
                assert!(
                    drawn.texts.iter().any(|(drawn, at)| drawn == text && inside.contains_rect(*at)),
                    "{text} in {size:?} {arrangement:?}: {:?}",
                    drawn.texts
                );
            }
        }
    }
}

/// A scene without maps, table or transfer offers the modes that need none.
#[test]
fn modes_that_cannot_be_drawn_are_grey() {
    let mut session = Session::with_picture([1280.0, 800.0]);
    let (subject, details) = (session.state.settings.subject.clone(), SubjectDetails::default());
    session.state.apply(PreviewUpdate::Scene { subject, scene: testkit::without_maps(), details });
    session.state.update(Action::Mode(Mode::Mirror));
    session.show();
    session.settle();
    for grey in ["Cabral", "prefiltered", "BRDF table"] {
        session.click("mirror");
        session.settle();
        session.click(grey);
        assert_eq!(session.state.first_mode(), Mode::Mirror, "{grey}");
        if session.settle().has(grey) {
            session.press(Key::Escape, Modifiers::NONE);
            session.settle();
        }
    }
    session.click("mirror");
    session.settle();
    session.click("irradiance");
    assert_eq!(session.state.first_mode(), Mode::Irradiance);
}

/// A light alone has the cube that is exported, and no material.
#[test]
fn modes_of_a_material_are_grey_for_a_light_alone() {
    let scene = testkit::light_alone();
    let offered = Mode::ALL.into_iter().filter(|mode| missing(&scene, *mode).is_none());
    let expected = [
        Mode::Prefiltered,
        Mode::Irradiance,
        Mode::Mirror,
        Mode::BruteForce,
        Mode::ShadowedBruteForce,
        Mode::Samples,
    ];
    assert!(offered.eq(expected));
    for mode in [Mode::LocalShrm, Mode::Table, Mode::Transfer, Mode::Taps] {
        assert_eq!(missing(&scene, mode), Some("no material in this pipeline"), "{mode:?}");
    }
    let mut session = Session::with_picture([1280.0, 800.0]);
    let (subject, details) = (session.state.settings.subject.clone(), SubjectDetails::default());
    session.state.apply(PreviewUpdate::Scene { subject, scene, details });
    session.show();
    assert!(session.settle().has("from left to right, read at level 0.00, 0.50"));
}

#[test]
fn captions_stay_within_the_picture_and_apart() {
    for size in SIZES {
        for divider in [0.0, 0.05, 0.5, 0.9, 1.0] {
            let mut session = Session::with_picture(size);
            session.state.update(Action::Second(Mode::BruteForce));
            session.state.update(Action::Divider(divider));
            session.show();
            session.shown.as_mut().unwrap().fallback_reason =
                Some("a long message about a limit of the device, ".repeat(4));
            let (drawn, picture) = (session.settle(), session.picture());
            let over: Vec<&(String, Rect)> =
                drawn.texts.iter().filter(|(_, at)| picture.contains(at.center())).collect();
            assert!(over.len() >= 2, "one mode and the reason for the CPU: {over:?}");
            for (at, (text, one)) in over.iter().enumerate() {
                assert!(picture.contains_rect(*one), "{size:?} {divider}: {text} at {one:?} of {picture:?}");
                assert!(over[..at].iter().all(|(_, other)| !other.intersects(*one)), "{text}: {over:?}");
            }
        }
    }
}

#[test]
fn panels_over_the_picture_are_not_cut_off() {
    for size in SIZES {
        let mut session = Session::with_picture(size);
        session.state.apply(PreviewUpdate::Failure(Some(vec!["a long line ".repeat(50); 40])));
        session.state.taking_screenshot = true;
        let (drawn, picture) = (session.settle(), session.picture());
        for text in ["hide", "drawing a screenshot", "Escape cancels it"] {
            let (_, at) = drawn.texts.iter().find(|(drawn, _)| drawn == text).unwrap();
            assert!(picture.contains_rect(*at), "{size:?}: {text} at {at:?} of {picture:?}");
        }
        session.state.update(Action::ToggleHelp);
        let drawn = session.settle();
        let (_, at) = drawn.texts.iter().find(|(drawn, _)| drawn == "Mode").unwrap();
        assert!(picture.contains_rect(*at), "{size:?}: {at:?} of {picture:?}");
    }
}

#[test]
fn what_the_window_waits_for_is_written_over_the_picture() {
    let mut session = Session::new([1280.0, 800.0]);
    assert!(session.settle().has("drawing chrome"));
    session.show();
    let drawn = session.settle();
    assert!(!drawn.has("drawing") && drawn.has("a pencil"));
    session.state.update(Action::Choose(List::Materials, "gold".into()));
    let drawn = session.settle();
    assert!(session.picture().contains(drawn.place("loading gold")));
    session.state.apply(PreviewUpdate::Failure(Some(vec!["gold.toml:3: unknown key".into()])));
    assert!(session.settle().has("waiting for gold"));
    session.state.apply(PreviewUpdate::Failure(None));
    let subject = session.state.settings.subject.clone();
    session.state.apply(PreviewUpdate::Scene {
        subject,
        scene: testkit::scene(),
        details: SubjectDetails::default(),
    });
    assert!(session.settle().has("drawing gold"), "the screen shows chrome");
    session.show();
    let subject = session.state.settings.subject.clone();
    session.state.apply(PreviewUpdate::Scene {
        subject,
        scene: testkit::scene(),
        details: SubjectDetails::default(),
    });
    assert!(!session.settle().has("drawing gold"), "the screen shows gold, as it was before an edit");
}

#[test]
fn edges_of_the_picture_lie_on_pixel_boundaries() {
    let area = Rect::from_min_max(pos2(10.3, 20.0), pos2(110.9, 60.2));
    let (rect, size) = pixels(area, 1.5);
    assert_eq!(size, [150, 60]);
    assert!((rect.min.x * 1.5 - 16.0).abs() < 1e-4 && (rect.max.y * 1.5 - 90.0).abs() < 1e-4);
    assert_eq!(pixels(Rect::NOTHING, 1.0).1, [1, 1]);
}

#[test]
fn every_parameter_of_every_model_fits_into_the_narrowest_inspector() {
    for model in brdf::MODELS {
        let mut values = brdf::Values::default();
        for parameter in model.parameters {
            let value = match parameter.value_type {
                brdf::ValueType::Number(range) => Value::Number(range.most),
                brdf::ValueType::Colour(range) => Value::Colour([range.least, range.most, 0.125]),
                brdf::ValueType::Records(_) => continue,
            };
            values.set(parameter.name, value);
        }
        let parameters = model.parameters.to_vec();
        let section = FormSection { heading: model.name.into(), place: Vec::new(), parameters, values };
        let form = Ok(MaterialForm { sections: vec![section] });
        let mut session = Session::new([716.0, 1400.0]);
        session.state.apply(PreviewUpdate::Material { material: "chrome".into(), form, edited: None });
        session.settle();
        let inside = Rect::from_min_size(Pos2::ZERO, session.size.into());
        let left = session.picture().right();
        let controls = session.context.viewport(|last| {
            let widgets = last.prev_pass.widgets.layers().flat_map(|(_, widgets)| widgets);
            let controls =
                widgets.filter(|widget| widget.sense.senses_drag() && widget.rect.left() > left + 8.0);
            controls.map(|widget| widget.rect).collect::<Vec<_>>()
        });
        assert!(controls.len() >= model.parameters.len() / 2, "{}: {controls:?}", model.name);
        assert!(controls.iter().all(|rect| inside.contains_rect(*rect)), "{}: {controls:?}", model.name);
        assert_eq!(session.effects, [], "drawing {} sets nothing", model.name);
    }
}

#[test]
fn without_maps_the_caption_and_the_status_line_say_why_the_picture_is_by_brute_force() {
    let mut session = Session::with_picture([1280.0, 1400.0]);
    let note = "brute force until the maps are made";
    assert!(!session.settle().has(note));
    let (subject, details) = (session.state.settings.subject.clone(), SubjectDetails::default());
    session.state.apply(PreviewUpdate::Status("building: 2 of 9 items".into()));
    session.state.apply(PreviewUpdate::Scene { subject, scene: testkit::without_maps(), details });
    assert!(!session.settle().texts.iter().any(|(text, _)| text == note), "that picture has maps");
    session.show();
    let drawn = session.settle();
    assert!(session.picture().contains(drawn.place(note)));
    assert!(drawn.has(&format!("{note}  ·  building: 2 of 9 items")), "{:?}", drawn.texts);
    assert!(drawn.has("no maps yet") && !drawn.has("Cabral, cube"), "{:?}", drawn.texts);
    session.state.update(Action::Mode(Mode::Mirror));
    session.show();
    assert!(!session.settle().has(note), "a mirror needs no map");
}
