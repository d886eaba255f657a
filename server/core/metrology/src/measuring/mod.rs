//! Values of fitted shapes with their uncertainty.
pub(crate) mod budget;
pub(crate) mod find;
pub(crate) mod form;
pub(crate) mod measure;
pub(crate) mod missing;
pub(crate) mod noise;
pub(crate) mod systematic;
pub(crate) mod temperature;
pub(crate) mod value;
