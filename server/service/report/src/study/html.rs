//! The report of a study as HTML.

use maud::{Markup, html};

use super::{SIMULATED, SheetChart, SheetTable, StudySheet};
use crate::drawing::page::{Page, Tile, figure, grid, sentence, table, verdict};
use crate::drawing::plot::{Axis, Plot};

/// Size of a chart, SVG units.
const CHART: (f64, f64) = (420.0, 170.0);

/// The report.
pub fn study_page(sheet: &StudySheet) -> String {
    let mut page = Page::new(&sheet.title(), "Fitness of the station for its measurements.");
    let remark = if sheet.missing.is_empty() { "the worst of all criteria" } else { "the study is not complete" };
    page.tiles(&[Tile::new(sheet.verdict_label(), "verdict", remark)]);
    page.section("Criteria", "", criteria(sheet));
    for one in &sheet.tables {
        page.section(&one.title, &one.about, rows(one));
    }
    if !sheet.charts.is_empty() {
        let charts: Vec<Markup> = sheet.charts.iter().map(chart).collect();
        page.section("Charts", "Dashed: limits, or the reference value.", grid(&charts));
    }
    let facts: Vec<Vec<String>> =
        sheet.facts.iter().map(|(name, value)| vec![(*name).to_owned(), value.clone()]).collect();
    page.section("Provenance", "", table(&["", ""], &facts, |_| false));
    page.finish()
}

fn criteria(sheet: &StudySheet) -> Markup {
    html! {
        @if sheet.simulated { (verdict(SIMULATED)) }
        @for missing in &sheet.missing { (verdict(&sentence(missing))) }
        @for criterion in &sheet.criteria { p { (sentence(criterion)) "." } }
    }
}

fn rows(sheet: &SheetTable) -> Markup {
    table(&sheet.head, &sheet.rows, |idx| sheet.marked.contains(&idx))
}

fn chart(chart: &SheetChart) -> Markup {
    let all = chart.values.iter().chain(&chart.rules).copied();
    let x = Axis::new(0.5, chart.values.len() as f64 + 0.5, chart.x);
    let mut plot = Plot::new(x, Axis::around(all, &chart.y), CHART.0, CHART.1);
    for rule in &chart.rules {
        plot.rule_at(*rule);
    }
    let points: Vec<(f64, f64)> =
        chart.values.iter().enumerate().map(|(idx, value)| (idx as f64 + 1.0, *value)).collect();
    plot.line(&points, "stroke:var(--accent);opacity:.4");
    plot.dots(points.into_iter(), 6.0, "stroke:var(--accent)");
    figure(plot.svg(), &chart.title)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::example;

    #[test]
    fn the_page_states_verdict_criteria_and_tables_and_escapes_user_input() {
        let page = study_page(&example());
        for text in [
            "NOT OK",
            "after service &amp; move",
            "ball &lt;7&gt;",
            "83.1",
            "Each error is at most its limit",
            SIMULATED,
            "<svg",
        ] {
            assert!(page.contains(text), "{text}");
        }
        assert!(!page.contains("ball <7>"));
    }

    #[test]
    fn an_incomplete_study_says_what_is_missing_and_has_no_verdict() {
        let sheet = StudySheet { verdict: None, missing: vec!["3 more positions".to_owned()], ..example() };
        let page = study_page(&sheet);
        assert!(page.contains("NOT COMPLETE") && page.contains("3 more positions"));
        assert!(page.contains("the study is not complete"));
    }
}
