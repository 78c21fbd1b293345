//! `build --junit` says of each item what the events say, as XML that another reader accepts.

use std::fs::{self, File};

use roxmltree::{Document, Node};
use serde_json::Value;

use crate::support::{Project, ran};

/// The test cases of a report: class, name, and what there is in them.
fn cases<'a>(report: &'a Document<'_>) -> Vec<(&'a str, &'a str, Option<Node<'a, 'a>>)> {
    let suites = report.root_element();
    let suite = suites.first_element_child().unwrap();
    assert_eq!((suites.tag_name().name(), suite.tag_name().name()), ("testsuites", "testsuite"));
    assert!(suite.next_sibling_element().is_none() && suite.has_attribute("name"));
    let count = |name: &str| suite.descendants().filter(|node| node.has_tag_name(name)).count();
    for (element, attribute, count) in [
        (suites, "tests", count("testcase")),
        (suite, "tests", count("testcase")),
        (suites, "failures", count("failure")),
        (suite, "failures", count("failure")),
        (suite, "skipped", count("skipped")),
        (suite, "errors", 0),
    ] {
        assert_eq!(element.attribute(attribute), Some(count.to_string().as_str()), "{attribute}");
    }
    let cases = suite.children().filter(Node::is_element).map(|case| {
        assert_eq!(case.tag_name().name(), "testcase");
        assert!(case.attribute("time").unwrap().parse::<f64>().unwrap() >= 0.0);
        let what = case.first_element_child();
        assert!(what.is_none_or(|what| what.next_sibling_element().is_none()));
        (case.attribute("classname").unwrap(), case.attribute("name").unwrap(), what)
    });
    cases.collect()
}

/// The words for a test case: `passed`, `up to date`, the text of a failure, or why it was skipped.
fn said(what: Option<Node<'_, '_>>) -> String {
    let Some(what) = what else { return "passed".into() };
    let text = what.text().unwrap_or_default();
    match what.tag_name().name() {
        "system-out" => text.into(),
        "failure" => {
            let message = what.attribute("message").unwrap();
            assert!(!message.is_empty() && text.starts_with(message), "{message:?} of {text:?}");
            text.into()
        }
        "skipped" => format!("skipped: {}", what.attribute("message").unwrap()),
        other => panic!("{other}"),
    }
}

/// What a report has to say of an item of which this is an event, if the event says how it ended.
fn expected(event: &Value) -> Option<String> {
    Some(match event["event"].as_str()? {
        "finished" => "passed".into(),
        "up-to-date" => "up to date".into(),
        "skipped" => "skipped: material [gold] failed".into(),
        "failed" => {
            let causes: Vec<_> = event["error"].as_array()?.iter().filter_map(Value::as_str).collect();
            let hint = event["help"].as_str().map_or_else(String::new, |help| format!("\nhint: {help}"));
            causes.join(": ") + &hint
        }
        _ => return None,
    })
}

#[test]
fn each_item_is_a_test_case_that_says_what_its_events_say() {
    let project = Project::small();
    let check = |code: i32, outcomes: &[&str]| {
        let run = project.specula(&["build", "--json", "--junit", "reports/specula.xml"]).ends(code, []);
        let events: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let text = fs::read_to_string(project.path("reports/specula.xml")).unwrap();
        let report = Document::parse(&text).unwrap();
        let mut found = Vec::new();
        for (stage, name, what) in cases(&report) {
            let stem = name.strip_prefix(stage).unwrap().trim_matches([' ', '[', ']']);
            found.push((stage.to_owned(), stem.to_owned(), said(what)));
        }
        let mut wanted = Vec::new();
        for event in &events {
            let Some(expected) = expected(event) else { continue };
            let key = event["item"]["key"].as_object().unwrap();
            let stems = key.values().map(|stem| stem.as_str().unwrap()).collect::<Vec<_>>().join(", ");
            wanted.push((event["item"]["stage"].as_str().unwrap().to_owned(), stems, expected));
        }
        found.sort();
        wanted.sort();
        assert_eq!(found, wanted);
        for outcome in outcomes {
            let has = |said: &str| test_data::unix_paths(said.to_owned()).starts_with(outcome);
            assert!(found.iter().any(|(_, _, said)| has(said)), "{outcome}: {found:#?}");
        }
        // An item takes as long as the worker needed for it.
        let time = |case: Node<'_, '_>| case.attribute("time").unwrap().parse::<f64>().unwrap();
        let sum = report.descendants().filter(|node| node.has_tag_name("testcase")).map(time).sum::<f64>();
        let runs = events.iter().filter(|event| event["event"] == "task-timed" && event["work"] == "run");
        let most = runs.map(|event| event["milliseconds"].as_f64().unwrap()).sum::<f64>() / 1e3;
        let rounding = 0.5e-3 * found.len() as f64;
        assert!(sum <= most + rounding, "{sum} of {most} s");
        assert!(ran(&events).is_empty() || sum > 0.0);
    };
    check(0, &["passed"]);
    check(0, &["up to date"]);
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    project.write("assets/materials/chalk.toml", "model = \"lambert\"\nalbedo = 0.25\n");
    check(1, &["passed", "up to date", "skipped", "source assets/materials/gold.toml"]);
    let files = fs::read_dir(project.path("reports")).unwrap().count();
    assert_eq!(files, 1, "no temporary file is left");
}

#[test]
fn whatever_stops_a_build_is_a_test_case() {
    let project = Project::small();
    let check = |code: i32, parts: &[&str]| {
        project.specula(&["build", "--junit", "report.xml"]).ends(code, []);
        let text = fs::read_to_string(project.path("report.xml")).unwrap();
        let report = Document::parse(&text).unwrap();
        let cases = cases(&report);
        let [("build", "pipeline.toml", what)] = cases[..] else { panic!("{text}") };
        for part in parts {
            assert!(said(what).contains(part), "no {part:?} in {text}");
        }
    };
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    project.write("pipeline.toml", &manifest.replace("layout = \"cube\"", "layout = \"cub<&\""));
    check(3, &["pipeline.toml:38:10: ", "cub<&"]);
    fs::remove_file(project.path("pipeline.toml")).unwrap();
    check(3, &["pipeline.toml", "specula init"]);
    project.write("pipeline.toml", &manifest);
    project.ok(&["build", "sh"]);
    let lock = File::options().write(true).open(project.path(".specula/lock")).unwrap();
    lock.lock().unwrap();
    let run = project.specula(&["build", "--wait=0", "--junit", "report.xml"]).ends(4, []);
    drop(lock);
    let text = fs::read_to_string(project.path("report.xml")).unwrap();
    let report = Document::parse(&text).unwrap();
    let (_, _, what) = cases(&report)[0];
    let said = test_data::unix_paths(said(what));
    assert!(run.stderr.contains(said.split(": ").next().unwrap()), "{text}\n{}", run.stderr);
}

#[test]
fn a_report_that_cannot_be_written_is_an_error_unless_there_is_another() {
    let project = Project::small();
    project.write("taken", "a file");
    project.specula(&["build", "sh", "--junit", "taken/report.xml"]).ends(4, ["taken"]);
    project.write("assets/materials/gold.toml", "model = \"fong\"\n");
    project.specula(&["build", "--junit", "taken/report.xml"]).ends(1, ["taken", "fong"]);
    project.write("pipeline.toml", "schema = 7\n");
    project.specula(&["build", "--junit", "taken/report.xml"]).ends(3, ["taken", "schema"]);
    project.specula(&["build", "--dry-run", "--junit", "report.xml"]).ends(2, ["--junit"]);
}

/// Names and messages that no document of XML 1.0 can hold as they are.
#[test]
#[cfg(unix)]
fn names_and_messages_may_hold_anything() {
    let project = Project::new(concat!(
        "schema = 1\n[stage]\n",
        "material = { kind = \"import-material\", source = \"hostile/*.toml\" }\n",
        "brdf = { kind = \"project-brdf\", input = \"material\", degree = [4, 0] }\n",
    ));
    let names =
        ["a\u{1b}[31mb", "c\"d'&<]]>", "e\nf\tg\r", "h\u{fffe}\u{ffff}", "i\u{85}\u{202e}", "\u{1f600}"];
    for name in names {
        project.write(&format!("hostile/{name}.toml"), "model = \"<\u{9b}\u{fffe}&\"\n");
    }
    project.specula(&["build", "--color", "always", "--junit", "report.xml"]).ends(1, []);
    let text = fs::read_to_string(project.path("report.xml")).unwrap();
    assert!(!text.contains(|c: char| c.is_control() && !['\n', '\t'].contains(&c)), "{text:?}");
    let report = Document::parse(&text).unwrap();
    let mut found: Vec<_> = cases(&report).into_iter().filter(|(stage, ..)| *stage == "material").collect();
    found.sort_by_key(|(_, name, _)| *name);
    let shown = [
        r"a\u{1b}[31mb",
        "c\"d'&<]]>",
        "e\nf\tg\\u{d}",
        r"h\u{fffe}\u{ffff}",
        r"i\u{85}\u{202e}",
        "\u{1f600}",
    ];
    let shown = shown.map(|name| format!("material [{name}]"));
    assert_eq!(found.iter().map(|(_, name, _)| *name).collect::<Vec<_>>(), shown);
    for (_, _, what) in &found {
        crate::support::assert_has(said(*what), [r"<\u{9b}\u{fffe}&", "hostile/"]);
    }
    assert_eq!(cases(&report).len(), 2 * names.len());
}
