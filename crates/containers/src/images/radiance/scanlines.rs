//! The rows of a Radiance picture.
//!
//! A row is flat (four bytes a pixel), or in the old run lengths (1, 1, 1, n repeats the last pixel,
//! successive ones being digits of base 256), or in the new ones: 2, 2, width in two bytes, then each of the
//! four planes as runs (128 + n, value) and literals (n, values).

use super::input::Input;
use crate::error::Error;

/// Widths that the new run lengths can hold.
const NEW_RUN_LENGTHS: std::ops::Range<usize> = 8..32768;

pub(super) fn read_scanline(input: &mut Input<'_>, line: &mut [[u8; 4]]) -> Result<(), Error> {
    if let [2, 2, high, low, ..] = *input.0
        && high < 128
        && NEW_RUN_LENGTHS.contains(&line.len())
    {
        let width = usize::from(high) << 8 | usize::from(low);
        if width != line.len() {
            return Err(Error::damaged(format!("{width} pixels in a line of {}", line.len())));
        }
        input.take(4)?;
        return (0..4).try_for_each(|plane| read_plane(input, line, plane));
    }
    read_old_run_lengths(input, line)
}

fn read_plane(input: &mut Input<'_>, line: &mut [[u8; 4]], plane: usize) -> Result<(), Error> {
    let overrun = || Error::damaged("a run passes the end of its line");
    let mut position = 0;
    while position < line.len() {
        let code = usize::from(input.take(1)?[0]);
        let count = if code > 128 { code - 128 } else { code };
        if count == 0 {
            return Err(Error::damaged("a run of no pixels"));
        }
        let run = line.get_mut(position..position + count).ok_or_else(overrun)?;
        if code > 128 {
            let value = input.take(1)?[0];
            run.iter_mut().for_each(|pixel| pixel[plane] = value);
        } else {
            for (pixel, value) in run.iter_mut().zip(input.take(count)?) {
                pixel[plane] = *value;
            }
        }
        position += count;
    }
    Ok(())
}

/// Flat pixels, among which (1, 1, 1, n) repeats the one before.
fn read_old_run_lengths(input: &mut Input<'_>, line: &mut [[u8; 4]]) -> Result<(), Error> {
    let mut position = 0;
    let mut shift = 0;
    while position < line.len() {
        let pixel = input.pixel()?;
        if let [1, 1, 1, count] = pixel {
            let Some(before) = position.checked_sub(1) else {
                return Err(Error::damaged("the line begins with a repetition"));
            };
            let count = usize::from(count).checked_shl(shift).unwrap_or(usize::MAX);
            let end = position.saturating_add(count);
            let value = line[before];
            line.get_mut(position..end)
                .ok_or_else(|| Error::damaged("a run passes the end of its line"))?
                .fill(value);
            position = end;
            shift += 8;
        } else {
            line[position] = pixel;
            position += 1;
            shift = 0;
        }
    }
    Ok(())
}

pub(super) fn write_scanline(line: &[[u8; 4]], bytes: &mut Vec<u8>) {
    if !NEW_RUN_LENGTHS.contains(&line.len()) {
        bytes.extend_from_slice(line.as_flattened());
        return;
    }
    bytes.extend_from_slice(&[2, 2, (line.len() >> 8) as u8, line.len() as u8]);
    for plane in 0..4 {
        write_plane(line, plane, bytes);
    }
}

fn write_plane(line: &[[u8; 4]], plane: usize, bytes: &mut Vec<u8>) {
    /// A run shorter than this costs less among literals.
    const WORTH: usize = 4;
    let run_at = |start: usize| {
        line[start..].iter().take(127).take_while(|pixel| pixel[plane] == line[start][plane]).count()
    };
    let mut position = 0;
    while position < line.len() {
        let start = position;
        let mut run = run_at(position);
        while run < WORTH && position < line.len() {
            position += run;
            run = if position < line.len() { run_at(position) } else { 0 };
        }
        for literals in line[start..position].chunks(128) {
            bytes.push(literals.len() as u8);
            bytes.extend(literals.iter().map(|pixel| pixel[plane]));
        }
        if run > 0 {
            bytes.extend_from_slice(&[128 + run as u8, line[position][plane]]);
            position += run;
        }
    }
}
