//! What reports measured of the forms that a page shows, read from the JSON files that they export.

use std::collections::BTreeMap;

use engine::{Digest, Failure, Inputs};
use preview_page::{Form, FormError, MeasuredBy};
use serde::Deserialize;

use super::forms::FormLook;
use super::pairs::Pair;
use crate::picture::report_schema::REPORT_SCHEMA;

/// The port of reports, and the file of a report that is read.
pub(crate) const PORT: &str = "report";
pub(crate) const ENDING: &str = ".json";

/// The reports that are connected.
pub(crate) struct Reports(Vec<Report>);

/// What a report says of a form.
pub(crate) struct ReportedForm {
    pub(crate) error: FormError,
    /// The bytes of the exported files, if the report knows them.
    pub(crate) bytes: Option<u64>,
    /// The textures and lights that were measured.
    pub(crate) texture: String,
}

/// What every version of a report says of itself.
#[derive(Deserialize)]
struct Version {
    schema: u64,
    specula: Kind,
}

#[derive(Deserialize)]
struct Kind {
    kind: String,
}

#[derive(Deserialize)]
struct Report {
    specula: Recipe,
    pairs: Vec<ReportedPair>,
}

/// How the report was made: the digests of what arrived at each of its ports.
#[derive(Deserialize)]
struct Recipe {
    inputs: BTreeMap<String, Digests>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Digests {
    One(String),
    Many(Vec<String>),
}

#[derive(Deserialize)]
struct ReportedPair {
    environment: String,
    material: String,
    exports: Vec<ReportedExport>,
}

#[derive(Deserialize)]
struct ReportedExport {
    method: String,
    /// The stops; JSON has no number for infinitely many.
    p95: Option<f64>,
    p99: Option<f64>,
    file: Option<u64>,
    texture: String,
}

impl Reports {
    /// The reports at the port.
    ///
    /// # Errors
    /// If a file is not that of a report, or of another version.
    pub(crate) fn of(inputs: &Inputs) -> Result<Self, Failure> {
        let files = inputs.many_files(PORT)?.into_iter();
        let reports = files.map(|(_, bytes)| Report::read(&bytes)).collect::<Result<_, _>>();
        Ok(Self(reports.map_err(|failure| failure.context(format!("the port {PORT}")))?))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What the first report that measured a form of a pair says of it.
    pub(crate) fn form(&self, form: Form, pair: &Pair, look: &FormLook) -> Option<ReportedForm> {
        self.0.iter().find_map(|report| {
            let export = report.pair(pair)?.export(form, look)?;
            let is_own = look.export.is_none_or(|files| report.used_at_any(files));
            let error = FormError { p95: export.p95?, p99: export.p99?, by: MeasuredBy::Report };
            is_own.then(|| ReportedForm { error, bytes: export.file, texture: export.texture.clone() })
        })
    }
}

impl Report {
    fn read(bytes: &[u8]) -> Result<Self, Failure> {
        let foreign =
            || Failure::new("the file is not that of a report").help("connect a stage of the kind report");
        let version: Version = serde_json::from_slice(bytes).map_err(|_| foreign())?;
        if version.specula.kind != "report" {
            return Err(foreign());
        }
        if version.schema != REPORT_SCHEMA {
            let message =
                format!("the report has version {} of its JSON, not {REPORT_SCHEMA}", version.schema);
            return Err(Failure::new(message).help("build the report and the page with the same program"));
        }
        serde_json::from_slice(bytes).map_err(|error| Failure::new(format!("the report's JSON: {error}")))
    }

    /// The pair, if the report was made from the same light and material.
    fn pair(&self, pair: &Pair) -> Option<&ReportedPair> {
        let is_own = pair.made_from.iter().all(|(port, digest)| self.used(port, *digest));
        let is_named =
            |of: &&ReportedPair| of.environment == pair.environment_name && of.material == pair.name;
        self.pairs.iter().filter(|_| is_own).find(is_named)
    }

    /// Whether what an export says of its files arrived at some port of the report.
    fn used_at_any(&self, files: Digest) -> bool {
        self.specula.inputs.keys().any(|port| self.used(port, files))
    }

    /// Whether an artifact arrived at a port of the report, or nothing did.
    fn used(&self, port: &str, digest: Digest) -> bool {
        let digest = digest.to_string();
        match self.specula.inputs.get(port) {
            None => true,
            Some(Digests::One(used)) => *used == digest,
            Some(Digests::Many(used)) => used.contains(&digest),
        }
    }
}

impl ReportedPair {
    /// The export of a form; in light without lamps an SHRM with them in it is the one without. Only plain
    /// maps of each part of a material have a method of their own.
    fn export(&self, form: Form, look: &FormLook) -> Option<&ReportedExport> {
        let of = |method: &str| self.exports.iter().find(|export| export.method == method);
        match form {
            Form::Compact => of("taps"),
            Form::Plain if look.has_map_of_each_part => of("part-maps"),
            Form::Shrm if look.has_lamps_in_map => of("shrm"),
            Form::Shrm => of("shrm-separate").or_else(|| of("shrm")),
            Form::Cabral => of("cabral"),
            Form::KautzMcCool => of("kautz-mccool"),
            Form::Plain => of("reflection-map"),
            Form::Table | Form::Transfer | Form::Irradiance | Form::Mirror => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In light that is black, an error may be infinite: the report is read, and has no figure of the form.
    #[test]
    fn an_infinite_error_is_no_figure() {
        let report = |p95: f64| {
            let export = serde_json::json!({
                "method": "taps", "p95": p95, "p99": 0.5, "file": null, "texture": "levels"
            });
            let pair = serde_json::json!({
                "environment": "sky", "material": "gold", "exports": [export]
            });
            let recipe = serde_json::json!({ "kind": "report", "inputs": {} });
            let report = serde_json::json!({ "schema": REPORT_SCHEMA, "specula": recipe, "pairs": [pair] });
            Report::read(report.to_string().as_bytes()).unwrap().pairs[0].exports[0].p95
        };
        assert_eq!((report(f64::INFINITY), report(0.25)), (None, Some(0.25)));
    }
}
