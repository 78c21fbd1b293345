//! The thread that makes the pictures of the window, so that the window itself never waits.
//!
//! It draws the latest order: coarse as long as another comes at once, then full, then with smoother outlines, and brute
//! force for as long as it gains. What the graphics device cannot do, the CPU does. Every picture is delivered; the window
//! shows the last.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::adaptive_quality::{AdaptiveQuality, Fineness};
use crate::guarded;
use crate::latest_value::LatestValue;
use crate::renderer_adapter::{Canvas, PartialFrame, RenderRequest, RendererAdapter, is_by_the_same_light};
use preview::Subject;
use preview::{Mode, Picture, RenderError, Shot};

/// A picture for the window.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) canvas: Canvas,
    pub(crate) size: [u32; 2],
    /// What was ordered, and of which scene.
    pub(crate) of: Shot,
    pub(crate) edition: u64,
    /// Whether each pixel of the window has its own.
    pub(crate) full: bool,
    /// How long it took.
    pub(crate) seconds: f64,
    /// What drew it.
    pub(crate) by: String,
    /// Why not by the graphics device.
    pub(crate) instead: Option<String>,
    pub(crate) light_samples: u32,
    pub(crate) unfinished: bool,
    pub(crate) relative_rms: Option<f64>,
}

/// What has come of orders since it was asked last.
#[derive(Debug, Default)]
pub(crate) struct Delivery {
    /// The latest picture.
    pub(crate) frame: Option<Frame>,
    /// Why there is no picture of the latest order.
    pub(crate) refused: Option<RenderError>,
    /// Pictures to keep, each with what it shows.
    pub(crate) pictures: Vec<(Subject, Result<Picture, RenderError>)>,
    /// Why there will be no more pictures.
    pub(crate) lost: Option<String>,
}

struct Shared {
    orders: LatestValue<RenderRequest>,
    keeps: Mutex<Keeps>,
    delivery: Mutex<Delivery>,
    wake: Box<dyn Fn() + Send + Sync>,
}

/// Pictures to keep, which are made before the order: each until it is made or given up, with its number.
#[derive(Default)]
struct Keeps {
    wanted: Vec<(u64, Subject, RenderRequest)>,
    count: u64,
}

/// The thread and its orders.
pub(crate) struct RenderThread {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    last: Option<RenderRequest>,
}

/// When no other order has come for so long, things are at rest.
const REST: Duration = Duration::from_millis(150);

impl RenderThread {
    /// Begins. `spare` draws what `easel` cannot. `wake` is called when there is something to [`RenderThread::take`].
    pub(crate) fn new(
        easel: Box<dyn RendererAdapter>,
        spare: Box<dyn RendererAdapter>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (orders, keeps, delivery) = (LatestValue::new(), Mutex::default(), Mutex::default());
        let shared = Arc::new(Shared { orders, keeps, delivery, wake: Box::new(wake) });
        let theirs = Arc::clone(&shared);
        let hand = Hand { easel, spare, refused: None, reached: None, pace: AdaptiveQuality::default() };
        let thread = std::thread::Builder::new().name("studio".into()).spawn(move || hand.work(&theirs))?;
        Ok(Self { shared, thread: Some(thread), last: None })
    }

    /// Orders a picture; an earlier order is no longer wanted. The same order again changes nothing, and says so.
    pub(crate) fn order(&mut self, order: RenderRequest) -> bool {
        let same =
            self.last.as_ref().is_some_and(|last| last.edition == order.edition && last.shot == order.shot);
        if !same {
            self.last = Some(order.clone());
            self.shared.orders.put(order);
        }
        !same
    }

    /// Whether a picture is what was ordered last, with all its pixels.
    pub(crate) fn is_reached(&self, frame: &Frame) -> bool {
        let is_of = |last: &RenderRequest| last.edition == frame.edition && last.shot == frame.of;
        frame.full && self.last.as_ref().is_some_and(is_of)
    }

    /// The size of the picture that was ordered last.
    pub(crate) fn ordered(&self) -> Option<[u32; 2]> {
        self.last.as_ref().map(|order| order.shot.size)
    }

    /// Orders a whole picture of a subject to keep.
    pub(crate) fn keep(&mut self, subject: Subject, order: RenderRequest) {
        let then = self.last.get_or_insert_with(|| order.clone()).clone();
        let mut keeps = self.shared.keeps();
        keeps.count += 1;
        let number = keeps.count;
        keeps.wanted.push((number, subject, order));
        drop(keeps);
        self.shared.orders.put(then);
    }

    /// Whether a picture to keep is being drawn.
    pub(crate) fn is_keeping(&self) -> bool {
        !self.shared.keeps().wanted.is_empty()
    }

    /// Gives up the pictures to keep that are not made yet.
    pub(crate) fn give_up(&self) {
        self.shared.keeps().wanted.clear();
    }

    pub(crate) fn take(&self) -> Delivery {
        std::mem::take(&mut *self.shared.delivery.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for RenderThread {
    fn drop(&mut self) {
        self.shared.orders.end();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn keeps(&self) -> MutexGuard<'_, Keeps> {
        self.keeps.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn deliver(&self, fill: impl FnOnce(&mut Delivery)) {
        fill(&mut self.delivery.lock().unwrap_or_else(PoisonError::into_inner));
        (self.wake)();
    }
}

/// What the thread works with.
struct Hand {
    easel: Box<dyn RendererAdapter>,
    /// Draws what the easel cannot.
    spare: Box<dyn RendererAdapter>,
    /// What the easel could not draw, and why: it is not asked again for that.
    refused: Option<(u64, Vec<Mode>, RenderError)>,
    /// How far the last order has come: how fine it was drawn, and whether that is unfinished.
    reached: Option<(u64, Shot, Fineness, bool)>,
    pace: AdaptiveQuality,
}

/// Why nothing more is drawn of an order.
enum Stop {
    Stale,
    Refused(RenderError),
    Lost(String),
}

impl Hand {
    fn work(mut self, shared: &Shared) {
        while let Some((number, order)) = shared.orders.take() {
            let result = self.keep(shared).and_then(|()| self.show(shared, number, &order));
            match result {
                Ok(()) | Err(Stop::Stale) => {}
                Err(Stop::Refused(error)) => {
                    if !shared.orders.is_stale(number) {
                        shared.deliver(|delivery| delivery.refused = Some(error));
                    }
                }
                Err(Stop::Lost(reason)) => {
                    shared.deliver(|delivery| delivery.lost = Some(reason));
                    return;
                }
            }
        }
    }

    /// Draws an order until it is stale or as good as it gets.
    fn show(&mut self, shared: &Shared, number: u64, order: &RenderRequest) -> Result<(), Stop> {
        let (show, size) = (order.shot.show, order.shot.size);
        let brute = show.modes().any(|mode| mode == Mode::BruteForce);
        let reached = self.reached.clone().filter(|(edition, ..)| *edition == order.edition);
        let (moving, unfinished) = match reached {
            Some((_, shot, fineness, unfinished)) if shot == order.shot => (fineness, unfinished),
            // What it took long to gather is not thrown away for another exposure.
            Some((_, shot, fineness, _)) if brute && is_by_the_same_light(&shot, &order.shot) => {
                (fineness, self.draw(shared, number, order, fineness)?)
            }
            _ => {
                let moving = self.pace.moving(show, size);
                (moving, self.draw(shared, number, order, moving)?)
            }
        };
        if shared.orders.becomes_stale(number, REST) {
            return Err(Stop::Stale);
        }
        let mut rest = self.pace.resting(show, size, moving);
        if rest.is_empty() && unfinished {
            rest.push(moving);
        }
        for (at, fineness) in rest.iter().enumerate() {
            // The last one is drawn to its end, those before it only begin.
            while self.draw(shared, number, order, *fineness)? && at + 1 == rest.len() {}
        }
        Ok(())
    }

    /// Draws once and delivers; says whether the same again would show more.
    fn draw(
        &mut self,
        shared: &Shared,
        number: u64,
        order: &RenderRequest,
        fineness: Fineness,
    ) -> Result<bool, Stop> {
        let whole = order.shot.size;
        let size = fineness.size(whole);
        let shot = Shot { size, samples: fineness.samples, ..order.shot.clone() };
        let stop = || shared.orders.is_stale(number);
        let begin = Instant::now();
        let drawn = self.with_easel(order, |easel| easel.draw(order, &shot, &stop));
        let (by, instead, stroke) = match drawn {
            Ok(drawn) => drawn,
            Err(RenderError::Cancelled) => return Err(Stop::Stale),
            Err(error) => return Err(self.easel.lost().map_or(Stop::Refused(error), Stop::Lost)),
        };
        let PartialFrame { canvas, light_samples, unfinished, relative_rms } = stroke;
        let seconds = begin.elapsed().as_secs_f64();
        self.pace.learn(shot.show, whole, fineness, seconds);
        let frame = Frame {
            canvas,
            size,
            of: order.shot.clone(),
            edition: order.edition,
            full: fineness.coarse == 1,
            seconds,
            by,
            instead,
            light_samples,
            unfinished,
            relative_rms,
        };
        shared.deliver(|delivery| (delivery.frame, delivery.refused) = (Some(frame), None));
        self.reached = Some((order.edition, order.shot.clone(), fineness, unfinished));
        if shared.orders.is_stale(number) { Err(Stop::Stale) } else { Ok(unfinished) }
    }

    /// Draws the pictures to keep, whatever else is asked for meanwhile: only who gives them up and the end stop them.
    fn keep(&mut self, shared: &Shared) -> Result<(), Stop> {
        loop {
            let next = shared.keeps().wanted.first().cloned();
            let Some((number, subject, order)) = next else { return Ok(()) };
            let is_wanted = || shared.keeps().wanted.iter().any(|(wanted, ..)| *wanted == number);
            let stop = || shared.orders.has_ended() || !is_wanted();
            let made = self.with_easel(&order, |easel| easel.picture(&order, &stop));
            if made.is_err()
                && let Some(reason) = self.easel.lost()
            {
                return Err(Stop::Lost(reason));
            }
            if shared.orders.has_ended() {
                return Err(Stop::Stale);
            }
            if is_wanted() {
                shared.keeps().wanted.retain(|(wanted, ..)| *wanted != number);
                shared.deliver(|delivery| {
                    delivery.pictures.push((subject, made.map(|(_, _, picture)| picture)));
                });
            }
        }
    }

    /// Does something with the easel, or with the spare one where the easel cannot. With the result come the name of
    /// what did it, and why it was the spare one.
    fn with_easel<T>(
        &mut self,
        order: &RenderRequest,
        mut work: impl FnMut(&mut dyn RendererAdapter) -> Result<T, RenderError>,
    ) -> Result<(String, Option<String>, T), RenderError> {
        let wanted: Vec<Mode> = order.shot.show.modes().collect();
        let before =
            self.refused.take().filter(|(edition, modes, _)| *edition == order.edition && *modes == wanted);
        let error = match before {
            Some((_, _, error)) => error,
            None => match guarded(|| work(self.easel.as_mut())) {
                Err(error) if error.is_of_the_device() && self.easel.lost().is_none() => error,
                result => return result.map(|made| (self.easel.name(), None, made)),
            },
        };
        let reason = error.to_string();
        self.refused = Some((order.edition, wanted, error));
        let made = guarded(|| work(self.spare.as_mut()))?;
        Ok((self.spare.name(), Some(reason), made))
    }
}

#[cfg(test)]
mod tests;
