//! How many colours of a picture lie outside of Rec. 709, for a message.

/// The share of the light that may move without a warning. What 8 bits round moves less.
const UNNOTICED: f64 = 1e-4;

/// The pixels that lay outside of Rec. 709 before they were brought in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OutsideGamut {
    pub(crate) pixels: usize,
    /// The number of all pixels.
    pub(crate) of: usize,
    /// The sum of the luminances of these pixels.
    luminance: f64,
    /// The sum of the luminances of all pixels.
    all_luminance: f64,
    /// The sum of the changes of the channels of these pixels.
    moved: f64,
    /// The sum of the channels of all pixels.
    light: f64,
}

impl OutsideGamut {
    /// Counts a pixel of this luminance, whose channels add up to `light` and were moved by `moved`.
    pub(crate) fn add(&mut self, is_outside: bool, luminance: f64, moved: f64, light: f64) {
        self.all_luminance += luminance;
        self.light += light;
        if is_outside {
            self.pixels += 1;
            self.luminance += luminance;
            self.moved += moved;
        }
    }

    /// These pixels and those of another part of the picture.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            pixels: self.pixels + other.pixels,
            of: self.of + other.of,
            luminance: self.luminance + other.luminance,
            all_luminance: self.all_luminance + other.all_luminance,
            moved: self.moved + other.moved,
            light: self.light + other.light,
        }
    }

    /// A sentence about these pixels, if there are any.
    fn message(&self) -> Option<String> {
        let percent = |part: f64, whole: f64| percent(if whole > 0.0 { part / whole } else { 0.0 });
        (self.pixels > 0).then(|| {
            format!(
                "{} {} ({} of the image, {} of its light) outside Rec. 709 moved toward their \
                 grey of the same luminance until no channel was negative, which changed {} of the light",
                self.pixels,
                if self.pixels == 1 { "pixel" } else { "pixels" },
                percent(self.pixels as f64, self.of as f64),
                percent(self.luminance, self.all_luminance),
                percent(self.moved, self.light)
            )
        })
    }

    /// Adds the sentence to a picture's warnings, or to its notes if hardly any light moved.
    pub(crate) fn report(self, warnings: &mut Vec<String>, notes: &mut Vec<String>) {
        let messages = if self.moved > UNNOTICED * self.light { warnings } else { notes };
        messages.extend(self.message());
    }
}

/// A share in percent, to two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        _ if percent <= 0.0 => "0 %".into(),
        _ if percent < 1e-4 => "less than 0.0001 %".into(),
        _ => {
            let digits = (1.0 - math::log10(percent).floor()).max(0.0) as usize;
            format!("{percent:.digits$} %")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_has_two_digits() {
        for (share, text) in [
            (0.0, "0 %"),
            (1e-9, "less than 0.0001 %"),
            (3.6e-6, "0.00036 %"),
            (0.00041, "0.041 %"),
            (0.0123, "1.2 %"),
            (0.5, "50 %"),
        ] {
            assert_eq!(percent(share), text);
        }
    }

    #[test]
    fn a_move_that_nobody_sees_is_a_note() {
        let (mut warnings, mut notes) = (Vec::new(), Vec::new());
        let mut outside = OutsideGamut { of: 2, ..OutsideGamut::default() };
        outside.add(true, 1.0, 1e-5, 3.0);
        outside.add(false, 1.0, 0.0, 3.0);
        outside.report(&mut warnings, &mut notes);
        assert!(warnings.is_empty());
        assert!(notes[0].starts_with("1 pixel (50 % of the image, 50 % of its light)"), "{notes:?}");
        outside.add(true, 1.0, 0.1, 3.0);
        outside.report(&mut warnings, &mut notes);
        assert_eq!((warnings.len(), notes.len()), (1, 1));
    }
}
