//! The line projector on the wire.

use capture::{CrossProjector, GratingProjector, PlanesProjector, Projector};
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

/// Nominal values of the line projector. Without `kind` it is a laser behind a grating.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ProjectorDto {
    /// A laser behind a grating.
    Grating {
        /// Wavelength of the laser.
        wavelength_nm: f64,
        /// Groove density of the grating.
        grating_lines_per_mm: f64,
        /// Orders, from the top (left) of the image.
        orders: Vec<i8>,
        /// Lines run along image `rows` or `columns`.
        line_direction: String,
    },
    /// Independent lasers, or independent lines of one, on together.
    Planes {
        /// Number of lines, 1 to 41; they are numbered from 0, from the top (left) of the image.
        lines: usize,
        /// Lines run along image `rows` or `columns`.
        line_direction: String,
    },
    /// Two lines that cross: line 0 along rows, line 1 along columns. Only in captures, not on a station.
    Cross,
}

impl<'de> Deserialize<'de> for ProjectorDto {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Projector::deserialize(deserializer).map(Into::into)
    }
}

impl From<Projector> for ProjectorDto {
    fn from(of: Projector) -> Self {
        let named = |direction: Option<String>| direction.unwrap_or_else(|| "rows".to_owned());
        match of {
            Projector::Grating(GratingProjector {
                wavelength_nm,
                grating_lines_per_mm,
                orders,
                line_direction,
            }) => Self::Grating {
                wavelength_nm,
                grating_lines_per_mm,
                orders,
                line_direction: named(line_direction),
            },
            Projector::Planes(PlanesProjector { lines, line_direction, switched: _ }) => {
                Self::Planes { lines, line_direction: named(line_direction) }
            }
            Projector::Cross(_) => Self::Cross,
        }
    }
}

impl From<ProjectorDto> for Projector {
    fn from(dto: ProjectorDto) -> Self {
        let of = |word: String| (word != "rows").then_some(word);
        match dto {
            ProjectorDto::Grating { wavelength_nm, grating_lines_per_mm, orders, line_direction } => {
                let line_direction = of(line_direction);
                Self::Grating(GratingProjector { wavelength_nm, grating_lines_per_mm, orders, line_direction })
            }
            ProjectorDto::Planes { lines, line_direction } => {
                Self::Planes(PlanesProjector { lines, line_direction: of(line_direction), switched: false })
            }
            ProjectorDto::Cross => Self::Cross(CrossProjector::default()),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_kind_of_projector_survives_a_round_trip() {
        let projectors = [
            json!({ "kind": "grating", "wavelength_nm": 660.0, "grating_lines_per_mm": 50.0, "orders": [-1, 0, 1],
                "line_direction": "rows" }),
            json!({ "kind": "planes", "lines": 2, "line_direction": "columns" }),
            json!({ "kind": "cross" }),
        ];
        for projector in projectors {
            let dto: ProjectorDto = serde_json::from_value(projector.clone()).unwrap();
            assert_eq!(serde_json::to_value(ProjectorDto::from(Projector::from(dto))).unwrap(), projector);
        }
    }

    #[test]
    fn a_projector_without_a_kind_is_a_grating_and_a_missing_entry_is_named() {
        let grating = json!({ "wavelength_nm": 660, "grating_lines_per_mm": 50, "orders": [0] });
        let dto: ProjectorDto = serde_json::from_value(grating).unwrap();
        assert!(matches!(dto, ProjectorDto::Grating { ref line_direction, .. } if line_direction == "rows"));
        let error = serde_json::from_value::<ProjectorDto>(json!({ "kind": "planes" })).unwrap_err().to_string();
        assert!(error.contains("projector.lines"), "{error}");
    }
}
