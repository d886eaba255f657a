//! The covariance as a picture: which parameters the data can tell apart.

use std::fmt::Write as _;

use optics::Calibration;

use crate::drawing::html::{Html, html};
use crate::drawing::page::figure;

/// Side of a cell in SVG units.
const CELL: f64 = 17.0;

/// Room for names.
const NAMES: f64 = 172.0;

/// Correlation from which two parameters are hardly told apart.
const STRONG: f64 = 0.98;

/// The correlation matrix, coloured by sign and strength.
pub fn content(calibration: &Calibration) -> Html {
    let names = calibration.parameter_names();
    let covariance = &calibration.covariance;
    let n = names.len().min(covariance.nrows());
    let side = NAMES + CELL * n as f64 + 4.0;
    let mut cells = Html::default();
    let mut strongest: Vec<(f64, usize, usize)> = Vec::new();
    for row in 0..n {
        let at = NAMES + CELL * (row as f64 + 0.75);
        cells += html!(
            "<text x={edge:.0} y={at:.1} text-anchor=end>{name}</text>\
             <text transform=\"translate({at:.1} {edge:.0}) rotate(-90)\">{name}</text>",
            edge = NAMES - 6.0,
            at = at,
            name = names[row],
        );
        for column in 0..n {
            let correlation =
                correlation(covariance[(row, row)], covariance[(column, column)], covariance[(row, column)]);
            if column < row && correlation.abs() > STRONG {
                strongest.push((correlation, row, column));
            }
            let class = if correlation < 0.0 { "cold" } else { "hot" };
            cells += html!(
                "<rect class={class} x={x:.1} y={y:.1} width={side:.1} height={side:.1} opacity={opacity:.3}>\
                 <title>{row} · {column}: {correlation:+.3}</title></rect>",
                class = class,
                x = NAMES + CELL * column as f64,
                y = NAMES + CELL * row as f64,
                side = CELL - 1.5,
                opacity = correlation.abs().max(0.04),
                row = names[row],
                column = names[column],
                correlation = correlation,
            );
        }
    }
    let svg = html!(
        "<svg viewBox=\"0 0 {side:.0} {side:.0}\" role=img style=\"max-width:760px\">{cells}</svg>",
        side = side,
        cells = cells,
    );
    figure(svg, &caption(&names, &mut strongest))
}

fn correlation(row_variance: f64, column_variance: f64, covariance: f64) -> f64 {
    let scale = (row_variance * column_variance).sqrt();
    if scale > 0.0 { (covariance / scale).clamp(-1.0, 1.0) } else { 0.0 }
}

fn caption(names: &[String], strongest: &mut [(f64, usize, usize)]) -> String {
    let mut caption =
        "Correlation of all parameters, orange positive, blue negative; a fixed parameter is blank.".to_owned();
    strongest.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    if let Some((correlation, row, column)) = strongest.first() {
        let _ = write!(
            caption,
            " Strongest: {} with {} ({correlation:+.4}): only their combination is well known, which is all a measurement needs.",
            names[*row], names[*column]
        );
    }
    caption
}
