//! The layout of a sheet: five columns of boxes that do not overlap.
//!
//! The environment takes three columns and the plot of energies the other two; reconstructions take one each.
//! Materials are in two halves of the sheet, each a 2:1 map beside its ball.

use preview::drawing::Rect;

const MARGIN: usize = 40;
const GUTTER: usize = 20;
/// The width of a reconstruction.
pub(super) const COLUMN: usize = 304;
const COLUMNS: usize = 5;
const CONTENT: usize = COLUMNS * COLUMN + (COLUMNS - 1) * GUTTER;
/// The height of one line of a caption.
const LINE: usize = 21;
/// The gap between a picture and its caption.
const CAPTION_GAP: usize = 9;
/// The gap between a row's captions and the next row.
const ROW_GAP: usize = 24;
/// The gap between sections.
const SECTION_GAP: usize = 38;
/// The gap between the two halves of the materials; wider than between a map and its ball, which belong
/// together.
const HALF_GUTTER: usize = 44;
/// The edge of a ball: a 2:1 map and a ball of one height fill half the sheet, with a gap of about 12
/// between.
pub(super) const BALL: usize = ((CONTENT - HALF_GUTTER) / 2 - 12) / 3;

/// A picture with a caption of two lines below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Panel {
    pub(crate) picture: Rect,
    pub(crate) caption: [Rect; 2],
}

/// A material: its map and its ball over one caption.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MaterialPanel {
    pub(crate) map: Rect,
    pub(crate) ball: Rect,
    pub(crate) caption: [Rect; 2],
}

/// A headline with a rule below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SheetSection {
    pub(crate) title: Rect,
    pub(crate) rule: Rect,
}

/// The boxes of a sheet.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SheetLayout {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) title: Rect,
    pub(crate) subtitle: Rect,
    pub(crate) environment: Panel,
    pub(crate) plot: Option<Rect>,
    pub(crate) harmonics: Option<SheetSection>,
    pub(crate) reconstructions: Vec<Panel>,
    pub(crate) material_section: Option<SheetSection>,
    pub(crate) materials: Vec<MaterialPanel>,
}

impl SheetLayout {
    /// The layout of a sheet with these numbers of reconstructions (with their plot, if there is lighting)
    /// and materials.
    pub(crate) fn new(reconstructions: Option<usize>, materials: usize) -> Self {
        let title = Rect::new(MARGIN, MARGIN - 6, CONTENT, 40);
        let subtitle = Rect::new(MARGIN, title.bottom() + 4, CONTENT, 24);
        let mut y = subtitle.bottom() + 20;

        let wide = if reconstructions.is_some() { 3 } else { COLUMNS };
        let environment = panel(MARGIN, y, span(wide));
        let plot = reconstructions.map(|_| {
            let x = MARGIN + span(wide) + GUTTER;
            Rect::new(x, y, span(COLUMNS - wide), environment.caption[1].bottom() - y)
        });
        y = environment.caption[1].bottom();

        let count = reconstructions.unwrap_or(0);
        let harmonics = (count > 0).then(|| section(&mut y));
        let reconstructions = (0..count).map(|index| {
            let (row, column) = (index / COLUMNS, index % COLUMNS);
            let height = COLUMN / 2 + CAPTION_GAP + 2 * LINE + ROW_GAP;
            panel(MARGIN + column * (COLUMN + GUTTER), y + row * height, COLUMN)
        });
        let reconstructions: Vec<_> = reconstructions.collect();
        y = reconstructions.last().map_or(y, |panel| panel.caption[1].bottom());

        let material_section = (materials > 0).then(|| section(&mut y));
        let materials = (0..materials).map(|index| {
            let (row, column) = (index / 2, index % 2);
            let half = (CONTENT - HALF_GUTTER) / 2;
            let height = BALL + CAPTION_GAP + 2 * LINE + ROW_GAP;
            let (x, y) = (MARGIN + column * (half + HALF_GUTTER), y + row * height);
            let map = Rect::new(x, y, 2 * BALL, BALL);
            let ball = Rect::new(x + half - BALL, y, BALL, BALL);
            MaterialPanel { map, ball, caption: caption(x, map.bottom(), half) }
        });
        let materials: Vec<_> = materials.collect();
        y = materials.last().map_or(y, |panel| panel.caption[1].bottom());

        Self {
            width: CONTENT + 2 * MARGIN,
            height: y + MARGIN,
            title,
            subtitle,
            environment,
            plot,
            harmonics,
            reconstructions,
            material_section,
            materials,
        }
    }
}

/// The width of some columns with the gutters between them.
const fn span(columns: usize) -> usize {
    columns * COLUMN + (columns - 1) * GUTTER
}

/// A 2:1 picture with its caption.
fn panel(x: usize, y: usize, width: usize) -> Panel {
    let picture = Rect::new(x, y, width, width / 2);
    Panel { picture, caption: caption(x, picture.bottom(), width) }
}

fn caption(x: usize, below: usize, width: usize) -> [Rect; 2] {
    [0, 1].map(|line| Rect::new(x, below + CAPTION_GAP + line * LINE, width, LINE))
}

/// A headline below `y`, which then is the top of the section's content.
fn section(y: &mut usize) -> SheetSection {
    let title = Rect::new(MARGIN, *y + SECTION_GAP, CONTENT, 26);
    let rule = Rect::new(MARGIN, title.bottom() + 6, CONTENT, 1);
    *y = rule.bottom() + 18;
    SheetSection { title, rule }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(layout: &SheetLayout) -> Vec<Rect> {
        let mut boxes = vec![layout.title, layout.subtitle, layout.environment.picture];
        boxes.extend(layout.environment.caption);
        boxes.extend(layout.plot);
        for section in layout.harmonics.iter().chain(&layout.material_section) {
            boxes.extend([section.title, section.rule]);
        }
        for panel in &layout.reconstructions {
            boxes.push(panel.picture);
            boxes.extend(panel.caption);
        }
        for panel in &layout.materials {
            boxes.extend([panel.map, panel.ball, panel.caption[0], panel.caption[1]]);
        }
        boxes
    }

    #[test]
    fn no_two_boxes_overlap_and_all_lie_within_the_margins() {
        for reconstructions in [None, Some(0), Some(1), Some(5), Some(6), Some(11)] {
            for materials in [0, 1, 2, 3, 30] {
                let layout = SheetLayout::new(reconstructions, materials);
                let boxes = boxes(&layout);
                for (index, a) in boxes.iter().enumerate() {
                    assert!(a.width > 0 && a.height > 0);
                    assert!(a.x >= MARGIN && a.right() <= layout.width - MARGIN, "{a:?}");
                    assert!(a.y >= MARGIN - 6 && a.bottom() <= layout.height - MARGIN, "{a:?}");
                    for b in &boxes[index + 1..] {
                        let apart =
                            a.right() <= b.x || b.right() <= a.x || a.bottom() <= b.y || b.bottom() <= a.y;
                        assert!(apart, "{a:?} and {b:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn rows_end_at_the_right_margin() {
        let layout = SheetLayout::new(Some(5), 2);
        let right = layout.width - MARGIN;
        assert_eq!(layout.plot.unwrap().right(), right);
        assert_eq!(layout.reconstructions[4].picture.right(), right);
        assert_eq!(layout.materials[1].ball.right(), right);
        assert_eq!(SheetLayout::new(None, 0).environment.picture.right(), right);
        // Within the rounding of the ball's edge.
        let panel = layout.materials[0];
        assert!((12..=14).contains(&(panel.ball.x - panel.map.right())), "{panel:?}");
    }
}
