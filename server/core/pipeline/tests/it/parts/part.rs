//! A part on the stage of a rendered station: its scan, and its plan with the true values.

use metrology::{DatumFrame, Plan};
use nalgebra::{Matrix3, Rotation3, Vector3};
use optics::{Calibration, PartFrame, Rigid, StagePosition};
use rayon::prelude::*;
use scanning::{Cloud, ScanFrame, ScanParams, scan_cloud};
use serde_json::{Value, json};
use twin::{Mesh, Renderer, Scene, Solid, StationModel};
use vision::{CentrelineParams, find_centrelines};

use super::solid::Triangles;

/// From the datum frame to the part frame.
pub type Pose = Rigid<PartFrame, DatumFrame>;

/// Frames of a scan, and the step between them.
const N_FRAMES: usize = 90;
const STEP_MM: f64 = 0.4;

/// A part with its characteristics and their true values.
pub struct Part {
    pub triangles: Triangles,
    pub plan: fn(&Pose) -> Value,
    pub characteristics: Vec<(Value, f64)>,
}

impl Part {
    /// The scan of the part, placed on the stage by random stream `stream`, and its plan.
    pub fn scan(&self, model: &StationModel, calibration: &Calibration, stream: u64) -> (Cloud, Plan) {
        // The plate's y runs along the travel, its x against the datum frame's y.
        let on_plate = |[x, y, z]: [f64; 3]| [-y, x, z];
        let triangles: Triangles = self.triangles.iter().map(|corners| corners.map(on_plate)).collect();
        let scene = Scene::mesh(Solid::new(&triangles).unwrap().into(), model, stream);
        let pose = pose(&scene, &triangles);
        let renderer = Renderer::new(model);
        let frame = |idx: usize| {
            let position_mm = (idx as f64 - (N_FRAMES - 1) as f64 / 2.0) * STEP_MM;
            let image = renderer.laser_image(&scene, position_mm, idx as u64);
            let centrelines = find_centrelines(&image, &CentrelineParams::default());
            ScanFrame { centrelines, position: StagePosition::LinearMm(position_mm) }
        };
        let frames: Vec<ScanFrame> = (0..N_FRAMES).into_par_iter().map(frame).collect();
        let cloud = scan_cloud(&frames, calibration, &ScanParams::default()).unwrap().cloud;
        let mut plan = (self.plan)(&pose);
        let measures = self.characteristics.iter().enumerate();
        plan["characteristics"] =
            measures.map(|(idx, (measure, _))| json!({ "id": idx.to_string(), "measure": measure })).collect();
        (cloud, Plan::from_json(&plan.to_string()).unwrap())
    }
}

/// Where the twin places the datum frame: solids stand on the middle of their bounding box.
fn pose(scene: &Scene, triangles: &Triangles) -> Pose {
    let Scene::Mesh(Mesh { plate, .. }) = scene else { panic!("not a mesh") };
    let corners = triangles.as_flattened().iter().map(|corner| Vector3::from(*corner));
    let (low, high) = corners
        .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), corner| {
            (low.inf(&corner), high.sup(&corner))
        });
    let foot = Vector3::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0, low.z);
    let plate_from_datum = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let rotation = Rotation3::from_matrix_unchecked(plate.axes * plate_from_datum);
    Rigid::new(rotation, plate.point_mm - plate.axes * foot)
}

pub fn boxed(min: [f64; 3], max: [f64; 3]) -> Value {
    json!({ "region": { "type": "box", "min_mm": min, "max_mm": max } })
}

/// The box about a box of the datum frame, in the part frame: for the features that the alignment rests on.
pub fn boxed_in_part(pose: &Pose, at: [f64; 3], half: [f64; 3]) -> Value {
    let at = pose.rotation * Vector3::from(at) + pose.translation_mm;
    let half = pose.rotation.matrix().abs() * Vector3::from(half);
    boxed((at - half).into(), (at + half).into())
}
