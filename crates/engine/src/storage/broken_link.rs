//! Links that cannot be followed.

use std::path::{Path, PathBuf};
use std::{fmt, io};

use super::files::MAX_LINKS;
use crate::platform::path_text;

/// A link that leads to nothing, or to what cannot be looked at now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokenLink {
    /// The link.
    pub path: PathBuf,
    /// The path in it.
    pub target: PathBuf,
    /// Why it cannot be followed.
    pub why: io::ErrorKind,
}

impl BrokenLink {
    /// The first link on the way to a path that cannot be followed.
    pub(crate) fn on_the_way_to(path: &Path) -> Option<Self> {
        let mut above = path.ancestors().collect::<Vec<_>>();
        above.reverse();
        above.into_iter().find_map(Self::at)
    }

    /// The last link of the chain that begins at a path, if it leads nowhere.
    fn at(path: &Path) -> Option<Self> {
        let is_link = |path: &Path| std::fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink());
        let why = std::fs::metadata(path).err().filter(|_| is_link(path))?.kind();
        let mut path = path.to_path_buf();
        for _ in 0..MAX_LINKS {
            let target = std::fs::read_link(&path).ok()?;
            let next = path.parent()?.join(&target);
            if !is_link(&next) {
                return Some(Self { path, target, why });
            }
            path = next;
        }
        let target = std::fs::read_link(&path).ok()?;
        Some(Self { path, target, why })
    }
}

impl fmt::Display for BrokenLink {
    /// `env/a.hdr is a link to ../store/a.hdr, which does not exist`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is a link to {}, which ", path_text(&self.path), path_text(&self.target))?;
        match self.why {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => f.write_str("does not exist"),
            why => write!(f, "cannot be followed: {why}"),
        }
    }
}
