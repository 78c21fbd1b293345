//! What is on disk: files and what was read of them, stored results, the journal, and the lock of the
//! state's folder.

mod broken_link;
mod disk;
mod files;
mod journal;
mod lock;
mod memory;
mod programs;
mod reader;
mod record;
pub(crate) mod regular;
mod state;
mod store;
pub(crate) mod writers;

pub use broken_link::BrokenLink;
pub(crate) use disk::{Disk, ReadSet, stamp_subject};
pub use files::{Files, OpenFile, Read, ReadKind};
pub(crate) use files::{
    MAX_LINKS, PROBE_PREFIX, digest_now, is_probe, leads_to, lies_in, list, listing_digest, look_up,
    modified, normal, path_name, slashed,
};
#[cfg(test)]
pub(crate) use journal::OTHERS;
pub(crate) use journal::{
    Journal, LatestRecord, Line, PublishedStamp, Retention, Subject, Tag, short, subject,
};
pub(crate) use lock::{Lock, LockRequest};
pub use lock::{LockPurpose, LockTimeout};
pub(crate) use memory::Memory;
pub(crate) use programs::SearchPath;
pub(crate) use reader::Reader;
pub use record::{Cause, FileRead, FromCache, InputUsed};
pub(crate) use record::{KeyHasher, Record, canonical, kind_name, recipe, worth_keeping};
pub(crate) use regular::{create_folders, hash, write_new};
pub use regular::{read_file, replace_file};
pub use state::prepare_state_folder;
pub(crate) use state::{FOLDER, State};
pub use store::Amount;
pub(crate) use store::{Blob, BlobFile, Presence, Store};
pub(crate) use writers::{being_written, open_for_writing};
