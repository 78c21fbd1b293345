//! How often artifacts are decoded, and how long they stay in memory.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::kinds::Artifact;
use crate::parameters;

static DECODED: AtomicUsize = AtomicUsize::new(0);
static ALIVE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// An artifact that is counted.
struct Big(Vec<u8>);

impl Big {
    fn new(bytes: Vec<u8>) -> Self {
        MOST.fetch_max(ALIVE.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
        Self(bytes)
    }
}

impl Drop for Big {
    fn drop(&mut self) {
        ALIVE.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Artifact for Big {
    const TYPE: &'static str = "big";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(self.0.clone())
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        DECODED.fetch_add(1, Ordering::SeqCst);
        Ok(Self::new(bytes.to_vec()))
    }
}

parameters! {
    /// What is added.
    struct Added {
        /// A number.
        number: usize = 0,
    }
}

struct Import;

impl Kind for Import {
    type Parameters = Added;
    const NAME: &'static str = "import";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Reads.\n";
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Added, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Big::TYPE)
    }

    fn run(_: &Added, context: &Context<'_>) -> Result<Output, Failure> {
        Output::artifact(Big::new(context.files.read(context.files.source()?)?.to_vec()))
    }
}

struct Add;

impl Kind for Add {
    type Parameters = Added;
    const NAME: &'static str = "add";
    const REVISION: u32 = 1;
    const TEXT: &'static str = "//! Adds.\n";

    fn ports() -> Vec<Port> {
        vec![Port::one::<Big>("big")]
    }

    fn product(_: &Added, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(Big::TYPE)
    }

    fn run(parameters: &Added, context: &Context<'_>) -> Result<Output, Failure> {
        let mut bytes = context.inputs.get::<Big>("big")?.0.clone();
        bytes.push(u8::try_from(parameters.number)?);
        Output::artifact(Big::new(bytes))
    }
}

/// The counts are global to the process.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Twenty imports, each with two consumers, one of which has another.
fn imports() -> Project {
    let mut project = Project::new(
        r#"
schema = 1
[stage]
big = { kind = "import", source = "*.txt" }
left = { kind = "add", input = "big", number = 1 }
right = { kind = "add", input = "big", number = 1 }
end = { kind = "add", input = "left", number = 1 }
"#,
    );
    project.kinds = Kinds::new().with(Import).with(Add);
    for n in 0..20 {
        project.write(&format!("{n}.txt"), &format!("text {n}"));
    }
    project
}

#[test]
fn an_artifact_is_decoded_once_and_dropped_after_its_last_consumer() {
    let _alone = ONE_AT_A_TIME.lock();
    DECODED.store(0, Ordering::SeqCst);
    MOST.store(0, Ordering::SeqCst);
    let mut project = imports();
    assert!(project.build().contains("80 ran"));
    assert_eq!(DECODED.load(Ordering::SeqCst), 0, "what was just made is passed on");
    // The import and `left` of one item, and the artifact that is being made.
    assert!(MOST.load(Ordering::SeqCst) <= 3, "{MOST:?} were alive at once");
    assert_eq!(ALIVE.load(Ordering::SeqCst), 0);

    assert!(project.build().contains("0 ran"));
    assert_eq!(DECODED.load(Ordering::SeqCst), 0, "nothing is decoded when nothing runs");

    for (jobs, old, new) in [(1, "number = 1", "number = 2"), (4, "number = 2", "number = 3")] {
        project.edit(old, new);
        DECODED.store(0, Ordering::SeqCst);
        project.options.jobs = Some(jobs);
        assert!(project.build().contains("60 ran, 20 up to date"));
        assert_eq!(DECODED.load(Ordering::SeqCst), 20, "each import once for its two consumers");
        assert_eq!(ALIVE.load(Ordering::SeqCst), 0);
    }
}

#[test]
fn a_session_keeps_the_artifacts_that_it_made_and_decoded() {
    let _alone = ONE_AT_A_TIME.lock();
    let project = imports();
    let session = BuildSession::new(Some(2), 1 << 20).unwrap();
    assert!(project.build_on(&session).contains("80 ran"));
    DECODED.store(0, Ordering::SeqCst);
    project.edit("number = 1", "number = 2");
    assert!(project.build_on(&session).contains("60 ran, 20 up to date"));
    assert_eq!(DECODED.load(Ordering::SeqCst), 0, "what was made is remembered");

    let fresh = BuildSession::new(Some(2), 1 << 20).unwrap();
    project.edit("number = 2", "number = 3");
    assert!(project.build_on(&fresh).contains("60 ran"));
    assert_eq!(DECODED.load(Ordering::SeqCst), 20);
    project.edit("number = 3", "number = 4");
    assert!(project.build_on(&fresh).contains("60 ran"));
    assert_eq!(DECODED.load(Ordering::SeqCst), 20, "what was decoded is remembered");

    // The limit is so small that each of these artifacts exceeds it.
    let small = BuildSession::new(Some(2), 3).unwrap();
    for number in [5, 6] {
        DECODED.store(0, Ordering::SeqCst);
        project.edit(&format!("number = {}", number - 1), &format!("number = {number}"));
        assert!(project.build_on(&small).contains("60 ran"));
        assert_eq!(DECODED.load(Ordering::SeqCst), 20);
    }
    drop((session, fresh, small));
    assert_eq!(ALIVE.load(Ordering::SeqCst), 0);
}

#[test]
fn memory_replaces_a_damaged_result_and_not_a_lost_one() {
    let _alone = ONE_AT_A_TIME.lock();
    let project = imports();
    let session = BuildSession::new(Some(1), 1 << 20).unwrap();
    project.build_on(&session);
    DECODED.store(0, Ordering::SeqCst);
    // As long as the original, so that only reading it shows the damage.
    std::fs::write(project.blob("text 0"), "tixt 0").unwrap();
    std::fs::remove_file(project.blob("text 1")).unwrap();
    project.edit("number = 1", "number = 2");
    assert_has(project.build_on(&session), ["run big [1]: result lost\n", "61 ran, 19 up to date"]);
    assert_eq!(DECODED.load(Ordering::SeqCst), 0);
    assert_eq!(std::fs::read(project.blob("text 1")).unwrap(), b"text 1");
    assert_eq!(std::fs::read(project.blob("text 0\u{2}\u{2}")).unwrap(), b"text 0\x02\x02");

    // A session without the value in memory reads the blob, and so detects the damage.
    project.edit("number = 2", "number = 3");
    assert_has(project.build(), ["run big [0]: result lost\n", "61 ran, 19 up to date"]);
    assert_eq!(std::fs::read(project.blob("text 0")).unwrap(), b"text 0");
}
