//! The window of `specula preview` as a designer uses it: on a virtual screen (Xvfb), by a hand that is a program (xdotool),
//! drawn by software Vulkan (lavapipe).
//!
//! `SPECULA_SCREENSHOTS` names a folder where what was seen is kept.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod support;

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use support::Project;

/// Longer than anything takes on two processors that draw everything themselves, unless it never comes.
const PATIENCE: Duration = Duration::from_secs(180);

const SCREEN: [usize; 2] = [1000, 700];

/// The side of the squares that pictures are compared by, in pixels.
const SQUARE: usize = 12;

const GOLD: &str = "assets/materials/gold.toml";

/// The sample's environments and materials, all but what takes long.
fn sample() -> String {
    let manifest = fs::read_to_string(support::root().join("pipeline.toml")).unwrap();
    let end = manifest.find("# --- Materials that change with the view").unwrap();
    manifest[..end].replace("degree = 60 ", "degree = 24 ").replace("0.000001", "0.01    ")
}

/// Software Vulkan's description, where it is installed.
fn lavapipe() -> Option<PathBuf> {
    let drivers = fs::read_dir("/usr/share/vulkan/icd.d").ok()?.flatten().map(|entry| entry.path());
    let is_it =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("lvp_icd"));
    drivers.into_iter().find(is_it)
}

/// What is missing on this machine for a window.
fn missing() -> Option<String> {
    let is_there =
        |program: &str| Command::new("which").arg(program).output().is_ok_and(|found| found.status.success());
    let programs = ["Xvfb", "xdotool", "import"].into_iter().filter(|program| !is_there(program));
    let mut missing = programs.map(str::to_owned).collect::<Vec<_>>();
    if lavapipe().is_none() {
        missing.push("lavapipe (mesa-vulkan-drivers)".into());
    }
    (!missing.is_empty()).then(|| format!("{} is not installed", missing.join(", ")))
}

/// A screen of its own, taken away at the end.
struct Screen {
    server: Child,
    name: String,
}

impl Screen {
    fn new() -> Self {
        // The server takes a free number by itself and writes it.
        let size = format!("{}x{}x24", SCREEN[0], SCREEN[1]);
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", &size, "-nolisten", "tcp"]);
        let mut server =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.as_mut().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb gave no display");
        Self { server, name: format!(":{}", number.trim()) }
    }

    /// What can be seen.
    fn look(&self) -> Sight {
        let image = Command::new("import")
            .args(["-silent", "-window", "root", "-depth", "8", "rgb:-"])
            .env("DISPLAY", &self.name)
            .output()
            .unwrap();
        assert!(image.status.success(), "{}", String::from_utf8_lossy(&image.stderr));
        let codes = image.stdout.chunks_exact(3).map(|code| [code[0], code[1], code[2]]).collect::<Vec<_>>();
        assert_eq!(codes.len(), SCREEN[0] * SCREEN[1]);
        Sight(codes)
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// What was on the screen.
#[derive(Clone, PartialEq)]
struct Sight(Vec<[u8; 3]>);

impl Sight {
    /// The middle of the window, where panels and messages do not reach.
    fn picture(&self, window: [usize; 4]) -> Vec<[u8; 3]> {
        self.squares(window, [45, 70], [25, 75])
    }

    /// Where errors stand, over the lower part of the picture.
    fn panel(&self, window: [usize; 4]) -> Vec<[u8; 3]> {
        self.squares(window, [25, 60], [80, 95])
    }

    /// A part of the window, from and to percents of its width and height, as the means of squares: a picture is first
    /// seen coarse, then in full.
    fn squares(&self, window: [usize; 4], across: [usize; 2], down: [usize; 2]) -> Vec<[u8; 3]> {
        let starts = |from: usize, side: usize, part: [usize; 2]| {
            (from + side * part[0] / 100..from + side * part[1] / 100 - SQUARE).step_by(SQUARE)
        };
        let mean = |row: usize, column: usize| {
            let lines = (row..row + SQUARE).map(|row| &self.0[row * SCREEN[0] + column..][..SQUARE]);
            let sum = lines.flatten().fold([0; 3], |sum: [usize; 3], code| {
                std::array::from_fn(|channel| sum[channel] + usize::from(code[channel]))
            });
            sum.map(|channel| (channel / SQUARE.pow(2)) as u8)
        };
        let [x, y, width, height] = window;
        let columns = || starts(x, width, across);
        starts(y, height, down).flat_map(|row| columns().map(move |column| mean(row, column))).collect()
    }

    /// Keeps it for people, where they asked for it.
    fn keep(&self, name: &str) {
        if let Some(folder) = env::var_os("SPECULA_SCREENSHOTS") {
            fs::create_dir_all(&folder).unwrap();
            let bytes = containers::write_png(SCREEN[0], SCREEN[1], &self.0, None).unwrap();
            fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).unwrap();
        }
    }
}

/// The mean difference of two pictures, in steps of 255.
fn difference(one: &[[u8; 3]], other: &[[u8; 3]]) -> f64 {
    let both = one.as_flattened().iter().zip(other.as_flattened());
    both.map(|(one, other)| f64::from(one.abs_diff(*other))).sum::<f64>() / (3 * one.len()) as f64
}

/// Coarse or in full, it is the same picture: the two are less than 1 apart.
fn is_same(one: &[[u8; 3]], other: &[[u8; 3]]) -> bool {
    difference(one, other) < 2.0
}

/// What this test looks for is 30 and more apart.
fn is_another(one: &[[u8; 3]], other: &[[u8; 3]]) -> bool {
    difference(one, other) > 8.0
}

/// Whether it shows more than a surface of one colour with a word on it.
fn is_rich(picture: &[[u8; 3]]) -> bool {
    let mean = picture.iter().map(|code| f64::from(code[0])).sum::<f64>() / picture.len() as f64;
    let spread = picture.iter().map(|code| (f64::from(code[0]) - mean).powi(2)).sum::<f64>();
    (spread / picture.len() as f64).sqrt() > 24.0
}

/// A preview at work on a screen.
struct Preview<'s> {
    screen: &'s Screen,
    child: Child,
    said: Arc<Mutex<String>>,
    /// Its window, and where it is: x, y, width and height.
    id: String,
    window: [usize; 4],
}

impl<'s> Preview<'s> {
    fn open(project: &Project, screen: &'s Screen, arguments: &[&str]) -> Self {
        let mut command = project.command(arguments);
        command.env("DISPLAY", &screen.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.env("VK_DRIVER_FILES", lavapipe().unwrap()).env("WGPU_BACKEND", "vulkan");
        command.env("XDG_RUNTIME_DIR", project.path("."));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut stderr = child.stderr.take().unwrap();
        let said = Arc::<Mutex<String>>::default();
        let listener = Arc::clone(&said);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = stderr.read(&mut bytes) {
                listener.lock().unwrap().push_str(&String::from_utf8_lossy(&bytes[..count]));
            }
        });
        let mut preview = Self { screen, child, said, id: String::new(), window: [0; 4] };
        preview.id = preview.wait("there is a window", |preview| {
            let found = preview.screen.xdotool(&["search", "--onlyvisible", "--name", "Specula preview"]);
            found.lines().next().map(str::to_owned)
        });
        preview.window = preview.wait("the window has a size", |preview| {
            let told = preview.screen.xdotool(&["getwindowgeometry", "--shell", &preview.id]);
            let value = |name: &str| told.lines().find_map(|line| line.strip_prefix(name)?.parse().ok());
            Some([value("X=")?, value("Y=")?, value("WIDTH=")?, value("HEIGHT=")?])
        });
        let [x, y, width, height] = preview.window;
        preview.screen.xdotool(&["mousemove", &(x + width / 2).to_string(), &(y + height / 2).to_string()]);
        preview
    }

    /// Waits until something is so, and returns it.
    fn wait<T>(&mut self, what: &str, mut found: impl FnMut(&mut Self) -> Option<T>) -> T {
        let deadline = Instant::now() + PATIENCE;
        loop {
            if let Some(found) = found(self) {
                return found;
            }
            let ended = self.child.try_wait().unwrap();
            if ended.is_some() || Instant::now() > deadline {
                self.screen.look().keep("not-as-expected");
                panic!("{what}: not within {PATIENCE:?}, {ended:?}; it said\n{}", self.said.lock().unwrap());
            }
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits for a picture that stays as it is for a second.
    fn see(&mut self, what: &str, wanted: impl Fn(&[[u8; 3]]) -> bool) -> Vec<[u8; 3]> {
        let (mut before, mut since) = (Vec::new(), Instant::now());
        let sight = self.wait(what, |preview| {
            let sight = preview.screen.look();
            let picture = sight.picture(preview.window);
            if picture != before {
                (before, since) = (picture, Instant::now());
            }
            (since.elapsed() > Duration::from_secs(1) && wanted(&before)).then_some(sight)
        });
        sight.keep(&what.replace(' ', "-"));
        before
    }

    fn key(&self, key: &str) {
        // There is no window manager to give it the keyboard.
        self.screen.xdotool(&["windowfocus", "--sync", &self.id, "key", key]);
    }

    /// Drags with the right button, in steps as a hand does.
    fn drag_light(&self, by: [isize; 2]) {
        self.screen.xdotool(&["mousedown", "3"]);
        for _ in 0..10 {
            let [x, y] = by.map(|way| (way / 10).to_string());
            self.screen.xdotool(&["mousemove_relative", "--", &x, &y]);
        }
        self.screen.xdotool(&["mouseup", "3"]);
    }

    /// Waits for its end.
    fn exit(mut self) -> Option<i32> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(Instant::now() < deadline, "it did not end; it said\n{}", self.said.lock().unwrap());
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Preview<'_> {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The pictures that were kept by key.
fn screenshots(project: &Project) -> Vec<PathBuf> {
    let folder = fs::read_dir(project.path(".specula/screenshots"));
    let files = folder.into_iter().flatten().flatten().map(|entry| entry.path());
    files.filter(|path| path.extension().is_some_and(|ending| ending == "png")).collect()
}

#[test]
fn a_designer_opens_turns_edits_keeps_closes_and_finds_it_again() {
    if let Some(missing) = missing() {
        return test_data::skip("a_designer_opens_turns_edits_keeps_closes_and_finds_it_again", &missing);
    }
    let (project, screen) = (Project::new(&sample()), Screen::new());
    // A small window: two processors draw all of it. The inspector comes at the end.
    project
        .write(".specula/preview.json", r#"{"version":1,"settings":{"size":[960,640],"inspector":false}}"#);
    let item = ["preview", "--item", "environment=studio,material=gold,mesh=sphere", "--mode", "local-shrm"];
    let mut preview = Preview::open(&project, &screen, &item);
    let gold = preview.see("the picture is there", is_rich);

    preview.key("7");
    let mirror = preview.see("a key switches the mode", |now| is_another(now, &gold));
    preview.key("1");
    preview.see("and back", |now| is_same(now, &gold));

    preview.drag_light([300, 0]);
    let turned = preview.see("dragging turns the light", |now| is_another(now, &gold));

    project.write(GOLD, "model = \"phong\"\nexponent = 24\nspecular = [0.1, 0.3, 1.0]\n");
    let blue = preview.see("an edited material is seen", |now| is_another(now, &turned));
    let colour = |picture: &[[u8; 3]], channel: usize| {
        picture.iter().map(|code| u64::from(code[channel])).sum::<u64>()
    };
    assert!(colour(&turned, 0) > colour(&turned, 2) && colour(&blue, 0) < colour(&blue, 2));

    let below = screen.look().panel(preview.window);
    project.write(GOLD, "model = \"phong\"\nexponent = -1\n");
    preview.wait("an error stands over the picture", |preview| {
        is_another(&screen.look().panel(preview.window), &below).then_some(())
    });
    preview.see("an error stands over the last good picture", |now| is_same(now, &blue));
    project.write(GOLD, "model = \"phong\"\nexponent = 24\nspecular = [0.1, 0.3, 1.0]\n");
    preview.wait("it goes when it is mended", |preview| {
        is_same(&screen.look().panel(preview.window), &below).then_some(())
    });

    preview.key("p");
    let kept = preview.wait("a key keeps a picture", |_| screenshots(&project).pop());
    let image = containers::read_image(&fs::read(&kept).unwrap(), &containers::ReadOptions::default());
    assert!(image.unwrap().image.width() >= 300, "{}", kept.display());

    preview.key("7");
    let last = preview.see("another mode at last", |now| is_another(now, &blue));
    assert!(is_another(&last, &mirror), "the light is still turned");
    preview.key("i");
    preview.see("the inspector makes the picture narrower", |now| is_another(now, &last));
    preview.key("i");
    preview.see("and goes again", |now| is_same(now, &last));
    preview.key("ctrl+q");
    assert_eq!(preview.exit(), Some(0), "closing is how a preview ends");
    assert!(fs::read_to_string(project.path(".specula/preview.json")).unwrap().contains("mirror"));

    let mut again = Preview::open(&project, &screen, &["preview"]);
    again.see("it is as it was left", |now| is_same(now, &last));
    let ended = Command::new("kill").args(["-INT", &again.child.id().to_string()]).status().unwrap();
    assert!(ended.success());
    assert_eq!(again.exit(), Some(0), "so does Ctrl-C");
}

#[test]
fn a_screen_that_no_device_can_draw_on_leaves_a_picture() {
    if let Some(missing) = missing() {
        return test_data::skip("a_screen_that_no_device_can_draw_on_leaves_a_picture", &missing);
    }
    let (project, screen) = (Project::new(&sample()), Screen::new());
    let mut command = project.command(&["preview", "--item", "material=satin"]);
    command.env("DISPLAY", &screen.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    // No driver at all.
    command.env("VK_DRIVER_FILES", "/dev/null").env("WGPU_BACKEND", "vulkan");
    let output = command.output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(4), "{told}");
    assert!(told.contains("error: cannot open a window: no graphics device"), "{told}");
    assert!(told.contains("preview.png: satin under sky on sphere"), "{told}");
    assert!(project.path(".specula/preview.png").exists());
}
