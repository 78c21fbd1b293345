//! A share of energy in words.

/// `98.765 %`: three decimals, rounded down so that what is not whole is never called 100 %.
pub(crate) fn share(part: f64) -> String {
    format!("{} %", (part * 1e5).floor() / 1e3)
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn what_is_not_whole_is_not_called_whole() {
        assert_eq!(share(0.98765432), "98.765 %");
        assert_eq!(share(0.999_999_9), "99.999 %");
        assert_eq!(share(1.0), "100 %");
    }
}
