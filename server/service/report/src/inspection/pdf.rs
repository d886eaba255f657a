//! The report of an inspection as PDF.

use metrology::PartVerdict;
use pipeline::Failure;
use scanning::Cloud;

use super::paper::{COURIER_ADVANCE, Font, HEIGHT_MM, JpegImage, Paper, WIDTH_MM};
use super::{COLUMNS, InspectionSheet, SIMULATED};
use crate::drawing::cloud_view::CloudView;
use crate::drawing::raster::encode_jpeg;

const MARGIN_MM: f32 = 18.0;
const BLACK: [f32; 3] = [0.1, 0.1, 0.12];
const GREY: [f32; 3] = [0.4, 0.4, 0.43];
const RULE: [f32; 3] = [0.82, 0.82, 0.84];

/// Font size of the table, points.
const TABLE_PT: f32 = 7.5;
/// Row height of the table, mm.
const ROW_MM: f32 = 4.6;

/// Width of each column of the table in characters; longer cells are truncated.
const COLUMN_CHARS: [usize; 8] = [17, 19, 10, 10, 10, 10, 11, 9];

/// Maximum height of the image of the cloud, mm.
const MAX_IMAGE_HEIGHT_MM: f32 = 90.0;

/// The report; without the cloud if it was deleted.
///
/// # Errors
/// An image cannot be encoded.
pub fn inspection_pdf(sheet: &InspectionSheet, cloud: Option<&Cloud>) -> Result<Vec<u8>, Failure> {
    let mut writer = Writer { paper: Paper::default(), y_mm: HEIGHT_MM };
    writer.new_page();
    writer.heading(sheet);
    writer.facts(sheet);
    writer.table(sheet);
    writer.reasons(sheet);
    if let Some(cloud) = cloud {
        writer.cloud(cloud)?;
    }
    Ok(writer.paper.finish(&format!("Inspection {} of {}", sheet.seq, sheet.serial)))
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

    fn heading(&mut self, sheet: &InspectionSheet) {
        let box_mm = [WIDTH_MM - MARGIN_MM - 42.0, MARGIN_MM - 6.0, 42.0, 14.0];
        self.paper.rectangle(box_mm, colour(sheet.verdict));
        self.paper.text(
            [box_mm[0] + 4.0, MARGIN_MM + 3.0],
            Font::HelveticaBold,
            15.0,
            [1.0; 3],
            sheet.verdict.label(),
        );
        self.line(Font::HelveticaBold, 16.0, BLACK, 7.0, &format!("Inspection of {}", sheet.serial));
        let about = format!("Number {}, {}", sheet.seq, sheet.id);
        self.line(Font::Helvetica, 9.0, GREY, 9.0, &about);
        if sheet.simulated {
            self.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 7.0, SIMULATED);
        }
    }

    fn facts(&mut self, sheet: &InspectionSheet) {
        for (name, value) in &sheet.facts {
            self.paper.text([MARGIN_MM, self.y_mm], Font::Helvetica, 9.0, GREY, name);
            self.ensure_room(5.0);
            self.paper.text([MARGIN_MM + 32.0, self.y_mm], Font::Helvetica, 9.0, BLACK, value);
            self.y_mm += 5.0;
        }
        self.y_mm += 5.0;
    }

    fn table(&mut self, sheet: &InspectionSheet) {
        self.row(&COLUMNS.map(str::to_owned), GREY);
        for row in &sheet.characteristics {
            let shown = row.verdict.filter(|verdict| *verdict != PartVerdict::Ok).map_or(BLACK, colour);
            self.row(&row.cells(), shown);
        }
        self.y_mm += 3.0;
    }

    /// A row of the table with a rule below: text left-aligned, numbers right-aligned.
    fn row(&mut self, cells: &[String; 8], colour: [f32; 3]) {
        self.ensure_room(ROW_MM);
        let char_mm = TABLE_PT * COURIER_ADVANCE * 25.4 / 72.0;
        let mut left = 0;
        for (idx, (cell, width)) in cells.iter().zip(COLUMN_CHARS).enumerate() {
            let text: String = cell.chars().take(width).collect();
            let is_number = (2..7).contains(&idx);
            let indent = if is_number { width - text.chars().count() } else { 0 };
            let x_mm = MARGIN_MM + (left + indent) as f32 * char_mm;
            self.paper.text([x_mm, self.y_mm], Font::Courier, TABLE_PT, colour, &text);
            left += width + 1;
        }
        let rule = [MARGIN_MM, self.y_mm + 1.3, WIDTH_MM - 2.0 * MARGIN_MM, 0.15];
        self.paper.rectangle(rule, RULE);
        self.y_mm += ROW_MM;
    }

    fn reasons(&mut self, sheet: &InspectionSheet) {
        for row in &sheet.characteristics {
            let Some(reason) = &row.reason else { continue };
            for line in lines(&format!("{}: {reason}", row.id), 105) {
                self.line(Font::Helvetica, 8.5, BLACK, 4.2, &line);
            }
        }
        self.y_mm += 3.0;
    }

    fn cloud(&mut self, cloud: &Cloud) -> Result<(), Failure> {
        let view = CloudView::new(cloud);
        let (image, [width_mm, height_mm]) = view.top_image();
        let scale = ((WIDTH_MM - 2.0 * MARGIN_MM) / width_mm as f32).min(MAX_IMAGE_HEIGHT_MM / height_mm as f32);
        let (width, height) = (width_mm as f32 * scale, height_mm as f32 * scale);
        self.ensure_room(height + 8.0);
        let paper = image::RgbImage::from_fn(image.width(), image.height(), |x, y| {
            let [red, green, blue, opacity] = image.get_pixel(x, y).0;
            image::Rgb(if opacity == 0 { [255; 3] } else { [red, green, blue] })
        });
        let (width_px, height_px) = paper.dimensions();
        let jpeg = encode_jpeg(&paper)?;
        self.paper.image([MARGIN_MM, self.y_mm, width, height], JpegImage { jpeg, width_px, height_px });
        self.y_mm += height + 4.0;
        let [low, high] = view.heights_mm();
        let caption = format!(
            "The cloud from above, {width_mm:.1} x {height_mm:.1} mm: height from {low:.2} mm (violet) to {high:.2} mm (yellow)."
        );
        self.line(Font::Helvetica, 8.0, GREY, 5.0, &caption);
        Ok(())
    }
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

/// Wraps text into lines of at most `max_chars` characters, between words.
fn lines(text: &str, max_chars: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("there is a first line");
        if !last.is_empty() && last.chars().count() + 1 + word.chars().count() > max_chars {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::inspection::example;

    #[test]
    fn the_document_states_verdict_rows_and_reasons() {
        let bytes = inspection_pdf(&example(), None).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        for words in ["(NOT OK)", "(8.9123)", "(INVALID)", "(bracket@7)", "(depth: no plane <top> was found)"] {
            assert!(text.contains(words), "{words}: {text}");
        }
        assert!(text.contains("/Count 1"));
    }

    #[test]
    fn a_long_table_continues_on_the_next_page() {
        let mut sheet = example();
        sheet.characteristics = vec![sheet.characteristics[0].clone(); 120];
        let bytes = inspection_pdf(&sheet, None).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("/Count 3"), "{text}");
        assert_eq!(text.matches("(8.9123)").count(), 120);
    }

    #[test]
    fn text_is_wrapped_between_words() {
        assert_eq!(lines("one two  three", 7), ["one two", "three"]);
        assert_eq!(lines("", 7), [""]);
    }
}
