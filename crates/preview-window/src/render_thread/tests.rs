//! The studio with easels that only pretend to draw.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use envmap::ToneMap;
use sphere::Rotation;

use super::*;
use crate::testkit;
use preview::{Background, Camera};

/// Longer than any of it takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// An easel that notes what it is asked for.
#[derive(Clone, Default)]
struct Pretence {
    name: &'static str,
    asked: Arc<Mutex<Vec<Shot>>>,
    error: Arc<Mutex<Option<RenderError>>>,
    lost: Arc<AtomicBool>,
    /// How many calls show more of brute force.
    bits: Arc<AtomicU32>,
}

impl Pretence {
    fn asked(&self) -> Vec<Shot> {
        self.asked.lock().unwrap().clone()
    }

    fn note(&self, shot: &Shot) -> Result<(), RenderError> {
        self.asked.lock().unwrap().push(shot.clone());
        self.error.lock().unwrap().clone().map_or(Ok(()), Err)
    }
}

impl RendererAdapter for Pretence {
    fn name(&self) -> String {
        self.name.into()
    }

    fn draw(
        &mut self,
        _order: &RenderRequest,
        shot: &Shot,
        _stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<PartialFrame, RenderError> {
        self.note(shot)?;
        let left = self.bits.load(Ordering::SeqCst);
        self.bits.store(left.saturating_sub(1), Ordering::SeqCst);
        Ok(PartialFrame {
            canvas: Canvas::Codes(Arc::new(picture(shot.size))),
            light_samples: 0,
            unfinished: left > 0,
            relative_rms: None,
        })
    }

    fn picture(
        &mut self,
        order: &RenderRequest,
        _stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        self.note(&order.shot)?;
        Ok(picture(order.shot.size))
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

fn order(mode: Mode) -> RenderRequest {
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
    };
    RenderRequest { edition: 1, scene, shot }
}

/// An easel that panics, or that draws a picture to keep until it is stopped.
struct Endless {
    panics: bool,
    begun: Arc<AtomicBool>,
}

impl RendererAdapter for Endless {
    fn name(&self) -> String {
        "endless".into()
    }

    fn draw(
        &mut self,
        _order: &RenderRequest,
        shot: &Shot,
        _stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<PartialFrame, RenderError> {
        assert!(!self.panics, "out of paint");
        let canvas = Canvas::Codes(Arc::new(picture(shot.size)));
        Ok(PartialFrame { canvas, light_samples: 0, unfinished: false, relative_rms: None })
    }

    fn picture(
        &mut self,
        _order: &RenderRequest,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        self.begun.store(true, Ordering::SeqCst);
        while !stop() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(RenderError::Cancelled)
    }

    fn lost(&self) -> Option<String> {
        None
    }
}

/// Gathers what is delivered until there is what is looked for.
fn wait<T>(studio: &RenderThread, mut look: impl FnMut(&Delivery) -> Option<T>) -> T {
    let until = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = look(&studio.take()) {
            return found;
        }
        assert!(Instant::now() < until, "nothing came");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn studio(easel: &Pretence, spare: &Pretence) -> RenderThread {
    RenderThread::new(Box::new(easel.clone()), Box::new(spare.clone()), || ()).unwrap()
}

fn pretences() -> [Pretence; 2] {
    ["device", "CPU"].map(|name| Pretence { name, ..Pretence::default() })
}

#[test]
fn a_picture_begins_coarse_and_ends_full_without_being_asked_again() {
    let [easel, spare] = pretences();
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::Mirror));
    let frame = wait(&studio, |delivery| delivery.frame.clone().filter(|frame| frame.full));
    assert_eq!((frame.size, frame.by.as_str(), &frame.instead), ([64, 40], "device", &None));
    assert!(studio.is_reached(&frame));
    studio.order(order(Mode::Irradiance));
    assert!(!studio.is_reached(&frame), "it is another order now");
    let sizes: Vec<[u32; 2]> = easel.asked().iter().map(|shot| shot.size).collect();
    assert_eq!(sizes[..2], [[16, 10], [64, 40]]);
    assert!(spare.asked().is_empty());
}

#[test]
fn the_same_order_again_is_no_order() {
    let [easel, spare] = pretences();
    let mut studio = studio(&easel, &spare);
    let same = order(Mode::Mirror);
    studio.order(same.clone());
    studio.order(same.clone());
    assert!(!studio.shared.orders.is_stale(1));
    studio.order(RenderRequest { edition: 2, ..same });
    assert!(studio.shared.orders.is_stale(1));
}

#[test]
fn brute_force_goes_on_until_it_gains_no_more() {
    let [easel, spare] = pretences();
    easel.bits.store(9, Ordering::SeqCst);
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::BruteForce));
    wait(&studio, |delivery| delivery.frame.clone().filter(|frame| frame.full && !frame.unfinished));
    assert!(easel.asked().len() >= 10);
}

#[test]
fn what_the_device_cannot_do_the_cpu_does_and_says_why() {
    let [easel, spare] = pretences();
    let limit = RenderError::Limit { what: "the local SHRM".into(), asked: 4096, limit: 2048 };
    *easel.error.lock().unwrap() = Some(limit.clone());
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::LocalShrm));
    let frame = wait(&studio, |delivery| delivery.frame.clone().filter(|frame| frame.full));
    assert_eq!((frame.by.as_str(), frame.instead), ("CPU", Some(limit.to_string())));
    assert_eq!(easel.asked().len(), 1, "it is not asked again for the same modes");
    studio.keep(subject(), order(Mode::LocalShrm));
    let kept = wait(&studio, |delivery| {
        delivery.pictures.first().map(|(of, made)| *of == subject() && made.is_ok())
    });
    assert!(kept);
    *easel.error.lock().unwrap() = None;
    studio.order(order(Mode::Mirror));
    wait(&studio, |delivery| delivery.frame.clone().filter(|frame| frame.by == "device"));
}

#[test]
fn what_no_easel_can_draw_is_refused_and_the_next_order_is_drawn() {
    let [easel, spare] = pretences();
    let missing = RenderError::Missing { what: "brute force", missing: "the material" };
    *easel.error.lock().unwrap() = Some(missing.clone());
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::BruteForce));
    assert_eq!(wait(&studio, |delivery| delivery.refused.clone()), missing);
    assert!(spare.asked().is_empty(), "the CPU lacks it as well");
    *easel.error.lock().unwrap() = None;
    studio.order(order(Mode::Mirror));
    wait(&studio, |delivery| delivery.frame.clone());
}

#[test]
fn a_lost_device_ends_the_work_with_its_reason() {
    let [easel, spare] = pretences();
    *easel.error.lock().unwrap() = Some(RenderError::Device("gone".into()));
    easel.lost.store(true, Ordering::SeqCst);
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::Mirror));
    assert_eq!(wait(&studio, |delivery| delivery.lost.clone()), "unplugged");
    assert!(spare.asked().is_empty());
}

#[test]
fn a_picture_to_keep_is_whole_and_what_was_seen_goes_on() {
    let [easel, spare] = pretences();
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::Mirror));
    let whole = order(Mode::Mirror);
    studio.keep(subject(), RenderRequest { shot: Shot { samples: 3, ..whole.shot }, ..whole });
    let mut full = false;
    let picture = wait(&studio, |delivery| {
        full |= delivery.frame.as_ref().is_some_and(|frame| frame.full);
        delivery.pictures.first().map(|(_, picture)| picture.clone().unwrap())
    });
    assert_eq!(picture.size, [64, 40]);
    wait(&studio, |delivery| {
        full |= delivery.frame.as_ref().is_some_and(|frame| frame.full);
        full.then_some(())
    });
}

#[test]
fn a_picture_to_keep_is_made_although_another_order_comes_at_once() {
    let [easel, spare] = pretences();
    let mut studio = studio(&easel, &spare);
    for _ in 0..3 {
        studio.keep(subject(), order(Mode::Mirror));
        studio.order(order(Mode::Irradiance));
    }
    let mut kept = 0;
    wait(&studio, |delivery| {
        kept += delivery.pictures.len();
        (kept == 3).then_some(())
    });
}

#[test]
fn a_picture_that_is_kept_does_not_make_the_seen_one_coarse() {
    let [easel, spare] = pretences();
    let mut studio = studio(&easel, &spare);
    studio.order(order(Mode::Mirror));
    wait(&studio, |delivery| delivery.frame.clone().filter(|frame| frame.full));
    studio.keep(subject(), order(Mode::Mirror));
    wait(&studio, |delivery| (!delivery.pictures.is_empty()).then_some(()));
    drop(studio);
    let coarse = easel.asked().iter().filter(|shot| shot.size != [64, 40]).count();
    assert_eq!(coarse, 1, "only the first one");
}

#[test]
fn a_picture_to_keep_can_be_given_up_and_what_is_seen_is_drawn() {
    let begun = Arc::new(AtomicBool::new(false));
    let endless = Endless { panics: false, begun: Arc::clone(&begun) };
    let [_, spare] = pretences();
    let mut studio = RenderThread::new(Box::new(endless), Box::new(spare), || ()).unwrap();
    studio.keep(subject(), order(Mode::Mirror));
    studio.order(order(Mode::Irradiance));
    wait(&studio, |_| begun.load(Ordering::SeqCst).then_some(()));
    assert!(studio.is_keeping());
    studio.give_up();
    assert!(!studio.is_keeping());
    wait(&studio, |delivery| {
        assert!(delivery.pictures.is_empty());
        delivery.frame.clone()
    });
}

#[test]
fn what_panics_is_drawn_by_the_other_easel_or_refused_and_the_thread_goes_on() {
    let panics = || Box::new(Endless { panics: true, begun: Arc::default() });
    let [_, spare] = pretences();
    let mut studio = RenderThread::new(panics(), Box::new(spare), || ()).unwrap();
    studio.order(order(Mode::Mirror));
    let frame = wait(&studio, |delivery| delivery.frame.clone());
    assert_eq!((frame.by.as_str(), frame.instead.as_deref()), ("CPU", Some("it panicked: out of paint")));
    let mut studio = RenderThread::new(panics(), panics(), || ()).unwrap();
    for mode in [Mode::Mirror, Mode::Irradiance] {
        studio.order(order(mode));
        let refused = wait(&studio, |delivery| delivery.refused.clone());
        assert_eq!(refused, RenderError::Device("it panicked: out of paint".into()));
    }
}
