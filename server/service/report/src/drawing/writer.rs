//! Text, rows and verdicts of a PDF report, written from the top of its pages to the bottom.

use metrology::PartVerdict;

use super::paper::{COURIER_ADVANCE, Font, HEIGHT_MM, Paper, WIDTH_MM};

/// Margin of the page, mm.
pub const MARGIN_MM: f32 = 18.0;

/// Colours of text: red, green, blue from 0 to 1.
pub const BLACK: [f32; 3] = [0.1, 0.1, 0.12];
/// Of secondary text.
pub const GREY: [f32; 3] = [0.4, 0.4, 0.43];
/// Of rules.
pub const RULE: [f32; 3] = [0.82, 0.82, 0.84];

/// Font size of tables, points.
pub const TABLE_PT: f32 = 7.5;
/// Row height of tables, mm.
pub const ROW_MM: f32 = 4.6;

/// Characters of a line of text across the page, at 8.5 points.
pub const TEXT_CHARS: usize = 105;

/// Height of a verdict's box, mm.
const VERDICT_MM: f32 = 14.0;

/// A report, and the place where it goes on.
pub struct Writer {
    /// Its pages.
    pub paper: Paper,
    /// Baseline of the next line of text, mm from the top of the page.
    pub y_mm: f32,
}

impl Default for Writer {
    fn default() -> Self {
        let mut writer = Self { paper: Paper::default(), y_mm: HEIGHT_MM };
        writer.new_page();
        writer
    }
}

impl Writer {
    fn new_page(&mut self) {
        self.paper.new_page();
        self.y_mm = MARGIN_MM;
        let footer = [MARGIN_MM, HEIGHT_MM - 10.0];
        self.paper.text(footer, Font::Helvetica, 7.0, GREY, concat!("sheaf ", env!("CARGO_PKG_VERSION")));
    }

    /// Begins a new page unless `height_mm` is left on this one.
    pub fn ensure_room(&mut self, height_mm: f32) {
        if self.y_mm + height_mm > HEIGHT_MM - MARGIN_MM {
            self.new_page();
        }
    }

    /// A line of text, and the step to the next baseline.
    pub fn line(&mut self, font: Font, size_pt: f32, colour: [f32; 3], step_mm: f32, text: &str) {
        self.ensure_room(step_mm);
        self.paper.text([MARGIN_MM, self.y_mm], font, size_pt, colour, text);
        self.y_mm += step_mm;
    }

    /// The verdict in a box of this width in the upper right corner.
    pub fn verdict(&mut self, width_mm: f32, colour: [f32; 3], label: &str) {
        let left = WIDTH_MM - MARGIN_MM - width_mm;
        self.paper.rectangle([left, MARGIN_MM - 6.0, width_mm, VERDICT_MM], colour);
        self.paper.text([left + 4.0, MARGIN_MM + 3.0], Font::HelveticaBold, 15.0, [1.0; 3], label);
    }

    /// A name, and its value from `value_mm` after the margin on.
    pub fn fact(&mut self, value_mm: f32, name: &str, value: &str) {
        self.ensure_room(ROW_MM);
        self.paper.text([MARGIN_MM, self.y_mm], Font::Helvetica, 8.5, GREY, name);
        self.paper.text([MARGIN_MM + value_mm, self.y_mm], Font::Helvetica, 8.5, BLACK, value);
        self.y_mm += ROW_MM;
    }

    /// A row of a table with a rule below. `widths`: of the columns, in characters; longer cells are truncated. Numbers
    /// are right-aligned.
    pub fn row(
        &mut self,
        cells: &[String],
        widths: &[usize],
        is_number: impl Fn(usize) -> bool,
        colour: [f32; 3],
    ) {
        self.ensure_room(ROW_MM);
        let char_mm = TABLE_PT * COURIER_ADVANCE * 25.4 / 72.0;
        let mut left = 0;
        for (idx, (cell, width)) in cells.iter().zip(widths).enumerate() {
            let text: String = cell.chars().take(*width).collect();
            let indent = if is_number(idx) { width - text.chars().count() } else { 0 };
            let x_mm = MARGIN_MM + (left + indent) as f32 * char_mm;
            self.paper.text([x_mm, self.y_mm], Font::Courier, TABLE_PT, colour, &text);
            left += width + 1;
        }
        let rule = [MARGIN_MM, self.y_mm + 1.3, WIDTH_MM - 2.0 * MARGIN_MM, 0.15];
        self.paper.rectangle(rule, RULE);
        self.y_mm += ROW_MM;
    }
}

/// The colour of a verdict in print; its label is always printed as well.
pub fn colour(verdict: PartVerdict) -> [f32; 3] {
    match verdict {
        PartVerdict::Ok => [0.05, 0.45, 0.25],
        PartVerdict::Undecided => [0.65, 0.40, 0.0],
        PartVerdict::Invalid => [0.35, 0.35, 0.40],
        PartVerdict::NotOk => [0.70, 0.10, 0.10],
    }
}

/// Text in lines of at most `max_chars` characters, broken between words.
pub fn wrapped(text: &str, max_chars: usize) -> Vec<String> {
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

    #[test]
    fn text_is_wrapped_between_words() {
        assert_eq!(wrapped("one two  three", 7), ["one two", "three"]);
        assert!(wrapped("", 7).is_empty());
    }
}
