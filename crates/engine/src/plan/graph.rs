//! The stages and their connections, as far as the manifest alone describes them, without the files on disk.
//!
//! A stage with an error stays in the graph, as far as it is known, so that the others can be checked; what
//! depends on its unknown part is not reported, so that each mistake is reported once.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cycles;
use super::index::StageIndex;
use super::manifest::{Declaration, Key, Manifest, OWNED, Written};
use super::source::{Source, listed, source_of, unexpanded};
use super::template::{Template, check};
use crate::kinds::{Configured, ErasedKind, Kinds, Port, Product, RecipeReader};
use crate::manifest::{Diagnostic, Diagnostics, Document, Spelling, Table, nearest, unknown_parameters};

/// The stages of a manifest and their connections, without items.
///
/// It contains everything that the manifest says, so that items can be expanded again when files appear or
/// disappear.
#[derive(Clone)]
pub struct Graph {
    pub(crate) manifest: PathBuf,
    pub(crate) out: PathBuf,
    pub(crate) document: Arc<Document>,
    /// The stages in topological order, ties in the order of the manifest.
    pub(crate) nodes: Vec<Node>,
    pub(crate) recipe_reader: RecipeReader,
}

/// A stage, as far as it is known.
#[derive(Clone)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) header: Range<usize>,
    pub(crate) kind: Option<Arc<dyn ErasedKind>>,
    pub(crate) configured: Option<Arc<dyn Configured>>,
    /// The parameters as they are written.
    pub(crate) parameters: Table,
    /// The kind's ports, or, if the kind accepts any port, those that the stage names.
    pub(crate) ports: Vec<Port>,
    /// The connections, in the order of `ports`.
    pub(crate) edges: Vec<Edge>,
    /// The `source`, if it is valid.
    pub(crate) source: Option<Source>,
    /// The name of the only item of a stage that needs no source.
    pub(crate) built_in: Option<String>,
    pub(crate) product: Option<Product>,
    /// The source stages whose files distinguish its items, sorted by name; `None` if one of them is unknown.
    pub(crate) keys: Option<Vec<StageIndex>>,
    /// The parsed `path`, for a stage that exports files.
    pub(crate) template: Option<Template>,
}

#[derive(Clone, Debug)]
pub(crate) struct Edge {
    /// The index of the port; `None` if the kind or the port is unknown.
    pub(crate) port: Option<usize>,
    pub(crate) from: StageIndex,
    /// The place of the stage's name in the text.
    pub(crate) span: Range<usize>,
}

impl Graph {
    /// Interprets a manifest's text. Returns what is valid and adds a diagnostic for what is not.
    pub(crate) fn parse(
        manifest: PathBuf,
        document: Document,
        kinds: &Kinds,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let Manifest { out, stages } = Manifest::parse(&document, errors)?;
        let folder = manifest.parent().unwrap_or(&manifest).to_path_buf();
        let out = out_folder(&out, &folder, errors);
        let spelling = Spelling::default();
        let mut nodes = connect(&stages, kinds, &folder, out.as_deref(), &spelling, errors);
        let needs = nodes.iter().map(|node| node.edges.iter().map(|edge| edge.from).collect());
        let (order, cycles) = cycles::order(&needs.collect::<Vec<_>>());
        errors.extend(cycles.iter().map(|cycle| in_a_cycle(&nodes, cycle)));
        let mut index = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| index[old] = new);
        nodes.iter_mut().flat_map(|node| &mut node.edges).for_each(|edge| edge.from = index[edge.from]);
        let mut nodes: Vec<_> = nodes.into_iter().map(Some).collect();
        let nodes = order.iter().filter_map(|&old| nodes[old].take()).collect();
        let declarations: Vec<_> = order.iter().map(|&old| &stages[old]).collect();
        let out = out.unwrap_or_else(|| folder.join("out"));
        let mut graph =
            Self { manifest, out, document: Arc::new(document), nodes, recipe_reader: kinds.recipe_reader() };
        graph.resolve(&declarations, &spelling, errors);
        Some(graph)
    }

    /// The manifest file. Absolute.
    pub fn manifest(&self) -> &Path {
        &self.manifest
    }

    /// The folder for exports. Absolute.
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// The sources, each with the name of its stage: the files, folders and globs that the items come from.
    pub fn sources(&self) -> impl Iterator<Item = (&str, &Source)> {
        self.nodes.iter().filter_map(|node| Some((node.name.as_str(), node.source.as_ref()?)))
    }

    pub(crate) fn diagnostics(&self, errors: Vec<Diagnostic>) -> Diagnostics {
        self.document.diagnostics(errors)
    }

    /// Adds to each stage what depends on those before it: types, keys and paths.
    fn resolve(&mut self, declarations: &[&Declaration], spelling: &Spelling, errors: &mut Vec<Diagnostic>) {
        let mut unconnected = Vec::new();
        let mut mismatched = Vec::new();
        for stage in 0..self.nodes.len() {
            let declaration = declarations[stage];
            if self.nodes[stage].kind.is_none() {
                continue;
            }
            let ports = self.nodes[stage].ports.clone();
            // An edge from a later stage belongs to a cycle, which has been reported.
            let edges = &self.nodes[stage].edges;
            let is_valid = ports.is_empty()
                || edges.iter().all(|edge| edge.from < stage && edge.port.is_some())
                    && !matches!(declaration.input, Key::Invalid)
                    && !matches!(declaration.inputs, Key::Invalid)
                    && edges.len() == names(declaration).len();
            let mut is_connected = is_valid;
            for (index, port) in ports.iter().enumerate() {
                let open = self.nodes[stage].edges.iter().all(|edge| edge.port != Some(index));
                if is_valid && open && !port.optional {
                    unconnected.push((stage, index));
                    is_connected = false;
                }
            }
            let types = self.types(stage, &ports, &mut mismatched);
            let node = &self.nodes[stage];
            let product = match (&node.configured, types) {
                (Some(configured), Some(types)) if is_connected => {
                    let types: Vec<_> = types.iter().map(|(port, made)| (port.as_str(), *made)).collect();
                    for (name, message) in configured.check_inputs(&types) {
                        let entry = declaration.parameters.get(name);
                        let span = entry.map_or(node.header.clone(), |entry| entry.value.span.clone());
                        errors.push(Diagnostic::at(span, message));
                    }
                    Some(configured.product(&types))
                }
                _ => None,
            };
            let keys =
                if is_connected { self.keys(stage, &ports, declaration, spelling, errors) } else { None };
            let template = self.template(stage, &keys, product.as_ref(), declaration, spelling, errors);
            let node = &mut self.nodes[stage];
            (node.product, node.keys, node.template) = (product, keys, template);
        }
        let unconnected = unconnected.into_iter().map(|(stage, index)| self.unconnected(stage, index));
        let mismatched = mismatched.into_iter().map(|(stage, edge)| self.mismatched(stage, edge));
        let mut without_input = unconnected.chain(mismatched).collect::<Vec<_>>();
        // All stages are searched for those that could be connected, so only the errors that are shown get
        // this help.
        without_input.sort_by_key(|(_, _, error)| error.span.as_ref().map(|span| span.start));
        let helped = without_input.into_iter().enumerate().map(|(index, (stage, port, error))| match index {
            ..Diagnostics::SHOWN => error.help(self.producers(stage, &self.nodes[stage].ports[port])),
            _ => error,
        });
        errors.extend(helped);
    }

    /// The types that arrive; `None` if one is unknown, or if one does not fit, which is added to
    /// `mismatched`.
    fn types(
        &self,
        stage: StageIndex,
        ports: &[Port],
        mismatched: &mut Vec<(StageIndex, usize)>,
    ) -> Option<Vec<(String, &'static str)>> {
        let mut types = Some(Vec::new());
        for (index, edge) in self.nodes[stage].edges.iter().enumerate() {
            let port = edge.port.map(|port| &ports[port]);
            let made = if edge.from < stage { self.nodes[edge.from].product.as_ref() } else { None };
            types = match (port, made) {
                (Some(port), Some(made)) if port.takes_product(made) => types.map(|mut types| {
                    types.push((port.name.clone(), made.type_name()));
                    types
                }),
                (Some(_), Some(_)) => {
                    mismatched.push((stage, index));
                    None
                }
                _ => None,
            };
        }
        types
    }

    /// The keys of a stage's items: those of its single ports and its own source, and those that `per` adds.
    fn keys(
        &self,
        stage: StageIndex,
        ports: &[Port],
        declaration: &Declaration,
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Vec<StageIndex>> {
        let node = &self.nodes[stage];
        let (mut kept, mut gathered) = (Vec::new(), Vec::new());
        if node.kind.as_ref()?.has_source() {
            kept.push(stage);
        }
        let mut known = true;
        for edge in &node.edges {
            match (&self.nodes[edge.from].keys, ports[edge.port?].many) {
                (Some(keys), false) => kept.extend(keys),
                (Some(keys), true) => gathered.extend(keys),
                (None, _) => known = false,
            }
        }
        let name = |stage: &StageIndex| self.nodes[*stage].name.as_str();
        let sorted = |mut keys: Vec<StageIndex>| {
            keys.sort_by(|a, b| name(a).cmp(name(b)));
            keys.dedup();
            keys
        };
        let kept = sorted(kept);
        match &declaration.per {
            Key::Absent => known.then_some(kept),
            Key::Invalid => None,
            Key::Given(_) if !ports.iter().any(|port| port.many) => None,
            Key::Given(_) if !known => None,
            Key::Given(per) => {
                let before = errors.len();
                let all = sorted(kept.iter().chain(&gathered).copied().collect());
                let named: HashMap<&str, StageIndex> = all.iter().map(|key| (name(key), *key)).collect();
                let mut chosen = HashSet::new();
                for word in &per.value {
                    match named.get(word.value.as_str()) {
                        Some(key) if !chosen.insert(*key) => errors.push(
                            Diagnostic::at(word.span.clone(), format!("{:?} appears twice", word.value))
                                .expected("expected each key once"),
                        ),
                        Some(_) => {}
                        None => {
                            let message = format!("{:?} is not a key of this stage's inputs", word.value);
                            let near = spelling.nearest(&word.value, all.iter().map(name));
                            errors.push(unknown(message, word, all.iter().map(name), near, "no key"));
                        }
                    }
                }
                let lost: Vec<_> = kept.iter().filter(|key| !chosen.contains(*key)).map(name).collect();
                if errors.len() == before && !lost.is_empty() {
                    let message = format!(
                        "\"per\" leaves out {}, but a port that takes a single item needs it",
                        listed(lost)
                    );
                    let expected = kept.iter().map(|key| format!("{:?}", name(key)));
                    errors.push(
                        Diagnostic::at(per.span.clone(), message)
                            .expected(format!("expected at least {}", listed(expected))),
                    );
                }
                (errors.len() == before).then(|| sorted(chosen.into_iter().collect()))
            }
        }
    }

    fn template(
        &self,
        stage: StageIndex,
        keys: &Option<Vec<StageIndex>>,
        product: Option<&Product>,
        declaration: &Declaration,
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Template> {
        let node = &self.nodes[stage];
        if let (Some(Product::Artifact(made)), Key::Given(path)) = (product, &declaration.path) {
            let kind = node.kind.as_ref()?.name();
            errors.push(
                Diagnostic::at(path.span.clone(), format!("stage {:?} does not export files", node.name))
                    .expected("expected no \"path\"")
                    .help(format!("{kind} makes {made}, for other stages")),
            );
        }
        let (Product::Files(_), Some(keys)) = (product?, keys) else { return None };
        match &declaration.path {
            Key::Invalid => None,
            Key::Absent => Some(Template::of_stage(&node.name, declaration.name.span.clone(), keys.len())),
            Key::Given(path) => {
                let names: Vec<_> = keys.iter().map(|&key| self.nodes[key].name.as_str()).collect();
                Template::parse(path, &node.name, &names, spelling, errors)
            }
        }
    }

    /// The error of a port that is not connected, with its stage and its index there.
    fn unconnected(&self, stage: StageIndex, index: usize) -> (StageIndex, usize, Diagnostic) {
        let node = &self.nodes[stage];
        let port = &node.ports[index];
        let expected = match node.ports.as_slice() {
            [_] => "expected input = \"STAGE\"".into(),
            _ => format!("expected inputs = {{ {} = \"STAGE\", ... }}", port.name),
        };
        let message = format!("port {:?} of stage {:?} is not connected", port.name, node.name);
        (stage, index, Diagnostic::at(node.header.clone(), message).expected(expected))
    }

    /// The error of a port that is connected to a stage of the wrong type, with its stage and its index
    /// there.
    fn mismatched(&self, stage: StageIndex, edge: usize) -> (StageIndex, usize, Diagnostic) {
        let node = &self.nodes[stage];
        let edge = &node.edges[edge];
        let index = edge.port.unwrap_or_default();
        let port = &node.ports[index];
        let (from, types) = (&self.nodes[edge.from], port.takes_text());
        let made = match &from.product {
            Some(Product::Artifact(made)) => format!("makes {made}"),
            _ => "exports files".into(),
        };
        let message = format!("port {:?} takes {types}, but stage {:?} {made}", port.name, from.name);
        let error = Diagnostic::at(edge.span.clone(), message);
        (stage, index, error.expected(format!("expected a stage that makes {types}")))
    }

    /// The stages that could be connected to a port, for help: those that make its type and do not need
    /// `stage`.
    fn producers(&self, stage: StageIndex, port: &Port) -> String {
        let mut needs = vec![false; self.nodes.len()];
        needs[stage] = true;
        // In topological order, so that the stages that a stage needs come before it.
        for index in 0..self.nodes.len() {
            needs[index] |= self.nodes[index].edges.iter().any(|edge| needs[edge.from]);
        }
        let producers = self.nodes.iter().zip(&needs).filter(|(node, needs)| {
            !**needs && node.product.as_ref().is_some_and(|made| port.takes_product(made))
        });
        let names: Vec<_> = producers.map(|(node, _)| &node.name).collect();
        let types = port.takes_text();
        match names.as_slice() {
            [] => format!("no stage makes {types}"),
            [name] => format!("stage {name:?} makes {types}"),
            _ => format!("these stages make {types}: {}", listed(names)),
        }
    }
}

/// The error of stages that need each other, from the first through what it needs back to itself.
fn in_a_cycle(nodes: &[Node], cycle: &[StageIndex]) -> Diagnostic {
    let (first, second) = (&nodes[cycle[0]], cycle[1 % cycle.len()]);
    let edge = first.edges.iter().find(|edge| edge.from == second);
    let span = edge.map_or(first.header.clone(), |edge| edge.span.clone());
    let message = match cycle {
        [_] => format!("stage {:?} needs itself", first.name),
        _ => {
            let needed =
                cycle[1..].iter().chain(&cycle[..1]).map(|&stage| format!("needs {}", nodes[stage].name));
            let needed: Vec<_> = needed.collect();
            let way = if needed.len() > 8 { listed(needed) } else { needed.join(", which ") };
            format!("stages need each other in a cycle: {} {way}", first.name)
        }
    };
    Diagnostic::at(span, message).expected("expected a stage that does not need this one")
}

/// The names of the ports that a stage writes; the short form `input` counts as a port of that name.
fn names(declaration: &Declaration) -> Vec<&str> {
    let short = declaration.input.given().map(|_| "input");
    let named = declaration.inputs.given().map_or(&[][..], |inputs| &inputs.value);
    short.into_iter().chain(named.iter().map(|(port, _)| port.value.as_str())).collect()
}

pub(super) fn out_folder(out: &Key<String>, folder: &Path, errors: &mut Vec<Diagnostic>) -> Option<PathBuf> {
    let written = match out {
        Key::Absent => return Some(folder.join("out")),
        Key::Invalid => return None,
        Key::Given(written) => written,
    };
    let plain = written.value.trim_start_matches("./").trim_end_matches('/');
    let error = |message: String, expected: String| {
        Diagnostic::at(written.span.clone(), message).expected(expected).help("out = \"out\" is the default")
    };
    if plain.is_empty() || plain == "." {
        let message = format!("out = {:?} is the manifest's own folder", written.value);
        let expected = "expected a folder for exports only, inside the manifest's folder";
        errors.push(error(message, expected.into()));
        return None;
    }
    if let Some(expansion) = unexpanded(plain) {
        let message = format!(
            "out = {:?} would be a folder with that name: {expansion} is not expanded",
            written.value
        );
        errors.push(error(message, "expected a folder inside the manifest's folder".into()));
        return None;
    }
    if let Err(problem) = check(plain, "the manifest's folder") {
        let message = format!("out = {:?} {}", written.value, problem.message);
        errors.push(error(message, problem.expected));
        return None;
    }
    Some(plain.split('/').fold(folder.to_path_buf(), |path, name| path.join(name)))
}

/// The stages in the order of the manifest, each with its kind, parameters, source and connections.
fn connect(
    stages: &[Declaration],
    kinds: &Kinds,
    folder: &Path,
    out: Option<&Path>,
    spelling: &Spelling,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Node> {
    let indices = stages.iter().zip(0..).map(|(stage, index)| (stage.name.value.as_str(), index));
    let indices: HashMap<&str, StageIndex> = indices.collect();
    stages
        .iter()
        .map(|stage| {
            let kind = kind(stage, kinds, errors);
            let ports = kind.as_ref().map(|kind| kind.ports_named(&names(stage)));
            let parameters =
                kind.as_ref().map(|kind| parameters(stage, kind.as_ref(), errors)).unwrap_or_default();
            let configured = kind.as_ref().map(|kind| kind.configure(&parameters));
            let configured =
                configured.and_then(|configured| configured.map_err(|found| errors.extend(found)).ok());
            let (source, built_in) =
                source_of(stage, kind.as_deref(), configured.as_deref(), (folder, out), errors);
            Node {
                name: stage.name.value.clone(),
                header: stage.header.clone(),
                configured,
                parameters,
                edges: edges(
                    stage,
                    kind.as_deref().zip(ports.as_deref()),
                    &indices,
                    stages,
                    spelling,
                    errors,
                ),
                ports: ports.unwrap_or_default(),
                source,
                built_in,
                product: None,
                keys: None,
                template: None,
                kind,
            }
        })
        .collect()
}

fn kind(stage: &Declaration, kinds: &Kinds, errors: &mut Vec<Diagnostic>) -> Option<Arc<dyn ErasedKind>> {
    let written = stage.kind.given()?;
    let kind = kinds.get(&written.value).cloned();
    if kind.is_none() {
        let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
        let near = nearest(&written.value, names.iter().copied());
        let message = format!("there is no kind {:?}", written.value);
        errors.push(unknown(message, written, names.iter().copied(), near, "no kind"));
    }
    kind
}

/// The parameters of a stage: the entries of its table less those that the engine owns.
fn parameters(stage: &Declaration, kind: &dyn ErasedKind, errors: &mut Vec<Diagnostic>) -> Table {
    // Unknown keys are reported here rather than by the kind, because they may be misspelt keys of the
    // engine.
    let fields = kind.fields();
    let ports = kind.ports_named(&names(stage));
    let used = |key: &&str| match *key {
        "source" => kind.has_source(),
        "input" | "inputs" => !ports.is_empty(),
        "per" => ports.iter().any(|port| port.many),
        _ => true,
    };
    let owned = OWNED.into_iter().filter(used).map(str::to_owned).collect::<Vec<_>>();
    unknown_parameters(&stage.parameters, &owned, &fields, errors);
    stage.parameters.only(&fields)
}

fn edges(
    stage: &Declaration,
    kind: Option<(&dyn ErasedKind, &[Port])>,
    indices: &HashMap<&str, StageIndex>,
    stages: &[Declaration],
    spelling: &Spelling,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Edge> {
    let ports = kind.map_or(&[][..], |(_, ports)| ports);
    let mut edges = Vec::new();
    if let Some((kind, [])) = kind {
        let given = stage.input.given().map(|input| &input.span);
        if let Some(span) = given.or(stage.inputs.given().map(|inputs| &inputs.span)) {
            let error = Diagnostic::at(span.clone(), format!("{} does not take an input", kind.name()));
            let error = error.expected("expected no \"input\"");
            errors.push(if kind.has_source() {
                error.help("it reads files: source = \"...\"")
            } else {
                error
            });
            return edges;
        }
    }
    if let (Key::Given(per), Some((kind, ports))) = (&stage.per, kind)
        && !ports.iter().any(|port| port.many)
    {
        let message = format!("{} has no port that takes many items", kind.name());
        let error = Diagnostic::at(per.span.clone(), message).expected("expected no \"per\"");
        errors.push(error.help("\"per\" chooses how such a port groups its items"));
    }
    let mut connect = |port: Option<usize>, from: &Written<String>| match indices.get(from.value.as_str()) {
        Some(&stage) => edges.push(Edge { port, from: stage, span: from.span.clone() }),
        None => {
            let names = stages.iter().map(|stage| stage.name.value.as_str());
            let near = spelling.nearest(&from.value, names.clone());
            let message = format!("there is no stage {:?}", from.value);
            errors.push(unknown(message, from, names, near, "no stage"));
        }
    };
    if let Key::Given(input) = &stage.input {
        connect(kind.map(|_| 0), input);
    }
    let mut unknown_ports = Vec::new();
    let names = ports.iter().map(|port| port.name.as_str());
    // If two ports have the same name, the first one is connected.
    let ports_by_name: HashMap<&str, usize> = names.clone().zip(0..ports.len()).rev().collect();
    for (port, from) in stage.inputs.given().map_or(&[][..], |inputs| &inputs.value) {
        let index = ports_by_name.get(port.value.as_str()).copied();
        if let (None, Some((kind, _))) = (index, kind) {
            let message = format!("{} has no port {:?}", kind.name(), port.value);
            let near = spelling.nearest(&port.value, names.clone());
            unknown_ports.push(unknown(message, port, names.clone(), near, "no port"));
        }
        connect(index, from);
    }
    errors.append(&mut unknown_ports);
    edges.sort_by_key(|edge| edge.port);
    edges
}

/// The error of a word that is not one of some names.
fn unknown<'n>(
    message: String,
    word: &Written<String>,
    names: impl ExactSizeIterator<Item = &'n str>,
    near: Option<&str>,
    none: &str,
) -> Diagnostic {
    let error = Diagnostic::at(word.span.clone(), message);
    let error = match names.len() {
        0 => error.expected(format!("expected {none}")),
        _ => error.expected(format!("expected one of: {}", listed(names))),
    };
    match near {
        Some(near) => error.help(format!("did you mean {near:?}?")),
        None => error,
    }
}
