//! A temporary project folder for each end-to-end test, and the binary to run in it.

#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

pub mod buildgrid;
pub mod casd;
pub mod faults;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// An environment of the sample.
pub const STUDIO: &str = "assets/environments/studio.exr";

/// A small pipeline over the sample assets, with every kind of step, quick enough to run hundreds of times.
pub const SMALL: &str = r#"
schema = 1
out = "out"

[stage.environment]
kind = "import-environment"
source = "assets/environments/studio.exr"
resolution = 32

[stage.material]
kind = "import-material"
source = "assets/materials/*.toml"

[stage.lighting]
kind = "project-sh"
input = "environment"
degree = 8

[stage.coefficients]
kind = "project-brdf"
input = "material"
degree = [8, 0]

[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" }

[stage.map]
kind = "export-reflection-map"
input = "reflection"
layout = "lat-long"
resolution = 16
path = "maps/{material}"

[stage.faces]
kind = "export-reflection-map"
input = "reflection"
layout = "cube"
resolution = 8
path = "faces/{material}"

[stage.sh]
kind = "export-sh"
input = "lighting"
path = "lighting"
"#;

/// A folder with a manifest and assets, removed at the end.
pub struct Project {
    folder: TempDir,
    /// PATH of the binary; by default that of the tests.
    search_path: Option<&'static str>,
}

/// How a run of the binary ended.
#[derive(Debug)]
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes| {
            let text = String::from_utf8(bytes).unwrap();
            // JSON has the escapes of its own.
            if text.starts_with(['{', '[']) { text } else { test_data::unix_paths(text) }
        };
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

impl Run {
    /// The run, which must have ended with this code and these texts on standard error.
    #[track_caller]
    pub fn ends<const N: usize>(self, code: i32, texts: [&str; N]) -> Self {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        assert_has(&self.stderr, texts);
        self
    }
}

/// Asserts that a text contains each of these parts.
#[track_caller]
pub fn assert_has<const N: usize>(text: impl AsRef<str>, parts: [&str; N]) {
    let text = text.as_ref();
    parts.iter().for_each(|part| assert!(text.contains(part), "no {part:?} in:\n{text}"));
}

impl Project {
    /// The repository's own pipeline and assets.
    pub fn sample() -> Self {
        let manifest = fs::read_to_string(root().join("pipeline.toml")).unwrap();
        // Smaller maps and pictures: CI builds the sample as it is once.
        let smaller = [
            ("sphere = 64 ", "sphere = 32 "),
            ("resolution = 32", "resolution = 12"),
            ("size = 200", "size = 48"),
        ];
        Self::new(&smaller.iter().fold(manifest, |manifest, (large, small)| {
            assert!(manifest.contains(large), "no {large:?} in the sample");
            manifest.replace(large, small)
        }))
    }

    /// [`SMALL`] over the sample assets.
    pub fn small() -> Self {
        Self::new(SMALL)
    }

    /// The sample's assets and no manifest.
    pub fn assets_alone() -> Self {
        let project = Self::new("");
        fs::remove_file(project.path("pipeline.toml")).unwrap();
        project
    }

    /// A manifest with the sample assets.
    pub fn new(manifest: &str) -> Self {
        let project = Self { folder: tempfile::tempdir().unwrap(), search_path: None };
        copy_folder(&root().join("assets"), &project.path("assets"));
        project.write("pipeline.toml", manifest);
        project
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file in the folder.
    pub fn write(&self, name: &str, text: &str) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), text).unwrap();
    }

    /// The project whose programs are found in these folders.
    pub fn with_search_path(self, search_path: &'static str) -> Self {
        Self { search_path: Some(search_path), ..self }
    }

    /// The binary, to be run in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_specula"));
        command.current_dir(self.folder.path()).args(arguments).env("NO_COLOR", "1").stdin(Stdio::null());
        command.envs(self.search_path.map(|folders| ("PATH", folders)));
        command
    }

    /// Runs the binary to its end.
    pub fn specula(&self, arguments: &[&str]) -> Run {
        self.command(arguments).output().unwrap().into()
    }

    /// Runs the binary, which must succeed.
    pub fn ok(&self, arguments: &[&str]) -> Run {
        let run = self.specula(arguments);
        assert_eq!(run.code, Some(0), "specula {arguments:?}\n{}{}", run.stdout, run.stderr);
        run
    }

    /// The events of a build, which may fail.
    pub fn events(&self, arguments: &[&str]) -> Vec<serde_json::Value> {
        let run = self.specula(&[&["build", "--json"], arguments].concat());
        run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// Starts the binary with its output thrown away.
    pub fn start(&self, arguments: &[&str]) -> Child {
        self.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// Starts `specula watch --json`.
    pub fn watch(&self, arguments: &[&str]) -> Watcher {
        let mut command = self.command(&[&["watch", "--json"], arguments].concat());
        Watcher::new(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap())
    }

    /// Every file below `out`, by its path there.
    pub fn outputs(&self) -> BTreeMap<String, Vec<u8>> {
        files_below(&self.path("out"))
    }
}

/// No event takes longer than this.
pub const TIMEOUT: Duration = Duration::from_secs(60);

/// A running `specula watch --json`, killed at the end.
pub struct Watcher {
    child: Child,
    events: Receiver<serde_json::Value>,
    /// The events so far.
    seen: Vec<serde_json::Value>,
}

impl Watcher {
    /// The events of a process whose standard output is piped.
    pub fn new(mut child: Child) -> Self {
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, events) = channel();
        std::thread::spawn(move || {
            // The last line of a killed process may be torn.
            let events = stdout.lines().map_while(Result::ok);
            for event in events.map_while(|line| serde_json::from_str(&line).ok()) {
                if sender.send(event).is_err() {
                    break;
                }
            }
        });
        Self { child, events, seen: Vec::new() }
    }

    /// Waits for an event of that name that fulfils a condition, and returns all until then.
    pub fn wait(
        &mut self,
        name: &str,
        wanted: impl Fn(&serde_json::Value) -> bool,
    ) -> Vec<serde_json::Value> {
        let (deadline, start) = (Instant::now() + TIMEOUT, self.seen.len());
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(event) = self.events.recv_timeout(left) else {
                let seen = self.seen.iter().map(|event| format!("\n{event}")).collect::<String>();
                panic!("no {name} event came within {TIMEOUT:?}, only{seen}");
            };
            self.seen.push(event);
            let event = &self.seen[self.seen.len() - 1];
            if event["event"] == name && wanted(event) {
                return self.seen[start..].to_vec();
            }
        }
    }

    /// Waits for the end of a build that was not stopped.
    pub fn wait_for_build(&mut self) -> Vec<serde_json::Value> {
        self.wait("ended", |end| end["cancelled"] == false)
    }

    /// Waits until the first build is done and the watcher listens.
    pub fn wait_until_it_watches(&mut self) {
        self.wait("watching", |_| true);
    }

    /// Whether the process runs.
    pub fn lives(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// Waits for the end of the process, and returns its exit code.
    pub fn wait_for_exit(mut self) -> Option<i32> {
        let deadline = Instant::now() + TIMEOUT;
        while self.lives() {
            assert!(Instant::now() < deadline, "it did not end within {TIMEOUT:?}");
            std::thread::sleep(Duration::from_millis(10));
        }
        self.child.wait().unwrap().code()
    }

    /// Kills it, as `kill -9` does.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// The id of its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        // The process may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A fixed sequence of numbers in [0, 1): splitmix64.
pub fn uniform(seed: u64) -> f64 {
    let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Checks that a whole build wrote each file of `out`; temporary files are hidden and are removed later.
pub fn assert_whole(project: &Project, known: &BTreeSet<(String, Vec<u8>)>, moment: &str) {
    for (name, bytes) in project.outputs() {
        let hidden = name.rsplit('/').next().unwrap().starts_with('.');
        let size = bytes.len();
        assert!(
            hidden || known.contains(&(name.clone(), bytes)),
            "{name} ({size} bytes) is not an output of a whole build, {moment}"
        );
    }
}

/// The names of the stages that ran, each with its number of items.
pub fn ran(events: &[serde_json::Value]) -> BTreeMap<String, usize> {
    let mut stages = BTreeMap::new();
    for event in events.iter().filter(|event| event["event"] == "finished") {
        *stages.entry(event["item"]["stage"].as_str().unwrap().to_owned()).or_default() += 1;
    }
    stages
}

/// Every file below a folder, by its path there with `/`; empty if there is no such folder.
pub fn files_below(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Copies a folder with everything in it.
pub fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}
