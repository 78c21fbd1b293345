//! Models whose rho_hat depends on the angle to one axis alone: phong about the mirrored view R, lambert
//! about the normal, in closed form; kajiya-kay about the tangent, by an integral over that angle.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use sh::{Basis, Degree, lambda, zonal_into};
use sphere::{DVec3, Direction};

use super::hemisphere::{NotFiniteIncident, ViewCoefficients};
use crate::quadrature::{Panel, RULE};
use crate::{Centre, Material};

/// The error that a panel may have, as a share of the value at most.
const ACCURACY: f64 = 1e-9;
/// The most halvings of a panel.
const DEEPEST: usize = 20;

/// Whether a material is a model whose rho_hat depends on the angle to one axis alone.
pub(super) fn is_zonal(material: &Material) -> bool {
    material.radial().is_some() || material.centre() == Centre::Tangent
}

/// Adds the coefficients of a zonal material toward a view: c_lm = Lambda_l u_l Y_lm(axis) for rho_hat = sum
/// of u_l Y_l0(angle to the axis).
pub(super) fn add_zonal(
    material: &Material,
    view: Direction,
    basis: &Basis,
    sum: &mut ViewCoefficients,
) -> Result<(), NotFiniteIncident> {
    let degree = basis.degree();
    let axis = material.centre().central(Direction::Z, Direction::X, view);
    let u = match material.radial() {
        Some(lobe) => {
            let rho = lobe.coefficients(degree.get());
            rho.into_iter().map(|rgb| rgb.map(|value| value / (4.0 * PI).sqrt())).collect()
        }
        None => about_tangent(material, view, degree)?,
    };
    let mut rows = vec![0.0; degree.rows()];
    basis.evaluate_into(axis, &mut rows);
    for l in 0..=degree.get() {
        for row in l * l..(l + 1) * (l + 1) {
            (0..3).for_each(|channel| sum.c[row][channel] += lambda(l) * u[l][channel] * rows[row]);
        }
    }
    Ok(())
}

/// u_l = 2 pi times the integral of rho_hat Y_l0 sin(theta), theta from the tangent.
fn about_tangent(
    material: &Material,
    view: Direction,
    degree: Degree,
) -> Result<Vec<[f64; 3]>, NotFiniteIncident> {
    let mut u = vec![[0.0; 3]; degree.get() + 1];
    let mut row = vec![0.0; degree.get() + 1];
    let theta_o = math::acos(view.vector().x.clamp(-1.0, 1.0));
    // The highlight, and the angles at which it ends.
    let mut edges = vec![0.0, theta_o, PI];
    edges.extend([theta_o - FRAC_PI_2, theta_o + FRAC_PI_2].into_iter().filter(|t| (0.0..PI).contains(t)));
    edges.sort_by(f64::total_cmp);
    let panels = edges.windows(2).flat_map(|ends| Panel::split(ends[0], ends[1], 0.4));
    let mut waiting: Vec<Panel> = panels.filter(|panel| panel.from < panel.to).collect();
    while let Some(panel) = waiting.pop() {
        let mut values = [([0.0; 3], 0.0, 0.0); RULE.len()];
        let (mut kronrod, mut gauss, mut most) = (0.0, 0.0, 0.0f64);
        for (value, node) in values.iter_mut().zip(RULE) {
            let (sine, cosine) = math::sin_cos(panel.at(node));
            let incident = Direction::from_unit(DVec3::new(cosine, 0.0, sine));
            let rgb = material.rho_hat(incident, view);
            if !rgb.iter().all(|value| value.is_finite()) {
                return Err(NotFiniteIncident(incident));
            }
            let grey = rgb.iter().sum::<f64>() * sine;
            kronrod += node.kronrod * grey;
            gauss += node.gauss * grey;
            most = most.max(grey.abs());
            *value = (rgb, cosine, TAU * panel.radius() * node.kronrod * sine);
        }
        // Halved panels are narrow, so that the harmonics are smooth on them.
        if (kronrod - gauss).abs() > ACCURACY * most && panel.depth < DEEPEST {
            waiting.extend(panel.halves());
            continue;
        }
        for (rgb, cosine, weight) in values {
            zonal_into(cosine, &mut row);
            for (u, y) in u.iter_mut().zip(&row) {
                (0..3).for_each(|channel| u[channel] += weight * y * rgb[channel]);
            }
        }
    }
    Ok(u)
}
