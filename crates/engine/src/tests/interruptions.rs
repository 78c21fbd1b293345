//! Builds that are stopped, killed, or not alone.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::error::ErrorKind;
use crate::storage::LockTimeout;

fn chain() -> Project {
    two_texts(CHAIN)
}

#[test]
fn a_cancelled_build_stops_between_items_and_the_next_continues() {
    let project = chain();
    let plan = project.plan();
    let ran = AtomicUsize::new(0);
    let events = Mutex::new(Vec::new());
    let summary = crate::build::build(&plan, &project.options, &project.cancel, &|event| {
        if matches!(event, Event::Finished { .. }) && ran.fetch_add(1, Ordering::Relaxed) == 1 {
            project.cancel.cancel();
        }
        events.lock().push(event);
    });
    assert!(summary.unwrap().cancelled);
    let log = log(&events.into_inner());
    assert!(
        log.ends_with("ended: 2 ran, 0 up to date, 0 failed, 4 skipped, 0 published, 0 removed, cancelled\n")
    );
    let project = Project { cancel: Cancel::default(), ..project };
    assert!(project.build().contains("ended: 4 ran, 2 up to date"));
}

/// Is cancelled in the middle of its run, and then returns half of its output.
struct Hasty;

impl TextKind for Hasty {
    type Parameters = Nothing;
    const NAME: &'static str = "upper";

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        let half = context.reporter.check_cancelled().is_err();
        Ok(text[..text.len() / if half { 2 } else { 1 }].to_uppercase())
    }
}

#[test]
fn the_partial_result_of_a_cancelled_item_is_not_kept() {
    let mut project = chain();
    project.kinds = replacing(Hasty);
    let plan = project.plan();
    let summary = crate::build::build(&plan, &project.options, &project.cancel, &|event| {
        if matches!(&event, Event::Started { item, .. } if item.stage == "loud") {
            project.cancel.cancel();
        }
    });
    let summary = summary.unwrap();
    assert_eq!((summary.ran, summary.failed, summary.skipped, summary.cancelled), (1, 0, 5, true));
    project.cancel = Cancel::default();
    project.build();
    assert_eq!(project.read("out/file/a.txt"), "ONE");
}

#[test]
fn a_second_build_is_refused_while_one_is_running() {
    let project = chain();
    let plan = project.plan();
    let seen = Mutex::new(None);
    crate::build::build(&plan, &project.options, &project.cancel, &|event| {
        if matches!(event, Event::Started { .. }) && seen.lock().is_none() {
            let hasty = BuildOptions { lock_timeout: LockTimeout::NONE, ..project.options.clone() };
            let second = crate::build::build(&plan, &hasty, &project.cancel, &|_| {});
            *seen.lock() = Some(second);
            project.rehearse();
        }
    })
    .unwrap();
    let error = seen.into_inner().unwrap().unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Locked);
    let who = format!("specula build (process {}, since 20", std::process::id());
    assert!(error.to_string().starts_with(&who), "{error}");
}

#[test]
fn a_build_waits_for_the_running_one_until_it_is_cancelled() {
    let project = chain();
    let plan = project.plan();
    let second = Mutex::new(None);
    let cancel = Cancel::default();
    crate::build::build(&plan, &project.options, &project.cancel, &|event| {
        if matches!(event, Event::Started { .. }) && second.lock().is_none() {
            let patient = BuildOptions { lock_timeout: LockTimeout::ENDLESS, ..project.options.clone() };
            let events = Mutex::new(Vec::new());
            let summary = crate::build::build(&plan, &patient, &cancel, &|event| {
                if matches!(event, Event::Waiting { .. }) {
                    cancel.cancel();
                }
                events.lock().push(event);
            });
            summary.unwrap();
            *second.lock() = Some(log(&events.into_inner()));
        }
    })
    .unwrap();
    let waited = second.into_inner().unwrap();
    assert_has(&waited, ["waiting for specula build (process "]);
    assert!(
        waited.ends_with("0 ran, 0 up to date, 0 failed, 6 skipped, 0 published, 0 removed, cancelled\n"),
        "{waited}"
    );
    assert!(project.build().contains("0 ran, 6 up to date"));
}

/// A process killed at any moment leaves the journal at some length, `out` with the files of that moment, and
/// temporary files. The journal names a file before it appears, so the next build always recognizes its own.
#[test]
fn a_build_killed_after_any_line_of_the_journal_is_continued() {
    let first = chain();
    first.build();
    first.write("a.txt", "three");
    let before = std::fs::read(first.path(".specula/journal")).unwrap();
    let old_out = first.files("out");
    first.build();
    let after = std::fs::read(first.path(".specula/journal")).unwrap();
    let new_out = first.files("out");
    assert!(after.starts_with(&before));
    assert_ne!(old_out, new_out);
    let mut cuts = vec![before.len()];
    cuts.extend((before.len()..after.len()).filter(|at| after[*at] == b'\n').map(|at| at + 1));
    cuts.extend((before.len()..after.len()).step_by(97));
    let intent = after.windows(9).rposition(|text| text == b"\"replaces").unwrap();
    for cut in cuts {
        let intents = String::from_utf8_lossy(&after[before.len()..cut]).matches("\"stamp\":null").count();
        for out in [&old_out, &new_out] {
            // The new file can exist only if the journal says that it may.
            if intents == 0 && out == &new_out {
                continue;
            }
            std::fs::write(first.path(".specula/journal"), &after[..cut]).unwrap();
            for (name, content) in out {
                std::fs::write(first.path("out").join(name), content).unwrap();
            }
            first.write("out/file/.specula-1-1.tmp", "half");
            let log = first.build();
            assert!(log.contains("0 failed, 0 skipped"), "cut at {cut} of {intent}: {log}");
            assert_eq!(first.read("out/file/a.txt"), "THREE");
            first.write("a.txt", "four");
            first.build();
            assert_eq!(first.read("out/file/a.txt"), "FOUR");
            first.write("a.txt", "three");
        }
    }
}

#[test]
fn temporary_files_of_a_killed_build_are_swept() {
    let project = chain();
    project.build();
    let journal = project.read(".specula/journal");
    // Without its last line, the journal says that a build is still publishing.
    let end = journal.trim_end().rfind('\n').unwrap() + 1;
    assert!(journal[end + 16..].starts_with(" o "));
    project.write(".specula/journal", &journal[..end]);
    project.write("out/file/.specula-1-1.tmp", "half");
    project.write(".specula/tmp/1-1", "half");
    project.build();
    assert!(!project.exists("out/file/.specula-1-1.tmp") && !project.exists(".specula/tmp/1-1"));
    assert_eq!(project.files("out").len(), 2);
    // A copy of the project sweeps its own folder, not the one that it was copied from.
    let copy = chain();
    copy.build();
    copy.write(".specula/journal", &journal[..end]);
    for project in [&project, &copy] {
        project.write("out/file/.specula-1-1.tmp", "half");
    }
    copy.build();
    assert!(project.exists("out/file/.specula-1-1.tmp") && !copy.exists("out/file/.specula-1-1.tmp"));
}

/// The process that [`a_killed_process_loses_nothing`] kills: it builds the project that the variable names.
#[test]
fn victim() {
    let Some(folder) = std::env::var_os("SPECULA_TEST_VICTIM") else { return };
    let plan = Plan::load(&Path::new(&folder).join("pipeline.toml"), &kinds()).unwrap();
    let options = BuildOptions { keep_going: true, jobs: Some(2), ..BuildOptions::default() };
    crate::build::build(&plan, &options, &Cancel::default(), &|_| {}).unwrap();
}

#[test]
fn a_killed_process_loses_nothing() {
    let project = chain();
    for n in 0..60 {
        project.write(&format!("{n:02}.txt"), &format!("text {n}"));
    }
    let shown = |text: &str| text.to_uppercase();
    let mut killed = 0;
    for round in 0..24_u64 {
        for n in 0..60 {
            project.write(&format!("{n:02}.txt"), &format!("text {n} of round {round}"));
        }
        let mut child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "tests::interruptions::victim", "--test-threads=1"])
            .env("SPECULA_TEST_VICTIM", project.path(""))
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(5 + round * 7919 % 120));
        killed += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        // Every file is complete: of this round, or of the last one that was built to its end.
        for n in 0..60 {
            if let Ok(text) = std::fs::read_to_string(project.path(&format!("out/file/{n:02}.txt"))) {
                let whole = (0..=round).any(|round| text == shown(&format!("text {n} of round {round}")));
                assert!(whole, "round {round}: {text:?}");
            }
        }
        if round % 4 == 3 {
            let log = project.build();
            assert!(log.contains(" 0 failed, 0 skipped"), "round {round}: {log}");
            assert!(!log.contains("warning"), "round {round}: {log}");
            for n in 0..60 {
                let text = shown(&format!("text {n} of round {round}"));
                assert_eq!(project.read(&format!("out/file/{n:02}.txt")), text);
            }
            assert_eq!(project.files("out").len(), 62, "no temporary file is left");
            assert_eq!(std::fs::read_dir(project.path(".specula/tmp")).unwrap().count(), 0);
        }
    }
    assert!(killed >= 12, "only {killed} of 24 processes were killed at work");
}
