//! What a process needed, as Linux counts it.

use std::collections::BTreeMap;
use std::fs;

/// The ticks of /proc in a second, which Linux has fixed.
const TICKS: f64 = 100.0;

/// The name and the processor time in seconds that a `stat` file gives.
fn stat(text: &str) -> Option<(&str, f64)> {
    let (before, after) = text.rsplit_once(") ")?;
    let mut fields = after.split(' ').skip(11).map(str::parse::<f64>);
    let (user, system) = (fields.next()?.ok()?, fields.next()?.ok()?);
    Some((before.split_once('(')?.1, (user + system) / TICKS))
}

/// The processor time of this process in seconds.
pub(crate) fn processor_seconds() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    stat(&text).map_or(0.0, |(_, seconds)| seconds)
}

/// The processor time of the threads that live, in seconds, by their names without numbers.
pub(crate) fn seconds_by_thread() -> BTreeMap<String, f64> {
    let mut seconds = BTreeMap::new();
    for entry in fs::read_dir("/proc/self/task").into_iter().flatten().flatten() {
        let text = fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
        if let Some((name, time)) = stat(&text) {
            let name = name.trim_end_matches(|c: char| c.is_ascii_digit());
            *seconds.entry(name.to_owned()).or_default() += time;
        }
    }
    seconds
}

/// A field of /proc/self/status in MiB: `VmRSS` is the memory now, `VmHWM` the most that it was.
pub(crate) fn memory(field: &str) -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(field)).unwrap_or_default();
    let kibibytes = line.trim_start_matches(':').trim().trim_end_matches("kB").trim();
    kibibytes.parse::<f64>().unwrap_or(0.0) / 1024.0
}
