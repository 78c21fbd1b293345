//! The section of a report's page on light probes: where they stand, from above and from a side, and what
//! leaks between them.

use containers::escape_html as escape;
use probes::{Leak, ProbePlaces, Repair, Scene};

use crate::picture::report::markup::Markup;
use crate::picture::report::probe_figures::{ProbeFigures, RepairedProbe};
use crate::values::percent;

/// The width of a picture, and the greatest height.
const WIDTH: f32 = 600.0;
const HEIGHT: f32 = 900.0;

/// The most triangles whose edges are drawn: the longest ones.
const MOST_WALLS: usize = 4000;

/// The most leaks that are drawn: the worst ones.
const MOST_LEAKS: usize = 200;

/// The share of a leak's weight below which it is not drawn.
const LEAST_SHARE: f32 = 0.01;

/// The rows of the table of repaired probes.
const MOST_ROWS: usize = 100;

/// What is drawn beside the figures.
pub(crate) struct ProbePicture<'a> {
    pub(crate) places: &'a ProbePlaces,
    pub(crate) scene: Option<&'a Scene>,
    /// What leaks in three.js, the worst first.
    pub(crate) leaks: Vec<Leak>,
}

/// A projection along an axis.
#[derive(Clone, Copy)]
struct View {
    /// The axes of the picture to the right and up, and the one along which it looks.
    axes: [usize; 3],
    /// The least and the greatest coordinates that are seen, in metres.
    bounds: [[f32; 3]; 2],
    /// Units of the picture a metre.
    scale: f32,
}

/// The section.
pub(crate) fn section(page: &mut Markup, is_first: bool, figures: &ProbeFigures, picture: &ProbePicture<'_>) {
    let count = picture.places.volumes().len();
    let volumes = if count == 1 { "a volume".to_owned() } else { format!("{count} volumes") };
    let class = if is_first { " class=\"first\"" } else { "" };
    page.put(format_args!("<h2{class} id=\"probes\">Where the probes stand</h2>\n"));
    page.put(format_args!("<p>{} probes in {volumes}", figures.probes));
    match picture.places.scattered() {
        0 => {}
        points => page.put(format_args!(", {points} of them at points")),
    }
    page.line(". A mark over another one is that of a probe in front of it or behind it.</p>");
    legend(page, figures, picture);
    page.line("<div class=\"probes\">");
    for (title, axes) in [
        ("From above: x to the right, y up", [0, 1, 2]),
        ("From the side of −y: x to the right, z up", [0, 2, 1]),
    ] {
        page.put(format_args!("<figure><figcaption>{title}</figcaption>"));
        draw(page, title, View::of(picture.places, axes), picture);
        page.line("</figure>");
    }
    page.line("</div>");
    leaks(page, figures);
    table(page, figures);
}

fn legend(page: &mut Markup, figures: &ProbeFigures, picture: &ProbePicture<'_>) {
    page.line("<ul class=\"legend\">");
    for (class, count, text) in [
        ("valid", figures.in_place, "where the grid has them"),
        (
            "moved",
            figures.moved,
            "moved out of something, or off a surface; a line leads to the grid's place",
        ),
        ("filled", figures.filled, "inside of something: filled from neighbours"),
        ("lost", figures.lost, "lost: no neighbour reaches them"),
    ] {
        page.put(format_args!(
            "<li><svg class=\"probes\" viewBox=\"-8 -8 16 16\" width=\"16\" height=\"16\" aria-hidden=\"true\">"
        ));
        mark(page, class, [0.0, 0.0], 5.5);
        page.put(format_args!("</svg>{count} {text}</li>\n"));
    }
    if picture.scene.is_some() {
        page.line(
            "<li><svg class=\"probes\" viewBox=\"-8 -8 16 16\" width=\"16\" height=\"16\" aria-hidden=\"true\"><path \
             class=\"leak\" d=\"M-7 5L7 -5\"/></svg>from a probe to a point that takes its light and cannot see it, in \
             three.js</li>",
        );
    }
    page.line("</ul>");
}

fn leaks(page: &mut Markup, figures: &ProbeFigures) {
    let Some(first) = figures.leaks.first() else {
        page.line("<p class=\"small soft\">Connect <code>scene</code> for walls and leaks.</p>");
        return;
    };
    page.put(format_args!(
        "<h3>Leaks</h3><p>The share of a surface's light that comes from probes which cannot see it, at {} points spread \
         evenly over the surfaces: by weight, as if all probes were equally bright.</p>\n<div class=\"scroll\"><table>\
         <thead><tr><th>Blend</th><th class=\"number\">Mean</th><th class=\"number\">Worst point</th></tr></thead><tbody>",
        first.points
    ));
    for own in &figures.leaks {
        let name = own.label;
        page.put(format_args!(
            "<tr><th scope=\"row\">{name}</th><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
            percent(own.mean),
            percent(own.worst)
        ));
    }
    page.line("</tbody></table></div>");
}

fn table(page: &mut Markup, figures: &ProbeFigures) {
    if figures.repaired.is_empty() {
        return;
    }
    // The lost ones first: these are to be looked at.
    let mut all: Vec<&RepairedProbe> = figures.repaired.iter().collect();
    all.sort_by_key(|probe| ["lost", "filled", "moved"].iter().position(|word| *word == probe.repair));
    page.put(format_args!(
        "<details><summary>{} repaired probes</summary><div class=\"scroll\"><table><thead><tr><th \
         class=\"number\">Probe</th><th>Place in the grid, in metres</th><th>Inside of</th><th>Repair</th></tr></thead>\
         <tbody>\n",
        all.len()
    ));
    for probe in all.iter().take(MOST_ROWS) {
        let [x, y, z] = probe.place;
        let inside = probe.inside.as_ref().map_or_else(String::new, |[node, material]| {
            format!("{}, material {}", escape(node), escape(material))
        });
        let repair = match (probe.metres, probe.from.as_slice()) {
            (Some(metres), _) => format!("moved {metres:.2} m"),
            (None, [one]) if probe.repair == "lost" => format!("found nothing: has the light of probe {one}"),
            (None, [_]) => "filled from 1 neighbour".to_owned(),
            (None, from) => format!("filled from {} neighbours", from.len()),
        };
        page.put(format_args!(
            "<tr><td class=\"number\">{}</td><td>{x:.2}, {y:.2}, {z:.2}</td><td>{inside}</td><td>{repair}</td></tr>\n",
            probe.probe
        ));
    }
    page.line("</tbody></table></div>");
    if all.len() > MOST_ROWS {
        page.put(format_args!(
            "<p class=\"small soft\">The JSON file has {} more.</p>\n",
            all.len() - MOST_ROWS
        ));
    }
    page.line("</details>");
}

impl View {
    /// A view of all probes with a margin.
    fn of(places: &ProbePlaces, axes: [usize; 3]) -> Self {
        let corners = places.volumes().iter().flat_map(|volume| volume.bounds);
        let points = places.grid().iter().chain(places.positions()).copied();
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for corner in corners.chain(points) {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(corner[axis]);
                bounds[1][axis] = bounds[1][axis].max(corner[axis]);
            }
        }
        let length = |axis: usize| bounds[1][axis] - bounds[0][axis];
        let margin = 0.05 * (0..3).map(length).fold(0.0, f32::max) + 0.1;
        for axis in 0..3 {
            bounds[0][axis] -= margin;
            bounds[1][axis] += margin;
        }
        let length = |axis: usize| bounds[1][axis] - bounds[0][axis];
        let scale = (WIDTH / length(axes[0])).min(HEIGHT / length(axes[1]));
        Self { axes, bounds, scale }
    }

    /// A point in the picture.
    fn point(&self, place: [f32; 3]) -> [f32; 2] {
        let [right, up, _] = self.axes;
        [place[right] - self.bounds[0][right], self.bounds[1][up] - place[up]].map(|x| x * self.scale)
    }

    /// The width and the height of the picture.
    fn size(&self) -> [f32; 2] {
        let [right, up, _] = self.axes;
        [right, up].map(|axis| (self.bounds[1][axis] - self.bounds[0][axis]) * self.scale)
    }
}

fn draw(page: &mut Markup, title: &str, view: View, picture: &ProbePicture<'_>) {
    let [width, height] = view.size();
    page.put(format_args!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{title}\">\n"
    ));
    if let Some(scene) = picture.scene {
        page.put(format_args!("<path class=\"wall\" d=\"{}\"/>\n", walls(view, scene)));
    }
    for volume in picture.places.volumes() {
        let [one, other] = volume.bounds.map(|end| view.point(end));
        page.put(format_args!(
            "<rect class=\"volume\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>\n",
            one[0],
            other[1],
            other[0] - one[0],
            one[1] - other[1]
        ));
    }
    let [valid, moved, filled, lost] = marks(view, picture.places);
    let spacing = picture.places.volumes().iter().flat_map(|volume| {
        let spacing = volume.spacing();
        [spacing[view.axes[0]], spacing[view.axes[1]]]
    });
    let radius = (0.15 * view.scale * spacing.fold(f32::INFINITY, f32::min)).clamp(1.5, 5.0);
    page.put(format_args!("<path class=\"way\" d=\"{}\"/>\n", ways(view, picture.places)));
    // What is worse is drawn over what is better.
    for (class, places) in [("valid", valid), ("moved", moved), ("filled", filled), ("lost", lost)] {
        places.into_iter().for_each(|at| mark(page, class, at, radius));
    }
    for leak in picture.leaks.iter().filter(|leak| leak.share >= LEAST_SHARE).take(MOST_LEAKS) {
        let Some((probe, _)) = leak.probes.first() else { continue };
        let from = picture.places.positions().get(*probe as usize).copied().unwrap_or(leak.point);
        let [[x, y], [end_x, end_y]] = [from, leak.point].map(|place| view.point(place));
        page.put(format_args!("<path class=\"leak\" d=\"M{x:.1} {y:.1}L{end_x:.1} {end_y:.1}\"/>\n"));
    }
    page.line("</svg>");
}

/// The edges of surfaces that are seen edge-on.
fn walls(view: View, scene: &Scene) -> String {
    let mut found: Vec<(f32, [[f32; 2]; 2])> = Vec::new();
    for triangle in &scene.parts().triangles {
        let [a, b, c] = *triangle;
        let edge = |end: [f32; 3]| [0, 1, 2].map(|axis| end[axis] - a[axis]);
        let ([p, q], [i, j, k]) = ([edge(b), edge(c)], [0, 1, 2]);
        let normal = [p[j] * q[k] - p[k] * q[j], p[k] * q[i] - p[i] * q[k], p[i] * q[j] - p[j] * q[i]];
        let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
        if normal[view.axes[2]].abs() > 0.2 * length {
            continue;
        }
        let corners = triangle.map(|corner| view.point(corner));
        let edges = [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|corner| corners[corner]));
        let square = |[one, other]: [[f32; 2]; 2]| {
            (one[0] - other[0]) * (one[0] - other[0]) + (one[1] - other[1]) * (one[1] - other[1])
        };
        let longest = edges.into_iter().map(|edge| (square(edge), edge)).max_by(|a, b| a.0.total_cmp(&b.0));
        found.extend(longest.filter(|(square, _)| *square > 1.0));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut lines: Vec<String> = found
        .iter()
        .take(MOST_WALLS)
        .map(|(_, [from, to])| format!("M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1]))
        .collect();
    lines.sort();
    lines.dedup();
    lines.concat()
}

/// Lines from the places in the grid of probes that were moved to where they stand.
fn ways(view: View, places: &ProbePlaces) -> String {
    let is_moved = |probe: &usize| places.repairs()[*probe] == Repair::Moved;
    let line = |probe: usize| {
        let [from, to] = [places.grid()[probe], places.positions()[probe]].map(|place| view.point(place));
        format!("M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1])
    };
    let mut lines: Vec<String> = (0..places.len()).filter(is_moved).map(line).collect();
    lines.sort();
    lines.dedup();
    lines.concat()
}

/// The places in the picture of valid, moved, filled and lost probes, each once.
fn marks(view: View, places: &ProbePlaces) -> [Vec<[f32; 2]>; 4] {
    let mut marks: [Vec<[f32; 2]>; 4] = Default::default();
    for (probe, repair) in places.repairs().iter().enumerate() {
        let (class, at) = match repair {
            Repair::None => (0, places.positions()[probe]),
            Repair::Moved => (1, places.positions()[probe]),
            Repair::Filled(_) => (2, places.grid()[probe]),
            Repair::Lost(_) => (3, places.grid()[probe]),
        };
        marks[class].push(view.point(at).map(|x| (10.0 * x).round() / 10.0));
    }
    for own in &mut marks {
        own.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        own.dedup();
    }
    marks
}

/// A mark of its own for each repair, so that no colour is needed to tell them apart. What may be over the
/// circle of another probe is smaller than that.
fn mark(page: &mut Markup, class: &str, [x, y]: [f32; 2], radius: f32) {
    match class {
        "valid" => {
            let r = 1.25 * radius;
            page.put(format_args!("<circle class=\"valid\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\"/>\n"));
        }
        "moved" => {
            let r = 1.1 * radius;
            page.put(format_args!(
                "<path class=\"moved\" d=\"M{:.1} {y:.1}l{r:.1} {r:.1}l{r:.1} -{r:.1}l-{r:.1} -{r:.1}z\"/>\n",
                x - r
            ));
        }
        "filled" => {
            let r = 1.4 * radius;
            page.put(format_args!(
                "<rect class=\"filled\" x=\"{:.1}\" y=\"{:.1}\" width=\"{r:.1}\" height=\"{r:.1}\"/>\n",
                x - 0.5 * r,
                y - 0.5 * r
            ));
        }
        _ => {
            let r = 1.8 * radius;
            let (left, top) = (x - 0.5 * r, y - 0.5 * r);
            page.put(format_args!(
                "<path class=\"lost\" d=\"M{left:.1} {top:.1}l{r:.1} {r:.1}m-{r:.1} 0l{r:.1} -{r:.1}\"/>\n"
            ));
        }
    }
}
