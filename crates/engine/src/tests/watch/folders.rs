//! Folders that appear, disappear and move, and links that are replaced.

use std::fs;

use super::*;

fn deep() -> Project {
    let project = Project::new(&CAPITALS.replace("in/*.txt", "in/**/*.txt"));
    project.write("in/sky.txt", "blue");
    project
}

each_way! {
    fn a_folder_made_and_written_to_at_once(way: Way) {
        let project = deep();
        let watched = Watched::new(&project, way);
        project.write("in/a/b/c/rain.txt", "wet");
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "BLUE")]);
        project.write("in/a/b/snow.txt", "cold");
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "BLUE"), ("snow.txt", "COLD")]);
    }

    fn a_folder_moved_away_and_back(way: Way) {
        let project = deep();
        project.write("in/a/b/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        for text in ["one", "two"] {
            project.rename("in/a", "elsewhere");
            watched.until_out(&[("sky.txt", "BLUE")]);
            project.write("elsewhere/b/rain.txt", "written elsewhere");
            project.rename("elsewhere", "in/a");
            watched.until_out(&[("rain.txt", "WRITTEN ELSEWHERE"), ("sky.txt", "BLUE")]);
            project.write("in/a/b/rain.txt", text);
            watched.until_out(&[("rain.txt", &text.to_uppercase()), ("sky.txt", "BLUE")]);
        }
    }

    fn a_folder_moved_away_and_back_at_once(way: Way) {
        let project = deep();
        project.write("in/a/b/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        project.rename("in/a", "elsewhere");
        project.rename("elsewhere", "in/a");
        project.write("in/a/b/rain.txt", "at once");
        watched.until_out(&[("rain.txt", "AT ONCE"), ("sky.txt", "BLUE")]);
        project.write("in/a/b/rain.txt", "later");
        watched.until_out(&[("rain.txt", "LATER"), ("sky.txt", "BLUE")]);
    }

    fn a_folder_renamed_within_the_glob(way: Way) {
        let project = deep();
        project.write("in/a/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        project.rename("in/a", "in/z");
        watched.until("the change", |events| changes(events).count() > 0);
        project.write("in/z/rain.txt", "dry");
        watched.until_out(&[("rain.txt", "DRY"), ("sky.txt", "BLUE")]);
        project.write("in/a/snow.txt", "cold");
        watched.until_out(&[("rain.txt", "DRY"), ("sky.txt", "BLUE"), ("snow.txt", "COLD")]);
    }

    fn a_folder_deleted_and_made_again(way: Way) {
        let project = deep();
        project.write("in/a/rain.txt", "wet");
        let watched = Watched::new(&project, way);
        for text in ["one", "two", "three"] {
            project.remove("in/a");
            project.write("in/a/rain.txt", text);
            watched.until_out(&[("rain.txt", &text.to_uppercase()), ("sky.txt", "BLUE")]);
        }
    }

    fn the_searched_folder_itself_moved_away_and_back(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        project.rename("in", "elsewhere");
        watched.until("the error", |events| {
            events.iter().any(|event| matches!(event, Event::Rejected { .. }))
        });
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
        project.rename("elsewhere", "in");
        watched.until("it is accepted", |events| events.contains(&Event::Accepted));
        project.write("in/sky.txt", "grey");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "GREY")]);
    }

    fn the_project_moved_away_and_another_one_in_its_place(way: Way) {
        let around = Around::new();
        let watched = Watched::new(&around.project, way);
        around.rename("project", "old");
        watched.until("the error", |events| events.iter().any(|event| matches!(event, Event::Rejected { .. })));
        around.rename("other", "project");
        watched.until_out(&[("other.txt", "OTHER")]);
        assert!(watched.noticed().contains(&(".".into(), Changed::Appeared)), "{:?}", watched.noticed());
        around.project.edit("path = \"{text}\"", "path = \"{text}-loud\"");
        watched.until_out(&[("other-loud.txt", "OTHER")]);
        around.project.write("in/sky.txt", "blue");
        watched.until_out(&[("other-loud.txt", "OTHER"), ("sky-loud.txt", "BLUE")]);
        assert!(!around.folder.path().join("old/out/other-loud.txt").exists());
    }

    fn the_project_replaced_at_once(way: Way) {
        let around = Around::new();
        let watched = Watched::new(&around.project, way);
        around.rename("project", "old");
        around.rename("other", "project");
        watched.until_out(&[("other.txt", "OTHER")]);
        around.project.edit("path = \"{text}\"", "path = \"{text}-loud\"");
        watched.until_out(&[("other-loud.txt", "OTHER")]);
    }

    fn the_project_deleted_and_made_again(way: Way) {
        let around = Around::new();
        let watched = Watched::new(&around.project, way);
        for text in ["one", "two"] {
            // The watcher may be writing into it.
            let deadline = Instant::now() + Duration::from_secs(10);
            while remove_tree(&around.folder.path().join("project")).is_err() {
                if Instant::now() > deadline {
                    if cfg!(unix) {
                        panic!("the project stays");
                    }
                    return test_data::skip("the_project_deleted_and_made_again", KEPT);
                }
            }
            watched.until("it has gone", |events| changes(events).any(|(_, what)| what == Changed::Gone));
            around.make("project", &[("sky", text)]);
            watched.until_out(&[("sky.txt", &text.to_uppercase())]);
        }
        around.project.edit("path = \"{text}\"", "path = \"{text}-loud\"");
        watched.until_out(&[("sky-loud.txt", "TWO")]);
    }

    fn a_folder_above_the_project_replaced(way: Way) {
        let around = Around::below("a/b");
        let watched = Watched::new(&around.project, way);
        around.rename("a", "old");
        watched.until("it has gone", |events| changes(events).any(|(_, what)| what == Changed::Gone));
        around.make("new/b/project", &[("sky", "grey")]);
        around.rename("new", "a");
        watched.until_out(&[("sky.txt", "GREY")]);
        around.project.write("in/sky.txt", "red");
        watched.until_out(&[("sky.txt", "RED")]);
    }

    fn a_folder_outside_the_project(way: Way) {
        let library = tempfile::tempdir().unwrap();
        fs::write(library.path().join("sky.txt"), "blue").unwrap();
        let name = library.path().file_name().unwrap().to_string_lossy().into_owned();
        let project = Project::new(&CAPITALS.replace("in/", &format!("../{name}/")));
        let watched = Watched::new(&project, way);
        fs::write(library.path().join("sky.txt"), "grey").unwrap();
        watched.until_out(&[("sky.txt", "GREY")]);
        fs::write(library.path().join("rain.txt"), "wet").unwrap();
        watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "GREY")]);
    }
}

/// A project in a folder with another one, which may take its place.
struct Around {
    folder: tempfile::TempDir,
    project: Project,
}

impl Around {
    fn new() -> Self {
        Self::below(".")
    }

    /// The project is in a folder of this folder.
    fn below(path: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().canonicalize().unwrap().join(path).join("project");
        let around = Self { project: Project::at(place), folder };
        around.make(&format!("{path}/project"), &[("sky", "blue")]);
        around.make("other", &[("other", "other")]);
        around
    }

    fn make(&self, name: &str, texts: &[(&str, &str)]) {
        let folder = self.folder.path().join(name);
        fs::create_dir_all(folder.join("in")).unwrap();
        for (name, text) in texts {
            fs::write(folder.join("in").join(format!("{name}.txt")), text).unwrap();
        }
        fs::write(folder.join("pipeline.toml"), CAPITALS).unwrap();
    }

    fn rename(&self, from: &str, to: &str) {
        fs::rename(self.folder.path().join(from), self.folder.path().join(to)).unwrap();
    }
}

/// If it did, what is put in its place would land inside it.
#[test]
fn a_running_build_does_not_bring_back_a_project_that_was_moved_away() {
    let around = Around::new();
    let go = around.folder.path().join("go");
    around.project.write("pipeline.toml", &CAPITALS.replace("kind = \"upper\"", "kind = \"wait-for-file\""));
    around.project.write("in/sky.txt", &format!("wait {}", go.display()));
    let watched = Watched::start(&around.project, Way::Listening.options());
    watched.until("the build runs", |events| {
        events.iter().any(|event| matches!(event, Event::Started { item, .. } if item.stage == "upper"))
    });
    around.rename("project", "old");
    fs::write(&go, "").unwrap();
    watched.until("the build ends", |events| {
        events.iter().any(|event| matches!(event, Event::Ended(_) | Event::BuildError { .. }))
    });
    std::thread::sleep(Duration::from_millis(200));
    assert!(!around.folder.path().join("project").exists(), "{}", log(&watched.events()));
}

/// Mounts a folder on another one; `None` if this user may not.
#[cfg(target_os = "linux")]
fn mounted(folder: &std::path::Path, on: &std::path::Path) -> Option<impl Drop + use<>> {
    struct Mounted(std::path::PathBuf);
    impl Drop for Mounted {
        fn drop(&mut self) {
            let _ = std::process::Command::new("umount").arg("--lazy").arg(&self.0).status();
        }
    }
    let mounted = std::process::Command::new("mount").arg("--bind").args([folder, on]).output();
    if mounted.is_ok_and(|mounted| mounted.status.success()) {
        return Some(Mounted(on.into()));
    }
    eprintln!("SKIPPED: this user may not mount");
    None
}

#[cfg(target_os = "linux")]
#[test]
fn a_drive_mounted_over_a_watched_folder() {
    let drive = tempfile::tempdir().unwrap();
    fs::write(drive.path().join("sky.txt"), "grey").unwrap();
    fs::write(drive.path().join("gold.txt"), "warm").unwrap();
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    let Some(mount) = mounted(drive.path(), &project.path("in")) else { return };
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "GREY")]);
    fs::write(drive.path().join("sky.txt"), "red").unwrap();
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "RED")]);
    drop(mount);
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_drive_mounted_over_a_folder_above_the_sources() {
    let around = Around::new();
    around.make("drive/project", &[("sky", "grey")]);
    let watched = Watched::new(&around.project, Way::Listening);
    let [drive, on] = ["drive/project", "project"].map(|name| around.folder.path().join(name));
    let Some(_mount) = mounted(&drive, &on) else { return };
    watched.until_out(&[("sky.txt", "GREY")]);
    around.project.write("in/sky.txt", "red");
    watched.until_out(&[("sky.txt", "RED")]);
}

#[cfg(unix)]
mod links {
    use std::os::unix::fs::symlink;

    use super::*;

    /// Replaces a link in one step.
    fn relink(project: &Project, target: &str, link: &str) {
        symlink(target, project.path("new-link")).unwrap();
        project.rename("new-link", link);
    }

    each_way! {
        fn a_link_to_a_file_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("store/one.dat", "one");
            project.write("store/two.dat", "two");
            project.write("in/gold.txt", "warm");
            symlink("../store/one.dat", project.path("in/sky.txt")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("store/one.dat", "uno");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "UNO")]);
            relink(&project, "../store/two.dat", "in/sky.txt");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "TWO")]);
            project.write("store/two.dat", "due");
            watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "DUE")]);
            assert!(watched.noticed().iter().all(|(path, _)| path == "in/sky.txt"), "{:?}", watched.noticed());
        }

        fn a_link_to_the_searched_folder_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("one/sky.txt", "one");
            project.write("two/sky.txt", "two");
            symlink("one", project.path("in")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("one/sky.txt", "uno");
            watched.until_out(&[("sky.txt", "UNO")]);
            relink(&project, "two", "in");
            watched.until_out(&[("sky.txt", "TWO")]);
            project.write("two/sky.txt", "due");
            project.write("two/rain.txt", "wet");
            watched.until_out(&[("rain.txt", "WET"), ("sky.txt", "DUE")]);
        }

        fn a_link_to_the_project_is_replaced(way: Way) {
            let around = Around::new();
            around.rename("project", "v1");
            around.rename("other", "v2");
            symlink("v1", around.folder.path().join("project")).unwrap();
            let watched = Watched::new(&around.project, way);
            watched.until_out(&[("sky.txt", "BLUE")]);
            symlink("v2", around.folder.path().join("next")).unwrap();
            around.rename("next", "project");
            watched.until_out(&[("other.txt", "OTHER")]);
            around.project.edit("path = \"{text}\"", "path = \"{text}-loud\"");
            watched.until_out(&[("other-loud.txt", "OTHER")]);
        }

        fn a_link_in_the_middle_of_a_chain_is_replaced(way: Way) {
            let project = Project::new(CAPITALS);
            project.write("v1/sky.txt", "one");
            project.write("v2/sky.txt", "two");
            symlink("v1", project.path("current")).unwrap();
            symlink(project.path("current"), project.path("in")).unwrap();
            let watched = Watched::new(&project, way);
            watched.until_out(&[("sky.txt", "ONE")]);
            relink(&project, "v2", "current");
            watched.until_out(&[("sky.txt", "TWO")]);
        }

        fn the_target_of_a_dangling_link_appears(way: Way) {
            let project = capitals();
            symlink("../store/rain.dat", project.path("in/rain.txt")).unwrap();
            let watched = Watched::new(&project, way);
            project.write("store/rain.dat", "wet");
            watched.until_out(&[("gold.txt", "WARM"), ("rain.txt", "WET"), ("sky.txt", "BLUE")]);
        }
    }
}
