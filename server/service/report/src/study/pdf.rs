//! The report of a study as PDF.

use metrology::PartVerdict;

use super::{SIMULATED, SheetChart, SheetTable, StudySheet};
use crate::drawing::paper::Font;
use crate::drawing::writer::{
    BLACK, GREY, MARGIN_MM, ROW_MM, RULE, TABLE_PT, TEXT_CHARS, Writer, colour, wrapped,
};

const ACCENT: [f32; 3] = [0.0, 0.35, 0.6];

/// Characters of a row across the page.
const ROW_CHARS: usize = 108;

/// Size of a chart and of its dots, mm.
const CHART_MM: (f32, f32) = (150.0, 40.0);
const DOT_MM: f32 = 1.2;

/// Width of the numbers beside a chart, mm.
const SCALE_MM: f32 = 20.0;

/// The report.
pub fn study_pdf(sheet: &StudySheet) -> Vec<u8> {
    let mut writer = Writer::default();
    write_heading(&mut writer, sheet);
    for table in &sheet.tables {
        write_table(&mut writer, table);
    }
    for chart in &sheet.charts {
        write_chart(&mut writer, chart);
    }
    for (name, value) in &sheet.facts {
        writer.fact(38.0, name, value);
    }
    writer.paper.finish(&sheet.title())
}

fn write_heading(writer: &mut Writer, sheet: &StudySheet) {
    writer.verdict(52.0, sheet.verdict.map_or(GREY, colour), sheet.verdict_label());
    writer.line(Font::HelveticaBold, 16.0, BLACK, 7.0, sheet.kind);
    writer.line(Font::Helvetica, 11.0, BLACK, 9.0, &sheet.name);
    if sheet.simulated {
        writer.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 6.0, SIMULATED);
    }
    for missing in &sheet.missing {
        writer.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 5.0, missing);
    }
    for line in sheet.criteria.iter().flat_map(|criterion| wrapped(criterion, TEXT_CHARS)) {
        writer.line(Font::Helvetica, 8.5, BLACK, 4.2, &line);
    }
    writer.y_mm += 4.0;
}

fn write_table(writer: &mut Writer, table: &SheetTable) {
    writer.ensure_room(14.0 + 2.0 * ROW_MM);
    writer.line(Font::HelveticaBold, 10.5, BLACK, 4.6, &table.title);
    for line in wrapped(&table.about, TEXT_CHARS) {
        writer.line(Font::Helvetica, 8.0, GREY, 4.4, &line);
    }
    writer.y_mm += 1.0;
    let head: Vec<String> = table.head.iter().map(|name| (*name).to_owned()).collect();
    let widths = widths(&head, &table.rows);
    let is_number = |idx: usize| idx > 0;
    writer.row(&head, &widths, is_number, GREY);
    for (idx, row) in table.rows.iter().enumerate() {
        let shown = if table.marked.contains(&idx) { colour(PartVerdict::NotOk) } else { BLACK };
        writer.row(row, &widths, is_number, shown);
    }
    writer.y_mm += 4.0;
}

fn write_chart(writer: &mut Writer, chart: &SheetChart) {
    let (width, height) = CHART_MM;
    let all = || chart.values.iter().chain(&chart.rules).copied().filter(|value| value.is_finite());
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    if low > high {
        return;
    }
    let span = if high > low { high - low } else { 1.0 };
    writer.ensure_room(height + 14.0);
    writer.line(Font::HelveticaBold, 10.5, BLACK, 4.0, &format!("{}, {}", chart.title, chart.y));
    let (left, top) = (MARGIN_MM + SCALE_MM, writer.y_mm);
    let y_of = |value: f64| top + height - ((value - low) / span) as f32 * height;
    for value in [low, high] {
        let place = [MARGIN_MM, y_of(value) + 1.0];
        writer.paper.text(place, Font::Courier, TABLE_PT, GREY, &format!("{value:.2}"));
    }
    for edge in [low, high] {
        writer.paper.rectangle([left, y_of(edge), width, 0.15], RULE);
    }
    for rule in &chart.rules {
        writer.paper.rectangle([left, y_of(*rule), width, 0.3], colour(PartVerdict::NotOk));
    }
    let step = width / chart.values.len().max(1) as f32;
    for (idx, value) in chart.values.iter().enumerate() {
        let x_mm = left + (idx as f32 + 0.5) * step - DOT_MM / 2.0;
        writer.paper.rectangle([x_mm, y_of(*value) - DOT_MM / 2.0, DOT_MM, DOT_MM], ACCENT);
    }
    writer.y_mm = top + height + 8.0;
}

/// Widths of the columns in characters: as wide as their widest cell, the first shortened so that all fit on the page.
fn widths(head: &[String], rows: &[Vec<String>]) -> Vec<usize> {
    let width = |idx: usize| {
        let cells = rows.iter().filter_map(|row| row.get(idx)).chain(head.get(idx));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let mut widths: Vec<usize> = (0..head.len()).map(width).collect();
    let all: usize = widths.iter().map(|width| width + 1).sum();
    if let Some(first) = widths.first_mut() {
        *first = first.saturating_sub(all.saturating_sub(ROW_CHARS)).max(1);
    }
    widths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::example;

    #[test]
    fn the_document_states_verdict_criteria_and_tables() {
        let bytes = study_pdf(&example());
        let text = String::from_utf8_lossy(&bytes);
        for words in ["(NOT OK)", "(83.1)", "(after service & move)", "(ball <7>)", "(Results)"] {
            assert!(text.contains(words), "{words}: {text}");
        }
        assert!(text.contains("/Count 1"));
    }

    #[test]
    fn a_long_first_column_gives_way_to_the_others() {
        let head = ["scan", "range"].map(str::to_owned);
        let rows = vec![vec!["x".repeat(200), "1234.56".to_owned()]];
        assert_eq!(widths(&head, &rows), [ROW_CHARS - 9, 7]);
    }

    #[test]
    fn many_rows_continue_on_the_next_page() {
        let mut sheet = example();
        sheet.tables[0].rows = vec![vec!["row".to_owned(), "1".to_owned(), "OK".to_owned()]; 120];
        let text = String::from_utf8_lossy(&study_pdf(&sheet)).into_owned();
        assert!(text.contains("/Count 3"), "{text}");
    }
}
