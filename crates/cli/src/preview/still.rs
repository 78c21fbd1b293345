//! One picture, without a window.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use ::preview::{Cpu, Mode, Picture, RenderError, Renderer, Scene, Shot, graphics_device};
use ::preview::{InitialView, Subject};
use engine::{BuildOptions, Cancel, Event, Plan, ResultsSnapshot};
use stages::{PreviewCatalog, SceneCache};

use super::{files, subject};
use crate::arguments::{Backend, PreviewArguments};
use crate::build::{exit_of, stop_on_interrupt};
use crate::print::{self, say};
use crate::progress::Progress;
use crate::{Exit, exit, quantity};

/// The size of a still that stands in for a window.
pub(crate) const SIZE: [u32; 2] = [1280, 720];

/// The longest side of a still.
const LONGEST: u32 = 8192;

/// `1280x720`
pub(crate) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']);
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let sides = sides.filter(|sides: &[u32; 2]| sides.iter().all(|side| (1..=LONGEST).contains(side)));
    sides.ok_or_else(|| format!("expected two numbers from 1 to {LONGEST}, such as 1280x720"))
}

/// A number of stops.
pub(crate) fn parse_exposure(text: &str) -> Result<f64, String> {
    let stops = text.parse().ok().filter(|stops: &f64| stops.abs() <= 24.0);
    stops.ok_or_else(|| "expected a number of stops from -24 to 24, such as -1.5".into())
}

/// A file that a picture can be written to.
pub(crate) fn parse_file(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let is_png = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if is_png { Ok(file) } else { Err("a still is a PNG: its name ends in .png".into()) }
}

/// Builds what a picture needs, draws it and writes it.
pub(crate) fn run(
    arguments: &PreviewArguments,
    file: &Path,
    showcase: PreviewCatalog,
    view: &InitialView,
) -> Exit {
    let subject = view.subject(&showcase.catalog());
    let found = subject::exhibit(&showcase, &subject.environment, &subject.material);
    let exhibit = match found {
        Ok(exhibit) => exhibit,
        Err(amiss) => {
            print::error(&[amiss.message], Some(&amiss.help));
            return Exit::Usage;
        }
    };
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let stages = showcase.stages(exhibit, &subject.mesh).into_iter().map(str::to_owned).collect();
    let built = match build(showcase.plan(), stages, arguments, &cancel) {
        Ok(Exit::Interrupted) => return Exit::Interrupted,
        Ok(built) => built,
        Err(exit) => return exit,
    };
    let shelf = match ResultsSnapshot::open(showcase.plan()) {
        Ok(shelf) => shelf,
        Err(error) => return exit::of_error(&error),
    };
    let scene = match SceneCache::default().scene(&showcase, &shelf, exhibit, &subject.mesh) {
        Ok(scene) => scene,
        Err(failure) => {
            let is_of_system = built == Exit::Machine || failure.system_error;
            let mut chain = vec![format!("{} cannot be shown", subject::told(&subject))];
            chain.extend(failure.chain);
            print::error(&chain, failure.help.as_deref());
            return if is_of_system { Exit::Machine } else { Exit::Failed };
        }
    };
    let shot = Shot { exposure: arguments.exposure, ..view.shot(scene.framing(), arguments.size) };
    let backend = arguments.backend.unwrap_or(Backend::Cpu);
    match draw(&scene, &shot, backend, &|| cancel.is_cancelled()) {
        Ok(drawn) => match files::write_picture(file, &drawn.picture) {
            Ok(()) => {
                say!("{}", drawn.told(file, &subject, &shot));
                built
            }
            Err(error) => unwritable(file, &error),
        },
        Err(RenderError::Cancelled) => Exit::Interrupted,
        Err(error) => {
            print::error(&[format!("{} cannot be drawn", subject::told(&subject)), error.to_string()], None);
            Exit::Failed
        }
    }
}

/// Says why a picture could not be written.
fn unwritable(file: &Path, error: &io::Error) -> Exit {
    print::error(&[format!("cannot write {}", file.display()), error.to_string()], None);
    Exit::Machine
}

/// Runs what is out of date of these stages.
fn build(
    plan: &Plan,
    stages: Vec<String>,
    arguments: &PreviewArguments,
    cancel: &Cancel,
) -> Result<Exit, Exit> {
    let options = BuildOptions {
        stages,
        jobs: arguments.way.jobs.map(usize::from),
        keep_going: true,
        ..BuildOptions::default()
    };
    let progress = Progress::new(arguments.way.verbose, false, true);
    let events = |event: Event| progress.tell(&event);
    match engine::build(plan, &options, cancel, &events) {
        Ok(summary) => {
            progress.tell_failures();
            Ok(exit_of(&summary))
        }
        Err(error) => {
            progress.tell_failures();
            Err(exit::of_error(&error))
        }
    }
}

/// A picture, and how it came about.
pub(crate) struct Drawn {
    pub(crate) picture: Picture,
    /// What drew it.
    renderer: String,
    milliseconds: f64,
}

impl Drawn {
    /// `gold.png: gold under sky on sphere, local-shrm, 1280x720, drawn by CPU, 2 threads in 0.4 s`
    pub(crate) fn told(&self, file: &Path, subject: &Subject, shot: &Shot) -> String {
        let [width, height] = shot.size;
        let modes = shot.show.modes().map(Mode::name).collect::<Vec<_>>();
        format!(
            "{}: {}, {}, {width}x{height}, drawn by {} in {}",
            file.display(),
            subject::told(subject),
            modes.join(" beside "),
            self.renderer,
            quantity::duration(self.milliseconds)
        )
    }
}

/// Draws a picture. What the graphics device cannot do the CPU does, with a warning.
pub(crate) fn draw(
    scene: &Scene,
    shot: &Shot,
    backend: Backend,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Drawn, RenderError> {
    let start = Instant::now();
    if backend == Backend::Gpu {
        let drawn =
            graphics_device().and_then(|mut device| Ok((device.render(scene, shot, stop)?, device.name())));
        match drawn {
            Ok((picture, renderer)) => return Ok(Drawn { picture, renderer, milliseconds: elapsed(start) }),
            Err(error) if error.is_of_the_device() => {
                say!("warning: the graphics device cannot draw this, so that the CPU does: {error}");
            }
            Err(error) => return Err(error),
        }
    }
    let start = Instant::now();
    let mut cpu = Cpu::new();
    let picture = cpu.render(scene, shot, stop)?;
    Ok(Drawn { picture, renderer: cpu.name(), milliseconds: elapsed(start) })
}

fn elapsed(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
