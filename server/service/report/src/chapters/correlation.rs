//! The correlation matrix as an image: which parameters the data can separate.

use std::fmt::Write as _;

use maud::{Markup, html};
use optics::Calibration;

use crate::drawing::page::figure;
use crate::drawing::plot::tenths;

/// Side of a cell in SVG units.
const CELL: f64 = 17.0;

/// Room for names.
const NAMES: f64 = 172.0;

/// Correlation from which two parameters are hardly separable.
const STRONG: f64 = 0.98;

/// The correlation matrix, coloured by sign and strength.
pub fn content(calibration: &Calibration) -> Markup {
    let names = calibration.parameter_names();
    let covariance = &calibration.covariance;
    let n = names.len().min(covariance.nrows());
    let side = NAMES + CELL * n as f64 + 4.0;
    let between = |row: usize, column: usize| {
        correlation(covariance[(row, row)], covariance[(column, column)], covariance[(row, column)])
    };
    let below_diagonal = (0..n).flat_map(|row| (0..row).map(move |column| (row, column)));
    let mut strongest: Vec<(f64, usize, usize)> = below_diagonal
        .map(|(row, column)| (between(row, column), row, column))
        .filter(|(correlation, ..)| correlation.abs() > STRONG)
        .collect();
    let edge = NAMES - 6.0;
    let svg = html! {
        svg viewBox=(format!("0 0 {side:.0} {side:.0}")) role="img" style="max-width:760px" {
            @for row in 0..n {
                @let at = tenths(NAMES + CELL * (row as f64 + 0.75));
                text x=(edge) y=(at) text-anchor="end" { (names[row]) }
                text transform={ "translate(" (at) " " (edge) ") rotate(-90)" } { (names[row]) }
                @for column in 0..n {
                    @let correlation = between(row, column);
                    @let opacity = format!("{:.3}", correlation.abs().max(0.04));
                    rect class=(if correlation < 0.0 { "cold" } else { "hot" }) x=(tenths(NAMES + CELL * column as f64))
                        y=(tenths(NAMES + CELL * row as f64)) width=(CELL - 1.5) height=(CELL - 1.5) opacity=(opacity) {
                        title { (names[row]) " · " (names[column]) (format!(": {correlation:+.3}")) }
                    }
                }
            }
        }
    };
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
            " Strongest: {} with {} ({correlation:+.4}): only their combination is well determined, which is sufficient for measurements.",
            names[*row], names[*column]
        );
    }
    caption
}
