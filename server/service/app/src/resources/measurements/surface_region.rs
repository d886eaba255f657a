//! Voxel region of the points of a fitted feature: coarse enough to send, fine enough for colouring.

use metrology::FittedFeature;
use nalgebra::Vector3;
use scanning::Cloud;
use serde_json::{Value, json};

/// Voxels along the longest side of the bounding box: more make no visible difference.
const CELLS_ALONG: f64 = 48.0;

/// Maximum number of cells returned: some 10 kB in a measurement.
const CELLS_LIMIT: usize = 2_000;

/// Smallest cell, mm: displayed points lie some hundredths of a millimetre from those of the cloud.
const CELL_MIN_MM: f64 = 0.5;

/// Each time there are too many cells they grow by this factor.
const GROWTH: f64 = 1.25;

/// Margin for the rounding of display points, mm.
const ROUNDING_MM: f64 = 0.01;

/// The voxels, part frame, mm, with the maximum distance of a point of the feature from its shape; null without points.
///
/// The index of a voxel is x + size_x · (y + size_y · z), counted from the one at `origin_mm`.
pub fn surface_region(cloud: &Cloud, feature: &FittedFeature) -> Value {
    let points = feature.cloud_indices.iter().filter_map(|&idx| cloud.points.get(idx as usize));
    let positions: Vec<Vector3<f64>> = points.map(|p| Vector3::new(p.x_mm, p.y_mm, p.z_mm)).collect();
    let Some(first) = positions.first() else { return Value::Null };
    let (low, high) = positions.iter().fold((*first, *first), |(low, high), at| (low.inf(at), high.sup(at)));
    let band_mm = positions.iter().map(|at| feature.shape.distance_mm(at).abs()).fold(0.0, f64::max) + ROUNDING_MM;
    let mut cell_mm = ((high - low).max() / CELLS_ALONG).max(CELL_MIN_MM);
    let (origin, size, cells) = loop {
        let (origin, size, cells) = grid(&positions, &low, &high, cell_mm);
        if cells.len() <= CELLS_LIMIT {
            break (origin, size, cells);
        }
        cell_mm *= GROWTH;
    };
    json!({ "origin_mm": origin, "cell_mm": cell_mm, "size": size, "cells": cells, "band_mm": band_mm })
}

/// Origin, size and occupied cells, sorted, of a grid with half a cell of room around the points.
fn grid(
    positions: &[Vector3<f64>],
    low: &Vector3<f64>,
    high: &Vector3<f64>,
    cell_mm: f64,
) -> ([f64; 3], [usize; 3], Vec<usize>) {
    let origin = low.add_scalar(-0.5 * cell_mm);
    let size = [0, 1, 2].map(|axis| ((high[axis] - origin[axis]) / cell_mm).floor() as usize + 1);
    let mut cells: Vec<usize> = positions
        .iter()
        .map(|at| {
            let [x, y, z] = [0, 1, 2].map(|axis| ((at[axis] - origin[axis]) / cell_mm).floor() as usize);
            x + size[0] * (y + size[1] * z)
        })
        .collect();
    cells.sort_unstable();
    cells.dedup();
    (origin.into(), size, cells)
}

#[cfg(test)]
mod tests {
    use metrology::Shape;
    use scanning::CloudPoint;

    use super::*;

    /// A plate of 40 × 40 mm of which the right half belongs to the feature.
    fn half_a_plate() -> (Cloud, FittedFeature) {
        let mut points = Vec::new();
        for (x, y) in (0..400).flat_map(|x| (0..400).map(move |y| (x, y))) {
            points.push(CloudPoint {
                x_mm: f64::from(x) * 0.1,
                y_mm: f64::from(y) * 0.1,
                z_mm: 400.0 + 0.02 * f64::from((x + y) % 3 - 1),
                order: 0,
                frame: 0,
                u_px: 0.0,
                v_px: 0.0,
                intensity: 0.0,
                sigma_mm: 0.02,
            });
        }
        let cloud_indices = (0..points.len() as u32).filter(|&idx| points[idx as usize].x_mm >= 20.0).collect();
        let shape = Shape::Plane { point_mm: Vector3::new(30.0, 20.0, 400.0), normal: -Vector3::z() };
        let feature = FittedFeature {
            role: "plane",
            shape,
            n_points: points.len() / 2,
            n_outliers: 0,
            n_border: 0,
            rms_mm: 0.02,
            cloud_indices,
        };
        (Cloud { points, comments: Vec::new() }, feature)
    }

    #[test]
    fn a_region_contains_the_points_of_its_feature_and_few_others() {
        let (cloud, feature) = half_a_plate();
        let region = surface_region(&cloud, &feature);
        let number = |value: &Value| value.as_f64().unwrap();
        let (origin, cell_mm) = (region["origin_mm"].as_array().unwrap(), number(&region["cell_mm"]));
        let size: Vec<usize> =
            region["size"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap() as usize).collect();
        let cells: Vec<usize> =
            region["cells"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap() as usize).collect();
        assert!(cells.len() <= CELLS_LIMIT && cell_mm < 2.0, "{} cells of {cell_mm} mm", cells.len());
        let holds = |point: &CloudPoint| {
            let at = [point.x_mm, point.y_mm, point.z_mm];
            let cell = [0, 1, 2].map(|axis| ((at[axis] - number(&origin[axis])) / cell_mm).floor());
            let inside = (0..3).all(|axis| cell[axis] >= 0.0 && cell[axis] < size[axis] as f64);
            let [x, y, z] = cell.map(|n| n as usize);
            inside && cells.binary_search(&(x + size[0] * (y + size[1] * z))).is_ok()
        };
        assert!(feature.cloud_indices.iter().all(|&idx| holds(&cloud.points[idx as usize])));
        // Beyond one cell of the edge nothing else is in.
        assert!(!cloud.points.iter().any(|point| point.x_mm < 20.0 - cell_mm && holds(point)));
        let band_mm = number(&region["band_mm"]);
        assert!((band_mm - 0.03).abs() < 1e-9, "{band_mm}");
    }

    #[test]
    fn a_feature_without_points_has_no_region() {
        let (cloud, feature) = half_a_plate();
        assert!(surface_region(&cloud, &FittedFeature { cloud_indices: Vec::new(), ..feature }).is_null());
    }
}
