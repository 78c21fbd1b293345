//! The page: a lane for each worker, the critical path, the slowest kinds, every item. It needs no script and
//! no other file; a bar has a tooltip, and links to the row of its item.

use std::fmt::Write;

use containers::escape_html as escape;
use engine::Work;

use super::bars::{Bar, BarStyle, Mark, bars};
use super::timeline::{Index, ItemOutcome, Nanoseconds, Timeline, WorkSpan};
use super::trace::{category, describe};
use crate::lists::list;
use crate::quantity::{self, percent};

/// The height of a bar and the space below it, in pixels.
const ROW: usize = 22;

/// The share of the width that has room for a name, in percent.
const ROOM: f64 = 4.0;

/// At most this many items of a bar are named in its tooltip.
const NAMED: usize = 12;

/// The whole page as HTML.
pub(super) fn page(timeline: &Timeline) -> String {
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n");
    html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n";
    let manifest = escape(&timeline.manifest);
    let _ =
        write!(html, "<title>Build of {manifest}</title>\n<style>\n{}</style>\n", include_str!("style.css"));
    let _ = writeln!(html, "</head>\n<body>\n<h1>Build of {manifest}</h1>");
    facts(timeline, &mut html);
    lanes(timeline, &mut html);
    critical_path(timeline, &mut html);
    kinds(timeline, &mut html);
    items(timeline, &mut html);
    html + "</body>\n</html>\n"
}

fn facts(timeline: &Timeline, html: &mut String) {
    let summary = &timeline.summary;
    let _ = writeln!(
        html,
        "<p class=\"soft\">{}{}</p>",
        timeline.began,
        match summary.cancelled {
            true => "; stopped before the end",
            false => "",
        }
    );
    let total = timeline.total();
    let workers = timeline.workers();
    let work: Nanoseconds = workers.iter().map(|(worker, _)| timeline.busy(*worker)).sum();
    let available = total * workers.len().max(1) as u64;
    let mut counts = vec![format!("{} ran", summary.ran), format!("{} up to date", summary.up_to_date)];
    for (count, word) in [(summary.failed, "failed"), (summary.skipped, "not run")] {
        if count > 0 {
            counts.push(format!("{count} {word}"));
        }
    }
    let facts = [
        ("total", time(total)),
        ("items", counts.join(", ")),
        ("work on items", time(work)),
        ("workers busy", percent(work, available)),
        ("critical path", time(timeline.critical_path().1)),
    ];
    html.push_str("<dl class=\"facts\">\n");
    for (name, value) in facts {
        let _ = writeln!(html, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    html.push_str("</dl>\n");
}

fn lanes(timeline: &Timeline, html: &mut String) {
    let total = timeline.total().max(1);
    html.push_str("<h2>What the workers did</h2>\n");
    html.push_str(
        "<p class=\"soft\">While an item waits for other workers that share its work, its worker may run \
         another item, which is drawn below it. Idle workers help with the items of others; this is not \
         drawn.</p>\n",
    );
    html.push_str("<ul class=\"legend\">\n");
    for style in [
        BarStyle::Ran,
        BarStyle::Same,
        BarStyle::Failed,
        BarStyle::Stopped,
        BarStyle::Fetch,
        BarStyle::UpToDate,
    ] {
        let (class, meaning) = described(style);
        let _ = writeln!(html, "<li><i class=\"{class}\"></i>{meaning}</li>");
    }
    html.push_str("</ul>\n<div class=\"timeline\">\n");
    for (worker, name) in timeline.workers() {
        let spans = timeline.spans.iter().filter(|span| span.worker == worker).collect::<Vec<_>>();
        let rows = spans.iter().map(|span| span.depth + 1).max().unwrap_or(1);
        let busy = percent(timeline.busy(worker), total);
        lane(&format!("{} <span>{busy}</span>", escape(&name)), rows, html, |html| {
            for depth in 0..rows {
                let row = spans.iter().filter(|span| span.depth == depth).map(|span| mark(timeline, span));
                draw(timeline, &bars(row, total), depth, html);
            }
        });
    }
    let current = timeline.outcomes.iter().enumerate().filter_map(|(item, outcome)| match outcome {
        ItemOutcome::UpToDate(time) => {
            Some(Mark { item, start: *time, end: *time, style: BarStyle::UpToDate })
        }
        _ => None,
    });
    let mut current = current.collect::<Vec<_>>();
    current.sort_by_key(|mark| mark.start);
    if !current.is_empty() {
        let name = format!("up to date <span>{}</span>", current.len());
        lane(&name, 1, html, |html| draw(timeline, &bars(current, total), 0, html));
    }
    html.push_str("<div class=\"axis\">");
    for tick in quantity::ticks(total, 10).filter(|tick| tick * 100 < total * 98) {
        let _ = write!(html, "<span style=\"left:{}%\">{}</span>", share(tick, total), round(tick));
    }
    html.push_str("</div>\n</div>\n");
}

fn lane(name: &str, rows: usize, html: &mut String, draw: impl FnOnce(&mut String)) {
    let height = rows * ROW;
    let _ = writeln!(
        html,
        "<div class=\"lane\"><div class=\"who\">{name}</div><div class=\"track\" style=\"height:{height}px\">"
    );
    draw(html);
    html.push_str("</div></div>\n");
}

fn draw(timeline: &Timeline, bars: &[Bar], depth: usize, html: &mut String) {
    let total = timeline.total().max(1);
    for bar in bars {
        let (left, width) = (share(bar.start, total), share(bar.end - bar.start, total));
        let top = depth * ROW + 1;
        let (class, _) = described(bar.style);
        let first = bar.marks[0].item;
        let label = match bar.marks.as_slice() {
            [mark] if width >= ROOM => format!("<b>{}</b>", escape(&timeline.nodes[mark.item].name)),
            _ => String::new(),
        };
        let _ = writeln!(
            html,
            "<a class=\"bar {class}\" href=\"#item-{first}\" style=\"left:{left}%;width:{width}%;top:{top}px\" \
             title=\"{}\">{label}</a>",
            escape(&tooltip(timeline, bar))
        );
    }
}

/// The tooltip of a bar: what it stands for.
fn tooltip(timeline: &Timeline, bar: &Bar) -> String {
    let name = |mark: &Mark| timeline.nodes[mark.item].name.as_str();
    let took = |mark: &Mark| time(mark.end - mark.start);
    if let [mark] = bar.marks.as_slice() {
        let why = match mark.style {
            BarStyle::UpToDate | BarStyle::Fetch | BarStyle::Publish => String::new(),
            _ => format!("; because: {}", timeline.reasons[mark.item]),
        };
        let took = if mark.style == BarStyle::UpToDate { String::new() } else { format!(", {}", took(mark)) };
        return format!("{}: {}{took}, at {}{why}", name(mark), described(mark.style).1, time(mark.start));
    }
    let names = bar.marks.iter().map(|mark| match mark.style {
        BarStyle::UpToDate => name(mark).to_owned(),
        _ => format!("{} {}", name(mark), took(mark)),
    });
    let names = list(&names.collect::<Vec<_>>(), "; ", NAMED);
    format!("{} items between {} and {}: {names}", bar.marks.len(), time(bar.start), time(bar.end))
}

fn mark(timeline: &Timeline, span: &WorkSpan) -> Mark {
    let style = match (span.work, &timeline.outcomes[span.item]) {
        (Work::Fetch, _) => BarStyle::Fetch,
        (Work::Publish, _) => BarStyle::Publish,
        (Work::Run, ItemOutcome::Failed { .. }) => BarStyle::Failed,
        (Work::Run, ItemOutcome::Ran { changed: false }) => BarStyle::Same,
        (Work::Run, ItemOutcome::Ran { .. } | ItemOutcome::UpToDate(_)) => BarStyle::Ran,
        (Work::Run, _) => BarStyle::Stopped,
    };
    Mark { item: span.item, start: span.start, end: span.end, style }
}

/// A bar's class, and what it means.
fn described(style: BarStyle) -> (&'static str, &'static str) {
    match style {
        BarStyle::UpToDate => ("current", "up to date: in the cache, or published from it"),
        BarStyle::Fetch => ("fetch", "read from the cache for items that need it"),
        BarStyle::Publish => ("publish", "published from the cache"),
        BarStyle::Same => ("same", "ran, same result as before"),
        BarStyle::Ran => ("ran", "ran"),
        BarStyle::Stopped => ("stopped", "stopped"),
        BarStyle::Failed => ("failed", "failed"),
    }
}

fn critical_path(timeline: &Timeline, html: &mut String) {
    let (path, _) = timeline.critical_path();
    if path.is_empty() {
        return;
    }
    let costs = timeline.costs();
    html.push_str(
        "<h2>Critical path</h2>\n<p class=\"soft\">Of all chains of items that need each other, the ",
    );
    html.push_str(
        "slowest: more workers can shorten the build only by sharing the work of these items.</p>\n",
    );
    html.push_str("<div class=\"scroll\"><table>\n<tr><th>item</th><th>kind</th><th class=\"number\">own time</th><th></th></tr>\n");
    let most = path.iter().map(|item| costs[*item]).max().unwrap_or(0);
    for item in path {
        let node = &timeline.nodes[item];
        let _ = writeln!(
            html,
            "<tr><td><a href=\"#item-{item}\">{}</a></td><td>{}</td><td class=\"number\">{}</td>{}</tr>",
            escape(&node.name),
            escape(&node.kind),
            time(costs[item]),
            share_cell(costs[item], most)
        );
    }
    html.push_str("</table></div>\n");
}

fn kinds(timeline: &Timeline, html: &mut String) {
    let kinds = timeline.kinds();
    if kinds.is_empty() {
        return;
    }
    html.push_str("<h2>Slowest kinds</h2>\n<div class=\"scroll\"><table>\n<tr><th>kind</th><th class=\"number\">runs</th>");
    html.push_str("<th class=\"number\">own time</th><th class=\"number\">longest</th><th></th></tr>\n");
    let most = kinds[0].2;
    for (kind, runs, all, longest) in kinds {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"number\">{runs}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>{}</tr>",
            escape(kind),
            time(all),
            time(longest),
            share_cell(all, most)
        );
    }
    html.push_str("</table></div>\n");
}

fn items(timeline: &Timeline, html: &mut String) {
    html.push_str(
        "<h2>Every item</h2>\n<div class=\"scroll\"><table>\n<tr><th>item</th><th>kind</th><th>outcome</th>",
    );
    html.push_str(
        "<th class=\"number\">began</th><th class=\"number\">took</th><th class=\"number\">own time</th>",
    );
    html.push_str("<th class=\"number\">worker</th><th>why</th></tr>\n");
    let mut spans = vec![Vec::new(); timeline.nodes.len()];
    for span in &timeline.spans {
        spans[span.item].push(span);
    }
    for (item, (outcome, mut spans)) in timeline.outcomes.iter().zip(spans).enumerate() {
        if *outcome == ItemOutcome::NotReached && spans.is_empty() {
            continue;
        }
        spans.sort_by_key(|span| span.start);
        let run = spans.iter().rfind(|span| span.work == Work::Run);
        row(timeline, item, outcome, run.copied(), html);
        for span in spans.iter().filter(|span| span.work != Work::Run) {
            let _ = writeln!(
                html,
                "<tr><td></td><td></td><td class=\"soft\">{}</td>{}<td></td></tr>",
                category(span.work),
                times(Some(span))
            );
        }
    }
    html.push_str("</table></div>\n");
}

fn row(timeline: &Timeline, item: Index, outcome: &ItemOutcome, run: Option<&WorkSpan>, html: &mut String) {
    let node = &timeline.nodes[item];
    let why = match outcome {
        ItemOutcome::Failed { error, .. } => error.as_str(),
        ItemOutcome::Skipped(Some(failed)) => &format!("{failed} failed"),
        _ => &timeline.reasons[item],
    };
    let class = if matches!(outcome, ItemOutcome::Failed { .. }) { " class=\"bad\"" } else { "" };
    let _ = writeln!(
        html,
        "<tr id=\"item-{item}\"{class}><td>{}</td><td>{}</td><td>{}</td>{}<td>{}</td></tr>",
        escape(&node.name),
        escape(&node.kind),
        describe(outcome),
        times(run),
        escape(why)
    );
}

/// When a span began, how long it took, its own time, and its worker.
fn times(span: Option<&WorkSpan>) -> String {
    let cells = match span {
        Some(span) => {
            [time(span.start), time(span.end - span.start), time(span.own), span.worker.to_string()]
        }
        None => Default::default(),
    };
    cells.map(|cell| format!("<td class=\"number\">{cell}</td>")).concat()
}

fn share_cell(part: Nanoseconds, whole: Nanoseconds) -> String {
    format!("<td class=\"share\"><i class=\"ran\" style=\"width:{}%\"></i></td>", share(part, whole))
}

/// A share in percent, rounded to a thousandth of a percent.
fn share(part: Nanoseconds, whole: Nanoseconds) -> f64 {
    (part as f64 * 1e5 / whole.max(1) as f64).round() / 1e3
}

/// A round duration, without decimals that say nothing.
fn round(nanoseconds: Nanoseconds) -> String {
    time(nanoseconds).replace(".00 ", " ").replace(".0 ", " ")
}

fn time(nanoseconds: Nanoseconds) -> String {
    quantity::duration(nanoseconds as f64 / 1e6)
}
