//! Sources that cannot be seen now: nothing is removed because of them. And links that lead into `out`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::*;

const OUT: [(&str, &str); 2] = [("out/gold.txt", "WARM"), ("out/sky.txt", "BLUE")];

fn built(source: &str, files: &[(&str, &str)]) -> Project {
    let project = Project::new(&CAPITALS.replace("in/*.txt", source));
    files.iter().for_each(|(file, text)| project.write(file, text));
    project.build();
    project
}

fn has_kept(project: &Project) {
    OUT.iter().for_each(|(file, text)| assert_eq!(project.read(file), *text, "{file}"));
}

fn rejected(project: &Project) -> String {
    let plan = Plan::load(&project.path("pipeline.toml"), &project.kinds);
    plan.map_or_else(|errors| errors.to_string(), |_| "no error".into())
}

fn link(project: &Project, target: impl AsRef<Path>, link: &str) {
    std::os::unix::fs::symlink(target, project.path(link)).unwrap();
}

#[test]
fn the_item_of_a_link_to_nothing_fails_with_the_target_and_keeps_its_outputs() {
    let project = built("in/*.txt", &[("store/sky", "blue"), ("in/gold.txt", "warm")]);
    link(&project, "../store/sky", "in/sky.txt");
    project.build();
    has_kept(&project);
    project.rename("store", "elsewhere");
    for _ in 0..2 {
        let log = project.build();
        let message = format!(
            "FAILED text [sky]: source in/sky.txt: cannot read {0}: {0} is a link to ../store/sky, which does not exist",
            project.path("in/sky.txt").display()
        );
        assert_has(&log, [&message, "1 failed, 2 skipped, 0 published, 0 removed"]);
        has_kept(&project);
    }
    project.rename("elsewhere", "store");
    assert!(project.build().contains("0 failed, 0 skipped"));
    // A link to a link to nothing, a circle of links, and a folder on the way that is one.
    for (target, expected) in [("chain", "is a link to"), ("sky.txt", "cannot be followed")] {
        project.remove_link("in/sky.txt");
        link(&project, target, "in/sky.txt");
        if target == "chain" {
            link(&project, "nowhere", "in/chain");
        }
        assert_has(project.build(), [expected, "1 failed", "0 removed"]);
        has_kept(&project);
    }
    project.remove_link("in/sky.txt");
    assert!(project.build().contains("removed sky.txt"), "a link that was deleted is gone");
}

#[test]
fn a_file_of_its_own_name_that_is_a_link_to_nothing_is_an_item_that_fails() {
    let project = built("in/sky.txt", &[("in/sky.txt", "blue")]);
    project.rename("in/sky.txt", "in/store");
    link(&project, "store", "in/sky.txt");
    assert!(project.build().contains("up to date"));
    project.remove("in/store");
    assert_has(project.build(), ["is a link to store, which does not exist", "0 removed"]);
    assert_eq!(project.read("out/sky.txt"), "BLUE");
}

/// Without the folder it is not known that its item's name ends in `.v2`.
#[test]
fn a_folder_of_its_own_name_that_is_a_link_to_nothing_keeps_its_outputs() {
    let project = Project::new(&CAPITALS.replace("in/*.txt", "faces.v2"));
    project.write("store/a", "");
    link(&project, "store", "faces.v2");
    project.build();
    assert_eq!(project.read("out/faces.v2.txt"), "A");
    project.rename("store", "elsewhere");
    let error = project.try_build().1.unwrap_err().to_string();
    assert!(error.ends_with("faces.v2 is a link to store, which does not exist"), "{error}");
    assert_eq!(project.read("out/faces.v2.txt"), "A");
}

#[test]
fn a_folder_that_cannot_be_reached_stops_the_build() {
    let files = [("share/deep/sky.txt", "blue"), ("in/here/gold.txt", "warm")];
    let project = built("in/*/*.txt", &files);
    link(&project, "../share/deep", "in/there");
    project.build();
    has_kept(&project);
    project.rename("share", "elsewhere");
    expect_test::expect![[r#"pipeline.toml:4:41: in/there is a link to ../share/deep, which does not exist; if it is not needed, leave it out: "!in/there""#]]
        .assert_eq(&rejected(&project).replace(&project.unix_path(""), ""));
    has_kept(&project);
    // Somebody who does not need it says so.
    project.edit("\"in/*/*.txt\"", "[\"in/*/*.txt\", \"!in/there\"]");
    assert!(project.build().contains("removed sky.txt"));
}

#[test]
fn a_folder_that_cannot_be_listed_stops_the_build() {
    use std::os::unix::fs::PermissionsExt;
    let project = built("in/**/*.txt", &[("in/a/sky.txt", "blue"), ("in/gold.txt", "warm")]);
    let closed = project.path("in/a");
    fs::set_permissions(&closed, PermissionsExt::from_mode(0o000)).unwrap();
    if fs::read_dir(&closed).is_ok() {
        eprintln!("SKIPPED: this user may list any folder");
    } else {
        assert_has(rejected(&project), ["cannot read the folder in/a: Permission denied"]);
        has_kept(&project);
    }
    fs::set_permissions(&closed, PermissionsExt::from_mode(0o755)).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_path_is_too_long_is_an_error() {
    let project = built("in/**/*.txt", &[("in/sky.txt", "blue"), ("in/gold.txt", "warm")]);
    let script = "import os\nos.chdir(os.environ['IN'])\nfor _ in range(25): os.mkdir('d' * 200); os.chdir('d' * 200)\nopen('deep.txt', 'w').close()";
    let made = Command::new("python3").args(["-c", script]).env("IN", project.path("in")).status();
    assert!(made.is_ok_and(|made| made.success()), "this test needs Python");
    let errors = rejected(&project);
    assert_has(&errors, ["cannot read the folder in/ddd", "too long"]);
    assert!(errors.len() < 600, "{} characters", errors.len());
    has_kept(&project);
    let _ = Command::new("rm").arg("-rf").arg(project.path("in")).status();
}

/// A drive that is mounted as long as this lives.
struct Mounted(PathBuf);

impl Mounted {
    /// Mounts one folder on another; `None` if this user may not.
    fn new(folder: &Path, on: &Path) -> Option<Self> {
        let mounted = Command::new("mount").arg("--bind").args([folder, on]).output();
        if mounted.is_ok_and(|mounted| mounted.status.success()) {
            return Some(Self(on.into()));
        }
        eprintln!("SKIPPED: this user may not mount");
        None
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_drive_that_is_not_mounted_stops_the_build() {
    let project = built("in/*/*.txt", &[("in/here/gold.txt", "warm"), ("share/sky.txt", "blue")]);
    fs::create_dir(project.path("in/drive")).unwrap();
    let mount = || Mounted::new(&project.path("share"), &project.path("in/drive"));
    let Some(mounted) = mount() else { return };
    project.build();
    has_kept(&project);
    drop(mounted);
    for dry_run in [false, true] {
        let options = BuildOptions { dry_run, ..project.options.clone() };
        let built = crate::build::build(&project.plan(), &options, &project.cancel, &|_| {});
        let error = built.unwrap_err().to_string();
        let expected =
            "the source in/drive/sky.txt cannot be read, and may still exist: nothing is mounted on ";
        assert!(error.starts_with(expected) && error.ends_with("/in/drive any more"), "{error}");
        has_kept(&project);
    }
    let mounted = mount();
    assert!(project.build().contains("0 ran, 6 up to date, 0 failed, 0 skipped, 0 published, 0 removed"));
    // A file that was deleted there is gone.
    project.remove("share/sky.txt");
    assert!(project.build().contains("removed sky.txt"));
    project.write("share/sky.txt", "blue");
    project.build();
    drop(mounted);
    // Some systems remove the folder when the drive goes.
    project.remove("in/drive");
    assert!(project.try_build().1.is_err());
    has_kept(&project);
    // Somebody who does not need it any more says so.
    project.edit("\"in/*/*.txt\"", "[\"in/*/*.txt\", \"!in/drive\"]");
    assert!(project.build().contains("removed sky.txt"));
}

/// What the drive hides may still be there.
#[cfg(target_os = "linux")]
#[test]
fn a_drive_that_hides_sources_stops_the_build() {
    let project = built("in/**/*.txt", &[("in/deep/sky.txt", "blue"), ("in/gold.txt", "warm")]);
    fs::create_dir(project.path("empty")).unwrap();
    let Some(mounted) = Mounted::new(&project.path("empty"), &project.path("in/deep")) else { return };
    let error = project.try_build().1.unwrap_err();
    assert!(error.to_string().contains("another drive is now mounted on "), "{error}");
    assert!(error.help().unwrap().contains("\"!in/deep\""), "{:?}", error.help());
    assert!(crate::answers::check_sources(&project.plan()).is_err());
    has_kept(&project);
    drop(mounted);
    assert!(project.build().contains("0 ran, 6 up to date"));
}

/// A drive that shows `out` a second time is no link.
#[cfg(target_os = "linux")]
#[test]
fn out_by_another_name_is_no_source() {
    let project = built("in/*.txt", &[("in/sky.txt", "blue"), ("in/gold.txt", "warm")]);
    for folder in ["in/all", "in/some"] {
        fs::create_dir(project.path(folder)).unwrap();
    }
    project.edit("in/*.txt", "in/**/*.txt");
    let Some(mounted) = Mounted::new(&project.path("out"), &project.path("in/all")) else { return };
    assert_has(rejected(&project), ["in/all is inside \"out\", the folder for exports"]);
    drop(mounted);
    assert_eq!(rejected(&project), "no error");
}

#[test]
fn a_source_that_leads_into_out_is_refused_by_any_link() {
    let files = [("in/sky.txt", "blue"), ("in/gold.txt", "warm")];
    let refused = |source: &str, links: &[(&str, &str)]| {
        let project = built("in/*.txt", &files);
        let more = format!("[stage.again]\nkind = \"text-source\"\nsource = \"{source}\"\n");
        project.write("pipeline.toml", &format!("{CAPITALS}{more}"));
        fs::create_dir(project.path("more")).unwrap();
        for (target, name) in links {
            link(&project, target.replace("HERE", &project.path("").display().to_string()), name);
        }
        let errors = rejected(&project);
        assert!(errors.contains("is inside \"out\", the folder for exports"), "{source}: {errors}");
        errors
    };
    assert_has(
        refused("more/*.txt", &[("../out/sky.txt", "more/x.txt")]),
        ["more/x.txt is inside \"out\", the folder for exports: it leads to out/sky.txt"],
    );
    refused("more/*.txt", &[("HERE/out/sky.txt", "more/x.txt")]);
    refused("more/*.txt", &[("y", "more/x.txt"), ("../in/../out/sky.txt", "more/y")]);
    refused("more/*.txt", &[("../out/not-yet.txt", "more/x.txt")]);
    refused("more/x.txt", &[("../out/sky.txt", "more/x.txt")]);
    refused("more/x.txt", &[("../out/not-yet.txt", "more/x.txt")]);
    refused("more/*/*.txt", &[("../out", "more/x")]);
    refused("link/*.txt", &[("out", "link")]);
    refused("more/deep/sky.txt", &[("../out", "more/deep")]);
    refused("more/deep", &[("../out", "more/deep")]);
}

#[test]
fn a_file_that_an_item_reads_may_not_lead_into_out() {
    let project = built("in/*.txt", &[("in/sky.txt", "blue"), ("in/gold.txt", "warm")]);
    link(&project, "../out/gold.txt", "in/linked");
    for included in ["linked", "../out/gold.txt"] {
        project.write("in/sky.txt", &format!("include {included}\n"));
        assert_has(project.build(), ["FAILED text [sky]", "is inside \"out\""]);
        has_kept(&project);
    }
}
