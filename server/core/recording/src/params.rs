//! Sizes of a recording, each with its reason.

/// The format's name, in the metadata that comes first.
pub const FORMAT: &str = "sheaf-recording/1";

/// Bytes after which a chunk is closed: a frame of a 4-megapixel camera. Chunks are closed by time as well.
pub const CHUNK_BYTES: u64 = 4 << 20;

/// Level of zstd: the fastest. Pictures of laser lines are mostly dark; higher levels gain a tenth for twice the time.
pub const COMPRESSION_LEVEL: u32 = 1;

/// Threads of zstd beside the one that writes: none, for the cores are for the frames.
pub const COMPRESSION_THREADS: u32 = 0;

/// The largest record that is read: a frame of 64 megapixels at 16 bits, and what the chunk held before.
pub const MOST_RECORD_BYTES: u64 = 256 << 20;

/// The name of the calibration among the attachments.
pub const CALIBRATION_NAME: &str = "calibration.json";
