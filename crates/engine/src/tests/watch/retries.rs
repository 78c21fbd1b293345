//! What the system refuses is tried again without a change, and not a word is said until something comes of it.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;

use super::*;
use crate::testkit::{Nothing, Text};
use crate::{Artifact as _, Context, Failure, Kind, Output, Port, Product};

/// Is refused by the system until the file exists whose path is its text; `.tries` beside that has a byte for each
/// time that it ran, and what it says is in `.words`.
pub(super) struct Refused;

impl Kind for Refused {
    type Parameters = Nothing;
    const NAME: &'static str = "refused";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Is refused.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let gate = Path::new(&context.get::<Text>("text")?.0).to_path_buf();
        context.warn("it may be refused");
        let tries = gate.with_extension("tries");
        OpenOptions::new().create(true).append(true).open(tries)?.write_all(b".")?;
        if !gate.exists() {
            let words = fs::read_to_string(gate.with_extension("words")).unwrap_or_default();
            return Err(Failure::new(format!("refused{words}")).system_error());
        }
        Output::artifact(Text("done".into()))
    }
}

/// Pauses that no test waits for.
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

/// A link to nowhere in the place of `out`: not even root can make a folder there.
#[cfg(unix)]
fn lead_out_nowhere(project: &Project) {
    std::os::unix::fs::symlink(project.path("missing/drive"), project.path("out")).unwrap();
}

each_way! {
    #[cfg(unix)]
    fn an_out_that_cannot_be_written_is_published_when_it_can(way: Way) {
        let project = capitals();
        // With one file no try is refused in part.
        project.remove("in/gold.txt");
        lead_out_nowhere(&project);
        let watched = Watched::new(&project, way);
        watched.until("the refusal", is_failed);
        project.remove_link("out");
        watched.until_out(&[("sky.txt", "BLUE")]);
        // The files are there before the try is told that put them there.
        let refused = |events: &[Event]| summaries(events).map(|summary| summary.system_errors).collect::<Vec<_>>();
        watched.until("the end of that try", |events| refused(events) == [1, 0]);
        assert_eq!(failures(&watched.events()).len(), 1, "{}", log(&watched.events()));
    }

    fn a_build_that_could_not_go_on_does_when_it_can(way: Way) {
        let project = capitals();
        project.write(".specula", "no folder");
        let watched = Watched::start(&project, way.options());
        watched.until("the refusal", is_failed);
        project.remove(".specula");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "BLUE")]);
        assert_eq!(failures(&watched.events()).len(), 1, "{}", log(&watched.events()));
    }

    fn tries_that_fail_as_before_say_nothing_and_one_that_fails_otherwise_does(way: Way) {
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
        let told = |told: &[Event]| told.iter().filter(|event| !matches!(event, Event::Watching { .. })).count();
        let (first, before) = (failures(&watched.events()), told(&watched.events()));
        assert_eq!(first, ["upper [sky]: refused"], "{}", log(&watched.events()));
        wait_for_more();
        assert_eq!(told(&watched.events()), before, "{}", log(&watched.events()));
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
        lead_out_nowhere(&project);
        let options = way.options();
        let collector = ChangeCollector::new(options.debounce, options.poll, Duration::from_millis(25));
        let watched = Watched::trying(&project, options, collector, [FOR_EVER, FOR_EVER]);
        watched.until("the refusal", |events| failures(events).len() == 2);
        watched.until("it watches", |events| events.iter().any(|event| matches!(event, Event::Watching { .. })));
        save(&project, "in/sky.txt", "grey");
        watched.until("the answer", |events| failures(events).len() == 4);
        project.remove_link("out");
        save(&project, "in/sky.txt", "pink");
        watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", "PINK")]);
    }

    #[cfg(unix)]
    fn once_returns_after_a_rebuild_that_the_system_refused(way: Way) {
        for place in ["out", ".specula"] {
            let project = capitals();
            let watched = Watched::start(&project, WatchOptions { once: true, ..way.options() });
            watched.until("it watches", |events| {
                let watches = events.iter().any(|event| matches!(event, Event::Watching { .. }));
                watches && summaries(events).next().is_some()
            });
            project.remove(place);
            std::os::unix::fs::symlink(project.path("missing/drive"), project.path(place)).unwrap();
            save(&project, "in/sky.txt", "grey");
            let told = Arc::clone(&watched.told);
            watched.ended().unwrap();
            assert!(is_failed(&told.events.lock()), "{place}");
        }
    }
}
