//! One picture, without a window.

use std::path::Path;
use std::time::Instant;

use ::preview::{
    Cpu, InitialView, Mode, Picture, RenderError, Renderer, Scene, Shot, Subject, graphics_device,
};
use engine::{BuildOptions, Cancel, Event, Plan, ResultsSnapshot, path_text};
use sh::Stop;
use stages::{PreviewCatalog, SceneCache};

use super::subject::SubjectError;
use super::{files, subject};
use crate::arguments::{Backend, PreviewArguments};
use crate::build::{exit_of, stop_on_interrupt};
use crate::build_reporter::BuildReporter;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::{self, say};
use crate::quantity;
use crate::remote_options::shared_cache_of_watcher;

/// Builds what a picture needs, draws it and writes it.
pub(crate) fn run(
    arguments: &PreviewArguments,
    file: &Path,
    catalog: PreviewCatalog,
    view: &InitialView,
) -> Result<Exit, Exit> {
    let subject = view.subject(&catalog.catalog());
    let entry =
        subject::entry(&catalog, &subject.environment, &subject.material).map_err(SubjectError::print)?;
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let stages = catalog.stages(entry, &subject.mesh).into_iter().map(str::to_owned).collect();
    let built = build(catalog.plan(), stages, arguments, &cancel)?;
    if built == Exit::Interrupted {
        return Err(built);
    }
    let results = ResultsSnapshot::open(catalog.plan()).map_err(failed)?;
    let scene = SceneCache::default().scene(&catalog, &results, entry, &subject.mesh).map_err(|failure| {
        let system_error = built == Exit::System || failure.system_error;
        let mut chain = vec![format!("{} cannot be shown", subject::describe(&subject))];
        chain.extend(failure.chain);
        print::error(&chain, failure.help.as_deref());
        if system_error { Exit::System } else { Exit::Failed }
    })?;
    let mut shot = view.shot(&scene, arguments.size).of(&scene);
    shot.exposure += arguments.exposure;
    let backend = arguments.backend.unwrap_or(Backend::Cpu);
    let drawn =
        draw(&scene, &shot, backend, Stop::when(&|| cancel.is_cancelled())).map_err(|error| match error {
            RenderError::Cancelled => Exit::Interrupted,
            error => {
                let message = format!("{} cannot be drawn", subject::describe(&subject));
                print::error(&[message, error.to_string()], None);
                Exit::Failed
            }
        })?;
    files::write_picture(file, &drawn.picture).map_err(|error| {
        print::error(&[format!("cannot write {}", path_text(file)), error.to_string()], None);
        Exit::System
    })?;
    say!("{}", drawn.describe(file, &subject, &shot));
    Ok(built)
}

/// Runs the items of these stages that are out of date.
fn build(
    plan: &Plan,
    stages: Vec<String>,
    arguments: &PreviewArguments,
    cancel: &Cancel,
) -> Result<Exit, Exit> {
    let options = BuildOptions {
        stages,
        jobs: arguments.watching.jobs.map(usize::from),
        keep_going: true,
        all_local: true,
        shared: shared_cache_of_watcher(&arguments.watching.remote, &plan.manifest)
            .map_err(CommandError::print)?,
        ..BuildOptions::default()
    };
    let reporter = BuildReporter::with_bar(arguments.watching.verbose);
    let events = |event: Event| reporter.show(&event);
    let built = engine::build(plan, &options, cancel, &events);
    reporter.show_failures();
    built.map(|summary| exit_of(&summary)).map_err(failed)
}

fn failed(error: engine::Error) -> Exit {
    CommandError::from(error).print()
}

/// A picture, and how it was drawn.
struct Drawn {
    picture: Picture,
    renderer: String,
    milliseconds: f64,
}

impl Drawn {
    /// `gold.png: gold under sky on sphere, local-shrm, 1280x720, drawn by CPU, 2 threads in 0.4 s`
    fn describe(&self, file: &Path, subject: &Subject, shot: &Shot) -> String {
        let [width, height] = shot.size;
        let modes = shot.show.modes().map(Mode::name).collect::<Vec<_>>();
        format!(
            "{}: {}, {}, {width}x{height}, drawn by {} in {}",
            crate::working_folder::name(file),
            subject::describe(subject),
            modes.join(" beside "),
            self.renderer,
            quantity::duration(self.milliseconds)
        )
    }
}

/// Draws a picture. If the graphics device cannot draw it, the CPU does, with a warning.
fn draw(scene: &Scene, shot: &Shot, backend: Backend, stop: Stop<'_>) -> Result<Drawn, RenderError> {
    let start = Instant::now();
    if backend == Backend::Gpu {
        let drawn =
            graphics_device().and_then(|mut device| Ok((device.render(scene, shot, stop)?, device.name())));
        match drawn {
            Ok((picture, renderer)) => return Ok(Drawn { picture, renderer, milliseconds: elapsed(start) }),
            Err(error) if error.is_of_the_device() => {
                say!("warning: the graphics device cannot draw this, so the CPU does: {error}");
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
