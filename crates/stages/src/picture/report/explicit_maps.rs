//! Plain maps, 3D textures and Cabral's maps of a pair, made once, and what readers see of them.

use std::borrow::Cow;

use brdf::BrdfCoefficients;
use engine::{Failure, Reporter};
use sh::Expansion;
use shrm::{MapGrid, MapViews, MeanLight, MeanLobe, Plain, Reflection, Shrm, Terms, View};
use sphere::{Cube, Direction, LatLong};

use crate::picture::report::figures::{Errors, Export, Method};
use crate::picture::report::readers::{Reader, add_map};
use crate::picture::report::sphere::{Lattice, Sphere};
use crate::picture::report::studied::{SLICES, Studied};
use crate::values::UntilStopped;

/// The maps of one method: of a reflection, or of each part of the material.
pub(crate) struct ExplicitMaps<'a> {
    method: Method,
    edge: usize,
    maps: Vec<(&'a Reflection, Made<'a>)>,
}

/// What the texels of a field are made of.
enum Made<'a> {
    /// A plain map: its series, and what the material reflects of the lamps.
    Plain(Expansion, Option<MeanLight>),
    /// A 3D texture: the terms without azimuth, and what the material reflects of the lamps at each angle.
    Texture(Shrm, Option<Vec<MeanLight>>),
    /// Maps of single views: the map of all views.
    Views(Cow<'a, Shrm>),
}

impl<'a> ExplicitMaps<'a> {
    /// The plain map, the 3D texture or Cabral's maps of a reflection, with faces of this edge. `soft` is the
    /// reflection's map without lamps. Of a material of two parts, a texture and views are maps of each part,
    /// unless they are `together`.
    pub(crate) fn new(
        method: Method,
        (material, reflection): (&Studied<'_>, &'a Reflection),
        soft: &'a Shrm,
        together: bool,
        edge: usize,
        reporter: &Reporter,
    ) -> Result<Self, Failure> {
        let parts = reflection.parts().filter(|_| method != Method::ReflectionMap && !together);
        let fields: Vec<&Reflection> = parts.map_or(vec![reflection], |parts| parts.iter().collect());
        let known: Vec<&Studied<'_>> =
            [material].into_iter().chain(material.parts().into_iter().flatten()).collect();
        let made = |field: &'a Reflection| {
            let lamps = field.lamps();
            let studied = lamps.and_then(|lamps| known.iter().find(|of| *of.material == lamps.material));
            let made = match method {
                Method::Cabral if std::ptr::eq(field, reflection) => Made::Views(Cow::Borrowed(soft)),
                Method::Cabral => {
                    let grid = MapGrid::Cube(Cube { edge });
                    let map = reporter.until_stopped(|stop| field.synthesise(grid, View::Local, stop))?;
                    Made::Views(Cow::Owned(map))
                }
                Method::KautzMccool => {
                    let rings = lamps.map(|lamps| {
                        let disks = material.disks(&lamps.lights);
                        let lit = |lobe: &MeanLobe| lobe.over(&lamps.lights, &disks);
                        let ring = |angle: &f64| lit(&MeanLobe::ring(&lamps.material, *angle));
                        match studied {
                            Some(studied) => studied.rings().iter().map(lit).collect(),
                            // A reflection that is connected may be of other parameters.
                            None => angles().angles().iter().map(ring).collect(),
                        }
                    });
                    Made::Texture(zonal(field, slices(edge), reporter)?, rings)
                }
                _ => {
                    let light = lamps.map(|lamps| {
                        let disks = material.disks(&lamps.lights);
                        match studied {
                            Some(studied) => studied.mean().over(&lamps.lights, &disks),
                            None => MeanLobe::plain(&lamps.material, Plain::Mean).over(&lamps.lights, &disks),
                        }
                    });
                    Made::Plain(field.plain(Plain::Mean), light)
                }
            };
            reporter.check_cancelled()?;
            Ok((field, made))
        };
        let maps = fields.into_iter().map(made).collect::<Result<_, Failure>>()?;
        Ok(Self { method, edge, maps })
    }

    pub(crate) fn method(&self) -> Method {
        self.method
    }

    /// The sum of the maps, as readers see it at the pixels of a sphere.
    pub(crate) fn seen(&self, sphere: &Sphere) -> Result<Vec<[f32; 3]>, Failure> {
        let mut sum = vec![[0.0; 3]; sphere.indices().len()];
        for (field, made) in &self.maps {
            let central: Vec<Direction> = sphere.central(field.brdf().centre());
            let reader = Reader::of(&central, field);
            let values = match made {
                Made::Plain(series, light) => {
                    reader.plain(series, light.as_ref(), Cube { edge: self.edge })?
                }
                Made::Texture(zonal, rings) => reader.kautz_mccool(zonal, &angles(), rings.as_deref()),
                Made::Views(soft) => reader.cabral(soft, field.lamps()),
            };
            add_map(&mut sum, &values);
        }
        Ok(sum)
    }

    /// The export with these errors.
    pub(crate) fn export(&self, errors: Errors, lattice: Lattice) -> Export {
        let (edge, texels, rows) = (self.edge, Cube { edge: self.edge }.len(), slices(self.edge));
        let faces = format!("6 faces of {edge} × {edge}");
        let (texels, texture) = match self.method {
            Method::KautzMccool => {
                (SLICES * rows.len(), format!("{SLICES} angles × {} × {}", rows.width, rows.height))
            }
            Method::Cabral => (12 * texels, format!("12 views × {faces}")),
            _ => (texels, faces),
        };
        let maps = self.maps.len();
        let texture = if maps == 1 { texture } else { format!("{maps} × {texture}") };
        // The map of a highlight comes after that of its matte base, and has the higher degrees.
        let degrees = self.maps.last().map(|(field, _)| [field.brdf().f().get(), field.brdf().p().get()]);
        let [f, p] = degrees.unwrap_or_default();
        let p = if self.method == Method::ReflectionMap { 0 } else { p };
        let (method, bytes, one_of) = (self.method, (8 * maps * texels) as u64, lattice.one_of());
        Export { method, errors, f, p, bytes, file: None, texture, maps, one_of }
    }
}

/// The angles of a 3D texture.
fn angles() -> MapViews {
    MapViews::even_angles(SLICES)
}

/// The slices of a 3D texture: lat-long images, as dense at the equator as cubes of this edge.
fn slices(edge: usize) -> LatLong {
    LatLong::with_rows(2 * edge)
}

/// The map of a reflection's terms without azimuth, which are all that a 3D texture holds.
pub(crate) fn zonal(reflection: &Reflection, grid: LatLong, reporter: &Reporter) -> Result<Shrm, Failure> {
    let brdf = reflection.brdf();
    let side = brdf.p().get() + 1;
    let without_azimuth = |(index, rho): (usize, &[f64; 3])| if index % side == 0 { *rho } else { [0.0; 3] };
    let rho = brdf.rho().iter().enumerate().map(without_azimuth).collect();
    let zonal = BrdfCoefficients::new(brdf.centre(), brdf.f(), brdf.p(), rho).unwrap_or_else(|| brdf.clone());
    let zonal = Reflection::convolve(reflection.lighting(), &zonal);
    let grid = MapGrid::LatLong(grid);
    let map = reporter.until_stopped(|stop| zonal.synthesise(grid, View::Local, stop))?;
    debug_assert_eq!(map.terms(), Terms::Zonal);
    Ok(map)
}
