//! Kinds for tests: texts that are read, changed, joined, gathered and written.

use crate::{
    Artifact, Context, Diagnostics, Failure, Kind, Kinds, Output, Port, Product, choice, line_and_column,
    parameters,
};

/// Every kind of this module.
pub(crate) fn kinds() -> Kinds {
    Kinds::new()
        .with(TextSource)
        .with(Upper)
        .with(Private)
        .with(Suffix)
        .with(Concat)
        .with(Collect)
        .with(Count)
        .with(Refuse)
        .with(Write)
        .with(WritePair)
}

/// Diagnostics as a test shows them: `line:column message | expected | help`, a line for each.
pub(crate) fn shown(diagnostics: &Diagnostics) -> String {
    let mut text = String::new();
    for error in &diagnostics.errors {
        let place = error.span.as_ref().map(|span| line_and_column(&diagnostics.text, span.start));
        text += &place.map_or("-".into(), |(line, column)| format!("{line}:{column}"));
        text += &format!(" {}", error.message);
        for more in [&error.expected, &error.help].into_iter().flatten() {
            text += &format!(" | {more}");
        }
        text.push('\n');
    }
    test_data::unix_paths(text)
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Text(pub(crate) String);

impl Artifact for Text {
    const TYPE: &'static str = "text";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.0.clone().into_bytes())
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(String::from_utf8(bytes.to_vec())?))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Number(pub(crate) u64);

impl Artifact for Number {
    const TYPE: &'static str = "number";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.0.to_le_bytes().to_vec())
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        let bytes = bytes.try_into().map_err(|_| Failure::new("a number has 8 bytes"))?;
        Ok(Self(u64::from_le_bytes(bytes)))
    }
}

parameters! {
    /// No parameters.
    pub(crate) struct Nothing {}
}

/// Reads a file, or the names in a folder. A line `include NAME` reads a file beside it; instead of a line
/// `program NAME` it says whether PATH has such a program.
pub(crate) struct TextSource;

impl Kind for TextSource {
    type Parameters = Nothing;
    const NAME: &'static str = "text-source";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads a text.\n//!\n//! A whole file.\n\nuse crate::Kind;\n";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let source = context.files.source()?.to_path_buf();
        if context.files.is_folder(&source) {
            let names = context.files.list(&source)?.into_iter().map(|(name, _)| name);
            return Output::artifact(Text(names.collect::<Vec<_>>().join("\n")));
        }
        let mut text = String::new();
        for line in String::from_utf8(context.files.read(&source)?.to_vec())?.split_inclusive('\n') {
            match line.trim_end().split_once(' ') {
                Some(("include", name)) => {
                    text += &String::from_utf8(context.files.read(name.as_ref())?.to_vec())?
                }
                Some(("program", name)) => {
                    text +=
                        if context.files.find_program(name.as_ref()).is_ok() { "found" } else { "not found" };
                }
                _ => text += line,
            }
        }
        Output::artifact(Text(text))
    }
}

/// A text as it is, which other machines do not share.
pub(crate) struct Private;

impl Kind for Private {
    type Parameters = Nothing;
    const NAME: &'static str = "private";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! A text as it is.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn is_shared(_: &Nothing) -> bool {
        false
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(Text(context.inputs.get::<Text>("text")?.0.clone()))
    }
}

pub(crate) struct Upper;

impl Kind for Upper {
    type Parameters = Nothing;
    const NAME: &'static str = "upper";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Makes a text upper case.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(Text(context.inputs.get::<Text>("text")?.0.to_uppercase()))
    }
}

choice! {
    /// Where something is put.
    pub(crate) enum Position {
        /// Before the text.
        Before = "before",
        /// After the text.
        After = "after",
    }
}

parameters! {
    /// Parameters of `suffix`.
    pub(crate) struct SuffixParameters {
        /// What is added.
        text: String,
        /// How often.
        times: usize = 1,
        /// Where it is added.
        place: Position = Position::After,
    }
}

/// Adds to a text; a kind with parameters.
pub(crate) struct Suffix;

impl Kind for Suffix {
    type Parameters = SuffixParameters;
    const NAME: &'static str = "suffix";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Adds to a text.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &SuffixParameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn check(parameters: &SuffixParameters) -> Vec<(&'static str, String)> {
        if parameters.times > 9 {
            vec![("times", format!("{} is more than 9", parameters.times))]
        } else {
            Vec::new()
        }
    }

    fn run(parameters: &SuffixParameters, context: &Context<'_>) -> Result<Output, Failure> {
        let text = context.inputs.get::<Text>("text")?;
        let added = parameters.text.repeat(parameters.times);
        Output::artifact(Text(match parameters.place {
            Position::Before => format!("{added}{}", text.0),
            Position::After => format!("{}{added}", text.0),
        }))
    }
}

/// Puts one text after another, and an optional third.
pub(crate) struct Concat;

impl Kind for Concat {
    type Parameters = Nothing;
    const NAME: &'static str = "concat";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Puts texts after each other.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("left"), Port::one::<Text>("right"), Port::one::<Text>("end").optional()]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let (left, right) = (context.inputs.get::<Text>("left")?, context.inputs.get::<Text>("right")?);
        let end = context.inputs.optional::<Text>("end")?.map_or_else(String::new, |text| text.0.clone());
        Output::artifact(Text(format!("{}{}{end}", left.0, right.0)))
    }
}

/// Gathers texts under a title, each with its item's key: `title:\nsky, gold=...\n`.
pub(crate) struct Collect;

impl Kind for Collect {
    type Parameters = Nothing;
    const NAME: &'static str = "collect";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Gathers texts.\n";
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::many::<Text>("texts"), Port::one::<Text>("title").optional()]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let title = context.inputs.optional::<Text>("title")?;
        let mut text = title.map_or_else(String::new, |title| format!("{}:\n", title.0));
        for (key, part) in context.inputs.many::<Text>("texts")? {
            text += &format!("{key}={}\n", part.0);
        }
        Output::artifact(Text(text))
    }
}

/// Counts the bytes of a text: another type.
pub(crate) struct Count;

impl Kind for Count {
    type Parameters = Nothing;
    const NAME: &'static str = "count";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Counts bytes.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Number::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(Number(context.inputs.get::<Text>("text")?.0.len() as u64))
    }
}

parameters! {
    /// Parameters of `refuse`.
    pub(crate) struct RefuseParameters {
        /// The word that must not be in the text.
        word: String = "bad".into(),
    }
}

/// Passes a text on, but fails if it contains a word.
pub(crate) struct Refuse;

impl Kind for Refuse {
    type Parameters = RefuseParameters;
    const NAME: &'static str = "refuse";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Fails on a word.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &RefuseParameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(parameters: &RefuseParameters, context: &Context<'_>) -> Result<Output, Failure> {
        let text = context.inputs.get::<Text>("text")?;
        if text.0.contains(&parameters.word) {
            return Err(Failure::new(format!("the text holds {:?}", parameters.word)).help("take it out"));
        }
        Output::artifact((*text).clone())
    }
}

/// Writes a text or a number to a file.
pub(crate) struct Write;

impl Kind for Write {
    type Parameters = Nothing;
    const NAME: &'static str = "write";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes a file.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("value").or::<Number>()]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let text = if context.inputs.type_at("value") == Some(Number::TYPE) {
            context.inputs.get::<Number>("value")?.0.to_string()
        } else {
            context.inputs.get::<Text>("value")?.0.clone()
        };
        Ok(Output::files(vec![text.into_bytes()]))
    }
}

/// Writes a text to a folder of two files; the second is the index. The first is left out if the text is
/// empty.
pub(crate) struct WritePair;

impl Kind for WritePair {
    type Parameters = Nothing;
    const NAME: &'static str = "write-pair";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes two files.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec!["/body.txt".into(), "/index.txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let text = &context.inputs.get::<Text>("text")?.0;
        let body = (!text.is_empty()).then(|| text.clone().into_bytes());
        Ok(Output::Files(vec![body, Some(text.len().to_string().into_bytes())]))
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_kind_is_listed_once() {
        assert_eq!(super::kinds().iter().count(), 10);
    }
}
