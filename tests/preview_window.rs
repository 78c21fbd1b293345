//! The window of `specula preview` on a virtual screen (Xvfb), with input from a program (xdotool), drawn by
//! software Vulkan (lavapipe).
//!
//! If `SPECULA_SCREENSHOTS` names a folder, images of the screen are saved there.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use crate::support::{Project, assert_has, root};

/// Longer than any step takes on two processors that draw everything in software.
const TIMEOUT: Duration = Duration::from_secs(180);

const SCREEN: [usize; 2] = [1000, 700];

/// The side of the squares whose means are compared, in pixels.
const SQUARE: usize = 12;

const GOLD: &str = "assets/materials/gold.toml";

/// The sample's manifest without its slow stages.
fn sample() -> String {
    let manifest = fs::read_to_string(root().join("pipeline.toml")).unwrap();
    let end = manifest.find("# --- Materials that change with the view").unwrap();
    manifest[..end].replace("degree = 60 ", "degree = 24 ").replace("0.000001", "0.01    ")
}

/// The description file of software Vulkan, if it is installed.
fn lavapipe() -> Option<PathBuf> {
    let drivers = fs::read_dir("/usr/share/vulkan/icd.d").ok()?.flatten().map(|entry| entry.path());
    let is_it =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("lvp_icd"));
    drivers.into_iter().find(is_it)
}

/// What this machine lacks for the test.
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

/// A virtual screen, removed at the end.
struct Screen {
    server: Child,
    name: String,
}

impl Screen {
    /// `None`, and that the test is skipped is reported, if this machine lacks something for it.
    fn start(test: &str) -> Option<Self> {
        if let Some(missing) = missing() {
            test_data::skip(test, &missing);
            return None;
        }
        // The server chooses a free number and prints it.
        let size = format!("{}x{}x24", SCREEN[0], SCREEN[1]);
        let mut command = Command::new("Xvfb");
        // Without a reset after its last client, in which the next one would find no server.
        command.args(["-displayfd", "1", "-screen", "0", &size, "-nolisten", "tcp", "-noreset"]);
        let mut server =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.as_mut().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb gave no display");
        Some(Self { server, name: format!(":{}", number.trim()) })
    }

    fn image(&self) -> ScreenImage {
        let image = Command::new("import")
            .args(["-silent", "-window", "root", "-depth", "8", "rgb:-"])
            .env("DISPLAY", &self.name)
            .output()
            .unwrap();
        assert!(image.status.success(), "{}", String::from_utf8_lossy(&image.stderr));
        let codes = image.stdout.chunks_exact(3).map(|code| [code[0], code[1], code[2]]).collect::<Vec<_>>();
        assert_eq!(codes.len(), SCREEN[0] * SCREEN[1]);
        ScreenImage(codes)
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

#[derive(Clone, PartialEq)]
struct ScreenImage(Vec<[u8; 3]>);

impl ScreenImage {
    /// The inspector on the right, without its edge.
    fn inspector(&self, window: [usize; 4]) -> Vec<[u8; 3]> {
        self.squares(window, [72, 100], [8, 95])
    }

    /// The middle of the window, which panels and messages do not cover.
    fn picture(&self, window: [usize; 4]) -> Vec<[u8; 3]> {
        self.squares(window, [45, 70], [25, 75])
    }

    /// The place of errors, over the lower part of the picture.
    fn panel(&self, window: [usize; 4]) -> Vec<[u8; 3]> {
        self.squares(window, [25, 60], [80, 95])
    }

    /// A part of the window, in percent of its width and height, as the means of squares. Coarse and full
    /// pictures have the same means.
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

    /// Whether neighbouring pixels of the picture differ by more than 3 steps in the mean: a picture by brute
    /// force. In pictures with maps it is less than 1, and with five light samples 49.
    fn is_noisy(&self, [x, y, width, height]: [usize; 4]) -> bool {
        let rows = y + height * 25 / 100..y + height * 75 / 100;
        let pixels = rows
            .flat_map(|row| self.0[row * SCREEN[0]..][x + width * 45 / 100..x + width * 60 / 100].windows(2));
        let steps: Vec<f64> = pixels.map(|pair| difference(&pair[..1], &pair[1..])).collect();
        steps.iter().sum::<f64>() / steps.len() as f64 > 3.0
    }

    /// Saves the image if `SPECULA_SCREENSHOTS` is set.
    fn save(&self, name: &str) {
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

/// Whether two pictures are the same. A coarse and a full one differ by less than 1.
fn is_same(one: &[[u8; 3]], other: &[[u8; 3]]) -> bool {
    difference(one, other) < 2.0
}

/// Whether two pictures differ. The changes in this test are 30 or more.
fn has_changed(one: &[[u8; 3]], other: &[[u8; 3]]) -> bool {
    difference(one, other) > 8.0
}

/// Whether a picture shows more than one colour with text on it.
fn has_contrast(picture: &[[u8; 3]]) -> bool {
    let mean = picture.iter().map(|code| f64::from(code[0])).sum::<f64>() / picture.len() as f64;
    let spread = picture.iter().map(|code| (f64::from(code[0]) - mean).powi(2)).sum::<f64>();
    (spread / picture.len() as f64).sqrt() > 24.0
}

struct Preview<'s> {
    screen: &'s Screen,
    child: Child,
    stderr: Arc<Mutex<String>>,
    id: String,
    /// The window's x, y, width and height.
    window: [usize; 4],
}

impl<'s> Preview<'s> {
    fn of_gold(project: &Project, screen: &'s Screen, more: &[&str]) -> Self {
        let item = ["preview", "--item", "environment=studio,material=gold,mesh=sphere"];
        Self::open(project, screen, &[&item[..], more].concat())
    }

    fn open(project: &Project, screen: &'s Screen, arguments: &[&str]) -> Self {
        let mut command = project.command(arguments);
        command.env("DISPLAY", &screen.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.env("VK_DRIVER_FILES", lavapipe().unwrap()).env("WGPU_BACKEND", "vulkan");
        command.env("XDG_RUNTIME_DIR", project.path("."));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut pipe = child.stderr.take().unwrap();
        let stderr = Arc::<Mutex<String>>::default();
        let copy = Arc::clone(&stderr);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = pipe.read(&mut bytes) {
                copy.lock().unwrap().push_str(&String::from_utf8_lossy(&bytes[..count]));
            }
        });
        let mut preview = Self { screen, child, stderr, id: String::new(), window: [0; 4] };
        preview.id = preview.wait("there is a window", |preview| {
            let found = preview.screen.xdotool(&["search", "--onlyvisible", "--name", "Specula preview"]);
            found.lines().next().map(str::to_owned)
        });
        preview.window = preview.wait("the window has a size", |preview| {
            let geometry = preview.screen.xdotool(&["getwindowgeometry", "--shell", &preview.id]);
            let value = |name: &str| geometry.lines().find_map(|line| line.strip_prefix(name)?.parse().ok());
            Some([value("X=")?, value("Y=")?, value("WIDTH=")?, value("HEIGHT=")?])
        });
        let [x, y, width, height] = preview.window;
        preview.screen.xdotool(&["mousemove", &(x + width / 2).to_string(), &(y + height / 2).to_string()]);
        preview
    }

    /// Waits until `found` returns something.
    fn wait<T>(&mut self, what: &str, mut found: impl FnMut(&mut Self) -> Option<T>) -> T {
        let deadline = Instant::now() + TIMEOUT;
        loop {
            if let Some(found) = found(self) {
                return found;
            }
            let ended = self.child.try_wait().unwrap();
            if ended.is_some() || Instant::now() > deadline {
                self.screen.image().save("not-as-expected");
                panic!(
                    "{what}: not within {TIMEOUT:?}, {ended:?}; its output:\n{}",
                    self.stderr.lock().unwrap()
                );
            }
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits until so many builds in which several items ran have ended, so that the maps are made.
    fn built(&mut self, times: usize) {
        self.wait("a build ends", |preview| {
            (preview.stderr.lock().unwrap().matches(" items ran").count() >= times).then_some(())
        });
    }

    /// Waits for a picture without noise that does not change for a second.
    fn see(&mut self, what: &str, wanted: impl Fn(&[[u8; 3]]) -> bool) -> Vec<[u8; 3]> {
        let (mut before, mut since) = (Vec::new(), Instant::now());
        let image = self.wait(what, |preview| {
            let image = preview.screen.image();
            let picture = image.picture(preview.window);
            if picture != before {
                (before, since) = (picture, Instant::now());
            }
            let is_there = since.elapsed() > Duration::from_secs(1) && !image.is_noisy(preview.window);
            (is_there && wanted(&before)).then_some(image)
        });
        image.save(&what.replace(' ', "-"));
        before
    }

    fn key(&self, key: &str) {
        // No window manager gives it the keyboard.
        self.screen.xdotool(&["windowfocus", "--sync", &self.id, "key", key]);
    }

    /// Drags with the right button in small steps.
    fn drag_light(&self, by: [isize; 2]) {
        self.screen.xdotool(&["mousedown", "3"]);
        for _ in 0..10 {
            let [x, y] = by.map(|way| (way / 10).to_string());
            self.screen.xdotool(&["mousemove_relative", "--", &x, &y]);
        }
        self.screen.xdotool(&["mouseup", "3"]);
    }

    /// Drags a slider of the inspector with the left button, to a place in the window.
    fn drag(&mut self, from: [usize; 2], to: [usize; 2]) {
        let (screen, [x, y, ..]) = (self.screen, self.window);
        let moved = |to: [usize; 2]| {
            screen.xdotool(&["mousemove", &(x + to[0]).to_string(), &(y + to[1]).to_string()]);
        };
        // The slider jumps to the pointer, then follows it.
        moved(from);
        for to in [from, to] {
            let before = screen.image().inspector(self.window);
            match to == from {
                true => _ = screen.xdotool(&["mousedown", "1"]),
                false => moved(to),
            }
            self.wait("a slider follows the pointer", |preview| {
                (difference(&screen.image().inspector(preview.window), &before) > 0.02).then_some(())
            });
        }
        screen.xdotool(&["mouseup", "1"]);
    }

    /// Waits for a picture, which may still get better.
    fn glimpse(&mut self, what: &str, wanted: impl Fn(&[[u8; 3]]) -> bool) {
        let image = self.wait(what, |preview| {
            let image = preview.screen.image();
            wanted(&image.picture(preview.window)).then_some(image)
        });
        image.save(&what.replace(' ', "-"));
    }

    /// Ctrl-C.
    fn interrupt(&self) {
        let ended = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        assert!(ended.success());
    }

    fn exit(mut self) -> Option<i32> {
        let deadline = Instant::now() + TIMEOUT;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(
                Instant::now() < deadline,
                "it did not end; its output:\n{}",
                self.stderr.lock().unwrap()
            );
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Preview<'_> {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn screenshots(project: &Project) -> Vec<PathBuf> {
    let folder = fs::read_dir(project.path("screenshots"));
    let files = folder.into_iter().flatten().flatten().map(|entry| entry.path());
    files.filter(|path| path.extension().is_some_and(|ending| ending == "png")).collect()
}

#[test]
fn a_user_opens_turns_edits_saves_closes_and_opens_again() {
    let Some(screen) = Screen::start("a_user_opens_turns_edits_saves_closes_and_opens_again") else { return };
    let project = Project::new(&sample());
    // The window is small, because two processors draw all of it. The inspector opens at the end.
    project
        .write(".specula/preview.json", r#"{"version":1,"settings":{"size":[960,640],"inspector":false}}"#);
    let mut preview = Preview::of_gold(&project, &screen, &["--mode", "local-shrm"]);
    preview.built(1);
    let gold = preview.see("the picture is there", has_contrast);

    preview.key("7");
    let mirror = preview.see("a key switches the mode", |now| has_changed(now, &gold));
    preview.key("1");
    preview.see("and back", |now| is_same(now, &gold));

    preview.drag_light([300, 0]);
    let turned = preview.see("dragging turns the light", |now| has_changed(now, &gold));

    project.write(GOLD, "model = \"phong\"\nexponent = 24\nspecular = [0.1, 0.3, 1.0]\n");
    preview.built(2);
    let blue = preview.see("an edited material is shown", |now| has_changed(now, &turned));
    let colour = |picture: &[[u8; 3]], channel: usize| {
        picture.iter().map(|code| u64::from(code[channel])).sum::<u64>()
    };
    assert!(colour(&turned, 0) > colour(&turned, 2) && colour(&blue, 0) < colour(&blue, 2));

    let below = screen.image().panel(preview.window);
    project.write(GOLD, "model = \"phong\"\nexponent = -1\n");
    preview.wait("an error covers the picture", |preview| {
        has_changed(&screen.image().panel(preview.window), &below).then_some(())
    });
    preview.see("an error covers part of the last valid picture", |now| is_same(now, &blue));
    project.write(GOLD, "model = \"phong\"\nexponent = 24\nspecular = [0.1, 0.3, 1.0]\n");
    preview.wait("the error disappears when it is fixed", |preview| {
        is_same(&screen.image().panel(preview.window), &below).then_some(())
    });

    preview.key("p");
    let kept = preview.wait("a key saves a screenshot", |_| screenshots(&project).pop());
    let image = containers::read_image(&fs::read(&kept).unwrap(), &containers::ReadOptions::default());
    assert!(image.unwrap().image.width() >= 300, "{}", kept.display());

    preview.key("7");
    let last = preview.see("another mode before closing", |now| has_changed(now, &blue));
    assert!(has_changed(&last, &mirror), "the light is still turned");
    preview.key("i");
    preview.see("the inspector makes the picture narrower", |now| has_changed(now, &last));
    preview.key("i");
    preview.see("and wider again", |now| is_same(now, &last));
    preview.key("ctrl+q");
    assert_eq!(preview.exit(), Some(0), "closing ends with success");
    assert!(fs::read_to_string(project.path(".specula/preview.json")).unwrap().contains("mirror"));

    let mut again = Preview::open(&project, &screen, &["preview"]);
    again.see("it opens with the last view", |now| is_same(now, &last));
    again.interrupt();
    assert_eq!(again.exit(), Some(0), "Ctrl-C ends with success");
}

/// The slider of `ior`, the fourth parameter of `standard`, near its ends: in a window of 960 x 640 points
/// without lists.
const IOR: [[usize; 2]; 2] = [[868, 219], [936, 219]];

/// A material that is bright or dark by its index of refraction alone.
const GLASS: &str = "# Black glass.\nmodel = \"standard\"\nbase_color = 0.01   # nearly black\nroughness = 0.5\nior = 1.4 # dark\n";

#[test]
fn a_slider_changes_the_picture_at_once_and_the_file_when_it_is_saved() {
    let Some(screen) = Screen::start("a_slider_changes_the_picture_at_once_and_the_file_when_it_is_saved")
    else {
        return;
    };
    let project = Project::new(&sample());
    project.write(".specula/preview.json", r#"{"version":1,"settings":{"size":[960,640],"lists":false}}"#);
    project.write(GOLD, GLASS);
    let file = || fs::read_to_string(project.path(GOLD)).unwrap();
    // The processors draw the pictures, so that the panels follow the pointer at once.
    let mut preview = Preview::of_gold(&project, &screen, &["--mode", "prefiltered", "--backend", "cpu"]);
    let brightness = |picture: &[[u8; 3]]| {
        picture.as_flattened().iter().map(|code| f64::from(*code)).sum::<f64>() / (3 * picture.len()) as f64
    };
    preview.built(1);
    let dark = preview.see("black glass is there", |_| true);
    let is_bright = |now: &[[u8; 3]]| brightness(now) > brightness(&dark) + 20.0;

    preview.drag(IOR[0], IOR[1]);
    preview.glimpse("a slider makes it bright", is_bright);
    assert_eq!(file(), GLASS, "nothing is written unasked");
    preview.key("ctrl+z");
    preview.see("undo brings the picture back", |now| is_same(now, &dark));
    preview.key("ctrl+shift+z");
    preview.glimpse("and redo the edit", is_bright);

    preview.key("ctrl+s");
    preview.wait("the file is saved", |_| (file() != GLASS).then_some(()));
    let saved = file();
    let ior = saved.lines().find_map(|line| line.strip_prefix("ior = ")?.strip_suffix(" # dark")).unwrap();
    assert!(ior.parse::<f64>().unwrap() > 8.0, "{saved}");
    assert_eq!(saved, GLASS.replace("1.4", ior), "nothing else has changed");
    preview.built(2);
    preview.see("its maps show it", is_bright);

    preview.drag(IOR[1], IOR[0]);
    preview.glimpse("another edit makes it dark", |now| !is_bright(now));
    let edited = preview.see("the dark picture is there", |_| true);
    preview.key("ctrl+q");
    preview.glimpse("a question about unsaved values", |now| has_changed(now, &edited));
    assert_eq!(file(), saved);
    preview.key("Escape");
    preview.glimpse("Escape keeps the window open", |now| is_same(now, &edited));
    preview.key("ctrl+q");
    preview.glimpse("the question again", |now| has_changed(now, &edited));
    preview.key("Return");
    let stderr = Arc::clone(&preview.stderr);
    assert_eq!(preview.exit(), Some(0));
    assert!(!stderr.lock().unwrap().contains("warning: "), "{}", stderr.lock().unwrap());
    let ior = file()
        .lines()
        .find_map(|line| line.strip_prefix("ior = ")?.strip_suffix(" # dark")?.parse::<f64>().ok());
    assert!(ior.is_some_and(|ior| ior < 2.0) && file() != saved, "{}", file());

    // Ctrl-C does not ask.
    let saved = file();
    let mut again = Preview::of_gold(&project, &screen, &["--backend", "cpu"]);
    again.see("the window is there again", |_| true);
    again.drag(IOR[0], IOR[1]);
    again.glimpse("it is edited again", is_bright);
    again.interrupt();
    let stderr = Arc::clone(&again.stderr);
    assert_eq!(again.exit(), Some(0));
    assert_has(&*stderr.lock().unwrap(), ["warning: the changes of ", "gold.toml were not saved"]);
    assert_eq!(file(), saved);
}

#[test]
fn a_turned_light_is_written_to_the_manifest_and_the_picture_does_not_turn_twice() {
    let Some(screen) =
        Screen::start("a_turned_light_is_written_to_the_manifest_and_the_picture_does_not_turn_twice")
    else {
        return;
    };
    let project = Project::new(&sample());
    project
        .write(".specula/preview.json", r#"{"version":1,"settings":{"size":[960,640],"inspector":false}}"#);
    let manifest = || fs::read_to_string(project.path("pipeline.toml")).unwrap();
    let before = manifest();
    let mut preview = Preview::of_gold(&project, &screen, &["--mode", "prefiltered", "--backend", "cpu"]);
    preview.built(1);
    let gold = preview.see("gold is there", has_contrast);
    (0..12).for_each(|_| preview.key("shift+Right"));
    let turned = preview.see("keys turn the light by 60 degrees", |now| has_changed(now, &gold));
    preview.key("ctrl+shift+s");
    preview.glimpse("a question about the light", |now| has_changed(now, &turned));
    assert_eq!(manifest(), before, "nothing is written unasked");
    preview.key("Escape");
    preview.glimpse("Escape writes nothing", |now| is_same(now, &turned));
    preview.key("ctrl+shift+s");
    preview.glimpse("the question about the light again", |now| has_changed(now, &turned));
    preview.key("Return");
    preview.wait("the manifest is written", |_| (manifest() != before).then_some(()));
    let new = "\n[stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 60.0\n";
    let written = manifest();
    assert!(written.contains(new), "{written}");
    let restored = written.replace(new, "").replace("\"lighting-turned\"", "\"lighting\"");
    assert_eq!(restored, before, "nothing else has changed");
    preview.built(2);
    preview.see("the light of the maps is turned and the window's is not", |now| is_same(now, &turned));
    preview.key("ctrl+q");
    assert_eq!(preview.exit(), Some(0));
    let settings = fs::read_to_string(project.path(".specula/preview.json")).unwrap();
    assert!(settings.contains(r#""light":{"pitch":0.0,"yaw":0.0}"#), "{settings}");
}

#[test]
fn without_a_device_for_the_window_a_page_takes_its_place() {
    let Some(screen) = Screen::start("without_a_device_for_the_window_a_page_takes_its_place") else {
        return;
    };
    let project = Project::new(&sample());
    let mut command = project.command(&["preview", "--item", "material=satin"]);
    command.env("DISPLAY", &screen.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    // There is no driver, and no browser.
    command.env("VK_DRIVER_FILES", "/dev/null").env("WGPU_BACKEND", "vulkan").env("PATH", "/nowhere");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("warning: cannot open a window: no graphics device")));
    assert!(lines.any(|line| line.starts_with("The page is at http://127.0.0.1:")));
    child.kill().unwrap();
    child.wait().unwrap();
}
