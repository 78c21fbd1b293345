//! What editors and exporters do to save a file.

use std::fs::{self, File};
use std::io::Write as _;
use std::time::{Duration, SystemTime};

use super::*;

const BEFORE: [(&str, &str); 2] = [("gold.txt", "WARM"), ("sky.txt", "BLUE")];
const AFTER: [(&str, &str); 2] = [("gold.txt", "WARM"), ("sky.txt", "GREY")];

/// Saves `sky` in some way, and checks that its output is updated, that the other item did not run, and that
/// no other change was reported.
fn saved(way: Way, save: impl Fn(&Project)) {
    let project = capitals();
    let watched = Watched::new(&project, way);
    watched.until_out(&BEFORE);
    save(&project);
    watched.until_out(&AFTER);
    let events = watched.events();
    assert!(changes(&events).all(|(path, _)| path == "in/sky.txt"), "{}", log(&events));
    let gold =
        |event: &&Event| matches!(event, Event::Started { item, .. } if item.to_string().contains("gold"));
    assert_eq!(events.iter().filter(gold).count(), 3, "{}", log(&events));
}

each_way! {
    fn a_file_written_in_place(way: Way) {
        saved(way, |project| project.write("in/sky.txt", "grey"));
    }

    fn a_file_truncated_and_then_written_slowly(way: Way) {
        saved(way, |project| {
            let mut file = File::create(project.path("in/sky.txt")).unwrap();
            for letter in "grey".chars() {
                std::thread::sleep(Duration::from_millis(60));
                write!(file, "{letter}").unwrap();
            }
        });
    }

    fn a_temporary_file_renamed_over(way: Way) {
        saved(way, |project| {
            project.write("in/.sky.txt.new", "grey");
            project.rename("in/.sky.txt.new", "in/sky.txt");
        });
    }

    fn a_file_renamed_away_for_a_backup_and_written_anew(way: Way) {
        saved(way, |project| {
            project.rename("in/sky.txt", "in/sky.txt~");
            project.write("in/sky.txt", "grey");
            project.remove("in/sky.txt~");
        });
    }

    fn a_file_deleted_and_created(way: Way) {
        saved(way, |project| {
            project.remove("in/sky.txt");
            project.write("in/sky.txt", "grey");
        });
    }

    fn a_file_deleted_and_created_later(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        project.remove("in/sky.txt");
        watched.until_out(&BEFORE[..1]);
        project.write("in/sky.txt", "grey");
        watched.until_out(&AFTER);
        assert!(watched.noticed().iter().all(|(path, _)| path == "in/sky.txt"), "{:?}", watched.noticed());
    }

    fn a_file_saved_twice_within_ten_milliseconds(way: Way) {
        saved(way, |project| {
            project.write("in/sky.txt", "gray");
            project.write("in/sky.txt", "grey");
        });
    }

    fn a_file_saved_again_and_again(way: Way) {
        saved(way, |project| {
            for number in 0..100 {
                project.write("in/sky.txt", &number.to_string());
                std::thread::sleep(Duration::from_millis(3));
            }
            project.write("in/sky.txt", "grey");
        });
    }

    fn a_file_restored_with_its_old_time(way: Way) {
        saved(way, |project| {
            let time = fs::metadata(project.path("in/sky.txt")).unwrap().modified().unwrap();
            project.write("in/sky.txt", "grey");
            set_modified(project, "in/sky.txt", time);
        });
    }

    fn a_file_from_the_past_put_in_its_place(way: Way) {
        saved(way, |project| {
            project.write("in/.old", "grey");
            set_modified(project, "in/.old", SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000));
            project.rename("in/.old", "in/sky.txt");
        });
    }

    fn swap_and_backup_files_are_ignored(way: Way) {
        saved(way, |project| {
            for name in [".sky.txt.swp", "4913", "sky.txt~", "#sky.txt#", "sky.txt.bak", "sky.part", ".#sky.txt"] {
                project.write(&format!("in/{name}"), "ignored");
                std::thread::sleep(QUIET * 2);
            }
            project.remove("in/4913");
            project.write("in/sky.txt", "grey");
        });
    }

    fn a_touch_without_change_runs_nothing(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        set_modified(&project, "in/sky.txt", SystemTime::now());
        watched.until("a build that finds nothing to do", |events| summaries(events).nth(1).is_some());
        save(&project, "in/sky.txt", "grey");
        watched.until_out(&AFTER);
        let ran = summaries(&watched.events()).map(|summary| summary.ran).collect::<Vec<_>>();
        assert_eq!((ran[0], ran[1]), (6, 0), "{}", log(&watched.events()));
        assert_eq!(ran.iter().sum::<usize>(), 9, "{}", log(&watched.events()));
    }

    fn an_edit_that_is_undone_runs_nothing_twice(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        save(&project, "in/sky.txt", "grey");
        watched.until_out(&AFTER);
        save(&project, "in/sky.txt", "blue");
        watched.until_out(&BEFORE);
        assert_eq!(summaries(&watched.events()).map(|summary| summary.ran).sum::<usize>(), 9);
    }

    fn new_files_give_new_outputs_and_outputs_of_removed_files_are_removed(way: Way) {
        let project = capitals();
        let watched = Watched::new(&project, way);
        project.write("in/rain.txt", "wet");
        watched.until_out(&[BEFORE[0], ("rain.txt", "WET"), BEFORE[1]]);
        project.remove("in/sky.txt");
        watched.until_out(&[BEFORE[0], ("rain.txt", "WET")]);
        project.rename("in/rain.txt", "in/snow.txt");
        watched.until_out(&[BEFORE[0], ("snow.txt", "WET")]);
        let names = ["in/rain.txt", "in/sky.txt", "in/snow.txt"];
        assert!(watched.noticed().iter().all(|(path, _)| names.contains(&path.as_str())), "{:?}", watched.noticed());
    }

    fn a_checkout_that_changes_two_hundred_files(way: Way) {
        let project = Project::new(CAPITALS);
        let write = |text: &str| (0..200).for_each(|n| project.write(&format!("in/{n:03}.txt"), &format!("{text} {n}")));
        write("one");
        let watched = Watched::new(&project, way);
        write("two");
        project.remove("in/199.txt");
        let names = (0..199).map(|n| (format!("{n:03}.txt"), format!("TWO {n}"))).collect::<Vec<_>>();
        watched.until_out(&names.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect::<Vec<_>>());
    }
}

/// The use of `O_TMPFILE`: a file that has no name until it is complete.
#[cfg(target_os = "linux")]
#[test]
fn a_file_without_a_name_that_is_linked() {
    use std::os::fd::AsRawFd as _;
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    let mut file = tempfile::tempfile_in(project.path("in")).unwrap();
    file.write_all(b"wet").unwrap();
    let link = format!("/proc/{}/fd/{}", std::process::id(), file.as_raw_fd());
    let linked =
        std::process::Command::new("ln").arg("-L").arg(link).arg(project.path("in/rain.txt")).status();
    assert!(linked.unwrap().success());
    watched.until_out(&[BEFORE[0], ("rain.txt", "WET"), BEFORE[1]]);
    assert!(watched.noticed().iter().all(|(path, _)| path == "in/rain.txt"), "{:?}", watched.noticed());
}
