//! Boards of every kind, rendered and detected: the twin's own projection is the truth.

use capture::{CharucoTarget, CirclesTarget, SquareMm, Target};
use twin::poses::{target_poses, usual_target};
use twin::{Board, Print, Renderer, Scene, StationModel, StationShape};
use vision::{BoardCorners, CharucoParams, CircleParams, find_charuco, find_circles};

/// RMS per axis of disc centres: 0.004 px is stated by `find_circles`, with half as much again for tilted views.
const DISC_RMS_PX: f64 = 0.006;

/// RMS per axis of ChArUco corners, whose windows end before the markers: that of `vision`'s own drawings.
const CORNER_RMS_PX: f64 = 0.012;

/// Mean over a board: 3 σ of corners with the RMS above (88 of them) is 0.004 px.
const MEAN_PX: f64 = 0.004;

fn grid(columns: usize, rows: usize, square_mm: SquareMm) -> CirclesTarget {
    CirclesTarget { columns, rows, square_mm, diameter_mm: 9.0 }
}

/// Checks that the detected points lie where the board projects, in the order of its rows and columns or rotated by
/// 180°.
fn check(renderer: &Renderer, board: &Board, found: &BoardCorners) {
    let (columns, rows) = (board.inner_columns, board.inner_rows);
    assert_eq!(found.corners.len(), columns * rows);
    let errors = |is_turned: bool| -> Vec<[f64; 2]> {
        let error = |corner: &vision::Corner| {
            let place = (corner.column, corner.row);
            let (column, row) = if is_turned { (columns - 1 - place.0, rows - 1 - place.1) } else { place };
            let truth = renderer.model().camera.project(&board.corner_mm(column, row)).unwrap();
            [corner.u_px - truth.x, corner.v_px - truth.y]
        };
        found.corners.iter().map(error).collect()
    };
    let square = |errors: &[[f64; 2]]| errors.iter().flatten().map(|error| error * error).sum::<f64>();
    let errors = [errors(false), errors(true)].into_iter().min_by(|a, b| square(a).total_cmp(&square(b))).unwrap();
    let rms_px = (square(&errors) / (2 * errors.len()) as f64).sqrt();
    let mean_px = [0, 1].map(|axis| errors.iter().map(|error| error[axis]).sum::<f64>() / errors.len() as f64);
    println!("{} points: RMS {rms_px:.4} px, mean {mean_px:.4?} px", errors.len());
    let limit_px = if matches!(board.print, Print::Discs { .. }) { DISC_RMS_PX } else { CORNER_RMS_PX };
    assert!(rms_px < limit_px && mean_px.iter().all(|mean| mean.abs() < MEAN_PX), "{rms_px} {mean_px:?}");
}

#[test]
fn discs_and_markers_are_found_where_they_project() {
    let renderer = Renderer::new(&StationModel::seeded(7, &StationShape::default()).unwrap());
    let sides = SquareMm { x_mm: 12.0, y_mm: 12.2 };
    let markers = CharucoTarget {
        columns: 12,
        rows: 9,
        square_mm: 12.0.into(),
        marker_mm: 8.0,
        dictionary: "DICT_5X5_100".to_owned(),
    };
    for target in [
        Target::Circles(grid(9, 7, 16.0.into())),
        Target::AsymmetricCircles(grid(6, 9, sides)),
        Target::Charuco(markers),
    ] {
        for board in target_poses(renderer.model(), &target, 3) {
            let image = renderer.board_image(&Scene::Board(board.clone()), 0.0, 0);
            let found = match &target {
                Target::Charuco(of) => {
                    let (columns, rows, marker_ratio) = (of.columns, of.rows, of.marker_mm / of.square_mm.x_mm);
                    let dictionary = of.dictionary.clone();
                    find_charuco(&image, &CharucoParams { columns, rows, marker_ratio, dictionary })
                }
                other => {
                    let (of, staggered) = other.circles().unwrap();
                    find_circles(&image, &CircleParams { columns: of.columns, rows: of.rows, staggered })
                }
            };
            check(&renderer, &board, &found.unwrap());
        }
    }
}

#[test]
fn the_usual_target_is_the_chessboard_of_the_station() {
    let model = StationModel::seeded(7, &StationShape::default()).unwrap();
    assert_eq!(usual_target(&model).inner_corners(), (11, 8));
    assert_eq!(usual_target(&model).square_mm(), 12.0.into());
}
