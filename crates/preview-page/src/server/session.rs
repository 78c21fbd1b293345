//! What a server knows: what the program said last, and what pages ask for.

use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::{Condvar, Mutex};
use preview::{Aim, Catalog, Host, InitialView, List, MaterialForm, PreviewUpdate, Subject, SubjectRequest};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};

use super::event_log::{Event, EventLog};
use super::form_json;
use super::live_scene::{KeptSky, LiveScene};
use super::response::Response;
use super::uploads::Uploads;
use crate::blobs::Blobs;
use crate::document::{STYLE, served_script};
use crate::{Document, Form};

/// The bytes of packed textures that are kept for browsers that load them again. If there are more, all are
/// forgotten, and pages load the scene anew.
const MAX_KEPT: usize = 256 << 20;

/// The state of a server, for all its connections.
pub(super) struct Session {
    token: String,
    host: Mutex<Box<dyn Host>>,
    document: Mutex<Document>,
    blobs: Mutex<Blobs>,
    /// The place of the first part that is not a shader of every page.
    shaders: usize,
    sky: KeptSky,
    state: Mutex<State>,
    /// Something was added to the events.
    told: Condvar,
    uploads: Uploads,
    /// Maps are made by threads of their own: those that all share may be occupied by a build. They make one
    /// after the other: a thread that waits for its part of one may not begin another that waits for the same
    /// value of a look.
    pool: Mutex<ThreadPool>,
}

#[derive(Default)]
struct State {
    /// What is shown first.
    view: InitialView,
    events: EventLog,
    catalog: Catalog,
    scene: Option<Arc<LiveScene>>,
    /// The number of the last scene.
    scenes: u64,
    /// The subject that was asked for last.
    wanted: Option<Subject>,
    /// The parameters of the materials that were shown, as their files have them.
    forms: HashMap<String, MaterialForm>,
    is_closed: bool,
}

impl State {
    /// Tells pages what there is, and what a page that has just opened shows.
    fn tell_catalog(&mut self) {
        let data = self.catalog_json();
        self.events.set("catalog", data);
    }

    fn catalog_json(&self) -> String {
        let Catalog { environments, materials, meshes, pairs } = &self.catalog;
        json!({
            "environments": environments,
            "materials": materials,
            "meshes": meshes,
            "pairs": pairs,
            "shown": self.wanted,
            "mode": self.view.request.mode.map(preview::Mode::name),
        })
        .to_string()
    }
}

/// A subject that a page shows, and a mark by which the page knows its own request when all pages are told of
/// it.
#[derive(Deserialize, Serialize)]
struct Show {
    #[serde(flatten)]
    subject: Subject,
    #[serde(default)]
    mark: String,
}

/// The values of a material that a page sends.
#[derive(Deserialize)]
struct Edit {
    material: String,
    values: Json,
}

/// A turn of the light to write, and the lines that the user agreed to.
#[derive(Deserialize)]
struct SavedLight {
    #[serde(flatten)]
    turn: Aim,
    lines: Vec<String>,
}

impl Session {
    pub(super) fn new(
        title: &str,
        token: String,
        view: InitialView,
        host: Box<dyn Host>,
    ) -> io::Result<Self> {
        let mut blobs = Blobs::quick();
        let document = Document::live(title, &mut blobs);
        Ok(Self {
            token,
            host: Mutex::new(host),
            document: Mutex::new(document),
            shaders: blobs.next(),
            blobs: Mutex::new(blobs),
            sky: KeptSky::default(),
            state: Mutex::new(State { view, ..State::default() }),
            told: Condvar::new(),
            uploads: Uploads::new()?,
            pool: Mutex::new(
                ThreadPoolBuilder::new()
                    .thread_name(|_| "page maps".into())
                    .build()
                    .map_err(io::Error::other)?,
            ),
        })
    }

    pub(super) fn token(&self) -> &str {
        &self.token
    }

    // ---- from the program

    /// Takes what the program says, and tells the pages.
    pub(super) fn update(&self, update: PreviewUpdate) {
        let mut state = self.state.lock();
        let state = &mut *state;
        match update {
            PreviewUpdate::Catalog(catalog) => {
                let wanted = match &state.wanted {
                    Some(wanted) => catalog.nearest(wanted, &SubjectRequest::default(), wanted),
                    None => state.view.subject(&catalog),
                };
                state.catalog = catalog;
                if state.wanted.as_ref() != Some(&wanted) {
                    self.host.lock().show(&wanted);
                }
                state.wanted = Some(wanted);
                state.tell_catalog();
            }
            PreviewUpdate::Choose(request) => {
                let SubjectRequest { environment, material, mesh, mode } = request;
                let mode = mode.map(preview::Mode::name);
                let data =
                    json!({ "environment": environment, "material": material, "mesh": mesh, "mode": mode });
                state.events.tell("choose", data.to_string());
                let wanted = state.wanted.get_or_insert_default();
                for (list, name) in List::ALL.into_iter().zip([environment, material, mesh]) {
                    if let Some(name) = name {
                        *list.chosen(wanted) = name;
                    }
                }
            }
            PreviewUpdate::Scene { subject, scene, details } => {
                state.scenes += 1;
                let scene = Arc::new(LiveScene::new(state.scenes, subject, scene, details));
                state.events.set("scene", scene.announcement());
                state.scene = Some(scene);
            }
            PreviewUpdate::Material { material, form, edited } => {
                let data = material_json(&material, form.as_ref(), edited.as_ref());
                state.events.set_of("material", &material, data);
                match form {
                    Ok(form) => _ = state.forms.insert(material, form),
                    Err(_) => _ = state.forms.remove(&material),
                }
            }
            PreviewUpdate::MaterialSaved { material, saved } => {
                state.events.tell("saved", json!({ "material": material, "saved": saved }).to_string());
            }
            PreviewUpdate::LightEdit { turn, lines } => {
                let data = json!({ "yaw": turn.yaw, "pitch": turn.pitch, "lines": lines });
                state.events.tell("light", data.to_string());
            }
            PreviewUpdate::LightSaved(turn) => {
                state.events.tell("light-saved", json!({ "yaw": turn.yaw, "pitch": turn.pitch }).to_string());
            }
            PreviewUpdate::Status(status) => state.events.set("status", json!(status).to_string()),
            PreviewUpdate::Toast { title, lines } => {
                state.events.tell("toast", json!({ "title": title, "lines": lines }).to_string());
            }
            PreviewUpdate::Failure(lines) => state.events.set("failure", json!(lines).to_string()),
            PreviewUpdate::Close => {
                state.is_closed = true;
                state.events.tell("close", "null".into());
            }
        }
        self.told.notify_all();
    }

    /// The events after a number ([`EventLog::after`]), and the number of the last. If there are none, it
    /// waits for the next, but not for longer than a pulse.
    pub(super) fn events_after(&self, number: Option<u64>, pulse: Duration) -> (Vec<Event>, u64) {
        let mut state = self.state.lock();
        let mut events = state.events.after(number);
        if events.is_empty() && number.is_some() {
            self.told.wait_for(&mut state, pulse);
            events = state.events.after(number);
        }
        (events, state.events.last())
    }

    pub(super) fn wait_until_closed(&self) {
        let mut state = self.state.lock();
        while !state.is_closed {
            self.told.wait(&mut state);
        }
    }

    // ---- from pages

    /// Answers a request for something below the link.
    pub(super) fn get(&self, path: &str) -> Response {
        match path {
            "" => match self.document.lock().served() {
                Ok(page) => Response::file("text/html; charset=utf-8", &page),
                Err(error) => Response::failed(&error.to_string()),
            },
            "page.css" => Response::file("text/css; charset=utf-8", STYLE),
            "page.js" => Response::file("text/javascript; charset=utf-8", &served_script()),
            _ => match path.split_once('/') {
                Some(("blob", place)) => {
                    let packed = place.parse().ok().and_then(|place| self.blobs.lock().packed(place));
                    packed.map_or_else(Response::nothing, Response::lasting)
                }
                Some(("scene", path)) => self.scene(path),
                _ => Response::nothing(),
            },
        }
    }

    /// `NUMBER` is the mesh and the sky of a scene, and `NUMBER/MODE` a form of it. Of an earlier scene there
    /// is nothing, which is no error: the page has not read yet that there is another.
    fn scene(&self, path: &str) -> Response {
        let (number, mode) = match path.split_once('/') {
            Some((number, mode)) => (number, Some(mode)),
            None => (path, None),
        };
        let is_form = |mode: &str| Form::ALL.iter().any(|form| form.mode().name() == mode);
        let scene = self.state.lock().scene.clone();
        let scene = scene.filter(|_| mode.is_none_or(is_form));
        let (Some(scene), Ok(number)) = (scene, number.parse::<u64>()) else { return Response::nothing() };
        if number != scene.number {
            return if number < scene.number { Response::done() } else { Response::nothing() };
        }
        let make = || match mode {
            None => scene.surroundings(&self.blobs, &self.sky).map(Some),
            Some(mode) => scene.view(mode, &self.blobs),
        };
        let made = self.pool.lock().install(make);
        let response = match made {
            Ok(Some(json)) => Response::json(&json),
            Ok(None) => Response::nothing(),
            Err(reason) => Response::failed(&reason),
        };
        self.forget_old_parts();
        response
    }

    /// If too much is kept, forgets all that is not of every page, and gives the scene another number.
    fn forget_old_parts(&self) {
        if self.blobs.lock().since(self.shaders) <= MAX_KEPT {
            return;
        }
        self.blobs.lock().forget_for_good(self.shaders);
        self.sky.forget();
        let mut state = self.state.lock();
        state.scenes += 1;
        if let Some(scene) = state.scene.take() {
            let scene = Arc::new(scene.renumbered(state.scenes));
            state.events.set("scene", scene.announcement());
            state.scene = Some(scene);
        }
        self.told.notify_all();
    }

    /// Does what a page asks for.
    pub(super) fn post(&self, path: &str, body: &str) -> Response {
        match self.ask(path, body) {
            Ok(true) => Response::done(),
            Ok(false) => Response::nothing(),
            Err(why) => Response::bad(&why),
        }
    }

    /// Passes a request on to the program; false if there is none of this name.
    fn ask(&self, path: &str, body: &str) -> Result<bool, String> {
        match path {
            "show" => {
                let Show { subject, mark } = read(body)?;
                let mut state = self.state.lock();
                // A page that asks for what is gone has not read of that yet.
                let nearest = state.catalog.nearest(&subject, &SubjectRequest::default(), &subject);
                let subject = match nearest == subject {
                    true => subject,
                    false => state.wanted.clone().unwrap_or(nearest),
                };
                state.wanted = Some(subject.clone());
                // There is one scene for all pages: the others follow, and so do those that open later.
                state.events.tell("shown", json!(Show { subject: subject.clone(), mark }).to_string());
                let catalog = state.catalog_json();
                state.events.amend("catalog", "", catalog);
                self.told.notify_all();
                // The next view begins with it.
                let (mut settings, _) = state.view.settings();
                settings.subject = subject.clone();
                let settings = settings.to_json();
                state.view.state = Some(settings.clone());
                // The program is asked in the order in which the pages are told.
                let mut host = self.host.lock();
                drop(state);
                host.show(&subject);
                host.keep_state(&settings);
            }
            "edit" => {
                let edit: Edit = read(body)?;
                let form = match edit.values.is_null() {
                    true => None,
                    false => Some(self.edited(&edit)?),
                };
                let mut state = self.state.lock();
                // A page that opens later has the values too.
                let file = state.forms.get(&edit.material);
                if let Some(data) = file.map(|file| material_json(&edit.material, Ok(file), form.as_ref())) {
                    state.events.amend("material", &edit.material, data);
                }
                drop(state);
                self.host.lock().edit_material(&edit.material, form.as_ref());
            }
            "save" => {
                let edit: Edit = read(body)?;
                let form = self.edited(&edit)?;
                self.host.lock().save_material(&edit.material, &form);
            }
            "light" => self.host.lock().propose_light(read(body)?),
            "save-light" => {
                let SavedLight { turn, lines } = read(body)?;
                self.host.lock().save_light(turn, &lines);
            }
            "dropped" => {
                let names: Vec<String> = read(body)?;
                let files = self.uploads.files(&names)?;
                self.host.lock().dropped(files);
            }
            "return" => self.host.lock().return_from_dropped(),
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The form of a material with the values that a page sends.
    fn edited(&self, edit: &Edit) -> Result<MaterialForm, String> {
        let form = self.state.lock().forms.get(&edit.material).cloned();
        let form = form.ok_or_else(|| format!("{:?} has no parameters to edit", edit.material))?;
        form_json::with_values(&form, &edit.values)
    }

    /// Receives a file, whose name is written as in an address. Also says whether its bytes were read.
    pub(super) fn receive(
        &self,
        name: &str,
        length: u64,
        body: &mut impl io::Read,
    ) -> io::Result<(Response, bool)> {
        let Ok(name) = percent_encoding::percent_decode_str(name).decode_utf8() else {
            return Ok((Response::bad("the name is no UTF-8"), false));
        };
        Ok(match self.uploads.receive(&name, length, body) {
            Ok(Ok(())) => (Response::done(), true),
            Ok(Err(why)) => (Response::bad(&why), false),
            Err(error) => (Response::failed(&format!("{name}: {error}")), false),
        })
    }
}

/// The event of a material: the values in its file, or why it cannot be edited, and those that are not saved.
fn material_json(
    material: &str,
    form: Result<&MaterialForm, &String>,
    edited: Option<&MaterialForm>,
) -> String {
    json!({
        "material": material,
        "form": form.ok().map(form_json::form),
        "reason": form.err().map_or("", String::as_str),
        "edited": edited.map(form_json::values),
    })
    .to_string()
}

/// The body of a request.
fn read<T: for<'a> Deserialize<'a>>(body: &str) -> Result<T, String> {
    serde_json::from_str(body).map_err(|error| error.to_string())
}
