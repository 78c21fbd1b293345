//! Builds that cause themselves.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::kinds::{Artifact as _, Kind, Output, Port, Product};
use crate::testkit::Text;

/// Reads a text that is the path of another file of the project, and writes another text into that file.
pub(super) struct Meddler;

impl Kind for Meddler {
    type Parameters = Nothing;
    const NAME: &'static str = "meddler";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes into another file.\n";
    const SOURCE: bool = true;
    const RUNS_PROGRAMS: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        static RUNS: AtomicUsize = AtomicUsize::new(0);
        let text = context.inputs.get::<Text>("text")?;
        let path = String::from_utf8(context.files.read(context.files.source()?)?.to_vec())?;
        std::fs::write(path, RUNS.fetch_add(1, Ordering::Relaxed).to_string())?;
        Output::artifact((*text).clone())
    }
}

fn runs(events: &[Event]) -> usize {
    events
        .iter()
        .filter(|event| matches!(event, Event::Finished { item, .. } if item.stage == "text"))
        .count()
}

fn loops(events: &[Event]) -> Vec<String> {
    let loops = events.iter().filter_map(|event| match event {
        Event::RebuildLoop { item, files } => Some(format!("{item}: {}", files.join(", "))),
        _ => None,
    });
    loops.collect()
}

#[test]
fn an_item_that_changes_its_own_source_stops_and_goes_on_after_another_change() {
    let manifest = "[stage.meddler]\nkind = \"meddler\"\nsource = \"target\"\ninput = \"text\"\n";
    let project = Project::new(&format!("{CAPITALS}{manifest}"));
    project.write("in/sky.txt", "blue");
    project.write("target", &project.path("in/sky.txt").display().to_string());
    let watched = Watched::new(&project, Way::Listening);
    watched.until("the loop is found", |events| !loops(events).is_empty());
    let found = runs(&watched.events());
    assert!((9..=13).contains(&found), "{found} runs");
    assert_eq!(loops(&watched.events()), ["text [sky]: in/sky.txt"]);
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(runs(&watched.events()), found, "it has stopped");
    // Somebody takes the cause away.
    project.write("target", &project.path("elsewhere").display().to_string());
    watched.until("it goes on", |events| runs(events) > found);
    project.write("in/sky.txt", "grey");
    watched.until_out(&[("sky.txt", "GREY")]);
}

#[test]
fn a_file_that_somebody_saves_often_is_built_each_time() {
    let project = capitals();
    let watched = Watched::new(&project, Way::Listening);
    let (mut number, deadline) = (0, Instant::now() + DEADLINE);
    // More runs than a loop has.
    while number < 60 || runs(&watched.events()) <= 13 {
        assert!(Instant::now() < deadline, "{}", log(&watched.events()));
        std::thread::sleep(Duration::from_millis(25));
        number += 1;
        save(&project, "in/sky.txt", &number.to_string());
    }
    watched.until_out(&[("gold.txt", "WARM"), ("sky.txt", &number.to_string())]);
    assert_eq!(loops(&watched.events()), [""; 0]);
}
