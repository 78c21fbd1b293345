//! One case: a server process and a client process, and what both say.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use engine::serde_json;
use engine::serde_json::{Value, json};

use super::Project;

/// What to simulate.
#[derive(Clone, Debug)]
pub struct Case {
    /// A name for it.
    pub name: String,
    /// At least so many items.
    pub items: usize,
    /// The workers.
    pub workers: usize,
    /// How many items the client has run at a time.
    pub jobs: usize,
    /// An item takes its time in the sample, multiplied by this.
    pub times: f64,
    /// Outputs and environments have their bytes in the sample, multiplied by this.
    pub share: f64,
    /// How much longer each call takes.
    pub delay_milliseconds: u64,
    /// Whether a second client, which has nothing, builds once more from the cache.
    pub again: bool,
}

/// What a simulation gave: the numbers of the client and of the server.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome(pub Value);

impl Outcome {
    /// A number of it: `["client", "seconds"]`.
    pub fn number(&self, path: &[&str]) -> f64 {
        path.iter().fold(&self.0, |value, name| &value[*name]).as_f64().unwrap_or(0.0)
    }

    /// The shortest time that the workers could need for the items.
    pub fn ideal_seconds(&self) -> f64 {
        let by_workers = self.number(&["client", "work_seconds"]) / self.number(&["workers"]).max(1.0);
        by_workers.max(self.number(&["client", "critical_seconds"]))
    }

    /// The share of the workers' time in which they ran something.
    pub fn utilisation(&self) -> f64 {
        let seconds = self.number(&["client", "seconds"]) * self.number(&["workers"]);
        self.number(&["server", "busy_seconds"]) / seconds.max(1e-9)
    }

    /// The calls that the client made.
    pub fn calls(&self) -> f64 {
        let calls = self.0["server"]["calls"].as_object();
        calls.into_iter().flatten().filter_map(|(_, count)| count.as_f64()).sum()
    }

    /// A row of a table, without its name.
    pub fn row(&self) -> String {
        let seconds = self.number(&["client", "seconds"]);
        let items = self.number(&["client", "items"]);
        let bytes = |name: &str| self.number(&["server", name]) / 1e6;
        format!(
            "{seconds:8.1} s, ideal {:.1} s, {:.0} items/s, workers busy {:.0} %, queue at most {:.0}, wait \
             {:.2} s (longest {:.1}), client {:.1} s of processor time, {:.2} ms an item, {:.0} MiB (plan {:.0}), \
             server {:.1} s, sent {:.0} MB, received {:.0} MB, {:.2} calls an item",
            self.ideal_seconds(),
            items / seconds,
            100.0 * self.utilisation(),
            self.number(&["server", "longest_queue"]),
            self.number(&["server", "mean_wait_seconds"]),
            self.number(&["server", "longest_wait_seconds"]),
            self.number(&["client", "processor_seconds"]),
            1e3 * self.number(&["client", "processor_seconds"]) / items,
            self.number(&["client", "most_mebibytes"]),
            self.number(&["client", "planned_mebibytes"]),
            self.number(&["server", "processor_seconds"]),
            bytes("bytes_received"),
            bytes("bytes_sent"),
            self.calls() / items,
        )
    }
}

/// The server's process.
struct ServerProcess {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl ServerProcess {
    fn start(program: &Path, case: &Case) -> Result<(Self, String), Box<dyn std::error::Error>> {
        let mut child = Command::new(program)
            .arg("--serve")
            .args([case.workers.to_string(), case.times.to_string(), case.share.to_string()])
            .arg(case.delay_milliseconds.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let input = child.stdin.take().ok_or("the server has no input")?;
        let output = BufReader::new(child.stdout.take().ok_or("the server has no output")?);
        let mut server = Self { child, input, output };
        let address = server.line()?;
        Ok((server, address))
    }

    fn line(&mut self) -> Result<String, Box<dyn std::error::Error>> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        Ok(line.trim().to_owned())
    }

    fn report(&mut self) -> Result<Value, Box<dyn std::error::Error>> {
        writeln!(self.input, "report")?;
        Ok(serde_json::from_str(&self.line()?)?)
    }
}

impl Drop for ServerProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Simulates a case with processes of this program, in a folder that is removed afterwards; returns one
/// outcome, or two if it builds again.
///
/// # Errors
/// If a process fails.
pub fn run_case(program: &Path, case: &Case) -> Result<Vec<Outcome>, Box<dyn std::error::Error>> {
    let (mut server, address) = ServerProcess::start(program, case)?;
    let mut outcomes = Vec::new();
    for is_again in [false, true].into_iter().take(1 + usize::from(case.again)) {
        let folder = tempfile::tempdir()?;
        Project::of_items(case.items).write(folder.path(), case.share)?;
        let output = Command::new(program)
            .arg("--client")
            .arg(folder.path())
            .args([address.as_str(), &case.jobs.to_string(), if is_again { "cached" } else { "run" }])
            .stderr(Stdio::inherit())
            .output()?;
        if !output.status.success() {
            return Err(format!("the client of {} failed", case.name).into());
        }
        let client = serde_json::from_slice::<Value>(&output.stdout)?;
        let name = if is_again { format!("{} again", case.name) } else { case.name.clone() };
        outcomes.push(Outcome(json!({
            "name": name,
            "workers": case.workers,
            "jobs": case.jobs,
            "times": case.times,
            "share": case.share,
            "delay_milliseconds": case.delay_milliseconds,
            "client": client,
            "server": server.report()?,
        })));
    }
    Ok(outcomes)
}
