//! Draws on a graphics device if one is asked for and available, otherwise on the CPU.

use engine::{Failure, Steps};
use preview::{Cpu, Picture, RenderError, Renderer, Scene, Shot, cpu_steps, graphics_device};

use super::values::Backend;
use crate::values::UntilStopped;

/// The end of a message about the device, which is not part of the key, so that another one does not make a
/// result out of date.
const KEPT: &str = "; this picture stays until a parameter or an input changes";

/// Draws pictures of an item.
pub(super) struct FallbackRenderer<'a> {
    /// The steps of the item, one for each picture.
    pictures: &'a Steps<'a>,
    device: Option<Box<dyn Renderer>>,
    cpu: Cpu,
}

impl<'a> FallbackRenderer<'a> {
    /// Notes the name of the device, or warns that the CPU draws although a device was asked for.
    pub(super) fn new(backend: Backend, pictures: &'a Steps<'a>) -> Self {
        Self::with(matches!(backend, Backend::Gpu).then(graphics_device), pictures)
    }

    fn with(device: Option<Result<Box<dyn Renderer>, RenderError>>, pictures: &'a Steps<'a>) -> Self {
        let mut renderer = Self { pictures, device: None, cpu: Cpu::new() };
        match device {
            Some(Ok(device)) => {
                pictures.reporter().note(format!("drawn by {}", device.name()));
                renderer.device = Some(device);
            }
            Some(Err(error)) => renderer.warn(&error),
            None => {}
        }
        renderer
    }

    fn warn(&self, error: &RenderError) {
        let message = format!("drawn on the CPU, because the graphics device cannot draw this: {error}");
        self.pictures.reporter().warn(message + KEPT);
    }

    /// The picture of a scene. If the device cannot draw it, the CPU draws this picture and all after it.
    pub(super) fn draw(&mut self, scene: &Scene, shot: &Shot) -> Result<Picture, Failure> {
        let steps = self.pictures.part(1, cpu_steps(shot));
        steps.until_stopped(|stop| {
            if let Some(device) = &mut self.device {
                match device.render(scene, shot, stop) {
                    Err(error) if error.is_of_the_device() => {
                        self.warn(&error);
                        self.device = None;
                    }
                    done => return done.map_err(failure),
                }
            }
            self.cpu.render(scene, shot, stop).map_err(failure)
        })
    }
}

/// The failure of an item whose picture could not be drawn.
fn failure(error: RenderError) -> Failure {
    match error {
        RenderError::Cancelled => Failure::cancelled(),
        error => Failure::from(error),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use brdf::{Choice, Lambert, Material, project};
    use engine::Reporter;
    use preview::{Background, Camera, Light, Look, MapSizes, Mode, PointSet, Show};
    use sh::{Degree, Expansion, Stop};
    use sphere::{LatLong, Rotation};

    use super::*;

    /// Returns this many black pictures of one pixel, then the error.
    struct FakeRenderer(usize, RenderError);

    impl Renderer for FakeRenderer {
        fn name(&self) -> String {
            "a fake device".into()
        }

        fn render(&mut self, _: &Scene, _: &Shot, _: Stop<'_>) -> Result<Picture, RenderError> {
            self.0 = self.0.checked_sub(1).ok_or_else(|| self.1.clone())?;
            Ok(Picture { size: [1; 2], codes: vec![[0; 3]], radiance: vec![[0.0; 4]], relative_rms: None })
        }
    }

    fn scene() -> Scene {
        let grid = LatLong::with_rows(4);
        let environment = envmap::Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap();
        let white = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let flat = project(&white, Choice::Degree { f: Degree::ZERO, p: Degree::ZERO }, Stop::NEVER).unwrap();
        let reflection = shrm::Reflection::convolve(&Expansion::zero(Degree::ZERO), &flat.coefficients);
        let light = Arc::new(Light::new(environment, None));
        let look = Look::new(light, reflection, None, MapSizes { edge: 4, slices: 2 });
        Scene::of(Arc::new(mesh::shape("plane").unwrap()), Arc::new(look))
    }

    fn shot(scene: &Scene) -> Shot {
        Shot {
            size: [8, 4],
            samples: 1,
            camera: Camera::new(scene.framing()),
            turn: Rotation::IDENTITY,
            show: Show::One(Mode::Mirror),
            background: Background::Environment,
            exposure: 0.0,
            tone: envmap::ToneMap::Plain,
            light_samples: 1,
            points: PointSet::Even,
        }
    }

    #[test]
    fn without_a_device_the_cpu_draws_with_a_warning_that_says_why() {
        let reporter = Reporter::default();
        let pictures = Steps::new(&reporter, 3);
        let none = RenderError::Device("no adapter was found".into());
        let scene = scene();
        let mut renderer = FallbackRenderer::with(Some(Err(none)), &pictures);
        assert_eq!(renderer.draw(&scene, &shot(&scene)).unwrap().codes.len(), 32);
        let expected = "drawn on the CPU, because the graphics device cannot draw this: no adapter was found";
        assert_eq!(reporter.warnings(), [format!("{expected}{KEPT}")]);
    }

    #[test]
    fn after_an_error_of_the_device_the_cpu_draws() {
        let reporter = Reporter::default();
        let pictures = Steps::new(&reporter, 3);
        let lost = FakeRenderer(1, RenderError::Limit { what: "the map".into(), asked: 9, limit: 8 });
        let (scene, mut renderer) = (scene(), FallbackRenderer::with(Some(Ok(Box::new(lost))), &pictures));
        let drawn = [(); 3].map(|()| renderer.draw(&scene, &shot(&scene)).unwrap().codes.len());
        assert_eq!(drawn, [1, 32, 32]);
        assert_eq!(reporter.notes(), ["drawn by a fake device"]);
        assert_eq!(reporter.warnings().len(), 1, "{:?}", reporter.warnings());
    }

    #[test]
    fn an_error_that_is_not_of_the_device_fails_the_item() {
        let reporter = Reporter::default();
        let pictures = Steps::new(&reporter, 3);
        let faulty = FakeRenderer(0, RenderError::Maps("a map is too large".into()));
        let (scene, mut renderer) = (scene(), FallbackRenderer::with(Some(Ok(Box::new(faulty))), &pictures));
        let failure = renderer.draw(&scene, &shot(&scene)).unwrap_err();
        assert_eq!((failure.to_string().as_str(), failure.cancelled), ("a map is too large", false));
        let stopped = FakeRenderer(0, RenderError::Cancelled);
        assert!(
            FallbackRenderer::with(Some(Ok(Box::new(stopped))), &pictures)
                .draw(&scene, &shot(&scene))
                .unwrap_err()
                .cancelled
        );
    }
}
