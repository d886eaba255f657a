//! The REST interface: one file per resource, and what all of them share.

pub mod answers;
pub mod around;
pub mod control;
pub mod conversions;
pub mod etag;
pub mod events_document;
pub mod extract;
pub mod idempotency;
pub mod openapi;
pub mod problems;
pub mod ranges;
pub mod routes;
