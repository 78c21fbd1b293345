//! Simulates builds of 100,000 items on up to 1,000 workers, and draws the charts of `docs/scale.md`:
//! [`research::worker_simulation`].
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin simulate-workers -- FOLDER` simulates
//! all cases of the page, which takes a quarter of an hour, and writes `scale.json` and the charts into the
//! folder. With options it simulates one case and prints its numbers:
//!
//! | option | meaning |
//! | --- | --- |
//! | `--items N` | at least so many items; 100000 |
//! | `--workers N` | the workers; 100 |
//! | `--jobs N` | how many items the client has run at a time; as many as there are workers |
//! | `--times FACTOR` | items take so many times as long as in the sample; 1 |
//! | `--bytes FACTOR` | outputs are so many times as large as in the sample; 0.015625 |
//! | `--delay MILLISECONDS` | each call takes so much longer; 0 |
//! | `--again` | a second client builds once more, from the cache |
//! | `--charts FILE` | only draws the charts of this `scale.json` |
//! | `--case NAME` | only these cases of the page, which replace those in `scale.json`; may be repeated |

use std::error::Error;
use std::fs;
use std::io::BufRead as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use engine::Plan;
use engine::serde_json::{self, Value, json};
use research::worker_simulation::server::{ModelServer, Workers};
use research::worker_simulation::{Case, Client, Measured, Outcome, Project, build, charts, kinds, run_case};

fn main() {
    let arguments = std::env::args().skip(1).collect::<Vec<_>>();
    let words = arguments.iter().map(String::as_str).collect::<Vec<_>>();
    let done = match &words[..] {
        ["--serve", workers, times, share, delay] => serve([workers, times, share, delay]),
        ["--client", folder, address, jobs, what] => client(Path::new(folder), address, jobs, what),
        _ => simulate(&words),
    };
    if let Err(error) = done {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// The server's process: prints its address, and a report for each line that it reads.
fn serve([workers, times, share, delay]: [&str; 4]) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    Project { environments: 1, materials: 1 }.write(folder.path(), 0.0)?;
    let plan = Plan::load(&folder.path().join("pipeline.toml"), &kinds());
    let measured = Measured::new(&plan.map_err(|errors| format!("{errors:?}"))?)?;
    folder.close()?;
    let workers = Workers { count: workers.parse()?, times: times.parse()?, share: share.parse()? };
    let server = ModelServer::start(workers, measured, Duration::from_millis(delay.parse()?))?;
    println!("{}", server.address());
    for line in std::io::stdin().lock().lines() {
        line?;
        println!("{}", server.report());
    }
    server.stop();
    Ok(())
}

/// The client's process: builds, and prints what that took.
fn client(folder: &Path, address: &str, jobs: &str, what: &str) -> Result<(), Box<dyn Error>> {
    let client = Client { address: address.into(), jobs: jobs.parse()?, runs: what == "run" };
    println!("{}", build(folder, &client)?);
    Ok(())
}

/// The cases of `docs/scale.md`.
fn cases() -> Vec<Case> {
    let case = |name: &str, items: usize, workers: usize, times: f64| Case {
        name: name.into(),
        items,
        workers,
        jobs: workers,
        times,
        share: 1.0 / 64.0,
        delay_milliseconds: 0,
        again: false,
    };
    vec![
        case("1 worker", 2_000, 1, 0.1),
        case("10 workers", 10_000, 10, 0.1),
        case("100 workers", 100_000, 100, 1.0),
        case("300 workers", 100_000, 300, 1.0),
        Case { again: true, ..case("1000 workers", 100_000, 1000, 1.0) },
        case("1000 workers, long items", 50_000, 1000, 10.0),
        Case { delay_milliseconds: 30, again: true, ..case("1000 workers, 30 ms", 10_000, 1000, 1.0) },
        Case { share: 1.0, again: true, ..case("100 workers, all bytes", 2_000, 100, 1.0) },
        case("no work, 30 jobs", 10_000, 30, 0.0),
        Case { again: true, ..case("no work, 100 jobs", 10_000, 100, 0.0) },
        case("no work, 300 jobs", 10_000, 300, 0.0),
        case("no work, 1000 jobs", 10_000, 1000, 0.0),
    ]
}

fn simulate(words: &[&str]) -> Result<(), Box<dyn Error>> {
    let program = std::env::current_exe()?;
    let mut one = Case {
        name: "one case".into(),
        items: 100_000,
        workers: 100,
        jobs: 0,
        times: 1.0,
        share: 1.0 / 64.0,
        delay_milliseconds: 0,
        again: false,
    };
    let (mut folder, mut is_one, mut names, mut drawn) = (None, false, Vec::new(), None);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("{word} needs a value"));
        is_one |= word.starts_with("--") && !["--case", "--charts"].contains(word);
        match *word {
            "--items" => one.items = value()?.parse()?,
            "--workers" => one.workers = value()?.parse()?,
            "--jobs" => one.jobs = value()?.parse()?,
            "--times" => one.times = value()?.parse()?,
            "--bytes" => one.share = value()?.parse()?,
            "--delay" => one.delay_milliseconds = value()?.parse()?,
            "--again" => one.again = true,
            "--case" => names.push((*value()?).to_owned()),
            "--charts" => drawn = Some(PathBuf::from(value()?)),
            option if option.starts_with('-') => return Err(format!("unknown option {option}").into()),
            _ => folder = Some(PathBuf::from(word)),
        }
    }
    if is_one {
        one.jobs = if one.jobs == 0 { one.workers } else { one.jobs };
        for outcome in run_case(&program, &one)? {
            println!("{}", outcome.row());
            println!("{}", outcome.0["server"]["calls"]);
            println!("{}", outcome.0["client"]["seconds_by_thread"]);
        }
        return Ok(());
    }
    let folder = folder.ok_or("usage: simulate-workers FOLDER, or with options for one case")?;
    fs::create_dir_all(&folder)?;
    let file = drawn.clone().unwrap_or_else(|| folder.join("scale.json"));
    let mut outcomes = match fs::read(&file) {
        Ok(bytes) => serde_json::from_slice::<Vec<Value>>(&bytes)?.into_iter().map(Outcome).collect(),
        Err(_) => Vec::new(),
    };
    let chosen = |case: &Case| names.is_empty() || names.contains(&case.name);
    for case in cases().into_iter().filter(|case| drawn.is_none() && chosen(case)) {
        for outcome in run_case(&program, &case)? {
            println!("{}: {}", outcome.0["name"], outcome.row());
            outcomes.retain(|before: &Outcome| before.0["name"] != outcome.0["name"]);
            outcomes.push(outcome);
        }
        let all = json!(outcomes.iter().map(|outcome| &outcome.0).collect::<Vec<_>>());
        fs::write(&file, format!("{all}\n"))?;
    }
    for (name, svg) in charts(&outcomes) {
        fs::write(folder.join(name), svg)?;
    }
    Ok(())
}
