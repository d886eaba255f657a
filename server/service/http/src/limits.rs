//! What the interface takes at most, and how long it waits: one place, stated to clients as problems.

use std::time::Duration;

/// Largest JSON body: the largest document of the API is below a tenth of it.
pub const JSON_BODY_LIMIT_BYTES: usize = 256 * 1024;

/// Largest uploaded archive: 40 poses and 400 frames of 5 Mpx as PNG.
pub const UPLOAD_LIMIT_BYTES: u64 = 2 * 1024 * 1024 * 1024;

/// Open connections: 200 sockets, as many pages with six connections each, and room for scripts.
pub const CONNECTION_LIMIT: usize = 1_000;

/// Connections beyond [`CONNECTION_LIMIT`] that are accepted for Stop alone.
pub const STOP_CONNECTION_LIMIT: usize = 32;

/// Computations of whole clouds at once: each takes a processor and, for a mesh of a large scan (1.25 million points),
/// 175 MiB for seconds.
pub const HEAVY_REQUESTS: usize = 1;

/// How long another one waits before it is asked to retry.
pub const HEAVY_WAIT: Duration = Duration::from_secs(15);

/// Time for the header of a request, also on a silent kept-open connection.
pub const HEADER_TIMEOUT: Duration = Duration::from_secs(10);

/// The same beyond [`CONNECTION_LIMIT`], where a place is worth more.
pub const STOP_HEADER_TIMEOUT: Duration = Duration::from_secs(2);

/// Largest STL file for the simulated stage: a million triangles in binary.
pub const STL_BODY_LIMIT_BYTES: usize = 64 * 1024 * 1024;

/// Time for a whole STL file.
pub const STL_BODY_TIMEOUT: Duration = Duration::from_secs(60);

/// Time for a whole JSON body.
pub const JSON_BODY_TIMEOUT: Duration = Duration::from_secs(10);

/// An upload that brings less than [`UPLOAD_WINDOW_MIN_BYTES`] in this time is closed.
pub const UPLOAD_WINDOW: Duration = Duration::from_secs(10);

/// See [`UPLOAD_WINDOW`]: a hundredth of the slowest line that makes sense.
pub const UPLOAD_WINDOW_MIN_BYTES: u64 = 10 * 1024;

/// Bytes of an upload between two looks at the room on the disk.
pub const UPLOAD_ROOM_STEP_BYTES: u64 = 8 * 1024 * 1024;

/// How long the rest of a refused upload is read and discarded: a client that still sends would not read the answer.
pub const REFUSED_UPLOAD_PATIENCE: Duration = Duration::from_secs(5);

/// A client that takes no byte for this long is closed; together with the reaction below the promised 15 s.
pub const WRITE_STALL_TIMEOUT: Duration = Duration::from_secs(12);

/// Most records of one page of a list.
pub const PAGE_LIMIT_MAX: u32 = 200;

/// Records of one page of a list, if not said.
pub const PAGE_LIMIT_DEFAULT: u32 = 50;

/// Silence on an event stream before a comment shows that the line is alive: below every proxy's and our own limit.
pub const SSE_KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Progress of jobs on an event stream, at most so often.
pub const SSE_PROGRESS_PERIOD: Duration = Duration::from_millis(100);

/// Time between two upkeeps of the figures: histograms grow until then.
pub const FIGURES_UPKEEP: Duration = Duration::from_secs(3600);
