//! What holds for every resource: the document, problems, lists, events, idempotency, the edge, the page.

mod document;
mod edge;
mod events;
mod idempotency;
mod lists;
mod page;
mod problems;
mod untyped;
