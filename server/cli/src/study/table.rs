//! Tables of the study.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::study::paper::{FIELD_HALF_WIDTHS_MM, GRATING_TILTS_DEG, ModelErrors, PaperStudy};

/// Ratio reported in the paper: RMSE 0.133 → 0.083 mm.
const PAPER_RATIO: f64 = 0.624;

/// The tables as text, µm.
pub fn study_text(study: &PaperStudy) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "Depth RMSE over the working volume in µm, root mean square over {} seeds (first table).\n",
        study.seeds
    );
    text.push_str(
        "Regime of the paper: field ±15 mm at 400 mm, normal incidence, centreline 0.5 px, corners 0.05 px,\n",
    );
    text.push_str("camera known. Bound: Cramér–Rao bound of the joint problem of boards and grating.\n\n");
    text.push_str(" poses   planes   pencil  grating    bound   pencil/planes  grating/planes  grating/bound\n");
    for row in &study.claim {
        let [planes, pencil, grating] = um(&row.errors);
        let bound = 1e3 * row.bound_mm;
        let _ = writeln!(
            text,
            " {:>5}  {planes:>7.1}  {pencil:>7.1}  {grating:>7.1}  {bound:>7.1}   {:>13.3}  {:>14.3}  {:>13.3}",
            row.n_poses,
            pencil / planes,
            grating / planes,
            grating / bound
        );
    }
    let _ = writeln!(text, "\n The paper reports pencil/planes = {PAPER_RATIO}.\n");
    text.push_str("Limits of plane models: 15 poses, centreline 0.15 px, corners 0.021 px, camera known.\n\n");
    text.push_str("  tilt  model   ");
    for field in FIELD_HALF_WIDTHS_MM {
        let _ = write!(text, "  ±{field:>4.0} mm");
    }
    text.push('\n');
    for tilt in GRATING_TILTS_DEG {
        for (idx, model) in ["planes", "pencil", "grating"].iter().enumerate() {
            let _ = write!(text, "  {:>4}  {model:<8}", if idx == 0 { format!("{tilt}°") } else { String::new() });
            for row in study.field.iter().filter(|row| row.grating_tilt_deg == tilt) {
                let _ = write!(text, "  {:>8.1}", um(&row.errors)[idx]);
            }
            text.push('\n');
        }
    }
    text.push_str("\nCorner noise and the bound: camera estimated as well; 17 poses, field ±75 mm, tilt 2°.\n\n");
    text.push_str(" corner noise px   grating    bound   grating/bound\n");
    for row in &study.corners {
        let _ = writeln!(
            text,
            " {:>15.4}  {:>8.1} {:>8.1}  {:>14.3}",
            row.corner_sigma_px,
            1e3 * row.grating_mm,
            1e3 * row.bound_mm,
            row.grating_mm / row.bound_mm
        );
    }
    text
}

/// The tables as JSON, mm.
pub fn study_json(study: &PaperStudy, plot: &Path) -> Value {
    let errors =
        |e: &ModelErrors| json!({"planes_mm": e.planes_mm, "pencil_mm": e.pencil_mm, "grating_mm": e.grating_mm});
    json!({
        "seeds": study.seeds,
        "claim": study.claim.iter().map(|row| json!({
            "n_poses": row.n_poses, "rmse": errors(&row.errors), "bound_mm": row.bound_mm,
            "pencil_over_planes": row.errors.pencil_mm / row.errors.planes_mm,
            "grating_over_bound": row.errors.grating_mm / row.bound_mm,
        })).collect::<Vec<_>>(),
        "field": study.field.iter().map(|row| json!({
            "field_half_width_mm": row.field_half_width_mm, "grating_tilt_deg": row.grating_tilt_deg,
            "rmse": errors(&row.errors),
        })).collect::<Vec<_>>(),
        "corners": study.corners.iter().map(|row| json!({
            "corner_sigma_px": row.corner_sigma_px, "grating_mm": row.grating_mm, "bound_mm": row.bound_mm,
            "grating_over_bound": row.grating_mm / row.bound_mm,
        })).collect::<Vec<_>>(),
        "plot": plot,
    })
}

fn um(errors: &ModelErrors) -> [f64; 3] {
    [1e3 * errors.planes_mm, 1e3 * errors.pencil_mm, 1e3 * errors.grating_mm]
}
