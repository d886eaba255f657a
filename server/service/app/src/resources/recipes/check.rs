//! Validation of a recipe; each refusal has a JSON pointer and a remedy.

use metrology::Plan;
use remedy::Remedy as _;
use serde_json::Value;

use crate::error::{AppError, ErrorKind};
use crate::resources::labels::label;
use crate::resources::recipes::Recipe;
use crate::resources::recipes::serial_rule::SerialRule;
use crate::resources::scan_run::ScanSettings;

/// Longest id of a recipe: it appears in file names and topics.
const LONGEST_ID: usize = 64;

/// Largest number of attributes of a recipe or an inspection.
const ATTRIBUTES_LIMIT: usize = 50;

/// Longest value of an attribute.
const LONGEST_ATTRIBUTE: usize = 1_000;

/// Exposure times of an HDR scan.
const N_EXPOSURES: std::ops::RangeInclusive<usize> = 2..=4;

pub(crate) fn refused(place: impl Into<String>, detail: impl Into<String>, remedy: &str) -> AppError {
    AppError::new(ErrorKind::Impossible, detail).at(place).remedy(remedy)
}

/// Checks the id of a new recipe; it starts with a letter, so that it is distinct from a number.
pub(crate) fn check_id(id: &str) -> Result<(), AppError> {
    let is_word = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_".contains(&byte);
    let begins = id.bytes().next().is_some_and(|byte| byte.is_ascii_lowercase());
    if begins && id.len() <= LONGEST_ID && id.bytes().all(is_word) {
        return Ok(());
    }
    let remedy = "use up to 64 of a to z, 0 to 9, - and _, starting with a letter";
    Err(refused("/id", "the id of the recipe is invalid", remedy))
}

/// Checks attributes, which are passed on to other systems.
pub(crate) fn check_attributes<'a>(
    attributes: impl ExactSizeIterator<Item = (&'a String, &'a String)>,
    place: &str,
) -> Result<(), AppError> {
    if attributes.len() > ATTRIBUTES_LIMIT {
        let detail = format!("{} attributes are too many", attributes.len());
        return Err(refused(place, detail, "give at most 50"));
    }
    for (name, value) in attributes {
        label(name, place)?;
        if value.chars().count() > LONGEST_ATTRIBUTE {
            return Err(refused(format!("{place}/{name}"), "the value is too long", "give at most 1000 letters"));
        }
    }
    Ok(())
}

/// Checks a plan; `place` is its JSON pointer in the request. The problem names the characteristic or feature.
pub(crate) fn check_plan(plan: &Plan, place: &str) -> Result<(), AppError> {
    plan.check().map_err(|error| {
        let detail = match part_at(plan, &error.pointer) {
            Some(part) => format!("{part}: {}", error.detail),
            None => error.detail.clone(),
        };
        refused(format!("{place}{}", error.pointer), detail, &error.remedy().unwrap_or_default())
    })?;
    for (idx, characteristic) in plan.characteristics.iter().enumerate() {
        let is_plain = |value: &Value| value.is_string() || value.is_number() || value.is_boolean();
        if let Some((name, _)) = characteristic.attributes.iter().find(|(_, value)| !is_plain(value)) {
            let place = format!("{place}/characteristics/{idx}/attributes/{name}");
            let detail = format!(
                "characteristic \"{}\": an attribute is a text, a number, true or false",
                characteristic.id
            );
            return Err(refused(place, detail, "give one of them"));
        }
    }
    Ok(())
}

/// The characteristic or feature that a pointer into a plan leads to, by its id.
fn part_at(plan: &Plan, pointer: &str) -> Option<String> {
    let mut parts = pointer.split('/').skip(1);
    let (list, idx) = (parts.next()?, parts.next()?.parse::<usize>().ok()?);
    match list {
        "characteristics" => plan.characteristics.get(idx).map(|one| format!("characteristic \"{}\"", one.id)),
        "features" => plan.features.get(idx).map(|one| format!("feature \"{}\"", one.id)),
        _ => None,
    }
}

impl Recipe {
    /// Validates it; pointers start with `/recipe`.
    ///
    /// # Errors
    /// The first invalid part, with its pointer and remedy.
    pub fn check(&self) -> Result<(), AppError> {
        label(&self.name, "/recipe/name")?;
        if self.number == Some(0) {
            return Err(refused("/recipe/number", "0 is not a recipe number", "give a number from 1"));
        }
        if let Some(pattern) = &self.serial_pattern {
            SerialRule::new(pattern)?;
        }
        self.scan.check()?;
        check_plan(&self.plan, "/recipe/plan")?;
        if self.plan.characteristics.is_empty() {
            let detail = "the plan has no characteristics";
            return Err(refused("/recipe/plan/characteristics", detail, "add a characteristic"));
        }
        for (idx, door) in self.outputs.iter().flatten().enumerate() {
            label(door, &format!("/recipe/outputs/{idx}"))?;
        }
        check_attributes(self.attributes.iter(), "/recipe/attributes")
    }
}

impl ScanSettings {
    /// Checks everything that does not depend on a station; the rest is checked when an inspection is requested.
    fn check(&self) -> Result<(), AppError> {
        let place = |field: &str| format!("/recipe/scan/{field}");
        let any = [
            ("from_mm", self.from_mm),
            ("to_mm", self.to_mm),
            ("from_deg", self.from_deg),
            ("to_deg", self.to_deg),
        ];
        let above_zero = [
            ("step_mm", self.step_mm),
            ("speed_mm_s", self.speed_mm_s),
            ("step_deg", self.step_deg),
            ("speed_deg_s", self.speed_deg_s),
            ("exposure_us", self.exposure_us),
            ("laser_power", self.laser_power),
        ];
        for (field, value) in any.iter().chain(&above_zero).filter_map(|(field, value)| Some((field, (*value)?))) {
            if !value.is_finite() {
                return Err(refused(place(field), format!("{field} is {value}"), "give a number"));
            }
        }
        for (field, value) in above_zero.iter().filter_map(|(field, value)| Some((field, (*value)?))) {
            if value <= 0.0 {
                return Err(refused(place(field), format!("{field} is {value}"), "give a number above 0"));
            }
        }
        if self.laser_power.is_some_and(|power| power > 1.0) {
            return Err(refused(place("laser_power"), "full power is 1", "give a number up to 1"));
        }
        self.check_range()?;
        self.check_exposures()?;
        let background = self.background.unwrap_or_default();
        if background.every_rows == Some(0) {
            return Err(refused(place("background/every_rows"), "every_rows is 0", "give a number from 1"));
        }
        if background.above_levels.is_some_and(|levels| !(0.0..=255.0).contains(&levels)) {
            return Err(refused(
                place("background/above_levels"),
                "levels range from 0 to 255",
                "give one of them",
            ));
        }
        Ok(())
    }

    fn check_range(&self) -> Result<(), AppError> {
        let linear = [self.from_mm, self.to_mm, self.step_mm, self.speed_mm_s];
        let rotary = [self.from_deg, self.to_deg, self.step_deg, self.speed_deg_s];
        let is_given = |range: &[Option<f64>; 4]| range.iter().any(Option::is_some);
        if is_given(&linear) && is_given(&rotary) {
            let detail = "a range is in millimetres or in degrees";
            return Err(refused("/recipe/scan", detail, "give the fields of one kind of stage"));
        }
        let [from, to, step, speed] = if is_given(&rotary) { rotary } else { linear };
        if from.is_none() || to.is_none() || step.or(speed).is_none() {
            let detail = "the range of the scan is incomplete";
            return Err(refused("/recipe/scan", detail, "give from, to, and a step or a speed"));
        }
        Ok(())
    }

    fn check_exposures(&self) -> Result<(), AppError> {
        if self.exposures_us.is_empty() {
            return Ok(());
        }
        let place = "/recipe/scan/exposures_us";
        if self.exposure_us.is_some() {
            return Err(refused(place, "exposure_us and exposures_us exclude each other", "give one of them"));
        }
        let are_good = self.exposures_us.iter().all(|us| us.is_finite() && *us > 0.0);
        if !N_EXPOSURES.contains(&self.exposures_us.len()) || !are_good {
            return Err(refused(place, "invalid exposure times of an HDR scan", "give two to four above 0"));
        }
        Ok(())
    }
}
