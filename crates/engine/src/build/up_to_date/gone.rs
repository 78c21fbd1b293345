//! The items that a manifest no longer has.
//!
//! Their files are removed. So an item is gone only if its source can be seen not to exist: a drive that is
//! not mounted, or a folder that cannot be looked at, is an error of the build, which then changes nothing.

use std::collections::HashSet;
use std::path::Path;
use std::{fs, io};

use super::UpToDateCheck;
use crate::error::{Error, ErrorKind};
use crate::plan::listed;
use crate::platform::path_text;
use crate::storage::{BrokenLink, LatestRecord, Line, Record, Subject, Tag};
use crate::{parallel, platform};

impl UpToDateCheck<'_> {
    /// Marks the records of items that the manifest no longer has.
    ///
    /// # Errors
    /// If it is not certain that a source does not exist any more, or the journal cannot be written.
    pub(crate) fn mark_gone(&self) -> Result<(), Error> {
        let gone = self.gone();
        self.check_gone(&gone)?;
        let lines = gone
            .into_iter()
            .map(|(subject, record)| Line::new(Tag::Item, subject, Some(&Record { gone: true, ..record })));
        self.state.journal.append(&lines.collect::<Vec<_>>())
    }

    /// Checks that the sources of items that the manifest no longer has do not exist any more.
    ///
    /// # Errors
    /// If that is not certain.
    pub(crate) fn check_seen(&self) -> Result<(), Error> {
        self.check_gone(&self.gone())
    }

    fn check_gone(&self, gone: &[(Subject, Record)]) -> Result<(), Error> {
        let unseen = gone.iter().filter_map(|(_, record)| {
            let source = record.source.as_ref()?;
            Some((source, self.why_unseen(record, &self.folder.join(source))?))
        });
        let unseen = unseen.collect::<Vec<_>>();
        let Some((_, why)) = unseen.first() else { return Ok(()) };
        let names = listed(unseen.iter().map(|(source, _)| source));
        let message = match unseen.len() {
            1 => format!("the source {names} cannot be read, and may still exist"),
            count => format!("{count} sources cannot be read, and may still exist: {names}"),
        };
        let folder = path_text(Path::new(unseen[0].0).parent().unwrap_or(Path::new("")));
        let error = Error::new(ErrorKind::Io, message).because(why.clone());
        Err(error.with_help(format!(
            "nothing was built or removed; if they are gone for good, exclude them: source = [\"...\", \
             \"!{folder}\"]"
        )))
    }

    /// The records of items that the manifest no longer has, and that are not marked yet.
    fn gone(&self) -> Vec<(Subject, Record)> {
        let journal = &self.state.journal;
        let is_ours = |latest: &LatestRecord<'_>| !latest.is_gone() && latest.manifest() == self.manifest;
        if self.known.is_some() {
            return Vec::new();
        }
        let ours = journal.latest_records().filter(|(_, latest)| is_ours(latest));
        if ours.count() == self.latest.iter().flatten().filter(|latest| is_ours(latest)).count() {
            return Vec::new();
        }
        let here = parallel::map(self.plan.items.len(), &|item| self.subject(item));
        let here = here.into_iter().collect::<HashSet<_>>();
        let ours =
            journal.latest_records().filter(|(subject, latest)| is_ours(latest) && !here.contains(subject));
        ours.filter_map(|(subject, _)| Some((subject, journal.get::<Record>(Tag::Item, subject)?))).collect()
    }

    /// Why it is not certain that the source of an item does not exist; `None` if it is, or if the stage
    /// would not read it now.
    fn why_unseen(&self, record: &Record, source: &Path) -> Option<String> {
        let stage = self.plan.stages.iter().find(|stage| stage.name == record.item.stage)?;
        stage.source.as_ref().filter(|wanted| wanted.concerns(source))?;
        if let Some(link) = BrokenLink::on_the_way_to(source) {
            return Some(link.to_string());
        }
        let error = fs::symlink_metadata(source).err()?;
        if !matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) {
            return Some(format!("cannot look at {}: {error}", path_text(source)));
        }
        // Some systems remove the folder when the drive goes, so what is above it counts.
        let before = record.mount.as_deref()?;
        let above = source.ancestors().find(|above| above.exists())?;
        let [now, folder] = platform::mount_points([above, self.folder])?;
        let is_ours = before == ".";
        let before = if is_ours { folder } else { self.folder.join(before) };
        (now != before).then(|| match is_ours {
            true => format!("another drive is now mounted on {}", path_text(now)),
            false => format!("nothing is mounted on {} any more", path_text(before)),
        })
    }
}
