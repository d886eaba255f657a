//! A part from the bytes of an STL file.

use std::borrow::Cow;

use remedy::Remedy;
use stl::StlError;

use crate::part::mesh::{Solid, SolidError};

/// Greatest number of triangles: about 500 MiB of memory with their tree.
pub const STL_MAX_TRIANGLES: usize = 2_000_000;

/// Why a file cannot be read as a part.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PartFileError {
    /// Not STL, or too large.
    #[error(transparent)]
    Stl(#[from] StlError),
    /// Triangles that do not form a part.
    #[error("the triangles do not form a part")]
    Solid(#[source] SolidError),
}

impl Remedy for PartFileError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::Stl(error) => error.remedy(),
            Self::Solid(cause) => cause.remedy(),
        }
    }
}

/// Reads a part from the bytes of an STL file, mm.
///
/// # Errors
/// [`PartFileError`] for a file that is not STL, is truncated or too large, or contains no part.
pub fn read_stl(bytes: &[u8]) -> Result<Solid, PartFileError> {
    Solid::new(&stl::read(bytes, STL_MAX_TRIANGLES)?).map_err(PartFileError::Solid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_without_a_part_are_refused_by_name() {
        let text = |corner: &str| {
            format!("solid part\nfacet\nvertex 0 0 0\nvertex 10 0 0\nvertex {corner}\nendfacet\nendsolid\n")
        };
        assert_eq!(read_stl(text("0 10 0").as_bytes()).unwrap().n_triangles(), 1);
        let infinite = SolidError::NotFinite { triangle_idx: 0 };
        assert_eq!(read_stl(text("0 nan 0").as_bytes()), Err(PartFileError::Solid(infinite)));
        assert_eq!(read_stl(b"solid nothing\nendsolid\n"), Err(PartFileError::Solid(SolidError::Empty)));
        assert!(matches!(read_stl(b"P5 3 3"), Err(PartFileError::Stl(StlError::TooShort { got_bytes: 6 }))));
    }
}
