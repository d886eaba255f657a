//! Checks of the stage: its reported position, and its scale by a board.

use devices::{CameraRequest, StageKind};
use pipeline::{board_geometry, find_board};
use station::{StationLease, StationRefusal};
use vision::BoardCorners;

use super::check::{Check, Outcome};
use super::examination::Examination;
use super::figures;
use super::limits::{BOARD_EXPOSURES, MAX_DISPLACEMENT_SCATTER, MOVE_MM, POSITION_MM, SCALE_PERCENT};

impl Examination<'_> {
    /// Moves the stage forth and back.
    pub fn motion(&self) -> Result<Vec<Check>, StationRefusal> {
        const NAME: &str = "stage position";
        let capabilities = self.station.status().stage.capabilities.clone();
        if capabilities.follows_frames {
            return Ok(vec![Check::stated(NAME, Outcome::NotRun, "this stage cannot be commanded")]);
        }
        if capabilities.kind != StageKind::Linear {
            return Ok(vec![Check::stated(NAME, Outcome::NotRun, "turntables are not checked")]);
        }
        let lease = self.lease()?;
        lease.configure(&self.camera_request())?;
        if !self.station.status().homed {
            lease.home(self.cancel)?;
        }
        let (low, high) = capabilities.travel_mm;
        let start_mm = self.station.status().position_mm.unwrap_or(low).clamp(low, high);
        // Towards the middle of the travel.
        let move_mm = MOVE_MM.min(0.5 * (high - low)).copysign(0.5 * (low + high) - start_mm);
        let board_before = self.board(&lease)?;
        let there_mm = lease.move_to(start_mm + move_mm, None, self.cancel)?;
        let board_after = if board_before.is_some() { self.board(&lease)? } else { None };
        let back_mm = lease.move_to(start_mm, None, self.cancel)?;
        let error_mm = (there_mm - start_mm - move_mm).abs().max((back_mm - start_mm).abs());
        let limit_mm = POSITION_MM + capabilities.resolution_mm;
        let position = Check::measured(
            NAME,
            error_mm <= limit_mm,
            (error_mm, "mm"),
            format!("{move_mm:+.1} mm and back, reported position off by {error_mm:.3} mm"),
        )
        .limit(format!("≤ {limit_mm:.3} mm"))
        .remedy("check for obstacles, the speed and the motor current");
        Ok(vec![position, self.scale(board_before.zip(board_after), there_mm - start_mm)])
    }

    /// The board in an image with the laser off, if it is detected.
    fn board(&self, lease: &StationLease) -> Result<Option<BoardCorners>, StationRefusal> {
        let set_us = lease.configure(&CameraRequest::default())?.exposure_us;
        let range = self.station.status().camera.capabilities.exposure_us;
        let mut found = None;
        for factor in BOARD_EXPOSURES {
            if let Some(range) = range {
                let exposure_us = Some(range.clamp(set_us * factor));
                lease.configure(&CameraRequest { exposure_us, ..CameraRequest::default() })?;
            }
            let frame = lease.grab(self.cancel)?;
            found = find_board(&frame.image, &self.settings.board).ok();
            if found.is_some() || range.is_none() {
                break;
            }
        }
        if range.is_some() {
            lease.configure(&CameraRequest { exposure_us: Some(set_us), ..CameraRequest::default() })?;
        }
        Ok(found)
    }

    fn scale(&self, boards: Option<(BoardCorners, BoardCorners)>, moved_mm: f64) -> Check {
        const NAME: &str = "stage scale";
        let Some((before, after)) = boards else {
            return Check::stated(NAME, Outcome::NotRun, "no board detected before and after the move")
                .remedy("place the board described by [target] flat on the stage");
        };
        let displacement = figures::board_displacement(&before, &after, &board_geometry(&self.settings.board));
        let Some((by_board_mm, scatter_mm)) = displacement
            .filter(|(by_board_mm, scatter)| *scatter <= MAX_DISPLACEMENT_SCATTER * by_board_mm.max(1.0))
        else {
            return Check::stated(NAME, Outcome::NotRun, "the board is not aligned with the stage travel")
                .remedy("place it flat on the stage so that it does not slip");
        };
        let percent = 100.0 * (by_board_mm / moved_mm.abs() - 1.0);
        // Lens distortion and tilt affect all corners: averaging over more of them does not reduce the error.
        let expanded_percent = 2.0 * 100.0 * scatter_mm / moved_mm.abs();
        let figure = format!(
            "{by_board_mm:.3} mm by the board, {:.3} mm by the stage: {percent:+.2} ± {expanded_percent:.2} % (k = 2)",
            moved_mm.abs()
        );
        Check::measured(NAME, percent.abs() <= SCALE_PERCENT, (percent, "%"), figure)
            .limit(format!("±{SCALE_PERCENT} %"))
            .remedy("set the steps per millimetre of the stage, and check the configured square size")
    }
}
