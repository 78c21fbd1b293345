//! Runs one kind on values in memory, the way the engine does.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use engine::{
    Artifact, Cancel, Configured, Context, Diagnostic, Digest, ExportedFiles, Failure, Files, Handle,
    ItemKey, Kinds, Output, Product, Read, Table,
};
use sh::{Degree, Stop, Transform};
use sphere::{DVec3, LatLong};
use stages::artifacts;

/// Every kind: those of this crate, and those for meshes and for light probes.
pub(crate) fn kinds() -> Kinds {
    probe_stages::add_to(mesh_stages::add_to(stages::kinds()))
}

/// A path in memory; the engine gives items absolute ones.
fn absolute(path: &str) -> PathBuf {
    Path::new("/memory").join(path)
}

/// Files that exist only in memory, in addition to the system's programs.
#[derive(Default)]
pub(crate) struct Memory(BTreeMap<PathBuf, Arc<Vec<u8>>>);

impl Memory {
    pub(crate) fn with(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.0.insert(absolute(path), Arc::new(bytes.into()));
        self
    }
}

impl Files for Memory {
    fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
        match self.0.get(path) {
            Some(bytes) => Ok(Arc::clone(bytes)),
            None if path.starts_with(absolute("")) => Err(io::ErrorKind::NotFound.into()),
            None => std::fs::read(path).map(Arc::new),
        }
    }

    fn list(&self, path: &Path) -> io::Result<Vec<(String, bool)>> {
        let mut names = BTreeMap::new();
        for inside in self.0.keys().filter_map(|file| file.strip_prefix(path).ok()) {
            let mut parts = inside.components();
            if let Some(name) = parts.next() {
                names.insert(name.as_os_str().to_string_lossy().into_owned(), parts.next().is_some());
            }
        }
        if names.is_empty() { Err(io::ErrorKind::NotFound.into()) } else { Ok(names.into_iter().collect()) }
    }

    fn is_folder(&self, path: &Path) -> bool {
        !self.0.contains_key(path) && self.0.keys().any(|file| file.starts_with(path))
    }
}

/// A kind with parameters and inputs, not yet run.
pub(crate) struct Case {
    kind: &'static str,
    parameters: String,
    inputs: Vec<(&'static str, ItemKey, Arc<Handle>)>,
    files: Memory,
    source: Option<PathBuf>,
    scratch: Option<PathBuf>,
    cancel: Cancel,
}

/// The output and the messages of a run.
pub(crate) struct Ran {
    pub(crate) output: Output,
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
    pub(crate) reads: Vec<Read>,
    /// The share of the work that it said is done.
    pub(crate) share_done: f64,
}

/// A case of a kind with parameters in TOML.
pub(crate) fn case(kind: &'static str, parameters: &str) -> Case {
    Case {
        kind,
        parameters: parameters.into(),
        inputs: Vec::new(),
        files: Memory::default(),
        source: None,
        scratch: None,
        cancel: Cancel::default(),
    }
}

impl Case {
    /// Connects a port.
    pub(crate) fn input<T: Artifact>(self, port: &'static str, value: T) -> Self {
        self.keyed_input(port, &[], value)
    }

    /// Connects a port to an item of this key; a gather is connected several times.
    pub(crate) fn keyed_input<T: Artifact>(
        mut self,
        port: &'static str,
        key: &[(&str, &str)],
        value: T,
    ) -> Self {
        self.inputs.push((port, key.iter().copied().collect(), handle(value)));
        self
    }

    /// Connects a port to an item of this key whose artifact has these bytes.
    pub(crate) fn keyed_bytes<T: Artifact>(
        mut self,
        port: &'static str,
        key: &[(&str, &str)],
        bytes: Vec<u8>,
    ) -> Self {
        let handle = Handle::new(T::TYPE, Digest::of(&bytes), move || Ok(bytes.clone()));
        self.inputs.push((port, key.iter().copied().collect(), Arc::new(handle)));
        self
    }

    /// Adds a file.
    pub(crate) fn file(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files = self.files.with(path, bytes);
        self
    }

    /// Sets the source.
    pub(crate) fn source(mut self, path: &str) -> Self {
        self.source = Some(absolute(path));
        self
    }

    /// Sets the folder for scratch folders.
    pub(crate) fn scratch(mut self, folder: PathBuf) -> Self {
        self.scratch = Some(folder);
        self
    }

    /// Lets it be cancelled.
    pub(crate) fn cancelled_by(mut self, cancel: &Cancel) -> Self {
        self.cancel = cancel.clone();
        self
    }

    fn configure(&self) -> Result<Arc<dyn Configured>, Vec<Diagnostic>> {
        kinds().get(self.kind).unwrap().configure(&table(&self.parameters))
    }

    /// The kind.
    pub(crate) fn kind(&self) -> &'static str {
        self.kind
    }

    /// The messages of the errors of the parameters.
    pub(crate) fn errors(&self) -> Vec<String> {
        self.configure().err().unwrap_or_default().into_iter().map(|error| error.message).collect()
    }

    /// What an item makes.
    pub(crate) fn product(&self) -> Product {
        self.configure().unwrap().product(&self.types())
    }

    /// The errors that parameters have because of what arrives.
    pub(crate) fn input_errors(&self) -> Vec<String> {
        self.configure().unwrap().check_inputs(&self.types()).into_iter().map(|(_, error)| error).collect()
    }

    fn types(&self) -> Vec<(&str, &'static str)> {
        let mut types: Vec<_> =
            self.inputs.iter().map(|(port, _, handle)| (*port, handle.type_name())).collect();
        types.dedup();
        types
    }

    /// Runs it twice, and checks that the output is of the declared product, that both runs agree, and that
    /// an artifact's bytes decode to the value. Of files, those that it leaves out are not in the output.
    pub(crate) fn run(&self) -> Result<Ran, Failure> {
        let mut ran = self.run_whole()?;
        if let Output::Files(files) = &mut ran.output {
            files.retain(Option::is_some);
        }
        Ok(ran)
    }

    /// The endings of the files that it exports.
    pub(crate) fn endings(&self) -> Vec<String> {
        let Product::Files(endings) = self.product() else { panic!("{} makes no files", self.kind) };
        let ran = self.run_whole().unwrap_or_else(|failure| panic!("{}: {failure}", self.kind));
        let Output::Files(files) = ran.output else { panic!("{} makes no files", self.kind) };
        endings.into_iter().zip(files).filter(|(_, file)| file.is_some()).map(|(ending, _)| ending).collect()
    }

    /// What a stage that is connected to it learns of its files, and the files.
    pub(crate) fn exported(&self) -> (ExportedFiles, Vec<Vec<u8>>) {
        let ran = self.run_whole().unwrap_or_else(|failure| panic!("{}: {failure}", self.kind));
        let Output::Files(files) = ran.output else { panic!("{} makes no files", self.kind) };
        let bytes = files.iter().map(|file| file.as_ref().map_or(0, |file| file.len() as u64)).collect();
        let parameters = self.configure().unwrap().canonical();
        let exported = ExportedFiles { kind: self.kind.into(), parameters, bytes };
        (exported, files.into_iter().flatten().collect())
    }

    fn run_whole(&self) -> Result<Ran, Failure> {
        let configured = self.configure().unwrap();
        let mut context = Context::new(&self.files)
            .with_cancel(self.cancel.clone())
            .with_folder(absolute(""))
            .with_recipe(format!("{{\"kind\":\"{}\"}}", self.kind));
        if kinds().get(self.kind).unwrap().shows_keys() {
            context = context.with_key(ItemKey::from_iter([("environment", "sky")]));
        }
        if let Some(source) = &self.source {
            context = context.with_source(source.clone());
        }
        if let Some(scratch) = &self.scratch {
            context = context.with_scratch(scratch.clone());
        }
        let mut ports: BTreeMap<&str, Vec<_>> = BTreeMap::new();
        for (port, key, handle) in &self.inputs {
            ports.entry(port).or_default().push((key.clone(), Arc::clone(handle)));
        }
        for (port, items) in ports {
            context = context.with_input(port, items);
        }
        let output = configured.run(&context);
        self.compare_check(output.as_ref().err());
        let output = output?;
        let again = configured.run(&context)?;
        assert!(output.digests() == again.digests(), "{} is not repeatable", self.kind);
        match (self.product(), &output) {
            (Product::Artifact(_), Output::Artifact { .. }) => {}
            (Product::Files(endings), Output::Files(files)) => assert_eq!(endings.len(), files.len()),
            _ => panic!("{} makes another product than it promises", self.kind),
        }
        let half = |mut said: Vec<String>| {
            said.truncate(said.len() / 2);
            said
        };
        Ok(Ran {
            notes: half(context.reporter.notes()),
            warnings: half(context.reporter.warnings()),
            reads: context.files.reads(),
            share_done: context.reporter.share_done(),
            output,
        })
    }

    /// What the check of the source finds, without a run; `None` if nothing.
    pub(crate) fn check(&self) -> Option<Failure> {
        let source = self.source.clone()?;
        let context = Context::new(&self.files).with_folder(absolute("")).with_source(source);
        self.configure().unwrap().check_source(&context).err()
    }

    /// The check of a source refuses nothing that runs, and says what the run says.
    fn compare_check(&self, failure: Option<&Failure>) {
        let Some(found) = self.check() else { return };
        match failure {
            None => panic!("{} runs, but its check says {found}", self.kind),
            Some(failure) if failure.cancelled => {}
            Some(failure) => assert_eq!(found, *failure, "{}", self.kind),
        }
    }

    /// The message of the failure of a run, with paths as Unix has them.
    pub(crate) fn failure(&self) -> String {
        match self.run() {
            Ok(_) => panic!("{} did not fail", self.kind),
            Err(failure) => test_data::unix_paths(failure.to_string()),
        }
    }

    /// Runs it and takes the artifact.
    pub(crate) fn artifact<T: Artifact + PartialEq>(&self) -> Arc<T> {
        match self.run() {
            Ok(ran) => ran.artifact(),
            Err(failure) => panic!("{}: {failure}", self.kind),
        }
    }

    /// Runs it and takes the files.
    pub(crate) fn files(&self) -> Vec<Vec<u8>> {
        match self.run() {
            Ok(Ran { output: Output::Files(files), .. }) => files.into_iter().flatten().collect(),
            Ok(_) => panic!("{} makes no files", self.kind),
            Err(failure) => panic!("{}: {failure}", self.kind),
        }
    }
}

impl Ran {
    /// The files that it exports.
    pub(crate) fn files(&self) -> Vec<&[u8]> {
        let Output::Files(files) = &self.output else { panic!("no files") };
        files.iter().flatten().map(Vec::as_slice).collect()
    }

    /// The artifact; its bytes decode to the same value.
    pub(crate) fn artifact<T: Artifact + PartialEq>(&self) -> Arc<T> {
        let Output::Artifact { bytes, value } = &self.output else { panic!("not an artifact") };
        let value = Arc::clone(value).downcast::<T>().ok().unwrap();
        assert!(T::decode(bytes).unwrap() == *value, "the bytes are not those of the value");
        value
    }
}

/// A handle on a value.
fn handle<T: Artifact>(value: T) -> Arc<Handle> {
    let value = Arc::new(value);
    let stored = Arc::clone(&value);
    let digest = Digest::of(T::TYPE.as_bytes());
    Arc::new(Handle::new(T::TYPE, digest, move || stored.encode()).with_value(value))
}

/// A TOML text as the engine parses it.
fn table(text: &str) -> Table {
    Table::parse(text).unwrap()
}

/// A lat-long environment of `rows` rows whose radiance is that of a function of the direction (x, y, z).
pub(crate) fn environment(rows: usize, radiance: impl Fn(DVec3) -> [f64; 3]) -> artifacts::Environment {
    let grid = LatLong::with_rows(rows);
    let looks = |index: usize| grid.direction(index / grid.width, index % grid.width).vector();
    let pixels = (0..grid.len()).map(|index| radiance(looks(index)).map(|value| value as f32)).collect();
    artifacts::Environment(envmap::Environment::new(grid, pixels).unwrap())
}

/// A soft sky: bright above, reddish toward +X, bluish toward +Y; of degree 2.
pub(crate) fn sky(w: DVec3) -> [f64; 3] {
    [1.0 + 0.5 * w.z + 0.3 * w.x, 1.0 + 0.5 * w.z, 1.0 + 0.5 * w.z + 0.3 * w.y + 0.2 * w.x * w.y]
}

/// The expansion of [`sky`].
pub(crate) fn sky_lighting() -> artifacts::Lighting {
    let environment = environment(16, sky);
    let transform = Transform::new(LatLong::with_rows(16), Degree::new(2).unwrap()).unwrap();
    artifacts::Lighting(transform.analyse(environment.0.pixels()).into())
}

/// The reflection of [`sky`] by a material.
pub(crate) fn reflection(material: brdf::Material, degree: usize) -> artifacts::Reflection {
    let f = Degree::new(degree).unwrap();
    let brdf = brdf::project(&material, brdf::Choice::Degree { f, p: Degree::ZERO }, Stop::NEVER).unwrap();
    artifacts::Reflection(shrm::Reflection::convolve(&sky_lighting().0.series, &brdf.coefficients))
}

/// A matte material of this albedo.
pub(crate) fn lambert(albedo: f64) -> brdf::Material {
    brdf::Material::Lambert(brdf::Lambert::new([albedo; 3]).unwrap())
}

/// A grey highlight.
pub(crate) fn phong(exponent: f64) -> brdf::Material {
    brdf::Material::Phong(brdf::Phong::new(exponent, [1.0; 3]).unwrap())
}

/// A picture as a 32-bit OpenEXR file.
pub(crate) fn exr(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Vec<u8> {
    let image = envmap::Image::new(width, height, pixels).unwrap();
    containers::write_exr(&image, containers::Precision::Float, None).unwrap().bytes
}

/// The pixels of a written picture.
pub(crate) fn pixels(bytes: &[u8]) -> (usize, usize, Vec<[f32; 3]>) {
    let image = containers::read_image(bytes, &containers::ReadOptions::default()).unwrap().image;
    (image.width(), image.height(), image.into_pixels())
}

/// The largest difference of two lists of colours.
#[track_caller]
pub(crate) fn difference<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[[A; 3]], b: &[[B; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(&a, &b)| (a.into() - b.into()).abs()).fold(0.0, f64::max)
}
