//! Pictures side by side, each above its name, with their differences below.

use preview::drawing::{Align, Canvas, Rect};

use crate::picture::sheet::theme;

const MARGIN: usize = 16;
const GAP: usize = 12;
/// The gap between a picture and its caption.
const CAPTION_GAP: usize = 6;
/// The height of a line of a caption.
const LINE: usize = 20;

/// A picture of a mode.
pub(super) struct ComparisonPanel {
    pub(super) label: &'static str,
    /// The difference from the picture that it is compared with, in words.
    pub(super) detail: String,
    pub(super) picture: Vec<[u8; 3]>,
    /// The name and the picture of the difference.
    pub(super) difference: Option<(String, Vec<[u8; 3]>)>,
}

/// The layout of the pictures. A single picture has no margin and no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ComparisonSheet {
    /// The width and height of each picture.
    pub(super) picture: [usize; 2],
    pub(super) columns: usize,
    /// Whether there are differences below the pictures, and captions have a second line.
    pub(super) compared: bool,
}

impl ComparisonSheet {
    /// The width and height of the sheet in pixels.
    pub(super) fn size(self) -> [usize; 2] {
        let ([width, height], gaps) = (self.picture, self.columns.saturating_sub(1));
        if self.columns == 1 && !self.compared {
            return self.picture;
        }
        let rows = if self.compared { self.row() + GAP + height + CAPTION_GAP + LINE } else { self.row() };
        [2 * MARGIN + self.columns * width + gaps * GAP, MARGIN + rows + MARGIN / 2]
    }

    /// The height of the pictures and their captions.
    fn row(self) -> usize {
        self.picture[1] + CAPTION_GAP + LINE * (1 + usize::from(self.compared))
    }

    /// Draws pictures, rows from the top.
    pub(super) fn draw(self, panels: &[ComparisonPanel]) -> Vec<[u8; 3]> {
        if let ([panel], false) = (panels, self.compared) {
            return panel.picture.clone();
        }
        let ([width, height], [whole, rows]) = (self.picture, self.size());
        let mut canvas = Canvas::new(whole, rows, theme::BACKGROUND);
        for (column, panel) in panels.iter().enumerate() {
            let place = Rect::new(MARGIN + column * (width + GAP), MARGIN, width, height);
            let line = |place: Rect, line: usize| {
                Rect::new(place.x, place.bottom() + CAPTION_GAP + line * LINE, width, LINE)
            };
            canvas.place(place, &panel.picture);
            theme::NAME.draw(&mut canvas, line(place, 0), Align::Left, panel.label);
            theme::DETAIL.draw(&mut canvas, line(place, 1), Align::Left, &panel.detail);
            if let Some((name, picture)) = &panel.difference {
                let place = Rect::new(place.x, MARGIN + self.row() + GAP, width, height);
                canvas.place(place, picture);
                theme::DETAIL.draw(&mut canvas, line(place, 0), Align::Left, name);
            }
        }
        canvas.pixels().to_vec()
    }
}

/// Joins frames of one size, with this many in each row.
pub(super) fn strip(frames: &[Vec<[u8; 3]>], [width, height]: [usize; 2], columns: usize) -> Vec<[u8; 3]> {
    let mut whole = Vec::with_capacity(width * height * frames.len());
    for row in frames.chunks(columns) {
        for line in 0..height {
            for frame in row {
                whole.extend_from_slice(&frame[line * width..][..width]);
            }
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(shade: u8, [width, height]: [usize; 2]) -> ComparisonPanel {
        let picture = vec![[shade; 3]; width * height];
        let difference = Some(("difference".into(), vec![[shade + 100; 3]; width * height]));
        ComparisonPanel { label: "mode", detail: "detail".into(), picture, difference }
    }

    #[test]
    fn a_single_picture_stands_alone() {
        let sheet = ComparisonSheet { picture: [20, 10], columns: 1, compared: false };
        assert_eq!(sheet.size(), [20, 10]);
        assert_eq!(sheet.draw(&[panel(7, [20, 10])]), vec![[7; 3]; 200]);
    }

    #[test]
    fn every_picture_is_whole_and_in_its_column() {
        let picture = [40, 30];
        let sheet = ComparisonSheet { picture, columns: 3, compared: true };
        let drawn = sheet.draw(&[1, 2, 3].map(|shade| panel(shade, picture)));
        let [width, height] = sheet.size();
        assert_eq!(drawn.len(), width * height);
        for shade in [1, 2, 3, 101, 102, 103] {
            let places: Vec<usize> = (0..drawn.len()).filter(|&at| drawn[at] == [shade; 3]).collect();
            assert_eq!(places.len(), 1200, "{shade}");
            let column = usize::from(shade % 100 - 1);
            assert!(places.iter().all(|at| (at % width - MARGIN) / (40 + GAP) == column));
        }
    }

    #[test]
    fn a_strip_holds_its_frames_in_order() {
        let frames: Vec<_> = (0..4).map(|shade| vec![[shade; 3]; 6]).collect();
        let shades = |columns| strip(&frames, [3, 2], columns).iter().map(|code| code[0]).collect::<Vec<_>>();
        assert_eq!(shades(1), [[0; 6], [1; 6], [2; 6], [3; 6]].as_flattened());
        assert_eq!(shades(4)[..12], [[0; 3], [1; 3], [2; 3], [3; 3]].as_flattened()[..]);
    }
}
