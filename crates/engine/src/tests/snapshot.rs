//! What the last build left, read without a build.

use std::sync::Arc;

use super::*;
use crate::answers::ResultsSnapshot;
use crate::error::ErrorKind;

const MANIFEST: &str = r#"
schema = 1
[stage]
paint = { kind = "text-source", source = "paint/*.txt" }
sound = { kind = "refuse", input = "paint" }
file = { kind = "write-pair", input = "sound" }
"#;

fn project() -> Project {
    let project = Project::new(MANIFEST);
    project.write("paint/gold.txt", "gold");
    project.write("paint/tin.txt", "tin");
    project
}

/// Each item with its result in the snapshot.
fn contents(project: &Project) -> String {
    let plan = project.plan();
    let snapshot = ResultsSnapshot::open(&plan).unwrap();
    let mut text = String::new();
    for (index, item) in plan.items.iter().enumerate() {
        let _ = write!(text, "{} [{}]:", plan.stages[item.stage].name, item.key);
        let _ = match snapshot.get(index) {
            Some(handle) => match handle.get::<Text>() {
                Ok(value) => writeln!(text, " {} {:?}", handle.type_name(), value.0),
                Err(failure) => {
                    writeln!(text, " {}", failure.chain[0].replace(&handle.digest().to_string(), "..."))
                }
            },
            None => writeln!(text, " {:?}", snapshot.file_sizes(index)),
        };
    }
    text
}

#[test]
fn built_items_are_in_the_snapshot_and_others_are_not() {
    let mut project = project();
    let nothing = "paint [gold]: []\npaint [tin]: []\nsound [gold]: []\nsound [tin]: []\nfile [gold]: []\nfile [tin]: []\n";
    assert_eq!(contents(&project), nothing);
    assert!(!project.exists(".specula"), "a look leaves no trace");
    project.options.stages = vec!["sound".into()];
    project.build();
    let sound = "paint [gold]: text \"gold\"\npaint [tin]: text \"tin\"\nsound [gold]: text \"gold\"\nsound [tin]: text \"tin\"\n";
    assert_eq!(contents(&project), format!("{sound}file [gold]: []\nfile [tin]: []\n"));
    project.options.stages = Vec::new();
    project.build();
    assert_eq!(contents(&project), format!("{sound}file [gold]: [4, 1]\nfile [tin]: [3, 1]\n"));
}

#[test]
fn an_exported_file_is_read_from_the_cache() {
    let project = project();
    assert_eq!(ResultsSnapshot::open(&project.plan()).unwrap().file_digest(4, 0), None);
    project.build();
    let (plan, snapshot) = (project.plan(), ResultsSnapshot::open(&project.plan()).unwrap());
    for (item, expected) in [(4, "gold"), (5, "tin")] {
        let published = plan.items[item].files[0].clone();
        std::fs::remove_file(project.path("out").join(&published)).unwrap();
        let digest = snapshot.file_digest(item, 0).unwrap();
        assert_eq!(snapshot.read_file(digest).unwrap(), expected.as_bytes(), "{published:?}");
        assert_eq!(snapshot.file_digest(item, 2), None);
    }
    assert_eq!(snapshot.file_digest(0, 0), None, "an artifact is not a file");
    let failure = snapshot.read_file(crate::Digest::of(b"nothing")).unwrap_err();
    assert!(failure.chain[0].starts_with("the stored file "), "{failure:?}");
}

#[test]
fn an_item_that_failed_shows_its_last_good_result() {
    let project = project();
    project.build();
    project.write("paint/gold.txt", "bad gold");
    project.write("paint/tin.txt", "new tin");
    project.write("paint/lead.txt", "bad lead");
    project.build();
    let contents = contents(&project);
    assert_has(
        &contents,
        [
            "paint [gold]: text \"bad gold\"\n",
            "sound [gold]: text \"gold\"\n",
            "sound [tin]: text \"new tin\"\n",
        ],
    );
    assert!(contents.contains("sound [lead]: []\n"), "it never made anything: {contents}");
    assert_has(&contents, ["file [gold]: [4, 1]\n"]);
}

#[test]
fn a_result_restored_from_the_cache_is_the_latest() {
    let project = project();
    project.build();
    project.write("paint/gold.txt", "brass");
    project.build();
    project.write("paint/gold.txt", "gold");
    assert!(contents(&project).contains("sound [gold]: text \"brass\"\n"), "nothing is checked");
    assert!(project.build().contains("0 ran"));
    assert!(contents(&project).contains("sound [gold]: text \"gold\"\n"));
}

#[test]
fn a_lost_result_is_absent_and_a_damaged_one_fails_until_the_next_build() {
    let project = project();
    project.build();
    std::fs::remove_file(project.blob("gold")).unwrap();
    std::fs::write(project.blob("tin"), "tan").unwrap();
    let contents = contents(&project);
    assert_has(&contents, ["sound [gold]: []\n", "sound [tin]: the stored artifact ... is damaged\n"]);
    assert_eq!(std::fs::read(project.blob("tin")).unwrap(), b"tan");
}

#[test]
fn a_stage_with_another_kind_has_no_result() {
    let project = project();
    project.build();
    project.edit("kind = \"refuse\"", "kind = \"count\"");
    project.edit("kind = \"write-pair\"", "kind = \"write\"");
    assert_has(contents(&project), ["sound [gold]: []\n", "file [gold]: []\n"]);
}

#[test]
fn it_can_be_read_while_a_build_holds_the_lock_and_each_handle_is_decoded_once() {
    let project = project();
    project.build();
    let plan = project.plan();
    let (purpose, timeout) = (crate::LockPurpose::Build, crate::LockTimeout::NONE);
    let request =
        crate::storage::LockRequest { purpose, timeout, cancel: &Cancel::default(), waiting: &|_| {} };
    let _lock = crate::storage::State::lock(&plan.state, &request).unwrap();
    let snapshot = ResultsSnapshot::open(&plan).unwrap();
    let value = |item| snapshot.get(item).unwrap().get::<Text>().unwrap();
    assert!(Arc::ptr_eq(&value(0), &value(0)));
    // A decoded value outlives its blob.
    std::fs::remove_file(project.blob("gold")).unwrap();
    assert_eq!(value(0).0, "gold");
    assert!(snapshot.get(plan.items.len()).is_none());
}

#[test]
fn a_state_folder_of_a_newer_version_is_an_error() {
    let project = project();
    project.build();
    project.write(".specula/journal", "specula journal 999\n");
    assert_eq!(ResultsSnapshot::open(&project.plan()).err().unwrap().kind(), ErrorKind::NewerState);
}
