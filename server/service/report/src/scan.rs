//! The report of a scan: views of the cloud, agreement of the orders, frames with their labels.

use calibration::CalibrationDocument;
use capture::Capture;
use maud::{Markup, html};
use scanning::ScanResult;

use super::drawing::cloud_view::CloudView;
use super::drawing::labelled_images::{LabelledPixel, labelled_image};
use super::drawing::page::{Page, Tile, gallery, grid, legend, sentence, table};
use crate::drawing::palette::order_hex;
use crate::tables::{closure_gaps, losses, median_sigma_mm, order_name};
use pipeline::Failure;

/// Number of frames shown: early, middle, late.
const SHOWN_FRAMES: usize = 3;

/// The report of one scan.
pub fn scan_page(
    capture: &Capture,
    name: &str,
    result: &ScanResult,
    document: &CalibrationDocument,
) -> Result<String, Failure> {
    let lead =
        format!("Scan {name} of {} with calibration {}.", capture.folder.display(), document.calibration.id);
    let mut page = Page::new(&format!("Scan {name}"), &lead);
    page.tiles(&tiles(result));
    scan_section(&mut page, capture, name, result)?;
    Ok(page.finish())
}

/// The section of one scan.
pub fn scan_section(page: &mut Page, capture: &Capture, name: &str, result: &ScanResult) -> Result<(), Failure> {
    let orders = capture.manifest.projector.orders();
    let keys: Vec<(String, String)> =
        orders.iter().map(|order| (format!("order {}", order_name(*order)), order_hex(*order))).collect();
    let view = CloudView::new(&result.cloud);
    let views = [view.top_view()?, view.side_views()];
    let content = html! {
        (legend(&keys))
        (grid(&views))
        (gallery(&frames(capture, name, result)?))
        (agreement(result))
        (closure(result))
        (left_out(result))
    };
    let introduction = format!(
        "{} points. Heights are distances from the dominant plane. {}.",
        result.report.n_points,
        sentence(&result.report.envelope.to_string())
    );
    page.section(&format!("Scan {name}"), &introduction, content);
    Ok(())
}

fn tiles(result: &ScanResult) -> [Tile; 3] {
    let worst = result.report.self_consistency.iter().map(|pair| pair.bias_mm.abs()).fold(0.0, f64::max);
    [
        Tile::new(
            result.report.n_points.to_string(),
            "points",
            format!("from {} line segments", result.report.n_segments),
        ),
        Tile::new(
            format!("{:.1} µm", median_sigma_mm(result) * 1e3),
            "median σ",
            "along the ray, from image noise and calibration",
        ),
        Tile::new(
            format!("{:.1} µm", worst * 1e3),
            "largest bias between orders",
            "between two orders on the same surface",
        ),
    ]
}

fn frames(capture: &Capture, name: &str, result: &ScanResult) -> Result<Vec<Markup>, Failure> {
    let scan = capture.scan(name)?;
    let n_frames = scan.frames.len();
    let frames_per_image = capture.manifest.projector.crossing_lines().map_or(1, |lines| lines.len());
    (0..SHOWN_FRAMES.min(n_frames))
        .map(|shown| {
            let idx = (n_frames * (2 * shown + 1) / (2 * SHOWN_FRAMES)).min(n_frames - 1);
            let frame = &scan.frames[idx];
            let labelled: Vec<LabelledPixel> = result
                .cloud
                .points
                .iter()
                .filter(|point| point.frame as usize / frames_per_image == idx)
                .map(|point| (f64::from(point.u_px), f64::from(point.v_px), point.order))
                .collect();
            let caption = format!("{} at {}", frame.image.display(), frame.position());
            labelled_image(capture, &frame.image, None, &labelled, &caption)
        })
        .collect()
}

fn agreement(result: &ScanResult) -> Markup {
    if result.report.self_consistency.is_empty() {
        return Markup::default();
    }
    let rows: Vec<Vec<String>> = result
        .report
        .self_consistency
        .iter()
        .map(|pair| {
            vec![
                format!("{} and {}", order_name(pair.order_a), order_name(pair.order_b)),
                pair.n_pairs.to_string(),
                format!("{:+.1}", pair.bias_mm * 1e3),
                format!("{:.1}", pair.rms_mm * 1e3),
            ]
        })
        .collect();
    html! { h3 { "Agreement of orders" } (table(&["orders", "pairs", "bias, µm", "RMS, µm"], &rows, |_| false)) }
}

fn closure(result: &ScanResult) -> Markup {
    let rows: Vec<Vec<String>> = closure_gaps(&result.report)
        .into_iter()
        .map(|(name, gap)| {
            vec![
                name.to_owned(),
                gap.n_pairs.to_string(),
                format!("{:+.1}", gap.bias_mm * 1e3),
                format!("{:.1}", gap.rms_mm * 1e3),
            ]
        })
        .collect();
    if rows.is_empty() {
        return Markup::default();
    }
    html! { h3 { "Closure after a full turn" } (table(&["seen again by", "pairs", "bias, µm", "RMS, µm"], &rows, |_| false)) }
}

fn left_out(result: &ScanResult) -> Markup {
    let rows: Vec<Vec<String>> = losses(&result.report)
        .into_iter()
        .map(|(reason, points, pieces)| vec![reason.to_owned(), points.to_string(), pieces.to_string()])
        .collect();
    if rows.is_empty() {
        return Markup::default();
    }
    html! { h3 { "Rejected points" } (table(&["reason", "points", "whole pieces"], &rows, |_| false)) }
}
