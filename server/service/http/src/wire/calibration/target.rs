//! The calibration board on the wire.

use capture::{CharucoTarget, ChessboardTarget, CirclesTarget, SquareMm, Target};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

/// The calibration board. Without `kind` it is a chessboard.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum TargetDto {
    /// A chessboard.
    Chessboard {
        /// Inner corners along a row.
        inner_columns: usize,
        /// Inner corners along a column.
        inner_rows: usize,
        /// Square size, or [along a row, along a column] if the print is stretched.
        square_mm: SquareMmDto,
    },
    /// A ChArUco board in OpenCV's layout: the square at the top left is black.
    Charuco {
        /// Squares along a row.
        columns: usize,
        /// Squares along a column.
        rows: usize,
        /// Square size, or [along a row, along a column] if the print is stretched.
        square_mm: SquareMmDto,
        /// Marker size.
        marker_mm: f64,
        /// OpenCV name of the marker dictionary, such as `DICT_4X4_50`.
        dictionary: String,
    },
    /// A symmetric circle grid.
    Circles {
        /// Discs in a row.
        columns: usize,
        /// Rows.
        rows: usize,
        /// Distance between neighbouring centres, or [along a row, along a column].
        square_mm: SquareMmDto,
        /// Diameter of a disc.
        diameter_mm: f64,
    },
    /// An asymmetric circle grid: every other row is shifted by half the spacing of the discs in a row.
    AsymmetricCircles {
        /// Discs in a row.
        columns: usize,
        /// Rows.
        rows: usize,
        /// Row spacing, which is half the disc spacing within a row; or [half the disc spacing, row spacing].
        square_mm: SquareMmDto,
        /// Diameter of a disc.
        diameter_mm: f64,
    },
}

/// One length, or one along a row and one along a column of the board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum SquareMmDto {
    /// The same in both directions.
    Square(f64),
    /// Along a row, along a column.
    Sides([f64; 2]),
}

impl<'de> Deserialize<'de> for TargetDto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut target = Map::deserialize(deserializer)?;
        target.entry("kind").or_insert_with(|| "chessboard".into());
        Target::deserialize(Value::Object(target)).map(Into::into).map_err(D::Error::custom)
    }
}

impl From<Target> for TargetDto {
    fn from(target: Target) -> Self {
        match target {
            Target::Chessboard(ChessboardTarget { inner_columns, inner_rows, square_mm }) => {
                Self::Chessboard { inner_columns, inner_rows, square_mm: square_mm.into() }
            }
            Target::Charuco(CharucoTarget { columns, rows, square_mm, marker_mm, dictionary }) => {
                Self::Charuco { columns, rows, square_mm: square_mm.into(), marker_mm, dictionary }
            }
            Target::Circles(CirclesTarget { columns, rows, square_mm, diameter_mm }) => {
                Self::Circles { columns, rows, square_mm: square_mm.into(), diameter_mm }
            }
            Target::AsymmetricCircles(CirclesTarget { columns, rows, square_mm, diameter_mm }) => {
                Self::AsymmetricCircles { columns, rows, square_mm: square_mm.into(), diameter_mm }
            }
        }
    }
}

impl From<TargetDto> for Target {
    fn from(dto: TargetDto) -> Self {
        match dto {
            TargetDto::Chessboard { inner_columns, inner_rows, square_mm } => {
                Self::Chessboard(ChessboardTarget { inner_columns, inner_rows, square_mm: square_mm.into() })
            }
            TargetDto::Charuco { columns, rows, square_mm, marker_mm, dictionary } => {
                let square_mm = square_mm.into();
                Self::Charuco(CharucoTarget { columns, rows, square_mm, marker_mm, dictionary })
            }
            TargetDto::Circles { columns, rows, square_mm, diameter_mm } => {
                Self::Circles(CirclesTarget { columns, rows, square_mm: square_mm.into(), diameter_mm })
            }
            TargetDto::AsymmetricCircles { columns, rows, square_mm, diameter_mm } => {
                Self::AsymmetricCircles(CirclesTarget { columns, rows, square_mm: square_mm.into(), diameter_mm })
            }
        }
    }
}

impl From<SquareMm> for SquareMmDto {
    fn from(SquareMm { x_mm, y_mm }: SquareMm) -> Self {
        if x_mm == y_mm { Self::Square(x_mm) } else { Self::Sides([x_mm, y_mm]) }
    }
}

impl From<SquareMmDto> for SquareMm {
    fn from(dto: SquareMmDto) -> Self {
        match dto {
            SquareMmDto::Square(side_mm) => side_mm.into(),
            SquareMmDto::Sides([x_mm, y_mm]) => Self { x_mm, y_mm },
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_kind_of_board_survives_a_round_trip() {
        let boards = [
            json!({ "kind": "chessboard", "inner_columns": 11, "inner_rows": 8, "square_mm": [12.0, 12.1] }),
            json!({ "kind": "charuco", "columns": 10, "rows": 7, "square_mm": 12.0, "marker_mm": 9.0,
                "dictionary": "DICT_5X5_100" }),
            json!({ "kind": "circles", "columns": 9, "rows": 7, "square_mm": 15.0, "diameter_mm": 8.0 }),
            json!({ "kind": "asymmetric_circles", "columns": 4, "rows": 11, "square_mm": 10.0, "diameter_mm": 8.0 }),
        ];
        for board in boards {
            let dto: TargetDto = serde_json::from_value(board.clone()).unwrap();
            assert_eq!(serde_json::to_value(TargetDto::from(Target::from(dto))).unwrap(), board);
        }
    }

    #[test]
    fn a_board_without_a_kind_is_a_chessboard_and_a_missing_entry_is_named() {
        let board = json!({ "inner_columns": 11, "inner_rows": 8, "square_mm": 12 });
        let dto: TargetDto = serde_json::from_value(board).unwrap();
        let square_mm = SquareMmDto::Square(12.0);
        assert_eq!(dto, TargetDto::Chessboard { inner_columns: 11, inner_rows: 8, square_mm });
        let grid = json!({ "kind": "circles", "columns": 9, "rows": 7, "square_mm": 15.0 });
        let error = serde_json::from_value::<TargetDto>(grid).unwrap_err().to_string();
        assert!(error.contains("target.diameter_mm"), "{error}");
    }
}
