//! What a watcher's events look like without a terminal.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use engine::{Diagnostic, Diagnostics, Digest};
use expect_test::{Expect, expect};

use super::*;

/// A reporter with a clock that the test sets, and its lines.
struct Watched {
    reporter: WatchReporter,
    clock: Arc<AtomicU64>,
    lines: Arc<Mutex<String>>,
}

impl Watched {
    fn new(verbose: bool) -> Self {
        let (clock, lines) = (Arc::new(AtomicU64::new(0)), Arc::new(Mutex::new(String::new())));
        let (read, write) = (Arc::clone(&clock), Arc::clone(&lines));
        let screen = Screen::plain(move |line| *write.lock() += &format!("{line}\n"));
        let reporter = WatchReporter::new(verbose, screen, move || {
            let now = read.load(Ordering::Relaxed);
            Moment { milliseconds: now as f64, time: format!("14:00:{:02}", now / 1000) }
        });
        Self { reporter, clock, lines }
    }

    /// Sends these events some milliseconds later.
    fn after(&self, milliseconds: u64, events: &[Event]) -> &Self {
        self.clock.fetch_add(milliseconds, Ordering::Relaxed);
        events.iter().for_each(|event| self.reporter.show(event));
        self
    }

    /// The lines since the last call.
    fn lines(&self) -> String {
        std::mem::take(&mut *self.lines.lock())
    }

    /// Compares the lines since the last call. The common indentation of an expectation is not compared: one
    /// of its lines begins a paragraph.
    fn shows(&self, expected: Expect) -> &Self {
        expected.assert_eq(&test_data::unix_paths(self.lines()));
        self
    }
}

fn item(stage: &str, stems: &[(&str, &str)]) -> ItemName {
    ItemName { stage: stage.into(), key: stems.iter().copied().collect() }
}

fn of_gold(stage: &str) -> ItemName {
    item(stage, &[("material", "gold")])
}

fn lit(stage: &str, environment: &str) -> ItemName {
    item(stage, &[("environment", environment), ("material", "gold")])
}

fn planned(items: usize) -> Event {
    Event::Planned { dry_run: false, stages: 5, items }
}

fn noticed(changes: &[(&str, Changed)]) -> Event {
    let change = |(path, what): &(&str, Changed)| Change { path: (*path).into(), what: *what };
    Event::Noticed { changes: changes.iter().map(change).collect(), milliseconds: 21.0 }
}

fn started(item: &ItemName, reason: Reason) -> Event {
    Event::Started { item: item.clone(), reasons: vec![reason], host: None }
}

fn finished(item: &ItemName) -> Event {
    Event::Finished { item: item.clone(), milliseconds: 3.0, changed: true }
}

fn published(item: &ItemName, file: &str) -> Event {
    Event::Published { item: item.clone(), file: file.into(), bytes: 9, restored: false }
}

fn failed(item: &ItemName, error: &[&str]) -> Event {
    let error = error.iter().map(|cause| (*cause).to_owned()).collect();
    Event::Failed { item: item.clone(), error, help: Some("write a positive number".into()) }
}

fn file(path: &str) -> Reason {
    let (old, new) = (Some(Digest([1; 32])), Some(Digest([2; 32])));
    Reason::File { path: path.into(), old, new, old_time: None, new_time: None }
}

fn input(item: &ItemName) -> Reason {
    let (old, new) = (Some(Digest([1; 32])), Some(Digest([2; 32])));
    Reason::Input { port: "brdf".into(), item: item.clone(), old, new }
}

fn ended(ran: usize, up_to_date: usize) -> Event {
    Event::Ended(Summary { ran, up_to_date, ..Summary::default() })
}

fn listening() -> Event {
    Event::Watching { folders: 3, poll_milliseconds: None, because: None }
}

#[test]
fn nearly_equal_warnings_share_a_line_unless_verbose_asks_for_each() {
    let warning = |environment: &str, share: u32| Event::Warning {
        item: lit("map", environment),
        message: format!("{share} % of the views are below zero"),
    };
    let events = [warning("studio", 13), warning("sky", 4), Event::Ended(Summary::default())];
    let lines = |verbose: bool| {
        let watched = Watched::new(verbose);
        watched.after(5, &events);
        watched.lines()
    };
    let grouped = " warning  map: 2 items: 4 % of the views are below zero; for example [sky, gold]\n";
    assert!(lines(false).contains(grouped), "{}", lines(false));
    assert_eq!(lines(true).matches("% of the views").count(), 2, "{}", lines(true));
}

#[test]
fn of_many_failures_the_first_are_shown_and_the_others_counted() {
    let items = (0..60).map(|n| item("material", &[("material", &format!("m{n:02}"))])).collect::<Vec<_>>();
    let change = || noticed(&[("assets/materials", Changed::Changed)]);
    let ends =
        |failed: usize| Event::Ended(Summary { failed, up_to_date: 60 - failed, ..Summary::default() });
    for (verbose, shown) in [(false, 50), (true, 60)] {
        let watched = Watched::new(verbose);
        let broken = items.iter().map(|item| failed(item, &["no such model"]));
        watched.after(1, &[vec![change(), planned(60)], broken.collect(), vec![ends(60)]].concat());
        let lines = watched.lines();
        assert_eq!(lines.matches("  FAILED  material").count(), shown, "{lines}");
        assert_eq!(
            lines.contains("          ... and 10 more failed items; --verbose shows all\n"),
            !verbose,
            "{lines}"
        );
        let fixed = items.iter().map(finished);
        watched.after(1, &[vec![change(), planned(60)], fixed.collect(), vec![ends(0)]].concat());
        let lines = watched.lines();
        assert_eq!(lines.matches("   fixed  material").count(), shown, "{lines}");
        assert_eq!(
            lines.contains("          ... and 10 more fixed items; --verbose shows all\n"),
            !verbose,
            "{lines}"
        );
    }
}

/// An edit of gold under two skies, with two exports of each reflection.
fn edit(watched: &Watched) {
    let gold = "assets/materials/gold.toml";
    watched.after(1000, &[noticed(&[(gold, Changed::Changed)]), planned(40)]);
    let (material, coefficients) = (of_gold("material"), of_gold("coefficients"));
    watched.after(5, &[started(&material, file(gold)), finished(&material)]);
    watched.after(10, &[started(&coefficients, input(&material)), finished(&coefficients)]);
    for sky in ["studio", "sunset"] {
        let reflection = lit("reflection", sky);
        watched.after(7, &[started(&reflection, input(&coefficients)), finished(&reflection)]);
        for stage in ["map", "shrm"] {
            let export = lit(stage, sky);
            let events = [
                started(&export, input(&reflection)),
                published(&export, &format!("{sky}/gold/{stage}.ktx2")),
                finished(&export),
            ];
            watched.after(8, &events);
        }
    }
    watched.after(1, &[ended(8, 32)]);
}

#[test]
fn an_edit_takes_a_line_for_each_stage() {
    let watched = Watched::new(false);
    watched.after(0, &[planned(40)]).after(30, &[ended(0, 40), listening()]).shows(expect![[r#"
        14:00:00  building, 40 items
           30 ms  40 up to date
        14:00:00  listening to 3 folders
    "#]]);
    edit(&watched);
    watched.shows(expect![[r#"
        14:00:01  assets/materials/gold.toml changed
           26 ms  material [gold] (gold.toml changed)
           36 ms  coefficients [gold] (material changed)
           66 ms  reflection, 2 items (coefficients changed)
           74 ms  map, 2 items (reflection changed): studio/gold/map.ktx2, sunset/gold/map.ktx2
           82 ms  shrm, 2 items (reflection changed): studio/gold/shrm.ktx2 and 1 more
           83 ms  4 files updated, 8 items ran, 32 up to date
    "#]]);
}

#[test]
fn verbose_names_every_item_and_file() {
    let watched = Watched::new(true);
    edit(&watched);
    watched.shows(expect![[r#"
        14:00:01  assets/materials/gold.toml changed
           26 ms  material [gold] ran: assets/materials/gold.toml changed (010101010101 to 020202020202)
           36 ms  coefficients [gold] ran: brdf = material [gold] changed (010101010101 to 020202020202)
           43 ms  reflection [studio, gold] ran: brdf = coefficients [gold] changed (010101010101 to 020202020202)
           51 ms  studio/gold/map.ktx2 updated
           51 ms  map [studio, gold] ran: brdf = reflection [studio, gold] changed (010101010101 to 020202020202)
           59 ms  studio/gold/shrm.ktx2 updated
           59 ms  shrm [studio, gold] ran: brdf = reflection [studio, gold] changed (010101010101 to 020202020202)
           66 ms  reflection [sunset, gold] ran: brdf = coefficients [gold] changed (010101010101 to 020202020202)
           74 ms  sunset/gold/map.ktx2 updated
           74 ms  map [sunset, gold] ran: brdf = reflection [sunset, gold] changed (010101010101 to 020202020202)
           82 ms  sunset/gold/shrm.ktx2 updated
           82 ms  shrm [sunset, gold] ran: brdf = reflection [sunset, gold] changed (010101010101 to 020202020202)
           83 ms  4 files updated, 8 items ran, 32 up to date
    "#]]);
}

#[test]
fn an_error_stays_until_its_item_succeeds() {
    let watched = Watched::new(false);
    let gold = "assets/materials/gold.toml";
    let (material, coefficients) = (of_gold("material"), of_gold("coefficients"));
    let change = [noticed(&[(gold, Changed::Changed)]), planned(3)];
    let error = ["source assets/materials/gold.toml", "2:12: sigma = -1 is negative"];
    let rebuild = [
        started(&material, file(gold)),
        failed(&material, &error),
        Event::Skipped { item: coefficients.clone(), because: Some(material.clone()) },
        Event::Ended(Summary { failed: 1, skipped: 1, up_to_date: 1, ..Summary::default() }),
    ];
    watched.after(0, &change).after(20, &rebuild).shows(expect![[r#"
        14:00:00  assets/materials/gold.toml changed
          FAILED  material [gold]
                    source assets/materials/gold.toml
                    2:12: sigma = -1 is negative
                    hint: write a positive number
           41 ms  1 FAILED, 1 not run, 1 up to date
    "#]]);
    // Something else changes; the same error is not printed in full again.
    watched.after(900, &[noticed(&[("assets/chalk.toml", Changed::Gone)]), planned(3)]);
    watched.after(20, &rebuild).shows(expect![[r#"
        14:00:00  assets/chalk.toml is gone
           41 ms  1 FAILED, 1 not run, 1 up to date
                  still failing: material [gold] (source assets/materials/gold.toml: 2:12: sigma = -1 is negative)
    "#]]);
    // Another error takes its place.
    watched.after(900, &change).after(20, &[started(&material, Reason::FailedBefore)]);
    watched.after(0, &[failed(&material, &["2:12: sigma is missing"]), ended(0, 2)]).shows(expect![[r#"
        14:00:01  assets/materials/gold.toml changed
          FAILED  material [gold]
                    2:12: sigma is missing
                    hint: write a positive number
           41 ms  2 up to date
    "#]]);
    watched.after(900, &change).after(20, &[started(&material, Reason::FailedBefore), finished(&material)]);
    watched.after(1, &[ended(1, 2)]).shows(expect![[r#"
        14:00:02  assets/materials/gold.toml changed
           fixed  material [gold]
           41 ms  material [gold] (its last run failed)
           42 ms  1 item ran, 2 up to date
    "#]]);
}

#[test]
fn an_error_ends_with_its_item_but_not_with_a_build_that_was_stopped() {
    let watched = Watched::new(false);
    let material = of_gold("material");
    let stopped = Event::Ended(Summary { cancelled: true, skipped: 3, ..Summary::default() });
    watched.after(0, &[planned(3), failed(&material, &["no"]), ended(0, 2)]).shows(expect![[r#"
        14:00:00  building, 3 items
          FAILED  material [gold]
                    no
                    hint: write a positive number
          0.0 ms  2 up to date
    "#]]);
    watched.after(0, &[noticed(&[("a", Changed::Gone)]), planned(3), stopped]).shows(expect![[r#"
        14:00:00  a is gone
           21 ms  0 up to date, stopped before the end
                  still failing: material [gold] (no)
    "#]]);
    watched.after(0, &[noticed(&[("b", Changed::Gone)]), planned(2), ended(0, 2)]).shows(expect![[r#"
        14:00:00  b is gone
           21 ms  2 up to date
    "#]]);
}

#[test]
fn an_invalid_manifest_is_drawn_and_kept_in_view_until_it_is_fixed() {
    let watched = Watched::new(false);
    let text = "schema = 1\nout = 7\n";
    let errors = vec![Diagnostic::at(17..18, "out is a number").expected("a folder")];
    let rejected = Event::Rejected { diagnostics: Diagnostics::new("pipeline.toml", text, errors) };
    let manifest = noticed(&[("pipeline.toml", Changed::Changed)]);
    watched.after(0, &[manifest.clone(), rejected]);
    let lines = std::mem::take(&mut *watched.lines.lock());
    assert!(lines.contains("out is a number") && lines.contains("pipeline.toml:2:7"), "{lines}");
    // Builds continue with the last valid manifest, and say so.
    watched.after(500, &[noticed(&[("a.toml", Changed::Changed)]), planned(2), ended(1, 1)]);
    watched.shows(expect![[r#"
        14:00:00  a.toml changed
           21 ms  1 item ran, 1 up to date
                  still failing: pipeline.toml:2:7: out is a number
    "#]]);
    watched.after(500, &[manifest, Event::Accepted, planned(2), ended(0, 2)]).shows(expect![[r#"
        14:00:01  pipeline.toml changed
           fixed  the manifest is valid again
           21 ms  2 up to date
    "#]]);
}

#[test]
fn many_changes_are_counted_by_folder() {
    let watched = Watched::new(false);
    let paths = (0..500).map(|n| format!("assets/{}/{n}.toml", n % 2)).collect::<Vec<_>>();
    let mut changes = paths.iter().map(|path| (path.as_str(), Changed::Changed)).collect::<Vec<_>>();
    changes.extend([("assets/0/new.toml", Changed::Appeared), ("pipeline.toml", Changed::Changed)]);
    watched.after(0, &[noticed(&changes)]).shows(expect![[r#"
        14:00:00  .: 1 changed
                  assets/0: 1 new, 250 changed
                  assets/1: 250 changed
    "#]]);
    let few = [("assets", Changed::Unknown), ("b.toml", Changed::Gone), ("c.toml", Changed::Appeared)];
    watched.after(0, &[noticed(&few)]).shows(expect![[r#"
        14:00:00  assets: events were lost, so everything in it will be checked
                  b.toml is gone
                  c.toml is new
    "#]]);
}

#[test]
fn a_build_without_a_change_reports_nothing_unless_something_ran() {
    let watched = Watched::new(false);
    watched.after(0, &[noticed(&[("a.toml", Changed::Changed)]), planned(2), ended(1, 1)]);
    watched.lines.lock().clear();
    let material = of_gold("material");
    watched.after(100, &[planned(2), ended(0, 2)]).shows(expect![[""]]);
    watched.after(100, &[planned(2), started(&material, file("a.toml")), finished(&material), ended(1, 1)]);
    watched.shows(expect![[r#"
        14:00:00  building again
          0.0 ms  material [gold] (a.toml changed)
          0.0 ms  1 item ran, 1 up to date
    "#]]);
}

#[test]
fn a_long_build_reports_while_it_runs() {
    let watched = Watched::new(false);
    watched.after(0, &[noticed(&[("sky.exr", Changed::Changed)]), planned(9)]);
    let lighting = item("lighting", &[("environment", "sky")]);
    watched.after(1500, &[started(&lighting, file("sky.exr")), finished(&lighting)]).shows(expect![[r#"
        14:00:00  sky.exr changed
    "#]]);
    let reflection = lit("reflection", "sky");
    let event = started(&reflection, input(&lighting));
    assert_eq!(watched.after(700, &[event]).lines(), "  1.52 s  lighting [sky] (sky.exr changed)\n");
    assert_eq!(
        watched.after(900, &[finished(&reflection), ended(2, 7)]).lines(),
        "  3.12 s  reflection [sky, gold] (lighting changed)\n  3.12 s  2 items ran, 7 up to date\n"
    );
}

#[test]
fn how_the_watcher_gets_changes_is_shown_with_the_reason() {
    let because = "no event arrived from /mnt/assets: a file was written there and nothing was heard for 2 s";
    let polling =
        Event::Watching { folders: 3, poll_milliseconds: Some(500.0), because: Some(because.into()) };
    let build_error = Event::BuildError {
        error: vec!["cannot lock .specula".into(), "another build is at work (process 7)".into()],
        help: Some("wait for it, or stop that process".into()),
    };
    Watched::new(false).after(0, &[polling, build_error]).shows(expect![[r#"
        14:00:00  polling every 500 ms: no event arrived from /mnt/assets: a file was written there and nothing was heard for 2 s
          FAILED  the build
                    cannot lock .specula
                    another build is at work (process 7)
                    hint: wait for it, or stop that process
    "#]]);
}
