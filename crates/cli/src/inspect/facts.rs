//! What is said of a file, in order.

use serde_json::Value;

/// Labels with their values.
pub(super) type Facts = Vec<(&'static str, Value)>;

/// The least, mean and greatest finite value of each channel, and the numbers of negative and of non-finite
/// values.
pub(super) fn range(unit: &str, values: impl Iterator<Item = [f64; 3]>) -> Facts {
    let (mut least, mut greatest, mut sum) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
    let mut count = [0_usize; 3];
    let (mut not_finite, mut negative) = (0_usize, 0_usize);
    for value in values {
        for channel in 0..3 {
            let number = value[channel];
            if !number.is_finite() {
                not_finite += 1;
                continue;
            }
            count[channel] += 1;
            negative += usize::from(number < 0.0);
            least[channel] = least[channel].min(number);
            greatest[channel] = greatest[channel].max(number);
            sum[channel] += number;
        }
    }
    let text_of = |values: [f64; 3]| {
        let texts = values.iter().zip(count);
        let texts = texts.map(|(value, count)| if count > 0 { format!("{value:.6}") } else { "none".into() });
        format!("[{}]", texts.collect::<Vec<_>>().join(", "))
    };
    let mean = [0, 1, 2].map(|channel| sum[channel] / count[channel] as f64);
    vec![
        ("values", unit.into()),
        ("least", text_of(least).into()),
        ("mean", text_of(mean).into()),
        ("greatest", text_of(greatest).into()),
        ("negative", negative.into()),
        ("not finite", not_finite.into()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_is_that_of_the_finite_values() {
        let values = [[1.0, f64::NAN, -1.0], [3.0, f64::INFINITY, f64::NAN]];
        let facts: std::collections::BTreeMap<_, _> =
            range("units", values.into_iter()).into_iter().collect();
        assert_eq!(facts["least"], "[1.000000, none, -1.000000]");
        assert_eq!(facts["mean"], "[2.000000, none, -1.000000]");
        assert_eq!((&facts["negative"], &facts["not finite"]), (&1.into(), &3.into()));
    }
}
