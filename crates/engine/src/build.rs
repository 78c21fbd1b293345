//! The build: runs what is out of date and publishes what it exports.

use crate::{Cancel, Error, Event, Plan, Summary};

/// What a build is asked to do.
#[derive(Clone, Debug, Default)]
pub struct BuildOptions {
    /// The stages to build, with all that they need; empty stands for all stages.
    pub stages: Vec<String>,
    /// The number of threads; `None` stands for the number of available cores.
    pub jobs: Option<usize>,
    /// Whether items that do not depend on a failed one still run.
    pub keep_going: bool,
    /// Whether only to tell what would run and why; nothing is written.
    pub dry_run: bool,
}

/// Runs the items of a plan that are out of date and publishes the files of exporting stages into `out`.
///
/// Events come one at a time, from the calling thread. The failure of an item is told as an event and counted in the
/// summary; it is not an error of the build.
///
/// # Errors
/// Where the build as a whole cannot go on: an unknown stage, another build at work, a state folder that is damaged
/// beyond use or cannot be written.
pub fn build(
    plan: &Plan,
    options: &BuildOptions,
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Result<Summary, Error> {
    let _ = (plan, options, cancel, events);
    Err(Error::new(crate::ErrorKind::Io, "not written yet"))
}
