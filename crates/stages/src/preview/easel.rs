//! What draws: a graphics device where one is asked for and there is one, else the CPU.

use engine::Context;
use engine::Failure;
use preview::{Cpu, Picture, RenderError, Renderer, Scene, Shot, graphics_device};

use super::{Backend, failure};

/// What a key does not hold cannot make a result out of date.
const KEPT: &str = "; this picture stays until a parameter or an input changes";

/// Draws pictures of an item.
pub(super) struct Easel<'a, 'b> {
    context: &'a Context<'b>,
    device: Option<Box<dyn Renderer>>,
    cpu: Cpu,
}

impl<'a, 'b> Easel<'a, 'b> {
    /// An easel; it tells what draws, and warns where that is not what was asked for.
    pub(super) fn new(backend: Backend, context: &'a Context<'b>) -> Self {
        Self::with(matches!(backend, Backend::Gpu).then(graphics_device), context)
    }

    fn with(device: Option<Result<Box<dyn Renderer>, RenderError>>, context: &'a Context<'b>) -> Self {
        let mut easel = Self { context, device: None, cpu: Cpu::new() };
        match device {
            Some(Ok(device)) => {
                context.note(format!("drawn by {}", device.name()));
                easel.device = Some(device);
            }
            Some(Err(error)) => easel.warn(&error),
            None => {}
        }
        easel
    }

    fn warn(&self, error: &RenderError) {
        let message = format!("drawn on the CPU, because the graphics device cannot: {error}");
        self.context.warn(message + KEPT);
    }

    /// The picture of a scene. What the device cannot draw the CPU does, this picture and all after it.
    pub(super) fn draw(&mut self, scene: &Scene, shot: &Shot) -> Result<Picture, Failure> {
        let context = self.context;
        let stop = || context.check_cancelled().is_err();
        if let Some(device) = &mut self.device {
            match device.render(scene, shot, &stop) {
                Err(error) if error.is_of_the_device() => {
                    self.warn(&error);
                    self.device = None;
                }
                done => return done.map_err(failure),
            }
        }
        self.cpu.render(scene, shot, &stop).map_err(failure)
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::path::Path;
    use std::sync::Arc;

    use brdf::{Choice, Lambert, Material, project};
    use engine::Files;
    use preview::{Background, Camera, Light, Look, MapSizes, Mode, Show};
    use sh::{Degree, Expansion};
    use sphere::{LatLong, Rotation};

    use super::*;

    struct NoFiles;

    impl Files for NoFiles {
        fn read(&self, _: &Path) -> io::Result<Arc<Vec<u8>>> {
            Err(io::ErrorKind::NotFound.into())
        }

        fn list(&self, _: &Path) -> io::Result<Vec<(String, bool)>> {
            Err(io::ErrorKind::NotFound.into())
        }

        fn is_folder(&self, _: &Path) -> bool {
            false
        }
    }

    /// Makes so many black pictures of one pixel, then answers with an error.
    struct Pretence(usize, RenderError);

    impl Renderer for Pretence {
        fn name(&self) -> String {
            "a pretence".into()
        }

        fn render(
            &mut self,
            _: &Scene,
            _: &Shot,
            _: &(dyn Fn() -> bool + Sync),
        ) -> Result<Picture, RenderError> {
            self.0 = self.0.checked_sub(1).ok_or_else(|| self.1.clone())?;
            Ok(Picture { size: [1; 2], codes: vec![[0; 3]], radiance: vec![[0.0; 4]], relative_rms: None })
        }
    }

    fn scene() -> Scene {
        let grid = LatLong::with_rows(4);
        let environment = envmap::Environment::new(grid, vec![[1.0; 3]; grid.len()]).unwrap();
        let white = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let flat = project(&white, Choice::Degree { f: Degree::ZERO, p: Degree::ZERO }).unwrap();
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
        }
    }

    #[test]
    fn without_a_device_the_cpu_draws_and_it_is_told_why() {
        let context = Context::new(&NoFiles);
        let none = RenderError::Device("no adapter was found".into());
        let scene = scene();
        let mut easel = Easel::with(Some(Err(none)), &context);
        assert_eq!(easel.draw(&scene, &shot(&scene)).unwrap().codes.len(), 32);
        let expected = "drawn on the CPU, because the graphics device cannot: no adapter was found";
        assert_eq!(context.warnings(), [format!("{expected}{KEPT}")]);
    }

    #[test]
    fn what_a_device_stops_drawing_the_cpu_goes_on_with() {
        let context = Context::new(&NoFiles);
        let lost = Pretence(1, RenderError::Limit { what: "the map".into(), asked: 9, limit: 8 });
        let (scene, mut easel) = (scene(), Easel::with(Some(Ok(Box::new(lost))), &context));
        let drawn = [(); 3].map(|()| easel.draw(&scene, &shot(&scene)).unwrap().codes.len());
        assert_eq!(drawn, [1, 32, 32]);
        assert_eq!(context.notes(), ["drawn by a pretence"]);
        assert_eq!(context.warnings().len(), 1, "{:?}", context.warnings());
    }

    #[test]
    fn what_is_no_matter_of_the_device_is_a_failure() {
        let context = Context::new(&NoFiles);
        let faulty = Pretence(0, RenderError::Maps("a map is too large".into()));
        let (scene, mut easel) = (scene(), Easel::with(Some(Ok(Box::new(faulty))), &context));
        let failure = easel.draw(&scene, &shot(&scene)).unwrap_err();
        assert_eq!((failure.to_string().as_str(), failure.cancelled), ("a map is too large", false));
        let stopped = Pretence(0, RenderError::Cancelled);
        assert!(
            Easel::with(Some(Ok(Box::new(stopped))), &context)
                .draw(&scene, &shot(&scene))
                .unwrap_err()
                .cancelled
        );
    }
}
