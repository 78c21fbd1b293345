//! The page: a lane for each worker, the critical path, the slowest kinds, every item. It needs no script and no other
//! file; a bar says what it is when it is pointed at, and leads to its item's row.

use std::fmt::Write;

use containers::escape_html as escape;
use engine::Work;

use super::bars::{Bar, Look, Mark, bars};
use super::trace::{category, outcome};
use super::{Fate, Index, Nanoseconds, Timeline, WorkSpan};
use crate::quantity;

/// The height of a bar and the space below it, in pixels.
const ROW: usize = 22;

/// So much of the width is enough for a name.
const ROOM: f64 = 4.0;

/// At most so many items of a bar are named when it is pointed at.
const NAMED: usize = 12;

/// The whole page.
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
    let work: Nanoseconds = (0..timeline.workers()).map(|worker| timeline.busy(worker)).sum();
    let available = total * timeline.workers().max(1) as u64;
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
        ("workers busy with items", percent(work, available)),
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
        "<p class=\"soft\">An item that waits for others to share its work lets its worker take on another item: that one \
         is drawn below it. Workers without an item of their own help those that have one, which is not drawn.</p>\n",
    );
    html.push_str("<ul class=\"legend\">\n");
    for look in
        [Look::Ran, Look::Same, Look::Failed, Look::Stopped, Look::Fetch, Look::Publish, Look::Current]
    {
        let (class, meaning) = described(look);
        if look != Look::Publish {
            let _ = writeln!(html, "<li><i class=\"{class}\"></i>{meaning}</li>");
        }
    }
    html.push_str("</ul>\n<div class=\"timeline\">\n");
    for worker in 0..timeline.workers() {
        let spells = timeline.spells.iter().filter(|spell| spell.worker == worker).collect::<Vec<_>>();
        let rows = spells.iter().map(|spell| spell.depth + 1).max().unwrap_or(1);
        let busy = percent(timeline.busy(worker), total);
        lane(&format!("worker {worker} <span>{busy}</span>"), rows, html, |html| {
            for depth in 0..rows {
                let row =
                    spells.iter().filter(|spell| spell.depth == depth).map(|spell| mark(timeline, spell));
                draw(timeline, &bars(row, total), depth, html);
            }
        });
    }
    let current = timeline.fates.iter().enumerate().filter_map(|(item, fate)| match fate {
        Fate::Current(time) => Some(Mark { item, start: *time, end: *time, look: Look::Current }),
        _ => None,
    });
    let mut current = current.collect::<Vec<_>>();
    current.sort_by_key(|mark| mark.start);
    if !current.is_empty() {
        let name = format!("up to date <span>{}</span>", current.len());
        lane(&name, 1, html, |html| draw(timeline, &bars(current, total), 0, html));
    }
    html.push_str("<div class=\"axis\">");
    for tick in ticks(total) {
        let _ = write!(html, "<span style=\"left:{}%\">{}</span>", share(tick, total), time(tick));
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
        let (class, _) = described(bar.look);
        let first = bar.marks[0].item;
        let label = match bar.marks.as_slice() {
            [mark] if width >= ROOM => format!("<b>{}</b>", escape(&timeline.nodes[mark.item].name)),
            _ => String::new(),
        };
        let _ = writeln!(
            html,
            "<a class=\"bar {class}\" href=\"#item-{first}\" style=\"left:{left}%;width:{width}%;top:{top}px\" \
             title=\"{}\">{label}</a>",
            escape(&told(timeline, bar))
        );
    }
}

/// What is said of a bar that is pointed at.
fn told(timeline: &Timeline, bar: &Bar) -> String {
    let name = |mark: &Mark| timeline.nodes[mark.item].name.as_str();
    let took = |mark: &Mark| time(mark.end - mark.start);
    if let [mark] = bar.marks.as_slice() {
        let why = match mark.look {
            Look::Current | Look::Fetch | Look::Publish => String::new(),
            _ => format!("; because: {}", timeline.reasons[mark.item]),
        };
        let took = if mark.look == Look::Current { String::new() } else { format!(", {}", took(mark)) };
        return format!("{}: {}{took}, at {}{why}", name(mark), described(mark.look).1, time(mark.start));
    }
    let mut text = format!("{} items between {} and {}: ", bar.marks.len(), time(bar.start), time(bar.end));
    let named = bar.marks.iter().take(NAMED).map(|mark| match mark.look {
        Look::Current => name(mark).to_owned(),
        _ => format!("{} {}", name(mark), took(mark)),
    });
    text += &named.collect::<Vec<_>>().join("; ");
    if bar.marks.len() > NAMED { text + "; ..." } else { text }
}

fn mark(timeline: &Timeline, spell: &WorkSpan) -> Mark {
    let look = match (spell.work, &timeline.fates[spell.item]) {
        (Work::Fetch, _) => Look::Fetch,
        (Work::Publish, _) => Look::Publish,
        (Work::Run, Fate::Failed(_)) => Look::Failed,
        (Work::Run, Fate::Ran { changed: false }) => Look::Same,
        (Work::Run, Fate::Ran { .. } | Fate::Current(_)) => Look::Ran,
        (Work::Run, _) => Look::Stopped,
    };
    Mark { item: spell.item, start: spell.start, end: spell.end, look }
}

/// A bar's class, and what it means.
fn described(look: Look) -> (&'static str, &'static str) {
    match look {
        Look::Current => ("current", "up to date: in the cache, or published from it"),
        Look::Fetch => ("fetch", "read from the cache for those that need it"),
        Look::Publish => ("publish", "published from the cache"),
        Look::Same => ("same", "ran, with the same result as before"),
        Look::Ran => ("ran", "ran"),
        Look::Stopped => ("stopped", "stopped"),
        Look::Failed => ("failed", "failed"),
    }
}

fn critical_path(timeline: &Timeline, html: &mut String) {
    let (path, _) = timeline.critical_path();
    if path.is_empty() {
        return;
    }
    let costs = timeline.costs();
    html.push_str("<h2>Critical path</h2>\n<p class=\"soft\">Of all chains of items that need each other, the one that took ");
    html.push_str(
        "longest: more workers shorten the build only as far as they share the work of these.</p>\n",
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
        "<h2>Every item</h2>\n<div class=\"scroll\"><table>\n<tr><th>item</th><th>kind</th><th>what</th>",
    );
    html.push_str(
        "<th class=\"number\">began</th><th class=\"number\">took</th><th class=\"number\">own time</th>",
    );
    html.push_str("<th class=\"number\">worker</th><th>why</th></tr>\n");
    let mut spells = vec![Vec::new(); timeline.nodes.len()];
    for spell in &timeline.spells {
        spells[spell.item].push(spell);
    }
    for (item, (fate, mut spells)) in timeline.fates.iter().zip(spells).enumerate() {
        if *fate == Fate::Untouched && spells.is_empty() {
            continue;
        }
        spells.sort_by_key(|spell| spell.start);
        let run = spells.iter().rfind(|spell| spell.work == Work::Run);
        row(timeline, item, fate, run.copied(), html);
        for spell in spells.iter().filter(|spell| spell.work != Work::Run) {
            let _ = writeln!(
                html,
                "<tr><td></td><td></td><td class=\"soft\">{}</td>{}<td></td></tr>",
                category(spell.work),
                times(Some(spell))
            );
        }
    }
    html.push_str("</table></div>\n");
}

fn row(timeline: &Timeline, item: Index, fate: &Fate, run: Option<&WorkSpan>, html: &mut String) {
    let node = &timeline.nodes[item];
    let why = match fate {
        Fate::Failed(error) => error.as_str(),
        Fate::Skipped(Some(failed)) => &format!("{failed} failed"),
        _ => &timeline.reasons[item],
    };
    let class = if matches!(fate, Fate::Failed(_)) { " class=\"bad\"" } else { "" };
    let _ = writeln!(
        html,
        "<tr id=\"item-{item}\"{class}><td>{}</td><td>{}</td><td>{}</td>{}<td>{}</td></tr>",
        escape(&node.name),
        escape(&node.kind),
        outcome(fate),
        times(run),
        escape(why)
    );
}

/// When something began, how long it took, how much of that was its own, and who did it.
fn times(spell: Option<&WorkSpan>) -> String {
    let cells = match spell {
        Some(spell) => {
            [time(spell.start), time(spell.end - spell.start), time(spell.own), spell.worker.to_string()]
        }
        None => Default::default(),
    };
    cells.map(|cell| format!("<td class=\"number\">{cell}</td>")).concat()
}

fn share_cell(part: Nanoseconds, whole: Nanoseconds) -> String {
    format!("<td class=\"share\"><i class=\"ran\" style=\"width:{}%\"></i></td>", share(part, whole))
}

/// Percent, to a thousandth of one.
fn share(part: Nanoseconds, whole: Nanoseconds) -> f64 {
    (part as f64 * 1e5 / whole.max(1) as f64).round() / 1e3
}

fn percent(part: Nanoseconds, whole: Nanoseconds) -> String {
    format!("{:.0} %", part as f64 * 100.0 / whole.max(1) as f64)
}

fn time(nanoseconds: Nanoseconds) -> String {
    quantity::duration(nanoseconds as f64 / 1e6)
}

/// Round times along the axis, some ten of them.
fn ticks(total: Nanoseconds) -> Vec<Nanoseconds> {
    let decade = |power: u32| 10u64.pow(power);
    let steps = (0..19).flat_map(|power| [1, 2, 5].map(|digit| digit * decade(power)));
    let step = steps.into_iter().find(|step| total / step <= 10).unwrap_or(total.max(1));
    (0..=total / step).map(|count| count * step).filter(|tick| tick * 100 < total * 98).collect()
}
