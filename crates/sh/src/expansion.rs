//! A function on the sphere given by its real spherical-harmonic coefficients.

/// The highest l of an expansion, inclusive: 0 to [`Degree::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Degree(u16);

/// A degree beyond [`Degree::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("degree {0} is past the highest supported, {max}", max = Degree::MAX.get())]
pub struct DegreeTooHigh(pub usize);

impl Degree {
    /// Degree 0: constants.
    pub const ZERO: Self = Self(0);

    /// The highest degree whose recurrences are tested: 2048.
    pub const MAX: Self = Self(2048);

    /// A checked degree.
    ///
    /// # Errors
    /// If `l` is past [`Degree::MAX`].
    pub const fn new(l: usize) -> Result<Self, DegreeTooHigh> {
        if l <= Self::MAX.0 as usize { Ok(Self(l as u16)) } else { Err(DegreeTooHigh(l)) }
    }

    /// The degree as a number.
    pub const fn get(self) -> usize {
        self.0 as usize
    }

    /// The number of coefficients: (degree + 1)^2.
    pub const fn rows(self) -> usize {
        (self.get() + 1) * (self.get() + 1)
    }
}

/// An RGB function on the sphere: f(w) = sum over rows of `rows[l*l + l + m] * Y_lm(w)`.
///
/// Real orthonormal harmonics without Condon-Shortley phase, in Specula's frame; the unit is that of the
/// function (radiance, for lighting).
#[derive(Clone, Debug, PartialEq)]
pub struct Expansion {
    degree: Degree,
    rows: Vec<[f64; 3]>,
}

impl Expansion {
    /// The zero function.
    pub fn zero(degree: Degree) -> Self {
        Self { degree, rows: vec![[0.0; 3]; degree.rows()] }
    }

    /// An expansion from its rows, in order l*l + l + m; `None` if their number is not (degree + 1)^2.
    pub fn from_coefficients(degree: Degree, rows: Vec<[f64; 3]>) -> Option<Self> {
        (rows.len() == degree.rows()).then_some(Self { degree, rows })
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The coefficients, RGB, in order l*l + l + m.
    pub fn coefficients(&self) -> &[[f64; 3]] {
        &self.rows
    }

    /// The coefficients, RGB, in order l*l + l + m.
    pub fn coefficients_mut(&mut self) -> &mut [[f64; 3]] {
        &mut self.rows
    }

    /// The coefficient of (l, m), m in -l ..= l.
    pub fn get(&self, l: usize, m: isize) -> [f64; 3] {
        self.rows[(l * l + l).wrapping_add_signed(m)]
    }

    /// Returns the same function cut, or padded with zeros, to another degree.
    pub fn to_degree(&self, degree: Degree) -> Self {
        let mut rows = self.rows.clone();
        rows.resize(degree.rows(), [0.0; 3]);
        Self { degree, rows }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degree_is_inclusive() {
        let degree = Degree::new(2).unwrap();
        assert_eq!(degree.rows(), 9);
        assert_eq!(Expansion::zero(degree).coefficients().len(), 9, "l = 0, 1 and 2: three bands");
        assert_eq!(Degree::new(2049), Err(DegreeTooHigh(2049)));
    }

    #[test]
    fn another_degree_cuts_or_pads() {
        let rows = (0..9).map(|row| [f64::from(row); 3]).collect();
        let expansion = Expansion::from_coefficients(Degree::new(2).unwrap(), rows).unwrap();
        assert_eq!(expansion.get(2, -1), [5.0; 3]);
        assert_eq!(expansion.to_degree(Degree::new(1).unwrap()).coefficients().len(), 4);
        let padded = expansion.to_degree(Degree::new(3).unwrap());
        assert_eq!((padded.get(2, 2), padded.get(3, 0)), ([8.0; 3], [0.0; 3]));
        assert_eq!(Expansion::from_coefficients(Degree::new(1).unwrap(), vec![[0.0; 3]; 5]), None);
    }
}
