//! Whether outputs depend on the number of threads.

use super::*;
use crate::answers::Determinism;
use crate::kinds::{Context, Failure, Kind, Output, Port};
use crate::testkit::{Nothing, Text};

/// A kind as it must not be: its output depends on the number of threads, from the fifth byte on.
struct Careless;

impl Kind for Careless {
    type Parameters = Nothing;
    const NAME: &'static str = "careless";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Depends on threads.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Text>("text")]
    }

    fn product(_: &Nothing, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact("text")
    }

    fn run(_: &Nothing, context: &Context<'_>) -> Result<Output, Failure> {
        let text = &context.inputs.get::<Text>("text")?.0;
        Output::artifact(Text(format!("{:<4.4}{}", text, "|".repeat(rayon::current_num_threads()))))
    }
}

fn project() -> Project {
    let mut project = Project::new(
        r#"
schema = 1
out = "out"

[stage.text]
kind = "text-source"
source = "*.txt"

[stage.loud]
kind = "upper"
input = "text"

[stage.careless]
kind = "careless"
input = "loud"

[stage.innocent]
kind = "suffix"
input = "careless"
text = "!"

[stage.file]
kind = "write"
input = "innocent"

[stage.count]
kind = "count"
input = "loud"

[stage.counted]
kind = "write"
input = "count"
"#,
    );
    project.kinds = kinds().with(Careless);
    project.write("a.txt", "gold");
    project
}

fn check(project: &Project, stages: &[&str]) -> Determinism {
    let stages = stages.iter().map(|stage| (*stage).to_owned()).collect::<Vec<_>>();
    crate::answers::determinism(&project.plan(), &stages, &[1, 2, 3], &project.cancel, &|_, _| {}).unwrap()
}

#[test]
fn a_difference_is_attributed_to_the_first_item_with_equal_inputs() {
    let project = project();
    let before = project.files("");
    let found = check(&project, &[]);
    assert!(!found.is_proven());
    assert_eq!((found.items, found.outputs), (7, 7));
    let reported = found.differences.iter().map(|difference| {
        let because = difference.because.as_ref().map_or_else(|| "itself".into(), ToString::to_string);
        let (item, output) = (&difference.item, &difference.output);
        format!(
            "{item}: {output} {:?} {:?} at {}, {because}",
            difference.threads, difference.bytes, difference.at
        )
    });
    assert_eq!(
        reported.collect::<Vec<_>>(),
        [
            "careless [a]: text [1, 2] [5, 6] at 5, itself",
            "innocent [a]: text [1, 2] [6, 7] at 5, careless [a]",
            "file [a]: file/a.txt [1, 2] [6, 7] at 5, careless [a]",
        ]
    );
    assert_eq!(project.files(""), before, "neither the state nor out of the project is touched");
}

#[test]
fn stages_that_do_not_depend_on_it_are_proven() {
    let project = project();
    let found = check(&project, &["counted"]);
    assert!(found.is_proven(), "{found:?}");
    assert_eq!((found.items, found.threads.as_slice()), (4, &[1, 2, 3][..]));
}

#[test]
fn a_failure_proves_nothing_and_is_reported() {
    let project = project();
    project.edit("kind = \"upper\"", "kind = \"refuse\"\nword = \"gold\"");
    let found = check(&project, &["counted"]);
    assert!(found.differences.is_empty() && !found.is_proven());
    let failures = found.failures.iter().map(|failed| format!("{} {}", failed.item, failed.threads));
    assert_eq!(failures.collect::<Vec<_>>(), ["loud [a] 1", "loud [a] 2", "loud [a] 3"]);
}

#[test]
fn a_cancelled_check_is_reported_as_cancelled() {
    let project = project();
    project.cancel.cancel();
    let found = check(&project, &[]);
    assert!(found.cancelled && !found.is_proven());
}
