//! Linearity and repeatability of the heights of a plate.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::figures::Plate;

/// Linearity along z: heights of a plate compared with the heights at which it was placed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Linearity {
    /// Slope of the least-squares line through measured over reference heights; 1 for a perfect scale.
    pub slope: f64,
    /// Largest minus smallest reference height, mm: the full scale.
    pub range_mm: f64,
    /// Deviation of each position from the least-squares line, mm.
    pub deviations_mm: Vec<f64>,
    /// The deviation of largest magnitude, mm.
    pub largest_mm: f64,
    /// Its magnitude in per cent of the full scale.
    pub percent_of_range: f64,
    /// Largest minus smallest deviation, mm.
    pub peak_to_peak_mm: f64,
    /// Fewest points that were averaged for a height.
    pub n_averaged: usize,
}

/// Repeatability along z of a plate that was not moved: standard deviations, 1 σ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Repeatability {
    /// Number of scans.
    pub n_scans: usize,
    /// Of a single point from scan to scan, mm.
    pub single_mm: f64,
    /// Of the height of the plate, the mean of its points, mm.
    pub averaged_mm: f64,
    /// Fewest points that were averaged.
    pub n_averaged: usize,
}

/// Heights of plates above their mean position, mm, along their mean normal: positive towards the camera. All are read at
/// one place across, so that a tilted plate does not add the offset of its centroid. `None` without plates.
pub(crate) fn heights_mm(plates: &[&Plate]) -> Option<Vec<f64>> {
    let normals: Vector3<f64> = plates.iter().map(|plate| Vector3::from(plate.normal)).sum();
    let normal = normals.try_normalize(f64::MIN_POSITIVE)?;
    let points: Vector3<f64> = plates.iter().map(|plate| Vector3::from(plate.point_mm)).sum();
    let middle = points / plates.len() as f64;
    let height = |plate: &&Plate| {
        let own = Vector3::from(plate.normal);
        own.dot(&(Vector3::from(plate.point_mm) - middle)) / own.dot(&normal)
    };
    Some(plates.iter().map(height).collect())
}

/// The linearity of plates placed at the reference heights; `None` unless there are three different heights.
pub(crate) fn linearity(plates: &[&Plate], reference_mm: &[f64]) -> Option<Linearity> {
    let measured_mm = heights_mm(plates)?;
    let n = reference_mm.len() as f64;
    let (mean_reference, mean_measured) =
        (reference_mm.iter().sum::<f64>() / n, measured_mm.iter().sum::<f64>() / n);
    let square: f64 = reference_mm.iter().map(|at| (at - mean_reference).powi(2)).sum();
    let product: f64 =
        reference_mm.iter().zip(&measured_mm).map(|(at, got)| (at - mean_reference) * (got - mean_measured)).sum();
    let mut different = reference_mm.to_vec();
    different.sort_unstable_by(f64::total_cmp);
    different.dedup();
    if different.len() < 3 {
        return None;
    }
    let slope = product / square;
    let deviation = |(at, got): (&f64, &f64)| got - mean_measured - slope * (at - mean_reference);
    let deviations_mm: Vec<f64> = reference_mm.iter().zip(&measured_mm).map(deviation).collect();
    let largest_mm = deviations_mm.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let (low, high) = range(&deviations_mm);
    let (from, to) = range(reference_mm);
    Some(Linearity {
        slope,
        range_mm: to - from,
        largest_mm,
        percent_of_range: 100.0 * largest_mm.abs() / (to - from),
        peak_to_peak_mm: high - low,
        n_averaged: fewest_points(plates),
        deviations_mm,
    })
}

/// The repeatability of scans of one plate; `differences_mm`: RMS of the differences of single points from the first scan,
/// of every later one. `None` for fewer than two scans.
pub(crate) fn repeatability(plates: &[&Plate], differences_mm: &[f64]) -> Option<Repeatability> {
    let heights_mm = heights_mm(plates)?;
    let n = heights_mm.len() as f64;
    if plates.len() < 2 || differences_mm.is_empty() {
        return None;
    }
    let mean = heights_mm.iter().sum::<f64>() / n;
    let variance = heights_mm.iter().map(|height| (height - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // A difference of two points has twice the variance of one.
    let square = differences_mm.iter().map(|rms| rms * rms).sum::<f64>() / (2.0 * differences_mm.len() as f64);
    Some(Repeatability {
        n_scans: plates.len(),
        single_mm: square.sqrt(),
        averaged_mm: variance.sqrt(),
        n_averaged: fewest_points(plates),
    })
}

fn fewest_points(plates: &[&Plate]) -> usize {
    let averaged = |plate: &&Plate| plate.dispersion.n_points - plate.dispersion.n_rejected;
    plates.iter().map(averaged).min().unwrap_or(0)
}

fn range(values: &[f64]) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    values.iter().fold(start, |(low, high), value| (low.min(*value), high.max(*value)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::acceptance::Dispersion;

    /// A plate at a height above 400 mm before the camera, with its centroid off the axis and a tilt about y.
    fn plate(height_mm: f64, across_mm: f64, tilt_rad: f64) -> Plate {
        let normal = Vector3::new(tilt_rad.sin(), 0.0, -tilt_rad.cos());
        Plate {
            point_mm: [across_mm, 0.0, 400.0 - height_mm + across_mm * tilt_rad.tan()],
            normal: normal.into(),
            dispersion: Dispersion { n_points: 1000, n_rejected: 3, range_mm: 0.1, d95_mm: 0.05 },
            n_excluded: 0,
            per_order: Vec::new(),
        }
    }

    #[test]
    fn heights_are_read_at_one_place_and_positive_towards_the_camera() {
        let plates = [plate(0.0, -8.0, 0.02), plate(10.0, 8.0, 0.02)];
        let heights = heights_mm(&[&plates[0], &plates[1]]).unwrap();
        // Both have the same tilt, so that the heights along the normal are those along z times its cosine.
        assert!((heights[1] - heights[0] - 10.0 * 0.02f64.cos()).abs() < 1e-9, "{heights:?}");
    }

    #[test]
    fn linearity_is_the_deviation_from_the_least_squares_line() {
        // Scale 1.001 and a bow of ±6 µm that is orthogonal to a line: (1, −2, 1) at the ends and in the middle.
        let reference = [0.0, 20.0, 40.0];
        let bow = [0.003, -0.006, 0.003];
        let plates: Vec<Plate> =
            reference.iter().zip(bow).map(|(at, bow)| plate(1.001 * at + bow, 0.0, 0.0)).collect();
        let found = linearity(&plates.iter().collect::<Vec<_>>(), &reference).unwrap();
        assert!((found.slope - 1.001).abs() < 1e-12, "{found:?}");
        assert!((found.largest_mm + 0.006).abs() < 1e-9 && (found.peak_to_peak_mm - 0.009).abs() < 1e-9);
        assert!((found.percent_of_range - 0.015).abs() < 1e-6 && found.n_averaged == 997);
        let twice = [0.0, 20.0, 20.0];
        assert_eq!(linearity(&plates.iter().collect::<Vec<_>>(), &twice), None);
    }

    #[test]
    fn repeatability_states_one_point_and_the_mean() {
        let plates = [plate(0.001, 0.0, 0.0), plate(-0.001, 0.0, 0.0), plate(0.0, 0.0, 0.0)];
        let all: Vec<&Plate> = plates.iter().collect();
        let found = repeatability(&all, &[0.014, 0.014]).unwrap();
        assert!((found.single_mm - 0.014 / 2f64.sqrt()).abs() < 1e-12 && (found.averaged_mm - 0.001).abs() < 1e-9);
        assert_eq!(repeatability(&all[..1], &[]), None);
    }
}
