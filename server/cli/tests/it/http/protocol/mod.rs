//! Properties of all resources: the document, problems, lists, events, idempotency, the edge.

mod document;
mod edge;
mod events;
mod idempotency;
mod lists;
mod problems;
mod untyped;
