//! The methods of OPC 40100-1.

use std::time::Duration;

use opcua::types::{ExtensionObject, Variant};

use crate::information_model::ids::structures::{JOB_ID, RECIPE_ID_INTERNAL};
use crate::information_model::structures::{array, text};
use crate::line::{Recipe, ResultFilter, StartJob};
use crate::refusal::Refusal;
use crate::result::{MEAS_ID_ATTRIBUTE, PRODUCT_ID_ATTRIBUTE, fields, structure};
use crate::server::nodes::Nodes;

/// Longest list in one answer.
const LONGEST_LIST: usize = 100;

/// How long an answer waits for the variables to show the state.
const SHOWN_WITHIN: Duration = Duration::from_secs(1);

/// `TriStateBooleanDataType` "don't care".
const DO_NOT_CARE: i32 = 2;

/// Methods that change nothing; all others need a user, and commands to be switched on.
const READING: [&str; 4] =
    ["GetRecipeListFiltered", "GetResultById", "GetResultComponentsById", "GetResultListFiltered"];

/// What became of a call.
pub enum Outcome {
    /// Executed, or refused with a number in the last output.
    Done(Vec<Variant>),
    /// The arguments have other types.
    BadArguments,
    /// This station does not do that.
    Unsupported,
}

/// Whether the method with this path changes something.
pub fn is_command(path: &str) -> bool {
    !READING.contains(&name(path))
}

fn name(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// Executes the method with this path.
pub async fn call(nodes: &Nodes, user: &str, path: &str, arguments: &[Variant]) -> Outcome {
    let outputs = match (name(path), arguments) {
        ("Halt", [Variant::Int32(_), _]) => vec![error(shown(nodes, nodes.line.halt(user).await).await)],
        ("Reset", [Variant::Int32(_), _]) => vec![error(shown(nodes, nodes.line.reset(user).await).await)],
        ("Stop" | "Abort", [Variant::Int32(_), _]) => vec![error(abort(nodes, user).await)],
        ("StartSingleJob", [meas, part, recipe, product, _]) => {
            let started = start(nodes, user, [meas, part, recipe, product]).await;
            let id = started.as_deref().unwrap_or_default();
            vec![nodes.structures.id(JOB_ID, id), error(started.map(drop))]
        }
        ("PrepareRecipe", [external, internal]) => prepare(nodes, [external, internal]).await,
        ("UnprepareRecipe", [external, internal]) => unprepare(nodes, [external, internal]),
        ("GetRecipeListFiltered", [recipe, _, is_prepared, max, start, _]) => {
            let (Some(max), Some(start)) = (number(max), number(start)) else { return Outcome::BadArguments };
            recipe_list(nodes, &text(recipe, "Id"), tri_state(is_prepared), max, start).await
        }
        ("GetResultById", [id, _]) => result(nodes, &text(id, "Id")).await,
        ("GetResultComponentsById", [id, _]) => result_components(nodes, &text(id, "Id")).await,
        ("GetResultListFiltered", [_, _, part, external, internal, _, _, _, job, max, start, _]) => {
            let (Some(max), Some(start)) = (number(max), number(start)) else { return Outcome::BadArguments };
            let filter = ResultFilter {
                serial: filled(text(part, "Id")),
                recipe: filled(text(internal, "Id")).or(filled(text(external, "Id"))),
                version: text(internal, "Version").parse().ok(),
                job_id: filled(text(job, "Id")),
            };
            result_list(nodes, &filter, max, start).await
        }
        ("StartContinuous", _) => return Outcome::Unsupported,
        _ => return Outcome::BadArguments,
    };
    Outcome::Done(outputs)
}

fn error(outcome: Result<(), Refusal>) -> Variant {
    outcome.err().map_or(0, Refusal::number).into()
}

/// Passes an outcome on once the variables show the state that follows from it: a client that reads the state after the
/// answer does not get the one before.
async fn shown(nodes: &Nodes, outcome: Result<(), Refusal>) -> Result<(), Refusal> {
    let newest = nodes.line.newest_change();
    let mut shown_change = nodes.shown_change.subscribe();
    // After the limit, the outcome still counts: the state follows.
    let _ = tokio::time::timeout(SHOWN_WITHIN, shown_change.wait_for(|shown| *shown >= newest)).await;
    outcome
}

fn filled(text: String) -> Option<String> {
    Some(text).filter(|text| !text.is_empty())
}

fn number(argument: &Variant) -> Option<usize> {
    match argument {
        Variant::UInt32(number) => usize::try_from(*number).ok(),
        _ => None,
    }
}

fn tri_state(argument: &Variant) -> Option<bool> {
    match argument {
        Variant::Int32(DO_NOT_CARE) => None,
        Variant::Int32(value) => Some(*value == 1),
        _ => None,
    }
}

/// A client's limit; 0 is none.
fn limit(max: usize) -> usize {
    if max == 0 { LONGEST_LIST } else { max.min(LONGEST_LIST) }
}

/// The serial number is the id of the part, or of the measurement if there is none.
async fn start(
    nodes: &Nodes,
    user: &str,
    [meas, part, recipe, product]: [&Variant; 4],
) -> Result<String, Refusal> {
    let [meas, product] = [meas, product].map(|one| filled(text(one, "Id")));
    let serial = filled(text(part, "Id")).or(meas.clone()).ok_or(Refusal::BadSerial)?;
    let named = named_recipe(recipe).or_else(|| nodes.prepared.lock().clone());
    let attributes = [(MEAS_ID_ATTRIBUTE, meas), (PRODUCT_ID_ATTRIBUTE, product)];
    let attributes = attributes.into_iter().filter_map(|(key, value)| Some((key, value?))).collect();
    let job = StartJob { serial, recipe: named, attributes };
    let id = nodes.line.start(user, job).await?;
    *nodes.started_job.lock() = Some(id.clone());
    Ok(id)
}

/// Cancels the job that uses the station, else the one started last.
async fn abort(nodes: &Nodes, user: &str) -> Result<(), Refusal> {
    let running = nodes.running_job.lock().clone();
    let job = running.or_else(|| nodes.started_job.lock().clone()).ok_or(Refusal::NotReady)?;
    nodes.line.abort(user, &job).await
}

/// `id` or `id@version`.
fn named_recipe(recipe: &Variant) -> Option<String> {
    let (id, version) = (filled(text(recipe, "Id"))?, filled(text(recipe, "Version")));
    Some(version.map_or_else(|| id.clone(), |version| format!("{id}@{version}")))
}

async fn find_recipe(nodes: &Nodes, named: Option<&str>) -> Result<Recipe, Refusal> {
    let named = named.ok_or(Refusal::NoRecipe)?;
    let recipes = nodes.line.recipes().await?;
    let id = named.split('@').next().unwrap_or(named);
    recipes.into_iter().find(|recipe| recipe.id == id).ok_or(Refusal::NoRecipe)
}

fn internal_id(nodes: &Nodes, recipe: &Recipe) -> Variant {
    let Recipe { id, version, digest } = recipe;
    nodes.structures.binary_id(RECIPE_ID_INTERNAL, id, Some(*version), Some(digest))
}

fn no_internal_id(nodes: &Nodes) -> Variant {
    nodes.structures.binary_id(RECIPE_ID_INTERNAL, "", None, None)
}

async fn prepare(nodes: &Nodes, ids: [&Variant; 2]) -> Vec<Variant> {
    let named = ids.into_iter().rev().find_map(named_recipe);
    match find_recipe(nodes, named.as_deref()).await {
        Ok(recipe) => {
            *nodes.prepared.lock() = named;
            // If the door is closing, nobody is there to notice.
            let _ = nodes.prepared_events.send(recipe.id.clone());
            vec![internal_id(nodes, &recipe), true.into(), error(Ok(()))]
        }
        Err(refusal) => vec![no_internal_id(nodes), false.into(), error(Err(refusal))],
    }
}

fn unprepare(nodes: &Nodes, ids: [&Variant; 2]) -> Vec<Variant> {
    let named = ids.into_iter().rev().find_map(named_recipe);
    let mut prepared = nodes.prepared.lock();
    let is_prepared = prepared.is_some() && (named.is_none() || *prepared == named);
    if is_prepared {
        *prepared = None;
    }
    let outcome = if is_prepared { Ok(()) } else { Err(Refusal::NoRecipe) };
    vec![no_internal_id(nodes), is_prepared.into(), error(outcome)]
}

async fn recipe_list(
    nodes: &Nodes,
    id: &str,
    is_prepared: Option<bool>,
    max: usize,
    start: usize,
) -> Vec<Variant> {
    let prepared = nodes.prepared.lock().clone();
    let prepared = prepared.as_deref().and_then(|named| named.split('@').next());
    let is_listed = |recipe: &Recipe| {
        let is_right = is_prepared.is_none_or(|wanted| wanted == (prepared == Some(recipe.id.as_str())));
        is_right && (id.is_empty() || id == recipe.id)
    };
    let listed = nodes.line.recipes().await;
    let outcome = listed.as_ref().map(drop).map_err(|refusal| *refusal);
    let listed: Vec<Recipe> = listed.unwrap_or_default().into_iter().filter(is_listed).skip(start).collect();
    let page: Vec<Variant> = listed.iter().take(limit(max)).map(|recipe| internal_id(nodes, recipe)).collect();
    list(page.len() == listed.len(), page, outcome)
}

async fn result_list(nodes: &Nodes, filter: &ResultFilter, max: usize, start: usize) -> Vec<Variant> {
    match nodes.line.results(filter, start, limit(max)).await {
        Ok((results, is_complete)) => {
            let results = results.iter().map(|one| structure(&nodes.structures, one)).collect();
            list(is_complete, results, Ok(()))
        }
        Err(refusal) => list(true, Vec::new(), Err(refusal)),
    }
}

/// `IsComplete`, `ResultCount`, a handle that need not be released, the list, `Error`.
fn list(is_complete: bool, page: Vec<Variant>, outcome: Result<(), Refusal>) -> Vec<Variant> {
    let n = u32::try_from(page.len()).unwrap_or(u32::MAX);
    vec![is_complete.into(), n.into(), 0_u32.into(), array(page), error(outcome)]
}

async fn result(nodes: &Nodes, id: &str) -> Vec<Variant> {
    match nodes.line.result(id).await {
        Ok(finished) => vec![0_u32.into(), structure(&nodes.structures, &finished), error(Ok(()))],
        Err(refusal) => vec![0_u32.into(), ExtensionObject::null().into(), error(Err(refusal))],
    }
}

async fn result_components(nodes: &Nodes, id: &str) -> Vec<Variant> {
    /// Not among the outputs.
    const LEFT_OUT: [&str; 2] = ["ResultId", "HasTransferableDataOnFile"];
    let (fields, outcome) = match nodes.line.result(id).await {
        Ok(finished) => (fields(&nodes.structures, &finished), Ok(())),
        Err(refusal) => (Vec::new(), Err(refusal)),
    };
    let mut outputs = vec![0_u32.into()];
    outputs.extend(fields.into_iter().filter(|(name, _)| !LEFT_OUT.contains(name)).map(|(_, value)| value));
    outputs.resize(15, Variant::Empty);
    outputs.push(error(outcome));
    outputs
}
