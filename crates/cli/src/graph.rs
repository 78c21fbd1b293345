//! `specula graph`: the stages and their connections, as Mermaid or DOT.

use engine::{Kinds, Plan, Product};

use crate::arguments::{GraphArguments, GraphFormat};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::quantity::count;
use crate::{manifest, print};

pub(crate) fn run(arguments: &GraphArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let plan = manifest::load(&arguments.manifest, kinds)?;
    Ok(print::data(&draw(&plan, arguments.format)))
}

/// The graph as text; stages that export files have a different shape.
fn draw(plan: &Plan, format: GraphFormat) -> String {
    let counts = plan.items.iter().fold(vec![0_usize; plan.stages.len()], |mut counts, item| {
        counts[item.stage] += 1;
        counts
    });
    let mut text = String::from(match format {
        GraphFormat::Mermaid => "flowchart LR\n",
        GraphFormat::Dot => "digraph pipeline {\n  rankdir=LR;\n  node [fontname=\"sans-serif\"];\n",
    });
    for (index, stage) in plan.stages.iter().enumerate() {
        let (name, kind) = (&stage.name, stage.kind.name());
        let items = count(counts[index], "item");
        let exports = matches!(stage.product, Product::Files(_));
        text += &match format {
            GraphFormat::Mermaid if exports => {
                format!("  s{index}[/\"{name}<br/><i>{kind}</i><br/>{items}\"/]\n")
            }
            GraphFormat::Mermaid => format!("  s{index}[\"{name}<br/><i>{kind}</i><br/>{items}\"]\n"),
            GraphFormat::Dot => {
                let shape = if exports { "note" } else { "box" };
                format!("  s{index} [shape={shape}, label=\"{name}\\n{kind}\\n{items}\"];\n")
            }
        };
    }
    for (index, stage) in plan.stages.iter().enumerate() {
        for (port, from) in &stage.inputs {
            text += &match format {
                GraphFormat::Mermaid => format!("  s{from} -->|\"{port}\"| s{index}\n"),
                GraphFormat::Dot => format!("  s{from} -> s{index} [label=\"{port}\"];\n"),
            };
        }
    }
    if let GraphFormat::Dot = format {
        text += "}\n";
    }
    text
}
