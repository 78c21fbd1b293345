//! Numbers as people read them: counts, sizes, durations, percentages, ticks of an axis.

use std::fmt::Display;

/// `1 item`, `2 items`
pub(crate) fn count<N: Display + PartialEq + From<u8>>(number: N, what: &str) -> String {
    format!("{number} {what}{}", if number == N::from(1) { "" } else { "s" })
}

/// A size, in powers of 1000: `12 B`, `3.4 MB`.
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

/// A duration: `12 ms`, `1.42 s`, `2 min 5 s`.
pub(crate) fn duration(milliseconds: f64) -> String {
    match milliseconds {
        ms if ms < 9.95 => format!("{ms:.1} ms"),
        ms if ms < 999.5 => format!("{ms:.0} ms"),
        ms if ms < 59_995.0 => format!("{:.2} s", ms / 1000.0),
        ms => {
            let seconds = (ms / 1000.0).round();
            format!("{:.0} min {:.0} s", (seconds / 60.0).floor(), seconds % 60.0)
        }
    }
}

/// A part of a whole in percent: `37 %`; 0 % of nothing.
pub(crate) fn percent(part: u64, whole: u64) -> String {
    format!("{:.0} %", part as f64 * 100.0 / whole.max(1) as f64)
}

/// Round numbers from 0 to `last`, at most `most` steps of 1, 2 or 5 times a power of ten.
pub(crate) fn ticks(last: u64, most: u64) -> impl Iterator<Item = u64> {
    let steps = (0..19).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_u64.pow(power)));
    let step = steps.into_iter().find(|step| last / step <= most).unwrap_or(last.max(1));
    (0..=last / step).map(move |count| count * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_never_shown_as_1000_or_60_of_a_unit() {
        assert_eq!([999, 1000, 999_949, 999_950].map(size), ["999 B", "1.0 kB", "999.9 kB", "1.0 MB"]);
        for (milliseconds, text) in [
            (0.04, "0.0 ms"),
            (9.94, "9.9 ms"),
            (9.96, "10 ms"),
            (999.4, "999 ms"),
            (999.6, "1.00 s"),
            (59_996.0, "1 min 0 s"),
            (119_700.0, "2 min 0 s"),
            (125_000.0, "2 min 5 s"),
        ] {
            assert_eq!(duration(milliseconds), text);
        }
        assert_eq!(
            [count(0_usize, "item"), count(1, "item"), count(2, "item")],
            ["0 items", "1 item", "2 items"]
        );
    }
}
