//! Two adjacent lines: both are found, or neither, and no line between them. Not covered: lines 1 to 1.25 widths apart,
//! which still give one line between them; lines that touch over too few columns for a minimum significant against
//! speckle; profiles that are not Gaussian.

use vision::{CentrelineParams, find_centrelines};

use crate::line_widths::{HEIGHT, found, line, rendered};

/// A point farther than this from both lines, in widths, is a false point.
const ASTRAY_WIDTHS: f64 = 0.35;
/// Largest fraction of columns with a false point; without the check, 400 to 424 of 424 had one.
const ASTRAY: f64 = 0.06;
/// From this distance on, in widths, both must be found, over this fraction of their columns.
const APART_WIDTHS: f64 = 3.0;
const FOUND: f64 = 0.9;
/// Columns over which the lines run.
const COLUMNS: std::ops::Range<usize> = 300..724;

#[test]
fn touching_lines_are_found_separately_or_not_at_all() {
    for width_px in [4.0, 6.0, 9.0] {
        for quarters in 6..=12 {
            let apart = f64::from(quarters) / 4.0;
            let rows = [300.0, 300.0 + apart * width_px];
            let mut lines: Vec<_> = rows.iter().map(|&row| line(row, move |_| width_px)).collect();
            for one in &mut lines {
                one.columns = COLUMNS;
            }
            // Lines that determine the typical width.
            lines.extend([100.0, 200.0, 500.0, 600.0].map(|row| line(row, move |_| width_px)));
            let rendered = rendered(&lines, 11 + quarters as u64);
            let extracted = find_centrelines(&rendered, &CentrelineParams::default());
            let points = extracted.segments.iter().flat_map(|segment| &segment.points);
            let between = points.filter(|point| (250.0..400.0).contains(&point.v_px)).filter(|point| {
                rows.iter().all(|row| (point.v_px - row - 0.01 * point.u_px).abs() > ASTRAY_WIDTHS * width_px)
            });
            let n_between = between.count();
            let of = [0, 1].map(|idx| found(&extracted, &lines[idx], HEIGHT));
            println!(
                "{width_px} px, {apart} widths apart: {n_between} between; found {:.2} {:.2}, error/σ {:.2} {:.2}",
                of[0].share, of[1].share, of[0].rms_sigmas, of[1].rms_sigmas
            );
            assert!(
                n_between as f64 <= ASTRAY * COLUMNS.len() as f64,
                "{width_px} px, {apart} widths: {n_between}"
            );
            if apart >= APART_WIDTHS {
                assert!(of.iter().all(|found| found.share >= FOUND), "{width_px} px, {apart} widths: {of:?}");
            }
        }
    }
}
