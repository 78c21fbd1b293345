//! A state folder that someone else has prepared may waste time; it never leads to a file outside `out`.

use serde_json::{Value, json};

use super::*;
use crate::storage::{Journal, Line, Tag, subject};

const MANIFEST: &str = r#"
schema = 1
out = "out"
[stage]
text = { kind = "text-source", source = "*.txt" }
file = { kind = "write", input = "text" }
"#;

fn project() -> Project {
    let project = Project::new(MANIFEST);
    project.write("a.txt", "one");
    project.build();
    project
}

/// Appends lines to the journal, each with a correct check.
fn forge(project: &Project, lines: &[Line]) {
    let path = project.path(".specula/journal");
    let journal =
        Journal::write(&path, None, |journal| crate::storage::Retention::of(journal, &project.path("")));
    journal.unwrap().append(lines).unwrap();
}

/// A line of the ledger: a file whose item has gone.
fn published(file: &str, content: &str) -> Line {
    let line = json!({
        "manifest": "pipeline.toml", "out": "out", "file": file,
        "item": { "stage": "file", "key": { "text": "gone" } },
        "digest": crate::Digest::of(content.as_bytes()), "settled": true,
        "stamp": { "size": content.len(), "modified": 0, "changed": 0, "inode": 0 }, "replaces": null,
    });
    Line::new(Tag::Published, subject(&["pipeline.toml", "out", file]), Some(&line))
}

#[test]
fn a_forged_ledger_removes_and_replaces_nothing_outside_out() {
    let project = project();
    let elsewhere = tempfile::tempdir().unwrap();
    let absolute = elsewhere.path().canonicalize().unwrap().join("precious");
    std::fs::write(&absolute, "precious").unwrap();
    project.write("precious", "precious");
    project.write("inside/precious", "precious");
    let names = ["../precious", "x/../../precious", "./../inside/precious", absolute.to_str().unwrap()];
    forge(&project, &names.map(|name| published(name, "precious")));
    // A line whose file is inside `out` works as always.
    project.write("out/stale.txt", "stale");
    forge(&project, &[published("stale.txt", "stale")]);
    let foreseen = log(&project.rehearse().0);
    assert_eq!(foreseen.matches("removed ").collect::<Vec<_>>().len(), 1, "{foreseen}");
    assert_has(project.build(), ["removed stale.txt", "0 published, 1 removed"]);
    for place in [absolute.as_path(), &project.path("precious"), &project.path("inside/precious")] {
        assert_eq!(std::fs::read_to_string(place).unwrap(), "precious");
    }
}

#[test]
fn a_forged_announcement_sweeps_no_folder_but_out() {
    let project = project();
    let elsewhere = tempfile::tempdir().unwrap();
    let folder = elsewhere.path().canonicalize().unwrap();
    let left = [folder.join(".specula-1-1.tmp"), project.path("inside/.specula-1-1.tmp")];
    std::fs::write(&left[0], "theirs").unwrap();
    project.write("inside/.specula-1-1.tmp", "theirs");
    project.write("out/.specula-1-1.tmp", "ours");
    let announced = |out: &str| Line::new(Tag::Publishing, subject(&[out]), Some(&out));
    forge(&project, &[folder.to_str().unwrap(), "inside", "out", "../..", ".", "out/.."].map(announced));
    project.build();
    assert!(left.iter().all(|left| left.exists()));
    assert!(!project.exists("out/.specula-1-1.tmp"), "what a killed build left there is swept");
}

/// The latest record of the item `text [a]`, changed.
fn change_record(project: &Project, change: impl FnOnce(&mut Value)) {
    let journal = Journal::read(&project.path(".specula/journal")).unwrap();
    let records = journal.contents::<Value>(Tag::Item);
    let is_text = |record: &Value| record["item"]["stage"] == "text";
    let (subject, mut record) = records.into_iter().find(|(_, record)| is_text(record)).unwrap();
    change(&mut record);
    forge(project, &[Line::new(Tag::Item, subject, Some(&record))]);
}

#[cfg(unix)]
#[test]
fn a_record_that_names_a_pipe_or_a_device_does_not_stop_a_build() {
    for place in ["pipe", "/dev/zero", "/dev/tty", "socket"] {
        let project = project();
        if place == "pipe" {
            let made = std::process::Command::new("mkfifo").arg(project.path("pipe")).status().unwrap();
            assert!(made.success());
        }
        let _socket = std::os::unix::net::UnixListener::bind(project.path("socket")).unwrap();
        change_record(&project, |record| {
            record["reads"][1]["path"] = place.into();
            record["reads"][1]["modified"] = Value::Null;
        });
        let explained = &project.explain("text")[0];
        assert!(explained.restored, "{place}: {explained:?}");
        let log = project.build();
        // The journal has a record of the same key, whose reads have not changed.
        assert!(log.contains("2 up to date, 0 failed"), "{place}: {log}");
        assert_eq!(project.read("out/file/a.txt"), "one");
    }
}

#[test]
fn forged_outputs_and_reads_of_an_item_reach_nothing() {
    let project = project();
    project.write("precious", "precious");
    change_record(&project, |record| {
        record["outputs"] = json!([
            { "digest": crate::Digest::of(b"precious"), "bytes": 8 },
            { "digest": crate::Digest::of(b""), "bytes": u64::MAX }
        ]);
        record["reads"] = json!([
            { "path": "../".repeat(40) + "etc/passwd", "listing": false, "digest": null },
            { "path": "/", "listing": true, "digest": null }
        ]);
    });
    assert!(project.build().contains("0 failed"));
    assert_eq!(project.read("precious"), "precious");
    assert_eq!(project.read("out/file/a.txt"), "one");
}

#[cfg(unix)]
#[test]
fn a_link_where_a_file_is_about_to_be_written_is_not_followed() {
    let project = Project::new(MANIFEST);
    project.write("a.txt", "one");
    project.write("precious", "precious");
    for number in 0..4 {
        for folder in ["out/file", ".specula/tmp"] {
            std::fs::create_dir_all(project.path(folder)).unwrap();
            let names = [format!(".specula-{}-{number}.tmp", std::process::id()), format!("{number}")];
            for name in names {
                let link = project.path(folder).join(name);
                std::os::unix::fs::symlink(project.path("precious"), link).unwrap();
            }
        }
    }
    assert!(project.build().contains("1 published"));
    assert_eq!(project.read("out/file/a.txt"), "one");
    assert_eq!(project.read("precious"), "precious");
}

#[cfg(unix)]
#[test]
fn an_out_that_leads_elsewhere_is_an_error() {
    let project = Project::new(MANIFEST);
    project.write("a.txt", "one");
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::write(elsewhere.path().join("precious"), "precious").unwrap();
    let shown = |project: &Project| {
        let loaded = Plan::load(&project.path("pipeline.toml"), &project.kinds);
        loaded.err().map(|diagnostics| crate::testkit::shown(&diagnostics)).unwrap_or_default()
    };
    for (out, link) in [("out", "out"), ("built/out", "built")] {
        project.write("pipeline.toml", &MANIFEST.replace("out = \"out\"", &format!("out = {out:?}")));
        std::os::unix::fs::symlink(elsewhere.path(), project.path(link)).unwrap();
        assert_has(shown(&project), [&format!("- {link:?} leads out of the manifest's folder, to ")]);
        project.remove_link(link);
        std::os::unix::fs::symlink(project.path(""), project.path(link)).unwrap();
        assert_eq!(
            shown(&project).is_empty(),
            out != link,
            "the manifest's folder itself is no folder for exports"
        );
        project.remove_link(link);
        std::fs::create_dir_all(project.path("real")).unwrap();
        std::os::unix::fs::symlink(project.path("real"), project.path(link)).unwrap();
        assert_eq!(shown(&project), "");
        project.remove_link(link);
        assert_eq!(shown(&project), "");
    }
}
