//! Markup, plots and images, independent of their content.

pub mod cloud_view;
pub mod deviation_map;
pub mod labelled_images;
pub mod page;
pub mod palette;
pub mod paper;
pub mod plot;
pub mod raster;
mod top_grid;
pub mod writer;

#[cfg(test)]
pub use top_grid::point_at;
