//! What the readers of each export see. Texels are made when they are looked up: a picture needs a small part
//! of most exports.

use engine::Failure;
use rayon::prelude::*;
use sh::{Expansion, synthesise_cube, zonal_into};
use shrm::{Lamps, Lookup, MapGrid, MapViews, MeanLight, Reflection, Shrm, icosahedron};
use sphere::{Cube, Direction};

use crate::picture::report::sphere::Sphere;

/// Reflected light for look-ups at these central directions.
pub(crate) struct Reader<'a> {
    pub(crate) central: &'a [Direction],
    /// The least value that an export writes: see `map_source.rs`.
    pub(crate) least: f32,
}

impl<'a> Reader<'a> {
    /// The readers of a reflection's maps.
    pub(crate) fn of(central: &'a [Direction], reflection: &Reflection) -> Self {
        Self { central, least: if reflection.is_for_light() { 0.0 } else { f32::MIN } }
    }

    /// A plain map: its series, and what the material reflects of the lights beside it.
    pub(crate) fn plain(
        &self,
        series: &Expansion,
        light: Option<&MeanLight>,
        cube: Cube,
    ) -> Result<Vec<[f32; 3]>, Failure> {
        let (grid, soft): (_, Vec<[f32; 3]>) = (MapGrid::Cube(cube), synthesise_cube(series, cube)?);
        let texel = |texel: usize| {
            let lit = light.map_or([0.0; 3], |light| light.radiance(grid.direction(texel)));
            let value: [f32; 3] = std::array::from_fn(|channel| soft[texel][channel] + lit[channel] as f32);
            value.map(|value| value.max(self.least))
        };
        Ok(self.look(|| (), |(), central| grid.taps(central).blend_by(texel).map(|value| value as f32)))
    }

    /// Cabral's maps of a map without lamps.
    pub(crate) fn cabral(&self, soft: &Shrm, lamps: Option<&Lamps>) -> Vec<[f32; 3]> {
        let (grid, vertices) = (soft.grid(), icosahedron::vertices());
        let lamps = lamps.map(Lamps::for_views);
        // The view is the same for all pixels, so that they share three maps, and many texels of these.
        let corners = icosahedron::corners(Sphere::view()).vertices;
        let mut seen: Vec<usize> =
            self.central.iter().flat_map(|central| grid.taps(*central).index).collect();
        seen.sort_unstable();
        seen.dedup();
        let value = |lookup: &mut Lookup<'_>, texel: usize, view: Direction| {
            let value = lookup.texel(texel, view).map(|value| value as f32);
            let value = match &lamps {
                Some(lamps) => lamps.added(value, grid.direction(texel), view),
                None => value,
            };
            value.map(|value| value.max(self.least))
        };
        let texels = seen.par_iter().map_init(
            || soft.lookup(),
            |lookup, texel| corners.map(|vertex| value(lookup, *texel, vertices[vertex])),
        );
        let texels: Vec<[[f32; 3]; 3]> = texels.collect();
        let at = |vertex: usize, texel: usize| {
            let (Ok(place), Some(corner)) =
                (seen.binary_search(&texel), corners.iter().position(|corner| *corner == vertex))
            else {
                unreachable!("the same look-ups")
            };
            texels[place][corner]
        };
        self.look(|| (), |(), central| MapViews::Icosahedron.interpolated(grid, central, Sphere::view(), at))
    }

    /// The 3D texture of a local map of zonal terms without lamps, with these slices; `rings` are what the
    /// material reflects of the lamps at each of them.
    pub(crate) fn kautz_mccool(
        &self,
        zonal: &Shrm,
        slices: &MapViews,
        rings: Option<&[MeanLight]>,
    ) -> Vec<[f32; 3]> {
        let (grid, rows, angles) = (zonal.grid(), zonal.p().get() + 1, slices.angles());
        let mut harmonics = vec![0.0; angles.len() * rows];
        for (angle, row) in angles.iter().zip(harmonics.chunks_exact_mut(rows)) {
            zonal_into(math::cos(*angle), row);
        }
        let value = |slice: usize, texel: usize| {
            let mut sum = [0.0; 3];
            for (value, y) in zonal.texel(texel).iter().zip(&harmonics[slice * rows..]) {
                (0..3).for_each(|channel| sum[channel] += f64::from(value[channel]) * y);
            }
            let soft = sum.map(|value| value as f32);
            let value: [f32; 3] = match rings {
                Some(rings) => {
                    let lit = rings[slice].radiance(grid.direction(texel));
                    std::array::from_fn(|channel| soft[channel].max(0.0) + lit[channel] as f32)
                }
                None => soft,
            };
            value.map(|value| value.max(self.least))
        };
        self.look(|| (), |(), central| slices.interpolated(grid, central, Sphere::view(), value))
    }

    /// A spherical harmonic reflection map.
    pub(crate) fn shrm(&self, map: &Shrm) -> Vec<[f32; 3]> {
        self.look(|| map.lookup(), |lookup, central| lookup.radiance(central, Sphere::view()))
    }

    /// Looks up the light that each pixel sees.
    fn look<T>(
        &self,
        reader: impl Fn() -> T + Sync + Send,
        of: impl Fn(&mut T, Direction) -> [f32; 3] + Sync + Send,
    ) -> Vec<[f32; 3]> {
        self.central.par_iter().map_init(reader, |reader, central| of(reader, *central)).collect()
    }
}

/// The radiance of lamps alone for look-ups at these central directions.
pub(crate) fn lamps_seen(central: &[Direction], lamps: &Lamps) -> Vec<[f64; 3]> {
    let (lamps, view) = (lamps.for_views(), Sphere::view());
    central.par_iter().map(|central| lamps.radiance(*central, view)).collect()
}

/// Adds what one map gives to what others give.
pub(crate) fn add_map(sum: &mut [[f32; 3]], values: &[[f32; 3]]) {
    sum.as_flattened_mut().iter_mut().zip(values.as_flattened()).for_each(|(sum, value)| *sum += value);
}

/// Adds the light of lamps to what a map gives.
pub(crate) fn add(values: &mut [[f32; 3]], lamps: &[[f64; 3]]) {
    for (value, lamps) in values.iter_mut().zip(lamps) {
        (0..3).for_each(|channel| value[channel] += lamps[channel] as f32);
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Fresnel, Ggx, KajiyaKay, Material, project};
    use engine::Reporter;
    use sh::{Degree, Light, Lighting, Stop};
    use shrm::{MeanLobe, Plain, View, ViewSet};
    use sphere::LatLong;

    use super::*;
    use crate::map::texels;
    use crate::picture::report::explicit_maps::zonal;

    fn lighting() -> Lighting {
        let degree = Degree::new(6).unwrap();
        let mut rows = vec![[0.0; 3]; degree.rows()];
        (rows[0], rows[2], rows[7], rows[20]) =
            ([3.5; 3], [1.2, 1.0, 0.8], [0.9, -0.3, 0.4], [-0.5, 0.6, 0.1]);
        let lamp = |theta, phi| Light::from_flux(Direction::from_angles(theta, phi), 0.01, [6.0, 5.0, 4.0]);
        let series = Expansion::from_coefficients(degree, rows).unwrap();
        Lighting { series, lights: vec![lamp(1.2, 0.4), lamp(2.2, 2.9)] }
    }

    /// Reflections with and without lamps, with and without a dependence on azimuth.
    fn reflections() -> Vec<Reflection> {
        let metal = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
        let materials = [
            Material::Ggx(Ggx::new(0.4, metal, [1.0; 3]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(16.0, [1.0; 3]).unwrap()),
        ];
        let mut all = Vec::new();
        for material in materials {
            let brdf = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
            all.push(Reflection::for_light(&lighting(), &brdf, &material, Stop::NEVER).unwrap().0);
            all.push(all[all.len() - 1].clone().without_lamps());
        }
        all
    }

    #[test]
    fn readers_see_what_they_see_of_the_whole_maps() {
        let (cube, angles) = (Cube { edge: 7 }, MapViews::even_angles(5));
        let grid = MapGrid::Cube(cube);
        for reflection in reflections() {
            let sphere = Sphere::new(32);
            let central = sphere.central(reflection.brdf().centre());
            let reader = Reader { central: &central, least: 0.0 };
            let (view, lamps) = (Sphere::view(), reflection.lamps());
            let finished = |soft: &Shrm, views: &MapViews| {
                let set = ViewSet::from_shrm(soft, views.clone(), Stop::NEVER).unwrap().unwrap();
                let set =
                    if let Some(lamps) = lamps { set.with_lamps(lamps, Stop::NEVER).unwrap() } else { set };
                let pixels = set.maps().iter().map(|pixel| pixel.map(|value| value.max(0.0))).collect();
                ViewSet::new(views.clone(), set.grid(), set.centre(), pixels).unwrap()
            };

            let soft = reflection.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            let maps = finished(&soft, &MapViews::Icosahedron);
            let expected: Vec<_> = central.iter().map(|central| maps.radiance(*central, view)).collect();
            assert_eq!(reader.cabral(&soft, lamps), expected);

            let zonal = zonal(&reflection, LatLong::with_rows(14), &Reporter::default()).unwrap();
            let texture = finished(&zonal, &angles);
            let expected: Vec<_> = central.iter().map(|central| texture.radiance(*central, view)).collect();
            let ring = |angle: &f64, lamps: &Lamps| MeanLobe::ring(&lamps.material, *angle).of(&lamps.lights);
            let rings: Option<Vec<MeanLight>> =
                lamps.map(|lamps| angles.angles().iter().map(|angle| ring(angle, lamps)).collect());
            assert_eq!(reader.kautz_mccool(&zonal, &angles, rings.as_deref()), expected);

            let texels = texels(&reflection, Plain::Mean, grid, &engine::DerivedValues::default()).unwrap();
            let look = |central: &Direction| grid.taps(*central).blend(&texels).map(|value| value as f32);
            let expected: Vec<_> = central.iter().map(look).collect();
            let light = lamps.map(|lamps| MeanLobe::plain(&lamps.material, Plain::Mean).of(&lamps.lights));
            let found = reader.plain(&reflection.plain(Plain::Mean), light.as_ref(), cube).unwrap();
            assert_eq!(found, expected);
        }
    }
}
