//! Spheres of a page's forms, drawn and measured without a browser.

use std::collections::HashMap;
use std::sync::Arc;

use containers::escape_html;
use engine::{Failure, Steps};
use preview::{
    Background, Camera, Cpu, Look, Mode, Picture, PointSet, RenderError, Renderer, Scene, Shot, Show,
};
use preview_page::{Form, FormError, MeasuredBy};
use sphere::Rotation;

use super::pairs::Pair;
use crate::picture::data_uri;
use crate::values::UntilStopped;

/// The pixels along an edge of a picture that is shown, and of one that is measured.
const SHOWN: u32 = 112;
const MEASURED: u32 = 64;

/// The samples of light at each pixel by brute force.
const LIGHT_SAMPLES: u32 = 1024;

/// The pictures of the first form of each pair, and what they were compared with.
#[derive(Default)]
pub(crate) struct Pictures {
    shown: Vec<(String, &'static str, Picture)>,
    references: HashMap<String, Picture>,
    cpu: Option<Cpu>,
}

impl Pictures {
    /// Forgets the forms that readers see.
    pub(crate) fn forget_shown(&mut self) {
        self.shown.clear();
    }

    /// Draws the first form of each pair for readers.
    pub(crate) fn show(
        &mut self,
        pair: &Pair,
        form: Form,
        look: &Arc<Look>,
        steps: &Steps<'_>,
    ) -> Result<(), Failure> {
        let title = pair.title();
        if self.shown.iter().all(|(shown, ..)| *shown != title) {
            let shown = self.draw(form.mode(), look, [SHOWN, 2], steps)?;
            self.shown.push((title, form.label(), shown));
        }
        Ok(())
    }

    /// The error of a form of a pair, compared with brute force; `None` if there is nothing to measure.
    pub(crate) fn measured(
        &mut self,
        pair: &Pair,
        form: Form,
        look: &Arc<Look>,
        steps: &Steps<'_>,
    ) -> Result<Option<FormError>, Failure> {
        let title = pair.title();
        if !self.references.contains_key(&title) {
            let plain = Look::of_light(Arc::clone(&pair.light), pair.material.clone(), look.sizes());
            let reference = self.draw(Mode::BruteForce, &Arc::new(plain), [MEASURED, 1], steps)?;
            self.references.insert(title.clone(), reference);
        }
        let picture = self.draw(form.mode(), look, [MEASURED, 1], steps)?;
        let error = picture.stops(&self.references[&title], pair.light.dark());
        Ok(error.map(|[p95, p99]| FormError { p95, p99, by: MeasuredBy::Page }))
    }

    /// A sphere of so many pixels along an edge, with so many samples along each side of one.
    fn draw(
        &mut self,
        mode: Mode,
        look: &Arc<Look>,
        [edge, samples]: [u32; 2],
        steps: &Steps<'_>,
    ) -> Result<Picture, Failure> {
        let mesh = mesh::shape("sphere").ok_or_else(|| Failure::new("there is no sphere"))?;
        let scene = Scene::of(Arc::new(mesh), Arc::clone(look));
        let shot = Shot {
            size: [edge; 2],
            samples,
            camera: Camera::new(scene.framing()),
            turn: Rotation::IDENTITY,
            show: Show::One(mode),
            background: Background::Environment,
            exposure: look.light().exposure().stops,
            tone: envmap::ToneMap::Filmic,
            light_samples: LIGHT_SAMPLES,
            points: PointSet::Even,
        };
        let cpu = self.cpu.get_or_insert_with(Cpu::new);
        steps.reporter().until_stopped(|stop| {
            cpu.render(&scene, &shot, stop).map_err(|error| match error {
                RenderError::Cancelled => Failure::cancelled(),
                error => Failure::from(error),
            })
        })
    }

    /// The pictures as figures of HTML.
    pub(crate) fn figures(&self) -> Result<String, Failure> {
        let edge = SHOWN as usize;
        let figure = |(title, form, picture): &(String, &str, Picture)| {
            let source = data_uri(edge, edge, &picture.codes)?;
            let title = escape_html(title);
            Ok(format!(
                "<figure><img src=\"{source}\" width=\"{edge}\" height=\"{edge}\" alt=\"{title}\">\
                 <figcaption>{title}<span>{form}</span></figcaption></figure>\n"
            ))
        };
        self.shown.iter().map(figure).collect()
    }
}
