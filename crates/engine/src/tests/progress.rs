//! What a build reports of how far a running item is.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::*;
use crate::kinds::Steps;

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "a.txt" }
quick = { kind = "upper", input = "text" }
slow = { kind = "slow", input = "quick" }
"#;

/// The events of progress so far.
static REPORTED: AtomicUsize = AtomicUsize::new(0);

const STEPS: usize = 4;

/// Takes each step after the one before was reported.
struct Slow;

impl TextKind for Slow {
    type Parameters = Nothing;
    const NAME: &'static str = "slow";

    fn make(_: &Nothing, text: &str, context: &Context<'_>) -> Result<String, Failure> {
        let steps = Steps::new(&context.reporter, STEPS);
        let limit = Instant::now() + Duration::from_secs(60);
        for step in 1..=STEPS {
            steps.step()?;
            while REPORTED.load(Ordering::Relaxed) < step {
                if Instant::now() > limit {
                    return Err(Failure::new("the step is not reported"));
                }
                sleep(Duration::from_millis(2));
            }
        }
        Ok(text.into())
    }
}

#[test]
fn the_share_of_a_long_item_rises_to_1_before_its_end_and_short_items_have_none() {
    let mut project = Project::new(MANIFEST);
    project.write("a.txt", "one");
    project.kinds = kinds().with(Slow);
    let events = Mutex::new(Vec::new());
    let summary = crate::build::build(&project.plan(), &project.options, &project.cancel, &|event| {
        if matches!(event, Event::Progress { .. }) {
            REPORTED.fetch_add(1, Ordering::Relaxed);
        }
        events.lock().push(event);
    });
    assert_eq!(summary.unwrap().ran, 3);
    let events = events.into_inner();
    let reports = events.iter().filter_map(|event| match event {
        Event::Progress { item, share } => Some((item.to_string(), *share)),
        _ => None,
    });
    let expected = (1..=STEPS).map(|step| ("slow [a]".to_owned(), step as f64 / STEPS as f64));
    assert_eq!(reports.collect::<Vec<_>>(), expected.collect::<Vec<_>>());
    let last = events.iter().rposition(|event| matches!(event, Event::Progress { .. })).unwrap();
    assert!(events[last..].iter().any(|event| matches!(event, Event::Finished { .. })));
}
