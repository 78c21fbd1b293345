//! The inputs of a surface shader: their values, defaults and lines.

use std::collections::BTreeMap;

use roxmltree::Node;

use super::document::{Said, line, said};
use crate::error::Error;

/// The default of an input, and the type of its value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Default {
    Number(f64),
    Colour([f64; 3]),
    /// A value that makes no difference to our material: it is not read.
    Ignored,
    /// A direction: only a connection says anything.
    Direction,
}

/// An input of a shader: its name and its default.
pub(super) type Input = (&'static str, Default);

/// From ACEScg to linear Rec. 709, as MaterialX converts (`acescg_to_lin_rec709` of its `cmlib_ng.mtlx`).
const FROM_ACESCG: [[f64; 3]; 3] = [
    [1.705050992658, -0.621792120657, -0.083258872001],
    [-0.130256417507, 1.140804736575, -0.010548319068],
    [-0.024003356805, -0.128968976065, 1.15297233287],
];

/// The inputs of a shader; a number is a grey.
pub(super) struct Shader {
    values: BTreeMap<&'static str, [f64; 3]>,
    /// The lines of the inputs that the file gives.
    lines: BTreeMap<&'static str, u32>,
    /// The line of the shader.
    line: u32,
    warnings: Vec<(u32, String)>,
}

impl Shader {
    /// Reads the inputs of a shader that are in this list.
    pub(super) fn read(shader: Node<'_, '_>, inputs: &[Input]) -> Result<Self, Error> {
        let mut read = Self {
            values: BTreeMap::new(),
            lines: BTreeMap::new(),
            line: line(shader),
            warnings: Vec::new(),
        };
        for (name, default) in inputs {
            match default {
                Default::Number(number) => _ = read.values.insert(name, [*number; 3]),
                Default::Colour(rgb) => _ = read.values.insert(name, *rgb),
                Default::Ignored | Default::Direction => {}
            }
        }
        for input in shader.children().filter(|child| child.has_tag_name("input")) {
            let name = input.attribute("name").unwrap_or_default();
            match inputs.iter().find(|(known, _)| *known == name) {
                Some((known, default)) => read.input(known, default, input)?,
                None => {
                    let tag = shader.tag_name().name();
                    read.warnings
                        .push((line(input), format!("{tag} has no input {name:?}, which is not read")));
                }
            }
        }
        Ok(read)
    }

    fn input(&mut self, name: &'static str, default: &Default, input: Node<'_, '_>) -> Result<(), Error> {
        let line = line(input);
        let (text, space) = match (said(input), default) {
            (_, Default::Ignored) | (Said::Nothing, _) => return Ok(()),
            (Said::Value(..), Default::Direction) => return Ok(()),
            (Said::Node(node), Default::Direction) => {
                self.warnings.push((line, format!("{name} is {node}, which is not read")));
                return Ok(());
            }
            (Said::Node(node), Default::Number(_) | Default::Colour(_)) => {
                let default = self.values.get(name).map(|rgb| words(*rgb)).unwrap_or_default();
                let message = format!("{name} is {node}, which is not read; the default {default} is used");
                self.warnings.push((line, message));
                return Ok(());
            }
            (Said::Value(text, space), Default::Number(_) | Default::Colour(_)) => (text, space),
        };
        let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        let value = match (default, numbers.as_deref()) {
            (Default::Number(_), Some([number])) => [*number; 3],
            (Default::Colour(_), Some([red, green, blue])) => {
                self.linear([*red, *green, *blue], space, (line, name))
            }
            _ => {
                let expected = match default {
                    Default::Number(_) => "a number",
                    _ => "three numbers, such as \"0.8, 0.2, 0.1\"",
                };
                return Err(Error::damaged(format!("line {line}: {name} is {text:?}; expected {expected}")));
            }
        };
        self.values.insert(name, value);
        self.lines.insert(name, line);
        Ok(())
    }

    /// A colour of a colour space in linear Rec. 709.
    fn linear(&mut self, rgb: [f64; 3], space: Option<&str>, (line, name): (u32, &str)) -> [f64; 3] {
        match space {
            None | Some("lin_rec709" | "lin_rec709_scene" | "none" | "") => rgb,
            Some("srgb_texture" | "srgb_rec709_scene") => {
                rgb.map(|channel| f64::from(envmap::srgb_decode(channel as f32)))
            }
            Some("acescg" | "lin_ap1" | "lin_ap1_scene") => {
                FROM_ACESCG.map(|row| row.iter().zip(rgb).map(|(factor, channel)| factor * channel).sum())
            }
            Some(other) => {
                let message = format!("{name} is in the colour space {other}, and is taken as lin_rec709");
                self.warnings.push((line, message));
                rgb
            }
        }
    }

    /// An input that is a number.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.values.get(name).map_or(0.0, |value| value[0])
    }

    /// An input that is a number from 0 to 1; others are limited to it.
    pub(super) fn share(&mut self, name: &'static str) -> f64 {
        self.shares(name)[0]
    }

    /// An input that is a colour of numbers from 0 to 1; others are limited to it.
    pub(super) fn shares(&mut self, name: &'static str) -> [f64; 3] {
        let value = self.values.get(name).copied().unwrap_or_default();
        let limited = value.map(|channel| channel.clamp(0.0, 1.0));
        // Conversions of colours leave a little.
        if value.iter().zip(limited).any(|(value, limited)| (value - limited).abs() > 1e-3) {
            self.warn(name, format!("{} is limited to {}", words(value), words(limited)));
        }
        limited
    }

    /// Adds a warning about an input.
    pub(super) fn warn(&mut self, name: &str, message: impl AsRef<str>) {
        let line = self.lines.get(name).copied().unwrap_or(self.line);
        self.warnings.push((line, format!("{name}: {}", message.as_ref())));
    }

    /// Warns about an input if it is not neutral, whatever its default.
    pub(super) fn left_out(&mut self, name: &str, neutral: f64, message: &str) {
        if self.values.get(name).is_some_and(|value| *value != [neutral; 3]) {
            self.warn(name, message);
        }
    }

    /// The warnings, each once, in the order of their lines.
    pub(super) fn warnings(mut self) -> Vec<String> {
        self.warnings.sort();
        self.warnings.dedup();
        self.warnings.into_iter().map(|(line, message)| format!("line {line}: {message}")).collect()
    }
}

/// A colour in a message, with four decimals; a grey is one number.
fn words(rgb: [f64; 3]) -> String {
    let [red, green, blue] = rgb.map(|channel| (channel * 1e4).round() / 1e4);
    if red == green && green == blue { red.to_string() } else { format!("{red}, {green}, {blue}") }
}
