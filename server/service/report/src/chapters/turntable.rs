//! The chapter on a turntable: its axis, and deviations of the boards from a pure rotation.

use calibration::AxisReport;
use maud::{Markup, html};

use crate::drawing::page::{figure, grid, legend, table};
use crate::drawing::plot::{Axis, Plot};

/// Names and colours of the three deviations.
const DEVIATIONS: [(&str, &str); 3] =
    [("along the turn", "#0072B2"), ("radial", "#E69F00"), ("along the axis", "#009E73")];

/// Table and plot of the deviations.
pub fn content(axis: &AxisReport) -> Markup {
    let mut rows: Vec<Vec<String>> = ["x", "y", "z"]
        .iter()
        .zip(axis.point_mm.iter().zip(axis.direction))
        .map(|(name, (point, direction))| {
            vec![(*name).to_owned(), format!("{point:+.4}"), format!("{direction:+.6}")]
        })
        .collect();
    let [first, second] = [0, 1].map(|i| (axis.shift_sigma_mm[i], axis.tilt_sigma_deg[i]));
    for (name, (shift_mm, tilt_deg)) in [("σ, first direction", first), ("σ, second direction", second)] {
        rows.push(vec![name.to_owned(), format!("{shift_mm:.4}"), format!("{tilt_deg:.4}°")]);
    }
    let keys: Vec<(String, String)> =
        DEVIATIONS.iter().map(|(name, colour)| ((*name).to_owned(), (*colour).to_owned())).collect();
    html! {
        (table(&["axis, camera frame", "point, mm", "direction"], &rows, |_| false))
        (legend(&keys))
        (grid(&[deviations(axis)]))
    }
}

fn deviations(axis: &AxisReport) -> Markup {
    let views = &axis.deviations_um;
    let largest = views.iter().flat_map(|view| &view[1..]).map(|value| value.abs()).fold(1.0, f64::max);
    let x = Axis::around(views.iter().map(|view| view[0]), "nominal angle, °");
    let mut plot = Plot::new(x, Axis::symmetric(largest * 1.2, "deviation, µm"), 640.0, 180.0);
    plot.rule_at(0.0);
    for (idx, (_, colour)) in DEVIATIONS.iter().enumerate() {
        let points: Vec<(f64, f64)> = views.iter().map(|view| (view[0], view[idx + 1])).collect();
        plot.line(&points, &format!("stroke:{colour};stroke-width:1.5"));
        plot.dots(points.iter().copied(), 6.0, &format!("stroke:{colour}"));
    }
    figure(plot.svg(), "Deviation of the board centre from a pure rotation.")
}
