//! Limits of reading, each with its reason.

/// The only format this crate reads and writes.
pub const FORMAT: &str = "sheaf-capture/1";

/// Name of the manifest inside a capture folder.
pub const MANIFEST_FILE: &str = "capture.json";

/// Largest manifest, bytes: a hundred thousand frames need about 10 MB.
pub const MANIFEST_LIMIT_BYTES: u64 = 64 << 20;

/// Largest image: twice the largest sensors in use for laser profiling (25 Mpx).
pub const IMAGE_LIMIT_PX: usize = 50_000_000;

/// Memory a decoder may take, bytes: 50 Mpx of 16-bit colour plus the decoder's own rows.
pub const DECODE_LIMIT_BYTES: u64 = 512 << 20;

/// Number of images from which the laser's channel is selected: lines of several poses or frames, read in one or
/// two seconds.
pub const CHANNEL_SAMPLE_IMAGES: usize = 4;

/// Highest diffraction order; real line gratings have light in fewer than ten on each side.
pub const ORDER_LIMIT: i8 = 20;

/// Most independent lines: as many as a grating may have.
pub const LINES_MAX: usize = 2 * ORDER_LIMIT as usize + 1;

/// Fewest inner corners along a side that still determine a pose and a lattice.
pub const CORNERS_MIN: usize = 2;

/// Most inner corners along a side; finer boards cannot be resolved within [`IMAGE_LIMIT_PX`].
pub const CORNERS_MAX: usize = 1000;
