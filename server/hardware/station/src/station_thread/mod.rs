//! The station thread, and the handle and leases through which it is used.
pub(crate) mod command;
pub(crate) mod execution;
pub mod handle;
pub mod lease;
pub(crate) mod live_view;
pub(crate) mod opening;
pub(crate) mod reset;
pub(crate) mod run;
pub(crate) mod stamping;
pub(crate) mod station;
pub(crate) mod status_publisher;
pub(crate) mod stopping;
pub(crate) mod task;
pub(crate) mod thread;
