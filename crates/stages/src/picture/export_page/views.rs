//! Adds the forms of pairs to a page, as many as fit.

use std::sync::Arc;

use engine::{Failure, Reporter, Steps};
use preview::{Light, web};
use preview_page::{Blobs, Document, Form, FormEntry};
use rayon::prelude::*;

use super::comparison::Comparison;
use super::forms::Forms;
use super::pairs::Pair;
use crate::values::quantity;

/// What the texels along the edge of a cube are divided by at most.
const MAX_DIVISOR: usize = 8;

/// The form of a pair, by the pair's place.
type PairForm = (usize, Form);

/// What forms are made from, and the page that they are added to.
pub(crate) struct Views<'a> {
    pub(crate) forms: &'a Forms,
    pub(crate) pairs: &'a [Pair],
    /// The backgrounds, by the places of environments.
    pub(crate) skies: &'a [Arc<Light>],
    pub(crate) document: &'a mut Document,
    pub(crate) blobs: &'a mut Blobs,
    pub(crate) comparison: &'a mut Comparison,
    /// The most bytes of all parts of the page.
    pub(crate) room: usize,
    pub(crate) reporter: &'a Reporter,
}

/// What happens to a form that does not fit.
#[derive(Clone, Copy, PartialEq)]
enum Excess {
    /// It is left out.
    LeftOut,
    /// None is added after it.
    Refused,
}

impl Views<'_> {
    /// Adds all forms that fit: first one of each pair, on smaller cubes until those of all pairs fit.
    pub(crate) fn add_all(&mut self) -> Result<(), Failure> {
        let (mut first, mut others): (Vec<PairForm>, Vec<PairForm>) = (Vec::new(), Vec::new());
        for form in Form::ALL {
            for (place, pair) in self.pairs.iter().enumerate() {
                if self.forms.shows(form, pair) {
                    let has_first = first.iter().any(|(other, _)| *other == place);
                    let forms = if form.shows_material() && !has_first { &mut first } else { &mut others };
                    forms.push((place, form));
                }
            }
        }

        let before = self.blobs.next();
        let has_cubes = first.iter().any(|(_, form)| form.has_cube());
        let (mut divisor, most) = (1, if has_cubes { MAX_DIVISOR } else { 1 });
        while divisor < most && !self.add(&first, divisor, Excess::Refused)? {
            self.blobs.forget(before);
            self.comparison.forget();
            self.document.pairs.iter_mut().for_each(|pair| pair.views.clear());
            divisor *= 2;
        }
        if divisor == most {
            self.add(&first, divisor, Excess::LeftOut)?;
        }
        if divisor > 1 {
            let fraction = format!("reflections in more than 1/{divisor} of their texels along an edge");
            self.document.left_out.insert(0, fraction);
        }
        self.add(&others, 1, Excess::LeftOut)?;
        Ok(())
    }

    /// Adds forms, on cubes whose texels along an edge are divided by a number. Returns whether all of them
    /// fit.
    fn add(&mut self, forms: &[PairForm], divisor: usize, excess: Excess) -> Result<bool, Failure> {
        let mut fits = true;
        let steps = Steps::new(self.reporter, if self.comparison.draws() { 2 } else { 1 } * forms.len());
        for some in forms.chunks(2 * rayon::current_num_threads()) {
            let made = some.par_iter().map(|&(place, form)| {
                self.reporter.check_cancelled()?;
                let pair = &self.pairs[place];
                let made =
                    self.forms.look(form, pair, &self.skies[pair.environment], divisor, self.reporter)?;
                let view = web::WebView::of(&made.look, form.mode())?;
                steps.step()?;
                Ok(view.map(|view| (place, form, made, view)))
            });
            let made = made.collect::<Result<Vec<_>, Failure>>()?;
            for (place, form, made, view) in made.into_iter().flatten() {
                let pair = &self.pairs[place];
                let (before, cost) = (self.blobs.next(), view.cost);
                let view = self.blobs.view(view);
                if self.blobs.bytes() > self.room {
                    fits = false;
                    if excess == Excess::Refused {
                        return Ok(false);
                    }
                    let bytes = quantity::size(self.blobs.since(before) as u64);
                    self.document.left_out.push(format!("{} as {}: {bytes}", pair.title(), form.label()));
                    self.blobs.forget(before);
                } else {
                    let mut entry = FormEntry::new(self.document.form(form), view, cost);
                    self.comparison.add(&mut entry, pair, form, made, &steps)?;
                    self.document.pairs[place].views.push(entry);
                }
                if self.comparison.draws() {
                    steps.step()?;
                }
            }
        }
        Ok(fits)
    }
}
