//! Recipes, inspections, statistics over them, and studies of the station.

pub mod inspections;
pub mod recipes;
pub mod statistics;
pub mod studies;
