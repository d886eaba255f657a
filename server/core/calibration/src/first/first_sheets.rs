//! Initial estimates of the light sheets from lit points in space: planes by SVD (eq. 6 of the paper), the pencil from
//! the planes (eq. 7–10), the grating from the pencil.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use optics::{Grating, Pencil, Plane};

use crate::params::{GAP_PRIOR_MM, MIN_TIED_ORDERS};

/// A lit point on a board, camera frame, with its order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitPoint {
    /// Order of its line.
    pub order: i8,
    /// Position.
    pub hit_in_camera: Vector3<f64>,
}

/// One plane per order through its points, normals all on the same side; `None` where points do not determine a plane.
pub fn planes_from_points(orders: &[i8], points: &[LitPoint]) -> Option<Vec<(i8, Plane)>> {
    let mut planes: Vec<(i8, Plane)> = Vec::with_capacity(orders.len());
    for &order in orders {
        let own: Vec<Vector3<f64>> = points.iter().filter(|p| p.order == order).map(|p| p.hit_in_camera).collect();
        if own.len() < 3 {
            return None;
        }
        let centre = own.iter().sum::<Vector3<f64>>() / own.len() as f64;
        let scatter: Matrix3<f64> = own.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let eigen = scatter.symmetric_eigen();
        let mut normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let reference = planes.first().map_or(-Vector3::y(), |(_, plane)| plane.normal);
        if normal.dot(&reference) < 0.0 {
            normal = -normal;
        }
        planes.push((order, Plane::through(&centre, normal)));
    }
    Some(planes)
}

/// The pencil nearest to free planes, for λ/d_g = `wavelength_over_period`; `None` with fewer than two orders.
pub fn pencil_from_planes(
    planes: &[(i8, Plane)],
    points: &[LitPoint],
    wavelength_over_period: f64,
) -> Option<Pencil> {
    if planes.len() < MIN_TIED_ORDERS {
        return None;
    }
    let scatter: Matrix3<f64> = planes.iter().map(|(_, p)| p.normal * p.normal.transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let centre = lit_centre(points);
    let point_mm = common_point(planes, &axis, &centre)?;
    [axis, -axis]
        .into_iter()
        .filter_map(|direction| {
            let turned_back = planes.iter().map(|(order, plane)| {
                let angle = (f64::from(*order) * wavelength_over_period).asin();
                nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_unchecked(direction), -angle)
                    * plane.normal
            });
            let mean: Vector3<f64> = turned_back.sum();
            let base_normal = (mean - direction * mean.dot(&direction)).normalize();
            let pencil = Pencil { point_mm, direction, base_normal, wavelength_over_period };
            let cost: Option<f64> = points
                .iter()
                .map(|p| pencil.plane(p.order).map(|plane| plane.distance_mm(&p.hit_in_camera).powi(2)))
                .sum();
            cost.filter(|c| c.is_finite()).map(|cost| (cost, pencil))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, pencil)| pencil)
}

/// The point of the planes' common line nearest to the projection of the scene's centre onto it.
fn common_point(planes: &[(i8, Plane)], direction: &Vector3<f64>, centre: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut left = DMatrix::zeros(planes.len() + 1, 3);
    let mut right = DVector::zeros(planes.len() + 1);
    for (row, (_, plane)) in planes.iter().enumerate() {
        left.row_mut(row).copy_from(&plane.normal.transpose());
        right[row] = -plane.offset_mm;
    }
    left.row_mut(planes.len()).copy_from(&direction.transpose());
    right[planes.len()] = direction.dot(centre);
    let solution = left.svd(true, true).solve(&right, 1e-12).ok()?;
    Some(Vector3::new(solution[0], solution[1], solution[2]))
}

/// A grating in normal incidence whose sheets are close to a pencil's.
pub fn grating_from_pencil(pencil: &Pencil, lit_centre_mm: &Vector3<f64>) -> Grating {
    let l = pencil.direction;
    let towards_scene = lit_centre_mm - pencil.point_mm;
    let forward = l.cross(&pencil.base_normal);
    let axis = if forward.dot(&towards_scene) >= 0.0 { forward } else { -forward };
    // Light directions turn about +l with the order, towards l × axis; normal × groove must point there.
    let groove = -l;
    let foot = pencil.point_mm + l * towards_scene.dot(&l);
    Grating {
        source_mm: foot - axis * GAP_PRIOR_MM.0,
        axis,
        fan: groove,
        normal: axis,
        groove,
        gap_mm: GAP_PRIOR_MM.0,
        wavelength_over_period: pencil.wavelength_over_period,
    }
}

/// Centroid of the lit points.
pub fn lit_centre(points: &[LitPoint]) -> Vector3<f64> {
    points.iter().map(|p| p.hit_in_camera).sum::<Vector3<f64>>() / points.len().max(1) as f64
}
