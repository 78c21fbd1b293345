//! How far the forms of a page are from brute force: what a report says of each, or else what is measured
//! here.

use std::sync::Arc;

use engine::{Failure, Reporter, Steps};
use preview_page::{Form, FormEntry};

use super::forms::{FormLook, port};
use super::pairs::Pair;
use super::pictures::Pictures;
use super::reported::Reports;

/// What compares forms with brute force: reports, and pictures that are drawn here.
pub(crate) struct Comparison {
    reports: Reports,
    /// Whether forms are drawn, and measured if no report says how far they are off.
    draws: bool,
    pictures: Pictures,
    /// The numbers of forms that were found in a report, that could have been, and that were measured here.
    reported: usize,
    missed: usize,
    measured: usize,
}

impl Comparison {
    pub(crate) fn new(reports: Reports, draws: bool) -> Self {
        Self { reports, draws, pictures: Pictures::default(), reported: 0, missed: 0, measured: 0 }
    }

    /// Whether forms are drawn.
    pub(crate) fn draws(&self) -> bool {
        self.draws
    }

    /// Forgets all forms, and nothing that they were compared with.
    pub(crate) fn forget(&mut self) {
        self.pictures.forget_shown();
        (self.reported, self.missed, self.measured) = (0, 0, 0);
    }

    /// Adds to a form how far it is off, the size of its files, and what a reader ought to know.
    pub(crate) fn add(
        &mut self,
        entry: &mut FormEntry,
        pair: &Pair,
        form: Form,
        made: FormLook,
        steps: &Steps<'_>,
    ) -> Result<(), Failure> {
        let reported = (!made.is_smaller).then(|| self.reports.form(form, pair, &made)).flatten();
        let mut notes = made.notes;
        entry.bytes = made.bytes;
        if let Some(reported) = reported {
            self.reported += 1;
            entry.error = Some(reported.error);
            entry.bytes = entry.bytes.or(reported.bytes);
            notes.push(format!("the report measured {}", reported.texture));
        } else if port(form).is_some() {
            self.missed += 1;
        }
        entry.note = notes.join("; ");
        if self.draws && form.shows_material() && pair.material.is_some() {
            let look = Arc::new(made.look);
            self.pictures.show(pair, form, &look, steps)?;
            if entry.error.is_none() {
                self.measured += 1;
                entry.error = self.pictures.measured(pair, form, &look, steps)?;
            }
        }
        Ok(())
    }

    /// Says whether the reports were of use.
    pub(crate) fn note(&self, reporter: &Reporter) {
        let Self { reported, missed, measured, .. } = *self;
        if !self.reports.is_empty() && reported == 0 && missed > 0 {
            reporter.warn("the report is of other environments, materials or exports than the page");
        }
        if reported > 0 && measured > 0 {
            reporter.note(format!(
                "the stops of {reported} forms are those of the report, and {measured} were measured here"
            ));
        }
    }

    /// The pictures as figures of HTML.
    pub(crate) fn figures(&self) -> Result<String, Failure> {
        self.pictures.figures()
    }
}
