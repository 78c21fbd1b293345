//! What draws the pictures of the window, a bit at a time.

use std::sync::Arc;

use glam::Vec3;

use preview::shading::develop::{codes, develop};
use preview::{Background, Mode, Picture, RenderError, Renderer, Scene, Shot, Show};

/// What is to be drawn.
#[derive(Clone, Debug)]
pub(crate) struct RenderRequest {
    /// Another for every scene.
    pub(crate) edition: u64,
    pub(crate) scene: Arc<Scene>,
    /// Of the whole picture, as it is at rest.
    pub(crate) shot: Shot,
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub(crate) enum Canvas {
    /// In this machine's memory.
    Codes(Arc<Picture>),
    /// On the graphics device that draws the window, as egui wants it.
    Texture(wgpu::TextureView),
}

/// A picture as far as it has come.
#[derive(Clone, Debug)]
pub(crate) struct PartialFrame {
    pub(crate) canvas: Canvas,
    /// The light samples that are in it, of a mode by brute force.
    pub(crate) light_samples: u32,
    /// Whether the same call again shows more.
    pub(crate) unfinished: bool,
    /// Of a difference: [`Picture::relative_rms`].
    pub(crate) relative_rms: Option<f64>,
}

/// Draws for the window.
pub(crate) trait RendererAdapter: Send {
    /// As [`Renderer::name`].
    fn name(&self) -> String;

    /// Draws an order by another shot of it, coarser perhaps. Brute force comes bit by bit, while it is asked for the same
    /// again.
    fn draw(
        &mut self,
        order: &RenderRequest,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<PartialFrame, RenderError>;

    /// The whole picture, to keep.
    fn picture(
        &mut self,
        order: &RenderRequest,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError>;

    /// Why it will never draw again.
    fn lost(&self) -> Option<String>;
}

/// Whether two shots of a scene are by the same light, and differ in nothing but exposure, tone curve and amplification.
pub(crate) fn is_by_the_same_light(one: &Shot, other: &Shot) -> bool {
    let amplify = |show| match show {
        Show::Difference { of, from, .. } => Show::Difference { of, from, amplify: 1.0 },
        show => show,
    };
    let developed =
        Shot { exposure: one.exposure, tone: one.tone, show: amplify(other.show), ..other.clone() };
    Shot { show: amplify(one.show), ..one.clone() } == developed
}

/// Draws by any renderer, in this machine's memory.
pub(crate) struct CpuAdapter {
    renderer: Box<dyn Renderer + Send>,
    last: Option<Last>,
}

/// The last picture by brute force.
struct Last {
    edition: u64,
    shot: Shot,
    light_samples: u32,
    picture: Arc<Picture>,
}

impl CpuAdapter {
    /// The light samples of a first picture by brute force; each after it has four times as many.
    const FIRST: u32 = 4;

    pub(crate) fn new(renderer: Box<dyn Renderer + Send>) -> Self {
        Self { renderer, last: None }
    }

    /// By brute force: the same again by more light, and what was drawn already where it is only to be developed anew.
    fn brute_force(
        &mut self,
        order: &RenderRequest,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(u32, Arc<Picture>), RenderError> {
        let last = self.last.as_ref().filter(|last| last.edition == order.edition);
        let (light_samples, picture) = match last {
            // Only of single samples the radiance of each is known.
            Some(last)
                if last.shot != *shot && shot.samples == 1 && is_by_the_same_light(&last.shot, shot) =>
            {
                (last.light_samples, developed(&last.picture, shot))
            }
            last => {
                let again = last.filter(|last| last.shot == *shot);
                let count = again.map_or(Self::FIRST, |last| last.light_samples.saturating_mul(4));
                let light_samples = count.min(shot.light_samples);
                let shot = Shot { light_samples, ..shot.clone() };
                (light_samples, self.renderer.render(&order.scene, &shot, stop)?)
            }
        };
        let picture = Arc::new(picture);
        let (edition, kept) = (order.edition, Arc::clone(&picture));
        self.last = Some(Last { edition, shot: shot.clone(), light_samples, picture: kept });
        Ok((light_samples, picture))
    }
}

/// The picture of one sample a pixel, by another exposure, tone curve and amplification.
fn developed(picture: &Picture, shot: &Shot) -> Picture {
    let amplify = if let Show::Difference { amplify, .. } = shot.show { amplify } else { 1.0 };
    let gain = shot.exposure.exp2() as f32;
    let behind = if let Background::Flat(_) = shot.background { 1.0 } else { gain };
    let display = picture.radiance.iter().map(|[red, green, blue, cover]| {
        let gain = if *cover > 0.0 { gain } else { behind };
        develop(Vec3::new(*red, *green, *blue) * amplify, gain, shot.tone).to_array()
    });
    Picture { codes: codes(&display.collect::<Vec<_>>()), ..picture.clone() }
}

impl RendererAdapter for CpuAdapter {
    fn name(&self) -> String {
        self.renderer.name()
    }

    fn draw(
        &mut self,
        order: &RenderRequest,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<PartialFrame, RenderError> {
        let (light_samples, picture) = if shot.show.modes().any(|mode| mode == Mode::BruteForce) {
            self.brute_force(order, shot, stop)?
        } else {
            self.last = None;
            (0, Arc::new(self.renderer.render(&order.scene, shot, stop)?))
        };
        Ok(PartialFrame {
            relative_rms: picture.relative_rms,
            canvas: Canvas::Codes(picture),
            light_samples,
            unfinished: light_samples > 0 && light_samples < shot.light_samples,
        })
    }

    fn picture(
        &mut self,
        order: &RenderRequest,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        self.renderer.render(&order.scene, &order.shot, stop)
    }

    fn lost(&self) -> Option<String> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit;
    use preview::Cpu;
    use preview::{Tone, ViewSettings};

    const GO_ON: &(dyn Fn() -> bool + Sync) = &|| false;

    #[test]
    fn brute_force_is_developed_anew_without_beginning_anew() {
        let scene = Arc::new(testkit::scene());
        let [of, from] = [Mode::LocalShrm, Mode::BruteForce];
        let settings = ViewSettings::default();
        for show in [Show::One(from), Show::Difference { of, from, amplify: 8.0 }] {
            for background in [Background::Environment, Background::Flat([0.18; 3])] {
                let shot = Shot { show, background, ..settings.shot(scene.framing(), [24, 16]) };
                let order = RenderRequest { edition: 1, scene: Arc::clone(&scene), shot: shot.clone() };
                let mut easel = CpuAdapter::new(Box::new(Cpu::new()));
                let counts = [(); 2].map(|()| easel.draw(&order, &shot, GO_ON).unwrap().light_samples);
                assert_eq!(counts, [4, 16]);
                let tone = ViewSettings { tone: Tone::Plain, ..settings.clone() }.tone_map();
                let mut bright = Shot { exposure: 1.5, tone, ..shot.clone() };
                if let Show::Difference { amplify, .. } = &mut bright.show {
                    *amplify = 2.0;
                }
                let stroke = easel.draw(&order, &bright, GO_ON).unwrap();
                assert_eq!((stroke.light_samples, stroke.unfinished), (16, true));
                let Canvas::Codes(picture) = stroke.canvas else { panic!("it is in memory") };
                let wanted = Shot { light_samples: 16, ..bright.clone() };
                let whole = Cpu::new().render(&scene, &wanted, GO_ON).unwrap();
                assert_eq!(picture.codes, whole.codes, "{show:?} {background:?}");
                assert_eq!(easel.draw(&order, &bright, GO_ON).unwrap().light_samples, 64, "it goes on");
                let turned = Shot { turn: sphere::Rotation::from_yaw_pitch_roll(1.0, 0.0, 0.0), ..bright };
                assert_eq!(easel.draw(&order, &turned, GO_ON).unwrap().light_samples, 4);
            }
        }
    }

    #[test]
    fn what_is_stopped_leaves_what_there_was() {
        let scene = Arc::new(testkit::scene());
        let show = Show::One(Mode::BruteForce);
        let shot = Shot { show, ..ViewSettings::default().shot(scene.framing(), [24, 16]) };
        let order = RenderRequest { edition: 1, scene, shot: shot.clone() };
        let mut easel = CpuAdapter::new(Box::new(Cpu::new()));
        easel.draw(&order, &shot, GO_ON).unwrap();
        assert_eq!(easel.draw(&order, &shot, &|| true).err(), Some(RenderError::Cancelled));
        assert_eq!(easel.draw(&order, &shot, GO_ON).unwrap().light_samples, 16);
    }
}
