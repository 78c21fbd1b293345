//! What a journal keeps, whatever happens to its file.

use std::fs;

use super::*;

/// Opens a journal as a build does.
fn open(path: &Path, saved: Option<Journal>) -> Result<Journal, Error> {
    Journal::write(path, saved, |journal| Retention::of(journal, Path::new("")))
}

fn journal(path: &Path) -> Journal {
    let journal = open(path, None).unwrap();
    journal
        .append(&[
            Line::new(Tag::Item, 1, Some(&"one")),
            Line::new(Tag::Item, 2, Some(&"two")),
            Line::new(Tag::Item, 1, Some(&"uno")),
            Line::new(Tag::Published, 1, Some(&"file")),
        ])
        .unwrap();
    let results = (0..10).map(|n| Line::new(Tag::Result, 7, Some(&n))).collect::<Vec<_>>();
    journal.append(&results).unwrap();
    journal.append(&[Line::new::<()>(Tag::Published, 1, None)]).unwrap();
    journal
}

#[test]
fn the_last_line_counts_and_of_results_the_last_eight() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    drop(journal(&path));
    for _ in 0..2 {
        let mut read = open(&path, None).unwrap();
        assert_eq!(read.get::<String>(Tag::Item, 1).unwrap(), "uno");
        assert_eq!(read.get::<String>(Tag::Item, 2).unwrap(), "two");
        assert_eq!(read.get::<String>(Tag::Published, 1), None);
        assert_eq!(read.results::<u32>(7).collect::<Vec<_>>(), [9, 8, 7, 6, 5, 4, 3, 2]);
        read.compact(|_| true).unwrap();
    }
    assert!(!path.with_extension("new").exists());
}

#[test]
fn every_truncated_length_reads_as_a_prefix_and_can_be_appended_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    drop(journal(&path));
    let whole = fs::read(&path).unwrap();
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        let opened = open(&path, None).unwrap();
        if let Some(one) = opened.get::<String>(Tag::Item, 1) {
            assert!(one == "one" || one == "uno");
        }
        opened.append(&[Line::new(Tag::Item, 3, Some(&"three"))]).unwrap();
        drop(opened);
        let again = Journal::read(&path).unwrap();
        assert_eq!(again.get::<String>(Tag::Item, 3).unwrap(), "three", "cut at {length}");
    }
}

#[test]
fn a_torn_line_that_cannot_be_removed_does_not_damage_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let journal = journal(&path);
    let mut appender = journal.appender.as_ref().unwrap().lock();
    appender.file.write_all(b"0123456789abcdef i half").unwrap();
    appender.torn = true;
    drop(appender);
    for n in 3..5 {
        journal.append(&[Line::new(Tag::Item, n, Some(&n))]).unwrap();
    }
    let again = Journal::read(&path).unwrap();
    assert_eq!(again.get::<u32>(Tag::Item, 3), Some(3));
    assert_eq!(again.get::<u32>(Tag::Item, 4), Some(4));
}

#[test]
fn every_damaged_byte_costs_at_most_its_own_line_and_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    drop(journal(&path));
    let whole = fs::read(&path).unwrap();
    for at in (0..whole.len()).step_by(7) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x20;
        fs::write(&path, &damaged).unwrap();
        let opened = Journal::read(&path).unwrap();
        assert!(opened.results::<u32>(7).count() >= 6, "damaged at {at}");
    }
    fs::write(&path, [0xff; 5000]).unwrap();
    assert_eq!(open(&path, None).unwrap().subjects(Tag::Item).count(), 0);
}

#[test]
fn a_newer_format_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    fs::write(&path, "specula journal 2\nwhatever").unwrap();
    assert_eq!(open(&path, None).err().unwrap().kind(), ErrorKind::NewerState);
    assert_eq!(fs::read_to_string(&path).unwrap(), "specula journal 2\nwhatever");
}

#[test]
fn a_saved_journal_reads_what_others_appended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let mut saved = journal(&path).close();
    for n in 100..110_u32 {
        let other = open(&path, None).unwrap();
        other.append(&[Line::new(Tag::Stamp, n.into(), Some(&n))]).unwrap();
        // Only the appended lines are read, not those that are known.
        let mut known = saved.take().unwrap();
        let before = known.text.length();
        let mut read = 0;
        let same = known.text.read_appended(&path, |start, piece| {
            assert!(start >= before);
            read += piece.len() as u64;
        });
        assert!(same.unwrap());
        let length = fs::metadata(&path).unwrap().len();
        assert_eq!((known.text.length(), read), (length, length - before));
        saved = open(&path, None).unwrap().close();
        let other = open(&path, None).unwrap();
        other.append(&[Line::new(Tag::Stamp, (n + 100).into(), Some(&n))]).unwrap();
        let ours = open(&path, saved.take()).unwrap();
        assert_eq!(ours.get::<u32>(Tag::Stamp, n.into()), Some(n));
        assert_eq!(ours.get::<u32>(Tag::Stamp, (n + 100).into()), Some(n));
        assert_eq!(ours.get::<String>(Tag::Item, 2).unwrap(), "two");
        ours.append(&[Line::new(Tag::Item, 2, Some(&"two"))]).unwrap();
        saved = ours.close();
    }
}

#[test]
fn appended_lines_are_known_after_closing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let ours = open(&path, journal(&path).close()).unwrap();
    ours.append(&[Line::new(Tag::Item, 2, Some(&"due"))]).unwrap();
    assert_eq!(ours.get::<String>(Tag::Item, 2).unwrap(), "two", "a build does not see what it appends");
    let mut ours = open(&path, ours.close()).unwrap();
    assert_eq!(ours.get::<String>(Tag::Item, 2).unwrap(), "due");
    ours.compact(|_| true).unwrap();
    assert_eq!(ours.get::<String>(Tag::Item, 1).unwrap(), "uno");
    assert_eq!(ours.results::<u32>(7).collect::<Vec<_>>(), [9, 8, 7, 6, 5, 4, 3, 2]);
    assert_eq!(ours.lines, Journal::read(&path).unwrap().lines);
}

/// Everything that a journal says.
fn said(journal: &Journal) -> Vec<(Tag, Vec<(Subject, serde_json::Value)>)> {
    let of = |tag| {
        let mut lines = journal.contents::<serde_json::Value>(tag);
        lines.sort_by_key(|(subject, _)| *subject);
        (tag, lines)
    };
    Tag::ALL.map(of).into()
}

/// A journal of so many lines that it has an index, and some more lines.
fn indexed(path: &Path) {
    let ours = open(path, None).unwrap();
    let line = |n: usize| {
        let digest = Digest::of(&n.to_le_bytes());
        let record = serde_json::json!({
            "manifest": "pipeline.toml", "key": digest, "kind": "write", "milliseconds": n,
            "outputs": [{ "digest": digest, "bytes": n }], "failure": null, "gone": n.is_multiple_of(5),
            "reads": [{ "path": format!("{}.txt", n % 7), "listing": false, "digest": digest }],
        });
        Line::new(if n.is_multiple_of(2) { Tag::Item } else { Tag::Result }, short(digest), Some(&record))
    };
    ours.append(&(0..1200).map(line).collect::<Vec<_>>()).unwrap();
    let ours = open(path, ours.close()).unwrap();
    assert_eq!(ours.indexed, ours.lines, "all is in the index");
    ours.append(&(1150..1250).map(line).collect::<Vec<_>>()).unwrap();
    ours.append(&[Line::new::<()>(Tag::Item, short(Digest::of(&2_usize.to_le_bytes())), None)]).unwrap();
}

#[test]
fn a_journal_is_the_same_with_and_without_its_index() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    indexed(&path);
    let with = Journal::read(&path).unwrap();
    assert!(with.indexed > 1200 && with.lines > with.indexed, "most was not read");
    fs::remove_file(index_of(&path)).unwrap();
    let without = Journal::read(&path).unwrap();
    assert_eq!(without.indexed, 0);
    assert_eq!((with.size(), said(&with)), (without.size(), said(&without)));
    let latest_records = |journal: &Journal| {
        let of = |(subject, latest): (Subject, LatestRecord<'_>)| {
            let reads = latest.reads().map(|(path, kind, digest)| (path.to_owned(), kind, digest));
            let facts = (latest.key(), latest.is_gone(), latest.has_failed(), latest.milliseconds());
            (subject, facts, latest.outputs().to_vec(), reads.collect::<Vec<_>>(), latest.kind().to_owned())
        };
        journal.latest_records().map(of).collect::<Vec<_>>()
    };
    assert_eq!(latest_records(&with).len(), 624);
    assert_eq!(latest_records(&with), latest_records(&without));
}

#[test]
fn an_index_that_is_damaged_or_of_another_journal_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    indexed(&path);
    let (journal, index) = (fs::read(&path).unwrap(), fs::read(index_of(&path)).unwrap());
    let expected = said(&Journal::read(&path).unwrap());
    let opened = |what: &str| {
        let opened = Journal::read(&path).unwrap();
        assert_eq!(opened.indexed, 0, "{what}");
        said(&opened)
    };
    for at in (0..index.len()).step_by(index.len() / 97) {
        let mut damaged = index.clone();
        damaged[at] ^= 1;
        fs::write(index_of(&path), &damaged).unwrap();
        assert_eq!(opened("damaged"), expected);
        fs::write(index_of(&path), &index[..at]).unwrap();
        assert_eq!(opened("cut"), expected);
    }
    fs::write(index_of(&path), &index).unwrap();
    fs::write(&path, &journal[..journal.len() / 2]).unwrap();
    opened("the journal is shorter");
    fs::remove_file(&path).unwrap();
    indexed(&path);
    fs::write(index_of(&path), &index).unwrap();
    assert_eq!(opened("of a journal with the same lines that was written at another time"), expected);
}

/// A forged index with a correct check, whose numbers lead anywhere, or whose texts are not texts.
#[test]
fn a_forged_index_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    indexed(&path);
    let index = fs::read(index_of(&path)).unwrap();
    let body = &index[..index.len() - 32];
    let mut used = 0;
    // Each number of the header, and some of the rest.
    let places = (0..104).step_by(4).chain((104..body.len()).step_by(1012));
    for at in places {
        let mut forged = body.to_vec();
        let end = forged.len().min(at + 4);
        forged[at..end].fill(0xff);
        let check = Digest::of(&forged);
        forged.extend_from_slice(&check.0);
        fs::write(index_of(&path), &forged).unwrap();
        // Whatever it contains, queries are safe.
        let opened = Journal::read(&path).unwrap();
        used += usize::from(opened.indexed > 0);
        said(&opened);
        opened.latest_records().for_each(|(_, latest)| _ = (latest.outputs().len(), latest.reads().count()));
    }
    assert!(used > 0, "digests can be any");
}

#[test]
fn a_saved_journal_is_read_again_if_the_file_was_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let changes: [(&str, &dyn Fn()); 5] = [
        ("written anew", &|| open(&path, None).unwrap().compact(|_| true).unwrap()),
        ("deleted", &|| fs::remove_file(&path).unwrap()),
        ("deleted and made again", &|| {
            fs::remove_file(&path).unwrap();
            drop(journal(&path));
            drop(journal(&path));
        }),
        ("cut", &|| fs::write(&path, &fs::read(&path).unwrap()[..100]).unwrap()),
        ("an older copy that went another way", &|| {
            let text = fs::read(&path).unwrap();
            fs::write(&path, &text[..text.len() - 200]).unwrap();
            let other = open(&path, None).unwrap();
            (0..20).for_each(|n| other.append(&[Line::new(Tag::Item, 50, Some(&n))]).unwrap());
        }),
    ];
    for (what, change) in changes {
        let _ = fs::remove_file(&path);
        let saved = journal(&path).close();
        let saved = open(&path, saved).unwrap().close();
        change();
        let ours = open(&path, saved).unwrap();
        let fresh = Journal::read(&path).unwrap();
        assert_eq!(ours.text.length(), fresh.text.length(), "{what}");
        assert_eq!(ours.text.head(), fresh.text.head(), "{what}");
        assert_eq!(said(&ours), said(&fresh), "{what}");
    }
}
