//! Studies of the station: create, add a position, delete.

use metrology::Region;
use metrology::acceptance::{Figures, Position, ProbeRequest, Procedure};
use station::wall_clock::now_ms;
use store::{Change, ScanRecord, ScanState};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, SessionVersion, event};
use crate::resources::labels::label;
use crate::resources::recipes::{RecipeRef, found};
use crate::resources::stored_scan::new_id;
use crate::resources::studies::{
    Study, StudyBody, StudyPlan, StudyPosition, position_figures, repeat_difference_mm,
};

/// Temperatures of a measuring room, °C; anything else is a slip of the pen or another unit.
const TEMPERATURES_C: std::ops::RangeInclusive<f64> = 0.0..=50.0;

/// A position to add to an acceptance test.
#[derive(Debug, Clone, PartialEq)]
pub struct NewPosition {
    /// Which procedure it belongs to.
    pub procedure: Procedure,
    /// The scan.
    pub scan_id: String,
    /// Temperature of the artefact, °C.
    pub temperature_c: Option<f64>,
    /// Linearity: the height at which the plate was placed, mm.
    pub reference_mm: Option<f64>,
    /// Two opposite corners of a box around the artefact, part frame, mm: x, y, z, x, y, z.
    pub region_mm: Option<[f64; 6]>,
}

/// Creates a study, together with what `and` returns.
///
/// # Errors
/// The plan is impossible, or its recipe or characteristic does not exist.
pub async fn create_study(
    app: &App,
    by: &Principal,
    (name, plan): (String, StudyPlan),
    and: impl FnOnce(&Study) -> Vec<Change>,
) -> Result<Study, AppError> {
    label(&name, "/name")?;
    plan.check()?;
    let plan = with_characteristic(app, plan).await?;
    let now_ms = now_ms();
    let body = StudyBody { name, author: by.actor.clone(), plan, positions: Vec::new() };
    let study = Study { id: new_id(), version: 1, body, created_at_ms: now_ms, changed_at_ms: now_ms };
    let mut changes = and(&study);
    changes.push(Change::InsertStudy(study.to_record()));
    changes.push(event(&study.id, Event::StudyCreated(SessionVersion { actor: by.actor.clone(), version: 1 })));
    app.catalogue.commit(changes).await?;
    Ok(study)
}

/// The plan for a version of its recipe, which must have the characteristic.
async fn with_characteristic(app: &App, plan: StudyPlan) -> Result<StudyPlan, AppError> {
    let Some((recipe, version, characteristic)) = plan.characteristic() else { return Ok(plan) };
    let recipe = RecipeRef::Id { id: recipe.to_owned(), version };
    let recipe = found(&app.catalogue, Some(&recipe), "").await?;
    if recipe.recipe.plan.characteristics.iter().all(|known| known.id != characteristic) {
        let detail = format!("{} has no characteristic {characteristic}", recipe.name());
        return Err(AppError::new(ErrorKind::Impossible, detail).remedy("give one of its characteristics"));
    }
    Ok(plan.with_version(recipe.version))
}

/// Adds a scan of an artefact to an acceptance test, together with what `and` returns; takes some seconds.
///
/// # Errors
/// The study is no acceptance test or does not have the procedure; the scan is not complete, was added before, or was made
/// with another calibration; the artefact is not found.
pub async fn add_position(
    app: &App,
    by: &Principal,
    id: &str,
    new: NewPosition,
    and: impl FnOnce(&Study) -> Vec<Change>,
) -> Result<Study, AppError> {
    let mut study = Study::of(app.catalogue.read().study(id).await?)?;
    let scan = app.catalogue.read().scan(&new.scan_id).await.map_err(|error| match error {
        store::StoreError::NotFound { .. } => refused("/scan_id", error.to_string(), "give the id of a scan"),
        other => other.into(),
    })?;
    let position = figures_of(app, &study, &new, &scan).await?;
    study.body.positions.push(StudyPosition {
        scan_id: scan.id,
        scan_name: scan.name,
        calibration_id: scan.calibration_id,
        simulated: app.station.status().simulated.is_some(),
        added_by: by.actor.clone(),
        added_at_ms: now_ms(),
        position,
    });
    (study.version, study.changed_at_ms) = (study.version + 1, now_ms());
    let mut changes = and(&study);
    changes.push(Change::UpdateStudy(study.to_record()));
    let changed = SessionVersion { actor: by.actor.clone(), version: study.version };
    changes.push(event(&study.id, Event::StudyChanged(changed)));
    app.catalogue.commit(changes).await.map_err(|error| match error {
        store::StoreError::Changed { .. } => {
            AppError::from(error).remedy("another position was added meanwhile: add this one again")
        }
        other => other.into(),
    })?;
    Ok(study)
}

/// The figures of a new position, after all that can be checked without them.
async fn figures_of(app: &App, study: &Study, new: &NewPosition, scan: &ScanRecord) -> Result<Position, AppError> {
    let StudyPlan::Acceptance(plan) = &study.body.plan else {
        return Err(AppError::new(ErrorKind::Conflict, "only an acceptance test has positions")
            .remedy("inspect the parts: inspections belong to such a study by themselves"));
    };
    let procedure = new.procedure;
    if plan.procedures().all(|planned| planned != procedure) {
        let detail = format!("this acceptance test has no procedure {}", procedure.name());
        return Err(refused("/procedure", detail, "give one of its procedures"));
    }
    if let Some(temperature_c) = new.temperature_c.filter(|value| !TEMPERATURES_C.contains(value)) {
        let detail = format!("the artefact cannot have {temperature_c} °C");
        return Err(refused("/temperature_c", detail, "give its temperature in °C, 0 to 50"));
    }
    match (procedure, new.reference_mm) {
        (Procedure::Linearity, Some(reference_mm)) if reference_mm.is_finite() => {}
        (Procedure::Linearity, _) => {
            return Err(refused(
                "/reference_mm",
                "linearity needs the height of the plate",
                "give its height, mm",
            ));
        }
        (_, Some(_)) => {
            let detail = format!("a position of {} has no height", procedure.name());
            return Err(refused("/reference_mm", detail, "give it for linearity only"));
        }
        (_, None) => {}
    }
    check_scan(study, scan)?;
    let region = new
        .region_mm
        .map(|[x, y, z, other_x, other_y, other_z]| Region::between([x, y, z], [other_x, other_y, other_z]));
    let request = ProbeRequest { procedure, region, seed: 1 };
    let figures = position_figures(&app.catalogue, &*app.artifacts, scan, plan, request).await?;
    let first = study.first_of(procedure).filter(|_| procedure == Procedure::Repeatability);
    let difference_mm = match first.map(|first| (first, &first.position.figures)) {
        Some((first, Figures::Plate(plate))) => {
            let first = app.catalogue.read().scan(&first.scan_id).await?;
            Some(repeat_difference_mm(&*app.artifacts, [&first, scan], plate.clone()).await?)
        }
        _ => None,
    };
    Ok(Position {
        procedure,
        temperature_c: new.temperature_c,
        reference_mm: new.reference_mm,
        difference_mm,
        figures,
    })
}

/// Each position is a scan of its own, whole, and all are of one calibration: an acceptance is that of a calibrated station.
fn check_scan(study: &Study, scan: &ScanRecord) -> Result<(), AppError> {
    if scan.state != ScanState::Complete {
        return Err(refused("/scan_id", "the scan is not complete", "scan the artefact again"));
    }
    if study.body.positions.iter().any(|position| position.scan_id == scan.id) {
        let detail = "the scan is a position of this test already";
        return Err(AppError::new(ErrorKind::Conflict, detail)
            .at("/scan_id")
            .remedy("move the artefact and scan it again"));
    }
    if study.body.positions.iter().any(|position| position.calibration_id != scan.calibration_id) {
        let detail = "the scan was made with another calibration than the positions before";
        return Err(refused("/scan_id", detail, "begin a new acceptance test, or recompute the scan"));
    }
    Ok(())
}

fn refused(place: &str, detail: impl Into<String>, remedy: &str) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(place).remedy(remedy)
}

/// Deletes a study.
///
/// # Errors
/// If it does not exist.
pub async fn delete_study(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let gone = event(&id, Event::StudyDeleted(by.initiator()));
    app.catalogue.commit(vec![Change::DeleteStudy(id), gone]).await?;
    Ok(())
}
