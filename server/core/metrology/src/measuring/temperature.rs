//! Effect of temperature on the light: the laser's wavelength drifts, and with it the angle between the orders.

use nalgebra::{DMatrix, DVector, Vector3};
use optics::{Calibration, LightSurfaces, Plane};

use crate::params::{TEMPERATURE_SIGMA_K, WAVELENGTH_DRIFT_PER_K};

/// Singular values below this fraction of the largest are zero: planes through one line determine no position along it.
const RANK_TOLERANCE: f64 = 1e-4;

/// The calibration one σ warmer and one σ colder; `None` if its light model does not depend on the wavelength.
pub(crate) fn wavelength_drift(calibration: &Calibration) -> Option<[Calibration; 2]> {
    let share = WAVELENGTH_DRIFT_PER_K * TEMPERATURE_SIGMA_K;
    let drifted = |share: f64| {
        let mut light = calibration.light.clone();
        match &mut light {
            LightSurfaces::Grating(grating) => grating.wavelength_over_period *= 1.0 + share,
            LightSurfaces::Pencil(pencil) => pencil.wavelength_over_period *= 1.0 + share,
            LightSurfaces::Planes(planes) => turn(planes, share)?,
        }
        Some(Calibration { light, ..calibration.clone() })
    };
    Some([drifted(share)?, drifted(-share)?])
}

/// Rotates every plane about the line common to nearly all of them, by its order's part of the angle between
/// neighbours.
fn turn(planes: &mut [(i8, Plane)], share: f64) -> Option<()> {
    let (first, last) = (planes.iter().min_by_key(|(m, _)| *m)?, planes.iter().max_by_key(|(m, _)| *m)?);
    if first.0 == last.0 {
        return None;
    }
    let by_order = (last.1.normal - first.1.normal) / (f64::from(last.0) - f64::from(first.0));
    let normals = DMatrix::from_fn(planes.len(), 3, |row, column| planes[row].1.normal[column]);
    let offsets = DVector::from_iterator(planes.len(), planes.iter().map(|(_, plane)| -plane.offset_mm));
    let svd = normals.svd(true, true);
    let point = svd.solve(&offsets, RANK_TOLERANCE * svd.singular_values.max()).ok()?;
    let point = Vector3::new(point[0], point[1], point[2]);
    for (order, plane) in planes {
        let normal = (plane.normal + by_order * (f64::from(*order) * share)).normalize();
        plane.offset_mm += (plane.normal - normal).dot(&point);
        plane.normal = normal;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::station::station;

    #[test]
    fn planes_rotate_about_their_common_line_in_proportion_to_their_order() {
        let station = station();
        let [warm, cold] = wavelength_drift(&station).unwrap();
        let planes = |calibration: &Calibration| match &calibration.light {
            LightSurfaces::Planes(planes) => planes.clone(),
            _ => panic!("not planes"),
        };
        let share = WAVELENGTH_DRIFT_PER_K * TEMPERATURE_SIGMA_K;
        for ((order, before), (_, after)) in planes(&station).iter().zip(planes(&warm)) {
            let turned = before.normal.cross(&after.normal).norm();
            // 0.033 rad between neighbours; the chord over two orders is a thousandth shorter.
            let expected = 0.033 * share * f64::from(order.abs());
            assert!((turned - expected).abs() <= 2e-3 * expected, "{order}: {turned}");
        }
        assert_ne!(planes(&warm), planes(&cold));
        let alone = Calibration { light: LightSurfaces::Planes(planes(&station)[..1].to_vec()), ..station };
        assert!(wavelength_drift(&alone).is_none());
    }
}
