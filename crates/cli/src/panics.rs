//! Panics of kinds: the engine catches them and tells them as failures of their items, so that Rust's own lines about
//! them would only be in the way. With `RUST_BACKTRACE` set they are printed all the same. They are printed as Rust does, but
//! through `print.rs`: a panic may quote what a file holds.

use std::backtrace::Backtrace;
use std::env;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::thread;

use parking_lot::Mutex;

use crate::print;

/// What the last panic would have printed, where it was a worker's.
static KEPT: Mutex<Option<String>> = Mutex::new(None);

/// Does something during which panics of workers are printed only where they end it.
pub(crate) fn told_once<T>(act: impl FnOnce() -> T) -> T {
    let backtrace = env::var_os("RUST_BACKTRACE").filter(|value| value != "0");
    panic::set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
        let thread = thread::current();
        let name = thread.name().unwrap_or("<unnamed>");
        let trace = match &backtrace {
            None => "note: run with `RUST_BACKTRACE=1` to see where it comes from".into(),
            Some(value) if value == "full" => format!("{:#}", Backtrace::force_capture()),
            Some(_) => Backtrace::force_capture().to_string(),
        };
        let told = format!("\nthread '{name}' {info}\n{}", trace.trim_end());
        let is_kept = backtrace.is_none() && name.starts_with(engine::WORKER);
        if !is_kept {
            print::message(&told);
        }
        *KEPT.lock() = is_kept.then_some(told);
    }));
    panic::catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|ended| {
        if let Some(kept) = KEPT.lock().take() {
            print::message(&kept);
        }
        panic::resume_unwind(ended)
    })
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::{env, fs};

    use clap::Parser;
    use engine::{Context, Failure, Kind, Kinds, Output, Port, Product, parameters};

    use super::told_once;
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

    /// Set in the process of its own that a test of this file runs another one in.
    const OWN_PROCESS: &str = "SPECULA_TEST_PANICS";

    #[test]
    fn build_with_a_broken_kind() {
        if env::var_os(OWN_PROCESS).is_none() {
            return;
        }
        let arguments = Arguments::parse_from(["specula", "build"]);
        let kinds = Kinds::default().with(Broken);
        assert_eq!(told_once(|| run(arguments.command, &kinds)), Exit::Failed);
    }

    #[test]
    fn end_by_a_worker() {
        if env::var_os(OWN_PROCESS).is_none() {
            return;
        }
        told_once(|| {
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
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(told.contains(r"ouch\u{1b}[31m") && !told.contains('\u{1b}'), "{told:?}");
        told
    }

    #[test]
    fn a_panic_of_a_kind_is_told_as_a_failure_and_no_second_time() {
        let told = stderr_of("build_with_a_broken_kind", "0");
        assert!(told.contains("a bug in kind broken: panicked: ouch"), "{told}");
        assert!(!told.contains("panicked at"), "{told}");
        let told = stderr_of("build_with_a_broken_kind", "1");
        assert!(told.contains("panicked at") && told.contains("panics.rs"), "{told}");
    }

    #[test]
    fn a_panic_that_ends_the_process_is_told() {
        let told = stderr_of("end_by_a_worker", "0");
        assert_eq!(told.matches("panicked at").count(), 1, "{told}");
        assert!(told.contains("ouch"), "{told}");
    }
}
