//! Parameters declared once: name, type, default and manual text in one place.
//!
//! [`parameters!`](crate::parameters) makes a struct of them, [`choice!`](crate::choice) an enum of words.
//! Both are parsed from a [`Table`], and all their errors are reported at once.

use serde_json::json;

use super::diagnostic::Diagnostic;
use super::document::{Entry, Table, Value, ValueKind};
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

    /// The parameters whose canonical JSON this is; `None` if it is not that of such parameters.
    fn from_canonical(value: &serde_json::Value) -> Option<Self> {
        Self::parse(&Table::from_json(value)?, &mut Vec::new())
    }
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
                error = error.help(format!("it is now called {name:?}"));
            } else if let Some(near) = nearest(&entry.key, known.iter().map(String::as_str)) {
                error = error.help(format!("did you mean {near:?}?"));
            }
            errors.push(error);
        }
    }
}

impl Table {
    /// The table with the entries of these parameters alone.
    pub fn only(&self, fields: &[Field]) -> Self {
        let is_one = |entry: &&Entry| fields.iter().any(|field| field.name == entry.key);
        Self { span: self.span.clone(), entries: self.entries.iter().filter(is_one).cloned().collect() }
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
/// one. A last line `..shared: Shared` adds the parameters of another such struct, which several kinds share.
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
        $(..$part:ident : $shared:ty,)?
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $name {
            $($(#[doc = $doc])* pub $field: $type,)*
            $(#[doc = "The parameters that kinds share."] pub $part: $shared,)?
        }

        impl $crate::Parameters for $name {
            fn fields() -> Vec<$crate::Field> {
                let own: Vec<$crate::Field> = vec![$($crate::Field {
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
                },)*];
                [own $(, <$shared as $crate::Parameters>::fields())?].concat()
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
                $(
                    let part = table.only(&<$shared as $crate::Parameters>::fields());
                    let $part = <$shared as $crate::Parameters>::parse(&part, errors);
                )?
                if errors.len() > before {
                    return None;
                }
                Some(Self { $($field: $field?,)* $($part: $part?,)? })
            }

            #[allow(unused_mut)]
            fn canonical(&self) -> $crate::serde_json::Value {
                let mut object = $crate::serde_json::Map::new();
                $(object.insert(stringify!($field).replace('_', "-"), $crate::Parameter::canonical(&self.$field));)*
                $(
                    if let $crate::serde_json::Value::Object(part) = $crate::Parameters::canonical(&self.$part) {
                        object.extend(part);
                    }
                )?
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
mod tests;
