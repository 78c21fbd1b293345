//! What the terminal on standard error can show.

use std::io::IsTerminal;

/// Whether someone watches: progress bars may move.
pub(crate) fn is_watched() -> bool {
    std::io::stderr().is_terminal()
}

/// Whether colour is wanted: on a terminal, unless `NO_COLOR` is set.
pub(crate) fn shows_colour() -> bool {
    is_watched() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Whether lines and corners can be drawn.
pub(crate) fn shows_unicode() -> bool {
    let locale =
        ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().filter_map(std::env::var_os).find(|v| !v.is_empty());
    cfg!(windows) || locale.is_some_and(|locale| locale.to_string_lossy().to_lowercase().contains("utf"))
}

/// The columns to fill.
pub(crate) fn width() -> usize {
    100
}

/// A size for people, in powers of 1000: `12 B`, `3.4 MB`.
pub(crate) fn size(bytes: u64) -> String {
    let mut size = bytes as f64;
    let mut units = ["B", "kB", "MB", "GB", "TB"].into_iter();
    let mut unit = units.next().unwrap_or_default();
    // What would be written as 1000 of one unit is 1 of the next.
    while size >= 999.95
        && let Some(next) = units.next()
    {
        (size, unit) = (size / 1000.0, next);
    }
    if unit == "B" { format!("{bytes} B") } else { format!("{size:.1} {unit}") }
}

/// A duration for people: `12 ms`, `1.42 s`, `2 min 5 s`.
pub(crate) fn duration(milliseconds: f64) -> String {
    match milliseconds {
        ms if ms < 10.0 => format!("{ms:.1} ms"),
        ms if ms < 1000.0 => format!("{ms:.0} ms"),
        ms if ms < 60_000.0 => format!("{:.2} s", ms / 1000.0),
        ms => format!("{:.0} min {:.0} s", (ms / 60_000.0).floor(), (ms / 1000.0) % 60.0),
    }
}

/// The time of day where the user is: `14:03:12`.
pub(crate) fn time_of_day() -> String {
    jiff::Zoned::now().strftime("%H:%M:%S").to_string()
}
