//! CAD models: nominal surfaces of parts, which plans name by the hash of their file.

use std::collections::HashMap;
use std::path::Path;

use metrology::{Measure, ModelRef, Models, Nominal, Plan};
use pipeline::Failure;
use scanning::MeshFormat;
use scanning::files::read_mesh_from;
use serde::{Deserialize, Serialize};
use store::{ArtifactId, Artifacts, StoreError};

use crate::error::{AppError, ErrorKind};
use crate::resources::recipes::RecipeFileModel;
use crate::resources::recipes::check::refused;

/// What a model is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelSummary {
    /// Number of triangles, without degenerate ones.
    pub n_triangles: usize,
    /// Smallest x, y, z, mm.
    pub min_mm: [f64; 3],
    /// Largest x, y, z, mm.
    pub max_mm: [f64; 3],
    /// Area, mm².
    pub area_mm2: f64,
    /// Whether the surface is closed.
    pub closed: bool,
}

/// The nominal surface in the bytes of a file; the name tells its format.
///
/// # Errors
/// The file is not a mesh, or no oriented surface.
pub fn nominal_of(name: &str, bytes: &[u8]) -> Result<Nominal, AppError> {
    let format = MeshFormat::from_path(Path::new(name)).map_err(|_| {
        refused("query/name", format!("\"{name}\" is no STL, GLB or PLY file"), "end it with .stl, .glb or .ply")
    })?;
    let mesh = read_mesh_from(bytes, format).map_err(|error| {
        AppError::new(ErrorKind::Impossible, format!("{name} cannot be read"))
            .because(error.to_string())
            .remedy("export the model again as binary STL, GLB or PLY")
    })?;
    Nominal::new(&mesh).map_err(|error| Failure::from(error).into())
}

impl ModelSummary {
    /// Of a surface.
    pub fn of(nominal: &Nominal) -> Self {
        let [min_mm, max_mm] = nominal.bounds_mm();
        Self {
            n_triangles: nominal.n_triangles(),
            min_mm,
            max_mm,
            area_mm2: nominal.area_mm2(),
            closed: nominal.is_closed,
        }
    }
}

/// The models that a plan names, each with the index of the first characteristic that does.
pub(crate) fn named_by(plan: &Plan) -> impl Iterator<Item = (usize, &ModelRef)> {
    plan.characteristics.iter().enumerate().filter_map(|(idx, characteristic)| match &characteristic.measure {
        Measure::SurfaceProfile { model, .. } => Some((idx, model)),
        _ => None,
    })
}

/// The plan with those of its surface profiles that `wanted` accepts by their ids, and no other characteristic.
pub fn surface_profiles(plan: &Plan, wanted: impl Fn(&str) -> bool) -> Plan {
    let mut plan = plan.clone();
    plan.characteristics.retain(|one| wanted(&one.id) && matches!(one.measure, Measure::SurfaceProfile { .. }));
    plan
}

/// Holds the files of all models that a plan names until a record refers to them; `place` is the pointer of the plan in the
/// request.
///
/// # Errors
/// A model is not stored here, or is no mesh, at its pointer.
pub async fn hold_models(artifacts: &dyn Artifacts, plan: &Plan, place: &str) -> Result<(), AppError> {
    for (idx, model) in named_by(plan) {
        let pointer = pointer_of(place, idx);
        let held = match artifact_of(model) {
            Some(id) => artifacts.hold(&id).await,
            None => Err(StoreError::NotFound { kind: "model", id: model.sha256.clone() }),
        };
        match held {
            Ok(()) => drop(nominal(artifacts, model).await.map_err(|problem| problem.at(pointer))?),
            Err(StoreError::NotFound { .. }) => {
                return Err(unknown(model, pointer));
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

fn pointer_of(place: &str, idx: usize) -> String {
    format!("{place}/characteristics/{idx}/measure/model")
}

fn unknown(model: &ModelRef, pointer: String) -> AppError {
    let detail = format!("the model {} is not stored here", model.name);
    refused(pointer, detail, "upload it: POST /api/v1/models")
}

/// Refuses a plan that names a model that is not among `models`.
///
/// # Errors
/// At the pointer of the first such model.
pub fn require_models(models: &Models, plan: &Plan, place: &str) -> Result<(), AppError> {
    let is_missing = |(_, model): &(usize, &ModelRef)| !models.contains_key(&model.sha256.to_ascii_lowercase());
    match named_by(plan).find(is_missing) {
        Some((idx, model)) => Err(unknown(model, pointer_of(place, idx))),
        None => Ok(()),
    }
}

/// The surfaces of all models that a plan names. A missing one makes its characteristics invalid.
///
/// # Errors
/// A file is damaged.
pub async fn models_of(artifacts: &dyn Artifacts, plan: &Plan) -> Result<Models, AppError> {
    let mut models: Models = HashMap::new();
    for (_, model) in named_by(plan) {
        let sha256 = model.sha256.to_ascii_lowercase();
        if !models.contains_key(&sha256)
            && let Some(nominal) = nominal(artifacts, model).await?
        {
            models.insert(sha256, nominal);
        }
    }
    Ok(models)
}

/// The surface of a model; `None` if it is not stored.
async fn nominal(artifacts: &dyn Artifacts, model: &ModelRef) -> Result<Option<Nominal>, AppError> {
    let Some(id) = artifact_of(model) else { return Ok(None) };
    let what = format!("the model {}", model.name);
    let bytes = match artifacts.read(&id).await {
        Ok(bytes) => bytes,
        Err(StoreError::NotFound { .. }) => return Ok(None),
        Err(error) => return Err(AppError::from(error).of_stored(&what)),
    };
    let name = model.name.clone();
    let read = tokio::task::spawn_blocking(move || nominal_of(&name, &bytes)).await;
    Ok(Some(read.map_err(|cause| AppError::damaged(&what, cause.to_string()))??))
}

/// The models that a plan names, each once, for its file.
///
/// # Errors
/// One is damaged or not stored.
pub async fn models_in_file(artifacts: &dyn Artifacts, plan: &Plan) -> Result<Vec<RecipeFileModel>, AppError> {
    let mut models: Vec<RecipeFileModel> = Vec::new();
    for (_, model) in named_by(plan) {
        if models.iter().any(|known| known.sha256.eq_ignore_ascii_case(&model.sha256)) {
            continue;
        }
        let read = match artifact_of(model) {
            Some(id) => artifacts.read(&id).await,
            None => Err(StoreError::NotFound { kind: "model", id: model.sha256.clone() }),
        };
        let bytes = read.map_err(|error| AppError::from(error).of_stored(&format!("the model {}", model.name)))?;
        models.push(RecipeFileModel::of(model, &bytes));
    }
    Ok(models)
}

fn artifact_of(model: &ModelRef) -> Option<ArtifactId> {
    ArtifactId::parse(&model.sha256.to_ascii_lowercase())
}
