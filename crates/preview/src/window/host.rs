//! What the window and the program around it tell each other.

use std::collections::BTreeSet;
use std::sync::mpsc::Sender;

use crate::{Mode, Picture, Scene};

/// What can be shown, by name. Meshes are those of the manifest and those that Specula has by itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Catalogue {
    /// The environments.
    pub environments: Vec<String>,
    /// The materials.
    pub materials: Vec<String>,
    /// The meshes.
    pub meshes: Vec<String>,
    /// The environments and materials that go together, by their places in the lists.
    pub pairs: BTreeSet<(usize, usize)>,
}

impl Catalogue {
    /// What there is that is nearest to what is `wanted`; what was wished for counts twice. Of two as near, it is the one that
    /// is nearer to what is seen `now`, then the first. Where there is nothing, names are empty.
    pub(super) fn nearest(&self, wanted: &Subject, wish: &Wish, now: &Subject) -> Subject {
        let weights = [&wish.environment, &wish.material].map(|name| 1 + u32::from(name.is_some()));
        let named = self.pairs.iter().filter_map(|&(environment, material)| {
            Some((self.environments.get(environment)?, self.materials.get(material)?))
        });
        let nearest = named.min_by_key(|(environment, material)| {
            let lacks = |subject: &Subject| {
                [**environment != subject.environment, **material != subject.material].map(u32::from)
            };
            let [environment, material] = lacks(wanted);
            (environment * weights[0] + material * weights[1], lacks(now))
        });
        let (environment, material) =
            nearest.map(|(one, other)| (one.clone(), other.clone())).unwrap_or_default();
        let mesh = [&wanted.mesh, &now.mesh].into_iter().find(|name| self.meshes.contains(name));
        let mesh = mesh.or(self.meshes.first()).cloned().unwrap_or_default();
        Subject { environment, material, mesh }
    }
}

/// A material on a mesh under an environment, each by its name in the [`Catalogue`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Subject {
    /// The environment.
    pub environment: String,
    /// The material.
    pub material: String,
    /// The mesh.
    pub mesh: String,
}

/// What is asked for at first; the rest is as it was, or the first of its list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wish {
    /// The environment.
    pub environment: Option<String>,
    /// The material.
    pub material: Option<String>,
    /// The mesh.
    pub mesh: Option<String>,
    /// The map that shades it, alone.
    pub mode: Option<Mode>,
}

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
pub struct Facts {
    /// What was exported of it, in the manifest's order.
    pub exports: Vec<Export>,
    /// What else is worth a line: warnings of stages, where a part of it was taken from.
    pub notes: Vec<String>,
}

/// What the window is told.
#[derive(Debug)]
pub enum News {
    /// What can be shown from now on. Where what is wanted is not in it, the window asks for what is nearest to that, and goes
    /// back when it is there again.
    Catalogue(Catalogue),
    /// The scene of a subject: an answer to [`Host::show`], or the same subject made anew. Of any other subject it is left out.
    Scene {
        /// Whose.
        subject: Subject,
        /// What is seen.
        scene: Scene,
        /// What the inspector tells of it.
        facts: Facts,
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

/// Sends news to a window and wakes it, from any thread.
#[derive(Clone, Debug)]
pub struct NewsSender {
    news: Sender<News>,
    window: eframe::egui::Context,
}

impl NewsSender {
    pub(crate) fn new(news: Sender<News>, window: eframe::egui::Context) -> Self {
        Self { news, window }
    }

    /// Sends. After the window has closed this does nothing.
    pub fn send(&self, news: News) {
        if self.news.send(news).is_ok() {
            self.window.request_repaint();
        }
    }
}

/// The program around the window. It is called on the window's thread, so that no method may wait for anything.
pub trait Host: Send {
    /// The window wants a subject; [`News::Scene`] is to follow, or [`News::Failure`]. An earlier wish is no longer wanted.
    fn show(&mut self, subject: &Subject);

    /// What to give to the next window as [`WindowSettings::state`]: JSON. Called a moment after the last change, and
    /// when the window closes.
    ///
    /// [`WindowSettings::state`]: super::WindowSettings::state
    fn keep_state(&mut self, json: &str);

    /// Keeps a picture of a subject. A [`News::Toast`] is to say where, or why not.
    fn screenshot(&mut self, subject: &Subject, picture: Picture);

    /// The window has closed.
    fn closed(&mut self);
}
