//! `sheaf target`: what it writes and says.

use crate::common::{path, sheaf, sheaf_json};

#[test]
fn a_board_is_written_true_to_scale_with_the_entry_of_its_capture() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "board.pdf");
    let (made, exit) = sheaf_json(&[
        "target",
        "--kind",
        "charuco",
        "--columns",
        "9",
        "--rows",
        "6",
        "--square-mm",
        "20",
        "-o",
        &file,
    ]);
    assert_eq!(exit, 0, "{made:#}");
    assert_eq!((made["page"].as_str(), made["target"]["marker_mm"].as_f64()), (Some("A4"), Some(14.0)));
    assert_eq!((made["target"]["kind"].as_str(), made["target"]["columns"].as_u64()), (Some("charuco"), Some(9)));
    let pdf = std::fs::read(&file).unwrap();
    let text = String::from_utf8_lossy(&pdf);
    // A4 landscape, and a square of 20 mm, in points.
    for words in ["%PDF-", "/MediaBox [0 0 841.8898 595.27", "56.692917 56.692917 re"] {
        assert!(text.contains(words), "`{words}` is not in:\n{}", &text[..text.len().min(900)]);
    }
}

#[test]
fn a_board_without_markers_enough_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "board.pdf");
    let output =
        sheaf(&["target", "--kind", "charuco", "--dictionary", "DICT_4X4_50", "--columns", "20", "-o", &file]);
    let message = crate::common::err(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("90 markers") && message.contains("larger dictionary"), "{message}");
}
