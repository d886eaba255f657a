//! `target` of the manifest: the calibration board.

use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};

use crate::projector::required;

/// Values of `target.kind`.
const KINDS: &[&str] = &["chessboard", "charuco", "circles", "asymmetric_circles"];

/// The calibration board.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Target {
    /// Black and white squares.
    Chessboard(ChessboardTarget),
    /// A chessboard with markers in its white squares.
    Charuco(CharucoTarget),
    /// Discs in rows and columns.
    Circles(CirclesTarget),
    /// Discs in rows, with every other row shifted by half the spacing of the discs in a row.
    AsymmetricCircles(CirclesTarget),
}

/// Black and white squares.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChessboardTarget {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// Sides of a square.
    pub square_mm: SquareMm,
}

/// A chessboard with markers in its white squares, as OpenCV prints it: the square at the top left is black.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CharucoTarget {
    /// Squares along a board row.
    pub columns: usize,
    /// Squares along a board column.
    pub rows: usize,
    /// Sides of a square.
    pub square_mm: SquareMm,
    /// Side of a marker.
    pub marker_mm: f64,
    /// OpenCV's name of the markers' dictionary, such as `DICT_4X4_50`.
    pub dictionary: String,
}

/// A grid of equal discs, dark on bright or bright on dark.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CirclesTarget {
    /// Discs in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Steps of the grid: the distances between neighbouring centres; for an asymmetric grid the distance between its
    /// rows, and half of that between the centres of a row.
    pub square_mm: SquareMm,
    /// Diameter of a disc.
    pub diameter_mm: f64,
}

/// Sides of a square: one number, or [x, y] if a printer has stretched them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SquareMm {
    /// Along a board row.
    pub x_mm: f64,
    /// Along a board column.
    pub y_mm: f64,
}

impl Target {
    /// Its `kind`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Chessboard(_) => KINDS[0],
            Self::Charuco(_) => KINDS[1],
            Self::Circles(_) => KINDS[2],
            Self::AsymmetricCircles(_) => KINDS[3],
        }
    }

    /// Inner corners, or centres of discs, along a board row and a board column.
    pub fn inner_corners(&self) -> (usize, usize) {
        match self {
            Self::Chessboard(board) => (board.inner_columns, board.inner_rows),
            Self::Charuco(board) => (board.columns.saturating_sub(1), board.rows.saturating_sub(1)),
            Self::Circles(grid) | Self::AsymmetricCircles(grid) => (grid.columns, grid.rows),
        }
    }

    /// The grid of discs, and whether it is asymmetric.
    pub fn circles(&self) -> Option<(&CirclesTarget, bool)> {
        match self {
            Self::Circles(grid) => Some((grid, false)),
            Self::AsymmetricCircles(grid) => Some((grid, true)),
            Self::Chessboard(_) | Self::Charuco(_) => None,
        }
    }

    /// Sides of a square, or steps of a circle grid.
    pub fn square_mm(&self) -> SquareMm {
        match self {
            Self::Chessboard(board) => board.square_mm,
            Self::Charuco(board) => board.square_mm,
            Self::Circles(grid) | Self::AsymmetricCircles(grid) => grid.square_mm,
        }
    }
}

impl From<ChessboardTarget> for Target {
    fn from(board: ChessboardTarget) -> Self {
        Self::Chessboard(board)
    }
}

impl From<f64> for SquareMm {
    fn from(side_mm: f64) -> Self {
        Self { x_mm: side_mm, y_mm: side_mm }
    }
}

impl Serialize for SquareMm {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.x_mm == self.y_mm {
            return serializer.serialize_f64(self.x_mm);
        }
        [self.x_mm, self.y_mm].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for SquareMm {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Sides)
    }
}

/// Visitor for a number or a list of two.
struct Sides;

impl<'de> Visitor<'de> for Sides {
    type Value = SquareMm;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("the side of a square in mm, or [x, y]")
    }

    fn visit_f64<E: Error>(self, side_mm: f64) -> Result<SquareMm, E> {
        Ok(side_mm.into())
    }

    fn visit_u64<E: Error>(self, side_mm: u64) -> Result<SquareMm, E> {
        Ok((side_mm as f64).into())
    }

    fn visit_i64<E: Error>(self, side_mm: i64) -> Result<SquareMm, E> {
        Ok((side_mm as f64).into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sides: A) -> Result<SquareMm, A::Error> {
        let x_mm = sides.next_element()?.ok_or_else(|| A::Error::invalid_length(0, &self))?;
        let y_mm = sides.next_element()?.ok_or_else(|| A::Error::invalid_length(1, &self))?;
        match sides.next_element::<f64>()? {
            Some(_) => Err(A::Error::invalid_length(3, &self)),
            None => Ok(SquareMm { x_mm, y_mm }),
        }
    }
}

/// The keys of all kinds.
#[derive(Deserialize)]
struct Keys {
    kind: Option<String>,
    inner_columns: Option<usize>,
    inner_rows: Option<usize>,
    columns: Option<usize>,
    rows: Option<usize>,
    square_mm: Option<SquareMm>,
    marker_mm: Option<f64>,
    diameter_mm: Option<f64>,
    dictionary: Option<String>,
}

impl<'de> Deserialize<'de> for Target {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let keys = Keys::deserialize(deserializer)?;
        let circles = || -> Result<CirclesTarget, D::Error> {
            Ok(CirclesTarget {
                columns: required(keys.columns, "target.columns")?,
                rows: required(keys.rows, "target.rows")?,
                square_mm: required(keys.square_mm, "target.square_mm")?,
                diameter_mm: required(keys.diameter_mm, "target.diameter_mm")?,
            })
        };
        match required(keys.kind.clone(), "target.kind")?.as_str() {
            "circles" => Ok(Self::Circles(circles()?)),
            "asymmetric_circles" => Ok(Self::AsymmetricCircles(circles()?)),
            "chessboard" => Ok(Self::Chessboard(ChessboardTarget {
                inner_columns: required(keys.inner_columns, "target.inner_columns")?,
                inner_rows: required(keys.inner_rows, "target.inner_rows")?,
                square_mm: required(keys.square_mm, "target.square_mm")?,
            })),
            "charuco" => Ok(Self::Charuco(CharucoTarget {
                columns: required(keys.columns, "target.columns")?,
                rows: required(keys.rows, "target.rows")?,
                square_mm: required(keys.square_mm, "target.square_mm")?,
                marker_mm: required(keys.marker_mm, "target.marker_mm")?,
                dictionary: required(keys.dictionary, "target.dictionary")?,
            })),
            other => Err(D::Error::unknown_variant(other, KINDS)),
        }
    }
}
