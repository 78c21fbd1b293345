//! Draws a BRDF table, for `specula inspect`: each coefficient over the views, and the energy of each degree.
//!
//! The arrangement is that of [KSS02, fig. 2]: a row for each degree with its coefficients, red where they
//! are positive and blue where they are negative, and below them the squares of each degree, summed. Each
//! square is the map of views of the table, cut off at the horizon.

use std::cmp::Ordering;

use brdf::BrdfTable;
use preview::drawing::{Align, Canvas, Rect};

use super::sheet::{Picture, theme};
use crate::values::percent;

/// The width of the picture.
const WIDTH: usize = 1680;
const MARGIN: usize = 40;
/// The height above the first row, which the title takes.
const HEAD: usize = 126;
/// The gap between maps; [`LABEL`] is the room for a row's name at its left.
const GAP: usize = 6;
const LABEL: usize = 130;
/// The largest edge of a map, and the edge of those of the energy.
const MAX_EDGE: usize = 150;
const CAPTION: usize = 30;

/// The maps that are drawn of one material of a table.
struct TableMaps<'a> {
    table: &'a BrdfTable,
    q: usize,
    /// The greatest coefficient, and the greatest energy of a degree.
    greatest: [f64; 2],
    /// The energy of each degree over all views.
    energies: Vec<f64>,
}

impl<'a> TableMaps<'a> {
    fn new(table: &'a BrdfTable, q: usize) -> Self {
        let mut maps = Self { table, q, greatest: [0.0; 2], energies: Vec::new() };
        let size = table.size();
        let solid_angle = |texel: usize| {
            let [x, y] = [texel % size, texel / size].map(|k| (2 * k + 1) as f64 / size as f64 - 1.0);
            let square = x * x + y * y;
            if square < 1.0 { 4.0 / math::powi(1.0 + square, 2) } else { 0.0 }
        };
        for l in 0..=table.degree().get() {
            let mut energy = 0.0;
            for texel in 0..size * size {
                for row in l * l..(l + 1) * (l + 1) {
                    maps.greatest[0] = maps.greatest[0].max(maps.coefficient(texel, row).abs());
                }
                maps.greatest[1] = maps.greatest[1].max(maps.energy(texel, l));
                energy += maps.energy(texel, l) * solid_angle(texel);
            }
            maps.energies.push(energy);
        }
        maps
    }

    fn channels(&self, texel: usize, row: usize) -> &[f32] {
        let first = (self.q * self.table.size().pow(2) + texel) * self.table.texel();
        &self.table.values()[first + row * self.table.channels()..][..self.table.channels()]
    }

    /// A coefficient in the mean of the channels.
    fn coefficient(&self, texel: usize, row: usize) -> f64 {
        let channels = self.channels(texel, row);
        channels.iter().map(|value| f64::from(*value)).sum::<f64>() / channels.len() as f64
    }

    /// The sum of a degree's squares, the mean of the channels.
    fn energy(&self, texel: usize, l: usize) -> f64 {
        let rows = (l * l..(l + 1) * (l + 1)).flat_map(|row| self.channels(texel, row));
        rows.map(|value| math::powi(f64::from(*value), 2)).sum::<f64>() / self.table.channels() as f64
    }

    /// The pixels of a map of `edge` x `edge` from a colour by texel.
    fn map(&self, edge: usize, colour: impl Fn(usize) -> [u8; 3]) -> Vec<[u8; 3]> {
        let size = self.table.size();
        let pixel = |index: usize| {
            let place = [index % edge, index / edge].map(|k| (k as f64 + 0.5) / edge as f64);
            let [x, y] = place.map(|place| 2.0 * place - 1.0);
            if x * x + y * y > 1.0 {
                return theme::BACKGROUND;
            }
            let [column, row] = place.map(|place| (place * size as f64) as usize);
            colour(row.min(size - 1) * size + column.min(size - 1))
        };
        (0..edge * edge).map(pixel).collect()
    }
}

/// Draws a table: 8-bit sRGB, 1680 pixels wide. Of several materials, the first and the last are drawn.
///
/// Brightness is the square root of a coefficient over the greatest one, so that small ones show, and that of
/// an energy likewise. Of an RGB table the mean of the channels is drawn.
///
/// # Example: a table of degree 2 has nine coefficients in three rows
/// ```
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.8; 3])?);
/// let (table, _) = brdf::tabulate(&chalk, sh::Degree::new(2)?, 32, sh::Stop::NEVER)?;
/// let picture = stages::table_picture("chalk", &table);
/// assert_eq!(picture.width, 1680);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn table_picture(name: &str, table: &BrdfTable) -> Picture {
    let degree = table.degree().get();
    let edge = ((WIDTH - 2 * MARGIN - LABEL - 2 * degree * GAP) / (2 * degree + 1)).min(MAX_EDGE);
    let energy_edge = ((WIDTH - 2 * MARGIN - LABEL - degree * GAP) / (degree + 1)).min(MAX_EDGE);
    let each = (degree + 1) * (edge + GAP) + CAPTION + energy_edge + 2 * CAPTION;
    let materials: &[usize] = if table.count() > 1 { &[0, table.count() - 1] } else { &[0] };
    let height = HEAD + materials.len() * (each + CAPTION) + MARGIN - CAPTION;
    let mut canvas = Canvas::new(WIDTH, height, theme::BACKGROUND);
    let line = |y: usize, height: usize| Rect::new(MARGIN, y, WIDTH - 2 * MARGIN, height);
    theme::TITLE.draw(&mut canvas, line(32, 42), Align::Left, name);
    theme::SUBTITLE.draw(&mut canvas, line(80, 24), Align::Left, &described(table));
    for (place, q) in materials.iter().enumerate() {
        let top = HEAD + place * (each + CAPTION);
        draw(&mut canvas, top, [edge, energy_edge], &TableMaps::new(table, *q));
    }
    Picture { width: canvas.width(), height: canvas.height(), pixels: canvas.pixels().to_vec() }
}

fn draw(canvas: &mut Canvas, top: usize, [edge, energy_edge]: [usize; 2], maps: &TableMaps<'_>) {
    let degree = maps.table.degree().get();
    let [greatest, greatest_energy] = maps.greatest.map(|greatest| greatest.max(f64::MIN_POSITIVE));
    let middle = MARGIN + LABEL + (WIDTH - 2 * MARGIN - LABEL) / 2;
    let label = |y: usize, text: &str, canvas: &mut Canvas| {
        theme::DETAIL.draw(canvas, Rect::new(MARGIN, y, LABEL, 21), Align::Left, text);
    };
    for l in 0..=degree {
        let y = top + l * (edge + GAP);
        let name = if maps.table.count() > 1 && l == 0 {
            format!("material {}: l = 0", maps.q + 1)
        } else {
            format!("l = {l}")
        };
        label(y + edge / 2 - edge.min(21) / 2, &name, canvas);
        let width = (2 * l + 1) * (edge + GAP) - GAP;
        for m in 0..=2 * l {
            let colour = |texel: usize| signed(maps.coefficient(texel, l * l + m) / greatest);
            let x = middle - width / 2 + m * (edge + GAP);
            canvas.place(Rect::new(x, y, edge, edge), &maps.map(edge, colour));
        }
    }
    let y = top + (degree + 1) * (edge + GAP) + CAPTION;
    label(y + energy_edge / 2 - energy_edge.min(21) / 2, "energy", canvas);
    let width = (degree + 1) * (energy_edge + GAP) - GAP;
    let total: f64 = maps.energies.iter().sum();
    for (l, energy) in maps.energies.iter().enumerate() {
        let x = middle - width / 2 + l * (energy_edge + GAP);
        let colour = |texel: usize| {
            let grey = (255.0 * (maps.energy(texel, l) / greatest_energy).sqrt()).round() as u8;
            [grey; 3]
        };
        canvas.place(Rect::new(x, y, energy_edge, energy_edge), &maps.map(energy_edge, colour));
        let share = if total > 0.0 { energy / total } else { 0.0 };
        let line = |below: usize| Rect::new(x, y + energy_edge + below, energy_edge, 21);
        theme::TICK.draw(canvas, line(6), Align::Centre, &format!("l = {l}"));
        theme::TICK.draw(canvas, line(24), Align::Centre, &percent(share));
    }
}

/// The colour of a value: red if it is positive, blue if it is negative, by the root of its size.
fn signed(value: f64) -> [u8; 3] {
    let bright = (255.0 * value.abs().sqrt()).round() as u8;
    match value.partial_cmp(&0.0) {
        Some(Ordering::Greater) => [bright, bright / 6, bright / 8],
        Some(Ordering::Less) => [bright / 8, bright / 4, bright],
        _ => [0; 3],
    }
}

/// `degree 4 · 128 x 128 views · grey · red is positive, blue negative`
fn described(table: &BrdfTable) -> String {
    let size = table.size();
    let colour = if table.channels() == 1 { "grey" } else { "the mean of RGB" };
    let several = match table.count() {
        1 => String::new(),
        count => format!(" · the first and the last of {count} materials"),
    };
    format!(
        "degree {} · {size} × {size} views, x to the right, y up · {colour}{several} · red is positive, blue negative",
        table.degree().get()
    )
}

#[cfg(test)]
mod tests {
    use brdf::{Lambert, Material, Ward, tabulate};
    use sh::{Degree, Stop};

    use super::*;

    fn table(material: &Material) -> BrdfTable {
        tabulate(material, Degree::new(2).unwrap(), 32, Stop::NEVER).unwrap().0
    }

    /// The maps of a matte surface are 1 at l = 0, m = 0; at l = 1 only that of z is not black; degree 2 has
    /// a quarter less (1/2, 1/sqrt(3), sqrt(5)/8 times the albedo).
    #[test]
    fn coefficients_are_red_or_blue_where_they_have_that_sign() {
        let chalk = Material::Lambert(Lambert::new([0.8; 3]).unwrap());
        let table = table(&chalk);
        let picture = table_picture("chalk", &table);
        let edge = MAX_EDGE;
        let middle = MARGIN + LABEL + (WIDTH - 2 * MARGIN - LABEL) / 2;
        let at = |l: usize, m: usize| {
            let width = (2 * l + 1) * (edge + GAP) - GAP;
            let x = middle - width / 2 + m * (edge + GAP) + edge / 2;
            picture.pixels[(HEAD + l * (edge + GAP) + edge / 2) * WIDTH + x]
        };
        assert_eq!(at(1, 1), signed(1.0), "the greatest coefficient");
        let share: f64 = 0.5 * 3f64.sqrt();
        assert_eq!(at(0, 0), signed(share));
        assert!(at(1, 0) < [2, 2, 2] && at(1, 2) < [2, 2, 2], "{:?} {:?}", at(1, 0), at(1, 2));
        assert!(signed(0.25)[0] > signed(0.25)[2] && signed(-0.25)[2] > signed(-0.25)[0]);
    }

    #[test]
    fn the_shares_of_the_degrees_are_those_of_the_table() {
        let chalk = Material::Lambert(Lambert::new([0.8, 0.4, 0.2]).unwrap());
        let table = table(&chalk);
        let maps = TableMaps::new(&table, 0);
        // c_l of a clamped cosine: 1/2, 1/sqrt(3) and sqrt(5)/8, times sqrt(pi) / pi.
        let expected = [1.0 / 4.0, 1.0 / 3.0, 5.0 / 64.0];
        for (found, expected) in maps.energies.iter().zip(expected) {
            assert!((found / maps.energies[0] - 4.0 * expected).abs() < 1e-5, "{:?}", maps.energies);
        }
    }

    #[test]
    fn several_materials_are_drawn_below_each_other() {
        let metal = |y: f64| table(&Material::Ward(Ward::new([0.3, y], [1.0; 3]).unwrap()));
        let one = table_picture("metal", &metal(0.3));
        let both = BrdfTable::joined(&[metal(0.3), metal(0.6), metal(0.9)]).unwrap();
        let both = table_picture("metal", &both);
        assert!(both.height > one.height + 3 * MAX_EDGE && both.pixels.len() == both.height * WIDTH);
        let deepest = tabulate(
            &Material::Lambert(Lambert::new([0.5; 3]).unwrap()),
            Degree::new(14).unwrap(),
            2,
            Stop::NEVER,
        );
        assert_eq!(table_picture("chalk", &deepest.unwrap().0).width, WIDTH);
    }
}
