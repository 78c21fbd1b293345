//! How the degree P of a field or a map is chosen: `accept`, `error` and `most-p`.

use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use serde_json::json;
use shrm::{DegreeRule, MapDegree, MapTolerance, Terms};

use crate::values::percent;

/// The errors that a map may have if the manifest says nothing.
pub(crate) const ACCEPT: Accept = Accept([0.15, 0.4]);

/// The highest P that `most-p` may be: that of the coefficients that `project-brdf` makes by default is less.
pub(crate) const MAX_P: usize = 32;

/// The largest number of stops in `accept`.
const MOST_STOPS: f64 = 100.0;

/// Errors in stops that 5 % of the views, and 1 %, may exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Accept(pub(crate) [f64; 2]);

impl Parameter for Accept {
    fn expected() -> String {
        "[p95, p99], two numbers of stops above 0".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let pair = match &value.kind {
            ValueKind::Array(_) => <[f64; 2]>::try_from(Vec::<f64>::parse(value)?).ok(),
            _ => None,
        };
        let pair = pair.filter(|pair| pair.iter().all(|stops| *stops > 0.0 && *stops <= MOST_STOPS));
        pair.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(Parameter::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        let stops = json!({ "type": "number", "exclusiveMinimum": 0, "maximum": MOST_STOPS });
        json!({ "type": "array", "items": stops, "minItems": 2, "maxItems": 2 })
    }
}

/// The parameters by which P is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DegreeChoice {
    pub(crate) accept: Option<Accept>,
    pub(crate) error: Option<f64>,
    pub(crate) most_p: Option<usize>,
}

impl DegreeChoice {
    /// Parameters that contradict each other.
    pub(crate) fn check(&self) -> Vec<(&'static str, String)> {
        match (self.accept, self.error) {
            (Some(_), Some(_)) => vec![("error", "accept already sets the allowed error".into())],
            _ => Vec::new(),
        }
    }

    /// The error that is allowed, if the manifest says so.
    pub(crate) fn tolerance(&self) -> Option<MapTolerance> {
        let accept = self.accept.map(|Accept(stops)| MapTolerance::Stops(stops));
        accept.or(self.error.map(MapTolerance::Rms))
    }

    /// The rule with these defaults, for a map that keeps these coefficients.
    pub(crate) fn rule(&self, accept: Accept, most_p: usize, terms: Terms) -> DegreeRule {
        let tolerance = self.tolerance().unwrap_or(MapTolerance::Stops(accept.0));
        DegreeRule { tolerance, most_p: self.most_p.unwrap_or(most_p), terms }
    }
}

/// Says how far off a map is, in the measure of its tolerance.
pub(crate) fn reached(tolerance: MapTolerance, map: &MapDegree) -> String {
    match tolerance {
        MapTolerance::Stops(_) => {
            format!("95 % of views are within {:.3} stops, 99 % within {:.3}", map.p95, map.p99)
        }
        MapTolerance::Rms(_) => format!("the RMS error is {} of the RMS radiance", percent(map.rms)),
    }
}

/// Says that a map misses its tolerance, by how much, and which parameters help.
pub(crate) fn missed(rule: DegreeRule, map: &MapDegree) -> String {
    let (asked, parameter) = match rule.tolerance {
        MapTolerance::Stops([p95, p99]) => (format!("accept = [{p95}, {p99}]"), "accept"),
        MapTolerance::Rms(error) => (format!("error = {error}"), "error"),
    };
    let (most, p, reached) = (rule.most_p, map.p.get(), reached(rule.tolerance, map));
    let help = match map.enough {
        Some(enough) => format!("most-p = {enough} is enough"),
        None => format!("raise most-p to come closer, or `{parameter}` to allow more"),
    };
    format!("no P up to {most} meets {asked}: at P = {p} {reached}; {help}")
}

#[cfg(test)]
mod tests {
    use sh::Degree;

    use super::*;

    fn parsed(numbers: &[f64]) -> Result<Accept, Diagnostic> {
        let value = |kind| Value { span: 0..1, kind };
        let numbers = numbers.iter().map(|number| value(ValueKind::Float(*number))).collect();
        Accept::parse(&value(ValueKind::Array(numbers)))
    }

    #[test]
    fn two_positive_numbers_are_errors_to_accept() {
        assert_eq!(parsed(&[0.1, 0.25]).unwrap().canonical(), json!([0.1, 0.25]));
        for wrong in [&[0.1][..], &[0.1, 0.2, 0.3], &[0.0, 0.2], &[0.1, -1.0], &[0.1, 1e9], &[f64::NAN, 0.1]]
        {
            assert!(parsed(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn what_is_given_goes_before_what_is_usual() {
        let none = DegreeChoice::default();
        assert_eq!(
            none.rule(ACCEPT, 4, Terms::All),
            DegreeRule { tolerance: MapTolerance::Stops([0.15, 0.4]), most_p: 4, terms: Terms::All }
        );
        let given = DegreeChoice { error: Some(0.1), most_p: Some(6), ..none };
        assert_eq!(
            given.rule(ACCEPT, 4, Terms::Zonal),
            DegreeRule { tolerance: MapTolerance::Rms(0.1), most_p: 6, terms: Terms::Zonal }
        );
        assert!(none.check().is_empty() && given.check().is_empty());
        let both = DegreeChoice { accept: Some(ACCEPT), ..given };
        assert_eq!(both.check(), [("error", "accept already sets the allowed error".to_owned())]);
    }

    #[test]
    fn a_missed_tolerance_is_told_with_the_remedy() {
        let p = Degree::new(4).unwrap();
        let enough = Some(10);
        let map = MapDegree { p, p95: 0.242, p99: 0.666, rms: 0.08, is_met: false, enough, field: p };
        let rule = DegreeRule { tolerance: MapTolerance::Stops([0.15, 0.4]), most_p: 4, terms: Terms::All };
        assert_eq!(
            missed(rule, &map),
            "no P up to 4 meets accept = [0.15, 0.4]: at P = 4 95 % of views are within 0.242 stops, 99 % within \
             0.666; most-p = 10 is enough"
        );
        let rule = DegreeRule { tolerance: MapTolerance::Rms(0.05), ..rule };
        assert_eq!(
            missed(rule, &MapDegree { enough: None, ..map }),
            "no P up to 4 meets error = 0.05: at P = 4 the RMS error is 8.0 % of the RMS radiance; raise \
             most-p to come closer, or `error` to allow more"
        );
    }
}
