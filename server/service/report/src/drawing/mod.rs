//! Markup, plots and pictures, whatever they show.

pub mod cloud_view;
pub mod page;
pub mod palette;
pub mod picture;
pub mod pictures;
pub mod plot;
