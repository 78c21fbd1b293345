//! Formats a share of energy.

/// `98.765 %`: three decimals, rounded down so that only the whole is 100 %.
pub(crate) fn share(part: f64) -> String {
    format!("{} %", (part * 1e5).floor() / 1e3)
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn only_the_whole_is_100_percent() {
        assert_eq!(share(0.98765432), "98.765 %");
        assert_eq!(share(0.999_999_9), "99.999 %");
        assert_eq!(share(1.0), "100 %");
    }
}
