//! Pictures of directions: balls, lat-long maps, dots on them, and sheets of several.

use containers::write_png;

/// The colour of dots.
pub const DOT: [u8; 3] = [232, 96, 28];

/// Between the pictures of a sheet, in pixels.
const GAP: usize = 8;

/// sRGB codes, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    codes: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture from the code of each pixel (column, row).
    pub fn new(width: usize, height: usize, code: impl Fn(usize, usize) -> [u8; 3]) -> Self {
        let codes = (0..width * height).map(|index| code(index % width, index / width)).collect();
        Self { width, height, codes }
    }

    /// The pictures of each row beside each other, the rows below each other, on white.
    pub fn sheet(rows: &[Vec<Self>]) -> Self {
        let across = |row: &Vec<Self>| row.iter().map(|picture| picture.width + GAP).sum::<usize>() + GAP;
        let tall = |row: &Vec<Self>| row.iter().map(|picture| picture.height).max().unwrap_or(0) + GAP;
        let width = rows.iter().map(across).max().unwrap_or(GAP);
        let height = rows.iter().map(tall).sum::<usize>() + GAP;
        let mut sheet = Self::new(width, height, |_, _| [255; 3]);
        let mut top = GAP;
        for row in rows {
            let mut left = GAP;
            for picture in row {
                for (y, codes) in picture.codes.chunks_exact(picture.width).enumerate() {
                    let begin = (top + y) * width + left;
                    sheet.codes[begin..begin + picture.width].copy_from_slice(codes);
                }
                left += picture.width + GAP;
            }
            top += tall(row);
        }
        sheet
    }

    /// A round dot about a place in pixels, from the left and the top; what is outside is left out.
    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64) {
        let range = |centre: f64, end: usize| {
            let from = (centre - radius - 1.0).max(0.0) as usize;
            from..((centre + radius + 2.0).max(0.0) as usize).min(end)
        };
        for row in range(y, self.height) {
            for column in range(x, self.width) {
                let distance = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y);
                let cover = (radius + 0.5 - distance).clamp(0.0, 1.0);
                let code = &mut self.codes[row * self.width + column];
                *code = mix(*code, DOT, cover);
            }
        }
    }

    /// The picture as a PNG.
    ///
    /// # Errors
    /// If it is too large for one.
    pub fn png(&self) -> Result<Vec<u8>, containers::Error> {
        write_png(self.width, self.height, &self.codes, None)
    }
}

/// From one colour to another, `share` between 0 and 1.
pub fn mix(from: [u8; 3], to: [u8; 3], share: f64) -> [u8; 3] {
    std::array::from_fn(|k| {
        (f64::from(from[k]) + (f64::from(to[k]) - f64::from(from[k])) * share).round() as u8
    })
}

/// The grey of a value between 0 and 1.
pub fn grey(value: f64) -> [u8; 3] {
    mix([24; 3], [238; 3], value.clamp(0.0, 1.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_its_pictures_in_place() {
        let red = Picture::new(2, 3, |_, _| [255, 0, 0]);
        let blue = Picture::new(4, 1, |_, _| [0, 0, 255]);
        let sheet = Picture::sheet(&[vec![red.clone(), blue.clone()], vec![blue]]);
        assert_eq!([sheet.width, sheet.height], [2 + 4 + 3 * GAP, 3 + 1 + 3 * GAP]);
        let at = |x: usize, y: usize| sheet.codes[y * sheet.width + x];
        assert_eq!(at(GAP, GAP + 2), [255, 0, 0]);
        assert_eq!(at(2 * GAP + 2, GAP), [0, 0, 255]);
        assert_eq!(at(2 * GAP + 2, GAP + 1), [255; 3]);
        assert_eq!(at(GAP + 3, 2 * GAP + 3), [0, 0, 255]);
        assert!(sheet.png().is_ok());
    }

    #[test]
    fn dots_at_and_beyond_the_edge_stay_inside() {
        let mut picture = Picture::new(5, 5, |_, _| [0; 3]);
        picture.dot([2.5, 2.5], 1.0);
        assert_eq!(picture.codes[2 * 5 + 2], DOT);
        assert_eq!(picture.codes[0], [0; 3]);
        for place in [[0.0, 0.0], [-9.0, 2.0], [5.0, 5.0], [2.0, 90.0]] {
            picture.dot(place, 2.0);
        }
        assert_eq!(picture.codes[0], DOT);
    }
}
