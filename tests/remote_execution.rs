//! Items that run on the workers of a real server (buildbox-casd, in a sandbox): the same bytes as here, and
//! what becomes of a build whose worker or server fails.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::casd::{SANDBOX_PATH, Server, assert_as_alone, assert_same, built, warnings};
use crate::support::{Project, SMALL, files_below, ran, uniform};

/// How many items ran, and how many of them elsewhere.
fn counts(summary: &serde_json::Value) -> [u64; 2] {
    ["ran", "ran_elsewhere"].map(|count| summary[count].as_u64().unwrap())
}

fn build_on(project: &Project, server: &Server) -> (serde_json::Value, Vec<serde_json::Value>) {
    let [executor, program] = server.executor();
    built(project, &[&executor, &program])
}

/// What `explain --json` says of where an item ran.
fn place(project: &Project, item: &str) -> serde_json::Value {
    let run = project.ok(&["explain", item, "--json"]);
    let found = serde_json::from_str::<serde_json::Value>(&run.stdout).unwrap();
    found["items"][0]["last"]["place"].clone()
}

#[test]
fn items_run_on_workers_with_the_same_bytes() {
    let Some(server) = Server::with_workers("items_run_on_workers") else { return };
    let (here, there) = (Project::small(), Project::small());
    here.ok(&["build"]);
    let (summary, events) = build_on(&there, &server);
    let [ran, elsewhere] = counts(&summary);
    assert!(ran > 20 && ran == elsewhere, "{summary}");
    assert_eq!(warnings(&events), [""; 0]);
    assert_same(&there.outputs(), &here.outputs(), 0);
    // What nobody here needs stays there.
    let count = |project: &Project| files_below(&project.path(".specula/blobs")).len();
    assert!(count(&there) < count(&here), "{} {}", count(&there), count(&here));
    let explained = there.ok(&["explain", "map [studio, gold]"]).stdout;
    assert!(explained.contains(&format!("of 127.0.0.1:{}", server.port())), "{explained}");

    // The next machine takes the results, whether it asks workers or not.
    let next = Project::small();
    let (summary, _) = built(&next, &[&server.address()]);
    assert_eq!((counts(&summary), &summary["shared"]), ([0, 0], &ran.into()), "{summary}");
    assert_same(&next.outputs(), &here.outputs(), 0);
    // Again nothing to do, although most results are only on the server.
    let (summary, _) = build_on(&there, &server);
    assert_eq!(counts(&summary), [0, 0], "{summary}");
}

/// Two folders ask for the same actions, byte for byte, so that a server runs each once.
#[test]
fn two_machines_send_the_same_actions() {
    let Some(server) = Server::with_workers("two_machines_send_the_same_actions") else { return };
    let [executor, program] = server.executor();
    // Neither stores results under the keys of items: what is known afterwards are the actions themselves.
    let options = [&*executor, &*program, "--remote-upload=never"];
    let (one, two) = (Project::small(), Project::small());
    let (first, _) = built(&one, &options);
    let known = server.actions();
    let (second, _) = built(&two, &options);
    assert!(counts(&first)[1] > 20 && counts(&second) == counts(&first), "{first} {second}");
    assert_eq!(server.actions(), known);
    assert_same(&two.outputs(), &one.outputs(), 0);
}

#[test]
fn the_program_is_sent_if_workers_do_not_have_it() {
    let Some(server) = Server::with_workers("the_program_is_sent") else { return };
    let project = Project::small();
    let (summary, events) = built(&project, &[&format!("--remote-executor={}", server.url())]);
    let [ran, elsewhere] = counts(&summary);
    assert_eq!((ran, warnings(&events)), (elsewhere, vec![""; 0]), "{summary}");
    // Once, however many items run at a time.
    let size = std::fs::metadata(env!("CARGO_BIN_EXE_specula")).unwrap().len();
    let sent = summary["shared_traffic"]["sent"].as_u64().unwrap();
    assert!((size..size + size / 4 + (4 << 20)).contains(&sent), "{sent} of {size}");
}

#[test]
fn an_edit_runs_elsewhere_what_it_affects() {
    let Some(server) = Server::with_workers("an_edit_runs_elsewhere") else { return };
    let (here, there) = (Project::small(), Project::small());
    build_on(&there, &server);
    for project in [&here, &there] {
        project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 9\n");
    }
    let (_, events) = build_on(&there, &server);
    let expected = ["coefficients", "faces", "map", "material", "reflection"];
    assert_eq!(ran(&events).into_iter().collect::<Vec<_>>(), expected.map(|stage| (stage.to_owned(), 1)));
    here.ok(&["build"]);
    assert_same(&there.outputs(), &here.outputs(), 0);
}

/// A file that another names is found in a second attempt.
#[test]
fn files_that_are_found_on_the_way_are_sent() {
    let Some(server) = Server::with_workers("files_that_are_found_on_the_way") else { return };
    let manifest = "schema = 1\n[stage.material]\nkind = \"import-material\"\nsource = \"paints/red.toml\"\n\
                    [stage.coefficients]\nkind = \"project-brdf\"\ninput = \"material\"\ndegree = [4, 0]\n";
    let project = Project::new(manifest);
    project.write("paints/red.toml", "model = \"measured\"\nfile = \"../tables/red.csv\"\n");
    let mut text = String::from("theta_i,theta_o,phi,r,g,b\n");
    for incident in [0, 30, 60, 89] {
        for outgoing in [0, 30, 60, 89] {
            for phi in [0, 60, 120, 180] {
                text += &format!("{incident},{outgoing},{phi},0.1,0.1,0.1\n");
            }
        }
    }
    project.write("tables/red.csv", &text);
    let (summary, _) = build_on(&project, &server);
    assert_eq!(counts(&summary), [2, 2], "{summary}");
    // Its content decides, also when it is the only change.
    project.write("tables/red.csv", &text.replace("0.1,0.1,0.1", "0.2,0.1,0.1"));
    let (summary, _) = build_on(&project, &server);
    assert_eq!(counts(&summary), [2, 2], "{summary}");
}

#[test]
fn what_the_server_has_forgotten_is_made_again() {
    let Some(server) = Server::with_workers("what_the_server_has_forgotten") else { return };
    let (here, there) = (Project::small(), Project::small());
    build_on(&there, &server);
    server.blobs().iter().for_each(|blob| std::fs::remove_file(blob).unwrap());
    // Needs inputs that were never here, and that nobody has any more.
    for project in [&here, &there] {
        project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 9\n");
    }
    let (summary, events) = build_on(&there, &server);
    assert_eq!(summary["failed"], 0, "{events:#?}");
    here.ok(&["build"]);
    assert_same(&there.outputs(), &here.outputs(), 0);
}

#[test]
fn a_failure_says_what_is_wrong_and_where() {
    let Some(server) = Server::with_workers("a_failure_says_what_is_wrong") else { return };
    let project = Project::small();
    project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = \"nine\"\n");
    let [executor, program] = server.executor();
    for _ in 0..2 {
        let run = project.specula(&["build", &executor, &program]).ends(1, []);
        for expected in
            ["material [gold] failed", "source assets/materials/gold.toml", "of 127.0.0.1:", "exponent"]
        {
            assert!(run.stderr.contains(expected), "{expected}: {}", run.stderr);
        }
        assert!(!run.stderr.contains("/files/"), "no path of the worker: {}", run.stderr);
    }
    // Mended, it runs: the server's memory of the failure is not in the way.
    project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 9\n");
    let (summary, _) = build_on(&project, &server);
    assert_eq!(summary["failed"], 0, "{summary}");
}

const EXEC: &str = r#"
schema = 1
out = "out"
[stage.environment]
kind = "import-environment"
source = "assets/environments/studio.exr"
resolution = 32
[stage.note]
kind = "exec"
command = ["python3", "tools/note.py", "{input.environment}", "{output}"]
inputs = { environment = "environment" }
output = { type = "file", format = "txt" }
remote = true
path = "note"
"#;

#[test]
fn programs_of_the_project_run_there_if_the_manifest_says_so() {
    let Some(server) = Server::with_workers("programs_of_the_project") else { return };
    if Command::new("/usr/bin/python3").arg("--version").output().is_err() {
        return test_data::skip("programs_of_the_project", "there is no /usr/bin/python3");
    }
    let script = "import sys, os\nsize = os.path.getsize(sys.argv[1])\n\
                  open(sys.argv[2], 'w').write(f'{size} bytes')\n";
    let project = |manifest: &str| {
        let project = Project::small().with_search_path(SANDBOX_PATH);
        project.write("tools/note.py", script);
        project.write("pipeline.toml", manifest);
        project
    };
    let (there, here) = (project(EXEC), project(&EXEC.replace("remote = true\n", "")));
    let (summary, events) = build_on(&there, &server);
    assert_eq!(counts(&summary), [2, 2], "{summary} {events:#?}");
    let (summary, _) = build_on(&here, &server);
    assert_eq!(counts(&summary), [1, 0], "the environment is in the cache: {summary}");
    assert_eq!(there.outputs()["note.txt"], here.outputs()["note.txt"]);
    let because = place(&here, "note")["here"]["because"].clone();
    assert_eq!(because, "exec runs only on the machine of the build");
    // A worker with other properties does not exist.
    let wanted = "remote = true\nplatform = { OSFamily = \"plan9\" }";
    let other = project(&EXEC.replace("remote = true", wanted));
    let (summary, events) = build_on(&other, &server);
    assert_eq!(summary["failed"], 0, "{events:#?}");
    assert_eq!(other.outputs()["note.txt"], here.outputs()["note.txt"]);
}

#[test]
fn large_sources_are_read_here() {
    let Some(server) = Server::with_workers("large_sources_are_read_here") else { return };
    let project = Project::small();
    let [executor, program] = server.executor();
    let (summary, _) = built(&project, &[&executor, &program, "--remote-source-limit=0"]);
    let [ran, elsewhere] = counts(&summary);
    assert!(0 < elsewhere && elsewhere < ran, "{summary}");
    let explained = project.ok(&["explain", "environment [studio]"]).stdout;
    assert!(explained.contains("runs on this machine only: it reads 1 MiB of files"), "{explained}");
}

#[test]
fn a_program_that_does_not_run_there_is_said_once() {
    let Some(server) = Server::with_workers("a_program_that_does_not_run") else { return };
    let project = Project::small();
    let [executor, _] = server.executor();
    let (summary, events) = built(&project, &[&executor, "--remote-program=/nowhere/specula"]);
    let [ran, elsewhere] = counts(&summary);
    assert!(ran > 20 && elsewhere == 0, "{summary}");
    let [warning] = warnings(&events)[..] else { panic!("{:?}", warnings(&events)) };
    assert!(warning.ends_with("; items that cannot run there run on this machine"), "{warning}");
    let other = Project::small();
    other.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degree = 7\n"));
    let run = other.specula(&["build", &executor, "--remote-program=/nowhere/specula", "--remote-required"]);
    assert_eq!(run.code, Some(4), "{}", run.stderr);
}

#[test]
fn a_server_without_workers_is_only_a_cache() {
    let Some(server) = Server::start("a_server_without_workers") else { return };
    let project = Project::small();
    let (summary, events) = build_on(&project, &server);
    assert_eq!((counts(&summary)[1], &summary["failed"]), (0, &0.into()), "{summary}");
    let [warning] = warnings(&events)[..] else { panic!("{:?}", warnings(&events)) };
    let expected =
        format!("{} runs no actions; items that cannot run there run on this machine", server.url());
    assert_eq!(warning, expected);
    let (summary, events) = build_on(&Project::small(), &server);
    assert_eq!((&summary["ran"], warnings(&events)), (&0.into(), vec![]), "{summary}");
    let other = Project::small();
    other.write("pipeline.toml", &SMALL.replace("degree = 8\n", "degree = 7\n"));
    let [executor, program] = server.executor();
    other.specula(&["build", &executor, &program, "--remote-required"]).ends(4, ["runs no actions"]);
}

/// The programs of workers that run now in the sandboxes of a server.
fn working() -> Vec<PathBuf> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten().map(|entry| entry.path());
    let is_ours = |process: &PathBuf| {
        let line = std::fs::read(process.join("cmdline")).unwrap_or_default();
        let line = String::from_utf8_lossy(&line).into_owned();
        line.starts_with("/opt/specula/specula\0run-item")
    };
    processes.filter(is_ours).collect()
}

/// A stage that takes long, so that it can be stopped.
const LONG_STAGE: &str = r#"
schema = 1
[stage.slow]
kind = "exec"
command = ["python3", "-c", "import time; time.sleep(300)", "{output}"]
output = { type = "file", format = "txt" }
timeout = 400.0
remote = true
path = "slow"
"#;

#[test]
#[cfg(unix)]
fn a_build_that_is_stopped_stops_its_workers() {
    let Some(server) = Server::with_workers("a_build_that_is_stopped") else { return };
    let project = Project::new(LONG_STAGE).with_search_path(SANDBOX_PATH);
    let [executor, program] = server.executor();
    let mut command = project.command(&["build", &executor, &program]);
    let build = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until("an item runs", || !working().is_empty());
    let stopped = Instant::now();
    assert!(Command::new("kill").args(["-INT", &build.id().to_string()]).status().unwrap().success());
    let end = build.wait_with_output().unwrap();
    assert_eq!(end.status.code(), Some(130), "{}", String::from_utf8_lossy(&end.stderr));
    wait_until("nothing runs any more", || working().is_empty());
    eprintln!("stopped after {:.2} s", stopped.elapsed().as_secs_f64());
}

/// Kills the worker's program once: the item is sent again.
#[test]
#[cfg(unix)]
fn an_item_whose_worker_is_lost_runs_again() {
    let Some(server) = Server::with_workers("an_item_whose_worker_is_lost") else { return };
    let manifest = LONG_STAGE
        .replace("time.sleep(300)", "time.sleep(3); open(__import__('sys').argv[1], 'w').write('done')");
    let project = Project::new(&manifest).with_search_path(SANDBOX_PATH);
    let [executor, program] = server.executor();
    let mut command = project.command(&["build", "--json", &executor, &program]);
    let build = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until("an item runs", || !working().is_empty());
    for process in working() {
        let id = process.file_name().unwrap().to_str().unwrap().to_owned();
        let _ = Command::new("kill").args(["-KILL", &id]).status();
    }
    let end = build.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&end.stdout).into_owned();
    assert!(end.status.success(), "{text}");
    let summary: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(counts(&summary), [1, 1], "{text}");
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !is_so() {
        assert!(Instant::now() < deadline, "{what}: waited for a minute");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Kills the server with its workers at random moments of builds, and starts it again or not.
#[test]
fn a_server_that_is_killed_costs_no_result() {
    const TEST: &str = "remote_execution::a_server_that_is_killed";
    let Some(mut server) = Server::with_workers(TEST) else { return };
    let clean = Project::small();
    clean.ok(&["build"]);
    let expected = clean.outputs();
    let start = Instant::now();
    build_on(&Project::small(), &server);
    let whole = start.elapsed();
    let [executor, program] = server.executor();
    for round in 0..test_data::length(TEST, "kills", 20, 4) {
        // Each round has another light, so that there is something to run.
        let project = Project::new(&SMALL.replace("degree = 8\n", &format!("degree = {}\n", 9 + round % 20)));
        let build = project.command(&["build", &executor, &program]).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(whole.mul_f64(1.2 * uniform(round)));
        server.kill();
        if round % 2 == 0 {
            server.restart();
        }
        let output = build.wait_with_output().unwrap();
        assert!(output.status.success(), "round {round}: {}", String::from_utf8_lossy(&output.stderr));
        if round % 5 == 0 {
            assert_as_alone(&project, round);
        }
        if round % 2 == 1 {
            server.restart();
        }
    }
    let last = Project::small();
    build_on(&last, &server);
    assert_same(&last.outputs(), &expected, 0);
}

#[test]
fn a_folder_without_an_item_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = |text: Option<&str>| {
        if let Some(text) = text {
            std::fs::write(folder.path().join("item.json"), text).unwrap();
        }
        let mut command = Command::new(env!("CARGO_BIN_EXE_specula"));
        let output = command.args(["run-item", "item.json"]).current_dir(folder.path()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, text) = run(None);
    assert!(code == Some(4) && text.contains("item.json"), "{code:?} {text}");
    for text in ["", "{", "[]", "{\"format\": 99}", "{\"format\": 1, \"version\": \"0.0.1\"}"] {
        let (code, said) = run(Some(text));
        assert!(code == Some(4) && said.contains("item.json"), "{text:?}: {code:?} {said}");
    }
    assert!(!Path::new("outputs").exists());
}
