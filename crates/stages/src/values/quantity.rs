//! Sizes, numbers of things and ticks, as the report, the contact sheet and the command line show them.

/// Writes a size in powers of 1000: `12 B`, `3.4 MB`.
pub fn size(bytes: u64) -> String {
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

/// Writes a number of things: `1 light`, `3 lights`.
pub fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// Round numbers from 0 to `last`, at most `most` steps of 1, 2 or 5 times a power of ten.
pub fn ticks(last: u64, most: u64) -> impl Iterator<Item = u64> {
    let steps = (0..19).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_u64.pow(power)));
    let step = steps.into_iter().find(|step| last / step <= most).unwrap_or(last.max(1));
    (0..=last / step).map(move |count| count * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_never_1000_of_a_unit() {
        let found = [999, 1000, 999_949, 999_950, 196_608, 1_769_472].map(size);
        assert_eq!(found, ["999 B", "1.0 kB", "999.9 kB", "1.0 MB", "196.6 kB", "1.8 MB"]);
    }

    #[test]
    fn one_thing_is_no_plural() {
        assert_eq!([0, 1, 2].map(|number| count(number, "tap")), ["0 taps", "1 tap", "2 taps"]);
    }

    #[test]
    fn ticks_are_round_and_few() {
        let ticks = |last, most| ticks(last, most).collect::<Vec<_>>();
        assert_eq!(ticks(0, 10), [0]);
        assert_eq!(ticks(4, 10), [0, 1, 2, 3, 4]);
        assert_eq!(ticks(30, 10), [0, 5, 10, 15, 20, 25, 30]);
        assert_eq!(ticks(255, 10), [0, 50, 100, 150, 200, 250]);
        for last in 0..3000 {
            let count = ticks(last, 10).len() as u64;
            assert!(count <= 11 && count > last.min(4), "{last}");
        }
    }
}
