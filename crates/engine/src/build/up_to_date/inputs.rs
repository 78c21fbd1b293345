//! What arrives at the ports of an item, and the key that it makes.

use super::UpToDateCheck;
use crate::build::arrivals::{Arrival, digest_of, exported_files};
use crate::key::Digest;
use crate::kinds::ExportedFiles;
use crate::plan::{ItemIndex, Stage};
use crate::storage::{Blob, InputUsed, KeyHasher};

/// The digest of an input that is not known.
const UNKNOWN: Digest = Digest([0; 32]);

impl UpToDateCheck<'_> {
    /// What arrives at an item, port by port.
    pub(crate) fn arrivals(&self, item: ItemIndex) -> impl Iterator<Item = Arrival<'_>> {
        let this = &self.plan.items[item];
        let files = &self.stages[this.stage].files_taken;
        let ports = self.plan.stages[this.stage].inputs.iter().zip(files).zip(&this.inputs);
        ports.flat_map(|(((port, _), file), items)| {
            items.iter().map(|from| Arrival { port, from: *from, file: *file })
        })
    }

    /// What arrives at an item and is read from the store; the sizes of files are known without them.
    pub(crate) fn stored_arrivals(&self, item: ItemIndex) -> impl Iterator<Item = Arrival<'_>> {
        let is_stored =
            |arrival: &Arrival<'_>| arrival.file.is_some() || self.plan.items[arrival.from].files.is_empty();
        self.arrivals(item).filter(is_stored)
    }

    /// The digest of what arrives of an item with these outputs: of its artifact, of a file, or of what
    /// [`ExportedFiles`] says of all its files. `None` if it has no outputs.
    pub(crate) fn arriving(&self, arrival: Arrival<'_>, outputs: &[Blob]) -> Option<Digest> {
        let stage = self.plan.items[arrival.from].stage;
        let Stage { kind, product, .. } = &self.plan.stages[stage];
        digest_of(product, arrival.file, kind.name(), &self.stages[stage].parameters, outputs)
    }

    /// The files that an item exported with these outputs, as a value and encoded.
    pub(crate) fn exported_files(&self, item: ItemIndex, outputs: &[Blob]) -> (ExportedFiles, Vec<u8>) {
        let stage = self.plan.items[item].stage;
        exported_files(self.plan.stages[stage].kind.name(), &self.stages[stage].parameters, outputs)
    }

    /// What arrives at the ports, given the outputs of each item.
    pub(crate) fn inputs<'o>(
        &self,
        item: ItemIndex,
        outputs: impl Fn(ItemIndex) -> &'o [Blob],
    ) -> Vec<InputUsed> {
        let used = |arrival: Arrival<'_>| InputUsed {
            port: arrival.port.into(),
            item: self.name(arrival.from),
            digest: self.arriving(arrival, outputs(arrival.from)).unwrap_or(UNKNOWN),
        };
        self.arrivals(item).map(used).collect()
    }

    /// Everything that an item's result depends on, except for the files that it reads.
    pub(crate) fn key<'o>(&self, item: ItemIndex, outputs: impl Fn(ItemIndex) -> &'o [Blob]) -> Digest {
        let this = &self.plan.items[item];
        let stage = &self.plan.stages[this.stage];
        let info = &self.stages[this.stage];
        let source = self.source(item);
        let mut hasher =
            KeyHasher::new(stage.kind.name(), info.revision, &info.parameters_text, source.as_deref());
        for (((port, _), file), items) in stage.inputs.iter().zip(&info.files_taken).zip(&this.inputs) {
            hasher.text(port).number(items.len() as u64);
            for &from in items {
                let made = &self.plan.items[from];
                let digest = self.arriving(Arrival { port, from, file: *file }, outputs(from));
                hasher.text(self.plan.stages[made.stage].product.type_name());
                hasher.digest(digest.unwrap_or(UNKNOWN));
                if info.shows_keys {
                    hasher.item_key(&made.key);
                }
            }
        }
        if info.shows_keys {
            hasher.item_key(&this.key);
        }
        if let Some(processor) = info.processor {
            hasher.text("processor").text(processor);
        }
        hasher.finish()
    }
}
