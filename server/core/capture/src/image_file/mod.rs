//! Image files: reading of grey and colour images with limits on their size, writing of grey images.

mod jpeg;
mod white_level;

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read};
use std::path::{Path, PathBuf};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::metadata::Orientation;
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError as DecodeError,
    ImageFormat, ImageReader, Limits,
};
use remedy::Remedy;
use sha2::{Digest, Sha256};
use vision::{CameraImage, Channel, ColourImage, GreyImage, ImageError, Pixels, WhiteLevel};

pub use white_level::white_level_of;

use crate::params::{DECODE_LIMIT_BYTES, IMAGE_LIMIT_PX};

/// Supported formats.
const FORMATS: [ImageFormat; 4] = [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Jpeg];

/// Bytes read at a time while hashing.
const HASH_CHUNK_BYTES: usize = 1 << 16;

/// Why an image file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageFileError {
    /// The file cannot be opened or created.
    #[error("cannot access {}", path.display())]
    Inaccessible {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        #[source]
        cause: std::io::Error,
    },
    /// The content is not an image of a supported format; file extensions are ignored.
    #[error("{} is not a PNG, TIFF, BMP or JPEG image", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Truncated, corrupt or of a kind that the decoder does not support.
    #[error("{} is truncated or corrupt", path.display())]
    Undecodable {
        /// The file.
        path: PathBuf,
        /// Where the decoder stopped.
        #[source]
        cause: DecodeError,
    },
    /// More pixels than an image may have.
    #[error("{} has {width_px}×{height_px} pixels, more than {IMAGE_LIMIT_PX}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Columns.
        width_px: u32,
        /// Rows.
        height_px: u32,
    },
    /// A bit depth other than 8 or 16.
    #[error("{} has pixels of kind {kind}", path.display())]
    BitDepth {
        /// The file.
        path: PathBuf,
        /// The kind of pixels in the file.
        kind: String,
    },
    /// An image without pixels.
    #[error("{} has no pixels", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is wrong with the image.
        #[source]
        cause: ImageError,
    },
    /// The encoder failed.
    #[error("cannot write {}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// The encoder's error.
        #[source]
        cause: DecodeError,
    },
}

impl Remedy for ImageFileError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Inaccessible { .. } => "check that it exists and that its permissions allow it".into(),
            Self::UnknownFormat { .. } => "convert it".into(),
            Self::Undecodable { .. } => "copy or record it again".into(),
            Self::TooLarge { .. } => "crop it".into(),
            Self::BitDepth { .. } => "record it with 8 or 16 bits per pixel".into(),
            Self::Empty { .. } => "record it again".into(),
            Self::Unwritable { .. } => "check that the disk is not full".into(),
        })
    }
}

/// Properties of an image file before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageHeader {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// 8 or 16.
    pub bits: u32,
    /// Whether the file has red, green and blue; they may be equal everywhere.
    pub is_colour: bool,
    /// Quality of JPEG compression, 1–100; `None` for lossless formats.
    pub jpeg_quality: Option<u8>,
}

/// An image as stored in its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// Grey or colour.
    pub image: CameraImage,
    /// Quality of JPEG compression, 1–100; `None` for lossless formats.
    pub jpeg_quality: Option<u8>,
}

impl Photograph {
    /// With its levels scaled so that white is full scale.
    pub fn scaled(self, white: WhiteLevel) -> Self {
        Self { image: white.scaled(self.image), ..self }
    }
}

/// Reads any photograph: PNG, TIFF, BMP or JPEG, 8 or 16 bit, grey or colour; transparency is ignored. It is turned as
/// its metadata say (EXIF).
///
/// # Errors
/// [`ImageFileError`] names the file and the remedy.
pub fn read_photograph(path: &Path) -> Result<Photograph, ImageFileError> {
    let (format, decoder) = open(path)?;
    let image = image_from_decoder(path, decoder)?;
    Ok(Photograph { image, jpeg_quality: jpeg_quality(path, format)? })
}

/// Reads any photograph as grey levels; colour is converted to luma ([`Channel::Luma`]).
///
/// # Errors
/// [`ImageFileError`] names the file and the remedy.
pub fn read_grey_image(path: &Path) -> Result<GreyImage, ImageFileError> {
    Ok(read_photograph(path)?.image.channel(Channel::Luma))
}

/// Reads the header of an image of a capture: exactly 8 or 16 bits.
pub(crate) fn read_header(path: &Path) -> Result<ImageHeader, ImageFileError> {
    let (format, mut decoder) = open(path)?;
    let (width_px, height_px) = match orientation_of(path, &mut decoder)? {
        Orientation::NoTransforms
        | Orientation::Rotate180
        | Orientation::FlipHorizontal
        | Orientation::FlipVertical => decoder.dimensions(),
        Orientation::Rotate90
        | Orientation::Rotate270
        | Orientation::Rotate90FlipH
        | Orientation::Rotate270FlipH => {
            let (width_px, height_px) = decoder.dimensions();
            (height_px, width_px)
        }
    };
    let kind = decoder.original_color_type();
    let bits = match kind {
        ExtendedColorType::L1 | ExtendedColorType::L2 | ExtendedColorType::L4 => None,
        _ => match decoder.color_type() {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Some(8),
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Some(16),
            _ => None,
        },
    };
    let refused = || ImageFileError::BitDepth { path: path.to_owned(), kind: format!("{kind:?}") };
    Ok(ImageHeader {
        width_px: width_px as usize,
        height_px: height_px as usize,
        bits: bits.ok_or_else(refused)?,
        is_colour: decoder.color_type().has_color(),
        jpeg_quality: jpeg_quality(path, format)?,
    })
}

/// Writes an image as PNG with its own bit depth.
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
            // The encoder takes samples in native byte order.
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

/// Quality of a JPEG file; 1 without a readable table.
fn jpeg_quality(path: &Path, format: ImageFormat) -> Result<Option<u8>, ImageFileError> {
    if format != ImageFormat::Jpeg {
        return Ok(None);
    }
    let mut file = BufReader::new(File::open(path).map_err(|cause| inaccessible(path, cause))?);
    let quality = jpeg::quality_of(&mut file).map_err(|cause| inaccessible(path, cause))?;
    Ok(Some(quality.unwrap_or(1)))
}

/// Opens a file, detects its format from its content, and checks its size.
fn open(path: &Path) -> Result<(ImageFormat, impl ImageDecoder + use<>), ImageFileError> {
    let file = File::open(path).map_err(|cause| inaccessible(path, cause))?;
    let unknown = || ImageFileError::UnknownFormat { path: path.to_owned() };
    if file.metadata().map_err(|cause| inaccessible(path, cause))?.is_dir() {
        return Err(unknown());
    }
    let mut reader =
        ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(|cause| inaccessible(path, cause))?;
    let format = reader.format().filter(|format| FORMATS.contains(format)).ok_or_else(unknown)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(DECODE_LIMIT_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|cause| undecodable(path, cause))?;
    let (width_px, height_px) = decoder.dimensions();
    if width_px as usize * height_px as usize > IMAGE_LIMIT_PX {
        return Err(ImageFileError::TooLarge { path: path.to_owned(), width_px, height_px });
    }
    Ok((format, decoder))
}

/// How the image must be turned to be seen as the camera was held; viewers and OpenCV do the same.
fn orientation_of(path: &Path, decoder: &mut impl ImageDecoder) -> Result<Orientation, ImageFileError> {
    decoder.orientation().map_err(|cause| undecodable(path, cause))
}

fn image_from_decoder(path: &Path, mut decoder: impl ImageDecoder) -> Result<CameraImage, ImageFileError> {
    let orientation = orientation_of(path, &mut decoder)?;
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(|cause| undecodable(path, cause))?;
    decoded.apply_orientation(orientation);
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let grey = |pixels| GreyImage::new(width, height, pixels).map(CameraImage::Grey);
    let colour = |pixels| ColourImage::new(width, height, pixels).map(CameraImage::from_colour);
    let image = match decoded {
        DynamicImage::ImageLuma8(image) => grey(Pixels::Eight(image.into_raw())),
        DynamicImage::ImageLuma16(image) => grey(Pixels::Sixteen(image.into_raw())),
        DynamicImage::ImageLumaA8(image) => grey(Pixels::Eight(image.pixels().map(|p| p.0[0]).collect())),
        DynamicImage::ImageLumaA16(image) => grey(Pixels::Sixteen(image.pixels().map(|p| p.0[0]).collect())),
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            colour(Pixels::Eight(decoded.into_rgb8().into_raw()))
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            colour(Pixels::Sixteen(decoded.into_rgb16().into_raw()))
        }
        other => {
            return Err(ImageFileError::BitDepth { path: path.to_owned(), kind: format!("{:?}", other.color()) });
        }
    };
    image.map_err(|cause| ImageFileError::Empty { path: path.to_owned(), cause })
}

fn inaccessible(path: &Path, cause: std::io::Error) -> ImageFileError {
    ImageFileError::Inaccessible { path: path.to_owned(), cause }
}

fn undecodable(path: &Path, cause: DecodeError) -> ImageFileError {
    ImageFileError::Undecodable { path: path.to_owned(), cause }
}
