//! Recipes on the wire.

pub mod plan_document;
pub mod recipes;
pub mod requests;
