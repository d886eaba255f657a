//! Types that the station shares with the service: leases, frames, status and the stop latch.

pub mod cancel;
pub mod dark_frame;
pub mod frame;
pub(crate) mod pool;
pub mod recycling;
pub mod refusal;
pub mod status;
pub(crate) mod stop_latch;
pub mod tap;
pub(crate) mod viewers;
pub mod wall_clock;
