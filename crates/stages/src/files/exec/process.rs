//! Runs a program: its time limit, its output, its end, and the end of all processes that it started.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use engine::{Failure, Reporter, path_text};
use process_wrap::std::{ChildWrapper, CommandWrap};

use super::tools::Variable;

/// A program to run.
pub(super) struct Process {
    pub(super) program: PathBuf,
    pub(super) arguments: Vec<OsString>,
    pub(super) environment: Vec<Variable>,
    /// The command for messages.
    pub(super) name: String,
    pub(super) limit: Duration,
    pub(super) scratch: PathBuf,
}

/// The most bytes that a program may write to standard output, and to standard error.
const MOST_OUTPUT_FILES: u64 = 64 << 20;

/// The names of the files that receive the program's output. Unlike a pipe, a file cannot be held open for
/// ever by a process that is left.
const OUTPUT_FILES: [&str; 2] = ["stdout", "stderr"];

/// A running program. Dropping it kills it with all processes that it started.
struct Running(Box<dyn ChildWrapper>);

impl Drop for Running {
    fn drop(&mut self) {
        // All of them may have ended already.
        let _ = self.0.start_kill();
        let _ = self.0.wait();
    }
}

impl Process {
    /// Runs the program to its end in the folder `work`, and keeps its output in the scratch folder.
    ///
    /// # Errors
    /// If it cannot be started, fails or does not end in time, or the build is cancelled.
    pub(super) fn run(&self, work: &Path, reporter: &Reporter) -> Result<(), Failure> {
        reporter.check_cancelled()?;
        let output = OUTPUT_FILES.map(|name| self.scratch.join(name));
        let mut running = Running(self.start(&output, work)?);
        let began = Instant::now();
        let mut pause = Duration::from_millis(1);
        let status = loop {
            let ended = running.0.try_wait();
            let ended = ended.map_err(|error| self.failure("cannot be waited for", error).system_error())?;
            if let Some(status) = ended {
                break status;
            }
            reporter.check_cancelled()?;
            if began.elapsed() >= self.limit {
                drop(running);
                let seconds = self.limit.as_secs_f64();
                let message = format!("{} did not end within {seconds} s and was killed", self.name);
                return Err(with_output(Failure::new(message), &output).help(
                    "raise timeout, or run it by hand to see what it waits for: its standard input is empty",
                ));
            }
            if let Some(name) = too_long(&output) {
                drop(running);
                let message = format!(
                    "{} wrote more than {} MiB to {name} and was killed",
                    self.name,
                    MOST_OUTPUT_FILES >> 20
                );
                return Err(with_output(Failure::new(message), &output).help("make it write less"));
            }
            sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(20));
        };
        // Processes that it left running would write to a folder that is about to be removed.
        drop(running);
        self.check_status(status, &output)
    }

    /// The command for a shell, with its placeholders filled in.
    pub(super) fn command_line(&self) -> String {
        let words =
            std::iter::once(self.program.as_os_str()).chain(self.arguments.iter().map(OsString::as_os_str));
        words.map(|word| quoted(&word.to_string_lossy())).collect::<Vec<_>>().join(" ")
    }

    /// The command for a shell, to be run in a scratch folder that was moved, with its environment. Values of
    /// the user's variables are left to the user's shell: they may be secrets.
    pub(super) fn command_line_in(&self, scratch: &Path, work: &str) -> String {
        let mut line = format!("cd {} && env -i", quoted(&scratch.join(work).to_string_lossy()));
        for Variable { name, value, is_shown } in &self.environment {
            let name = name.to_string_lossy();
            // The folders of the environment were moved, too.
            let moved = Path::new(value).strip_prefix(&self.scratch).map(|inside| scratch.join(inside));
            let value = moved.map_or_else(|_| value.clone(), PathBuf::into_os_string);
            line += &match is_shown {
                true => format!(" {name}={}", quoted(&value.to_string_lossy())),
                false => format!(" {name}=\"${name}\""),
            };
        }
        format!("{line} {}", self.command_line())
    }

    fn start(&self, output: &[PathBuf; 2], work: &Path) -> Result<Box<dyn ChildWrapper>, Failure> {
        let [stdout, stderr] = output;
        let starter = starter(&self.program);
        let mut command =
            CommandWrap::with_new(starter.first().map_or(self.program.as_os_str(), OsStr::new), |_| {});
        let inner = command.command_mut();
        if !starter.is_empty() {
            inner.args(&starter[1..]).arg(&self.program);
        }
        inner.args(&self.arguments).current_dir(work).stdin(Stdio::null());
        inner.env_clear().envs(self.environment.iter().map(|Variable { name, value, .. }| (name, value)));
        let files = File::create(stdout).and_then(|stdout| Ok((stdout, File::create(stderr)?)));
        let (stdout, stderr) =
            files.map_err(|error| self.failure("cannot be given files", error).system_error())?;
        inner.stdout(stdout).stderr(stderr);
        #[cfg(unix)]
        command.wrap(process_wrap::std::ProcessGroup::leader());
        #[cfg(windows)]
        command.wrap(process_wrap::std::JobObject);
        let mut attempts = 0;
        loop {
            match command.spawn() {
                // Another process is still writing the program's file; it will soon be done.
                Err(error) if error.kind() == ErrorKind::ExecutableFileBusy && attempts < 100 => {
                    attempts += 1;
                    sleep(Duration::from_millis(20));
                }
                started => return started.map_err(|error| self.not_started(error)),
            }
        }
    }

    fn check_status(&self, status: ExitStatus, output: &[PathBuf; 2]) -> Result<(), Failure> {
        if status.success() {
            return Ok(());
        }
        Err(with_output(Failure::new(format!("{} ended with {status}", self.name)), output))
    }

    fn failure(&self, what: &str, error: io::Error) -> Failure {
        Failure::from(error).context(format!("{} {what}", self.name))
    }

    fn not_started(&self, error: io::Error) -> Failure {
        let help = match error.kind() {
            _ if cfg!(windows) && error.raw_os_error() == Some(BAD_EXE_FORMAT) => {
                Some("this file is not a program of Windows: name the interpreter of a script first")
            }
            ErrorKind::PermissionDenied => Some("make the file executable, or name its interpreter first"),
            // The program exists, because it was read; its interpreter does not.
            ErrorKind::NotFound => Some("the interpreter in its first line (#!) does not exist"),
            ErrorKind::ArgumentListTooLong => Some("put long arguments into a file"),
            _ => None,
        };
        let failure = self.failure(&format!("cannot be started ({})", path_text(&self.program)), error);
        match help {
            Some(help) => failure.help(help),
            None => failure,
        }
    }
}

/// Windows cannot run a file, because it is not a program.
const BAD_EXE_FORMAT: i32 = 193;

/// What starts a program that the system does not start itself: on Windows a script of PowerShell. The system
/// starts `.bat` and `.cmd`.
fn starter(program: &Path) -> &'static [&'static str] {
    let is_script = program.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ps1"));
    match cfg!(windows) && is_script {
        true => &["powershell.exe", "-NoProfile", "-NonInteractive", "-ExecutionPolicy", "Bypass", "-File"],
        false => &[],
    }
}

/// A word for a shell.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_@%+=:,./-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

fn too_long(output: &[PathBuf; 2]) -> Option<&'static str> {
    let is_long = |file: &PathBuf| fs::metadata(file).is_ok_and(|file| file.len() > MOST_OUTPUT_FILES);
    let names = ["standard output", "standard error"];
    output.iter().zip(names).find(|(file, _)| is_long(file)).map(|(_, name)| name)
}

/// The failure with the last lines of the program's standard error or, if that is empty, of its standard
/// output.
fn with_output(mut failure: Failure, output: &[PathBuf; 2]) -> Failure {
    let [stdout, stderr] = output;
    let last = [("standard error", stderr), ("standard output", stdout)]
        .map(|(name, file)| (name, last_lines(file).unwrap_or_default()));
    match last.into_iter().find(|(_, text)| !text.is_empty()) {
        Some((name, text)) => failure.chain.push(format!("the end of its {name}:\n{text}")),
        None => failure.chain.push("it wrote nothing to standard output and standard error".into()),
    }
    failure
}

fn last_lines(file: &Path) -> io::Result<String> {
    const MOST_BYTES: u64 = 4096;
    const MOST_LINES: usize = 20;
    let mut file = File::open(file)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(MOST_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes)?;
    let text = readable(&String::from_utf8_lossy(&bytes));
    let lines: Vec<&str> = text.trim_end().lines().collect();
    Ok(lines[lines.len().saturating_sub(MOST_LINES)..].join("\n"))
}

/// A text without the control sequences of a terminal: colours, cursor movements, bells.
fn readable(text: &str) -> String {
    let mut shown = String::new();
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '\x1b' if characters.next_if_eq(&'[').is_some() => {
                characters.by_ref().find(|c| ('\x40'..='\x7e').contains(c));
            }
            '\n' | '\t' => shown.push(character),
            '\r' if characters.peek() != Some(&'\n') => shown.push('\n'),
            _ if character.is_control() => {}
            _ => shown.push(character),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_is_shown_without_control_sequences() {
        assert_eq!(readable("\x1b[1;31merror\x1b[0m:\ta\r\nb\x07\x1b]c"), "error:\ta\nb]c");
        assert_eq!(readable("10%\r20%\r"), "10%\n20%\n");
        assert_eq!(readable("\x1b["), "");
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, expected) in [
            ("--lut=/a/b.cube", "--lut=/a/b.cube"),
            ("", "''"),
            ("a b", "'a b'"),
            ("cp $0 \"$1\"", "'cp $0 \"$1\"'"),
            ("it's", r"'it'\''s'"),
        ] {
            assert_eq!(quoted(word), expected);
        }
    }

    #[test]
    fn the_last_lines_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("stderr");
        let text: String = (0..5000).map(|line| format!("line {line}\n")).collect();
        std::fs::write(&file, text).unwrap();
        let output = last_lines(&file).unwrap();
        assert!(output.starts_with("line 4980\n") && output.ends_with("line 4999"), "{output}");
    }
}
