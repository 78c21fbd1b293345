//! Numbers as people read them: counts, sizes, durations, percentages, ticks of an axis.

use std::fmt::Display;

pub(crate) use stages::quantity::{size, ticks};

/// `1 item`, `2 items`
pub(crate) fn count<N: Display + PartialEq + From<u8>>(number: N, what: &str) -> String {
    format!("{number} {what}{}", if number == N::from(1) { "" } else { "s" })
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

/// A share of work that is done: `45 %`, rounded down so that only all of it is 100 %.
pub(crate) fn percent_done(share: f64) -> String {
    format!("{:.0} %", (share * 100.0).floor())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_never_shown_as_1000_or_60_of_a_unit() {
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
        assert_eq!([0.0, 0.459, 0.999, 1.0].map(percent_done), ["0 %", "45 %", "99 %", "100 %"]);
    }
}
