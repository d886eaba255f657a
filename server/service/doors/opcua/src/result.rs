//! An inspection as a result of OPC 40100-1, and one that ended without a result.

use app::doors::{CharacteristicMessage, InspectionMessage};
use opcua::types::{Array, DateTime, ExtensionObject, KeyValuePair, QualifiedName, Variant, VariantScalarTypeId};

use crate::information_model::ids::structures::{
    CONFIGURATION_ID, JOB_ID, MEAS_ID, PART_ID, PRODUCT_ID, RECIPE_ID_EXTERNAL, RECIPE_ID_INTERNAL, RESULT,
    RESULT_ID,
};
use crate::information_model::structures::{Structures, texts};
use crate::line::{Finished, Unfinished};

/// Attribute of a part with the client's id of the measurement.
pub const MEAS_ID_ATTRIBUTE: &str = "meas_id";

/// Attribute of a part with the client's id of the product.
pub const PRODUCT_ID_ATTRIBUTE: &str = "product_id";

/// `ResultState` Completed: all results are, whatever their verdict.
const COMPLETED: i32 = 1;

/// `ResultState` Aborted: a person or the end of the service ended the job.
const ABORTED: i32 = 3;

/// `ResultState` Failed.
const FAILED: i32 = 4;

/// 1970 in units of 100 ns since 1601.
const UNIX_EPOCH_TICKS: i64 = 116_444_736_000_000_000;

/// The fields of `ResultDataType` by name, in order; empty if absent.
pub fn fields(structures: &Structures, finished: &Finished) -> Vec<(&'static str, Variant)> {
    let Finished { inspection, job_id } = finished;
    let recipe = &inspection.recipe;
    let attribute = |key: &str, number| {
        let id = inspection.attributes.get(key);
        id.map_or(Variant::Empty, |id| structures.described_id(number, id))
    };
    vec![
        ("ResultId", structures.id(RESULT_ID, &inspection.id)),
        ("HasTransferableDataOnFile", Variant::Empty),
        ("IsPartial", false.into()),
        ("IsSimulated", inspection.simulated.into()),
        ("ResultState", COMPLETED.into()),
        ("MeasId", attribute(MEAS_ID_ATTRIBUTE, MEAS_ID)),
        ("PartId", structures.described_id(PART_ID, &inspection.serial)),
        ("ExternalRecipeId", structures.binary_id(RECIPE_ID_EXTERNAL, &recipe.id, None, None)),
        (
            "InternalRecipeId",
            structures.binary_id(RECIPE_ID_INTERNAL, &recipe.id, Some(recipe.version), Some(&recipe.digest)),
        ),
        ("ProductId", attribute(PRODUCT_ID_ATTRIBUTE, PRODUCT_ID)),
        ("ExternalConfigurationId", Variant::Empty),
        (
            "InternalConfigurationId",
            structures.binary_id(CONFIGURATION_ID, &inspection.calibration_id, None, None),
        ),
        ("JobId", structures.id(JOB_ID, job_id.as_deref().unwrap_or_default())),
        ("CreationTime", time(inspection.inspected_at_ms).into()),
        ("ProcessingTimes", Variant::Empty),
        ("ResultContent", content(inspection)),
    ]
}

/// The fields of `ResultDataType` that are known without a result. The id is that of the job; there is no content, so
/// that nobody takes it for a verdict.
pub fn fields_of_unfinished(structures: &Structures, unfinished: &Unfinished) -> Vec<(&'static str, Variant)> {
    let Unfinished { job_id, serial, recipe, has_failed, at_ms, .. } = unfinished;
    let (id, version) = recipe.split_once('@').unwrap_or((recipe, ""));
    vec![
        ("ResultId", structures.id(RESULT_ID, job_id)),
        ("IsPartial", false.into()),
        ("ResultState", if *has_failed { FAILED } else { ABORTED }.into()),
        ("PartId", structures.described_id(PART_ID, serial)),
        ("ExternalRecipeId", structures.binary_id(RECIPE_ID_EXTERNAL, id, None, None)),
        ("InternalRecipeId", structures.binary_id(RECIPE_ID_INTERNAL, id, version.parse().ok(), None)),
        ("JobId", structures.id(JOB_ID, job_id)),
        ("CreationTime", time(*at_ms).into()),
    ]
}

/// The result as one structure.
pub fn structure(structures: &Structures, finished: &Finished) -> Variant {
    structures.make(RESULT, fields(structures, finished).into_iter().map(|(_, value)| value).collect())
}

/// Milliseconds since 1970 as a time of OPC UA.
pub fn time(at_ms: i64) -> DateTime {
    DateTime::from(UNIX_EPOCH_TICKS.saturating_add(at_ms.saturating_mul(10_000)))
}

/// `ResultContent`: pairs of key and value; after the verdict, one array per property of the characteristics. What is
/// invalid or absent is NaN or an empty text, never 0.
fn content(inspection: &InspectionMessage) -> Variant {
    let all = &inspection.results;
    let number = |of: fn(&CharacteristicMessage) -> Option<f64>| {
        let value = |one| of(one).filter(|value| value.is_finite()).unwrap_or(f64::NAN);
        Variant::from(all.iter().map(value).collect::<Vec<f64>>())
    };
    let text = |of: fn(&CharacteristicMessage) -> &str| texts(all.iter().map(of));
    let pairs = [
        ("verdict", inspection.verdict.as_str().into()),
        ("ids", text(|one| &one.id)),
        ("units", text(|one| &one.unit)),
        // A client that looks at the value alone must not use one that is invalid.
        ("values", number(|one| one.value.filter(|_| one.verdict.as_deref() != Some("invalid")))),
        ("expanded_uncertainties", number(|one| one.expanded_uncertainty)),
        ("verdicts", text(|one| one.verdict.as_deref().unwrap_or_default())),
        ("lower_limits", number(|one| one.limits().0)),
        ("upper_limits", number(|one| one.limits().1)),
    ];
    let pair = |(key, value): (&str, Variant)| {
        let pair = KeyValuePair { key: QualifiedName::new(0, key), value };
        Variant::Variant(Box::new(Variant::ExtensionObject(ExtensionObject::new(pair))))
    };
    let array = Array::new(VariantScalarTypeId::Variant, pairs.map(pair).to_vec());
    array.map_or(Variant::Empty, |array| Variant::Array(Box::new(array)))
}
