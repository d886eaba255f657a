//! The report of a study as PDF.

use metrology::PartVerdict;

use super::{SIMULATED, SheetChart, SheetTable, StudySheet};
use crate::inspection::paper::{COURIER_ADVANCE, Font, HEIGHT_MM, Paper, WIDTH_MM};

const MARGIN_MM: f32 = 18.0;
const BLACK: [f32; 3] = [0.1, 0.1, 0.12];
const GREY: [f32; 3] = [0.4, 0.4, 0.43];
const RULE: [f32; 3] = [0.82, 0.82, 0.84];
const ACCENT: [f32; 3] = [0.0, 0.35, 0.6];

/// Font size of tables, points, and their row height, mm.
const TABLE_PT: f32 = 7.5;
const ROW_MM: f32 = 4.6;

/// Characters of a row across the page.
const ROW_CHARS: usize = 108;

/// Characters of a line of text across the page.
const TEXT_CHARS: usize = 105;

/// Size of a chart and of its dots, mm.
const CHART_MM: (f32, f32) = (150.0, 40.0);
const DOT_MM: f32 = 1.2;

/// Width of the numbers beside a chart, mm.
const SCALE_MM: f32 = 20.0;

/// The report.
pub fn study_pdf(sheet: &StudySheet) -> Vec<u8> {
    let mut writer = Writer { paper: Paper::default(), y_mm: HEIGHT_MM };
    writer.new_page();
    writer.heading(sheet);
    for table in &sheet.tables {
        writer.table(table);
    }
    for chart in &sheet.charts {
        writer.chart(chart);
    }
    writer.facts(sheet);
    writer.paper.finish(&sheet.title())
}

struct Writer {
    paper: Paper,
    /// Baseline of the next line of text, from the top of the page.
    y_mm: f32,
}

impl Writer {
    fn new_page(&mut self) {
        self.paper.new_page();
        self.y_mm = MARGIN_MM;
        let footer = [MARGIN_MM, HEIGHT_MM - 10.0];
        self.paper.text(footer, Font::Helvetica, 7.0, GREY, concat!("sheaf ", env!("CARGO_PKG_VERSION")));
    }

    /// Begins a new page unless `height_mm` is left on this one.
    fn ensure_room(&mut self, height_mm: f32) {
        if self.y_mm + height_mm > HEIGHT_MM - MARGIN_MM {
            self.new_page();
        }
    }

    fn line(&mut self, font: Font, size_pt: f32, colour: [f32; 3], step_mm: f32, text: &str) {
        self.ensure_room(step_mm);
        self.paper.text([MARGIN_MM, self.y_mm], font, size_pt, colour, text);
        self.y_mm += step_mm;
    }

    fn heading(&mut self, sheet: &StudySheet) {
        let box_mm = [WIDTH_MM - MARGIN_MM - 52.0, MARGIN_MM - 6.0, 52.0, 14.0];
        self.paper.rectangle(box_mm, sheet.verdict.map_or(GREY, colour));
        let place = [box_mm[0] + 4.0, MARGIN_MM + 3.0];
        self.paper.text(place, Font::HelveticaBold, 15.0, [1.0; 3], sheet.verdict_label());
        self.line(Font::HelveticaBold, 16.0, BLACK, 7.0, sheet.kind);
        self.line(Font::Helvetica, 11.0, BLACK, 9.0, &sheet.name);
        if sheet.simulated {
            self.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 6.0, SIMULATED);
        }
        for missing in &sheet.missing {
            self.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 5.0, missing);
        }
        for line in sheet.criteria.iter().flat_map(|criterion| wrapped(criterion, TEXT_CHARS)) {
            self.line(Font::Helvetica, 8.5, BLACK, 4.2, &line);
        }
        self.y_mm += 4.0;
    }

    fn table(&mut self, table: &SheetTable) {
        self.ensure_room(14.0 + 2.0 * ROW_MM);
        self.line(Font::HelveticaBold, 10.5, BLACK, 4.6, &table.title);
        for line in wrapped(&table.about, TEXT_CHARS) {
            self.line(Font::Helvetica, 8.0, GREY, 4.4, &line);
        }
        self.y_mm += 1.0;
        let head: Vec<String> = table.head.iter().map(|name| (*name).to_owned()).collect();
        let widths = widths(&head, &table.rows);
        self.row(&head, &widths, GREY);
        for (idx, row) in table.rows.iter().enumerate() {
            let shown = if table.marked.contains(&idx) { colour(PartVerdict::NotOk) } else { BLACK };
            self.row(row, &widths, shown);
        }
        self.y_mm += 4.0;
    }

    /// A row with a rule below: the first column is text, the others are right-aligned.
    fn row(&mut self, cells: &[String], widths: &[usize], colour: [f32; 3]) {
        self.ensure_room(ROW_MM);
        let char_mm = TABLE_PT * COURIER_ADVANCE * 25.4 / 72.0;
        let mut left = 0;
        for (idx, (cell, width)) in cells.iter().zip(widths).enumerate() {
            let text: String = cell.chars().take(*width).collect();
            let indent = if idx > 0 { width - text.chars().count() } else { 0 };
            let x_mm = MARGIN_MM + (left + indent) as f32 * char_mm;
            self.paper.text([x_mm, self.y_mm], Font::Courier, TABLE_PT, colour, &text);
            left += width + 1;
        }
        let rule = [MARGIN_MM, self.y_mm + 1.3, WIDTH_MM - 2.0 * MARGIN_MM, 0.15];
        self.paper.rectangle(rule, RULE);
        self.y_mm += ROW_MM;
    }

    fn chart(&mut self, chart: &SheetChart) {
        let (width, height) = CHART_MM;
        let all = || chart.values.iter().chain(&chart.rules).copied().filter(|value| value.is_finite());
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return;
        }
        let span = if high > low { high - low } else { 1.0 };
        self.ensure_room(height + 14.0);
        self.line(Font::HelveticaBold, 10.5, BLACK, 4.0, &format!("{}, {}", chart.title, chart.y));
        let (left, top) = (MARGIN_MM + SCALE_MM, self.y_mm);
        let y_of = |value: f64| top + height - ((value - low) / span) as f32 * height;
        for value in [low, high] {
            let place = [MARGIN_MM, y_of(value) + 1.0];
            self.paper.text(place, Font::Courier, TABLE_PT, GREY, &format!("{value:.2}"));
        }
        for edge in [low, high] {
            self.paper.rectangle([left, y_of(edge), width, 0.15], RULE);
        }
        for rule in &chart.rules {
            self.paper.rectangle([left, y_of(*rule), width, 0.3], colour(PartVerdict::NotOk));
        }
        let step = width / chart.values.len().max(1) as f32;
        for (idx, value) in chart.values.iter().enumerate() {
            let x_mm = left + (idx as f32 + 0.5) * step - DOT_MM / 2.0;
            self.paper.rectangle([x_mm, y_of(*value) - DOT_MM / 2.0, DOT_MM, DOT_MM], ACCENT);
        }
        self.y_mm = top + height + 8.0;
    }

    fn facts(&mut self, sheet: &StudySheet) {
        for (name, value) in &sheet.facts {
            self.ensure_room(5.0);
            self.paper.text([MARGIN_MM, self.y_mm], Font::Helvetica, 8.5, GREY, name);
            self.paper.text([MARGIN_MM + 38.0, self.y_mm], Font::Helvetica, 8.5, BLACK, value);
            self.y_mm += 4.6;
        }
    }
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

/// The colour of a verdict in print; its label is always printed as well.
fn colour(verdict: PartVerdict) -> [f32; 3] {
    match verdict {
        PartVerdict::Ok => [0.05, 0.45, 0.25],
        PartVerdict::Undecided => [0.65, 0.40, 0.0],
        PartVerdict::Invalid => [0.35, 0.35, 0.40],
        PartVerdict::NotOk => [0.70, 0.10, 0.10],
    }
}

/// Text in lines of at most `max_chars` characters, broken between words.
fn wrapped(text: &str, max_chars: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(last) if last.chars().count() + 1 + word.chars().count() <= max_chars => {
                last.push(' ');
                last.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
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
