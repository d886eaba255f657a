//! The report of an inspection as PDF.

use image::{RgbImage, RgbaImage};
use metrology::PartVerdict;
use pipeline::Failure;
use scanning::Cloud;

use super::{ABOUT_COLUMNS, ABOUT_MAP, COLUMNS, InspectionSheet, SIMULATED, VERDICTS};
use crate::comparison::{ABOUT_MAP as ABOUT_MODEL_MAP, numbers};
use crate::drawing::cloud_view::CloudView;
use crate::drawing::deviation_map::{DeviationMap, microns};
use crate::drawing::paper::{Font, JpegImage, WIDTH_MM};
use crate::drawing::raster::encode_jpeg;
use crate::drawing::writer::{BLACK, GREY, MARGIN_MM, TEXT_CHARS, Writer, colour, wrapped};

/// Width of each column of the table in characters; longer cells continue on further lines.
const COLUMN_CHARS: [usize; 9] = [19, 16, 9, 9, 9, 9, 9, 9, 9];

/// Maximum height of an image, mm.
const MAX_IMAGE_HEIGHT_MM: f32 = 90.0;

/// Size of a colour of the legend, mm.
const KEY_MM: [f32; 2] = [10.0, 3.0];

/// The report; without the cloud if it was deleted.
///
/// # Errors
/// An image cannot be encoded.
pub fn inspection_pdf(sheet: &InspectionSheet, cloud: Option<&Cloud>) -> Result<Vec<u8>, Failure> {
    let mut writer = Writer::default();
    write_heading(&mut writer, sheet);
    for (name, value) in &sheet.facts {
        writer.fact(32.0, name, value);
    }
    writer.y_mm += 5.0;
    write_table(&mut writer, sheet);
    write_reasons(&mut writer, sheet);
    write_meanings(&mut writer);
    if let Some(map) = cloud.and_then(|cloud| sheet.deviation_map(cloud)) {
        write_map(&mut writer, &map, ABOUT_MAP)?;
    }
    if let Some(cloud) = cloud {
        for compared in &sheet.comparisons {
            let map = DeviationMap::new(cloud, &compared.comparison.deviations_mm);
            let about = format!("{}. {} {}", compared.title(), ABOUT_MODEL_MAP, numbers(&compared.comparison));
            map.map_or(Ok(()), |map| write_map(&mut writer, &map, &about))?;
        }
        write_cloud(&mut writer, cloud)?;
    }
    Ok(writer.paper.finish(&format!("Inspection {} of {}", sheet.seq, sheet.serial)))
}

fn write_heading(writer: &mut Writer, sheet: &InspectionSheet) {
    writer.verdict(42.0, colour(sheet.verdict), sheet.verdict.label());
    writer.line(Font::HelveticaBold, 16.0, BLACK, 7.0, &format!("Inspection of {}", sheet.serial));
    let about = format!("Number {}, {}", sheet.seq, sheet.id);
    writer.line(Font::Helvetica, 9.0, GREY, 9.0, &about);
    if sheet.simulated {
        writer.line(Font::HelveticaBold, 9.0, colour(PartVerdict::Undecided), 7.0, SIMULATED);
    }
}

fn write_table(writer: &mut Writer, sheet: &InspectionSheet) {
    let is_number = |idx: usize| (2..8).contains(&idx);
    writer.row(&COLUMNS.map(str::to_owned), &COLUMN_CHARS, is_number, GREY);
    for row in &sheet.characteristics {
        let shown = row.verdict.filter(|verdict| *verdict != PartVerdict::Ok).map_or(BLACK, colour);
        writer.row(&row.cells(), &COLUMN_CHARS, is_number, shown);
    }
    writer.line(Font::Helvetica, 8.0, GREY, 7.0, ABOUT_COLUMNS);
}

fn write_reasons(writer: &mut Writer, sheet: &InspectionSheet) {
    for row in &sheet.characteristics {
        let Some(reason) = &row.reason else { continue };
        for line in wrapped(&format!("{}: {reason}", row.id), TEXT_CHARS) {
            writer.line(Font::Helvetica, 8.5, BLACK, 4.2, &line);
        }
    }
    writer.y_mm += 3.0;
}

fn write_meanings(writer: &mut Writer) {
    const MEANING_MM: f32 = 24.0;
    for (verdict, meaning) in VERDICTS {
        writer.fact(MEANING_MM, verdict.label(), meaning);
    }
    let rule =
        "Verdicts by ISO 14253-1; that on the part is the worst on its characteristics, in the order above.";
    writer.line(Font::Helvetica, 8.0, GREY, 9.0, rule);
}

fn write_map(writer: &mut Writer, map: &DeviationMap, about: &str) -> Result<(), Failure> {
    let (image, [width_mm, height_mm]) = map.image();
    let [key_width, key_height] = KEY_MM;
    write_image(writer, &image, [width_mm, height_mm], 3.0 * key_height + 14.0)?;
    for (idx, (deviation_mm, [red, green, blue])) in map.stops().enumerate() {
        let left = MARGIN_MM + idx as f32 * key_width;
        let colour = [red, green, blue].map(|channel| f32::from(channel) / 255.0);
        writer.paper.rectangle([left, writer.y_mm, key_width, key_height], colour);
        if idx % 2 == 0 {
            let below = [left, writer.y_mm + 2.0 * key_height];
            writer.paper.text(below, Font::Helvetica, 7.0, GREY, &microns(deviation_mm));
        }
    }
    writer.y_mm += 3.0 * key_height + 2.0;
    for line in wrapped(&format!("{about} Grey: points without a deviation."), TEXT_CHARS) {
        writer.line(Font::Helvetica, 8.0, GREY, 3.8, &line);
    }
    writer.y_mm += 4.0;
    Ok(())
}

fn write_cloud(writer: &mut Writer, cloud: &Cloud) -> Result<(), Failure> {
    let view = CloudView::new(cloud);
    let (image, [width_mm, height_mm]) = view.top_image();
    write_image(writer, &image, [width_mm, height_mm], 8.0)?;
    let [low, high] = view.heights_mm();
    let caption = format!(
        "The cloud from above, {width_mm:.1} x {height_mm:.1} mm: height from {low:.2} mm (violet) to {high:.2} mm (yellow)."
    );
    writer.line(Font::Helvetica, 8.0, GREY, 5.0, &caption);
    Ok(())
}

/// An image of something of this size, with room for a caption below it on the same page.
fn write_image(
    writer: &mut Writer,
    image: &RgbaImage,
    [width_mm, height_mm]: [f64; 2],
    caption_mm: f32,
) -> Result<(), Failure> {
    let scale = ((WIDTH_MM - 2.0 * MARGIN_MM) / width_mm as f32).min(MAX_IMAGE_HEIGHT_MM / height_mm as f32);
    let (width, height) = (width_mm as f32 * scale, height_mm as f32 * scale);
    writer.ensure_room(height + caption_mm);
    let paper = RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [red, green, blue, opacity] = image.get_pixel(x, y).0;
        image::Rgb(if opacity == 0 { [255; 3] } else { [red, green, blue] })
    });
    let (width_px, height_px) = paper.dimensions();
    let jpeg = encode_jpeg(&paper)?;
    writer.paper.image([MARGIN_MM, writer.y_mm, width, height], JpegImage { jpeg, width_px, height_px });
    writer.y_mm += height + 4.0;
    Ok(())
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
}
