//! A rendered hobby rig for tests: two lasers, a camera and a turntable.
//!
//! A board and a cylinder that stands off the axis, seen by a pinhole and lit by two sheets, without a line of the twin's
//! code, so that what is calibrated and measured from these pictures has a witness of its own. Not drawn: speckle, blur,
//! reflections. Only tests may import this crate.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::LazyLock;

use capture::write_png;
use nalgebra::{Rotation3, Vector3};
use optics::{Camera, CameraFrame, Motion, PointMm, RotaryAxis};
use serde_json::{Value, json};
use vision::{GreyImage, Pixels};

/// Precondition of the functions that write files.
const WRITABLE: &str = "the test's folder is writable";

const SIZE_PX: [usize; 2] = [400, 320];
const FOCAL_PX: f64 = 950.0;
/// Inner corners of the board and side of a square.
const BOARD: ([usize; 2], f64) = ([9, 6], 7.0);
/// Positions of the lasers; their light sheets contain the axis.
const LASERS_MM: [[f64; 3]; 2] = [[-120.0, 0.0, 20.0], [110.0, 5.0, 30.0]];
/// Thickness (σ) of the light sheets, mm: lines 3 px wide.
const SHEET_SIGMA_MM: f64 = 0.4;
/// Radius of the cylinder and its distance from the axis, mm.
pub const CYLINDER_MM: [f64; 2] = [16.0, 3.0];
/// Table angles of the board views, degrees.
pub const VIEWS_DEG: [f64; 7] = [-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0];
/// Number of board poses.
const N_POSES: u8 = 9;
/// Angle between frames; 378° in all.
const STEP_DEG: f64 = 7.0;
const N_FRAMES: usize = 55;
/// Axis of the turntable, camera frame.
pub static AXIS: LazyLock<RotaryAxis> =
    LazyLock::new(|| RotaryAxis::new(Vector3::new(0.5, 0.0, 300.0), Vector3::new(0.01, -1.0, 0.03)));

/// Position of each laser and the unit normal of its light sheet.
static SHEETS: LazyLock<[(Vector3<f64>, Vector3<f64>); 2]> = LazyLock::new(|| {
    LASERS_MM.map(|laser| {
        let laser = Vector3::from(laser);
        (laser, AXIS.direction.cross(&(AXIS.point_mm - laser)).normalize())
    })
});

/// Intersection of a ray: point, unit normal, reflectance.
type Intersection = Option<(Vector3<f64>, Vector3<f64>, f64)>;

/// Renders an image: the mean over `grid` × `grid` rays per pixel.
fn render(grid: usize, level: impl Fn(&Vector3<f64>) -> f64) -> GreyImage {
    let camera = camera();
    let pixel = |idx: usize| {
        let (u, v) = ((idx % SIZE_PX[0]) as f64, (idx / SIZE_PX[0]) as f64);
        let offset = |k: usize| (k as f64 + 0.5) / grid as f64 - 0.5;
        let rays = (0..grid * grid).map(|k| {
            let (x, y) = (u + offset(k % grid) - camera.cx_px, v + offset(k / grid) - camera.cy_px);
            level(&Vector3::new(x / camera.fx_px, y / camera.fy_px, 1.0))
        });
        let mean = rays.sum::<f64>() / (grid * grid) as f64;
        // Fixed noise of one grey level, as of any sensor.
        let noise = (idx.wrapping_mul(2_654_435_761) >> 7) % 5;
        (mean + noise as f64 * 0.5).round().clamp(0.0, 255.0) as u8
    };
    let pixels = (0..SIZE_PX[0] * SIZE_PX[1]).map(pixel).collect();
    GreyImage::new(SIZE_PX[0], SIZE_PX[1], Pixels::Eight(pixels)).expect("one value per pixel")
}

fn camera() -> Camera {
    let matrix = [[FOCAL_PX, 0.0, 199.5], [0.0, FOCAL_PX, 159.5], [0.0, 0.0, 1.0]];
    Camera::from_opencv(SIZE_PX[0], SIZE_PX[1], matrix, &[])
}

fn lit(hit: Intersection) -> f64 {
    let Some((at, normal, reflectance)) = hit else { return 4.0 };
    let of_laser = |(laser, sheet): &(Vector3<f64>, Vector3<f64>)| {
        let is_lit = normal.dot(&(laser - at)) > 0.0;
        let off_mm = sheet.dot(&(at - AXIS.point_mm));
        if is_lit { 200.0 * (-0.5 * (off_mm / SHEET_SIGMA_MM).powi(2)).exp() } else { 0.0 }
    };
    4.0 + reflectance * SHEETS.iter().map(of_laser).sum::<f64>()
}

/// Intersection with a board with corner (0, 0) at `origin_mm` and axes in the columns of `turn`.
fn on_board(turn: &Rotation3<f64>, origin_mm: &Vector3<f64>, ray: &Vector3<f64>) -> Intersection {
    let normal = turn * Vector3::z();
    let at = ray * (normal.dot(origin_mm) / normal.dot(ray));
    let on_board = turn.inverse() * (at - origin_mm) / BOARD.1;
    let [columns, rows] = BOARD.0.map(|n| n as f64);
    let inside = |value: f64, n: f64, margin: f64| value > -1.0 - margin && value < n + margin;
    if !(inside(on_board.x, columns, 0.8) && inside(on_board.y, rows, 0.8)) {
        return None;
    }
    let is_square = inside(on_board.x, columns, 0.0) && inside(on_board.y, rows, 0.0);
    let is_dark = is_square && (on_board.x.floor() + on_board.y.floor()).rem_euclid(2.0) < 0.5;
    Some((at, -normal, if is_dark { 0.15 } else { 0.9 }))
}

fn board_middle_mm() -> Vector3<f64> {
    Vector3::new((BOARD.0[0] - 1) as f64, (BOARD.0[1] - 1) as f64, 0.0) * (BOARD.1 / 2.0)
}

fn on_cylinder(motion: &Motion, ray: &Vector3<f64>) -> Intersection {
    let eye = motion.part_from_camera(&PointMm::<CameraFrame>::new(Vector3::zeros())).xyz;
    let way = motion.part_direction(ray);
    let (along, out) = (AXIS.direction, optics::rotation::completing_frame(&AXIS.direction).0);
    let middle = AXIS.point_mm + out * CYLINDER_MM[1];
    let flat = |v: Vector3<f64>| v - along * along.dot(&v);
    let (o, d) = (flat(eye - middle), flat(way));
    let (a, b, c) = (d.dot(&d), o.dot(&d), o.dot(&o) - CYLINDER_MM[0].powi(2));
    let root = (b * b - a * c).max(0.0).sqrt();
    let at = eye + way * ((-b - root) / a);
    let hits = b * b > a * c && along.dot(&(at - middle)).abs() < 24.0;
    let normal = flat(at - middle).normalize();
    hits.then(|| {
        let seen = motion.camera_from_part(&PointMm::new(at)).xyz;
        let outwards = motion.camera_from_part(&PointMm::new(at + normal)).xyz - seen;
        (seen, outwards, 0.8)
    })
}

/// Grey level in ambient light.
fn ambient(hit: Intersection) -> f64 {
    hit.map_or(70.0, |(_, _, reflectance)| 230.0 * reflectance)
}

/// Orientation of a board and position of its corner (0, 0).
fn pose(idx: u8) -> (Rotation3<f64>, Vector3<f64>) {
    let angle = TAU * f64::from(idx) / f64::from(N_POSES);
    let turn = Rotation3::from_euler_angles(0.42 * angle.cos(), 0.42 * angle.sin(), 0.05 * angle);
    let centre = Vector3::new(-4.0 + 3.0 * angle.sin(), 4.0 * angle.cos(), 268.0 + 2.4 * f64::from(idx));
    (turn, centre - turn * board_middle_mm())
}

/// Writes an image of a board pose in ambient light of this brightness, with the lasers on or off.
///
/// # Panics
///
/// Panics if the file cannot be written.
pub fn by_daylight(idx: u8, room: f64, has_laser: bool, file: &Path) {
    let (turn, origin) = pose(idx);
    let light = |ray: &Vector3<f64>| {
        let hit = on_board(&turn, &origin, ray);
        room * ambient(hit) + if has_laser { lit(hit) - lit(None) } else { 0.0 }
    };
    write_png(file, &render(2, light)).expect(WRITABLE);
}

/// Writes a capture to an empty folder: poses, stage views and a scan of slightly more than a full turn.
///
/// # Panics
///
/// Panics if the folder cannot be written.
pub fn capture(folder: &Path) {
    for of in ["board", "laser", "stage", "scan"] {
        std::fs::create_dir(folder.join(of)).expect(WRITABLE);
    }
    let put = |name: String, image: GreyImage| -> String {
        write_png(&folder.join(&name), &image).expect(WRITABLE);
        name
    };
    let poses: Vec<Value> = (0..N_POSES)
        .map(|idx| {
            let (turn, origin) = pose(idx);
            let board = render(2, |ray| ambient(on_board(&turn, &origin, ray)));
            let laser = render(1, |ray| lit(on_board(&turn, &origin, ray)));
            json!({ "board": put(format!("board/{idx:03}.png"), board), "laser": put(format!("laser/{idx:03}.png"), laser) })
        })
        .collect();
    let (turn, centre) = (Rotation3::from_euler_angles(0.15, 0.05, 0.0), Vector3::new(1.0, 0.0, 290.0));
    let views: Vec<Value> = (0..)
        .zip(VIEWS_DEG)
        .map(|(idx, angle_deg): (usize, f64)| {
            let motion = AXIS.motion(angle_deg.to_radians());
            let place = |at: Vector3<f64>| motion.camera_from_part(&PointMm::new(at)).xyz;
            let origin = centre - turn * board_middle_mm();
            let axes =
                [Vector3::x(), Vector3::y(), Vector3::z()].map(|way| place(origin + turn * way) - place(origin));
            let (turned, origin) = (Rotation3::from_basis_unchecked(&axes), place(origin));
            let board = render(2, |ray| ambient(on_board(&turned, &origin, ray)));
            json!({ "board": put(format!("stage/{idx:03}.png"), board), "angle_deg": angle_deg })
        })
        .collect();
    let frames: Vec<Value> = (0..N_FRAMES)
        .map(|idx| {
            let angle_deg = idx as f64 * STEP_DEG;
            let motion = AXIS.motion(angle_deg.to_radians());
            let image = render(1, |ray| lit(on_cylinder(&motion, ray)));
            json!({ "image": put(format!("scan/{idx:03}.png"), image), "angle_deg": angle_deg })
        })
        .collect();
    let manifest = json!({
        "format": "sheaf-capture/1",
        "camera": { "width_px": SIZE_PX[0], "height_px": SIZE_PX[1] },
        "target": { "kind": "chessboard", "inner_columns": BOARD.0[0], "inner_rows": BOARD.0[1], "square_mm": BOARD.1 },
        "projector": { "kind": "planes", "lines": 2, "line_direction": "columns" },
        "stage": { "kind": "rotary", "angle_sigma_deg": 0.01 },
        "poses": poses,
        "stage_views": views,
        "scans": [{ "name": "part", "frames": frames }],
    });
    std::fs::write(folder.join("capture.json"), manifest.to_string()).expect(WRITABLE);
}
