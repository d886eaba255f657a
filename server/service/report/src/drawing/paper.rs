//! PDF pages with text, rectangles and images.

use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str};

/// Points of PDF per millimetre.
const POINTS_PER_MM: f32 = 72.0 / 25.4;

/// A4, mm.
pub const WIDTH_MM: f32 = 210.0;
/// A4, mm.
pub const HEIGHT_MM: f32 = 297.0;

/// Width of a Courier character relative to the font size; the same for all characters.
pub const COURIER_ADVANCE: f32 = 0.6;

/// A standard PDF font, which every reader provides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    /// Text.
    Helvetica,
    /// Headings.
    HelveticaBold,
    /// Tables: all characters have the same width, so that columns of numbers are aligned.
    Courier,
}

impl Font {
    const ALL: [(Self, &'static [u8], &'static [u8]); 3] = [
        (Self::Helvetica, b"F1", b"Helvetica"),
        (Self::HelveticaBold, b"F2", b"Helvetica-Bold"),
        (Self::Courier, b"F3", b"Courier"),
    ];

    fn key(self) -> &'static [u8] {
        match self {
            Self::Helvetica => b"F1",
            Self::HelveticaBold => b"F2",
            Self::Courier => b"F3",
        }
    }
}

/// A JPEG file with its size in pixels.
pub struct JpegImage {
    /// The bytes of the file, RGB.
    pub jpeg: Vec<u8>,
    /// Width.
    pub width_px: u32,
    /// Height.
    pub height_px: u32,
}

/// A document under construction; positions are in mm from the top left of the page.
#[derive(Default)]
pub struct Paper {
    pages: Vec<Content>,
    images: Vec<JpegImage>,
}

impl Paper {
    /// Begins a page.
    pub fn new_page(&mut self) {
        self.pages.push(Content::new());
    }

    /// Adds text. The baseline begins at the given position; `colour` is red, green and blue from 0 to 1.
    pub fn text(&mut self, [x_mm, y_mm]: [f32; 2], font: Font, size_pt: f32, colour: [f32; 3], text: &str) {
        let page = self.page();
        page.set_fill_rgb(colour[0], colour[1], colour[2]);
        page.begin_text();
        page.set_font(Name(font.key()), size_pt);
        page.next_line(points(x_mm), points(HEIGHT_MM - y_mm));
        page.show(Str(windows_1252(text).as_slice()));
        page.end_text();
    }

    /// Adds a filled rectangle: left, top, width and height.
    pub fn rectangle(&mut self, [x, y, width, height]: [f32; 4], colour: [f32; 3]) {
        let page = self.page();
        page.set_fill_rgb(colour[0], colour[1], colour[2]);
        page.rect(points(x), points(HEIGHT_MM - y - height), points(width), points(height));
        page.fill_nonzero();
    }

    /// Adds an image: left, top, width and height.
    pub fn image(&mut self, [x, y, width, height]: [f32; 4], image: JpegImage) {
        let name = image_name(self.images.len());
        let page = self.page();
        page.save_state();
        page.transform([points(width), 0.0, 0.0, points(height), points(x), points(HEIGHT_MM - y - height)]);
        page.x_object(Name(name.as_bytes()));
        page.restore_state();
        self.images.push(image);
    }

    fn page(&mut self) -> &mut Content {
        if self.pages.is_empty() {
            self.new_page();
        }
        self.pages.last_mut().expect("a page was added above")
    }

    /// The bytes of the file.
    pub fn finish(self, title: &str) -> Vec<u8> {
        let mut next = 0;
        let mut reference = || {
            next += 1;
            Ref::new(next)
        };
        let [catalogue, tree, info] = [reference(), reference(), reference()];
        let fonts = Font::ALL.map(|(_, key, base)| (reference(), key, base));
        let pages: Vec<(Ref, Ref)> = self.pages.iter().map(|_| (reference(), reference())).collect();
        let images: Vec<(Ref, String)> =
            (0..self.images.len()).map(|idx| (reference(), image_name(idx))).collect();
        let mut pdf = Pdf::new();
        pdf.catalog(catalogue).pages(tree);
        pdf.document_info(info).title(pdf_writer::TextStr(title)).producer(pdf_writer::TextStr("Sheaf"));
        pdf.pages(tree).kids(pages.iter().map(|(page, _)| *page)).count(pages.len() as i32);
        for (content, (page, stream)) in self.pages.into_iter().zip(&pages) {
            let mut sheet = pdf.page(*page);
            sheet.parent(tree).contents(*stream);
            sheet.media_box(Rect::new(0.0, 0.0, points(WIDTH_MM), points(HEIGHT_MM)));
            let mut resources = sheet.resources();
            let mut shown = resources.x_objects();
            for (image, name) in &images {
                shown.pair(Name(name.as_bytes()), *image);
            }
            shown.finish();
            let mut used = resources.fonts();
            for (font, key, _) in &fonts {
                used.pair(Name(key), *font);
            }
            used.finish();
            resources.finish();
            sheet.finish();
            pdf.stream(*stream, &content.finish());
        }
        for (font, _, base) in fonts {
            pdf.type1_font(font).base_font(Name(base)).encoding_predefined(Name(b"WinAnsiEncoding"));
        }
        for (JpegImage { jpeg, width_px, height_px }, (image, _)) in self.images.iter().zip(&images) {
            let mut drawn = pdf.image_xobject(*image, jpeg);
            drawn.filter(Filter::DctDecode);
            drawn.width(width_px.cast_signed()).height(height_px.cast_signed());
            drawn.color_space().device_rgb();
            drawn.bits_per_component(8);
        }
        pdf.finish()
    }
}

/// The name by which pages refer to an image.
fn image_name(idx: usize) -> String {
    format!("I{}", idx + 1)
}

fn points(mm: f32) -> f32 {
    mm * POINTS_PER_MM
}

/// Encodes text for the fonts; other characters become question marks.
fn windows_1252(text: &str) -> Vec<u8> {
    let byte = |character: char| match character {
        '–' | '−' => 0x96,
        '—' => 0x97,
        '…' => 0x85,
        '€' => 0x80,
        '\u{80}'..='\u{9f}' => b'?',
        character => u8::try_from(u32::from(character)).unwrap_or(b'?'),
    };
    text.chars().map(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_outside_the_encoding_become_question_marks() {
        assert_eq!(windows_1252("Ø 5 µm – 漢"), b"\xd8 5 \xb5m \x96 ?");
    }

    #[test]
    fn every_page_is_in_the_document() {
        let mut paper = Paper::default();
        for page in ["first", "second"] {
            paper.new_page();
            paper.text([10.0, 10.0], Font::Courier, 9.0, [0.0; 3], page);
        }
        let bytes = paper.finish("two");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-") && text.contains("/Count 2"));
        assert!(text.contains("(first) Tj") && text.contains("(second) Tj"), "{text}");
    }
}
