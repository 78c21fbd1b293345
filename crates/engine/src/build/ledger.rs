//! The ledger: the files that a manifest has published, as lines of the journal.
//!
//! Only files of the ledger are ever removed or replaced. A ledger may come from someone else: a line is
//! ignored if its file would not be inside `out`, or if its subject is not that of the file.
//!
//! A manifest that was renamed keeps its files. Its first build under the new name finds that the ledger has
//! no line of this manifest, but lines of one that no longer exists, about the same items or files, and takes
//! these over ([`Ledger::take_over`]).

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, Metadata};
use std::io;
use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::retention::Manifests;
use crate::event::ItemName;
use crate::key::Digest;
use crate::parallel;
use crate::plan::{ItemIndex, Plan, template};
use crate::platform::Stamp;
use crate::storage::{Journal, Line, PublishedStamp, Subject, Tag, hash, path_name, subject};

mod others;

pub(crate) use others::{Fate, Leftover, Others, is_inside};

/// A line of the ledger.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Published {
    pub(crate) manifest: String,
    /// The folder that files were published into, as records contain paths: after a change of `out` the
    /// manifest publishes into a new folder and leaves the old one alone.
    pub(crate) out: String,
    pub(crate) file: String,
    item: ItemName,
    pub(crate) digest: Digest,
    /// The file's stamp; `None` while the file is being renamed into place.
    pub(crate) stamp: Option<Stamp>,
    /// Whether every later change of the file shows in its stamp. Records of older versions do not say.
    #[serde(default)]
    pub(crate) settled: bool,
    /// The content that the manifest had published there before, while it is being replaced.
    pub(crate) replaces: Option<Digest>,
}

impl Published {
    /// Whether a build of this manifest can have written this record under a subject.
    fn is_of(&self, manifest: &str, out: &str, subject: Subject) -> bool {
        self.manifest == manifest && self.out == out && self.is_valid(subject)
    }

    /// Whether a build can have written this record under a subject: its file is inside `out`.
    fn is_valid(&self, subject: Subject) -> bool {
        subject_of(&self.manifest, &self.out, &self.file) == subject
            && template::check(&self.file, "out").is_ok()
    }

    /// Whether a file is as it was published.
    pub(crate) fn describes(&self, found: &Metadata, place: &Path) -> io::Result<bool> {
        Ok(self.content(found, place)?.is_some_and(|content| self.published(content)))
    }

    /// Whether this content was published, even if it is being replaced.
    pub(crate) fn published(&self, content: Digest) -> bool {
        content == self.digest || Some(content) == self.replaces
    }

    /// The digest of the file at the place of this one; a link or folder has none.
    pub(crate) fn content(&self, found: &Metadata, place: &Path) -> io::Result<Option<Digest>> {
        if !found.is_file() {
            Ok(None)
        } else if self.settled && self.stamp == Some(Stamp::of(found)) {
            Ok(Some(self.digest))
        } else {
            hash(place).map(Some)
        }
    }

    /// The line that removes this one.
    pub(crate) fn removal(&self) -> Line {
        Line::new::<()>(Tag::Published, subject_of(&self.manifest, &self.out, &self.file), None)
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
    /// All lines of files that no item of the plan exports under this manifest's name.
    others: OnceLock<OtherLines>,
    /// The lines that were taken over from manifests that no longer exist, by their files.
    taken_over: HashMap<String, Published>,
}

#[derive(Default)]
struct OtherLines {
    /// The lines of this manifest and its `out`.
    unwanted: Vec<Published>,
    others: Others,
    /// The plan's `out`, as [`Others`] contains paths.
    root: Option<String>,
}

impl<'a> Ledger<'a> {
    pub(crate) fn new(plan: &'a Plan, journal: &'a Journal) -> Self {
        Self {
            plan,
            journal,
            manifest: plan.manifest_name(),
            out: out_name(plan),
            wanted: OnceLock::new(),
            others: OnceLock::new(),
            taken_over: HashMap::new(),
        }
    }

    /// Prepares for questions about all files, before any item runs.
    pub(crate) fn prepare(&self) {
        let subjects = parallel::map(self.plan.items.len(), &|item| self.subjects(item));
        // Nobody has asked yet.
        let _ = self.wanted.set(sorted(subjects.into_iter()));
    }

    pub(crate) fn entry(&self, file: &str) -> Option<Published> {
        let subject = self.subject(file);
        let line = self.journal.get::<Published>(Tag::Published, subject);
        let line = line.filter(|line| line.is_of(&self.manifest, &self.out, subject));
        line.or_else(|| self.taken_over.get(file).cloned())
    }

    /// The line of a file, as far as every build needs it.
    pub(crate) fn stamp(&self, file: &str) -> Option<PublishedStamp> {
        self.journal.published(self.subject(file)).or_else(|| {
            let Published { digest, stamp, settled, .. } = self.taken_over.get(file)?;
            Some(PublishedStamp { digest: *digest, stamp: stamp.filter(|_| *settled) })
        })
    }

    /// The published files that no item of the plan exports, sorted, by the item that did.
    pub(crate) fn unwanted(&self) -> BTreeMap<ItemName, Vec<String>> {
        let taken_over = self.taken_over.values().filter(|line| !self.is_wanted(&line.file));
        let mut files = BTreeMap::<_, Vec<_>>::new();
        for line in self.other_lines().unwanted.iter().chain(taken_over) {
            files.entry(line.item.clone()).or_default().push(line.file.clone());
        }
        files.values_mut().for_each(|files| files.sort_unstable());
        files
    }

    /// Whether an item of the plan exports a file.
    pub(crate) fn is_wanted(&self, file: &str) -> bool {
        self.wanted().binary_search(&self.subject(file)).is_ok()
    }

    /// The line of a file that another manifest exports.
    pub(crate) fn exported_by_another(&self, file: &str) -> Option<&Published> {
        let lines = self.other_lines();
        lines.others.exported(&self.path(file)?)
    }

    /// The lines of a file whose manifests no longer exist, or now export into another folder.
    pub(crate) fn abandoned(&self, file: &str) -> &[Published] {
        self.path(file).map_or(&[], |path| self.other_lines().others.abandoned(&path))
    }

    /// The abandoned files that no manifest exports any more; `within`, only those at the place of a file of
    /// `out`, or in a folder there.
    pub(crate) fn leftovers(&self, within: Option<&str>) -> Vec<Leftover<'_>> {
        let lines = self.other_lines();
        let is_left = |path: &str| {
            let file = lines.root.as_deref().and_then(|root| path.strip_prefix(root)?.strip_prefix('/'));
            let is_within = |place: &str| file.is_some_and(|file| is_at_or_below(file, place));
            within.is_none_or(is_within)
                && !file.is_some_and(|file| self.is_wanted(file) || self.entry(file).is_some())
        };
        lines.others.leftovers(&is_left)
    }

    /// Takes over the lines of a manifest that no longer exists, if this one is that manifest under a new
    /// name: nothing has been published under the new name yet, and both have an item or a file in common. A
    /// line stays as it is if the plan exports the file and somebody has changed it. Returns what has to be
    /// recorded.
    pub(crate) fn take_over(&mut self) -> Vec<Line> {
        let lines = self.renamed();
        let mut records = Vec::new();
        for line in lines {
            let place = self.plan.out.join(&line.file);
            let is_unchanged = || {
                let found = fs::symlink_metadata(&place);
                found.is_ok_and(|found| line.describes(&found, &place).unwrap_or(false))
            };
            if self.taken_over.contains_key(&line.file) || self.is_wanted(&line.file) && !is_unchanged() {
                continue;
            }
            let own = Published { manifest: self.manifest.clone(), ..line.clone() };
            records.extend([self.write(&line.file, own.clone()), line.removal()]);
            self.taken_over.insert(line.file, own);
        }
        if let Some(lines) = self.others.get_mut() {
            let is_taken =
                |line: &Published| line.out == self.out && self.taken_over.contains_key(&line.file);
            lines.others.retain_abandoned(|line| !is_taken(line));
        }
        records
    }

    /// The lines of manifests that no longer exist, if this manifest is one of them under a new name.
    fn renamed(&self) -> Vec<Published> {
        let lines = self.other_lines();
        let mut manifests = Manifests::new(self.folder(), Some(&self.manifest));
        let mut renamed = BTreeMap::<&str, Vec<&Published>>::new();
        for line in lines.others.all_abandoned().filter(|line| line.out == self.out) {
            if !manifests.has(&line.manifest) {
                renamed.entry(&line.manifest).or_default().push(line);
            }
        }
        let is_new = || {
            lines.unwanted.is_empty()
                && self.wanted().iter().all(|line| self.journal.published(*line).is_none())
        };
        if renamed.is_empty() || !is_new() {
            return Vec::new();
        }
        let items = (0..self.plan.items.len()).map(|item| self.plan.item_name(item)).collect::<HashSet<_>>();
        let is_similar = |line: &&Published| items.contains(&line.item) || self.is_wanted(&line.file);
        renamed.retain(|_, lines| lines.iter().any(is_similar));
        renamed.into_values().flatten().cloned().collect()
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

    /// The folder of the manifests that share the journal.
    fn folder(&self) -> &'a Path {
        self.plan.manifest.parent().unwrap_or(Path::new("."))
    }

    /// A file of `out`, as [`Others`] contains paths.
    fn path(&self, file: &str) -> Option<String> {
        self.other_lines().root.as_ref().map(|root| format!("{root}/{file}"))
    }

    fn other_lines(&self) -> &OtherLines {
        self.others.get_or_init(|| {
            let wanted = self.wanted();
            let subjects =
                self.journal.subjects(Tag::Published).filter(|line| wanted.binary_search(line).is_err());
            let lines = self.journal.contents_of(Tag::Published, &subjects.collect::<Vec<_>>());
            let is_own =
                |(subject, line): &(Subject, Published)| line.is_of(&self.manifest, &self.out, *subject);
            let (own, others): (Vec<_>, Vec<_>) = lines.into_iter().partition(is_own);
            let others = Others::of(others, self.folder(), Some(&self.manifest));
            let unwanted = own.into_iter().map(|(_, line)| line).collect();
            OtherLines { unwanted, root: others.root(&self.out), others }
        })
    }

    fn wanted(&self) -> &[Subject] {
        // One by one: a thread of rayon's that waits for others may begin another item meanwhile, which would
        // wait for this value for ever.
        self.wanted.get_or_init(|| sorted((0..self.plan.items.len()).map(|item| self.subjects(item))))
    }

    /// The subjects of the files that an item exports.
    fn subjects(&self, item: ItemIndex) -> Vec<Subject> {
        self.plan.items[item].files.iter().map(|file| self.subject(file)).collect()
    }
}

fn sorted(subjects: impl Iterator<Item = Vec<Subject>>) -> Vec<Subject> {
    let mut subjects = subjects.flatten().collect::<Vec<_>>();
    subjects.sort_unstable();
    subjects
}

/// The folder that a plan publishes into, as records contain paths.
pub(crate) fn out_name(plan: &Plan) -> String {
    path_name(plan.manifest.parent().unwrap_or(Path::new(".")), &plan.out)
}

fn subject_of(manifest: &str, out: &str, file: &str) -> Subject {
    subject(&[manifest, out, file])
}

fn is_at_or_below(file: &str, place: &str) -> bool {
    file.strip_prefix(place).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}
