//! Unknown keys of the manifest: ignored, but reported to the operator.

use serde_json::Value;

/// The known keys of one kind of object, and the objects below them.
struct Known {
    keys: &'static [&'static str],
    below: &'static [(&'static str, &'static Known)],
}

const CAMERA: Known = Known { keys: &["width_px", "height_px", "channel", "white_level"], below: &[] };
const TARGET: Known = Known {
    keys: &[
        "kind",
        "inner_columns",
        "inner_rows",
        "columns",
        "rows",
        "square_mm",
        "marker_mm",
        "diameter_mm",
        "dictionary",
    ],
    below: &[],
};
const PROJECTOR: Known = Known {
    keys: &["kind", "wavelength_nm", "grating_lines_per_mm", "orders", "lines", "line_direction", "switched"],
    below: &[],
};
const STAGE: Known = Known { keys: &["kind", "angle_sigma_deg"], below: &[] };
const POSE: Known = Known { keys: &["board", "laser", "lasers", "background"], below: &[] };
const STAGE_VIEW: Known = Known { keys: &["board", "position_mm", "angle_deg"], below: &[] };
const FRAME: Known = Known { keys: &["image", "position_mm", "angle_deg", "background", "line"], below: &[] };
const SCAN: Known = Known { keys: &["name", "frames"], below: &[("frames", &FRAME)] };
const MANIFEST: Known = Known {
    keys: &["format", "camera", "target", "projector", "stage", "background", "poses", "stage_views", "scans"],
    below: &[
        ("camera", &CAMERA),
        ("target", &TARGET),
        ("projector", &PROJECTOR),
        ("stage", &STAGE),
        ("poses", &POSE),
        ("stage_views", &STAGE_VIEW),
        ("scans", &SCAN),
    ],
};

/// Paths of all keys of a manifest that are not part of the format.
pub(crate) fn unknown_keys(manifest: &Value) -> Vec<String> {
    let mut found = Vec::new();
    collect(manifest, "", &MANIFEST, &mut found);
    found
}

fn collect(value: &Value, path: &str, known: &Known, found: &mut Vec<String>) {
    if let Value::Array(items) = value {
        for (idx, item) in items.iter().enumerate() {
            collect(item, &format!("{path}[{idx}]"), known, found);
        }
    }
    let Value::Object(object) = value else { return };
    for (key, inner) in object {
        let inner_path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if !known.keys.contains(&key.as_str()) {
            found.push(inner_path);
        } else if let Some((_, below)) = known.below.iter().find(|(name, _)| name == key) {
            collect(inner, &inner_path, below, found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_keys_are_named_by_their_paths() {
        let manifest = serde_json::json!({
            "format": "x", "operator": "A", "scans": [{"name": "a", "frames": [{"image": "b", "gain": 2}]}]
        });
        assert_eq!(unknown_keys(&manifest), ["operator", "scans[0].frames[0].gain"]);
    }
}
