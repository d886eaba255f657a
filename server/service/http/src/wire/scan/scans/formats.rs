//! Formats of clouds and meshes on the wire.

use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

/// Format of a cloud.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CloudFormatDto {
    /// Binary PLY with σ, order and calibration; as `sheaf scan` writes it.
    #[default]
    Ply,
    /// Text.
    Csv,
    /// Point Cloud Library.
    Pcd,
    /// ASTM E2807.
    E57,
}

impl CloudFormatDto {
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Pcd => "pcd",
            Self::E57 => "e57",
        }
    }
}

/// Format of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, ToSchema)]
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
    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Ply => "ply",
        }
    }
}

/// Which format of the cloud.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct CloudQuery {
    /// `ply` if not said.
    pub format: Option<CloudFormatDto>,
}

/// Which format of the mesh.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct MeshQuery {
    /// `stl` if not said.
    pub format: Option<MeshFormatDto>,
}
