//! Runs one kind on values in memory, the way the engine does.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use engine::{Artifact, Cancel, Context, Digest, Failure, Files, Handle, ItemKey, Kinds, Output, Table};
use stages::artifacts;

/// The kinds of `stages` and those of this crate.
pub(crate) fn kinds() -> Kinds {
    probe_stages::add_to(stages::kinds())
}

fn absolute(path: &str) -> PathBuf {
    Path::new("/memory").join(path)
}

/// Files that exist only in memory.
#[derive(Default)]
struct Memory(BTreeMap<PathBuf, Arc<Vec<u8>>>);

impl Files for Memory {
    fn read(&self, path: &Path) -> io::Result<Arc<Vec<u8>>> {
        self.0.get(path).map(Arc::clone).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn list(&self, _: &Path) -> io::Result<Vec<(String, bool)>> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn is_folder(&self, path: &Path) -> bool {
        !self.0.contains_key(path) && self.0.keys().any(|file| file.starts_with(path))
    }
}

/// The contents of the declared files; `None` for a file that is not exported.
pub(crate) type ExportedContents = Vec<Option<Vec<u8>>>;

/// A kind with parameters and inputs, not yet run.
pub(crate) struct Case {
    kind: &'static str,
    parameters: String,
    inputs: Vec<(&'static str, Arc<Handle>)>,
    files: Memory,
    source: Option<PathBuf>,
    cancel: Cancel,
}

/// The output and the messages of a run.
pub(crate) struct Ran<T> {
    pub(crate) value: Arc<T>,
    pub(crate) bytes: Vec<u8>,
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
    /// The paths of the files that were read.
    pub(crate) reads: Vec<String>,
}

/// A case of a kind with parameters in TOML.
pub(crate) fn case(kind: &'static str, parameters: &str) -> Case {
    Case {
        kind,
        parameters: parameters.into(),
        inputs: Vec::new(),
        files: Memory::default(),
        source: None,
        cancel: Cancel::default(),
    }
}

impl Case {
    /// Connects a port.
    pub(crate) fn input<T: Artifact + Clone>(mut self, port: &'static str, value: &T) -> Self {
        let bytes = value.encode().unwrap();
        let stored = bytes.clone();
        let handle = Handle::new(T::TYPE, Digest::of(&bytes), move || Ok(stored.clone()));
        self.inputs.push((port, Arc::new(handle.with_value(Arc::new(value.clone())))));
        self
    }

    /// Adds a file.
    pub(crate) fn file(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.files.0.insert(absolute(path), Arc::new(bytes.into()));
        self
    }

    /// Sets the source.
    pub(crate) fn source(mut self, path: &str) -> Self {
        self.source = Some(absolute(path));
        self
    }

    /// Lets it be cancelled.
    pub(crate) fn cancelled_by(mut self, cancel: &Cancel) -> Self {
        self.cancel = cancel.clone();
        self
    }

    /// The messages of the errors of the parameters.
    pub(crate) fn errors(&self) -> Vec<String> {
        let configured = kinds().get(self.kind).unwrap().configure(&Table::parse(&self.parameters).unwrap());
        configured.err().unwrap_or_default().into_iter().map(|error| error.message).collect()
    }

    /// Runs it; the bytes of its artifact decode to the value.
    pub(crate) fn run<T: Artifact + PartialEq>(&self) -> Result<Ran<T>, Failure> {
        let table = Table::parse(&self.parameters).unwrap();
        let configured = kinds().get(self.kind).unwrap().configure(&table);
        let configured = configured.unwrap_or_else(|errors| panic!("{}: {errors:?}", self.kind));
        let mut context =
            Context::new(&self.files).with_cancel(self.cancel.clone()).with_folder(absolute(""));
        if let Some(source) = &self.source {
            context = context.with_source(source.clone());
        }
        for (port, handle) in &self.inputs {
            context = context.with_input(port, vec![(ItemKey::default(), Arc::clone(handle))]);
        }
        let Output::Artifact { bytes, value } = configured.run(&context)? else { panic!("not an artifact") };
        let value = value.downcast::<T>().ok().unwrap();
        assert!(T::decode(&bytes).unwrap() == *value, "the bytes are not those of the value");
        Ok(Ran {
            value,
            bytes,
            notes: context.reporter.notes(),
            warnings: context.reporter.warnings(),
            reads: context.files.reads().iter().map(|read| read.path.display().to_string()).collect(),
        })
    }

    /// Runs it, a kind that exports: the contents of its files, and the notes.
    pub(crate) fn files_of(&self) -> Result<(ExportedContents, Vec<String>), Failure> {
        let configured = kinds().get(self.kind).unwrap().configure(&Table::parse(&self.parameters).unwrap());
        let configured = configured.unwrap_or_else(|errors| panic!("{}: {errors:?}", self.kind));
        let mut context = Context::new(&self.files).with_recipe("{\"a recipe\":1}".into());
        for (port, handle) in &self.inputs {
            context = context.with_input(port, vec![(ItemKey::default(), Arc::clone(handle))]);
        }
        let Output::Files(files) = configured.run(&context)? else { panic!("no files") };
        Ok((files, context.reporter.notes()))
    }

    /// Runs it and takes the artifact.
    pub(crate) fn artifact<T: Artifact + PartialEq>(&self) -> Arc<T> {
        self.run().unwrap_or_else(|failure| panic!("{}: {failure}", self.kind)).value
    }

    /// The failure of a run, as text, with its help.
    pub(crate) fn failure(&self) -> String {
        match self.run_any() {
            Ok(()) => panic!("{} did not fail", self.kind),
            Err(failure) => match &failure.help {
                Some(help) => format!("{failure} | {help}"),
                None => failure.to_string(),
            },
        }
    }

    fn run_any(&self) -> Result<(), Failure> {
        let done = match self.kind {
            "import-scene" | "scene-part" => self.run::<artifacts::Scene>().err(),
            "place-probes" => self.run::<artifacts::ProbePlaces>().err(),
            "bake-probes" => self.run::<artifacts::ProbeTransport>().err(),
            "bake-lamps" => self.run::<artifacts::ProbeLamps>().err(),
            _ => self.run::<artifacts::Probes>().err(),
        };
        done.map_or(Ok(()), Err)
    }
}

/// A part of a scene, by the kind `scene-part`.
pub(crate) fn part(scene: &artifacts::Scene, part: &str) -> Arc<artifacts::Scene> {
    case("scene-part", &format!("part = \"{part}\"")).input("scene", scene).artifact()
}
