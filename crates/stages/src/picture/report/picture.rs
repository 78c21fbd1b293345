//! Differences of pictures inside the page.

/// The difference of two pictures as shown, times `amplify`, cut at white.
pub(crate) fn difference(a: &[[u8; 3]], b: &[[u8; 3]], amplify: f64) -> Vec<[u8; 3]> {
    let channel = |a: u8, b: u8| (f64::from(a.abs_diff(b)) * amplify).min(255.0).round() as u8;
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|i| channel(a[i], b[i]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_between_pictures_as_shown() {
        let found = difference(&[[10, 200, 0]], &[[20, 100, 0]], 8.0);
        assert_eq!(found, [[80, 255, 0]]);
    }
}
