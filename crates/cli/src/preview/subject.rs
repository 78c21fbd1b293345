//! What is shown, by the names that people type.

use std::path::Path;

use ::preview::Mode;
use ::preview::{Subject, SubjectRequest};
use engine::nearest;
use stages::{CatalogEntry, PreviewCatalog, Unknown};

/// The parts of a subject.
const PARTS: [&str; 3] = ["environment", "material", "mesh"];

/// `environment=sky,material=gold,mesh=sphere`, any of them in any order. A name may hold commas.
pub(crate) fn parse_item(text: &str) -> Result<SubjectRequest, String> {
    let mut parts = Vec::<(&str, String)>::new();
    for piece in text.split(',') {
        match (piece.split_once('='), parts.last_mut()) {
            (Some((part, name)), _) if PARTS.contains(&part.trim()) => {
                parts.push((part.trim(), name.trim().to_owned()));
            }
            (Some((part, _)), _) => {
                return Err(match nearest(part.trim(), PARTS) {
                    Some(near) => format!("there is no part {:?}; did you mean {near:?}?", part.trim()),
                    None => format!("there is no part {:?}, only {}", part.trim(), PARTS.join(", ")),
                });
            }
            (None, Some((_, name))) => *name = format!("{name},{piece}"),
            (None, None) => return Err("expected environment=NAME, material=NAME or mesh=NAME".into()),
        }
    }
    let mut wish = SubjectRequest::default();
    for (part, name) in parts {
        if name.is_empty() {
            return Err(format!("{part} has no name"));
        }
        let place = match part {
            "environment" => &mut wish.environment,
            "material" => &mut wish.material,
            _ => &mut wish.mesh,
        };
        if place.replace(name).is_some() {
            return Err(format!("{part} is named twice"));
        }
    }
    Ok(wish)
}

/// A mode by its name.
pub(crate) fn parse_mode(text: &str) -> Result<Mode, String> {
    let names = || Mode::ALL.iter().map(|mode| mode.name());
    Mode::from_name(text).ok_or_else(|| match nearest(text, names()) {
        Some(near) => format!("there is no such mode; did you mean {near:?}?"),
        None => format!("there is no such mode, only {}", names().collect::<Vec<_>>().join(", ")),
    })
}

/// Why something cannot be shown, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SubjectError {
    pub(crate) message: String,
    pub(crate) help: String,
}

impl SubjectError {
    /// The lines for a panel.
    pub(crate) fn lines(self) -> Vec<String> {
        vec![self.message, format!("hint: {}", self.help)]
    }
}

impl From<Unknown> for SubjectError {
    fn from(Unknown { what, name, known }: Unknown) -> Self {
        let help = match nearest(&name, known.iter().map(String::as_str)) {
            Some(near) => format!("did you mean {near:?}?"),
            None => format!("there is {}", listed(&known)),
        };
        Self { message: format!("there is no {what} {name:?} to preview"), help }
    }
}

/// So many names are told.
const TOLD: usize = 12;

fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(TOLD);
    let told = names.iter().take(TOLD).map(String::as_str).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{told} and {more} more") } else { told }
}

/// Whether everything that is wished for is there, and goes together.
pub(crate) fn check(showcase: &PreviewCatalog, wish: &SubjectRequest) -> Result<(), SubjectError> {
    if let Some(mesh) = &wish.mesh {
        showcase.check_mesh(mesh)?;
    }
    match (&wish.environment, &wish.material) {
        (Some(environment), Some(material)) => exhibit(showcase, environment, material).map(|_| ()),
        (Some(environment), None) => Ok(showcase.check_environment(environment)?),
        (None, Some(material)) => Ok(showcase.check_material(material)?),
        (None, None) => Ok(()),
    }
}

/// A material under an environment.
pub(crate) fn exhibit<'s>(
    showcase: &'s PreviewCatalog,
    environment: &str,
    material: &str,
) -> Result<&'s CatalogEntry, SubjectError> {
    showcase.entry(environment, material)?.ok_or_else(|| {
        let others = showcase.materials().iter();
        let others = others.filter(|other| matches!(showcase.entry(environment, other), Ok(Some(_))));
        let others = others.cloned().collect::<Vec<_>>();
        SubjectError {
            message: format!("no stage reflects {environment} off {material}"),
            help: format!("{environment} is reflected off {}", listed(&others)),
        }
    })
}

/// Why nothing can be shown at all, of these stages or, where none are named, of all.
pub(crate) fn nothing(manifest: &Path, stages: &[String]) -> SubjectError {
    let none = match stages {
        [] => "no stage of it reflects an environment".into(),
        stages => format!("{} and what that needs reflect no environment", stages.join(", ")),
    };
    SubjectError {
        message: format!("{} has nothing to preview: {none}", manifest.display()),
        help: "a stage of the kind convolve makes a reflection of lighting and a material; `specula init` writes a manifest with one".into(),
    }
}

/// A wish for all of a subject.
pub(crate) fn wish(subject: &Subject) -> SubjectRequest {
    let Subject { environment, material, mesh } = subject.clone();
    SubjectRequest { environment: Some(environment), material: Some(material), mesh: Some(mesh), mode: None }
}

/// `gold under sky on sphere`
pub(crate) fn told(subject: &Subject) -> String {
    let Subject { environment, material, mesh } = subject;
    format!("{material} under {environment} on {mesh}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_is_parts_with_names_that_may_hold_commas() {
        let some = |name: &str| Some(name.to_owned());
        let wish = parse_item("material=gold, warm (shine),environment=sky").unwrap();
        let expected = SubjectRequest {
            environment: some("sky"),
            material: some("gold, warm (shine)"),
            ..SubjectRequest::default()
        };
        assert_eq!(wish, expected);
        assert_eq!(
            parse_item("mesh=sphere").unwrap(),
            SubjectRequest { mesh: some("sphere"), ..SubjectRequest::default() }
        );
        for (text, word) in [
            ("", "expected environment=NAME"),
            ("sky", "expected environment=NAME"),
            ("enviroment=sky", "did you mean \"environment\"?"),
            ("mesh=a,colour=b", "only environment, material, mesh"),
            ("mesh=", "mesh has no name"),
            ("mesh=a,mesh=b", "mesh is named twice"),
        ] {
            let message = parse_item(text).unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
    }

    #[test]
    fn every_mode_is_known_by_its_name_and_a_near_one_is_offered() {
        for mode in Mode::ALL {
            assert_eq!(parse_mode(mode.name()), Ok(mode));
        }
        assert_eq!(parse_mode("cabrel").unwrap_err(), "there is no such mode; did you mean \"cabral\"?");
        assert!(parse_mode("x-ray-vision").unwrap_err().contains("only local-shrm, global-shrm"));
    }
}
