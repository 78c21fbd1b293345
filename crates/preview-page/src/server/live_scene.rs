//! A scene as a page draws it: its mesh, its sky, and a view for each form, made when a page asks for it.

use std::sync::{Arc, OnceLock};

use parking_lot::Mutex;
use preview::{Export, Light, Look, RenderError, Scene, Subject, SubjectDetails, web::WebView};
use serde_json::json;
use sh::Stop;

use crate::blobs::{Blobs, ViewEntry};
use crate::document::{FormEntry, MeshEntry};
use crate::{Document, Form};

/// The most rows of a sky in the background.
const SKY_ROWS: usize = 512;

/// What a page draws of a scene.
#[derive(Debug)]
pub(super) struct LiveScene {
    pub(super) number: u64,
    subject: Subject,
    scene: Scene,
    details: SubjectDetails,
    /// The look with a reflection of low degree, of a material without maps.
    estimate: OnceLock<Result<Arc<Look>, RenderError>>,
}

/// The sky of the light that was shown last.
#[derive(Debug, Default)]
pub(super) struct KeptSky(Mutex<Option<(Arc<Light>, Arc<ViewEntry>)>>);

impl LiveScene {
    pub(super) fn new(number: u64, subject: Subject, scene: Scene, details: SubjectDetails) -> Self {
        Self { number, subject, scene, details, estimate: OnceLock::new() }
    }

    /// Returns a scene with another number, so that pages load all of it again.
    pub(super) fn renumbered(&self, number: u64) -> Self {
        Self::new(number, self.subject.clone(), self.scene.clone(), self.details.clone())
    }

    /// Whether a page can draw a form.
    fn shows(&self, form: Form) -> bool {
        self.scene.offers(form.mode()) || self.is_estimate(form)
    }

    /// Whether a form is estimated: an SHRM, if the material is known and nothing else shows it.
    fn is_estimate(&self, form: Form) -> bool {
        let shows_material = |form: &Form| form.shows_material() && self.scene.offers(form.mode());
        form == Form::Shrm
            && self.look().is_some_and(|look| look.material().is_some())
            && !Form::ALL.iter().any(shows_material)
    }

    /// The look of the mesh. Of several materials, a page draws the first.
    fn look(&self) -> Option<&Arc<Look>> {
        self.scene.objects.first().map(|object| &object.look)
    }

    /// The event that announces it.
    pub(super) fn announcement(&self) -> String {
        let Subject { environment, material, mesh } = &self.subject;
        let form = |form: Form| {
            // The first of the exports of a kind.
            let is_its = |export: &&Export| form.exporter() == export.name.split([',', ' ', ':']).next();
            let export = self.details.exports.iter().find(is_its);
            let estimate = "an estimate of low degree until its maps are built";
            json!({
                "mode": form.mode().name(),
                "bytes": export.map(|export| export.bytes),
                "note": if self.is_estimate(form) { estimate } else { "" },
            })
        };
        let forms: Vec<_> = Form::ALL.into_iter().filter(|form| self.shows(*form)).map(form).collect();
        let mut notes = self.details.notes.clone();
        if self.scene.objects.len() > 1 {
            notes.push("The page draws one of the materials of this mesh on all of it.".into());
        }
        json!({
            "number": self.number,
            "environment": environment,
            "material": material,
            "mesh": mesh,
            "exposure": self.scene.light.exposure().stops,
            "forms": forms,
            "notes": notes,
        })
        .to_string()
    }

    /// The mesh and the sky.
    ///
    /// # Errors
    /// If the scene has no mesh, or a number of it is not finite.
    pub(super) fn surroundings(&self, blobs: &Mutex<Blobs>, sky: &KeptSky) -> Result<String, String> {
        let object = self.scene.objects.first().ok_or("the scene has no mesh")?;
        let mesh = object.whole.as_ref().unwrap_or(&object.mesh);
        let mesh = MeshEntry::new(self.subject.mesh.clone(), mesh, &mut blobs.lock());
        let sky = sky.of(&self.scene.light, blobs)?;
        serde_json::to_string(&json!({ "mesh": mesh, "sky": *sky })).map_err(|error| error.to_string())
    }

    /// What a form of the scene is drawn with; `None` if it has no such form.
    ///
    /// # Errors
    /// If its map cannot be made.
    pub(super) fn view(
        &self,
        mode: &str,
        document: &Mutex<Document>,
        blobs: &Mutex<Blobs>,
    ) -> Result<Option<String>, String> {
        let found = Form::ALL.into_iter().find(|form| form.mode().name() == mode && self.shows(*form));
        let (Some(form), Some(look)) = (found, self.look()) else { return Ok(None) };
        let look = match self.is_estimate(form) {
            true => self.estimate.get_or_init(|| look.estimated(Stop::NEVER).map(Arc::new)).clone(),
            false => Ok(Arc::clone(look)),
        };
        let view = look.and_then(|look| WebView::of(&look, form.mode()));
        let view = view.map_err(|error| error.to_string())?.ok_or("a page cannot draw this form")?;
        let cost = view.cost;
        let entry = FormEntry::new(document.lock().form(form), blobs.lock().view(view), cost);
        serde_json::to_string(&entry).map(Some).map_err(|error| error.to_string())
    }
}

impl KeptSky {
    /// The sky of a light, which is packed once.
    fn of(&self, light: &Arc<Light>, blobs: &Mutex<Blobs>) -> Result<Arc<ViewEntry>, String> {
        let mut kept = self.0.lock();
        if let Some((_, sky)) = kept.as_ref().filter(|(of, _)| Arc::ptr_eq(of, light)) {
            return Ok(Arc::clone(sky));
        }
        let shown = light.in_rows(SKY_ROWS).map_err(|error| error.to_string())?;
        let sky = Arc::new(blobs.lock().view(WebView::sky(&shown)));
        *kept = Some((Arc::clone(light), Arc::clone(&sky)));
        Ok(sky)
    }

    /// Forgets it, since its parts are forgotten.
    pub(super) fn forget(&self) {
        *self.0.lock() = None;
    }
}
