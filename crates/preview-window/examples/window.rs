//! The preview's window with scenes made here, without a pipeline: for work on the window itself.
//!
//! `cargo run --release -p preview-window --example window`
//!
//! It has two skies, three materials and Specula's own shapes. The window's settings and screenshots go to
//! the folder of temporary files, as `specula-window.json` and `specula-window-N.ppm`. Arguments cause events
//! a moment after the window has opened: `toast`, `failure`, `rebuild` or `close`. With `cpu` the CPU draws,
//! and `lose` destroys the graphics device after the first picture.

#![allow(clippy::unwrap_used, reason = "an example may panic")]

use std::io::Write;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use brdf::{Choice, Fresnel, Ggx, Lambert, Material, Phong, project};
use envmap::Environment;
use preview::{
    Aim, Catalog, Export, InitialView, Light, Look, MapSizes, MaterialForm, Picture, PreviewUpdate, Scene,
    Subject, SubjectDetails,
};
use preview_window::{Host, UpdateSender, WindowError, WindowSettings, open};
use sh::{Degree, Stop, Tolerance, Transform};
use shrm::Reflection;
use sphere::{Direction, LatLong};

/// Makes scenes on its own thread, as a real host does.
struct ExampleHost {
    requests: Sender<Subject>,
    pictures: usize,
}

impl Host for ExampleHost {
    fn show(&mut self, subject: &Subject) {
        let _ = self.requests.send(subject.clone());
    }

    fn dropped(&mut self, files: Vec<PathBuf>) {
        say(&format!("dropped: {files:?}"));
    }

    fn return_from_dropped(&mut self) {}

    fn keep_state(&mut self, json: &str) {
        let _ = std::fs::write(state_file(), json);
    }

    fn screenshot(&mut self, _: &Subject, picture: Picture) {
        self.pictures += 1;
        let path = std::env::temp_dir().join(format!("specula-window-{}.ppm", self.pictures));
        let header = format!("P6 {} {} 255\n", picture.size[0], picture.size[1]);
        let bytes = [header.as_bytes(), picture.codes.as_flattened()].concat();
        say(&match std::fs::write(&path, bytes) {
            Ok(()) => format!("saved {}", path.display()),
            Err(error) => format!("{}: {error}", path.display()),
        });
    }

    // It has no files, and says so.
    fn edit_material(&mut self, _: &str, _: Option<&MaterialForm>) {}

    fn save_material(&mut self, _: &str, _: &MaterialForm) {}

    // Nor has it a manifest.
    fn propose_light(&mut self, _: Aim) {}

    fn save_light(&mut self, _: Aim, _: &[String]) {}

    fn closed(&mut self) {}
}

fn main() {
    let state = std::fs::read_to_string(state_file()).ok();
    let mut events: Vec<String> = std::env::args().skip(1).collect();
    let cpu = events.iter().any(|event| event == "cpu");
    let lose = events.iter().any(|event| event == "lose");
    events.retain(|event| event != "cpu" && event != "lose");
    for attempt in 0..2 {
        let (requests, requested) = channel();
        let settings = WindowSettings {
            view: InitialView { state: state.clone(), ..InitialView::default() },
            cpu,
            simulate_device_loss: lose && attempt == 0,
        };
        let events = events.clone();
        let start = move |updates: UpdateSender| {
            std::thread::spawn(move || work(&updates, &requested, &events));
        };
        match open(settings, Box::new(ExampleHost { requests, pictures: 0 }), start) {
            Err(WindowError::Lost(reason)) if attempt == 0 => say(&format!("opening again: {reason}")),
            Err(error) => return say(&error.to_string()),
            Ok(()) => return,
        }
    }
}

fn work(updates: &UpdateSender, requested: &Receiver<Subject>, events: &[String]) {
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    updates.send(PreviewUpdate::Catalog(Catalog {
        environments: names(&["evening", "studio"]),
        materials: names(&["chalk", "gold", "lacquer"]),
        meshes: names(&mesh::SHAPES),
        pairs: (0..6).map(|pair| (pair / 3, pair % 3)).collect(),
    }));
    updates.send(PreviewUpdate::Status("watching assets/".into()));
    let last: Arc<Mutex<Option<Subject>>> = Arc::default();
    let (sender, events, shown) = (updates.clone(), events.to_vec(), Arc::clone(&last));
    std::thread::spawn(move || {
        for event in events {
            std::thread::sleep(Duration::from_secs(2));
            trigger(&sender, &event, &shown);
        }
    });
    for subject in requested {
        let start = Instant::now();
        let scene = scene(&subject, 1.0);
        updates.send(PreviewUpdate::Status(format!("made in {:.2} s", start.elapsed().as_secs_f64())));
        *last.lock().unwrap() = Some(subject.clone());
        let (material, form) = (subject.material.clone(), Err("an example has no material files".into()));
        updates.send(PreviewUpdate::Material { material, form, edited: None });
        updates.send(PreviewUpdate::Scene { subject, scene, details: details() });
    }
}

fn trigger(updates: &UpdateSender, event: &str, last: &Mutex<Option<Subject>>) {
    match event {
        "toast" => updates.send(PreviewUpdate::Toast {
            title: "rebuilt in 0.84 s".into(),
            lines: vec!["coefficients: gold".into(), "reflection: evening, gold".into()],
        }),
        "failure" => updates.send(PreviewUpdate::Failure(Some(vec![
            "the build failed; the picture shows the last good results".into(),
            "assets/materials/gold.toml:3:1: unknown key `roughnes`".into(),
            "  expected one of: model, roughness, reflectance".into(),
            "  did you mean `roughness`?".into(),
        ]))),
        "rebuild" => {
            let subject = last.lock().unwrap().clone();
            if let Some(subject) = subject {
                let scene = scene(&subject, 2.0);
                updates.send(PreviewUpdate::Scene { subject, scene, details: details() });
                trigger(updates, "toast", last);
            }
        }
        "close" => updates.send(PreviewUpdate::Close),
        other => say(&format!("{other}: expected toast, failure, rebuild or close")),
    }
}

fn details() -> SubjectDetails {
    let export = |name: &str, bytes| Export { name: name.into(), bytes };
    SubjectDetails {
        exports: vec![export("shrm.ktx2", 3_539_000), export("cabral.dds", 2_360_000)],
        notes: vec!["This scene was made by an example.".into()],
    }
}

/// The scene of a subject; `rougher` multiplies the roughness of its material.
fn scene(subject: &Subject, rougher: f64) -> Scene {
    let environment = match subject.environment.as_str() {
        "studio" => studio(),
        _ => evening(),
    };
    let degree = Degree::new(60).unwrap();
    let lighting = Transform::new(environment.grid(), degree).unwrap().analyse(environment.pixels());
    let material = match subject.material.as_str() {
        "chalk" => Material::Lambert(Lambert::new([0.8; 3]).unwrap()),
        "gold" => {
            let reflectance = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
            Material::Ggx(Ggx::new(0.4 * rougher, reflectance, [1.0; 3]).unwrap())
        }
        _ => Material::Phong(Phong::new(60.0 / rougher, [0.7, 0.06, 0.05]).unwrap()),
    };
    let fitted = project(&material, Choice::Tolerance(Tolerance::new(0.01).unwrap()), Stop::NEVER).unwrap();
    let reflection = Reflection::convolve(&lighting, &fitted.coefficients);
    let light = Arc::new(Light::new(environment, Some(lighting)));
    let look = Look::new(light, reflection, Some(material), MapSizes::default());
    let mesh = mesh::shape(&subject.mesh).unwrap_or_else(|| mesh::shape("sphere").unwrap());
    Scene::of(Arc::new(mesh), Arc::new(look))
}

/// A low sun, a warm horizon, a blue sky and dark ground.
fn evening() -> Environment {
    let sun = Direction::from_angles(1.25, 0.6);
    painted(|direction| {
        let [_, _, up] = direction.vector().to_array();
        if direction.dot(sun) > 0.998 {
            return [400.0, 260.0, 130.0];
        }
        let glow = (1.0 + direction.dot(sun)) / 2.0;
        if up < 0.0 {
            return [0.10, 0.085, 0.07];
        }
        let low = (-4.0 * up).exp();
        std::array::from_fn(|channel| {
            let [zenith, horizon] = [[0.12, 0.25, 0.6][channel], [1.4, 0.75, 0.4][channel]];
            zenith + (horizon - zenith) * low * (0.3 + 0.7 * glow.powi(4))
        })
    })
}

/// Two soft boxes in a grey room.
fn studio() -> Environment {
    painted(|direction| {
        let [x, y, z] = direction.vector().to_array();
        let key = x > 0.5 && y > 0.3 && z.abs() < 0.4;
        let rim = x < -0.2 && y < -0.75 && z.abs() < 0.6;
        let floor = 0.15 + 0.1 * z;
        if key {
            [12.0; 3]
        } else if rim {
            [4.0, 5.0, 8.0]
        } else {
            [floor; 3]
        }
    })
}

fn painted(radiance: impl Fn(Direction) -> [f64; 3]) -> Environment {
    let grid = LatLong::with_rows(256);
    let pixels = (0..grid.len()).map(|pixel| {
        let direction = grid.direction(pixel / grid.width, pixel % grid.width);
        radiance(direction).map(|value| value as f32)
    });
    Environment::new(grid, pixels.collect()).unwrap()
}

fn state_file() -> PathBuf {
    std::env::temp_dir().join("specula-window.json")
}

fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
