//! The graphics device: which adapter, what is asked of it, and what becomes of its errors.
//!
//! wgpu panics on an error that nobody waits for. Here none stays unheard: [`Device::guarded`] catches those of its own
//! thread, handlers keep those that come later and the loss of the device, and each becomes a [`RenderError::Device`].

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use wgpu::{AdapterInfo, DeviceType, DownlevelFlags, ErrorFilter, TextureFormat, TextureUsages};

use super::canvas::GROUP;
use super::layouts::{COLOUR_BYTES, GROUPS, STORAGE_BUFFERS};
use crate::RenderError;

/// Whether a device still works, told to any thread.
#[derive(Clone, Debug)]
pub struct Health(Arc<Faults>);

impl Health {
    /// Why the device does nothing any more; known once it was polled after that.
    pub fn lost(&self) -> Option<String> {
        self.0.lost.lock().clone()
    }
}

/// A device, its queue, and what went wrong with them.
#[derive(Clone, Debug)]
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    info: AdapterInfo,
    faults: Arc<Faults>,
}

/// How long to sleep between looks at the device.
pub(super) const LOOK: Duration = Duration::from_micros(100);

/// What went wrong outside of any call.
#[derive(Debug, Default)]
struct Faults {
    lost: Mutex<Option<String>>,
    error: Mutex<Option<String>>,
}

impl Device {
    /// What can be made on the best adapter of this machine on which it can: a GPU before a software one, and
    /// `WGPU_BACKEND` chooses among backends.
    pub(super) fn best<T>(make: impl Fn(Self) -> Result<T, RenderError>) -> Result<T, RenderError> {
        let mut reasons = Vec::new();
        for adapter in adapters() {
            let info = adapter.get_info();
            let request = || pollster::block_on(adapter.request_device(&descriptor(&adapter)));
            let device = suits(&adapter).and_then(|()| request().map_err(|error| error.to_string()));
            match device.map(|(device, queue)| make(Self::new(info.clone(), device, queue))) {
                Ok(Ok(made)) => return Ok(made),
                // It names the adapter.
                Ok(Err(error)) => reasons.push(error.to_string()),
                Err(reason) => reasons.push(format!("{}: {reason}", name(&info))),
            }
        }
        Err(RenderError::Device(if reasons.is_empty() {
            "there is no graphics adapter here: install a Vulkan driver, or Mesa's software one".to_owned()
        } else {
            format!("no graphics adapter will do: {}", reasons.join("; "))
        }))
    }

    /// A device that exists already; its handlers of errors and loss become ours.
    pub(super) fn new(info: AdapterInfo, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let faults = Arc::new(Faults::default());
        let keep = Arc::clone(&faults);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&keep.error, error.to_string())));
        let keep = Arc::clone(&faults);
        device.set_device_lost_callback(move |reason, message| {
            let message = if message.is_empty() { format!("{reason:?}") } else { message };
            note(&keep.lost, message);
        });
        Self { device, queue, info, faults }
    }

    /// The backend and the adapter, for people.
    pub(super) fn name(&self) -> String {
        name(&self.info)
    }

    /// Does something with the device; an error of the device outdoes the result.
    pub(super) fn guarded<T>(&self, work: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
        self.sound()?;
        let filters = [ErrorFilter::OutOfMemory, ErrorFilter::Validation, ErrorFilter::Internal];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
        let error = errors.last();
        self.sound()?;
        match error {
            Some(error) => Err(self.fault(&error.to_string())),
            None => result,
        }
    }

    /// Where commands are gathered.
    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Returns when all that was submitted is done.
    ///
    /// It looks now and then: while one thread waits in a poll, no other may submit, and a window's must.
    pub(super) fn wait(&self) -> Result<(), RenderError> {
        let done = Arc::new(AtomicBool::new(false));
        let tell = Arc::clone(&done);
        self.queue.on_submitted_work_done(move || tell.store(true, Ordering::Release));
        while !done.load(Ordering::Acquire) {
            self.sound()?;
            std::thread::sleep(LOOK);
        }
        self.sound()
    }

    /// Lets the device tell what has happened; an error where it was lost, or where something failed since it was asked last.
    pub(super) fn sound(&self) -> Result<(), RenderError> {
        // Callbacks run within.
        let _ = self.device.poll(wgpu::PollType::Poll);
        if let Some(message) = &*self.faults.lost.lock() {
            return Err(self.fault(&format!("the device was lost ({message})")));
        }
        let error = self.faults.error.lock().take();
        error.map_or(Ok(()), |message| Err(self.fault(&message)))
    }

    /// What tells of the loss of the device.
    pub(super) fn health(&self) -> Health {
        Health(Arc::clone(&self.faults))
    }

    /// An error of this device.
    pub(super) fn fault(&self, message: &str) -> RenderError {
        RenderError::Device(format!("{}: {}", self.name(), message.trim()))
    }
}

/// The adapters of this machine, the best first.
pub(super) fn adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let backends = wgpu::Backends::all().with_env();
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|adapter| rank(&adapter.get_info()));
    adapters
}

/// What a device needs for [`super::Gpu`]: all that the adapter allows, since maps may be large.
pub(super) fn descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("specula"),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }
}

/// Why an adapter will not do.
fn suits(adapter: &wgpu::Adapter) -> Result<(), String> {
    let flags = adapter.get_downlevel_capabilities().flags;
    let needed = DownlevelFlags::COMPUTE_SHADERS | DownlevelFlags::FRAGMENT_STORAGE;
    if !flags.contains(needed) {
        return Err(format!("it lacks {:?}", needed - flags));
    }
    let usages = adapter.get_texture_format_features(TextureFormat::Rgba32Float).allowed_usages;
    let needed =
        TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING;
    if !usages.contains(needed) {
        return Err(format!("its 32-bit textures lack {:?}", needed - usages));
    }
    let limits = adapter.limits();
    let needs = [
        ("storage buffers in a stage", STORAGE_BUFFERS, limits.max_storage_buffers_per_shader_stage),
        ("groups of bindings", GROUPS, limits.max_bind_groups),
        ("bytes of a sample's colours", COLOUR_BYTES, limits.max_color_attachment_bytes_per_sample),
        ("invocations in a workgroup", GROUP * GROUP, limits.max_compute_invocations_per_workgroup),
    ];
    match needs.into_iter().find(|(_, needed, allowed)| allowed < needed) {
        Some((what, needed, allowed)) => Err(format!("it allows {allowed} {what}, and {needed} are needed")),
        None => Ok(()),
    }
}

/// Less is better.
fn rank(info: &AdapterInfo) -> (u8, u8) {
    let kind = match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    (kind, u8::from(info.backend == wgpu::Backend::Gl))
}

pub(super) fn name(info: &AdapterInfo) -> String {
    let backend = match info.backend {
        wgpu::Backend::Vulkan => "Vulkan",
        wgpu::Backend::Metal => "Metal",
        wgpu::Backend::Dx12 => "Direct3D 12",
        wgpu::Backend::Gl => "OpenGL",
        wgpu::Backend::BrowserWebGpu => "WebGPU",
        wgpu::Backend::Noop => "no",
    };
    format!("{backend}, {}", info.name)
}

/// Keeps the first message.
fn note(place: &Mutex<Option<String>>, message: String) {
    place.lock().get_or_insert(message);
}
