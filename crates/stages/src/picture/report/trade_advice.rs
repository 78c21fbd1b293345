//! The taps and lights that a pair needs, in a line.

use taps::{Accuracy, Trade};

use crate::picture::report::figures::{Limits, TapAdvice, Technique, TradePoint, TradeSeries};
use crate::values::quantity::{self, size};

/// The errors in stops of 95 and 99 of 100 samples that are good enough: those of `export-taps`.
pub(crate) const LIMITS: Limits = Limits { p95: 0.1, p99: 0.25 };

/// Advises the cheapest taps and lights whose errors are good enough, otherwise the best.
pub(crate) fn of_series(series: &[TradeSeries]) -> TapAdvice {
    let taps = series.iter().filter(|series| series.technique == Technique::Taps);
    let all: Vec<(usize, &TradePoint)> =
        taps.flat_map(|series| series.points.iter().map(|point| (series.lights, point))).collect();
    let trade = |(table, (lights, point)): (usize, &(usize, &TradePoint))| Trade {
        table,
        taps: point.degree.unwrap_or(0),
        lights: *lights,
        accuracy: Accuracy { p95: point.errors.p95, p99: point.errors.p99 },
    };
    let trades: Vec<Trade> = all.iter().enumerate().map(trade).collect();
    let Some((lights, point)) = Trade::cheapest(&trades, LIMITS.stops()).map(|chosen| all[chosen.table])
    else {
        let text = String::new();
        return TapAdvice { taps: 0, lights: 0, bytes: 0, p95: 0.0, p99: 0.0, good: false, text };
    };
    let taps = point.degree.unwrap_or(0);
    let (p95, p99) = (point.errors.p95, point.errors.p99);
    let good = LIMITS.excess(&point.errors) <= 1.0;
    let what = format!("{} and {}", count(taps, "tap"), count(lights, "light"));
    let bytes = size(point.bytes);
    let text = if good {
        format!("{what}: {bytes} for all materials, within {p95:.2} stops (95 %) and {p99:.2} (99 %).")
    } else {
        format!(
            "No number of taps and lights is within {} and {} stops. The best is {what}: {bytes} for all materials, \
             within {p95:.2} stops (95 %) and {p99:.2} (99 %).",
            LIMITS.p95, LIMITS.p99
        )
    };
    TapAdvice { taps, lights, bytes: point.bytes, p95, p99, good, text }
}

/// A number of things.
fn count(number: usize, what: &str) -> String {
    if number == 0 { format!("no {what}s") } else { quantity::count(number, what) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::report::figures::Errors;

    fn series(technique: Technique, lights: usize, points: &[(usize, f64, f64)]) -> TradeSeries {
        let point = |&(degree, p95, p99): &(usize, f64, f64)| TradePoint {
            degree: Some(degree),
            errors: Errors { p95, p99, ..Errors::default() },
            bytes: 540_000,
            fetches: 2 * degree,
            one_of: 1,
        };
        TradeSeries { technique, lights, points: points.iter().map(point).collect() }
    }

    #[test]
    fn the_cheapest_that_is_good_enough_is_advised() {
        // Six taps and four lights cost 260, four taps and eight lights 360, eight taps and four 300.
        let all = [
            series(Technique::Shrm, 0, &[(0, 0.01, 0.01)]),
            series(Technique::Taps, 0, &[(8, 0.09, 0.3)]),
            series(Technique::Taps, 4, &[(4, 0.2, 0.3), (6, 0.08, 0.2), (8, 0.05, 0.1)]),
            series(Technique::Taps, 8, &[(4, 0.07, 0.2)]),
        ];
        let advice = of_series(&all);
        assert_eq!((advice.taps, advice.lights, advice.good), (6, 4, true));
        assert_eq!(
            advice.text,
            "6 taps and 4 lights: 540.0 kB for all materials, within 0.08 stops (95 %) and 0.20 (99 %)."
        );
    }

    #[test]
    fn where_nothing_is_good_enough_the_best_is_named_with_its_errors() {
        let all = [
            series(Technique::Taps, 0, &[(1, 0.9, 1.8), (8, 0.12, 0.3)]),
            series(Technique::Taps, 1, &[(8, 0.11, 0.4)]),
        ];
        let advice = of_series(&all);
        assert_eq!((advice.taps, advice.lights, advice.good), (8, 0, false));
        assert!(advice.text.starts_with("No number of taps and lights is within 0.1 and 0.25 stops."));
        assert!(advice.text.ends_with(
            "8 taps and no lights: 540.0 kB for all materials, within 0.12 stops (95 %) and 0.30 (99 %)."
        ));
    }
}
