//! Renderers of the window, which refine a picture step by step.

use std::sync::Arc;

use glam::Vec3;
use sh::Stop;

use preview::shading::develop::{codes, develop};
use preview::{Background, Mode, Picture, RenderError, Renderer, Scene, Shot, Show};

#[derive(Clone, Debug)]
pub(crate) struct RenderRequest {
    /// A number of its own for every scene.
    pub(crate) scene_id: u64,
    pub(crate) scene: Arc<Scene>,
    /// The shot in full resolution.
    pub(crate) shot: Shot,
}

#[derive(Clone, Debug)]
pub(crate) enum FrameImage {
    /// A picture in this machine's memory.
    Codes(Arc<Picture>),
    /// A picture on the window's graphics device, in egui's format.
    Texture(wgpu::TextureView),
}

/// A picture that may improve with the next call.
#[derive(Clone, Debug)]
pub(crate) struct PartialFrame {
    pub(crate) image: FrameImage,
    /// The light samples of the picture; 0 without brute force.
    pub(crate) light_samples: u32,
    /// Whether the same call again improves the picture.
    pub(crate) unfinished: bool,
    /// The error of a difference by [`Picture::relative_rms`].
    pub(crate) relative_rms: Option<f64>,
}

/// Draws for the window.
pub(crate) trait RendererAdapter: Send {
    /// The name of the renderer, as from [`Renderer::name`].
    fn name(&self) -> String;

    /// Draws a request with another shot of its scene, which may be coarser. Brute force adds light samples
    /// with each call for the same shot.
    fn draw(
        &mut self,
        request: &RenderRequest,
        shot: &Shot,
        stop: Stop<'_>,
    ) -> Result<PartialFrame, RenderError>;

    /// The finished picture, for a screenshot.
    fn picture(&mut self, request: &RenderRequest, stop: Stop<'_>) -> Result<Picture, RenderError>;

    /// Why the renderer cannot draw any more.
    fn lost(&self) -> Option<String>;
}

/// Whether two shots of a scene differ only in exposure, tone curve and amplification, and have no diagram,
/// whose radiance is that of its codes.
pub(crate) fn has_same_radiance(one: &Shot, other: &Shot) -> bool {
    if one.show.modes().any(Mode::is_diagram) {
        return false;
    }
    let amplify = |show| match show {
        Show::Difference { of, from, .. } => Show::Difference { of, from, amplify: 1.0 },
        show => show,
    };
    let developed =
        Shot { exposure: one.exposure, tone: one.tone, show: amplify(other.show), ..other.clone() };
    Shot { show: amplify(one.show), ..one.clone() } == developed
}

/// Draws with any renderer, in this machine's memory.
pub(crate) struct CpuAdapter {
    renderer: Box<dyn Renderer + Send>,
    last: Option<BruteForce>,
}

/// The last picture by brute force.
struct BruteForce {
    scene_id: u64,
    shot: Shot,
    light_samples: u32,
    picture: Arc<Picture>,
}

impl CpuAdapter {
    /// The light samples of the first picture by brute force; each picture after it has four times as many.
    const FIRST: u32 = 4;

    pub(crate) fn new(renderer: Box<dyn Renderer + Send>) -> Self {
        Self { renderer, last: None }
    }

    /// A picture by brute force: with more light samples than the last one of this shot, or the last one
    /// developed again if only the development changed.
    fn brute_force(
        &mut self,
        request: &RenderRequest,
        shot: &Shot,
        stop: Stop<'_>,
    ) -> Result<(u32, Arc<Picture>), RenderError> {
        let last = self.last.as_ref().filter(|last| last.scene_id == request.scene_id);
        let (light_samples, picture) = match last {
            // With several samples in a pixel, the radiance of each is unknown.
            Some(last) if last.shot != *shot && shot.samples == 1 && has_same_radiance(&last.shot, shot) => {
                (last.light_samples, developed(&last.picture, shot))
            }
            last => {
                let again = last.filter(|last| last.shot == *shot);
                let count = again.map_or(Self::FIRST, |last| last.light_samples.saturating_mul(4));
                let light_samples = count.min(shot.light_samples);
                let shot = Shot { light_samples, ..shot.clone() };
                (light_samples, self.renderer.render(&request.scene, &shot, stop)?)
            }
        };
        let picture = Arc::new(picture);
        self.last = Some(BruteForce {
            scene_id: request.scene_id,
            shot: shot.clone(),
            light_samples,
            picture: Arc::clone(&picture),
        });
        Ok((light_samples, picture))
    }
}

/// A picture of one sample per pixel, developed with another exposure, tone curve and amplification.
fn developed(picture: &Picture, shot: &Shot) -> Picture {
    let amplify = if let Show::Difference { amplify, .. } = shot.show { amplify } else { 1.0 };
    let gain = shot.exposure.exp2() as f32;
    let background_gain = if let Background::Flat(_) = shot.background { 1.0 } else { gain };
    let display = picture.radiance.iter().map(|[red, green, blue, cover]| {
        let gain = if *cover > 0.0 { gain } else { background_gain };
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
        request: &RenderRequest,
        shot: &Shot,
        stop: Stop<'_>,
    ) -> Result<PartialFrame, RenderError> {
        let (light_samples, picture) = if shot.show.modes().any(Mode::is_brute_force) {
            self.brute_force(request, shot, stop)?
        } else {
            self.last = None;
            (0, Arc::new(self.renderer.render(&request.scene, shot, stop)?))
        };
        Ok(PartialFrame {
            relative_rms: picture.relative_rms,
            image: FrameImage::Codes(picture),
            light_samples,
            unfinished: light_samples > 0 && light_samples < shot.light_samples,
        })
    }

    fn picture(&mut self, request: &RenderRequest, stop: Stop<'_>) -> Result<Picture, RenderError> {
        self.renderer.render(&request.scene, &request.shot, stop)
    }

    fn lost(&self) -> Option<String> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit;
    use envmap::ToneMap;
    use preview::{Cpu, ViewSettings};

    #[test]
    fn brute_force_is_developed_again_without_starting_over() {
        let scene = Arc::new(testkit::scene());
        let [of, from] = [Mode::LocalShrm, Mode::BruteForce];
        let settings = ViewSettings::default();
        for show in [Show::One(from), Show::Difference { of, from, amplify: 8.0 }] {
            for background in [Background::Environment, Background::Flat([0.18; 3])] {
                let shot = Shot { show, background, ..settings.shot(&scene, scene.framing(), [24, 16]) };
                let request = RenderRequest { scene_id: 1, scene: Arc::clone(&scene), shot: shot.clone() };
                let mut renderer = CpuAdapter::new(Box::new(Cpu::new()));
                let counts =
                    [(); 2].map(|()| renderer.draw(&request, &shot, Stop::NEVER).unwrap().light_samples);
                assert_eq!(counts, [4, 16]);
                let mut bright = Shot { exposure: 1.5, tone: ToneMap::Plain, ..shot.clone() };
                if let Show::Difference { amplify, .. } = &mut bright.show {
                    *amplify = 2.0;
                }
                let partial = renderer.draw(&request, &bright, Stop::NEVER).unwrap();
                assert_eq!((partial.light_samples, partial.unfinished), (16, true));
                let FrameImage::Codes(picture) = partial.image else { panic!("the picture is in memory") };
                let wanted = Shot { light_samples: 16, ..bright.clone() };
                let whole = Cpu::new().render(&scene, &wanted, Stop::NEVER).unwrap();
                assert_eq!(picture.codes, whole.codes, "{show:?} {background:?}");
                assert_eq!(
                    renderer.draw(&request, &bright, Stop::NEVER).unwrap().light_samples,
                    64,
                    "it goes on"
                );
                let turned = Shot { turn: sphere::Rotation::from_yaw_pitch_roll(1.0, 0.0, 0.0), ..bright };
                assert_eq!(renderer.draw(&request, &turned, Stop::NEVER).unwrap().light_samples, 4);
            }
        }
    }

    #[test]
    fn a_stopped_picture_leaves_the_last_one() {
        let scene = Arc::new(testkit::scene());
        let show = Show::One(Mode::BruteForce);
        let shot = Shot { show, ..ViewSettings::default().shot(&scene, scene.framing(), [24, 16]) };
        let request = RenderRequest { scene_id: 1, scene, shot: shot.clone() };
        let mut renderer = CpuAdapter::new(Box::new(Cpu::new()));
        renderer.draw(&request, &shot, Stop::NEVER).unwrap();
        assert_eq!(renderer.draw(&request, &shot, Stop::when(&|| true)).err(), Some(RenderError::Cancelled));
        assert_eq!(renderer.draw(&request, &shot, Stop::NEVER).unwrap().light_samples, 16);
    }
}
