//! Files that are dropped on the window: the project of them and of what it shows.
//!
//! The manifest stays as it is. What is shown comes from the files of its imports; what other stages make is
//! replaced by the sample's.

use std::path::{Path, PathBuf};

use ::preview::{Subject, SubjectRequest};
use engine::{ItemIndex, Plan};
use sphere::Rotation;
use stages::PreviewCatalog;

use super::project::{self, Project};
use super::status::Toast;
use crate::assets::{self, Assets};
use crate::lists::list;
use crate::standard_pipeline::ImportParameters;

/// A toast names at most this many files.
const NAMED: usize = 4;

/// The project, catalog and subject that the window shows.
pub(super) struct Shown<'a> {
    pub(super) project: &'a Project,
    pub(super) catalog: Option<&'a PreviewCatalog>,
    pub(super) subject: Option<&'a Subject>,
}

/// The project that the window goes over to.
pub(super) struct DroppedProject {
    pub(super) project: Project,
    /// The dropped files, as parts of the subject.
    pub(super) chosen: SubjectRequest,
    /// A message of what happened, how to keep it, and how to return.
    pub(super) toast: Toast,
}

/// The project of files that were dropped, and of those that are shown; or the manifest that was dropped.
/// Projects of files are written below `cache`.
pub(super) fn project_of(
    files: &[PathBuf],
    shown: &Shown<'_>,
    cache: &Path,
) -> Result<DroppedProject, Vec<String>> {
    let back = format!("Backspace returns to {}", name_of(shown.project));
    if let [file] = files
        && file.is_file()
        && assets::is_manifest(file)
    {
        let project = Project { manifest: file.clone(), ..Project::default() };
        let toast = Toast { title: format!("opened {}", name_of(&project)), lines: vec![back] };
        return Ok(DroppedProject { project, chosen: SubjectRequest::default(), toast });
    }
    let dropped = Assets::named(files).map_err(|error| vec![error, format!("hint: {}", project::FILES)])?;
    let (assets, mut parameters) = shown.files();
    // They are of the files that were shown; a dropped panorama need not be laid out in the same way.
    if !dropped.environments.is_empty() {
        parameters.environment.clear();
        parameters.turn = None;
    }
    if !dropped.materials.is_empty() {
        parameters.material.clear();
    }
    let project = Project::of_assets(with_dropped(assets, &dropped), &parameters, cache);
    let cannot = "cannot prepare a project for these files";
    let project = project.map_err(|error| vec![cannot.into(), error.to_string()])?;
    let names = dropped.files().iter().map(|file| file_name(file)).collect::<Vec<_>>();
    let lines = shown.how_to_keep(&dropped).into_iter().chain([back]).collect();
    let toast = Toast { title: format!("showing {}", list(&names, ", ", NAMED)), lines };
    Ok(DroppedProject { project, chosen: choice(&dropped), toast })
}

impl Shown<'_> {
    /// The files of what is shown, and how its manifest imports them.
    fn files(&self) -> (Assets, ImportParameters) {
        let nothing = || (Assets::default(), ImportParameters::default());
        let project = self.project;
        if !project.files.is_empty() {
            let left = project.files.iter().filter(|file| file.exists()).cloned().collect::<Vec<_>>();
            return (Assets::named(&left).unwrap_or_default(), ImportParameters::default());
        }
        let (Some(catalog), Some(subject)) = (self.catalog, self.subject) else { return nothing() };
        let Ok(Some(entry)) = catalog.entry(&subject.environment, &subject.material) else {
            return nothing();
        };
        let plan = catalog.plan();
        let environment = imported(plan, Some(entry.environment), "import-environment");
        let material = imported(plan, entry.material, "import-material");
        let mesh = imported(plan, catalog.mesh_item(&subject.mesh), "import-mesh");
        let turn = environment.as_ref().and_then(|_| angles(entry.turn));
        let file = |found: &Option<Imported>| found.iter().map(|found| found.file.clone()).collect();
        let assets =
            Assets { environments: file(&environment), materials: file(&material), meshes: file(&mesh) };
        let parameters =
            |found: Option<Imported>| found.map(|found| parameters(plan, &found.stage)).unwrap_or_default();
        let parameters =
            ImportParameters { environment: parameters(environment), material: parameters(material), turn };
        (assets, parameters)
    }

    /// The text to write to keep files that were dropped: for each of their kinds a line.
    fn how_to_keep(&self, dropped: &Assets) -> Vec<String> {
        let lists = [
            ("import-environment", &dropped.environments),
            ("import-material", &dropped.materials),
            ("import-mesh", &dropped.meshes),
        ];
        if !self.project.files.is_empty() {
            return vec!["`specula preview FILES --manifest` prints a manifest that keeps them".into()];
        }
        let stages = self.catalog.map(|catalog| &catalog.plan().stages[..]).unwrap_or_default();
        let advice = lists.into_iter().filter(|(_, files)| !files.is_empty()).map(|(kind, files)| {
            let names = files.iter().map(|file| file_name(file)).collect::<Vec<_>>();
            let names = list(&names, ", ", NAMED);
            match stages.iter().find(|stage| stage.kind.name() == kind) {
                Some(stage) => format!("to keep {names}, add it to the source of [stage.{}]", stage.name),
                None => format!("to keep {names}, add a stage of the kind {kind}"),
            }
        });
        advice.collect()
    }
}

/// An item that a stage imports.
struct Imported {
    stage: String,
    file: PathBuf,
}

/// An item's file, if a stage of this kind imports it from one.
fn imported(plan: &Plan, item: Option<ItemIndex>, kind: &str) -> Option<Imported> {
    let item = &plan.items[item?];
    let stage = &plan.stages[item.stage];
    let file = item.source.clone().filter(|_| stage.kind.name() == kind)?;
    Some(Imported { stage: stage.name.clone(), file })
}

/// Yaw, pitch and roll in degrees of a rotation; `None` if it turns nothing.
fn angles(turn: Rotation) -> Option<[f64; 3]> {
    // Nobody wrote more digits.
    let degrees = turn.yaw_pitch_roll().map(|angle| (angle.to_degrees() * 1e9).round() / 1e9 + 0.0);
    (degrees != [0.0; 3]).then_some(degrees)
}

/// The lines of a stage in its manifest, without its kind and its source.
fn parameters(plan: &Plan, stage: &str) -> Vec<String> {
    let text = engine::read_file(&plan.manifest).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    let manifest = text.and_then(|text| toml::from_str::<toml::Table>(&text).ok()).unwrap_or_default();
    let stage = manifest.get("stage").and_then(|stages| stages.get(stage)?.as_table());
    let lines = stage.into_iter().flatten().filter(|(key, _)| !["kind", "source"].contains(&key.as_str()));
    lines.map(|(key, value)| format!("{key} = {value}")).collect()
}

/// The dropped files, and those that were shown; of two files with one name, the one that was dropped.
fn with_dropped(shown: Assets, dropped: &Assets) -> Assets {
    let kept = |shown: Vec<PathBuf>, dropped: &[PathBuf]| {
        let is_kept = |file: &PathBuf| dropped.iter().all(|other| other.file_stem() != file.file_stem());
        [dropped.to_vec(), shown.into_iter().filter(is_kept).collect()].concat()
    };
    Assets {
        environments: kept(shown.environments, &dropped.environments),
        materials: kept(shown.materials, &dropped.materials),
        meshes: kept(shown.meshes, &dropped.meshes),
    }
}

/// The first of each kind of these files.
fn choice(dropped: &Assets) -> SubjectRequest {
    let first = |files: &[PathBuf]| Some(files.first()?.file_stem()?.to_string_lossy().into_owned());
    SubjectRequest {
        environment: first(&dropped.environments),
        material: first(&dropped.materials),
        mesh: first(&dropped.meshes),
        mode: None,
    }
}

/// A project in a sentence: its manifest or its files.
pub(super) fn name_of(project: &Project) -> String {
    match &project.files[..] {
        [] => file_name(&project.manifest),
        files => list(&files.iter().map(|file| file_name(file)).collect::<Vec<_>>(), ", ", NAMED),
    }
}

fn file_name(file: &Path) -> String {
    file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_is_written_as_the_angles_that_make_it() {
        for written in [[30.0, 0.0, 0.0], [-170.0, 20.0, 75.0], [10.0, 90.0, 0.0], [-35.5, -90.0, 0.0]] {
            let [yaw, pitch, roll] = written.map(f64::to_radians);
            let found = angles(Rotation::from_yaw_pitch_roll(yaw, pitch, roll)).unwrap();
            assert!(
                found.iter().zip(written).all(|(found, angle)| (found - angle).abs() < 1e-6),
                "{found:?}"
            );
        }
        assert_eq!(angles(Rotation::IDENTITY), None);
    }
}
