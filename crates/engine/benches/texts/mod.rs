//! Cheap kinds for measuring the engine itself: texts that are read, joined, added to and written.

use std::fs;
use std::path::Path;

use engine::{Artifact, Context, Failure, Kind, Kinds, Output, Port, Product, parameters};

struct Text(String);

impl Artifact for Text {
    const TYPE: &'static str = "text";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.0.clone().into_bytes())
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(String::from_utf8(bytes.to_vec())?))
    }
}

parameters! {
    /// No parameters.
    struct Nothing {}
}

parameters! {
    /// What is added.
    struct Added {
        /// The text.
        text: String = "!".into(),
    }
}

struct Source;

impl Kind for Source {
    type Parameters = Nothing;
    const NAME: &'static str = "source";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads a text.\n";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let bytes = context.read(context.source()?)?;
        Output::artifact(Text(String::from_utf8(bytes.to_vec())?))
    }
}

struct Add;

impl Kind for Add {
    type Parameters = Added;
    const NAME: &'static str = "add";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Adds to a text.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Added, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(parameters: &Added, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(Text(format!("{}{}", context.get::<Text>("text")?.0, parameters.text)))
    }
}

struct Join;

impl Kind for Join {
    type Parameters = Nothing;
    const NAME: &'static str = "join";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Puts one text after another.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("left"), Port::one::<Text>("right")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let (left, right) = (context.get::<Text>("left")?, context.get::<Text>("right")?);
        Output::artifact(Text(format!("{}{}", left.0, right.0)))
    }
}

struct Write;

impl Kind for Write {
    type Parameters = Nothing;
    const NAME: &'static str = "write";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Writes a text.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".txt".into()])
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        Ok(Output::Files(vec![context.get::<Text>("text")?.0.clone().into_bytes()]))
    }
}

/// All of them.
pub(crate) fn kinds() -> Kinds {
    Kinds::new().with(Source).with(Add).with(Join).with(Write)
}

/// Every text of one folder with every text of another.
const LARGE: &str = r#"
schema = 1
out = "out"

[stage.left]
kind = "source"
source = "left/*.txt"

[stage.right]
kind = "source"
source = "right/*.txt"

[stage.loud-left]
kind = "add"
input = "left"

[stage.loud-right]
kind = "add"
input = "right"
text = "!!"

[stage.pair]
kind = "join"
inputs = { left = "loud-left", right = "loud-right" }

[stage.file]
kind = "write"
input = "pair"
path = "{left}/{right}/text"
"#;

/// Writes a project of 200 texts by 200 others: 80,800 items, of which 40,000 are files.
pub(crate) fn make_large(folder: &Path) {
    for side in ["left", "right"] {
        fs::create_dir_all(folder.join(side)).expect("a folder");
        for n in 0..200 {
            fs::write(folder.join(format!("{side}/{n:03}.txt")), format!("{side} {n}")).expect("a text");
        }
    }
    fs::write(folder.join("pipeline.toml"), LARGE).expect("the manifest");
}
