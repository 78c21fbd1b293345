//! A shared cache behind a bad line, and one that loses blobs while they are asked for: each build ends with
//! the right outputs, soon.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::support::casd::{Server, assert_as_alone, assert_same, built, warnings};
use crate::support::faults::{Fault, Proxy};
use crate::support::{Project, SMALL, uniform};

/// A server that has the results of the small project, and one that has nothing, with what a build makes and
/// how long it and its data take.
struct Scene {
    full: Server,
    expected: BTreeMap<String, Vec<u8>>,
    /// The bytes and the time of a build that finds everything, and of one that stores everything.
    bytes: [u64; 2],
    times: [Duration; 2],
}

/// What a build found on its server.
const FOUND: [&str; 2] = ["everything there", "nothing there"];

impl Scene {
    fn new(test: &str) -> Option<Self> {
        let full = Server::start(test)?;
        let mut scene = Self { full, expected: BTreeMap::new(), bytes: [0; 2], times: [Duration::ZERO; 2] };
        for found in [1, 0] {
            let (project, proxy) = (Project::small(), Proxy::start(scene.full.port(), Fault::None));
            let start = Instant::now();
            let (_, events) = built(&project, &[&proxy.address()]);
            assert_eq!(warnings(&events), [""; 0]);
            (scene.times[found], scene.bytes[found]) = (start.elapsed(), proxy.passed());
            scene.expected = project.outputs();
        }
        println!("{test}: without faults {:.2?}, {:?} bytes", scene.times, scene.bytes);
        Some(scene)
    }

    /// Builds a new project behind a bad line, on a server that has everything (0) or nothing (1). The build
    /// is right, and so is the next one, which finds what was stored by then.
    fn build(
        &self,
        test: &str,
        (found, round): (usize, u64),
        fault: Fault,
        options: &[&str],
        meanwhile: impl FnOnce(&Proxy, &AtomicBool) + Send,
    ) -> Option<Built> {
        let empty = if found == 1 { Some(Server::start(test)?) } else { None };
        let server = empty.as_ref().unwrap_or(&self.full);
        let (project, proxy) = (Project::small(), Proxy::start(server.port(), fault));
        let (start, address, done) = (Instant::now(), proxy.address(), AtomicBool::new(false));
        let (summary, events) = std::thread::scope(|scope| {
            scope.spawn(|| meanwhile(&proxy, &done));
            let built = built(&project, &[&[&*address], options].concat());
            done.store(true, Ordering::Relaxed);
            built
        });
        let time = start.elapsed();
        let case = format!("{}, {fault:?}, round {round}", FOUND[found]);
        assert_eq!(summary["failed"], 0, "{case}: {events:#?}");
        assert_same(&project.outputs(), &self.expected, round);
        let warnings = warnings(&events).into_iter().map(str::to_owned).collect::<Vec<_>>();
        println!("{case}: {time:.2?}, {} ran, {} shared, {warnings:?}", summary["ran"], summary["shared"]);
        assert!(warnings.len() <= 2, "{case}: {warnings:?}");
        if let Some(server) = empty {
            let next = Project::small();
            let (summary, _) = built(&next, &[&server.address()]);
            assert_eq!(summary["failed"], 0, "{case}: {summary}");
            assert_same(&next.outputs(), &self.expected, round);
        }
        Some(Built { time, warnings, ran: summary["ran"].as_u64().unwrap() })
    }
}

/// What became of a build.
struct Built {
    time: Duration,
    warnings: Vec<String>,
    ran: u64,
}

fn nothing(_: &Proxy, _: &AtomicBool) {}

#[test]
fn a_long_line_costs_time_only() {
    const TEST: &str = "a_long_line_costs_time_only";
    let Some(scene) = Scene::new(TEST) else { return };
    for found in [0, 1] {
        let fault = Fault::Delay(Duration::from_millis(30));
        let Some(built) = scene.build(TEST, (found, 0), fault, &[], nothing) else { return };
        assert_eq!(built.warnings, [""; 0]);
    }
}

/// Connections end after some bytes, again and again: the first may be enough for nothing.
#[test]
fn a_line_that_is_cut_costs_no_result() {
    const TEST: &str = "a_line_that_is_cut_costs_no_result";
    let Some(scene) = Scene::new(TEST) else { return };
    for round in 0..test_data::length(TEST, "rounds", 12, 4) {
        let found = (round % 2) as usize;
        // Most at the beginning, where the connection is made.
        let part = uniform(round).powi(3);
        let fault = Fault::CutAfter((scene.bytes[found] as f64 * part) as u64);
        let Some(Built { time, .. }) = scene.build(TEST, (found, round), fault, &[], nothing) else { return };
        // A few pauses between attempts; the rest is for a machine that does other things too.
        assert!(time < 3 * scene.times[1] + Duration::from_secs(30), "round {round}: {time:?}");
    }
}

#[test]
fn connections_that_are_reset_cost_no_result() {
    const TEST: &str = "connections_that_are_reset";
    let Some(scene) = Scene::new(TEST) else { return };
    for round in 0..test_data::length(TEST, "rounds", 12, 4) {
        let found = (round % 2) as usize;
        let whole = scene.times[found];
        let meanwhile = |proxy: &Proxy, done: &AtomicBool| {
            let mut moment = 0;
            while !done.load(Ordering::Relaxed) {
                moment += 1;
                std::thread::sleep(whole.mul_f64(0.5 * uniform(100 * round + moment)));
                proxy.reset();
            }
        };
        let Some(_) = scene.build(TEST, (found, round), Fault::None, &[], meanwhile) else { return };
    }
}

/// The server is there and says nothing more: a build waits for its time limit, a few times at most.
#[test]
fn a_stalled_line_holds_a_build_up_for_the_time_limit_only() {
    const TEST: &str = "a_stalled_line_holds_a_build_up";
    let Some(scene) = Scene::new(TEST) else { return };
    let limit = ["--remote-timeout=1"];
    let mut longest = Duration::ZERO;
    for round in 0..test_data::length(TEST, "rounds", 8, 4) {
        let found = (round % 2) as usize;
        let part = if round < 2 { 0.0 } else { uniform(round).powi(2) };
        let fault = Fault::StallAfter((scene.bytes[found] as f64 * part) as u64);
        let Some(built) = scene.build(TEST, (found, round), fault, &limit, nothing) else { return };
        let Built { time, warnings, .. } = built;
        // Every build can make all itself, and no call is made again after the limit.
        longest = longest.max(time);
        assert!(time < 3 * scene.times[1] + Duration::from_secs(20), "round {round}: {time:?}");
        if part == 0.0 {
            assert!(warnings[0].contains("--remote-timeout"), "{warnings:?}");
        }
    }
    println!("{TEST}: {longest:.2?} at most, {:.2?} without a fault", scene.times[1]);
    let proxy = Proxy::start(scene.full.port(), Fault::StallAfter(0));
    let options = ["build", &proxy.address(), limit[0], "--remote-required"];
    Project::small().specula(&options).ends(4, ["--remote-timeout"]);
}

/// A bit of a message is flipped, in what the server says or in what it is told. What it was told wrong it
/// may have stored: it is found by the next build, which is right all the same.
#[test]
fn flipped_bits_cost_no_result() {
    const TEST: &str = "flipped_bits_cost_no_result";
    let Some(scene) = Scene::new(TEST) else { return };
    for round in 0..test_data::length(TEST, "rounds", 12, 4) {
        let found = (round % 2) as usize;
        let fault = Fault::Flip((scene.bytes[found] as f64 * uniform(round)) as u64);
        let Some(_) = scene.build(TEST, (found, round), fault, &["--remote-timeout=3"], nothing) else {
            return;
        };
    }
}

/// Blobs go between the answer that they are there and the moment in which they are asked for.
#[test]
fn blobs_that_go_while_they_are_asked_for_cost_no_result() {
    const TEST: &str = "blobs_that_go_while_they_are_asked_for";
    let Some(scene) = Scene::new(TEST) else { return };
    let files = scene.full.blobs().into_iter().map(|file| (file.clone(), fs::read(file).unwrap()));
    let files = files.collect::<BTreeMap<PathBuf, Vec<u8>>>();
    // A long line widens the time between hit and download: six times as long as it is in each direction.
    let delay = Duration::from_millis(20);
    let (whole, mut lost) = (scene.times[0] + 10 * delay, 0);
    for round in 0..test_data::length(TEST, "rounds", 25, 6) {
        for (file, bytes) in &files {
            if !file.exists() {
                fs::create_dir_all(file.parent().unwrap()).unwrap();
                fs::write(file, bytes).unwrap();
            }
        }
        let meanwhile = |_: &Proxy, _: &AtomicBool| {
            std::thread::sleep(whole.mul_f64(uniform(round)));
            for (index, file) in files.keys().enumerate() {
                if uniform(1000 * (round + 1) + index as u64) < 0.5 {
                    let _ = fs::remove_file(file);
                }
            }
        };
        let built = scene.build(TEST, (0, round), Fault::Delay(delay), &[], meanwhile);
        let Some(Built { ran, warnings, .. }) = built else { return };
        assert!(warnings.len() <= 1, "round {round}: {warnings:?}");
        lost += ran;
    }
    println!("{TEST}: {lost} items were made again");
    assert!(lost > 0);
}

/// Connections to the cache and to the workers end at random moments: what was running is asked for again.
#[test]
fn lost_connections_to_workers_cost_no_result() {
    const TEST: &str = "lost_connections_to_workers";
    let Some(server) = Server::with_workers(TEST) else { return };
    let clean = Project::small();
    clean.ok(&["build"]);
    for round in 0..test_data::length(TEST, "rounds", 6, 3) {
        // Each round has another light, so that there is something to run.
        let project = Project::new(&SMALL.replace("degree = 8\n", &format!("degree = {}\n", 9 + round)));
        let proxy = Proxy::start(server.port(), Fault::None);
        let [_, program] = server.executor();
        let (executor, done) = (format!("--remote-executor={}", proxy.url()), AtomicBool::new(false));
        let start = Instant::now();
        let (summary, events) = std::thread::scope(|scope| {
            scope.spawn(|| {
                let mut moment = 0;
                while !done.load(Ordering::Relaxed) {
                    moment += 1;
                    std::thread::sleep(Duration::from_secs_f64(uniform(100 * round + moment)));
                    proxy.reset();
                }
            });
            let built = built(&project, &[&executor, &program]);
            done.store(true, Ordering::Relaxed);
            built
        });
        println!(
            "{TEST}, round {round}: {:.2?}, {} ran, {} of them elsewhere, {:?}",
            start.elapsed(),
            summary["ran"],
            summary["ran_elsewhere"],
            warnings(&events)
        );
        assert_eq!(summary["failed"], 0, "round {round}: {events:#?}");
        assert!(warnings(&events).len() <= 2, "round {round}: {:?}", warnings(&events));
        assert_as_alone(&project, round);
    }
}

/// A server of workers that says nothing more, while the cache answers, is seen by its pings alone.
#[test]
fn a_stalled_line_to_workers_holds_a_build_up_for_a_while_only() {
    const TEST: &str = "a_stalled_line_to_workers";
    // At least 31 s, and four times as long if the line stalls again after each new connection.
    if test_data::length(TEST, "rounds", 1, 0) == 0 {
        return;
    }
    let Some(server) = Server::with_workers(TEST) else { return };
    let clean = Project::small();
    clean.ok(&["build"]);
    let (project, proxy) = (Project::small(), Proxy::start(server.port(), Fault::StallAfter(2000)));
    let [_, program] = server.executor();
    let (start, executor) = (Instant::now(), format!("--remote-executor={}", proxy.url()));
    let options = [&*executor, &*program, &*server.address(), "--remote-timeout=1"];
    let (summary, events) = built(&project, &options);
    let (time, said) = (start.elapsed(), warnings(&events));
    println!("{TEST}: {time:.2?}, {} ran, {} elsewhere, {said:?}", summary["ran"], summary["ran_elsewhere"]);
    assert_eq!(summary["failed"], 0, "{events:#?}");
    assert_same(&project.outputs(), &clean.outputs(), 0);
    assert!((1..=2).contains(&said.len()), "{said:?}");
    assert!(time < Duration::from_secs(300), "{time:?}");
}
