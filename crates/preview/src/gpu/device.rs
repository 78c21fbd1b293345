//! The graphics device: the choice of the adapter, its requirements, and its errors.
//!
//! wgpu panics on an error without a handler. Here all errors are handled: [`Device::guarded`] catches those
//! of its own thread, handlers store later ones and the loss of the device, and each becomes a
//! [`RenderError::Device`].

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use parking_lot::Mutex;
use wgpu::{AdapterInfo, DeviceType, DownlevelFlags, ErrorFilter, TextureFormat, TextureUsages};

use crate::RenderError;

/// The number of pixels along each side of a workgroup of the compute passes.
pub(super) const GROUP: u32 = 8;
/// The most storage buffers of a stage: those of `develop`, and the constants of the harmonics.
pub(super) const STORAGE_BUFFERS: u32 = 7;
/// The most bind groups of a pipeline: those of brute force.
pub(super) const BIND_GROUPS: u32 = 4;
/// The bytes of a sample in the surface buffer: normal and tangent in 32-bit RGBA.
pub(super) const COLOUR_BYTES: u32 = 32;

/// Reports from any thread whether a device still works.
#[derive(Clone, Debug)]
pub struct DeviceStatus(Arc<DeviceErrors>);

impl DeviceStatus {
    /// The reason why the device stopped working; known after the next poll.
    pub fn lost(&self) -> Option<String> {
        self.0.lost.lock().clone()
    }
}

/// A device, its queue and their errors.
#[derive(Clone, Debug)]
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    info: AdapterInfo,
    errors: Arc<DeviceErrors>,
}

/// The time to sleep between polls of the device.
pub(super) const POLL_INTERVAL: Duration = Duration::from_micros(100);

/// Errors outside of any call.
#[derive(Debug, Default)]
struct DeviceErrors {
    lost: Mutex<Option<String>>,
    error: Mutex<Option<String>>,
}

impl Device {
    /// Calls `make` with the device of the best adapter of this machine, then of the next until it succeeds.
    /// GPUs come before software adapters, and `WGPU_BACKEND` restricts the backends.
    pub(super) fn best<T>(make: impl Fn(Self) -> Result<T, RenderError>) -> Result<T, RenderError> {
        let mut reasons = Vec::new();
        for adapter in adapters() {
            let info = adapter.get_info();
            match request(&adapter).map(|(device, queue)| make(Self::new(info.clone(), device, queue))) {
                Ok(Ok(made)) => return Ok(made),
                // This error names the adapter.
                Ok(Err(error)) => reasons.push(error.to_string()),
                Err(reason) => reasons.push(format!("{}: {reason}", name(&info))),
            }
        }
        Err(RenderError::Device(none_of(&reasons)))
    }

    /// An existing device, whose handlers of errors and loss are replaced.
    pub(super) fn new(info: AdapterInfo, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let errors = Arc::new(DeviceErrors::default());
        let stored = Arc::clone(&errors);
        device
            .on_uncaptured_error(Arc::new(move |error: wgpu::Error| store(&stored.error, error.to_string())));
        let stored = Arc::clone(&errors);
        device.set_device_lost_callback(move |reason, message| {
            let message = if message.is_empty() { format!("{reason:?}") } else { message };
            store(&stored.lost, message);
        });
        Self { device, queue, info, errors }
    }

    /// The names of the backend and the adapter, for messages.
    pub(super) fn name(&self) -> String {
        name(&self.info)
    }

    /// Calls `work`; an error of the device replaces its result.
    pub(super) fn guarded<T>(&self, work: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
        self.check()?;
        let filters = [ErrorFilter::OutOfMemory, ErrorFilter::Validation, ErrorFilter::Internal];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
        let error = errors.last();
        self.check()?;
        match error {
            Some(error) => Err(self.error(&error.to_string())),
            None => result,
        }
    }

    /// A new command encoder.
    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Returns when all submitted work is done.
    ///
    /// It polls, because a blocking wait would keep the window's thread from submitting.
    pub(super) fn wait(&self) -> Result<(), RenderError> {
        let done = Arc::new(AtomicBool::new(false));
        let set = Arc::clone(&done);
        self.queue.on_submitted_work_done(move || set.store(true, Ordering::Release));
        while !done.load(Ordering::Acquire) {
            self.check()?;
            std::thread::sleep(POLL_INTERVAL);
        }
        self.check()
    }

    /// Polls the device.
    ///
    /// # Errors
    /// If the device is lost, or something failed since the last call.
    pub(super) fn check(&self) -> Result<(), RenderError> {
        // Callbacks run inside `poll`.
        let _ = self.device.poll(wgpu::PollType::Poll);
        if let Some(message) = &*self.errors.lost.lock() {
            return Err(self.error(&format!("the device was lost ({message})")));
        }
        let error = self.errors.error.lock().take();
        error.map_or(Ok(()), |message| Err(self.error(&message)))
    }

    /// Reports the loss of the device.
    pub(super) fn status(&self) -> DeviceStatus {
        DeviceStatus(Arc::clone(&self.errors))
    }

    /// An error of this device.
    pub(super) fn error(&self, message: &str) -> RenderError {
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

/// The best of these adapters that draws on the surface and makes a device: some drivers list an adapter and
/// then cannot.
///
/// # Errors
/// Why none of them does.
pub(super) fn best_for(
    adapters: &[wgpu::Adapter],
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter, String> {
    let mut sorted: Vec<_> = adapters.iter().collect();
    sorted.sort_by_key(|adapter| rank(&adapter.get_info()));
    let mut reasons = Vec::new();
    for adapter in sorted {
        let made = match surface.is_none_or(|surface| adapter.is_surface_supported(surface)) {
            true => request(adapter).map(drop),
            false => Err("it cannot draw on the screen".to_owned()),
        };
        match made {
            Ok(()) => return Ok(adapter.clone()),
            Err(reason) => reasons.push(format!("{}: {reason}", name(&adapter.get_info()))),
        }
    }
    Err(none_of(&reasons))
}

/// A device of an adapter that is suitable.
fn request(adapter: &wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String> {
    check_suitable(adapter)?;
    pollster::block_on(adapter.request_device(&descriptor(adapter))).map_err(|error| error.to_string())
}

/// The message if no adapter makes a device, for these reasons.
fn none_of(reasons: &[String]) -> String {
    match reasons {
        [] => "there is no graphics adapter: install a Vulkan driver, or Mesa's software one".to_owned(),
        reasons => format!("no graphics adapter is suitable: {}", reasons.join("; ")),
    }
}

/// The device for [`super::Gpu`]: with all limits of the adapter, since maps may be large.
pub(super) fn descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("specula"),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }
}

/// # Errors
/// Why an adapter is not suitable.
fn check_suitable(adapter: &wgpu::Adapter) -> Result<(), String> {
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
        ("bind groups", BIND_GROUPS, limits.max_bind_groups),
        ("bytes of a sample's colours", COLOUR_BYTES, limits.max_color_attachment_bytes_per_sample),
        ("invocations in a workgroup", GROUP * GROUP, limits.max_compute_invocations_per_workgroup),
    ];
    match needs.into_iter().find(|(_, needed, allowed)| allowed < needed) {
        Some((what, needed, allowed)) => Err(format!("it allows {allowed} {what}, but {needed} are needed")),
        None => Ok(()),
    }
}

/// The best adapter has the lowest rank.
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

/// Stores a message unless there is one.
fn store(slot: &Mutex<Option<String>>, message: String) {
    slot.lock().get_or_insert(message);
}
