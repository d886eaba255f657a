//! Corners of the boards of both rendered stations against their truth. Not covered: print and flatness of a real board.

use std::path::Path;

use serde_json::Value;
use vision::{BoardCorners, CornerParams, GreyImage, Pixels, find_corners};

fn load(path: &Path) -> GreyImage {
    let grey = image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).to_luma8();
    GreyImage::new(grey.width() as usize, grey.height() as usize, Pixels::Eight(grey.into_raw())).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Where a corner of a pose lies in the image: board rotation and centre in the camera frame, Brown–Conrady distortion.
fn projected(truth: &Value, pose: usize, column: usize, row: usize) -> [f64; 2] {
    let (k, dist) = (numbers(&truth["K"]), numbers(&truth["dist"]));
    let centre = numbers(&truth[format!("pose{pose}_c")]);
    let board = [12.0 * (column as f64 - 5.0), 12.0 * (row as f64 - 3.5)];
    let axis = |i: usize| {
        let r = numbers(&truth[format!("pose{pose}_R")][i]);
        centre[i] + r[0] * board[0] + r[1] * board[1]
    };
    let (x, y) = (axis(0) / axis(2), axis(1) / axis(2));
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (dist[0] + r2 * (dist[1] + r2 * dist[4]));
    let (p1, p2) = (dist[2], dist[3]);
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [k[0] * xd + k[2], k[1] * yd + k[3]]
}

/// Smallest angle of an edge near the board's middle to the pixel grid, degrees.
fn angle_to_grid(board: &BoardCorners) -> f64 {
    let at = |row: usize, column: usize| board.corners[row * board.inner_columns + column];
    let (a, b, c) = (at(4, 5), at(4, 6), at(5, 5));
    let of = |u: f64, v: f64| {
        let degrees = v.atan2(u).to_degrees().rem_euclid(90.0);
        degrees.min(90.0 - degrees)
    };
    of(b.u_px - a.u_px, b.v_px - a.v_px).min(of(c.u_px - a.u_px, c.v_px - a.v_px))
}

#[test]
fn corners_of_the_rendered_stations_are_as_accurate_as_stated() {
    let params = CornerParams { inner_columns: 11, inner_rows: 8 };
    // Boards within half a degree of the grid are limited by the renderings' samples: `docs/maths/corners.md`.
    for (rig, limit_px) in [("rig-a", RIG_A_PX), ("rig-b", RIG_B_PX)] {
        let Some(folder) = reference::data(rig) else { return };
        let truth: Value = serde_json::from_slice(&std::fs::read(folder.join("truth.json")).unwrap()).unwrap();
        let (mut square, mut sigmas, mut n) = (0.0, 0.0, 0.0);
        for pose in 0..12 {
            let board = find_corners(&load(&folder.join(format!("board/{pose:03}.png"))), &params).unwrap();
            let (mut own, mut own_sigmas, mut stated) = ([0.0; 2], 0.0, 0.0);
            for corner in &board.corners {
                let at = projected(&truth, pose, corner.column, corner.row);
                let error = [corner.u_px - at[0], corner.v_px - at[1]];
                for (own, error) in own.iter_mut().zip(error) {
                    *own += error * error / board.corners.len() as f64;
                    own_sigmas += (error / corner.sigma_px).powi(2);
                    (square, n) = (square + error * error, n + 1.0);
                }
                stated += corner.sigma_px / board.corners.len() as f64;
            }
            sigmas += own_sigmas;
            eprintln!(
                "{rig} {pose}: u {:.4} v {:.4} px, stated {stated:.4}, error {:.2} σ, {:.2}° to the grid",
                own[0].sqrt(),
                own[1].sqrt(),
                (own_sigmas / 2.0 / board.corners.len() as f64).sqrt(),
                angle_to_grid(&board)
            );
        }
        let (rms_px, by_sigma) = (f64::sqrt(square / n), f64::sqrt(sigmas / n));
        eprintln!("{rig}: {rms_px:.4} px per axis, error {by_sigma:.2} σ");
        assert!(rms_px < limit_px, "{rig}: {rms_px} px per axis");
        assert!((0.8..1.25).contains(&by_sigma), "{rig}: error {by_sigma} σ");
    }
}

const RIG_A_PX: f64 = 0.0085;
const RIG_B_PX: f64 = 0.013;
