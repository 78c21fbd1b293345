//! What happens when something fails.

use expect_test::expect;

use super::*;
use crate::error::ErrorKind;

const REFUSING: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
checked = { kind = "refuse", input = "text" }
loud = { kind = "upper", input = "checked" }
file = { kind = "write", input = "loud" }
"#;

fn refusing() -> Project {
    let project = Project::new(REFUSING);
    project.write("a.txt", "bad");
    project.write("b.txt", "good");
    project
}

#[test]
fn other_items_run_and_dependants_are_skipped_with_the_failed_item() {
    let project = refusing();
    expect![[r#"
        planned 4 stages, 8 items
        run text [a]: never built
        ran text [a]
        run checked [a]: never built
        FAILED checked [a]: the text holds "bad" (take it out)
        skipped loud [a] because of checked [a]
        skipped file [a] because of checked [a]
        run text [b]: never built
        ran text [b]
        run checked [b]: never built
        ran checked [b]
        run loud [b]: never built
        ran loud [b]
        run file [b]: never built
        ran file [b]
        published file/b.txt 4
        ended: 5 ran, 0 up to date, 1 failed, 2 skipped, 1 published, 0 removed
    "#]]
    .assert_eq(&project.build());
    let checked = &project.explain("checked")[0];
    assert!(checked.would_run);
    assert_eq!(checked.reasons, [Reason::FailedBefore]);
    assert_eq!(checked.last.as_ref().unwrap().failure.as_ref().unwrap()[0], "the text holds \"bad\"");
}

#[test]
fn a_failure_is_not_cached_and_the_last_good_file_stays() {
    let project = refusing();
    project.write("a.txt", "fine");
    project.build();
    project.write("a.txt", "bad");
    for reasons in ["text text [a] some -> some", "failed before"] {
        assert_has(project.build(), [&format!("run checked [a]: {reasons}\nFAILED checked [a]")]);
        assert_eq!(project.read("out/file/a.txt"), "FINE");
    }
    project.write("a.txt", "fine");
    assert!(project.build().contains("0 ran, 8 up to date, 0 failed"));
    // The failure disappears with its cause.
    project.write("a.txt", "finer");
    assert!(project.build().contains("run checked [a]: text text [a] some -> some\nran checked [a]\n"));
}

#[test]
fn fail_fast_skips_items_that_have_not_started() {
    let mut project = refusing();
    project.options.keep_going = false;
    expect![[r#"
        planned 4 stages, 8 items
        run text [a]: never built
        ran text [a]
        run checked [a]: never built
        FAILED checked [a]: the text holds "bad" (take it out)
        skipped text [b]
        skipped checked [b]
        skipped loud [a] because of checked [a]
        skipped loud [b]
        skipped file [a] because of checked [a]
        skipped file [b]
        ended: 1 ran, 0 up to date, 1 failed, 6 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&project.build());
}

struct Careless;

impl TextKind for Careless {
    type Parameters = Nothing;
    const NAME: &'static str = "upper";

    fn make(_: &Nothing, text: &str, _: &Context<'_>) -> Result<String, Failure> {
        assert!(text.len() < 5, "{text} is too long");
        Ok(text.into())
    }
}

#[test]
fn a_panic_is_the_failure_of_its_item() {
    let mut project = refusing();
    project.write("a.txt", "longer");
    project.kinds = replacing(Careless);
    let log = project.build();
    assert_has(&log, ["FAILED loud [a]: a bug in kind upper: panicked: longer is too long"]);
    assert!(
        log.ends_with("ended: 6 ran, 0 up to date, 1 failed, 1 skipped, 1 published, 0 removed\n"),
        "{log}"
    );
}

#[test]
fn a_lost_result_is_made_again() {
    let project = refusing();
    project.write("a.txt", "fine");
    project.remove("b.txt");
    project.build();
    std::fs::remove_file(project.blob("FINE")).unwrap();
    let log = project.build();
    // The artifact of `loud` and the file of `file` have the same bytes: one blob.
    assert_has(&log, ["run loud [a]: result lost\nran loud [a], the same result\nup to date file [a]\n"]);
    assert!(project.build().contains("0 ran, 4 up to date"));
}

#[test]
fn a_damaged_result_is_detected_when_it_is_read_and_made_again() {
    let mut project = refusing();
    project.write("a.txt", "fine");
    project.write("b.txt", "good");
    project.build();
    // Of the same size, so that only reading it shows the damage.
    std::fs::write(project.blob("fine"), "fi!e").unwrap();
    assert!(project.build().contains("0 ran, 8 up to date"));
    // `text` and `checked` share the blob; a new `loud` has to read it.
    project.edit(
        "kind = \"upper\", input = \"checked\"",
        "kind = \"suffix\", input = \"checked\", text = \"!\"",
    );
    project.options.stages = vec!["loud".into()];
    std::fs::write(project.blob("fine"), "fi!e").unwrap();
    expect![[r#"
        planned 3 stages, 6 items
        up to date text [a]
        up to date text [b]
        up to date checked [a]
        up to date checked [b]
        run loud [b]: kind upper 1 -> suffix 1; place null -> "after"; text null -> "!"; times null -> 1
        ran loud [b]
        run text [a]: result lost
        ran text [a], the same result
        run checked [a]: result lost
        ran checked [a], the same result
        run loud [a]: kind upper 1 -> suffix 1; place null -> "after"; text null -> "!"; times null -> 1
        ran loud [a]
        ended: 4 ran, 2 up to date, 0 failed, 0 skipped, 0 published, 0 removed
    "#]]
    .assert_eq(&project.build());
}

#[test]
fn after_any_loss_or_damage_the_next_build_is_correct() {
    let diamonds = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
loud = { kind = "upper", input = "text" }
marked = { kind = "suffix", input = "text", text = "!" }
both = { kind = "concat", inputs = { left = "loud", right = "marked" } }
all = { kind = "collect", inputs = { texts = "both" } }
file = { kind = "write", input = "both" }
sheet = { kind = "write", input = "all" }
pair = { kind = "write-pair", input = "marked" }
"#;
    let mut project = Project::new(diamonds);
    for n in 0..5 {
        project.write(&format!("{n}.txt"), &format!("text {n}"));
    }
    project.build();
    let out = project.files("out");
    let mut seed = 1_u32;
    let mut chance = |of: u32| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 16).is_multiple_of(of)
    };
    for round in 0..60 {
        for (name, bytes) in project.files(".specula/blobs") {
            let path = project.path(&format!(".specula/blobs/{name}"));
            if chance(4) {
                std::fs::write(path, vec![b'x'; bytes.len()]).unwrap();
            } else if chance(5) {
                std::fs::remove_file(path).unwrap();
            }
        }
        for (name, _) in &out {
            if chance(3) {
                project.remove(&format!("out/{name}"));
            }
        }
        project.options.jobs = Some(1 + round % 3);
        let log = project.build();
        assert!(log.contains(" 0 failed, 0 skipped, "), "round {round}: {log}");
        assert_eq!(project.files("out"), out, "round {round}: {log}");
    }
}

#[test]
fn a_damaged_journal_costs_reruns_and_no_files() {
    let project = refusing();
    project.write("a.txt", "fine");
    project.build();
    let journal = std::fs::read(project.path(".specula/journal")).unwrap();
    let out = project.files("out");
    for damage in [journal[..journal.len() / 2].to_vec(), vec![0; 1000], Vec::new()] {
        std::fs::write(project.path(".specula/journal"), damage).unwrap();
        assert_has(project.build(), ["0 failed, 0 skipped, 0 published, 0 removed"]);
        assert_eq!(project.files("out"), out);
        assert!(project.build().contains("0 ran, 8 up to date"));
    }
}

#[test]
fn a_newer_state_folder_is_left_alone() {
    let project = refusing();
    project.build();
    project.write(".specula/journal", "specula journal 99\nwhatever that means");
    let before = project.files(".specula");
    let error = project.try_build().1.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NewerState);
    assert!(error.help().unwrap().contains("delete"));
    assert_eq!(crate::answers::explain(&project.plan(), "text").unwrap_err().kind(), ErrorKind::NewerState);
    assert_eq!(project.files(".specula"), before);
}

#[test]
fn errors_of_the_system_are_distinguished() {
    use std::io::{Error as Io, ErrorKind as Kind};
    for (kind, expected) in [
        (Kind::StorageFull, ErrorKind::DiskFull),
        (Kind::QuotaExceeded, ErrorKind::DiskFull),
        (Kind::ReadOnlyFilesystem, ErrorKind::ReadOnly),
        (Kind::PermissionDenied, ErrorKind::ReadOnly),
        (Kind::NotFound, ErrorKind::Io),
    ] {
        let error = Error::io(&Io::from(kind), "write", Path::new("out/a.exr"));
        assert_eq!(error.kind(), expected);
        assert!(test_data::unix_paths(error.to_string()).starts_with("cannot write out/a.exr: "));
        assert_eq!(error.help().is_some(), expected != ErrorKind::Io);
    }
}

/// The number of failed items, and of those that failed because of the system.
fn failed(project: &Project) -> (usize, usize) {
    let summary = project.try_build().1.unwrap();
    (summary.failed, summary.system_errors)
}

#[cfg(unix)]
#[test]
fn a_file_that_the_system_refuses_counts_as_an_error_of_the_system() {
    let project = refusing();
    assert_eq!(failed(&project), (1, 0));
    // No system takes a path of this length.
    let long = format!(", path = \"{}{{text}}\"", "a-long-name/".repeat(1000));
    project.edit("input = \"loud\"", &format!("input = \"loud\"{long}"));
    assert_eq!(failed(&project), (2, 1));
    project.write("a.txt", "fine");
    assert_eq!(failed(&project), (2, 2));
    project.edit(&long, "");
    assert_eq!(failed(&project), (0, 0));
}

#[test]
fn a_result_that_cannot_be_stored_is_counted_as_an_error_of_the_system() {
    let project = refusing();
    (0..256).for_each(|n| project.write(&format!(".specula/blobs/{n:02x}"), "not a folder"));
    assert_eq!(failed(&project), (2, 2));
    project.remove(".specula/blobs");
    assert_eq!(failed(&project), (1, 0));
}

#[test]
fn an_unpublished_file_in_the_way_is_not_an_error_of_the_system() {
    let project = refusing();
    project.write("out/file/b.txt", "mine");
    assert_eq!(failed(&project), (2, 0));
}

/// Fails to create its scratch folder.
struct Homeless;

impl TextKind for Homeless {
    type Parameters = Nothing;
    const NAME: &'static str = "upper";

    fn make(_: &Nothing, _: &str, _: &Context<'_>) -> Result<String, Failure> {
        let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
        Err(Failure::from(full).context("cannot make a scratch folder").system_error())
    }
}

#[test]
fn a_kind_can_report_an_error_of_the_system() {
    let mut project = refusing();
    project.kinds = replacing(Homeless);
    assert_eq!(failed(&project), (2, 1));
}

/// Root may write anywhere: if the test runs as root, there is nothing to check.
#[cfg(unix)]
fn is_enforced(folder: &Path) -> bool {
    let probe = folder.join("probe");
    let enforced = std::fs::write(&probe, "").is_err();
    let _ = std::fs::remove_file(probe);
    enforced
}

#[cfg(unix)]
fn set_mode(folder: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(folder, std::fs::Permissions::from_mode(mode)).unwrap();
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_is_named() {
    let project = refusing();
    project.write("a.txt", "fine");
    project.build();
    let out = project.path("out/file");
    set_mode(&out, 0o555);
    if !is_enforced(&out) {
        eprintln!("SKIPPED a_read_only_folder_is_named: this user may write anywhere");
        set_mode(&out, 0o755);
        return;
    }
    project.write("a.txt", "other");
    let log = project.build();
    set_mode(&out, 0o755);
    assert_has(&log, ["FAILED file [a]: cannot write", "make the folder writable"]);
    assert_eq!(project.read("out/file/a.txt"), "FINE");
    assert_eq!(project.files("out").len(), 2);
    assert!(project.build().contains("published file/a.txt"));
    set_mode(&project.path(".specula"), 0o555);
    project.remove(".specula/lock");
    let error = project.try_build().1;
    set_mode(&project.path(".specula"), 0o755);
    assert_eq!(error.unwrap_err().kind(), ErrorKind::ReadOnly);
}

/// Each of these once hung, or filled the memory.
#[cfg(unix)]
#[test]
fn a_pipe_or_an_endless_file_beside_a_source_is_an_error() {
    let project =
        Project::new("schema = 1\n[stage]\ntext = { kind = \"text-source\", source = \"a.txt\" }\n");
    assert!(std::process::Command::new("mkfifo").arg(project.path("pipe")).status().unwrap().success());
    let sparse = std::fs::File::create(project.path("sparse")).unwrap();
    sparse.set_len((8 << 30) + 1).unwrap();
    for (name, expected) in [
        ("pipe", "it is a pipe, not a file"),
        ("/dev/zero", "it is a device, not a file"),
        ("sparse", "it has 8589934593 bytes, but at most 8 GiB are read"),
    ] {
        project.write("a.txt", &format!("include {name}\n"));
        assert_has(project.build(), ["FAILED text [a]: source a.txt: cannot read ", expected]);
    }
}

#[test]
fn an_item_that_reads_a_file_in_out_fails_and_says_why() {
    let project = refusing();
    project.write("a.txt", "include out/x.txt\n");
    project.write("out/x.txt", "exported");
    assert_has(project.build(), ["FAILED text [a]", "is inside \"out\", the folder for exports"]);
    project.write("more/x.txt", "moved");
    project.write("a.txt", "include more/x.txt\n");
    assert!(project.build().contains("0 failed"));
}
