//! Recipes, inspections, and statistics over them.

pub mod inspections;
pub mod recipes;
pub mod statistics;
