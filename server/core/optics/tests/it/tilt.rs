//! Effect of a stage's rotations on a length along its travel: the Abbe error.

use nalgebra::Vector3;
use optics::stage::{MAX_STAGE_NODES, Straightness, Tilt};
use optics::{CAMERA_PARAMETERS, PointMm, StageAxis};

use crate::scene::{length_variances, station};

/// Pitch, yaw and roll of a travel along y.
const SIGMAS_RAD: [f64; 3] = [3e-4, 2e-4, 1e-4];

const CENTRE_MM: Vector3<f64> = Vector3::new(1.0, 2.0, 400.0);

fn tilt(n_nodes: usize) -> Option<Tilt> {
    let [pitch, roll, yaw] =
        [Vector3::x() * SIGMAS_RAD[0], Vector3::y() * SIGMAS_RAD[2], Vector3::z() * SIGMAS_RAD[1]];
    Tilt::new([pitch, roll, yaw], CENTRE_MM, (-20.0, 20.0), n_nodes)
}

#[test]
fn a_length_along_the_travel_is_uncertain_by_its_distance_from_the_board_times_pitch_and_yaw() {
    let axis = StageAxis { tilt: tilt(5), ..StageAxis::new(Vector3::y()) };
    let calibration = station(axis);
    let [pitch, yaw, roll] = SIGMAS_RAD;
    for (height_mm, aside_mm) in [(0.0, 0.0), (-30.0, 0.0), (0.0, 25.0), (-12.0, 7.0)] {
        let got = length_variances(
            &calibration,
            &PointMm::new(CENTRE_MM + Vector3::new(aside_mm, 0.0, height_mm)),
            -20.0,
            20.0,
        );
        // Rotations by ±θ at both ends. The point is 20 mm from the centre along the travel at either end.
        let along = 2.0 * ((height_mm * pitch).powi(2) + (aside_mm * yaw).powi(2));
        let across = 2.0 * ((height_mm * roll).powi(2) + (20.0 * yaw).powi(2));
        let up = 2.0 * ((aside_mm * roll).powi(2) + (20.0 * pitch).powi(2));
        for (axis, expected) in [across, along, up].into_iter().enumerate() {
            // Second order in the angle: 20 mm times the square of 0.3 mrad.
            assert!(
                (got[axis].sqrt() - expected.sqrt()).abs() < 2e-5,
                "{axis}: {got} for {height_mm}, {aside_mm}"
            );
        }
    }
}

#[test]
fn the_rotations_of_a_stage_do_not_depend_on_its_zero_beside_those_of_its_straightness() {
    let straightness = Straightness::new(0.002, -20.0, 20.0, 5);
    let axis = StageAxis { straightness, tilt: tilt(5), ..StageAxis::new(Vector3::y()) };
    let n = axis.direction.len() + CAMERA_PARAMETERS + 3;
    let modes = station(axis).sigma_modes();
    // Three modes per node and kind, of equal length.
    assert_eq!(modes.len(), 30);
    assert!(modes.iter().all(|mode| mode.len() == n + 30));
    let moved = station(axis).stepped(modes.last().unwrap()).stage.unwrap().linear().unwrap();
    for position_mm in [-20.0, 0.0, 13.0, 20.0] {
        let in_part = PointMm::new(Vector3::new(3.0, -4.0, 390.0));
        let motion = moved.motion(position_mm);
        // The motion from the middle of the nodes, at 0 here, is the same motion.
        assert_eq!(motion, moved.motion_from_middle(position_mm));
        let back = motion.part_from_camera(&motion.camera_from_part(&in_part));
        assert!((back.xyz - in_part.xyz).norm() < 1e-12);
    }
}

#[test]
fn a_motion_is_that_from_the_middle_of_the_nodes_after_the_travel_to_it() {
    let shifted = Tilt::new(*tilt(3).unwrap().sigmas_rad(), CENTRE_MM, (80.0, 120.0), 3);
    let axis = StageAxis { tilt: shifted, ..StageAxis::new(Vector3::y()) };
    let calibration = station(axis);
    let moved = calibration.stepped(calibration.sigma_modes().last().unwrap()).stage.unwrap().linear().unwrap();
    let seen = PointMm::new(CENTRE_MM + Vector3::new(5.0, 3.0, -30.0));
    let (from_zero, from_middle) = (moved.motion(120.0), moved.motion_from_middle(20.0));
    let travelled = from_middle.part_from_camera(&seen).xyz - from_zero.part_from_camera(&seen).xyz;
    assert!((travelled - Vector3::y() * 100.0).norm() < 1e-9, "{travelled}");
    // The last node turns about z: a point 5 mm aside deviates along the travel, one at the centre does not.
    assert!((from_middle.part_from_camera(&seen).xyz - (seen.xyz - Vector3::y() * 20.0)).norm() > 5e-4);
    let centre = PointMm::new(CENTRE_MM + Vector3::y() * 20.0);
    assert!((from_middle.part_from_camera(&centre).xyz - CENTRE_MM).norm() < 1e-12);
}

#[test]
fn more_nodes_are_limited_and_invalid_arguments_are_refused() {
    assert_eq!(tilt(40).unwrap().n_nodes(), MAX_STAGE_NODES);
    let sigmas = |size: f64| [Vector3::x() * size, Vector3::zeros(), Vector3::zeros()];
    for (size, last_mm, n_nodes) in [(0.0, 1.0, 3), (f64::NAN, 1.0, 3), (1e-4, 0.0, 3), (1e-4, 1.0, 1)] {
        assert_eq!(Tilt::new(sigmas(size), CENTRE_MM, (0.0, last_mm), n_nodes), None);
    }
}
