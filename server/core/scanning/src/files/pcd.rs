//! Clouds as PCD 0.7 (Point Cloud Library), binary; ASCII is read too.

use std::io::{BufRead, Write};

use super::{ContentError, FIELDS, header_line, one_line, point_from_fields, push, trusted_capacity};
use crate::points::cloud::Cloud;

/// Conventional first line of a PCD file; the only comment that does not belong to the cloud.
const BANNER: &str = ".PCD v0.7 - Point Cloud Data file format";

const REMEDY: &str = "export the file as PCD 0.7, binary or ascii";

/// The vertices follow as in PLY: the layout is the same.
pub(super) fn write_header(
    out: &mut impl Write,
    comments: &[String],
    n_points: usize,
) -> Result<(), ContentError> {
    writeln!(out, "# {BANNER}")?;
    for comment in comments {
        writeln!(out, "# {}", one_line(comment))?;
    }
    writeln!(out, "VERSION 0.7\nFIELDS {}", FIELDS.join(" "))?;
    writeln!(out, "SIZE 8 8 8 1 4 4 4 4 4\nTYPE F F F I U F F F F\nCOUNT 1 1 1 1 1 1 1 1 1")?;
    writeln!(out, "WIDTH {n_points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n_points}\nDATA binary")?;
    Ok(())
}

/// A column of the table: its index in [`FIELDS`], its type letter and size, and its count.
struct Column {
    field: Option<usize>,
    kind: char,
    size_bytes: usize,
    count: usize,
}

#[derive(Default)]
struct Header {
    comments: Vec<String>,
    names: Vec<String>,
    sizes: Vec<usize>,
    kinds: Vec<char>,
    counts: Vec<usize>,
    points: u64,
    encoding: String,
}

pub(super) fn read(mut input: impl BufRead) -> Result<Cloud, ContentError> {
    let mut line_number = 0;
    let header = read_header(&mut input, &mut line_number)?;
    let columns = columns_of(&header)?;
    let mut cloud =
        Cloud { points: Vec::with_capacity(trusted_capacity(header.points)), comments: header.comments };
    let mut row = vec![0; columns.iter().map(|c| c.size_bytes * c.count).sum()];
    for idx in 0..header.points {
        let place = || format!("point {idx} of {}", header.points);
        let values = if header.encoding == "ascii" {
            ascii_row(&mut input, &mut line_number, &columns, &place)?
        } else {
            input.read_exact(&mut row).map_err(|cause| ContentError::truncated(cause, place))?;
            binary_row(&row, &columns)
        };
        push(&mut cloud.points, point_from_fields(&values, place)?, header.points);
    }
    Ok(cloud)
}

fn read_header(input: &mut impl BufRead, line_number: &mut u64) -> Result<Header, ContentError> {
    let mut header = Header::default();
    while let Some(line) = header_line(input, line_number)? {
        if let Some(comment) = line.strip_prefix('#') {
            let comment = comment.strip_prefix(' ').unwrap_or(comment);
            if comment != BANNER {
                header.comments.push(comment.to_owned());
            }
            continue;
        }
        let bad =
            || ContentError::malformed(format!("line {line_number}"), format!("cannot read `{line}`"), REMEDY);
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        let words: Vec<&str> = words.collect();
        match key {
            "FIELDS" => header.names = words.iter().map(|w| (*w).to_owned()).collect(),
            "SIZE" => header.sizes = parsed(&words).ok_or_else(bad)?,
            "TYPE" => header.kinds = parsed(&words).ok_or_else(bad)?,
            "COUNT" => header.counts = parsed(&words).ok_or_else(bad)?,
            "POINTS" => header.points = *parsed(&words).ok_or_else(bad)?.first().ok_or_else(bad)?,
            "VERSION" | "WIDTH" | "HEIGHT" | "VIEWPOINT" => {}
            "DATA" => {
                header.encoding = words.join(" ");
                return Ok(header);
            }
            _ => return Err(bad()),
        }
    }
    Err(ContentError::malformed(format!("line {line_number}"), "there is no DATA line", REMEDY))
}

fn parsed<T: std::str::FromStr>(words: &[&str]) -> Option<Vec<T>> {
    words.iter().map(|word| word.parse().ok()).collect()
}

/// Largest record accepted, bytes.
const MAX_ROW_BYTES: usize = 1 << 16;

fn columns_of(header: &Header) -> Result<Vec<Column>, ContentError> {
    let n = header.names.len();
    let counts = if header.counts.is_empty() { vec![1; n] } else { header.counts.clone() };
    let problem = |text: String| ContentError::malformed("header", text, REMEDY);
    if header.sizes.len() != n || header.kinds.len() != n || counts.len() != n {
        return Err(problem("FIELDS, SIZE, TYPE and COUNT differ in length".into()));
    }
    if !matches!(header.encoding.as_str(), "ascii" | "binary") {
        return Err(problem(format!("unsupported encoding `{}`", header.encoding)));
    }
    let mut columns = Vec::new();
    let mut row_bytes = 0usize;
    for (idx, count) in counts.into_iter().enumerate() {
        let (kind, size_bytes) = (header.kinds[idx], header.sizes[idx]);
        if !matches!((kind, size_bytes), ('F', 4 | 8) | ('I' | 'U', 1 | 2 | 4 | 8)) {
            return Err(problem(format!("field `{}` has type {kind} of {size_bytes} bytes", header.names[idx])));
        }
        row_bytes = row_bytes.saturating_add(size_bytes.saturating_mul(count));
        let field = FIELDS.iter().position(|field| *field == header.names[idx]).filter(|_| count == 1);
        columns.push(Column { field, kind, size_bytes, count });
    }
    if row_bytes > MAX_ROW_BYTES {
        return Err(problem(format!("a point takes {row_bytes} bytes")));
    }
    match (0..3).find(|axis| !columns.iter().any(|c| c.field == Some(*axis))) {
        Some(axis) => Err(problem(format!("there is no field `{}`", FIELDS[axis]))),
        None => Ok(columns),
    }
}

fn binary_row(row: &[u8], columns: &[Column]) -> [f64; 9] {
    let mut values = [0.0; 9];
    let mut rest = row;
    for column in columns {
        let (bytes, tail) = rest.split_at(column.size_bytes * column.count);
        if let Some(field) = column.field {
            values[field] = number(column.kind, bytes);
        }
        rest = tail;
    }
    values
}

fn number(kind: char, le: &[u8]) -> f64 {
    let mut wide = [0; 8];
    wide[..le.len()].copy_from_slice(le);
    let unsigned = u64::from_le_bytes(wide);
    match (kind, le.len()) {
        ('F', 4) => f64::from(f32::from_bits(unsigned as u32)),
        ('F', _) => f64::from_bits(unsigned),
        ('U', _) => unsigned as f64,
        (_, size) => {
            // Sign extension.
            let unused = 64 - 8 * size as u32;
            ((unsigned << unused) as i64 >> unused) as f64
        }
    }
}

fn ascii_row(
    input: &mut impl BufRead,
    line_number: &mut u64,
    columns: &[Column],
    place: &impl Fn() -> String,
) -> Result<[f64; 9], ContentError> {
    let Some(line) = header_line(input, line_number)? else {
        return Err(ContentError::truncated(std::io::ErrorKind::UnexpectedEof.into(), place));
    };
    let mut values = [0.0; 9];
    let mut words = line.split_whitespace();
    for column in columns {
        for _ in 0..column.count {
            let word = words.next().unwrap_or("");
            let Some(field) = column.field else { continue };
            values[field] = word.parse().map_err(|_| {
                ContentError::malformed(
                    format!("line {line_number}"),
                    format!("`{word}` is not a number"),
                    "export the file again",
                )
            })?;
        }
    }
    Ok(values)
}
