//! The picture that labels and plots are drawn on: 8-bit sRGB, blended in sRGB values as screens do with
//! text.

/// A rectangle of whole pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// The first column.
    pub x: usize,
    /// The first row.
    pub y: usize,
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
}

impl Rect {
    /// A rectangle from its first column and row, and its size.
    pub const fn new(x: usize, y: usize, width: usize, height: usize) -> Self {
        Self { x, y, width, height }
    }

    /// The first column to the right of the rectangle.
    pub const fn right(self) -> usize {
        self.x + self.width
    }

    /// The first row below the rectangle.
    pub const fn bottom(self) -> usize {
        self.y + self.height
    }
}

/// An opaque picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A picture of one colour.
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The colours, row by row from the top.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// Lays `coverage` (0 to 1) of a colour over a pixel; outside the picture this does nothing.
    pub fn blend(&mut self, x: i64, y: i64, colour: [u8; 3], coverage: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x < self.width && y < self.height && coverage > 0.0 {
            let pixel = &mut self.pixels[y * self.width + x];
            if coverage >= 1.0 {
                *pixel = colour;
                return;
            }
            for (old, new) in pixel.iter_mut().zip(colour) {
                *old = (f32::from(*old) + (f32::from(new) - f32::from(*old)) * coverage).round() as u8;
            }
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, rect: Rect, colour: [u8; 3]) {
        let columns = rect.x.min(self.width)..rect.right().min(self.width);
        for y in rect.y..rect.bottom().min(self.height) {
            self.pixels[y * self.width..][columns.clone()].fill(colour);
        }
    }

    /// Fills a rectangle with edges between pixels: edge pixels are covered in part.
    pub fn fill_between(&mut self, left: f64, top: f64, right: f64, bottom: f64, colour: [u8; 3]) {
        let overlap = |cell: i64, low: f64, high: f64| {
            (high.min(cell as f64 + 1.0) - low.max(cell as f64)).clamp(0.0, 1.0)
        };
        for y in top.floor() as i64..bottom.ceil() as i64 {
            for x in left.floor() as i64..right.ceil() as i64 {
                let coverage = overlap(x, left, right) * overlap(y, top, bottom);
                self.blend(x, y, colour, coverage as f32);
            }
        }
    }

    /// Draws a line of a thickness through points, in coordinates where pixel (x, y) covers x..x+1, y..y+1.
    pub fn line(&mut self, points: &[(f64, f64)], thickness: f64, colour: [u8; 3]) {
        // Joints belong to two segments: coverage is collected first, so that no pixel is blended twice.
        let reach = thickness / 2.0 + 1.0;
        let bound = |of: fn(&(f64, f64)) -> f64| {
            let values = points.iter().map(of);
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
            ((low - reach).floor().max(0.0) as usize, (high + reach).ceil().max(0.0) as usize)
        };
        let (left, right) = bound(|point| point.0);
        let (top, bottom) = bound(|point| point.1);
        let (right, bottom) = (right.min(self.width), bottom.min(self.height));
        if points.len() < 2 || left >= right || top >= bottom {
            return;
        }
        let mut covered = vec![0.0_f64; (right - left) * (bottom - top)];
        for pair in points.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let squared = (dx * dx + dy * dy).max(1e-12);
            let columns = ((a.0.min(b.0) - reach).floor().max(left as f64) as usize)
                ..((a.0.max(b.0) + reach).ceil().max(0.0) as usize).min(right);
            let rows = ((a.1.min(b.1) - reach).floor().max(top as f64) as usize)
                ..((a.1.max(b.1) + reach).ceil().max(0.0) as usize).min(bottom);
            for y in rows {
                for x in columns.clone() {
                    let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                    let along = (((px - a.0) * dx + (py - a.1) * dy) / squared).clamp(0.0, 1.0);
                    let distance = math::hypot(px - a.0 - along * dx, py - a.1 - along * dy);
                    let coverage = (thickness / 2.0 + 0.5 - distance).clamp(0.0, 1.0);
                    let cell = &mut covered[(y - top) * (right - left) + x - left];
                    *cell = cell.max(coverage);
                }
            }
        }
        for (row, line) in covered.chunks_exact(right - left).enumerate() {
            for (column, coverage) in line.iter().enumerate() {
                self.blend((left + column) as i64, (top + row) as i64, colour, *coverage as f32);
            }
        }
    }

    /// Copies a picture to a rectangle of its size.
    ///
    /// # Panics
    /// If the rectangle reaches beyond the canvas.
    pub fn place(&mut self, rect: Rect, picture: &[[u8; 3]]) {
        for (row, line) in picture.chunks_exact(rect.width.max(1)).enumerate().take(rect.height) {
            let start = (rect.y + row) * self.width + rect.x;
            self.pixels[start..start + rect.width].copy_from_slice(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 3] = [255; 3];

    fn sum(canvas: &Canvas) -> f64 {
        canvas.pixels().iter().map(|pixel| f64::from(pixel[0]) / 255.0).sum()
    }

    #[test]
    fn a_filled_area_is_the_area_of_its_rectangle() {
        let mut canvas = Canvas::new(20, 20, [0; 3]);
        canvas.fill_between(2.25, 3.5, 7.5, 9.75, WHITE);
        // 5.25 x 6.25; each of the 24 edge pixels rounds to 1/510 at most.
        assert!((sum(&canvas) - 32.8125).abs() < 24.0 / 510.0, "{}", sum(&canvas));
    }

    #[test]
    fn a_line_covers_its_length_times_its_thickness() {
        let mut canvas = Canvas::new(100, 60, [0; 3]);
        canvas.line(&[(10.0, 10.5), (50.0, 10.5), (90.0, 10.5)], 2.0, WHITE);
        // Round caps of radius 1 add pi; their antialiasing is a linear ramp, good to a fraction of a pixel.
        assert!((sum(&canvas) - 160.0 - std::f64::consts::PI).abs() < 1.5, "{}", sum(&canvas));
    }

    #[test]
    fn nothing_is_drawn_outside_the_picture() {
        let mut canvas = Canvas::new(4, 4, [0; 3]);
        canvas.fill(Rect::new(3, 3, 10, 10), WHITE);
        canvas.fill_between(-5.0, -5.0, 1.0, 1.0, WHITE);
        canvas.line(&[(-10.0, -10.0), (-2.0, -3.0)], 1.0, WHITE);
        canvas.line(&[(30.0, 30.0), (40.0, 40.0)], 1.0, WHITE);
        canvas.blend(-1, 2, WHITE, 1.0);
        assert_eq!(sum(&canvas), 2.0);
    }
}
