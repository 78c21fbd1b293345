//! The error of bilinear look-ups, measured, against its estimate.

use std::f64::consts::PI;

use sh::Stop;
use shrm::{MapGrid, MapLayout, Reflection, View};
use sphere::Direction;

use crate::materials::{Noise, lighting, reflection, tensor};

/// RMS difference of look-ups from evaluation, over RMS radiance, at even random directions and views.
fn measured(reflection: &Reflection, grid: MapGrid, view: View) -> f64 {
    let mut noise = Noise::new(5);
    let map = reflection.synthesise(grid, view, Stop::NEVER).unwrap();
    let mut lookup = map.lookup();
    let mut random = || Direction::from_angles(noise.next().acos(), PI * noise.next());
    let (mut error, mut energy) = (0.0, 0.0);
    for _ in 0..3000 {
        let (central, view) = (random(), random());
        let expected = reflection.evaluate(central, view);
        let found = lookup.radiance(central, view);
        for channel in 0..3 {
            error += (f64::from(found[channel]) - expected[channel]).powi(2);
            energy += expected[channel].powi(2);
        }
    }
    (error / energy).sqrt()
}

/// The estimate is right for fine maps (0.85 to 1) and cautious for coarse ones, where h k is not small.
/// Samples add about 2 percent.
#[test]
fn look_ups_are_as_accurate_as_estimated() {
    let zonal = Reflection::convolve(&lighting(10, 2), &tensor(10, 3, false, 8));
    for reflection in [
        reflection(1, 0, true),
        reflection(4, 2, true),
        reflection(12, 2, true),
        reflection(3, 6, true),
        zonal,
        reflection(20, 1, true),
    ] {
        let degrees = [reflection.brdf().f().get(), reflection.brdf().p().get()];
        for layout in [MapLayout::LatLong, MapLayout::Cube] {
            for demand in [0.1, 0.012] {
                let resolution = reflection.resolution(layout, demand);
                let grid = layout.grid(resolution.texels);
                let error = measured(&reflection, grid, View::Local);
                let ratio = error / resolution.estimated_error;
                let text = format!("{degrees:?} {layout:?} {demand}: {resolution:?}, {error:.5}, {ratio:.2}");
                assert!(resolution.estimated_error <= demand && error < demand, "{text}");
                assert!(ratio < 1.02 && ratio > if demand < 0.02 { 0.8 } else { 0.5 }, "{text}");
                println!("{text}");
            }
        }
    }
}

/// Texels of a global map are the same functions of V, so that blending them before or after evaluation is
/// too.
#[test]
fn global_maps_are_looked_up_with_the_same_error() {
    let reflection = reflection(12, 2, true);
    let resolution = reflection.resolution(MapLayout::Cube, 0.02);
    let grid = MapLayout::Cube.grid(resolution.texels);
    let [local, global] = [View::Local, View::Global].map(|view| measured(&reflection, grid, view));
    assert!((local - global).abs() < 1e-6, "{local} {global}");
}

#[test]
fn resolution_never_passes_10_f() {
    let reflection = reflection(12, 2, true);
    for demand in [1e-9, 0.0, -1.0, f64::NAN] {
        let rows = reflection.resolution(MapLayout::LatLong, demand);
        assert_eq!((rows.texels, reflection.resolution(MapLayout::Cube, demand).texels), (120, 60));
        assert!(rows.estimated_error > 1e-4 && rows.estimated_error < 0.01, "{rows:?}");
    }
    let constant = crate::materials::reflection(0, 0, true).resolution(MapLayout::Cube, 0.01);
    assert_eq!((constant.texels, constant.estimated_error), (4, 0.0));
}
