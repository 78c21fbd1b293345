//! The files that connected stages export: which pair each belongs to, how large it is, and how an SHRM was
//! made.

use std::sync::Arc;

use engine::{ExportedFiles, Failure, Inputs, ItemKey};

use crate::map::ShrmSettings;
use crate::picture::report::figures::{FileSizes, Method};
use crate::values::{LampsName, parts};

/// What the pipeline exports of a pair.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairFiles {
    /// The bytes of the files of each method.
    sizes: FileSizes,
    /// The methods of which one map holds both parts of a material.
    together: [bool; Method::ALL.len()],
    /// How the SHRM with the lamps in it is made, and how that without.
    shrm: [Option<ShrmSettings>; 2],
}

impl PairFiles {
    /// The bytes of the files of a method. In light without lamps, both forms of an SHRM are one.
    pub(crate) fn size(&self, method: Method, has_lamps: bool) -> Option<u64> {
        let other =
            self.sizes[Method::ShrmSeparate as usize].filter(|_| method == Method::Shrm && !has_lamps);
        self.sizes[method as usize].or(other)
    }

    /// Whether a connected stage writes one map of both parts of a material.
    pub(crate) fn are_together(&self, method: Method) -> bool {
        self.together[method as usize]
    }

    /// How a form of SHRM is made: as a connected stage does it, or else by default at a resolution of a
    /// cube.
    pub(crate) fn shrm(&self, lamps: LampsName, has_lamps: bool, edge: usize) -> ShrmSettings {
        let [baked, separate] = self.shrm;
        let found = match lamps {
            _ if !has_lamps => baked.or(separate),
            LampsName::Baked => baked,
            LampsName::Separate => separate,
        };
        found.unwrap_or_else(|| ShrmSettings::of_cube(edge, lamps))
    }
}

/// The files of connected stages, by method and item.
pub(crate) struct Exported(Vec<ExportedItem>);

struct ExportedItem {
    port: &'static str,
    method: Method,
    key: ItemKey,
    files: Arc<ExportedFiles>,
    shrm: Option<ShrmSettings>,
}

impl Exported {
    /// The files at the ports of all methods.
    ///
    /// # Errors
    /// If the files of an SHRM hold something else, or those of both its ports have the same form.
    pub(crate) fn of(inputs: &Inputs) -> Result<Self, Failure> {
        let mut all: Vec<ExportedItem> = Vec::new();
        for connected in Method::ALL {
            let Some(port) = connected.port() else { continue };
            for (key, files) in inputs.many::<ExportedFiles>(port)? {
                let (method, shrm) =
                    held(connected, &files).map_err(|failure| failure.context(format!("the port {port}")))?;
                if all.iter().any(|item| item.method == method && item.port != port) {
                    return Err(Failure::new(format!(
                        "the ports shrm and shrm-separate both receive the files of {}",
                        method.kind()
                    ))
                    .help("connect one export-shrm with lamps = \"baked\", and one with \"separate\""));
                }
                all.push(ExportedItem { port, method, key, files, shrm });
            }
        }
        Ok(Self(all))
    }

    /// The files of a pair.
    pub(crate) fn files(&self, environment: &ItemKey, material: &ItemKey) -> PairFiles {
        let mut found = PairFiles::default();
        let is_own = |item: &&ExportedItem| {
            [environment, material].into_iter().all(|part| names(&item.key, part, Unnamed::Fits))
        };
        for item in self.0.iter().filter(is_own) {
            *found.sizes[item.method as usize].get_or_insert(0) += item.files.total();
            found.together[item.method as usize] |= item.files.parameters["parts"] == "together";
            if let Some(settings) = item.shrm {
                let place = usize::from(settings.lamps() == LampsName::Separate);
                found.shrm[place] = Some(settings);
            }
        }
        found
    }
}

/// The method whose maps these files hold, and how an SHRM was made.
fn held(connected: Method, files: &ExportedFiles) -> Result<(Method, Option<ShrmSettings>), Failure> {
    match connected {
        Method::Shrm | Method::ShrmSeparate => {
            let settings = ShrmSettings::of_files(files)?;
            let method = settings.map_or(connected, |settings| match settings.lamps() {
                LampsName::Baked => Method::Shrm,
                LampsName::Separate => Method::ShrmSeparate,
            });
            Ok((method, settings))
        }
        // A stage that writes a map of each part leaves that of the diffuse one, the first half of its files,
        // out if the material has no parts.
        Method::ReflectionMap if !parts::are_together(files) => {
            let diffuse = &files.bytes[..files.bytes.len() / 2];
            let has_parts = diffuse.iter().any(|bytes| *bytes > 0);
            Ok((if has_parts { Method::PartMaps } else { connected }, None))
        }
        _ => Ok((connected, None)),
    }
}

/// Whether a stage that a key does not name fits every item of it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unnamed {
    /// It does: what the key stands for is the same for all of them.
    Fits,
    /// It does not.
    Misses,
}

/// Whether a key names the items that another one names.
pub(crate) fn names(key: &ItemKey, part: &ItemKey, unnamed: Unnamed) -> bool {
    part.iter().all(|(stage, stem)| match key.get(stage) {
        Some(own) => own == stem,
        None => unnamed == Unnamed::Fits,
    })
}
