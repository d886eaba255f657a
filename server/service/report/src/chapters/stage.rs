//! The chapter on the stage: direction, scale, straightness, tilt.

use calibration::StageReport;
use maud::{Markup, html};

use crate::drawing::page::{figure, grid, legend, table};
use crate::drawing::plot::{Axis, Plot};

/// Names and colours of the three deviations, and of the axes of the three rotations.
const DEVIATIONS: [(&str, &str); 3] =
    [("along the travel", "#0072B2"), ("across, first", "#E69F00"), ("across, second", "#009E73")];

/// Table, and plots of straightness and tilt.
pub fn content(stage: &StageReport) -> Markup {
    let rows: Vec<Vec<String>> = ["x", "y", "z"]
        .iter()
        .zip(stage.direction)
        .zip(stage.sigma)
        .map(|((name, value), sigma)| vec![(*name).to_owned(), format!("{value:+.6}"), format!("{sigma:.6}")])
        .collect();
    let keys: Vec<(String, String)> =
        DEVIATIONS.iter().map(|(name, colour)| ((*name).to_owned(), (*colour).to_owned())).collect();
    html! {
        (table(&["travel per mm, camera frame", "value", "σ"], &rows, |_| false))
        (legend(&keys))
        (grid(&[
            by_view(&stage.straightness_um, "deviation, µm", "Deviation of the board from straight and even travel."),
            by_view(&stage.tilt_urad, "rotation, µrad", "Rotation of the board about these axes, from its mean."),
        ]))
    }
}

fn by_view(views: &[[f64; 4]], label: &'static str, caption: &str) -> Markup {
    let largest = views.iter().flat_map(|view| &view[1..]).map(|value| value.abs()).fold(1.0, f64::max);
    let x = Axis::around(views.iter().map(|view| view[0]), "nominal position, mm");
    let mut plot = Plot::new(x, Axis::symmetric(largest * 1.2, label), 640.0, 180.0);
    plot.rule_at(0.0);
    for (axis, (_, colour)) in DEVIATIONS.iter().enumerate() {
        let points: Vec<(f64, f64)> = views.iter().map(|view| (view[0], view[axis + 1])).collect();
        plot.line(&points, &format!("stroke:{colour};stroke-width:1.5"));
        plot.dots(points.iter().copied(), 6.0, &format!("stroke:{colour}"));
    }
    figure(plot.svg(), caption)
}
