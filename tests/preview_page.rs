//! The page of `specula preview` and `specula watch --serve`, asked as a browser asks it. What it draws is
//! looked at in a browser, by tests/readers/live.mjs.

use std::cell::RefCell;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Instant;

use serde_json::{Value, json};

use crate::preview::{GOLD, PHOTOGRAPH, TWO_MATERIALS, headless};
use crate::support::{Project, TIMEOUT, assert_has};

/// A program that serves a page, and the events of the page. It is killed at the end.
struct Page {
    child: Child,
    address: String,
    /// The path of the link: `/TOKEN/`.
    path: String,
    events: Receiver<(String, Value)>,
    /// The latest scene that was waited for or passed over.
    latest: RefCell<Value>,
}

/// Whether a scene shows a material without its maps.
fn is_estimate(scene: &Value) -> bool {
    scene["forms"][0]["note"].as_str().unwrap().contains("estimate")
}

/// The lines of a stream, from another thread.
fn lines(stream: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, lines) = channel();
    let read = BufReader::new(stream).lines().map_while(Result::ok);
    thread::spawn(move || read.for_each(|line| _ = sender.send(line)));
    lines
}

impl Page {
    fn open(project: &Project, arguments: &[&str]) -> Self {
        let mut command = headless(project, arguments);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let said = lines(child.stderr.take().unwrap());
        let link = loop {
            let line = said.recv_timeout(TIMEOUT).expect("it prints a link");
            if let Some((_, link)) = line.split_once("http://") {
                break link.to_owned();
            }
        };
        let (address, path) = link.split_once('/').unwrap();
        let (address, path) = (address.to_owned(), format!("/{path}"));
        let mut stream = TcpStream::connect(&address).unwrap();
        write!(stream, "GET {path}events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
        let (sender, events) = channel();
        let received = lines(stream);
        thread::spawn(move || {
            let mut name = String::new();
            while let Ok(line) = received.recv() {
                match line.split_once(": ") {
                    Some(("event", event)) => event.clone_into(&mut name),
                    Some(("data", data)) => {
                        let _ = sender.send((name.clone(), serde_json::from_str(data).unwrap()));
                    }
                    _ => {}
                }
            }
        });
        Self { child, address, path, events, latest: RefCell::default() }
    }

    /// The next event of a name whose data fulfil a condition.
    #[track_caller]
    fn wait(&self, name: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let (deadline, mut seen) = (Instant::now() + TIMEOUT, String::new());
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok((event, data)) = self.events.recv_timeout(left) else { panic!("no {name} but{seen}") };
            if event == "scene" {
                self.latest.replace(data.clone());
            }
            if event == name && wanted(&data) {
                return data;
            }
            seen += &format!("\n{event}: {data}");
        }
    }

    /// The next scene with the maps of a material.
    fn scene(&self, material: &str) -> Value {
        self.wait("scene", |scene| scene["material"] == material && !is_estimate(scene))
    }

    /// Sends a request as it is, and returns the status and the body of the response.
    fn raw(&self, request: &str, body: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        write!(stream, "{request}Content-Length: {}\r\nConnection: close\r\n\r\n", body.len()).unwrap();
        stream.write_all(body).unwrap();
        let mut response = Vec::new();
        // The server may end a connection before it has read the whole request, which is an error of reading.
        let _ = stream.read_to_end(&mut response);
        let end = response.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(response.len() - 4);
        let head = String::from_utf8_lossy(&response[..end]).into_owned();
        let status = head.split(' ').nth(1).unwrap_or_else(|| panic!("no response: {head:?}"));
        (status.parse().unwrap(), response[end + 4..].to_vec())
    }

    fn request(&self, method: &str, path: &str, body: &[u8]) -> (u16, Vec<u8>) {
        let Self { address, path: link, .. } = self;
        self.raw(&format!("{method} {link}{path} HTTP/1.1\r\nHost: {address}\r\n"), body)
    }

    fn get(&self, path: &str) -> Vec<u8> {
        let (status, body) = self.request("GET", path, b"");
        assert_eq!(status, 200, "{path}: {}", String::from_utf8_lossy(&body));
        body
    }

    /// What a form of the latest scene is drawn with.
    #[track_caller]
    fn view(&self, mode: &str) -> Value {
        self.of_scene(&format!("/{mode}"))
    }

    /// The mesh and the sky of the latest scene.
    #[track_caller]
    fn around(&self) -> Value {
        self.of_scene("")
    }

    #[track_caller]
    fn of_scene(&self, path: &str) -> Value {
        loop {
            let number = self.latest.borrow()["number"].clone();
            let (status, body) = self.request("GET", &format!("scene/{number}{path}"), b"");
            match status {
                200 => return serde_json::from_slice(&body).unwrap(),
                // There is another.
                204 => _ = self.wait("scene", |_| true),
                _ => panic!("{status}: {}", String::from_utf8_lossy(&body)),
            }
        }
    }

    fn post(&self, path: &str, body: &Value) {
        let (status, text) = self.request("POST", path, body.to_string().as_bytes());
        assert_eq!(status, 204, "{path}: {}", String::from_utf8_lossy(&text));
    }

    /// Ends it as Ctrl-C does, and returns its exit code.
    #[cfg(unix)]
    fn interrupt(mut self) -> Option<i32> {
        let killed =
            std::process::Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        self.wait("close", |_| true);
        let deadline = Instant::now() + TIMEOUT;
        while self.child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < deadline, "it does not end");
            thread::sleep(std::time::Duration::from_millis(20));
        }
        self.child.wait().unwrap().code()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn gold(exponent: u32) -> String {
    format!("model = \"phong\"\nexponent = {exponent}\nspecular = [1.0, 0.8, 0.3]\n")
}

/// A project whose gold has this exponent.
fn project(exponent: u32) -> Project {
    let project = Project::new(TWO_MATERIALS);
    project.write(GOLD, &gold(exponent));
    project
}

/// The exponent in a `material` event.
fn exponent(material: &Value) -> &Value {
    &material["form"]["sections"][0]["fields"][0]["value"]
}

/// Values of gold.
fn values(exponent: f64) -> Value {
    json!([[exponent, [1.0, 0.8, 0.3]]])
}

#[test]
fn a_page_shows_what_is_built_and_follows_the_files() {
    let project = project(9);
    let page = Page::open(&project, &["watch", "--serve"]);
    let catalog = page.wait("catalog", |_| true);
    assert_eq!(catalog["materials"], json!(["gold", "satin"]));
    assert_eq!(catalog["shown"]["material"], "gold");
    // With the size of its file: nothing more is built then.
    let with_maps =
        |scene: &Value| scene["forms"][0]["mode"] == "local-shrm" && scene["forms"][0]["bytes"].is_number();
    page.wait("scene", with_maps);
    assert!(String::from_utf8(page.get("")).unwrap().contains("<script src=\"page.js\">"));
    assert!(!page.get("page.js").is_empty() && !page.get("page.css").is_empty());
    let before = page.view("local-shrm")["parts"][0].clone();
    let first = page.around();
    assert_eq!(first["mesh"]["name"], "sphere");
    let map = |view: &Value| view["textures"]["map"]["blob"].clone();
    assert!(!page.get(&format!("blob/{}", map(&before))).is_empty());

    // A file that is saved before the watcher listens is built again without the message `rebuilt`.
    page.wait("status", |status| status.as_str().unwrap().starts_with("listening to"));
    project.write(GOLD, &gold(40));
    let material = page.wait("material", |material| material["material"] == "gold");
    assert_eq!(exponent(&material), 40.0);
    page.wait("toast", |toast| toast["title"].as_str().unwrap().starts_with("rebuilt"));
    let after = page.view("local-shrm")["parts"][0].clone();
    assert_ne!(map(&after), map(&before), "the map changed");
    assert_eq!(after["fragment"], before["fragment"], "the shader did not, and is not sent again");
    assert_eq!(page.around(), first);
    for (path, status) in
        [("scene/1/local-shrm", 204), ("scene/999/local-shrm", 404), ("scene/1/samples", 404)]
    {
        assert_eq!(page.request("GET", path, b"").0, status, "{path}");
    }

    let satin = json!({ "environment": "studio", "material": "satin", "mesh": "torus-knot", "mark": "1" });
    page.post("show", &satin);
    assert_eq!(page.wait("shown", |_| true), satin, "all pages are told, and the one that asked knows it");
    assert_eq!(page.scene("satin")["mesh"], "torus-knot");
    // A page that opens now begins with it, and one that asks for what is gone learns of it.
    let mut stream = TcpStream::connect(&page.address).unwrap();
    write!(stream, "GET {}events HTTP/1.1\r\nHost: {}\r\n\r\n", page.path, page.address).unwrap();
    let received = lines(stream);
    let shown = loop {
        let line = received.recv_timeout(TIMEOUT).expect("the catalog");
        let data = line.strip_prefix("data: ").and_then(|data| serde_json::from_str::<Value>(data).ok());
        if let Some(shown) = data.and_then(|data| data.get("shown").cloned()) {
            break shown;
        }
    };
    assert_eq!(shown["material"], "satin");
    page.post("show", &json!({ "environment": "studio", "material": "gone", "mesh": "car", "mark": "2" }));
    assert_eq!(page.wait("shown", |said| said["mark"] == "2")["material"], "satin");
    #[cfg(unix)]
    assert_eq!(page.interrupt(), Some(0), "Ctrl-C is how watching ends");
}

#[test]
fn values_are_shown_at_once_and_written_when_they_are_saved() {
    let project = project(9);
    let page = Page::open(&project, &["preview", "--no-open", "--item", "material=gold"]);
    page.wait("material", |material| exponent(material) == 9.0);
    page.scene("gold");
    page.post("edit", &json!({ "material": "gold", "values": values(30.0) }));
    let edited = page.wait("scene", is_estimate);
    assert_eq!(edited["forms"][0]["mode"], "local-shrm");
    page.view("local-shrm");
    assert_eq!(fs::read_to_string(project.path(GOLD)).unwrap(), gold(9), "nothing is written");

    // A page that opens now has the values too.
    let mut stream = TcpStream::connect(&page.address).unwrap();
    write!(stream, "GET {}events HTTP/1.1\r\nHost: {}\r\n\r\n", page.path, page.address).unwrap();
    let received = lines(stream);
    let is_edited = |line: String| line.starts_with("data: ") && line.contains("\"edited\":[[30.0");
    while !is_edited(received.recv_timeout(TIMEOUT).expect("the values that are not saved")) {}

    // Another program writes the file; its values are not lost.
    project.write(GOLD, &gold(12));
    let theirs = page.wait("material", |material| exponent(material) == 12.0);
    assert_eq!(theirs["edited"], values(30.0));
    page.post("save", &json!({ "material": "gold", "values": values(31.0) }));
    assert_eq!(page.wait("saved", |_| true), json!({ "material": "gold", "saved": true }));
    assert_eq!(fs::read_to_string(project.path(GOLD)).unwrap(), gold(31));
    page.scene("gold");

    for wrong in [
        json!({ "material": "tin", "values": values(1.0) }),
        json!({ "material": "gold", "values": [[1.0]] }),
        json!({ "material": "gold", "values": [["x", [1.0, 1.0, 1.0]]] }),
        json!([]),
    ] {
        let (status, why) = page.request("POST", "edit", wrong.to_string().as_bytes());
        assert!(status == 400 && !why.is_empty(), "{wrong}");
    }
    let (status, _) = page.request("POST", "edit", b"{\"material\": \"gold\", \"values\": [[1e999");
    assert_eq!(status, 400);
}

#[test]
fn the_light_is_written_after_a_question() {
    let project = project(9);
    let page = Page::open(&project, &["preview", "--no-open"]);
    page.scene("gold");
    page.post("light", &json!({ "yaw": 0.5, "pitch": 0.0 }));
    let light = page.wait("light", |_| true);
    assert!(light["lines"][0].as_str().unwrap().starts_with("Write the turned light to"), "{light}");
    page.post("save-light", &light);
    page.wait("light-saved", |_| true);
    page.scene("gold");
    assert_has(fs::read_to_string(project.path("pipeline.toml")).unwrap(), ["yaw = 28.6"]);
}

#[test]
fn dropped_files_are_shown_beside_what_is_there() {
    let project = project(9);
    let page = Page::open(&project, &["preview", "--no-open"]);
    page.scene("gold");
    let (status, _) = page.request("PUT", "file/red%20paint.toml", b"model = \"lambert\"\nalbedo = 0.2\n");
    assert_eq!(status, 204);
    page.post("dropped", &json!(["red paint.toml"]));
    let catalog = page.wait("catalog", |catalog| catalog.to_string().contains("red paint"));
    assert!(catalog["environments"].to_string().contains("studio"), "{catalog}");
    page.scene("red paint");
    page.post("return", &json!({}));
    page.wait("catalog", |catalog| catalog["materials"] == json!(["gold", "satin"]));
    for name in ["..%2F..%2Fx.toml", "%2Fetc%2Fpasswd", "a%5Cb.toml", ".x", "%ff", "a%00b"] {
        let (status, _) = page.request("PUT", &format!("file/{name}"), b"x");
        assert_eq!(status, 400, "{name}");
    }
    let (status, why) = page.request("POST", "dropped", b"[\"never-sent.hdr\"]");
    assert!(status == 400 && String::from_utf8(why).unwrap().contains("was not sent"));
    page.request("PUT", "file/no.txt", b"words");
    page.post("dropped", &json!(["no.txt"]));
    let failure = page.wait("failure", |failure| !failure.is_null());
    assert_eq!(failure[0], "The dropped files cannot be shown");
}

#[test]
fn a_broken_manifest_shows_its_error_until_it_is_mended() {
    let project = project(9);
    let page = Page::open(&project, &["preview", "--no-open"]);
    page.scene("gold");
    let manifest = fs::read_to_string(project.path("pipeline.toml")).unwrap();
    project.write("pipeline.toml", &manifest.replace("degree = 8", "degree = -8"));
    let failure = page.wait("failure", |failure| !failure.is_null());
    assert_has(failure.to_string(), ["pipeline.toml has errors", "degree"]);
    project.write("pipeline.toml", &manifest);
    page.wait("failure", Value::is_null);
}

#[test]
fn a_photograph_alone_is_shown_on_white_metal() {
    let project = Project::new(PHOTOGRAPH);
    let page = Page::open(&project, &["watch", "--serve=127.0.0.1:0"]);
    page.wait("scene", |scene| scene["forms"][0]["mode"] == "prefiltered");
    // A row of five pieces.
    assert_eq!(page.view("prefiltered")["parts"].as_array().unwrap().len(), 5);
    let mesh = &page.around()["mesh"];
    assert_eq!(mesh["parts"].as_array().unwrap().len(), 5);
    assert!(mesh["radius"].as_f64().unwrap() > 5.0, "{mesh}");
}

/// A mesh of two materials, of which one has a texture.
const CAR: &str = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
    "meshes": [{ "primitives": [
        { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 },
        { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 1 }] }],
    "materials": [
        { "name": "paint", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 } },
        { "name": "tyre", "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.1, 0.1, 1], "metallicFactor": 0 } }],
    "textures": [{ "source": 0 }],
    "images": [{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==" }],
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
        { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2" }],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
    "buffers": [{ "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA",
        "byteLength": 36 }] }"#;

#[test]
fn a_mesh_of_a_gltf_file_is_shown_in_its_own_materials() {
    let manifest = TWO_MATERIALS.replace("assets/materials/{gold,satin}", "{paint,tyre}");
    let project =
        Project::new(&format!("{manifest}mesh = {{ kind = \"import-mesh\", source = \"c*.gltf\" }}\n"));
    project.write("car.gltf", CAR);
    for name in ["paint", "tyre"] {
        let text = format!("model = \"gltf\"\nfile = \"car.gltf\"\nmaterial = \"{name}\"\n");
        project.write(&format!("{name}.toml"), &text);
    }
    let page = Page::open(&project, &["preview", "--no-open", "--item", "material=paint,mesh=car"]);
    // The part with the texture comes first while its material is chosen.
    let texels = |shown: usize| {
        let (mesh, view) = (page.around()["mesh"].clone(), page.view("local-shrm"));
        let [parts, views] = [&mesh["parts"], &view["parts"]].map(|parts| parts.as_array().unwrap().clone());
        assert_eq!([parts.len(), views.len()], [2; 2]);
        let of = |part: usize| views[part]["textures"]["texture_texels"].clone();
        let is_placed = |part: usize| !parts[part]["coordinates"].as_object().unwrap().is_empty();
        assert_eq!([is_placed(shown), is_placed(1 - shown)], [true, false], "{mesh}");
        assert!(of(1 - shown).is_null(), "{view}");
        assert_eq!(of(shown)["size"], json!([1024, 1, 1]));
        of(shown)
    };
    page.scene("paint");
    let first = texels(0);
    page.post("show", &json!({ "environment": "studio", "material": "tyre", "mesh": "car" }));
    page.scene("tyre");
    assert_eq!(texels(1), first, "the texture is not sent again");
}

#[test]
fn nobody_without_the_link_gets_anything() {
    let project = project(9);
    let page = Page::open(&project, &["watch", "--serve"]);
    let Page { address, path, .. } = &page;
    let other = format!("/{}/", "0".repeat(path.len() - 2));
    for path in ["/", "/pipeline.toml", "/../pipeline.toml", &other, &path[..path.len() - 2]] {
        let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n");
        assert_eq!(page.raw(&request, b""), (404, Vec::new()), "{path}");
    }
    for below in [
        "../pipeline.toml",
        "..%2fpipeline.toml",
        "blob/../../pipeline.toml",
        "pipeline.toml",
        "scene/1/../x",
    ] {
        let request = format!("GET {path}{below} HTTP/1.1\r\nHost: {address}\r\n");
        assert_eq!(page.raw(&request, b""), (404, Vec::new()), "{below}");
    }
    for host in ["evil.example", "evil.example:80", "localhost.evil.example"] {
        assert_eq!(page.raw(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n"), b""), (404, Vec::new()));
    }
    let of_another_page =
        format!("POST {path}return HTTP/1.1\r\nHost: {address}\r\nOrigin: http://evil.example\r\n");
    assert_eq!(page.raw(&of_another_page, b"{}"), (404, Vec::new()));
    assert_eq!(page.raw(&format!("GET {path} HTTP/1.1\r\n"), b"").0, 404, "a request without a host");
    assert_eq!(page.raw("nonsense\r\n", b"").0, 400);
    // A port that SSH forwards has another number.
    assert_eq!(page.raw(&format!("GET {path} HTTP/1.1\r\nHost: localhost:1\r\n"), b"").0, 200);
}

#[test]
fn an_address_that_is_taken_is_an_error() {
    let project = project(9);
    let page = Page::open(&project, &["watch", "--serve"]);
    let ended = project.specula(&["preview", "--no-open", "--serve", &page.address]);
    ended.ends(4, ["cannot serve a page at 127.0.0.1:", "`--serve ADDRESS` names another address"]);
    project.specula(&["watch", "--serve", "maps"]).ends(2, ["expected an address such as 127.0.0.1:8080"]);
}

#[test]
fn there_are_at_most_32_connections() {
    let project = project(9);
    let page = Page::open(&project, &["watch", "--serve"]);
    // One is that of the events.
    let open: Vec<_> = (1..32).map(|_| TcpStream::connect(&page.address).unwrap()).collect();
    let deadline = Instant::now() + TIMEOUT;
    while page.request("GET", "page.css", b"").0 != 503 {
        assert!(Instant::now() < deadline);
    }
    drop(open);
    while page.request("GET", "page.css", b"").0 != 200 {
        assert!(Instant::now() < deadline);
    }
}

#[cfg(all(target_os = "linux", feature = "window"))]
#[test]
fn without_a_display_a_page_takes_the_place_of_the_window() {
    let project = project(9);
    let page = Page::open(&project, &["watch", "--preview"]);
    page.scene("gold");
    assert_eq!(page.interrupt(), Some(0));
}
