//! The live stream: WebSocket sub-protocol `sheaf.v1`, specified in `openapi/stream.md`.

pub mod protocol;
