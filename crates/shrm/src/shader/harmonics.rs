//! The real harmonics of w as statements of arithmetic, unrolled from the recurrences in p and q.
//!
//! With c_q + i s_q = (x + i y)^q, Y_pq is f_pq(z) c_q and Y_p,-q is f_pq(z) s_q, where f_qq is a constant
//! and f_pq = a z f_(p-1)q - b f_(p-2)q. For unit w these are polynomials of its coordinates.

use std::f64::consts::PI;
use std::fmt::{Display, Formatter, Result};

use crate::Terms;

/// One line of the sum.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Statement {
    /// Gives a value a name.
    Let(String, Value),
    /// Adds to the sum.
    Add(Addend),
}

/// A factor times a sum of harmonics in azimuth, each times the coefficient of a row; without a name it is 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Addend {
    pub(super) factor: Value,
    pub(super) rows: Vec<(Option<String>, usize)>,
}

/// A sum of products of a constant and names.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Value(Vec<(f32, Vec<String>)>);

impl Display for Value {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        for (k, (constant, names)) in self.0.iter().enumerate() {
            match (k, *constant < 0.0) {
                (0, false) => {}
                (0, true) => formatter.write_str("-")?,
                (_, false) => formatter.write_str(" + ")?,
                (_, true) => formatter.write_str(" - ")?,
            }
            let size = constant.abs();
            if size != 1.0 || names.is_empty() {
                write!(formatter, "{size:?}")?;
                if !names.is_empty() {
                    formatter.write_str(" * ")?;
                }
            }
            formatter.write_str(&names.join(" * "))?;
        }
        Ok(())
    }
}

/// The statements that add up all harmonics of `w` times the coefficients of their rows.
pub(super) fn statements(p: usize, terms: Terms) -> Vec<Statement> {
    let product = |constant: f64, names: &[&str]| {
        (constant as f32, names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    };
    let mut statements = Vec::new();
    let orders = if terms == Terms::Zonal { 0 } else { p };
    let mut start = 0.5 / PI.sqrt();
    for q in 0..=orders {
        if q == 1 {
            statements.push(Statement::Let("c1".into(), Value(vec![product(1.0, &["w.x"])])));
            statements.push(Statement::Let("s1".into(), Value(vec![product(1.0, &["w.y"])])));
        } else if q > 1 {
            let [c, s] = ["c", "s"].map(|wave| format!("{wave}{}", q - 1));
            let cosine = Value(vec![product(1.0, &["w.x", &c]), product(-1.0, &["w.y", &s])]);
            let sine = Value(vec![product(1.0, &["w.x", &s]), product(1.0, &["w.y", &c])]);
            statements.push(Statement::Let(format!("c{q}"), cosine));
            statements.push(Statement::Let(format!("s{q}"), sine));
        }
        if q > 0 {
            start *= ((2 * q + 1) as f64 / (2 * q) as f64).sqrt();
        }
        // Harmonics with q > 0 are real: cosine and sine each have the factor sqrt(2).
        let peak = if q > 0 { 2_f64.sqrt() * start } else { start };
        let name = |p: usize| format!("f{p}_{q}");
        let mut before = f64::INFINITY;
        for p in q..=p {
            let value = if p == q {
                Value(vec![product(peak, &[])])
            } else {
                let a = (((2 * p - 1) * (2 * p + 1)) as f64 / ((p - q) * (p + q)) as f64).sqrt();
                let b = a / before;
                before = a;
                if p == q + 1 {
                    Value(vec![product(a * peak, &["w.z"])])
                } else {
                    let below =
                        if p == q + 2 { product(-b * peak, &[]) } else { product(-b, &[&name(p - 2)]) };
                    Value(vec![product(a, &["w.z", &name(p - 1)]), below])
                }
            };
            // A constant needs no name, and neither has one that is used once.
            let factor = if p == q {
                value
            } else {
                statements.push(Statement::Let(name(p), value));
                Value(vec![product(1.0, &[&name(p)])])
            };
            let rows = match terms {
                Terms::Zonal => vec![(None, p)],
                Terms::All if q == 0 => vec![(None, p * p + p)],
                Terms::All => {
                    vec![(Some(format!("c{q}")), p * p + p + q), (Some(format!("s{q}")), p * p + p - q)]
                }
            };
            statements.push(Statement::Add(Addend { factor, rows }));
        }
    }
    statements
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use sh::{Basis, Degree};
    use sphere::spiral;

    use super::*;

    /// The sum of a value in the arithmetic of a shader.
    fn evaluated(value: &Value, named: &HashMap<String, f32>) -> f32 {
        let product = |(constant, names): &(f32, Vec<String>)| {
            names.iter().fold(*constant, |so_far, name| so_far * named[name])
        };
        value.0.iter().map(product).sum()
    }

    /// The statements, run in 32 bits, give each row its harmonic.
    #[test]
    fn the_statements_are_the_harmonics_of_the_basis() {
        for p in 0..=16 {
            let degree = Degree::new(p).unwrap();
            let (basis, mut y) = (Basis::new(degree), vec![0.0; degree.rows()]);
            for terms in [Terms::All, Terms::Zonal] {
                let statements = statements(p, terms);
                for k in 0..50 {
                    let w = spiral(k, 50);
                    basis.evaluate_into(w, &mut y);
                    let v = w.vector();
                    let mut named: HashMap<String, f32> = [("w.x", v.x), ("w.y", v.y), ("w.z", v.z)]
                        .map(|(name, x)| (name.into(), x as f32))
                        .into();
                    let mut rows = vec![f32::NAN; if terms == Terms::All { degree.rows() } else { p + 1 }];
                    for statement in &statements {
                        match statement {
                            Statement::Let(name, value) => {
                                let value = evaluated(value, &named);
                                assert!(named.insert(name.clone(), value).is_none(), "{name} twice");
                            }
                            Statement::Add(Addend { factor, rows: added }) => {
                                for (wave, row) in added {
                                    let wave = wave.as_ref().map_or(1.0, |wave| named[wave]);
                                    assert!(rows[*row].is_nan(), "row {row} twice");
                                    rows[*row] = evaluated(factor, &named) * wave;
                                }
                            }
                        }
                    }
                    for (row, found) in rows.iter().enumerate() {
                        let expected = if terms == Terms::All { y[row] } else { y[row * row + row] };
                        assert!(
                            (f64::from(*found) - expected).abs() < 2e-5,
                            "P = {p}, {row}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn values_are_written_as_arithmetic() {
        let value = |terms: &[(f32, &[&str])]| {
            Value(terms.iter().map(|(c, names)| (*c, names.iter().map(|n| (*n).into()).collect())).collect())
        };
        for (value, text) in [
            (value(&[(0.5, &[])]), "0.5"),
            (value(&[(1.0, &["a", "b"]), (-1.0, &["c"])]), "a * b - c"),
            (value(&[(-2.5, &["a"]), (3.0, &["b"])]), "-2.5 * a + 3.0 * b"),
        ] {
            assert_eq!(value.to_string(), text);
        }
    }
}
