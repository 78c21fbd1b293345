//! What is shown, by the names that people type.

use std::path::Path;

use ::preview::{Subject, SubjectRequest};
use engine::{nearest, path_text};
use stages::{CatalogEntry, PreviewCatalog, Unknown};

use crate::exit::Exit;
use crate::lists::list;
use crate::print;

/// This many names of a list are suggested.
const SUGGESTED: usize = 12;

/// Why something cannot be shown, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SubjectError {
    pub(crate) message: String,
    pub(crate) help: String,
}

impl SubjectError {
    /// Prints the error, and returns the exit code of a request that cannot be fulfilled.
    pub(crate) fn print(self) -> Exit {
        print::error(&[self.message], Some(&self.help));
        Exit::Usage
    }

    /// The lines for a panel.
    pub(crate) fn lines(self) -> Vec<String> {
        vec![self.message, format!("hint: {}", self.help)]
    }
}

impl From<Unknown> for SubjectError {
    fn from(Unknown { what, name, known }: Unknown) -> Self {
        let help = match nearest(&name, known.iter().map(String::as_str)) {
            Some(near) => format!("did you mean {near:?}?"),
            None => format!("there is {}", list(&known, ", ", SUGGESTED)),
        };
        Self { message: format!("there is no {what} {name:?} to preview"), help }
    }
}

/// Checks that everything that is requested exists, and can be shown together.
pub(crate) fn check(catalog: &PreviewCatalog, request: &SubjectRequest) -> Result<(), SubjectError> {
    if let Some(mesh) = &request.mesh {
        catalog.check_mesh(mesh)?;
    }
    match (&request.environment, &request.material) {
        (Some(environment), Some(material)) => entry(catalog, environment, material).map(|_| ()),
        (Some(environment), None) => Ok(catalog.check_environment(environment)?),
        (None, Some(material)) => Ok(catalog.check_material(material)?),
        (None, None) => Ok(()),
    }
}

/// The catalog's entry of a material under an environment.
pub(crate) fn entry<'c>(
    catalog: &'c PreviewCatalog,
    environment: &str,
    material: &str,
) -> Result<&'c CatalogEntry, SubjectError> {
    catalog.entry(environment, material)?.ok_or_else(|| {
        let others = catalog.materials().iter();
        let others = others.filter(|other| matches!(catalog.entry(environment, other), Ok(Some(_))));
        let others = others.cloned().collect::<Vec<_>>();
        SubjectError {
            message: format!("no stage reflects {environment} off {material}"),
            help: format!("{environment} is reflected off {}", list(&others, ", ", SUGGESTED)),
        }
    })
}

/// The error if there is nothing to show: of these stages or, if none are named, of all.
pub(crate) fn nothing_to_preview(manifest: &Path, stages: &[String]) -> SubjectError {
    let reason = match stages {
        [] => "none of its stages reflects an environment".into(),
        stages => {
            format!("{} and the stages that they need do not reflect an environment", stages.join(", "))
        }
    };
    SubjectError {
        message: format!("{} has nothing to preview: {reason}", path_text(manifest)),
        help: "add a stage of the kind convolve, which combines lighting and a material; `specula init` \
               writes a manifest that has one"
            .into(),
    }
}

/// The request for all parts of a subject.
pub(crate) fn request(subject: &Subject) -> SubjectRequest {
    let Subject { environment, material, mesh } = subject.clone();
    SubjectRequest { environment: Some(environment), material: Some(material), mesh: Some(mesh), mode: None }
}

/// `gold under sky on sphere`
pub(crate) fn describe(subject: &Subject) -> String {
    let Subject { environment, material, mesh } = subject;
    format!("{material} under {environment} on {mesh}")
}
