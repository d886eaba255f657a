//! Ground truth of the images: noise-free points on the centre of every line, and the station's own numbers.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Vector3};
use optics::Stage;
use serde_json::{Map, Value, json};
use vision::LineDirection;

use crate::model::station::StationModel;
use crate::part::board::Board;
use crate::part::scene::{Plate, Scene};
use crate::render::renderer::Renderer;
use crate::render::view::laser_image::{MovedScene, Placed};

/// Secant steps towards a whole pixel column; on a smooth surface three suffice.
const COLUMN_MAX_STEPS: usize = 30;

/// Distance of a truth point from its pixel column, pixels: far below the six decimals written.
const COLUMN_TOLERANCE_PX: f64 = 1e-9;

/// Hits of neighbouring traced rays farther apart than this lie on different surfaces, pixels.
const SAME_SURFACE_PX: f64 = 6.0;

/// A point on the centre of a line, lit and visible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthPoint {
    /// The line's order.
    pub order: i8,
    /// Column, raw pixels; whole for lines along rows.
    pub u_px: f64,
    /// Row, raw pixels; whole for lines along columns.
    pub v_px: f64,
    /// The lit point in the camera frame.
    pub hit_in_camera_mm: Vector3<f64>,
}

impl Renderer {
    /// The centre of every line as seen by the camera, one point per image column (row, for lines along columns),
    /// sorted by order and position; shadowed and hidden parts are left out.
    pub fn truth_points(&self, scene: &Scene, position: f64) -> Vec<TruthPoint> {
        let moved = MovedScene::new(self.model(), scene, position);
        let placed = moved.placed();
        self.model().orders.iter().flat_map(|&order| self.centre_of_line(placed, order)).collect()
    }

    fn centre_of_line(&self, scene: Placed<'_>, order: i8) -> Vec<TruthPoint> {
        let camera = &self.model().camera;
        let last = if self.lines_along_rows() { camera.width_px } else { camera.height_px } as f64 - 1.0;
        let mut points = Vec::new();
        let mut previous: Option<(f64, TruthPoint)> = None;
        let angles = self.fan_angles;
        for phi in (-angles.last..=angles.last).map(|idx| angles.phi_rad(idx)) {
            let current = self.lit_point(scene, order, phi).map(|point| (phi, point));
            if let (Some(a), Some(b)) = (&previous, &current) {
                let (from, to) = (self.along(&a.1), self.along(&b.1));
                let jump = (a.1.u_px - b.1.u_px).abs().max((a.1.v_px - b.1.v_px).abs());
                let columns = (from.min(to).floor() as i64 + 1)..=(from.max(to).floor() as i64);
                let inside = columns.map(|column| column as f64).filter(|column| (0.0..=last).contains(column));
                if jump < SAME_SURFACE_PX {
                    points.extend(inside.filter_map(|column| self.on_column(scene, order, column, a.0, b.0)));
                }
            }
            previous = current;
        }
        points.sort_by(|a, b| self.along(a).total_cmp(&self.along(b)));
        points
    }

    /// The point between two fan angles whose pixel column (row) is whole.
    fn on_column(&self, scene: Placed<'_>, order: i8, column: f64, a: f64, b: f64) -> Option<TruthPoint> {
        let miss = |phi: f64| {
            let point = self.lit_point(scene, order, phi)?;
            Some((self.along(&point) - column, point))
        };
        let (mut low, mut high) = (a, b);
        let (mut at_low, mut at_high) = (miss(a)?.0, miss(b)?.0);
        for _ in 0..COLUMN_MAX_STEPS {
            let phi = low - at_low * (high - low) / (at_high - at_low);
            let (at, point) = miss(phi)?;
            if at.abs() < COLUMN_TOLERANCE_PX {
                let visible = self.model().camera.project(&point.hit_in_camera_mm)?;
                let camera = &self.model().camera;
                let inside = (0.0..=camera.width_px as f64 - 1.0).contains(&visible.x.round())
                    && (0.0..=camera.height_px as f64 - 1.0).contains(&visible.y.round());
                return inside.then_some(point);
            }
            (low, at_low, high, at_high) =
                if (at > 0.0) == (at_high > 0.0) { (low, at_low, phi, at) } else { (phi, at, high, at_high) };
        }
        None
    }

    /// The point lit by `order` at fan angle φ, if the camera sees it.
    fn lit_point(&self, scene: Placed<'_>, order: i8, phi_rad: f64) -> Option<TruthPoint> {
        if phi_rad.abs() >= self.model().fan_half_angle_rad {
            return None;
        }
        let (source, source_order) = self.model().source_of(order);
        let ray = source.ray(phi_rad, source_order)?;
        let hit = scene.hit(&ray.origin_mm, &ray.direction)?;
        let point = ray.origin_mm + ray.direction * hit.ray_length;
        let pixel = self.model().camera.project(&point)?;
        scene.reaches(&Vector3::zeros(), &point).then_some(TruthPoint {
            order,
            u_px: pixel.x,
            v_px: pixel.y,
            hit_in_camera_mm: point,
        })
    }

    fn lines_along_rows(&self) -> bool {
        self.model().shape.line_direction == LineDirection::Rows
    }

    fn along(&self, point: &TruthPoint) -> f64 {
        if self.lines_along_rows() { point.u_px } else { point.v_px }
    }
}

/// Rows `frame,order,u_px,v_px,x_mm,y_mm,z_mm` of one frame.
pub(crate) fn csv_rows(frame: usize, points: &[TruthPoint]) -> String {
    points.iter().fold(String::new(), |mut rows, point| {
        let at = point.hit_in_camera_mm;
        let (u, v) = (point.u_px, point.v_px);
        // Writing to a string cannot fail.
        let _ = writeln!(rows, "{frame},{},{u:.6},{v:.6},{:.6},{:.6},{:.6}", point.order, at.x, at.y, at.z);
        rows
    })
}

/// The first line of a truth table.
pub(crate) const CSV_HEADER: &str = "frame,order,u_px,v_px,x_mm,y_mm,z_mm\n";

/// `truth.json`: the station's numbers, the board poses and the parts.
pub(crate) fn truth_json(
    model: &StationModel,
    poses: &[Board],
    stage: Option<&Board>,
    scenes: &[(String, Scene)],
) -> Value {
    let mut truth = Map::new();
    let mut put = |key: String, value: Value| truth.insert(key, value);
    for (idx, board) in poses.iter().enumerate() {
        put(format!("pose{idx}_R"), rows(&board.axes));
        put(format!("pose{idx}_c"), vector(&board.centre_mm));
    }
    if let Some(board) = stage {
        put("stage_board_R".to_owned(), rows(&board.axes));
        put("stage_board_c".to_owned(), vector(&board.centre_mm));
    }
    for (name, scene) in scenes {
        put(format!("{name}_scene"), scene_json(scene));
    }
    let (camera, grating) = (&model.camera, &model.grating);
    put("K".to_owned(), json!([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px]));
    put("dist".to_owned(), json!(camera.opencv_distortion()));
    match &model.stage {
        Stage::Linear(axis) => put("stage".to_owned(), vector(&axis.direction)),
        Stage::Rotary(axis) => {
            put("stage_axis".to_owned(), vector(&axis.direction));
            put("stage_axis_point".to_owned(), vector(&axis.point_mm))
        }
    };
    if model.lasers.is_empty() {
        put("S".to_owned(), vector(&grating.source_mm));
        put("axis".to_owned(), vector(&grating.axis));
        put("fan".to_owned(), vector(&grating.fan));
        put("normal".to_owned(), vector(&grating.normal));
        put("groove".to_owned(), vector(&grating.groove));
        put("gap".to_owned(), json!(grating.gap_mm));
        put("wavelength_over_period".to_owned(), json!(grating.wavelength_over_period));
    }
    for (line, laser) in model.lasers.iter().enumerate() {
        put(format!("laser{line}_source"), vector(&laser.source_mm));
        put(format!("laser{line}_plane_normal"), vector(&laser.axis.cross(&laser.fan)));
    }
    put("orders".to_owned(), json!(model.orders));
    put("order_powers".to_owned(), json!(model.order_powers));
    put("seed".to_owned(), json!(model.seed));
    Value::Object(truth)
}

fn scene_json(scene: &Scene) -> Value {
    match scene {
        Scene::Board(board) => json!({ "kind": "board", "R": rows(&board.axes), "c": vector(&board.centre_mm) }),
        Scene::Plate(plate) => plate_json("plate", plate),
        Scene::Gauge(gauge) => {
            let mut part = plate_json("gauge", &gauge.plate);
            part["height_mm"] = json!(gauge.height_mm);
            part["half_mm"] = json!([gauge.half_mm[0], gauge.half_mm[1], gauge.height_mm / 2.0]);
            part
        }
        Scene::Sphere(ball) => {
            let mut part = plate_json("sphere", &ball.plate);
            part["radius_mm"] = json!(ball.radius_mm);
            part["center"] = vector(&ball.centre_mm);
            part
        }
        Scene::Freeform(freeform) => {
            let mut part = plate_json("freeform", &freeform.plate);
            part["hills"] = freeform
                .hills
                .iter()
                .map(|hill| json!({ "at_mm": hill.at_mm, "sigma_mm": hill.sigma_mm, "height_mm": hill.height_mm }))
                .collect();
            part
        }
        Scene::Mesh(mesh) => {
            let mut part = plate_json("mesh", &mesh.plate);
            part["triangles"] = json!(mesh.solid.n_triangles());
            part
        }
    }
}

fn plate_json(kind: &str, plate: &Plate) -> Value {
    json!({
        "kind": kind,
        "R": rows(&plate.axes),
        "normal": vector(&plate.normal()),
        "table_point": vector(&plate.point_mm),
    })
}

fn vector(v: &Vector3<f64>) -> Value {
    json!([v.x, v.y, v.z])
}

/// Row by row; the columns are the axes.
fn rows(m: &Matrix3<f64>) -> Value {
    m.row_iter().map(|row| json!([row[0], row[1], row[2]])).collect()
}
