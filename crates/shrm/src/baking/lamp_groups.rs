//! Neighbouring lamps as one disk, where they are close beside the width of what a surface shows of them.
//!
//! Soft boxes and windows are rows of lamps. A texel whose central direction is far from them sees no more of
//! them than their flux, their centre and how far they are spread: a disk. Lamps are split into two again and
//! again, and a texel adds the largest groups that are far enough from it.

use std::f64::consts::FRAC_PI_2;

use brdf::{Centre, Material};
use sh::Light;
use sphere::{DVec3, Direction};

use crate::lamps::{TAIL, WIDEST};

/// The share of a feature's width that a group may have as its extent: the error falls with its square.
const MOST_EXTENT: f64 = 0.2;

/// The extent of a group is at least so many times the distance of a channel's centre from the common one:
/// what a disk about the common centre loses by that is of first order.
const SHIFTS_IN_EXTENT: f64 = 8.0;

/// A lamp, or lamps that texels see as one disk.
#[derive(Clone, Copy, Debug)]
pub(super) struct LampGroup {
    /// The lamp, or the disk in place of the lamps: their flux about their centre, spread as far as theirs.
    pub(super) light: Light,
    /// The least angle between central direction and centre at which this is enough, 0 if it always is.
    pub(super) least_angle: f64,
    /// The number of groups after this one into which it is split, where it is not enough.
    pub(super) descendants: usize,
}

/// The groups of these lamps, each before those into which it is split. Groups for which no texel is far
/// enough are left out.
pub(super) fn groups(lights: &[Light], material: &Material) -> Vec<LampGroup> {
    let mut groups = Vec::new();
    let (width, centre) = (material.highlight_width(), material.centre());
    if !lights.is_empty() {
        split(&mut lights.to_vec(), &|extent| least_angle(extent, width, centre), &mut groups);
    }
    groups
}

/// The angle from which on features are wide enough for a group of this extent, if there is one.
fn least_angle(extent: f64, width: f64, centre: Centre) -> Option<f64> {
    let feature = extent / MOST_EXTENT;
    match centre {
        _ if feature <= width => Some(0.0),
        Centre::Reflection if feature <= WIDEST => Some(extent + feature / TAIL),
        _ => None,
    }
}

fn split(lights: &mut [Light], least_angle: &impl Fn(f64) -> Option<f64>, groups: &mut Vec<LampGroup>) {
    if let [light] = lights {
        groups.push(LampGroup { light: *light, least_angle: 0.0, descendants: 0 });
        return;
    }
    let place = groups.len();
    let (light, extent) = disk_of(lights);
    let own = least_angle(extent).map(|angle| LampGroup { light, least_angle: angle, descendants: 0 });
    groups.extend(own);
    if own.is_some_and(|group| group.least_angle == 0.0) {
        return;
    }
    // In halves along the axis on which they are spread the most.
    let spread = |axis: usize| {
        let along = lights.iter().map(|light| light.direction.vector()[axis]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    let axis = (1..3).fold(0, |most, axis| if spread(axis) > spread(most) { axis } else { most });
    lights.sort_by(|a, b| a.direction.vector()[axis].total_cmp(&b.direction.vector()[axis]));
    let (first, second) = lights.split_at_mut(lights.len() / 2);
    split(first, least_angle, groups);
    split(second, least_angle, groups);
    if own.is_some() {
        groups[place].descendants = groups.len() - place - 1;
    }
}

/// The disk in place of some lamps, and the angle about its centre in which all of them lie.
fn disk_of(lights: &[Light]) -> (Light, f64) {
    let fluxes = || lights.iter().map(|light| (light.direction, light.radius, light.flux()));
    let flux = fluxes().fold([0.0; 3], |sum, (.., flux)| std::array::from_fn(|c| sum[c] + flux[c]));
    let centre_of = |share: &dyn Fn([f64; 3]) -> f64| {
        let sum: DVec3 = fluxes().map(|(direction, _, flux)| direction.vector() * share(flux)).sum();
        (sum.length() > 0.0).then(|| Direction::normalised(sum))
    };
    let grey = |flux: [f64; 3]| flux.iter().sum::<f64>();
    let centre = centre_of(&grey).unwrap_or(lights[0].direction);
    let of_channel = (0..3).filter_map(|channel| centre_of(&|flux| flux[channel]));
    let shift = of_channel.map(|direction| angle(centre, direction)).fold(0.0, f64::max);
    let (mut extent, mut square) = (SHIFTS_IN_EXTENT * shift, 0.0);
    for (direction, radius, flux) in fluxes() {
        let distance = angle(centre, direction);
        extent = extent.max(distance + radius);
        // The mean square of the distance from its centre is half the square of a disk's radius.
        square += grey(flux) * (distance * distance + 0.5 * radius * radius);
    }
    let total = grey(flux);
    let radius = if total > 0.0 { (2.0 * square / total).sqrt() } else { 0.0 };
    (Light::from_flux(centre, radius.min(FRAC_PI_2), flux), extent)
}

/// The angle between two directions, exact if it is small.
fn angle(a: Direction, b: Direction) -> f64 {
    2.0 * math::asin((0.5 * (a.vector() - b.vector()).length()).min(1.0))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use brdf::{Fresnel, Ggx, Phong};
    use sphere::spiral;

    use super::*;

    fn metal(alpha: f64) -> Material {
        Material::Ggx(Ggx::new(alpha, Fresnel::Conductor { n: [0.2; 3], k: [3.4; 3] }, [1.0; 3]).unwrap())
    }

    /// The fluxes that a texel adds.
    fn added(groups: &[LampGroup], central: Direction) -> Vec<[f64; 3]> {
        let (mut fluxes, mut next) = (Vec::new(), 0);
        for (index, group) in groups.iter().enumerate() {
            let is_enough = angle(central, group.light.direction) >= group.least_angle;
            if index >= next && is_enough {
                fluxes.push(group.light.flux());
                next = index + 1 + group.descendants;
            }
        }
        fluxes
    }

    /// Each texel sees the flux of all lamps once, and far ones in groups.
    #[test]
    fn each_lamp_is_seen_once() {
        let light = |k: usize, direction, radius| {
            Light::from_flux(direction, radius, [0.1 * k as f64, 1.0, 1.0 / (k + 1) as f64])
        };
        let box_of = |count: usize| -> Vec<Light> {
            let place = |k: usize| Direction::from_angles(1.0 + 0.01 * (k / 4) as f64, 0.01 * (k % 4) as f64);
            (0..count).map(|k| light(k, place(k), 0.004)).collect()
        };
        let all_around = (0..50).map(|k| light(k, spiral(k, 50), 0.0)).collect();
        let opposite = vec![light(1, Direction::Z, 0.1), light(1, Direction::from_angles(PI, 0.0), 0.1)];
        let same = vec![light(1, Direction::X, 0.0); 3];
        let black = vec![Light { irradiance: [0.0; 3], ..light(1, Direction::X, 0.1) }; 2];
        let cases = [Vec::new(), box_of(1), box_of(17), all_around, opposite, same, black];
        for (lights, material) in cases.iter().flat_map(|l| [metal(0.05), metal(0.9)].map(|m| (l, m))) {
            let groups = groups(lights, &material);
            for k in 0..40 {
                let found = added(&groups, spiral(k, 40));
                let sum = |fluxes: &[[f64; 3]], c: usize| fluxes.iter().map(|flux| flux[c]).sum::<f64>();
                let all: Vec<[f64; 3]> = lights.iter().map(Light::flux).collect();
                for c in 0..3 {
                    assert!((sum(&found, c) - sum(&all, c)).abs() < 1e-9, "{} lamps", lights.len());
                }
                assert!(found.len() <= lights.len());
            }
        }
        let groups_of = |material| groups(&box_of(17), &material);
        assert_eq!(groups_of(metal(0.9)).len(), 1, "a rough surface sees one lamp");
        let sharp = groups_of(metal(0.05));
        let behind = Direction::normalised(-Direction::from_angles(1.02, 0.015).vector());
        assert!(added(&sharp, behind).len() < 5);
        assert_eq!(added(&sharp, Direction::from_angles(1.02, 0.015)).len(), 17);
        let normal = Material::Phong(Phong::new(400.0, [1.0; 3]).unwrap());
        assert!(groups_of(normal).len() >= 17);
    }

    /// Two points have the second moment of their disk: half the square of its radius.
    #[test]
    fn a_disk_is_as_wide_as_its_lamps() {
        let point = |phi| Light::from_flux(Direction::from_angles(FRAC_PI_2, phi), 0.0, [1.0, 2.0, 3.0]);
        let (disk, extent) = disk_of(&[point(-0.03), point(0.03)]);
        assert!((disk.radius - 0.03 * 2f64.sqrt()).abs() < 1e-9 && (extent - 0.03).abs() < 1e-9);
        let warm = Light::from_flux(Direction::from_angles(FRAC_PI_2, 0.03), 0.0, [3.0, 2.0, 1.0]);
        let (_, extent) = disk_of(&[point(-0.03), warm]);
        // Red is centred at half the distance: three quarters of it are at one of two equal fluxes.
        assert!((extent - 8.0 * 0.015).abs() < 1e-4, "{extent}");
    }
}
