//! CAD models on the wire.

use serde::{Deserialize, Serialize};
use store::{DamagedRow, ModelRecord};
use utoipa::{IntoParams, ToSchema};

use crate::wire::parse_stored;

/// Name of an uploaded model.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ModelQuery {
    /// Name of the file; its extension, `.stl`, `.glb` or `.ply`, determines the format.
    #[param(min_length = 5, max_length = 100)]
    pub name: String,
}

/// A CAD model: the nominal surface of a part.
#[derive(Debug, Serialize, ToSchema)]
pub struct ModelDto {
    /// Its id.
    pub id: String,
    /// Name of its file.
    pub name: String,
    /// SHA-256 of its file, by which plans name it.
    pub sha256: String,
    /// Size of its file.
    pub size_bytes: u64,
    /// Triangles and dimensions.
    pub summary: ModelSummaryDto,
    /// URL of its file.
    pub file: String,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

/// Triangles and dimensions of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelSummaryDto {
    /// Number of triangles, without degenerate ones.
    pub n_triangles: usize,
    /// Smallest x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub min_mm: [f64; 3],
    /// Largest x, y, z.
    #[schema(min_items = 3, max_items = 3)]
    pub max_mm: [f64; 3],
    /// Area of the surface.
    pub area_mm2: f64,
    /// Whether the surface is closed.
    pub closed: bool,
}

/// URL of a model.
pub fn model_href(id: &str) -> String {
    format!("/api/v1/models/{id}")
}

impl TryFrom<ModelRecord> for ModelDto {
    type Error = DamagedRow;

    fn try_from(record: ModelRecord) -> Result<Self, DamagedRow> {
        let summary = parse_stored("model", &record.id, record.summary)?;
        Ok(Self {
            file: format!("{}/file", model_href(&record.id)),
            id: record.id,
            name: record.name,
            sha256: record.file.as_str().to_owned(),
            size_bytes: record.size_bytes,
            summary,
            created_at_ms: record.created_at_ms,
        })
    }
}
