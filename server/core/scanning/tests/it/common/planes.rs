//! Plane models of a station, which deviate from the bow of its sheets by tenths of a millimetre.

use nalgebra::{DMatrix, Matrix3, Vector3};
use optics::{Calibration, Grating, LightSurfaces, Plane};

/// The plane nearest to the sheet of `order` between 350 and 450 mm.
fn fitted_plane(grating: &Grating, order: i8) -> Plane {
    let lit = |phi: i32, z: i32| {
        let ray = grating.ray(f64::from(phi) * 0.05, order)?;
        Some(ray.origin_mm + ray.direction * ((350.0 + 10.0 * f64::from(z) - ray.origin_mm.z) / ray.direction.z))
    };
    let points: Vec<Vector3<f64>> = (-5..=5).flat_map(|phi| (0..=10).filter_map(move |z| lit(phi, z))).collect();
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let scatter: Matrix3<f64> = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    Plane::through(&mean, eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned())
}

/// `exact` with a plane fitted to each sheet.
pub fn fitted_planes(exact: &Calibration) -> Calibration {
    let LightSurfaces::Grating(grating) = &exact.light else { panic!("station without grating") };
    let planes = exact.orders.iter().map(|&order| (order, fitted_plane(grating, order)));
    let n_params = 12 + 3 * exact.orders.len();
    Calibration {
        light: LightSurfaces::Planes(planes.collect()),
        covariance: DMatrix::from_diagonal_element(n_params, n_params, 1e-10),
        ..exact.clone()
    }
}
