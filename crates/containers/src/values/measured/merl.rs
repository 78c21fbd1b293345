//! `.binary`: a material of the MERL database (Matusik et al., "A Data-Driven Reflectance Model", 2003).
//!
//! Three little-endian i32 (n_h, n_d, n_phi; 90, 90 and 180), then for red, green and blue in turn n_h n_d
//! n_phi little-endian f64, theta_h slowest, phi_d fastest. The BRDF is 1/1500, 1.15/1500 and 1.66/1500 of
//! them. Entries that the database does not have are negative: most lie where light or view is below the
//! horizon, the others were never measured. Each takes the mean of its neighbours that are known, layer by
//! layer from the border of these inward, so that no lookup meets a hole; a note says how many.

use std::f64::consts::FRAC_PI_2;

use brdf::{Material, Measured, from_half_difference};

use super::scattered::MaterialAndNotes;
use crate::error::{Error, ErrorKind};

/// The factor of an entry, RGB.
const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

const HEADER: usize = 12;

/// The most entries that are read, as [`Measured`] has.
const MOST_ENTRIES: usize = 1 << 24;

/// The shape of the table and the number of its entries, given the beginning of a file and its length.
pub(super) fn declared(beginning: &[u8], length: usize) -> Result<([usize; 3], usize), Error> {
    let (header, _) = beginning.split_at_checked(HEADER).ok_or_else(|| {
        Error::truncated(format!("the file has {length} bytes; expected a header of {HEADER}"))
    })?;
    let (shape, entries) = shape(header)?;
    let expected = HEADER + entries * 24;
    if length != expected {
        let message = format!(
            "the header declares {} x {} x {} entries of 24 bytes, {expected} bytes in all; the file has {length}",
            shape[0], shape[1], shape[2],
        );
        return Err(if length < expected { Error::truncated(message) } else { Error::damaged(message) });
    }
    Ok((shape, entries))
}

pub(super) fn read(bytes: &[u8]) -> Result<MaterialAndNotes, Error> {
    let (shape, entries) = declared(bytes, bytes.len())?;
    let body = &bytes[HEADER..];
    let mut values = vec![[0.0f32; 3]; entries];
    let mut known = vec![true; entries];
    for (index, eight) in body.as_chunks::<8>().0.iter().enumerate() {
        let (channel, entry) = (index / entries, index % entries);
        let value = f64::from_le_bytes(*eight);
        if !value.is_finite() || value > 1e30 {
            let byte = HEADER + 8 * index;
            return Err(Error::damaged(format!(
                "byte {byte}: the value is {value}; expected a finite number, negative where nothing was measured"
            )));
        }
        known[entry] &= value >= 0.0;
        values[entry][channel] = (value * SCALES[channel]) as f32;
    }
    let notes = fill(shape, &mut values, &mut known)?;
    let measured = Measured::new(shape, values).map_err(|error| Error::damaged(error.to_string()))?;
    Ok((Material::Measured(measured), notes))
}

fn shape(header: &[u8]) -> Result<([usize; 3], usize), Error> {
    let declared: Vec<i32> = header.as_chunks::<4>().0.iter().map(|four| i32::from_le_bytes(*four)).collect();
    let shape = [0, 1, 2].map(|axis| usize::try_from(declared[axis]).unwrap_or(0));
    let text = format!("{} x {} x {}", declared[0], declared[1], declared[2]);
    if shape == [90, 90, 360] {
        return Err(Error::unsupported(format!(
            "the table is {text}: a full turn of phi_d, for BRDFs that are not reciprocal; expected 90 x 90 x 180"
        )));
    }
    let entries = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n)).unwrap_or(usize::MAX);
    if entries == 0 {
        return Err(Error::damaged(format!(
            "bytes 0 to 11 declare a table of {text}; expected 90 x 90 x 180"
        )));
    }
    if entries > MOST_ENTRIES {
        let message = format!(
            "bytes 0 to 11 declare a table of {text}, more than {MOST_ENTRIES} entries; expected 90 x 90 x 180"
        );
        return Err(Error::new(ErrorKind::TooLarge, message));
    }
    Ok((shape, entries))
}

/// Fills the unknown entries; says how many there were.
fn fill(shape: [usize; 3], values: &mut [[f32; 3]], known: &mut [bool]) -> Result<Vec<String>, Error> {
    let mut front: Vec<usize> = (0..known.len()).filter(|&entry| !known[entry]).collect();
    if front.is_empty() {
        return Ok(Vec::new());
    }
    if front.len() == known.len() {
        return Err(Error::damaged("every entry is negative: the table holds no measurement"));
    }
    let missing = front.len();
    let seen = front.iter().filter(|&&entry| above_horizon(shape, entry)).count();
    while !front.is_empty() {
        let layer: Vec<(usize, [f32; 3])> = front
            .iter()
            .filter_map(|&entry| {
                let mut sum = [0.0; 3];
                let mut count = 0.0;
                for neighbour in neighbours(shape, entry).filter(|&neighbour| known[neighbour]) {
                    count += 1.0;
                    for channel in 0..3 {
                        sum[channel] += f64::from(values[neighbour][channel]);
                    }
                }
                (count > 0.0).then(|| (entry, sum.map(|sum| (sum / count) as f32)))
            })
            .collect();
        for &(entry, value) in &layer {
            values[entry] = value;
            known[entry] = true;
        }
        front.retain(|&entry| !known[entry]);
    }
    Ok(vec![format!(
        "{missing} of {} entries were not measured, {seen} of them with light and view above the horizon; each became the mean of its neighbours",
        known.len()
    )])
}

/// The entries one step away along each axis; phi_d goes around.
fn neighbours(shape: [usize; 3], entry: usize) -> impl Iterator<Item = usize> {
    let [n_h, n_d, n_phi] = shape;
    let (row, k) = (entry / n_phi, entry % n_phi);
    let (i, j) = (row / n_d, row % n_d);
    let at = move |i: usize, j: usize, k: usize| (i * n_d + j) * n_phi + k;
    [
        (i > 0).then(|| at(i - 1, j, k)),
        (i + 1 < n_h).then(|| at(i + 1, j, k)),
        (j > 0).then(|| at(i, j - 1, k)),
        (j + 1 < n_d).then(|| at(i, j + 1, k)),
        Some(at(i, j, (k + 1) % n_phi)),
        Some(at(i, j, (k + n_phi - 1) % n_phi)),
    ]
    .into_iter()
    .flatten()
}

fn above_horizon(shape: [usize; 3], entry: usize) -> bool {
    let [_, n_d, n_phi] = shape;
    let (row, k) = (entry / n_phi, entry % n_phi);
    let angles = Measured::node(shape, [row / n_d, row % n_d, k]);
    debug_assert!(angles[0] < FRAC_PI_2);
    from_half_difference(angles).iter().all(|direction| direction.vector().z > 1e-9)
}
