//! A studio's own type of artifact travels through `exec`.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::fs;

use engine::{
    Artifact, BuildOptions, Cancel, Context, Failure, Kind, Output, Plan, Port, Product, parameters,
};

/// A table of colours, which no kind of Specula knows.
#[derive(PartialEq, Debug)]
struct ColourTable(Vec<u8>);

impl Artifact for ColourTable {
    const TYPE: &'static str = "colour-table";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.0.clone())
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(bytes.to_vec()))
    }
}

parameters! {
    /// The kind has no parameters.
    struct NoParameters {}
}

/// Reads a table of colours.
struct ImportColourTable;

impl Kind for ImportColourTable {
    type Parameters = NoParameters;

    const NAME: &'static str = "import-colour-table";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads a table of colours.";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &NoParameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(ColourTable::TYPE)
    }

    fn run(_: &NoParameters, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(ColourTable(context.files.read(context.files.source()?)?.to_vec()))
    }
}

#[test]
fn a_program_receives_the_bytes_of_a_type_that_only_the_studio_knows() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("warm.table"), "warm colours").unwrap();
    let manifest = folder.path().join("pipeline.toml");
    let stages = r#"
        schema = 1

        [stage.table]
        kind = "import-colour-table"
        source = "warm.table"

        [stage.packed]
        kind = "exec"
        command = ["sh", "-c", "tr a-z A-Z < $0 > $1", "{input.table}", "{output}"]
        inputs = { table = "table" }
        output = { type = "file", format = "lut" }
        path = "warm"
    "#;
    let kinds = cli::kinds().with(ImportColourTable);
    let build = |stages: &str| {
        fs::write(&manifest, stages).unwrap();
        let plan = Plan::load(&manifest, &kinds).unwrap();
        let built = engine::build(&plan, &BuildOptions::default(), &Cancel::default(), &|_| {}).unwrap();
        (built.ran, fs::read_to_string(folder.path().join("out/warm.lut")).unwrap())
    };
    assert_eq!(build(stages), (2, "WARM COLOURS".into()));
    // Only the program runs again, with the stored artifact.
    let copied = stages.replace("tr a-z A-Z < $0 > $1", "cp $0 $1");
    assert_eq!(build(&copied), (1, "warm colours".into()));
}
