//! Sizes as they are typed and shown: `512MiB`, `20 GB`, `0`.

/// The units, largest first.
const UNITS: [(&str, u64); 9] = [
    ("TiB", 1 << 40),
    ("GiB", 1 << 30),
    ("MiB", 1 << 20),
    ("KiB", 1 << 10),
    ("TB", 1_000_000_000_000),
    ("GB", 1_000_000_000),
    ("MB", 1_000_000),
    ("kB", 1_000),
    ("B", 1),
];

/// The number of bytes that a text names: a number, and a unit if need be. Case does not count, and a letter alone stands
/// for the power of 1024: `1.5g` is `1.5GiB`.
///
/// # Errors
/// Where it is no such thing, with what was expected.
pub(crate) fn parse(text: &str) -> Result<u64, String> {
    let expected = || format!("expected a size such as 512MiB, 20GB or 0, not {text:?}");
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let number: f64 = number.parse().map_err(|_| expected())?;
    let unit = unit.trim();
    let factor = match unit {
        "" => 1,
        _ => {
            let whole = |name: &str| name.eq_ignore_ascii_case(unit);
            let letter = |name: &str| name.ends_with("iB") && name[..1].eq_ignore_ascii_case(unit);
            let found = UNITS.iter().find(|(name, _)| whole(name) || letter(name));
            found.ok_or_else(expected)?.1
        }
    };
    let bytes = number * factor as f64;
    // Past 2^53 not every number of bytes can be told from the next; no disk is so large.
    if bytes < (1_u64 << 53) as f64 { Ok(bytes as u64) } else { Err(expected()) }
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn sizes_are_numbers_with_a_unit() {
        for (text, bytes) in [
            ("0", 0),
            ("512", 512),
            ("512B", 512),
            ("1KiB", 1024),
            ("1k", 1024),
            ("1 kB", 1000),
            ("64M", 64 << 20),
            ("64mib", 64 << 20),
            ("1.5GiB", 3 << 29),
            ("20GB", 20_000_000_000),
            ("2TiB", 2 << 40),
        ] {
            assert_eq!(parse(text), Ok(bytes), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused_with_an_example() {
        for text in ["", "GiB", "-1", "1e3", "1..5M", "12 parsecs", "9999999TiB", "1MiBs", "nan"] {
            let error = parse(text).unwrap_err();
            assert!(error.contains("512MiB") && error.contains(text), "{text}: {error}");
        }
    }
}
