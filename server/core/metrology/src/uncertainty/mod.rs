//! What a value does not say by itself: noise, systematic parts, temperature, and their sum.

pub(crate) mod budget;
pub(crate) mod footprint;
pub(crate) mod noise;
pub(crate) mod systematic;
pub(crate) mod temperature;
