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

crate::parameters! {
    /// Parameters of [`Greeting`].
    struct Language {
        /// The language of a greeting that is built in.
        language: Option<String> = None,
    }
}

/// Reads a file; without a source, it makes a greeting that is built in.
struct Greeting;

impl Kind for Greeting {
    type Parameters = Language;
    const NAME: &'static str = "greeting";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads a text, or makes a greeting.\n";
    const SOURCE: bool = true;
    const BUILT_IN: Option<&'static str> = Some("language");

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Language, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Text::TYPE)
    }

    fn built_in(parameters: &Language) -> Result<Option<String>, String> {
        match parameters.language.as_deref() {
            None | Some("english" | "french") => Ok(parameters.language.clone()),
            Some(other) => Err(format!("there is no greeting in {other}")),
        }
    }

    fn run(parameters: &Language, context: &Context<'_>) -> Result<Output, Failure> {
        let text = match (context.files.source(), parameters.language.as_deref()) {
            (Ok(source), _) => String::from_utf8(context.files.read(source)?.to_vec())?,
            (Err(_), Some("french")) => "bonjour".into(),
            (Err(_), _) => "hello".into(),
        };
        Output::artifact(Text(text))
    }
}

const GREETINGS: &str = r#"
schema = 1
[stage]
text = { kind = "greeting", language = "french" }
loud = { kind = "upper", input = "text" }
file = { kind = "write", input = "loud", path = "{text}" }
"#;

#[test]
fn a_parameter_can_take_the_place_of_the_source() {
    let mut project = Project::new(GREETINGS);
    project.kinds = project.kinds.clone().with(Greeting);
    assert_has(project.build(), ["ran text [french]", "ran loud [french]"]);
    assert_eq!(project.read("out/french.txt"), "BONJOUR");
    assert_eq!(project.plan().items[0].source, None);
    assert_has(project.build(), ["up to date text [french]", "up to date loud [french]"]);

    project.write("greetings/welcome.txt", "welcome");
    project.edit("language = \"french\"", "source = \"greetings/*.txt\", language = \"french\"");
    project.build();
    assert_eq!(project.read("out/welcome.txt"), "WELCOME");
    assert!(!project.exists("out/french.txt"));
}

#[test]
fn what_is_not_built_in_is_an_error_at_its_parameter() {
    let mut project = Project::new(GREETINGS);
    project.kinds = project.kinds.clone().with(Greeting);
    let errors = |project: &Project| {
        let errors = Plan::load(&project.path("pipeline.toml"), &project.kinds).err().unwrap();
        crate::testkit::shown(&errors)
    };
    project.edit("french", "latin");
    assert_eq!(errors(&project), "4:40 language: there is no greeting in latin\n");
    project.edit(", language = \"latin\"", "");
    let expected = "4:8 stage \"text\" has no source | expected source = \"...\", a file, a folder or a glob \
                    | or language = \"...\", the name of a built-in one\n";
    assert_eq!(errors(&project), expected);
    project.edit("\"greeting\"", "\"greeting\", language = 7");
    assert_eq!(errors(&project).lines().count(), 1);
}
