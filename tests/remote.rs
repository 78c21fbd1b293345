//! A cache that machines share, on a real server (buildbox-casd): what is found, what is received, and what
//! becomes of a build whose server is gone, forgetful or wrong.

use std::fs;
use std::process::Stdio;
use std::time::Instant;

use crate::support::casd::{Server, assert_as_alone, assert_same, built, warnings};
use crate::support::{Project, SMALL, assert_has, files_below, ran, uniform};

fn blobs_of(project: &Project) -> usize {
    files_below(&project.path(".specula/blobs")).len()
}

#[test]
fn another_folder_runs_nothing_and_receives_only_its_files() {
    let Some(server) = Server::start("another_folder_runs_nothing") else { return };
    let (here, there) = (Project::small(), Project::small());
    let address = server.address();
    let (first, _) = built(&here, &[&address]);
    let items = first["ran"].as_u64().unwrap();
    assert!(items > 20 && first["shared"] == 0, "{first}");
    assert!(first["shared_traffic"]["sent"].as_u64().unwrap() > 0, "{first}");

    let (second, events) = built(&there, &[&address]);
    assert_eq!((&second["ran"], second["shared"].as_u64()), (&0.into(), Some(items)), "{second}");
    assert_eq!(there.outputs(), here.outputs());
    assert_eq!(blobs_of(&there), there.outputs().values().collect::<std::collections::BTreeSet<_>>().len());
    assert!(
        events.iter().filter(|event| event["event"] == "up-to-date").all(|event| event["host"].is_string())
    );
    assert_has(there.ok(&["explain", "map"]).stdout, ["its result came from the cache at 127.0.0.1:"]);
    assert_has(there.ok(&["explain", "map [studio, gold]"]).stdout, ["made by map [studio, gold] on "]);

    // Without the server, nothing is out of date, and what is only there is not missed.
    let (third, _) = built(&there, &[]);
    assert_eq!((&third["ran"], third["up_to_date"].as_u64()), (&0.into(), Some(items)), "{third}");
    there.ok(&["cache", "verify"]);
    let all = Project::small();
    built(&all, &[&address, "--remote-download=all"]);
    let mut left = files_below(&here.path(".specula/blobs"));
    left.retain(|name, _| !all.path(".specula/blobs").join(name).exists());
    // What stands for a file that an item leaves out is on every machine.
    assert!(left.values().all(|bytes| bytes.starts_with(b"specula: this item does not export")), "{left:?}");
}

#[test]
fn an_edit_runs_what_it_affects_on_inputs_that_are_received() {
    let Some(server) = Server::start("an_edit_runs_what_it_affects") else { return };
    let (here, there) = (Project::small(), Project::small());
    let address = server.address();
    built(&here, &[&address]);
    built(&there, &[&address]);
    let edit =
        |project: &Project| project.write("assets/materials/gold.toml", "model = \"phong\"\nexponent = 9\n");
    edit(&there);
    let (_, events) = built(&there, &[&address]);
    let expected = ["coefficients", "faces", "map", "material", "reflection"];
    assert_eq!(ran(&events).into_iter().collect::<Vec<_>>(), expected.map(|stage| (stage.to_owned(), 1)));
    // What it made is found by the other, whose edit is the same.
    edit(&here);
    let (summary, _) = built(&here, &[&address]);
    assert_eq!((&summary["ran"], &summary["shared"]), (&0.into(), &5.into()), "{summary}");
    assert_eq!(here.outputs(), there.outputs());
}

#[test]
fn files_that_a_file_names_are_found_by_their_contents() {
    let Some(server) = Server::start("files_that_a_file_names") else { return };
    let manifest = "schema = 1\n[stage.material]\nkind = \"import-material\"\nsource = \"paint.toml\"\n\
                    [stage.coefficients]\nkind = \"project-brdf\"\ninput = \"material\"\ndegree = [4, 0]\n";
    let project = |rows: &str| {
        let project = Project::new(manifest);
        project.write("paint.toml", "model = \"measured\"\nfile = \"paint.csv\"\n");
        project.write("paint.csv", rows);
        project
    };
    let rows = |scale: f64| {
        let mut text = String::from("theta_i,theta_o,phi,r,g,b\n");
        for incident in [0, 30, 60, 89] {
            for outgoing in [0, 30, 60, 89] {
                for phi in [0, 60, 120, 180] {
                    text += &format!("{incident},{outgoing},{phi},{scale},{scale},{scale}\n");
                }
            }
        }
        text
    };
    let address = server.address();
    let (one, same, other) = (project(&rows(0.1)), project(&rows(0.1)), project(&rows(0.2)));
    let (first, events) = built(&one, &[&address]);
    assert_eq!((&first["ran"], &first["failed"]), (&2.into(), &0.into()), "{events:#?}");
    let (second, _) = built(&same, &[&address]);
    assert_eq!((&second["ran"], &second["shared"]), (&0.into(), &2.into()), "{second}");
    let (third, _) = built(&other, &[&address]);
    assert_eq!((&third["ran"], &third["shared"]), (&2.into(), &0.into()), "{third}");
}

#[test]
fn many_results_are_found_in_few_calls() {
    let Some(server) = Server::start("many_results_are_found") else { return };
    let address = server.address();
    let project = |edited: &str| {
        let manifest = "schema = 1\n[stage.material]\nkind = \"import-material\"\nsource = \"paints/*.toml\"\n\
                        [stage.coefficients]\nkind = \"project-brdf\"\ninput = \"material\"\ndegree = [2, 0]\n";
        let project = Project::new(manifest);
        for paint in 0..300 {
            let exponent = if format!("{paint}") == edited { 99 } else { 1 + paint % 50 };
            let text = format!("model = \"phong\"\nexponent = {exponent}.{paint}\n");
            project.write(&format!("paints/{paint}.toml"), &text);
        }
        project
    };
    let calls = |summary: &serde_json::Value| summary["shared_traffic"]["calls"].as_u64().unwrap();
    let first = project("");
    built(&first, &[&address]);
    let (second, _) = built(&project(""), &[&address]);
    assert_eq!((&second["ran"], &second["shared"]), (&0.into(), &600.into()), "{second}");
    assert!(calls(&second) < 20, "{second}");
    // A list is a shorter way, and nothing else: what it lacks is asked for, and runs.
    let (third, _) = built(&project("7"), &[&address, "--remote-upload=never"]);
    assert_eq!((&third["ran"], &third["shared"]), (&2.into(), &598.into()), "{third}");
    assert!(calls(&third) < 30, "{third}");
    // A server that has forgotten one result has forgotten its list, and still has every other result.
    let (_, lost) = files_below(&first.path(".specula/blobs")).pop_first().unwrap();
    let lost = server.blobs().into_iter().find(|blob| fs::read(blob).unwrap() == lost).unwrap();
    fs::remove_file(lost).unwrap();
    let (fourth, _) = built(&project(""), &[&address]);
    let ran = fourth["ran"].as_u64().unwrap();
    // If it is a material, the item after it is not asked for.
    assert!((1..=2).contains(&ran) && calls(&fourth) > 200, "{fourth}");
    assert_eq!(fourth["shared"], 600 - ran, "{fourth}");
}

#[test]
fn a_reader_stores_nothing() {
    let Some(server) = Server::start("a_reader_stores_nothing") else { return };
    let address = server.address();
    built(&Project::small(), &[&address, "--remote-upload=never"]);
    let (summary, _) = built(&Project::small(), &[&address]);
    assert_eq!(summary["shared"], 0, "{summary}");
}

#[test]
fn what_the_server_has_forgotten_is_made_again() {
    let Some(server) = Server::start("what_the_server_has_forgotten") else { return };
    let (here, there) = (Project::small(), Project::small());
    let address = server.address();
    built(&here, &[&address]);
    built(&there, &[&address]);
    server.blobs().iter().for_each(|blob| fs::remove_file(blob).unwrap());
    // Needs inputs that were never received, and that nobody has any more.
    let edit = "model = \"phong\"\nexponent = 9\n";
    for project in [&here, &there] {
        project.write("assets/materials/gold.toml", edit);
    }
    let (alone, with) = (built(&here, &[]).0, built(&there, &[&address]));
    assert_eq!(with.0["failed"], 0, "{:#?}", with.1);
    assert_eq!(here.outputs(), there.outputs());
    assert!(with.0["ran"].as_u64() > alone["ran"].as_u64(), "{} {alone}", with.0);
}

#[test]
fn wrong_bytes_are_not_believed() {
    let Some(mut server) = Server::start("wrong_bytes_are_not_believed") else { return };
    let here = Project::small();
    let address = server.address();
    built(&here, &[&address]);
    server.kill();
    for blob in server.blobs() {
        let mut bytes = fs::read(&blob).unwrap();
        let mut permissions = fs::metadata(&blob).unwrap().permissions();
        #[allow(clippy::permissions_set_readonly_false, reason = "a file of a temporary folder")]
        permissions.set_readonly(false);
        fs::set_permissions(&blob, permissions).unwrap();
        bytes.iter_mut().for_each(|byte| *byte ^= 0x55);
        fs::write(&blob, bytes).unwrap();
    }
    server.restart();
    let there = Project::small();
    let (summary, events) = built(&there, &[&address]);
    assert_eq!(summary["failed"], 0, "{summary}");
    assert_eq!(there.outputs(), here.outputs());
    // However many are wrong.
    assert!(warnings(&events).len() <= 2, "{:?}", warnings(&events));
}

#[test]
fn without_its_server_a_build_warns_once_or_fails_if_it_must_not() {
    let Some(mut server) = Server::start("without_its_server") else { return };
    let address = server.address();
    server.kill();
    let project = Project::small();
    let (summary, events) = built(&project, &[&address]);
    assert!(summary["failed"] == 0 && summary["ran"].as_u64().unwrap() > 20, "{summary}");
    let [warning] = warnings(&events)[..] else { panic!("{:?}", warnings(&events)) };
    assert!(warning.starts_with("cannot connect to grpc://127.0.0.1:"), "{warning}");
    assert!(warning.ends_with("; the build continues without it"), "{warning}");
    project.specula(&["build", &address, "--remote-required"]).ends(4, ["error: cannot connect to grpc://"]);
}

#[test]
fn wrong_options_are_refused_before_anything_runs() {
    let project = Project::small();
    for (arguments, expected) in [
        (&["--remote-cache=http://cache"][..], "expected grpc://HOST:PORT, grpcs://HOST:PORT or unix:PATH"),
        (&["--remote-cache=grpc://cache:1", "--tls-certificate=missing.pem"], "cannot read missing.pem"),
        (&["--remote-cache=grpc://cache:1", "--remote-header=secret1234"], "a header is not NAME=VALUE"),
        (&["--remote-cache=grpc://cache:1", "--tls-certificate=pipeline.toml"], "is not encrypted"),
    ] {
        let run = project.specula(&[&["build"], arguments].concat()).ends(2, [expected]);
        assert!(!run.stderr.contains("secret1234"), "{}", run.stderr);
    }
    assert!(!project.path(".specula").exists());
}

/// Kills the server at random moments of builds, and starts it again or not.
#[test]
fn a_server_that_is_killed_costs_no_result() {
    const TEST: &str = "a_server_that_is_killed_costs_no_result";
    let Some(mut server) = Server::start(TEST) else { return };
    let address = server.address();
    let clean = Project::small();
    let start = Instant::now();
    clean.ok(&["build"]);
    let (whole, expected) = (start.elapsed(), clean.outputs());
    for round in 0..test_data::length(TEST, "kills", 25, 6) {
        let project = Project::small();
        let child = project.command(&["build", &address]).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(whole.mul_f64(1.5 * uniform(round)));
        server.kill();
        if round % 2 == 0 {
            server.restart();
        }
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "round {round}: {}", String::from_utf8_lossy(&output.stderr));
        assert_same(&project.outputs(), &expected, round);
        if round % 2 == 1 {
            server.restart();
        }
    }
}

/// Kills the client at random moments; the next build, with what was stored by then, is right.
#[test]
fn a_client_that_is_killed_leaves_nothing_half_stored() {
    const TEST: &str = "a_client_that_is_killed_leaves_nothing_half_stored";
    let Some(server) = Server::start(TEST) else { return };
    let address = server.address();
    let clean = Project::small();
    let start = Instant::now();
    clean.ok(&["build"]);
    let (whole, expected) = (start.elapsed(), clean.outputs());
    let (mut round, mut killed) = (0, 0);
    let kills = test_data::length(TEST, "kills", 25, 6);
    while killed < kills && round < 4 * kills {
        // Each round has another light, so that there is something to store.
        let manifest = SMALL.replace("resolution = 32", &format!("resolution = {}", 33 + round));
        let project = Project::new(&manifest);
        let mut child = project.start(&["build", &address]);
        std::thread::sleep(whole.mul_f64(1.2 * uniform(100 + round)));
        killed += u64::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        // Another machine, with what was stored by then.
        let next = Project::new(&manifest);
        next.ok(&["build", &address]);
        if round % 5 == 0 {
            assert_as_alone(&next, round);
        }
        project.ok(&["build", &address]);
        assert_same(&project.outputs(), &next.outputs(), round);
        round += 1;
    }
    assert!(killed >= kills / 2, "{killed} of {round} builds were still running");
    assert!(!expected.is_empty());
}
