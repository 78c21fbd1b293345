//! Parameters that are numbers, and the ranges that `#[range(...)]` sets them.

use std::ops::{Bound, RangeBounds};

use serde_json::json;

use super::diagnostic::Diagnostic;
use super::document::{Value, ValueKind};
use super::parameters::{Parameter, unexpected};
use super::spelling::nearest;

/// The numbers that a parameter accepts, as `#[range(1..=64)]` in [`parameters!`](crate::parameters) gives
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    least: Bound<f64>,
    most: Bound<f64>,
}

impl Range {
    /// The range of a Rust range: `1..=64`, `0.0..1.0`, or a pair of bounds.
    pub fn of<T: Number>(range: impl RangeBounds<T>) -> Self {
        let bound = |bound: Bound<&T>| bound.map(|number| number.as_f64());
        Self { least: bound(range.start_bound()), most: bound(range.end_bound()) }
    }

    /// The text of what is expected: `a whole number from 1 to 64`.
    fn expected(&self, noun: &str) -> String {
        match (self.least, self.most) {
            (Bound::Unbounded, Bound::Unbounded) => noun.into(),
            (Bound::Included(least), Bound::Unbounded) => format!("{noun}, {least} or more"),
            (Bound::Excluded(least), Bound::Unbounded) => format!("{noun} above {least}"),
            (Bound::Unbounded, Bound::Included(most)) => format!("{noun}, {most} or less"),
            (Bound::Unbounded, Bound::Excluded(most)) => format!("{noun} below {most}"),
            (Bound::Included(least), Bound::Included(most)) => format!("{noun} from {least} to {most}"),
            (Bound::Included(least), Bound::Excluded(most)) => {
                format!("{noun}, {least} or more and below {most}")
            }
            (Bound::Excluded(least), Bound::Included(most)) => {
                format!("{noun} above {least} and at most {most}")
            }
            (Bound::Excluded(least), Bound::Excluded(most)) => {
                format!("{noun} above {least} and below {most}")
            }
        }
    }

    /// The range as JSON Schema for a type of numbers.
    fn schema(&self, kind: &str) -> serde_json::Value {
        let mut schema = json!({ "type": kind });
        let number = |number: f64| match number as i64 {
            whole if whole as f64 == number => json!(whole),
            _ => json!(number),
        };
        let bounds =
            [(self.least, "minimum", "exclusiveMinimum"), (self.most, "maximum", "exclusiveMaximum")];
        for (bound, included, excluded) in bounds {
            match bound {
                Bound::Included(bound) => schema[included] = number(bound),
                Bound::Excluded(bound) => schema[excluded] = number(bound),
                Bound::Unbounded => {}
            }
        }
        schema
    }
}

/// A type of numbers that has ranges.
pub trait Number: Copy {
    /// The number.
    fn as_f64(self) -> f64;
}

impl Number for f64 {
    fn as_f64(self) -> f64 {
        self
    }
}

impl Number for usize {
    fn as_f64(self) -> f64 {
        self as f64
    }
}

/// A parameter that `#[range(...)]` may limit: a number, or something made of numbers.
pub trait Ranged: Parameter {
    /// The type of the numbers.
    type Number: Number;

    /// [`Parameter::expected`], if its numbers are in this range.
    fn expected_in(range: Range) -> String;

    /// [`Parameter::parse`], if its numbers must be in this range.
    ///
    /// # Errors
    /// If the value is of another type, or a number is outside the range.
    fn parse_in(value: &Value, range: Range) -> Result<Self, Diagnostic>;

    /// [`Parameter::schema`], if its numbers are in this range.
    fn schema_in(range: Range) -> serde_json::Value;
}

/// A number that is in the range.
fn number<T: Ranged + Number>(value: &Value, number: Option<T>, range: Range) -> Result<T, Diagnostic> {
    let is_inside = |number: &T| (range.least, range.most).contains(&number.as_f64());
    number.filter(is_inside).ok_or_else(|| unexpected(value, &T::expected_in(range)))
}

impl Ranged for f64 {
    type Number = Self;

    fn expected_in(range: Range) -> String {
        range.expected("a number")
    }

    fn parse_in(value: &Value, range: Range) -> Result<Self, Diagnostic> {
        number(value, Self::parse(value).ok(), range)
    }

    fn schema_in(range: Range) -> serde_json::Value {
        range.schema("number")
    }
}

impl Parameter for f64 {
    fn expected() -> String {
        "a finite number".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match value.kind {
            ValueKind::Float(number) if number.is_finite() => Ok(number),
            ValueKind::Integer(number) => Ok(number as f64),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        // 30 and 30.0, 0 and -0 are one value.
        (*self + 0.0).into()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "number" })
    }
}

impl Ranged for usize {
    type Number = Self;

    fn expected_in(range: Range) -> String {
        range.expected("a whole number")
    }

    fn parse_in(value: &Value, range: Range) -> Result<Self, Diagnostic> {
        let found = match value.kind {
            ValueKind::Integer(number) => Self::try_from(number).ok(),
            _ => None,
        };
        number(value, found, range)
    }

    fn schema_in(range: Range) -> serde_json::Value {
        range.schema("integer")
    }
}

impl Parameter for usize {
    fn expected() -> String {
        Self::expected_in(Range::of::<Self>(0..))
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        Self::parse_in(value, Range::of::<Self>(0..))
    }

    fn canonical(&self) -> serde_json::Value {
        (*self).into()
    }

    fn schema() -> serde_json::Value {
        Self::schema_in(Range::of::<Self>(0..))
    }
}

impl<T: Ranged> Ranged for Option<T> {
    type Number = T::Number;

    fn expected_in(range: Range) -> String {
        T::expected_in(range)
    }

    fn parse_in(value: &Value, range: Range) -> Result<Self, Diagnostic> {
        T::parse_in(value, range).map(Some)
    }

    fn schema_in(range: Range) -> serde_json::Value {
        T::schema_in(range)
    }
}

/// A value, or the word `"auto"` for the one that the kind chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrAuto<T> {
    /// The kind chooses.
    Auto,
    /// The manifest gives this value.
    Fixed(T),
}

impl<T> OrAuto<T> {
    fn parse_with(
        value: &Value,
        expected: String,
        parse: impl FnOnce() -> Result<T, Diagnostic>,
    ) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(word) if word == "auto" => Ok(Self::Auto),
            _ => parse().map(Self::Fixed).map_err(|error| {
                let near = match &value.kind {
                    ValueKind::String(word) => {
                        nearest(word, ["auto"]).map(|_| "did you mean \"auto\"?".into())
                    }
                    _ => None,
                };
                Diagnostic { help: near.or(error.help), ..unexpected(value, &expected) }
            }),
        }
    }
}

/// The schema of a value or the word `"auto"`.
fn or_auto_schema(mut schema: serde_json::Value) -> serde_json::Value {
    match schema.get_mut("enum").and_then(|words| words.as_array_mut()) {
        Some(words) => {
            words.push("auto".into());
            let meaning = "The kind chooses.";
            if let Some(meanings) =
                schema.pointer_mut("/x-taplo/docs/enumValues").and_then(|list| list.as_array_mut())
            {
                meanings.push(meaning.into());
            }
            if let Some(description) = schema["description"].as_str() {
                schema["description"] = format!("{description}\n- `\"auto\"`: {meaning}").into();
            }
        }
        None => {
            schema["type"] = json!([schema["type"], "string"]);
            schema["pattern"] = "^auto$".into();
        }
    }
    schema
}

impl<T: Parameter> Parameter for OrAuto<T> {
    fn expected() -> String {
        format!("{} or \"auto\"", T::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        Self::parse_with(value, Self::expected(), || T::parse(value))
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Auto => "auto".into(),
            Self::Fixed(value) => value.canonical(),
        }
    }

    fn schema() -> serde_json::Value {
        or_auto_schema(T::schema())
    }
}

impl<T: Ranged> Ranged for OrAuto<T> {
    type Number = T::Number;

    fn expected_in(range: Range) -> String {
        format!("{} or \"auto\"", T::expected_in(range))
    }

    fn parse_in(value: &Value, range: Range) -> Result<Self, Diagnostic> {
        Self::parse_with(value, Self::expected_in(range), || T::parse_in(value, range))
    }

    fn schema_in(range: Range) -> serde_json::Value {
        or_auto_schema(T::schema_in(range))
    }
}
