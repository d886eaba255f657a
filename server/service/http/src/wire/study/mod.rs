//! Studies of the station on the wire.

pub mod acceptance;
pub mod requests;
pub mod studies;
