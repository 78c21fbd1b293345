//! Numbers as people read and type them: counts, sizes, durations.

use std::fmt::Display;

/// `1 item`, `2 items`
pub(crate) fn count<N: Display + PartialEq + From<u8>>(number: N, what: &str) -> String {
    format!("{number} {what}{}", if number == N::from(1) { "" } else { "s" })
}

/// Of thousands of failed items so many are told in full; the others are counted.
pub(crate) const SHOWN: usize = 50;

/// `... and 4950 more errors`: the line for those of many things that are not shown, if there are any.
pub(crate) fn more(number: usize, what: &str) -> Option<String> {
    (number > 0).then(|| format!("... and {}", count(number, what)))
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

/// The size that a text names: a number, and a unit if need be. K, M, G and T are powers of 1000, as in what [`size`]
/// shows, Ki to Ti of 1024; a B may follow, and case does not count: `500M`, `1.5 GB`, `2GiB`, `1000000`.
///
/// # Errors
/// Where it is no such thing, with what was expected.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let expected = || "expected a number and a unit, such as 500M, 20GB, 512MiB or 0".to_owned();
    let text = text.trim();
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text[..split].parse().map_err(|_| expected())?;
    let unit = text[split..].trim_start().to_ascii_lowercase();
    let factor = match unit.strip_suffix('b').unwrap_or(&unit) {
        "" => 1.0,
        unit => {
            let (letter, base) = unit.strip_suffix('i').map_or((unit, 1000.0), |letter| (letter, 1024.0));
            let power = ["", "k", "m", "g", "t"].iter().position(|known| *known == letter);
            let power = power.filter(|power| *power > 0).ok_or_else(expected)?;
            f64::powi(base, i32::try_from(power).unwrap_or_default())
        }
    };
    let bytes = (number * factor).round();
    // Past 2^53 not every number of bytes can be told from the next; no disk is so large.
    if bytes < (1_u64 << 53) as f64 { Ok(bytes as u64) } else { Err(expected()) }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        for (text, bytes) in [
            ("0", 0),
            ("1000000", 1_000_000),
            ("12b", 12),
            ("1k", 1000),
            ("1 kB", 1000),
            ("500M", 500_000_000),
            ("500MB", 500_000_000),
            ("20GB", 20_000_000_000),
            ("1.5 GB", 1_500_000_000),
            ("1T", 1_000_000_000_000),
            ("4KiB", 4096),
            ("64mib", 64 << 20),
            ("2gi", 2 << 30),
            ("1.5GiB", 3 << 29),
            ("2TiB", 2 << 40),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused_with_an_example() {
        for text in [
            "",
            "M",
            "GiB",
            "-1",
            "-5M",
            "1e3",
            "5X",
            "5MM",
            "5iB",
            "1..5M",
            "1.2.3G",
            "12 parsecs",
            "1MiBs",
            "9999999TiB",
            "99999999T",
            "nan",
        ] {
            let error = parse_size(text).unwrap_err();
            assert!(error.contains("512MiB"), "{text}: {error}");
        }
    }

    #[test]
    fn what_is_shown_is_never_1000_or_60_of_a_unit() {
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
