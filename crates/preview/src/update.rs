//! The messages of the program to the preview's window.

use crate::{Aim, Catalog, MaterialForm, Scene, Subject, SubjectRequest};

/// An export of a subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Export {
    /// The export's name in the inspector: `export-shrm, ktx2`.
    pub name: String,
    /// The total size of the export's files.
    pub bytes: u64,
}

/// The facts that the inspector shows of a subject beside its scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SubjectDetails {
    /// The subject's exports, in the manifest's order.
    pub exports: Vec<Export>,
    /// Further lines: warnings of stages, the origin of a part.
    pub notes: Vec<String>,
}

/// A message to the window.
#[derive(Debug)]
pub enum PreviewUpdate {
    /// The subjects that can be shown. If the catalog lacks the wanted one, the window requests the nearest
    /// one instead, and returns when a later catalog has it.
    Catalog(Catalog),
    /// Chooses these parts of the subject, as if the user had chosen them in the lists, when the next catalog
    /// arrives; the other parts stay.
    Choose(SubjectRequest),
    /// The scene of the requested subject, new or rebuilt. Scenes of other subjects are ignored.
    Scene {
        /// The subject that the scene shows.
        subject: Subject,
        /// The scene of the subject.
        scene: Scene,
        /// The subject's details in the inspector.
        details: SubjectDetails,
    },
    /// The parameters in the file of a material, or why it cannot be edited. It is sent with the first scene
    /// of a material, and whenever the file has changed.
    Material {
        /// The material's name in the catalog.
        material: String,
        /// The values in the file.
        form: Result<MaterialForm, String>,
        /// The unsaved values that a window before this one had.
        edited: Option<MaterialForm>,
    },
    /// A material was to be saved.
    MaterialSaved {
        /// The material's name in the catalog.
        material: String,
        /// Whether the material's file was written; if not, a toast says why.
        saved: bool,
    },
    /// How the light that the window has turned would be written to the manifest, for the user to agree to.
    LightEdit {
        /// The turn of the light in the window.
        turn: Aim,
        /// The headline, a question, and what changes.
        lines: Vec<String>,
    },
    /// The manifest has this turn of the window's light, and the light of the next scene is turned by it.
    LightSaved(Aim),
    /// The status line.
    Status(String),
    /// A message in a corner for a few seconds: `rebuilt in 0.8 s` and what reran.
    Toast {
        /// The headline.
        title: String,
        /// The details.
        lines: Vec<String>,
    },
    /// A headline and details of a failure, in a panel over the picture; `None` removes it.
    Failure(Option<Vec<String>>),
    /// Closes the window.
    Close,
}
