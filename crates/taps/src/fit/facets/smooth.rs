//! Facet taps that change smoothly with the view: each parameter is a polynomial over the disc of views.
//!
//! If mirrors along the tangent and across it change nothing, taps come in orbits: a tap that is its own
//! mirror image, pairs, and quadruples. The taps of an orbit share their polynomials, and the parity of these
//! makes each of the mirrored views see the mirrored taps.

use rayon::prelude::*;

use super::view::{OF_TAP, View};
use crate::facets::disc;
use crate::fit::least_squares::{Normal, minimise};
use crate::fit::view::LAST_NORMAL;
use crate::widths::Widths;

/// Taps that are mirror images of each other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Orbit {
    /// Whether a tap is its own image in the mirror that turns x over, and in that which turns y over.
    pub(super) is_own: [bool; 2],
    /// The signs of x and y of each tap.
    pub(super) images: Vec<[f64; 2]>,
    /// p, q, the place between levels and the logarithm of the weight of the first tap, seen head on.
    pub(super) start: [f64; OF_TAP],
}

impl Orbit {
    /// Each tap by itself, for lobes without mirror images.
    pub(super) fn apart(self) -> impl Iterator<Item = Self> {
        let [p, q, x, weight] = self.start;
        self.images.into_iter().map(move |[sx, sy]| Self {
            is_own: [false; 2],
            images: vec![[1.0; 2]],
            start: [sx * p, sy * q, x, weight],
        })
    }
}

/// What a parameter means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// The slope along the tangent (0) or across it (1).
    Slope(usize),
    /// The place between levels.
    Level,
    /// The place between kernels about the normal.
    Kernel,
    /// The logarithm of a weight.
    Weight,
}

/// A polynomial of the basis: r^m cos(m phi) or r^m sin(m phi), times T_a(2 r^2 / last^2 - 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Term {
    m: usize,
    is_sine: bool,
    a: usize,
}

impl Term {
    /// Whether a mirror that turns over x, or y, changes the sign.
    fn is_odd(self) -> [bool; 2] {
        [(self.m % 2 == 1) != self.is_sine, self.is_sine]
    }
}

/// The steepest slope of a tap.
const STEEPEST: f64 = 2.0;

/// The taps about the normal.
const NORMALS: usize = 1;

/// The greatest m.
const AZIMUTHS: usize = 4;

/// The angle of the last view from the normal, 88 degrees: beyond, taps stay as they are.
pub(super) const LAST_ANGLE: f64 = 1.536;

/// The square of the distance of the last view from the centre of the disc, 1 - sqrt(cos(LAST_ANGLE)).
const LAST: f64 = 0.813_5;

/// The terms up to a degree in r.
fn terms(degree: usize) -> Vec<Term> {
    let mut terms = Vec::new();
    for m in 0..=AZIMUTHS.min(degree) {
        for is_sine in [false, true] {
            if m == 0 && is_sine {
                continue;
            }
            terms.extend((0..=(degree - m) / 2).map(|a| Term { m, is_sine, a }));
        }
    }
    terms
}

/// The values of terms at a place in the disc.
fn term_values(terms: &[Term], [x, y]: [f64; 2]) -> Vec<f64> {
    let t = 2.0 * (x * x + y * y) / LAST - 1.0;
    let mut radial = vec![1.0, t];
    while radial.len() < 16 {
        radial.push(2.0 * t * radial[radial.len() - 1] - radial[radial.len() - 2]);
    }
    let mut powers = vec![[1.0, 0.0]];
    for m in 0..AZIMUTHS {
        let [c, s] = powers[m];
        powers.push([c * x - s * y, c * y + s * x]);
    }
    terms.iter().map(|term| powers[term.m][usize::from(term.is_sine)] * radial[term.a]).collect()
}

/// A function over the disc: the indices of its terms, and its first coefficient.
#[derive(Clone, Debug)]
struct Function {
    meaning: Meaning,
    terms: Vec<usize>,
    first: usize,
}

/// A parameter of a view: a function of the mirrored view, with a sign.
#[derive(Clone, Copy, Debug)]
struct Parameter {
    function: usize,
    sign: f64,
    image: [f64; 2],
}

/// The form of smooth taps.
#[derive(Clone, Debug)]
struct Form {
    levels: usize,
    terms: Vec<Term>,
    functions: Vec<Function>,
    parameters: Vec<Parameter>,
    /// The number of coefficients.
    len: usize,
}

impl Form {
    fn new(orbits: &[Orbit], is_quarter: bool, degree: usize, levels: usize) -> Self {
        let terms = terms(degree);
        let mut form = Self { levels, terms, functions: Vec::new(), parameters: Vec::new(), len: 0 };
        for orbit in orbits {
            let first = form.functions.len();
            for meaning in [Meaning::Slope(0), Meaning::Slope(1), Meaning::Level, Meaning::Weight] {
                let is_odd = [0, 1].map(|axis| meaning == Meaning::Slope(axis));
                form.add(meaning, orbit.is_own, is_odd);
            }
            for image in &orbit.images {
                let signs = [image[0], image[1], 1.0, 1.0];
                form.parameters.extend((signs.iter().enumerate()).map(|(k, sign)| Parameter {
                    function: first + k,
                    sign: *sign,
                    image: *image,
                }));
            }
        }
        for _ in 0..NORMALS {
            for meaning in [Meaning::Kernel, Meaning::Weight] {
                form.parameters.push(Parameter {
                    function: form.functions.len(),
                    sign: 1.0,
                    image: [1.0; 2],
                });
                form.add(meaning, [is_quarter; 2], [false; 2]);
            }
        }
        form
    }

    /// Adds a function, whose terms are odd as said where it is its own mirror image.
    fn add(&mut self, meaning: Meaning, is_own: [bool; 2], is_odd: [bool; 2]) {
        let fits = |term: &Term| {
            let odd = term.is_odd();
            (0..2).all(|axis| !is_own[axis] || odd[axis] == is_odd[axis])
        };
        let terms: Vec<usize> =
            self.terms.iter().enumerate().filter(|(_, term)| fits(term)).map(|(index, _)| index).collect();
        let first = self.len;
        self.len += terms.len();
        self.functions.push(Function { meaning, terms, first });
    }

    /// What each coefficient of a parameter's function adds to it at a view.
    fn factors(&self, values: &[f64], parameter: Parameter) -> Vec<f64> {
        let factor = |index: &usize| {
            let odd = self.terms[*index].is_odd();
            let mirrored = (0..2).filter(|axis| odd[*axis] && parameter.image[*axis] < 0.0).count();
            parameter.sign * values[*index] * if mirrored == 1 { -1.0 } else { 1.0 }
        };
        self.functions[parameter.function].terms.iter().map(factor).collect()
    }

    /// The parameters at a place in the disc.
    fn at(&self, coefficients: &[f64], place: [f64; 2]) -> Vec<f64> {
        let values = term_values(&self.terms, place);
        let parameter = |parameter: &Parameter| {
            let function = &self.functions[parameter.function];
            let factors = self.factors(&values, *parameter);
            let value: f64 = factors.iter().zip(&coefficients[function.first..]).map(|(a, b)| a * b).sum();
            match function.meaning {
                Meaning::Slope(_) => value.clamp(-STEEPEST, STEEPEST),
                Meaning::Level => value.clamp(0.0, (self.levels - 1) as f64 - 1e-3),
                Meaning::Kernel => value.clamp(0.0, LAST_NORMAL),
                Meaning::Weight => value.clamp(-14.0, 4.0),
            }
        };
        self.parameters.iter().map(parameter).collect()
    }
}

/// The polynomials of all parameters.
#[derive(Clone, Debug)]
pub(super) struct Smooth {
    form: Form,
    coefficients: Vec<f64>,
    is_quarter: bool,
    orbits: Vec<Orbit>,
}

impl Smooth {
    /// Taps that are the same toward every view: those of the orbits, and one about the normal. Without
    /// mirror images each orbit is one tap.
    pub(super) fn constant(orbits: Vec<Orbit>, is_quarter: bool, widths: Widths) -> Self {
        let form = Form::new(&orbits, is_quarter, 0, widths.len());
        let taps: usize = orbits.iter().map(|orbit| orbit.images.len()).sum();
        let weight = -math::ln((taps + NORMALS) as f64);
        let starts = orbits.iter().flat_map(|orbit| orbit.start).chain([1.3, weight].repeat(NORMALS));
        let mut coefficients = vec![0.0; form.len];
        for (function, start) in form.functions.iter().zip(starts) {
            if !function.terms.is_empty() {
                coefficients[function.first] = start;
            }
        }
        Self { form, coefficients, is_quarter, orbits }
    }

    /// The taps of these polynomials as polynomials of a higher degree.
    pub(super) fn raised(&self, degree: usize) -> Self {
        let form = Form::new(&self.orbits, self.is_quarter, degree, self.form.levels);
        let mut coefficients = vec![0.0; form.len];
        for (old, new) in self.form.functions.iter().zip(&form.functions) {
            for (k, index) in old.terms.iter().enumerate() {
                let term = self.form.terms[*index];
                let at = new.terms.iter().position(|index| form.terms[*index] == term);
                if let Some(at) = at {
                    coefficients[new.first + at] = self.coefficients[old.first + k];
                }
            }
        }
        Self { form, coefficients, ..self.clone() }
    }

    /// The coefficients that fit these views best; those of parameters that are not `free` stay.
    pub(super) fn fitted(&self, views: &[View<'_>], free: impl Fn(Meaning) -> bool + Copy + Sync) -> Self {
        let form = &self.form;
        let evaluate = |coefficients: &[f64], normal: Option<&mut Normal>| -> f64 {
            let of = |view: &View<'_>| form.at(coefficients, disc(view.direction));
            let Some(normal) = normal else {
                let costs: Vec<f64> = views.par_iter().map(|view| view.evaluate(&of(view), None)).collect();
                return costs.iter().sum();
            };
            let each = views.par_iter().map(|view| {
                let mut normal = Normal::new(form.parameters.len());
                let cost = view.evaluate(&of(view), Some(&mut normal));
                let values = term_values(&form.terms, disc(view.direction));
                let factors = form.parameters.iter().map(|parameter| {
                    if free(form.functions[parameter.function].meaning) {
                        form.factors(&values, *parameter)
                    } else {
                        vec![0.0; form.functions[parameter.function].terms.len()]
                    }
                });
                (cost, normal, factors.collect::<Vec<_>>())
            });
            let each: Vec<_> = each.collect();
            add_views(form, &each, normal);
            each.iter().map(|view| view.0).sum()
        };
        let coefficients = minimise(self.coefficients.clone(), evaluate, |_| ());
        Self { coefficients, ..self.clone() }
    }

    /// The cost at some views.
    pub(super) fn cost(&self, views: &[View<'_>]) -> f64 {
        let of = |view: &View<'_>| view.evaluate(&self.at(disc(view.direction)), None);
        views.par_iter().map(of).collect::<Vec<f64>>().iter().sum()
    }

    /// The number of taps that are not about the normal.
    pub(super) fn taps(&self) -> usize {
        self.orbits.iter().map(|orbit| orbit.images.len()).sum()
    }

    /// The parameters at a place in the disc.
    pub(super) fn at(&self, place: [f64; 2]) -> Vec<f64> {
        let squared = place[0] * place[0] + place[1] * place[1];
        let scale = (LAST / squared.max(1e-12)).sqrt().min(1.0);
        self.form.at(&self.coefficients, place.map(|value| scale * value))
    }
}

/// Adds the normal equations of views to those of the coefficients, a function's rows at a time.
fn add_views(form: &Form, views: &[(f64, Normal, Vec<Vec<f64>>)], whole: &mut Normal) {
    let size = whole.size;
    let rows = form.functions.par_iter().enumerate().map(|(index, function)| {
        let count = function.terms.len();
        let width = function.first + count;
        let (mut matrix, mut vector) = (vec![0.0; count * width], vec![0.0; count]);
        let mut line = vec![0.0; width];
        for (_, normal, factors) in views {
            for (i, parameter) in form.parameters.iter().enumerate() {
                if parameter.function != index {
                    continue;
                }
                line.fill(0.0);
                for (j, other) in form.parameters.iter().enumerate() {
                    let first = form.functions[other.function].first;
                    if first <= function.first {
                        let value = normal.matrix[i.max(j) * normal.size + i.min(j)];
                        let to = &mut line[first..];
                        to.iter_mut().zip(&factors[j]).for_each(|(sum, factor)| *sum += value * factor);
                    }
                }
                for (a, factor) in factors[i].iter().enumerate() {
                    let to = &mut matrix[a * width..][..width];
                    to.iter_mut().zip(&line).for_each(|(sum, value)| *sum += factor * value);
                    vector[a] += factor * normal.vector[i];
                }
            }
        }
        (matrix, vector)
    });
    let rows: Vec<(Vec<f64>, Vec<f64>)> = rows.collect();
    for (function, (matrix, vector)) in form.functions.iter().zip(rows) {
        let width = function.first + function.terms.len();
        for (a, value) in vector.iter().enumerate() {
            let row = function.first + a;
            whole.vector[row] += value;
            let to = &mut whole.matrix[row * size..][..=row];
            to.iter_mut().zip(&matrix[a * width..]).for_each(|(sum, value)| *sum += value);
        }
    }
}
