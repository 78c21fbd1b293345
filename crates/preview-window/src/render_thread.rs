//! The thread that draws the window's pictures, so that the window itself never waits.
//!
//! It draws the latest request: coarse while new requests keep coming, then in full resolution, then with
//! smoother outlines, and adds light samples to brute force until the shot's number is reached. The CPU draws
//! what the graphics device cannot. The window gets every picture and shows the last.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::adaptive_quality::{AdaptiveQuality, Quality};
use crate::latest_value::LatestValue;
use crate::panics::guarded;
use crate::renderer_adapter::{FrameImage, PartialFrame, RenderRequest, RendererAdapter, has_same_radiance};
use preview::{Mode, Picture, RenderError, Shot, Subject};

#[derive(Clone, Debug)]
pub(crate) struct RenderedFrame {
    pub(crate) image: FrameImage,
    pub(crate) size: [u32; 2],
    /// The requested shot, and its scene.
    pub(crate) of: Shot,
    pub(crate) scene_id: u64,
    /// Whether the picture has a pixel for each pixel of the window.
    pub(crate) full: bool,
    /// How long the picture took, in seconds.
    pub(crate) seconds: f64,
    pub(crate) renderer: String,
    /// Why the graphics device did not draw the picture.
    pub(crate) fallback_reason: Option<String>,
    pub(crate) light_samples: u32,
    pub(crate) unfinished: bool,
    pub(crate) relative_rms: Option<f64>,
}

/// The results since the last call of [`RenderThread::take`].
#[derive(Debug, Default)]
pub(crate) struct RenderResults {
    pub(crate) frame: Option<RenderedFrame>,
    /// Why the latest request cannot be drawn.
    pub(crate) error: Option<RenderError>,
    /// Finished screenshots, each with its subject.
    pub(crate) screenshots: Vec<(Subject, Result<Picture, RenderError>)>,
    /// Why no more pictures can be drawn.
    pub(crate) lost: Option<String>,
}

struct SharedResults {
    requests: LatestValue<RenderRequest>,
    screenshots: Mutex<Screenshots>,
    results: Mutex<RenderResults>,
    wake: Box<dyn Fn() + Send + Sync>,
}

/// Screenshots that are not drawn yet, each with its number. They are drawn before the request.
#[derive(Default)]
struct Screenshots {
    pending: Vec<(u64, Subject, RenderRequest)>,
    count: u64,
}

/// The thread and its requests.
pub(crate) struct RenderThread {
    shared: Arc<SharedResults>,
    thread: Option<JoinHandle<()>>,
    last: Option<RenderRequest>,
}

/// The view is at rest when no request has come for this long.
const REST: Duration = Duration::from_millis(150);

impl RenderThread {
    /// Starts the thread. `fallback` draws what `renderer` cannot. New results call `wake`.
    pub(crate) fn new(
        renderer: Box<dyn RendererAdapter>,
        fallback: Box<dyn RendererAdapter>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (requests, screenshots, results) = (LatestValue::new(), Mutex::default(), Mutex::default());
        let shared = Arc::new(SharedResults { requests, screenshots, results, wake: Box::new(wake) });
        let of_thread = Arc::clone(&shared);
        let quality = AdaptiveQuality::default();
        let worker = Worker { renderer, fallback, unsupported: None, last: None, quality };
        let thread = std::thread::Builder::new().name("render thread".into());
        let thread = thread.spawn(move || worker.run(&of_thread))?;
        Ok(Self { shared, thread: Some(thread), last: None })
    }

    /// Replaces the requested picture. Returns `false` if both requests are the same.
    pub(crate) fn request(&mut self, request: RenderRequest) -> bool {
        let same = self
            .last
            .as_ref()
            .is_some_and(|last| last.scene_id == request.scene_id && last.shot == request.shot);
        if !same {
            self.last = Some(request.clone());
            self.shared.requests.put(request);
        }
        !same
    }

    /// Whether a picture is the one requested last, in full resolution.
    pub(crate) fn is_current(&self, frame: &RenderedFrame) -> bool {
        let is_of = |last: &RenderRequest| last.scene_id == frame.scene_id && last.shot == frame.of;
        frame.full && self.last.as_ref().is_some_and(is_of)
    }

    /// The size of the picture that was requested last.
    pub(crate) fn requested_size(&self) -> Option<[u32; 2]> {
        self.last.as_ref().map(|request| request.shot.size)
    }

    pub(crate) fn screenshot(&mut self, subject: Subject, request: RenderRequest) {
        let then = self.last.get_or_insert_with(|| request.clone()).clone();
        let mut screenshots = self.shared.screenshots();
        screenshots.count += 1;
        let number = screenshots.count;
        screenshots.pending.push((number, subject, request));
        drop(screenshots);
        self.shared.requests.put(then);
    }

    pub(crate) fn has_screenshots(&self) -> bool {
        !self.shared.screenshots().pending.is_empty()
    }

    pub(crate) fn cancel_screenshots(&self) {
        self.shared.screenshots().pending.clear();
    }

    pub(crate) fn take(&self) -> RenderResults {
        std::mem::take(&mut *self.shared.results.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for RenderThread {
    fn drop(&mut self) {
        self.shared.requests.end();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl SharedResults {
    fn screenshots(&self) -> MutexGuard<'_, Screenshots> {
        self.screenshots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn report(&self, add: impl FnOnce(&mut RenderResults)) {
        add(&mut self.results.lock().unwrap_or_else(PoisonError::into_inner));
        (self.wake)();
    }
}

struct Worker {
    renderer: Box<dyn RendererAdapter>,
    /// Draws what `renderer` cannot.
    fallback: Box<dyn RendererAdapter>,
    /// The scene and modes that `renderer` could not draw, so that it does not try again, and why.
    unsupported: Option<(u64, Vec<Mode>, RenderError)>,
    /// The scene and shot drawn last, the quality, and whether that is unfinished.
    last: Option<(u64, Shot, Quality, bool)>,
    quality: AdaptiveQuality,
}

/// Why drawing a request ended early.
enum Stop {
    Stale,
    Failed(RenderError),
    Lost(String),
}

impl Worker {
    fn run(mut self, shared: &SharedResults) {
        while let Some((number, request)) = shared.requests.take() {
            let result =
                self.draw_screenshots(shared).and_then(|()| self.draw_request(shared, number, &request));
            match result {
                Ok(()) | Err(Stop::Stale) => {}
                Err(Stop::Failed(error)) => {
                    if !shared.requests.is_stale(number) {
                        shared.report(|results| results.error = Some(error));
                    }
                }
                Err(Stop::Lost(reason)) => {
                    shared.report(|results| results.lost = Some(reason));
                    return;
                }
            }
        }
    }

    /// Draws a request until it is stale or finished.
    fn draw_request(
        &mut self,
        shared: &SharedResults,
        number: u64,
        request: &RenderRequest,
    ) -> Result<(), Stop> {
        let (show, size) = (request.shot.show, request.shot.size);
        let brute = show.modes().any(Mode::is_brute_force);
        let last = self.last.clone().filter(|(scene_id, ..)| *scene_id == request.scene_id);
        let (moving, unfinished) = match last {
            Some((_, shot, quality, unfinished)) if shot == request.shot => (quality, unfinished),
            // Another exposure keeps the light samples.
            Some((_, shot, quality, _)) if brute && has_same_radiance(&shot, &request.shot) => {
                (quality, self.draw(shared, number, request, quality)?)
            }
            _ => {
                let moving = self.quality.moving(show, size);
                (moving, self.draw(shared, number, request, moving)?)
            }
        };
        if shared.requests.becomes_stale(number, REST) {
            return Err(Stop::Stale);
        }
        let mut rest = self.quality.resting(show, size, moving);
        if rest.is_empty() && unfinished {
            rest.push(moving);
        }
        for (at, quality) in rest.iter().enumerate() {
            // Only the last one is refined to its end.
            while self.draw(shared, number, request, *quality)? && at + 1 == rest.len() {}
        }
        Ok(())
    }

    /// Draws once and reports the picture; returns whether the same again would improve it.
    fn draw(
        &mut self,
        shared: &SharedResults,
        number: u64,
        request: &RenderRequest,
        quality: Quality,
    ) -> Result<bool, Stop> {
        let whole = request.shot.size;
        let size = quality.size(whole);
        let shot = Shot { size, samples: quality.samples, ..request.shot.clone() };
        let is_stale = || shared.requests.is_stale(number);
        let stop = sh::Stop::when(&is_stale);
        let start = Instant::now();
        let drawn = self.with_fallback(request, |renderer| renderer.draw(request, &shot, stop));
        let (renderer, fallback_reason, partial) = match drawn {
            Ok(drawn) => drawn,
            Err(RenderError::Cancelled) => return Err(Stop::Stale),
            Err(error) => return Err(self.renderer.lost().map_or(Stop::Failed(error), Stop::Lost)),
        };
        let PartialFrame { image, light_samples, unfinished, relative_rms } = partial;
        let seconds = start.elapsed().as_secs_f64();
        self.quality.record(shot.show, whole, quality, seconds);
        let frame = RenderedFrame {
            image,
            size,
            of: request.shot.clone(),
            scene_id: request.scene_id,
            full: quality.downscale == 1,
            seconds,
            renderer,
            fallback_reason,
            light_samples,
            unfinished,
            relative_rms,
        };
        shared.report(|results| (results.frame, results.error) = (Some(frame), None));
        self.last = Some((request.scene_id, request.shot.clone(), quality, unfinished));
        if shared.requests.is_stale(number) { Err(Stop::Stale) } else { Ok(unfinished) }
    }

    /// Draws the pending screenshots until they are cancelled or the window closes; new requests wait.
    fn draw_screenshots(&mut self, shared: &SharedResults) -> Result<(), Stop> {
        loop {
            let next = shared.screenshots().pending.first().cloned();
            let Some((number, subject, request)) = next else { return Ok(()) };
            let is_pending = || shared.screenshots().pending.iter().any(|(pending, ..)| *pending == number);
            let is_unwanted = || shared.requests.has_ended() || !is_pending();
            let stop = sh::Stop::when(&is_unwanted);
            let made = self.with_fallback(&request, |renderer| renderer.picture(&request, stop));
            if made.is_err()
                && let Some(reason) = self.renderer.lost()
            {
                return Err(Stop::Lost(reason));
            }
            if shared.requests.has_ended() {
                return Err(Stop::Stale);
            }
            if is_pending() {
                shared.screenshots().pending.retain(|(pending, ..)| *pending != number);
                shared.report(|results| {
                    results.screenshots.push((subject, made.map(|(_, _, picture)| picture)));
                });
            }
        }
    }

    /// Calls `work` with the renderer, or with the fallback if the renderer cannot do it. Returns the name of
    /// the one used, why it was the fallback, and the result.
    fn with_fallback<T>(
        &mut self,
        request: &RenderRequest,
        mut work: impl FnMut(&mut dyn RendererAdapter) -> Result<T, RenderError>,
    ) -> Result<(String, Option<String>, T), RenderError> {
        let modes: Vec<Mode> = request.shot.show.modes().collect();
        let known = self.unsupported.take();
        let error = match known.filter(|(scene_id, of, _)| *scene_id == request.scene_id && *of == modes) {
            Some((_, _, error)) => error,
            None => match guarded(|| work(self.renderer.as_mut())) {
                Err(error) if error.is_of_the_device() && self.renderer.lost().is_none() => error,
                result => return result.map(|made| (self.renderer.name(), None, made)),
            },
        };
        let reason = error.to_string();
        self.unsupported = Some((request.scene_id, modes, error));
        let made = guarded(|| work(self.fallback.as_mut()))?;
        Ok((self.fallback.name(), Some(reason), made))
    }
}

#[cfg(test)]
mod tests;
