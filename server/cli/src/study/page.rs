//! The report of the study: the claim of the paper, the limits of plane models, the effect of corner noise on the bound.

use crate::study::paper::{GRATING_TILTS_DEG, ModelErrors, PaperStudy};
use crate::study::table::study_text;

use maud::{Markup, html};
use report::page::{Page, Tile, figure, grid, legend};
use report::plot::{Axis, Plot, bars};

/// One colour per model, from Okabe and Ito.
const MODEL_COLOURS: [(&str, &str); 3] = [("planes", "#D55E00"), ("pencil", "#E69F00"), ("grating", "#0072B2")];

/// Size of the plots, SVG units.
const PLOT_WIDTH: f64 = 380.0;
/// Size of the plots, SVG units.
const PLOT_HEIGHT: f64 = 240.0;

/// The report as an HTML page.
pub fn study_page(study: &PaperStudy) -> String {
    let lead =
        "Simulated stations with ground truth: depth RMSE over the working volume with the three light models.";
    let mut page = Page::new("Study: the paper's regime", lead);
    if let Some(row) = study.claim.first() {
        let ratio = row.errors.pencil_mm / row.errors.planes_mm;
        page.tiles(&[
            Tile::new(format!("{ratio:.3}"), "pencil / planes, 3 poses", "the paper reports 0.624"),
            Tile::new(
                format!("{:.3}", row.errors.grating_mm / row.errors.planes_mm),
                "grating / planes, 3 poses",
                "",
            ),
            Tile::new(
                format!("{:.2}", row.errors.grating_mm / row.bound_mm),
                "grating / Cramér–Rao bound",
                "over these seeds; at least 1 on average for unbiased estimates",
            ),
        ]);
    }
    page.section("The claim", "Narrow field, normal incidence, coarse centrelines.", claim(study));
    page.section(
        "Limits of plane models",
        "In wide fields the outer light sheets are curved, which planes cannot represent.",
        fields(study),
    );
    page.section(
        "Corner noise and the bound",
        "If the camera is estimated as well, corner noise limits the accuracy.",
        corners(study),
    );
    page.section("Tables", "The same figures as text.", html! { pre { (study_text(study)) } });
    page.finish()
}

fn claim(study: &PaperStudy) -> Markup {
    let figures: Vec<Markup> = study
        .claim
        .iter()
        .map(|row| {
            let entries: Vec<(String, f64)> = [
                ("planes", row.errors.planes_mm),
                ("pencil", row.errors.pencil_mm),
                ("grating", row.errors.grating_mm),
                ("bound", row.bound_mm),
            ]
            .map(|(name, mm)| (name.to_owned(), 1e3 * mm))
            .to_vec();
            figure(bars(&entries, "µm", 1, |idx| idx == 2), &format!("{} poses", row.n_poses))
        })
        .collect();
    grid(&figures)
}

fn fields(study: &PaperStudy) -> Markup {
    let keys: Vec<(String, String)> =
        MODEL_COLOURS.iter().map(|(name, colour)| ((*name).to_owned(), (*colour).to_owned())).collect();
    let figures: Vec<Markup> = GRATING_TILTS_DEG
        .iter()
        .map(|tilt| {
            let mut plot = Plot::new(
                Axis::new(10.0, 105.0, "field half-width, mm"),
                Axis::new(0.0, 3.0, "depth RMSE, log₁₀ µm"),
                PLOT_WIDTH,
                PLOT_HEIGHT,
            );
            for (idx, (_, colour)) in MODEL_COLOURS.iter().enumerate() {
                let points: Vec<(f64, f64)> = study
                    .field
                    .iter()
                    .filter(|row| row.grating_tilt_deg == *tilt)
                    .map(|row| (row.field_half_width_mm, log_um(of_model(&row.errors, idx))))
                    .collect();
                plot.line(&points, &format!("stroke:{colour};stroke-width:2"));
                plot.dots(points.iter().copied(), 6.0, &format!("stroke:{colour}"));
            }
            figure(plot.svg(), &format!("grating tilted by {tilt}°"))
        })
        .collect();
    html! { (legend(&keys)) (grid(&figures)) }
}

fn corners(study: &PaperStudy) -> Markup {
    let largest = study.corners.iter().map(|row| row.grating_mm.max(row.bound_mm)).fold(0.0, f64::max);
    let mut plot = Plot::new(
        Axis::new(0.0, 0.05, "corner noise per axis, px"),
        Axis::new(0.0, 1.1e3 * largest, "depth RMSE, µm"),
        PLOT_WIDTH,
        PLOT_HEIGHT,
    );
    let bound: Vec<(f64, f64)> =
        study.corners.iter().map(|row| (row.corner_sigma_px, 1e3 * row.bound_mm)).collect();
    plot.line(&bound, "stroke:#888;stroke-width:2;stroke-dasharray:5 4");
    let grating = study.corners.iter().map(|row| (row.corner_sigma_px, 1e3 * row.grating_mm));
    plot.dots(grating, 8.0, &format!("stroke:{}", MODEL_COLOURS[2].1));
    figure(plot.svg(), "dots: the joint fit; dashed: the Cramér–Rao bound")
}

fn of_model(errors: &ModelErrors, idx: usize) -> f64 {
    [errors.planes_mm, errors.pencil_mm, errors.grating_mm][idx]
}

fn log_um(mm: f64) -> f64 {
    (1e3 * mm).log10()
}
