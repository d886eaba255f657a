//! Clouds as E57 (ASTM E2807).
//!
//! Stored: positions (metres, float64: the conversion from millimetres costs one unit in the last place),
//! intensity, the comments (in the scan's description). The other columns are attributes of the extension `sheaf`,
//! which other programs ignore as the standard requires; this reader restores all of them.

use std::io::{BufRead, Read, Seek, Write};

use e57::{E57Reader, E57Writer, Extension, Record, RecordDataType, RecordName, RecordValue};

use super::{ContentError, FIELDS, one_line, point_from_fields, push, trusted_capacity};
use crate::points::cloud::{Cloud, CloudPoint};

const NAMESPACE: &str = "sheaf";
const NAMESPACE_URL: &str = "https://sheaf.invalid/e57/1";
const MM_PER_METRE: f64 = 1000.0;

/// Writes a whole file at once: its header holds offsets that are known only at the end. `points` is iterated
/// twice.
pub(super) fn write<P>(
    out: impl Read + Write + Seek,
    comments: &[String],
    points: impl Fn() -> Result<P, ContentError>,
) -> Result<(), ContentError>
where
    P: Iterator<Item = Result<CloudPoint, ContentError>>,
{
    let guid = content_guid(comments, points()?)?;
    let mut file = E57Writer::new(out, &guid).map_err(written)?;
    file.register_extension(Extension::new(NAMESPACE, NAMESPACE_URL)).map_err(written)?;
    let mut scan = file.add_pointcloud(&format!("{guid}-scan"), prototype()).map_err(written)?;
    scan.set_name(Some("scan".to_owned()));
    let description: Vec<String> = comments.iter().map(|comment| one_line(comment)).collect();
    scan.set_description(Some(description.join("\n")));
    for point in points()? {
        scan.add_point(record_values(&point?)).map_err(written)?;
    }
    scan.finalize().map_err(written)?;
    file.finalize().map_err(written)
}

/// The columns in the order of [`FIELDS`].
fn prototype() -> Vec<Record> {
    let double = || RecordDataType::Double { min: None, max: None };
    let single = || RecordDataType::Single { min: None, max: None };
    let types = [
        double(),
        double(),
        double(),
        RecordDataType::Integer { min: i64::from(i8::MIN), max: i64::from(i8::MAX) },
        RecordDataType::Integer { min: 0, max: i64::from(u32::MAX) },
        single(),
        single(),
        single(),
        single(),
    ];
    (0..FIELDS.len()).zip(types).map(|(idx, data_type)| Record { name: record_name(idx), data_type }).collect()
}

fn record_name(field: usize) -> RecordName {
    match FIELDS[field] {
        "x" => RecordName::CartesianX,
        "y" => RecordName::CartesianY,
        "z" => RecordName::CartesianZ,
        "intensity" => RecordName::Intensity,
        name => RecordName::Unknown { namespace: NAMESPACE.to_owned(), name: name.to_owned() },
    }
}

fn record_values(p: &CloudPoint) -> Vec<RecordValue> {
    vec![
        RecordValue::Double(p.x_mm / MM_PER_METRE),
        RecordValue::Double(p.y_mm / MM_PER_METRE),
        RecordValue::Double(p.z_mm / MM_PER_METRE),
        RecordValue::Integer(p.order.into()),
        RecordValue::Integer(p.frame.into()),
        RecordValue::Single(p.u_px),
        RecordValue::Single(p.v_px),
        RecordValue::Single(p.intensity),
        RecordValue::Single(p.sigma_mm),
    ]
}

/// An identifier that depends on the content alone, so that equal clouds give equal files (FNV-1a).
fn content_guid(
    comments: &[String],
    points: impl Iterator<Item = Result<CloudPoint, ContentError>>,
) -> Result<String, ContentError> {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    let mut update = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for point in points {
        update(&super::ply::vertex_bytes(&point?));
    }
    comments.iter().for_each(|comment| update(comment.as_bytes()));
    Ok(format!("sheaf-{hash:016x}"))
}

pub(super) fn read(input: impl BufRead + Seek) -> Result<Cloud, ContentError> {
    let mut file = E57Reader::new(input).map_err(unreadable)?;
    let scans = file.pointclouds();
    let Some(scan) = scans.first() else {
        return Err(ContentError::malformed(
            "file",
            "the file contains no scan",
            "export the file with its points",
        ));
    };
    let slots: Vec<Option<usize>> = scan
        .prototype
        .iter()
        .map(|record| (0..FIELDS.len()).find(|&idx| record_name(idx) == record.name))
        .collect();
    if let Some(axis) = (0..3).find(|axis| !slots.contains(&Some(*axis))) {
        return Err(ContentError::malformed(
            "scan 0",
            format!("points have no cartesian {}", FIELDS[axis]),
            "export the file with cartesian coordinates",
        ));
    }
    let mut cloud = Cloud { points: Vec::with_capacity(trusted_capacity(scan.records)), comments: Vec::new() };
    if let Some(text) = scan.description.as_deref().filter(|text| !text.is_empty()) {
        cloud.comments = text.split('\n').map(str::to_owned).collect();
    }
    for (idx, row) in file.pointcloud_raw(scan).map_err(unreadable)?.enumerate() {
        let row = row.map_err(unreadable)?;
        push(&mut cloud.points, point(&scan.prototype, &slots, &row, idx)?, scan.records);
    }
    Ok(cloud)
}

fn point(
    prototype: &[Record],
    slots: &[Option<usize>],
    row: &[RecordValue],
    idx: usize,
) -> Result<CloudPoint, ContentError> {
    let mut values = [0.0; 9];
    for ((record, slot), value) in prototype.iter().zip(slots).zip(row) {
        let Some(field) = *slot else { continue };
        let number = match (value, &record.data_type) {
            (RecordValue::Single(value), _) => f64::from(*value),
            (RecordValue::Double(value), _) => *value,
            (RecordValue::ScaledInteger(raw), RecordDataType::ScaledInteger { scale, offset, .. }) => {
                *raw as f64 * scale + offset
            }
            (RecordValue::Integer(value) | RecordValue::ScaledInteger(value), _) => *value as f64,
        };
        values[field] = if field < 3 { number * MM_PER_METRE } else { number };
    }
    point_from_fields(&values, || format!("point {idx}"))
}

fn unreadable(error: e57::Error) -> ContentError {
    ContentError::malformed("E57 structure", error.to_string(), "copy or export the file again; it is damaged")
}

fn written(error: e57::Error) -> ContentError {
    ContentError::Io(std::io::Error::other(error))
}
