//! What a stage can do: the trait that authors of kinds write, and its erased form that the engine sees.

use std::any::Any;
use std::path::PathBuf;
use std::sync::Arc;

use super::artifact::Artifact;
use super::context::Context;
use super::exported_files::ExportedFiles;
use super::failure::Failure;
use super::output::{Output, Product};
use crate::manifest::{Diagnostic, Field, Parameters, Table};

/// A place where artifacts arrive.
#[derive(Clone, Debug)]
pub struct Port {
    /// The name in `inputs = { name = "stage" }`.
    pub name: String,
    /// Whether it takes artifacts of every type.
    any: bool,
    /// The artifact types that it takes; of a port that takes all types, those that it decodes.
    types: Vec<PortType>,
    /// Whether it receives every item that agrees (a gather) rather than one.
    pub many: bool,
    /// Whether it may stay unconnected.
    pub optional: bool,
    /// The ending of the exported file that it takes, rather than the sizes of all files.
    file: Option<&'static str>,
}

/// The name of an artifact type, and how the engine decodes a stored artifact, once, before its consumers
/// run.
type PortType = (&'static str, Decoder);

/// Decodes the bytes of an artifact into its value.
pub(crate) type Decoder = fn(&[u8]) -> Result<Arc<dyn Any + Send + Sync>, Failure>;

fn port_type<T: Artifact>() -> PortType {
    (T::TYPE, |bytes| Ok(Arc::new(T::decode(bytes)?)))
}

impl Port {
    /// A port that takes one artifact of any type, including types that only other kinds know.
    /// [`Inputs::type_at`](super::inputs::Inputs::type_at) returns its type, and
    /// [`Inputs::bytes`](super::inputs::Inputs::bytes) its bytes.
    pub fn any(name: impl Into<String>) -> Self {
        Self { name: name.into(), any: true, types: Vec::new(), many: false, optional: false, file: None }
    }

    /// A port that takes one artifact of type `T`.
    pub fn one<T: Artifact>(name: impl Into<String>) -> Self {
        Self { any: false, ..Self::any(name).or::<T>() }
    }

    /// A port that receives every item that agrees, sorted by key.
    pub fn many<T: Artifact>(name: impl Into<String>) -> Self {
        Self { many: true, ..Self::one::<T>(name) }
    }

    /// A port that receives one exported file of every item that agrees, sorted by key: the file that the
    /// kind of the stage declares with this ending, such as `.json`. Items that leave it out are not among
    /// them. The files are read from the cache, by
    /// [`Inputs::many_files`](super::inputs::Inputs::many_files), and the consumer reruns if the bytes of one
    /// change.
    pub fn many_files(name: impl Into<String>, ending: &'static str) -> Self {
        Self { file: Some(ending), ..Self::many::<ExportedFiles>(name) }
    }

    /// Returns the port, also taking artifacts of type `T`. If it takes all types, this says that the kind
    /// decodes artifacts of type `T`, rather than taking their bytes.
    #[must_use]
    pub fn or<T: Artifact>(mut self) -> Self {
        self.types.push(port_type::<T>());
        self
    }

    /// Returns the port as one that may stay unconnected.
    #[must_use]
    pub fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// The names of the types that it takes; of a port that takes all types, those that it decodes.
    pub fn types(&self) -> impl Iterator<Item = &'static str> {
        self.types.iter().map(|(name, _)| *name)
    }

    /// Whether it takes artifacts of this type. The sizes of exported files have to be named: a port that
    /// takes all types does not mean them.
    pub fn takes(&self, type_name: &str) -> bool {
        self.any && type_name != ExportedFiles::TYPE || self.types().any(|name| name == type_name)
    }

    /// Whether it takes what a stage with this product hands on.
    pub(crate) fn takes_product(&self, product: &Product) -> bool {
        let has_file = self.file.is_none_or(|ending| product.place(ending).is_some());
        has_file && self.takes(product.type_name())
    }

    /// The place of the exported file that it takes of such a product; `None` if it takes artifacts or sizes.
    pub(crate) fn file_of(&self, product: &Product) -> Option<usize> {
        product.place(self.file?)
    }

    /// The types that it takes, for messages and manual pages: `reflection or shrm`.
    pub fn takes_text(&self) -> String {
        match (self.any, self.file) {
            (true, _) => "any artifact".into(),
            (false, Some(ending)) => format!("files that include {ending}"),
            (false, None) => self.types().collect::<Vec<_>>().join(" or "),
        }
    }

    /// How artifacts of this type are decoded; `None` if the kind takes their bytes.
    pub(crate) fn decoder(&self, type_name: &str) -> Option<Decoder> {
        self.types.iter().find(|(name, _)| *name == type_name).map(|(_, decoder)| *decoder)
    }
}

/// What a stage does: one unit of code with typed ports, parameters, a revision and its own manual text.
pub trait Kind: Send + Sync + 'static {
    /// The parameters, parsed once before the graph runs.
    type Parameters: Parameters;

    /// The name in the manifest: `project-sh`.
    const NAME: &'static str;
    /// Raised by the author when the output of equal inputs changes because of the kind's own code.
    const REVISION: u32;
    /// The revisions of the kernels that it calls, such as `&[sh::revisions::TRANSFORM]`. They are added to
    /// [`Kind::REVISION`], so if a kernel's results change, only the kernel's own number must be raised.
    const KERNELS: &'static [u32] = &[];
    /// The text of the kind's own source file (`include_str!`): its `//!` lines are the manual page.
    const TEXT: &'static str;
    /// Whether the kind reads a file or folder named by `source`.
    const SOURCE: bool = false;
    /// The optional parameter that, without a `source`, names something built in; only for a kind with a
    /// source. [`Kind::built_in`] finds it.
    const BUILT_IN: Option<&'static str> = None;
    /// Whether the kind shows items' names (labels). Then they are part of its key.
    const SHOWS_KEYS: bool = false;
    /// Whether an item takes seconds. As long as nobody knows how long it takes, it goes after all others.
    const SLOW: bool = false;
    /// Whether an item runs another program, which may write any file.
    const RUNS_PROGRAMS: bool = false;

    /// The manual page, Markdown, given the `//!` lines of [`Kind::TEXT`]. A kind fills in here what is made
    /// of a list, such as the rows of a table.
    fn manual(text: String) -> String {
        text
    }

    /// The ports, in the order of the manual page; the first is the one that `input = "..."` connects.
    fn ports() -> Vec<Port>;

    /// The ports of a stage whose `inputs` have these names, for a kind whose ports are chosen by its user.
    fn ports_named(_names: &[&str]) -> Vec<Port> {
        Self::ports()
    }

    /// The product of an item, given the type that arrives at each connected port (in the order of `ports`).
    ///
    /// Whether that is an artifact or files must not depend on an optional parameter.
    fn product(parameters: &Self::Parameters, types: &[(&str, &'static str)]) -> Product;

    /// What a stage with these parameters says to other parts of a program that know more of its product than
    /// the engine does: a value of a type that both know. The engine only passes it on.
    fn details(_parameters: &Self::Parameters) -> Option<Box<dyn Any>> {
        None
    }

    /// The errors of parameters that are each valid by themselves: pairs of a parameter's name and a message.
    /// The engine puts the name before the message.
    fn check(_parameters: &Self::Parameters) -> Vec<(&'static str, String)> {
        Vec::new()
    }

    /// The errors of parameters that show only with the types that arrive, which are given as to
    /// [`Kind::product`]: pairs of a parameter's name and a message.
    fn check_inputs(
        _parameters: &Self::Parameters,
        _types: &[(&str, &'static str)],
    ) -> Vec<(&'static str, String)> {
        Vec::new()
    }

    /// The files and folders that these parameters name, beside the source. What lies in `out` is refused,
    /// before anything runs: nothing orders it after the stage that makes it.
    fn named_paths(_parameters: &Self::Parameters) -> Vec<NamedPath> {
        Vec::new()
    }

    /// Whether other machines may use the results of a stage with these parameters, from a cache that they
    /// share. False if a result depends on something that is not in its key, such as a device.
    fn is_shared(_parameters: &Self::Parameters) -> bool {
        true
    }

    /// The kind of processor, if results of a stage with these parameters depend on it: it is part of the
    /// key. `None`, as it should be: every machine makes the same bytes.
    fn processor(_parameters: &Self::Parameters) -> Option<&'static str> {
        None
    }

    /// The properties that another machine must have to run items of a stage with these parameters, such as
    /// `("container-image", "docker://...")`; usually none. `None`: the items run only on the machine of the
    /// build. What is not shared never runs elsewhere.
    fn properties(_parameters: &Self::Parameters) -> Option<Vec<(String, String)>> {
        Some(Vec::new())
    }

    /// Finds errors in an item's source without making its output: what its text and its headers say. It must
    /// be quick even if thousands of items are checked, so it reads headers by
    /// [`ItemFiles::open`](super::item_files::ItemFiles::open), and no pixels. It must not refuse what
    /// [`Kind::run`] accepts. A source that is not checked is accepted.
    ///
    /// # Errors
    /// If a run would fail, with the same message.
    fn check_source(_parameters: &Self::Parameters, _context: &Context<'_>) -> Result<(), Failure> {
        Ok(())
    }

    /// The name of the only item of a stage without a `source`, if [`Kind::BUILT_IN`] is given: the item has
    /// no source, and is made from the parameters alone. `None` if these name nothing built in.
    ///
    /// # Errors
    /// If nothing of that name is built in. The engine puts the parameter's name before the message.
    fn built_in(_parameters: &Self::Parameters) -> Result<Option<String>, String> {
        Ok(None)
    }

    /// Makes the output of one item.
    ///
    /// # Errors
    /// If the input cannot be used. The message says what is wrong and where, what was expected and what to
    /// do.
    fn run(parameters: &Self::Parameters, context: &Context<'_>) -> Result<Output, Failure>;
}

/// A file or folder that a parameter names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedPath {
    /// The parameter, an array or one path.
    pub parameter: &'static str,
    /// The index in the array; 0 of one path.
    pub index: usize,
    /// The path, relative to the manifest's folder.
    pub path: PathBuf,
    /// Whether it is a word that is a path only if something of that name exists.
    pub is_word: bool,
    /// Whether everything in it is read, if it is a folder.
    pub is_read_whole: bool,
}

/// A [`Kind`] as the engine sees it.
pub trait ErasedKind: Send + Sync {
    /// Returns [`Kind::NAME`].
    fn name(&self) -> &str;
    /// Returns [`Kind::REVISION`] and the sum of [`Kind::KERNELS`].
    fn revision(&self) -> u32;
    /// The manual page, Markdown: [`Kind::manual`] of the `//!` lines of [`Kind::TEXT`].
    fn manual(&self) -> String;
    /// The first paragraph of the manual, on one line.
    fn summary(&self) -> String {
        let manual = self.manual();
        let paragraph =
            manual.lines().take_while(|line| !line.trim().is_empty()).collect::<Vec<_>>().join(" ");
        paragraph.trim_start_matches(['#', ' ']).to_owned()
    }
    /// The parameters: names, what each expects, defaults and docs.
    fn fields(&self) -> Vec<Field>;
    /// The ports of [`Kind::ports`], which the manual page lists.
    fn ports(&self) -> Vec<Port>;
    /// The ports of [`Kind::ports_named`], for a stage whose `inputs` have these names.
    fn ports_named(&self, names: &[&str]) -> Vec<Port> {
        let _ = names;
        self.ports()
    }
    /// Returns [`Kind::SOURCE`].
    fn has_source(&self) -> bool;
    /// Returns [`Kind::BUILT_IN`].
    fn built_in_parameter(&self) -> Option<&'static str> {
        None
    }
    /// Returns [`Kind::SHOWS_KEYS`].
    fn shows_keys(&self) -> bool;
    /// Returns [`Kind::SLOW`].
    fn is_slow(&self) -> bool {
        false
    }
    /// Returns [`Kind::RUNS_PROGRAMS`].
    fn runs_programs(&self) -> bool {
        false
    }
    /// Parses a stage's parameters: the entries of its table less those that the engine owns.
    ///
    /// # Errors
    /// If there are errors in the parameters: all of them.
    fn configure(&self, table: &Table) -> Result<Arc<dyn Configured>, Vec<Diagnostic>>;
}

/// A kind with the parameters of one stage.
pub trait Configured: Send + Sync {
    /// The parameters with defaults filled in, as canonical JSON.
    fn canonical(&self) -> serde_json::Value;
    /// [`Kind::product`] with the stage's parameters.
    fn product(&self, types: &[(&str, &'static str)]) -> Product;
    /// [`Kind::details`] of the stage's parameters.
    fn details(&self) -> Option<Box<dyn Any>> {
        None
    }
    /// [`Kind::check_inputs`] of the stage's parameters; each message begins with the parameter's name.
    fn check_inputs(&self, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let _ = types;
        Vec::new()
    }
    /// [`Kind::named_paths`] of the stage's parameters.
    fn named_paths(&self) -> Vec<NamedPath> {
        Vec::new()
    }
    /// [`Kind::is_shared`] of the stage's parameters.
    fn is_shared(&self) -> bool {
        true
    }
    /// [`Kind::processor`] of the stage's parameters.
    fn processor(&self) -> Option<&'static str> {
        None
    }
    /// [`Kind::properties`] of the stage's parameters, and `None` for what is not shared.
    fn properties(&self) -> Option<Vec<(String, String)>> {
        self.is_shared().then(Vec::new)
    }
    /// Checks an item's source by [`Kind::check_source`] with the stage's parameters.
    ///
    /// # Errors
    /// The errors of [`Kind::check_source`].
    fn check_source(&self, context: &Context<'_>) -> Result<(), Failure> {
        let _ = context;
        Ok(())
    }
    /// [`Kind::built_in`] of the stage's parameters.
    ///
    /// # Errors
    /// The errors of [`Kind::built_in`]; each message begins with the parameter's name.
    fn built_in(&self) -> Result<Option<String>, String> {
        Ok(None)
    }
    /// Makes the output of an item by [`Kind::run`] with the stage's parameters.
    ///
    /// # Errors
    /// The errors of [`Kind::run`].
    fn run(&self, context: &Context<'_>) -> Result<Output, Failure>;
}

/// Finds the recipe in the bytes of an exported file; `None` if it holds none.
pub type RecipeReader = fn(&[u8]) -> Option<String>;

/// A list of kinds: what a manifest may name.
#[derive(Clone)]
pub struct Kinds {
    list: Vec<Arc<dyn ErasedKind>>,
    recipe_reader: RecipeReader,
}

impl Default for Kinds {
    fn default() -> Self {
        Self { list: Vec::new(), recipe_reader: |_| None }
    }
}

impl Kinds {
    /// An empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets how recipes are found in exported files. A build recognises an earlier export whose record is
    /// lost by its recipe; without this function there are no recipes.
    #[must_use]
    pub fn with_recipe_reader(self, recipe_reader: RecipeReader) -> Self {
        Self { recipe_reader, ..self }
    }

    pub(crate) fn recipe_reader(&self) -> RecipeReader {
        self.recipe_reader
    }

    /// Adds a kind.
    ///
    /// # Panics
    /// If there is already a kind of that name, which is a mistake in the program and not in its input.
    #[must_use]
    pub fn with<K: Kind>(self, kind: K) -> Self {
        self.with_erased(Arc::new(Erased(kind)))
    }

    /// Adds a kind that is already erased.
    ///
    /// # Panics
    /// If there is already a kind of that name.
    #[must_use]
    pub fn with_erased(mut self, kind: Arc<dyn ErasedKind>) -> Self {
        assert!(self.get(kind.name()).is_none(), "two kinds are named {}", kind.name());
        self.list.push(kind);
        self
    }

    /// The kind of a name.
    pub fn get(&self, name: &str) -> Option<&Arc<dyn ErasedKind>> {
        self.list.iter().find(|kind| kind.name() == name)
    }

    /// All kinds, in the order of the list.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<dyn ErasedKind>> {
        self.list.iter()
    }
}

struct Erased<K>(#[allow(dead_code)] K);

impl<K: Kind> ErasedKind for Erased<K> {
    fn name(&self) -> &str {
        K::NAME
    }

    fn revision(&self) -> u32 {
        K::REVISION + K::KERNELS.iter().sum::<u32>()
    }

    fn manual(&self) -> String {
        let lines = K::TEXT.lines().map_while(|line| line.strip_prefix("//!"));
        K::manual(lines.map(|line| line.strip_prefix(' ').unwrap_or(line)).collect::<Vec<_>>().join("\n"))
    }

    fn fields(&self) -> Vec<Field> {
        K::Parameters::fields()
    }

    fn ports(&self) -> Vec<Port> {
        K::ports()
    }

    fn ports_named(&self, names: &[&str]) -> Vec<Port> {
        K::ports_named(names)
    }

    fn has_source(&self) -> bool {
        K::SOURCE
    }

    fn built_in_parameter(&self) -> Option<&'static str> {
        K::BUILT_IN
    }

    fn shows_keys(&self) -> bool {
        K::SHOWS_KEYS
    }

    fn is_slow(&self) -> bool {
        K::SLOW
    }

    fn runs_programs(&self) -> bool {
        K::RUNS_PROGRAMS
    }

    fn configure(&self, table: &Table) -> Result<Arc<dyn Configured>, Vec<Diagnostic>> {
        let mut errors = Vec::new();
        let parameters = K::Parameters::parse(table, &mut errors);
        if let Some(parameters) = &parameters {
            for (name, message) in K::check(parameters) {
                let span = table.get(name).map_or(table.span.clone(), |entry| entry.value.span.clone());
                errors.push(Diagnostic::at(span, format!("{name}: {message}")));
            }
        }
        match parameters {
            Some(parameters) if errors.is_empty() => Ok(Arc::new(ConfiguredKind::<K>(parameters))),
            _ => Err(errors),
        }
    }
}

struct ConfiguredKind<K: Kind>(K::Parameters);

impl<K: Kind> Configured for ConfiguredKind<K> {
    fn canonical(&self) -> serde_json::Value {
        self.0.canonical()
    }

    fn product(&self, types: &[(&str, &'static str)]) -> Product {
        K::product(&self.0, types)
    }

    fn details(&self) -> Option<Box<dyn Any>> {
        K::details(&self.0)
    }

    fn check_inputs(&self, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let errors = K::check_inputs(&self.0, types).into_iter();
        errors.map(|(name, message)| (name, format!("{name}: {message}"))).collect()
    }

    fn named_paths(&self) -> Vec<NamedPath> {
        K::named_paths(&self.0)
    }

    fn is_shared(&self) -> bool {
        K::is_shared(&self.0)
    }

    fn processor(&self) -> Option<&'static str> {
        K::processor(&self.0)
    }

    fn properties(&self) -> Option<Vec<(String, String)>> {
        K::properties(&self.0).filter(|_| K::is_shared(&self.0))
    }

    fn check_source(&self, context: &Context<'_>) -> Result<(), Failure> {
        K::check_source(&self.0, context)
    }

    fn built_in(&self) -> Result<Option<String>, String> {
        let name = K::BUILT_IN.unwrap_or_default();
        K::built_in(&self.0).map_err(|message| format!("{name}: {message}"))
    }

    fn run(&self, context: &Context<'_>) -> Result<Output, Failure> {
        K::run(&self.0, context)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::parameters! {
        /// Parameters of a test.
        struct NoParameters {}
    }

    struct Blur;

    impl Kind for Blur {
        type Parameters = NoParameters;
        const NAME: &'static str = "blur";
        const REVISION: u32 = 3;
        const KERNELS: &'static [u32] = &[2, 5];
        const TEXT: &'static str = "//! Blurs.";

        fn ports() -> Vec<Port> {
            vec![Port::any("picture")]
        }

        fn product(_: &NoParameters, _: &[(&str, &'static str)]) -> Product {
            Product::Files(vec![".png".into()])
        }

        fn check_inputs(_: &NoParameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
            types.iter().map(|(_, arrives)| ("inputs", format!("{arrives} cannot be blurred"))).collect()
        }

        fn run(_: &NoParameters, _: &Context<'_>) -> Result<Output, Failure> {
            Err(Failure::new("it is not run"))
        }
    }

    #[test]
    fn a_kernels_revision_is_part_of_its_kinds() {
        assert_eq!(Erased(Blur).revision(), 10);
    }

    #[test]
    fn the_engine_names_the_parameter_before_the_message() {
        let stage = ConfiguredKind::<Blur>(NoParameters {});
        let expected = [("inputs", "inputs: mesh cannot be blurred".to_owned())];
        assert_eq!(stage.check_inputs(&[("picture", "mesh")]), expected);
    }
}
