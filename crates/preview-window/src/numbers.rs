//! The window's formats of numbers.

/// A size in bytes, with three digits.
pub(crate) fn bytes(bytes: u64) -> String {
    let mut size = bytes as f64;
    for unit in ["B", "kB", "MB"] {
        if size < 999.5 {
            return format!("{} {unit}", three_digits(size));
        }
        size /= 1000.0;
    }
    format!("{} GB", three_digits(size))
}

/// A share of a whole. Only exactly 1 is written as 100 %.
pub(crate) fn percent(share: f64) -> String {
    if (0.9995..1.0).contains(&share) {
        let missing = 100.0 * (1.0 - share);
        return if missing < 1e-3 { "over 99.999 %".into() } else { format!("{:.3} %", 100.0 - missing) };
    }
    format!("{:.1} %", 100.0 * share)
}

pub(crate) fn seconds(seconds: f64) -> String {
    if seconds < 0.9995 {
        format!("{} ms", three_digits(1000.0 * seconds))
    } else {
        format!("{} s", three_digits(seconds))
    }
}

pub(crate) fn error(relative: f64) -> String {
    format!("{} %", three_digits(100.0 * relative))
}

/// How far a picture is from the right one: the stops that 95 and 99 of 100 samples stay below, and the
/// relative RMS.
pub(crate) fn apart([p95, p99]: [f64; 2], rms: f64) -> String {
    format!("95 % within {p95:.2} stops, 99 % within {p99:.2}; RMS {}", error(rms))
}

/// How far a picture is from the right one, in few words, since the inspector is narrow: the stops that 95
/// and 99 of 100 samples stay below, and the relative RMS.
pub(crate) fn apart_in_columns([p95, p99]: [f64; 2], rms: f64) -> String {
    format!("{p95:.2}, {p99:.2} stops, {}", error(rms))
}

pub(crate) fn degrees(radians: f64) -> String {
    // Adding 0 removes the sign of -0.
    format!("{:.1}°", (radians.to_degrees() * 10.0).round() / 10.0 + 0.0)
}

pub(crate) fn stops(exposure: f64) -> String {
    format!("{:+.2} stops", (exposure * 100.0).round() / 100.0 + 0.0)
}

fn three_digits(value: f64) -> String {
    let decimals = match value.abs() {
        0.0 => 0,
        small if small < 0.001 => return format!("{value:.1e}"),
        small if small < 0.1 => 4,
        small if small < 1.0 => 3,
        small if small < 9.995 => 2,
        small if small < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_with_three_digits_and_their_unit() {
        assert_eq!([0, 999, 1000, 1_234_567].map(bytes), ["0 B", "999 B", "1.00 kB", "1.23 MB"]);
        assert_eq!(bytes(2_400_000_000_000), "2400 GB");
        assert_eq!([0.0, 0.5, 1.0].map(percent), ["0.0 %", "50.0 %", "100.0 %"]);
        assert_eq!([0.9999, 0.99999999].map(percent), ["99.990 %", "over 99.999 %"]);
        assert_eq!([0.000_25, 0.0123, 1.5].map(seconds), ["0.250 ms", "12.3 ms", "1.50 s"]);
        assert_eq!([0.0, 0.0123, 2e-7].map(error), ["0 %", "1.23 %", "2.0e-5 %"]);
        assert_eq!([0.0, -0.0001, -0.5].map(degrees), ["0.0°", "0.0°", "-28.6°"]);
        assert_eq!([-0.0, 1.0 / 3.0].map(stops), ["+0.00 stops", "+0.33 stops"]);
    }
}
