//! Image files: grey in, grey out, with limits on what a file may ask for.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read};
use std::path::{Path, PathBuf};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{
    DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError as DecodeError, ImageFormat,
    ImageReader, Limits,
};
use sha2::{Digest, Sha256};
use vision::{GreyImage, ImageError, Pixels};

use crate::params::{DECODE_LIMIT_BYTES, IMAGE_LIMIT_PX};

/// Bytes read at a time while hashing.
const HASH_CHUNK_BYTES: usize = 1 << 16;

/// Why an image file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The file cannot be opened or created.
    #[error("cannot access {}: check that it exists and that its permissions allow it", path.display())]
    Inaccessible {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        #[source]
        cause: std::io::Error,
    },
    /// Not an image of an allowed format, whatever its name says.
    #[error("{} is not {allowed}: convert it", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What may be read here.
        allowed: &'static str,
    },
    /// Truncated, corrupt or of a kind the decoder does not know.
    #[error("{} is truncated or corrupt: copy or record it again", path.display())]
    Undecodable {
        /// The file.
        path: PathBuf,
        /// Where the decoder stopped.
        #[source]
        cause: DecodeError,
    },
    /// More pixels than an image may have.
    #[error("{} has {width_px}×{height_px} pixels, more than {IMAGE_LIMIT_PX}: crop it", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Columns.
        width_px: u32,
        /// Rows.
        height_px: u32,
    },
    /// Colour where one channel is wanted.
    #[error("{} has colour or transparency ({kind}): record it in one channel, or convert it to grey", path.display())]
    Colour {
        /// The file.
        path: PathBuf,
        /// What the file says it holds.
        kind: String,
    },
    /// A bit depth other than 8 or 16.
    #[error("{} has pixels of kind {kind}: record it with 8 or 16 bits per pixel", path.display())]
    BitDepth {
        /// The file.
        path: PathBuf,
        /// What the file says it holds.
        kind: String,
    },
    /// An image without pixels.
    #[error("{} has no pixels: record it again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        cause: ImageError,
    },
    /// The encoder failed.
    #[error("cannot write {}: check that the disk has room", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the encoder met.
        #[source]
        cause: DecodeError,
    },
}

/// What an image file says about itself before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageHeader {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// 8 or 16.
    pub bits: u32,
}

/// Reads any photograph as grey levels: PNG, TIFF or JPEG, 8 or 16 bit, grey or colour.
///
/// Colour becomes the mean of its three channels, so that a red laser line on a dark ground keeps a third of
/// its height whatever its colour; transparency is ignored.
///
/// # Errors
/// [`ImageFileError`] names the file and the remedy.
pub fn read_grey_image(path: &Path) -> Result<GreyImage, ImageFileError> {
    let allowed = [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Jpeg];
    grey_from_decoder(path, open(path, &allowed, "a PNG, TIFF or JPEG image")?)
}

/// Reads an image of a capture: PNG or TIFF, 8 or 16 bit, exactly one channel.
pub(crate) fn read_capture_image(path: &Path) -> Result<GreyImage, ImageFileError> {
    let decoder = open_capture_image(path)?;
    header(path, &decoder)?;
    grey_from_decoder(path, decoder)
}

/// Reads the header of an image of a capture, with the same demands as [`read_capture_image`].
pub(crate) fn read_capture_header(path: &Path) -> Result<ImageHeader, ImageFileError> {
    header(path, &open_capture_image(path)?)
}

/// Writes an image as PNG of its own bit depth.
///
/// # Errors
/// [`ImageFileError::Inaccessible`] or [`ImageFileError::Unwritable`].
pub fn write_png(path: &Path, image: &GreyImage) -> Result<(), ImageFileError> {
    let file = File::create(path).map_err(|cause| inaccessible(path, cause))?;
    let encoder = PngEncoder::new_with_quality(BufWriter::new(file), CompressionType::Fast, FilterType::Adaptive);
    let (width, height) = (image.width() as u32, image.height() as u32);
    let written = match image.pixels() {
        Pixels::Eight(pixels) => encoder.write_image(pixels, width, height, ExtendedColorType::L8),
        Pixels::Sixteen(pixels) => {
            // The encoder takes samples in the machine's byte order and writes PNG's.
            let bytes: Vec<u8> = pixels.iter().flat_map(|level| level.to_ne_bytes()).collect();
            encoder.write_image(&bytes, width, height, ExtendedColorType::L16)
        }
    };
    written.map_err(|cause| ImageFileError::Unwritable { path: path.to_owned(), cause })
}

/// SHA-256 of a file's bytes, 64 lower-case hexadecimal digits.
///
/// # Errors
/// [`ImageFileError::Inaccessible`].
pub fn sha256_of(path: &Path) -> Result<String, ImageFileError> {
    let mut file = File::open(path).map_err(|cause| inaccessible(path, cause))?;
    let mut hasher = Sha256::new();
    let mut chunk = vec![0; HASH_CHUNK_BYTES];
    loop {
        let n_bytes = file.read(&mut chunk).map_err(|cause| inaccessible(path, cause))?;
        if n_bytes == 0 {
            return Ok(hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect());
        }
        hasher.update(&chunk[..n_bytes]);
    }
}

fn open_capture_image(path: &Path) -> Result<impl ImageDecoder + use<>, ImageFileError> {
    open(path, &[ImageFormat::Png, ImageFormat::Tiff], "a PNG or TIFF image")
}

/// Opens a file as one of the allowed formats, by content rather than by name, and checks its size.
fn open(
    path: &Path,
    formats: &[ImageFormat],
    allowed: &'static str,
) -> Result<impl ImageDecoder + use<>, ImageFileError> {
    let file = File::open(path).map_err(|cause| inaccessible(path, cause))?;
    if file.metadata().map_err(|cause| inaccessible(path, cause))?.is_dir() {
        return Err(ImageFileError::UnknownFormat { path: path.to_owned(), allowed });
    }
    let mut reader =
        ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(|cause| inaccessible(path, cause))?;
    if !reader.format().is_some_and(|format| formats.contains(&format)) {
        return Err(ImageFileError::UnknownFormat { path: path.to_owned(), allowed });
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(DECODE_LIMIT_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|cause| undecodable(path, cause))?;
    let (width_px, height_px) = decoder.dimensions();
    if width_px as usize * height_px as usize > IMAGE_LIMIT_PX {
        return Err(ImageFileError::TooLarge { path: path.to_owned(), width_px, height_px });
    }
    Ok(decoder)
}

fn header(path: &Path, decoder: &impl ImageDecoder) -> Result<ImageHeader, ImageFileError> {
    let (width_px, height_px) = decoder.dimensions();
    let kind = decoder.original_color_type();
    let bits = match kind {
        ExtendedColorType::L8 => 8,
        ExtendedColorType::L16 => 16,
        _ if kind.channel_count() == 1 => {
            return Err(ImageFileError::BitDepth { path: path.to_owned(), kind: format!("{kind:?}") });
        }
        _ => return Err(ImageFileError::Colour { path: path.to_owned(), kind: format!("{kind:?}") }),
    };
    Ok(ImageHeader { width_px: width_px as usize, height_px: height_px as usize, bits })
}

fn grey_from_decoder(path: &Path, decoder: impl ImageDecoder) -> Result<GreyImage, ImageFileError> {
    let decoded = DynamicImage::from_decoder(decoder).map_err(|cause| undecodable(path, cause))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let pixels = match decoded {
        DynamicImage::ImageLuma8(grey) => Pixels::Eight(grey.into_raw()),
        DynamicImage::ImageLuma16(grey) => Pixels::Sixteen(grey.into_raw()),
        DynamicImage::ImageLumaA8(grey) => Pixels::Eight(grey.pixels().map(|p| p.0[0]).collect()),
        DynamicImage::ImageLumaA16(grey) => Pixels::Sixteen(grey.pixels().map(|p| p.0[0]).collect()),
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let mean = |p: &image::Rgb<u8>| (p.0.iter().map(|&c| u16::from(c)).sum::<u16>() + 1) / 3;
            Pixels::Eight(decoded.into_rgb8().pixels().map(|p| mean(p) as u8).collect())
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            let mean = |p: &image::Rgb<u16>| (p.0.iter().map(|&c| u32::from(c)).sum::<u32>() + 1) / 3;
            Pixels::Sixteen(decoded.into_rgb16().pixels().map(|p| mean(p) as u16).collect())
        }
        other => {
            return Err(ImageFileError::BitDepth { path: path.to_owned(), kind: format!("{:?}", other.color()) });
        }
    };
    GreyImage::new(width, height, pixels).map_err(|cause| ImageFileError::Empty { path: path.to_owned(), cause })
}

fn inaccessible(path: &Path, cause: std::io::Error) -> ImageFileError {
    ImageFileError::Inaccessible { path: path.to_owned(), cause }
}

fn undecodable(path: &Path, cause: DecodeError) -> ImageFileError {
    ImageFileError::Undecodable { path: path.to_owned(), cause }
}
