//! What the cache keeps, removes and repairs.

use std::collections::BTreeSet;
use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::answers::cache::{CollectOptions, Freed, collect, stats, verify};
use crate::build::BuildSession;
use crate::error::ErrorKind;
use crate::storage::{Amount, LockTimeout};

/// One text of a hundred bytes: it has two blobs, as the file has the bytes of the artifact that it is made
/// from.
fn chain() -> Project {
    let project = Project::new(CHAIN);
    write(&project, 'a');
    project
}

fn write(project: &Project, letter: char) {
    project.write("text.txt", &letter.to_string().repeat(100));
}

/// Builds with one letter after another in the text.
fn edits(project: &Project, letters: &str) {
    for letter in letters.chars() {
        write(project, letter);
        project.build();
    }
}

fn gc(project: &Project, limit: Option<u64>) -> Freed {
    let options = CollectOptions { limit, ..CollectOptions::default() };
    collect(&project.path(""), &options, &|_| {}).unwrap()
}

/// Whether a build with this letter would run nothing.
fn is_remembered(project: &Project, letter: char) -> bool {
    write(project, letter);
    project.rehearse().1.ran == 0
}

fn amount(count: u64, bytes: u64) -> Amount {
    Amount { count, bytes }
}

#[test]
fn results_in_effect_earlier_results_and_garbage_are_distinguished() {
    let project = chain();
    edits(&project, "abc");
    project.write(&format!(".specula/blobs/ab/{}", "0".repeat(62)), "nobody's");
    project.write(".specula/tmp/1-1", "half");
    let found = stats(&project.path("")).unwrap();
    assert_eq!(found.in_effect, amount(2, 200));
    assert_eq!(found.earlier, amount(4, 400));
    assert_eq!(found.garbage, amount(1, 8));
    assert_eq!(found.temporary, amount(1, 4));
    assert_eq!(found.journal.bytes, project.read(".specula/journal").len() as u64);
    let shares = found.stages.iter().map(|share| (share.stage.as_str(), share.in_effect, share.earlier));
    let mut shares = shares.collect::<Vec<_>>();
    shares.sort_by_key(|(stage, ..)| *stage);
    let share = (amount(1, 100), amount(2, 200));
    assert_eq!(shares, ["file", "loud", "text"].map(|stage| (stage, share.0, share.1)));
}

#[test]
fn without_a_limit_only_garbage_is_removed() {
    let project = chain();
    edits(&project, "ab");
    project.write(&format!(".specula/blobs/ab/{}", "0".repeat(62)), "nobody's");
    project.write(".specula/tmp/1-1", "half");
    let rehearsal = CollectOptions { dry_run: true, ..CollectOptions::default() };
    let before = project.files(".specula");
    let expected = Freed {
        garbage: amount(1, 8),
        earlier: Amount::default(),
        temporary: amount(1, 4),
        left: amount(4, 400),
        in_effect: amount(2, 200),
    };
    assert_eq!(collect(&project.path(""), &rehearsal, &|_| {}).unwrap(), expected);
    assert_eq!(project.files(".specula"), before, "a rehearsal writes nothing");
    assert_eq!(gc(&project, None), expected);
    assert!(is_remembered(&project, 'a') && is_remembered(&project, 'b'));
    assert_eq!(
        gc(&project, None),
        Freed { garbage: Amount::default(), temporary: Amount::default(), ..expected }
    );
}

#[test]
fn with_a_limit_the_least_recently_used_results_are_removed_first_and_those_in_effect_never() {
    let project = chain();
    // Of the earlier results `a` was used last, as the edit to it was undone again.
    edits(&project, "abcad");
    assert_eq!(stats(&project.path("")).unwrap().earlier, amount(6, 600));
    assert_eq!(gc(&project, Some(400)).earlier, amount(4, 400));
    assert_eq!(
        ['a', 'b', 'c', 'd'].map(|letter| is_remembered(&project, letter)),
        [true, false, false, true]
    );
    let freed = gc(&project, Some(0));
    assert_eq!(
        (freed.earlier, freed.left, freed.in_effect),
        (amount(2, 200), amount(2, 200), amount(2, 200))
    );
    write(&project, 'd');
    assert!(project.build().contains("0 ran, 3 up to date"));
    project.remove("out");
    assert_has(project.build(), ["restored file/text.txt 100", "0 ran"]);
    // No line remains whose blob does not exist.
    let journal = project.read(".specula/journal");
    let named = journal.match_indices("{\"digest\":\"").map(|(at, start)| &journal[at + start.len()..][..64]);
    for digest in named.collect::<BTreeSet<_>>() {
        assert!(project.exists(&format!(".specula/blobs/{}/{}", &digest[..2], &digest[2..])), "{digest}");
    }
    edits(&project, "a");
    assert_eq!(project.read("out/file/text.txt"), "A".repeat(100));
}

#[test]
fn the_last_good_outputs_of_a_failed_item_and_of_every_manifest_stay() {
    let project = chain();
    project.write(
        "other.toml",
        &CHAIN.replace("out = \"out\"", "out = \"published\"").replace("*.txt", "other/*.txt"),
    );
    project.write("other/text.txt", &"z".repeat(100));
    project.build();
    let other = || Plan::load(&project.path("other.toml"), &project.kinds).unwrap();
    crate::build::build(&other(), &project.options, &project.cancel, &|_| {}).unwrap();
    // Two bytes that are not a text: the source fails, and the outputs of its last good result stay.
    fs::write(project.path("text.txt"), [0xff, 0xfe]).unwrap();
    assert!(project.build().contains("1 failed, 2 skipped"));
    assert_eq!(gc(&project, Some(0)).left, amount(4, 400));
    project.remove("out");
    write(&project, 'a');
    project.build();
    assert_eq!(project.read("out/file/text.txt"), "A".repeat(100));
    // The outputs of a manifest that no longer exists do not count.
    project.remove("other.toml");
    assert_eq!(gc(&project, Some(0)).left, amount(2, 200));
}

#[test]
fn the_result_of_a_removed_item_is_earlier_and_restored_without_a_run() {
    let project = chain();
    project.write("more.txt", &"m".repeat(100));
    project.build();
    project.remove("more.txt");
    project.build();
    let found = stats(&project.path("")).unwrap();
    assert_eq!((found.in_effect, found.earlier), (amount(2, 200), amount(2, 200)));
    project.write("more.txt", &"m".repeat(100));
    assert!(project.build().contains("0 ran, 6 up to date"));
    assert_eq!(stats(&project.path("")).unwrap().in_effect, amount(4, 400));
    // Even then its reads are known: an edit is reported as an edit.
    project.remove("more.txt");
    project.build();
    project.write("more.txt", "short");
    assert_has(project.build(), ["run text [more]: file more.txt some -> some"]);
}

#[test]
fn a_damaged_blob_is_reported_removed_and_made_again_by_the_next_build() {
    let project = chain();
    edits(&project, "ab");
    let check = || verify(&project.path(""), LockTimeout::NONE, &|_| {}).unwrap();
    assert_eq!((check().intact, check().lost.len()), (amount(4, 400), 0));
    let (now, before) = (project.blob(&"B".repeat(100)), project.blob(&"a".repeat(100)));
    fs::write(&now, "B".repeat(99) + "?").unwrap();
    fs::write(&before, "short").unwrap();
    fs::remove_file(project.blob(&"b".repeat(100))).unwrap();
    let found = check();
    assert_eq!(found.intact, amount(1, 100));
    let mut lost_blobs = found.lost.iter().map(|lost| {
        let names = |items: &[crate::event::ItemName]| {
            items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        };
        format!(
            "{} of [{}], earlier of [{}]",
            if lost.damaged { "damaged" } else { "missing" },
            names(&lost.items),
            names(&lost.earlier)
        )
    });
    let mut lost_blobs = lost_blobs.by_ref().collect::<Vec<_>>();
    lost_blobs.sort();
    assert_eq!(
        lost_blobs,
        [
            "damaged of [], earlier of [text [text]]",
            "damaged of [file [text], loud [text]], earlier of []",
            "missing of [text [text]], earlier of []",
        ]
    );
    assert!(!now.exists() && !before.exists());
    assert_has(project.build(), ["run text [text]: result lost", "run loud [text]: result lost"]);
    assert_eq!(check().lost, []);
    assert_eq!(project.files("out").len(), 1);
    assert!(project.build().contains("0 ran, 3 up to date"));
}

#[test]
fn a_collection_killed_at_any_moment_leaves_a_correct_cache() {
    let project = chain();
    edits(&project, "abcd");
    let before = project.files(".specula");
    gc(&project, Some(200));
    let after = project.files(".specula");
    let removed = before.iter().filter(|(name, _)| !after.iter().any(|(other, _)| other == name));
    let removed = removed.map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(removed.len(), 6);
    let journal =
        |files: &[(String, Vec<u8>)]| files.iter().find(|(name, _)| name == "journal").unwrap().1.clone();
    let (old, new) = (journal(&before), journal(&after));
    // A new journal that is half written; a renamed one, with some of the blobs removed; and what a copying
    // tool may leave: the old journal with blobs removed.
    let moments = (0..removed.len())
        .flat_map(|gone| [(&old, Some(&new[..new.len() / 2]), 0), (&new, None, gone), (&old, None, gone)]);
    for (round, (journal, half, gone)) in moments.enumerate() {
        for (name, content) in &before {
            fs::write(project.path(".specula").join(name), content).unwrap();
        }
        fs::write(project.path(".specula/journal"), journal).unwrap();
        if let Some(half) = half {
            fs::write(project.path(".specula/journal.new"), half).unwrap();
        }
        removed[..gone].iter().for_each(|name| project.remove(&format!(".specula/{name}")));
        for letter in ['d', 'a', 'b', 'c', 'd'] {
            write(&project, letter);
            let log = project.build();
            assert!(log.contains("0 failed, 0 skipped"), "round {round}: {log}");
            assert_eq!(project.read("out/file/text.txt"), letter.to_string().to_uppercase().repeat(100));
        }
        assert_eq!(gc(&project, Some(200)).left, amount(2, 200), "round {round}");
        assert!(!project.exists(".specula/journal.new"));
    }
}

#[test]
fn readers_are_not_disturbed_by_builds_compactions_and_collections() {
    let project = chain();
    edits(&project, "a");
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let readers = (0..2).map(|_| {
            scope.spawn(|| {
                let mut rounds = 0;
                while !ended.load(Ordering::Relaxed) || rounds < 20 {
                    stats(&project.path("")).unwrap();
                    let explained = crate::answers::explain(&project.plan(), "file").unwrap();
                    assert!(explained[0].last.is_some(), "there always is a last run");
                    rounds += 1;
                    // Locks are not fair on every system: two readers without a pause keep a build waiting.
                    std::thread::sleep(std::time::Duration::from_millis(1));
                }
            })
        });
        let readers = readers.collect::<Vec<_>>();
        for round in 0..30_u32 {
            edits(&project, ["b", "a", "c"][round as usize % 3]);
            gc(&project, Some(200 * u64::from(round % 3)));
        }
        ended.store(true, Ordering::Relaxed);
        readers.into_iter().for_each(|reader| reader.join().unwrap());
    });
}

#[test]
fn a_session_that_builds_all_day_keeps_cache_and_journal_within_bounds() {
    let project = chain();
    let session = BuildSession::new(Some(1), 0).unwrap();
    let mut largest = 0;
    let mut longest = 0;
    for round in 0..1500 {
        project.write("text.txt", &format!("{round:>100}"));
        session.build(&project.plan(), &project.options, &project.cancel, &|_| {}).unwrap();
        session.trim(&project.path(""), 20_000).unwrap();
        if round % 50 == 49 {
            let found = stats(&project.path("")).unwrap();
            largest = largest.max((found.in_effect + found.earlier + found.garbage).bytes);
            longest = longest.max(found.journal.count);
        }
    }
    assert!((15_000..=20_000).contains(&largest), "{largest} bytes");
    assert!(longest < 4000, "{longest} lines of the journal");
    // The last ones can still be restored: of one key, eight contents are remembered.
    project.write("text.txt", &format!("{:>100}", 1494));
    assert!(project.build().contains("0 ran, 3 up to date"));
}

#[test]
fn trimming_leaves_a_locked_or_missing_folder_alone() {
    let project = chain();
    let session = BuildSession::new(Some(1), 0).unwrap();
    assert_eq!(session.trim(&project.path(""), 0).unwrap(), Freed::default(), "nothing has been built");
    edits(&project, "ab");
    let lock = fs::File::options().write(true).open(project.path(".specula/lock")).unwrap();
    lock.lock().unwrap();
    assert_eq!(session.trim(&project.path(""), 0).unwrap(), Freed::default());
    assert_eq!(stats(&project.path("")).unwrap().earlier, amount(2, 200));
    drop(lock);
    assert_eq!(session.trim(&project.path(""), 0).unwrap().earlier, amount(2, 200));
}

#[test]
fn a_folder_without_a_cache_is_an_error() {
    let project = chain();
    let error = stats(&project.path("")).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::UnknownTarget);
    assert!(error.to_string().contains(".specula does not exist") && error.help().is_some(), "{error}");
    assert!(collect(&project.path(""), &CollectOptions::default(), &|_| {}).is_err());
    assert!(verify(&project.path(""), LockTimeout::NONE, &|_| {}).is_err());
    assert!(!project.exists(".specula"));
}
