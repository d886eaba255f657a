//! The connection to the broker.

pub mod address;
pub mod link;
pub mod message;
pub mod options;
pub mod reasons;
pub mod state;
pub mod subscription;
pub mod tls;
pub mod unacknowledged;
