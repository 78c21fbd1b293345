//! The text of a page: its data as JSON, and the HTML around them.

use containers::{escape_html, recipe_element};
use preview::web::{self, WebProgram};
use serde::Serialize;

use crate::Form;
use crate::blobs::{BaseColorEntry, Blobs, ProgramEntry, ViewEntry};
use crate::mesh_entry::MeshEntry;

/// Everything that a page shows.
#[derive(Debug, Default, Serialize)]
pub struct Document {
    /// The version of these data.
    schema: u32,
    title: String,
    /// The environments.
    pub environments: Vec<EnvironmentEntry>,
    /// What the background reads, of each environment.
    pub skies: Vec<ViewEntry>,
    /// The names of the materials.
    pub materials: Vec<String>,
    /// The meshes.
    pub meshes: Vec<MeshEntry>,
    modes: Vec<ModeEntry>,
    /// Draws the depth of meshes alone, so that nothing is shaded that others hide.
    depth: ProgramEntry,
    difference: ProgramEntry,
    /// The materials under environments.
    pub pairs: Vec<PairEntry>,
    /// What the page is too small for.
    pub left_out: Vec<String>,
}

/// An environment.
#[derive(Debug, Serialize)]
pub struct EnvironmentEntry {
    /// Its name.
    pub name: String,
    /// The exposure that suits it, in stops.
    pub exposure: f64,
}

/// A form.
#[derive(Debug, Serialize)]
struct ModeEntry {
    name: &'static str,
    label: &'static str,
}

/// Within how many stops 95 % and 99 % of a sphere's pixels are.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FormError {
    /// Within how many stops 95 % are.
    pub p95: f64,
    /// Within how many stops 99 % are.
    pub p99: f64,
    /// What measured it.
    pub by: MeasuredBy,
}

/// What measured a form.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeasuredBy {
    /// A report, over all views.
    Report,
    /// The stage that made the page, in a picture of one view.
    Page,
}

/// A material under an environment, by their places.
#[derive(Debug, Serialize)]
pub struct PairEntry {
    environment: usize,
    material: usize,
    /// The texture of the material's base colour, for the parts of meshes that show it.
    pub base_color: Option<BaseColorEntry>,
    /// The forms that the page has of it.
    pub views: Vec<FormEntry>,
}

impl PairEntry {
    /// A pair without a view.
    pub fn new(environment: usize, material: usize) -> Self {
        Self { environment, material, base_color: None, views: Vec::new() }
    }

    /// The place of the material in the document.
    pub fn material(&self) -> usize {
        self.material
    }
}

/// A form of a pair.
#[derive(Debug, Serialize)]
pub struct FormEntry {
    mode: usize,
    #[serde(flatten)]
    view: ViewEntry,
    /// The bytes of the exported files.
    pub bytes: Option<u64>,
    /// How far it is from brute force.
    pub error: Option<FormError>,
    /// The texels of maps that a pixel reads, and the lights that it adds.
    fetches: usize,
    lights: usize,
    /// What a reader ought to know.
    pub note: String,
}

impl FormEntry {
    /// The form at a place of the document's list ([`Document::form`]), and what it is drawn with.
    pub fn new(form: usize, view: ViewEntry, cost: web::Cost) -> Self {
        let web::Cost { fetches, lights } = cost;
        Self { mode: form, view, bytes: None, error: None, fetches, lights, note: String::new() }
    }
}

impl Document {
    /// A page with the shaders that every page has.
    pub fn new(title: &str, blobs: &mut Blobs) -> Self {
        Self {
            schema: 1,
            title: title.to_owned(),
            depth: blobs.program(WebProgram::depth()),
            difference: blobs.program(WebProgram::difference()),
            ..Self::default()
        }
    }

    /// A page that shows what a server sends, in any form. Its other lists are empty at first.
    pub(crate) fn live(title: &str, blobs: &mut Blobs) -> Self {
        let mut document = Self::new(title, blobs);
        for form in Form::ALL {
            document.form(form);
        }
        document
    }

    /// The place of a material, which is added if it is new.
    pub fn material(&mut self, name: &str) -> usize {
        self.materials.iter().position(|known| known == name).unwrap_or_else(|| {
            self.materials.push(name.to_owned());
            self.materials.len() - 1
        })
    }

    /// The place of a form, which is added if it is new.
    pub fn form(&mut self, form: Form) -> usize {
        let name = form.mode().name();
        self.modes.iter().position(|known| known.name == name).unwrap_or_else(|| {
            self.modes.push(ModeEntry { name, label: form.label() });
            self.modes.len() - 1
        })
    }

    /// The whole page in one file. `recipe` says what it was made from, and `pictures` are figures of HTML
    /// for browsers that cannot draw it.
    ///
    /// # Errors
    /// If a number of the document is not finite.
    pub fn file(&self, blobs: &Blobs, recipe: &str, pictures: &str) -> serde_json::Result<String> {
        // The page is as safe as its own text: nothing but it is loaded.
        let policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
                      script-src 'unsafe-inline'";
        Ok(filled(&[
            ("POLICY", format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">")),
            ("TITLE", escape_html(&self.title)),
            ("RECIPE", recipe_element(recipe)),
            ("STYLE", format!("<style>\n{STYLE}</style>")),
            ("SCRIPT", format!("<script>\n{}</script>", script(&[include_str!("file.js")]))),
            ("FALLBACK", pictures.to_owned()),
            ("DATA", self.json()?),
            ("BLOBS", blobs.elements()),
        ]))
    }

    /// The page that a server sends, with files beside it: [`STYLE`] and [`served_script`].
    ///
    /// # Errors
    /// If a number of the document is not finite.
    pub(crate) fn served(&self) -> serde_json::Result<String> {
        Ok(filled(&[
            ("POLICY", String::new()),
            ("TITLE", escape_html(&self.title)),
            ("RECIPE", String::new()),
            ("STYLE", "<link rel=\"stylesheet\" href=\"page.css\">".to_owned()),
            ("SCRIPT", "<script src=\"page.js\"></script>".to_owned()),
            ("FALLBACK", String::new()),
            ("DATA", self.json()?),
            ("BLOBS", String::new()),
        ]))
    }

    /// The data as JSON in which an escaped `<` cannot end the element that holds it.
    fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string(self)?.replace('<', "\\u003c"))
    }
}

/// The style of a page.
pub(crate) const STYLE: &str = include_str!("page.css");

/// The script of a page that a server sends.
pub(crate) fn served_script() -> String {
    script(&[include_str!("live.js"), include_str!("editor.js")])
}

/// The script of a page, with the parts that say where it has what it shows from.
fn script(source: &[&str]) -> String {
    let common = [
        include_str!("data.js"),
        include_str!("camera.js"),
        include_str!("renderer.js"),
        include_str!("interface.js"),
    ];
    [&common, source, &[include_str!("start.js")]].concat().concat()
}

/// The template with its parts.
fn filled(parts: &[(&str, String)]) -> String {
    let template = include_str!("page.html");
    let mut pieces = template.split("{{");
    let mut page = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, after) = piece.split_once("}}").unwrap_or((piece, ""));
        let part = parts.iter().find(|(known, _)| *known == name);
        page += part.map_or("", |(_, text)| text);
        page += after;
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_every_part_of_its_template() {
        let mut blobs = Blobs::default();
        let document = Document::new("a < b", &mut blobs);
        let file = document.file(&blobs, "{}", "<p>a picture</p>").unwrap();
        let served = Document::live("a < b", &mut blobs).served().unwrap();
        for page in [&file, &served] {
            assert!(!page.contains("{{") && page.contains("a &lt; b"));
        }
        assert!(file.contains("function sceneOf(") && !file.contains("EventSource"), "it has no server");
        for (part, is_in_file) in
            [("<style>", true), ("'use strict'", true), ("blob-0", true), ("page.js", false)]
        {
            assert_eq!([file.contains(part), served.contains(part)], [is_in_file, !is_in_file], "{part}");
        }
        assert!(file.contains("default-src 'none'") && file.contains("<p>a picture</p>"));
    }

    #[test]
    fn all_names_of_the_template_are_known() {
        let names =
            include_str!("page.html").split("{{").skip(1).map(|piece| piece.split_once("}}").unwrap().0);
        let known = ["BLOBS", "DATA", "FALLBACK", "POLICY", "RECIPE", "SCRIPT", "STYLE", "TITLE"];
        assert!(names.clone().all(|name| known.contains(&name)), "{:?}", names.collect::<Vec<_>>());
    }
}
