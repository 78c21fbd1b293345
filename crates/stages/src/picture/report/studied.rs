//! A material of a report, what is made from it once, and its reflection of a light.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::sync::Arc;

use brdf::{BrdfCoefficients, Choice, Part, Projection, project};
use containers::tensors::MaterialTaps;
use engine::{DerivedValues, Failure, Reporter};
use sh::Light;
use shrm::{DiskMeans, MapViews, MeanLobe, Plain, Reflection};
use taps::AnyTable;

use crate::map::{default_taps, disk_means, tap_tables};
use crate::picture::report::lit::Lit;
use crate::values::UntilStopped;

/// The number of angles of a Kautz-McCool texture, as `export-kautz-mccool` has them by default.
pub(crate) const SLICES: usize = 16;

/// A material, and the lobes and coefficients that are made from it once.
pub(crate) struct Studied<'a> {
    pub(crate) name: String,
    pub(crate) material: Cow<'a, brdf::Material>,
    /// The diffuse and the specular part, of a material that has both.
    parts: OnceCell<Option<Box<[Studied<'static>; 2]>>>,
    full: OnceCell<Projection>,
    /// The coefficients of degrees that the report's parameters give.
    given: OnceCell<Projection>,
    /// The material's lobe for a small light, in the mean over all views.
    mean: OnceCell<MeanLobe>,
    /// The material's lobes for a small light, in the mean over the views at each angle of a 3D texture.
    rings: OnceCell<Vec<MeanLobe>>,
    /// The look-ups into a scale space, with more and more of them.
    taps: OnceCell<Arc<MaterialTaps>>,
    derived: DerivedValues<'a>,
}

impl<'a> Studied<'a> {
    pub(crate) fn new(name: String, material: Cow<'a, brdf::Material>, derived: DerivedValues<'a>) -> Self {
        let (parts, full, given, mean, rings, taps) = Default::default();
        Self { name, material, parts, full, given, mean, rings, taps, derived }
    }

    pub(crate) fn mean(&self) -> &MeanLobe {
        self.mean.get_or_init(|| MeanLobe::plain(&self.material, Plain::Mean))
    }

    /// The means over the disks of these lights.
    pub(crate) fn disks(&self, lights: &[Light]) -> Arc<DiskMeans> {
        disk_means(lights, &self.derived)
    }

    pub(crate) fn rings(&self) -> &[MeanLobe] {
        let ring = |angle: &f64| MeanLobe::ring(&self.material, *angle);
        self.rings.get_or_init(|| MapViews::even_angles(SLICES).angles().iter().map(ring).collect())
    }

    /// The diffuse and the specular part, of a material that has both.
    pub(crate) fn parts(&self) -> Option<&[Studied<'static>; 2]> {
        let part = |part| {
            let material = Cow::Owned(self.material.part(part)?);
            Some(Studied::new(self.name.clone(), material, DerivedValues::default()))
        };
        let parts = || Some(Box::new([part(Part::Diffuse)?, part(Part::Specular)?]));
        self.parts.get_or_init(parts).as_deref()
    }

    /// The parts, of a material of which exports write a map for each.
    pub(crate) fn maps(&self) -> Option<&[Studied<'static>; 2]> {
        self.material.split().and_then(|_| self.parts())
    }

    /// The tables of look-ups that `fit-taps` makes by default.
    pub(crate) fn tables(&self, reporter: &Reporter) -> Result<Vec<AnyTable<'_>>, Failure> {
        if let Some(taps) = self.taps.get() {
            return Ok(tap_tables(taps));
        }
        let made = default_taps(&self.material, &self.derived, reporter)?;
        Ok(tap_tables(self.taps.get_or_init(|| made)))
    }

    /// The coefficients that `project-brdf` makes by default.
    pub(crate) fn full(&self, reporter: &Reporter) -> Result<&BrdfCoefficients, Failure> {
        Ok(&self.projection(reporter)?.coefficients)
    }

    /// The projection of the material at the full degrees: its coefficients and its energy.
    pub(crate) fn projection(&self, reporter: &Reporter) -> Result<&Projection, Failure> {
        projected(&self.full, &self.material, Choice::Full, reporter)
    }
}

fn projected<'a>(
    cell: &'a OnceCell<Projection>,
    material: &brdf::Material,
    choice: Choice,
    reporter: &Reporter,
) -> Result<&'a Projection, Failure> {
    if let Some(made) = cell.get() {
        return Ok(made);
    }
    let made = reporter.until_stopped(|stop| project(material, choice, stop))?;
    Ok(cell.get_or_init(|| made))
}

/// The reflection of a pair as the stages make it by default, or with these degrees.
pub(crate) fn reflection_of(
    lit: &Lit<'_>,
    material: &Studied<'_>,
    choice: Option<Choice>,
    reporter: &Reporter,
) -> Result<Reflection, Failure> {
    Ok(match choice {
        None => {
            let (lighting, brdf) = (lit.full(reporter)?, material.full(reporter)?);
            let (field, _) = reporter
                .until_stopped(|stop| Reflection::for_light(lighting, brdf, &material.material, stop))?;
            match material.maps() {
                Some([diffuse, specular]) => {
                    let parts = [
                        (diffuse.full(reporter)?, &*diffuse.material),
                        (specular.full(reporter)?, &*specular.material),
                    ];
                    let (parts, _) =
                        reporter.until_stopped(|stop| Reflection::parts_for_light(lighting, parts, stop))?;
                    field.with_parts(parts)
                }
                None => field,
            }
        }
        Some(choice) => {
            let series = lit.full(reporter)?.whole();
            let brdf = &projected(&material.given, &material.material, choice, reporter)?.coefficients;
            let field = Reflection::convolve(&series, brdf);
            match material.maps() {
                Some([diffuse, specular]) => {
                    // Those of the whole, as `project-brdf` has it.
                    let choice = Choice::Degree { f: brdf.f(), p: brdf.p() };
                    let part = |part: &Studied<'_>| -> Result<_, Failure> {
                        let brdf = &projected(&part.given, &part.material, choice, reporter)?.coefficients;
                        Ok(Reflection::convolve(&series, brdf))
                    };
                    field.with_parts([part(diffuse)?, part(specular)?])
                }
                None => field,
            }
        }
    })
}
