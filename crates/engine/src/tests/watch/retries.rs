//! What the system refuses is tried again without a change, and tries that fail in the same way are not
//! reported.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use super::*;

/// Fails with a system error until the file exists whose path is its text. `.tries` beside that file has a
/// byte for each run, and `.words` the end of the error's message.
pub(super) struct Refused;

impl TextKind for Refused {
    type Parameters = Nothing;
    const NAME: &'static str = "refused";

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        let gate = Path::new(text);
        context.reporter.warn("it may be refused");
        let tries = gate.with_extension("tries");
        OpenOptions::new().create(true).append(true).open(tries)?.write_all(b".")?;
        if !gate.exists() {
            let words = fs::read_to_string(gate.with_extension("words")).unwrap_or_default();
            return Err(Failure::new(format!("refused{words}")).system_error());
        }
        Ok("done".into())
    }
}

/// A pause that no test waits for.
#[cfg(unix)]
const FOR_EVER: Duration = Duration::from_secs(86_400);

fn failures(events: &[Event]) -> Vec<String> {
    let failed = events.iter().filter_map(|event| match event {
        Event::Failed { item, error, .. } => Some(format!("{item}: {}", error.join(": "))),
        Event::BuildError { error, .. } => Some(error.join(": ")),
        _ => None,
    });
    failed.collect()
}

fn is_failed(events: &[Event]) -> bool {
    !failures(events).is_empty()
}

/// Makes `out` a dangling link.
#[cfg(unix)]
fn make_out_unwritable(project: &Project) {
    std::os::unix::fs::symlink(project.path("missing/drive"), project.path("out")).unwrap();
}

each_way! {
    #[cfg(unix)]
    fn exports_are_published_as_soon_as_out_can_be_written(way: Way) {
        let project = capitals();
        make_out_unwritable(&project);
        let watched = Watched::start(&project, way.options());
        watched.until("the refusal", is_failed);
        project.remove_link("out");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
        assert_eq!(failures(&watched.events()).len(), 1, "{}", log(&watched.events()));
    }

    fn a_failed_build_succeeds_as_soon_as_its_cause_is_removed(way: Way) {
        let project = capitals();
        project.write(".specula", "not a folder");
        let watched = Watched::start(&project, way.options());
        watched.until("the refusal", is_failed);
        project.remove(".specula");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
        assert_eq!(failures(&watched.events()).len(), 1, "{}", log(&watched.events()));
    }

    fn a_try_is_reported_only_if_it_fails_in_another_way(way: Way) {
        let project = Project::new(&CAPITALS.replace("kind = \"upper\"", "kind = \"refused\""));
        let gate = project.path("gate");
        project.write("in/sky.txt", &gate.display().to_string());
        let watched = Watched::new(&project, way);
        let tries = || fs::read(gate.with_extension("tries")).map_or(0, |tries| tries.len());
        let wait_for_more = || {
            let (before, deadline) = (tries(), Instant::now() + DEADLINE);
            while tries() < before + 4 {
                assert!(Instant::now() < deadline, "it is not tried again: {}", log(&watched.events()));
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        wait_for_more();
        let count = |events: &[Event]| events.iter().filter(|event| !matches!(event, Event::Watching { .. })).count();
        let (first, before) = (failures(&watched.events()), count(&watched.events()));
        assert_eq!(first, ["upper [sky]: refused"], "{}", log(&watched.events()));
        wait_for_more();
        assert_eq!(count(&watched.events()), before, "{}", log(&watched.events()));
        project.write("gate.words", ", and how");
        watched.until("the other failure", |events| failures(events).len() == 2);
        wait_for_more();
        assert_eq!(failures(&watched.events())[1..], ["upper [sky]: refused, and how"]);
        project.write("gate", "");
        watched.until_out(&[("sky.txt", "done")]);
        assert_eq!(failures(&watched.events()).len(), 2, "{}", log(&watched.events()));
    }

    #[cfg(unix)]
    fn a_change_does_not_wait_for_the_next_try(way: Way) {
        let project = capitals();
        make_out_unwritable(&project);
        let options = way.options();
        let collector = ChangeCollector::new(options.debounce, options.poll, Duration::from_millis(25));
        let watched = Watched::trying(&project, options, collector, [FOR_EVER, FOR_EVER]);
        let watches = |events: &[Event]| events.iter().any(|event| matches!(event, Event::Watching { .. }));
        watched.until("the refusal", |events| failures(events).len() == 1 && watches(events));
        save(&project, "in/sky.txt", "grey");
        watched.until("the answer", |events| failures(events).len() == 2);
        project.remove_link("out");
        save(&project, "in/sky.txt", "pink");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "PINK")]);
    }

    #[cfg(unix)]
    fn once_returns_after_a_rebuild_that_the_system_refused(way: Way) {
        for place in ["out", ".specula"] {
            let project = capitals();
            let watched = Watched::start(&project, WatchOptions { once: true, ..way.options() });
            watched.until_watching();
            project.remove(place);
            std::os::unix::fs::symlink(project.path("missing/drive"), project.path(place)).unwrap();
            save(&project, "in/sky.txt", "grey");
            let events = Arc::clone(&watched.log);
            watched.ended().unwrap();
            assert!(is_failed(&events.events.lock()), "{place}");
        }
    }
}
