//! Clouds as comma-separated text: `#` comments, one line of column names, one line per point.

use std::io::{BufRead, Write};

use super::{ContentError, FIELDS, header_line, one_line, point_from_fields};
use crate::points::cloud::{Cloud, CloudPoint};

/// Column names, in the order of [`FIELDS`] and with their units.
const COLUMNS: [&str; 9] = ["x_mm", "y_mm", "z_mm", "order", "frame", "u_px", "v_px", "intensity", "sigma_mm"];

pub(super) fn write_header(out: &mut impl Write, comments: &[String]) -> Result<(), ContentError> {
    for comment in comments {
        writeln!(out, "# {}", one_line(comment))?;
    }
    Ok(writeln!(out, "{}", COLUMNS.join(","))?)
}

pub(super) fn write_points(out: &mut impl Write, points: &[CloudPoint]) -> Result<(), ContentError> {
    for p in points {
        // Rust's `Display` prints the shortest decimal that reads back as the same number.
        writeln!(
            out,
            "{},{},{},{},{},{},{},{},{}",
            p.x_mm, p.y_mm, p.z_mm, p.order, p.frame, p.u_px, p.v_px, p.intensity, p.sigma_mm
        )?;
    }
    Ok(())
}

pub(super) fn read(mut input: impl BufRead) -> Result<Cloud, ContentError> {
    let mut cloud = Cloud::default();
    let mut slots: Option<Vec<Option<usize>>> = None;
    let mut line_number = 0;
    while let Some(line) = header_line(&mut input, &mut line_number)? {
        if let Some(comment) = line.strip_prefix('#') {
            cloud.comments.push(comment.strip_prefix(' ').unwrap_or(comment).to_owned());
            continue;
        }
        if line.trim().is_empty() {
            continue;
        }
        match &slots {
            None => slots = Some(slots_of(&line, line_number)?),
            Some(slots) => {
                let values = values_of(&line, line_number, slots)?;
                cloud.points.push(point_from_fields(&values, || format!("line {line_number}"))?);
            }
        }
    }
    match slots {
        Some(_) => Ok(cloud),
        None => Err(ContentError::malformed(
            format!("line {line_number}"),
            "the line of column names is missing",
            "begin the table with at least x_mm,y_mm,z_mm",
        )),
    }
}

/// For every column, its index in [`FIELDS`], with or without its unit.
fn slots_of(line: &str, line_number: u64) -> Result<Vec<Option<usize>>, ContentError> {
    let slots: Vec<Option<usize>> = line
        .split(',')
        .map(str::trim)
        .map(|name| (0..FIELDS.len()).find(|&idx| name == COLUMNS[idx] || name == FIELDS[idx]))
        .collect();
    match (0..3).find(|axis| !slots.contains(&Some(*axis))) {
        None => Ok(slots),
        Some(axis) => Err(ContentError::malformed(
            format!("line {line_number}"),
            format!("there is no column `{}`", COLUMNS[axis]),
            "name the columns x_mm,y_mm,z_mm and separate them by commas",
        )),
    }
}

fn values_of(line: &str, line_number: u64, slots: &[Option<usize>]) -> Result<[f64; 9], ContentError> {
    let mut values = [0.0; 9];
    let mut found = 0;
    for (cell, slot) in line.split(',').zip(slots) {
        found += 1;
        let Some(field) = slot else { continue };
        values[*field] = cell.trim().parse().map_err(|_| {
            ContentError::malformed(
                format!("line {line_number}"),
                format!("`{cell}` in column `{}` is not a number", COLUMNS[*field]),
                "write numbers with a decimal point",
            )
        })?;
    }
    if found < slots.len() {
        return Err(ContentError::malformed(
            format!("line {line_number}"),
            format!("{found} columns where the table has {}", slots.len()),
            "complete or remove the line",
        ));
    }
    Ok(values)
}
