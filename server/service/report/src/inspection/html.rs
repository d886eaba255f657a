//! The report of an inspection as HTML.

use maud::{Markup, html};
use pipeline::Failure;
use scanning::Cloud;

use super::{ABOUT_COLUMNS, ABOUT_MAP, COLUMNS, InspectionSheet, SIMULATED, VERDICTS};
use crate::comparison::add_sections;
use crate::drawing::cloud_view::CloudView;
use crate::drawing::page::{Page, Tile, grid, sentence, table, verdict};

/// The report; without the cloud if it was deleted.
///
/// # Errors
/// An image cannot be encoded.
pub fn inspection_page(sheet: &InspectionSheet, cloud: Option<&Cloud>) -> Result<String, Failure> {
    let lead = format!("Part {}, inspection {} ({}).", sheet.serial, sheet.seq, sheet.id);
    let mut page = Page::new(&format!("Inspection of {}", sheet.serial), &lead);
    page.tiles(&tiles(sheet));
    page.section("Characteristics", ABOUT_COLUMNS, rows(sheet));
    page.section(
        "Verdicts",
        "By ISO 14253-1. The verdict on the part is the worst on its characteristics, in the order of this table.",
        meanings(),
    );
    if let Some(cloud) = cloud {
        if let Some(map) = sheet.deviation_map(cloud) {
            page.section("Deviations", ABOUT_MAP, map.figure("From above, as the camera sees it.")?);
        }
        for compared in &sheet.comparisons {
            add_sections(&mut page, &compared.title(), cloud, &compared.comparison)?;
        }
        let view = CloudView::new(cloud);
        let views = [view.top_view()?, view.side_views()];
        let about = format!("{} points. Heights are distances from the dominant plane.", cloud.points.len());
        page.section("Cloud", &about, grid(&views));
    }
    let facts: Vec<Vec<String>> =
        sheet.facts.iter().map(|(name, value)| vec![(*name).to_owned(), value.clone()]).collect();
    page.section("Provenance", "", table(&["", ""], &facts, |_| false));
    Ok(page.finish())
}

fn tiles(sheet: &InspectionSheet) -> [Tile; 2] {
    let n_within =
        sheet.characteristics.iter().filter(|row| row.verdict == Some(metrology::PartVerdict::Ok)).count();
    [
        Tile::new(sheet.verdict.label(), "verdict", "the worst of all characteristics; accept only OK"),
        Tile::new(
            format!("{n_within} of {}", sheet.characteristics.len()),
            "characteristics OK",
            "within the limits by the expanded uncertainty or more",
        ),
    ]
}

fn rows(sheet: &InspectionSheet) -> Markup {
    let rows: Vec<Vec<String>> = sheet.characteristics.iter().map(|row| row.cells().to_vec()).collect();
    let is_bad = |idx: usize| sheet.characteristics[idx].verdict != Some(metrology::PartVerdict::Ok);
    html! {
        @if sheet.simulated { (verdict(SIMULATED)) }
        (table(&COLUMNS, &rows, is_bad))
        @for row in &sheet.characteristics {
            @if let Some(reason) = &row.reason { p { (row.id) ": " (sentence(reason)) } }
        }
    }
}

fn meanings() -> Markup {
    let rows: Vec<Vec<String>> = VERDICTS
        .iter()
        .map(|(verdict, meaning)| vec![verdict.label().to_owned(), (*meaning).to_owned()])
        .collect();
    table(&["verdict", "meaning"], &rows, |_| false)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::inspection::example;

    #[test]
    fn the_page_states_verdict_rows_and_reasons_and_escapes_user_input() {
        let page = inspection_page(&example(), None).unwrap();
        for text in [
            "NOT OK",
            "1 of 3",
            "8.9123",
            "BL-0042 &amp; co",
            "No plane &lt;top&gt; was found",
            "bracket@7",
            SIMULATED,
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("BL-0042 & co") && !page.contains("<top>"));
    }
}
