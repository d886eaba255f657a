//! The requested range, in the unit of the station's stage.

use optics::StageKind;

use super::checks::refused;
use crate::error::AppError;
use crate::resources::scan_run::ScanSettings;

/// The requested range; absent fields follow from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequestedRange {
    /// The kind of stage.
    pub stage: StageKind,
    /// Position of the first row.
    pub from: Option<f64>,
    /// Position of the last row.
    pub to: Option<f64>,
    /// Distance between rows.
    pub step: Option<f64>,
    /// Speed of a continuous scan, per second.
    pub speed: Option<f64>,
}

/// Names of the input fields of the range.
#[derive(Debug, Clone, Copy)]
pub struct RangeFields {
    pub from: &'static str,
    pub to: &'static str,
    pub step: &'static str,
    pub speed: &'static str,
}

/// The field names for this kind of stage.
pub fn fields_of(stage: StageKind) -> RangeFields {
    match stage {
        StageKind::Linear => RangeFields { from: "from_mm", to: "to_mm", step: "step_mm", speed: "speed_mm_s" },
        StageKind::Rotary => {
            RangeFields { from: "from_deg", to: "to_deg", step: "step_deg", speed: "speed_deg_s" }
        }
    }
}

impl RequestedRange {
    /// The range in `settings` in the unit of this kind of stage.
    pub fn of(settings: &ScanSettings, stage: StageKind) -> Self {
        let [from, to, step, speed] = match stage {
            StageKind::Linear => [settings.from_mm, settings.to_mm, settings.step_mm, settings.speed_mm_s],
            StageKind::Rotary => [settings.from_deg, settings.to_deg, settings.step_deg, settings.speed_deg_s],
        };
        Self { stage, from, to, step, speed }
    }

    /// The given fields with their names.
    pub fn given(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let names = fields_of(self.stage);
        let fields =
            [(names.from, self.from), (names.to, self.to), (names.step, self.step), (names.speed, self.speed)];
        fields.into_iter().filter_map(|(name, value)| Some((name, value?)))
    }

    /// `settings` with this range.
    pub fn filled_into(&self, settings: &ScanSettings) -> ScanSettings {
        let Self { stage, from, to, step, speed } = *self;
        let settings = settings.clone();
        match stage {
            StageKind::Linear => {
                ScanSettings { from_mm: from, to_mm: to, step_mm: step, speed_mm_s: speed, ..settings }
            }
            StageKind::Rotary => {
                ScanSettings { from_deg: from, to_deg: to, step_deg: step, speed_deg_s: speed, ..settings }
            }
        }
    }

    /// The range in `settings` for the station's stage.
    ///
    /// # Errors
    /// A field in the unit of the other kind of stage.
    pub fn checked(settings: &ScanSettings, stage: StageKind) -> Result<Self, AppError> {
        let (other, does) = match stage {
            StageKind::Linear => (StageKind::Rotary, "travels"),
            StageKind::Rotary => (StageKind::Linear, "turns"),
        };
        if let Some((field, _)) = Self::of(settings, other).given().next() {
            let names = fields_of(stage);
            let remedy = format!("give {}, {} and {} instead", names.from, names.to, names.step);
            return Err(refused(field, format!("{field} is given, but the station's stage {does}"), remedy));
        }
        Ok(Self::of(settings, stage))
    }
}
