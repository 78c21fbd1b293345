//! A scene as a page draws it: its mesh, its sky, and a view for each form, made when a page asks for it.

use std::sync::{Arc, OnceLock};

use brdf::BaseColorTexture;
use parking_lot::Mutex;
use preview::web::{Cost, WebBaseColor, WebView, shows_table};
use preview::{Export, Light, Look, Object, RenderError, Scene, Subject, SubjectDetails};
use serde_json::json;
use sh::Stop;

use crate::Form;
use crate::blobs::{Blobs, ViewEntry};
use crate::mesh_entry::{MeshEntry, MeshPart};

/// The most rows of a sky in the background.
const SKY_ROWS: usize = 512;

/// The most texels along a side of a texture: all that there are.
const LONGEST_SIDE: usize = BaseColorTexture::LONGEST_SIDE;

/// What a page draws of a scene.
#[derive(Debug)]
pub(super) struct LiveScene {
    pub(super) number: u64,
    subject: Subject,
    scene: Scene,
    details: SubjectDetails,
    /// The looks with a reflection of low degree, of the materials of objects without maps.
    estimates: Vec<OnceLock<Result<Arc<Look>, RenderError>>>,
}

/// The sky of the light that was shown last.
#[derive(Debug, Default)]
pub(super) struct KeptSky(Mutex<Option<(Arc<Light>, Arc<ViewEntry>)>>);

impl LiveScene {
    pub(super) fn new(number: u64, subject: Subject, scene: Scene, details: SubjectDetails) -> Self {
        let estimates = scene.objects.iter().map(|_| OnceLock::new()).collect();
        Self { number, subject, scene, details, estimates }
    }

    /// Returns a scene with another number, so that pages load all of it again.
    pub(super) fn renumbered(&self, number: u64) -> Self {
        Self::new(number, self.subject.clone(), self.scene.clone(), self.details.clone())
    }

    /// Whether a page can draw a form.
    fn shows(&self, form: Form) -> bool {
        let can = |object: &Object| match form {
            Form::Table => shows_table(&object.look),
            // The transfer of a scene is of matrices.
            Form::Transfer => false,
            _ => true,
        };
        self.scene.offers(form.mode()) && self.scene.objects.iter().all(can) || self.is_estimate(form)
    }

    /// Whether a form is estimated: an SHRM, if all materials are known and no form shows all of them.
    fn is_estimate(&self, form: Form) -> bool {
        let shows_material = |form: &Form| form.shows_material() && self.scene.offers(form.mode());
        form == Form::Shrm
            && self.scene.objects.iter().all(|object| object.look.material().is_some())
            && !Form::ALL.iter().any(shows_material)
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
        json!({
            "number": self.number,
            "environment": environment,
            "material": material,
            "mesh": mesh,
            "exposure": self.scene.light.exposure().stops,
            "forms": forms,
            "notes": self.details.notes,
        })
        .to_string()
    }

    /// The mesh and the sky.
    ///
    /// # Errors
    /// If the scene has no mesh, or a number of it is not finite.
    pub(super) fn surroundings(&self, blobs: &Mutex<Blobs>, sky: &KeptSky) -> Result<String, String> {
        let meshes = self.scene.objects.iter().map(Object::mesh_in_scene);
        let meshes = meshes.collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())?;
        let parts = self.scene.objects.iter().zip(&meshes).map(|(object, mesh)| {
            let placement = object.look.base_color().map(|texture| (0, *texture.placement()));
            MeshPart { mesh, material: None, textures: placement.into_iter().collect(), transfer: None }
        });
        let parts: Vec<_> = parts.collect();
        let mesh = MeshEntry::new(self.subject.mesh.clone(), self.scene.framing(), &parts, &mut blobs.lock());
        let sky = sky.of(&self.scene.light, blobs)?;
        serde_json::to_string(&json!({ "mesh": mesh, "sky": *sky })).map_err(|error| error.to_string())
    }

    /// What each part of the mesh is drawn with in a form of the scene; `None` if it has no such form.
    ///
    /// # Errors
    /// If a map cannot be made.
    pub(super) fn view(&self, mode: &str, blobs: &Mutex<Blobs>) -> Result<Option<String>, String> {
        let found = Form::ALL.into_iter().find(|form| form.mode().name() == mode && self.shows(*form));
        let Some(form) = found else { return Ok(None) };
        let mut cost = Cost::default();
        let mut parts = Vec::new();
        for (object, estimate) in self.scene.objects.iter().zip(&self.estimates) {
            let look = match object.offers(form.mode()) {
                true => Ok(Arc::clone(&object.look)),
                false => estimate.get_or_init(|| object.look.estimated(Stop::NEVER).map(Arc::new)).clone(),
            };
            let view = look.and_then(|look| WebView::of(&look, form.mode()));
            let view = view.map_err(|error| error.to_string())?.ok_or("a page cannot draw this form")?;
            let base_color = object.mesh.coordinates().and(WebBaseColor::of(&object.look, LONGEST_SIDE));
            let view = match base_color {
                Some(base_color) => view.with_base_color(base_color),
                None => view,
            };
            cost = cost.most(view.cost);
            parts.push(blobs.lock().view(view));
        }
        let Cost { fetches, lights } = cost;
        let view = json!({ "parts": parts, "fetches": fetches, "lights": lights });
        Ok(Some(view.to_string()))
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
