//! Files that are written slowly: the watcher waits for them, but not for other files.

use std::fs::OpenOptions;
use std::io::Write as _;

use super::*;
use crate::watch::WritePauses;

/// Reads a text, which is complete if it ends with a full stop, and removes the full stop; `wait PATH` is
/// read after a file exists at that path.
pub(super) struct Sentence;

impl TextKind for Sentence {
    type Parameters = Nothing;
    const NAME: &'static str = "sentence";
    const SOURCE: bool = true;

    fn make(_: &Nothing, text: &str, _: &Context<'_>) -> Result<String, Failure> {
        if let Some(path) = text.strip_prefix("wait ") {
            let deadline = Instant::now() + DEADLINE;
            while !std::path::Path::new(path).exists() && Instant::now() < deadline {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        let sentence = text.strip_suffix('.').map(str::to_owned);
        sentence.ok_or_else(|| Failure::new(format!("{text:?} is half a sentence")))
    }
}

/// Longer than any test.
const FOR_EVER: Duration = Duration::from_secs(86_400);
/// A pause between two pieces, longer than the quiet time and the time between two polls.
const PAUSE: Duration = Duration::from_millis(60);
const LETTERS: &str = "abcdefghijklmnopqrstuvwx.";
const BEFORE: [(&str, &str); 2] = [("gold.txt", "WARM"), ("sky.txt", "BLUE")];
const AFTER: [(&str, &str); 2] = [("gold.txt", "WARM"), ("sky.txt", "ABCDEFGHIJKLMNOPQRSTUVWX")];

fn sentences() -> Project {
    let project = Project::new(&CAPITALS.replace("text-source", "sentence"));
    project.write("in/sky.txt", "blue.");
    project.write("in/gold.txt", "warm.");
    project
}

/// Pauses that show what the watcher waited for, however slow the machine is.
fn pauses() -> WritePauses {
    WritePauses {
        open: FOR_EVER,
        longest: FOR_EVER,
        failed: [Duration::from_secs(2), Duration::from_secs(8)],
        stable: FOR_EVER,
    }
}

/// Changes a file until six results of it were seen: a watcher that waited for a pause would wait for ever.
fn is_built_while(project: &Project, way: Way, change: impl Fn(usize)) {
    let watched = watched(project, way, WritePauses { failed: [FOR_EVER, FOR_EVER], ..pauses() });
    let (mut seen, deadline) = (std::collections::BTreeSet::new(), Instant::now() + DEADLINE);
    for number in 0.. {
        change(number);
        seen.insert(project.read("out/gold.txt"));
        if seen.len() == 6 {
            break;
        }
        assert!(Instant::now() < deadline, "{seen:?}; {}", log(&watched.events()));
    }
}

/// Watches, and waits until everything is built.
fn watched(project: &Project, way: Way, pauses: WritePauses) -> Watched<'_> {
    let options = way.options();
    let collector = ChangeCollector::new(options.debounce, options.poll, Duration::from_millis(25));
    let watched = Watched::with(project, options, collector.with_pauses(pauses));
    watched.until_watching();
    watched.until_out(&BEFORE);
    watched
}

fn failures(events: &[Event]) -> usize {
    events.iter().filter(|event| matches!(event, Event::Failed { .. })).count()
}

/// How often the text of `sky` was read without a failure.
#[cfg(target_os = "linux")]
fn made(events: &[Event]) -> usize {
    let is =
        |event: &&Event| matches!(event, Event::Finished { item, .. } if item.to_string() == "text [sky]");
    events.iter().filter(is).count()
}

/// Overwrites `sky` piece by piece, and closes it at the end.
fn write_slowly(project: &Project) {
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    for letter in LETTERS.chars() {
        std::thread::sleep(PAUSE);
        write!(file, "{letter}").unwrap();
    }
    std::thread::sleep(PAUSE);
}

#[cfg(target_os = "linux")]
#[test]
fn a_slow_copy_through_one_handle_is_built_once_and_never_fails() {
    let project = sentences();
    let watched = watched(&project, Way::Listening, pauses());
    write_slowly(&project);
    watched.until_out(&AFTER);
    let events = watched.events();
    assert_eq!((failures(&events), made(&events), changes(&events).count()), (0, 2, 1), "{}", log(&events));
}

#[cfg(target_os = "linux")]
#[test]
fn a_new_file_that_is_copied_slowly_is_built_once_and_never_fails() {
    let project = sentences();
    let watched = watched(&project, Way::Listening, pauses());
    project.remove("in/sky.txt");
    watched.until_out(&BEFORE[..1]);
    write_slowly(&project);
    watched.until_out(&AFTER);
    let events = watched.events();
    assert_eq!((failures(&events), made(&events), changes(&events).count()), (0, 2, 2), "{}", log(&events));
}

/// The open files of a writer on another machine cannot be seen.
#[cfg(not(target_os = "linux"))]
#[test]
fn without_close_events_a_slow_copy_fails_once() {
    let project = sentences();
    let watched = watched(&project, Way::Polling, pauses());
    write_slowly(&project);
    watched.until_out(&AFTER);
    // The first piece fails. Then the watcher waits for two seconds without a change, which come after the
    // last piece. If the machine stops for as long before that, another piece fails, and it waits for four
    // seconds.
    assert!(failures(&watched.events()) <= 3, "{}", log(&watched.events()));
}

#[cfg(target_os = "linux")]
#[test]
fn another_edit_does_not_wait_for_a_slow_copy_whose_failure_is_not_reported() {
    let project = sentences();
    let watched = watched(&project, Way::Listening, pauses());
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    write!(file, "gr").unwrap();
    save(&project, "in/gold.txt", "hot.");
    watched.until_out(&[("gold.txt", "HOT"), BEFORE[1]]);
    write!(file, "ey.").unwrap();
    drop(file);
    watched.until_out(&[("gold.txt", "HOT"), ("sky.txt", "GREY")]);
    let events = watched.events();
    assert_eq!((failures(&events), made(&events)), (0, 2), "{}", log(&events));
}

#[test]
fn opening_a_file_without_writing_is_not_a_change() {
    let project = sentences();
    let watched = watched(&project, Way::Listening, pauses());
    drop(OpenOptions::new().append(true).open(project.path("in/sky.txt")).unwrap());
    drop(OpenOptions::new().read(true).write(true).open(project.path("in/sky.txt")).unwrap());
    assert_eq!(project.read("in/sky.txt"), "blue.");
    // The events of a folder arrive in order.
    project.write("in/gold.txt", "hot.");
    watched.until_out(&[("gold.txt", "HOT"), BEFORE[1]]);
    assert_eq!(watched.noticed(), [("in/gold.txt".into(), Changed::Changed)]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_that_succeeds_after_a_failure_is_stable() {
    let project = sentences();
    let failed = [FOR_EVER, FOR_EVER];
    let watched = watched(&project, Way::Listening, WritePauses { failed, ..pauses() });
    project.write("in/sky.txt", "half");
    watched.until("the failure", |events| failures(events) == 1);
    // Complete at once, so that the watcher does not wait for it.
    save(&project, "in/sky.txt", "pink.");
    watched.until_out(&[BEFORE[0], ("sky.txt", "PINK")]);
    project.write("in/sky.txt", "grey.");
    watched.until_out(&[BEFORE[0], ("sky.txt", "GREY")]);
}

#[cfg(target_os = "linux")]
#[test]
fn the_watcher_does_not_wait_for_a_close_event_that_was_lost() {
    let project = sentences();
    let options = Way::Listening.options();
    let collector =
        ChangeCollector::new(options.debounce, None, Duration::from_secs(3600)).with_pauses(pauses());
    let system = collector.sender();
    let watched = Watched::with(&project, options, collector);
    watched.until_out(&BEFORE);
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    write!(file, "grey.").unwrap();
    // The event of the write may come after the first of them.
    for _ in 0..10 {
        system.send(crate::watch::WatchMessage::EventsLost).unwrap();
        std::thread::sleep(PAUSE);
    }
    watched.until_out(&[BEFORE[0], ("sky.txt", "GREY")]);
}

each_way! {
    fn a_slow_copy_through_many_handles_fails_once(way: Way) {
        let project = sentences();
        let watched = watched(&project, way, pauses());
        File::create(project.path("in/sky.txt")).unwrap();
        for letter in LETTERS.chars() {
            std::thread::sleep(PAUSE);
            let mut file = OpenOptions::new().append(true).open(project.path("in/sky.txt")).unwrap();
            write!(file, "{letter}").unwrap();
        }
        watched.until_out(&AFTER);
        // The first piece fails. Then the watcher waits for two seconds without a change, which come after
        // the last piece. If the machine stops for as long before that, another piece fails, and it waits for
        // four.
        assert!(failures(&watched.events()) <= 3, "{}", log(&watched.events()));
    }

    fn a_stable_file_that_is_replaced_again_and_again_is_built_meanwhile(way: Way) {
        let project = sentences();
        is_built_while(&project, way, |number| {
            save(&project, "in/gold.txt", &format!("{number}."));
            std::thread::sleep(Duration::from_millis(30));
        });
    }

    fn a_stable_file_that_is_saved_in_place_is_built_meanwhile(way: Way) {
        let project = capitals();
        is_built_while(&project, way, |number| {
            project.write("in/gold.txt", &number.to_string());
            std::thread::sleep(Duration::from_millis(3));
        });
    }

    fn a_failure_on_a_file_that_has_changed_since_is_not_reported(way: Way) {
        let project = sentences();
        let watched = watched(&project, way, pauses());
        save(&project, "in/sky.txt", &format!("wait {}", project.path("go").display()));
        watched.until("it is read", |events| {
            let starts = |event: &&Event| matches!(event, Event::Started { item, .. } if item.to_string() == "text [sky]");
            events.iter().filter(starts).count() == 2
        });
        // Usually it is read within this time; if it is not, nothing fails either.
        std::thread::sleep(QUIET);
        save(&project, "in/sky.txt", "grey.");
        project.write("go", "");
        watched.until_out(&[BEFORE[0], ("sky.txt", "GREY")]);
        assert_eq!(failures(&watched.events()), 0, "{}", log(&watched.events()));
    }

    fn a_manifest_that_is_written_in_pieces_is_rejected_once(way: Way) {
        let project = sentences();
        let watched = watched(&project, way, pauses());
        let text = format!("{CAPITALS}\n[stage.again]\nkind = \"write\"\ninput = \"text\"\n").replace("text-source", "sentence");
        project.write("pipeline.toml", "");
        for piece in text.as_bytes().chunks(20) {
            std::thread::sleep(PAUSE);
            let mut file = OpenOptions::new().append(true).open(project.path("pipeline.toml")).unwrap();
            file.write_all(piece).unwrap();
        }
        watched.until_out(&[BEFORE[0], BEFORE[1], ("again/gold.txt", "warm"), ("again/sky.txt", "blue")]);
        let rejected = |event: &&Event| matches!(event, Event::Rejected { .. });
        let rejected = watched.events().iter().filter(rejected).count();
        // As above.
        assert!(rejected <= 3, "{rejected} of {}", log(&watched.events()));
    }
}

/// A writer that pauses for much longer than the quiet time, with the file as long as it will be from the
/// start.
#[cfg(target_os = "linux")]
fn write_with_pauses(project: &Project, set_length: bool) {
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    if set_length {
        file.set_len(LETTERS.len() as u64).unwrap();
    }
    for piece in ["abcdefgh", "ijklmnop", "qrstuvwx."] {
        std::thread::sleep(Duration::from_millis(150));
        write!(file, "{piece}").unwrap();
    }
    std::thread::sleep(Duration::from_millis(150));
}

/// The pauses of a watcher that would build after 40 ms without a write.
#[cfg(target_os = "linux")]
fn impatient() -> WritePauses {
    WritePauses { open: Duration::from_millis(40), ..pauses() }
}

#[cfg(target_os = "linux")]
#[test]
fn a_writer_that_pauses_with_the_file_open_is_waited_for() {
    for (text, set_length) in [("sentence", false), ("text-source", true)] {
        let project = sentences();
        project.edit("sentence", text);
        if text == "text-source" {
            project.write("in/sky.txt", "blue");
            project.write("in/gold.txt", "warm");
        }
        let watched = watched(&project, Way::Listening, impatient());
        write_with_pauses(&project, set_length);
        let after = if set_length { "ABCDEFGHIJKLMNOPQRSTUVWX." } else { AFTER[1].1 };
        watched.until_out(&[BEFORE[0], ("sky.txt", after)]);
        let events = watched.events();
        assert_eq!(
            (failures(&events), made(&events), changes(&events).count()),
            (0, 2, 1),
            "{}",
            log(&events)
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_writer_that_pauses_on_a_drive_that_is_polled_is_waited_for() {
    let project = sentences();
    let watched = watched(&project, Way::Polling, impatient());
    write_with_pauses(&project, false);
    watched.until_out(&AFTER);
    assert_eq!(failures(&watched.events()), 0, "{}", log(&watched.events()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_writer_that_keeps_its_file_open_for_too_long_is_not_waited_for() {
    let project = sentences();
    let longest = Duration::from_millis(300);
    let watched = watched(&project, Way::Listening, WritePauses { longest, ..impatient() });
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    write!(file, "grey.").unwrap();
    watched.until_out(&[BEFORE[0], ("sky.txt", "GREY")]);
    drop(file);
}

/// Edits elsewhere, and the look at everything after them, make nothing of half a file.
#[cfg(target_os = "linux")]
#[test]
fn half_a_file_is_not_published_because_of_another_edit() {
    let project = sentences();
    project.edit("sentence", "text-source");
    project.write("in/sky.txt", "blue");
    project.write("in/gold.txt", "warm");
    let watched = watched(&project, Way::Listening, pauses());
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    write!(file, "gr").unwrap();
    save(&project, "in/gold.txt", "hot");
    watched.until_out(&[("gold.txt", "HOT"), BEFORE[1]]);
    std::thread::sleep(Duration::from_millis(1300));
    assert_eq!(texts(&project), [("gold.txt".into(), "HOT".to_owned()), ("sky.txt".into(), "BLUE".into())]);
    write!(file, "ey").unwrap();
    drop(file);
    watched.until_out(&[("gold.txt", "HOT"), ("sky.txt", "GREY")]);
    assert_eq!(made(&watched.events()), 2, "{}", log(&watched.events()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_that_was_being_written_before_the_watcher_began_is_waited_for() {
    let project = sentences();
    project.edit("sentence", "text-source");
    project.write("in/gold.txt", "warm");
    let mut file = File::create(project.path("in/sky.txt")).unwrap();
    write!(file, "bl").unwrap();
    let options = Way::Listening.options();
    let collector = ChangeCollector::new(options.debounce, options.poll, Duration::from_millis(25));
    let watched = Watched::with(&project, options, collector.with_pauses(pauses()));
    watched.until_watching();
    watched.until_out(&BEFORE[..1]);
    write!(file, "ue").unwrap();
    drop(file);
    watched.until_out(&BEFORE);
    assert_eq!(made(&watched.events()), 1, "{}", log(&watched.events()));
}

/// No event says that a file in a new folder is being written, or one that gets its name while it is.
#[cfg(target_os = "linux")]
#[test]
fn half_a_file_that_comes_with_a_folder_or_by_another_name_is_waited_for() {
    let project = sentences();
    project.edit("sentence", "text-source");
    project.edit("in/*.txt", "in/**/*.txt");
    project.write("in/sky.txt", "blue");
    project.write("in/gold.txt", "warm");
    fs::create_dir(project.path("in/hidden")).unwrap();
    let ways: [(&str, &str, &dyn Fn()); 4] = [
        ("in/new/deep/rain.txt", "in/new/deep/rain.txt", &|| ()),
        ("elsewhere/rain.txt", "in/moved/rain.txt", &|| project.rename("elsewhere", "in/moved")),
        ("in/rain.txt.part", "in/rain.txt", &|| project.rename("in/rain.txt.part", "in/rain.txt")),
        ("elsewhere/rain", "in/rain.txt", &|| {
            fs::hard_link(project.path("elsewhere/rain"), project.path("in/rain.txt")).unwrap();
        }),
    ];
    for (start, end, appear) in ways {
        let watched = watched(&project, Way::Listening, impatient());
        fs::create_dir_all(project.path(start).parent().unwrap()).unwrap();
        let mut file = File::create(project.path(start)).unwrap();
        write!(file, "w").unwrap();
        std::thread::sleep(PAUSE);
        appear();
        std::thread::sleep(Duration::from_millis(400));
        assert_eq!(texts(&project).len(), 2, "{end}: {}", log(&watched.events()));
        write!(file, "et").unwrap();
        drop(file);
        watched.until_out(&[BEFORE[0], ("rain.txt", "WET"), BEFORE[1]]);
        assert_eq!(failures(&watched.events()), 0, "{end}");
        project.remove(end);
        watched.until_out(&BEFORE);
        drop(watched);
        let _ = fs::remove_dir_all(project.path("elsewhere"));
    }
}
