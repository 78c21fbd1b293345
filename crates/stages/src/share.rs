//! Formats shares of energy and relative errors.

/// `98.765 %`: three decimals, rounded down so that only the whole is 100 %.
pub(crate) fn share(part: f64) -> String {
    format!("{} %", (part * 1e5).floor() / 1e3)
}

/// `0.012 %`: two digits of an error.
pub(crate) fn percent(error: f64) -> String {
    if error == 0.0 {
        return "0 %".into();
    }
    let digits = (1.0 - math::log10((100.0 * error).max(1e-9)).floor()).clamp(0.0, 6.0) as usize;
    format!("{:.digits$} %", 100.0 * error)
}

#[cfg(test)]
mod tests {
    use super::{percent, share};

    #[test]
    fn an_error_has_two_digits() {
        assert_eq!(percent(0.12345), "12 %");
        assert_eq!(percent(0.000_123_45), "0.012 %");
        assert_eq!(percent(1.2345), "123 %");
        assert_eq!(percent(0.0), "0 %");
    }

    #[test]
    fn only_the_whole_is_100_percent() {
        assert_eq!(share(0.98765432), "98.765 %");
        assert_eq!(share(0.999_999_9), "99.999 %");
        assert_eq!(share(1.0), "100 %");
    }
}
