//! Elements of MaterialX: their lines, connections and values.

use roxmltree::Node;

use crate::error::Error;

/// The line of an element in its file, from 1 on.
pub(super) fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// An element in a message: its name, or its tag if it has none.
pub(super) fn named(node: Node<'_, '_>) -> String {
    match node.attribute("name") {
        Some(name) => format!("{name:?}"),
        None => format!("<{}>", node.tag_name().name()),
    }
}

/// The input of this name.
fn input<'a, 'd>(node: Node<'a, 'd>, name: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| child.has_tag_name("input") && child.attribute("name") == Some(name))
}

/// The child of this name, which may have any tag but one.
fn child<'a, 'd>(scope: Node<'a, 'd>, name: &str, not: &str) -> Option<Node<'a, 'd>> {
    let mut named = scope.children().filter(|child| child.attribute("name") == Some(name));
    named.find(|child| !child.has_tag_name(not))
}

/// The node that an input is connected to, with the tag of what is missing if there is none.
fn connected<'a, 'd>(input: Node<'a, 'd>) -> Option<Result<Node<'a, 'd>, String>> {
    let root = input.document().root_element();
    // Names are those of the graph that the input's node is in.
    let scope = input.ancestors().find(|above| above.has_tag_name("nodegraph")).unwrap_or(root);
    if let Some(name) = input.attribute("nodename") {
        let found = child(scope, name, "output").or_else(|| child(root, name, "output"));
        return Some(found.ok_or_else(|| format!("a node {name:?}")));
    }
    let graph = input.attribute("nodegraph")?;
    let Some(graph) =
        root.children().find(|node| node.has_tag_name("nodegraph") && node.attribute("name") == Some(graph))
    else {
        return Some(Err(format!("a nodegraph {graph:?}")));
    };
    let mut outputs = graph.children().filter(|node| node.has_tag_name("output"));
    let output = match input.attribute("output") {
        Some(name) => outputs.find(|output| output.attribute("name") == Some(name)),
        None => outputs.next(),
    };
    let inner = output.and_then(|output| output.attribute("nodename"));
    Some(inner.and_then(|name| child(graph, name, "output")).ok_or_else(|| "the graph's output".into()))
}

/// The surface shader that a material names.
pub(super) fn surface_shader<'a, 'd>(material: Node<'a, 'd>) -> Result<Node<'a, 'd>, Error> {
    let wrong = |what: String| Error::damaged(format!("line {}: {what}", line(material)));
    let found = input(material, "surfaceshader").and_then(connected);
    match found {
        None => Err(wrong(format!("{} has no surface shader", named(material)))),
        Some(Err(missing)) => Err(wrong(format!(
            "the surface shader of {} is {missing}, which does not exist",
            named(material)
        ))),
        Some(Ok(shader)) => Ok(shader),
    }
}

/// What an input says.
pub(super) enum Said<'a> {
    /// A value, as it is written, and the space of its colour.
    Value(&'a str, Option<&'a str>),
    /// Nothing: the default counts.
    Nothing,
    /// The result of a node that is not read, in words.
    Node(String),
}

/// How many nodes a value is followed through.
const DEEPEST: usize = 16;

/// What an input says, through nodes that pass a value on.
pub(super) fn said<'a>(mut input: Node<'a, '_>) -> Said<'a> {
    for _ in 0..DEEPEST {
        if let Some(value) = input.attribute("value") {
            let space = input.ancestors().find_map(|node| node.attribute("colorspace"));
            return Said::Value(value, space);
        }
        let node = match connected(input) {
            None if input.attribute("interfacename").is_some() => {
                return Said::Node("an input of its graph".into());
            }
            None => return Said::Nothing,
            Some(Err(missing)) => return Said::Node(format!("{missing}, which does not exist")),
            Some(Ok(node)) => node,
        };
        let passed_on = match node.tag_name().name() {
            "constant" => self::input(node, "value"),
            "dot" => self::input(node, "in"),
            _ => None,
        };
        match passed_on {
            Some(next) => input = next,
            None => return Said::Node(format!("<{}> {}", node.tag_name().name(), named(node))),
        }
    }
    Said::Node("a long chain of nodes".into())
}
