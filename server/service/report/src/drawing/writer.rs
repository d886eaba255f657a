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
/// Distance of the lines within a row, mm.
const LINE_MM: f32 = 3.2;

/// Characters of a line of text across the page, at 8.5 points.
pub const TEXT_CHARS: usize = 105;
/// Their mean width, mm.
const TEXT_CHAR_MM: f32 = (WIDTH_MM - 2.0 * MARGIN_MM) / TEXT_CHARS as f32;

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

    /// A name, and its value from `value_mm` after the margin on; a long value continues on further lines.
    pub fn fact(&mut self, value_mm: f32, name: &str, value: &str) {
        let chars = TEXT_CHARS - (value_mm / TEXT_CHAR_MM).ceil() as usize;
        self.ensure_room(ROW_MM);
        self.paper.text([MARGIN_MM, self.y_mm], Font::Helvetica, 8.5, GREY, name);
        for (idx, line) in wrapped(value, chars).iter().enumerate() {
            if idx > 0 {
                self.y_mm += ROW_MM;
                self.ensure_room(ROW_MM);
            }
            self.paper.text([MARGIN_MM + value_mm, self.y_mm], Font::Helvetica, 8.5, BLACK, line);
        }
        self.y_mm += ROW_MM;
    }

    /// A row of a table with a rule below. `widths`: of the columns, in characters; longer cells continue on further
    /// lines. Numbers are right-aligned.
    pub fn row(
        &mut self,
        cells: &[String],
        widths: &[usize],
        is_number: impl Fn(usize) -> bool,
        colour: [f32; 3],
    ) {
        let lines: Vec<Vec<String>> =
            cells.iter().zip(widths).map(|(cell, width)| wrapped(cell, *width)).collect();
        let n_lines = lines.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let further_mm = (n_lines - 1) as f32 * LINE_MM;
        self.ensure_room(further_mm + ROW_MM);
        let char_mm = TABLE_PT * COURIER_ADVANCE * 25.4 / 72.0;
        let mut left = 0;
        for (idx, (cell, width)) in lines.iter().zip(widths).enumerate() {
            for (line, text) in cell.iter().enumerate() {
                let indent = if is_number(idx) { width - text.chars().count() } else { 0 };
                let x_mm = MARGIN_MM + (left + indent) as f32 * char_mm;
                let y_mm = self.y_mm + line as f32 * LINE_MM;
                self.paper.text([x_mm, y_mm], Font::Courier, TABLE_PT, colour, text);
            }
            left += width + 1;
        }
        self.y_mm += further_mm;
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

/// Text in lines of at most `max_chars` characters, broken between words; a longer word is broken where the line ends.
pub fn wrapped(text: &str, max_chars: usize) -> Vec<String> {
    let max_chars = max_chars.max(1);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let characters: Vec<char> = word.chars().collect();
        for piece in characters.chunks(max_chars) {
            match lines.last_mut() {
                Some(last)
                    if characters.len() <= max_chars && last.chars().count() + 1 + piece.len() <= max_chars =>
                {
                    last.push(' ');
                    last.extend(piece);
                }
                _ => lines.push(piece.iter().collect()),
            }
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
        assert_eq!(wrapped("a characteristic b", 7), ["a", "charact", "eristic", "b"]);
    }
}
