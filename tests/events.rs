//! The lines of `--json` are what `specula schema events` and docs/events.md say.

use std::collections::BTreeSet;
use std::fs;

use crate::support::{Project, SMALL, root};
use engine::EventLine;
use serde_json::Value;

/// The schema, with fields that it does not name refused.
fn strict() -> jsonschema::Validator {
    let mut schema = EventLine::schema();
    schema["unevaluatedProperties"] = false.into();
    jsonschema::draft202012::new(&schema).unwrap()
}

/// Checks every line, and returns the names of the events.
fn names(events: &[Value]) -> BTreeSet<String> {
    let schema = strict();
    for event in events {
        let errors = schema.iter_errors(event).map(|error| error.to_string()).collect::<Vec<_>>();
        assert!(errors.is_empty(), "{event:#}\n{errors:#?}");
        assert_eq!(event["v"], EventLine::VERSION);
        assert!(event["time"].as_u64().unwrap() > 1_700_000_000_000, "milliseconds since 1970: {event}");
    }
    events.iter().map(|event| event["event"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn every_line_of_a_build_is_what_the_schema_says() {
    let project = Project::small();
    let mut seen = names(&project.events(&[]));
    project.write("assets/materials/chalk.toml", "model = \"lambert\"\nalbedo = 2\n");
    project.write("assets/materials/chrome.toml", "model = \"fong\"\n");
    fs::remove_file(project.path("assets/materials/gold.toml")).unwrap();
    fs::remove_file(project.path("out/lighting.json")).unwrap();
    let dry = project.events(&["--dry-run"]);
    assert!(names(&dry).contains("removed"), "{dry:#?}");
    seen.extend(names(&project.events(&[])));
    project.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degree = 6\n"));
    seen.extend(names(&project.events(&["--fail-fast"])));
    // Told only of items that take long, which on a busy machine may be any.
    seen.remove("progress");
    let expected = [
        "ended",
        "failed",
        "finished",
        "note",
        "planned",
        "published",
        "removed",
        "skipped",
        "started",
        "task-timed",
        "up-to-date",
        "warning",
    ];
    assert_eq!(seen.iter().map(String::as_str).collect::<Vec<_>>(), expected);
}

#[test]
fn every_line_of_a_watcher_is_what_the_schema_says() {
    let project = Project::small();
    let mut watcher = project.watch(&[]);
    let mut events = watcher.wait("watching", |_| true);
    project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 9\n");
    // A map and six faces depend on the material.
    events.extend(watcher.wait("ended", |end| end["cancelled"] == false && end["published"] == 7));
    project.write("pipeline.toml", &SMALL.replace("resolution = 16", "resolutoin = 16"));
    events.extend(watcher.wait("rejected", |event| event.to_string().contains("resolutoin")));
    let keys = (0..60).map(|n| format!("key-{n} = 1\n")).collect::<String>();
    project.write("pipeline.toml", &format!("{keys}{}", SMALL));
    events.extend(watcher.wait("rejected", |event| event.to_string().contains("key-0")));
    let found = &events[events.len() - 1]["diagnostics"];
    assert_eq!((found["errors"].as_array().unwrap().len(), &found["more"]), (50, &10.into()));
    project.write("pipeline.toml", &SMALL.replace("resolution = 16", "resolution = 8"));
    events.extend(watcher.wait("accepted", |_| true));
    events.extend(watcher.wait_for_build());
    let seen = names(&events);
    for name in ["watching", "noticed", "rejected", "accepted", "ended"] {
        assert!(seen.contains(name), "{name} is not among {seen:?}");
    }
}

fn removed() -> engine::Event {
    engine::Event::Removed {
        item: engine::ItemName { stage: "map".into(), key: engine::ItemKey::default() },
        file: "a".into(),
        because: engine::RemovalCause::SourceDeleted { path: "a.hdr".into() },
    }
}

#[test]
fn a_line_that_is_not_an_event_is_refused() {
    let schema = strict();
    let line = serde_json::to_value(EventLine::now(removed())).unwrap();
    assert!(schema.is_valid(&line));
    for (key, value) in
        [("event", "gone".into()), ("v", "1".into()), ("file", Value::Null), ("more", 1.into())]
    {
        let mut wrong = line.clone();
        wrong[key] = value;
        assert!(!schema.is_valid(&wrong), "{wrong}");
    }
}

/// The table of docs/events.md, from the schema.
fn table() -> String {
    let schema = EventLine::schema();
    let definitions = schema["$defs"].as_object().unwrap();
    let mut text = String::from("| event | when | fields |\n| --- | --- | --- |\n");
    for event in schema["oneOf"].as_array().unwrap() {
        let when = event["description"].as_str().unwrap().replace('\n', " ");
        // The summary's fields are in its own definition.
        let inner = event["$ref"].as_str().map(|name| &definitions[name.rsplit('/').next().unwrap()]);
        let all =
            [Some(event), inner].into_iter().flatten().filter_map(|part| part["properties"].as_object());
        let names = all
            .flatten()
            .map(|(name, _)| name)
            .filter(|name| *name != "event")
            .map(|name| format!("`{name}`"));
        let name = event["properties"]["event"]["const"].as_str().unwrap();
        text += &format!("| `{name}` | {when} | {} |\n", names.collect::<Vec<_>>().join(", "));
    }
    text
}

/// `UPDATE_EXPECT=1 cargo test -p cli --test end_to_end events::` writes the table.
#[test]
fn the_manual_lists_every_event_and_its_fields() {
    let path = root().join("docs/events.md");
    let manual = fs::read_to_string(&path).unwrap();
    let start = manual.find("| event | when |").unwrap();
    let end = start + manual[start..].find("\n\n").unwrap() + 1;
    let table = table();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, [&manual[..start], &table, &manual[end..]].concat()).unwrap();
    } else {
        assert!(manual[start..end] == table, "docs/events.md should hold this table:\n{table}");
    }
    assert!(manual.contains(&format!("This is version {}.", EventLine::VERSION)));
}
