//! Reads STL files, binary and text, as triangles: three corners each, in the unit of the file (by convention mm).
//! Normals are computed from the corners, not read. Writing files and other formats of meshes do not belong here.

use std::borrow::Cow;

use remedy::Remedy;

/// Three corners.
pub type Triangle = [[f64; 3]; 3];

/// Bytes before the first triangle of a binary file: header and count.
const BINARY_HEADER: usize = 84;

/// Bytes of a triangle of a binary file: normal, three corners, attribute.
const BINARY_TRIANGLE: usize = 50;

/// Why the content cannot be read as STL.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StlError {
    /// Too many triangles.
    #[error("the file declares {count} triangles, more than {max}")]
    TooMany {
        /// Number of triangles.
        count: usize,
        /// The permitted number.
        max: usize,
    },
    /// The length does not match the count.
    #[error("the file declares {count} triangles and has {got_bytes} bytes instead of {needed_bytes}")]
    WrongLength {
        /// Number of triangles in the header.
        count: usize,
        /// Bytes required for them.
        needed_bytes: usize,
        /// Bytes in the file.
        got_bytes: usize,
    },
    /// Neither text nor long enough to be binary.
    #[error("{got_bytes} bytes are not an STL file")]
    TooShort {
        /// Bytes in the file.
        got_bytes: usize,
    },
    /// A syntax error in a text file.
    #[error("line {line}: expected {expected}, found \"{found}\"")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Expected text.
        expected: &'static str,
        /// Text found, shortened.
        found: String,
    },
}

impl StlError {
    /// The remedy.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::TooMany { .. } => "reduce the mesh",
            Self::WrongLength { .. } => "copy it again",
            Self::TooShort { .. } | Self::Syntax { .. } => "export the part again as STL, in mm",
        }
    }
}

impl Remedy for StlError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(self.advice().into())
    }
}

/// Reads the triangles of an STL file, at most `max` of them. Numbers are not checked: corners may be infinite or NaN.
///
/// # Errors
/// [`StlError`] for a file that is truncated, has a wrong count, is not STL, or is too large.
pub fn read(bytes: &[u8], max: usize) -> Result<Vec<Triangle>, StlError> {
    let needed_bytes = |count: usize| BINARY_HEADER + count * BINARY_TRIANGLE;
    match binary_count(bytes) {
        Some(count) if bytes.len() == needed_bytes(count) => binary(bytes, count, max),
        _ if looks_like_text(bytes) => text(bytes, max),
        Some(count) if count > max => Err(StlError::TooMany { count, max }),
        Some(count) => {
            Err(StlError::WrongLength { count, needed_bytes: needed_bytes(count), got_bytes: bytes.len() })
        }
        None => Err(StlError::TooShort { got_bytes: bytes.len() }),
    }
}

fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(BINARY_HEADER - 4..BINARY_HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?) as usize)
}

/// Binary headers may also begin with "solid", but contain zero bytes.
fn looks_like_text(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(1024)];
    start.trim_ascii_start().starts_with(b"solid") && !start.contains(&0)
}

fn binary(bytes: &[u8], count: usize, max: usize) -> Result<Vec<Triangle>, StlError> {
    if count > max {
        return Err(StlError::TooMany { count, max });
    }
    let number = |four: &[u8]| f64::from(f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
    let triangles = bytes[BINARY_HEADER..].chunks_exact(BINARY_TRIANGLE);
    Ok(triangles
        .map(|triangle| {
            std::array::from_fn(|corner| {
                std::array::from_fn(|axis| number(&triangle[12 + 12 * corner + 4 * axis..]))
            })
        })
        .collect())
}

fn text(bytes: &[u8], max: usize) -> Result<Vec<Triangle>, StlError> {
    let text = String::from_utf8_lossy(bytes);
    let mut triangles = Vec::new();
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let mut in_facet = false;
    for (idx, line) in text.lines().enumerate() {
        let wrong =
            |expected| StlError::Syntax { line: idx + 1, expected, found: line.trim().chars().take(40).collect() };
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("facet") if !in_facet => in_facet = true,
            Some("facet") => return Err(wrong("endfacet")),
            Some("vertex") if in_facet && corners.len() < 3 => {
                corners.push(corner(words).ok_or_else(|| wrong("three numbers"))?)
            }
            Some("vertex") => return Err(wrong("a facet of three corners")),
            Some("endfacet") => {
                let three = corners.as_slice().try_into().map_err(|_| wrong("three corners before endfacet"))?;
                if triangles.len() >= max {
                    return Err(StlError::TooMany { count: triangles.len() + 1, max });
                }
                triangles.push(three);
                corners.clear();
                in_facet = false;
            }
            Some("solid" | "outer" | "endloop" | "endsolid") | None => {}
            Some(_) => return Err(wrong("facet, outer loop, vertex, endloop, endfacet or endsolid")),
        }
    }
    if in_facet {
        let line = text.lines().count();
        return Err(StlError::Syntax { line, expected: "endfacet", found: "the end of the file".to_owned() });
    }
    Ok(triangles)
}

fn corner<'t>(mut words: impl Iterator<Item = &'t str>) -> Option<[f64; 3]> {
    let mut next = || words.next()?.parse().ok();
    Some([next()?, next()?, next()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_TRIANGLES: [[[f32; 3]; 3]; 2] = [
        [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]],
        [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]],
    ];

    fn binary_file(triangles: &[[[f32; 3]; 3]], count: u32) -> Vec<u8> {
        let mut bytes = b"solid by a program that writes binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(count.to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn text_file(triangles: &[[[f32; 3]; 3]]) -> String {
        let mut text = "solid part\n".to_owned();
        for triangle in triangles {
            text += "facet normal 0 0 0\n outer loop\n";
            for [x, y, z] in triangle {
                text += &format!("  vertex {x:e} {y} {z}\n");
            }
            text += " endloop\nendfacet\n";
        }
        text + "endsolid part\n"
    }

    #[test]
    fn binary_and_text_files_give_the_same_triangles() {
        let binary = read(&binary_file(&TWO_TRIANGLES, 2), 9).unwrap();
        assert_eq!(binary, TWO_TRIANGLES.map(|triangle| triangle.map(|corner| corner.map(f64::from))));
        assert_eq!(binary, read(text_file(&TWO_TRIANGLES).as_bytes(), 9).unwrap());
    }

    #[test]
    fn damaged_and_oversized_files_are_refused() {
        let whole = binary_file(&TWO_TRIANGLES, 2);
        assert!(matches!(read(&whole[..150], 9), Err(StlError::WrongLength { count: 2, got_bytes: 150, .. })));
        assert!(matches!(read(&binary_file(&TWO_TRIANGLES, 3), 9), Err(StlError::WrongLength { count: 3, .. })));
        for too_many in [binary_file(&TWO_TRIANGLES, u32::MAX), binary_file(&[TWO_TRIANGLES[0]; 10], 10)] {
            assert!(matches!(read(&too_many, 9), Err(StlError::TooMany { max: 9, .. })));
        }
        let text_of_ten = text_file(&[TWO_TRIANGLES[0]; 10]);
        assert!(matches!(read(text_of_ten.as_bytes(), 9), Err(StlError::TooMany { count: 10, max: 9 })));
        assert!(matches!(read(b"P5 3 3", 9), Err(StlError::TooShort { got_bytes: 6 })));
        for (from, to, line) in
            [("vertex 1e1 0", "vertex 1e1", 5), ("endloop", "loop", 7), ("  vertex 0e0 10 0\n", "", 7)]
        {
            let text = text_file(&TWO_TRIANGLES).replacen(from, to, 1);
            assert!(
                matches!(read(text.as_bytes(), 9), Err(StlError::Syntax { line: at, .. }) if at == line),
                "{to}: {text}"
            );
        }
        let cut = text_file(&TWO_TRIANGLES);
        assert!(matches!(read(&cut.as_bytes()[..200], 9), Err(StlError::Syntax { .. })));
    }
}
