//! The window itself: passes input and updates to [`State`], carries out its effects, and requests pictures.

use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use eframe::egui::{Context, Ui, ViewportCommand};
use eframe::{CreationContext, egui_wgpu};

use crate::device_health::DeviceHealth;
use crate::error_meter::{ErrorMeter, MeasureRequest};
use crate::gpu_adapter::GpuAdapter;
use crate::keyboard::Keyboard;
use crate::panel_layout::PanelLayout;
use crate::picture_texture::PictureTexture;
use crate::pointer::Pointer;
use crate::render_thread::RenderThread;
use crate::renderer_adapter::{CpuAdapter, RenderRequest, RendererAdapter};
use crate::state::{Action, Effect, State};
use crate::theme;
use preview::{Arrangement, Cpu, Host, PreviewUpdate, RenderError, Shot};

/// The settings are saved when they have not changed for this many seconds.
const SAVE_AFTER: f64 = 1.0;

/// The reason for the loss of the device, for [`crate::open`].
pub(crate) type DeviceLoss = Arc<Mutex<Option<String>>>;

pub(crate) struct App {
    state: State,
    host: Box<dyn Host>,
    updates: Receiver<PreviewUpdate>,
    device_health: DeviceHealth,
    adapter_name: String,
    render_thread: RenderThread,
    error_meter: ErrorMeter,
    picture_texture: PictureTexture,
    pointer: Pointer,
    keyboard: Keyboard,
    /// Why the requested picture cannot be drawn.
    render_error: Option<RenderError>,
    loss: DeviceLoss,
    title: String,
    saved: String,
    /// Settings that are not saved yet, and since when.
    unsaved: Option<(String, f64)>,
    closing: bool,
    /// Whether to destroy the device after the first picture.
    pub(crate) simulate_device_loss: bool,
}

impl App {
    /// A window without a picture. With `cpu` the graphics device draws only the panels.
    pub(crate) fn new(
        creation: &CreationContext<'_>,
        gpu: &egui_wgpu::RenderState,
        mut state: State,
        host: Box<dyn Host>,
        updates: Receiver<PreviewUpdate>,
        loss: DeviceLoss,
        cpu: bool,
    ) -> std::io::Result<Self> {
        let context = &creation.egui_ctx;
        theme::set(context);
        let info = gpu.adapter.get_info();
        let adapter_name = format!("{}, {}", info.backend, info.name);
        let on_cpu = || Box::new(CpuAdapter::new(Box::new(Cpu::new()))) as Box<dyn RendererAdapter>;
        let (mut renderer, mut status) = (on_cpu(), None);
        if !cpu {
            match GpuAdapter::new(info, gpu.device.clone(), gpu.queue.clone()) {
                Ok(adapter) => {
                    status = Some(adapter.status());
                    renderer = Box::new(adapter);
                }
                Err(error) => {
                    state.toast("pictures are drawn on the CPU".into(), vec![error.to_string()]);
                }
            }
        }
        let wake = |context: Context| move || context.request_repaint();
        let render_thread = RenderThread::new(renderer, on_cpu(), wake(context.clone()))?;
        let error_meter = ErrorMeter::new(Box::new(Cpu::new()), wake(context.clone()))?;
        let saved = state.to_json();
        Ok(Self {
            title: state.title(),
            state,
            host,
            updates,
            device_health: DeviceHealth::new(&gpu.device, &gpu.queue, status),
            adapter_name,
            render_thread,
            error_meter,
            picture_texture: PictureTexture::new(gpu),
            pointer: Pointer::default(),
            keyboard: Keyboard::default(),
            render_error: None,
            loss,
            saved,
            unsaved: None,
            closing: false,
            simulate_device_loss: false,
        })
    }

    /// Takes the program's updates and the results of the render thread.
    fn receive(&mut self, context: &Context) {
        while let Ok(update) = self.updates.try_recv() {
            let effect = self.state.apply(update);
            self.carry_out(context, effect);
        }
        let results = self.render_thread.take();
        if let Some(frame) = results.frame {
            self.picture_texture.put(context, frame);
            self.render_error = None;
            if std::mem::take(&mut self.simulate_device_loss) {
                self.device_health.destroy();
            }
        }
        if let Some(error) = results.error {
            self.render_error = Some(error);
        }
        for screenshot in results.screenshots {
            match screenshot {
                (subject, Ok(picture)) => self.host.screenshot(&subject, picture),
                (_, Err(error)) => {
                    self.state.toast("the screenshot failed".into(), vec![error.to_string()]);
                }
            }
        }
        if let Some(reason) = results.lost.or_else(|| self.device_health.lost()) {
            *self.loss.lock().unwrap_or_else(PoisonError::into_inner) = Some(reason);
            self.close(context);
        }
    }

    fn carry_out(&mut self, context: &Context, effect: Option<Effect>) {
        match effect {
            None => {}
            Some(Effect::Show(subject)) => self.host.show(&subject),
            Some(Effect::ShowFiles(files)) => self.host.dropped(files),
            Some(Effect::ReturnFromDropped) => self.host.return_from_dropped(),
            Some(Effect::Screenshot) => {
                let size = self.picture_texture.frame().map(|(_, frame)| frame.size).unwrap_or([1, 1]);
                let size = self.render_thread.requested_size().unwrap_or(size);
                if let (Some(request), Some(shown)) = (self.request(size), &self.state.shown) {
                    let request = RenderRequest { shot: request.shot.for_screenshot(), ..request };
                    self.render_thread.screenshot(shown.subject.clone(), request);
                }
            }
            Some(Effect::CancelScreenshots) => {
                self.render_thread.cancel_screenshots();
                self.state.toast("the screenshot was cancelled".into(), Vec::new());
            }
            Some(Effect::EditMaterial(material, form)) => {
                self.host.edit_material(&material, form.as_ref());
            }
            Some(Effect::SaveMaterial(material, form)) => self.host.save_material(&material, &form),
            Some(Effect::SaveAndClose(materials)) => {
                materials.iter().for_each(|(material, form)| self.host.save_material(material, form));
            }
            Some(Effect::DiscardAndClose(materials)) => {
                materials.iter().for_each(|material| self.host.edit_material(material, None));
                self.close(context);
            }
            Some(Effect::ProposeLight(turn)) => self.host.propose_light(turn),
            Some(Effect::SaveLight(turn, lines)) => self.host.save_light(turn, &lines),
            Some(Effect::Fullscreen(on)) => context.send_viewport_cmd(ViewportCommand::Fullscreen(on)),
            Some(Effect::Close) => self.close(context),
        }
    }

    /// Asks before somebody closes the window while there are unsaved values.
    fn intercept_close(&mut self, context: &Context) {
        if self.closing || !context.input(|input| input.viewport().close_requested()) {
            return;
        }
        match self.state.update(Action::Close) {
            Some(Effect::Close) => self.closing = true,
            _ => {
                context.send_viewport_cmd(ViewportCommand::CancelClose);
                // It may be minimized, and the question is in it.
                context.send_viewport_cmd(ViewportCommand::Minimized(false));
                context.send_viewport_cmd(ViewportCommand::Focus);
            }
        }
    }

    fn close(&mut self, context: &Context) {
        self.closing = true;
        context.send_viewport_cmd(ViewportCommand::Close);
    }

    /// The picture to show, in this size.
    fn request(&self, size: [u32; 2]) -> Option<RenderRequest> {
        let (settings, shown) = (&self.state.settings, self.state.shown.as_ref()?);
        let shot = settings.shot(&shown.scene, shown.framing, size).of(&shown.scene);
        Some(RenderRequest { scene_id: shown.scene_id, scene: Arc::clone(&shown.scene), shot })
    }

    /// Whether the picture on the screen is the one requested last.
    fn is_current(&self) -> bool {
        self.picture_texture.frame().is_some_and(|(_, frame)| self.render_thread.is_current(frame))
    }

    /// Asks for errors and statistics, once the picture itself is drawn or has failed.
    fn measure(&mut self, request: &RenderRequest) {
        let settings = &self.state.settings;
        let ready = self.render_error.is_some() || self.is_current();
        let mut modes = vec![settings.first_mode(&request.scene)];
        if settings.arrangement != Arrangement::One {
            modes.push(settings.second);
        }
        modes.retain(|mode| request.scene.offers(*mode));
        let RenderRequest { scene_id, scene, shot: Shot { camera, turn, size, .. } } = request;
        let scene = Arc::clone(scene);
        let request =
            MeasureRequest { scene_id: *scene_id, scene, camera: *camera, turn: *turn, size: *size, modes };
        self.error_meter.request(request, ready);
    }

    /// Passes the settings to the host, a moment after the last change.
    fn save_settings(&mut self, context: &Context) {
        let settings = self.state.to_json();
        if settings == self.saved {
            return;
        }
        let now = context.input(|input| input.time);
        let since = match &self.unsaved {
            Some((unsaved, since)) if *unsaved == settings => *since,
            _ => now,
        };
        let left = since + SAVE_AFTER - now;
        if left > 0.0 && !self.closing {
            self.unsaved = Some((settings, since));
            context.request_repaint_after(Duration::from_secs_f64(left));
        } else {
            self.host.keep_state(&settings);
            self.saved = settings;
        }
    }

    /// Records the window's size in the settings and updates its title.
    fn update_window(&mut self, context: &Context) {
        // Wayland reports no position, but every platform reports the size.
        let size = context.viewport_rect().size() * context.zoom_factor();
        let (maximized, special) = context.input(|input| {
            let viewport = input.viewport();
            (viewport.maximized, [viewport.fullscreen, viewport.minimized].contains(&Some(true)))
        });
        if !special {
            self.state.settings.maximized = maximized == Some(true);
            if !self.state.settings.maximized && size.min_elem() > 0.0 {
                self.state.settings.size = size.into();
            }
        }
        let title = self.state.title();
        if title != self.title {
            context.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

impl eframe::App for App {
    fn logic(&mut self, context: &Context, _frame: &mut eframe::Frame) {
        self.receive(context);
        self.intercept_close(context);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        if self.closing {
            // Painting on a lost device would panic.
            return;
        }
        let context = ui.ctx().clone();
        let now = context.input(|input| input.time);
        if let Some(seconds) = self.state.expire_toasts(now) {
            context.request_repaint_after(Duration::from_secs_f64(seconds.max(0.0)));
        }
        self.state.taking_screenshot = self.render_thread.has_screenshots();
        let mut actions = self.keyboard.pressed(&context);
        let layout = PanelLayout {
            state: &self.state,
            error_meter: &self.error_meter,
            frame: self.picture_texture.frame(),
            is_current: self.is_current(),
            render_error: self.render_error.as_ref(),
            adapter_name: &self.adapter_name,
        };
        let size = layout.draw(ui, &mut self.pointer, &mut actions);
        self.keyboard.end_frame(&context);
        if !actions.is_empty() {
            // This frame was drawn before its actions take effect.
            context.request_repaint();
        }
        for action in actions {
            let effect = self.state.update(action);
            self.carry_out(&context, effect);
        }
        if let Some(request) = self.request(size) {
            if self.render_thread.request(request.clone()) {
                self.render_error = None;
            }
            self.measure(&request);
        }
        self.update_window(&context);
        self.save_settings(&context);
    }

    fn on_exit(&mut self) {
        self.host.keep_state(&self.state.to_json());
        self.host.closed();
    }
}
