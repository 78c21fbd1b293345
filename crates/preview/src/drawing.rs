//! Lines, rectangles and labels on pictures of 8 bits.

mod canvas;
mod text;

pub use canvas::{Canvas, Rect};
pub use text::{Align, Style, Weight};
