//! The report of an inspection as HTML and PDF: verdict, characteristics, the cloud.

mod html;
mod pdf;

pub use html::inspection_page;
pub use pdf::inspection_pdf;

use metrology::PartVerdict;

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
const COLUMNS: [&str; 8] =
    ["characteristic", "measure", "nominal", "lower", "upper", "value", "U (k = 2)", "verdict"];

/// Notice for inspections without real devices.
const SIMULATED: &str = "Simulated or replayed devices: not a verdict on a real part.";

impl CharacteristicRow {
    /// The cells of its row.
    fn cells(&self) -> [String; 8] {
        let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
        let [lower, upper] = self.limits.map(number);
        [
            self.id.clone(),
            format!("{}, {}", self.measure, self.unit),
            number(self.nominal),
            lower,
            upper,
            number(self.value),
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
    }
}
