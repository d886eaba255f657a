//! The predicted bias of averaging along a line, compared with that of extracted lines. Not covered: the blur of a lens.

use vision::{AveragingBias, CentrelineParams, find_centrelines};

use crate::line_widths::{arc, rendered};

const RADIUS_PX: f64 = 52.0;
/// Ends of an arc, columns from its middle: 67° of a circle.
const HALF_PX: usize = 48;
/// Rows per column of radius: the lines of a station with 27° between laser and camera.
const SCALE: f64 = 0.5;
const SPACING_PX: f64 = 120.0;

fn row(from_middle_px: f64) -> f64 {
    -SCALE * (RADIUS_PX * RADIUS_PX - from_middle_px * from_middle_px).sqrt()
}

/// Columns from the middle of an arc, and the sums over them.
struct Bin {
    columns: std::ops::Range<usize>,
    found_px: f64,
    predicted_px: f64,
    variance: f64,
    n: f64,
}

/// Errors of the rows of arcs, and those predicted.
fn errors() -> Vec<Bin> {
    let ranges = [0..10, 20..28, 30..36, 42..46];
    let empty = |columns| Bin { columns, found_px: 0.0, predicted_px: 0.0, variance: 0.0, n: 0.0 };
    let mut bins: Vec<Bin> = ranges.into_iter().map(empty).collect();
    let middles: Vec<(f64, f64)> =
        (0..64).map(|idx| (70.0 + SPACING_PX * f64::from(idx % 8), 90.0 + 80.0 * f64::from(idx / 8))).collect();
    for seed in 0..16 {
        let arcs: Vec<_> = middles.iter().map(|&(u, v)| arc([u, v], HALF_PX, 6.0, row)).collect();
        let lines = find_centrelines(&rendered(&arcs, seed), &CentrelineParams::default());
        let averaging = AveragingBias::new(lines.correlation_px);
        for segment in &lines.segments {
            let first = &segment.points[0];
            let starts_there = |(u, v): &&(f64, f64)| {
                let start = [u - HALF_PX as f64, v + row(HALF_PX as f64)];
                (first.u_px - start[0]).abs() < 8.0 && (first.v_px - start[1]).abs() < 8.0
            };
            let Some(&(u0, v0)) = middles.iter().find(starts_there) else { continue };
            let rows_px: Vec<f32> = segment.points.iter().map(|point| row(point.u_px - u0) as f32).collect();
            for (at, point) in segment.points.iter().enumerate() {
                let from_middle = point.u_px - u0;
                let column = from_middle.abs().round() as usize;
                let Some(bin) = bins.iter_mut().find(|bin| bin.columns.contains(&column)) else { continue };
                let sigma_px = point.sigma_px / point.normal[1].abs();
                bin.found_px += point.v_px - v0 - row(from_middle);
                bin.predicted_px += averaging.at(&rows_px, at, sigma_px);
                bin.variance += sigma_px * sigma_px * lines.correlation_px;
                bin.n += 1.0;
            }
        }
    }
    bins
}

#[test]
fn the_predicted_bias_on_an_arc_is_that_of_extracted_lines() {
    let bins = errors();
    for Bin { columns, found_px, predicted_px, variance, n } in &bins {
        let (found, predicted, standard_error) = (found_px / n, predicted_px / n, variance.sqrt() / n);
        eprintln!("{columns:?}: {found:+.4} {predicted:+.4} px, {standard_error:.4}");
        assert!((found - predicted).abs() < 3.0 * standard_error, "{columns:?}: {found} {predicted}");
    }
    let flank = &bins[3];
    assert!(
        flank.found_px > 5.0 * flank.variance.sqrt(),
        "there is nothing to predict: {} px",
        flank.found_px / flank.n
    );
}
