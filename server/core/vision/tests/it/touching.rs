//! Two lines beside each other: found apart with an honest σ, or neither, counted, and no line between them.
//! What this does not show: lines of 2.5 px whose neighbour lies where their background is sampled (2.75 widths), of
//! which few are counted; lines that touch over fewer columns than show their shape beyond their speckle; pictures in
//! which most lines touch, so that the typical line is unknown; light that is not a bell.

use vision::{CentrelineParams, find_centrelines};

use crate::line_widths::{HEIGHT, found, line, picture};

/// A point farther than this from both lines, in widths, is on neither.
const ASTRAY_WIDTHS: f64 = 0.35;
/// Share of the columns that may have such a point: all had one up to 1.25 widths.
const ASTRAY: f64 = 0.06;
/// The same of lines of 2.5 px: 13 % at 2.25 widths, where the pixels show a line in the valley.
const ASTRAY_OF_NARROW: f64 = 0.15;
/// From this distance on, in widths, both must be found, over this share of their columns. Of lines of 2.5 px a pixel is
/// half a width.
const APART_WIDTHS: [(f64, f64); 4] = [(2.5, 3.5), (4.0, 2.5), (6.0, 2.25), (9.0, 2.0)];
const FOUND: f64 = 0.9;
/// Below it, at least this share of the columns without points is counted.
const COUNTED: f64 = 0.6;
/// Errors by σ where both are found, three pictures together.
const HONEST: std::ops::Range<f64> = 0.8..1.25;
const PICTURES: u64 = 3;
/// Columns over which the lines run.
const COLUMNS: std::ops::Range<usize> = 300..724;

#[test]
fn lines_that_touch_are_found_apart_or_not_at_all_and_counted() {
    for (width_px, apart_widths) in APART_WIDTHS {
        // The tops of lines of 2.5 px are as far apart as samples are wide: up to 1.375 widths two are often taken for one.
        let nearest = if width_px < 3.0 { 12 } else { 8 };
        for eighths in
            [8, 9, 10, 11, 12, 14, 16, 18, 20, 22, 24, 28, 32].into_iter().filter(|eighths| *eighths >= nearest)
        {
            let apart = f64::from(eighths) / 8.0;
            let rows = [300.0, 300.0 + apart * width_px];
            let mut lines: Vec<_> = rows.iter().map(|&row| line(row, move |_| width_px)).collect();
            for one in &mut lines {
                one.columns = COLUMNS;
            }
            // The lines that say how wide lines are.
            lines.extend([100.0, 200.0, 500.0, 600.0].map(|row| line(row, move |_| width_px)));
            let (mut n_between, mut n_counted, mut shares, mut squares) = (0, 0, [0.0; 2], 0.0);
            for seed in 0..PICTURES {
                let picture = picture(&lines, 100 * seed + eighths as u64);
                let extracted = find_centrelines(&picture, &CentrelineParams::default());
                let points = extracted.segments.iter().flat_map(|segment| &segment.points);
                let between = points.filter(|point| (250.0..400.0).contains(&point.v_px)).filter(|point| {
                    rows.iter().all(|row| (point.v_px - row - 0.01 * point.u_px).abs() > ASTRAY_WIDTHS * width_px)
                });
                n_between += between.count();
                n_counted += extracted.n_touching;
                for idx in [0, 1] {
                    let of = found(&extracted, &lines[idx], HEIGHT);
                    shares[idx] += of.share / PICTURES as f64;
                    squares += of.share * of.rms_sigmas.powi(2) / PICTURES as f64;
                }
            }
            let n_columns = PICTURES as f64 * COLUMNS.len() as f64;
            let by_sigma = (squares / (shares[0] + shares[1])).sqrt();
            let (between, counted) = (n_between as f64 / n_columns, n_counted as f64 / n_columns / 2.0);
            let name = format!(
                "{width_px} px, {apart} widths apart: {between:.2} between; found {:.2} {:.2}, error/σ {by_sigma:.2}; \
                 {counted:.2} counted",
                shares[0], shares[1]
            );
            println!("{name}");
            assert!(between <= if width_px < 3.0 { ASTRAY_OF_NARROW } else { ASTRAY }, "{name}");
            if apart >= apart_widths {
                assert!(shares.iter().all(|share| *share >= FOUND), "{name}");
                assert!(HONEST.contains(&by_sigma), "{name}");
            } else if width_px > 3.0 {
                assert!(counted >= COUNTED * (1.0 - 0.5 * (shares[0] + shares[1])), "{name}");
            }
        }
    }
}

#[test]
fn a_wide_line_beside_typical_ones_is_one_line() {
    for (width_px, share) in [(4.0, 1.5), (4.0, 1.75), (4.0, 2.0), (6.0, 1.75), (9.0, 1.75)] {
        let mut lines = vec![line(300.0, move |_| share * width_px)];
        lines.extend([100.0, 200.0, 500.0, 600.0].map(|row| line(row, move |_| width_px)));
        for seed in 0..PICTURES {
            let extracted = find_centrelines(&picture(&lines, seed), &CentrelineParams::default());
            let of = found(&extracted, &lines[0], HEIGHT);
            assert!(of.share >= 0.95, "{width_px} px, {share}: {of:?}, {} counted", extracted.n_touching);
        }
    }
}
