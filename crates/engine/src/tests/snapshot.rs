//! What the last build left, read without a build.

use std::sync::Arc;

use super::*;
use crate::testkit::Text;
use crate::{ErrorKind, ResultsSnapshot};

const MANIFEST: &str = r#"
schema = 1
out = "out"

[stage.paint]
kind = "text-source"
source = "paint/*.txt"

[stage.sound]
kind = "refuse"
input = "paint"

[stage.file]
kind = "write-pair"
input = "sound"
"#;

fn project() -> Project {
    let project = Project::new(MANIFEST);
    project.write("paint/gold.txt", "gold");
    project.write("paint/tin.txt", "tin");
    project
}

/// Each item with what the shelf has of it.
fn told(project: &Project) -> String {
    let plan = project.plan();
    let shelf = ResultsSnapshot::open(&plan).unwrap();
    let mut text = String::new();
    for (index, item) in plan.items.iter().enumerate() {
        let _ = write!(text, "{} [{}]:", plan.stages[item.stage].name, item.key);
        let _ = match shelf.get(index) {
            Some(handle) => match handle.get::<Text>() {
                Ok(value) => writeln!(text, " {} {:?}", handle.type_name(), value.0),
                Err(failure) => {
                    writeln!(text, " {}", failure.chain[0].replace(&handle.digest().to_string(), "..."))
                }
            },
            None => writeln!(text, " {:?}", shelf.file_sizes(index)),
        };
    }
    text
}

#[test]
fn what_was_built_is_there_and_what_was_not_is_not() {
    let mut project = project();
    let nothing = "paint [gold]: []\npaint [tin]: []\nsound [gold]: []\nsound [tin]: []\nfile [gold]: []\nfile [tin]: []\n";
    assert_eq!(told(&project), nothing);
    assert!(!project.exists(".specula"), "a look leaves no trace");
    project.options.stages = vec!["sound".into()];
    project.build();
    let sound = "paint [gold]: text \"gold\"\npaint [tin]: text \"tin\"\nsound [gold]: text \"gold\"\nsound [tin]: text \"tin\"\n";
    assert_eq!(told(&project), format!("{sound}file [gold]: []\nfile [tin]: []\n"));
    project.options.stages = Vec::new();
    project.build();
    assert_eq!(told(&project), format!("{sound}file [gold]: [4, 1]\nfile [tin]: [3, 1]\n"));
}

#[test]
fn an_item_that_failed_shows_its_last_good_result() {
    let project = project();
    project.build();
    project.write("paint/gold.txt", "bad gold");
    project.write("paint/tin.txt", "new tin");
    project.write("paint/lead.txt", "bad lead");
    project.build();
    let told = told(&project);
    assert!(told.contains("paint [gold]: text \"bad gold\"\n"), "{told}");
    assert!(told.contains("sound [gold]: text \"gold\"\n"), "{told}");
    assert!(told.contains("sound [tin]: text \"new tin\"\n"), "{told}");
    assert!(told.contains("sound [lead]: []\n"), "it never made anything: {told}");
    assert!(told.contains("file [gold]: [4, 1]\n"), "{told}");
}

#[test]
fn a_result_taken_from_the_cache_again_is_the_one_in_effect() {
    let project = project();
    project.build();
    project.write("paint/gold.txt", "brass");
    project.build();
    project.write("paint/gold.txt", "gold");
    assert!(told(&project).contains("sound [gold]: text \"brass\"\n"), "nothing is judged");
    assert!(project.build().contains("0 ran"));
    assert!(told(&project).contains("sound [gold]: text \"gold\"\n"));
}

#[test]
fn a_lost_result_is_absent_and_a_damaged_one_fails_and_stays_for_the_next_build() {
    let project = project();
    project.build();
    std::fs::remove_file(project.blob("gold")).unwrap();
    std::fs::write(project.blob("tin"), "tan").unwrap();
    let told = told(&project);
    assert!(told.contains("sound [gold]: []\n"), "{told}");
    assert!(told.contains("sound [tin]: the stored artifact ... is damaged\n"), "{told}");
    assert_eq!(std::fs::read(project.blob("tin")).unwrap(), b"tan");
}

#[test]
fn a_stage_that_became_another_kind_shows_nothing_of_before() {
    let project = project();
    project.build();
    project.edit("kind = \"refuse\"", "kind = \"count\"");
    project.edit("kind = \"write-pair\"", "kind = \"write\"");
    let told = told(&project);
    assert!(told.contains("sound [gold]: []\n") && told.contains("file [gold]: []\n"), "{told}");
}

#[test]
fn it_is_read_while_a_build_holds_the_lock_and_each_handle_is_decoded_once() {
    let project = project();
    project.build();
    let plan = project.plan();
    let (errand, patience) = (crate::LockPurpose::Build, crate::LockTimeout::NONE);
    let request = crate::lock::Request { errand, patience, cancel: &Cancel::default(), waiting: &|_| {} };
    let _lock = crate::state::State::lock(&plan.state, &request).unwrap();
    let shelf = ResultsSnapshot::open(&plan).unwrap();
    let value = |item| shelf.get(item).unwrap().get::<Text>().unwrap();
    assert!(Arc::ptr_eq(&value(0), &value(0)));
    // What was decoded outlives its blob.
    std::fs::remove_file(project.blob("gold")).unwrap();
    assert_eq!(value(0).0, "gold");
    assert!(shelf.get(plan.items.len()).is_none());
}

#[test]
fn a_state_folder_of_a_newer_version_is_an_error() {
    let project = project();
    project.build();
    project.write(".specula/journal", "specula journal 999\n");
    assert_eq!(ResultsSnapshot::open(&project.plan()).err().unwrap().kind(), ErrorKind::NewerState);
}
