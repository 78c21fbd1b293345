//! Plots as inline SVG. Colours and fonts come from the page's style sheet, so they adapt to light and dark
//! themes.

use std::fmt::Write as _;

use containers::escape_html as escape;

/// A curve, one value for each x = 0, 1, 2 ...
pub(crate) struct Curve<'a> {
    pub(crate) name: &'a str,
    /// The class that gives its colour and dashes.
    pub(crate) class: &'static str,
    /// Shares, 0 to 1; values below the axis are drawn on it.
    pub(crate) values: &'a [f64],
}

/// Shares over degrees.
pub(crate) struct Curves<'a> {
    /// The text for readers who cannot see the plot.
    pub(crate) description: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    /// The least share on the axis.
    pub(crate) least: f64,
    pub(crate) curves: Vec<Curve<'a>>,
    /// A degree that is marked, and its label.
    pub(crate) mark: Option<(usize, String)>,
}

/// The area of a plot in units of the SVG.
struct PlotArea {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Curves<'_> {
    /// The `<svg>` element.
    pub(crate) fn svg(&self) -> String {
        let frame = PlotArea { left: 46.0, top: 24.0, width: 380.0, height: 180.0 };
        let last =
            self.curves.iter().map(|curve| curve.values.len()).max().unwrap_or(1).saturating_sub(1).max(1);
        let x = |degree: f64| frame.left + frame.width * degree / last as f64;
        let y = |share: f64| {
            let inside = (share.clamp(self.least, 1.0) - self.least) / (1.0 - self.least);
            frame.top + frame.height * (1.0 - inside)
        };
        let (bottom, right) = (frame.top + frame.height, frame.left + frame.width);
        let mut svg = open(440.0, 268.0, self.description);
        for share in ticks(self.least) {
            let y = y(share);
            put(
                &mut svg,
                format_args!(
                    r#"<line class="grid" x1="{left}" y1="{y:.1}" x2="{right}" y2="{y:.1}"/><text class="tick end" x="{at}" y="{text:.1}">{label}</text>"#,
                    left = frame.left,
                    at = frame.left - 6.0,
                    text = y + 4.0,
                    label = (share * 100.0).round()
                ),
            );
        }
        let step = [1, 2, 5, 10, 20, 50, 100, 500].into_iter().find(|step| last / step <= 8).unwrap_or(1000);
        for degree in (0..=last).step_by(step) {
            put(
                &mut svg,
                format_args!(
                    r#"<text class="tick middle" x="{x:.1}" y="{y}">{degree}</text>"#,
                    x = x(degree as f64),
                    y = bottom + 16.0
                ),
            );
        }
        put(
            &mut svg,
            format_args!(
                r#"<text class="label middle" x="{x}" y="{y}">{label}</text><text class="label" x="4" y="{top}">{y_label}</text>"#,
                x = frame.left + frame.width / 2.0,
                y = bottom + 34.0,
                top = frame.top - 13.0,
                label = escape(self.x_label),
                y_label = escape(self.y_label)
            ),
        );
        if let Some((degree, label)) = &self.mark {
            let at = x((*degree).min(last) as f64);
            let (class, text) = if *degree * 2 > last { ("note end", at - 5.0) } else { ("note", at + 5.0) };
            put(
                &mut svg,
                format_args!(
                    r#"<line class="mark" x1="{at:.1}" y1="{top}" x2="{at:.1}" y2="{bottom}"/><text class="{class}" x="{text:.1}" y="{low}">{label}</text>"#,
                    top = frame.top,
                    low = bottom - 7.0,
                    label = escape(label)
                ),
            );
        }
        for curve in &self.curves {
            let points = curve.values.iter().enumerate().map(|(degree, share)| {
                format!("{:.1},{:.1}", x(degree as f64), y(if share.is_finite() { *share } else { 0.0 }))
            });
            let points = points.collect::<Vec<_>>().join(" ");
            put(&mut svg, format_args!(r#"<polyline class="curve {}" points="{points}"/>"#, curve.class));
        }
        let mut at = 4.0;
        for curve in &self.curves {
            put(
                &mut svg,
                format_args!(
                    r#"<line class="curve {class}" x1="{at}" y1="258" x2="{end}" y2="258"/><text class="tick" x="{text}" y="262">{name}</text>"#,
                    class = curve.class,
                    end = at + 18.0,
                    text = at + 23.0,
                    name = escape(curve.name)
                ),
            );
            at += 40.0 + 5.4 * curve.name.chars().count() as f64;
        }
        svg.push_str("</svg>");
        svg
    }
}

/// One row of a [`dots`] chart.
pub(crate) struct Row<'a> {
    pub(crate) name: &'a str,
    /// Shares for P = 0, 1, 2 ..., ascending.
    pub(crate) shares: &'a [f64],
    /// The P that the exports have.
    pub(crate) chosen: usize,
}

/// A row per material: diamonds for P = 0, 1, 2 ..., from light to dark, and a circle for the last (figure 8
/// of the paper). The chosen P has a ring.
pub(crate) fn dots(rows: &[Row<'_>], description: &str) -> String {
    const HEIGHT: f64 = 26.0;
    let frame = PlotArea { left: 190.0, top: 24.0, width: 480.0, height: HEIGHT * rows.len() as f64 };
    let lowest = rows.iter().filter_map(|row| row.shares.first()).copied().fold(1.0, f64::min);
    let least = ((lowest * 10.0).floor() / 10.0).clamp(0.0, 0.9);
    let x = |share: f64| frame.left + frame.width * (share.clamp(least, 1.0) - least) / (1.0 - least);
    let bottom = frame.top + frame.height;
    let mut svg = open(700.0, bottom + 26.0, description);
    for share in ticks(least) {
        let x = x(share);
        put(
            &mut svg,
            format_args!(
                r#"<line class="grid" x1="{x:.1}" y1="{top}" x2="{x:.1}" y2="{bottom}"/><text class="tick middle" x="{x:.1}" y="{text}">{label} %</text>"#,
                top = frame.top,
                text = bottom + 16.0,
                label = (share * 100.0).round()
            ),
        );
    }
    for (index, row) in rows.iter().enumerate() {
        let y = frame.top + HEIGHT * (index as f64 + 0.5);
        put(
            &mut svg,
            format_args!(
                r#"<line class="grid" x1="{left}" y1="{y}" x2="{right}" y2="{y}"/><text class="name end" x="{at}" y="{text}">{name}</text>"#,
                left = frame.left,
                right = frame.left + frame.width,
                at = frame.left - 12.0,
                text = y + 4.5,
                name = escape(&shortened(row.name, 26))
            ),
        );
        let last = row.shares.len().saturating_sub(1);
        for (p, share) in row.shares.iter().enumerate() {
            let (x, strength) = (x(*share), 0.25 + 0.75 * p as f64 / last.max(1) as f64);
            if p == row.chosen {
                put(&mut svg, format_args!(r#"<circle class="ring" cx="{x:.1}" cy="{y}" r="9"/>"#));
            }
            if p == last {
                put(&mut svg, format_args!(r#"<circle class="dot" cx="{x:.1}" cy="{y}" r="4.5"/>"#));
            } else {
                put(
                    &mut svg,
                    format_args!(
                        r#"<path class="dot" style="opacity:{strength:.2}" d="M{x:.1} {a}l5 5-5 5-5-5z"/>"#,
                        a = y - 5.0
                    ),
                );
            }
        }
    }
    svg.push_str("</svg>");
    svg
}

/// Shares with a line: at most six from `least` to 1.
fn ticks(least: f64) -> Vec<f64> {
    let span = 1.0 - least;
    let step = [0.01, 0.02, 0.05, 0.1, 0.2].into_iter().find(|step| span / step < 6.5).unwrap_or(0.25);
    let count = (span / step + 1e-9).floor() as usize;
    (0..=count).rev().map(|i| 1.0 - step * i as f64).collect()
}

/// A name cut to at most `most` characters, with an ellipsis.
fn shortened(name: &str, most: usize) -> String {
    if name.chars().count() <= most {
        return name.to_owned();
    }
    name.chars().take(most - 1).chain(['…']).collect()
}

fn open(width: f64, height: f64, description: &str) -> String {
    let description = escape(description);
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="{description}"><title>{description}</title>"#
    )
}

fn put(svg: &mut String, text: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = svg.write_fmt(text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_the_whole() {
        let found = ticks(0.0);
        assert_eq!(found.len(), 6);
        assert_eq!(*found.last().unwrap(), 1.0);
        assert!(ticks(0.9).len() >= 5 && ticks(0.97).len() >= 3);
    }

    #[test]
    fn values_off_the_axis_stay_in_the_frame() {
        let curves =
            vec![Curve { name: "bound", class: "bound", values: &[-7.0, f64::NEG_INFINITY, 0.5, 1.0] }];
        let svg = Curves {
            description: "a",
            x_label: "F",
            y_label: "%",
            least: 0.0,
            curves,
            mark: Some((9, "<here>".into())),
        }
        .svg();
        assert!(svg.contains("46.0,204.0") && !svg.contains("inf") && !svg.contains("NaN"), "{svg}");
        assert!(svg.contains("&lt;here&gt;"));
    }

    #[test]
    fn long_names_are_cut() {
        assert_eq!(shortened("gold", 5), "gold");
        assert_eq!(shortened("素材素材素材", 4), "素材素…");
    }
}
