//! Parameters declared once: name, type, default and manual text in one place.
//!
//! [`parameters!`](crate::parameters) makes a struct of them, [`choice!`](crate::choice) an enum of words.
//! Both are parsed from a [`Table`], and all their errors are reported at once.

use serde_json::json;

use super::diagnostic::Diagnostic;
use super::document::{Table, Value, ValueKind};
use super::spelling::nearest;

/// A type that a parameter can have.
pub trait Parameter: Sized {
    /// What is expected, for messages and manual pages: `a number`.
    fn expected() -> String;

    /// The value.
    ///
    /// # Errors
    /// If the value is not what is expected: an error at its place.
    fn parse(value: &Value) -> Result<Self, Diagnostic>;

    /// The value as canonical JSON: equal values give equal JSON.
    fn canonical(&self) -> serde_json::Value;

    /// The values that the manifest may hold, as JSON Schema; `true` if only [`Parameter::parse`] can decide.
    ///
    /// Editors support `oneOf` and similar keywords poorly: several types with a constraint each (`minimum`
    /// applies to numbers, `pattern` to strings) mean the same. A `description` is shown below that of the
    /// parameter.
    fn schema() -> serde_json::Value {
        true.into()
    }
}

/// A parameter as manual pages and schemas show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// The key in the manifest.
    pub name: String,
    /// The value that the parameter expects, in words.
    pub expected: String,
    /// The values that the parameter expects, as JSON Schema.
    pub schema: serde_json::Value,
    /// The default; `None` if the parameter is required.
    pub default: Option<serde_json::Value>,
    /// The key that the parameter had before it was renamed. A manifest that still has it gets an error that
    /// names the new key.
    pub was: Option<&'static str>,
    /// The manual text, one paragraph.
    pub doc: String,
}

/// A set of parameters, made by [`parameters!`](crate::parameters).
pub trait Parameters: Sized + Send + Sync + 'static {
    /// The parameters in the order of their declaration.
    fn fields() -> Vec<Field>;

    /// Parses a table and adds every error that it finds to `errors`; `None` if there was one.
    fn parse(table: &Table, errors: &mut Vec<Diagnostic>) -> Option<Self>;

    /// The parameters with defaults filled in, as canonical JSON.
    fn canonical(&self) -> serde_json::Value;
}

/// The error of a value that is not what was expected.
pub fn unexpected(value: &Value, expected: &str) -> Diagnostic {
    let found = match &value.kind {
        ValueKind::Boolean(value) => format!("{value}"),
        ValueKind::Integer(value) => format!("{value}"),
        ValueKind::Float(value) => format!("{value:?}"),
        ValueKind::String(value) => format!("{value:?}"),
        ValueKind::Array(_) => "an array".into(),
        ValueKind::Table(_) => "a table".into(),
        ValueKind::Datetime(value) => format!("the date {value}"),
    };
    Diagnostic::at(value.span.clone(), format!("{found} is not {expected}"))
        .expected(format!("expected {expected}"))
}

/// Adds an error for each key that is not among `known`, with the nearest spelling.
pub fn unknown_keys(table: &Table, known: &[String], errors: &mut Vec<Diagnostic>) {
    unknown_or_renamed(table, known, &[], errors);
}

/// Adds an error for each key that is neither among `others` nor a parameter, with the parameter's new key
/// if it was renamed, or else the nearest spelling.
pub fn unknown_parameters(table: &Table, others: &[String], fields: &[Field], errors: &mut Vec<Diagnostic>) {
    let known = others.iter().cloned().chain(fields.iter().map(|field| field.name.clone()));
    let renamed = fields.iter().filter_map(|field| Some((field.was?, field.name.as_str())));
    unknown_or_renamed(table, &known.collect::<Vec<_>>(), &renamed.collect::<Vec<_>>(), errors);
}

/// Adds an error for each key that is not among `known`. `renamed` are pairs of an earlier key and its new
/// one.
fn unknown_or_renamed(
    table: &Table,
    known: &[String],
    renamed: &[(&str, &str)],
    errors: &mut Vec<Diagnostic>,
) {
    for entry in &table.entries {
        if !known.contains(&entry.key) {
            let mut error = Diagnostic::at(entry.key_span.clone(), format!("unknown key {:?}", entry.key))
                .expected(if known.is_empty() {
                    "expected no key".into()
                } else {
                    format!("expected one of: {}", known.join(", "))
                });
            if let Some((_, name)) = renamed.iter().find(|(was, _)| *was == entry.key) {
                error = error.help(format!("it is called {name:?} now"));
            } else if let Some(near) = nearest(&entry.key, known.iter().map(String::as_str)) {
                error = error.help(format!("did you mean {near:?}?"));
            }
            errors.push(error);
        }
    }
}

impl Parameter for bool {
    fn expected() -> String {
        "true or false".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match value.kind {
            ValueKind::Boolean(flag) => Ok(flag),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        (*self).into()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "boolean" })
    }
}

impl Parameter for String {
    fn expected() -> String {
        "a string".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(text) => Ok(text.clone()),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        self.clone().into()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "string" })
    }
}

/// An optional parameter; its default should be `None`.
impl<T: Parameter> Parameter for Option<T> {
    fn expected() -> String {
        T::expected()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        T::parse(value).map(Some)
    }

    fn canonical(&self) -> serde_json::Value {
        self.as_ref().map_or(serde_json::Value::Null, T::canonical)
    }

    fn schema() -> serde_json::Value {
        T::schema()
    }
}

impl<T: Parameter> Parameter for Vec<T> {
    fn expected() -> String {
        format!("an array, each {}", T::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::Array(values) => values.iter().map(T::parse).collect(),
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        self.iter().map(T::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": T::schema() })
    }
}

/// Declares parameters: a struct whose field `bad_pixels` is the manifest's key `bad-pixels`.
///
/// A field with `= default` is optional in the manifest. The doc comments are the manual text.
/// `#[range(...)]` limits numbers, and `#[words(...)]` a [`Choice`](crate::Choice) to some of its values; the
/// manual page and the schema show them, so the doc comment need not. After these, `#[was("old-key")]` says
/// which key the parameter had before it was renamed: if a manifest still has it, the error names the new
/// one.
///
/// ```
/// engine::parameters! {
///     /// Parameters of `grade`.
///     pub struct Grade {
///         /// The gain, in stops.
///         #[range(-100.0..=100.0)]
///         #[was("exposure")]
///         gain: f64 = 0.0,
///         /// What to grade.
///         what: String,
///     }
/// }
/// let gain = &<Grade as engine::Parameters>::fields()[0];
/// assert_eq!((&*gain.name, &*gain.expected), ("gain", "a number from -100 to 100"));
/// ```
#[macro_export]
macro_rules! parameters {
    ($(#[$meta:meta])* $vis:vis struct $name:ident {
        $(
            $(#[doc = $doc:literal])*
            $(#[range($range:expr)])? $(#[words($($word:expr),+)])? $(#[was($was:literal)])?
            $field:ident : $type:ty $(= $default:expr)?,
        )*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name {
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl $crate::Parameters for $name {
            fn fields() -> Vec<$crate::Field> {
                vec![$($crate::Field {
                    name: stringify!($field).replace('_', "-"),
                    expected: $crate::parameters!(
                        @call $type, expected, expected_in, expected_among, ()
                        $(, range $range)? $(, words [$($word),+])?
                    ),
                    schema: $crate::parameters!(
                        @call $type, schema, schema_in, schema_among, ()
                        $(, range $range)? $(, words [$($word),+])?
                    ),
                    default: $crate::parameters!(@default $type $(, $default)?)
                        .map(|value: $type| $crate::Parameter::canonical(&value)),
                    was: $crate::parameters!(@was $($was)?),
                    doc: [$($doc),*].join("").trim().to_owned(),
                },)*]
            }

            #[allow(unused_variables, clippy::unused_unit)]
            fn parse(table: &$crate::Table, errors: &mut Vec<$crate::Diagnostic>) -> Option<Self> {
                let before = errors.len();
                $crate::unknown_parameters(table, &[], &<Self as $crate::Parameters>::fields(), errors);
                $(
                    let name = stringify!($field).replace('_', "-");
                    let $field: Option<$type> = match table.get(&name) {
                        Some(entry) => match $crate::parameters!(
                            @call $type, parse, parse_in, parse_among, (&entry.value,)
                            $(, range $range)? $(, words [$($word),+])?
                        ) {
                            Ok(value) => Some(value),
                            Err(error) => {
                                errors.push($crate::Diagnostic { message: format!("{name}: {}", error.message), ..error });
                                None
                            }
                        },
                        None => {
                            let default: Option<$type> = $crate::parameters!(@default $type $(, $default)?);
                            if default.is_none() {
                                let expected = $crate::parameters!(
                                    @call $type, expected, expected_in, expected_among, ()
                                    $(, range $range)? $(, words [$($word),+])?
                                );
                                errors.push($crate::Diagnostic::at(table.span.clone(), format!("{name:?} is missing"))
                                    .expected(format!("expected {name} = {expected}")));
                            }
                            default
                        }
                    };
                )*
                if errors.len() > before {
                    return None;
                }
                Some(Self { $($field: $field?,)* })
            }

            #[allow(unused_mut)]
            fn canonical(&self) -> $crate::serde_json::Value {
                let mut object = $crate::serde_json::Map::new();
                $(object.insert(stringify!($field).replace('_', "-"), $crate::Parameter::canonical(&self.$field));)*
                $crate::serde_json::Value::Object(object)
            }
        }
    };
    (@call $type:ty, $plain:ident, $ranged:ident, $among:ident, ($($argument:expr,)*)) => {
        <$type as $crate::Parameter>::$plain($($argument),*)
    };
    (@call $type:ty, $plain:ident, $ranged:ident, $among:ident, ($($argument:expr,)*),
        words [$($word:expr),+]) => {
        <$type as $crate::Choice>::$among($($argument,)* &[$($word),+])
    };
    (@call $type:ty, $plain:ident, $ranged:ident, $among:ident, ($($argument:expr,)*), range $range:expr) => {
        <$type as $crate::Ranged>::$ranged(
            $($argument,)*
            $crate::Range::of::<<$type as $crate::Ranged>::Number>($range),
        )
    };
    (@default $type:ty) => { None::<$type> };
    (@default $type:ty, $default:expr) => { Some::<$type>($default) };
    (@was) => { None };
    (@was $was:literal) => { Some($was) };
}

#[cfg(test)]
mod tests {
    use std::ops::Bound;

    use expect_test::{Expect, expect};
    use serde_json::json;

    use super::*;
    use crate::choice;
    use crate::manifest::diagnostic::Diagnostics;
    use crate::manifest::range::OrAuto;
    use crate::testkit::shown;

    choice! {
        /// A filter.
        enum Filter {
            /// Nothing is done.
            None = "none",
            /// A raised cosine.
            Hanning = "hanning",
            /// A sinc.
            Lanczos = "lanczos",
        }
    }

    parameters! {
        /// Parameters of a test.
        struct Everything {
            /// How much.
            exposure: f64 = 0.0,
            /// How many.
            /// Or how few.
            count: usize,
            /// Whether to mirror.
            mirrored: bool = false,
            /// What it is called.
            layer_name: Option<String> = None,
            /// The weights.
            weights: Vec<f64> = vec![1.0, 2.0],
            /// The filter.
            filter: Filter = Filter::None,
            /// Samples of a pixel.
            #[range(1..=64)]
            samples: OrAuto<usize> = OrAuto::Auto,
            /// The share that may be lost.
            #[range((Bound::Excluded(0.0), Bound::Excluded(1.0)))]
            share: Option<f64> = None,
            /// The filter of the edges.
            #[words(Filter::Lanczos, Filter::None)]
            edges: Filter = Filter::None,
            /// What colours are multiplied with.
            #[range(0.0..)]
            #[was("gain")]
            scale: f64 = 1.0,
        }
    }

    fn parse(text: &str) -> Result<Everything, Diagnostics> {
        let table = Table::parse(text).unwrap();
        let mut errors = Vec::new();
        let parsed = Everything::parse(&table, &mut errors);
        assert_eq!(parsed.is_none(), !errors.is_empty());
        parsed.ok_or_else(|| Diagnostics::new("x.toml", text, errors))
    }

    fn check(text: &str, expected: Expect) {
        expected.assert_eq(&shown(&parse(text).unwrap_err()));
    }

    #[test]
    fn defaults_are_filled_in() {
        let parsed = parse("count = 3").unwrap();
        let expected = Everything {
            exposure: 0.0,
            count: 3,
            mirrored: false,
            layer_name: None,
            weights: vec![1.0, 2.0],
            filter: Filter::None,
            samples: OrAuto::Auto,
            share: None,
            edges: Filter::None,
            scale: 1.0,
        };
        assert_eq!(parsed, expected);
        let text = "count = 0\nexposure = -1\nmirrored = true\nlayer-name = \"a\"\nweights = []\nfilter = \"lanczos\"\n\
                    samples = 64\nshare = 0.5\nedges = \"lanczos\"\nscale = 0";
        let expected = Everything {
            exposure: -1.0,
            count: 0,
            mirrored: true,
            layer_name: Some("a".into()),
            weights: vec![],
            filter: Filter::Lanczos,
            samples: OrAuto::Fixed(64),
            share: Some(0.5),
            edges: Filter::Lanczos,
            scale: 0.0,
        };
        assert_eq!(parse(text).unwrap(), expected);
    }

    #[test]
    fn every_error_has_its_place() {
        check(
            "exposure = \"much\"\ncount = -1\nmirored = true\nlayer-name = 3\nweights = [1, \"two\"]\nfilter = \"hannin\"\nq = 1",
            expect![[r#"
                1:12 exposure: "much" is not a finite number | expected a finite number
                2:9 count: -1 is not a whole number, 0 or more | expected a whole number, 0 or more
                3:1 unknown key "mirored" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | did you mean "mirrored"?
                4:14 layer-name: 3 is not a string | expected a string
                5:15 weights: "two" is not a finite number | expected a finite number
                6:10 filter: "hannin" is not "none" or "hanning" or "lanczos" | expected "none" or "hanning" or "lanczos" | did you mean "hanning"?
                7:1 unknown key "q" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale
            "#]],
        );
        check(
            "count = 1.0\nexposure = nan\nmirrored = 1\nweights = 1\nfilter = 2024-01-01",
            expect![[r#"
                1:9 count: 1.0 is not a whole number, 0 or more | expected a whole number, 0 or more
                2:12 exposure: NaN is not a finite number | expected a finite number
                3:12 mirrored: 1 is not true or false | expected true or false
                4:11 weights: 1 is not an array, each a finite number | expected an array, each a finite number
                5:10 filter: the date 2024-01-01 is not "none" or "hanning" or "lanczos" | expected "none" or "hanning" or "lanczos"
            "#]],
        );
        check(
            "",
            expect![[r#"
            1:1 "count" is missing | expected count = a whole number, 0 or more
        "#]],
        );
        check(
            "count = 1\nlayer_name = \"a\"",
            expect![[r#"
            2:1 unknown key "layer_name" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | did you mean "layer-name"?
        "#]],
        );
    }

    #[test]
    fn a_key_that_was_renamed_is_an_error_that_names_the_new_one() {
        check(
            "count = 1\ngain = 2",
            expect![[r#"
                2:1 unknown key "gain" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | it is called "scale" now
            "#]],
        );
    }

    #[test]
    fn numbers_outside_their_range_are_errors() {
        check(
            "count = 1\nsamples = 65\nshare = 1\nscale = -0.5",
            expect![[r#"
            2:11 samples: 65 is not a whole number from 1 to 64 or "auto" | expected a whole number from 1 to 64 or "auto"
            3:9 share: 1 is not a number above 0 and below 1 | expected a number above 0 and below 1
            4:9 scale: -0.5 is not a number, 0 or more | expected a number, 0 or more
        "#]],
        );
        check(
            "count = 1\nsamples = \"autp\"\nshare = \"half\"\nscale = nan",
            expect![[r#"
            2:11 samples: "autp" is not a whole number from 1 to 64 or "auto" | expected a whole number from 1 to 64 or "auto" | did you mean "auto"?
            3:9 share: "half" is not a number above 0 and below 1 | expected a number above 0 and below 1
            4:9 scale: NaN is not a number, 0 or more | expected a number, 0 or more
        "#]],
        );
    }

    #[test]
    fn a_choice_may_be_limited_to_some_of_its_words() {
        check(
            "count = 1\nedges = \"hanning\"",
            expect![[r#"
                2:9 edges: "hanning" is not "lanczos" or "none" | expected "lanczos" or "none"
            "#]],
        );
        check(
            "count = 1\nedges = \"lanczo\"",
            expect![[r#"
                2:9 edges: "lanczo" is not "lanczos" or "none" | expected "lanczos" or "none" | did you mean "lanczos"?
            "#]],
        );
        let edges = Everything::fields().into_iter().find(|field| field.name == "edges").unwrap();
        assert_eq!(edges.expected, "\"lanczos\" or \"none\"");
        assert_eq!(edges.schema["enum"], json!(["lanczos", "none"]));
    }

    #[test]
    fn ranges_are_in_the_schema() {
        let ranged = ["samples", "share", "scale"];
        let fields = Everything::fields().into_iter().filter(|field| ranged.contains(&field.name.as_str()));
        let schemas = fields.map(|field| field.schema);
        let expected = [
            json!({ "type": ["integer", "string"], "minimum": 1, "maximum": 64, "pattern": "^auto$" }),
            json!({ "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1 }),
            json!({ "type": "number", "minimum": 0 }),
        ];
        assert_eq!(schemas.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn equal_parameters_have_one_canonical_form() {
        let canonical = |text: &str| parse(text).unwrap().canonical().to_string();
        let whole = canonical("count = 1\nexposure = 30\nweights = [0]");
        assert_eq!(whole, canonical("weights = [-0.0]\nexposure = 3e1\ncount = 0x1\nfilter = \"none\""));
        assert_ne!(whole, canonical("count = 1\nexposure = 30.000000000000004\nweights = [0]"));
        assert_eq!(
            parse("count = 2").unwrap().canonical(),
            json!({
                "count": 2, "edges": "none", "exposure": 0.0, "filter": "none", "layer-name": null, "mirrored": false,
                "samples": "auto", "scale": 1.0, "share": null, "weights": [1.0, 2.0],
            })
        );
    }

    #[test]
    fn the_manual_has_every_field() {
        let fields = Everything::fields();
        let names: Vec<_> = fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "exposure",
                "count",
                "mirrored",
                "layer-name",
                "weights",
                "filter",
                "samples",
                "share",
                "edges",
                "scale"
            ]
        );
        assert_eq!(fields[1].doc, "How many. Or how few.");
        assert_eq!(fields[1].default, None);
        assert_eq!(fields[3].default, Some(serde_json::Value::Null));
        assert_eq!(fields[5].expected, "\"none\" or \"hanning\" or \"lanczos\"");
        assert_eq!(fields[5].default, Some(json!("none")));
    }
}
