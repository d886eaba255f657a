//! Every kind of damage to a capture folder is refused with the file, the entry and the remedy.
//!
//! Not covered: whether the images are plausible, which the calibration checks.

use std::path::Path;

use crate::common::{HEIGHT_PX, WIDTH_PX, chain, flat, folder_with, manifest_with, put, refusal, valid_manifest};
use capture::{
    Capture, CaptureError, ChessboardTarget, read_grey_image, read_photograph, sha256_of, write_manifest,
};
use image::ImageFormat;
use serde_json::{Value, json};
use vision::{Channel, GreyImage, LineDirection, Pixels};

/// Opening the valid capture with one value replaced is refused with a message that contains all of `expected`.
#[track_caller]
fn check(pointer: &str, value: Value, expected: &[&str]) {
    let folder = folder_with(&manifest_with(pointer, value));
    let message = refusal(folder.path());
    for part in expected.iter().chain(&["capture.json"]) {
        assert!(message.contains(part), "`{part}` is not in `{message}`");
    }
}

/// Opening the valid capture with changed text is refused with a message that contains all of `expected`.
#[track_caller]
fn check_text(from: &str, to: &str, expected: &[&str]) {
    let folder = folder_with(&valid_manifest());
    let text = serde_json::to_string_pretty(&valid_manifest()).unwrap();
    assert!(text.contains(from));
    std::fs::write(folder.path().join("capture.json"), text.replacen(from, to, 1)).unwrap();
    let message = refusal(folder.path());
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in `{message}`");
    }
}

#[test]
fn jpeg_images_give_a_warning_with_their_qualities() {
    let mut manifest = valid_manifest();
    manifest["poses"][0]["laser"] = json!("laser/000.jpg");
    manifest["scans"][0]["frames"][0]["image"] = json!("scan/000.jpg");
    let folder = folder_with(&manifest);
    for (name, quality) in [("laser/000.jpg", 60), ("scan/000.jpg", 95)] {
        let mut bytes = Vec::new();
        let pixels: Vec<u8> = (0..WIDTH_PX * HEIGHT_PX).map(|k| (k * 37 % 251) as u8).collect();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)
            .encode(&pixels, WIDTH_PX as u32, HEIGHT_PX as u32, image::ExtendedColorType::L8)
            .unwrap();
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let warnings = Capture::open(folder.path()).unwrap().warnings;
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    for words in ["capture.json", "2 images are JPEG of quality 60 to 95", "PNG, TIFF or BMP"] {
        assert!(warning.contains(words), "no {words:?} in {warning}");
    }
}

#[test]
fn a_valid_capture_opens_without_warnings() {
    let folder = folder_with(&valid_manifest());
    let capture = Capture::open(folder.path()).unwrap();
    assert_eq!(capture.warnings, Vec::<String>::new());
    assert_eq!(capture.manifest.projector.direction_of(0), LineDirection::Rows);
    let entries: Vec<String> = capture.files().into_iter().map(|named| named.entry).collect();
    let expected =
        ["poses[0].board", "poses[0].laser", "poses[1].board", "stage_views[0].board", "scans[0].frames[0].image"];
    assert_eq!(entries, expected);
    let image = capture.image("poses[0].board", Path::new("board/000.png")).unwrap();
    assert_eq!(image, flat(WIDTH_PX, HEIGHT_PX));
}

#[test]
fn lines_along_columns_are_understood() {
    let mut manifest = valid_manifest();
    manifest["projector"]["line_direction"] = json!("columns");
    let capture = Capture::open(folder_with(&manifest).path()).unwrap();
    assert_eq!(capture.manifest.projector.direction_of(0), LineDirection::Columns);
}

#[test]
fn a_folder_without_manifest_is_refused() {
    let folder = tempfile::TempDir::new().unwrap();
    assert!(refusal(folder.path()).contains("use a folder that contains capture.json"));
}

#[test]
fn unknown_keys_give_a_warning_with_their_path() {
    let mut manifest = valid_manifest();
    manifest["projector"]["maker"] = json!("A");
    let warnings = Capture::open(folder_with(&manifest).path()).unwrap().warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("projector.maker"), "{warnings:?}");
}

#[test]
fn wrong_values_are_refused_by_entry() {
    check("/format", json!("sheaf-capture/2"), &["sheaf-capture/2", "update the program"]);
    check("/camera/width_px", json!(0), &["camera.width_px", "above 0"]);
    check("/camera", json!({"width_px": 1_000_000, "height_px": 51}), &["1000000×51", "50000000"]);
    check("/camera/height_px", json!(u64::MAX), &["camera.height_px"]);
    check(
        "/target/kind",
        json!("hexagons"),
        &["target", "unknown variant `hexagons`", "chessboard", "charuco", "circles"],
    );
    check("/target/inner_rows", json!(1), &["target.inner_rows", "between 2 and 1000"]);
    check("/target/square_mm", json!(-12), &["target.square_mm is -12", "above 0"]);
    check("/target/square_mm", json!([12, 0]), &["target.square_mm is 0", "above 0"]);
    check("/target/square_mm", json!([12]), &["target.square_mm", "[x, y]"]);
    check("/projector/wavelength_nm", json!(0.0), &["projector.wavelength_nm", "above 0"]);
    check("/projector/grating_lines_per_mm", json!(-50), &["projector.grating_lines_per_mm"]);
    check("/projector/orders", json!([]), &["projector.orders is empty"]);
    check("/projector/orders", json!([-2, -1, -1]), &["projector.orders[2]", "each order once"]);
    check("/projector/orders", json!([-2, 0, -1]), &["projector.orders[2]", "increasing or decreasing"]);
    check("/projector/orders", json!([2, 0, 1]), &["projector.orders[2]", "is 1 after 0"]);
    check("/projector/orders", json!([0, 21]), &["projector.orders[1]", "21"]);
    check("/scans/0/name", json!(" "), &["scans[0].name", "a unique name"]);
}

#[test]
fn orders_may_decrease() {
    let folder = folder_with(&manifest_with("/projector/orders", json!([2, 1, 0, -1])));
    Capture::open(folder.path()).unwrap();
}

#[test]
fn an_unknown_line_direction_is_refused() {
    let mut manifest = valid_manifest();
    manifest["projector"]["line_direction"] = json!("diagonal");
    assert!(refusal(folder_with(&manifest).path()).contains("\"rows\" or \"columns\""));
}

#[test]
fn two_scans_of_one_name_are_refused() {
    let mut manifest = valid_manifest();
    let scan = manifest["scans"][0].clone();
    manifest["scans"].as_array_mut().unwrap().push(scan);
    assert!(refusal(folder_with(&manifest).path()).contains("scans[1].name is \"gauge\""));
}

#[test]
fn values_of_the_wrong_type_are_refused_by_line_and_entry() {
    check_text("-20.0", "null", &["stage_views[0].position_mm", "line", "null"]);
    check_text("\"board\": \"board/001.png\"", "\"bord\": 1", &["line ", "poses[1].board is missing"]);
    check_text("12.0", "\"twelve\"", &["target.square_mm", "twelve"]);
    check_text("-20.0", "1e999", &["stage_views[0].position_mm", "out of range"]);
    check_text("\"poses\"", "\"poses\" \"x\"", &["line", "column", "capture.schema.json"]);
}

#[test]
fn bare_nan_and_infinity_are_refused_by_line_and_entry() {
    check_text("-20.0", "NaN", &["stage_views[0].position_mm is NaN", "line", "remove the entry"]);
    check_text("0.5", "-Infinity", &["scans[0].frames[0].position_mm is -Infinity"]);
    check_text("12.0", "NaN", &["target.square_mm is NaN"]);
}

#[test]
fn a_missing_image_is_named_with_its_entry() {
    let folder = folder_with(&valid_manifest());
    std::fs::remove_file(folder.path().join("laser/000.png")).unwrap();
    let message = refusal(folder.path());
    assert!(message.starts_with("missing image \"laser/000.png\" named by poses[0].laser"), "{message}");
    assert!(message.ends_with("restore the file or remove the pose"), "{message}");
}

#[test]
fn paths_that_leave_the_folder_are_refused() {
    let board = "/poses/0/board";
    check(board, json!("../elsewhere.png"), &["poses[0].board", "leaves the folder", "copy the image"]);
    check(board, json!("board/../../x.png"), &["poses[0].board", "leaves the folder"]);
    check(board, json!("/etc/hostname"), &["poses[0].board", "is absolute"]);
    check(board, json!(""), &["poses[0].board", "is empty"]);
    check(board, json!("board\\000.png"), &["poses[0].board", "backslash"]);
}

#[cfg(unix)]
#[test]
fn a_link_that_leaves_the_folder_is_refused() {
    let elsewhere = tempfile::TempDir::new().unwrap();
    put(elsewhere.path(), "secret.png", &flat(WIDTH_PX, HEIGHT_PX));
    let folder = folder_with(&valid_manifest());
    let link = folder.path().join("board/000.png");
    std::fs::remove_file(&link).unwrap();
    std::os::unix::fs::symlink(elsewhere.path().join("secret.png"), &link).unwrap();
    let message = refusal(folder.path());
    assert!(message.contains("poses[0].board") && message.contains("outside the folder"), "{message}");
}

#[test]
fn an_image_of_another_size_is_refused() {
    let folder = folder_with(&valid_manifest());
    put(folder.path(), "stage/000.png", &flat(WIDTH_PX, HEIGHT_PX + 1));
    let message = refusal(folder.path());
    assert!(message.contains("stage_views[0].board") && message.contains("16×13"), "{message}");
    assert!(message.contains("16×12"), "{message}");
}

#[test]
fn mixed_bit_depths_are_refused_and_16_bits_throughout_are_accepted() {
    let levels: Vec<u16> = (0..WIDTH_PX * HEIGHT_PX).map(|idx| idx as u16 * 301).collect();
    let deep = GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Sixteen(levels)).unwrap();
    let folder = folder_with(&valid_manifest());
    put(folder.path(), "scan/000.png", &deep);
    let message = refusal(folder.path());
    assert!(message.contains("scans[0].frames[0].image has 16 bits"), "{message}");
    for named in Capture::open(folder_with(&valid_manifest()).path()).unwrap().files() {
        put(folder.path(), named.path.to_str().unwrap(), &deep);
    }
    let capture = Capture::open(folder.path()).unwrap();
    assert_eq!(capture.image("x", Path::new("scan/000.png")).unwrap(), deep);
}

/// The valid capture with every image of 16 bits, with these levels in turn.
fn deep_capture(manifest: &serde_json::Value, levels: [u16; 3]) -> tempfile::TempDir {
    let levels = levels.into_iter().cycle().take(WIDTH_PX * HEIGHT_PX).collect();
    let deep = GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Sixteen(levels)).unwrap();
    let folder = folder_with(&valid_manifest());
    let files = Capture::open(folder.path()).unwrap().files();
    files.iter().for_each(|named| put(folder.path(), named.path.to_str().unwrap(), &deep));
    std::fs::write(folder.path().join("capture.json"), manifest.to_string()).unwrap();
    folder
}

#[test]
fn levels_of_sensors_with_fewer_bits_are_scaled_to_full_scale() {
    let read = |manifest: &serde_json::Value, levels: [u16; 3]| {
        let folder = deep_capture(manifest, levels);
        let capture = Capture::open(folder.path()).unwrap();
        let image = capture.image("x", Path::new("scan/000.png")).unwrap();
        (capture.white_level().level(), [0, 1, 2].map(|u| image.at(u, 0)))
    };
    let manifest = valid_manifest();
    assert_eq!(read(&manifest, [0, 2048, 4095]), (4095, [0.0, 32_776.0, 65_535.0]), "12 bits, the lower ones");
    assert_eq!(read(&manifest, [0, 16, 65_520]), (65_520, [0.0, 16.0, 65_535.0]), "12 bits, the upper ones");
    assert_eq!(read(&manifest, [0, 1, 65_535]), (65_535, [0.0, 1.0, 65_535.0]), "16 bits");
    // Every image counts: one alone may be dark.
    let folder = deep_capture(&manifest, [0, 2048, 4095]);
    let dark = Pixels::Sixteen(vec![800; WIDTH_PX * HEIGHT_PX]);
    put(folder.path(), "board/000.png", &GreyImage::new(WIDTH_PX, HEIGHT_PX, dark).unwrap());
    assert_eq!(Capture::open(folder.path()).unwrap().white_level().level(), 4095);

    let mut stated = valid_manifest();
    stated["camera"]["white_level"] = json!(4000);
    assert_eq!(read(&stated, [0, 2000, 4095]), (4000, [0.0, 32_768.0, 65_535.0]));
    let message = refusal(folder_with(&stated).path());
    assert!(message.contains("camera.white_level") && message.contains("8 bits"), "{message}");
}

/// A JPEG with EXIF metadata that say how the camera was held (TIFF tag 0x0112).
fn jpeg_of_orientation(image: &image::GrayImage, orientation: u8) -> Vec<u8> {
    let mut jpeg = std::io::Cursor::new(Vec::new());
    image.write_to(&mut jpeg, ImageFormat::Jpeg).unwrap();
    let jpeg = jpeg.into_inner();
    let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
    let mut turned = jpeg[..2].to_vec();
    turned.extend([0xFF, 0xE1]);
    turned.extend((exif.len() as u16 + 2).to_be_bytes());
    turned.extend(exif);
    turned.extend(&jpeg[2..]);
    turned
}

#[test]
fn photographs_are_turned_as_their_metadata_say() {
    // Bright at the left of the sensor.
    let (width, height) = (WIDTH_PX as u32, HEIGHT_PX as u32);
    let image = image::GrayImage::from_fn(height, width, |u, _| image::Luma([if u < 4 { 220 } else { 20 }]));
    let mut manifest = valid_manifest();
    manifest["poses"][0]["laser"] = json!("laser.jpg");
    let folder = folder_with(&manifest);
    let file = folder.path().join("laser.jpg");
    let is_near = |level: f32, expected: f32| (level - expected).abs() < 12.0;
    // 6: the camera was turned left, so that the image has to be turned right.
    std::fs::write(&file, jpeg_of_orientation(&image, 6)).unwrap();
    let capture = Capture::open(folder.path()).unwrap();
    let turned = capture.image("poses[0].laser", Path::new("laser.jpg")).unwrap();
    assert_eq!((turned.width(), turned.height()), (WIDTH_PX, HEIGHT_PX));
    assert!(is_near(turned.at(8, 1), 220.0) && is_near(turned.at(8, 10), 20.0), "the left is above now");
    std::fs::write(&file, jpeg_of_orientation(&image, 1)).unwrap();
    let message = refusal(folder.path());
    assert!(message.contains("12×16"), "{message}");
}

#[test]
fn colour_images_are_reduced_to_the_channel_stated_for_the_camera() {
    let red = image::RgbImage::from_pixel(WIDTH_PX as u32, HEIGHT_PX as u32, image::Rgb([200, 10, 30]));
    // Channel, level of a laser image, level of a board.
    for (channel, laser, board) in
        [("green", 10.0, 10.0), ("red-minus-others", 170.0, 200.0), ("luma", 69.0, 69.0)]
    {
        let mut manifest = valid_manifest();
        manifest["camera"]["channel"] = json!(channel);
        let folder = folder_with(&manifest);
        red.save(folder.path().join("laser/000.png")).unwrap();
        red.save(folder.path().join("board/000.png")).unwrap();
        let capture = Capture::open(folder.path()).unwrap();
        assert_eq!(capture.warnings, Vec::<String>::new());
        let level = |entry, path| capture.image(entry, Path::new(path)).unwrap().at(3, 3);
        assert_eq!(level("poses[0].laser", "laser/000.png"), laser, "{channel}");
        assert_eq!(level("poses[0].board", "board/000.png"), board, "{channel}");
        // A grey image has only one channel.
        assert_eq!(level("scans[0].frames[0].image", "scan/000.png"), 7.0, "{channel}");
    }
    check_text(
        "\"height_px\": 12",
        "\"height_px\": 12, \"channel\": \"infrared\"",
        &["camera", "red-minus-others"],
    );
}

#[test]
fn every_laser_image_has_its_own_background_or_that_of_the_capture() {
    let mut manifest = valid_manifest();
    manifest["background"] = json!("board/001.png");
    manifest["poses"][0]["background"] = json!("off/000.png");
    let folder = folder_with(&manifest);
    let level =
        |level| GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(vec![level; WIDTH_PX * HEIGHT_PX])).unwrap();
    put(folder.path(), "off/000.png", &level(5));
    put(folder.path(), "scan/000.png", &level(90));
    let capture = Capture::open(folder.path()).unwrap();
    assert_eq!(capture.warnings, Vec::<String>::new());
    let images = capture.laser_images();
    let entries: Vec<_> =
        images.iter().map(|p| (p.entry.as_str(), p.background.as_ref().unwrap().0.as_str())).collect();
    let expected = [("poses[0].laser", "poses[0].background"), ("scans[0].frames[0].image", "background")];
    assert_eq!(entries, expected);
    // 7 − 5 and 90 − 7.
    let levels: Vec<f32> = images.iter().map(|image| capture.laser_image(image).unwrap().at(3, 3)).collect();
    assert_eq!(levels, [2.0, 83.0]);
    std::fs::remove_file(folder.path().join("off/000.png")).unwrap();
    let message = refusal(folder.path());
    assert!(message.contains("poses[0].background") && message.contains("remove the background"), "{message}");
}

#[test]
fn every_format_is_read_by_its_content() {
    let folder = folder_with(&valid_manifest());
    let path = folder.path().join("laser/000.png");
    let red = image::RgbImage::from_pixel(WIDTH_PX as u32, HEIGHT_PX as u32, image::Rgb([200, 10, 30]));
    let deep = image::DynamicImage::from(red.clone()).into_rgb16();
    for (format, tolerance, is_lossy) in [
        (ImageFormat::Png, 0.0, false),
        (ImageFormat::Tiff, 0.0, false),
        (ImageFormat::Bmp, 0.0, false),
        (ImageFormat::Jpeg, 2.0, true),
    ] {
        red.save_with_format(&path, format).unwrap();
        let photograph = read_photograph(&path).unwrap();
        assert_eq!(photograph.jpeg_quality.is_some(), is_lossy, "{format:?}");
        assert!((photograph.image.channel(Channel::Red).at(3, 3) - 200.0).abs() <= tolerance, "{format:?}");
        // Luma.
        assert!((read_grey_image(&path).unwrap().at(3, 3) - 69.0).abs() <= tolerance, "{format:?}");
        Capture::open(folder.path()).unwrap();
    }
    for format in [ImageFormat::Png, ImageFormat::Tiff] {
        deep.save_with_format(&path, format).unwrap();
        let image = read_photograph(&path).unwrap().image;
        assert_eq!((image.bit_depth(), image.channel(Channel::Blue).at(3, 3)), (16, 30.0 * 257.0), "{format:?}");
    }
}

#[test]
fn a_truncated_image_is_refused_by_entry_when_it_is_read() {
    let folder = folder_with(&valid_manifest());
    let noise: Vec<u8> = (0..WIDTH_PX * HEIGHT_PX).map(|idx| (idx * 97 % 251) as u8).collect();
    put(folder.path(), "board/000.png", &GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(noise)).unwrap());
    let path = folder.path().join("board/000.png");
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let opened = Capture::open(folder.path()).and_then(|c| c.image("poses[0].board", Path::new("board/000.png")));
    let message = chain(&opened.unwrap_err());
    assert!(message.contains("poses[0].board") && message.contains("truncated or corrupt"), "{message}");
}

#[test]
fn a_file_that_is_not_an_image_is_refused() {
    let folder = folder_with(&valid_manifest());
    for bytes in [&b"P5 1 1 255 x"[..], b"", b"\x89PNG\r\n\x1a\n"] {
        std::fs::write(folder.path().join("board/000.png"), bytes).unwrap();
        let message = refusal(folder.path());
        assert!(message.contains("\"board/000.png\" named by poses[0].board"), "{message}");
    }
    std::fs::remove_file(folder.path().join("board/000.png")).unwrap();
    std::fs::create_dir(folder.path().join("board/000.png")).unwrap();
    assert!(refusal(folder.path()).contains("is not a PNG, TIFF, BMP or JPEG image"));
}

#[test]
fn a_header_with_too_many_pixels_is_refused_before_decoding() {
    let folder = folder_with(&valid_manifest());
    let path = folder.path().join("board/000.png");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&60_000_u32.to_be_bytes());
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    std::fs::write(&path, bytes).unwrap();
    let message = refusal(folder.path());
    assert!(message.contains("poses[0].board") && message.contains("60000×60000"), "{message}");
}

#[test]
fn an_unknown_scan_lists_the_known_ones() {
    let capture = Capture::open(folder_with(&valid_manifest()).path()).unwrap();
    assert_eq!(capture.scan("gauge").unwrap().frames.len(), 1);
    let error = capture.scan("sphere").unwrap_err();
    assert!(matches!(&error, CaptureError::UnknownScan { available, .. } if available == &["gauge"]));
}

#[test]
fn a_written_manifest_is_read_back_unchanged() {
    let folder = folder_with(&valid_manifest());
    let capture = Capture::open(folder.path()).unwrap();
    write_manifest(folder.path(), &capture.manifest).unwrap();
    assert_eq!(Capture::open(folder.path()).unwrap(), capture);
}

#[test]
fn a_manifest_that_could_not_be_read_back_is_not_written() {
    let folder = folder_with(&valid_manifest());
    let mut manifest = Capture::open(folder.path()).unwrap().manifest;
    manifest.target = ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: f64::NAN.into() }.into();
    write_manifest(folder.path(), &manifest).unwrap_err();
    Capture::open(folder.path()).unwrap();
}

#[test]
fn the_hash_of_a_file_is_its_sha_256() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("abc");
    std::fs::write(&path, b"abc").unwrap();
    // FIPS 180-2, appendix B.1.
    let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(sha256_of(&path).unwrap(), expected);
}

/// PNG's checksum, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0_u32, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn a_missing_entry_of_the_projector_is_named() {
    check("/projector", json!({}), &["projector.wavelength_nm is missing", "kind \"planes\""]);
    check("/projector", json!({"wavelength_nm": 660}), &["projector.grating_lines_per_mm is missing"]);
    check("/projector", json!({"kind": "planes"}), &["projector.lines is missing", "capture.schema.json"]);
    check("/projector", json!({"kind": "planes", "lines": 0}), &["projector.lines is 0", "1 to 41"]);
    check("/projector", json!({"kind": "fan"}), &["projector", "unknown variant `fan`", "planes"]);
}

#[test]
fn independent_lines_are_numbered() {
    let mut manifest = valid_manifest();
    manifest["projector"] = json!({"kind": "planes", "lines": 3, "line_direction": "columns"});
    let projector = Capture::open(folder_with(&manifest).path()).unwrap().manifest.projector;
    assert_eq!(projector.orders(), [0, 1, 2]);
    assert_eq!(projector.direction_of(0), vision::LineDirection::Columns);
}

/// A ChArUco board with one value replaced.
fn charuco(key: &str, value: serde_json::Value) -> serde_json::Value {
    let mut board = json!({"kind": "charuco", "columns": 10, "rows": 7, "square_mm": 20, "marker_mm": 14,
        "dictionary": "DICT_5X5_100"});
    board[key] = value;
    board
}

#[test]
fn an_impossible_charuco_board_is_refused() {
    Capture::open(folder_with(&manifest_with("/target", charuco("rows", json!(7)))).path()).unwrap();
    check("/target", charuco("marker_mm", json!(20)), &["target.marker_mm is 20", "below that of a square"]);
    check("/target", charuco("dictionary", json!("DICT_9X9")), &["target.dictionary", "DICT_9X9", "OpenCV"]);
    check("/target", charuco("columns", json!(40)), &["140 markers", "DICT_5X5_100 has 100", "larger dictionary"]);
    check("/target", json!({"kind": "charuco", "columns": 10}), &["target.rows is missing"]);
}

#[test]
fn discs_must_not_touch() {
    let grid = |kind: &str, diameter_mm: f64| json!({"kind": kind, "columns": 4, "rows": 11, "square_mm": 15, "diameter_mm": diameter_mm});
    // Nearest neighbours in an asymmetric grid are diagonal.
    Capture::open(folder_with(&manifest_with("/target", grid("asymmetric_circles", 20.0))).path()).unwrap();
    check("/target", grid("asymmetric_circles", 22.0), &["target.diameter_mm is 22", "neighbouring discs"]);
    check("/target", grid("circles", 15.0), &["target.diameter_mm is 15", "neighbouring discs"]);
    check("/target", json!({"kind": "circles", "columns": 10}), &["target.rows is missing"]);
}

#[test]
fn squares_may_have_different_sides() {
    let folder = folder_with(&manifest_with("/target/square_mm", json!([12.0, 12.1])));
    let square = Capture::open(folder.path()).unwrap().manifest.target.square_mm();
    assert_eq!((square.x_mm, square.y_mm), (12.0, 12.1));
}

#[test]
fn a_missing_position_or_one_of_the_other_kind_is_refused_by_entry() {
    let of_stage = |stage: Value, frame: Value| {
        let mut manifest = manifest_with("/scans/0/frames/0", frame);
        manifest["stage"] = stage;
        manifest["stage_views"] = json!([]);
        refusal(folder_with(&manifest).path())
    };
    let rotary = || json!({"kind": "rotary"});
    let cases = [
        (
            rotary(),
            json!({"image": "scan/000.png"}),
            ["frames[0].angle_deg is missing", "rotary", "state the stage position"],
        ),
        (
            json!({}),
            json!({"image": "scan/000.png"}),
            ["frames[0].position_mm is missing", "linear", "state the stage position"],
        ),
        (
            rotary(),
            json!({"image": "scan/000.png", "position_mm": 1}),
            ["frames[0].position_mm", "rotary", "angle_deg instead"],
        ),
        (
            json!({}),
            json!({"image": "scan/000.png", "angle_deg": 1}),
            ["frames[0].angle_deg", "linear", "stage.kind \"rotary\""],
        ),
        (
            rotary(),
            json!({"image": "scan/000.png", "angle_deg": 1, "position_mm": 1}),
            ["frames[0].position_mm", "rotary", "angle_deg instead"],
        ),
        (
            json!({"kind": "rotary", "angle_sigma_deg": -1}),
            json!({"image": "scan/000.png", "angle_deg": 1}),
            ["stage.angle_sigma_deg is -1", "above 0", ""],
        ),
        (
            json!({"angle_sigma_deg": 1}),
            json!({"image": "scan/000.png", "position_mm": 1}),
            ["stage.angle_sigma_deg", "linear", "stage.kind \"rotary\""],
        ),
    ];
    for (stage, frame, words) in cases {
        let message = of_stage(stage, frame);
        words.iter().for_each(|word| assert!(message.contains(word), "{message}"));
    }
}
