//! Pictures through wgpu, on Vulkan, Metal, Direct3D 12 or OpenGL.
//!
//! Shading is deferred. For each sample of a pixel, `raster.wgsl` draws all meshes into a surface buffer:
//! normal, tangent and object number. `shade.wgsl` runs a mode over the samples that hit an object, into a
//! buffer of radiance, to which brute force adds. `develop.wgsl` adds the developed background or radiance to
//! the pixel's sums, and computes the codes after the last sample. These files have bindings and entry
//! points, and choose what a pixel shows, as the CPU's `BandRenderer` does. All formulas are in `shading/`,
//! where each shader has its twin. In the modes that shade vertices, `vertices.wgsl` does so before, and
//! `raster.wgsl` draws their radiance as the map that the mode reads; for shadows it draws positions.
//! Where brute force follows the product of light and material, `product.wgsl` makes its tables when the
//! view changes. If an object has a texture, `coloured.wgsl` draws the base colours of all, by which
//! `textured.wgsl` changes the radiance before it is developed.
//!
//! The samples of a pixel are drawn one after another, so that memory does not grow with their number. The
//! shaders load and blend texels themselves, because samplers have weights of eight bits and their own rules
//! at a cube's corners.

mod canvas;
mod device;
mod frame_encoder;
mod identity_cache;
mod layouts;
mod maps;
mod memory;
mod mesh;
mod product;
mod readback;
mod resources;
mod sample_budget;
mod shader_sources;
mod shadow_tree;
#[cfg(test)]
mod tests;
mod textures;
mod vertex_light;
#[cfg(test)]
mod web_shaders;

use std::time::{Duration, Instant};

use ::mesh::Mesh;
use glam::DAffine3;
use sh::Stop;

use crate::diagram::Diagram;
use crate::{Camera, Look, Mode, Picture, PointSet, RenderError, Renderer, Scene, Shot, Show};
use canvas::DeviceCanvas;
use device::Device;
pub use device::DeviceStatus;
use frame_encoder::{FrameEncoder, draws_map};
use identity_cache::Identity;
use readback::{Readback, squares};
use resources::Resources;
use sample_budget::{Batches, SampleBudget};

/// Draws through a graphics device.
///
/// It caches the device's resources of a mesh, a look or a light by the identity of their `Arc`s, until a
/// scene does not use them.
#[derive(Debug)]
pub struct Gpu {
    resources: Resources,
    /// The buffers that [`Gpu::draw`] reuses.
    canvas: Option<DeviceCanvas>,
    accumulation: Option<Accumulation>,
    sample_budget: SampleBudget,
    rms: RmsReadback,
    diagram: Diagram,
}

/// The progress of a picture that is drawn repeatedly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrawProgress {
    /// The light samples of each sample of a pixel so far; 0 without brute force.
    pub light_samples: u32,
    /// Whether the same call again would improve the picture or its RMS.
    pub unfinished: bool,
    /// The latest [`Picture::relative_rms`] of a difference.
    pub relative_rms: Option<f64>,
}

/// The changes that a call of [`Gpu::draw`] made to the picture.
#[derive(Debug, Default)]
struct Added {
    /// The light samples of each sample of a pixel so far, the value of [`DrawProgress::light_samples`].
    light_samples: u32,
    /// Whether the next call adds light samples.
    unfinished: bool,
    /// Whether the call changed anything.
    is_new: bool,
}

/// The view that light samples were accumulated for, and their number.
#[derive(Debug, PartialEq)]
struct Accumulation {
    objects: Vec<(Identity<Mesh>, Identity<Look>, DAffine3)>,
    camera: Camera,
    turn: sphere::Rotation,
    modes: [Option<Mode>; 2],
    points: PointSet,
    light_samples: u32,
}

/// Reads back the RMS of a difference.
#[derive(Debug, Default)]
struct RmsReadback {
    modes: [Option<Mode>; 2],
    pending: Option<Readback>,
    /// Whether the picture changed after the last readback.
    is_stale: bool,
    relative_rms: Option<f64>,
}

impl Gpu {
    /// The format of [`Gpu::draw`]'s target: sRGB codes, the format of egui's textures.
    pub const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

    /// The names of this machine's graphics adapters, the best first, including unusable ones.
    pub fn adapters() -> Vec<String> {
        device::adapters().iter().map(|adapter| device::name(&adapter.get_info())).collect()
    }

    /// The best graphics device of this machine, a software one if there is no other. `WGPU_BACKEND`
    /// (`vulkan`, `dx12`, `metal`, `gl`) restricts the backends.
    ///
    /// # Errors
    /// [`RenderError::Device`] if there is no suitable one.
    pub fn new() -> Result<Self, RenderError> {
        Device::best(Self::on)
    }

    /// Draws through an existing device that was requested with [`Gpu::device_descriptor`]. This renderer
    /// replaces the device's handlers of uncaptured errors and of its loss, and reports both as errors of the
    /// next call.
    ///
    /// # Errors
    /// [`RenderError::Device`] if it is not suitable.
    pub fn with_device(
        info: wgpu::AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        Self::on(Device::new(info, device, queue))
    }

    /// The best of these adapters that draws on the surface and makes a device for [`Gpu::with_device`].
    ///
    /// # Errors
    /// Why none of them does.
    pub fn best_adapter(
        adapters: &[wgpu::Adapter],
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<wgpu::Adapter, String> {
        device::best_for(adapters, surface)
    }

    /// The device to request from an adapter for [`Gpu::with_device`].
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        device::descriptor(adapter)
    }

    fn on(device: Device) -> Result<Self, RenderError> {
        let resources = device.guarded(|| Resources::new(device.clone(), Self::TARGET))?;
        let (sample_budget, rms) = (SampleBudget::default(), RmsReadback::default());
        let diagram = Diagram::default();
        Ok(Self { resources, canvas: None, accumulation: None, sample_budget, rms, diagram })
    }

    /// The number of times that a light was brought to the vertices of the scene's objects.
    pub fn light_passes(&self) -> u32 {
        self.resources.vertex_lights.values().map(|light| light.passes).sum()
    }

    /// Reports the loss of the device, from any thread.
    pub fn status(&self) -> DeviceStatus {
        self.resources.device.status()
    }

    /// Draws a scene into a texture of [`Gpu::TARGET`] with [`wgpu::TextureUsages::RENDER_ATTACHMENT`] and
    /// the shot's size. It does not wait for the picture, unless the device is more than two pictures behind.
    ///
    /// Each call adds some light samples to brute force, as many as a frame has time for, up to
    /// [`Shot::light_samples`]. They are kept while objects, size, samples, camera, light and modes stay the
    /// same; exposure, tone curve, background and divider may change.
    ///
    /// # Errors
    /// The errors of [`Renderer::render`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        target: &wgpu::TextureView,
    ) -> Result<DrawProgress, RenderError> {
        if shot.size.contains(&0) {
            return Ok(DrawProgress::default());
        }
        let device = self.resources.device.clone();
        let texture = target.texture();
        if ([texture.width(), texture.height()], texture.format()) != (shot.size, Self::TARGET) {
            return Err(RenderError::Device(format!(
                "the texture to draw into is {} x {}, {:?}; expected {} x {}, {:?}",
                texture.width(),
                texture.height(),
                texture.format(),
                shot.size[0],
                shot.size[1],
                Self::TARGET
            )));
        }
        device.guarded(|| self.draw_some(scene, &shot.of(scene), target))
    }

    /// Draws as [`Gpu::draw`] does, into its own texture, waits for the device, and returns the time.
    ///
    /// # Errors
    /// The errors of [`Gpu::draw`].
    pub fn timed(&mut self, scene: &Scene, shot: &Shot) -> Result<(Duration, DrawProgress), RenderError> {
        let device = self.resources.device.clone();
        let [width, height] = shot.size.map(|side| u64::from(side.max(1)));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let target = device
            .guarded(|| device.texture("the picture", Self::TARGET, usage, [width, height, 1]))?
            .create_view(&wgpu::TextureViewDescriptor::default());
        let start = Instant::now();
        let drawn = self.draw(scene, shot, &target)?;
        let waited = device.device.poll(wgpu::PollType::wait_indefinitely());
        let took = start.elapsed();
        device.check()?;
        waited.map_err(|error| device.error(&error.to_string()))?;
        Ok((took, drawn))
    }

    fn draw_some(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        target: &wgpu::TextureView,
    ) -> Result<DrawProgress, RenderError> {
        let device = self.resources.device.clone();
        self.sample_budget.wait(&device)?;
        let samples = shot.samples.clamp(1, 4);
        if self.canvas.as_ref().is_some_and(|old| (old.size, old.samples) != (shot.size, samples)) {
            self.canvas = None;
            self.accumulation = None;
        }
        let mut canvas = match self.canvas.take() {
            Some(canvas) => canvas,
            None => DeviceCanvas::new(&device, &self.resources.layouts, shot.size, samples)?,
        };
        let (columns, beside) = shot.show.beside_diagram(shot.size[0]);
        let mut encoder = device.encoder();
        let mut added = Added::default();
        match beside {
            Some(show) => {
                let shot = Shot { show, ..shot.clone() };
                added = self.add_samples(scene, &shot, &mut canvas, &mut encoder)?;
            }
            None => self.accumulation = None,
        }
        if !columns.is_empty() {
            // A write comes before all work that is submitted after it.
            device.queue.submit([std::mem::replace(&mut encoder, device.encoder()).finish()]);
            let diagram = self.diagram.draw(scene, shot, columns.end - columns.start);
            canvas.place_diagram(&device, columns, diagram);
        }
        canvas.present(&self.resources.pipelines.present, &mut encoder, target);
        device.queue.submit([encoder.finish()]);
        self.sample_budget.submitted(&device.queue);
        self.rms.update(&device, &canvas, shot.show, added.is_new)?;
        self.canvas = Some(canvas);
        Ok(DrawProgress {
            light_samples: added.light_samples,
            unfinished: added.unfinished || self.rms.is_pending(),
            relative_rms: self.rms.relative_rms,
        })
    }

    /// Draws surfaces and background, and adds light samples to brute force.
    fn add_samples(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        canvas: &mut DeviceCanvas,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Result<Added, RenderError> {
        let samples = canvas.samples;
        let modes = shot.show.sides();
        let mut accumulation = Accumulation::new(scene, shot);
        let mut same = false;
        if let Some(before) = self.accumulation.take() {
            let light_samples = before.light_samples;
            if light_samples <= shot.light_samples
                && (Accumulation { light_samples: 0, ..before }) == accumulation
            {
                accumulation.light_samples = light_samples;
                same = true;
            }
        }
        let is_brute_force = |mode: Option<Mode>| mode.is_some_and(Mode::is_brute_force);
        let before = accumulation.light_samples;
        let missing = shot.light_samples.max(1) - before;
        let add = match modes.into_iter().any(is_brute_force) {
            true => self.sample_budget.next().min(missing),
            false => 0,
        };
        accumulation.light_samples += add;
        self.resources.prepare(scene, shot, accumulation.light_samples)?;
        let Resources { device, layouts, .. } = &self.resources;
        for side in 0..2 {
            let count = if is_brute_force(modes[side]) { samples * samples } else { 1 };
            canvas.reserve(device, side, if modes[side].is_some() { count as usize } else { 0 })?;
        }
        if shot.show.modes().any(draws_map) {
            canvas.reserve_drawn_map(device, layouts)?;
        }
        if self.resources.textures.is_shown {
            canvas.reserve_colours(device)?;
        }
        let frame = FrameEncoder::new(scene, shot, &self.resources, canvas)?;
        frame.update(encoder);
        for sample in 0..(samples * samples) as usize {
            frame.sample(encoder, sample, |encoder, side| {
                if before == 0 {
                    frame.clear(encoder, side, sample);
                }
                let lights = before..accumulation.light_samples;
                let mode = modes[side].unwrap_or(Mode::BruteForce);
                frame.shade(encoder, side, mode, sample, 0..shot.size[0], lights)?;
                Ok(accumulation.light_samples)
            })?;
        }
        let added = Added {
            light_samples: accumulation.light_samples,
            unfinished: add < missing && modes.into_iter().any(is_brute_force),
            is_new: !same || add > 0,
        };
        self.accumulation = Some(accumulation);
        Ok(added)
    }

    fn render_whole(&mut self, scene: &Scene, shot: &Shot, stop: Stop<'_>) -> Result<Picture, RenderError> {
        stop.check()?;
        self.resources.prepare(scene, shot, shot.light_samples)?;
        let Resources { device, layouts, .. } = &self.resources;
        let samples = shot.samples.clamp(1, 4);
        let mut canvas = DeviceCanvas::new(device, layouts, shot.size, samples)?;
        let modes = shot.show.sides();
        for side in 0..2 {
            canvas.reserve(device, side, usize::from(modes[side].is_some()))?;
        }
        if shot.show.modes().any(draws_map) {
            canvas.reserve_drawn_map(device, layouts)?;
        }
        if self.resources.textures.is_shown {
            canvas.reserve_colours(device)?;
        }
        let frame = FrameEncoder::new(scene, shot, &self.resources, &canvas)?;
        let mut encoder = device.encoder();
        frame.update(&mut encoder);
        for sample in 0..(samples * samples) as usize {
            frame.sample(&mut encoder, sample, |encoder, side| {
                frame.clear(encoder, side, sample);
                let light_samples = shot.light_samples.max(1);
                let mut batches = Batches::new(shot.size, light_samples);
                while let Some(batch) = batches.next() {
                    for lights in batch {
                        let columns = frame.columns(side);
                        let mode = modes[side].unwrap_or(Mode::BruteForce);
                        frame.shade(encoder, side, mode, sample, columns, lights)?;
                    }
                    device.queue.submit([std::mem::replace(encoder, device.encoder()).finish()]);
                    device.wait()?;
                    batches.done();
                    stop.check()?;
                }
                Ok(light_samples)
            })?;
            stop.check()?;
        }
        device.queue.submit([encoder.finish()]);
        let difference = matches!(shot.show, Show::Difference { .. });
        let radiances = Readback::start(device, &canvas.radiances)?;
        let codes = Readback::start(device, &canvas.codes)?;
        let parts = if difference { Some(Readback::start(device, &canvas.squares)?) } else { None };
        device.wait()?;
        let pixels = shot.size[0] as usize * shot.size[1] as usize;
        let share = 1.0 / (samples * samples) as f32;
        let radiance = radiances.take::<[f32; 4]>(device)?;
        let codes = codes.take::<[u8; 4]>(device)?;
        Ok(Picture {
            size: shot.size,
            codes: codes.into_iter().take(pixels).map(|[r, g, b, _]| [r, g, b]).collect(),
            radiance: radiance.into_iter().take(pixels).map(|sum| sum.map(|value| value * share)).collect(),
            relative_rms: match parts {
                Some(parts) => squares(&parts.take(device)?).relative_rms(),
                None => None,
            },
        })
    }
}

impl Renderer for Gpu {
    fn name(&self) -> String {
        self.resources.device.name()
    }

    fn render(&mut self, scene: &Scene, shot: &Shot, stop: Stop<'_>) -> Result<Picture, RenderError> {
        if shot.size.contains(&0) {
            return Ok(Picture { size: shot.size, codes: vec![], radiance: vec![], relative_rms: None });
        }
        let device = self.resources.device.clone();
        let shot = &shot.of(scene);
        let (columns, beside) = shot.show.beside_diagram(shot.size[0]);
        let mut picture = match beside {
            Some(show) => {
                let shot = Shot { show, ..shot.clone() };
                device.guarded(|| self.render_whole(scene, &shot, stop))?
            }
            None => Picture::black(shot.size),
        };
        if !columns.is_empty() {
            stop.check()?;
            let diagram = self.diagram.draw(scene, shot, columns.end - columns.start);
            picture.place_diagram(columns, diagram);
        }
        Ok(picture)
    }
}

impl Accumulation {
    /// The view of a shot, without light samples.
    fn new(scene: &Scene, shot: &Shot) -> Self {
        let objects = scene.objects.iter();
        Self {
            objects: objects
                .map(|object| (Identity::of(&object.mesh), Identity::of(&object.look), object.place))
                .collect(),
            camera: shot.camera,
            turn: shot.turn,
            modes: shot.show.sides(),
            points: shot.points,
            light_samples: 0,
        }
    }
}

impl RmsReadback {
    /// Takes a finished readback, and starts the next one if the picture changed and none is pending.
    fn update(
        &mut self,
        device: &Device,
        canvas: &DeviceCanvas,
        show: Show,
        is_new: bool,
    ) -> Result<(), RenderError> {
        let modes = match show {
            Show::Difference { .. } => show.sides(),
            _ => [None; 2],
        };
        if modes != self.modes {
            *self = Self { modes, ..Self::default() };
        }
        if let Some(readback) = self.pending.take_if(|readback| readback.is_done()) {
            self.relative_rms = squares(&readback.take(device)?).relative_rms();
        }
        self.is_stale |= is_new && modes[0].is_some();
        if self.is_stale && self.pending.is_none() {
            self.pending = Some(Readback::start(device, &canvas.squares)?);
            self.is_stale = false;
        }
        Ok(())
    }

    /// Whether a newer RMS will follow.
    fn is_pending(&self) -> bool {
        self.is_stale || self.pending.is_some()
    }
}
