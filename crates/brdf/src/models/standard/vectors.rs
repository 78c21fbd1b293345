//! rho_hat of four pairs of directions at once: the same operations in the same order as for one pair, so
//! that the bits are the same.

use pulp::{Simd, WithSimd};
use sh::f64x4::{F64x4, LANES, load, store};
use sphere::Direction;

use crate::models::directional_albedo::Tables;

/// Pairs of the incident and the outgoing direction.
pub(super) trait Pairs {
    /// Whether the outgoing direction is the same in all pairs.
    const ARE_TOWARD_ONE: bool;

    fn count(&self) -> usize;

    fn incident(&self, index: usize) -> Direction;

    fn outgoing(&self, index: usize) -> Direction;
}

impl Pairs for &[[Direction; 2]] {
    const ARE_TOWARD_ONE: bool = false;

    #[inline(always)]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn incident(&self, index: usize) -> Direction {
        self[index][0]
    }

    #[inline(always)]
    fn outgoing(&self, index: usize) -> Direction {
        self[index][1]
    }
}

/// Light from many directions toward one view.
pub(super) struct Toward<'a> {
    pub(super) outgoing: Direction,
    pub(super) incident: &'a [Direction],
}

impl Pairs for Toward<'_> {
    const ARE_TOWARD_ONE: bool = true;

    #[inline(always)]
    fn count(&self) -> usize {
        self.incident.len()
    }

    #[inline(always)]
    fn incident(&self, index: usize) -> Direction {
        self.incident[index]
    }

    #[inline(always)]
    fn outgoing(&self, _: usize) -> Direction {
        self.outgoing
    }
}

/// The values of a material without sheen: its constants are those of the formula, by the same names.
pub(super) struct RhoHats<'a, P> {
    /// alpha^2 of the highlight, if there is one.
    pub(super) alpha2: Option<f64>,
    pub(super) f_0: [f64; 3],
    pub(super) f_90: f64,
    pub(super) coat: Option<Coat>,
    pub(super) multiple: [f64; 3],
    pub(super) diffuse: [f64; 3],
    pub(super) tables: &'a Tables,
    pub(super) pairs: P,
    /// The value of each pair.
    pub(super) values: &'a mut [[f64; 3]],
}

/// The clear coat, whose F_90 is 1.
#[derive(Clone, Copy)]
pub(super) struct Coat {
    pub(super) weight: f64,
    pub(super) f_0: f64,
    pub(super) alpha2: f64,
}

/// The half vectors of four pairs of light and view.
#[derive(Clone, Copy)]
struct HalfVectors<S: Simd> {
    light: S::f64s,
    view: S::f64s,
    /// As `HalfVector::sin2`, `HalfVector::cos2` and `HalfVector::facet`.
    sin2: S::f64s,
    cos2: S::f64s,
    facet: S::f64s,
}

/// Four views, and what depends on them alone.
#[derive(Clone, Copy)]
struct Views<S: Simd> {
    vector: [S::f64s; 3],
    /// The cosine to the normal, 0 below the horizon.
    cosine: S::f64s,
    rows: [S::f64s; 4],
    /// The root of [`masked`] for the coat and for the highlight, or 0 if there is none.
    masked: [S::f64s; 2],
}

impl<P: Pairs> WithSimd for RhoHats<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { alpha2, f_0, f_90, coat: coating, multiple, diffuse, tables, pairs, values } = self;
        let splat = |value: f64| simd.splat_f64s(value);
        let [zero, one] = [0.0, 1.0].map(splat);
        let count = pairs.count();
        if count == 0 {
            return;
        }
        let coordinates = |directions: [Direction; LANES]| {
            let vectors = directions.map(Direction::vector);
            [vectors.map(|v| v.x), vectors.map(|v| v.y), vectors.map(|v| v.z)].map(F64x4)
        };
        let views = |views: [Direction; LANES]| {
            let vector = coordinates(views).map(|lanes| load(simd, &lanes));
            let cosine = simd.max_f64s(vector[2], zero);
            let masked = [coating.map(|coat| coat.alpha2), alpha2]
                .map(|alpha2| alpha2.map_or(zero, |alpha2| masked(simd, alpha2, cosine)));
            Views::<S> { vector, cosine, rows: rows(simd, tables, cosine), masked }
        };
        let one_view = P::ARE_TOWARD_ONE.then(|| views([pairs.outgoing(0); LANES]));
        for (block, values) in values.chunks_mut(LANES).enumerate() {
            // A pair that is missing in the last four is one of those that are there.
            let pair = |lane: usize| (LANES * block + lane).min(count - 1);
            let light = coordinates(std::array::from_fn(|lane| pairs.incident(pair(lane))));
            if light[2].0.iter().all(|height| *height <= 0.0) {
                values.fill([0.0; 3]);
                continue;
            }
            let view =
                one_view.unwrap_or_else(|| views(std::array::from_fn(|lane| pairs.outgoing(pair(lane)))));
            let sum: [S::f64s; 3] =
                std::array::from_fn(|axis| simd.add_f64s(load(simd, &light[axis]), view.vector[axis]));
            let [x2, y2, z2] = sum.map(|value| simd.mul_f64s(value, value));
            let across = simd.add_f64s(x2, y2);
            let length_squared = simd.add_f64s(across, z2);
            let half = HalfVectors::<S> {
                light: load(simd, &light[2]),
                view: view.cosine,
                sin2: simd.div_f64s(across, length_squared),
                cos2: simd.div_f64s(z2, length_squared),
                facet: simd.mul_f64s(splat(0.5), simd.sqrt_f64s(length_squared)),
            };
            let (of_light, of_view) = (rows(simd, tables, half.light), view.rows);
            let from_grazing = simd.max_f64s(simd.sub_f64s(one, half.facet), zero);
            let square = simd.mul_f64s(from_grazing, from_grazing);
            let grazing = simd.mul_f64s(from_grazing, simd.mul_f64s(square, square));
            let mut coat = zero;
            if let Some(Coat { weight, f_0, alpha2 }) = coating {
                let fresnel = simd.add_f64s(splat(f_0), simd.mul_f64s(splat(1.0 - f_0), grazing));
                let facets = half.ggx(simd, alpha2, view.masked[0]);
                coat = simd.mul_f64s(simd.mul_f64s(splat(weight), fresnel), facets);
            }
            let mut highlight = zero;
            if let Some(alpha2) = alpha2 {
                let received = simd.min_f64s(of_light[1], of_view[1]);
                highlight = simd.mul_f64s(received, half.ggx(simd, alpha2, view.masked[1]));
            }
            let [several, matte] = [2, 3]
                .map(|column| simd.mul_f64s(simd.mul_f64s(of_light[column], of_view[column]), half.light));
            let channels = [0, 1, 2].map(|channel| {
                let rise = splat(f_90 - f_0[channel]);
                let fresnel = simd.add_f64s(splat(f_0[channel]), simd.mul_f64s(rise, grazing));
                let facets = simd.add_f64s(coat, simd.mul_f64s(highlight, fresnel));
                let facets = simd.add_f64s(facets, simd.mul_f64s(splat(multiple[channel]), several));
                let value = simd.add_f64s(facets, simd.mul_f64s(splat(diffuse[channel]), matte));
                let mut lanes = F64x4::ZERO;
                store(simd, value, &mut lanes);
                lanes.0
            });
            let (mut height, mut length) = (F64x4::ZERO, F64x4::ZERO);
            store(simd, sum[2], &mut height);
            store(simd, length_squared, &mut length);
            for (lane, value) in values.iter_mut().enumerate() {
                // As in `HalfVector::new`.
                let is_lit = light[2].0[lane] > 0.0 && height.0[lane] > 0.0 && length.0[lane] > 0.0;
                *value = if is_lit { channels.map(|lanes| lanes[lane]) } else { [0.0; 3] };
            }
        }
    }
}

/// The root of alpha^2 + (1 - alpha^2) cosine^2.
#[inline(always)]
fn masked<S: Simd>(simd: S, alpha2: f64, cosine: S::f64s) -> S::f64s {
    let rest = simd.mul_f64s(simd.mul_f64s(simd.splat_f64s(1.0 - alpha2), cosine), cosine);
    simd.sqrt_f64s(simd.add_f64s(simd.splat_f64s(alpha2), rest))
}

/// `Tables::at` of four cosines.
#[inline(always)]
fn rows<S: Simd>(simd: S, tables: &Tables, cosine: S::f64s) -> [S::f64s; 4] {
    let clamped = simd.min_f64s(simd.max_f64s(cosine, simd.splat_f64s(0.0)), simd.splat_f64s(1.0));
    let mut place = F64x4::ZERO;
    store(simd, simd.mul_f64s(simd.sqrt_f64s(clamped), simd.splat_f64s(tables.last() as f64)), &mut place);
    let mut columns = [F64x4::ZERO; 4];
    for lane in 0..LANES {
        let (ends, share) = tables.between(place.0[lane]);
        let [low, high] = ends.map(|end| load(simd, &F64x4(*end)));
        let row = simd.add_f64s(low, simd.mul_f64s(simd.sub_f64s(high, low), simd.splat_f64s(share)));
        let mut values = F64x4::ZERO;
        store(simd, row, &mut values);
        for column in 0..4 {
            columns[column].0[lane] = values.0[column];
        }
    }
    [0, 1, 2, 3].map(|column| load(simd, &columns[column]))
}

impl<S: Simd> HalfVectors<S> {
    /// As `HalfVector::ggx`; `masked_view` is [`masked`] of the view.
    #[inline(always)]
    fn ggx(&self, simd: S, alpha2: f64, masked_view: S::f64s) -> S::f64s {
        let splat = |value: f64| simd.splat_f64s(value);
        let across = simd.add_f64s(self.sin2, simd.mul_f64s(splat(alpha2), self.cos2));
        let squared = simd.mul_f64s(simd.mul_f64s(splat(std::f64::consts::PI), across), across);
        let d = simd.div_f64s(splat(alpha2), squared);
        let seen = simd.add_f64s(
            simd.mul_f64s(self.light, masked_view),
            simd.mul_f64s(self.view, masked(simd, alpha2, self.light)),
        );
        simd.div_f64s(simd.mul_f64s(simd.mul_f64s(d, splat(0.5)), self.light), seen)
    }
}
