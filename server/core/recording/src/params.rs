//! Sizes of a recording, each with its reason.

/// The format's name, in the first metadata record.
pub const FORMAT: &str = "sheaf-recording/1";

/// Bytes after which a chunk is closed: a frame of a 4-megapixel camera. Chunks are closed by time as well.
pub const CHUNK_BYTES: u64 = 4 << 20;

/// Level of zstd: the fastest. Images of laser lines are mostly dark; higher levels save a tenth at twice the
/// time.
pub const COMPRESSION_LEVEL: u32 = 1;

/// Threads of zstd besides the writing one: none, because the cores are needed for the frames.
pub const COMPRESSION_THREADS: u32 = 0;

/// Largest record read: a frame of 64 megapixels at 16 bits, plus the earlier content of its chunk.
pub const MAX_RECORD_BYTES: u64 = 256 << 20;

/// The name of the calibration among the attachments.
pub const CALIBRATION_NAME: &str = "calibration.json";
