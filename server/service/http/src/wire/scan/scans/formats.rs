//! Formats of clouds and meshes on the wire.

use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Format of a cloud.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CloudFormatDto {
    /// Binary PLY with σ, order and calibration, as written by `sheaf scan`.
    #[default]
    Ply,
    /// Comma-separated text.
    Csv,
    /// PCD of the Point Cloud Library.
    Pcd,
    /// ASTM E2807.
    E57,
}

impl CloudFormatDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Pcd => "pcd",
            Self::E57 => "e57",
        }
    }
}

/// Format of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshFormatDto {
    /// Binary STL.
    #[default]
    Stl,
    /// glTF, binary.
    Glb,
    /// Binary PLY.
    Ply,
}

impl MeshFormatDto {
    /// Its code.
    pub fn code(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Ply => "ply",
        }
    }
}

/// Selects the format of the cloud.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CloudQuery {
    /// Default `ply`.
    pub format: Option<CloudFormatDto>,
}

/// Selects the format of the mesh.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MeshQuery {
    /// Default `stl`.
    pub format: Option<MeshFormatDto>,
}
