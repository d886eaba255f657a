//! Images of clutter rendered by the twin: blocks about one wrap high, thin and wide lines, three working
//! distances.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use optics::{Calibration, DepthRangeMm, LightSurfaces, StagePosition};
use rayon::prelude::*;
use scanning::ScanFrame;
use twin::{Mesh, Plate, Renderer, Scene, Solid, StationModel, StationShape};
use vision::{CentrelineParams, LineDirection, find_centrelines};

use super::scene::Noise;
use super::truth_lines::TruthLine;

/// Depth range of the labels around the standoff, as a fraction of it.
const DEPTH_FRACTION: f64 = 0.14;
/// Full width of a Gaussian at half its height, standard deviations.
pub const FWHM_SIGMAS: f64 = 2.354_82;
/// Latitudes and longitudes of a ball's triangles.
const BALL_RINGS: [usize; 2] = [10, 20];
/// The part's stream number within a station's seed.
pub const PART_STREAM: u64 = 0x100;

/// A rendered scan, the truth of its images and the true station.
pub struct Rendered {
    pub name: String,
    pub calibration: Calibration,
    pub frames: Vec<ScanFrame>,
    /// Per frame: the true centrelines.
    pub truth: Vec<Vec<TruthLine>>,
}

/// Random numbers between two limits.
pub struct RandomNumbers(pub Noise);

impl RandomNumbers {
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.uniform()
    }
}

/// The scene of a seed: two to nine blocks, most of them 0.85–1.2 wraps high, up to three balls; lines 3–9 px wide at
/// half height; 24–40 frames; a station of 150, 400 or 1000 mm.
pub fn clutter(seed: u64) -> Rendered {
    let mut random = RandomNumbers(Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678));
    (0..8).for_each(|_| {
        random.0.uniform();
    });
    let fwhm_px = random.between(3.0, 9.0);
    let standoff_mm = match seed % 5 {
        3 => 150.0,
        4 => 1000.0,
        _ => 400.0,
    };
    let direction = if seed.is_multiple_of(4) { LineDirection::Columns } else { LineDirection::Rows };
    let scale = standoff_mm / 400.0;
    let shape = StationShape {
        line_direction: direction,
        standoff_mm,
        field_half_width_mm: 101.7 * scale,
        line_sigma_px: fwhm_px / FWHM_SIGMAS,
        speckle_contrast: random.between(0.1, 0.5),
        speckle_grain_px: random.between(1.2, 3.0),
        ..StationShape::default()
    };
    let model = StationModel::seeded(seed, &shape).unwrap();
    let calibration = calibration_of(&model);
    let wrap_mm = wrap_mm(&calibration, standoff_mm);
    let n_blocks = random.between(2.0, 10.0) as usize;
    let n_balls = random.between(0.0, 4.0) as usize;
    let mut triangles = Vec::new();
    for _ in 0..n_blocks {
        let height =
            if random.between(0.0, 1.0) < 0.75 { random.between(0.85, 1.2) } else { random.between(0.1, 1.6) };
        let centre = [random.between(-75.0, 75.0) * scale, random.between(-50.0, 50.0) * scale];
        let half = [random.between(4.0, 20.0) * scale, random.between(4.0, 16.0) * scale];
        add_block(&mut triangles, centre, half, random.between(-0.5, 0.5), height * wrap_mm);
    }
    for _ in 0..n_balls {
        let centre = [random.between(-75.0, 75.0) * scale, random.between(-50.0, 50.0) * scale];
        add_ball(&mut triangles, centre, random.between(6.0, 18.0) * scale);
    }
    let solid = Arc::new(Solid::new(&triangles).unwrap());
    let scene = Scene::mesh(solid, &model, PART_STREAM);
    let n_frames = random.between(24.0, 41.0) as usize;
    let step_mm = random.between(0.5, 1.3) * scale;
    let name = format!(
        "seed {seed}: {standoff_mm} mm, lines {fwhm_px:.1} px, {n_blocks} blocks, {n_balls} balls, \
         {n_frames} × {step_mm:.2} mm"
    );
    rendered(name, &model, calibration, &scene, n_frames, step_mm)
}

/// A scene like that of `rig-b`: nine blocks, a third of them exactly one wrap high, and four balls at 400 mm; 32
/// frames at 1 mm; lines of 5–8 px, three times as wide 50 mm out of focus.
pub fn crowded(seed: u64) -> Rendered {
    let mut random = RandomNumbers(Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x4321_8765));
    (0..8).for_each(|_| {
        random.0.uniform();
    });
    let fwhm_px = random.between(5.0, 8.0);
    let shape = StationShape {
        line_sigma_px: fwhm_px / FWHM_SIGMAS,
        speckle_contrast: random.between(0.15, 0.4),
        speckle_grain_px: random.between(1.2, 2.5),
        focus_depth_mm: 50.0 / f64::sqrt(3.0 * 3.0 - 1.0),
        ..StationShape::default()
    };
    let model = StationModel::seeded(seed, &shape).unwrap();
    let calibration = calibration_of(&model);
    let wrap_mm = wrap_mm(&calibration, shape.standoff_mm);
    let mut triangles = Vec::new();
    let place = |random: &mut RandomNumbers| [random.between(-75.0, 75.0), random.between(-45.0, 45.0)];
    for idx in 0..9 {
        let height_mm = if idx < 3 { random.between(0.93, 1.07) * wrap_mm } else { random.between(2.0, 32.0) };
        let centre = place(&mut random);
        let half = [random.between(6.0, 16.0), random.between(6.0, 16.0)];
        add_block(&mut triangles, centre, half, random.between(-0.8, 0.8), height_mm);
    }
    for _ in 0..4 {
        let centre = place(&mut random);
        add_ball(&mut triangles, centre, random.between(6.0, 18.0));
    }
    let solid = Arc::new(Solid::new(&triangles).unwrap());
    let scene = Scene::mesh(solid, &model, PART_STREAM);
    let name = format!("crowded {seed}: lines {fwhm_px:.1} px, wrap {wrap_mm:.1} mm");
    rendered(name, &model, calibration, &scene, 32, 1.0)
}

/// A block `height_mm` high on the plate of a station at 400 mm, its top near the field of the last frames.
pub fn block(seed: u64, fwhm_px: f64, height_mm: f64, centre_mm: [f64; 2], n_frames: usize) -> Rendered {
    let shape = StationShape { line_sigma_px: fwhm_px / FWHM_SIGMAS, ..StationShape::default() };
    let model = StationModel::seeded(seed, &shape).unwrap();
    let calibration = calibration_of(&model);
    // The part is centred on its bounding box: two thin feet on either side fix the block's position.
    let mut triangles = Vec::new();
    add_block(&mut triangles, centre_mm, [14.0, 9.0], 0.0, height_mm);
    for side in [-1.0, 1.0] {
        add_block(&mut triangles, [side * 80.0, side * 60.0], [1.0, 1.0], 0.0, 0.1);
    }
    let solid = Arc::new(Solid::new(&triangles).unwrap());
    let axes = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, -1.0));
    let plate = Plate { axes, point_mm: Vector3::new(0.0, 0.0, shape.standoff_mm) };
    let name = format!("block {height_mm} mm high at {centre_mm:?} mm, lines {fwhm_px} px");
    rendered(name, &model, calibration, &Scene::Mesh(Mesh { plate, solid }), n_frames, 1.0)
}

fn rendered(
    name: String,
    model: &StationModel,
    calibration: Calibration,
    scene: &Scene,
    n_frames: usize,
    step_mm: f64,
) -> Rendered {
    let renderer = Renderer::new(model);
    let columns = model.shape.line_direction == LineDirection::Columns;
    let frame = |idx: usize| {
        let position_mm = (idx as f64 - (n_frames - 1) as f64 / 2.0) * step_mm;
        let image = renderer.laser_image(scene, position_mm, idx as u64);
        let params =
            CentrelineParams { line_direction: model.shape.line_direction, ..CentrelineParams::default() };
        let centrelines = find_centrelines(&image, &params);
        let truth = renderer.truth_points(scene, position_mm).into_iter().map(|point| {
            let (along, across) = if columns { (point.v_px, point.u_px) } else { (point.u_px, point.v_px) };
            TruthLine { order: point.order, along: along.round() as i64, across_px: across }
        });
        (ScanFrame { centrelines, position: StagePosition::LinearMm(position_mm) }, truth.collect())
    };
    let (frames, truth): (Vec<ScanFrame>, Vec<Vec<TruthLine>>) = (0..n_frames).into_par_iter().map(frame).unzip();
    Rendered { name, calibration, frames, truth }
}

/// The true calibration of the station, orders ascending.
pub fn calibration_of(model: &StationModel) -> Calibration {
    let mut orders = model.orders.clone();
    orders.sort_unstable();
    let standoff_mm = model.shape.standoff_mm;
    Calibration {
        id: "twin".into(),
        camera: model.camera,
        orders,
        light: LightSurfaces::Grating(model.grating),
        stage: Some(model.stage),
        depth_range_mm: DepthRangeMm {
            near_mm: standoff_mm * (1.0 - DEPTH_FRACTION),
            far_mm: standoff_mm * (1.0 + DEPTH_FRACTION),
        },
        covariance: DMatrix::from_diagonal_element(22, 22, 1e-10),
    }
}

/// Depth between the sheets of neighbouring orders in the middle of the view, mm.
pub fn wrap_mm(calibration: &Calibration, standoff_mm: f64) -> f64 {
    let middle = &calibration.camera;
    let depth =
        |order: i8, pixel: &Vector2<f64>| calibration.triangulate(order, pixel, None).map(|hit| hit.hit.depth_mm);
    // The pixel in which order 0 meets the standoff, searched along the direction across the lines.
    let centre = Vector2::new(middle.width_px as f64 / 2.0, middle.height_px as f64 / 2.0);
    let near = depth(0, &centre).unwrap_or(standoff_mm);
    let next = depth(1, &centre).or_else(|| depth(-1, &centre)).unwrap();
    (next - near).abs() * (standoff_mm / near).powi(2)
}

type Triangles = Vec<[[f64; 3]; 3]>;

fn add_block(triangles: &mut Triangles, centre: [f64; 2], half: [f64; 2], turn_rad: f64, height: f64) {
    let (sin, cos) = turn_rad.sin_cos();
    let corner = |x: f64, y: f64, z: f64| {
        let (x, y) = (x * half[0], y * half[1]);
        [centre[0] + x * cos - y * sin, centre[1] + x * sin + y * cos, z]
    };
    let ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for idx in 0..4 {
        let (a, b) = (ring[idx], ring[(idx + 1) % 4]);
        let [low_a, low_b] = [corner(a.0, a.1, 0.0), corner(b.0, b.1, 0.0)];
        let [high_a, high_b] = [corner(a.0, a.1, height), corner(b.0, b.1, height)];
        triangles.push([low_a, low_b, high_b]);
        triangles.push([low_a, high_b, high_a]);
    }
    let top = ring.map(|(x, y)| corner(x, y, height));
    triangles.push([top[0], top[1], top[2]]);
    triangles.push([top[0], top[2], top[3]]);
}

fn add_ball(triangles: &mut Triangles, centre: [f64; 2], radius: f64) {
    let [n_rings, n_turns] = BALL_RINGS;
    let at = |ring: usize, turn: usize| {
        let (polar, azimuth) = (PI * ring as f64 / n_rings as f64, TAU * turn as f64 / n_turns as f64);
        let (sin, cos) = polar.sin_cos();
        [centre[0] + radius * sin * azimuth.cos(), centre[1] + radius * sin * azimuth.sin(), radius + radius * cos]
    };
    for (ring, turn) in (0..n_rings).flat_map(|ring| (0..n_turns).map(move |turn| (ring, turn))) {
        let [a, b, c, d] = [at(ring, turn), at(ring + 1, turn), at(ring + 1, turn + 1), at(ring, turn + 1)];
        triangles.push([a, b, c]);
        triangles.push([a, c, d]);
    }
}
