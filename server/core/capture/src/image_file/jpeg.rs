//! Quality of JPEG compression, from the quantisation table.

use std::io::{ErrorKind, Read};

/// Sum of the 64 steps of the luminance table at quality 50 (ITU-T T.81, table K.1).
const SUM_AT_50: f64 = 3679.0;
/// Steps in a table.
const N_STEPS: usize = 64;
/// Markers: start of the image, of quantisation tables, of the compressed data, end of the image.
const START: u8 = 0xd8;
const TABLES: u8 = 0xdb;
const SCAN: u8 = 0xda;
const END: u8 = 0xd9;

/// Quality of a JPEG file, 1 to 100 on the scale of the Independent JPEG Group: the one whose luminance table has
/// the same mean step. Below 25, where steps are limited to 255, the estimate is too high (15 for 10). `None` if
/// the file ends before its first table or is not a JPEG.
pub fn quality_of(file: &mut impl Read) -> std::io::Result<Option<u8>> {
    match first_table(file) {
        Ok(sum) => Ok(sum.map(quality_of_sum)),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
        Err(error) => Err(error),
    }
}

/// Scale 5000 / q below quality 50, 200 − 2 q above, in percent.
fn quality_of_sum(sum: f64) -> u8 {
    let percent = 100.0 * sum / SUM_AT_50;
    let quality = if percent > 100.0 { 5000.0 / percent } else { 100.0 - percent / 2.0 };
    quality.round().clamp(1.0, 100.0) as u8
}

/// Sum of the steps of table 0, which encoders use for luminance.
fn first_table(file: &mut impl Read) -> std::io::Result<Option<f64>> {
    let mut head = [0; 2];
    file.read_exact(&mut head)?;
    if head != [0xff, START] {
        return Ok(None);
    }
    loop {
        let marker = next_marker(file)?;
        if matches!(marker, SCAN | END) {
            return Ok(None);
        }
        let mut length = [0; 2];
        file.read_exact(&mut length)?;
        let mut segment = vec![0; usize::from(u16::from_be_bytes(length)).saturating_sub(length.len())];
        file.read_exact(&mut segment)?;
        if marker == TABLES
            && let Some(sum) = sum_of_table(&segment)
        {
            return Ok(Some(sum));
        }
    }
}

/// The next marker's byte; fill bytes before it are skipped.
fn next_marker(file: &mut impl Read) -> std::io::Result<u8> {
    let mut byte = [0];
    loop {
        file.read_exact(&mut byte)?;
        if !matches!(byte[0], 0x00 | 0xff) {
            return Ok(byte[0]);
        }
    }
}

/// The sum of table 0 in a segment of tables, each a byte (precision, number) and 64 steps of one or two bytes.
fn sum_of_table(mut segment: &[u8]) -> Option<f64> {
    while let Some((&head, rest)) = segment.split_first() {
        let is_wide = head >> 4 != 0;
        let (steps, rest) = rest.split_at_checked(if is_wide { 2 * N_STEPS } else { N_STEPS })?;
        if head & 0xf == 0 {
            let sum = match is_wide {
                true => steps.chunks_exact(2).map(|step| f64::from(u16::from_be_bytes([step[0], step[1]]))).sum(),
                false => steps.iter().map(|&step| f64::from(step)).sum(),
            };
            return Some(sum);
        }
        segment = rest;
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use image::ExtendedColorType;
    use image::codecs::jpeg::JpegEncoder;

    use super::*;

    fn jpeg(quality: u8, colour: ExtendedColorType) -> Vec<u8> {
        let mut bytes = Vec::new();
        let pixels = vec![90; 16 * 16 * usize::from(colour.bits_per_pixel() / 8)];
        JpegEncoder::new_with_quality(&mut bytes, quality).encode(&pixels, 16, 16, colour).unwrap();
        bytes
    }

    #[test]
    fn the_quality_matches_that_of_the_encoder() {
        for quality in [30, 50, 60, 75, 85, 95, 100] {
            for colour in [ExtendedColorType::L8, ExtendedColorType::Rgb8] {
                let read = quality_of(&mut &jpeg(quality, colour)[..]).unwrap().unwrap();
                // Steps are whole numbers, at least one.
                assert!(read.abs_diff(quality) <= 1, "{read} for {quality}");
            }
        }
    }

    #[test]
    fn a_file_that_is_truncated_or_not_a_jpeg_has_none() {
        let whole = jpeg(75, ExtendedColorType::L8);
        for n_bytes in [0, 1, 3, 10, 40] {
            assert_eq!(quality_of(&mut &whole[..n_bytes]).unwrap(), None, "{n_bytes}");
        }
        assert_eq!(quality_of(&mut &b"\x89PNG\r\n\x1a\n"[..]).unwrap(), None);
    }
}
