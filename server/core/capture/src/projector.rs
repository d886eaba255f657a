//! `projector` of the manifest: the nominal values of the line projector.

use std::borrow::Cow;

use remedy::Remedy;
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use vision::LineDirection;

use crate::params::{LINES_MAX, ORDER_LIMIT};

/// Value of `line_direction` for lines along image columns.
pub(crate) const COLUMNS: &str = "columns";

/// Value of `line_direction` for lines along image rows.
pub(crate) const ROWS: &str = "rows";

/// Values of `projector.kind`.
const KINDS: &[&str] = &["grating", "planes", "cross"];

/// The lines of a cross, by their numbers.
const CROSS: [(i8, LineDirection); 2] = [(0, LineDirection::Rows), (1, LineDirection::Columns)];

/// Beginning of the parser's error for a missing entry with its whole path, up to a backtick.
pub(crate) const MISSING: &str = "missing entry `";

/// The line projector.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Projector {
    /// One laser behind a grating; the default `kind`.
    Grating(GratingProjector),
    /// Independent lasers, or independent lines of one.
    Planes(PlanesProjector),
    /// Two lines that cross, of one laser or two: line 0 along rows, line 1 along columns.
    Cross(CrossProjector),
}

/// Nominal values of laser and grating.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GratingProjector {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves per millimetre.
    pub grating_lines_per_mm: f64,
    /// Orders from the top (left) of the image downwards (rightwards).
    pub orders: Vec<i8>,
    /// `rows` (default) or `columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_direction: Option<String>,
}

/// Independent lasers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanesProjector {
    /// Number of lines. They are numbered from 0, from the top (left) of the image downwards (rightwards).
    pub lines: usize,
    /// `rows` (default) or `columns`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_direction: Option<String>,
    /// Whether they are switched on one by one; every image then states its line.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub switched: bool,
}

/// Two lines that cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CrossProjector {
    /// Whether they are lit one by one, as for [`PlanesProjector::switched`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub switched: bool,
}

impl Projector {
    /// The labels of the lines from the top (left) of the image downwards (rightwards): orders of a grating, or
    /// numbers of independent lines; for a cross, that along rows first.
    pub fn orders(&self) -> Vec<i8> {
        match self {
            Self::Grating(grating) => grating.orders.clone(),
            Self::Planes(planes) => (0..=i8::MAX).take(planes.lines).collect(),
            Self::Cross(_) => CROSS.map(|(line, _)| line).to_vec(),
        }
    }

    /// Number of lines switched on one by one; `None` if they are on together.
    pub fn switched_lines(&self) -> Option<usize> {
        match self {
            Self::Planes(planes) if planes.switched => Some(planes.lines),
            Self::Cross(cross) if cross.switched => Some(CROSS.len()),
            _ => None,
        }
    }

    /// The lines of a cross and their directions, if both are on together; otherwise `None`.
    pub fn crossing_lines(&self) -> Option<[(i8, LineDirection); 2]> {
        matches!(self, Self::Cross(cross) if !cross.switched).then_some(CROSS)
    }

    /// Direction of a line in the images.
    pub fn direction_of(&self, line: i8) -> LineDirection {
        match self {
            Self::Cross(_) => {
                CROSS.iter().find(|(other, _)| *other == line).map_or(CROSS[0].1, |(_, direction)| *direction)
            }
            _ => direction(self.line_direction()),
        }
    }

    /// Directions of the lines in the images.
    pub fn directions(&self) -> Vec<LineDirection> {
        match self {
            Self::Cross(_) => CROSS.map(|(_, direction)| direction).to_vec(),
            _ => vec![direction(self.line_direction())],
        }
    }

    /// The line direction as written, if all lines have the same.
    pub(crate) fn line_direction(&self) -> Option<&str> {
        match self {
            Self::Grating(grating) => grating.line_direction.as_deref(),
            Self::Planes(planes) => planes.line_direction.as_deref(),
            Self::Cross(_) => None,
        }
    }
}

/// The first entry of a projector that is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("projector.{entry} cannot be {found}")]
pub struct ProjectorError {
    /// The entry within the projector.
    pub entry: &'static str,
    /// Its value.
    pub found: String,
    /// The allowed values.
    pub allowed: String,
}

impl Remedy for ProjectorError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(format!("give {}", self.allowed).into())
    }
}

impl Projector {
    /// The name of the kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Grating(_) => "grating",
            Self::Planes(_) => "planes",
            Self::Cross(_) => "cross",
        }
    }

    /// Checks the values by the rules of the manifest.
    ///
    /// # Errors
    /// [`ProjectorError`] names the first entry that is wrong.
    pub fn check(&self) -> Result<(), ProjectorError> {
        let within = |entry, right: bool, found: String, allowed: &str| {
            if right { Ok(()) } else { Err(ProjectorError { entry, found, allowed: allowed.to_owned() }) }
        };
        if let Some(word) = self.line_direction() {
            let known = matches!(word, COLUMNS | ROWS);
            within("line_direction", known, format!("\"{word}\""), "rows or columns")?;
        }
        match self {
            Self::Grating(grating) => {
                let positive = |entry, value: f64| {
                    let right = value > 0.0 && value.is_finite();
                    within(entry, right, value.to_string(), "a number above 0, from the data sheet")
                };
                positive("wavelength_nm", grating.wavelength_nm)?;
                positive("grating_lines_per_mm", grating.grating_lines_per_mm)?;
                let orders = &grating.orders;
                let rising = orders.is_sorted_by(|a, b| a < b) || orders.is_sorted_by(|a, b| a > b);
                let small = orders.iter().all(|order| order.unsigned_abs() <= ORDER_LIMIT.unsigned_abs());
                let right = !orders.is_empty() && rising && small;
                let allowed = format!("each order once, from the top of the image, up to ±{ORDER_LIMIT}");
                within("orders", right, format!("{orders:?}"), &allowed)
            }
            Self::Planes(planes) => {
                let allowed = format!("the number of lines, 1 to {LINES_MAX}");
                let right = (1..=LINES_MAX).contains(&planes.lines);
                within("lines", right, planes.lines.to_string(), &allowed)
            }
            Self::Cross(_) => Ok(()),
        }
    }
}

impl GratingProjector {
    /// Direction of the lines in the images.
    pub fn direction(&self) -> LineDirection {
        direction(self.line_direction.as_deref())
    }

    /// λ/d_g, the sine of the angle between neighbouring orders at normal incidence.
    pub fn wavelength_over_period(&self) -> f64 {
        self.wavelength_nm * 1e-6 * self.grating_lines_per_mm
    }

    /// The manifest's value for a line direction: `None` for rows, the default.
    pub fn name_of(direction: LineDirection) -> Option<String> {
        (direction == LineDirection::Columns).then(|| COLUMNS.to_owned())
    }
}

impl From<GratingProjector> for Projector {
    fn from(grating: GratingProjector) -> Self {
        Self::Grating(grating)
    }
}

/// The keys of all kinds.
#[derive(Deserialize)]
struct Keys {
    kind: Option<String>,
    wavelength_nm: Option<f64>,
    grating_lines_per_mm: Option<f64>,
    orders: Option<Vec<i8>>,
    lines: Option<usize>,
    #[serde(default)]
    switched: bool,
    line_direction: Option<String>,
}

impl<'de> Deserialize<'de> for Projector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let keys = Keys::deserialize(deserializer)?;
        match keys.kind.as_deref().unwrap_or("grating") {
            "grating" => Ok(Self::Grating(GratingProjector {
                wavelength_nm: required(keys.wavelength_nm, "projector.wavelength_nm")?,
                grating_lines_per_mm: required(keys.grating_lines_per_mm, "projector.grating_lines_per_mm")?,
                orders: required(keys.orders, "projector.orders")?,
                line_direction: keys.line_direction,
            })),
            "planes" => Ok(Self::Planes(PlanesProjector {
                lines: required(keys.lines, "projector.lines")?,
                line_direction: keys.line_direction,
                switched: keys.switched,
            })),
            "cross" => match keys {
                Keys { lines: Some(lines), .. } if lines != CROSS.len() => {
                    Err(D::Error::custom(format_args!("a cross has 2 lines, projector.lines is {lines}")))
                }
                Keys { line_direction: Some(_), .. } => Err(D::Error::custom(
                    "projector.line_direction is stated, but the lines of a cross run both ways: \
                     line 0 along rows, line 1 along columns",
                )),
                Keys { switched, .. } => Ok(Self::Cross(CrossProjector { switched })),
            },
            other => Err(D::Error::unknown_variant(other, KINDS)),
        }
    }
}

/// The value, or an error that names the entry.
pub(crate) fn required<T, E: Error>(value: Option<T>, entry: &'static str) -> Result<T, E> {
    value.ok_or_else(|| E::custom(format_args!("{MISSING}{entry}`")))
}

fn direction(word: Option<&str>) -> LineDirection {
    match word {
        Some(COLUMNS) => LineDirection::Columns,
        _ => LineDirection::Rows,
    }
}
