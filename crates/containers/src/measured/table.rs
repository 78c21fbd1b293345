//! `.csv`: a plain isotropic table, made by hand or by another program.
//!
//! The first line is `theta_i,theta_o,phi,r,g,b`; each other line is one measurement: the angles of light and
//! view from the normal and the azimuth between them, in degrees (phi = 0: on the same side, 180: the
//! mirror's), then the BRDF in 1/sr, linear Rec. 709. Order and spacing of the lines do not matter; `#`
//! starts a comment. The BRDF is taken to be reciprocal, so that half of a symmetric table is enough.

use brdf::scattered::Sample;

use super::scattered::{Found, direction, interpolated};
use super::text;
use crate::error::Error;

const HEADER: [&str; 6] = ["theta_i", "theta_o", "phi", "r", "g", "b"];

pub(super) fn read(bytes: &[u8]) -> Result<Found, Error> {
    let mut lines = text::lines(bytes)?;
    let expected = || format!("the header {:?}", HEADER.join(","));
    let (line, header) = lines
        .next()
        .ok_or_else(|| Error::truncated(format!("no line holds anything; expected {}", expected())))?;
    if !header.split(',').map(str::trim).eq(HEADER) {
        return Err(Error::damaged(format!("line {line}: {header:?} stands first; expected {}", expected())));
    }
    let mut samples = Vec::new();
    for (line, row) in lines {
        let words: Vec<&str> = row.split(',').map(str::trim).collect();
        let &[theta_i, theta_o, phi, r, g, b] = words.as_slice() else {
            let found = words.len();
            return Err(Error::damaged(format!(
                "line {line}: {found} values; expected 6 ({})",
                HEADER.join(",")
            )));
        };
        let incident = direction(text::theta(line, theta_i, "theta_i", true)?, 0.0);
        let theta_o = text::theta(line, theta_o, "theta_o", true)?;
        let outgoing = direction(theta_o, text::azimuth(line, phi, "phi", true)?);
        let value = [text::value(line, r, "r")?, text::value(line, g, "g")?, text::value(line, b, "b")?];
        samples.push(Sample { incident, outgoing, value });
    }
    interpolated(&samples, Vec::new())
}
