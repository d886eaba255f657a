//! Limits and timeouts of the interface, in one place; clients see them as problems.

use std::time::Duration;

/// Largest JSON body: the largest document of the API is below a tenth of it.
pub const JSON_BODY_LIMIT_BYTES: usize = 256 * 1024;

/// Largest uploaded archive: 40 poses and 400 frames of 5 Mpx as PNG.
pub const UPLOAD_LIMIT_BYTES: u64 = 2 * 1024 * 1024 * 1024;

/// Open connections: 200 sockets, as many pages with six connections each, and room for scripts.
pub const CONNECTION_LIMIT: usize = 1_000;

/// Connections beyond [`CONNECTION_LIMIT`] that are accepted for Stop alone.
pub const STOP_CONNECTION_LIMIT: usize = 32;

/// Concurrent computations on whole clouds: each takes a core for seconds and, for the mesh of a large scan
/// (1.25 million points), 175 MiB.
pub const HEAVY_REQUESTS: usize = 1;

/// How long a further one waits before the client is asked to retry.
pub const HEAVY_WAIT: Duration = Duration::from_secs(15);

/// Timeout of a request header, also on an idle keep-alive connection.
pub const HEADER_TIMEOUT: Duration = Duration::from_secs(10);

/// The same beyond [`CONNECTION_LIMIT`], where slots are scarce.
pub const STOP_HEADER_TIMEOUT: Duration = Duration::from_secs(2);

/// Largest CAD model, also for the simulated stage: a million triangles in binary STL.
pub const MODEL_BODY_LIMIT_BYTES: usize = 64 * 1024 * 1024;

/// Timeout of a whole upload of CAD models.
pub const MODEL_BODY_TIMEOUT: Duration = Duration::from_secs(60);

/// Largest file of a recipe with its CAD models: the largest model in base64, and room for further ones.
pub const RECIPE_FILE_LIMIT_BYTES: usize = 96 * 1024 * 1024;

/// Timeout of a whole JSON body.
pub const JSON_BODY_TIMEOUT: Duration = Duration::from_secs(10);

/// An upload that sends less than [`UPLOAD_WINDOW_MIN_BYTES`] in this time is closed.
pub const UPLOAD_WINDOW: Duration = Duration::from_secs(10);

/// See [`UPLOAD_WINDOW`]: a hundredth of the slowest useful link.
pub const UPLOAD_WINDOW_MIN_BYTES: u64 = 10 * 1024;

/// Bytes of an upload between two checks of the free disk space.
pub const UPLOAD_ROOM_STEP_BYTES: u64 = 8 * 1024 * 1024;

/// How long the rest of a refused upload is read and discarded: a client that still sends would not read the answer.
pub const REFUSED_UPLOAD_PATIENCE: Duration = Duration::from_secs(5);

/// A client that reads nothing for this long is disconnected; including the reaction time below the promised 15 s.
pub const WRITE_STALL_TIMEOUT: Duration = Duration::from_secs(12);

/// Maximum number of records per page of a list.
pub const PAGE_LIMIT_MAX: u32 = 200;

/// Default number of records per page of a list.
pub const PAGE_LIMIT_DEFAULT: u32 = 50;

/// Idle time of an event stream before a keep-alive comment is sent: below the idle limits of proxies and our own.
pub const SSE_KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Minimum interval between two job progress messages on an event stream.
pub const SSE_PROGRESS_PERIOD: Duration = Duration::from_millis(100);

/// Interval of metrics upkeep: histograms grow in between.
pub const FIGURES_UPKEEP: Duration = Duration::from_secs(3600);
