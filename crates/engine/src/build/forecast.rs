//! What a build would do, without doing it: for a dry run, and for the questions that `explain` and `verify`
//! answer.
//!
//! No item runs, so the output of an item that would run is not known, and all items that need it would run,
//! too.

use std::sync::Arc;

use super::publish::Publisher;
use super::removal_cause::{RemovalCauses, files_changed};
use super::running::Dependent;
use super::session::BuildSession;
use super::up_to_date::{Freshness, UpToDateCheck};
use crate::cancel::Cancel;
use crate::error::Error;
use crate::event::{Event, Reason, Summary};
use crate::kinds::is_left_out;
use crate::plan::{ItemIndex, Plan, Selection};
use crate::storage::{Blob, Cause, Disk, State};

impl BuildSession {
    /// Reports what a build would do; writes nothing. `is_whole` says whether all stages are built.
    ///
    /// # Errors
    /// If the state folder cannot be read, or it is not certain that a source has gone.
    pub(crate) fn dry_run(
        &self,
        plan: &Plan,
        selected: &Selection,
        is_whole: bool,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Summary, Error> {
        let state = self.pool.install(|| State::read(&plan.state))?;
        let disk = Disk::new(state.now, Arc::default(), &Cancel::default());
        let (check, publisher) = self.pool.install(|| {
            rayon::join(|| UpToDateCheck::new(plan, &state, &disk, selected), || Publisher::new(plan, &state))
        });
        check.check_seen()?;
        let mut summary = Summary::default();
        let causes = RemovalCauses::new(&check);
        for (item, file) in publisher.would_remove(plan, selected, is_whole)? {
            summary.removed += 1;
            let because = causes.of(&item);
            events(Event::Removed { item, file, because });
        }
        publisher.leftovers()?.into_iter().for_each(events);
        for (index, forecast) in forecast(&check, selected).into_iter().enumerate() {
            let item = check.name(index);
            match forecast {
                None => {}
                Some(Forecast::Runs(reasons)) => {
                    summary.ran += 1;
                    events(Event::Started { item, reasons, host: None });
                }
                Some(Forecast::Current { outputs, .. }) => {
                    summary.up_to_date += 1;
                    events(Event::UpToDate { item: item.clone(), host: None });
                    for (file, blob) in plan.items[index].files.iter().zip(&outputs) {
                        if publisher.is_in_place(file, blob.digest) {
                            continue;
                        }
                        if is_left_out(blob.digest) {
                            summary.removed += 1;
                            let (item, file) = (item.clone(), file.clone());
                            events(Event::Removed { item, file, because: files_changed(plan, index) });
                        } else {
                            summary.published += 1;
                            let restored = publisher.is_restored(file, blob.digest);
                            let (item, file) = (item.clone(), file.clone());
                            events(Event::Published { item, file, bytes: blob.bytes, restored });
                        }
                    }
                }
            }
        }
        Ok(summary)
    }
}

/// The forecast of what a build would do with an item.
pub(crate) enum Forecast {
    /// The item's result is in the cache.
    Current {
        outputs: Vec<Blob>,
        /// Whether the result is that of an earlier run than the last.
        restored: bool,
    },
    Runs(Vec<Reason>),
}

/// The forecast for each selected item. The output of an item that would run is not known, so all items that
/// need it would run too, unless its output turns out to be the same as before.
pub(crate) fn forecast(check: &UpToDateCheck<'_>, selected: &Selection) -> Vec<Option<Forecast>> {
    let mut forecasts = Vec::<Option<Forecast>>::with_capacity(check.plan.items.len());
    for (index, item) in check.plan.items.iter().enumerate() {
        if !selected.has(index) {
            forecasts.push(None);
            continue;
        }
        if check.is_current(index) {
            let outputs = check.latest(index).map_or_else(Vec::new, |latest| latest.outputs().to_vec());
            forecasts.push(Some(Forecast::Current { outputs, restored: false }));
            continue;
        }
        let outputs = |input: usize| match &forecasts[input] {
            Some(Forecast::Current { outputs, .. }) => Some(&outputs[..]),
            _ => None,
        };
        let known = item.inputs.iter().flatten().all(|input| outputs(*input).is_some());
        let freshness = if known {
            let key = check.key(index, |input| outputs(input).unwrap_or_default());
            check.freshness(&Dependent::without_build(index), key)
        } else {
            Freshness::Run
        };
        forecasts.push(Some(match freshness {
            Freshness::Current { outputs, restored, .. } => {
                Forecast::Current { outputs, restored: restored.is_some() }
            }
            Freshness::Run => Forecast::Runs(check.reasons(index, outputs)),
        }));
    }
    forecasts
}

/// For each stale item, the changes that made it stale.
pub(crate) fn forecast_causes(check: &UpToDateCheck<'_>, forecasts: &[Option<Forecast>]) -> Vec<Vec<Cause>> {
    let outputs = |input: ItemIndex| match &forecasts[input] {
        Some(Forecast::Current { outputs, .. }) => Some(&outputs[..]),
        _ => None,
    };
    let mut causes = Vec::<Vec<Cause>>::with_capacity(forecasts.len());
    for (item, forecast) in forecasts.iter().enumerate() {
        let of_input = |input: ItemIndex| match &causes[input][..] {
            [] => check.last_causes(input),
            causes => causes.to_vec(),
        };
        let begun = match forecast {
            Some(Forecast::Runs(reasons)) => check.causes(item, reasons, of_input),
            Some(Forecast::Current { restored: true, .. }) => {
                check.causes(item, &check.reasons(item, outputs), of_input)
            }
            _ => Vec::new(),
        };
        causes.push(begun);
    }
    causes
}
