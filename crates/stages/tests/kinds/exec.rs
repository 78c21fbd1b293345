//! External programs, run by the engine: what they see, when they rerun, how they fail.
//!
//! The programs are lines of `sh`, which every Unix has.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread::sleep;
use std::time::{Duration, Instant};

use engine::{BuildOptions, Cancel, Event, Plan, Reason, Summary};
use envmap::Image;
use stages::artifacts::Mesh;
use tempfile::TempDir;

use crate::fixture::{case, environment, exr, kinds, pixels, sky};

#[cfg(unix)]
mod tools;

/// A manifest of one environment for each file, and a stage `graded` that its lines complete.
fn manifest(graded: &str) -> String {
    format!(
        r#"
schema = 1

[stage.sky]
kind = "import-environment"
source = "skies/*.exr"

[stage.graded]
kind = "exec"
{graded}
"#
    )
}

/// A project in a folder of its own.
struct Project {
    folder: TempDir,
    cancel: Cancel,
}

/// The events of a build.
struct Built {
    events: Vec<Event>,
    summary: Summary,
}

impl Project {
    /// With skies `a` (all 1) and `b` (all 2), and files by name and text.
    fn new(graded: &str, files: &[(&str, &str)]) -> Self {
        let project = Self { folder: tempfile::tempdir().unwrap(), cancel: Cancel::default() };
        project.write("pipeline.toml", manifest(graded).as_bytes());
        project.write("skies/a.exr", &exr(16, 8, vec![[1.0; 3]; 128]));
        project.write("skies/b.exr", &exr(16, 8, vec![[2.0; 3]; 128]));
        for (name, text) in files {
            project.write(name, text.as_bytes());
        }
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().canonicalize().unwrap().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn plan(&self) -> Result<Plan, engine::Diagnostics> {
        Plan::load(&self.path("pipeline.toml"), &kinds())
    }

    /// The errors of the manifest, one per line.
    fn errors(&self) -> String {
        self.plan().err().unwrap().to_string()
    }

    fn build(&self) -> Built {
        let options = BuildOptions { jobs: Some(2), keep_going: true, ..BuildOptions::default() };
        self.build_plan(&self.plan().unwrap(), options)
    }

    fn build_plan(&self, plan: &Plan, options: BuildOptions) -> Built {
        let events = Mutex::new(Vec::new());
        let record = |event| events.lock().unwrap().push(event);
        let summary = engine::build(plan, &options, &self.cancel, &record).unwrap();
        // No scratch folder is left, whatever happened.
        let left: Vec<_> = fs::read_dir(self.path(".specula/tmp")).unwrap().collect();
        assert!(left.is_empty(), "{left:?}");
        Built { events: events.into_inner().unwrap(), summary }
    }
}

impl Built {
    /// Each item of `graded` that ran, with the reasons.
    fn graded(&self) -> Vec<(String, Vec<Reason>)> {
        let started = self.events.iter().filter_map(|event| match event {
            Event::Started { item, reasons, .. } if item.stage == "graded" => {
                Some((item.to_string(), reasons.clone()))
            }
            _ => None,
        });
        started.collect()
    }

    /// Each failure with its whole chain and what to do.
    fn failures(&self) -> Vec<String> {
        let failed = self.events.iter().filter_map(|event| match event {
            Event::Failed { item, error, help } => {
                Some(format!("{item}: {}: {}", error.join(": "), help.clone().unwrap_or_default()))
            }
            _ => None,
        });
        failed.collect()
    }
}

/// A stage that publishes a text that a program wrote.
const SCRIPT: &str = r#"
command = ["sh", "tools/tool.sh", "{input}", "{output}"]
input = "sky"
output = { type = "file", format = "txt" }
"#;

#[test]
fn a_program_grades_an_environment() {
    // EXPOSURE of a Radiance header divides, so the second is twice as bright as the first.
    let graded = |script: &str| {
        let parameters = format!(
            "command = [\"sh\", \"-c\", {script:?}, \"sh\", \"{{input.sky}}\", \"{{output}}\"]
            formats = {{ sky = \"hdr\" }}
            output = {{ type = \"environment\", format = \"hdr\" }}"
        );
        case("exec", &parameters)
            .input("sky", environment(8, sky))
            .artifact::<stages::artifacts::Environment>()
    };
    let same = graded("cp $1 $2");
    let twice = graded("(head -n 1 $1; echo EXPOSURE=0.5; tail -n +2 $1) > $2");
    let original = environment(8, sky);
    for ((same, twice), original) in same.0.pixels().iter().zip(twice.0.pixels()).zip(original.0.pixels()) {
        for channel in 0..3 {
            assert_eq!(twice[channel], 2.0 * same[channel]);
            // RGBE has 8 bits for the largest channel, which is at most 2.
            assert!((same[channel] - original[channel]).abs() <= 2.0 / 256.0);
        }
    }
}

#[test]
fn a_scratch_folder_that_cannot_be_made_is_an_error_of_the_system_and_a_program_that_fails_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let failure = |command: &str, scratch: &str| {
        let parameters = format!(
            "command = [\"{command}\", \"{{input.sky}}\", \"{{output}}\"]
            output = {{ type = \"environment\" }}"
        );
        let case = case("exec", &parameters).input("sky", environment(8, sky));
        case.scratch(folder.path().join(scratch)).run().err().unwrap()
    };
    let refused = failure("cp", "missing");
    assert!(
        refused.system_error && refused.to_string().contains("cannot create a scratch folder"),
        "{refused}"
    );
    let failed = failure("false", "");
    assert!(!failed.system_error, "{failed}");
}

#[test]
fn an_environment_goes_out_as_openexr_and_comes_back_bit_for_bit() {
    let sent = environment(8, |w| [w.x.abs() * 1e-6, 1e6 + w.y, w.z.abs()]);
    let back = case(
        "exec",
        "command = [\"sh\", \"-c\", \"head -c 4 $0 | od -An -tx1 | grep -q '76 2f 31 01' && cp $0 $1\", \
                    \"{input}\", \"{output}\"]
        output = { type = \"environment\" }",
    )
    .input("input", sent.clone());
    assert_eq!(*back.artifact::<stages::artifacts::Environment>(), sent);
}

#[test]
fn coefficients_travel_as_safetensors_or_json() {
    for (formats, format, begins) in
        [("{}", "safetensors", "__metadata__"), ("{ input = \"json\" }", "json", "\\\"preset\\\"")]
    {
        let parameters = format!(
            "command = [\"sh\", \"-c\", \"grep -q {begins} $0 && cp $0 $1\", \"{{input}}\", \"{{output}}\"]
            formats = {formats}
            output = {{ type = \"lighting\", format = \"{format}\" }}"
        );
        let sent = crate::fixture::sky_lighting();
        let back = case("exec", &parameters).input("input", sent.clone());
        assert_eq!(*back.artifact::<stages::artifacts::Lighting>(), sent);
    }
}

#[test]
fn a_mesh_travels_as_safetensors() {
    let parameters = "command = [\"sh\", \"-c\", \"cp $0 $1\", \"{input.mesh}\", \"{output}\"]
        output = { type = \"mesh\" }";
    let knot = mesh::shape("torus-knot").unwrap();
    let copied = case("exec", parameters).input("mesh", Mesh(knot.clone())).artifact::<Mesh>();
    assert_eq!(copied.0, knot);
    let exec = kinds().get("exec").unwrap().ports_named(&["mesh"]);
    assert!(exec[0].takes("mesh") && exec[0].takes("a-type-of-a-studio"), "{exec:?}");
}

#[test]
fn only_a_tool_that_is_edited_reruns() {
    let stage = format!("{SCRIPT}\ntools = [\"tools/lib\"]\n");
    let script = "cat \"$(dirname \"$0\")/lib/words\" > $2";
    let files = [("tools/tool.sh", script), ("tools/lib/words", "one"), ("tools/lib/.words.swp", "")];
    let project = Project::new(&stage, &files);
    assert_eq!(project.build().summary.ran, 4);
    assert_eq!(project.read("out/graded/a.txt"), "one");
    assert!(project.read("out/graded/a.txt.json").contains("\"exec\""), "the recipe is beside it");
    assert_eq!(project.build().summary.ran, 0, "nothing changed");

    project.write("tools/lib/words", b"two");
    let built = project.build();
    let reasons: Vec<_> = built.graded().into_iter().flat_map(|(_, reasons)| reasons).collect();
    let is_words = |reason: &Reason| matches!(reason, Reason::File { path, .. } if path == "tools/lib/words");
    assert!(reasons.len() == 2 && reasons.iter().all(is_words), "{reasons:?}");
    assert_eq!(project.read("out/graded/b.txt"), "two");

    project.write("tools/tool.sh", b"echo three > $2");
    assert_eq!(project.build().graded().len(), 2);
    assert_eq!(project.read("out/graded/b.txt"), "three\n");

    project.write("skies/b.exr", &exr(16, 8, vec![[3.0; 3]; 128]));
    assert_eq!(project.build().graded().len(), 1, "only the item whose input changed");
}

#[test]
fn an_equal_result_stops_later_stages() {
    let stage = r#"
command = ["sh", "tool.sh", "{input}", "{output}"]
input = "sky"
output = { type = "environment" }

[stage.lighting]
kind = "project-sh"
input = "graded"
degree = 1
"#;
    let project = Project::new(stage, &[("tool.sh", "cp $1 $2")]);
    assert_eq!(project.build().summary.ran, 6);
    project.write("tool.sh", b"cat $1 > $2");
    assert_eq!(project.build().summary.ran, 2, "the tool's items alone");
}

#[test]
fn a_failing_program_fails_only_its_item_and_its_output_is_shown() {
    // One file is larger than the other; its size is all that a shell can see of it.
    let script = "if [ $(wc -c < $1) -gt 20000 ]; then echo 'no luck' >&2; exit 3; fi; echo good > $2";
    let stage = format!("{SCRIPT}\nformats = {{ input = \"safetensors\" }}");
    let project = Project::new(&stage, &[("tools/tool.sh", script)]);
    project.write("skies/b.exr", &exr(64, 32, (0..2048).map(|i| [i as f32, 1.0, 0.5]).collect()));
    let built = project.build();
    let failures = built.failures();
    assert_eq!((built.summary.failed, failures.len()), (1, 1));
    for word in ["graded [b]", "sh tools/tool.sh", "exit status: 3", "standard error", "no luck"] {
        assert!(failures[0].contains(word), "no {word:?} in {}", failures[0]);
    }
    assert_eq!(project.read("out/graded/a.txt"), "good\n");
    // Failures are not remembered: it is tried again.
    assert_eq!(project.build().graded().len(), 1);
}

#[test]
fn an_invalid_output_is_reported() {
    let nan = exr(4, 2, vec![[f32::NAN; 3]; 8]);
    let wide = exr(4, 4, vec![[1.0; 3]; 16]);
    let whole = exr(4, 2, vec![[1.0; 3]; 8]);
    let image = Image::new(4, 2, vec![[1.0; 3]; 8]).unwrap();
    let radiance = containers::write_rgbe(&image, None).unwrap().bytes;
    let cases: [(&str, &[u8], &[&str]); 8] = [
        ("true", b"", &["succeeded", "did not write output.exr"]),
        ("echo whole > $1; kill -9 $$", b"", &["ended with signal: 9"]),
        (": > $1", b"", &["output.exr", "empty"]),
        ("mkdir $1", b"", &["not a regular file"]),
        ("cp $0 $1", &whole[..whole.len() / 2], &["did not write a valid environment"]),
        ("cp $0 $1", &nan, &["NaN", "finite"]),
        ("cp $0 $1", &wide, &["4 x 4"]),
        ("cp $0 $1", &radiance, &["Radiance, not OpenEXR"]),
    ];
    for (script, file, words) in cases {
        let stage = format!(
            "command = [\"sh\", \"-c\", {script:?}, \"file\", \"{{output}}\"]\noutput = {{ type = \"environment\" }}"
        );
        let project = Project::new(&stage, &[]);
        project.write("file", file);
        let failures = project.build().failures();
        assert_eq!(failures.len(), 1, "{script}");
        for word in words {
            assert!(failures[0].contains(word), "no {word:?} in {}", failures[0]);
        }
    }
}

#[test]
fn a_missing_program_is_reported_and_found_when_it_appears() {
    let stage = "command = [\"specula-has-no-such-tool\", \"{output}\"]\noutput = { type = \"file\", format = \"txt\" }";
    let failure = Project::new(stage, &[]).build().failures().remove(0);
    assert!(failure.contains("there is no program \"specula-has-no-such-tool\" in PATH"), "{failure}");

    let stage =
        "command = [\"sh\", \"tools/late.sh\", \"{output}\"]\noutput = { type = \"file\", format = \"txt\" }";
    let project = Project::new(stage, &[]);
    assert_eq!(project.build().summary.failed, 1);
    project.write("tools/late.sh", b"echo here > $1");
    assert_eq!(project.build().summary.failed, 0);
    assert_eq!(project.read("out/graded.txt"), "here\n");
}

#[test]
fn only_named_variables_are_in_the_environment() {
    // Cargo sets several variables for tests: one is named, the others must not arrive.
    let stage = r#"
command = ["sh", "-c", "env > $0; pwd >> $0; cat >> $0", "{output}"]
output = { type = "file", format = "txt" }
env = ["CARGO_PKG_NAME", "SPECULA_NOT_SET"]
"#;
    let project = Project::new(stage, &[]);
    let built = project.build();
    let warned = |event: &Event| matches!(event, Event::Warning { message, .. } if message.contains("SPECULA_NOT_SET"));
    assert!(built.events.iter().any(warned));
    let text = project.read("out/graded.txt");
    let value = |name: &str| text.lines().find_map(|line| line.strip_prefix(&format!("{name}=")));
    assert_eq!(value("CARGO_PKG_NAME"), Some("stages"));
    assert_eq!(value("LANG"), Some("C.UTF-8"));
    let scratch = project.path(".specula/tmp");
    for name in ["HOME", "TMPDIR"] {
        assert!(Path::new(value(name).unwrap()).starts_with(&scratch), "{text}");
    }
    // A shell adds these of its own.
    let known = [
        "CARGO_PKG_NAME",
        "PATH",
        "HOME",
        "TMPDIR",
        "TEMP",
        "TMP",
        "LANG",
        "TZ",
        "SOURCE_DATE_EPOCH",
        "PYTHONHASHSEED",
        "PYTHONDONTWRITEBYTECODE",
        "PWD",
        "OLDPWD",
        "SHLVL",
        "_",
    ];
    for line in text.lines().filter(|line| line.contains('=')) {
        assert!(known.contains(&line.split('=').next().unwrap()), "{line}");
    }
    let recipe = project.read("out/graded.txt.json");
    assert!(
        recipe.contains("CARGO_PKG_NAME") && !recipe.contains("\"stages\""),
        "a digest, not the value: {recipe}"
    );
}

/// A child that outlives its parent unless the whole group is killed; it notes its process.
const LINGERS: &str = "sleep 600 & echo $! > {folder}/child; wait";

fn is_alive(process: &str) -> bool {
    let probe = Command::new("sh").args(["-c", &format!("kill -0 {process} 2>/dev/null")]).status();
    probe.unwrap().success() && !is_zombie(process)
}

/// If no process waits for orphans (as in some containers), a killed process stays in the list.
fn is_zombie(process: &str) -> bool {
    let state = Command::new("ps").args(["-o", "stat=", "-p", process]).output();
    state.is_ok_and(|state| String::from_utf8_lossy(&state.stdout).trim_start().starts_with('Z'))
}

fn wait_for(what: &str, condition: impl Fn() -> bool) {
    let began = Instant::now();
    while !condition() {
        assert!(began.elapsed() < Duration::from_secs(60), "waited for {what}");
        sleep(Duration::from_millis(10));
    }
}

#[test]
fn after_the_timeout_all_processes_are_killed() {
    let stage = format!(
        "command = [\"sh\", \"-c\", \"{LINGERS}\", \"{{output}}\"]\noutput = {{ type = \"file\", format = \"txt\" }}\ntimeout = 2"
    );
    let project = Project::new(&stage, &[]);
    let failure = project.build().failures().remove(0);
    assert!(failure.contains("did not end within 2 s") && failure.contains("raise timeout"), "{failure}");
    let child = project.read("child").trim().to_owned();
    wait_for("the child's end", || !is_alive(&child));
}

#[test]
fn processes_that_a_program_leaves_running_are_killed_without_delay() {
    let script = "sleep 600 & echo $! > {folder}/child; echo done > $0";
    let stage = format!(
        "command = [\"sh\", \"-c\", \"{script}\", \"{{output}}\"]\noutput = {{ type = \"file\", format = \"txt\" }}"
    );
    let project = Project::new(&stage, &[]);
    assert_eq!(project.build().summary.failed, 0);
    let child = project.read("child").trim().to_owned();
    wait_for("the child's end", || !is_alive(&child));
}

#[test]
fn a_cancelled_build_kills_the_program() {
    let stage = format!(
        "command = [\"sh\", \"-c\", \"{LINGERS}\", \"{{output}}\"]\noutput = {{ type = \"file\", format = \"txt\" }}\ntimeout = 600"
    );
    let project = Project::new(&stage, &[]);
    let child = project.path("child");
    std::thread::scope(|scope| {
        scope.spawn(|| {
            wait_for("the child's beginning", || {
                fs::read_to_string(&child).is_ok_and(|text| text.ends_with('\n'))
            });
            project.cancel.cancel();
        });
        let built = project.build();
        assert!(built.summary.cancelled && built.failures().is_empty());
    });
    let child = project.read("child").trim().to_owned();
    wait_for("the child's end", || !is_alive(&child));
}

#[test]
fn a_program_that_never_stops_writing_is_killed() {
    let stage = "command = [\"sh\", \"-c\", \"yes 0123456789012345678901234567890123456789\", \"{output}\"]
        output = { type = \"file\", format = \"txt\" }\ntimeout = 600";
    let failure = Project::new(stage, &[]).build().failures().remove(0);
    assert!(failure.contains("more than 64 MiB to standard output"), "{failure}");
}

#[test]
fn several_files_are_published_with_their_recipe() {
    let stage = r#"
command = ["sh", "-c", "for f in a b; do echo $f > $0/$f.txt; done", "{output}"]
output = { type = "files", names = ["a.txt", "b.txt"] }
path = "set"
"#;
    let project = Project::new(stage, &[]);
    assert_eq!(project.build().summary.published, 3);
    assert_eq!(project.read("out/set/b.txt"), "b\n");
    assert!(project.read("out/set/recipe.json").contains("exec"));
}

#[test]
fn mismatches_are_reported_before_anything_runs() {
    let sky = "inputs = { sky = \"sky\" }\noutput = { type = \"environment\" }\n";
    let cases = [
        (
            format!("command = [\"t\", \"{{input.sly}}\", \"{{output}}\"]\n{sky}"),
            "pipeline.toml:10:11: command: {input.sly} is not an input of the stage: inputs has sky; did you mean {input.sky}?",
        ),
        (format!("command = [\"t\", \"{{output}}\"]\n{sky}"), "the input \"sky\" is not used"),
        (format!("command = [\"t\", \"{{input.sky}}\"]\n{sky}"), "no argument is \"{output}\""),
        (format!("command = [\"t\", \"{{input.sky}}\", \"{{outptu}}\"]\n{sky}"), "did you mean {output}?"),
        (
            format!(
                "command = [\"t\", \"{{input.sky}}\", \"{{output}}\"]\nformats = {{ sky = \"json\" }}\n{sky}"
            ),
            "sky is environment: expected \"exr\" or \"hdr\" or \"safetensors\", not \"json\"",
        ),
        (
            format!(
                "command = [\"t\", \"{{input.sky}}\", \"{{output}}\"]\nformats = {{ sly = \"exr\" }}\n{sky}"
            ),
            "no input \"sly\"",
        ),
        (format!("command = [\"t\", \"{{input.sky}}\", \"{{output}}\"]\ntimeout = 0\n{sky}"), "timeout: 0"),
        (
            "command = [\"t\", \"{output}\"]\noutput = { type = \"environmint\" }".into(),
            "did you mean \"environment\"?",
        ),
        (
            "command = [\"t\", \"{output}\"]\noutput = { type = \"lighting\", format = \"exr\" }".into(),
            "\"exr\" is not \"safetensors\" or \"json\"",
        ),
        ("command = [\"t\", \"{output}\"]\noutput = { type = \"file\" }".into(), "\"format\" is missing"),
        (
            "command = [\"t\", \"{output}\"]\noutput = { type = \"files\", names = [\"../x\"] }".into(),
            "\"../x\" is not a valid file name",
        ),
        (
            "command = [\"t\", \"{output}\"]\noutput = { type = \"files\", names = [\"x\", \"X\"] }".into(),
            "is listed twice",
        ),
        (
            "command = [\"t\", \"{input}\", \"{output}\"]\noutput = { type = \"brdf\" }".into(),
            "the stage has no inputs",
        ),
    ];
    for (stage, expected) in cases {
        let errors = Project::new(&stage, &[]).errors();
        assert!(errors.contains(expected), "no {expected:?} in {errors}\n{stage}");
    }
}

#[test]
fn no_argument_changes_between_runs() {
    let stage = r#"
command = ["sh", "-c", "echo $* > $2", "sh", "{input}", "{output}"]
input = "sky"
output = { type = "file", format = "txt" }
"#;
    let project = Project::new(stage, &[]);
    project.build();
    assert_eq!(project.read("out/graded/a.txt"), "input/input.exr output.txt\n");
    assert_eq!(project.read("out/graded/b.txt"), "input/input.exr output.txt\n");
}

#[test]
fn a_picture_is_published_as_the_program_wrote_it() {
    let stage = r#"
command = ["sh", "-c", "cp $0 $1", "{input}", "{output}"]
input = "sky"
output = { type = "file", format = "exr" }
"#;
    let project = Project::new(stage, &[]);
    project.build();
    let (width, height, colours) = pixels(&fs::read(project.path("out/graded/b.exr")).unwrap());
    assert_eq!((width, height, colours), (16, 8, vec![[2.0; 3]; 128]));
}
