//! How panics are printed. The engine catches panics of kinds and reports them as failures of their items, so
//! they are printed only if `RUST_BACKTRACE` is set. Others are printed as Rust prints them, but through
//! `print.rs`, because a panic may quote text from a file.

use std::backtrace::Backtrace;
use std::env;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::thread;

use parking_lot::Mutex;

use crate::print;

/// The text of the last panic, if a worker panicked.
static WORKER_PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Calls a function; a panic of a worker during the call is printed only if it ends the call.
pub(crate) fn reported_once<T>(act: impl FnOnce() -> T) -> T {
    let backtrace = env::var_os("RUST_BACKTRACE").filter(|value| value != "0");
    panic::set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
        let thread = thread::current();
        let name = thread.name().unwrap_or("<unnamed>");
        let trace = match &backtrace {
            None => "note: run with `RUST_BACKTRACE=1` to display a backtrace".into(),
            Some(value) if value == "full" => format!("{:#}", Backtrace::force_capture()),
            Some(_) => Backtrace::force_capture().to_string(),
        };
        let text = format!("\nthread '{name}' {info}\n{}", trace.trim_end());
        let is_caught = backtrace.is_none() && name.starts_with(engine::WORKER);
        if !is_caught {
            print::message(&text);
        }
        *WORKER_PANIC.lock() = is_caught.then_some(text);
    }));
    panic::catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        if let Some(text) = WORKER_PANIC.lock().take() {
            print::message(&text);
        }
        panic::resume_unwind(panic)
    })
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::{env, fs};

    use clap::Parser;
    use engine::{Context, Failure, Kind, Kinds, Output, Port, Product, parameters};

    use super::reported_once;
    use crate::arguments::Arguments;
    use crate::{Exit, run};

    parameters! {
        /// None.
        struct Nothing {}
    }

    /// A kind with a bug.
    struct Broken;

    impl Kind for Broken {
        type Parameters = Nothing;

        const NAME: &'static str = "broken";
        const REVISION: u32 = 1;
        const TEXT: &'static str = "//! Panics.\n";

        fn ports() -> Vec<Port> {
            Vec::new()
        }

        fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
            Product::Artifact("nothing")
        }

        fn run(_: &Nothing, _: &Context<'_>) -> Result<Output, Failure> {
            panic!("ouch\u{1b}[31m");
        }
    }

    /// Set in the child process in which a test of this file runs another one.
    const OWN_PROCESS: &str = "SPECULA_TEST_PANICS";

    #[test]
    fn build_with_a_broken_kind() {
        if env::var_os(OWN_PROCESS).is_none() {
            return;
        }
        let arguments = Arguments::parse_from(["specula", "build"]);
        let kinds = Kinds::default().with(Broken);
        assert_eq!(reported_once(|| run(arguments, &kinds)), Exit::Failed);
    }

    #[test]
    fn end_by_a_worker() {
        if env::var_os(OWN_PROCESS).is_none() {
            return;
        }
        reported_once(|| {
            let worker = std::thread::Builder::new().name(format!("{} 0", engine::WORKER));
            let ended = worker.spawn(|| panic!("ouch\u{1b}[31m")).unwrap().join();
            std::panic::resume_unwind(ended.unwrap_err());
        })
    }

    /// What a test of this file prints to standard error.
    fn stderr_of(test: &str, backtrace: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("pipeline.toml"), "schema = 1\n[stage.a]\nkind = \"broken\"\n").unwrap();
        let mut command = Command::new(env::current_exe().unwrap());
        command.args(["--exact", "--nocapture", &format!("panics::tests::{test}")]);
        let output = command
            .env(OWN_PROCESS, "1")
            .env("RUST_BACKTRACE", backtrace)
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(String::from_utf8_lossy(&output.stdout).contains("running 1 test"));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.contains(r"ouch\u{1b}[31m") && !stderr.contains('\u{1b}'), "{stderr:?}");
        stderr
    }

    #[test]
    fn a_panic_of_a_kind_is_reported_as_a_failure_and_not_twice() {
        let stderr = stderr_of("build_with_a_broken_kind", "0");
        assert!(stderr.contains("a bug in kind broken: panicked: ouch"), "{stderr}");
        assert!(!stderr.contains("panicked at"), "{stderr}");
        let stderr = stderr_of("build_with_a_broken_kind", "1");
        assert!(stderr.contains("panicked at") && stderr.contains("panics.rs"), "{stderr}");
    }

    #[test]
    fn a_panic_that_ends_the_process_is_printed() {
        let stderr = stderr_of("end_by_a_worker", "0");
        assert_eq!(stderr.matches("panicked at").count(), 1, "{stderr}");
        assert!(stderr.contains("ouch"), "{stderr}");
    }
}
