//! What is done to every request and answer, whatever it asks for.

pub mod guard;
pub mod headers;
pub mod heavy;
pub mod metering;
pub mod objects_only;
