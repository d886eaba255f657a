//! Gauge R&R: how much of the observed variation comes from the measuring system.
//!
//! A crossed study: every operator measures every part equally often. With one operator it is the study of an automatic
//! measuring system (type 3), without reproducibility.

mod anova;
mod average_and_range;
mod result;
mod study;

pub use anova::anova;
pub use average_and_range::average_and_range;
pub use result::{
    Acceptance, AnovaRow, Component, GaugeRr, GaugeRrError, InteractionTest, Method, Source, acceptance,
};
pub use study::{Reading, Study, StudyError};
