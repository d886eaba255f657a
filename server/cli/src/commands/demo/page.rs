//! The report of the demo: the three models compared with the ground truth, then details of the best one.

use capture::Capture;
use maud::{Markup, html};

use crate::commands::demo::Trial;
use crate::inputs::photographs::{Photograph, SOURCE};
use pipeline::Failure;
use pipeline::Features;
use report::calibration::calibration_sections;
use report::labelled_images::thumbnail;
use report::measurement;
use report::page::{Page, Tile, figure, gallery, table, verdict};
use report::plot::bars;
use report::scan::scan_section;

/// The page of a demo.
pub fn demo_page(
    capture: &Capture,
    features: &Features,
    trials: &[Trial],
    best: &Trial,
    photographs: &[Photograph],
) -> Result<String, Failure> {
    let lead = "A simulated station with ground truth, calibrated with three light models from the same images; two parts \
                scanned and measured.";
    let mut page = Page::new("Sheaf demo", lead);
    page.tiles(&tiles(best));
    page.section(
        "Three light models compared with the truth",
        "Systematic error: noise-free pixels triangulated with each calibration, compared with the true depth of the \
         simulation.",
        comparison(trials, best),
    );
    for part in &best.parts {
        scan_section(&mut page, capture, &part.name, &part.scan)?;
        page.section(
            &format!("Measured: {}", part.name),
            &format!("With the model {}.", best.kind),
            measurement::content(&part.measurement),
        );
    }
    photograph_section(&mut page, photographs)?;
    let introduction = format!("With the model {}, recommended by cross-validation.", best.kind);
    page.section("Calibration", &introduction, Markup::default());
    calibration_sections(&mut page, capture, features, &best.calibrated.result)?;
    Ok(page.finish())
}

fn photograph_section(page: &mut Page, photographs: &[Photograph]) -> Result<(), Failure> {
    if photographs.is_empty() {
        return Ok(());
    }
    let introduction = format!(
        "Laser lines detected in photographs of a real scanner in a lit room, after subtraction of a laser-off image. \
         {SOURCE}"
    );
    let images: Vec<Markup> = photographs
        .iter()
        .map(|photograph| thumbnail(&photograph.overlay, &photograph.caption))
        .collect::<Result<_, Failure>>()?;
    page.section("Photographs", &introduction, gallery(&images));
    Ok(())
}

fn tiles(best: &Trial) -> Vec<Tile> {
    let mut tiles = vec![Tile::new(
        format!("{:.1} µm", best.systematic_rmse_mm * 1e3),
        "systematic depth error",
        format!("RMS deviation from the truth, with {}", best.kind),
    )];
    tiles.extend(best.parts.iter().map(|part| {
        let measurement = &part.measurement;
        Tile::new(
            format!("{:.4} {}", measurement.value, measurement.unit.symbol()),
            &format!("{}: {}", part.name, measurement.tool),
            format!(
                "nominal {:.4}, U = {:.4} {} (k = 2)",
                measurement.nominal.unwrap_or(0.0),
                measurement.expanded_uncertainty,
                measurement.unit.symbol()
            ),
        )
    }));
    tiles
}

fn comparison(trials: &[Trial], best: &Trial) -> Markup {
    let rows: Vec<Vec<String>> = trials
        .iter()
        .map(|trial| {
            let mut row = vec![trial.kind.name().to_owned(), format!("{:.1}", trial.systematic_rmse_mm * 1e3)];
            row.extend(trial.parts.iter().map(|part| {
                format!(
                    "{:+.1} ± {:.1}",
                    part.measurement.error.unwrap_or(0.0) * 1e3,
                    part.measurement.expanded_uncertainty * 1e3
                )
            }));
            row
        })
        .collect();
    let mut head = vec!["model".to_owned(), "systematic depth RMSE, µm".to_owned()];
    head.extend(best.parts.iter().map(|part| format!("{}: error ± U, µm", part.name)));
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let entries: Vec<(String, f64)> =
        trials.iter().map(|trial| (trial.kind.name().to_owned(), trial.systematic_rmse_mm * 1e3)).collect();
    let marked = |idx: usize| trials[idx].kind == best.kind;
    let worst = trials.iter().map(|trial| trial.systematic_rmse_mm).fold(0.0, f64::max);
    let sentence = format!(
        "Systematic depth error {:.0} µm with {}, up to {:.0} µm with the others.",
        best.systematic_rmse_mm * 1e3,
        best.kind,
        worst * 1e3
    );
    html! {
        (verdict(&sentence))
        (table(&head, &rows, marked))
        (figure(bars(&entries, "µm", 1, marked), "Systematic depth error, RMS deviation from the truth."))
    }
}
