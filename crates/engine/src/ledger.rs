//! The ledger: the files that a manifest has published, as lines of the journal.
//!
//! Only files of the ledger are ever removed or replaced. A ledger may come from someone else: a line is
//! ignored if its file would not be inside `out`, or if its subject is not that of the file.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::files::path_name;
use crate::journal::{Journal, Line, PublishedStamp, Subject, Tag, subject};
use crate::plan::template;
use crate::platform::Stamp;
use crate::{Digest, ItemName, Plan, parallel};

/// A line of the ledger.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Published {
    pub(crate) manifest: String,
    /// The folder that files were published into, as records contain paths: after a change of `out` the
    /// manifest publishes into a new folder and leaves the old one alone.
    out: String,
    pub(crate) file: String,
    item: ItemName,
    pub(crate) digest: Digest,
    /// `None` while it is being renamed into place.
    pub(crate) stamp: Option<Stamp>,
    /// Whether every later change of the file shows in its stamp. Records of older versions do not say.
    #[serde(default)]
    pub(crate) settled: bool,
    /// The content that the manifest had published there before, while it is being replaced.
    pub(crate) replaces: Option<Digest>,
}

impl Published {
    /// Whether a build of this manifest can have written this record under a subject: its file is inside
    /// `out`.
    fn is_of(&self, manifest: &str, out: &str, subject: Subject) -> bool {
        self.manifest == manifest
            && self.out == out
            && subject_of(manifest, out, &self.file) == subject
            && template::check(&self.file, "out").is_ok()
    }

    /// The content that the manifest has published there, even if someone has changed the file since; `None`
    /// if it was never put in place.
    pub(crate) fn owned(&self) -> Option<Digest> {
        if self.stamp.is_some() { Some(self.digest) } else { self.replaces }
    }
}

/// The lines of one manifest and its `out`.
pub(crate) struct Ledger<'a> {
    plan: &'a Plan,
    journal: &'a Journal,
    manifest: String,
    out: String,
    /// The subjects of the files that the plan's items export, sorted.
    wanted: OnceLock<Vec<Subject>>,
    /// The files in the same folder that other manifests have published.
    others: OnceLock<HashSet<String>>,
}

impl<'a> Ledger<'a> {
    pub(crate) fn new(plan: &'a Plan, journal: &'a Journal) -> Self {
        let (manifest, out) = (plan.manifest_name(), out_name(plan));
        Self { plan, journal, manifest, out, wanted: OnceLock::new(), others: OnceLock::new() }
    }

    /// The line of a file.
    pub(crate) fn entry(&self, file: &str) -> Option<Published> {
        let subject = self.subject(file);
        let line = self.journal.get::<Published>(Tag::Published, subject);
        line.filter(|line| line.is_of(&self.manifest, &self.out, subject))
    }

    /// The same, as far as every build needs it.
    pub(crate) fn stamp(&self, file: &str) -> Option<PublishedStamp> {
        self.journal.published(self.subject(file))
    }

    /// The published files that no item of the plan exports, sorted, by the item that did.
    pub(crate) fn unwanted(&self) -> BTreeMap<ItemName, Vec<String>> {
        let wanted = self.wanted();
        let unwanted =
            self.journal.subjects(Tag::Published).filter(|line| wanted.binary_search(line).is_err());
        let unwanted = unwanted.collect::<Vec<_>>();
        let mut files = BTreeMap::<_, Vec<_>>::new();
        for (subject, line) in self.journal.contents_of::<Published>(Tag::Published, &unwanted) {
            if line.is_of(&self.manifest, &self.out, subject) {
                files.entry(line.item).or_default().push(line.file);
            }
        }
        files.values_mut().for_each(|files| files.sort_unstable());
        files
    }

    /// Whether an item of the plan exports a file.
    pub(crate) fn is_wanted(&self, file: &str) -> bool {
        self.wanted().binary_search(&self.subject(file)).is_ok()
    }

    /// Whether another manifest has published a file of this name into the same folder.
    pub(crate) fn is_of_another_manifest(&self, file: &str) -> bool {
        let others = self.others.get_or_init(|| {
            let lines = self.journal.contents::<Published>(Tag::Published).into_iter().map(|(_, line)| line);
            let others = lines.filter(|line| line.out == self.out && line.manifest != self.manifest);
            others.map(|line| line.file).collect()
        });
        others.contains(file)
    }

    /// The line of a file that is about to be renamed into place.
    pub(crate) fn intent(
        &self,
        item: &ItemName,
        file: &str,
        digest: Digest,
        replaces: Option<Digest>,
    ) -> Line {
        self.write(file, Published { digest, replaces, ..self.blank(item, file) })
    }

    /// The line of a file that is in place; `settled` says whether every later change of it shows in its
    /// stamp.
    pub(crate) fn line(
        &self,
        item: &ItemName,
        file: &str,
        digest: Digest,
        stamp: Stamp,
        settled: bool,
    ) -> Line {
        self.write(file, Published { digest, stamp: Some(stamp), settled, ..self.blank(item, file) })
    }

    /// The line of a file that has been removed.
    pub(crate) fn removal(&self, file: &str) -> Line {
        Line::new::<()>(Tag::Published, self.subject(file), None)
    }

    /// The line that says whether temporary files may be left in `out` from now on.
    pub(crate) fn publishing(&self, begins: bool) -> Line {
        Line::new(Tag::Publishing, subject(&[&self.out]), begins.then_some(&self.out))
    }

    fn write(&self, file: &str, line: Published) -> Line {
        Line::new(Tag::Published, self.subject(file), Some(&line))
    }

    /// A line without content yet.
    fn blank(&self, item: &ItemName, file: &str) -> Published {
        Published {
            manifest: self.manifest.clone(),
            out: self.out.clone(),
            file: file.into(),
            item: item.clone(),
            digest: Digest([0; 32]),
            stamp: None,
            settled: false,
            replaces: None,
        }
    }

    fn subject(&self, file: &str) -> Subject {
        subject_of(&self.manifest, &self.out, file)
    }

    fn wanted(&self) -> &[Subject] {
        self.wanted.get_or_init(|| {
            let items = &self.plan.items;
            let subjects =
                |item: usize| items[item].files.iter().map(|file| self.subject(file)).collect::<Vec<_>>();
            let mut wanted = parallel::map(items.len(), &subjects).concat();
            wanted.sort_unstable();
            wanted
        })
    }
}

/// The folder that a plan publishes into, as records contain paths.
pub(crate) fn out_name(plan: &Plan) -> String {
    path_name(plan.manifest.parent().unwrap_or(Path::new(".")), &plan.out)
}

/// The subject of a file's line.
fn subject_of(manifest: &str, out: &str, file: &str) -> Subject {
    subject(&[manifest, out, file])
}
