//! The controller by itself: messages in, updates out.

mod dropped;
mod light;
mod rejected;

use std::fs;
use std::iter;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use ::preview::MaterialForm;
use engine::{BuildOptions, Cancel, ItemKey, Kinds, Summary};

use super::*;

/// One environment and two materials.
const PIPELINE: &str = r#"
schema = 1

[stage.environment]
kind = "import-environment"
source = "studio.exr"
resolution = 8

[stage.material]
kind = "import-material"
source = "paint/*.toml"

[stage.lighting]
kind = "project-sh"
input = "environment"
degree = 2

[stage.coefficients]
kind = "project-brdf"
input = "material"
degree = [2, 0]

[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" }

[stage.map]
kind = "export-shrm"
input = "reflection"
resolution = 4
"#;

const GOLD: &str = "model = \"phong\"\nexponent = 4\nspecular = [1.0, 0.8, 0.3]\n";

struct TestProject {
    folder: tempfile::TempDir,
    kinds: Kinds,
    manifest: PathBuf,
    screenshots: PathBuf,
    project: project::Project,
}

impl TestProject {
    fn new(pipeline: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let studio = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/environments/studio.exr");
        fs::copy(studio, folder.path().join("studio.exr")).unwrap();
        let manifest = folder.path().join("pipeline.toml");
        fs::write(&manifest, pipeline).unwrap();
        fs::create_dir(folder.path().join("paint")).unwrap();
        fs::write(folder.path().join("paint/gold.toml"), GOLD).unwrap();
        fs::write(folder.path().join("paint/tin.toml"), "model = \"lambert\"\nalbedo = 0.5\n").unwrap();
        let screenshots = folder.path().join("screenshots");
        let project = project::Project { manifest: manifest.clone(), ..project::Project::default() };
        Self { folder, kinds: crate::kinds(), manifest, screenshots, project }
    }

    fn built() -> Self {
        let project = Self::new(PIPELINE);
        project.build();
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn build(&self) {
        self.build_only(&[]);
    }

    /// Builds these stages and those that they need; none means all.
    fn build_only(&self, stages: &[&str]) {
        let plan = Plan::load(&self.manifest, &self.kinds).unwrap_or_else(|errors| panic!("{errors}"));
        let stages = stages.iter().map(ToString::to_string).collect();
        let options = BuildOptions { stages, ..BuildOptions::default() };
        let built = engine::build(&plan, &options, &Cancel::default(), &|_| {}).unwrap();
        assert_eq!(built.failed, 0);
    }

    fn surroundings(&self) -> Surroundings<'_> {
        Surroundings::new(&self.project, &self.screenshots, &self.kinds)
    }
}

/// What a controller borrows.
struct Surroundings<'a> {
    request: ViewRequest<'a>,
    watched: WatchedProject,
}

impl<'a> Surroundings<'a> {
    fn new(project: &'a project::Project, screenshots: &'a Path, kinds: &'a Kinds) -> Self {
        let (subject, place) = (SubjectRequest::default(), ViewPlace::Window);
        let request = ViewRequest { project, screenshots, kinds, subject, cpu: true, place };
        Self { watched: WatchedProject::new(project.clone(), &Cancel::default()), request }
    }

    fn controller(&self) -> PreviewController<'_> {
        PreviewController::new(&self.request, &self.watched)
    }

    /// A controller that has a window and then gets these messages, and the updates of the window.
    fn with_window<const N: usize>(
        &self,
        messages: [PreviewMessage; N],
    ) -> (PreviewController<'_>, Receiver<PreviewUpdate>) {
        let (mut controller, (opened, updates)) = (self.controller(), window());
        controller.handle_all(iter::once(opened).chain(messages));
        (controller, updates)
    }
}

fn event(event: Event) -> PreviewMessage {
    PreviewMessage::Event(event, Instant::now())
}

fn planned() -> PreviewMessage {
    event(Event::Planned { dry_run: false, stages: 5, items: 9 })
}

fn ended() -> PreviewMessage {
    event(Event::Ended(Summary::default()))
}

fn watching() -> PreviewMessage {
    event(Event::Watching { folders: 3, poll_milliseconds: None, because: None })
}

fn failed(stage: &str) -> PreviewMessage {
    let key = ItemKey::from_iter([("environment", "studio")]);
    let item = ItemName { stage: stage.into(), key };
    event(Event::Failed { item, error: vec!["it is broken".into()], help: None })
}

fn show(material: &str) -> PreviewMessage {
    let subject = Subject { environment: "studio".into(), material: material.into(), mesh: "sphere".into() };
    PreviewMessage::Show(subject)
}

/// A window, and the updates that it gets.
fn window() -> (PreviewMessage, Receiver<PreviewUpdate>) {
    let (sender, updates) = channel();
    (PreviewMessage::Opened(Box::new(move |update| _ = sender.send(update))), updates)
}

/// The updates, each in a line, without those of the status line.
fn received(updates: &Receiver<PreviewUpdate>) -> Vec<String> {
    let lines = updates.try_iter().map(|update| match update {
        PreviewUpdate::Catalog(catalog) => format!("catalog: {}", catalog.materials.join(", ")),
        PreviewUpdate::Scene { subject, scene, .. } => {
            format!("scene: {}{}", subject.material, if scene.has_maps() { "" } else { ", no maps" })
        }
        PreviewUpdate::Material { .. } => "status: ".into(),
        PreviewUpdate::Choose(SubjectRequest { environment, material, mesh, .. }) => {
            format!("choose: {:?}", [environment, material, mesh].map(Option::unwrap_or_default))
        }
        PreviewUpdate::Status(line) => format!("status: {line}"),
        PreviewUpdate::Toast { title, lines } => format!("toast: {title}: {}", lines.join("; ")),
        PreviewUpdate::MaterialSaved { material, saved } => format!("saved: {material}, {saved}"),
        PreviewUpdate::LightEdit { lines, .. } => format!("light: {}", lines.join("; ")),
        PreviewUpdate::LightSaved(_) => "light saved".into(),
        PreviewUpdate::Failure(None) => "no failure".into(),
        PreviewUpdate::Failure(Some(lines)) => format!("failure: {}", lines.join("; ")),
        PreviewUpdate::Close => "close".into(),
    });
    lines.filter(|line| !line.starts_with("status: ")).collect()
}

fn finished(stage: &str, key: [(&str, &str); 1]) -> PreviewMessage {
    let item = ItemName { stage: stage.into(), key: ItemKey::from_iter(key) };
    event(Event::Finished { item, milliseconds: 1.0, changed: true })
}

#[test]
fn a_subject_is_shown_as_soon_as_its_light_and_its_material_are_imported() {
    let project = TestProject::new(PIPELINE);
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned(), show("gold")]);
    assert_eq!(received(&updates), ["catalog: gold, tin"]);
    project.build_only(&["environment"]);
    controller.handle_all([finished("environment", [("environment", "studio")])]);
    assert_eq!(received(&updates), [""; 0]);
    project.build_only(&["material"]);
    controller.handle_all([finished("material", [("material", "gold")])]);
    assert_eq!(received(&updates), ["scene: gold, no maps"]);
    controller.handle_all([finished("material", [("material", "tin")])]);
    assert_eq!(received(&updates), [""; 0], "that is not a part of it");
    project.build();
    controller.handle_all([planned(), ended()]);
    assert_eq!(received(&updates), ["scene: gold"]);

    // After an edit, the new material is shown before its maps are made.
    fs::write(project.path("paint/gold.toml"), GOLD.replace("0.3", "0.9")).unwrap();
    project.build_only(&["material"]);
    controller.handle_all([planned(), finished("material", [("material", "gold")])]);
    assert_eq!(received(&updates), ["scene: gold, no maps"]);
    project.build();
    controller.handle_all([ended()]);
    assert_eq!(received(&updates), ["scene: gold"]);
}

/// The latest of what `pick` finds in the updates, and the other updates.
fn latest_and_others<T>(
    updates: &Receiver<PreviewUpdate>,
    pick: impl Fn(&PreviewUpdate) -> Option<T>,
) -> (Option<T>, Vec<String>) {
    let (mut latest, (sender, others)) = (None, channel());
    for update in updates.try_iter() {
        match pick(&update) {
            Some(picked) => latest = Some(picked),
            None => sender.send(update).unwrap(),
        }
    }
    (latest, received(&others))
}

/// The latest form of a material, and the other updates.
fn form_and_others(updates: &Receiver<PreviewUpdate>) -> (Option<MaterialForm>, Vec<String>) {
    latest_and_others(updates, |update| match update {
        PreviewUpdate::Material { form, .. } => Some(form.as_ref().unwrap().clone()),
        _ => None,
    })
}

#[test]
fn an_edited_material_is_shown_at_once_and_with_maps_after_it_is_saved() {
    let project = TestProject::built();
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned(), show("gold"), ended()]);
    let (form, others) = form_and_others(&updates);
    assert_eq!(others, ["catalog: gold, tin", "scene: gold"]);
    let mut form = form.unwrap();
    let exponent = ::preview::FormField { section: 0, parameter: 0 };
    let mut edit = |value: f64| {
        form.set(exponent, &brdf::Value::Number(value));
        (PreviewMessage::Edit("gold".into(), MaterialEdit::Show(Some(form.clone()))), form.clone())
    };
    // Of several values only the last is shown.
    controller.handle_all([edit(5.0).0, edit(6.0).0, edit(9.0).0]);
    assert_eq!(received(&updates), ["scene: gold, no maps"]);
    let shown = controller.shown.as_ref().unwrap().1.objects[0].look.material().unwrap().values();
    assert_eq!(shown.number("exponent"), Ok(9.0));
    let file = project.path("paint/gold.toml");
    assert_eq!(fs::read_to_string(&file).unwrap(), GOLD);
    controller.handle_all([planned(), ended()]);
    assert_eq!(received(&updates), [""; 0], "a build does not replace it");
    controller.handle_all([show("tin")]);
    controller.handle_all([show("gold")]);
    assert_eq!(received(&updates), ["scene: tin", "scene: gold, no maps"]);

    controller.handle_all([PreviewMessage::Edit("gold".into(), MaterialEdit::Save(edit(9.0).1))]);
    let (form, others) = form_and_others(&updates);
    assert!(form.is_some(), "the file's values are sent");
    assert_eq!(
        others,
        [format!("toast: saved the material: {}", engine::path_text(&file)), "saved: gold, true".into()]
    );
    assert_eq!(fs::read_to_string(&file).unwrap(), GOLD.replace("= 4", "= 9"));
    project.build_only(&["material"]);
    controller.handle_all([planned(), finished("material", [("material", "gold")])]);
    assert_eq!(received(&updates), ["scene: gold, no maps"], "the same material, now from the results");
    project.build();
    controller.handle_all([ended()]);
    assert_eq!(received(&updates), ["scene: gold"]);

    // An edit after saving is not lost.
    let save = PreviewMessage::Edit("gold".into(), MaterialEdit::Save(edit(10.0).1));
    controller.handle_all([save, edit(11.0).0]);
    assert_eq!(fs::read_to_string(&file).unwrap(), GOLD.replace("= 4", "= 10"));
    let shown = controller.shown.as_ref().unwrap().1.objects[0].look.material().unwrap().values();
    assert_eq!(shown.number("exponent"), Ok(11.0));
}

#[test]
fn a_file_that_changes_under_unsaved_values_is_reported_and_not_overwritten() {
    let project = TestProject::built();
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([planned(), show("gold"), ended()]);
    let mut form = form_and_others(&updates).0.unwrap();
    form.set(::preview::FormField { section: 0, parameter: 0 }, &brdf::Value::Number(9.0));
    controller.handle_all([PreviewMessage::Edit("gold".into(), MaterialEdit::Show(Some(form.clone())))]);
    let theirs = GOLD.replace("= 4", "= 5");
    fs::write(project.path("paint/gold.toml"), &theirs).unwrap();
    controller.handle_all([PreviewMessage::Edit("gold".into(), MaterialEdit::Save(form.clone()))]);
    let (on_disk, others) = form_and_others(&updates);
    assert!(others.contains(&"saved: gold, false".into()), "{others:?}");
    assert!(others.iter().any(|line| line.starts_with("toast: the material was not saved: ")), "{others:?}");
    assert!(on_disk.is_some_and(|on_disk| on_disk != form), "the window can ask the user");
    assert_eq!(fs::read_to_string(project.path("paint/gold.toml")).unwrap(), theirs);
    // The user chose the file.
    controller.handle_all([PreviewMessage::Edit("gold".into(), MaterialEdit::Show(None))]);
    assert_eq!(received(&updates), ["scene: gold"]);
    fs::write(project.path("paint/gold.toml"), GOLD).unwrap();
    controller.handle_all([planned()]);
    assert!(form_and_others(&updates).0.is_some(), "every change of the file is reported");
}

#[test]
fn a_window_that_comes_too_late_is_closed() {
    let project = TestProject::new(PIPELINE);
    let around = project.surroundings();
    let mut controller = around.controller();
    controller.handle_all([PreviewMessage::Close]);
    for _ in 0..2 {
        let (opened, updates) = window();
        controller.handle_all([opened]);
        assert!(received(&updates).contains(&"close".into()));
    }
    assert!(controller.handle_all([PreviewMessage::End]));
}

#[test]
fn if_nothing_can_be_shown_it_says_so_and_what_to_do() {
    let nothing = |project: &TestProject| {
        let around = project.surroundings();
        let (opened, updates) = window();
        around.controller().handle_all([opened]);
        received(&updates).pop().unwrap()
    };
    let reflection = PIPELINE.find("[stage.reflection]").unwrap();
    let line = nothing(&TestProject::new(&PIPELINE[..reflection]));
    assert!(line.starts_with("failure: There is nothing to show; "), "{line}");
    assert!(
        line.contains("has nothing to preview: none of its stages reflects an environment; hint: "),
        "{line}"
    );
    // Only the stages that are watched are shown.
    let mut project = TestProject::new(PIPELINE);
    project.project.stages = vec!["lighting".into(), "coefficients".into()];
    let line = nothing(&project);
    assert!(
        line.contains(
            ": lighting, coefficients and the stages that they need do not reflect an environment; "
        ),
        "{line}"
    );
    project.project.stages = vec!["map".into()];
    assert_eq!(nothing(&project), "catalog: gold, tin", "a stage is watched with the stages that it needs");
}

#[test]
fn a_saved_picture_is_reported_when_it_is_written() {
    let project = TestProject::new(PIPELINE);
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([]);
    received(&updates);
    let subject = Subject { environment: "sky".into(), material: "gold".into(), mesh: "sphere".into() };
    let picture =
        || Picture { size: [1; 2], codes: vec![[0; 3]], radiance: vec![[0.0; 4]], relative_rms: None };
    let save = || PreviewMessage::SavePicture(subject.clone(), picture());
    controller.handle_all([save(), save()]);
    for (line, number) in received(&updates).iter().zip([1, 2]) {
        let file = project.path("screenshots").join(format!("gold-sky-sphere-{number}.png"));
        assert_eq!(*line, format!("toast: saved the picture: {}", file.display()));
        assert!(file.exists());
    }
    fs::remove_dir_all(project.path("screenshots")).unwrap();
    fs::write(project.path("screenshots"), "").unwrap();
    controller.handle_all([save()]);
    assert!(received(&updates)[0].starts_with("toast: the picture was not saved: "));
}

#[test]
fn a_material_that_is_gone_is_not_a_failure_and_old_results_do_not_replace_unreadable_ones() {
    let project = TestProject::built();
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([watching()]);
    controller.handle_all([show("gold")]);
    assert_eq!(received(&updates), ["catalog: gold, tin", "scene: gold"]);

    fs::remove_file(project.path("paint/gold.toml")).unwrap();
    controller.handle_all([planned()]);
    assert_eq!(received(&updates), ["catalog: tin"], "the window asks for another");
    controller.handle_all([show("tin")]);
    assert_eq!(received(&updates), ["scene: tin"]);

    fs::rename(project.path(".specula"), project.path("away")).unwrap();
    fs::write(project.path(".specula"), "").unwrap();
    fs::write(project.path("paint/gold.toml"), GOLD).unwrap();
    controller.handle_all([planned(), show("gold")]);
    let lines = received(&updates);
    assert_eq!(lines[0], "catalog: gold, tin");
    assert!(lines[1].starts_with("failure: This cannot be shown; this is an earlier picture; "), "{lines:?}");
    assert!(
        lines.len() == 2 && lines[1].contains(".specula cannot be used: it is a file, not a folder"),
        "{lines:?}"
    );

    fs::remove_file(project.path(".specula")).unwrap();
    fs::rename(project.path("away"), project.path(".specula")).unwrap();
    controller.handle_all([ended()]);
    assert_eq!(received(&updates), ["scene: gold", "no failure"]);
}

#[test]
fn a_failure_says_whether_the_picture_depends_on_it() {
    let project = TestProject::built();
    let around = project.surroundings();
    let (mut controller, updates) = around.with_window([show("gold")]);
    received(&updates);
    let headline = |message: PreviewMessage, controller: &mut PreviewController<'_>| {
        controller.handle_all([message]);
        received(&updates).pop().unwrap().split(';').next().unwrap().to_owned()
    };
    let other = "failure: A stage failed";
    assert_eq!(headline(failed("report"), &mut controller), other);
    assert_eq!(headline(failed("environment"), &mut controller), "failure: The build failed");
}
