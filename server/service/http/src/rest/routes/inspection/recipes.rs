//! Recipes: publish, compare, restore and archive versions; import and export files.

use crate::Http;
use app::error::ErrorKind;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use store::{DamagedRow, RecipeFilter, RecipeVersionRecord};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::limits::RECIPE_FILE_LIMIT_BYTES;
use crate::problem::{Problem, ProblemKind};
use crate::rest::answers::{Reply, bytes};
use crate::rest::control::By;
use crate::rest::etag::{Versioned, check};
use crate::rest::extract::{ApiJson, ApiPath, ApiQuery};
use crate::rest::idempotency::{Begun, begin};
use crate::wire::paging::{ListDto, PageQuery, page, path_with};
use crate::wire::recipe::recipes::{
    NewestRecipeDto, PlaceChangeDto, RecipeDifferenceDto, RecipeFileDto, RecipeItemDto, RecipeVersionDto,
    recipe_href, version_href,
};
use crate::wire::recipe::requests::{
    CreateRecipeDto, PublishRecipeDto, RecipeDiffQuery, RecipesQuery, RollBackRecipeDto,
};
use app::App;
use app::models::models_in_file;
use app::recipes::{RecipeFile, RecipeVersion, changes_between, newest_version, stored_version};
use app::use_cases::{self, NewVersion};

/// The routes.
pub fn routes() -> OpenApiRouter<Http> {
    OpenApiRouter::new()
        .routes(routes!(list_recipes, create_recipe))
        .routes(routes!(import_recipe))
        .routes(routes!(get_recipe))
        .routes(routes!(list_recipe_versions, publish_recipe))
        .routes(routes!(get_recipe_version))
        .routes(routes!(export_recipe))
        .routes(routes!(diff_recipe))
        .routes(routes!(roll_back_recipe))
        .routes(routes!(archive_recipe))
        .routes(routes!(restore_recipe))
}

/// 201 with the version, whose number is the `ETag` of the recipe.
fn published(version: &RecipeVersion) -> Reply {
    let href = version_href(&version.id, version.version);
    Reply {
        version: Some(version.version.to_string()),
        ..Reply::created(href, &RecipeVersionDto::from(version.clone()))
    }
}

/// Lists recipes with their newest version, most recently created first.
#[utoipa::path(
    get, path = "/recipes", tag = "recipes", params(RecipesQuery),
    responses((status = 200, body = ListDto<RecipeItemDto>))
)]
async fn list_recipes(
    State(app): State<App>,
    ApiQuery(query): ApiQuery<RecipesQuery>,
) -> Result<Json<ListDto<RecipeItemDto>>, Problem> {
    let page = page(query.before, query.limit)?;
    let archived = query.archived.map(|archived| archived.to_string());
    let number = query.number.map(|number| number.to_string());
    let path = path_with("/api/v1/recipes", &[("archived", archived.as_deref()), ("number", number.as_deref())]);
    let filter = RecipeFilter { archived: query.archived, number: query.number };
    let mut listed = app.catalogue.read().recipes(&filter, &page).await?;
    let mut items = Vec::new();
    for record in std::mem::take(&mut listed.records) {
        match stored_version(&app.catalogue, &record.id, record.newest).await {
            Ok(version) => items.push(RecipeItemDto::from((record, version))),
            Err(problem) if problem.kind == ErrorKind::Damaged => {
                listed.damaged.push(DamagedRow { kind: "recipe", id: record.id });
            }
            Err(problem) => return Err(problem.into()),
        }
    }
    let list = ListDto::new(&path, &page, listed, |_| unreachable!("the records were taken"));
    Ok(Json(ListDto { items, ..list }))
}

/// Creates a recipe with version 1.
#[utoipa::path(
    post, path = "/recipes", tag = "recipes", request_body = CreateRecipeDto,
    responses((status = 201, body = RecipeVersionDto,
        headers(("ETag" = String, description = "The version"), ("Location" = String, description = "Its address"))))
)]
async fn create_recipe(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<CreateRecipeDto>,
) -> Result<Reply, Problem> {
    let once = match begin(&app, &headers, "POST recipes", &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let CreateRecipeDto { id, reason, recipe } = body.value;
    let new = NewVersion { id, after: 0, reason, recipe: recipe.into() };
    let version = use_cases::publish_recipe(&app, &by, new, |version| once.changes(&published(version))).await?;
    Ok(published(&version))
}

/// Imports a file with its CAD models, at most 96 MiB: creates the recipe, or publishes its next version, which requires
/// `If-Match`. If the newest version already has the same content, nothing is changed.
#[utoipa::path(
    post, path = "/recipes/import", tag = "recipes", request_body = RecipeFileDto,
    params(("If-Match" = Option<String>, Header, description = "ETag of the recipe, or `*`, if there is one with this id")),
    responses((status = 201, body = RecipeVersionDto,
        headers(("ETag" = String, description = "The version"), ("Location" = String, description = "Its address"))))
)]
async fn import_recipe(
    State(app): State<App>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<RecipeFileDto, RECIPE_FILE_LIMIT_BYTES>,
) -> Result<Reply, Problem> {
    let once = match begin(&app, &headers, "POST recipes/import", &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let file = RecipeFile::from(body.value);
    let after = match app.catalogue.read().recipe(&file.id).await {
        Ok(recipe) => {
            check(&headers, &recipe.newest.to_string())?;
            recipe.newest
        }
        Err(store::StoreError::NotFound { .. }) => 0,
        Err(error) => return Err(error.into()),
    };
    let and = |version: &RecipeVersion| once.changes(&published(version));
    Ok(published(&use_cases::import_recipe(&app, &by, file, after, and).await?))
}

/// Returns a recipe with its newest version; the `ETag` is needed to change it.
#[utoipa::path(
    get, path = "/recipes/{id}", tag = "recipes", params(("id" = String, Path)),
    responses((status = 200, body = NewestRecipeDto, headers(("ETag" = String, description = "The version"))))
)]
async fn get_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
) -> Result<Versioned<Json<NewestRecipeDto>>, Problem> {
    newest(&app, &id).await
}

async fn newest(app: &App, id: &str) -> Result<Versioned<Json<NewestRecipeDto>>, Problem> {
    let (record, version) = newest_version(&app.catalogue, id).await?;
    let tag = version.version.to_string();
    Ok(Versioned(tag, Json(NewestRecipeDto { archived: record.archived, newest: version.into() })))
}

/// Lists the versions of a recipe, newest first.
#[utoipa::path(
    get, path = "/recipes/{id}/versions", tag = "recipes", params(("id" = String, Path), PageQuery),
    responses((status = 200, body = ListDto<RecipeVersionDto>))
)]
async fn list_recipe_versions(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<PageQuery>,
) -> Result<Json<ListDto<RecipeVersionDto>>, Problem> {
    let page = query.page()?;
    app.catalogue.read().recipe(&id).await?;
    let listed = app.catalogue.read().recipe_versions(&id, &page).await?;
    let dto = |record: RecipeVersionRecord| {
        let row = DamagedRow { kind: "recipe version", id: format!("{}@{}", record.recipe_id, record.version) };
        RecipeVersion::of(record).map(RecipeVersionDto::from).map_err(|_| row)
    };
    Ok(Json(ListDto::whole_of(&format!("{}/versions", recipe_href(&id)), &page, listed, dto)))
}

/// Publishes the next version of a recipe. Inspections already requested keep their version.
#[utoipa::path(
    post, path = "/recipes/{id}/versions", tag = "recipes", request_body = PublishRecipeDto,
    params(
        ("id" = String, Path),
        ("If-Match" = String, Header, description = "ETag of the recipe, or `*`")
    ),
    responses((status = 201, body = RecipeVersionDto,
        headers(("ETag" = String, description = "The version"), ("Location" = String, description = "Its address"))))
)]
async fn publish_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<PublishRecipeDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST recipes/{id}/versions");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let after = app.catalogue.read().recipe(&id).await?.newest;
    check(&headers, &after.to_string())?;
    let PublishRecipeDto { reason, recipe } = body.value;
    let new = NewVersion { id, after, reason, recipe: recipe.into() };
    let version = use_cases::publish_recipe(&app, &by, new, |version| once.changes(&published(version))).await?;
    Ok(published(&version))
}

/// Returns a version of a recipe.
#[utoipa::path(
    get, path = "/recipes/{id}/versions/{version}", tag = "recipes",
    params(("id" = String, Path), ("version" = i64, Path)),
    responses((status = 200, body = RecipeVersionDto))
)]
async fn get_recipe_version(
    State(app): State<App>,
    ApiPath((id, version)): ApiPath<(String, i64)>,
) -> Result<Json<RecipeVersionDto>, Problem> {
    Ok(Json(stored_version(&app.catalogue, &id, version).await?.into()))
}

/// Downloads a version of a recipe with the CAD models that it names, as a file for another station.
#[utoipa::path(
    get, path = "/recipes/{id}/versions/{version}/file", tag = "recipes",
    params(("id" = String, Path), ("version" = i64, Path)),
    responses((status = 200, body = RecipeFileDto, content_type = "application/json"))
)]
async fn export_recipe(
    State(app): State<App>,
    ApiPath((id, version)): ApiPath<(String, i64)>,
) -> Result<Response, Problem> {
    let version = stored_version(&app.catalogue, &id, version).await?;
    let name = format!("{id}-{}.recipe.json", version.version);
    let models = models_in_file(&*app.artifacts, &version.recipe.plan).await?;
    let file = RecipeFileDto::from(RecipeFile::of(version, models));
    let text = serde_json::to_string_pretty(&file).map_err(|cause| {
        Problem::new(ProblemKind::Internal, "the recipe cannot be written").because(cause.to_string())
    })?;
    Ok(bytes("application/json", Some(&name), text))
}

/// Compares two versions of a recipe.
#[utoipa::path(
    get, path = "/recipes/{id}/diff", tag = "recipes", params(("id" = String, Path), RecipeDiffQuery),
    responses((status = 200, body = RecipeDifferenceDto))
)]
async fn diff_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    ApiQuery(query): ApiQuery<RecipeDiffQuery>,
) -> Result<Json<RecipeDifferenceDto>, Problem> {
    let recipe = app.catalogue.read().recipe(&id).await?;
    let to = query.to.unwrap_or(recipe.newest);
    let from = query.from.unwrap_or(to.saturating_sub(1).max(1));
    let (old, new) =
        (stored_version(&app.catalogue, &id, from).await?, stored_version(&app.catalogue, &id, to).await?);
    let changes = changes_between(&old.recipe, &new.recipe).into_iter().map(PlaceChangeDto::from).collect();
    Ok(Json(RecipeDifferenceDto { from, to, changes }))
}

/// Publishes the content of an earlier version as the next one.
#[utoipa::path(
    post, path = "/recipes/{id}/roll-back", tag = "recipes", request_body = RollBackRecipeDto,
    params(
        ("id" = String, Path),
        ("If-Match" = String, Header, description = "ETag of the recipe, or `*`")
    ),
    responses((status = 201, body = RecipeVersionDto,
        headers(("ETag" = String, description = "The version"), ("Location" = String, description = "Its address"))))
)]
async fn roll_back_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
    headers: HeaderMap,
    body: ApiJson<RollBackRecipeDto>,
) -> Result<Reply, Problem> {
    let route = format!("POST recipes/{id}/roll-back");
    let once = match begin(&app, &headers, &route, &body.sha256).await? {
        Begun::Answered(reply) => return Ok(reply),
        Begun::Fresh(once) => once,
    };
    let after = app.catalogue.read().recipe(&id).await?.newest;
    check(&headers, &after.to_string())?;
    let RollBackRecipeDto { to_version, reason } = body.value;
    let and = |version: &RecipeVersion| once.changes(&published(version));
    let version = use_cases::roll_back_recipe(&app, &by, (&id, after), (to_version, reason), and).await?;
    Ok(published(&version))
}

/// Archives a recipe: it can no longer be used for inspections, and its number becomes free. Its versions are kept.
#[utoipa::path(
    post, path = "/recipes/{id}/archive", tag = "recipes", params(("id" = String, Path)),
    responses((status = 200, body = NewestRecipeDto, headers(("ETag" = String, description = "The version"))))
)]
async fn archive_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<Versioned<Json<NewestRecipeDto>>, Problem> {
    use_cases::archive_recipe(&app, &by, &id, true).await?;
    newest(&app, &id).await
}

/// Restores an archived recipe.
#[utoipa::path(
    post, path = "/recipes/{id}/restore", tag = "recipes", params(("id" = String, Path)),
    responses((status = 200, body = NewestRecipeDto, headers(("ETag" = String, description = "The version"))))
)]
async fn restore_recipe(
    State(app): State<App>,
    ApiPath(id): ApiPath<String>,
    By(by): By,
) -> Result<Versioned<Json<NewestRecipeDto>>, Problem> {
    use_cases::archive_recipe(&app, &by, &id, false).await?;
    newest(&app, &id).await
}
