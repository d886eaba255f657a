//! `sheaf target`: writes a calibration board for printing at true scale.

use capture::{CharucoTarget, ChessboardTarget, CirclesTarget, SquareMm, Target};
use pipeline::{Failure, FailureKind, Reporter};
use report::target_sheet::target_sheet;
use serde_json::json;

use crate::answer::output::write_file;
use crate::arguments::{TargetArgs, TargetKind};
use crate::commands::Answer;

/// Ratio of marker size to square size: leaves room for corner detection while the marker remains readable.
const MARKER_RATIO: f64 = 0.7;

/// Ratio of disc diameter to grid spacing: large, since the accuracy of a centre grows with the length of the edge, but
/// with room for a blurred edge.
const CIRCLE_RATIO: f64 = 0.6;
/// The same for an asymmetric grid, whose discs are 1.4 row spacings apart.
const ASYMMETRIC_CIRCLE_RATIO: f64 = 0.85;

/// Writes the page and prints the entry that a capture needs for the board.
pub fn run(args: &TargetArgs, _: &dyn Reporter) -> Result<Answer, Failure> {
    let target = target(args)?;
    let entry = serde_json::to_value(&target).map_err(|error| Failure::bad_input(error.to_string()))?;
    let sheet = target_sheet(&target, &format!("\"target\": {entry}"))
        .map_err(|error| pipeline::failure_of(FailureKind::BadParameter, &error))?;
    write_file(&args.output, &sheet.pdf)?;
    let text = format!(
        "board on {} → {}\nprint it at 100 % and measure its ruler: {:.0} mm\nin capture.json: \"target\": {entry}\n",
        sheet.page,
        args.output.display(),
        sheet.ruler_mm
    );
    let json = json!({ "output": args.output, "page": sheet.page, "ruler_mm": sheet.ruler_mm, "target": entry });
    Ok(Answer::done(text, json))
}

fn target(args: &TargetArgs) -> Result<Target, Failure> {
    let wrong = |what: &str| Err(Failure::new(FailureKind::BadParameter, what.to_owned()));
    if !(args.square_mm > 0.0 && args.square_mm.is_finite()) {
        return wrong("--square-mm must be a number above 0");
    }
    let has_squares = matches!(args.kind, TargetKind::Chessboard | TargetKind::Charuco);
    let (columns, rows) = match args.kind {
        TargetKind::Chessboard | TargetKind::Charuco => (args.columns.unwrap_or(12), args.rows.unwrap_or(9)),
        TargetKind::Circles => (args.columns.unwrap_or(9), args.rows.unwrap_or(7)),
        TargetKind::AsymmetricCircles => (args.columns.unwrap_or(4), args.rows.unwrap_or(11)),
    };
    if has_squares && (columns < 3 || rows < 3) {
        return wrong("--columns and --rows count squares: at least 3 each");
    }
    if columns < 2 || rows < 2 {
        return wrong("--columns and --rows count circles: at least 2 each");
    }
    let square_mm = SquareMm::from(args.square_mm);
    Ok(match args.kind {
        TargetKind::Chessboard => {
            let (inner_columns, inner_rows) = (columns - 1, rows - 1);
            ChessboardTarget { inner_columns, inner_rows, square_mm }.into()
        }
        TargetKind::Charuco => Target::Charuco(CharucoTarget {
            columns,
            rows,
            square_mm,
            marker_mm: MARKER_RATIO * args.square_mm,
            dictionary: args.dictionary.clone(),
        }),
        TargetKind::Circles => {
            let diameter_mm = CIRCLE_RATIO * args.square_mm;
            Target::Circles(CirclesTarget { columns, rows, square_mm, diameter_mm })
        }
        TargetKind::AsymmetricCircles => {
            let diameter_mm = ASYMMETRIC_CIRCLE_RATIO * args.square_mm;
            Target::AsymmetricCircles(CirclesTarget { columns, rows, square_mm, diameter_mm })
        }
    })
}
