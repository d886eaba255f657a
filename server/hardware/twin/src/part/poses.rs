//! Poses of the target for calibration: tilted in all directions, near and far, always entirely in the image.

use capture::{ChessboardTarget, Target};
use nalgebra::{Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use crate::model::random::derived_seed;
use crate::model::station::StationModel;
use crate::params::BACKDROP_GAP_FRACTION;
use crate::part::board::Board;

/// Inner corners along the rows and columns of the default target.
pub const BOARD_CORNERS: (usize, usize) = (11, 8);

/// Side of a square at a field of ±100 mm.
const SQUARE_MM: f64 = 12.0;

/// Smallest and largest tilt of a pose, radians (11° and 28°).
const TILT_RAD: (f64, f64) = (0.2, 0.49);

/// Largest rotation in the image plane, radians.
const ROLL_RAD: f64 = 0.2;

/// Nearest and farthest pose relative to the standoff.
const DISTANCE: (f64, f64) = (0.9, 1.06);

/// Largest shift from the camera axis at a field of ±100 mm.
const SHIFT_MM: f64 = 14.0;

/// Distance between the outermost corners of squares and the image border, as a fraction of its width.
const EDGE_FRACTION: f64 = 0.01;

/// Draws per pose before tilt and shift are reduced.
const DRAWS: usize = 40;

/// Random stream of the poses, derived from a station's seed.
const POSE_STREAM: u64 = 4;

/// Random stream of the target on the stage.
const STAGE_STREAM: u64 = 5;

/// Side of the default target's squares: chosen to fill the station's field.
pub fn square_mm(model: &StationModel) -> f64 {
    // Whole hundredths, as printed by a manufacturer.
    (SQUARE_MM * model.shape.field_scale() * 100.0).round() / 100.0
}

/// The default chessboard of the station.
pub fn usual_target(model: &StationModel) -> Target {
    let (inner_columns, inner_rows) = BOARD_CORNERS;
    ChessboardTarget { inner_columns, inner_rows, square_mm: square_mm(model).into() }.into()
}

/// [`target_poses`] of the default target.
pub fn board_poses(model: &StationModel, count: usize) -> Vec<Board> {
    target_poses(model, &usual_target(model), count)
}

/// [`stage_target`] with the default target.
pub fn stage_board(model: &StationModel, positions: &[f64]) -> Board {
    stage_target(model, &usual_target(model), positions)
}

/// `count` poses of a target for calibration, tilted in directions spread around the circle.
pub fn target_poses(model: &StationModel, target: &Target, count: usize) -> Vec<Board> {
    let target = Board::of(target);
    let mut rng = Pcg64::seed_from_u64(derived_seed(model.seed, POSE_STREAM));
    // Successive directions differ by the golden angle, so that any number of poses is spread well.
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|idx| {
            let azimuth = golden * idx as f64 + 0.5 * (rng.random::<f64>() - 0.5);
            within_image(model, &mut rng, |rng, tilt_factor| {
                let tilt = tilt_factor * (TILT_RAD.0 + (TILT_RAD.1 - TILT_RAD.0) * rng.random::<f64>());
                let far = DISTANCE.0 + (DISTANCE.1 - DISTANCE.0) * rng.random::<f64>();
                placed(model, &target, rng, azimuth, tilt, 1.0 + (far - 1.0) * tilt_factor, tilt_factor)
            })
        })
        .collect()
}

/// A target on the stage, entirely in the image at all `positions`, in the stage's unit.
pub fn stage_target(model: &StationModel, target: &Target, positions: &[f64]) -> Board {
    let target = Board::of(target);
    let mut rng = Pcg64::seed_from_u64(derived_seed(model.seed, STAGE_STREAM));
    let azimuth = std::f64::consts::TAU * rng.random::<f64>();
    let mut draws = 0;
    loop {
        let tilt_factor = tilt_factor_after(draws);
        let board = placed(model, &target, &mut rng, azimuth, TILT_RAD.0 * tilt_factor, 1.0, 0.2 * tilt_factor);
        let carried = |position: &f64| board.turned(&model.motion(*position));
        if tilt_factor <= 0.0 || positions.iter().all(|position| fits(model, &carried(position))) {
            return board;
        }
        draws += 1;
    }
}

/// Draws until the board is entirely in the image, with decreasing tilt and shift; at last it is perpendicular to the
/// camera axis.
fn within_image(model: &StationModel, rng: &mut Pcg64, mut draw: impl FnMut(&mut Pcg64, f64) -> Board) -> Board {
    let mut draws = 0;
    loop {
        let tilt_factor = tilt_factor_after(draws);
        let board = draw(rng, tilt_factor);
        if tilt_factor <= 0.0 || fits(model, &board) {
            return board;
        }
        draws += 1;
    }
}

/// 1 at first, less after every [`DRAWS`] draws, 0 in the end.
fn tilt_factor_after(draws: usize) -> f64 {
    (1.0 - 0.1 * (draws / DRAWS) as f64).max(0.0)
}

fn placed(
    model: &StationModel,
    target: &Board,
    rng: &mut Pcg64,
    azimuth: f64,
    tilt: f64,
    distance: f64,
    tilt_factor: f64,
) -> Board {
    let scale = model.shape.field_scale();
    let mut around = |half_range: f64| half_range * (2.0 * rng.random::<f64>() - 1.0);
    let roll = Rotation3::from_axis_angle(&Vector3::z_axis(), around(ROLL_RAD * tilt_factor));
    let tilted = Rotation3::new(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt);
    let shift = SHIFT_MM * scale * tilt_factor;
    let standoff = model.shape.standoff_mm;
    Board {
        axes: *(tilted * roll).matrix(),
        centre_mm: Vector3::new(around(shift), around(shift), standoff * distance),
        backdrop_z_mm: standoff * (DISTANCE.1 + BACKDROP_GAP_FRACTION),
        ..target.clone()
    }
}

/// Whether the whole pattern is in the image.
fn fits(model: &StationModel, board: &Board) -> bool {
    let (width, height) = (model.camera.width_px as f64, model.camera.height_px as f64);
    let margin = EDGE_FRACTION * width;
    let half = board.half_mm();
    [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].iter().all(|(x, y)| {
        let corner = board.centre_mm + board.axes * Vector3::new(half.x * x, half.y * y, 0.0);
        model.camera.project(&corner).is_some_and(|pixel| {
            (margin..width - margin).contains(&pixel.x) && (margin..height - margin).contains(&pixel.y)
        })
    })
}
