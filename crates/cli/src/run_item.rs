//! `specula run-item`: what a worker of a build with `--remote-executor` runs.

use std::path::Path;

use engine::Kinds;

use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print;

pub(crate) fn run(item: &Path, kinds: &Kinds) -> Result<Exit, CommandError> {
    let folder = item.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match engine::run_item(folder, kinds)? {
        None => Ok(Exit::Success),
        Some(failure) => {
            print::error(&failure.chain, failure.help.as_deref());
            Ok(Exit::Failed)
        }
    }
}
