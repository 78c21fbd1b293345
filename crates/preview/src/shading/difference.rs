//! The difference of two modes, and its RMS over a picture.

use glam::Vec3;

/// The absolute difference, not amplified.
pub fn difference(of: Vec3, from: Vec3) -> Vec3 {
    (of - from).abs()
}

/// The sums of squares over channels and the samples that hit a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squares {
    /// The number of samples that hit a surface.
    pub samples: u64,
    /// The sum of squared differences.
    pub difference: f64,
    /// The sum of squares of the reference.
    pub from: f64,
}

impl Squares {
    /// Adds a sample.
    pub fn add(&mut self, difference: Vec3, from: Vec3) {
        self.samples += 1;
        self.difference += f64::from(difference.length_squared());
        self.from += f64::from(from.length_squared());
    }

    /// Adds the sums of another part of the picture.
    pub fn join(&mut self, other: Self) {
        self.samples += other.samples;
        self.difference += other.difference;
        self.from += other.from;
    }

    /// [`crate::Picture::relative_rms`]; `None` if no sample hits a surface, or the reference is black.
    pub fn relative_rms(self) -> Option<f64> {
        match (self.difference, self.from) {
            _ if self.samples == 0 => None,
            (0.0, _) => Some(0.0),
            (_, 0.0) => None,
            (difference, from) => Some((difference / from).sqrt()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_relative_rms_covers_all_samples_and_channels() {
        let pairs = [(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.5, 2.0, 2.0)), (Vec3::ZERO, Vec3::ONE)];
        let mut squares = Squares::default();
        for (of, from) in pairs {
            squares.add(difference(of, from), from);
        }
        let expected = ((0.25 + 1.0 + 3.0) / (2.25 + 4.0 + 4.0 + 3.0_f64)).sqrt();
        assert!((squares.relative_rms().unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn without_surfaces_or_with_a_black_reference_there_is_no_rms() {
        let mut squares = Squares::default();
        assert_eq!(squares.relative_rms(), None);
        squares.add(Vec3::ZERO, Vec3::ZERO);
        assert_eq!(squares.relative_rms(), Some(0.0));
        squares.add(Vec3::ONE, Vec3::ZERO);
        assert_eq!(squares.relative_rms(), None);
    }
}
