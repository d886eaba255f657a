//! Conversion between an image and `foxglove.RawImage`.

use bytes::{BufMut as _, Bytes};
use prost::Message as _;
use prost::encoding::{WireType, encode_key, encode_varint};
use vision::{GreyImage, Pixels};

use crate::foxglove::{RawImage, Timestamp};

/// The frame of reference of images and profiles.
pub const CAMERA_FRAME: &str = "camera";

const MONO8: &str = "mono8";
const MONO16: &str = "mono16";

/// Field number of `data` in `foxglove.RawImage`.
const DATA_TAG: u32 = 6;

/// A time stamp from Unix time in nanoseconds.
pub fn timestamp(at_ns: u64) -> Timestamp {
    const NS_PER_S: u64 = 1_000_000_000;
    Timestamp { seconds: (at_ns / NS_PER_S) as i64, nanos: (at_ns % NS_PER_S) as i32 }
}

/// Encodes an image into `message`, reusing its memory; pixels are copied once.
pub fn encode(image: &GreyImage, at_ns: u64, message: &mut Vec<u8>) {
    const FITS: &str = "a vector grows on demand";
    message.clear();
    let (encoding, pixel_bytes) = match image.pixels() {
        Pixels::Eight(_) => (MONO8, 1),
        Pixels::Sixteen(_) => (MONO16, 2),
    };
    let (width, height) = (image.width(), image.height());
    let size_bytes = width * height * pixel_bytes;
    message.reserve(size_bytes + 128);
    let head = RawImage {
        timestamp: Some(timestamp(at_ns)),
        frame_id: CAMERA_FRAME.to_owned(),
        width: width as u32,
        height: height as u32,
        encoding: encoding.to_owned(),
        step: (width * pixel_bytes) as u32,
        data: Bytes::new(),
    };
    head.encode(message).expect(FITS);
    encode_key(DATA_TAG, WireType::LengthDelimited, message);
    encode_varint(size_bytes as u64, message);
    match image.pixels() {
        Pixels::Eight(pixels) => message.extend_from_slice(pixels),
        Pixels::Sixteen(pixels) => pixels.iter().for_each(|pixel| message.put_u16_le(*pixel)),
    }
}

/// Columns, rows and bits per pixel of an image, from its message.
///
/// # Errors
/// A description of the inconsistency.
pub fn shape(image: &RawImage) -> Result<(usize, usize, u32), String> {
    let (width, height) = (image.width as usize, image.height as usize);
    let bits = match image.encoding.as_str() {
        MONO8 => 8,
        MONO16 => 16,
        other => return Err(format!("its encoding is {other:?}, not {MONO8} or {MONO16}")),
    };
    let row_bytes = width.checked_mul(bits as usize / 8);
    let whole = row_bytes.and_then(|row| row.checked_mul(height));
    if row_bytes != Some(image.step as usize) || whole != Some(image.data.len()) || image.data.is_empty() {
        return Err(format!("{width} × {height} pixels of {bits} bits do not fill {} bytes", image.data.len()));
    }
    Ok((width, height, bits))
}

/// Decodes the pixels of a message into `target`, reusing its memory.
///
/// # Errors
/// A description of the inconsistency.
pub fn decode(image: &RawImage, target: &mut GreyImage) -> Result<(), String> {
    let (width, height, bits) = shape(image)?;
    let filled = match bits {
        8 => target.eight_mut(width, height).map(|pixels| pixels.copy_from_slice(&image.data)),
        _ => target.sixteen_mut(width, height).map(|pixels| {
            for (pixel, bytes) in pixels.iter_mut().zip(image.data.chunks_exact(2)) {
                *pixel = u16::from_le_bytes([bytes[0], bytes[1]]);
            }
        }),
    };
    filled.map_err(|error| error.to_string())
}
