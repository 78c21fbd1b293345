//! What a check finds in the sources of items, without running them.

use super::*;
use crate::answers::{SourceError, check_sources};

/// Takes files that begin with a word, and reads no more of them for a check.
struct Headed;

impl Kind for Headed {
    type Parameters = Nothing;
    const NAME: &'static str = "headed";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads files with a head.\n";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn check_source(_: &Nothing, context: &Context<'_>) -> Result<(), Failure> {
        let mut head = [0; 4];
        std::io::Read::read_exact(&mut context.files.open(context.files.source()?)?, &mut head)?;
        match &head {
            b"head" => Ok(()),
            _ => Err(Failure::new("there is no head").context("cannot read it").help("write one")),
        }
    }

    fn run(_: &Nothing, _: &Context<'_>) -> Result<Output, Failure> {
        Err(Failure::new("it is not run"))
    }
}

const HEADED: &str = r#"
schema = 1
[stage]
headed = { kind = "headed", source = "in/*.txt" }
text = { kind = "text-source", source = "in/*.txt" }
file = { kind = "write", input = "headed" }
"#;

fn project() -> Project {
    let mut project = Project::new(HEADED);
    project.kinds = project.kinds.clone().with(Headed);
    project
}

#[test]
fn every_source_is_checked_and_nothing_is_written() {
    let project = project();
    for (name, text) in [("a", "head and body"), ("b", "body"), ("c", "hea"), ("d", "headless")] {
        project.write(&format!("in/{name}.txt"), text);
    }
    let errors = check_sources(&project.plan()).unwrap();
    let found =
        errors.iter().map(|error| format!("{} {}: {}", error.item, error.source, error.error.join(": ")));
    let found = found.collect::<Vec<_>>();
    assert_eq!(found.len(), 2, "{found:?}");
    assert_eq!(found[0], "headed [b] in/b.txt: cannot read it: there is no head");
    assert!(found[1].starts_with("headed [c] in/c.txt: "), "{found:?}");
    assert_eq!(errors[0].help.as_deref(), Some("write one"));
    assert!(!project.exists("out") && !project.exists(".specula"));
}

#[test]
fn an_out_that_cannot_be_written_is_an_error_of_the_check() {
    let project = project();
    project.write("in/a.txt", "head");
    assert_eq!(check_sources(&project.plan()), Ok(Vec::<SourceError>::new()));
    project.write("out", "a file");
    assert!(check_sources(&project.plan()).unwrap_err().to_string().starts_with("out is a file"));
}
