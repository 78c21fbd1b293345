//! Pictures through wgpu, on Vulkan, Metal, Direct3D 12 or OpenGL.
//!
//! Shading is deferred. For each sample of a pixel, `raster.wgsl` draws all meshes into a surface buffer: normal, tangent and the
//! object's number. `shade.wgsl` runs a mode over the samples that see an object, into a buffer of radiance; brute force
//! adds to what is there. `develop.wgsl` adds background or radiance, developed, to the pixel's sums, and after the last sample
//! makes codes. These files hold bindings and entry points, and choose what a pixel shows as the CPU's frame does; every
//! formula is in `shading/`, where each shader has its twin.
//!
//! Samples of a pixel come one after the other, so that memory does not grow with their number. Texels are loaded
//! and blended by the shaders: samplers have eight bits of weight and their own rules at a cube's corners.

mod canvas;
mod device;
mod frame;
mod kept;
mod layouts;
mod maps;
mod memory;
mod mesh;
mod numbers;
mod pace;
mod readback;
mod resources;
#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use ::mesh::Mesh;
use glam::DAffine3;

use crate::{Camera, Look, Mode, Picture, RenderError, Renderer, Scene, Shot, Show};
use canvas::Canvas;
use device::Device;
pub use device::Health;
use frame::Frame;
use kept::Identity;
use pace::{Batches, Pace};
use readback::{Readback, squares};
use resources::Resources;

/// Draws through a graphics device.
///
/// What it has put on the device for a mesh, a look or a light is kept while scenes use it, by the identity of their
/// `Arc`s, and dropped with the first scene that does not.
#[derive(Debug)]
pub struct Gpu {
    resources: Resources,
    /// What [`Gpu::draw`] goes on with.
    canvas: Option<Canvas>,
    gathered: Option<Accumulation>,
    pace: Pace,
    figure: RmsReadback,
}

/// How far a picture has come that is drawn again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// The light samples that are in it, of each sample of a pixel: 0 where no brute force is shown.
    pub light_samples: u32,
    /// Whether the same call again would show or tell more.
    pub unfinished: bool,
    /// Of a difference: [`Picture::relative_rms`] as it was lately.
    pub relative_rms: Option<f64>,
}

/// What light samples were gathered for, and how many.
#[derive(Debug, PartialEq)]
struct Accumulation {
    objects: Vec<(Identity<Mesh>, Identity<Look>, DAffine3)>,
    camera: Camera,
    turn: sphere::Rotation,
    modes: [Option<Mode>; 2],
    light_samples: u32,
}

/// How large a difference is, as far as it was told.
#[derive(Debug, Default)]
struct RmsReadback {
    modes: [Option<Mode>; 2],
    coming: Option<Readback>,
    /// Whether something was drawn that is in no figure yet.
    is_old: bool,
    relative_rms: Option<f64>,
}

impl Gpu {
    /// The format of [`Gpu::draw`]'s target: sRGB codes, as egui wants its textures.
    pub const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

    /// The names of this machine's graphics adapters, the best first, usable or not.
    pub fn adapters() -> Vec<String> {
        device::adapters().iter().map(|adapter| device::name(&adapter.get_info())).collect()
    }

    /// The best graphics device of this machine, a software one where there is no other. `WGPU_BACKEND` (`vulkan`,
    /// `dx12`, `metal`, `gl`) says which backends are looked at.
    ///
    /// # Errors
    /// [`RenderError::Device`] where there is none that will do.
    pub fn new() -> Result<Self, RenderError> {
        Device::best(Self::on)
    }

    /// Draws through a device that exists already, made by [`Gpu::device_descriptor`]. Its handlers of uncaptured errors
    /// and of its loss become those of this renderer, which turns both into errors of the next call.
    ///
    /// # Errors
    /// [`RenderError::Device`] where it will not do.
    pub fn with_device(
        info: wgpu::AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        Self::on(Device::new(info, device, queue))
    }

    /// What must be asked of an adapter for [`Gpu::with_device`].
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        device::descriptor(adapter)
    }

    fn on(device: Device) -> Result<Self, RenderError> {
        let resources = device.guarded(|| Resources::new(device.clone(), Self::TARGET))?;
        let (pace, figure) = (Pace::default(), RmsReadback::default());
        Ok(Self { resources, canvas: None, gathered: None, pace, figure })
    }

    /// What tells of the loss of the device.
    pub fn health(&self) -> Health {
        self.resources.device.health()
    }

    /// Draws a scene into a texture of [`Gpu::TARGET`] with [`wgpu::TextureUsages::RENDER_ATTACHMENT`], of the shot's
    /// size. It does not wait for the picture, but for the last but two where the device is as far behind.
    ///
    /// Brute force comes bit by bit: each call adds some light samples, as many as a frame has time for, up to
    /// [`Shot::light_samples`], while objects, size, samples, camera, turn and modes stay the same; exposure, tone,
    /// background and divider may change.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        target: &wgpu::TextureView,
    ) -> Result<Drawn, RenderError> {
        if shot.size.contains(&0) {
            return Ok(Drawn::default());
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
        device.guarded(|| self.draw_some(scene, shot, target))
    }

    /// Draws as [`Gpu::draw`] does, into a texture of its own, and waits for the device: how long that takes.
    ///
    /// # Errors
    /// As [`Gpu::draw`].
    pub fn timed(&mut self, scene: &Scene, shot: &Shot) -> Result<(Duration, Drawn), RenderError> {
        let device = self.resources.device.clone();
        let [width, height] = shot.size.map(|side| u64::from(side.max(1)));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let target = device
            .guarded(|| device.texture("the picture", Self::TARGET, usage, [width, height, 1]))?
            .create_view(&wgpu::TextureViewDescriptor::default());
        let begun = Instant::now();
        let drawn = self.draw(scene, shot, &target)?;
        let waited = device.device.poll(wgpu::PollType::wait_indefinitely());
        let took = begun.elapsed();
        device.sound()?;
        waited.map_err(|error| device.fault(&error.to_string()))?;
        Ok((took, drawn))
    }

    fn draw_some(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        target: &wgpu::TextureView,
    ) -> Result<Drawn, RenderError> {
        self.pace.keep(&self.resources.device)?;
        self.resources.prepare(scene, shot)?;
        let Resources { device, layouts, .. } = &self.resources;
        let samples = shot.samples.clamp(1, 4);
        if self.canvas.as_ref().is_some_and(|old| (old.size, old.samples) != (shot.size, samples)) {
            self.canvas = None;
            self.gathered = None;
        }
        let mut canvas = match self.canvas.take() {
            Some(canvas) => canvas,
            None => Canvas::new(device, layouts, shot.size, samples)?,
        };
        let modes = sides(shot.show);
        let mut gathered = Accumulation::new(scene, shot);
        let mut same = false;
        if let Some(before) = self.gathered.take() {
            let light_samples = before.light_samples;
            if light_samples <= shot.light_samples
                && (Accumulation { light_samples: 0, ..before }) == gathered
            {
                gathered.light_samples = light_samples;
                same = true;
            }
        }
        let gathers = |mode: Option<Mode>| mode == Some(Mode::BruteForce);
        for side in 0..2 {
            let count = if gathers(modes[side]) { samples * samples } else { 1 };
            canvas.reserve(device, side, if modes[side].is_some() { count as usize } else { 0 })?;
        }
        let before = gathered.light_samples;
        let missing = shot.light_samples.max(1) - before;
        let add = match modes.into_iter().any(gathers) {
            true => self.pace.next().min(missing),
            false => 0,
        };
        gathered.light_samples += add;
        let frame = Frame::new(scene, shot, &self.resources, &canvas)?;
        let mut encoder = device.encoder();
        frame.update(&mut encoder);
        for sample in 0..(samples * samples) as usize {
            frame.sample(&mut encoder, sample, |encoder, side| {
                if before == 0 {
                    frame.clear(encoder, side, sample);
                }
                let lights = before..gathered.light_samples;
                frame.shade(encoder, (side, Mode::BruteForce), sample, 0..shot.size[0], lights)?;
                Ok(gathered.light_samples)
            })?;
        }
        frame.present(&mut encoder, target);
        device.queue.submit([encoder.finish()]);
        self.pace.sent(&device.queue);
        self.figure.follow(device, &canvas, shot.show, !same || add > 0)?;
        let drawn = Drawn {
            light_samples: gathered.light_samples,
            unfinished: add < missing && modes.into_iter().any(gathers) || self.figure.is_awaited(),
            relative_rms: self.figure.relative_rms,
        };
        (self.canvas, self.gathered) = (Some(canvas), Some(gathered));
        Ok(drawn)
    }

    fn render_whole(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        let go_on = || if stop() { Err(RenderError::Cancelled) } else { Ok(()) };
        go_on()?;
        self.resources.prepare(scene, shot)?;
        let Resources { device, layouts, .. } = &self.resources;
        let samples = shot.samples.clamp(1, 4);
        let mut canvas = Canvas::new(device, layouts, shot.size, samples)?;
        let modes = sides(shot.show);
        for side in 0..2 {
            canvas.reserve(device, side, usize::from(modes[side].is_some()))?;
        }
        let frame = Frame::new(scene, shot, &self.resources, &canvas)?;
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
                        frame.shade(encoder, (side, Mode::BruteForce), sample, columns, lights)?;
                    }
                    device.queue.submit([std::mem::replace(encoder, device.encoder()).finish()]);
                    device.wait()?;
                    batches.done();
                    go_on()?;
                }
                Ok(light_samples)
            })?;
            go_on()?;
        }
        device.queue.submit([encoder.finish()]);
        let difference = matches!(shot.show, Show::Difference { .. });
        let radiances = Readback::begin(device, &canvas.radiances)?;
        let codes = Readback::begin(device, &canvas.codes)?;
        let parts = if difference { Some(Readback::begin(device, &canvas.squares)?) } else { None };
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

    fn render(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        if shot.size.contains(&0) {
            return Ok(Picture { size: shot.size, codes: vec![], radiance: vec![], relative_rms: None });
        }
        let device = self.resources.device.clone();
        device.guarded(|| self.render_whole(scene, shot, stop))
    }
}

impl Accumulation {
    /// Nothing yet, of a scene in a shot.
    fn new(scene: &Scene, shot: &Shot) -> Self {
        let objects = scene.objects.iter();
        Self {
            objects: objects
                .map(|object| (Identity::of(&object.mesh), Identity::of(&object.look), object.place))
                .collect(),
            camera: shot.camera,
            turn: shot.turn,
            modes: sides(shot.show),
            light_samples: 0,
        }
    }
}

impl RmsReadback {
    /// Takes what has come, and asks for the figure of what was drawn just now where that is new and nothing is on its way.
    fn follow(
        &mut self,
        device: &Device,
        canvas: &Canvas,
        show: Show,
        is_new: bool,
    ) -> Result<(), RenderError> {
        let modes = match show {
            Show::Difference { .. } => sides(show),
            _ => [None; 2],
        };
        if modes != self.modes {
            *self = Self { modes, ..Self::default() };
        }
        if let Some(coming) = self.coming.take_if(|coming| coming.is_done()) {
            self.relative_rms = squares(&coming.take(device)?).relative_rms();
        }
        self.is_old |= is_new && modes[0].is_some();
        if self.is_old && self.coming.is_none() {
            self.coming = Some(Readback::begin(device, &canvas.squares)?);
            self.is_old = false;
        }
        Ok(())
    }

    /// Whether a newer figure is there to be told.
    fn is_awaited(&self) -> bool {
        self.is_old || self.coming.is_some()
    }
}

/// The modes of the first and the second side of a picture; a difference of a mode from itself has both.
fn sides(show: Show) -> [Option<Mode>; 2] {
    match show {
        Show::One(mode) => [Some(mode), None],
        Show::Split { left, right, .. } => [Some(left), Some(right)],
        Show::Difference { of, from, .. } => [Some(of), Some(from)],
    }
}
