//! Faults of a simulated station, by name.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use remedy::Remedy;

/// A fault; one of each kind at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TwinFault {
    /// Every n-th exposure is lost.
    LostFrames {
        /// n, at least 1: every frame.
        every: u64,
    },
    /// The camera's cable is unplugged; after it is plugged in again, the camera must be reconnected.
    CameraUnplugged,
    /// Frames arrive with half the configured height.
    WrongFrameSize,
    /// Frames arrive with twice the configured bytes per pixel.
    WrongPixelFormat,
    /// The camera accepts commands and sends nothing.
    CameraHang,
    /// The carriage cannot pass a position.
    StageStall {
        /// The position.
        at_mm: f64,
    },
    /// The motor has lost steps: the controller's position is wrong until homing.
    LostSteps {
        /// Distance by which the true position lags behind the reported one.
        lost_mm: f64,
    },
    /// The stage's controller does not respond.
    StageSilent,
    /// The stage's cable is unplugged.
    StageUnplugged,
    /// The laser's driver reports a fault.
    LaserFault,
    /// The laser's interlock is open.
    InterlockOpen,
    /// The laser's cable is unplugged.
    LaserUnplugged,
    /// The laser has warmed up or cooled down.
    WavelengthDrift {
        /// Relative change of λ/d_g.
        relative: f64,
    },
    /// Dirt on the grating weakens the orders unevenly and scatters light.
    DirtyGrating {
        /// 0 is clean, 1 entirely dirty.
        fraction: f64,
    },
    /// The sensor has hot pixels and a fixed pattern of its rows.
    SensorDefects {
        /// Size of the pattern, grey levels of 255.
        levels: f64,
    },
    /// The belt that triggers the camera has stopped.
    ConveyorStopped,
    /// The lens is covered by its cap.
    LensCovered,
}

/// Why a text is not a fault name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FaultNameError {
    /// An unknown name.
    #[error("there is no fault \"{name}\"")]
    Unknown {
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
    /// A value outside the fault's range.
    #[error("{name} cannot be {value}")]
    BadValue {
        /// The fault.
        name: String,
        /// The value.
        value: String,
        /// The permitted values.
        expected: &'static str,
    },
}

impl Remedy for FaultNameError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Unknown { known, .. } => format!("use one of {known}").into(),
            Self::BadValue { expected, .. } => format!("give {expected}").into(),
        })
    }
}

impl TwinFault {
    /// One of each kind, with a typical value.
    pub const EXAMPLES: [Self; 17] = [
        Self::LostFrames { every: 10 },
        Self::CameraUnplugged,
        Self::WrongFrameSize,
        Self::WrongPixelFormat,
        Self::CameraHang,
        Self::StageStall { at_mm: 5.0 },
        Self::LostSteps { lost_mm: 0.5 },
        Self::StageSilent,
        Self::StageUnplugged,
        Self::LaserFault,
        Self::InterlockOpen,
        Self::LaserUnplugged,
        Self::WavelengthDrift { relative: 1e-3 },
        Self::DirtyGrating { fraction: 0.3 },
        Self::SensorDefects { levels: 6.0 },
        Self::ConveyorStopped,
        Self::LensCovered,
    ];

    /// Name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::LostFrames { .. } => "lost_frames",
            Self::CameraUnplugged => "camera_unplugged",
            Self::WrongFrameSize => "wrong_frame_size",
            Self::WrongPixelFormat => "wrong_pixel_format",
            Self::CameraHang => "camera_hang",
            Self::StageStall { .. } => "stage_stall",
            Self::LostSteps { .. } => "lost_steps",
            Self::StageSilent => "stage_silent",
            Self::StageUnplugged => "stage_unplugged",
            Self::LaserFault => "laser_fault",
            Self::InterlockOpen => "interlock_open",
            Self::LaserUnplugged => "laser_unplugged",
            Self::WavelengthDrift { .. } => "wavelength_drift",
            Self::DirtyGrating { .. } => "dirty_grating",
            Self::SensorDefects { .. } => "sensor_defects",
            Self::ConveyorStopped => "conveyor_stopped",
            Self::LensCovered => "lens_covered",
        }
    }

    /// Value, if the fault has one: frames, mm, a relative change, a fraction, grey levels.
    pub fn value(&self) -> Option<f64> {
        match *self {
            Self::LostFrames { every } => Some(every as f64),
            Self::StageStall { at_mm } => Some(at_mm),
            Self::LostSteps { lost_mm } => Some(lost_mm),
            Self::WavelengthDrift { relative } => Some(relative),
            Self::DirtyGrating { fraction } => Some(fraction),
            Self::SensorDefects { levels } => Some(levels),
            _ => None,
        }
    }

    /// The fault of that name; without a value a typical one is used.
    ///
    /// # Errors
    /// [`FaultNameError`] for an unknown name or an impossible value.
    pub fn named(name: &str, value: Option<f64>) -> Result<Self, FaultNameError> {
        let known = || Self::EXAMPLES.map(|fault| fault.name()).join(", ");
        let ordinary = Self::EXAMPLES.into_iter().find(|fault| fault.name() == name);
        let ordinary =
            ordinary.ok_or_else(|| FaultNameError::Unknown { name: name.to_owned(), known: known() })?;
        let Some(value) = value else { return Ok(ordinary) };
        let (fault, allowed, expected) = match ordinary {
            Self::LostFrames { .. } => {
                let whole = value.fract() == 0.0 && (1.0..=1e9).contains(&value);
                (Self::LostFrames { every: value as u64 }, whole, "a whole number of frames, at least 1")
            }
            Self::StageStall { .. } => (Self::StageStall { at_mm: value }, value.is_finite(), "a position in mm"),
            Self::LostSteps { .. } => (Self::LostSteps { lost_mm: value }, value.is_finite(), "a distance in mm"),
            Self::WavelengthDrift { .. } => {
                (Self::WavelengthDrift { relative: value }, value.abs() < 0.05, "a relative change below 0.05")
            }
            Self::DirtyGrating { .. } => {
                (Self::DirtyGrating { fraction: value }, (0.0..=1.0).contains(&value), "a fraction of 0 to 1")
            }
            Self::SensorDefects { .. } => {
                (Self::SensorDefects { levels: value }, (0.0..=50.0).contains(&value), "0 to 50 grey levels")
            }
            other => (other, false, "no value"),
        };
        let bad = || FaultNameError::BadValue { name: name.to_owned(), value: value.to_string(), expected };
        if allowed { Ok(fault) } else { Err(bad()) }
    }
}

impl fmt::Display for TwinFault {
    /// `name` or `name=value`, as parsed by [`FromStr`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value() {
            Some(value) => write!(f, "{}={value}", self.name()),
            None => f.write_str(self.name()),
        }
    }
}

impl FromStr for TwinFault {
    type Err = FaultNameError;

    fn from_str(text: &str) -> Result<Self, FaultNameError> {
        let Some((name, value)) = text.split_once('=') else { return Self::named(text, None) };
        let number = value.trim().parse::<f64>().map_err(|_| FaultNameError::BadValue {
            name: name.trim().to_owned(),
            value: value.trim().to_owned(),
            expected: "a number",
        })?;
        Self::named(name.trim(), Some(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_reads_back_what_it_shows() {
        for fault in TwinFault::EXAMPLES {
            assert_eq!(fault.to_string().parse(), Ok(fault));
            assert_eq!(TwinFault::named(fault.name(), None), Ok(fault));
        }
        assert_eq!("stage_stall = -3.5".parse(), Ok(TwinFault::StageStall { at_mm: -3.5 }));
    }

    #[test]
    fn an_invalid_fault_name_is_refused() {
        for text in
            ["fire", "lost_frames=0", "lost_frames=1.5", "dirty_grating=NaN", "camera_hang=1", "stage_stall=x"]
        {
            let refused = text.parse::<TwinFault>();
            assert!(refused.is_err(), "{text}: {refused:?}");
        }
    }
}
