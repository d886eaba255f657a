//! The report of a comparison with CAD data: statistics, the map of deviations, the worst places.

use maud::{Markup, html};
use metrology::Comparison;
use pipeline::Failure;
use scanning::Cloud;

use crate::drawing::deviation_map::{DeviationMap, microns};
use crate::drawing::page::{Page, Tile, sentence, table};

/// The report.
///
/// # Errors
/// The map cannot be encoded.
pub fn comparison_page(part: &str, cloud: &Cloud, comparison: &Comparison) -> Result<String, Failure> {
    let lead = "Signed distances of the points of a cloud from the nominal surface of the part.";
    let mut page = Page::new(&format!("Comparison with {part}"), lead);
    page.tiles(&tiles(comparison));
    add_sections(&mut page, "Deviations", cloud, comparison)?;
    Ok(page.finish())
}

/// The map under a title, the worst places, the notes.
///
/// # Errors
/// The map cannot be encoded.
pub(crate) fn add_sections(
    page: &mut Page,
    title: &str,
    cloud: &Cloud,
    comparison: &Comparison,
) -> Result<(), Failure> {
    if let Some(map) = DeviationMap::new(cloud, &comparison.deviations_mm) {
        page.section(title, &numbers(comparison), map.figure(ABOUT_MAP)?);
    }
    page.section("Worst places", ABOUT_WORST, worst(comparison));
    let notes = html! { @for note in &comparison.notes { p { (sentence(note)) "." } } };
    page.section("Notes", "", notes);
    Ok(())
}

/// What the map shows.
pub(crate) const ABOUT_MAP: &str = "From above, as the camera sees it. Red: outside the surface; blue: inside.";

/// What the worst places are.
const ABOUT_WORST: &str = "Means over cells of the surface, in the frame of the CAD data, with U (k = 2).";

fn tiles(comparison: &Comparison) -> Vec<Tile> {
    let statistics = &comparison.statistics;
    let verdict = comparison.tolerance_mm.zip(comparison.verdict).map(|(tolerance_mm, verdict)| {
        let out_mm2 = statistics.out_of_tolerance_mm2.unwrap_or(0.0);
        let remark = format!("tolerance ±{tolerance_mm} mm by ISO 14253-1; {out_mm2:.1} mm² out of it");
        Tile::new(verdict.label(), "verdict", remark)
    });
    let covered_percent = 100.0 * statistics.covered_mm2 / statistics.area_mm2;
    let [low, _, high] = statistics.percentiles_mm;
    let figures = [
        Tile::new(format!("{:.1} µm", 1000.0 * statistics.rms_mm), "RMS", "weighted by area"),
        Tile::new(
            format!("{} … {}", microns(low), microns(high)),
            "95 % of the surface",
            "percentiles 2.5 % and 97.5 %",
        ),
        Tile::new(
            format!("{covered_percent:.1} %"),
            "covered",
            format!("of {:.0} mm²; the verdict concerns this part", statistics.area_mm2),
        ),
    ];
    verdict.into_iter().chain(figures).collect()
}

/// How many points were compared, and the fit.
pub(crate) fn numbers(comparison: &Comparison) -> String {
    let statistics = &comparison.statistics;
    let fitted = comparison
        .fit_rms_mm
        .map_or_else(String::new, |rms_mm| format!(" Aligned by best fit, RMS {:.1} µm.", 1000.0 * rms_mm));
    format!(
        "{} points; {} too far away to be compared, in grey as those without a surface.{fitted}",
        statistics.n_points, statistics.n_beyond
    )
}

fn worst(comparison: &Comparison) -> Markup {
    let rows: Vec<Vec<String>> = comparison
        .worst
        .iter()
        .map(|place| {
            let [x, y, z] = place.at_mm.map(|mm| format!("{mm:.2}"));
            let deviation = format!("{:+.4}", place.deviation_mm);
            vec![deviation, format!("{:.4}", place.expanded_uncertainty_mm), x, y, z, place.n_points.to_string()]
        })
        .collect();
    table(&["deviation, mm", "U, mm", "x, mm", "y, mm", "z, mm", "points"], &rows, |_| false)
}
