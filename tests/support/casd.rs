//! A real server of the Remote Execution API, buildbox-casd.

use std::collections::BTreeMap;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::{Project, files_below, root};

fn program(test: &str) -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    installed(test, "buildbox-casd", "tests/remote/install-casd.sh", &PROGRAM)
}

/// The program of a server, which a script installs at its first use; `None` if it cannot be had here.
pub fn installed(
    test: &str,
    server: &str,
    script: &str,
    program: &'static OnceLock<Option<PathBuf>>,
) -> Option<&'static PathBuf> {
    let program = program.get_or_init(|| {
        let install = Command::new("bash").arg(root().join(script)).output().ok()?;
        let path = PathBuf::from(String::from_utf8(install.stdout).ok()?.trim());
        install.status.success().then_some(path)
    });
    if program.is_none() {
        test_data::skip(test, &format!("{server} cannot be installed ({script} says why)"));
    }
    program.as_ref()
}

/// A server with a cache of its own, killed at the end.
pub struct Server {
    program: &'static Path,
    port: u16,
    cache: TempDir,
    options: Vec<String>,
    child: Child,
}

/// PATH of a build whose programs are those of the sandbox: with another python3 before the system's, a
/// build runs the items of `exec` itself.
pub const SANDBOX_PATH: &str = "/usr/bin:/bin";

impl Server {
    /// A server that has a cache and runs nothing.
    pub fn start(test: &str) -> Option<Self> {
        Self::with(test, Vec::new())
    }

    /// A server that also runs actions. Programs run in a sandbox that has the system's folders, and in
    /// `/opt/specula` that of this program.
    pub fn with_workers(test: &str) -> Option<Self> {
        let runner = program(test)?.parent().unwrap().join("buildbox-run");
        let sandbox = Command::new("bwrap").args(["--ro-bind", "/", "/", "true"]).status();
        if !sandbox.is_ok_and(|status| status.success()) {
            test_data::skip(test, "bubblewrap is not installed or cannot make a sandbox");
            return None;
        }
        let ours = Path::new(env!("CARGO_BIN_EXE_specula")).parent().unwrap();
        let folders = ["/usr", "/bin", "/lib", "/lib64"].map(|folder| (folder.to_owned(), folder));
        let folders = folders.into_iter().chain([(ours.display().to_string(), "/opt/specula")]);
        let mounts = folders.filter(|(from, _)| Path::new(from).exists());
        let mounts = mounts.map(|(from, to)| format!("--runner-arg=--bind-mount={from}:{to}"));
        let mut options = vec![format!("--buildbox-run={}", runner.display()), "--jobs=2".into()];
        options.extend(mounts);
        Self::with(test, options)
    }

    /// A server with these options.
    pub fn with(test: &str, options: Vec<String>) -> Option<Self> {
        let program = program(test)?;
        let port = free_port();
        let cache = tempfile::tempdir().unwrap();
        let child = spawn(program, port, cache.path(), &options);
        Some(Self { program, port, cache, options, child })
    }

    /// The option that names its cache.
    pub fn address(&self) -> String {
        format!("--remote-cache={}", self.url())
    }

    /// The options that let items run on its workers, whose program is that of these tests.
    pub fn executor(&self) -> [String; 2] {
        [format!("--remote-executor={}", self.url()), "--remote-program=/opt/specula/specula".into()]
    }

    pub fn url(&self) -> String {
        format!("grpc://127.0.0.1:{}", self.port)
    }

    pub fn port(&self) -> u16 {
        self.port
    }

    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub fn restart(&mut self) {
        self.child = spawn(self.program, self.port, self.cache.path(), &self.options);
    }

    /// The actions whose results it knows.
    pub fn actions(&self) -> Vec<String> {
        files_below(&self.cache.path().join("actioncache")).into_keys().collect()
    }

    /// The files of the blobs that it holds.
    pub fn blobs(&self) -> Vec<PathBuf> {
        let folder = self.cache.path().join("cas/objects");
        files_below(&folder).into_keys().map(|name| folder.join(name)).collect()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that nothing listens on.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn spawn(program: &Path, port: u16, cache: &Path, options: &[String]) -> Child {
    let mut command = Command::new(program);
    command.arg(format!("--bind=127.0.0.1:{port}")).args(options).arg(cache);
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(30);
    while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(Instant::now() < deadline, "buildbox-casd does not listen");
        std::thread::sleep(Duration::from_millis(20));
    }
    child
}

/// The summary of a build with these options.
pub fn built(project: &Project, arguments: &[&str]) -> (serde_json::Value, Vec<serde_json::Value>) {
    let events = project.events(arguments);
    let end = events.last().expect("the build ends").clone();
    assert_eq!(end["event"], "ended", "{events:#?}");
    (end, events)
}

pub fn warnings(events: &[serde_json::Value]) -> Vec<&str> {
    let of_cache = events.iter().filter(|event| event["event"] == "shared-cache");
    of_cache.map(|event| event["message"].as_str().unwrap()).collect()
}

/// Asserts that a project has what a build of its manifest makes without a server.
pub fn assert_as_alone(project: &Project, round: u64) {
    let alone = Project::new(&std::fs::read_to_string(project.path("pipeline.toml")).unwrap());
    alone.ok(&["build"]);
    assert_same(&project.outputs(), &alone.outputs(), round);
}

pub fn assert_same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>, round: u64) {
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected), "round {round}");
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "round {round}: {name} differs");
    }
}
