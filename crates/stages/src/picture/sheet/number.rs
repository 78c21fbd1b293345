//! Formats numbers for labels.

/// A number with three significant digits: `0.0213`, `1.25`, `34.2`, `1830`, `2.20×10⁵`.
pub(crate) fn short(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let rounded = format!("{:.2e}", value.abs());
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let digits = match exponent {
        _ if value == 0.0 => "0".into(),
        -3..=2 => format!("{:.*}", usize::try_from(2 - exponent).unwrap_or(0), value.abs()),
        3..=4 => format!("{:.0}", value.abs()),
        _ => format!("{mantissa}×{}", power_of_ten(exponent)),
    };
    if value < 0.0 { format!("−{digits}") } else { digits }
}

/// 10 with its exponent: `10⁻³`.
pub(crate) fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.to_string();
    let raised = digits.chars().map(|digit| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    });
    format!("10{}", raised.collect::<String>())
}

/// A signed number of stops: `+1.3 stops`.
pub(crate) fn stops(exposure: f64) -> String {
    let text = format!("{exposure:+.1} stops").replace('-', "−");
    if text == "−0.0 stops" { "+0.0 stops".into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let cases = [
            (0.0, "0"),
            (0.021_34, "0.0213"),
            (1.251, "1.25"),
            (34.24, "34.2"),
            (183.4, "183"),
            (1834.0, "1834"),
            (220_000.0, "2.20×10⁵"),
            (-0.5, "−0.500"),
            (1e-7, "1.00×10⁻⁷"),
            (9.999, "10.0"),
            (f64::NAN, "–"),
        ];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
        assert_eq!(power_of_ten(-12), "10⁻¹²");
        assert_eq!(power_of_ten(4), "10⁴");
    }

    #[test]
    fn stops_carry_a_sign() {
        assert_eq!(stops(1.26), "+1.3 stops");
        assert_eq!(stops(-0.3), "−0.3 stops");
        assert_eq!(stops(-0.01), "+0.0 stops");
    }
}
