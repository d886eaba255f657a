//! Independence of the stage's zero: every tool, with and without a calibration, with shifted stages. Not covered: that
//! a scan of shifted positions gives the shifted cloud; see `server/cli/tests/it/rigs/rig_a.rs`.

use nalgebra::Vector3;
use optics::{CameraFrame, PointMm, StageAxis};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, StagePositions};

use super::station::gauge_scan;
use super::surfaces::{ball, gauge, rod, roof, two_balls};
use super::synthetic::SIGMA_MM;
use crate::fitting::features::Search;
use crate::fitting::sample::Samples;
use crate::*;

/// Added to every stage position, mm.
const OFFSETS_MM: [f64; 5] = [-100.0, -37.3, 12.5, 50.0, 150.0];

/// Tolerance, mm: a thousand times the rounding of float64 at half a metre, over all points and steps of a fit.
const SAME_MM: f64 = 1e-6;

/// The stage of clouds made at rest.
const DIRECTION: Vector3<f64> = Vector3::new(-0.005, 0.9998, -0.02);

/// The cloud of the same images with every stage position increased by `offset_mm`.
pub(super) fn shifted(cloud: &Cloud, offset_mm: f64) -> Cloud {
    let mut cloud = cloud.clone();
    let n_frames = cloud.points.iter().map(|point| point.frame as usize + 1).max().unwrap_or(0);
    let (axis, positions_mm) = StagePositions::from_comments(&cloud.comments)
        .and_then(|stage| {
            Some((stage.stage.linear()?, stage.positions.iter().map(|position| position.value()).collect()))
        })
        .filter(|(axis, _)| axis.direction.norm() > 0.0)
        .unwrap_or((StageAxis::new(DIRECTION), vec![0.0; n_frames]));
    let stage = StagePositions::linear(axis, positions_mm.iter().map(|position_mm: &f64| position_mm + offset_mm));
    let moved = axis.direction * -offset_mm;
    for point in &mut cloud.points {
        point.x_mm += moved.x;
        point.y_mm += moved.y;
        point.z_mm += moved.z;
    }
    cloud
        .comments
        .retain(|line| !line.starts_with("stage_direction ") && !line.starts_with("frame_positions_mm "));
    cloud.comments.extend(stage.comments());
    cloud
}

/// Value, u, selection: everything that must not change.
fn same(before: &Measurement, after: &Measurement, what: &str) {
    let near = |a: f64, b: f64, name: &str| assert!((a - b).abs() <= SAME_MM, "{what}: {name} {a}, then {b}");
    near(before.value, after.value, "value");
    near(before.u_noise, after.u_noise, "u_noise");
    near(before.u_systematic.unwrap_or(0.0), after.u_systematic.unwrap_or(0.0), "u_systematic");
    near(before.expanded_uncertainty, after.expanded_uncertainty, "U");
    for (a, b) in before.features.iter().zip(&after.features) {
        let counts = |f: &FittedFeature| (f.role, f.n_points, f.n_outliers, f.n_border);
        assert_eq!(counts(a), counts(b), "{what}");
        near(a.rms_mm, b.rms_mm, "RMS");
    }
}

#[test]
fn no_tool_depends_on_the_zero_of_the_stage() {
    let flat = gauge(8.9, SIGMA_MM, 2);
    for (tool, cloud) in [
        (Tool::Plane, &flat),
        (Tool::Step, &flat),
        (Tool::Flatness, &flat),
        (Tool::Sphere, &ball(SIGMA_MM, 2)),
        (Tool::Cylinder, &rod(SIGMA_MM, 2)),
        (Tool::Angle, &roof(2)),
        (Tool::Distance, &two_balls(2)),
    ] {
        let request = MeasureRequest::new(tool);
        let before = measure(&shifted(cloud, 0.0), None, &request).unwrap();
        for offset_mm in OFFSETS_MM {
            let after = measure(&shifted(cloud, offset_mm), None, &request).unwrap();
            same(&before, &after, &format!("{tool} {offset_mm:+} mm"));
        }
    }
}

#[test]
fn a_calibrated_measurement_does_not_depend_on_the_zero_of_the_stage() {
    let (cloud, calibration) = gauge_scan(8.9, 5);
    for tool in [Tool::Plane, Tool::Step, Tool::Distance, Tool::Flatness] {
        let request = MeasureRequest::new(tool);
        let before = measure(&cloud, Some(&calibration), &request).unwrap();
        for offset_mm in OFFSETS_MM {
            let after = measure(&shifted(&cloud, offset_mm), Some(&calibration), &request).unwrap();
            same(&before, &after, &format!("{tool} {offset_mm:+} mm"));
        }
    }
}

#[test]
fn the_light_source_is_taken_at_the_frame_of_the_point() {
    let light = PointMm::<CameraFrame>::new(Vector3::new(0.0, -174.0, 11.0));
    let lit = |offset_mm: f64| {
        let cloud = shifted(&ball(SIGMA_MM, 2), offset_mm);
        let samples = Samples::from_cloud(&cloud, None, Some(light));
        let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(1) };
        let candidates = search.off_table();
        search.sphere("sphere", &candidates, Some(18.9)).unwrap().inliers
    };
    let before = lit(0.0);
    for offset_mm in OFFSETS_MM {
        assert_eq!(before, lit(offset_mm), "{offset_mm:+} mm");
    }
}
