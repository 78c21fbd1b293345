//! Labels in Inter, the typeface in `assets/inter` (SIL Open Font License).
//!
//! The files hold Latin, Greek and Cyrillic letters with tabular digits; any other letter is shown as a box.
//! There is no shaping: letters are placed one after another with pair kerning, and a combining accent is
//! centred on its letter.

use std::borrow::Cow;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, Point, PxScale};

use super::canvas::{Canvas, Rect};

/// The weight of a typeface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// The weight of running text.
    Regular,
    /// The weight of names and titles.
    SemiBold,
}

/// The weight, size and colour of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// The weight.
    pub weight: Weight,
    /// The size in pixels per em.
    pub size: f32,
    /// The colour, sRGB.
    pub colour: [u8; 3],
}

/// The position of a text in its box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// The text is at the left edge of its box.
    Left,
    /// The text is in the middle of its box.
    Centre,
    /// The text is at the right edge of its box.
    Right,
}

static REGULAR: LazyLock<FontRef<'static>> =
    LazyLock::new(|| typeface(include_bytes!("../../assets/inter/Inter-Regular-subset.ttf")));
static SEMI_BOLD: LazyLock<FontRef<'static>> =
    LazyLock::new(|| typeface(include_bytes!("../../assets/inter/Inter-SemiBold-subset.ttf")));

#[allow(clippy::expect_used)]
fn typeface(bytes: &'static [u8]) -> FontRef<'static> {
    FontRef::try_from_slice(bytes).expect("the font files are part of the program")
}

/// A glyph and the position of its origin, in pixels from the start of the text.
struct PlacedGlyph {
    glyph: GlyphId,
    x: f32,
}

impl Style {
    fn font(&self) -> &'static FontRef<'static> {
        match self.weight {
            Weight::Regular => &REGULAR,
            Weight::SemiBold => &SEMI_BOLD,
        }
    }

    /// The number of pixels per font unit.
    fn unit(&self) -> f32 {
        self.size / self.font().units_per_em().unwrap_or(1000.0)
    }

    /// The height of a capital letter in pixels.
    fn capital(&self) -> f32 {
        0.727 * self.size
    }

    /// The width of a text in pixels.
    pub fn width(&self, text: &str) -> f32 {
        self.set(text).1
    }

    /// The text, or its beginning and its end around an ellipsis, in at most `width` pixels.
    ///
    /// Related files often differ only at the end of their names, so both ends are kept.
    pub fn elide<'a>(&self, text: &'a str, width: f32) -> Cow<'a, str> {
        if self.width(text) <= width {
            return Cow::Borrowed(text);
        }
        let letters: Vec<char> = text.chars().collect();
        let kept = |count: usize| {
            let head: String = letters[..count.div_ceil(2)].iter().collect();
            let tail: String = letters[letters.len() - count / 2..].iter().collect();
            format!("{}…{}", head.trim_end(), tail.trim_start())
        };
        // Widths grow with the number of letters but for kerning, so the longest that fits is searched
        // downward from a bound by halving.
        let (mut low, mut high) = (0, letters.len());
        while low + 1 < high {
            let middle = usize::midpoint(low, high);
            if self.width(&kept(middle)) <= width { low = middle } else { high = middle }
        }
        let mut count = low;
        while count > 0 && self.width(&kept(count)) > width {
            count -= 1;
        }
        let short = kept(count);
        if self.width(&short) <= width { Cow::Owned(short) } else { Cow::Borrowed("") }
    }

    /// Draws a text in a box, elided to its width, capitals centred in its height. Returns the width drawn.
    pub fn draw(&self, canvas: &mut Canvas, place: Rect, align: Align, text: &str) -> f32 {
        let text = self.elide(text, place.width as f32);
        let (glyphs, width) = self.set(&text);
        let slack = (place.width as f32 - width).max(0.0);
        let left = place.x as f32
            + match align {
                Align::Left => 0.0,
                Align::Centre => slack / 2.0,
                Align::Right => slack,
            };
        let baseline = (place.y as f32 + (place.height as f32 + self.capital()) / 2.0).round();
        let font = self.font();
        // ab_glyph's scale is the height from ascender to descender.
        let scale = PxScale::from(self.unit() * font.height_unscaled());
        for PlacedGlyph { glyph, x } in glyphs {
            let position = Point { x: left + x, y: baseline };
            if let Some(outline) = font.outline_glyph(glyph.with_scale_and_position(scale, position)) {
                let (x0, y0) = (outline.px_bounds().min.x as i64, outline.px_bounds().min.y as i64);
                outline.draw(|x, y, coverage| {
                    canvas.blend(x0 + i64::from(x), y0 + i64::from(y), self.colour, coverage);
                });
            }
        }
        width
    }

    /// The glyphs of a text, and its width.
    fn set(&self, text: &str) -> (Vec<PlacedGlyph>, f32) {
        let (font, unit) = (self.font(), self.unit());
        let mut glyphs: Vec<PlacedGlyph> = Vec::new();
        let mut pen = 0.0;
        // The glyph before and its horizontal middle, for kerning and accents.
        let mut before: Option<(GlyphId, f32)> = None;
        for letter in text.chars() {
            let glyph = font.glyph_id(if letter.is_control() { ' ' } else { letter });
            let advance = unit * font.h_advance_unscaled(glyph);
            let bounds = font.outline(glyph).map(|outline| outline.bounds);
            if advance == 0.0 {
                if let (Some((_, middle)), Some(bounds)) = (before, bounds) {
                    let x = middle - unit * (bounds.min.x + bounds.max.x) / 2.0;
                    glyphs.push(PlacedGlyph { glyph, x });
                }
                continue;
            }
            if let Some((before, _)) = before {
                pen += unit * font.kern_unscaled(before, glyph);
            }
            let middle = bounds.map_or(advance / 2.0, |b| unit * (b.min.x + b.max.x) / 2.0);
            before = Some((glyph, pen + middle));
            glyphs.push(PlacedGlyph { glyph, x: pen });
            pen += advance;
        }
        (glyphs, pen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STYLE: Style = Style { weight: Weight::Regular, size: 16.0, colour: [255; 3] };
    const NAMES: [&str; 9] = [
        "gold",
        "Überraschung_für_Žofie",
        "алюминий-матовый",
        "χρυσός",
        "素材の金属",
        "e\u{301}toile\u{327} d'e\u{301}te\u{301}",
        "tab\tnew\nline\u{0}",
        "a_very_long_name_of_a_material_that_a_studio_made_for_a_shot_in_2019_v0043",
        "🙂🙃",
    ];

    /// The smallest rectangle around what was drawn: left, top, right, bottom.
    fn drawn(canvas: &Canvas) -> Option<(usize, usize, usize, usize)> {
        let lit = (0..canvas.width() * canvas.height()).filter(|i| canvas.pixels()[*i] != [0; 3]);
        lit.map(|i| (i % canvas.width(), i / canvas.width())).fold(None, |bounds, (x, y)| {
            let (left, top, right, bottom) = bounds.unwrap_or((x, y, x + 1, y + 1));
            Some((left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)))
        })
    }

    #[test]
    fn text_stays_in_its_box() {
        for weight in [Weight::Regular, Weight::SemiBold] {
            for align in [Align::Left, Align::Centre, Align::Right] {
                for width in [5, 40, 100, 300] {
                    for name in NAMES {
                        let place = Rect::new(20, 20, width, 24);
                        let mut canvas = Canvas::new(width + 40, 64, [0; 3]);
                        Style { weight, ..STYLE }.draw(&mut canvas, place, align, name);
                        if let Some((left, top, right, bottom)) = drawn(&canvas) {
                            // A letter's outline may reach a pixel past its advance.
                            assert!(left + 1 >= 20 && right <= 21 + width, "{name} {align:?} {width}");
                            assert!(top >= 20 && bottom <= 44, "{name}: rows {top} to {bottom}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn long_names_keep_both_ends() {
        let name = NAMES[7];
        let short = STYLE.elide(name, 200.0);
        assert!(STYLE.width(&short) <= 200.0 && STYLE.width(&short) > 170.0, "{short}");
        let (head, tail) = short.split_once('…').unwrap();
        assert!(name.starts_with(head) && name.ends_with(tail) && !tail.is_empty());
        assert_eq!(STYLE.elide("gold", 200.0), "gold");
        assert_eq!(STYLE.elide(name, 1.0), "");
    }

    #[test]
    fn every_letter_of_a_label_has_a_glyph() {
        let used = "ABCXYZabcxyz0123456789.,:;·×−–—…±°%()[]/\\+=<>≤≥≈→∞Σℓ²³\"'_#&@áßøœžşğłđ";
        for letter in used.chars() {
            assert_ne!(STYLE.font().glyph_id(letter), GlyphId(0), "{letter}");
        }
        assert_eq!(STYLE.font().glyph_id('素'), GlyphId(0));
    }

    #[test]
    fn digits_align_in_columns() {
        let width = STYLE.width("0");
        assert!(('0'..='9').all(|digit| STYLE.width(&digit.to_string()) == width));
    }

    #[test]
    fn a_combining_accent_takes_no_room_and_stands_on_its_letter() {
        assert_eq!(STYLE.width("e\u{301}"), STYLE.width("e"));
        let (glyphs, _) = STYLE.set("e\u{301}");
        let bounds = |placed: &PlacedGlyph| {
            let bounds = STYLE.font().outline(placed.glyph).unwrap().bounds;
            (placed.x + STYLE.unit() * bounds.min.x, placed.x + STYLE.unit() * bounds.max.x)
        };
        let (letter, accent) = (bounds(&glyphs[0]), bounds(&glyphs[1]));
        assert!(((letter.0 + letter.1) - (accent.0 + accent.1)).abs() < 1e-4);
    }

    #[test]
    fn kerning_draws_a_pair_together() {
        assert!(STYLE.width("AV") < STYLE.width("A") + STYLE.width("V") - 0.5);
    }
}
