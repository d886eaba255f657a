//! The report of an inspection as HTML and PDF: verdict, characteristics, deviations, the cloud.

mod html;
mod pdf;
mod surfaces;

pub use html::inspection_page;
pub use pdf::inspection_pdf;
pub use surfaces::{MeasuredSurface, measured_surfaces};

use metrology::{Comparison, PartVerdict};
use scanning::Cloud;

use crate::drawing::deviation_map::DeviationMap;

/// Contents of the report of an inspection, except for the cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectionSheet {
    /// Id of the inspection.
    pub id: String,
    /// Sequence number of the inspection.
    pub seq: i64,
    /// Serial number of the part.
    pub serial: String,
    /// The verdict on the part.
    pub verdict: PartVerdict,
    /// Whether the devices were simulated or replayed.
    pub simulated: bool,
    /// Names and values to print, in this order: part, recipe, calibration, time.
    pub facts: Vec<(&'static str, String)>,
    /// The characteristics, in the order of the plan.
    pub characteristics: Vec<CharacteristicRow>,
    /// The measured planes, spheres and cylinders, for the map of deviations.
    pub surfaces: Vec<MeasuredSurface>,
    /// The comparisons with CAD models.
    pub comparisons: Vec<ModelComparison>,
}

impl InspectionSheet {
    /// The deviations of the points of a cloud from the measured surfaces; `None` without such points.
    fn deviation_map(&self, cloud: &Cloud) -> Option<DeviationMap> {
        DeviationMap::new(cloud, &surfaces::deviations_mm(cloud, &self.surfaces))
    }
}

/// The comparison of the part with a CAD model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelComparison {
    /// Id of the characteristic in the plan.
    pub id: String,
    /// Name of the model.
    pub model: String,
    /// The comparison.
    pub comparison: Comparison,
}

impl ModelComparison {
    /// Title of its map.
    fn title(&self) -> String {
        format!("{}: deviation from {}", self.id, self.model)
    }
}

/// A characteristic in a report.
#[derive(Debug, Clone, PartialEq)]
pub struct CharacteristicRow {
    /// Its id in the plan.
    pub id: String,
    /// The measured quantity.
    pub measure: String,
    /// `mm` or `°`.
    pub unit: String,
    /// Nominal value, in `unit`.
    pub nominal: Option<f64>,
    /// Lower and upper limit as values, in `unit`.
    pub limits: [Option<f64>; 2],
    /// The value, in `unit`.
    pub value: Option<f64>,
    /// Expanded uncertainty (k = 2), in `unit`.
    pub expanded_uncertainty: Option<f64>,
    /// The verdict; `None` without limits.
    pub verdict: Option<PartVerdict>,
    /// Why it is undecided or invalid.
    pub reason: Option<String>,
}

/// Columns of the table of characteristics.
const COLUMNS: [&str; 9] =
    ["characteristic", "measure", "nominal", "lower", "upper", "value", "deviation", "U (k = 2)", "verdict"];

/// What each verdict means, from the best to the worst: that on the part is the worst of its characteristics.
const VERDICTS: [(PartVerdict, &str); 4] = [
    (PartVerdict::Ok, "within the limits by the expanded uncertainty U or more"),
    (
        PartVerdict::Undecided,
        "a limit lies within U of the value, U lacks a contribution, or a feature does not fit; not accepted",
    ),
    (
        PartVerdict::Invalid,
        "not measured, without a finite value or U, or the scan permits no verdict; not accepted",
    ),
    (PartVerdict::NotOk, "beyond a limit by more than U"),
];

/// What the table of characteristics contains.
const ABOUT_COLUMNS: &str =
    "Limits and values in the unit of each measure; the deviation is the value minus nominal.";

/// What the map of deviations shows.
const ABOUT_MAP: &str = "Distances of the points from the planes, spheres and cylinders of the plan as they were fitted \
                         to them: form and noise, not size or position. Red: outside, or towards the camera.";

/// Notice for inspections without real devices.
const SIMULATED: &str = "Simulated or replayed devices: not a verdict on a real part.";

impl CharacteristicRow {
    /// The cells of its row.
    fn cells(&self) -> [String; 9] {
        let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
        let [lower, upper] = self.limits.map(number);
        let deviation = self.value.zip(self.nominal).map(|(value, nominal)| value - nominal);
        [
            self.id.clone(),
            format!("{}, {}", self.measure, self.unit),
            number(self.nominal),
            lower,
            upper,
            number(self.value),
            deviation.map_or_else(|| "–".to_owned(), |deviation| format!("{deviation:+.4}")),
            number(self.expanded_uncertainty),
            self.verdict.map_or("–", PartVerdict::label).to_owned(),
        ]
    }
}

#[cfg(test)]
pub(crate) fn example() -> InspectionSheet {
    let row = |id: &str, value: Option<f64>, verdict| CharacteristicRow {
        id: id.to_owned(),
        measure: "step".to_owned(),
        unit: "mm".to_owned(),
        nominal: Some(8.9),
        limits: [Some(8.85), Some(9.0)],
        value,
        expanded_uncertainty: value.map(|_| 0.012),
        verdict: Some(verdict),
        reason: (verdict == PartVerdict::Invalid).then(|| "no plane <top> was found".to_owned()),
    };
    InspectionSheet {
        id: "019a".to_owned(),
        seq: 812,
        serial: "BL-0042 & co".to_owned(),
        verdict: PartVerdict::NotOk,
        simulated: true,
        facts: vec![("order", "4711".to_owned()), ("recipe", "bracket@7".to_owned())],
        characteristics: vec![
            row("height", Some(8.9123), PartVerdict::Ok),
            row("width", Some(9.5), PartVerdict::NotOk),
            row("depth", None, PartVerdict::Invalid),
        ],
        surfaces: Vec::new(),
        comparisons: Vec::new(),
    }
}
