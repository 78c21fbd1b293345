//! A cache that several folders share, in memory.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use expect_test::expect;
use parking_lot::Mutex;

use super::{PROGRAM, Project, assert_has};
use crate::key::Digest;
use crate::shared::{
    Question, SharedBlob, SharedCache, SharedCacheOptions, SharedResult, Traffic, Trouble, Upload,
    UploadOutputs,
};

/// A server that keeps everything, by itself.
#[derive(Default)]
pub(super) struct Memory {
    results: Mutex<HashMap<Vec<u8>, SharedResult>>,
    blobs: Mutex<HashMap<Digest, Vec<u8>>>,
    /// Blobs that were given away.
    given: Mutex<Vec<Vec<u8>>>,
    is_gone: AtomicBool,
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Memory")
    }
}

impl Memory {
    /// The name of bytes: any digest but the engine's own.
    pub(super) fn name(bytes: &[u8]) -> SharedBlob {
        SharedBlob { hash: Digest::of(&[bytes, b"!"].concat()), bytes: bytes.len() as u64 }
    }

    pub(super) fn keep(&self, bytes: &[u8]) -> SharedBlob {
        let blob = Self::name(bytes);
        self.blobs.lock().insert(blob.hash, bytes.to_vec());
        blob
    }

    pub(super) fn bytes(&self, blob: SharedBlob) -> Option<Vec<u8>> {
        self.blobs.lock().get(&blob.hash).cloned()
    }

    fn forge(&self, change: impl Fn(&mut serde_json::Value)) {
        for result in self.results.lock().values_mut() {
            let mut description = serde_json::from_slice::<serde_json::Value>(&result.description).unwrap();
            if description.get("result").is_some() {
                change(&mut description["result"]);
            }
            result.description = description.to_string().into_bytes();
        }
    }
}

impl SharedCache for Memory {
    fn host(&self) -> String {
        "memory".into()
    }

    fn find(&self, _: &[u8], questions: &[Question]) -> Vec<Option<SharedResult>> {
        let results = self.results.lock();
        let is_gone = self.is_gone.load(Ordering::Relaxed);
        questions.iter().map(|one| results.get(&one.action).filter(|_| !is_gone).cloned()).collect()
    }

    fn read(&self, blobs: &[SharedBlob], each: &mut dyn FnMut(usize, Option<Vec<u8>>) -> bool) {
        for (index, blob) in blobs.iter().enumerate() {
            let bytes = self.blobs.lock().get(&blob.hash).cloned();
            self.given.lock().extend(bytes.clone());
            if !each(index, bytes) {
                return;
            }
        }
    }

    fn store(&self, upload: Upload) {
        let outputs = match upload.outputs {
            UploadOutputs::There(blobs) => blobs,
            UploadOutputs::Here { count, read } => {
                (0..count).map(|index| self.keep(&read(index).expect("it was just made"))).collect()
            }
        };
        let last = upload.entries.len() - 1;
        for (index, (action, description)) in upload.entries.into_iter().enumerate() {
            let outputs = if index == last { outputs.clone() } else { Vec::new() };
            self.results.lock().insert(action, SharedResult { description, outputs });
        }
    }

    fn finish(&self, _: &dyn Fn() -> bool) -> Traffic {
        Traffic::default()
    }

    fn trouble(&self) -> Option<Trouble> {
        let is_gone = self.is_gone.load(Ordering::Relaxed);
        is_gone.then(|| Trouble { message: "it is gone".into(), is_lost: true })
    }
}

const MANIFEST: &str = r#"
schema = 1
[stage]
text = { kind = "text-source", source = "*.txt" }
loud = { kind = "upper", input = "text" }
file = { kind = "write", input = "loud", path = "{text}" }
"#;

fn project(memory: &Arc<Memory>, text: &str) -> Project {
    let project = with_cache(memory, MANIFEST);
    project.write("a.txt", text);
    project
}

/// A folder that shares its results through this memory.
pub(super) fn with_cache(memory: &Arc<Memory>, manifest: &str) -> Project {
    let mut project = Project::new(manifest);
    project.options.jobs = Some(1);
    project.options.shared = Some(SharedCacheOptions {
        cache: Arc::clone(memory) as Arc<dyn SharedCache>,
        version: "test".into(),
        machine: "nightly".into(),
        download_all: false,
        is_required: false,
        executor: None,
        programs: Vec::new(),
    });
    project
}

#[test]
fn another_folder_finds_what_one_made_and_receives_its_files_alone() {
    let memory = Arc::<Memory>::default();
    let one = project(&memory, "light");
    expect![[r"
        planned 3 stages, 3 items
        run text [a]: never built
        ran text [a]
        run loud [a]: never built
        ran loud [a]
        run file [a]: never built
        ran file [a]
        published a.txt 5
        ended: 3 ran, 0 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "]]
    .assert_eq(&one.build());
    let other = project(&memory, "light");
    expect![[r"
        planned 3 stages, 3 items
        from memory text [a]
        from memory loud [a]
        from memory file [a]
        published a.txt 5
        ended: 0 ran, 3 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "]]
    .assert_eq(&other.build());
    assert_eq!(*memory.given.lock(), [b"LIGHT"]);
    assert!(!other.blob("light").exists() && other.blob("LIGHT").exists());
    let origin = other.explain("loud")[0].last.as_ref().unwrap().from_cache.clone().unwrap().shared.unwrap();
    assert_eq!((origin.host.as_str(), origin.machine.as_str()), ("memory", "nightly"));
}

#[test]
fn an_input_that_is_only_there_is_received_when_an_item_runs() {
    let memory = Arc::<Memory>::default();
    project(&memory, "light").build();
    let other = project(&memory, "light");
    other.build();
    other.edit("loud = ", "suffix = { kind = \"suffix\", input = \"text\", text = \"!\" }\nloud = ");
    let log = other.build();
    assert!(log.contains("ran suffix [a]") && !log.contains("ran text"), "{log}");
    assert!(memory.given.lock().contains(&b"light".to_vec()));
}

/// A preview needs every result on this machine: with the cache they are received, without it made.
#[test]
fn results_in_the_middle_are_here_if_all_have_to_be() {
    let memory = Arc::<Memory>::default();
    project(&memory, "light").build();
    for with_cache in [true, false] {
        let mut other = project(&memory, "light");
        other.build();
        assert!(!other.blob("light").exists());
        other.options.all_local = true;
        if let Some(shared) = &mut other.options.shared {
            shared.download_all = true;
        }
        if !with_cache {
            other.options.shared = None;
        }
        let log = other.build();
        assert!(other.blob("light").exists() && other.blob("LIGHT").exists(), "{log}");
        assert_eq!(log.contains("from memory text [a]"), with_cache, "{log}");
        assert_eq!(log.contains("ran text [a]"), !with_cache, "{log}");
        assert!(other.build().contains("0 ran, 3 up to date"));
    }
}

#[test]
fn what_the_server_lost_is_made_again() {
    let memory = Arc::<Memory>::default();
    project(&memory, "light").build();
    let other = project(&memory, "light");
    memory.blobs.lock().clear();
    let log = other.build();
    assert_has(&log, ["run file [a]", "published a.txt 5", "0 failed"]);
    assert_eq!(other.read("out/a.txt"), "LIGHT");
}

#[test]
fn files_that_a_file_includes_are_part_of_the_action() {
    let memory = Arc::<Memory>::default();
    let with = |text: &str| {
        let project = project(&memory, "include b\n");
        project.write("b", text);
        project
    };
    with("one").build();
    assert_has(with("one").build(), ["from memory text [a]", "0 ran"]);
    let other = with("two");
    let log = other.build();
    assert!(log.contains("ran text [a]") && other.read("out/a.txt") == "TWO", "{log}");
    // Both are there now.
    assert!(with("one").build().contains("0 ran") && with("two").build().contains("0 ran"));
}

#[test]
fn where_path_leads_is_part_of_the_action() {
    let memory = Arc::<Memory>::default();
    for name in [PROGRAM, "no-such-program"] {
        let text = format!("program {name}\n");
        let one = project(&memory, &text);
        assert!(one.build().contains("ran text [a]"));
        let reads = one.explain("text [a]").remove(0).last.unwrap().reads;
        let read = reads.iter().find(|read| read.kind == crate::ReadKind::Lookup).unwrap();
        assert_eq!((read.path.as_str(), read.found.is_some()), (name, name == PROGRAM));
        assert_eq!(read.digest.is_some(), read.found.is_some());
        assert_has(project(&memory, &text).build(), ["from memory text [a]", "0 ran"]);
    }
}

#[test]
fn a_result_that_does_not_fit_is_not_taken() {
    let changes: [&dyn Fn(&mut serde_json::Value); 6] = [
        &|result| result["key"] = Digest::of(b"other").to_string().into(),
        &|result| result["kind"] = "count".into(),
        &|result| result["revision"] = 77.into(),
        &|result| result["outputs"] = serde_json::json!([]),
        &|result| result["outputs"][0]["bytes"] = 1_000_000.into(),
        &|result| result["outputs"][0]["digest"] = Digest::of(b"other").to_string().into(),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let memory = Arc::<Memory>::default();
        project(&memory, "light").build();
        memory.forge(change);
        let other = project(&memory, "light");
        let log = other.build();
        assert!(log.contains("0 failed") && log.contains("ran file [a]"), "{index}: {log}");
        assert_eq!(other.read("out/a.txt"), "LIGHT", "{index}");
    }
}

#[test]
fn a_cache_that_is_gone_is_a_warning_or_an_error() {
    let memory = Arc::<Memory>::default();
    memory.is_gone.store(true, Ordering::Relaxed);
    let mut project = project(&memory, "light");
    let log = project.build();
    assert_has(&log, ["trouble at memory: it is gone; the build continues without it\n", "3 ran"]);
    project.options.shared.as_mut().unwrap().is_required = true;
    let (_, summary) = project.try_build();
    assert!(summary.unwrap_err().to_string().contains("it is gone"));
}

#[test]
fn what_is_not_shared_runs_and_what_comes_after_it_is_found() {
    let memory = Arc::<Memory>::default();
    let with = || {
        let project = project(&memory, "light");
        project.edit("input = \"text\"", "input = \"own\"");
        project.edit("loud = ", "own = { kind = \"private\", input = \"text\" }\nloud = ");
        project
    };
    with().build();
    expect![[r"
        planned 4 stages, 4 items
        from memory text [a]
        run own [a]: never built
        ran own [a]
        from memory loud [a]
        from memory file [a]
        published a.txt 5
        ended: 1 ran, 3 up to date, 0 failed, 0 skipped, 1 published, 0 removed
    "]]
    .assert_eq(&with().build());
}
