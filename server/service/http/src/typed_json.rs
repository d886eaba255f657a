//! JSON as a type.
//!
//! Every type is read through `dyn Deserializer`, so that its code is compiled once, not once for each source: bytes,
//! values, and values with their paths were a quarter of the machine code of this crate.

use serde::de::{DeserializeOwned, Deserializer};
use serde_path_to_error::Track;

/// An error with its place in the JSON.
pub type PathError = serde_path_to_error::Error<erased_serde::Error>;

/// Reads a value.
///
/// # Errors
/// With the path to what does not fit the type.
pub fn typed<'de, T: DeserializeOwned>(from: impl Deserializer<'de>) -> Result<T, PathError> {
    let mut track = Track::new();
    let with_paths = serde_path_to_error::Deserializer::new(from, &mut track);
    let read = T::deserialize(
        &mut <dyn erased_serde::Deserializer>::erase(with_paths) as &mut dyn erased_serde::Deserializer
    );
    read.map_err(|error| PathError::new(track.path(), error))
}
