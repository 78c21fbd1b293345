//! What a journal keeps, whatever becomes of its file.

use super::*;

/// Opens a journal as a build does.
fn open(path: &Path, kept: Option<Journal>) -> Result<Journal, Error> {
    Journal::write(path, kept, |journal| Retention::of(journal, Path::new("")))
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
fn the_last_line_holds_and_of_results_the_last_eight() {
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
fn half_a_line_that_cannot_be_taken_back_does_not_swallow_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let journal = journal(&path);
    let mut end = journal.end.as_ref().unwrap().lock().unwrap();
    end.file.write_all(b"0123456789abcdef i half").unwrap();
    end.torn = true;
    drop(end);
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
    assert!(open(&path, None).unwrap().latest.is_empty());
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
fn a_kept_journal_is_taken_up_with_what_others_appended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let mut kept = Some(journal(&path).rest());
    for n in 100..110_u32 {
        let other = open(&path, None).unwrap();
        other.append(&[Line::new(Tag::Stamp, n.into(), Some(&n))]).unwrap();
        // Only what was appended is read: what is known is not looked at again.
        let mut known = kept.take().unwrap();
        let before = known.text.len();
        assert!(known.text.recent().1.is_empty(), "the text is not kept");
        assert!(known.take_up().unwrap());
        let length = fs::metadata(&path).unwrap().len() as usize;
        assert_eq!(known.text.recent().0, before);
        assert_eq!(known.text.len(), length);
        let ours = open(&path, Some(known)).unwrap();
        assert_eq!(ours.get::<u32>(Tag::Stamp, n.into()), Some(n));
        assert_eq!(ours.get::<String>(Tag::Item, 2).unwrap(), "two");
        ours.append(&[Line::new(Tag::Item, 2, Some(&"two"))]).unwrap();
        kept = Some(ours.rest());
    }
}

#[test]
fn what_is_known_stays_known_until_a_later_line_and_nothing_else_stays_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("journal");
    let ours = open(&path, Some(journal(&path).rest())).unwrap();
    let known = |journal: &Journal| journal.known::<String>(Tag::Item, 2).unwrap();
    let first = known(&ours);
    let mut ours = open(&path, Some(ours.rest())).unwrap();
    assert!(Arc::ptr_eq(&first, &known(&ours)));
    ours.compact(|_| true).unwrap();
    assert!(ours.text.recent().1.is_empty());
    assert!(Arc::ptr_eq(&first, &known(&ours)));
    assert_eq!(ours.known::<u32>(Tag::Item, 2), None, "it is no number");
    assert_eq!(ours.get::<String>(Tag::Item, 1).unwrap(), "uno");
    assert_eq!(ours.results::<u32>(7).collect::<Vec<_>>(), [9, 8, 7, 6, 5, 4, 3, 2]);
    ours.append(&[Line::new(Tag::Item, 2, Some(&"due"))]).unwrap();
    let ours = open(&path, Some(ours.rest())).unwrap();
    assert_eq!(*known(&ours), "due");
    assert_eq!(ours.lines, Journal::read(&path).unwrap().lines);
}

#[test]
fn a_kept_journal_is_read_anew_where_the_file_is_another() {
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
        let kept = journal(&path).rest();
        let kept = open(&path, Some(kept)).unwrap().rest();
        change();
        let ours = open(&path, Some(kept)).unwrap();
        let fresh = Journal::read(&path).unwrap();
        assert_eq!(ours.text.len(), fresh.text.len(), "{what}");
        assert_eq!(ours.text.head(), fresh.text.head(), "{what}");
        assert_eq!(ours.latest.len(), fresh.latest.len(), "{what}");
    }
}
