//! What commands read besides captures and clouds.

pub mod photographs;
pub mod pixel_row;
pub mod truth;
