//! The forms in which a page shows a material under an environment.

use std::sync::Arc;

use engine::{Digest, ExportedFiles, Failure, Inputs, ItemKey, Reporter};
use preview::{Light, Look, MapSizes};
use preview_page::Form;
use sh::Degree;

use super::pairs::{Pair, fits};
use crate::map::ShrmSettings;
use crate::values::LampsName;

/// The port of the stage that exports a form; those without one are no material.
pub(crate) fn port(form: Form) -> Option<&'static str> {
    match form {
        Form::Compact => Some("compact"),
        Form::Shrm => Some("shrm"),
        Form::Cabral => Some("cabral"),
        Form::KautzMcCool => Some("kautz-mccool"),
        Form::Plain => Some("reflection-map"),
        Form::Table | Form::Transfer | Form::Irradiance | Form::Mirror => None,
    }
}

/// What is exported.
pub(crate) struct Forms {
    exported: Vec<Exported>,
    sizes: MapSizes,
    /// Whether a mesh has a transfer.
    has_transfer: bool,
}

/// The files of an export.
struct Exported {
    form: Form,
    key: ItemKey,
    files: Arc<ExportedFiles>,
    /// The digest of what is known of them.
    digest: Digest,
}

/// The look of a form.
pub(crate) struct FormLook {
    pub(crate) look: Look,
    /// The bytes of the exported files, if they are connected.
    pub(crate) bytes: Option<u64>,
    /// The digest of what is known of the exported files, if they are connected.
    pub(crate) export: Option<Digest>,
    /// Whether suns and lamps are in the map, rather than beside it.
    pub(crate) has_lamps_in_map: bool,
    /// What a reader ought to know.
    pub(crate) note: String,
}

impl Forms {
    /// The forms whose exports are connected, and the sizes of others.
    pub(crate) fn of(inputs: &Inputs, edge: usize, slices: usize) -> Result<Self, Failure> {
        let mut exported = Vec::new();
        for form in Form::ALL {
            let Some(port) = port(form) else { continue };
            let digests = inputs.many_digests(port);
            for ((key, files), digest) in inputs.many::<ExportedFiles>(port)?.into_iter().zip(digests) {
                exported.push(Exported { form, key, files, digest });
            }
        }
        let has_transfer = inputs.type_at("transfer").is_some();
        Ok(Self { exported, sizes: MapSizes { edge, slices }, has_transfer })
    }

    /// The exported files of a form of a pair.
    fn export(&self, form: Form, pair: &Pair) -> Option<&Exported> {
        self.exported.iter().find(|export| export.form == form && fits(&export.key, &pair.key))
    }

    /// Whether a page shows a pair in this form.
    pub(crate) fn shows(&self, form: Form, pair: &Pair) -> bool {
        let can = match form {
            Form::Compact => pair.compact_map.is_some(),
            Form::Table => pair.table.is_some(),
            Form::Transfer => self.has_transfer,
            Form::Irradiance | Form::Mirror => true,
            _ => pair.reflection.is_some(),
        };
        let is_chosen = port(form).is_none()
            || self.exported.is_empty()
            || self.exported.iter().any(|export| export.form == form);
        can && is_chosen
    }

    /// The look with which a form of a pair is drawn. A mirror shows the sky as the background does.
    pub(crate) fn look(
        &self,
        form: Form,
        pair: &Pair,
        sky: &Arc<Light>,
        reporter: &Reporter,
    ) -> Result<FormLook, Failure> {
        let export = self.export(form, pair);
        let files = export.map(|export| &*export.files);
        let number = |name: &str| files.and_then(|files| files.parameters[name].as_u64());
        let sizes = MapSizes {
            edge: number("resolution").map_or(self.sizes.edge, |edge| edge as usize),
            slices: number("slices").map_or(self.sizes.slices, |slices| slices as usize),
        };
        let is_baked = files.is_some_and(|files| files.parameters["lamps"] == "baked");
        let mut note = String::new();
        let material = pair.material.clone();
        let light = Arc::clone(if form == Form::Mirror { sky } else { &pair.light });
        let look = match &pair.reflection {
            Some(reflection) if form == Form::Shrm => {
                let settings = match files {
                    Some(files) => ShrmSettings::of_files(files)?,
                    None => None,
                };
                let lamps = if is_baked { LampsName::Baked } else { LampsName::Separate };
                let settings = settings.unwrap_or_else(|| ShrmSettings::of_cube(sizes.edge, lamps));
                let maps = settings.with_cube(sizes.edge).maps(&reflection.0, reporter)?;
                let p = maps.iter().map(|map| map.shape.p).max().unwrap_or(Degree::ZERO);
                note = format!("P = {}", p.get());
                if maps.len() > 1 {
                    note += "; one map here, a map of each part in the files";
                }
                Look::new(light, reflection.0.cut_in_view(p), material, sizes)
            }
            Some(reflection) if form != Form::Compact => {
                Look::new(light, reflection.0.clone(), material, sizes)
            }
            _ => Look::of_light(light, material, sizes),
        };
        if let Some(table) = pair.table.as_ref().filter(|_| form == Form::Table) {
            note = format!("F = {}, {} x {1} views", table.degree().get(), table.size());
        }
        if let Some(map) = pair.compact_map.as_ref().filter(|_| form == Form::Compact) {
            let taps = map.taps.table().taps();
            note = format!("{taps} {} here", if taps == 1 { "tap" } else { "taps" });
        }
        if form == Form::Transfer {
            note = "computed at the vertices of the mesh".into();
        }
        let look = look.with_lamps_in_maps(is_baked).with_compact_map(pair.compact_map.clone());
        let look = look.with_table(pair.table.clone());
        Ok(FormLook {
            look,
            bytes: files.map(ExportedFiles::total),
            export: export.map(|export| export.digest),
            has_lamps_in_map: is_baked,
            note,
        })
    }
}
