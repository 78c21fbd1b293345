//! The stages and their connections: what the manifest alone says, before the disk is asked for files.
//!
//! A stage with a fault is kept, as far as it is known, so that the others can be looked at; what depends on the
//! unknown part is passed over in silence, so that one mistake is told once.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cycles;
use super::manifest::{Declaration, Key, Manifest, OWNED, Written};
use super::source::{Source, listed};
use super::template::{Template, check};
use crate::spelling::Spelling;
use crate::{
    Configured, Diagnostic, Diagnostics, Document, ErasedKind, Kinds, Port, Product, RecipeReader, Table,
    nearest, unknown_keys,
};

/// The place of a stage in the graph: topological, ties in the order of the manifest.
pub(crate) type Place = usize;

/// The stages of a manifest and their connections, without items.
///
/// It is all that the manifest says, so that items can be expanded again when files come and go.
#[derive(Clone)]
pub struct Graph {
    pub(crate) manifest: PathBuf,
    pub(crate) out: PathBuf,
    pub(crate) document: Arc<Document>,
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
    /// The kind's ports, or for a kind that takes what it is given, those that the stage names.
    pub(crate) ports: Vec<Port>,
    /// In the order of `ports`.
    pub(crate) edges: Vec<Edge>,
    /// The `source`, where it is understood.
    pub(crate) source: Option<Source>,
    pub(crate) product: Option<Product>,
    /// The source stages whose files tell its items apart, sorted by name; `None` where a part of that is unknown.
    pub(crate) keys: Option<Vec<Place>>,
    /// For a stage that exports files.
    pub(crate) template: Option<Template>,
}

/// A connection of a port.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    /// The place among the kind's ports; `None` where the kind or the port is unknown.
    pub(crate) port: Option<usize>,
    pub(crate) from: Place,
    /// Where the stage's name is written.
    pub(crate) span: Range<usize>,
}

impl Graph {
    /// Understands a manifest's text. Returns what is sound and adds what is not to the faults.
    pub(crate) fn draft(
        manifest: PathBuf,
        document: Document,
        kinds: &Kinds,
        faults: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let Manifest { out, stages } = Manifest::parse(&document, faults)?;
        let folder = manifest.parent().unwrap_or(&manifest).to_path_buf();
        let out = out_folder(&out, &folder, faults);
        let spelling = Spelling::default();
        let mut nodes = connect(&stages, kinds, &folder, out.as_deref(), &spelling, faults);
        let order = cycles::order(&nodes, faults);
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| place[old] = new);
        nodes.iter_mut().flat_map(|node| &mut node.edges).for_each(|edge| edge.from = place[edge.from]);
        let mut nodes: Vec<_> = nodes.into_iter().map(Some).collect();
        let nodes = order.iter().filter_map(|&old| nodes[old].take()).collect();
        let declarations: Vec<_> = order.iter().map(|&old| &stages[old]).collect();
        let out = out.unwrap_or_else(|| folder.join("out"));
        let mut graph =
            Self { manifest, out, document: Arc::new(document), nodes, recipe_reader: kinds.recipe_reader() };
        graph.resolve(&declarations, &spelling, faults);
        Some(graph)
    }

    /// The manifest file. Absolute.
    pub fn manifest(&self) -> &Path {
        &self.manifest
    }

    /// The folder that exports land in. Absolute.
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// The sources, each with the name of its stage: the files, folders and globs that the items come from.
    pub fn sources(&self) -> impl Iterator<Item = (&str, &Source)> {
        self.nodes.iter().filter_map(|node| Some((node.name.as_str(), node.source.as_ref()?)))
    }

    pub(crate) fn faults(&self, faults: Vec<Diagnostic>) -> Diagnostics {
        self.document.faults(faults)
    }

    /// Types, keys, paths: what a stage knows from those before it.
    fn resolve(&mut self, declarations: &[&Declaration], spelling: &Spelling, faults: &mut Vec<Diagnostic>) {
        let mut unconnected = Vec::new();
        let mut unfit = Vec::new();
        for place in 0..self.nodes.len() {
            let declaration = declarations[place];
            if self.nodes[place].kind.is_none() {
                continue;
            }
            let ports = self.nodes[place].ports.clone();
            // An edge from a later stage belongs to a cycle, which has been told.
            let edges = &self.nodes[place].edges;
            let sound = ports.is_empty()
                || edges.iter().all(|edge| edge.from < place && edge.port.is_some())
                    && !matches!(declaration.input, Key::Faulty)
                    && !matches!(declaration.inputs, Key::Faulty)
                    && edges.len() == named(declaration);
            let mut whole = sound;
            for (index, port) in ports.iter().enumerate() {
                let open = self.nodes[place].edges.iter().all(|edge| edge.port != Some(index));
                if sound && open && !port.optional {
                    unconnected.push((place, index));
                    whole = false;
                }
            }
            let types = self.types(place, &ports, &mut unfit);
            let node = &self.nodes[place];
            let product = match (&node.configured, types) {
                (Some(configured), Some(types)) if whole => {
                    let types: Vec<_> = types.iter().map(|(port, made)| (port.as_str(), *made)).collect();
                    for (name, message) in configured.check_inputs(&types) {
                        let entry = declaration.parameters.get(name);
                        let span = entry.map_or(node.header.clone(), |entry| entry.value.span.clone());
                        faults.push(Diagnostic::at(span, message));
                    }
                    Some(configured.product(&types))
                }
                _ => None,
            };
            let keys = if whole { self.keys(place, &ports, declaration, spelling, faults) } else { None };
            let template = self.template(place, &keys, product.as_ref(), declaration, spelling, faults);
            let node = &mut self.nodes[place];
            (node.product, node.keys, node.template) = (product, keys, template);
        }
        let unconnected = unconnected.into_iter().map(|(place, index)| self.unconnected(place, index));
        let unfit = unfit.into_iter().map(|(place, edge)| self.unfit(place, edge));
        let mut unfed = unconnected.chain(unfit).collect::<Vec<_>>();
        // Who could feed them is looked for among all stages: for those alone that can be among the first.
        unfed.sort_by_key(|(_, _, fault)| fault.span.as_ref().map(|span| span.start));
        let helped = unfed.into_iter().enumerate().map(|(index, (place, port, fault))| match index {
            ..Diagnostics::SHOWN => fault.help(self.makers(place, &self.nodes[place].ports[port])),
            _ => fault,
        });
        faults.extend(helped);
    }

    /// The types that arrive; `None` where one is unknown or does not fit, which is added to `unfit`.
    fn types(
        &self,
        place: Place,
        ports: &[Port],
        unfit: &mut Vec<(Place, usize)>,
    ) -> Option<Vec<(String, &'static str)>> {
        let mut types = Some(Vec::new());
        for (index, edge) in self.nodes[place].edges.iter().enumerate() {
            let port = edge.port.map(|port| &ports[port]);
            let made = if edge.from < place { self.nodes[edge.from].product.as_ref() } else { None };
            types = match (port, made) {
                (Some(port), Some(Product::Artifact(made))) if port.takes(made) => types.map(|mut types| {
                    types.push((port.name.clone(), *made));
                    types
                }),
                (Some(_), Some(_)) => {
                    unfit.push((place, index));
                    None
                }
                _ => None,
            };
        }
        types
    }

    /// The keys of a stage's items: those of its single ports and its own source, and what `per` keeps besides.
    fn keys(
        &self,
        place: Place,
        ports: &[Port],
        declaration: &Declaration,
        spelling: &Spelling,
        faults: &mut Vec<Diagnostic>,
    ) -> Option<Vec<Place>> {
        let node = &self.nodes[place];
        let (mut kept, mut gathered) = (Vec::new(), Vec::new());
        if node.kind.as_ref()?.has_source() {
            kept.push(place);
        }
        let mut known = true;
        for edge in &node.edges {
            match (&self.nodes[edge.from].keys, ports[edge.port?].many) {
                (Some(keys), false) => kept.extend(keys),
                (Some(keys), true) => gathered.extend(keys),
                (None, _) => known = false,
            }
        }
        let name = |place: &Place| self.nodes[*place].name.as_str();
        let sorted = |mut keys: Vec<Place>| {
            keys.sort_by(|a, b| name(a).cmp(name(b)));
            keys.dedup();
            keys
        };
        let kept = sorted(kept);
        match &declaration.per {
            Key::Absent => known.then_some(kept),
            Key::Faulty => None,
            Key::Given(_) if !ports.iter().any(|port| port.many) => None,
            Key::Given(_) if !known => None,
            Key::Given(per) => {
                let before = faults.len();
                let all = sorted(kept.iter().chain(&gathered).copied().collect());
                let named: HashMap<&str, Place> = all.iter().map(|key| (name(key), *key)).collect();
                let mut chosen = HashSet::new();
                for word in &per.value {
                    match named.get(word.value.as_str()) {
                        Some(key) if !chosen.insert(*key) => faults.push(
                            Diagnostic::at(word.span.clone(), format!("{:?} is there twice", word.value))
                                .expected("expected each key once"),
                        ),
                        Some(_) => {}
                        None => {
                            let message = format!("{:?} is not a key of what arrives here", word.value);
                            let near = spelling.nearest(&word.value, all.iter().map(name));
                            faults.push(unknown(&message, word, all.iter().map(name), near, "no key"));
                        }
                    }
                }
                let lost: Vec<_> = kept.iter().filter(|key| !chosen.contains(*key)).map(name).collect();
                if faults.len() == before && !lost.is_empty() {
                    let message =
                        format!("\"per\" leaves out {}, but a port takes one item of each", listed(lost));
                    let expected = kept.iter().map(|key| format!("{:?}", name(key)));
                    faults.push(
                        Diagnostic::at(per.span.clone(), message)
                            .expected(format!("expected at least {}", listed(expected))),
                    );
                }
                (faults.len() == before).then(|| sorted(chosen.into_iter().collect()))
            }
        }
    }

    fn template(
        &self,
        place: Place,
        keys: &Option<Vec<Place>>,
        product: Option<&Product>,
        declaration: &Declaration,
        spelling: &Spelling,
        faults: &mut Vec<Diagnostic>,
    ) -> Option<Template> {
        let node = &self.nodes[place];
        if let (Some(Product::Artifact(made)), Key::Given(path)) = (product, &declaration.path) {
            let kind = node.kind.as_ref()?.name();
            faults.push(
                Diagnostic::at(path.span.clone(), format!("stage {:?} exports no files", node.name))
                    .expected("expected no \"path\"")
                    .help(format!("{kind} makes {made}, for other stages")),
            );
        }
        let (Product::Files(_), Some(keys)) = (product?, keys) else { return None };
        match &declaration.path {
            Key::Faulty => None,
            Key::Absent => Some(Template::of_stage(&node.name, declaration.name.span.clone(), keys.len())),
            Key::Given(path) => {
                let names: Vec<_> = keys.iter().map(|&key| self.nodes[key].name.as_str()).collect();
                Template::parse(path, &node.name, &names, spelling, faults)
            }
        }
    }

    /// The fault of a port that nothing feeds, with its stage and its index there.
    fn unconnected(&self, place: Place, index: usize) -> (Place, usize, Diagnostic) {
        let node = &self.nodes[place];
        let port = &node.ports[index];
        let expected = match node.ports.as_slice() {
            [_] => "expected input = \"STAGE\"".into(),
            _ => format!("expected inputs = {{ {} = \"STAGE\", ... }}", port.name),
        };
        let message = format!("port {:?} of stage {:?} is not connected", port.name, node.name);
        (place, index, Diagnostic::at(node.header.clone(), message).expected(expected))
    }

    /// The same of a port that the wrong stage feeds.
    fn unfit(&self, place: Place, edge: usize) -> (Place, usize, Diagnostic) {
        let node = &self.nodes[place];
        let edge = &node.edges[edge];
        let index = edge.port.unwrap_or_default();
        let port = &node.ports[index];
        let (from, types) = (&self.nodes[edge.from], port.takes_text());
        let made = match &from.product {
            Some(Product::Artifact(made)) => format!("makes {made}"),
            _ => "exports files".into(),
        };
        let message = format!("port {:?} takes {types}, but stage {:?} {made}", port.name, from.name);
        let fault = Diagnostic::at(edge.span.clone(), message);
        (place, index, fault.expected(format!("expected a stage that makes {types}")))
    }

    /// The stages that could feed a port, for help: not those that need the stage itself.
    fn makers(&self, place: Place, port: &Port) -> String {
        let mut needs = vec![false; self.nodes.len()];
        needs[place] = true;
        // Topological order: the stages that a stage needs have been looked at before it.
        for index in 0..self.nodes.len() {
            needs[index] |= self.nodes[index].edges.iter().any(|edge| needs[edge.from]);
        }
        let makers = self.nodes.iter().zip(&needs).filter(|(node, needs)| {
            let fits = |made: &Product| matches!(made, Product::Artifact(made) if port.takes(made));
            !**needs && node.product.as_ref().is_some_and(fits)
        });
        let names: Vec<_> = makers.map(|(node, _)| &node.name).collect();
        match names.len() {
            0 => format!("no stage makes {}", port.takes_text()),
            1 => format!("stage {:?} makes {}", names[0], port.takes_text()),
            _ => format!("these make {}: {}", port.takes_text(), listed(names)),
        }
    }
}

/// The names of the ports that a stage writes; the short form `input` has none of its own.
fn names(declaration: &Declaration) -> Vec<&str> {
    let short = declaration.input.given().map(|_| "input");
    let named = declaration.inputs.given().map_or(&[][..], |inputs| &inputs.value);
    short.into_iter().chain(named.iter().map(|(port, _)| port.value.as_str())).collect()
}

/// The number of connections that a stage asks for.
fn named(declaration: &Declaration) -> usize {
    let inputs = declaration.inputs.given().map_or(0, |inputs| inputs.value.len());
    inputs + usize::from(declaration.input.given().is_some())
}

fn out_folder(out: &Key<String>, folder: &Path, faults: &mut Vec<Diagnostic>) -> Option<PathBuf> {
    let written = match out {
        Key::Absent => return Some(folder.join("out")),
        Key::Faulty => return None,
        Key::Given(written) => written,
    };
    let plain = written.value.trim_start_matches("./").trim_end_matches('/');
    let fault = |message: String, expected: String| {
        Diagnostic::at(written.span.clone(), message)
            .expected(expected)
            .help("out = \"out\" is a good choice")
    };
    if plain.is_empty() || plain == "." {
        let message = format!("\"out\" is {:?}: not a folder of its own", written.value);
        faults.push(fault(message, "expected a folder below the manifest's, for exports alone".into()));
        return None;
    }
    if let Err(problem) = check(plain, "the manifest's folder") {
        faults
            .push(fault(format!("\"out\" is {:?}: it {}", written.value, problem.message), problem.expected));
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
    faults: &mut Vec<Diagnostic>,
) -> Vec<Node> {
    let places: HashMap<&str, Place> =
        stages.iter().enumerate().map(|(place, stage)| (stage.name.value.as_str(), place)).collect();
    stages
        .iter()
        .map(|stage| {
            let kind = kind(stage, kinds, faults);
            let ports = kind.as_ref().map(|kind| kind.ports_named(&names(stage)));
            Node {
                name: stage.name.value.clone(),
                header: stage.header.clone(),
                configured: kind.as_ref().and_then(|kind| configure(stage, kind.as_ref(), faults)),
                edges: edges(stage, kind.as_deref().zip(ports.as_deref()), &places, stages, spelling, faults),
                ports: ports.unwrap_or_default(),
                source: source(stage, kind.as_deref(), folder, out, faults),
                product: None,
                keys: None,
                template: None,
                kind,
            }
        })
        .collect()
}

fn kind(stage: &Declaration, kinds: &Kinds, faults: &mut Vec<Diagnostic>) -> Option<Arc<dyn ErasedKind>> {
    let written = stage.kind.given()?;
    let kind = kinds.get(&written.value).cloned();
    if kind.is_none() {
        let names: Vec<_> = kinds.iter().map(|kind| kind.name()).collect();
        let near = nearest(&written.value, names.iter().copied());
        let message = format!("there is no kind {:?}", written.value);
        faults.push(unknown(&message, written, names.iter().copied(), near, "no kind"));
    }
    kind
}

fn configure(
    stage: &Declaration,
    kind: &dyn ErasedKind,
    faults: &mut Vec<Diagnostic>,
) -> Option<Arc<dyn Configured>> {
    // Unknown keys are told here rather than by the kind: they may be misspelt keys of the engine.
    let fields: Vec<_> = kind.fields().into_iter().map(|field| field.name).collect();
    let ports = kind.ports_named(&names(stage));
    let used = |key: &&str| match *key {
        "source" => kind.has_source(),
        "input" | "inputs" => !ports.is_empty(),
        "per" => ports.iter().any(|port| port.many),
        _ => true,
    };
    let owned = OWNED.into_iter().filter(used).map(str::to_owned);
    unknown_keys(&stage.parameters, &owned.chain(fields.iter().cloned()).collect::<Vec<_>>(), faults);
    let mut table = Table { span: stage.parameters.span.clone(), entries: stage.parameters.entries.clone() };
    table.entries.retain(|entry| fields.contains(&entry.key));
    kind.configure(&table).map_err(|found| faults.extend(found)).ok()
}

fn source(
    stage: &Declaration,
    kind: Option<&dyn ErasedKind>,
    folder: &Path,
    out: Option<&Path>,
    faults: &mut Vec<Diagnostic>,
) -> Option<Source> {
    match (&stage.source, kind) {
        (Key::Given(written), Some(kind)) if !kind.has_source() => {
            let fault = Diagnostic::at(written.span.clone(), format!("{} reads no files", kind.name()));
            let fault = fault.expected("expected no \"source\"");
            faults.push(match kind.ports().first() {
                Some(port) => fault.help(format!("it takes {} by input = \"STAGE\"", port.takes_text())),
                None => fault,
            });
            None
        }
        (Key::Given(written), _) => Source::parse(written, folder, out, faults),
        (Key::Absent, Some(kind)) if kind.has_source() => {
            let message = format!("stage {:?} has no source", stage.name.value);
            let fault = Diagnostic::at(stage.header.clone(), message);
            faults.push(fault.expected("expected source = \"...\", a file, a folder or a glob"));
            None
        }
        _ => None,
    }
}

fn edges(
    stage: &Declaration,
    kind: Option<(&dyn ErasedKind, &[Port])>,
    places: &HashMap<&str, Place>,
    stages: &[Declaration],
    spelling: &Spelling,
    faults: &mut Vec<Diagnostic>,
) -> Vec<Edge> {
    let ports = kind.map_or(&[][..], |(_, ports)| ports);
    let mut edges = Vec::new();
    if let Some((kind, [])) = kind {
        let given = stage.input.given().map(|input| &input.span);
        if let Some(span) = given.or(stage.inputs.given().map(|inputs| &inputs.span)) {
            let fault = Diagnostic::at(span.clone(), format!("{} takes no input", kind.name()));
            let fault = fault.expected("expected no \"input\"");
            faults.push(if kind.has_source() {
                fault.help("it reads files: source = \"...\"")
            } else {
                fault
            });
            return edges;
        }
    }
    if let (Key::Given(per), Some((kind, ports))) = (&stage.per, kind)
        && !ports.iter().any(|port| port.many)
    {
        let fault = Diagnostic::at(per.span.clone(), format!("{} gathers nothing", kind.name()));
        faults.push(
            fault
                .expected("expected no \"per\"")
                .help("\"per\" is for kinds with a port that takes many items"),
        );
    }
    let mut connect = |port: Option<usize>, from: &Written<String>| match places.get(from.value.as_str()) {
        Some(&place) => edges.push(Edge { port, from: place, span: from.span.clone() }),
        None => {
            let names = stages.iter().map(|stage| stage.name.value.as_str());
            let near = spelling.nearest(&from.value, names.clone());
            faults.push(unknown(
                &format!("there is no stage {:?}", from.value),
                from,
                names,
                near,
                "no stage",
            ));
        }
    };
    if let Key::Given(input) = &stage.input {
        connect(kind.map(|_| 0), input);
    }
    let mut unknown_ports = Vec::new();
    let names = ports.iter().map(|port| port.name.as_str());
    // Of two with one name the first is meant.
    let named: HashMap<&str, usize> =
        names.clone().enumerate().map(|(place, name)| (name, place)).rev().collect();
    for (port, from) in stage.inputs.given().map_or(&[][..], |inputs| &inputs.value) {
        let place = named.get(port.value.as_str()).copied();
        if let (None, Some((kind, _))) = (place, kind) {
            let message = format!("{} has no port {:?}", kind.name(), port.value);
            let near = spelling.nearest(&port.value, names.clone());
            unknown_ports.push(unknown(&message, port, names.clone(), near, "no port"));
        }
        connect(place, from);
    }
    faults.append(&mut unknown_ports);
    edges.sort_by_key(|edge| edge.port);
    edges
}

/// The fault of a word that is none of some names.
fn unknown<'n>(
    message: &str,
    word: &Written<String>,
    names: impl ExactSizeIterator<Item = &'n str>,
    near: Option<&str>,
    none: &str,
) -> Diagnostic {
    let fault = Diagnostic::at(word.span.clone(), message);
    let fault = match names.len() {
        0 => fault.expected(format!("expected {none}")),
        _ => fault.expected(format!("expected one of: {}", listed(names))),
    };
    match near {
        Some(near) => fault.help(format!("did you mean {near:?}?")),
        None => fault,
    }
}
