//! CAD models of parts.

use serde_json::json;
use station::wall_clock::now_ms;
use store::{ArtifactId, Change, ModelRecord};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, ModelCreated, event};
use crate::resources::labels::label;
use crate::resources::models::{ModelSummary, nominal_of};
use crate::resources::recipes::{ModelFile, RecipeFile};
use crate::resources::stored_scan::new_id;

/// Checks a model and stores it in one transaction with the changes that `and` returns. The extension of its file name
/// determines the format.
///
/// # Errors
/// The file is not a mesh or no oriented surface, or `and` fails.
pub async fn add_model<E: From<AppError>>(
    app: &App,
    by: &Principal,
    name: String,
    bytes: Vec<u8>,
    and: impl FnOnce(&ModelRecord) -> Result<Vec<Change>, E>,
) -> Result<ModelRecord, E> {
    label(&name, "query/name")?;
    let (record, mut changes) = checked_model(app, by, name, bytes).await?;
    changes.extend(and(&record)?);
    app.catalogue.commit(changes).await.map_err(AppError::from)?;
    Ok(record)
}

/// Stores the file of a model whose name is a label; returns its record, and the changes that insert it.
///
/// # Errors
/// The file is not a mesh or no oriented surface.
pub(super) async fn checked_model(
    app: &App,
    by: &Principal,
    name: String,
    bytes: Vec<u8>,
) -> Result<(ModelRecord, Vec<Change>), AppError> {
    let of = name.clone();
    let checked = tokio::task::spawn_blocking(move || {
        let summary = ModelSummary::of(&nominal_of(&of, &bytes)?);
        Ok::<_, AppError>((summary, bytes))
    });
    let (summary, bytes) = checked.await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the model could not be checked").because(cause.to_string())
    })??;
    let file = app.artifacts.put(&bytes).await?;
    let record = ModelRecord {
        id: new_id(),
        name,
        file,
        size_bytes: bytes.len() as u64,
        summary: json!(summary),
        created_at_ms: now_ms(),
    };
    let created = ModelCreated {
        name: record.name.clone(),
        sha256: record.file.as_str().to_owned(),
        actor: by.actor.clone(),
    };
    let changes = vec![Change::InsertModel(record.clone()), event(&record.id, Event::ModelCreated(created))];
    Ok((record, changes))
}

/// The changes that insert the models of a recipe file that are not stored yet.
///
/// # Errors
/// One is damaged, or no oriented surface, at its pointer in the file.
pub(super) async fn models_of_file(app: &App, by: &Principal, file: &RecipeFile) -> Result<Vec<Change>, AppError> {
    let mut changes = Vec::new();
    for (idx, ModelFile { name, sha256, bytes }) in file.model_files()?.into_iter().enumerate() {
        label(&name, &format!("/models/{idx}/name"))?;
        if let Some(id) = ArtifactId::parse(&sha256)
            && app.artifacts.hold(&id).await.is_ok()
        {
            continue;
        }
        let checked = checked_model(app, by, name, bytes).await;
        changes.extend(checked.map_err(|problem| problem.at(format!("/models/{idx}")))?.1);
    }
    Ok(changes)
}

/// Deletes a model. Recipes that name it keep its file.
///
/// # Errors
/// If it does not exist.
pub async fn delete_model(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let gone = event(&id, Event::ModelDeleted(by.initiator()));
    app.catalogue.commit(vec![Change::DeleteModel(id), gone]).await?;
    Ok(())
}
