//! The constants of the door.

use std::time::Duration;

/// A share that has not answered for this long is treated as disconnected. Longer than an SMB client needs to reconnect
/// after a short outage.
pub const DISK_LIMIT: Duration = Duration::from_secs(60);

/// Time between two looks into the folder of orders. Network shares do not notify reliably.
pub const POLL_PERIOD: Duration = Duration::from_secs(1);

/// Largest file with orders: some ten thousand rows.
pub const LARGEST_ORDER_BYTES: u64 = 1 << 20;

/// Files of the same name that are told apart by a suffix. More of them point to a template without `{seq}`.
pub const MOST_SUFFIXES: usize = 999;

/// Longest text that a placeholder adds to a file name, in bytes. With the other parts of a template, names stay well
/// below the 255 of file systems and leave room for the folder in the 260 of Windows.
pub const LONGEST_PART_BYTES: usize = 60;

/// Longest file name without its extension, in bytes.
pub const LONGEST_STEM_BYTES: usize = 160;
