//! The thread that measures the errors of the modes against brute force in the current view, and the scene's
//! statistics. It draws small pictures on the CPU while the view is at rest.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use envmap::ToneMap;
use sh::Stop;
use sphere::Rotation;

use crate::latest_value::LatestValue;
use crate::panics::guarded;
use crate::scene_statistics::SceneStatistics;
use preview::{Background, Camera, Mode, PointSet, RenderError, Renderer, Scene, Shot, Show};

/// A view and the modes to measure.
#[derive(Clone, Debug)]
pub(crate) struct MeasureRequest {
    /// A number of its own for every scene.
    pub(crate) scene_id: u64,
    pub(crate) scene: Arc<Scene>,
    pub(crate) camera: Camera,
    pub(crate) turn: Rotation,
    /// The size of the picture in the window.
    pub(crate) size: [u32; 2],
    pub(crate) modes: Vec<Mode>,
}

/// The error of a mode against brute force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ModeError {
    /// The distance of the mode's picture from that of brute force.
    Measured {
        /// The error by [`preview::Picture::stops`]: 95 and 99 of 100 samples are within these.
        stops: [f64; 2],
        /// The error by [`preview::Picture::relative_rms`].
        rms: f64,
        /// The light samples of a pixel by brute force.
        light_samples: u32,
    },
    /// The mode has no error, for this reason.
    None(String),
}

#[derive(Debug, Default)]
pub(crate) struct Measurements {
    statistics: Option<(u64, Arc<SceneStatistics>)>,
    /// The errors in one view.
    errors: Option<(MeasureRequest, Vec<(Mode, ModeError)>)>,
}

struct SharedMeasurements {
    requests: LatestValue<MeasureRequest>,
    measurements: Mutex<Measurements>,
    wake: Box<dyn Fn() + Send + Sync>,
}

/// The thread and its requests.
pub(crate) struct ErrorMeter {
    shared: Arc<SharedMeasurements>,
    thread: Option<JoinHandle<()>>,
    last: Option<MeasureRequest>,
}

/// The shorter side of the compared pictures in pixels, and the most pixels, to which long ones shrink.
const SIDE: f64 = 80.0;
const AREA: f64 = 20_000.0;

/// The light samples of a pixel in each round. Noise adds to every error, so rounds follow while one falls.
const ROUNDS: [u32; 4] = [64, 256, 1024, 4096];

/// The share by which an error must fall for another round.
const LEAST_FALL: f64 = 0.02;

/// Measuring starts when the view has been at rest for this long.
const REST: Duration = Duration::from_millis(500);

impl MeasureRequest {
    /// Whether both requests have the same scene, camera, light and size.
    fn has_same_view(&self, other: &Self) -> bool {
        self.scene_id == other.scene_id
            && self.camera == other.camera
            && self.turn == other.turn
            && self.small() == other.small()
    }

    /// The size to compare at.
    fn small(&self) -> [u32; 2] {
        let size = self.size.map(|side| f64::from(side.max(1)));
        let scale = (SIDE / size[0].min(size[1])).min((AREA / (size[0] * size[1])).sqrt());
        size.map(|side| (side * scale).round().clamp(1.0, AREA) as u32)
    }
}

impl ErrorMeter {
    /// Starts the thread. `wake` is called when there are new results.
    pub(crate) fn new(
        renderer: Box<dyn Renderer + Send>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (requests, measurements) = (LatestValue::new(), Mutex::default());
        let shared = Arc::new(SharedMeasurements { requests, measurements, wake: Box::new(wake) });
        let of_thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("error meter".into());
        let thread = thread.spawn(move || of_thread.run(renderer))?;
        Ok(Self { shared, thread: Some(thread), last: None })
    }

    /// Requests measurements in place of those requested before. The same request again changes nothing.
    ///
    /// A new view gets only statistics until `ready`, so that its picture has the processor to itself.
    pub(crate) fn request(&mut self, mut request: MeasureRequest, ready: bool) {
        let started = |last: &MeasureRequest| last.has_same_view(&request) && !last.modes.is_empty();
        if !ready && !self.last.as_ref().is_some_and(started) {
            request.modes.clear();
        }
        let same = |last: &MeasureRequest| last.has_same_view(&request) && last.modes == request.modes;
        if !self.last.as_ref().is_some_and(same) {
            self.last = Some(request.clone());
            self.shared.requests.put(request);
        }
    }

    /// The statistics of a scene, once they are known.
    pub(crate) fn statistics(&self, scene_id: u64) -> Option<Arc<SceneStatistics>> {
        let measurements = self.shared.measurements();
        measurements
            .statistics
            .as_ref()
            .filter(|(of, _)| *of == scene_id)
            .map(|(_, statistics)| Arc::clone(statistics))
    }

    /// The error of a mode in the view requested last, once it is known.
    pub(crate) fn mode_error(&self, mode: Mode) -> Option<ModeError> {
        if let Some(why) = no_comparison(mode) {
            return Some(ModeError::None(why.into()));
        }
        let last = self.last.as_ref()?;
        let measurements = self.shared.measurements();
        let (_, errors) = measurements.errors.as_ref().filter(|(of, _)| of.has_same_view(last))?;
        errors.iter().find(|(of, _)| *of == mode).map(|(_, mode_error)| mode_error.clone())
    }
}

impl Drop for ErrorMeter {
    fn drop(&mut self) {
        self.shared.requests.end();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl SharedMeasurements {
    fn measurements(&self) -> std::sync::MutexGuard<'_, Measurements> {
        self.measurements.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self, mut renderer: Box<dyn Renderer + Send>) {
        while let Some((number, request)) = self.requests.take() {
            let scene_id = request.scene_id;
            let known = self.measurements().statistics.as_ref().is_some_and(|(of, _)| *of == scene_id);
            if !known {
                // If they panic, the scene has no statistics.
                if let Ok(statistics) = guarded(|| Ok(SceneStatistics::of(&request.scene))) {
                    self.measurements().statistics = Some((scene_id, Arc::new(statistics)));
                    (self.wake)();
                }
            }
            if self.requests.becomes_stale(number, REST) {
                continue;
            }
            for &mode in &request.modes {
                if no_comparison(mode).is_some() || self.knows(&request, mode) {
                    continue;
                }
                let stop = || self.requests.is_stale(number);
                let measured = self.measure_in_rounds(renderer.as_mut(), &request, mode, Stop::when(&stop));
                if let Err(RenderError::Cancelled) = measured {
                    break;
                }
            }
        }
    }

    /// Measures a mode with more and more light samples.
    fn measure_in_rounds(
        &self,
        renderer: &mut dyn Renderer,
        request: &MeasureRequest,
        mode: Mode,
        stop: Stop<'_>,
    ) -> Result<(), RenderError> {
        let mut before = [f64::INFINITY; 3];
        for light_samples in ROUNDS {
            let mode_error = match guarded(|| measure(renderer, request, mode, light_samples, stop)) {
                Err(RenderError::Cancelled) => {
                    self.forget(request, mode);
                    return Err(RenderError::Cancelled);
                }
                Err(error) => ModeError::None(error.to_string()),
                Ok(mode_error) => mode_error,
            };
            let mut falls = false;
            if let ModeError::Measured { stops: [p95, p99], rms, .. } = mode_error {
                let errors = [p95, p99, rms];
                falls = errors.iter().zip(before).any(|(error, before)| *error < (1.0 - LEAST_FALL) * before);
                before = errors;
            }
            self.store(request, mode, mode_error);
            (self.wake)();
            if !falls {
                break;
            }
        }
        Ok(())
    }

    fn knows(&self, request: &MeasureRequest, mode: Mode) -> bool {
        let measurements = self.measurements();
        let known = measurements.errors.as_ref().filter(|(of, _)| of.has_same_view(request));
        known.is_some_and(|(_, errors)| errors.iter().any(|(of, _)| *of == mode))
    }

    fn store(&self, request: &MeasureRequest, mode: Mode, mode_error: ModeError) {
        let mut measurements = self.measurements();
        match &mut measurements.errors {
            Some((of, errors)) if of.has_same_view(request) => {
                errors.retain(|(of, _)| *of != mode);
                errors.push((mode, mode_error));
            }
            other => *other = Some((request.clone(), vec![(mode, mode_error)])),
        }
    }

    /// Drops the error of a mode whose rounds were cancelled.
    fn forget(&self, request: &MeasureRequest, mode: Mode) {
        if let Some((of, errors)) = &mut self.measurements().errors
            && of.has_same_view(request)
        {
            errors.retain(|(of, _)| *of != mode);
        }
    }
}

fn measure(
    renderer: &mut dyn Renderer,
    request: &MeasureRequest,
    mode: Mode,
    light_samples: u32,
    stop: Stop<'_>,
) -> Result<ModeError, RenderError> {
    let mut shot = Shot {
        size: request.small(),
        samples: 1,
        camera: request.camera,
        turn: request.turn,
        show: Show::One(mode),
        background: Background::Flat([0.0; 3]),
        exposure: 0.0,
        tone: ToneMap::Plain,
        light_samples,
        points: PointSet::Even,
    };
    let of = renderer.render(&request.scene, &shot, stop)?;
    shot.show = Show::One(mode.reference());
    let from = renderer.render(&request.scene, &shot, stop)?;
    Ok(match of.stops(&from, request.scene.light.dark()) {
        Some(stops) => {
            let rms = of.difference(&from, 1.0, &shot).relative_rms.unwrap_or(0.0);
            ModeError::Measured { stops, rms, light_samples }
        }
        None => ModeError::None("no surface is visible".into()),
    })
}

/// Why a mode is not compared with brute force.
fn no_comparison(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::BruteForce | Mode::ShadowedBruteForce => Some("it is the reference"),
        Mode::Mirror | Mode::Irradiance => Some("it replaces the material"),
        Mode::Samples => Some("it is a diagram"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::testkit;
    use preview::Picture;

    /// Longer than any test takes on a busy machine.
    const TIMEOUT: Duration = Duration::from_secs(60);

    /// Records shots of modes. Brute force is 1; a mode is as many stops brighter as its name has letters,
    /// plus noise below 256 light samples.
    struct ShotRecorder(Arc<Mutex<Vec<Shot>>>);

    impl Renderer for ShotRecorder {
        fn name(&self) -> String {
            "fake".into()
        }

        fn render(&mut self, _scene: &Scene, shot: &Shot, _stop: Stop<'_>) -> Result<Picture, RenderError> {
            let Show::One(of) = shot.show else {
                return Err(RenderError::Maps("more than one mode".into()));
            };
            if of == Mode::BruteForce {
                return Ok(flat(shot, 0.0));
            }
            self.0.lock().unwrap().push(shot.clone());
            if of == Mode::Cabral {
                return Err(RenderError::Missing { what: "brute force", missing: "the material" });
            }
            let noise = if shot.light_samples < 256 { 1.0 } else { 0.0 };
            Ok(flat(shot, of.name().len() as f32 + noise))
        }
    }

    /// A surface all over the picture, so many stops brighter than a million.
    fn flat(shot: &Shot, stops: f32) -> Picture {
        let value = 1e6 * stops.exp2();
        let pixels = shot.size[0] as usize * shot.size[1] as usize;
        let radiance = vec![[value, value, value, 1.0]; pixels];
        Picture { size: shot.size, codes: Vec::new(), radiance, relative_rms: None }
    }

    /// Whether an error is one of so many stops.
    fn is_stops(mode_error: &ModeError, expected: f64) -> bool {
        matches!(mode_error, ModeError::Measured { stops: [p95, p99], light_samples: 1024, .. }
            if (p95 - expected).abs() < 1e-3 && (p99 - expected).abs() < 1e-3)
    }

    fn request(scene_id: u64, modes: &[Mode]) -> MeasureRequest {
        let scene = Arc::new(testkit::scene());
        MeasureRequest {
            scene_id,
            camera: Camera::new(scene.framing()),
            scene,
            turn: Rotation::from_yaw_pitch_roll(0.0, 0.0, 0.0),
            size: [1280, 800],
            modes: modes.to_vec(),
        }
    }

    fn wait<T>(mut look: impl FnMut() -> Option<T>) -> T {
        let until = Instant::now() + TIMEOUT;
        loop {
            if let Some(found) = look() {
                return found;
            }
            assert!(Instant::now() < until, "no result in time");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn modes_are_measured_at_a_small_size_and_known_until_the_view_changes() {
        let drawn = Arc::new(Mutex::new(Vec::new()));
        let mut error_meter = ErrorMeter::new(Box::new(ShotRecorder(Arc::clone(&drawn))), || ()).unwrap();
        let first = request(1, &[Mode::LocalShrm, Mode::BruteForce, Mode::Cabral]);
        error_meter.request(first.clone(), true);
        let known = error_meter.mode_error(Mode::BruteForce);
        assert_eq!(known, Some(ModeError::None("it is the reference".into())), "nothing is drawn for that");
        assert_eq!(wait(|| error_meter.statistics(1)).f, Some(7));
        let local = |error_meter: &ErrorMeter| {
            error_meter.mode_error(Mode::LocalShrm).filter(|mode_error| is_stops(mode_error, 10.0))
        };
        wait(|| local(&error_meter));
        let ModeError::None(why) = wait(|| error_meter.mode_error(Mode::Cabral)) else {
            panic!("Cabral has no material")
        };
        assert_eq!(why, "brute force needs the material");
        assert_eq!(drawn.lock().unwrap()[0].size, [128, 80]);

        error_meter.request(
            MeasureRequest { modes: vec![Mode::LocalShrm, Mode::Prefiltered], ..first.clone() },
            true,
        );
        assert!(local(&error_meter).is_some(), "it is known already");
        wait(|| error_meter.mode_error(Mode::Prefiltered).filter(|mode_error| is_stops(mode_error, 11.0)));
        assert_eq!(drawn.lock().unwrap().len(), 7, "a known error is not measured again");

        let mut turned = first.clone();
        turned.camera.yaw += 0.1;
        error_meter.request(turned, true);
        assert_eq!(error_meter.mode_error(Mode::LocalShrm), None, "it is another view");
        assert!(error_meter.statistics(1).is_some() && error_meter.statistics(2).is_none());
        wait(|| local(&error_meter));
        error_meter.request(request(2, &[Mode::LocalShrm]), true);
        assert_eq!(error_meter.mode_error(Mode::LocalShrm), None, "it is another scene");
        wait(|| error_meter.statistics(2));
    }

    #[test]
    fn a_new_view_is_not_measured_before_its_picture_is_drawn() {
        let mut error_meter = ErrorMeter::new(Box::new(ShotRecorder(Arc::default())), || ()).unwrap();
        let first = request(1, &[Mode::LocalShrm]);
        error_meter.request(first.clone(), false);
        wait(|| error_meter.statistics(1));
        assert!(error_meter.last.as_ref().unwrap().modes.is_empty());
        error_meter.request(first.clone(), true);
        wait(|| error_meter.mode_error(Mode::LocalShrm));
        error_meter.request(first.clone(), false);
        assert_eq!(error_meter.last.as_ref().unwrap().modes, [Mode::LocalShrm], "it has started");
        let mut turned = first;
        turned.camera.yaw += 0.1;
        error_meter.request(turned, false);
        assert!(error_meter.last.as_ref().unwrap().modes.is_empty());
    }

    #[test]
    fn compared_pictures_are_small_for_any_size_of_the_window() {
        let small = |size| MeasureRequest { size, ..request(1, &[]) }.small();
        assert_eq!([small([1280, 800]), small([600, 600])], [[128, 80], [80, 80]]);
        for size in [[1, 1], [1, 4000], [16384, 10], [0, 7], [16384, 16384]] {
            let [width, height] = small(size);
            assert!(
                width >= 1 && height >= 1 && f64::from(width * height) < 1.1 * AREA,
                "{size:?}: {width} x {height}"
            );
        }
    }

    /// Panics when it draws one of the modes.
    struct PanickingRenderer;

    impl Renderer for PanickingRenderer {
        fn name(&self) -> String {
            "broken".into()
        }

        fn render(&mut self, _scene: &Scene, shot: &Shot, _stop: Stop<'_>) -> Result<Picture, RenderError> {
            assert!(!shot.show.modes().any(|mode| mode == Mode::Cabral), "no Cabral");
            Ok(flat(shot, 0.5))
        }
    }

    #[test]
    fn a_panic_is_reported_and_the_other_modes_are_measured() {
        let mut error_meter = ErrorMeter::new(Box::new(PanickingRenderer), || ()).unwrap();
        error_meter.request(request(1, &[Mode::Cabral, Mode::LocalShrm]), true);
        let reported = wait(|| error_meter.mode_error(Mode::Cabral));
        assert_eq!(reported, ModeError::None("the renderer panicked: no Cabral".into()));
        wait(|| {
            error_meter
                .mode_error(Mode::LocalShrm)
                .filter(|mode_error| matches!(mode_error, ModeError::Measured { .. }))
        });
    }
}
