//! The choice of the taps and lights of an environment and a material.

use containers::tensors::{EnvironmentScales, MaterialTaps};
use engine::{Failure, Reporter, choice};
use taps::{Accuracy, AnyTable, ScaleSpace, Trade, Truth, widths_for};

use super::degree_choice::Accept;
use crate::values::{UntilStopped, quantity};

choice! {
    /// The lights beside the map of a pair.
    pub(crate) enum PairLights {
        /// As many of the strongest as make the pair accurate enough at the least cost.
        Auto = "auto",
        /// All that the scale space has.
        All = "all",
    }
}

/// The views toward which a pair is measured: fewer if each needs the mean over all turns of the surface.
const VIEWS: [usize; 2] = [2000, 100];

/// The tables of a material, with more taps from one to the next: those that know the tangent if the material
/// depends on it.
pub(crate) fn tables(taps: &MaterialTaps) -> Vec<AnyTable<'_>> {
    if !taps.facets.is_empty() {
        return taps.facets.iter().map(|fitted| AnyTable::View(&fitted.table)).collect();
    }
    let all = taps.others.iter().chain([&taps.fitted]);
    all.map(|fitted| AnyTable::Angle(&fitted.table)).collect()
}

/// The lights and the taps of a pair with the least cost that are within what is accepted, otherwise the most
/// accurate, with a warning.
pub(crate) fn choose<'a>(
    scales: &EnvironmentScales,
    taps: &'a MaterialTaps,
    lights: PairLights,
    Accept(accept): Accept,
    reporter: &Reporter,
) -> Result<(ScaleSpace, AnyTable<'a>), Failure> {
    let all = scales.space.lights().len();
    let counts: Vec<usize> = match lights {
        PairLights::All => vec![all],
        // Each of a few, then every fourth.
        PairLights::Auto => {
            (0..=all).filter(|count| *count <= 8 || count % 4 == 0 || *count == all).collect()
        }
    };
    let tables = tables(taps);
    let knows_tangent = tables.iter().any(|table| matches!(table, AnyTable::View(_)));
    let found = reporter.until_stopped(|stop| {
        let (points, material) = (&scales.points, &taps.material);
        let truth = if knows_tangent {
            Truth::turned(points, material, VIEWS[0], stop)
        } else {
            let views = VIEWS[usize::from(material.turns() > 1 || !material.is_isotropic())];
            Truth::new(points, material, views, stop)
        };
        let tables: Vec<&AnyTable<'_>> = tables.iter().collect();
        truth?.trade(&tables, &counts, &scales.space, material, stop).map_err(Failure::from)
    })?;
    let chosen = Trade::cheapest(&found, accept).ok_or_else(|| Failure::new("nothing was measured"))?;
    let Accuracy { p95, p99 } = chosen.accuracy;
    let text = format!(
        "{} and {}: 95 % of views are within {p95:.2} stops, 99 % within {p99:.2}",
        quantity::count(chosen.taps, "tap"),
        quantity::count(chosen.lights, "light"),
    );
    if chosen.accuracy.excess(accept) <= 1.0 {
        reporter.note(text);
    } else {
        reporter.warn(format!("{text}; `accept` is [{}, {}]{}", accept[0], accept[1], help(scales, taps)));
    }
    Ok((scales.space.keeping(chosen.lights), tables[chosen.table]))
}

/// What may bring a pair closer to the truth.
fn help(scales: &EnvironmentScales, taps: &MaterialTaps) -> String {
    let mut remedies = Vec::new();
    let needed = widths_for(&taps.material).edge();
    if needed > scales.space.widths().edge() {
        remedies.push(format!("resolution = {needed} of scale-space for such a sharp highlight"));
    }
    if !scales.space.lights().is_empty() {
        remedies.push("more `lights` of scale-space".to_owned());
    }
    if taps.others.is_empty() && taps.facets.is_empty() && taps.fitted.table.taps() > 0 {
        remedies.push("taps = \"auto\" of fit-taps".to_owned());
    }
    if remedies.is_empty() { String::new() } else { format!("; what may help: {}", remedies.join(", ")) }
}
