//! Drops on the window of a manifest and on that of files: what is shown, watched and said.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Receiver;

use engine::{BuildOptions, Cancel, Kinds};
use parking_lot::Mutex;

use super::super::*;
use super::{Surroundings, window};

const PIPELINE: &str = r#"
schema = 1

[stage.light]
kind = "import-environment"
source = "light/*.exr"
resolution = 8

[stage.paint]
kind = "import-material"
source = "paint/*.toml"

[stage.lighting]
kind = "project-sh"
input = "light"
degree = 2

[stage.coefficients]
kind = "project-brdf"
input = "paint"
degree = [2, 0]

[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" }
"#;

const MATTE: &str = "model = \"lambert\"\nalbedo = 0.5\n";

/// A folder with a pipeline of one environment and two materials, and files to drop.
struct Folder {
    folder: tempfile::TempDir,
    kinds: Kinds,
    project: Project,
    screenshots: PathBuf,
}

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let studio = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/environments/studio.exr");
        for name in ["light/studio.exr", "drop/dawn.exr", "drop/studio.exr"] {
            fs::create_dir_all(path(name).parent().unwrap()).unwrap();
            fs::copy(&studio, path(name)).unwrap();
        }
        fs::create_dir(path("paint")).unwrap();
        for name in ["paint/gold.toml", "paint/tin.toml", "drop/clay.toml"] {
            fs::write(path(name), MATTE).unwrap();
        }
        fs::write(path("pipeline.toml"), PIPELINE).unwrap();
        let project = Project { manifest: path("pipeline.toml"), ..Project::default() };
        Self { screenshots: path("screenshots"), kinds: crate::kinds(), project, folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn surroundings(&self) -> Surroundings<'_> {
        Surroundings::new(&self.project, &self.screenshots, &self.kinds)
    }
}

/// A controller with a window, and its watcher.
struct Session<'a> {
    controller: PreviewController<'a>,
    watched: &'a WatchedProject,
    updates: Receiver<PreviewUpdate>,
    kinds: &'a Kinds,
}

impl<'a> Session<'a> {
    /// A window on what was built, with gold chosen.
    fn new(folder: &'a Folder, around: &'a Surroundings<'a>) -> Self {
        let mut controller = around.controller();
        controller.cache = folder.path("cache");
        let (opened, updates) = window();
        let mut session = Self { controller, watched: &around.watched, updates, kinds: &folder.kinds };
        session.builds();
        session.send(opened);
        session.send(show("studio", "gold"));
        session.received();
        session
    }

    fn send(&mut self, message: PreviewMessage) {
        self.controller.handle_all([message]);
    }

    /// The next watcher builds its project; returns the manifest, if there is one.
    fn builds(&mut self) -> Option<PathBuf> {
        let (project, _) = self.watched.next()?;
        let plan = Plan::load(&project.manifest, self.kinds).unwrap_or_else(|errors| panic!("{errors}"));
        let events = Mutex::new(Vec::new());
        let built = engine::build(&plan, &BuildOptions::default(), &Cancel::default(), &|event: Event| {
            events.lock().push(event);
        });
        assert!(built.is_ok());
        self.send(PreviewMessage::Watched(project.manifest.clone()));
        for event in events.into_inner() {
            self.send(PreviewMessage::Event(event, Instant::now()));
        }
        Some(project.manifest)
    }

    fn drop(&mut self, files: &[PathBuf]) -> Vec<String> {
        self.send(PreviewMessage::Dropped(files.to_vec()));
        self.received()
    }

    /// The updates since the last call, each in a line, without those of the status line.
    fn received(&self) -> Vec<String> {
        let lines = self.updates.try_iter().filter_map(|update| match update {
            PreviewUpdate::Choose(SubjectRequest { environment, material, mesh, .. }) => {
                let name = |name: Option<String>| name.unwrap_or_else(|| "-".into());
                Some(format!("choose {}, {}, {}", name(environment), name(material), name(mesh)))
            }
            PreviewUpdate::Catalog(catalog) => {
                let lists = [catalog.environments, catalog.materials].map(|names| names.join(" "));
                Some(format!("catalog {}", lists.join(", ")))
            }
            PreviewUpdate::Scene { subject, .. } => Some(format!("scene {}", subject::describe(&subject))),
            PreviewUpdate::Toast { title, lines } => Some(format!("toast {title}; {}", lines.join("; "))),
            PreviewUpdate::Failure(lines) => {
                Some(format!("failure {}", lines.unwrap_or_default().join("; ")))
            }
            PreviewUpdate::Status(_) | PreviewUpdate::Material { .. } | PreviewUpdate::Close => None,
            PreviewUpdate::MaterialSaved { .. }
            | PreviewUpdate::LightEdit { .. }
            | PreviewUpdate::LightSaved(_) => None,
        });
        lines.collect()
    }
}

fn show(environment: &str, material: &str) -> PreviewMessage {
    let [environment, material] = [environment, material].map(str::to_owned);
    PreviewMessage::Show(Subject { environment, material, mesh: "plane".into() })
}

#[test]
fn a_dropped_material_is_shown_under_the_same_light_and_backspace_returns() {
    let folder = Folder::new();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    let manifest = fs::read(&folder.project.manifest).unwrap();
    assert_eq!(
        session.drop(&[folder.path("drop/clay.toml")]),
        [
            "choose -, clay, -",
            "catalog studio, clay gold",
            "toast showing clay.toml; to keep clay.toml, add it to the source of [stage.paint]; \
             Backspace returns to pipeline.toml",
        ]
    );
    let made = session.builds().unwrap();
    assert!(made.starts_with(folder.path("cache")), "{}", made.display());
    assert_eq!(session.received(), ["scene clay under studio on plane"]);
    let text = fs::read_to_string(&made).unwrap();
    assert!(text.contains("resolution = 8"), "the light is imported as in the manifest:\n{text}");
    // Nothing was written beside the manifest.
    assert!(
        fs::read(&folder.project.manifest).unwrap() == manifest && !folder.path("drop/.specula").exists()
    );

    session.send(PreviewMessage::ReturnFromDropped);
    let back = ["choose studio, gold, plane", "catalog studio, gold tin"];
    assert_eq!(session.received()[..2], back);
    assert_eq!(session.builds().unwrap(), folder.project.manifest);
    session.send(PreviewMessage::ReturnFromDropped);
    assert!(session.received().contains(&"toast no files were dropped; ".into()));
}

#[test]
fn a_dropped_environment_replaces_one_of_its_name_and_another_drop_adds_to_the_first() {
    let folder = Folder::new();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    session.drop(&[folder.path("drop/studio.exr")]);
    let made = session.builds().unwrap();
    assert!(fs::read_to_string(&made).unwrap().contains("drop/studio.exr"));
    assert!(!fs::read_to_string(&made).unwrap().contains("resolution"), "that was of the other file");
    assert_eq!(session.received(), ["scene gold under studio on plane"]);
    let lines = session.drop(&[folder.path("drop/dawn.exr"), folder.path("drop/clay.toml")]);
    assert_eq!(lines[..2], ["choose dawn, clay, -", "catalog dawn studio, clay gold"]);
    assert!(lines[2].ends_with("Backspace returns to studio.exr, gold.toml"), "{lines:?}");
    session.builds().unwrap();
    assert_eq!(session.received(), ["scene clay under dawn on plane"]);
}

#[test]
fn a_dropped_folder_is_its_files_and_a_dropped_manifest_is_opened() {
    let folder = Folder::new();
    fs::remove_file(folder.path("drop/studio.exr")).unwrap();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    let lines = session.drop(&[folder.path("drop")]);
    assert_eq!(lines[..2], ["choose dawn, clay, -", "catalog dawn studio, clay gold"]);
    let lines = session.drop(std::slice::from_ref(&folder.project.manifest));
    assert_eq!(lines[..2], ["choose -, -, -", "catalog studio, gold tin"]);
    assert!(lines[3].starts_with("toast opened pipeline.toml; "), "{lines:?}");
}

#[test]
fn files_that_cannot_be_shown_are_an_error_in_the_window_and_nothing_changes() {
    let folder = Folder::new();
    fs::write(folder.path("notes.txt"), "").unwrap();
    fs::write(folder.path("broken.toml"), "schema = ").unwrap();
    fs::create_dir(folder.path("empty")).unwrap();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    for (name, words) in [
        ("notes.txt", "notes.txt is not an image of an environment, a material or a glTF mesh; hint: name"),
        ("none.hdr", "cannot read"),
        ("broken.toml", "broken.toml:1:"),
        ("empty", "empty contains no HDR image, material or glTF mesh"),
    ] {
        let lines = session.drop(&[folder.path(name)]);
        assert_eq!(lines.len(), 1, "{lines:?}");
        let starts = lines[0].starts_with("failure The dropped files cannot be shown; ");
        assert!(starts && lines[0].contains(words), "{lines:?}");
        assert_eq!(session.builds(), None, "the watcher goes on");
    }
    session.send(show("studio", "tin"));
    assert_eq!(session.received(), ["scene tin under studio on plane", "failure "]);
}

#[test]
fn a_file_that_is_damaged_is_reported_and_the_picture_stays() {
    let folder = Folder::new();
    fs::write(folder.path("dusk.hdr"), "not an image").unwrap();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    assert_eq!(
        session.drop(&[folder.path("dusk.hdr")])[..2],
        ["choose dusk, -, -", "catalog dusk studio, gold"]
    );
    session.builds().unwrap();
    let lines = session.received();
    let last = lines.last().unwrap();
    assert!(last.contains("FAILED  environment [dusk]"), "{lines:?}");
    assert!(!lines.iter().any(|line| line.starts_with("scene")), "{lines:?}");
}

#[test]
fn light_that_the_pipeline_turns_stays_turned_until_other_light_is_dropped() {
    let folder = Folder::new();
    let turned = "[stage.turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 30\n";
    let pipeline = PIPELINE.replace("lighting = \"lighting\"", "lighting = \"turned\"") + turned;
    fs::write(&folder.project.manifest, pipeline).unwrap();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    session.drop(&[folder.path("drop/clay.toml")]);
    let made = fs::read_to_string(session.builds().unwrap()).unwrap();
    assert!(made.contains("yaw = 30.0\n") && made.contains("lighting = \"turned\""), "{made}");
    assert_eq!(session.received(), ["scene clay under studio on plane"]);
    session.send(PreviewMessage::ReturnFromDropped);
    session.builds();
    session.drop(&[folder.path("drop/dawn.exr")]);
    let made = fs::read_to_string(session.builds().unwrap()).unwrap();
    assert!(!made.contains("yaw"), "{made}");
}

#[test]
fn unsaved_values_are_not_given_to_another_file_of_the_same_name() {
    let folder = Folder::new();
    fs::write(folder.path("drop/gold.toml"), MATTE).unwrap();
    let around = folder.surroundings();
    let mut session = Session::new(&folder, &around);
    let form = stages::material_form("gold.toml", &MATTE.replace("0.5", "0.25")).unwrap();
    session.send(PreviewMessage::Edit("gold".into(), MaterialEdit::Show(Some(form))));
    session.received();
    assert_eq!(
        session.drop(&[folder.path("drop/gold.toml")]),
        [
            "failure The dropped files cannot be shown; gold was replaced on the disk, and its values here are not saved; \
          hint: save or revert them first"
        ]
    );
    // Beside other files, gold keeps them.
    session.drop(&[folder.path("drop/clay.toml")]);
    session.builds().unwrap();
    session.send(show("studio", "gold"));
    let unsaved = session.controller.edits.unsaved().map(Path::to_owned).collect::<Vec<_>>();
    assert_eq!(unsaved.len(), 1);
    session.send(PreviewMessage::Edit("gold".into(), MaterialEdit::Show(None)));
    session.drop(&[folder.path("drop/gold.toml")]);
    assert!(session.builds().is_some(), "it is reverted");
}
