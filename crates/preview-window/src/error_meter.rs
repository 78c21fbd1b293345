//! The thread that judges what is seen: figures of the scene, and how far each mode is from brute force in this view. It
//! works at a small size on the CPU, when things are at rest.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use envmap::ToneMap;
use sphere::Rotation;

use crate::figures::Figures;
use crate::guarded;
use crate::latest_value::LatestValue;
use preview::{Background, Camera, Mode, RenderError, Renderer, Scene, Shot, Show};

/// What is to be judged.
#[derive(Clone, Debug)]
pub(crate) struct Question {
    /// Another for every scene.
    pub(crate) edition: u64,
    pub(crate) scene: Arc<Scene>,
    pub(crate) camera: Camera,
    pub(crate) turn: Rotation,
    /// Of the picture that is seen.
    pub(crate) size: [u32; 2],
    pub(crate) modes: Vec<Mode>,
}

/// How far a mode is from brute force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// [`preview::Picture::relative_rms`], by so many samples of light a pixel.
    Rms {
        /// The RMS.
        relative: f64,
        /// The samples.
        by: u32,
    },
    /// There is nothing to compare, and why.
    None(String),
}

/// What is known.
#[derive(Debug, Default)]
pub(crate) struct Findings {
    figures: Option<(u64, Arc<Figures>)>,
    /// Of one question, without its modes.
    verdicts: Option<(Question, Vec<(Mode, Verdict)>)>,
}

struct Shared {
    questions: LatestValue<Question>,
    findings: Mutex<Findings>,
    wake: Box<dyn Fn() + Send + Sync>,
}

/// The thread and its questions.
pub(crate) struct ErrorMeter {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    last: Option<Question>,
}

/// The shorter side of the pictures that are compared, and the most pixels: of a long one both sides are shorter.
const SIDE: f64 = 80.0;
const AREA: f64 = 20_000.0;

/// Their samples of light, of each pixel, one round after the other. The noise of brute force adds to the RMS: another
/// round is worth it while that makes the RMS another.
const ROUNDS: [u32; 4] = [64, 256, 1024, 4096];

/// By what share an RMS must fall for another round.
const ANOTHER: f64 = 0.02;

/// A question that has stood for so long is worth an answer.
const REST: Duration = Duration::from_millis(500);

impl Question {
    /// Whether the same scene is seen in the same way.
    fn is_of_the_view(&self, other: &Self) -> bool {
        self.edition == other.edition
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
    /// Begins, with what draws. `wake` is called when something is found.
    pub(crate) fn new(
        renderer: Box<dyn Renderer + Send>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (questions, findings) = (LatestValue::new(), Mutex::default());
        let shared = Arc::new(Shared { questions, findings, wake: Box::new(wake) });
        let keep = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("judge".into()).spawn(move || shared.work(renderer))?;
        Ok(Self { shared: keep, thread: Some(thread), last: None })
    }

    /// Asks; an earlier question is no longer asked. The same again changes nothing.
    ///
    /// Of another view only figures are asked for, until `ready`: the picture itself needs the machine first.
    pub(crate) fn ask(&mut self, mut question: Question, ready: bool) {
        let begun = |last: &Question| last.is_of_the_view(&question) && !last.modes.is_empty();
        if !ready && !self.last.as_ref().is_some_and(begun) {
            question.modes.clear();
        }
        let same = |last: &Question| last.is_of_the_view(&question) && last.modes == question.modes;
        if !self.last.as_ref().is_some_and(same) {
            self.last = Some(question.clone());
            self.shared.questions.put(question);
        }
    }

    /// The figures of a scene, once they are known.
    pub(crate) fn figures(&self, edition: u64) -> Option<Arc<Figures>> {
        let findings = self.shared.findings();
        findings.figures.as_ref().filter(|(of, _)| *of == edition).map(|(_, figures)| Arc::clone(figures))
    }

    /// How far a mode is from brute force in what was asked last, once that is known.
    pub(crate) fn verdict(&self, mode: Mode) -> Option<Verdict> {
        if let Some(why) = no_comparison(mode) {
            return Some(Verdict::None(why.into()));
        }
        let asked = self.last.as_ref()?;
        let findings = self.shared.findings();
        let (_, verdicts) = findings.verdicts.as_ref().filter(|(of, _)| of.is_of_the_view(asked))?;
        verdicts.iter().find(|(of, _)| *of == mode).map(|(_, verdict)| verdict.clone())
    }
}

impl Drop for ErrorMeter {
    fn drop(&mut self) {
        self.shared.questions.end();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported where it happened.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn findings(&self) -> std::sync::MutexGuard<'_, Findings> {
        self.findings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self, mut renderer: Box<dyn Renderer + Send>) {
        while let Some((number, question)) = self.questions.take() {
            let edition = question.edition;
            let known = self.findings().figures.as_ref().is_some_and(|(of, _)| *of == edition);
            if !known {
                // Of a scene that makes it panic no figures are known.
                if let Ok(figures) = guarded(|| Ok(Figures::of(&question.scene))) {
                    self.findings().figures = Some((edition, Arc::new(figures)));
                    (self.wake)();
                }
            }
            if self.questions.becomes_stale(number, REST) {
                continue;
            }
            for &mode in &question.modes {
                if no_comparison(mode).is_some() || self.knows(&question, mode) {
                    continue;
                }
                let stop = || self.questions.is_stale(number);
                if let Err(RenderError::Cancelled) = self.judge(renderer.as_mut(), &question, mode, &stop) {
                    break;
                }
            }
        }
    }

    /// Judges a mode, round by round.
    fn judge(
        &self,
        renderer: &mut dyn Renderer,
        question: &Question,
        mode: Mode,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), RenderError> {
        let mut before = f64::INFINITY;
        for by in ROUNDS {
            let verdict = match guarded(|| judge(renderer, question, mode, by, stop)) {
                Err(RenderError::Cancelled) => {
                    self.forget(question, mode);
                    return Err(RenderError::Cancelled);
                }
                Err(error) => Verdict::None(error.to_string()),
                Ok(verdict) => verdict,
            };
            let another =
                matches!(verdict, Verdict::Rms { relative, .. } if relative < (1.0 - ANOTHER) * before);
            if let Verdict::Rms { relative, .. } = verdict {
                before = relative;
            }
            self.note(question, mode, verdict);
            (self.wake)();
            if !another {
                break;
            }
        }
        Ok(())
    }

    fn knows(&self, question: &Question, mode: Mode) -> bool {
        let findings = self.findings();
        let known = findings.verdicts.as_ref().filter(|(of, _)| of.is_of_the_view(question));
        known.is_some_and(|(_, verdicts)| verdicts.iter().any(|(of, _)| *of == mode))
    }

    fn note(&self, question: &Question, mode: Mode, verdict: Verdict) {
        let mut findings = self.findings();
        match &mut findings.verdicts {
            Some((of, verdicts)) if of.is_of_the_view(question) => {
                verdicts.retain(|(of, _)| *of != mode);
                verdicts.push((mode, verdict));
            }
            other => *other = Some((question.clone(), vec![(mode, verdict)])),
        }
    }

    /// Forgets what was found in rounds that were not the last.
    fn forget(&self, question: &Question, mode: Mode) {
        if let Some((of, verdicts)) = &mut self.findings().verdicts
            && of.is_of_the_view(question)
        {
            verdicts.retain(|(of, _)| *of != mode);
        }
    }
}

fn judge(
    renderer: &mut dyn Renderer,
    question: &Question,
    mode: Mode,
    by: u32,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Verdict, RenderError> {
    let shot = Shot {
        size: question.small(),
        samples: 1,
        camera: question.camera,
        turn: question.turn,
        show: Show::Difference { of: mode, from: Mode::BruteForce, amplify: 1.0 },
        background: Background::Flat([0.0; 3]),
        exposure: 0.0,
        tone: ToneMap::Plain,
        light_samples: by,
    };
    let picture = renderer.render(&question.scene, &shot, stop)?;
    let nothing = || Verdict::None("nothing is seen".into());
    Ok(picture.relative_rms.map_or_else(nothing, |relative| Verdict::Rms { relative, by }))
}

/// Why a mode is not compared with brute force.
fn no_comparison(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::BruteForce => Some("it is the reference"),
        Mode::Mirror | Mode::Irradiance => Some("it shows another material"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::testkit;
    use preview::Picture;

    /// Longer than any of it takes on a busy machine.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// Says that a mode is as far from brute force as its name is long, with noise by the first 256 samples of light; notes
    /// what it was asked for.
    struct Pretence(Arc<Mutex<Vec<Shot>>>);

    impl Renderer for Pretence {
        fn name(&self) -> String {
            "pretence".into()
        }

        fn render(
            &mut self,
            _scene: &Scene,
            shot: &Shot,
            _stop: &(dyn Fn() -> bool + Sync),
        ) -> Result<Picture, RenderError> {
            self.0.lock().unwrap().push(shot.clone());
            let Show::Difference { of, from: Mode::BruteForce, .. } = shot.show else {
                return Err(RenderError::Maps("not a difference from brute force".into()));
            };
            if of == Mode::Cabral {
                return Err(RenderError::Missing { what: "brute force", missing: "the material" });
            }
            let noise = if shot.light_samples < 256 { 1.0 } else { 0.0 };
            let relative_rms = Some(of.name().len() as f64 + noise);
            Ok(Picture { size: shot.size, codes: Vec::new(), radiance: Vec::new(), relative_rms })
        }
    }

    fn question(edition: u64, modes: &[Mode]) -> Question {
        let scene = Arc::new(testkit::scene());
        Question {
            edition,
            camera: Camera::new(scene.framing()),
            scene,
            turn: Rotation::from_yaw_pitch_roll(0.0, 0.0, 0.0),
            size: [1280, 800],
            modes: modes.to_vec(),
        }
    }

    fn wait<T>(mut look: impl FnMut() -> Option<T>) -> T {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(found) = look() {
                return found;
            }
            assert!(Instant::now() < until, "nothing was found");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn modes_are_judged_at_a_small_size_and_known_until_the_view_changes() {
        let asked = Arc::new(Mutex::new(Vec::new()));
        let mut judge = ErrorMeter::new(Box::new(Pretence(Arc::clone(&asked))), || ()).unwrap();
        let first = question(1, &[Mode::LocalShrm, Mode::BruteForce, Mode::Cabral]);
        judge.ask(first.clone(), true);
        let known = judge.verdict(Mode::BruteForce);
        assert_eq!(known, Some(Verdict::None("it is the reference".into())), "nobody has to work for that");
        assert_eq!(wait(|| judge.figures(1)).f, Some(7));
        let local = Verdict::Rms { relative: 10.0, by: 1024 };
        wait(|| judge.verdict(Mode::LocalShrm).filter(|verdict| *verdict == local));
        let Verdict::None(why) = wait(|| judge.verdict(Mode::Cabral)) else {
            panic!("Cabral has no material")
        };
        assert_eq!(why, "brute force: the material is not there");
        assert_eq!(asked.lock().unwrap()[0].size, [128, 80]);

        judge.ask(Question { modes: vec![Mode::LocalShrm, Mode::Prefiltered], ..first.clone() }, true);
        assert_eq!(judge.verdict(Mode::LocalShrm), Some(local.clone()), "it is known already");
        let plain = Verdict::Rms { relative: 11.0, by: 1024 };
        wait(|| judge.verdict(Mode::Prefiltered).filter(|verdict| *verdict == plain));
        assert_eq!(asked.lock().unwrap().len(), 7, "what is known is not judged again");

        let mut turned = first.clone();
        turned.camera.yaw += 0.1;
        judge.ask(turned, true);
        assert_eq!(judge.verdict(Mode::LocalShrm), None, "it is another view");
        assert!(judge.figures(1).is_some() && judge.figures(2).is_none());
        wait(|| judge.verdict(Mode::LocalShrm).filter(|verdict| *verdict == local));
        judge.ask(question(2, &[Mode::LocalShrm]), true);
        assert_eq!(judge.verdict(Mode::LocalShrm), None, "it is another scene");
        wait(|| judge.figures(2));
    }

    #[test]
    fn another_view_is_not_judged_before_its_picture_is_there() {
        let asked = Arc::new(Mutex::new(Vec::new()));
        let mut judge = ErrorMeter::new(Box::new(Pretence(Arc::clone(&asked))), || ()).unwrap();
        let first = question(1, &[Mode::LocalShrm]);
        judge.ask(first.clone(), false);
        wait(|| judge.figures(1));
        assert!(judge.last.as_ref().unwrap().modes.is_empty());
        judge.ask(first.clone(), true);
        wait(|| judge.verdict(Mode::LocalShrm));
        judge.ask(first.clone(), false);
        assert_eq!(judge.last.as_ref().unwrap().modes, [Mode::LocalShrm], "it has begun");
        let mut turned = first;
        turned.camera.yaw += 0.1;
        judge.ask(turned, false);
        assert!(judge.last.as_ref().unwrap().modes.is_empty());
    }

    #[test]
    fn pictures_that_are_compared_are_small_whatever_the_window_is() {
        let small = |size| Question { size, ..question(1, &[]) }.small();
        assert_eq!([small([1280, 800]), small([600, 600])], [[128, 80], [80, 80]]);
        for size in [[1, 1], [1, 4000], [16384, 10], [0, 7], [16384, 16384]] {
            let [width, height] = small(size);
            assert!(
                width >= 1 && height >= 1 && f64::from(width * height) < 1.1 * AREA,
                "{size:?}: {width} x {height}"
            );
        }
    }

    /// Panics by one mode.
    struct Broken;

    impl Renderer for Broken {
        fn name(&self) -> String {
            "broken".into()
        }

        fn render(
            &mut self,
            _scene: &Scene,
            shot: &Shot,
            _stop: &(dyn Fn() -> bool + Sync),
        ) -> Result<Picture, RenderError> {
            assert!(!shot.show.modes().any(|mode| mode == Mode::Cabral), "no Cabral");
            Ok(Picture { size: shot.size, codes: Vec::new(), radiance: Vec::new(), relative_rms: Some(0.5) })
        }
    }

    #[test]
    fn what_panics_is_told_and_the_rest_is_judged() {
        let mut judge = ErrorMeter::new(Box::new(Broken), || ()).unwrap();
        judge.ask(question(1, &[Mode::Cabral, Mode::LocalShrm]), true);
        let told = wait(|| judge.verdict(Mode::Cabral));
        assert_eq!(told, Verdict::None("it panicked: no Cabral".into()));
        wait(|| judge.verdict(Mode::LocalShrm).filter(|verdict| matches!(verdict, Verdict::Rms { .. })));
    }
}
