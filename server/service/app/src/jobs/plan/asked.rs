//! The requested range, in the unit of the station's stage.

use optics::StageKind;

use super::checks::refused;
use crate::error::AppError;
use crate::jobs::ScanInput;

/// The requested range; absent fields follow from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AskedRange {
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

impl AskedRange {
    /// The range in `input` in the unit of this kind of stage.
    pub fn of(input: &ScanInput, stage: StageKind) -> Self {
        let [from, to, step, speed] = match stage {
            StageKind::Linear => [input.from_mm, input.to_mm, input.step_mm, input.speed_mm_s],
            StageKind::Rotary => [input.from_deg, input.to_deg, input.step_deg, input.speed_deg_s],
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

    /// `input` with this range.
    pub fn filled_into(&self, input: &ScanInput) -> ScanInput {
        let Self { stage, from, to, step, speed } = *self;
        let input = input.clone();
        match stage {
            StageKind::Linear => ScanInput { from_mm: from, to_mm: to, step_mm: step, speed_mm_s: speed, ..input },
            StageKind::Rotary => {
                ScanInput { from_deg: from, to_deg: to, step_deg: step, speed_deg_s: speed, ..input }
            }
        }
    }

    /// The range in `input` for the station's stage.
    ///
    /// # Errors
    /// A field in the unit of the other kind of stage.
    pub fn checked(input: &ScanInput, stage: StageKind) -> Result<Self, AppError> {
        let (other, does) = match stage {
            StageKind::Linear => (StageKind::Rotary, "travels"),
            StageKind::Rotary => (StageKind::Linear, "turns"),
        };
        if let Some((field, _)) = Self::of(input, other).given().next() {
            let names = fields_of(stage);
            let remedy = format!("give {}, {} and {} instead", names.from, names.to, names.step);
            return Err(refused(field, format!("{field} is given, but the station's stage {does}"), remedy));
        }
        Ok(Self::of(input, stage))
    }
}
