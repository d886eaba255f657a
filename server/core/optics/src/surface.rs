//! The three light-surface models behind one interface: the intersection of a camera ray with the sheet of an order.

use nalgebra::Vector3;

use crate::grating::{GRATING_PARAMETER_NAMES, GRATING_PARAMETERS, Grating};
use crate::pencil::{PENCIL_PARAMETER_NAMES, PENCIL_PARAMETERS, Pencil};
use crate::plane::{PLANE_PARAMETERS, Plane};

/// Newton steps for φ; 2–4 suffice from the initial estimate.
const PHI_MAX_STEPS: usize = 20;

/// Stop when φ moves less than this (radians): below 1e-9 mm at a metre.
const PHI_TOLERANCE_RAD: f64 = 1e-13;

/// Which of the light-surface models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightModelKind {
    /// One free plane per order.
    Planes,
    /// Planes through one line at the angles of the grating equation.
    Pencil,
    /// The exact curved sheets of the vector grating equation.
    Grating,
}

impl LightModelKind {
    /// All models, simplest first.
    pub const ALL: [Self; 3] = [Self::Planes, Self::Pencil, Self::Grating];

    /// The name used in documents, on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Planes => "planes",
            Self::Pencil => "pencil",
            Self::Grating => "grating",
        }
    }
}

impl std::fmt::Display for LightModelKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// The light sheets of all orders by one model, in the camera frame.
#[derive(Debug, Clone, PartialEq)]
pub enum LightSurfaces {
    /// One plane per order, listed with its order.
    Planes(Vec<(i8, Plane)>),
    /// A pencil of planes.
    Pencil(Pencil),
    /// The exact sheets.
    Grating(Grating),
}

/// Intersection of a camera ray with a light sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceHit {
    /// z of the hit: X = `depth_mm` · ray.
    pub depth_mm: f64,
    /// Unit normal of the sheet at the hit.
    pub normal: Vector3<f64>,
    /// Fan angle of the light ray at the hit (0 for the plane models).
    pub phi_rad: f64,
    /// Distance from the grating along the light ray (0 for the plane models).
    pub path_length_mm: f64,
}

impl LightSurfaces {
    /// Which model this is.
    pub fn kind(&self) -> LightModelKind {
        match self {
            Self::Planes(_) => LightModelKind::Planes,
            Self::Pencil(_) => LightModelKind::Pencil,
            Self::Grating(_) => LightModelKind::Grating,
        }
    }

    /// Number of local parameters.
    pub fn parameters(&self) -> usize {
        match self {
            Self::Planes(planes) => planes.len() * PLANE_PARAMETERS,
            Self::Pencil(_) => PENCIL_PARAMETERS,
            Self::Grating(_) => GRATING_PARAMETERS,
        }
    }

    /// Names of the local parameters.
    pub fn parameter_names(&self) -> Vec<String> {
        match self {
            Self::Planes(planes) => planes
                .iter()
                .flat_map(|(order, _)| {
                    ["normal_e1_rad", "normal_e2_rad", "offset_mm"].map(|name| format!("order_{order}_{name}"))
                })
                .collect(),
            Self::Pencil(_) => PENCIL_PARAMETER_NAMES.map(String::from).to_vec(),
            Self::Grating(_) => GRATING_PARAMETER_NAMES.map(String::from).to_vec(),
        }
    }

    /// Intersection of `ray` = (x_h, y_h, 1) with the sheet of `order`; `None` if there is none, or the order is
    /// unknown.
    ///
    /// `phi_guess_rad`: fan angle of a neighbouring hit, to save Newton steps.
    pub fn hit(&self, order: i8, ray: &Vector3<f64>, phi_guess_rad: Option<f64>) -> Option<SurfaceHit> {
        let plane = match self {
            Self::Planes(planes) => planes.iter().find(|(candidate, _)| *candidate == order)?.1,
            Self::Pencil(pencil) => pencil.plane(order)?,
            Self::Grating(grating) => return grating_hit(grating, order, ray, phi_guess_rad),
        };
        let depth_mm = plane.depth_along(ray)?;
        Some(SurfaceHit { depth_mm, normal: plane.normal, phi_rad: 0.0, path_length_mm: 0.0 })
    }

    /// Displacement of the sheet along its normal at `hit`, per local parameter (mm per unit).
    pub fn normal_motion_by_parameters(
        &self,
        order: i8,
        ray: &Vector3<f64>,
        hit: &SurfaceHit,
    ) -> Option<Vec<f64>> {
        let point = ray * hit.depth_mm;
        match self {
            Self::Planes(planes) => {
                let mut motion = vec![0.0; planes.len() * PLANE_PARAMETERS];
                let idx = planes.iter().position(|(candidate, _)| *candidate == order)?;
                let gradient = planes[idx].1.distance_by_parameters(&point);
                for (slot, slope) in motion[idx * PLANE_PARAMETERS..].iter_mut().zip(gradient) {
                    *slot = -slope;
                }
                Some(motion)
            }
            Self::Pencil(pencil) => {
                Some(pencil.distance_by_parameters(order, &point)?.iter().map(|slope| -slope).collect())
            }
            Self::Grating(grating) => {
                Some(grating.normal_motion(hit.phi_rad, order, hit.path_length_mm, &hit.normal)?.to_vec())
            }
        }
    }

    /// Moved by a local step of [`LightSurfaces::parameters`] entries.
    pub fn stepped(&self, step: &[f64]) -> Self {
        match self {
            Self::Planes(planes) => Self::Planes(
                planes
                    .iter()
                    .zip(step.chunks_exact(PLANE_PARAMETERS))
                    .map(|((order, plane), step)| (*order, plane.stepped(step)))
                    .collect(),
            ),
            Self::Pencil(pencil) => Self::Pencil(pencil.stepped(&leading(step))),
            Self::Grating(grating) => Self::Grating(grating.stepped(&leading(step))),
        }
    }
}

/// The first `N` entries of a step vector; missing ones are zero.
fn leading<const N: usize>(step: &[f64]) -> [f64; N] {
    let mut fixed = [0.0; N];
    for (slot, value) in fixed.iter_mut().zip(step) {
        *slot = *value;
    }
    fixed
}

/// Solves Q(φ)·(D × k'_m(φ)) = 0 by Newton's method (`docs/maths/grating.md`, eq. 9), then intersects the two lines.
fn grating_hit(
    grating: &Grating,
    order: i8,
    ray: &Vector3<f64>,
    phi_guess_rad: Option<f64>,
) -> Option<SurfaceHit> {
    let mut phi = phi_guess_rad.or_else(|| phi_from_flat_sheet(grating, order, ray))?;
    for _ in 0..PHI_MAX_STEPS {
        let light = ray_by_phi(grating, phi, order)?;
        let normal = ray.cross(&light.direction);
        let mismatch = light.origin.dot(&normal);
        let slope = light.origin_by_phi.dot(&normal) + light.origin.dot(&ray.cross(&light.direction_by_phi));
        let step = mismatch / slope;
        if !step.is_finite() {
            return None;
        }
        phi -= step;
        if step.abs() < PHI_TOLERANCE_RAD {
            return intersection(grating, order, ray, phi);
        }
    }
    None
}

/// A ray and its derivative with respect to φ only.
struct RayByPhi {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    origin_by_phi: Vector3<f64>,
    direction_by_phi: Vector3<f64>,
}

fn ray_by_phi(grating: &Grating, phi: f64, order: i8) -> Option<RayByPhi> {
    let (sin, cos) = phi.sin_cos();
    let k = grating.axis * cos + grating.fan * sin;
    let ray = grating.diffracted(&k, order)?;
    let k_by_phi = grating.fan * cos - grating.axis * sin;
    let n = grating.normal;
    let incidence = k.dot(&n);
    let incidence_by_phi = k_by_phi.dot(&n);
    let path_length_mm = grating.gap_mm / incidence;
    let forward = ray.direction.dot(&n);
    let tangential_by_phi = k_by_phi - n * incidence_by_phi;
    let forward_by_phi = -(ray.direction - n * forward).dot(&tangential_by_phi) / forward;
    Some(RayByPhi {
        origin: ray.origin_mm,
        direction: ray.direction,
        origin_by_phi: k_by_phi * path_length_mm - k * (path_length_mm * incidence_by_phi / incidence),
        direction_by_phi: tangential_by_phi + n * forward_by_phi,
    })
}

/// Initial φ: the hit on the flat sheet spanned by the central ray and the lit line, from the source.
fn phi_from_flat_sheet(grating: &Grating, order: i8, ray: &Vector3<f64>) -> Option<f64> {
    let centre = ray_by_phi(grating, 0.0, order)?;
    let normal =
        centre.direction.cross(&(centre.origin_by_phi + centre.direction_by_phi * grating.gap_mm)).normalize();
    let depth = Plane::through(&centre.origin, normal).depth_along(ray)?;
    let seen = ray * depth - grating.source_mm;
    let along = seen.dot(&grating.fan);
    let path_length_mm = (seen - grating.fan * along).norm();
    Some(along.atan2(path_length_mm))
}

fn intersection(grating: &Grating, order: i8, ray: &Vector3<f64>, phi: f64) -> Option<SurfaceHit> {
    let light = ray_by_phi(grating, phi, order)?;
    // λ·D − t·k' = Q in least squares; the two lines are coplanar at the solution.
    let (dd, dk, kk) = (ray.norm_squared(), ray.dot(&light.direction), light.direction.norm_squared());
    let (dq, kq) = (ray.dot(&light.origin), light.direction.dot(&light.origin));
    let determinant = dd * kk - dk * dk;
    let depth_mm = (dq * kk - dk * kq) / determinant;
    let path_length_mm = (dk * dq - dd * kq) / determinant;
    if !(depth_mm > 0.0 && path_length_mm > 0.0) {
        return None;
    }
    let along_fan = light.origin_by_phi + light.direction_by_phi * path_length_mm;
    Some(SurfaceHit {
        depth_mm,
        normal: light.direction.cross(&along_fan).normalize(),
        phi_rad: phi,
        path_length_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grating::tests::grating;

    #[test]
    fn triangulation_recovers_a_lit_point_on_its_camera_ray() {
        let grating = grating();
        for (phi, order, path_length_mm) in
            [(0.3, -2, 380.0), (-0.25, 2, 500.0), (0.0, 0, 300.0), (0.42, 4, 400.0)]
        {
            let light = grating.ray(phi, order).unwrap();
            let point = light.origin_mm + light.direction * path_length_mm;
            let ray = point / point.z;
            let hit = LightSurfaces::Grating(grating).hit(order, &ray, None).unwrap();
            assert!((hit.depth_mm - point.z).abs() < 1e-9, "{phi} {order}: {} {}", hit.depth_mm, point.z);
            assert!((hit.phi_rad - phi).abs() < 1e-12);
        }
    }

    #[test]
    fn derivatives_by_phi_agree_with_central_differences() {
        // Second-order truncation of the differences.
        const STEP: f64 = 1e-5;
        const TOLERANCE: f64 = 1e-7;
        let grating = grating();
        for (phi, order) in [(0.25, -2), (-0.1, 1), (0.3, 4)] {
            let exact = ray_by_phi(&grating, phi, order).unwrap();
            let (ahead, behind) =
                (grating.ray(phi + STEP, order).unwrap(), grating.ray(phi - STEP, order).unwrap());
            let origin = (ahead.origin_mm - behind.origin_mm) / (2.0 * STEP);
            let direction = (ahead.direction - behind.direction) / (2.0 * STEP);
            assert!((origin - exact.origin_by_phi).norm() < TOLERANCE);
            assert!((direction - exact.direction_by_phi).norm() < TOLERANCE);
        }
    }

    #[test]
    fn the_normal_motion_of_a_sheet_agrees_with_central_differences() {
        let surfaces = LightSurfaces::Grating(grating());
        let ray = Vector3::new(0.2, 0.05, 1.0);
        let hit = surfaces.hit(2, &ray, None).unwrap();
        let motion = surfaces.normal_motion_by_parameters(2, &ray, &hit).unwrap();
        for parameter in 0..GRATING_PARAMETERS {
            let depth = |size: f64| {
                let mut step = [0.0; GRATING_PARAMETERS];
                step[parameter] = size;
                surfaces.stepped(&step).hit(2, &ray, None).unwrap().depth_mm
            };
            let difference = (depth(1e-5) - depth(-1e-5)) / 2e-5;
            let predicted = motion[parameter] / hit.normal.dot(&ray);
            assert!((difference - predicted).abs() < 1e-5 * predicted.abs().max(1.0), "{parameter}");
        }
    }

    #[test]
    fn an_order_that_was_not_calibrated_gives_no_hit() {
        let plane = Plane { normal: Vector3::z(), offset_mm: -400.0 };
        assert_eq!(LightSurfaces::Planes(vec![(0, plane)]).hit(1, &Vector3::z(), None), None);
    }
}
