//! The chapter on the camera: residuals over the image and per image, coverage of the image by corners.

use calibration::{CameraReport, PoseResidual};
use maud::{Markup, html};
use optics::Camera;

use crate::drawing::page::{figure, grid, table};
use crate::drawing::plot::{Axis, Plot, bars};

/// Width of plots over the image in SVG units.
const PLANE_WIDTH: f64 = 520.0;

/// Length of a typical residual in the map, as a fraction of the image width.
const TYPICAL_ARROW_FRACTION: f64 = 0.018;

/// Cells across the image in the coverage map.
const COVERAGE_CELLS: usize = 16;

/// Names and units of the nine parameters.
const PARAMETERS: [&str; 9] = ["fx, px", "fy, px", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3"];

/// Figures and table of the camera fit.
pub fn content(camera: &Camera, report: &CameraReport) -> Markup {
    let per_image: Vec<(String, f64)> = report.poses.iter().map(|pose| (pose.name.clone(), pose.rms_px)).collect();
    let figures = [
        residual_map(camera, report),
        figure(
            bars(&per_image, "px", 4, |idx| per_image[idx].1 > 1.5 * report.rms_px),
            "RMS reprojection error per image. An outlier (dark) means that the board was moved, blurred or bent.",
        ),
        coverage_map(camera, &report.poses),
    ];
    html! { (grid(&figures)) (parameter_table(camera, report)) }
}

fn residual_map(camera: &Camera, report: &CameraReport) -> Markup {
    let width_px = camera.width_px as f64;
    let factor = round_factor(width_px * TYPICAL_ARROW_FRACTION / report.rms_px.max(1e-9));
    let mut plot = image_plot(camera);
    let arrows = report
        .poses
        .iter()
        .flat_map(|pose| &pose.residuals_px)
        .map(|[u, v, du, dv]| [*u, *v, du * factor, dv * factor]);
    plot.arrows(arrows, "");
    figure(
        plot.svg(),
        &format!("Residuals of all corners, {factor:.0} times enlarged. They should point in random directions."),
    )
}

/// 1, 2 or 5 times a power of ten, at most `factor`.
fn round_factor(factor: f64) -> f64 {
    let power = 10f64.powf(factor.max(1.0).log10().floor());
    [5.0, 2.0, 1.0].iter().map(|lead| lead * power).find(|round| *round <= factor).unwrap_or(1.0)
}

fn coverage_map(camera: &Camera, poses: &[PoseResidual]) -> Markup {
    let cell_px = camera.width_px as f64 / COVERAGE_CELLS as f64;
    let rows = (camera.height_px as f64 / cell_px).ceil() as usize;
    let mut counts = vec![0usize; rows * COVERAGE_CELLS];
    for [u, v, ..] in poses.iter().flat_map(|pose| &pose.residuals_px) {
        let column = (((u + 0.5) / cell_px) as usize).min(COVERAGE_CELLS - 1);
        let row = (((v + 0.5) / cell_px) as usize).min(rows - 1);
        counts[row * COVERAGE_CELLS + column] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    let empty = counts.iter().filter(|count| **count == 0).count();
    let mut plot = image_plot(camera);
    for (idx, count) in counts.iter().enumerate() {
        let u = (idx % COVERAGE_CELLS) as f64 * cell_px - 0.5;
        let v = (idx / COVERAGE_CELLS) as f64 * cell_px - 0.5;
        let bottom = (v + cell_px).min(camera.height_px as f64);
        let opacity = (*count as f64 / most as f64).sqrt() * 0.9;
        plot.cell((u, v), (u + cell_px, bottom), "cell", opacity, &format!("{count} corners"));
    }
    figure(
        plot.svg(),
        &format!(
            "Where corners were seen (up to {most} per cell). {:.0} % of the image saw none: there the distortion \
             is extrapolated.",
            empty as f64 * 100.0 / counts.len() as f64
        ),
    )
}

fn image_plot(camera: &Camera) -> Plot {
    let (width_px, height_px) = (camera.width_px as f64, camera.height_px as f64);
    Plot::new(
        Axis::new(-0.5, width_px - 0.5, "column u, px"),
        Axis::new(height_px - 0.5, -0.5, "row v, px"),
        PLANE_WIDTH,
        PLANE_WIDTH * height_px / width_px,
    )
}

fn parameter_table(camera: &Camera, report: &CameraReport) -> Markup {
    let rows: Vec<Vec<String>> = PARAMETERS
        .iter()
        .zip(camera.parameters())
        .zip(report.sigma)
        .map(|((name, value), sigma)| {
            let sigma = if sigma == 0.0 { "fixed".to_owned() } else { format!("{sigma:.6}") };
            vec![(*name).to_owned(), format!("{value:.6}"), sigma]
        })
        .collect();
    table(&["parameter", "value", "σ"], &rows, |_| false)
}
