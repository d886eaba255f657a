//! Studies by Monte Carlo: what the light models buy, where they break, and how near the fits come to the bound.

pub mod bound;
pub mod fit;
mod page;
pub mod paper;
pub mod regime;
pub mod simulate;
mod table;

pub use page::study_page;
pub use table::{study_json, study_text};
