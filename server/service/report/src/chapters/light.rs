//! The chapter on the light sheets: the three models side by side, residuals per order and per pose.

use calibration::{CrossValidation, LaserPoint, LightReport};
use capture::Projector;
use maud::{Markup, html};
use vision::LineDirection;

use crate::drawing::page::{figure, grid, legend, sentence, table, verdict};
use crate::drawing::palette::order_hex;
use crate::drawing::plot::{Axis, Plot, bars, tenths};
use crate::tables::{order_name, order_sums};

/// Maximum number of dots per order in a residual plot.
const MAX_DOTS: usize = 2000;

/// Bins of the running mean along the line.
const MEAN_BINS: usize = 24;

/// Minimum number of points in a bin whose mean is drawn.
const MIN_PER_BIN: usize = 8;

/// The three models, table and bars, with the recommendation as a sentence.
pub fn models(models: &CrossValidation) -> Markup {
    let rows: Vec<Vec<String>> = models
        .scores
        .iter()
        .map(|score| match &score.failure {
            Some(reason) => {
                vec![score.model.name().to_owned(), "–".into(), "–".into(), "–".into(), "–".into(), reason.clone()]
            }
            None => vec![
                score.model.name().to_owned(),
                format!("{:.4}", score.held_out_rms_px),
                format!("{:.1}", score.held_out_rms_mm * 1e3),
                format!("{:.1}", score.held_out_bias_mm * 1e3),
                format!("{:.4}", score.fit_rms_px),
                if score.model == models.recommended { "recommended".to_owned() } else { String::new() },
            ],
        })
        .collect();
    let head = ["model", "held-out RMS, px", "held-out RMS, µm", "bias, µm", "RMS of the fit, px", ""];
    let fitted: Vec<_> = models.scores.iter().filter(|score| score.failure.is_none()).collect();
    let entries: Vec<(String, f64)> =
        fitted.iter().map(|score| (score.model.name().to_owned(), score.held_out_bias_mm * 1e3)).collect();
    let marked = |idx: usize| models.scores[idx].model == models.recommended;
    html! {
        (verdict(&sentence(&models.reason)))
        (table(&head, &rows, marked))
        (figure(
            bars(&entries, "µm", 1, |idx| fitted[idx].model == models.recommended),
            "Systematic depth error on held-out poses: mean error per pose and order, RMS.",
        ))
    }
}

/// Residuals of the chosen model.
pub fn residuals(light: &LightReport, projector: &Projector) -> Markup {
    let sums = order_sums(light);
    let rows: Vec<Vec<String>> = sums
        .iter()
        .map(|sum| {
            vec![
                order_name(sum.order),
                sum.n_points.to_string(),
                format!("{:+.4}", sum.mean_px),
                format!("{:.4}", sum.rms_px),
                format!("{:.2}", sum.normalised_rms),
                sum.n_outliers.to_string(),
            ]
        })
        .collect();
    let keys: Vec<(String, String)> =
        sums.iter().map(|sum| (format!("order {}", order_name(sum.order)), order_hex(sum.order))).collect();
    let extent = extent(light);
    let mut figures: Vec<Markup> =
        sums.iter().map(|sum| order_plot(light, sum.order, projector.direction_of(sum.order), extent)).collect();
    figures.push(pose_order_map(light));
    let head = ["order", "points", "mean, px", "RMS, px", "RMS / σ", "outliers"];
    html! { (legend(&keys)) (table(&head, &rows, |_| false)) (grid(&figures)) }
}

/// Four times the RMS residual, which contains all but rare outliers.
fn extent(light: &LightReport) -> f64 {
    let sum: f64 = light.points.iter().map(|point| point.residual_px.powi(2)).sum();
    (4.0 * (sum / light.points.len().max(1) as f64).sqrt()).max(1e-3)
}

fn order_plot(light: &LightReport, order: i8, direction: LineDirection, extent: f64) -> Markup {
    let (along, title): (fn(&LaserPoint) -> f64, &str) = match direction {
        LineDirection::Rows => (|point| point.u_px, "column u, px"),
        LineDirection::Columns => (|point| point.v_px, "row v, px"),
    };
    let points: Vec<(f64, f64)> = light
        .points
        .iter()
        .filter(|point| point.order == order)
        .map(|point| (along(point), point.residual_px))
        .collect();
    let x = Axis::around(light.points.iter().map(along), title);
    let mut plot = Plot::new(x, Axis::symmetric(extent, "residual, px"), 420.0, 170.0);
    let colour = order_hex(order);
    let stride = points.len().div_ceil(MAX_DOTS).max(1);
    plot.dots(points.iter().copied().step_by(stride), 2.0, &format!("stroke:{colour};opacity:.45"));
    plot.rule_at(0.0);
    plot.line(&running_mean(&points), "stroke:var(--ink);stroke-width:1.8");
    figure(
        plot.svg(),
        &format!(
            "Order {}: residual along the line, all poses; the line is the running mean. A bow indicates a wrong model.",
            order_name(order)
        ),
    )
}

/// Mean per bin along the line.
fn running_mean(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let low = points.iter().map(|point| point.0).fold(f64::INFINITY, f64::min);
    let high = points.iter().map(|point| point.0).fold(f64::NEG_INFINITY, f64::max);
    let width = (high - low) / MEAN_BINS as f64;
    let mut sums = [(0.0, 0.0, 0usize); MEAN_BINS];
    for (x, y) in points {
        let bin = (((x - low) / width) as usize).min(MEAN_BINS - 1);
        sums[bin] = (sums[bin].0 + x, sums[bin].1 + y, sums[bin].2 + 1);
    }
    let full = sums.iter().filter(|(_, _, n)| *n >= MIN_PER_BIN);
    full.map(|(x, y, n)| (x / *n as f64, y / *n as f64)).collect()
}

/// Mean residual of every pose and order as a coloured table.
fn pose_order_map(light: &LightReport) -> Markup {
    const CELL: (f64, f64) = (64.0, 19.0);
    const NAMES: f64 = 128.0;
    let orders: Vec<i8> = order_sums(light).iter().map(|sum| sum.order).collect();
    let mut poses: Vec<&str> = Vec::new();
    for residual in &light.residuals {
        if !poses.contains(&residual.pose.as_str()) {
            poses.push(&residual.pose);
        }
    }
    let largest = light.residuals.iter().map(|r| r.mean_px.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let (width, height) = (NAMES + CELL.0 * orders.len() as f64, CELL.1 * (poses.len() + 1) as f64 + 4.0);
    let svg = html! {
        svg viewBox=(format!("0 0 {width:.0} {height:.0}")) role="img" {
            @for (idx, order) in orders.iter().enumerate() {
                text x=(NAMES + CELL.0 * (idx as f64 + 0.5)) y="13" text-anchor="middle" { (order_name(*order)) }
            }
            @for (row, pose) in poses.iter().enumerate() {
                @let y = CELL.1 * (row + 1) as f64;
                @let base = tenths(y + 13.5);
                text x=(NAMES - 8.0) y=(base) text-anchor="end" { (pose) }
                @for residual in light.residuals.iter().filter(|residual| residual.pose == *pose) {
                    @if let Some(column) = orders.iter().position(|order| *order == residual.order) {
                        @let x = NAMES + CELL.0 * column as f64;
                        @let opacity = format!("{:.3}", residual.mean_px.abs() / largest * 0.75);
                        rect class=(if residual.mean_px < 0.0 { "cold" } else { "hot" }) x=(tenths(x)) y=(tenths(y))
                            width=(CELL.0 - 2.0) height=(CELL.1 - 2.0) opacity=(opacity) {}
                        text.ink x=(tenths(x + CELL.0 / 2.0)) y=(base) text-anchor="middle" {
                            (format!("{:+.3}", residual.mean_px))
                        }
                    }
                }
            }
        }
    };
    figure(
        svg,
        "Mean residual in px of every pose (rows) and order (columns). A row of one colour indicates a moved board.",
    )
}
