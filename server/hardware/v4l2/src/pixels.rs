//! Conversion of the pixels of video devices to grey images, in the one copy from the kernel's buffer.
//!
//! Deeper pixels fill 16 bits, white at full scale. Of YUYV and MJPG the luma is used unchanged, or one
//! colour, that of the laser: with studio range (16 to 235) white is 235, which is not recognised as saturated. YUYV
//! has colour in half as many columns as luma, MJPG in half as many columns and, mostly, rows.

mod huffman;

use std::borrow::Cow;

use vision::GreyImage;
use vision::white_level::widened;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use crate::device::{Format, FourCc};
use crate::settings::CameraChannel;

/// Byte layout of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    /// One byte each.
    Eight,
    /// Two bytes each, little-endian, with this number of used bits.
    Sixteen(u32),
    /// Two bytes each, luma first.
    LumaFirst,
    /// A JPEG image.
    Jpeg,
}

/// A supported format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourceFormat {
    /// Its four letters.
    pub code: FourCc,
    packing: Packing,
}

/// All supported formats; the first suitable one is used.
const FORMATS: [SourceFormat; 6] = [
    SourceFormat { code: FourCc(*b"GREY"), packing: Packing::Eight },
    SourceFormat { code: FourCc(*b"YUYV"), packing: Packing::LumaFirst },
    SourceFormat { code: FourCc(*b"MJPG"), packing: Packing::Jpeg },
    SourceFormat { code: FourCc(*b"Y16 "), packing: Packing::Sixteen(16) },
    SourceFormat { code: FourCc(*b"Y12 "), packing: Packing::Sixteen(12) },
    SourceFormat { code: FourCc(*b"Y10 "), packing: Packing::Sixteen(10) },
];

/// Why bytes are not a valid image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvalidImage {
    /// Bytes are missing or damaged.
    Incomplete,
    /// An image of another size: columns and rows.
    WrongSize(usize, usize),
}

impl SourceFormat {
    /// Of the formats a camera offers, the best with 8 bits, or with more; `preferred` is used if it is offered with
    /// that depth.
    pub fn choose(offered: &[FourCc], is_deep: bool, preferred: &str) -> Option<Self> {
        let is_suitable = |format: &SourceFormat| format.is_deep() == is_deep && offered.contains(&format.code);
        let mut known = FORMATS.into_iter().filter(is_suitable);
        let preferred_format = known.clone().find(|format| format.code.to_string() == preferred);
        preferred_format.or_else(|| known.next())
    }

    /// Whether its pixels have more than 8 bits.
    pub fn is_deep(&self) -> bool {
        matches!(self.packing, Packing::Sixteen(_))
    }

    /// Writes the image into `image`, whose memory is reused; `channel`: of a colour camera.
    ///
    /// # Errors
    /// [`InvalidImage`]; the content of `image` is then undefined.
    pub fn unpack(
        &self,
        bytes: &[u8],
        format: &Format,
        channel: CameraChannel,
        image: &mut GreyImage,
    ) -> Result<(), InvalidImage> {
        let (width, height) = (format.width_px, format.height_px);
        match self.packing {
            Packing::Eight => {
                let rows = Rows::of(bytes, format, width)?;
                let pixels = image.eight_mut(width, height).map_err(|_| InvalidImage::Incomplete)?;
                pixels.chunks_exact_mut(width).zip(rows).for_each(|(out, row)| out.copy_from_slice(row));
            }
            Packing::LumaFirst => {
                let rows = Rows::of(bytes, format, 2 * width)?;
                let pixels = image.eight_mut(width, height).map_err(|_| InvalidImage::Incomplete)?;
                for (out, row) in pixels.chunks_exact_mut(width).zip(rows) {
                    let of_pairs = out.chunks_mut(2).zip(row.chunks(4));
                    of_pairs.for_each(|(out, pair)| unpack_pair(pair, channel, out));
                }
            }
            Packing::Sixteen(bits) => {
                let rows = Rows::of(bytes, format, 2 * width)?;
                let pixels = image.sixteen_mut(width, height).map_err(|_| InvalidImage::Incomplete)?;
                for (out, row) in pixels.chunks_exact_mut(width).zip(rows) {
                    let sent = row.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
                    out.iter_mut().zip(sent).for_each(|(out, pixel)| *out = widened(pixel, bits));
                }
            }
            Packing::Jpeg => decode_jpeg(bytes, (width, height), channel, image)?,
        }
        Ok(())
    }
}

/// Rows of an image, without padding bytes.
struct Rows;

impl Rows {
    fn of<'b>(
        bytes: &'b [u8],
        format: &Format,
        used: usize,
    ) -> Result<impl Iterator<Item = &'b [u8]>, InvalidImage> {
        let step = format.row_bytes.max(used);
        // The last row may end with its pixels.
        let needed = step * format.height_px.saturating_sub(1) + used;
        if used == 0 || format.height_px == 0 || bytes.len() < needed {
            return Err(InvalidImage::Incomplete);
        }
        Ok(bytes.chunks(step).map(move |row| &row[..used]))
    }
}

/// Two pixels of YUYV: luma, U, luma, V. Colours by ITU-R BT.601, full range.
fn unpack_pair(pair: &[u8], channel: CameraChannel, out: &mut [u8]) {
    let byte = |idx: usize| f32::from(pair.get(idx).copied().unwrap_or(128));
    let (u, v) = (byte(1) - 128.0, byte(3) - 128.0);
    let above_luma = match channel {
        CameraChannel::Luma => 0.0,
        CameraChannel::Red => 1.402 * v,
        CameraChannel::Green => -0.344_136 * u - 0.714_136 * v,
        CameraChannel::Blue => 1.772 * u,
    };
    // The cast saturates.
    out.iter_mut().enumerate().for_each(|(idx, out)| *out = (byte(2 * idx) + above_luma).round() as u8);
}

/// Decodes one channel. A truncated image is an error: a tolerant decoder would fill it with invented content.
///
/// Bytes lost in its middle are not detectable: the kernel marks such frames if it knows of them.
fn decode_jpeg(
    bytes: &[u8],
    size: (usize, usize),
    channel: CameraChannel,
    image: &mut GreyImage,
) -> Result<(), InvalidImage> {
    let colour = match channel {
        CameraChannel::Luma => None,
        CameraChannel::Red => Some(0),
        CameraChannel::Green => Some(1),
        CameraChannel::Blue => Some(2),
    };
    let space = if colour.is_some() { ColorSpace::RGB } else { ColorSpace::Luma };
    let bytes = with_tables(trimmed(bytes)?)?;
    let options = DecoderOptions::default().set_strict_mode(true).jpeg_set_out_colorspace(space);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&bytes[..]), options);
    decoder.decode_headers().map_err(|_| InvalidImage::Incomplete)?;
    let got = decoder.dimensions().ok_or(InvalidImage::Incomplete)?;
    if got != size {
        return Err(InvalidImage::WrongSize(got.0, got.1));
    }
    let pixels = image.eight_mut(size.0, size.1).map_err(|_| InvalidImage::Incomplete)?;
    let Some(colour) = colour else {
        return decoder.decode_into(pixels).map_err(|_| InvalidImage::Incomplete);
    };
    let rgb = decoder.decode().map_err(|_| InvalidImage::Incomplete)?;
    pixels.iter_mut().zip(rgb.chunks_exact(3)).for_each(|(out, rgb)| *out = rgb[colour]);
    Ok(())
}

/// The image up to its end marker; cameras pad with zeros behind it.
fn trimmed(bytes: &[u8]) -> Result<&[u8], InvalidImage> {
    const END: [u8; 2] = [0xFF, 0xD9];
    let last = bytes.iter().rposition(|&byte| byte != 0).ok_or(InvalidImage::Incomplete)?;
    let used = &bytes[..=last];
    if used.ends_with(&END) { Ok(used) } else { Err(InvalidImage::Incomplete) }
}

/// The image with the standard's Huffman tables before its scan, if it has none.
fn with_tables(jpeg: &[u8]) -> Result<Cow<'_, [u8]>, InvalidImage> {
    const SCAN: u8 = 0xDA;
    const TABLES: u8 = 0xC4;
    let mut at = 2;
    loop {
        let Some(&[0xFF, marker, high, low]) = jpeg.get(at..at + 4) else { return Err(InvalidImage::Incomplete) };
        match marker {
            TABLES => return Ok(Cow::Borrowed(jpeg)),
            SCAN => return Ok(Cow::Owned([&jpeg[..at], &huffman::STANDARD_TABLES, &jpeg[at..]].concat())),
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
}

#[cfg(test)]
mod tests;
