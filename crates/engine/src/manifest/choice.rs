//! Parameters that are one of some words, made by [`choice!`](crate::choice).

use serde_json::json;

use super::diagnostic::Diagnostic;
use super::document::{Value, ValueKind};
use super::parameters::{Parameter, unexpected};
use super::spelling::nearest;

/// A parameter that is one of some words.
pub trait Choice: Copy + PartialEq + 'static {
    /// The values, each after its word and what it means.
    fn words() -> Vec<(&'static str, &'static str, Self)>;

    /// [`Parameter::expected`], if it must be one of some values.
    fn expected_among(among: &[Self]) -> String {
        let words = words_of(among).into_iter().map(|(word, ..)| format!("{word:?}"));
        words.collect::<Vec<_>>().join(" or ")
    }

    /// [`Parameter::parse`], if it must be one of some values.
    ///
    /// # Errors
    /// If the value is not a string, or none of their words.
    fn parse_among(value: &Value, among: &[Self]) -> Result<Self, Diagnostic> {
        let error = || unexpected(value, &Self::expected_among(among));
        let ValueKind::String(given) = &value.kind else { return Err(error()) };
        let words = words_of(among);
        let found = words.iter().find(|(word, ..)| word == given);
        found.map(|(.., value)| *value).ok_or_else(|| {
            match nearest(given, words.iter().map(|(word, ..)| *word)) {
                Some(near) => error().help(format!("did you mean {near:?}?")),
                None => error(),
            }
        })
    }

    /// [`Parameter::schema`], if it must be one of some values. The meanings are in the description for all
    /// editors, and again in the member that Taplo reads.
    fn schema_among(among: &[Self]) -> serde_json::Value {
        let words = words_of(among);
        let lines = words.iter().map(|(word, meaning, _)| format!("- `{word:?}`: {}", meaning.trim()));
        let meanings = words.iter().map(|(_, meaning, _)| meaning.trim());
        json!({
            "type": "string",
            "enum": words.iter().map(|(word, ..)| *word).collect::<Vec<_>>(),
            "description": lines.collect::<Vec<_>>().join("\n"),
            "x-taplo": { "docs": { "enumValues": meanings.collect::<Vec<_>>() } },
        })
    }
}

fn words_of<T: Choice>(among: &[T]) -> Vec<(&'static str, &'static str, T)> {
    let words = T::words();
    among.iter().filter_map(|value| words.iter().find(|(.., other)| other == value).copied()).collect()
}

fn all<T: Choice>() -> Vec<T> {
    T::words().into_iter().map(|(.., value)| value).collect()
}

impl<T: Choice> Parameter for T {
    fn expected() -> String {
        Self::expected_among(&all())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        Self::parse_among(value, &all())
    }

    fn canonical(&self) -> serde_json::Value {
        T::words().into_iter().find(|(.., value)| value == self).map(|(word, ..)| word).into()
    }

    fn schema() -> serde_json::Value {
        Self::schema_among(&all())
    }
}

/// Declares a choice of words: an enum that the manifest writes as a string.
///
/// ```
/// engine::choice! {
///     /// What turns from frame to frame.
///     pub enum Turn {
///         /// The camera circles the mesh.
///         Camera = "camera",
///         /// The light turns.
///         Light = "light",
///     }
/// }
/// assert_eq!(<Turn as engine::Parameter>::expected(), "\"camera\" or \"light\"");
/// ```
///
/// `Name: Enum` gives the words of an enum that is there already: `Name` is a struct that holds one of its
/// values. A value without a word has the one that its `name()` returns. Every value must be listed.
///
/// ```
/// # #[derive(Clone, Copy, Debug, PartialEq, Eq)]
/// # pub enum BadPixels { Error, Zero }
/// # impl BadPixels {
/// #     fn name(self) -> &'static str { "error" }
/// # }
/// engine::choice! {
///     /// What happens to values that are not finite.
///     pub enum OnBadPixels: BadPixels {
///         /// The item fails.
///         Error,
///         /// They become black.
///         Zero = "zero",
///     }
/// }
/// let OnBadPixels(policy) = OnBadPixels(BadPixels::Zero);
/// assert_eq!(<OnBadPixels as engine::Parameter>::expected(), "\"error\" or \"zero\"");
/// ```
#[macro_export]
macro_rules! choice {
    ($(#[$meta:meta])* $vis:vis enum $name:ident {
        $($(#[doc = $doc:literal])* $variant:ident = $word:literal,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name {
            $($(#[doc = $doc])* $variant,)*
        }

        impl $crate::Choice for $name {
            fn words() -> Vec<(&'static str, &'static str, Self)> {
                vec![$(($word, concat!($($doc),*), Self::$variant)),*]
            }
        }
    };
    ($(#[$meta:meta])* $vis:vis enum $name:ident: $of:ty {
        $($(#[doc = $doc:literal])* $variant:ident $(= $word:literal)?,)*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis struct $name(pub $of);

        impl $crate::Choice for $name {
            fn words() -> Vec<(&'static str, &'static str, Self)> {
                // A value that is not listed here is an error of compilation.
                const _: fn($of) = |value| match value { $(<$of>::$variant => {})* };
                vec![$((
                    $crate::choice!(@word $of, $variant $(, $word)?),
                    concat!($($doc),*),
                    Self(<$of>::$variant),
                )),*]
            }
        }
    };
    (@word $of:ty, $variant:ident) => { <$of>::$variant.name() };
    (@word $of:ty, $variant:ident, $word:literal) => { $word };
}
