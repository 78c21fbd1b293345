//! White balance in manifests: a temperature, a colour that was white, or a grey card in the picture.

use engine::{Diagnostic, Failure, Parameter, Range, Ranged, Reporter, Value, ValueKind, unexpected};
use envmap::{Coverage, Image, Layout, temperature_colour, white_balance};
use serde_json::json;

use crate::values::Rgb;

/// The reflectance of a grey card, and what its pixels are after it was exposed for.
const GREY: f64 = 0.18;

/// The factors of red, green and blue by which the light of a picture is multiplied before it is exposed,
/// with a note that says them.
///
/// # Errors
/// The errors of [`GreyCard::factors`], and a card in a source that is a cube.
pub(crate) fn factors(
    white: Option<WhiteBalance>,
    card: Option<GreyCard>,
    image: &Image,
    coverage: Coverage,
    reporter: &Reporter,
) -> Result<Option<[f64; 3]>, Failure> {
    let factors = match card {
        Some(_) if matches!(coverage, Coverage::Whole(Layout::Cube)) => {
            return Err(Failure::new("grey-card: the source is a cube, not one picture")
                .help("measure the colour of the card, and set white-balance to it"));
        }
        Some(card) => Some(card.factors(image)?),
        None => white.and_then(WhiteBalance::factors),
    };
    if let Some([red, green, blue]) = factors {
        reporter.note(format!("red, green and blue are multiplied by {red:.3}, {green:.3} and {blue:.3}"));
    }
    Ok(factors)
}

/// What was white in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum WhiteBalance {
    /// The light of a black body of this temperature, in kelvin.
    Temperature(f64),
    /// A thing of this colour.
    Colour(Rgb),
}

impl WhiteBalance {
    /// The factors of red, green and blue.
    fn factors(self) -> Option<[f64; 3]> {
        white_balance(match self {
            Self::Temperature(kelvin) => temperature_colour(kelvin),
            Self::Colour(colour) => colour.0,
        })
    }
}

impl Parameter for WhiteBalance {
    fn expected() -> String {
        "a temperature from 2000 to 25000 kelvin, or the colour of what was white: [red, green, blue], each above 0"
            .into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let wrong = || unexpected(value, &Self::expected());
        let balance = match &value.kind {
            ValueKind::Array(_) => Self::Colour(Rgb::parse(value)?),
            _ => Self::Temperature(
                f64::parse_in(value, Range::of::<f64>(2000.0..=25000.0)).map_err(|_| wrong())?,
            ),
        };
        balance.factors().map(|_| balance).ok_or_else(wrong)
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Temperature(kelvin) => kelvin.canonical(),
            Self::Colour(colour) => colour.canonical(),
        }
    }

    fn schema() -> serde_json::Value {
        let colour = json!({ "type": "array", "items": { "type": "number", "exclusiveMinimum": 0 }, "minItems": 3, "maxItems": 3 });
        json!({ "oneOf": [{ "type": "number", "minimum": 2000, "maximum": 25000 }, colour] })
    }
}

/// Where a grey card is in a picture: the column of its left edge, the row of its upper one, its width and
/// its height, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GreyCard([usize; 4]);

impl GreyCard {
    /// The factors of red, green and blue by which the mean of the card's pixels becomes a grey of 0.18.
    ///
    /// # Errors
    /// If the card is not within the picture, or is black in a channel.
    fn factors(self, image: &Image) -> Result<[f64; 3], Failure> {
        let [left, top, width, height] = self.0;
        let [columns, rows] = [image.width(), image.height()];
        let within =
            |from: usize, length: usize, all: usize| from.checked_add(length).is_some_and(|end| end <= all);
        if !within(left, width, columns) || !within(top, height, rows) {
            return Err(Failure::new(format!(
                "grey-card: {width} x {height} pixels from column {left} and row {top} are not all within \
                 the {columns} x {rows} picture"
            )));
        }
        let mut sum = [0.0; 3];
        for row in image.pixels().chunks(columns).skip(top).take(height) {
            for pixel in &row[left..left + width] {
                (0..3).for_each(|c| sum[c] += f64::from(pixel[c]));
            }
        }
        let mean = sum.map(|sum| sum / (width * height) as f64);
        let factors = mean.map(|mean| GREY / mean);
        if mean.iter().any(|mean| *mean <= 0.0) || factors.iter().any(|factor| !factor.is_finite()) {
            return Err(Failure::new(format!("grey-card: the mean of its pixels is {mean:?}, which is not a \
                                             grey"))
                .help("give the column and the row of the card's upper left corner, its width and its height, in pixels"));
        }
        Ok(factors)
    }
}

impl Parameter for GreyCard {
    fn expected() -> String {
        "[left, top, width, height] in pixels of the picture, the last two 1 or more".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let number = |value: &Value| match value.kind {
            ValueKind::Integer(number) => usize::try_from(number).ok(),
            _ => None,
        };
        let card = match &value.kind {
            ValueKind::Array(numbers) => numbers.iter().map(number).collect::<Option<Vec<_>>>(),
            _ => None,
        };
        let card = card.and_then(|numbers| <[usize; 4]>::try_from(numbers).ok());
        let card = card.filter(|[.., width, height]| *width > 0 && *height > 0);
        card.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        json!(self.0)
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": { "type": "integer", "minimum": 0 }, "minItems": 4, "maxItems": 4 })
    }
}
