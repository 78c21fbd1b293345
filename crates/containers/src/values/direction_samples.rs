//! Directions that were drawn, as CSV, and the points of the unit square from which they are drawn.
//!
//! The first line of a table of directions names its columns; each other line is one direction:
//!
//! | column | meaning |
//! | --- | --- |
//! | `u`, `v` | the point of the unit square |
//! | `x`, `y`, `z` | the direction, a unit vector in Specula's frame, +Z up |
//! | `pdf` | the density with which the direction was drawn, in 1/sr |
//! | `weight` | the integrand over the density, signed |
//!
//! Numbers are the shortest that read back as the same 32-bit float.

use super::measured::{lines, number};
use crate::error::{Error, ErrorKind};

/// The first line of a table of directions.
pub const DIRECTION_COLUMNS: &str = "u,v,x,y,z,pdf,weight";

/// The first line that a list of points may have.
const POINT_COLUMNS: &str = "u,v";

/// The largest number below 1 of 32 bits.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Directions that were drawn, one of each slice for every direction.
#[derive(Clone, Copy, Debug)]
pub struct DirectionSamples<'a> {
    /// The points of the unit square.
    pub points: &'a [[f32; 2]],
    /// Unit vectors, +Z up.
    pub directions: &'a [[f32; 3]],
    /// The densities with which they were drawn, in 1/sr.
    pub densities: &'a [f32],
    /// The integrand over the density.
    pub weights: &'a [f32],
}

impl DirectionSamples<'_> {
    /// Refuses slices of different lengths, and numbers that are not finite.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let unwritable = |message: String| Err(Error::new(ErrorKind::Unwritable, message));
        let count = self.points.len();
        if [self.directions.len(), self.densities.len(), self.weights.len()] != [count; 3] {
            return unwritable("expected one point, density and weight for each direction".into());
        }
        match (0..count).find(|index| !self.row(*index).iter().all(|value| value.is_finite())) {
            Some(index) => unwritable(format!(
                "direction {index}: expected numbers that 32 bits can hold, found {:?}",
                self.row(index)
            )),
            None => Ok(()),
        }
    }

    fn row(&self, index: usize) -> [f32; 7] {
        let ([u, v], [x, y, z]) = (self.points[index], self.directions[index]);
        [u, v, x, y, z, self.densities[index], self.weights[index]]
    }
}

/// Directions as a table, one on each line.
///
/// # Errors
/// If the slices have different lengths, or a number is not finite.
pub fn write_csv_directions(samples: &DirectionSamples<'_>) -> Result<Vec<u8>, Error> {
    samples.check().map_err(|error| error.within("CSV"))?;
    let mut text = format!("{DIRECTION_COLUMNS}\n");
    for index in 0..samples.points.len() {
        text.push_str(&samples.row(index).map(|number| number.to_string()).join(","));
        text.push('\n');
    }
    Ok(text.into_bytes())
}

/// Points of the unit square: two numbers on each line, separated by a comma, each 0 or more and below 1. The
/// first line may be `u,v`; `#` starts a comment. Rounded down to the largest 32-bit float below 1 if they
/// are nearer to 1 than that.
///
/// # Errors
/// If there is no point, or a line is anything else: the message has the line's number.
pub fn read_csv_points(bytes: &[u8]) -> Result<Vec<[f32; 2]>, Error> {
    let mut points = Vec::new();
    for (index, (line, row)) in lines(bytes)?.enumerate() {
        let words: Vec<&str> = row.split(',').map(str::trim).collect();
        if index == 0 && words.iter().copied().eq(POINT_COLUMNS.split(',')) {
            continue;
        }
        let &[u, v] = words.as_slice() else {
            let count = words.len();
            let values = if count == 1 { "value" } else { "values" };
            return Err(Error::damaged(format!(
                "line {line}: {count} {values}; expected two, such as 0.25,0.5"
            )));
        };
        points.push([coordinate(line, u, "u")?, coordinate(line, v, "v")?]);
    }
    if points.is_empty() {
        return Err(Error::truncated("no line holds a point; expected two numbers a line, such as 0.25,0.5"));
    }
    Ok(points)
}

fn coordinate(line: usize, word: &str, name: &str) -> Result<f32, Error> {
    let expected = "a number that is 0 or more and below 1";
    let value: f64 = number(line, word, expected)?;
    if !(0.0..1.0).contains(&value) {
        return Err(Error::damaged(format!("line {line}: {name} is {word}; expected {expected}")));
    }
    // -0 is 0.
    Ok((value as f32 + 0.0).min(BELOW_ONE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_line_for_each_direction() {
        let samples = DirectionSamples {
            points: &[[0.0, 0.5], [0.25, 0.1]],
            directions: &[[1.0, 0.0, 0.0], [0.0, -0.6, 0.8]],
            densities: &[0.25, 1e-9],
            weights: &[-3.0, 0.1],
        };
        let text = write_csv_directions(&samples).unwrap();
        let expected = "u,v,x,y,z,pdf,weight\n0,0.5,1,0,0,0.25,-3\n0.25,0.1,0,-0.6,0.8,0.000000001,0.1\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
        let infinite = DirectionSamples { weights: &[0.0, f32::INFINITY], ..samples };
        let error = write_csv_directions(&infinite).unwrap_err().to_string();
        assert!(error.contains("direction 1: expected numbers that 32 bits can hold"), "{error}");
        assert!(write_csv_directions(&DirectionSamples { points: &[], ..samples }).is_err());
    }

    #[test]
    fn points_are_two_numbers_a_line() {
        let read = |text: &str| read_csv_points(text.as_bytes()).unwrap();
        assert_eq!(read("0.25,0.5\n"), [[0.25, 0.5]]);
        assert_eq!(
            read("\u{feff}u, v\r\n# dots\r\n0 , -0\r\n\r\n.5,1e-3 # one\r\n"),
            [[0.0, 0.0], [0.5, 1e-3]]
        );
        assert_eq!(read("0.9999999999,0.5"), [[BELOW_ONE, 0.5]]);
        assert!(read("0,-0")[0][1].is_sign_positive());
    }

    #[test]
    fn a_line_that_is_no_point_is_named() {
        let coordinate = "a number that is 0 or more and below 1";
        for (text, expected) in [
            ("", "no line holds a point; expected two numbers a line, such as 0.25,0.5".to_owned()),
            ("u,v\n# none\n", "no line holds a point; expected two numbers a line, such as 0.25,0.5".into()),
            ("0,0\n0.5\n", "line 2: 1 value; expected two, such as 0.25,0.5".into()),
            ("0,0,0\n", "line 1: 3 values; expected two, such as 0.25,0.5".into()),
            ("0,0\n\n0.5,1\n", format!("line 3: v is 1; expected {coordinate}")),
            ("-1e-9,0\n", format!("line 1: u is -1e-9; expected {coordinate}")),
            ("u,v\nNaN,0\n", format!("line 2: u is NaN; expected {coordinate}")),
            ("0,inf\n", format!("line 1: v is inf; expected {coordinate}")),
            ("0,0\nu,v\n", format!("line 2: \"u\" is not a number; expected {coordinate}")),
            ("0;0\n", "line 1: 1 value; expected two, such as 0.25,0.5".into()),
        ] {
            assert_eq!(read_csv_points(text.as_bytes()).unwrap_err().to_string(), expected, "{text:?}");
        }
        assert!(read_csv_points(b"0,0\n\xff").unwrap_err().to_string().contains("is not text"));
    }
}
