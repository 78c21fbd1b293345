//! The window itself: it takes in input and news, lets [`State`] decide, and orders pictures.

use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use eframe::egui::{Context, Ui, ViewportCommand};
use eframe::{CreationContext, egui_wgpu};

use crate::device_health::DeviceHealth;
use crate::error_meter::{ErrorMeter, Question};
use crate::gpu_adapter::GpuAdapter;
use crate::host::Host;
use crate::keyboard::Keyboard;
use crate::panel_layout::PanelLayout;
use crate::pointer::Pointer;
use crate::render_thread::RenderThread;
use crate::renderer_adapter::{CpuAdapter, RenderRequest, RendererAdapter};
use crate::screen::Screen;
use crate::state::{Effect, State};
use crate::theme;
use preview::Arrangement;
use preview::PreviewUpdate;
use preview::{Cpu, RenderError, Shot};

/// ViewSettings are kept when they have not changed for so many seconds.
const KEEP_AFTER: f64 = 1.0;

/// Where the reason of a loss is left for who opened the window.
pub(crate) type Loss = Arc<Mutex<Option<String>>>;

/// The window.
pub(crate) struct App {
    state: State,
    host: Box<dyn Host>,
    news: Receiver<PreviewUpdate>,
    pulse: DeviceHealth,
    adapter: String,
    studio: RenderThread,
    judge: ErrorMeter,
    screen: Screen,
    pointer: Pointer,
    keyboard: Keyboard,
    /// Why there is no picture of what is ordered.
    refused: Option<RenderError>,
    loss: Loss,
    title: String,
    kept: String,
    /// What is set and not kept, and since when.
    unkept: Option<(String, f64)>,
    closing: bool,
    /// Whether the device is destroyed after the first picture.
    pub(crate) rehearse_loss: bool,
}

impl App {
    /// A window that shows nothing yet. With `cpu` the graphics device draws the panels only.
    pub(crate) fn new(
        creation: &CreationContext<'_>,
        gpu: &egui_wgpu::RenderState,
        mut state: State,
        host: Box<dyn Host>,
        news: Receiver<PreviewUpdate>,
        loss: Loss,
        cpu: bool,
    ) -> std::io::Result<Self> {
        let context = &creation.egui_ctx;
        theme::set(context);
        let info = gpu.adapter.get_info();
        let adapter = format!("{}, {}", info.backend, info.name);
        let memory = || Box::new(CpuAdapter::new(Box::new(Cpu::new()))) as Box<dyn RendererAdapter>;
        let (mut easel, mut health) = (memory(), None);
        if !cpu {
            match GpuAdapter::new(info, gpu.device.clone(), gpu.queue.clone()) {
                Ok(able) => {
                    health = Some(able.health());
                    easel = Box::new(able);
                }
                Err(error) => {
                    state.toast("pictures are drawn by the CPU".into(), vec![error.to_string()]);
                }
            }
        }
        let wake = |context: Context| move || context.request_repaint();
        let studio = RenderThread::new(easel, memory(), wake(context.clone()))?;
        let judge = ErrorMeter::new(Box::new(Cpu::new()), wake(context.clone()))?;
        let kept = state.kept();
        Ok(Self {
            title: state.title(),
            state,
            host,
            news,
            pulse: DeviceHealth::new(&gpu.device, &gpu.queue, health),
            adapter,
            studio,
            judge,
            screen: Screen::new(gpu),
            pointer: Pointer::default(),
            keyboard: Keyboard::default(),
            refused: None,
            loss,
            kept,
            unkept: None,
            closing: false,
            rehearse_loss: false,
        })
    }

    fn hear(&mut self, context: &Context) {
        while let Ok(news) = self.news.try_recv() {
            let effect = self.state.hear(news);
            self.follow(context, effect);
        }
        let delivery = self.studio.take();
        if let Some(frame) = delivery.frame {
            self.screen.put(context, frame);
            self.refused = None;
            if std::mem::take(&mut self.rehearse_loss) {
                self.pulse.stop();
            }
        }
        if let Some(error) = delivery.refused {
            self.refused = Some(error);
        }
        for picture in delivery.pictures {
            match picture {
                (subject, Ok(picture)) => self.host.screenshot(&subject, picture),
                (_, Err(error)) => {
                    self.state.toast("the picture was not kept".into(), vec![error.to_string()]);
                }
            }
        }
        if let Some(reason) = delivery.lost.or_else(|| self.pulse.lost()) {
            *self.loss.lock().unwrap_or_else(PoisonError::into_inner) = Some(reason);
            self.close(context);
        }
    }

    fn follow(&mut self, context: &Context, effect: Option<Effect>) {
        match effect {
            None => {}
            Some(Effect::Show(subject)) => self.host.show(&subject),
            Some(Effect::Screenshot) => {
                let size = self.screen.seen().map(|(_, frame)| frame.size).unwrap_or([1, 1]);
                let size = self.studio.ordered().unwrap_or(size);
                if let (Some(order), Some(shown)) = (self.order(size), &self.state.shown) {
                    let order = RenderRequest { shot: order.shot.to_keep(), ..order };
                    self.studio.keep(shown.subject.clone(), order);
                }
            }
            Some(Effect::GiveUp) => {
                self.studio.give_up();
                self.state.toast("the picture is not kept".into(), Vec::new());
            }
            Some(Effect::Fullscreen(on)) => context.send_viewport_cmd(ViewportCommand::Fullscreen(on)),
            Some(Effect::Close) => self.close(context),
        }
    }

    fn close(&mut self, context: &Context) {
        self.closing = true;
        context.send_viewport_cmd(ViewportCommand::Close);
    }

    /// The picture that is to be seen, of this size.
    fn order(&self, size: [u32; 2]) -> Option<RenderRequest> {
        let (settings, shown) = (&self.state.settings, self.state.shown.as_ref()?);
        let shot = settings.shot(shown.framing, size);
        Some(RenderRequest { edition: shown.edition, scene: Arc::clone(&shown.scene), shot })
    }

    /// Whether the picture is what was ordered last.
    fn is_reached(&self) -> bool {
        self.screen.seen().is_some_and(|(_, frame)| self.studio.is_reached(frame))
    }

    /// Asks the judge. A picture that is drawn needs the machine before it; one that cannot be drawn does not.
    fn ask(&mut self, order: &RenderRequest) {
        let settings = &self.state.settings;
        let is_there = self.refused.is_some() || self.is_reached();
        let mut modes = vec![settings.mode];
        if settings.arrangement != Arrangement::One {
            modes.push(settings.second);
        }
        let RenderRequest { edition, scene, shot: Shot { camera, turn, size, .. } } = order;
        let scene = Arc::clone(scene);
        let question =
            Question { edition: *edition, scene, camera: *camera, turn: *turn, size: *size, modes };
        self.judge.ask(question, is_there);
    }

    /// Tells the host what is set, a moment after the last change.
    fn keep(&mut self, context: &Context) {
        let settings = self.state.kept();
        if settings == self.kept {
            return;
        }
        let now = context.input(|input| input.time);
        let since = match &self.unkept {
            Some((unkept, since)) if *unkept == settings => *since,
            _ => now,
        };
        let left = since + KEEP_AFTER - now;
        if left > 0.0 && !self.closing {
            self.unkept = Some((settings, since));
            context.request_repaint_after(Duration::from_secs_f64(left));
        } else {
            self.host.keep_state(&settings);
            self.kept = settings;
        }
    }

    /// Notes the size of the window, to be kept, and gives the window its title.
    fn window(&mut self, context: &Context) {
        // Wayland tells no place on the screen, but everyone tells the size that is drawn on.
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
        self.hear(context);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        if self.closing {
            // What is painted on a lost device panics; where there is nothing to paint, nothing does.
            return;
        }
        let context = ui.ctx().clone();
        let now = context.input(|input| input.time);
        if let Some(seconds) = self.state.pass(now) {
            context.request_repaint_after(Duration::from_secs_f64(seconds.max(0.0)));
        }
        self.state.keeping = self.studio.is_keeping();
        let mut actions = self.keyboard.pressed(&context);
        let desk = PanelLayout {
            state: &self.state,
            judge: &self.judge,
            seen: self.screen.seen(),
            reached: self.is_reached(),
            refused: self.refused.as_ref(),
            adapter: &self.adapter,
        };
        let size = desk.draw(ui, &mut self.pointer, &mut actions);
        self.keyboard.drawn(&context);
        if !actions.is_empty() {
            // What was drawn above is what was before them.
            context.request_repaint();
        }
        for action in actions {
            let effect = self.state.update(action);
            self.follow(&context, effect);
        }
        if let Some(order) = self.order(size) {
            if self.studio.order(order.clone()) {
                self.refused = None;
            }
            self.ask(&order);
        }
        self.window(&context);
        self.keep(&context);
    }

    fn on_exit(&mut self) {
        self.host.keep_state(&self.state.kept());
        self.host.closed();
    }
}
