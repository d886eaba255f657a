//! Limits of uploaded captures, each with its reason.

/// Largest archive: ten thousand images of a 1280 × 1024 camera as PNG need about 8 GiB less than this would
/// suggest, because laser images are mostly dark (0.1–0.3 MB each).
pub const ARCHIVE_LIMIT_BYTES: u64 = 2 << 30;

/// Maximum unpacked size: four times the largest archive; images hardly shrink further.
pub const UNPACKED_LIMIT_BYTES: u64 = 8 << 30;

/// Maximum compression ratio beyond [`RATIO_FREE_BYTES`]. Deflate reaches 1032 on zeros; dark
/// TIFF images, the most compressible valid content, stay below 150.
pub const RATIO_LIMIT: u64 = 200;

/// Unpacked bytes to which the ratio does not apply: a small capture of empty images is not an attack.
pub const RATIO_FREE_BYTES: u64 = 64 << 20;

/// Maximum number of entries: twice a scan of ten thousand frames and a calibration.
pub const ENTRY_LIMIT: usize = 20_000;

/// Maximum file size in an archive: an image of 50 Mpx with 8 bits, or of 30 Mpx with 16 bits.
pub const FILE_LIMIT_BYTES: u64 = 64 << 20;

/// Largest manifest of an archive: [`ENTRY_LIMIT`] frames need about 2 MB; parsing takes up to twenty times its bytes.
pub const MANIFEST_LIMIT_BYTES: u64 = 4 << 20;

/// Maximum folder depth.
pub const DEPTH_LIMIT: usize = 8;

/// Maximum length of an entry name: far below the limit of file systems (4096), far above what a recorder writes.
pub const NAME_LIMIT_BYTES: usize = 512;

/// Longest extended header of a tar entry: it holds a name and some times.
pub const TAR_HEADER_LIMIT_BYTES: u64 = 16 << 10;

/// Memory limit of image validation (`promises.md` 9).
pub const DECODE_LIMIT_BYTES: usize = 256 << 20;

/// Number of unpacked captures cached; older ones are unpacked again when needed.
pub const CACHE_LIMIT_BYTES: u64 = 16 << 30;

/// Free disk space reserved when unpacking, for the catalogue and running jobs.
pub const ROOM_LEFT_BYTES: u64 = 256 << 20;
