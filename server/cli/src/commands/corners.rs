//! `sheaf corners`: chessboard corners of images, one CSV each.

use std::fmt::Write as _;
use std::path::Path;

use capture::read_grey_image;
use rayon::prelude::*;
use serde_json::{Value, json};
use vision::{BoardCorners, CornerParams, find_corners};

use crate::arguments::CornersArgs;
use crate::commands::{Answer, failed_entry, with_failures};
use crate::output::{create_folder, file_names_after, write_file};
use pipeline::Reporter;
use pipeline::{Failure, FailureKind};

/// Finds the corners of every image; images without a readable board are named, the others are written and reported.
pub fn run(args: &CornersArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    if args.columns < 2 || args.rows < 2 {
        return Err(Failure::new(
            FailureKind::BadParameter,
            "a board has at least 2 inner columns and 2 inner rows",
        )
        .remedy("count the corners where four squares meet, not the squares"));
    }
    create_folder(&args.csv)?;
    let params = CornerParams { inner_columns: args.columns, inner_rows: args.rows };
    let task = reporter.count("finding corners", "images", args.images.len());
    let boards: Vec<Result<BoardCorners, Failure>> = args
        .images
        .par_iter()
        .map(|image| {
            let board = corners_of(image, &params);
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

fn corners_of(path: &Path, params: &CornerParams) -> Result<BoardCorners, Failure> {
    let image = read_grey_image(path).map_err(|error| Failure::from(error).in_file(path))?;
    find_corners(&image, params).map_err(|error| {
        Failure::bad_input(format!("{}: {error}", path.display()))
            .in_file(path)
            .remedy("check --columns and --rows, and that the whole board is in the picture, evenly lit and sharp")
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
