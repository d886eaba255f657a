//! Monte Carlo studies: accuracy of the light models, their limits, and the distance of the fits from the Cramér–Rao bound.

pub mod bound;
pub mod fit;
mod page;
pub mod paper;
pub mod regime;
pub mod simulate;
mod table;

pub use page::study_page;
pub use table::{study_json, study_text};
