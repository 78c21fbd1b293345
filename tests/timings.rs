//! `build --timings` draws what the events say.

use std::collections::BTreeMap;
use std::fs;

use crate::support::{Project, assert_has};
use serde_json::Value;

/// The complete events of a trace, which must be valid for Perfetto.
fn complete(project: &Project, name: &str) -> Vec<Value> {
    let trace: Value = serde_json::from_str(&fs::read_to_string(project.path(name)).unwrap()).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let mut complete = Vec::new();
    for event in events {
        assert!(event["name"].is_string() && event["pid"].is_u64() && event["tid"].is_u64(), "{event}");
        match event["ph"].as_str().unwrap() {
            "M" => assert!(event["args"]["name"].is_string(), "{event}"),
            "i" => assert!(event["ts"].is_f64() && event["s"] == "t", "{event}"),
            "X" => complete.push(event.clone()),
            other => panic!("{other} in {event}"),
        }
    }
    for (index, a) in complete.iter().enumerate() {
        let span = |event: &Value| {
            let start = event["ts"].as_f64().unwrap();
            (start, start + event["dur"].as_f64().unwrap())
        };
        // Rounding of microseconds as floating point: far below a nanosecond.
        let slack = 1e-4;
        for b in complete[index + 1..].iter().filter(|b| b["tid"] == a["tid"]) {
            let ((a0, a1), (b0, b1)) = (span(a), span(b));
            let apart = a1 <= b0 + slack || b1 <= a0 + slack;
            let nested = (a0 <= b0 + slack && b1 <= a1 + slack) || (b0 <= a0 + slack && a1 <= b1 + slack);
            assert!(apart || nested, "{a} and {b} overlap");
        }
    }
    complete
}

/// The time of each item and kind of work.
fn sums<'a>(all: impl Iterator<Item = (String, &'a Value, f64)>) -> BTreeMap<(String, String), f64> {
    let mut sums = BTreeMap::new();
    for (name, work, time) in all {
        *sums.entry((name, work.as_str().unwrap().to_owned())).or_default() += time;
    }
    sums
}

/// The name of an item.
fn shown(item: &Value) -> String {
    let stems = item["key"].as_object().unwrap().values().map(|stem| stem.as_str().unwrap());
    let stems = stems.collect::<Vec<_>>().join(", ");
    let stage = item["stage"].as_str().unwrap();
    if stems.is_empty() { stage.to_owned() } else { format!("{stage} [{stems}]") }
}

/// Every element is closed where it should be, and no text holds markup.
fn assert_well_formed(html: &str) {
    let body = html.strip_prefix("<!DOCTYPE html>\n").unwrap();
    let mut open = Vec::new();
    for piece in body.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').unwrap_or_else(|| panic!("<{piece} has no end"));
        assert!(!text.contains('>') || open.last() == Some(&"style"), "markup in {text:?}");
        assert_eq!(tag.matches('"').count() % 2, 0, "<{tag}>");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "</{name}>");
        } else if !tag.ends_with('/') {
            open.push(tag.split([' ', '\n']).next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?}");
    for elsewhere in ["http:", "https:", "src=", "url(", "@import", "<script"] {
        assert!(!html.contains(elsewhere), "the page needs {elsewhere}");
    }
}

#[test]
fn the_trace_and_the_page_hold_what_the_events_say() {
    let project = Project::small();
    let check = |events: &[Value]| {
        let worked = events.iter().filter(|event| event["event"] == "task-timed");
        let reported = sums(worked.map(|event| {
            (shown(&event["item"]), &event["work"], event["milliseconds"].as_f64().unwrap() * 1e3)
        }));
        let complete = complete(&project, ".specula/timings.json");
        let traced = sums(complete.iter().map(|event| {
            (event["name"].as_str().unwrap().to_owned(), &event["cat"], event["dur"].as_f64().unwrap())
        }));
        assert_eq!(reported.keys().collect::<Vec<_>>(), traced.keys().collect::<Vec<_>>());
        for (reported, traced) in reported.values().zip(traced.values()) {
            assert!((reported - traced).abs() < 0.01, "{reported} and {traced} microseconds");
        }
        let page = fs::read_to_string(project.path(".specula/timings.html")).unwrap();
        assert_well_formed(&page);
        let items = events.iter().filter(|event| {
            ["finished", "up-to-date", "failed", "skipped"].contains(&event["event"].as_str().unwrap())
        });
        let mut listed = 0;
        for event in items {
            assert!(page.contains(&format!("<td>{}</td>", shown(&event["item"]))), "{event}");
            listed += 1;
        }
        (listed, complete)
    };
    let (all, complete) = check(&project.events(&["--timings", "--jobs", "2"]));
    assert_eq!(complete.len(), all, "each item ran once");
    assert!(complete.iter().all(|event| event["args"]["because"] == "never built"), "{complete:#?}");

    // Some items fail, some are up to date, some are fetched, some are restored.
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    project.write("assets/materials/chalk.toml", "model = \"lambert\"\nalbedo = 0.25\n");
    fs::remove_file(project.path("out/lighting.json")).unwrap();
    let (again, complete) = check(&project.events(&["--timings", "--jobs", "2"]));
    assert_eq!(again, all);
    let mut outcomes = complete.iter().filter_map(|event| event["args"]["outcome"].as_str());
    assert!(outcomes.any(|outcome| outcome == "failed"));
    for work in ["run", "fetch", "publish"] {
        assert!(complete.iter().any(|event| event["cat"] == work), "{work}");
    }
}

#[test]
fn the_files_are_named_and_written_to_the_given_folder_and_not_published() {
    let project = Project::small();
    let run = project.ok(&["build", "--timings=notes/today", "sh"]);
    for name in ["notes/today/timings.html", "notes/today/timings.json"] {
        assert_has(&run.stderr, [name]);
        assert!(project.path(name).exists());
    }
    assert_eq!(project.outputs().into_keys().collect::<Vec<_>>(), ["lighting.json"]);
    assert_eq!(fs::read_dir(project.path("notes/today")).unwrap().count(), 2, "no temporary file is left");
    assert_eq!(project.specula(&["build", "--timings", "--dry-run"]).code, Some(2));
    project.write("taken", "a file");
    project.specula(&["build", "--timings=taken"]).ends(4, ["taken"]);
}

#[test]
#[cfg(unix)]
fn a_build_that_was_stopped_leaves_its_timings() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let project = Project::sample();
    let build = ["build", "--jobs", "1", "--json", "--timings"];
    let mut child = project.command(&build).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.find(|line| line.as_ref().unwrap().contains("\"event\":\"finished\"")).unwrap().unwrap();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!complete(&project, ".specula/timings.json").is_empty());
    let page = fs::read_to_string(project.path(".specula/timings.html")).unwrap();
    assert!(page.contains("stopped before the end"));
    assert_well_formed(&page);
}
