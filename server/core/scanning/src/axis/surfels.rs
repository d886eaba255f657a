//! Surfels: small planar patches of surface, each observed in a frame and its two neighbours
//! (`docs/maths/turntable.md`, eq. 12).

use nalgebra::{Matrix3, Vector3};
use optics::{Calibration, RotaryAxis};
use rayon::prelude::*;
use vision::LineDirection;

use crate::points::profile::{Profile, ProfilePoint};

/// Largest angle between consecutive frames of one surfel.
const MAX_NEIGHBOUR_ANGLE_RAD: f64 = 0.3;
/// Fewest points of a surfel.
const MIN_POINTS: usize = 9;
/// A surfel whose points are farther from their plane than this many times their noise contains an edge.
const SMOOTH_SIGMAS: f64 = 3.0;

/// One line in one frame.
pub struct LineFrame {
    pub angle_rad: f64,
    /// Points along the line.
    pub points: Vec<(f64, ProfilePoint)>,
    pub correlation_px: f64,
}

/// The frames in which a line was observed, in the sequence of their angles.
pub type Line = Vec<LineFrame>;

/// A surfel.
#[derive(Debug, Clone)]
pub struct Surfel {
    /// Index of its line.
    pub line: usize,
    pub angle_rad: f64,
    /// Its centre and its unit normal towards the camera, in the camera frame of its own frame.
    pub at_mm: Vector3<f64>,
    pub normal: Vector3<f64>,
    /// One σ of the centre along the normal.
    pub sigma_mm: f64,
    /// Covariance of the normal.
    pub normal_covariance: Matrix3<f64>,
    /// Its radius.
    pub radius_mm: f64,
}

/// The frames of every line. `profiles`: for every frame its points, their correlation along the line and the line
/// direction.
pub fn lines(profiles: &[(Profile, f64, LineDirection)], angles_rad: &[f64], orders: &[i8]) -> Vec<Line> {
    let of_line = |order: &i8| {
        let frame =
            |((profile, correlation_px, direction), &angle_rad): (&(Profile, f64, LineDirection), &f64)| {
                let own = profile.points.iter().filter(|point| point.order == *order);
                let mut points: Vec<(f64, ProfilePoint)> =
                    own.map(|point| (point.centreline.along_across(*direction).0, *point)).collect();
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                (!points.is_empty()).then_some(LineFrame { angle_rad, points, correlation_px: *correlation_px })
            };
        let mut frames: Line = profiles.iter().zip(angles_rad).filter_map(frame).collect();
        frames.sort_by(|a, b| a.angle_rad.total_cmp(&b.angle_rad));
        frames
    };
    orders.iter().map(of_line).collect()
}

/// The surfels of every frame, each from the frame and its two neighbours, with the table turned about `axis`.
pub fn surfels(lines: &[Line], calibration: &Calibration, axis: &RotaryAxis) -> Vec<Surfel> {
    let focal_px = calibration.camera.fx_px.min(calibration.camera.fy_px);
    let triples = lines.iter().enumerate().flat_map(|(line, frames)| frames.windows(3).map(move |w| (line, w)));
    let near = |(_, window): &(usize, &[LineFrame])| {
        window.windows(2).all(|pair| (pair[1].angle_rad - pair[0].angle_rad).abs() < MAX_NEIGHBOUR_ANGLE_RAD)
    };
    let triples: Vec<(usize, &[LineFrame])> = triples.filter(near).collect();
    triples
        .into_par_iter()
        .flat_map_iter(|(line, window)| surfels_of_frame(line, window, focal_px, axis))
        .collect()
}

fn surfels_of_frame(line: usize, window: &[LineFrame], focal_px: f64, axis: &RotaryAxis) -> Vec<Surfel> {
    let own = &window[1];
    let step_rad = 0.5 * (window[2].angle_rad - window[0].angle_rad).abs();
    let own_motion = axis.motion(own.angle_rad);
    let mut surfels = Vec::new();
    let mut next_px = f64::NEG_INFINITY;
    for (along, point) in &own.points {
        if *along < next_px {
            continue;
        }
        let centre = &point.hit_in_camera.xyz;
        let radius_mm = (axis.radius_mm(centre) * step_rad).max(2.0 * centre.z / focal_px);
        let reach_px = radius_mm * focal_px / centre.z;
        // Surfels of one frame have no point in common.
        next_px = along + 2.0 * reach_px;
        let near = window.iter().flat_map(|frame| {
            let first = frame.points.partition_point(|(at, _)| *at < along - reach_px);
            let around = frame.points[first..].iter().take_while(move |(at, _)| *at <= along + reach_px);
            let motion = axis.motion(frame.angle_rad);
            around.map(move |(_, point)| {
                own_motion.camera_from_part(&motion.part_from_camera(&point.hit_in_camera)).xyz
            })
        });
        let near: Vec<Vector3<f64>> = near.filter(|at| (at - centre).norm() < 2.0 * radius_mm).collect();
        surfels.extend(surfel(line, own, &near, point.noise_sigma_mm, radius_mm));
    }
    surfels
}

/// The plane through the points, if they are smooth.
fn surfel(line: usize, own: &LineFrame, near: &[Vector3<f64>], noise_mm: f64, radius_mm: f64) -> Option<Surfel> {
    let n = near.len() as f64;
    if near.len() < MIN_POINTS {
        return None;
    }
    let at_mm = near.iter().sum::<Vector3<f64>>() / n;
    let spread: Matrix3<f64> = near.iter().map(|at| (at - at_mm) * (at - at_mm).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let mut by_size = [0, 1, 2];
    by_size.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [thin, short, long] = by_size;
    let rms_mm = (eigen.eigenvalues[thin].max(0.0) / (n - 3.0)).sqrt();
    // Collinear points do not determine the surface across them.
    let spans_a_plane = eigen.eigenvalues[short] > 0.02 * eigen.eigenvalues[long];
    if !spans_a_plane || rms_mm > SMOOTH_SIGMAS * noise_mm {
        return None;
    }
    let axis = |idx: usize| eigen.eigenvectors.column(idx).into_owned();
    let normal = if axis(thin).dot(&at_mm) < 0.0 { axis(thin) } else { -axis(thin) };
    let variance = rms_mm.max(0.3 * noise_mm).powi(2) * own.correlation_px.max(1.0);
    let tilt_covariance = |idx: usize| axis(idx) * axis(idx).transpose() * (variance / eigen.eigenvalues[idx]);
    Some(Surfel {
        line,
        angle_rad: own.angle_rad,
        at_mm,
        normal,
        sigma_mm: (variance / n).sqrt(),
        normal_covariance: tilt_covariance(short) + tilt_covariance(long),
        radius_mm,
    })
}
