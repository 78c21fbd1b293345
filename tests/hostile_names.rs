//! Names of files and texts in them that a terminal would act on are shown escaped, by every command and on
//! both streams.

// Windows has no such names.
use std::fs;
use std::time::{Duration, Instant};

use crate::support::{Project, Run, TIMEOUT, assert_has, files_below};

/// They set the title and colours, by ESC and by C1's CSI, delete characters, and change the direction of
/// text.
const HOSTILE: [&str; 5] =
    ["gold\x1b]0;pwned\x07", "red\x1b[31m", "c1\u{9b}31m", "del\x7f\r", "iso\u{2066}x"];

/// Names in `out` may contain a character that changes the direction of text, but no control characters.
const BIDIRECTIONAL: &str = "bidi\u{202e}txt";

const MANIFEST: &str = r#"
schema = 1
[stage]
environment = { kind = "import-environment", source = "assets/environments/studio.exr", resolution = 32 }
lighting = { kind = "project-sh", input = "environment", degree = 4 }
hostile = { kind = "import-material", source = "hostile/*.toml" }
coefficients = { kind = "project-brdf", input = "hostile", degree = [4, 0] }
turned = { kind = "import-material", source = "turned/*.toml" }
brdf = { kind = "project-brdf", input = "turned", degree = [4, 0] }
reflection = { kind = "convolve", inputs = { lighting = "lighting", brdf = "brdf" } }
[stage.map]
kind = "export-reflection-map"
input = "reflection"
layout = "lat-long"
resolution = 4
path = "maps/{turned}"
"#;

const MATERIAL: &str = "model = \"lambert\"\nalbedo = 0.5\n";

fn project() -> Project {
    let project = Project::new(MANIFEST);
    for name in HOSTILE {
        project.write(&format!("hostile/{name}.toml"), MATERIAL);
    }
    project.write(&format!("turned/{BIDIRECTIONAL}.toml"), MATERIAL);
    project
}

/// Whether a terminal acts on a character; line feeds and tabs are allowed.
fn is_raw(c: char) -> bool {
    let turns = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && !matches!(c, '\n' | '\t')
}

fn assert_clean(what: &str, run: &Run) {
    for (stream, text) in [("stdout", &run.stdout), ("stderr", &run.stderr)] {
        let raw = text.find(is_raw).map(|at| &text[text.floor_char_boundary(at.saturating_sub(60))..]);
        assert!(raw.is_none(), "{what} prints raw to {stream}: {:?}", raw.unwrap_or_default());
    }
}

/// Runs a command and checks its streams; both are returned.
fn clean(project: &Project, arguments: &[&str]) -> String {
    let run = project.specula(arguments);
    assert_clean(&format!("specula {arguments:?}"), &run);
    run.stdout + &run.stderr
}

#[test]
fn no_command_prints_the_name_of_a_file_raw() {
    let project = project();
    let printed = clean(&project, &["build", "--verbose"]);
    for shown in
        [r"gold\u{1b}]0;pwned\u{7}", r"red\u{1b}[31m", r"c1\u{9b}31m", r"del\u{7f}\u{d}", r"iso\u{2066}x"]
    {
        assert!(printed.contains(shown), "no {shown} in {printed}");
    }
    clean(&project, &["build", "--verbose"]);
    project.write(&format!("hostile/{}.toml", HOSTILE[0]), "model = \"fo\u{9b}ng\x07\"\n");
    project.write(&format!("hostile/{}.toml", HOSTILE[1]), "model = \"phong\"\n\"\u{202e}key\" = 1\n");
    project.write(&format!("turned/{BIDIRECTIONAL}.toml"), "model = \"lambert\"\nalbedo = 0.25\n");
    assert!(clean(&project, &["build", "--dry-run"]).contains(r"bidi\u{202e}txt"));
    assert!(clean(&project, &["build"]).contains(r"map [studio, bidi\u{202e}txt]"));
    let file = format!("maps/{BIDIRECTIONAL}.exr");
    for target in ["hostile", "coefficients", &file, &format!("turned/{BIDIRECTIONAL}.toml"), HOSTILE[0]] {
        assert!(clean(&project, &["explain", target]).contains(r"\u{"), "{target:?}");
        clean(&project, &["explain", target, "--verbose"]);
    }
    assert!(clean(&project, &["verify", &file]).contains(r"bidi\u{202e}txt.exr"));
    assert!(clean(&project, &["inspect", &format!("out/{file}")]).contains("OpenEXR"));
    let [good, bad] = [2, 0].map(|index| format!("hostile/{}.toml", HOSTILE[index]));
    clean(&project, &["inspect", &good]);
    assert!(clean(&project, &["inspect", &bad]).contains(r"pwned\u{7}"));
    project.write("other.json", r#"{"preset":"\u001b[31m","frame":"\u202e","specula":"\u009b"}"#);
    assert!(clean(&project, &["inspect", "other.json"]).contains(r"\u{1b}[31m"));
    for command in [
        &["check"][..],
        &["check", "--determinism", "--threads", "1,2", "map"],
        &["graph"],
        &["graph", "--format", "dot"],
        &["cache", "stats"],
        &["cache", "gc", "--dry-run"],
        &["build", "--timings"],
    ] {
        clean(&project, command);
    }
    // A lost result of a hostile item is named.
    for blob in files_below(&project.path(".specula/blobs")).keys() {
        fs::write(project.path(".specula/blobs").join(blob), "damaged").unwrap();
    }
    assert!(clean(&project, &["cache", "verify"]).contains(r"iso\u{2066}x"));
    fs::remove_file(project.path(&format!("turned/{BIDIRECTIONAL}.toml"))).unwrap();
    project.write("turned/plain.toml", MATERIAL);
    assert!(clean(&project, &["verify"]).contains(r"maps/bidi\u{202e}txt.exr: left over"));
    let text = clean(&project, &["build", "--verbose"]);
    assert_has(&text, [r"removed  maps/bidi\u{202e}txt.exr", r"turned/bidi\u{202e}txt.toml was "]);
}

#[test]
fn json_is_escaped_as_json() {
    let project = project();
    project.ok(&["build"]);
    project.write(&format!("turned/{BIDIRECTIONAL}.toml"), "model = \"lambert\"\nalbedo = 0.25\n");
    let file = format!("maps/{BIDIRECTIONAL}.exr");
    for command in [
        &["build", "--json", "--dry-run"][..],
        &["explain", "coefficients", "--json"],
        &["explain", &file, "--json"],
        &["verify", &file, "--json"],
        &["inspect", &format!("out/{file}"), "--json"],
        &["check", "--json"],
        &["cache", "stats", "--json"],
    ] {
        let run = project.specula(command);
        assert_clean(&format!("{command:?}"), &run);
        let lines = run.stdout.lines().map(serde_json::from_str::<serde_json::Value>);
        let values = lines.collect::<Result<Vec<_>, _>>().unwrap();
        assert!(!values.is_empty(), "{command:?}");
        if command.contains(&"coefficients") {
            let keys =
                values[0]["items"].as_array().unwrap().iter().map(|item| &item["item"]["key"]["hostile"]);
            let keys = keys.map(|key| key.as_str().unwrap()).collect::<Vec<_>>();
            assert!(HOSTILE.iter().all(|name| keys.contains(name)), "parsed JSON has the names: {keys:?}");
        }
    }
}

#[test]
fn a_watcher_prints_nothing_raw() {
    let project = project();
    project.ok(&["build"]);
    let log = project.path("log");
    let mut command = project.command(&["watch", "--once", "--verbose"]);
    command.stdout(fs::File::create(project.path("data")).unwrap());
    let mut child = command.stderr(fs::File::create(&log).unwrap()).spawn().unwrap();
    let printed = || String::from_utf8(fs::read(&log).unwrap()).unwrap();
    let deadline = Instant::now() + TIMEOUT;
    while !["listening to", "polling every"].iter().any(|way| printed().contains(way)) {
        assert!(Instant::now() < deadline, "{}", printed());
        std::thread::sleep(Duration::from_millis(10));
    }
    project.write(&format!("hostile/{}.toml", HOSTILE[2]), "model = \"fo\u{9b}ng\"\n");
    while child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < deadline, "{}", printed());
        std::thread::sleep(Duration::from_millis(10));
    }
    let stdout = fs::read_to_string(project.path("data")).unwrap();
    let run = Run { code: child.wait().unwrap().code(), stdout, stderr: printed() };
    assert_clean("specula watch", &run);
    assert!(
        run.stderr.contains(r"c1\u{9b}31m.toml changed") && run.stderr.contains("FAILED"),
        "{}",
        run.stderr
    );
}

#[test]
fn errors_of_a_manifest_are_drawn_without_its_raw_text() {
    let project = project();
    for (text, shown) in [
        (
            "schema = 1\r\n[stage.a]\r\nkind = \"im\u{202e}port\u{9b}\" # \u{2066}\r\n",
            r#"kind = "im\u{202e}port\u{9b}" # \u{2066}"#,
        ),
        (
            "schema = 1\n[stage.a]\nkind = \"\x1b[31m\x07\" # \x7f\n\"\u{9b}\" = 1",
            r#"kind = "\u{1b}[31m\u{7}" # \u{7f}"#,
        ),
        ("schema = 1\n[stage.\"\\u001b[31m\"]\nkind = \"rotate\"\n", r"\u{1b}[31m"),
        (
            "schema = 1\n[stage.a]\nkind = \"import-material\"\nsource = \"hos\u{202e}tile/*.toml\"\n",
            r"\u{202e}",
        ),
        (
            "schema = 1\n[stage.a]\nkind = \"import-material\"\nsource = \"hostile/\\u001b]0;x\\u0007.toml\"\n",
            r"\u{1b}]0;x\u{7}",
        ),
        ("\u{0}\u{1b}\u{9b}", r"\u{0}\u{1b}\u{9b}"),
    ] {
        project.write("\x1b[32mbad.toml", text);
        for command in ["build", "check", "graph"] {
            let printed = clean(&project, &[command, "--manifest", "\x1b[32mbad.toml"]);
            assert!(printed.contains(r"\u{1b}[32mbad.toml"), "{printed}");
            assert!(printed.contains(shown), "no {shown} in {printed}");
        }
    }
}

#[test]
fn arguments_are_quoted_escaped() {
    let project = project();
    let hostile = "\x1b]0;pwned\x07\u{202e}";
    for command in [
        &[hostile][..],
        &["build", hostile],
        &["build", "--jobs", hostile],
        &["build", &format!("--{hostile}")],
        &["preview", "--item", hostile],
        &["preview", "--still", hostile],
        &["explain", hostile],
        &["verify", hostile],
        &["inspect", hostile],
        &["stages", hostile],
        &["check", "--manifest", hostile],
        &["cache", "stats", "--manifest", &format!("{hostile}/pipeline.toml")],
        &["init", hostile],
    ] {
        let printed = clean(&project, command);
        assert!(printed.contains(r"\u{1b}]0;pwned\u{7}\u{202e}"), "{command:?} prints {printed}");
    }
    assert!(clean(&project, &["--help"]).contains("Usage: specula"));
}
