//! The surfaces that an inspection measured, and the deviations of a cloud's points from them.

use metrology::{DatumFrame, Plan, Region, Shape};
use nalgebra::{Matrix3, Rotation3, Vector3};
use optics::{PartFrame, Rigid};
use scanning::{Cloud, CloudPoint};
use serde_json::Value;

/// Points farther from a surface than this multiple of the RMS of its fit do not belong to it. The same as on the page.
const BAND_RMS: f64 = 4.0;

/// But points up to this far do, mm.
const LEAST_BAND_MM: f64 = 0.02;

/// A fitted plane, sphere or cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredSurface {
    /// Its shape in the part frame.
    shape: Shape,
    /// Points farther away do not belong to it, mm.
    band_mm: f64,
    /// The region of its points; everywhere without one.
    region: Option<Region>,
    /// The frame of the region, unless it is the part frame.
    region_frame: Option<Rigid<DatumFrame, PartFrame>>,
    /// Orders of its points; all if empty.
    orders: Vec<i8>,
}

impl MeasuredSurface {
    /// The signed distance of a point that belongs to it, mm: positive outside, or towards the camera.
    fn deviation_mm(&self, point: &CloudPoint) -> Option<f64> {
        let at = Vector3::new(point.x_mm, point.y_mm, point.z_mm);
        let deviation_mm = self.shape.distance_mm(&at);
        let is_near = deviation_mm.abs() <= self.band_mm;
        (is_near && self.is_searched(&at, point.order)).then_some(deviation_mm)
    }

    fn is_searched(&self, at: &Vector3<f64>, order: i8) -> bool {
        let at = self.region_frame.as_ref().map_or(*at, |frame| frame.rotation * at + frame.translation_mm);
        (self.orders.is_empty() || self.orders.contains(&order))
            && self.region.is_none_or(|region| region.contains(&at))
    }
}

/// The surfaces in a stored result, as `plan_json` wrote it. `plan`: the plan it was measured by.
pub fn measured_surfaces(result: &Value, plan: &Plan) -> Vec<MeasuredSurface> {
    let frame = rigid(&result["datum_from_part"]);
    let datums = plan.alignment.as_ref().map_or(Vec::new(), |alignment| alignment.datums().into());
    let aligns = plan.with_dependencies(&datums);
    let of_feature = |feature: &Value| {
        let id = feature["id"].as_str()?;
        let shape = shape(&feature["geometry"])?;
        let idx = plan.features.iter().position(|planned| planned.id == id)?;
        let selection = plan.features[idx].shape.selection()?;
        Some(MeasuredSurface {
            shape: frame.as_ref().map_or(shape, |frame| shape.moved(&frame.inverse())),
            band_mm: (BAND_RMS * feature["rms_mm"].as_f64()?).max(LEAST_BAND_MM),
            region: selection.region,
            region_frame: frame.filter(|_| !aligns[idx]),
            orders: selection.orders.clone(),
        })
    };
    result["features"].as_array().map_or_else(Vec::new, |all| all.iter().filter_map(of_feature).collect())
}

/// The deviation of every point from the surface it is nearest to, mm; NaN if it belongs to none.
pub(super) fn deviations_mm(cloud: &Cloud, surfaces: &[MeasuredSurface]) -> Vec<f32> {
    let nearest = |point: &CloudPoint| {
        let all = surfaces.iter().filter_map(|surface| surface.deviation_mm(point));
        all.min_by(|a, b| a.abs().total_cmp(&b.abs())).map_or(f32::NAN, |deviation_mm| deviation_mm as f32)
    };
    cloud.points.iter().map(nearest).collect()
}

/// A plane, its normal towards the camera, a sphere or a cylinder, as `plan_json` writes them.
fn shape(geometry: &Value) -> Option<Shape> {
    let xyz = |name: &str| vector(&geometry[name]);
    let radius = || geometry["radius_mm"].as_f64();
    Some(match geometry["kind"].as_str()? {
        "plane" => Shape::Plane { point_mm: xyz("point_mm")?, normal: xyz("normal")? },
        "sphere" => Shape::Sphere { centre_mm: xyz("centre_mm")?, radius_mm: radius()? },
        "cylinder" => Shape::Cylinder { point_mm: xyz("point_mm")?, axis: xyz("axis")?, radius_mm: radius()? },
        _ => return None,
    })
}

fn vector(value: &Value) -> Option<Vector3<f64>> {
    let of = |idx: usize| value[idx].as_f64();
    Some(Vector3::new(of(0)?, of(1)?, of(2)?))
}

fn rigid(pose: &Value) -> Option<Rigid<DatumFrame, PartFrame>> {
    let row = |idx: usize| vector(&pose["rotation"][idx]).map(|row| row.transpose());
    let rotation = Matrix3::from_rows(&[row(0)?, row(1)?, row(2)?]);
    Some(Rigid::new(Rotation3::from_matrix_unchecked(rotation), vector(&pose["translation_mm"])?))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::drawing::point_at;

    /// A plane found in the datum frame, and one that the alignment depends on, found in the part frame.
    fn surfaces() -> Vec<MeasuredSurface> {
        let around = |z_mm: f64| json!({ "region": { "type": "box", "min_mm": [-5, -5, z_mm - 1.0], "max_mm": [5, 5, z_mm + 1.0] } });
        let plan = json!({
            "format": "sheaf-plan/1",
            "features": [
                { "id": "top", "shape": { "type": "plane", "select": around(0.0) } },
                { "id": "base", "shape": { "type": "plane", "select": around(402.0) } },
                { "id": "corner", "shape": { "type": "point", "of": { "centre": "base" } } },
            ],
            "alignment": { "primary": "corner", "secondary": "corner", "tertiary": "corner" },
            "characteristics": [],
        });
        let plane = |id: &str, z_mm: f64| {
            json!({ "id": id, "rms_mm": 0.002,
                "geometry": { "kind": "plane", "point_mm": [0, 0, z_mm], "normal": [0, 0, -1] } })
        };
        let result = json!({
            "datum_from_part": { "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation_mm": [0, 0, -400] },
            "features": [
                plane("top", 0.0),
                plane("base", 2.0),
                { "id": "corner", "geometry": { "kind": "point", "at_mm": [0, 0, 2] }, "rms_mm": null },
            ],
        });
        measured_surfaces(&result, &serde_json::from_value(plan).unwrap())
    }

    #[test]
    fn points_deviate_from_the_surface_they_belong_to() {
        let surfaces = surfaces();
        assert_eq!(surfaces.len(), 2, "a point is no surface");
        let cases = [
            ("above the top", [0.0, 399.99], Some(0.01)),
            ("below the top", [0.0, 400.01], Some(-0.01)),
            ("beyond its band", [0.0, 399.97], None),
            ("outside its region", [6.0, 400.0], None),
            ("below the base, which the alignment depends on", [0.0, 402.01], Some(-0.01)),
            ("between both", [0.0, 401.0], None),
        ];
        for (name, [x_mm, z_mm], expected) in cases {
            let point = point_at([x_mm, 0.0, z_mm]);
            let cloud = Cloud { points: vec![point], comments: Vec::new() };
            let deviation_mm = deviations_mm(&cloud, &surfaces)[0];
            match expected {
                Some(expected) => assert!((deviation_mm - expected).abs() < 1e-6, "{name}: {deviation_mm}"),
                None => assert!(deviation_mm.is_nan(), "{name}: {deviation_mm}"),
            }
        }
    }
}
