//! What a preview is to show from now on: what the program around it sends.

use crate::{Catalog, Scene, Subject};

/// An export of a subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Export {
    /// What it is, for people: `export-shrm, ktx2`.
    pub name: String,
    /// How large its files are together.
    pub bytes: u64,
}

/// What the inspector tells of a subject and cannot see in its scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SubjectDetails {
    /// What was exported of it, in the manifest's order.
    pub exports: Vec<Export>,
    /// What else is worth a line: warnings of stages, where a part of it was taken from.
    pub notes: Vec<String>,
}

/// What the window is told.
#[derive(Debug)]
pub enum PreviewUpdate {
    /// What can be shown from now on. Where what is wanted is not in it, the window asks for what is nearest to that, and goes
    /// back when it is there again.
    Catalog(Catalog),
    /// The scene of a subject: an answer to a request, or the same subject made anew. Of any other subject it is left out.
    Scene {
        /// Whose.
        subject: Subject,
        /// What is seen.
        scene: Scene,
        /// What the inspector tells of it.
        facts: SubjectDetails,
    },
    /// A line about what goes on.
    Status(String),
    /// What happened, in a corner for a few seconds: `rebuilt in 0.8 s` and what reran.
    Toast {
        /// What happened.
        title: String,
        /// The details.
        lines: Vec<String>,
    },
    /// What went wrong: a headline, then the details, in a panel over the picture until `None` takes it away.
    Failure(Option<Vec<String>>),
    /// The program ends.
    Close,
}
