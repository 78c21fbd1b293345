//! The render thread with renderers that only pretend to draw.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use envmap::ToneMap;
use sphere::Rotation;

use super::*;
use crate::testkit;
use preview::{Background, Camera, PointSet};

/// Longer than any test takes on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A renderer that records its shots.
#[derive(Clone, Default)]
struct FakeRenderer {
    name: &'static str,
    shots: Arc<Mutex<Vec<Shot>>>,
    error: Arc<Mutex<Option<RenderError>>>,
    lost: Arc<AtomicBool>,
    /// How many more calls improve the picture.
    improvements: Arc<AtomicU32>,
}

impl FakeRenderer {
    fn shots(&self) -> Vec<Shot> {
        self.shots.lock().unwrap().clone()
    }

    fn record(&self, shot: &Shot) -> Result<(), RenderError> {
        self.shots.lock().unwrap().push(shot.clone());
        self.error.lock().unwrap().clone().map_or(Ok(()), Err)
    }
}

impl RendererAdapter for FakeRenderer {
    fn name(&self) -> String {
        self.name.into()
    }

    fn draw(
        &mut self,
        _order: &RenderRequest,
        shot: &Shot,
        _stop: sh::Stop<'_>,
    ) -> Result<PartialFrame, RenderError> {
        self.record(shot)?;
        let left = self.improvements.load(Ordering::SeqCst);
        self.improvements.store(left.saturating_sub(1), Ordering::SeqCst);
        Ok(PartialFrame {
            image: FrameImage::Codes(Arc::new(picture(shot.size))),
            light_samples: 0,
            unfinished: left > 0,
            relative_rms: None,
        })
    }

    fn picture(&mut self, request: &RenderRequest, _stop: sh::Stop<'_>) -> Result<Picture, RenderError> {
        self.record(&request.shot)?;
        Ok(picture(request.shot.size))
    }

    fn lost(&self) -> Option<String> {
        self.lost.load(Ordering::SeqCst).then(|| "unplugged".into())
    }
}

fn picture(size: [u32; 2]) -> Picture {
    let pixels = (size[0] * size[1]) as usize;
    Picture { size, codes: vec![[0; 3]; pixels], radiance: vec![[0.0; 4]; pixels], relative_rms: None }
}

fn subject() -> Subject {
    Subject { environment: "sky".into(), material: "white".into(), mesh: "sphere".into() }
}

fn request(mode: Mode) -> RenderRequest {
    let scene = Arc::new(testkit::scene());
    let shot = Shot {
        size: [64, 40],
        samples: 1,
        camera: Camera::new(scene.framing()),
        turn: Rotation::from_yaw_pitch_roll(0.0, 0.0, 0.0),
        show: preview::Show::One(mode),
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Filmic,
        light_samples: 64,
        points: PointSet::Even,
    };
    RenderRequest { scene_id: 1, scene, shot }
}

/// A renderer that panics, or that draws a screenshot until it is stopped.
struct Endless {
    panics: bool,
    started: Arc<AtomicBool>,
}

impl RendererAdapter for Endless {
    fn name(&self) -> String {
        "endless".into()
    }

    fn draw(
        &mut self,
        _order: &RenderRequest,
        shot: &Shot,
        _stop: sh::Stop<'_>,
    ) -> Result<PartialFrame, RenderError> {
        assert!(!self.panics, "out of paint");
        let image = FrameImage::Codes(Arc::new(picture(shot.size)));
        Ok(PartialFrame { image, light_samples: 0, unfinished: false, relative_rms: None })
    }

    fn picture(&mut self, _order: &RenderRequest, stop: sh::Stop<'_>) -> Result<Picture, RenderError> {
        self.started.store(true, Ordering::SeqCst);
        while !stop.requested() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(RenderError::Cancelled)
    }

    fn lost(&self) -> Option<String> {
        None
    }
}

/// Takes results until `look` finds something.
fn wait<T>(render_thread: &RenderThread, mut look: impl FnMut(&RenderResults) -> Option<T>) -> T {
    let until = Instant::now() + TIMEOUT;
    loop {
        if let Some(found) = look(&render_thread.take()) {
            return found;
        }
        assert!(Instant::now() < until, "no result in time");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn start(renderer: &FakeRenderer, fallback: &FakeRenderer) -> RenderThread {
    RenderThread::new(Box::new(renderer.clone()), Box::new(fallback.clone()), || ()).unwrap()
}

fn fakes() -> [FakeRenderer; 2] {
    ["device", "CPU"].map(|name| FakeRenderer { name, ..FakeRenderer::default() })
}

#[test]
fn a_picture_starts_coarse_and_ends_full_by_itself() {
    let [renderer, fallback] = fakes();
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::Mirror));
    let frame = wait(&render_thread, |results| results.frame.clone().filter(|frame| frame.full));
    assert_eq!((frame.size, frame.renderer.as_str(), &frame.fallback_reason), ([64, 40], "device", &None));
    assert!(render_thread.is_current(&frame));
    render_thread.request(request(Mode::Irradiance));
    assert!(!render_thread.is_current(&frame), "there is a new request now");
    let sizes: Vec<[u32; 2]> = renderer.shots().iter().map(|shot| shot.size).collect();
    assert_eq!(sizes[..2], [[16, 10], [64, 40]]);
    assert!(fallback.shots().is_empty());
}

#[test]
fn the_same_request_again_changes_nothing() {
    let [renderer, fallback] = fakes();
    let mut render_thread = start(&renderer, &fallback);
    let same = request(Mode::Mirror);
    render_thread.request(same.clone());
    render_thread.request(same.clone());
    assert!(!render_thread.shared.requests.is_stale(1));
    render_thread.request(RenderRequest { scene_id: 2, ..same });
    assert!(render_thread.shared.requests.is_stale(1));
}

#[test]
fn brute_force_goes_on_until_it_is_finished() {
    let [renderer, fallback] = fakes();
    renderer.improvements.store(9, Ordering::SeqCst);
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::BruteForce));
    wait(&render_thread, |results| results.frame.clone().filter(|frame| frame.full && !frame.unfinished));
    assert!(renderer.shots().len() >= 10);
}

#[test]
fn the_cpu_draws_what_the_device_cannot_and_the_frame_says_why() {
    let [renderer, fallback] = fakes();
    let limit = RenderError::Limit { what: "the local SHRM".into(), asked: 4096, limit: 2048 };
    *renderer.error.lock().unwrap() = Some(limit.clone());
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::LocalShrm));
    let frame = wait(&render_thread, |results| results.frame.clone().filter(|frame| frame.full));
    assert_eq!((frame.renderer.as_str(), frame.fallback_reason), ("CPU", Some(limit.to_string())));
    assert_eq!(renderer.shots().len(), 1, "it does not try the same modes again");
    render_thread.screenshot(subject(), request(Mode::LocalShrm));
    let saved = wait(&render_thread, |results| {
        results.screenshots.first().map(|(of, made)| *of == subject() && made.is_ok())
    });
    assert!(saved);
    *renderer.error.lock().unwrap() = None;
    render_thread.request(request(Mode::Mirror));
    wait(&render_thread, |results| results.frame.clone().filter(|frame| frame.renderer == "device"));
}

#[test]
fn an_impossible_request_is_an_error_and_the_next_one_is_drawn() {
    let [renderer, fallback] = fakes();
    let missing = RenderError::Missing { what: "brute force", missing: "the material" };
    *renderer.error.lock().unwrap() = Some(missing.clone());
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::BruteForce));
    assert_eq!(wait(&render_thread, |results| results.error.clone()), missing);
    assert!(fallback.shots().is_empty(), "the CPU could not draw it either");
    *renderer.error.lock().unwrap() = None;
    render_thread.request(request(Mode::Mirror));
    wait(&render_thread, |results| results.frame.clone());
}

#[test]
fn a_lost_device_ends_the_thread_with_its_reason() {
    let [renderer, fallback] = fakes();
    *renderer.error.lock().unwrap() = Some(RenderError::Device("gone".into()));
    renderer.lost.store(true, Ordering::SeqCst);
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::Mirror));
    assert_eq!(wait(&render_thread, |results| results.lost.clone()), "unplugged");
    assert!(fallback.shots().is_empty());
}

#[test]
fn a_screenshot_is_finished_and_the_request_goes_on() {
    let [renderer, fallback] = fakes();
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::Mirror));
    let whole = request(Mode::Mirror);
    render_thread.screenshot(subject(), RenderRequest { shot: Shot { samples: 3, ..whole.shot }, ..whole });
    let mut full = false;
    let picture = wait(&render_thread, |results| {
        full |= results.frame.as_ref().is_some_and(|frame| frame.full);
        results.screenshots.first().map(|(_, picture)| picture.clone().unwrap())
    });
    assert_eq!(picture.size, [64, 40]);
    wait(&render_thread, |results| {
        full |= results.frame.as_ref().is_some_and(|frame| frame.full);
        full.then_some(())
    });
}

#[test]
fn a_screenshot_is_made_although_a_new_request_comes_at_once() {
    let [renderer, fallback] = fakes();
    let mut render_thread = start(&renderer, &fallback);
    for _ in 0..3 {
        render_thread.screenshot(subject(), request(Mode::Mirror));
        render_thread.request(request(Mode::Irradiance));
    }
    let mut saved = 0;
    wait(&render_thread, |results| {
        saved += results.screenshots.len();
        (saved == 3).then_some(())
    });
}

#[test]
fn a_screenshot_does_not_make_the_picture_coarse() {
    let [renderer, fallback] = fakes();
    let mut render_thread = start(&renderer, &fallback);
    render_thread.request(request(Mode::Mirror));
    wait(&render_thread, |results| results.frame.clone().filter(|frame| frame.full));
    render_thread.screenshot(subject(), request(Mode::Mirror));
    wait(&render_thread, |results| (!results.screenshots.is_empty()).then_some(()));
    drop(render_thread);
    let coarse = renderer.shots().iter().filter(|shot| shot.size != [64, 40]).count();
    assert_eq!(coarse, 1, "only the first one");
}

#[test]
fn a_screenshot_can_be_cancelled_and_the_request_is_drawn() {
    let started = Arc::new(AtomicBool::new(false));
    let endless = Endless { panics: false, started: Arc::clone(&started) };
    let [_, fallback] = fakes();
    let mut render_thread = RenderThread::new(Box::new(endless), Box::new(fallback), || ()).unwrap();
    render_thread.screenshot(subject(), request(Mode::Mirror));
    render_thread.request(request(Mode::Irradiance));
    wait(&render_thread, |_| started.load(Ordering::SeqCst).then_some(()));
    assert!(render_thread.has_screenshots());
    render_thread.cancel_screenshots();
    assert!(!render_thread.has_screenshots());
    wait(&render_thread, |results| {
        assert!(results.screenshots.is_empty());
        results.frame.clone()
    });
}

#[test]
fn after_a_panic_the_fallback_draws_and_the_thread_goes_on() {
    let panics = || Box::new(Endless { panics: true, started: Arc::default() });
    let [_, fallback] = fakes();
    let mut render_thread = RenderThread::new(panics(), Box::new(fallback), || ()).unwrap();
    render_thread.request(request(Mode::Mirror));
    let frame = wait(&render_thread, |results| results.frame.clone());
    assert_eq!(
        (frame.renderer.as_str(), frame.fallback_reason.as_deref()),
        ("CPU", Some("the renderer panicked: out of paint"))
    );
    let mut render_thread = RenderThread::new(panics(), panics(), || ()).unwrap();
    for mode in [Mode::Mirror, Mode::Irradiance] {
        render_thread.request(request(mode));
        let error = wait(&render_thread, |results| results.error.clone());
        assert_eq!(error, RenderError::Device("the renderer panicked: out of paint".into()));
    }
}
