//! The curator by itself: letters in, news out.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use ::preview::SubjectRequest;
use engine::{BuildOptions, ItemKey, Kinds, Summary};

use super::*;

/// One light and two paints.
const PIPELINE: &str = r#"
schema = 1

[stage.environment]
kind = "import-environment"
source = "STUDIO"
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

/// A project in a folder of its own, and what is asked for of it.
struct Project {
    folder: tempfile::TempDir,
    kinds: Kinds,
    manifest: PathBuf,
    stages: Vec<String>,
}

impl Project {
    fn new(pipeline: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let studio = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/environments/studio.exr");
        let manifest = folder.path().join("pipeline.toml");
        let text = pipeline.replace("\"STUDIO\"", &format!("'{}'", studio.display()));
        fs::write(&manifest, text).unwrap();
        fs::create_dir(folder.path().join("paint")).unwrap();
        fs::write(folder.path().join("paint/gold.toml"), GOLD).unwrap();
        fs::write(folder.path().join("paint/tin.toml"), "model = \"lambert\"\nalbedo = 0.5\n").unwrap();
        Self { folder, kinds: stages::kinds(), manifest, stages: Vec::new() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn build(&self) {
        let plan = Plan::load(&self.manifest, &self.kinds).unwrap_or_else(|faults| panic!("{faults}"));
        let built = engine::build(&plan, &BuildOptions::default(), &Cancel::default(), &|_| {}).unwrap();
        assert_eq!(built.failed, 0);
    }

    fn opening(&self, goes_on_without: bool) -> WindowRequest<'_> {
        let Self { manifest, kinds, stages, .. } = self;
        WindowRequest { manifest, kinds, stages, wish: SubjectRequest::default(), cpu: true, goes_on_without }
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

fn wanted(material: &str) -> PreviewMessage {
    let subject = Subject { environment: "studio".into(), material: material.into(), mesh: "sphere".into() };
    PreviewMessage::Wanted(subject)
}

/// A window that keeps what it is told.
fn window() -> (PreviewMessage, Receiver<PreviewUpdate>) {
    let (sender, news) = channel();
    (PreviewMessage::Opened(Box::new(move |item| _ = sender.send(item))), news)
}

/// The news in a line each.
fn told(news: &Receiver<PreviewUpdate>) -> Vec<String> {
    let told = news.try_iter().map(|news| match news {
        PreviewUpdate::Catalog(catalogue) => format!("catalogue: {}", catalogue.materials.join(", ")),
        PreviewUpdate::Scene { subject, .. } => format!("scene: {}", subject.material),
        PreviewUpdate::Status(line) => format!("status: {line}"),
        PreviewUpdate::Toast { title, lines } => format!("toast: {title}: {}", lines.join("; ")),
        PreviewUpdate::Failure(None) => "no failure".into(),
        PreviewUpdate::Failure(Some(lines)) => format!("failure: {}", lines.join("; ")),
        PreviewUpdate::Close => "close".into(),
    });
    told.filter(|line| !line.starts_with("status: ")).collect()
}

fn no_window() -> PreviewMessage {
    PreviewMessage::NoWindow(Box::default())
}

#[test]
fn without_a_window_it_ends_with_a_still_though_the_build_had_ended_before() {
    let project = Project::new(PIPELINE);
    project.build();
    let (opening, cancel) = (project.opening(false), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    curator.answer([planned(), ended()]);
    curator.answer([watching()]);
    assert!(!cancel.is_cancelled(), "there may be a window yet");
    curator.answer([no_window()]);
    assert!(cancel.is_cancelled());
    assert!(project.path(".specula/preview.png").exists());
}

#[test]
fn a_window_that_is_lost_leaves_a_still_of_what_it_showed() {
    let project = Project::new(PIPELINE);
    project.build();
    let (opening, cancel) = (project.opening(false), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    let (opened, news) = window();
    curator.answer([opened]);
    curator.answer([wanted("gold")]);
    assert_eq!(told(&news), ["catalogue: gold, tin", "scene: gold"]);
    curator.answer([planned(), ended()]);
    drop(news);
    curator.answer([no_window()]);
    assert!(cancel.is_cancelled() && project.path(".specula/preview.png").exists());
}

#[test]
fn without_a_window_it_ends_where_nothing_can_be_built_and_not_while_something_is() {
    let project = Project::new(PIPELINE);
    let hindered = || event(Event::BuildError { error: vec!["the disk is full".into()], help: None });
    let opening = project.opening(false);
    let cancelled = |letters: Vec<PreviewMessage>| {
        let cancel = Cancel::default();
        let mut curator = PreviewController::new(&opening, &cancel);
        letters.into_iter().for_each(|letter| _ = curator.answer([letter]));
        cancel.is_cancelled()
    };
    assert!(cancelled(vec![planned(), hindered(), no_window()]));
    assert!(cancelled(vec![planned(), no_window(), hindered()]));
    assert!(!cancelled(vec![planned(), ended(), planned(), no_window()]));
    let stopped = event(Event::Ended(Summary { cancelled: true, ..Summary::default() }));
    assert!(!cancelled(vec![planned(), stopped, no_window()]));
    let (watching, cancel) = (project.opening(true), Cancel::default());
    let mut curator = PreviewController::new(&watching, &cancel);
    curator.answer([planned(), ended(), no_window()]);
    assert!(!cancel.is_cancelled(), "a watcher goes on");
}

#[test]
fn a_window_that_comes_too_late_is_closed() {
    let project = Project::new(PIPELINE);
    let (opening, cancel) = (project.opening(true), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    curator.answer([PreviewMessage::Close]);
    for _ in 0..2 {
        let (opened, news) = window();
        curator.answer([opened]);
        assert!(told(&news).contains(&"close".into()));
    }
    assert!(curator.answer([PreviewMessage::End]));
}

#[test]
fn where_nothing_can_be_shown_it_says_so_and_what_to_do() {
    let nothing = |project: &Project| {
        let (opening, cancel) = (project.opening(true), Cancel::default());
        let (opened, news) = window();
        PreviewController::new(&opening, &cancel).answer([opened]);
        told(&news).pop().unwrap()
    };
    let reflection = PIPELINE.find("[stage.reflection]").unwrap();
    let line = nothing(&Project::new(&PIPELINE[..reflection]));
    assert!(line.starts_with("failure: This did not work; "), "{line}");
    assert!(
        line.contains("has nothing to preview: no stage of it reflects an environment; hint: "),
        "{line}"
    );
    // What is not watched is not shown.
    let mut project = Project::new(PIPELINE);
    project.stages = vec!["lighting".into(), "coefficients".into()];
    let line = nothing(&project);
    assert!(line.contains(": lighting, coefficients and what that needs reflect no environment; "), "{line}");
    project.stages = vec!["map".into()];
    assert_eq!(nothing(&project), "catalogue: gold, tin", "a stage is watched with all that it needs");
}

#[test]
fn a_kept_picture_is_told_when_it_is_there() {
    let project = Project::new(PIPELINE);
    let (opening, cancel) = (project.opening(true), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    let (opened, news) = window();
    curator.answer([opened]);
    told(&news);
    let subject = Subject { environment: "sky".into(), material: "gold".into(), mesh: "sphere".into() };
    let picture =
        || Picture { size: [1; 2], codes: vec![[0; 3]], radiance: vec![[0.0; 4]], relative_rms: None };
    let keep = || PreviewMessage::Keepsake(subject.clone(), picture());
    curator.answer([keep(), keep()]);
    for (line, number) in told(&news).iter().zip([1, 2]) {
        let file = project.path(&format!(".specula/screenshots/gold-sky-sphere-{number}.png"));
        assert_eq!(*line, format!("toast: kept the picture: {}", file.display()));
        assert!(file.exists());
    }
    fs::remove_dir_all(project.path(".specula")).unwrap();
    fs::write(project.path(".specula"), "").unwrap();
    curator.answer([keep()]);
    assert!(told(&news)[0].starts_with("toast: the picture was not kept: "));
}

#[test]
fn what_is_gone_is_no_failure_and_no_shelf_of_before_stands_in_for_what_cannot_be_read() {
    let project = Project::new(PIPELINE);
    project.build();
    let (opening, cancel) = (project.opening(true), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    let (opened, news) = window();
    curator.answer([opened, watching()]);
    curator.answer([wanted("gold")]);
    assert_eq!(told(&news), ["catalogue: gold, tin", "scene: gold"]);

    fs::remove_file(project.path("paint/gold.toml")).unwrap();
    curator.answer([planned()]);
    assert_eq!(told(&news), ["catalogue: tin"], "the window is to ask for another");
    curator.answer([wanted("tin")]);
    assert_eq!(told(&news), ["scene: tin"]);

    fs::rename(project.path(".specula"), project.path("away")).unwrap();
    fs::write(project.path(".specula"), "").unwrap();
    fs::write(project.path("paint/gold.toml"), GOLD).unwrap();
    curator.answer([planned(), wanted("gold")]);
    let lines = told(&news);
    assert_eq!(lines[0], "catalogue: gold, tin");
    assert!(
        lines[1].starts_with("failure: This cannot be shown; the picture is the one before; "),
        "{lines:?}"
    );
    assert!(
        lines.len() == 2 && lines[1].contains(".specula cannot be used: it is a file, not a folder"),
        "{lines:?}"
    );

    fs::remove_file(project.path(".specula")).unwrap();
    fs::rename(project.path("away"), project.path(".specula")).unwrap();
    curator.answer([ended()]);
    assert_eq!(told(&news), ["scene: gold", "no failure"]);
}

#[test]
fn a_failure_says_whether_it_is_the_pictures() {
    let project = Project::new(PIPELINE);
    project.build();
    let (opening, cancel) = (project.opening(true), Cancel::default());
    let mut curator = PreviewController::new(&opening, &cancel);
    let (opened, news) = window();
    curator.answer([opened, wanted("gold")]);
    told(&news);
    let headline = |letter: PreviewMessage, curator: &mut PreviewController<'_>| {
        curator.answer([letter]);
        told(&news).pop().unwrap().split(';').next().unwrap().to_owned()
    };
    let other = "failure: Something did not work that this picture is not made of";
    assert_eq!(headline(failed("report"), &mut curator), other);
    assert_eq!(headline(failed("environment"), &mut curator), "failure: This did not work");
}
