//! Light sheets in the plane across the lines: rays through one point at the grating's angles, or independent ones.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::fits::light_fit::Scene;

/// How the rays are related.
#[derive(Debug, Clone)]
pub(super) enum SectionModel {
    /// The tangents of the angles to order 0, one per listed order.
    Grating(Vec<f64>),
    /// Independent; the number of rays.
    Free(usize),
}

/// One ray per label: across = `at_mm` + `slope` · away. `None` if its lines do not determine it.
pub(super) struct Rays(Vec<Option<(f64, f64)>>);

impl SectionModel {
    /// The possible models of a scene: with increasing order the light may rotate either way.
    pub fn candidates(scene: &Scene) -> Vec<Self> {
        let Some(sine) = scene.nominal_wavelength_over_period else { return vec![Self::Free(scene.orders.len())] };
        let tangents =
            |side: f64| scene.orders.iter().map(|&order| (side * f64::from(order) * sine).asin().tan()).collect();
        vec![Self::Grating(tangents(1.0)), Self::Grating(tangents(-1.0))]
    }

    /// The rays closest to labelled positions (across, away), mm; `None` where they are not determined.
    pub fn rays(&self, labelled: &[(usize, Vector2<f64>)]) -> Option<Rays> {
        match self {
            Self::Grating(tangents) => fan(tangents, labelled),
            Self::Free(n_rays) => Some(Rays((0..*n_rays).map(|label| free_ray(label, labelled)).collect())),
        }
    }
}

/// Rays through one point: with T the slope of order 0 and τ the tangent of an order's angle to it, its slope is
/// (T + τ)/(1 − Tτ), and the rays are linear in T, b and c: across − away·τ = T·(away + across·τ) + b − c·τ.
fn fan(tangents: &[f64], labelled: &[(usize, Vector2<f64>)]) -> Option<Rays> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (label, at) in labelled {
        let tangent = tangents[*label];
        let row = Vector3::new(at.y + at.x * tangent, 1.0, -tangent);
        normal += row * row.transpose();
        right += row * (at.x - at.y * tangent);
    }
    let solved = normal.cholesky()?.solve(&right);
    let (slope, b, c) = (solved[0], solved[1], solved[2]);
    let source_away = (c - slope * b) / (1.0 + slope * slope);
    let source_across = b + source_away * slope;
    let ray = |tangent: &f64| {
        let slope = (slope + tangent) / (1.0 - slope * tangent);
        Some((source_across - slope * source_away, slope))
    };
    Some(Rays(tangents.iter().map(ray).collect()))
}

/// The straight line through the positions of one label.
fn free_ray(label: usize, labelled: &[(usize, Vector2<f64>)]) -> Option<(f64, f64)> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (_, at) in labelled.iter().filter(|(other, _)| *other == label) {
        let row = Vector2::new(1.0, at.y);
        normal += row * row.transpose();
        right += row * at.x;
    }
    let solved = normal.cholesky()?.solve(&right);
    Some((solved[0], solved[1]))
}

impl Rays {
    /// Distance of a position from the ray of `label` in units of the distance to the next ray there.
    pub fn distance_pitches(&self, label: usize, at: &Vector2<f64>) -> Option<f64> {
        let across =
            |label: usize| self.0.get(label).copied().flatten().map(|(at_mm, slope)| at_mm + slope * at.y);
        let own = across(label)?;
        let beside = [label.checked_sub(1), Some(label + 1)].into_iter().flatten().filter_map(across);
        let pitch_mm = beside.map(|other| (other - own).abs()).fold(f64::INFINITY, f64::min);
        pitch_mm.is_finite().then(|| (at.x - own).abs() / pitch_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_is_determined_by_three_positions_per_ray() {
        // Rays from (−150, 20), rotated by asin(0.033 m) about 0.4 rad.
        let tangents: Vec<f64> = (-2..=2).map(|m| (0.033 * f64::from(m)).asin().tan()).collect();
        let slope = |label: usize| (0.4f64 + tangents[label].atan()).tan();
        let at = |label: usize, away: f64| Vector2::new(-150.0 + slope(label) * (away - 20.0), away);
        let labelled: Vec<_> = [380.0, 400.0, 430.0]
            .into_iter()
            .flat_map(|away| [1, 2, 3].map(|label| (label, at(label, away))))
            .collect();
        let rays = SectionModel::Grating(tangents.clone()).rays(&labelled).unwrap();
        for label in 0..5 {
            assert!(rays.distance_pitches(label, &at(label, 410.0)).unwrap() < 1e-9, "{label}");
        }
        assert!((rays.distance_pitches(2, &at(3, 410.0)).unwrap() - 1.0).abs() < 0.05);
    }
}
