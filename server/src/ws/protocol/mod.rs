//! The bytes of `sheaf.v1`, as `openapi/stream.md` specifies them.

pub mod points;
