//! Images as JPEG. The encoder is generic and large: it is compiled here, once for all that send images.

use jpeg_encoder::{ColorType, Encoder, EncodingError};

/// An image of 8-bit grey levels, row by row, as JPEG of this quality (1 to 100).
///
/// # Errors
/// If the number of levels is not `width_px` × `height_px`, or either is 0.
pub fn grey_jpeg(levels: &[u8], (width_px, height_px): (u16, u16), quality: u8) -> Result<Vec<u8>, EncodingError> {
    let mut jpeg = Vec::new();
    Encoder::new(&mut jpeg, quality).encode(levels, width_px, height_px, ColorType::Luma)?;
    Ok(jpeg)
}
