//! `sheaf corners`: detects corners of boards, or centres of circle grids, in images, as one CSV per image.

use std::fmt::Write as _;
use std::path::Path;

use capture::{CharucoTarget, ChessboardTarget, CirclesTarget, SquareMm, Target, read_grey_image};
use rayon::prelude::*;
use serde_json::{Value, json};
use vision::{BoardCorners, CharucoParams};

use crate::answer::output::{create_folder, file_names_after, write_file};
use crate::arguments::{CornersArgs, TargetKind};
use crate::commands::{Answer, failed_entry, with_failures};
use pipeline::{Failure, FailureKind, Reporter, find_board};

/// Detects the corners in every image; images without a readable board are reported by name, the others are written.
pub fn run(args: &CornersArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let target = target(args)?;
    create_folder(&args.csv)?;
    let task = reporter.count("finding corners", "images", args.images.len());
    let boards: Vec<Result<BoardCorners, Failure>> = args
        .images
        .par_iter()
        .map(|image| {
            let board = corners_of(image, &target);
            task.step();
            board
        })
        .collect();
    drop(task);
    let mut text = String::new();
    let mut images: Vec<Value> = Vec::new();
    let mut failures = Vec::new();
    for ((image, name), board) in args.images.iter().zip(file_names_after(&args.images, "csv")).zip(boards) {
        match board {
            Ok(board) => {
                let path = args.csv.join(name);
                write_file(&path, csv(&board).as_bytes())?;
                let n_corners = board.corners.len();
                let sigma_px = rms(board.corners.iter().map(|corner| corner.sigma_px));
                let _ = writeln!(
                    text,
                    "{}: {n_corners} corners, σ {sigma_px:.4} px → {}",
                    image.display(),
                    path.display()
                );
                images.push(
                    json!({ "image": image, "csv": path, "n_corners": n_corners, "sigma_rms_px": sigma_px }),
                );
            }
            Err(failure) => {
                images.push(failed_entry(image, &failure));
                failures.push(failure);
            }
        }
    }
    Ok(with_failures(text, json!({}), images, &failures))
}

/// The board with a square size of 1 mm: only calibration needs the real size.
fn target(args: &CornersArgs) -> Result<Target, Failure> {
    let (columns, rows) = (args.columns, args.rows);
    let wrong = |what: &str, remedy: &str| {
        Err(Failure::new(FailureKind::BadParameter, what.to_owned()).remedy(remedy.to_owned()))
    };
    let square_mm = SquareMm::from(1.0);
    let circles = CirclesTarget { columns, rows, square_mm, diameter_mm: 0.5 };
    match args.kind {
        TargetKind::Charuco if columns < 3 || rows < 3 => {
            wrong("a ChArUco board has at least 3 columns and 3 rows of squares", "count the squares")
        }
        _ if columns < 2 || rows < 2 => wrong(
            "a board has at least 2 inner columns and 2 inner rows",
            "count the corners where four squares meet, not the squares",
        ),
        TargetKind::Charuco if !(args.marker_ratio > 0.0 && args.marker_ratio < 1.0) => {
            wrong("--marker-ratio must be above 0 and below 1", "measure marker and square")
        }
        TargetKind::Chessboard => {
            Ok(ChessboardTarget { inner_columns: columns, inner_rows: rows, square_mm }.into())
        }
        TargetKind::Charuco => {
            let dictionary = args.dictionary.clone();
            let params =
                CharucoParams { columns, rows, marker_ratio: args.marker_ratio, dictionary: dictionary.clone() };
            params.check().map_err(|error| Failure::new(FailureKind::BadParameter, error.to_string()))?;
            Ok(Target::Charuco(CharucoTarget {
                columns,
                rows,
                square_mm,
                marker_mm: args.marker_ratio,
                dictionary,
            }))
        }
        TargetKind::Circles => Ok(Target::Circles(circles)),
        TargetKind::AsymmetricCircles => Ok(Target::AsymmetricCircles(circles)),
    }
}

fn corners_of(path: &Path, target: &Target) -> Result<BoardCorners, Failure> {
    let image = read_grey_image(path).map_err(|error| Failure::from(error).in_file(path))?;
    find_board(&image, target).map_err(|error| {
        let more = if matches!(target, Target::Charuco(_)) { "more of" } else { "the whole of" };
        Failure::bad_input(format!("{}: {error}", path.display())).in_file(path).remedy(format!(
            "check --kind, --columns and --rows, and that {more} the board is in the image, evenly lit and in focus"
        ))
    })
}

fn csv(board: &BoardCorners) -> String {
    let mut csv = "row,column,u_px,v_px,sigma_px\n".to_owned();
    for corner in &board.corners {
        let _ = writeln!(
            csv,
            "{},{},{:.6},{:.6},{:.6}",
            corner.row, corner.column, corner.u_px, corner.v_px, corner.sigma_px
        );
    }
    csv
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value * value, n + 1.0));
    if n > 0.0 { f64::sqrt(sum / n) } else { 0.0 }
}
