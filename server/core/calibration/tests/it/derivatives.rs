//! Every derivative of the joint problem, compared with central differences of its cost.

use crate::common::Rig;
use calibration::bundle::{Bundle, sheet_residual};
use calibration::bundle_state::{BoardPose, BundleState};
use calibration::light_fit::{Scene, light_priors, lit_points};
use calibration::observation::{CornerObservation, CornerView, LaserObservation};
use calibration::prior::Priors;
use calibration::solver::Problem;
use nalgebra::{Vector2, Vector3, Vector6};
use optics::{LightModelKind, LightSurfaces, Pencil, Plane};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// Relative step of the central differences, in units of each parameter's range.
const STEP: f64 = 1e-6;

/// Relative tolerance: the derivative neglects the curvature of the curve, an error that falls with the square of the
/// residuals; at the 0.01 px used here central differences limit the comparison.
const TOLERANCE: f64 = 1e-3;

/// Distance of the observations from the prediction.
const RESIDUAL_PX: f64 = 0.01;

/// A bundle with corners, laser points and a stage, and a state with residuals of some tenths of a pixel.
fn problem(kind: LightModelKind) -> (Bundle, BundleState) {
    let rig = Rig { corner_sigma_px: RESIDUAL_PX, line_sigma_px: 0.0, ..Rig::new(3) };
    let light = light_of(kind, &rig);
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let poses: Vec<_> = (0..3).map(|_| rig.pose(&mut random)).collect();
    let mut views = Vec::new();
    let mut laser = Vec::new();
    for (block, pose) in poses.iter().enumerate() {
        let corners = rig.corners(pose, &mut random).corners;
        let travel_mm = if block == 2 { 7.0 } else { 0.0 };
        views.push(CornerView {
            block,
            travel_mm,
            corners: corners
                .iter()
                .map(|c| CornerObservation {
                    board_mm: Vector3::new(c.column as f64, c.row as f64, 0.0) * crate::common::SQUARE_MM,
                    pixel: Vector2::new(c.u_px, c.v_px),
                    sigma_px: 0.1,
                })
                .collect(),
        });
        for (line, segment) in rig.centrelines(pose, &mut random).segments.iter().enumerate() {
            let order = rig.orders[line];
            for (idx, point) in segment.points.iter().step_by(16).enumerate() {
                let pixel = Vector2::new(point.u_px, point.v_px);
                let seen = LaserObservation { block, order, pixel, sigma_px: 0.1, effective_weight: 0.7 };
                let sign = if idx % 2 == 0 { 1.0 } else { -1.0 };
                laser.push(beside_the_curve(&rig, &light, pose, seen, sign * RESIDUAL_PX));
            }
        }
    }
    let scene = Scene {
        camera: &rig.camera,
        poses: &poses,
        orders: &rig.orders,
        nominal_wavelength_over_period: Some(0.0331),
    };
    let mut priors = light_priors(&scene, &light, &lit_points(&scene, &laser));
    priors.camera = Priors::of_camera(1280, 1024, 2400.0);
    let stage = Some(rig.stage * 0.01);
    let station = BundleState { camera: rig.camera, light: Some(light), stage, poses };
    let free = vec![true; station.globals()];
    (Bundle::new(views, laser, free, true, priors, 3), station)
}

/// The observation moved across the line until it is `residual_px` from the predicted curve.
fn beside_the_curve(
    rig: &Rig,
    light: &LightSurfaces,
    pose: &BoardPose,
    mut seen: LaserObservation,
    residual_px: f64,
) -> LaserObservation {
    for _ in 0..6 {
        let sheet = sheet_residual(&rig.camera, light, pose, &seen, None).unwrap();
        seen.pixel += sheet.direction * (residual_px - sheet.residual_px);
    }
    seen
}

fn light_of(kind: LightModelKind, rig: &Rig) -> LightSurfaces {
    let point_mm = rig.grating.source_mm + rig.grating.axis * 18.0;
    let direction = -rig.grating.groove;
    let normal = rig.grating.axis.cross(&direction);
    let base_normal = (normal - direction * normal.dot(&direction)).normalize();
    let pencil = Pencil { point_mm, direction, base_normal, wavelength_over_period: 0.033 };
    match kind {
        LightModelKind::Grating => LightSurfaces::Grating(rig.grating),
        LightModelKind::Pencil => LightSurfaces::Pencil(pencil),
        LightModelKind::Planes => LightSurfaces::Planes(
            rig.orders.iter().map(|&m| (m, pencil.plane(m).unwrap())).collect::<Vec<(i8, Plane)>>(),
        ),
    }
}

fn check(kind: LightModelKind) {
    let (bundle, station) = problem(kind);
    let ranges = bundle.ranges(&station);
    let normal = bundle.linearise(&station);
    let n = station.globals();
    let none = vec![Vector6::zeros(); 3];
    let slope_of = |globals: &[f64], blocks: &[Vector6<f64>], size: f64| {
        let ahead = bundle.cost(&bundle.stepped(&station, globals, blocks));
        let negated: Vec<f64> = globals.iter().map(|g| -g).collect();
        let back: Vec<Vector6<f64>> = blocks.iter().map(|b| -b).collect();
        (ahead - bundle.cost(&bundle.stepped(&station, &negated, &back))) / (2.0 * size)
    };
    let (by_globals, by_blocks) = normal.gradient();
    for idx in 0..n {
        let size = STEP * ranges.globals[idx];
        let mut globals = vec![0.0; n];
        globals[idx] = size;
        let slope = slope_of(&globals, &none, size);
        let exact = by_globals[idx];
        let scale = normal.sensitivity(idx).sqrt();
        assert!(
            (slope - exact).abs() < TOLERANCE * exact.abs() + TOLERANCE * scale,
            "{kind} {idx}: {slope} {exact}"
        );
    }
    for block in 0..3 {
        for axis in 0..6 {
            let size = STEP * ranges.block[axis];
            let mut blocks = none.clone();
            blocks[block][axis] = size;
            let slope = slope_of(&vec![0.0; n], &blocks, size);
            let exact = by_blocks[block][axis];
            assert!(
                (slope - exact).abs() < TOLERANCE * exact.abs() + 1.0,
                "{kind} {block} {axis}: {slope} {exact}"
            );
        }
    }
}

#[test]
fn the_gradient_with_exact_sheets_agrees_with_central_differences() {
    check(LightModelKind::Grating);
}

#[test]
fn the_gradient_with_a_pencil_agrees_with_central_differences() {
    check(LightModelKind::Pencil);
}

#[test]
fn the_gradient_with_planes_agrees_with_central_differences() {
    check(LightModelKind::Planes);
}
