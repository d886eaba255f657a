//! Reader for any PLY file: ASCII or binary of either byte order, elements read in sequence.

use std::io::BufRead;

use super::{ContentError, header_line};

/// Longest list (corners of one polygon) accepted.
const MAX_LIST: f64 = 4096.0;

/// Most header lines accepted.
const MAX_HEADER_LINES: u64 = 100_000;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value of as many bytes as the number has, in the byte order of a binary file.
    fn value_of(self, bytes: &[u8], encoding: Encoding) -> f64 {
        let mut le = [0; 8];
        let used = &mut le[..bytes.len()];
        used.copy_from_slice(bytes);
        if encoding == Encoding::Big {
            used.reverse();
        }
        self.value(le)
    }

    /// The value of the first bytes of `le`, little endian.
    fn value(self, le: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = le;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(le),
        }
    }
}

/// A property of an element: a number, or a list of numbers with a count in front.
#[derive(Debug, Clone)]
pub(super) struct Property {
    pub(super) name: String,
    value: Number,
    count: Option<Number>,
}

/// An element of the file: a table with one row per vertex, face, …
#[derive(Debug, Clone)]
pub(super) struct Element {
    name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// A PLY file whose header has been read.
pub(super) struct PlyReader<R> {
    input: R,
    encoding: Encoding,
    line_number: u64,
    /// Words of the current ASCII line, last first.
    words: Vec<String>,
    /// Bytes of the current binary row.
    row: Vec<u8>,
    remaining: std::collections::VecDeque<Element>,
    pub(super) comments: Vec<String>,
}

impl<R: BufRead> PlyReader<R> {
    pub(super) fn open(input: R) -> Result<Self, ContentError> {
        let mut reader = Self {
            input,
            encoding: Encoding::Ascii,
            line_number: 0,
            words: Vec::new(),
            row: Vec::new(),
            remaining: std::collections::VecDeque::new(),
            comments: Vec::new(),
        };
        let first = header_line(&mut reader.input, &mut reader.line_number)?;
        if first.as_deref().map(str::trim) != Some("ply") {
            return Err(reader.header_problem("the file does not begin with `ply`"));
        }
        while reader.header_entry()? {}
        Ok(reader)
    }

    fn header_problem(&self, problem: impl Into<String>) -> ContentError {
        ContentError::malformed(
            format!("line {}", self.line_number),
            problem,
            "check that the file is a PLY file of version 1.0",
        )
    }

    /// Parses one header line; `false` at the end of the header.
    fn header_entry(&mut self) -> Result<bool, ContentError> {
        let Some(line) = header_line(&mut self.input, &mut self.line_number)? else {
            return Err(self.header_problem("the header has no end"));
        };
        if self.line_number > MAX_HEADER_LINES {
            return Err(self.header_problem("the header has no end"));
        }
        if let Some(comment) = line.strip_prefix("comment") {
            self.comments.push(comment.strip_prefix(' ').unwrap_or(comment).to_owned());
            return Ok(true);
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["end_header"] => return Ok(false),
            ["format", encoding, "1.0"] => {
                self.encoding = match *encoding {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => return Err(self.header_problem(format!("unknown encoding `{other}`"))),
                }
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return Err(self.header_problem(format!("`{count}` is not a count")));
                };
                self.remaining.push_back(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", "list", count, value, name] => self.property(name, value, Some(count))?,
            ["property", value, name] => self.property(name, value, None)?,
            [] | ["obj_info", ..] => {}
            _ => return Err(self.header_problem(format!("`{line}` is not a header entry"))),
        }
        Ok(true)
    }

    fn property(&mut self, name: &str, value: &str, count: Option<&str>) -> Result<(), ContentError> {
        let value_kind = Number::from_name(value);
        let count_kind = count.map(|count| Number::from_name(count).ok_or(()));
        match (value_kind, count_kind.transpose(), self.remaining.back_mut()) {
            (Some(value), Ok(count), Some(element)) => {
                element.properties.push(Property { name: name.to_owned(), value, count });
                Ok(())
            }
            (_, _, None) => Err(self.header_problem("a property precedes any element")),
            _ => Err(self.header_problem(format!("property `{name}` has an unknown type"))),
        }
    }

    /// Skips elements until the one called `name`; its rows come next.
    pub(super) fn skip_to(&mut self, name: &str) -> Result<Element, ContentError> {
        let mut row = Vec::new();
        while let Some(element) = self.remaining.pop_front() {
            if element.name == name {
                return Ok(element);
            }
            if element.properties.is_empty() {
                continue;
            }
            for idx in 0..element.count {
                self.scalars(&element, idx, &mut row)?;
            }
        }
        Err(ContentError::malformed(
            "header",
            format!("there is no element `{name}`"),
            "export the file with points (clouds) or faces (meshes)",
        ))
    }

    /// Reads one row; lists are skipped and read as 0.
    pub(super) fn scalars(&mut self, element: &Element, idx: u64, row: &mut Vec<f64>) -> Result<(), ContentError> {
        row.clear();
        if self.encoding != Encoding::Ascii && element.properties.iter().all(|property| property.count.is_none()) {
            return self.binary_row(element, idx, row);
        }
        self.read_row(element, idx, |_, values| row.push(if let [one] = values { *one } else { 0.0 }))
    }

    /// Reads one row and keeps the list whose name begins with `prefix`.
    pub(super) fn list(
        &mut self,
        element: &Element,
        idx: u64,
        prefix: &str,
        list: &mut Vec<f64>,
    ) -> Result<(), ContentError> {
        list.clear();
        self.read_row(element, idx, |property, values| {
            if property.count.is_some() && property.name.starts_with(prefix) {
                list.extend_from_slice(values);
            }
        })
    }

    /// Reads one row without lists at once: clouds have millions.
    fn binary_row(&mut self, element: &Element, idx: u64, row: &mut Vec<f64>) -> Result<(), ContentError> {
        let place = || place_of(element, idx);
        let n_bytes = element.properties.iter().map(|property| property.value.bytes()).sum();
        self.row.resize(n_bytes, 0);
        self.input.read_exact(&mut self.row).map_err(|cause| ContentError::truncated(cause, place))?;
        let mut rest = &self.row[..];
        for property in &element.properties {
            let (number, after) = rest.split_at(property.value.bytes());
            row.push(property.value.value_of(number, self.encoding));
            rest = after;
        }
        Ok(())
    }

    fn read_row(
        &mut self,
        element: &Element,
        idx: u64,
        mut take: impl FnMut(&Property, &[f64]),
    ) -> Result<(), ContentError> {
        let place = || place_of(element, idx);
        let mut values = Vec::new();
        for property in &element.properties {
            values.clear();
            let count = match property.count {
                None => 1.0,
                Some(kind) => self.number(kind, &place)?,
            };
            if !(0.0..=MAX_LIST).contains(&count) {
                return Err(ContentError::malformed(
                    place(),
                    format!("a list of {count} entries"),
                    "export the file again",
                ));
            }
            for _ in 0..count as usize {
                values.push(self.number(property.value, &place)?);
            }
            take(property, &values);
        }
        Ok(())
    }

    fn number(&mut self, kind: Number, place: &impl Fn() -> String) -> Result<f64, ContentError> {
        if self.encoding == Encoding::Ascii {
            return self.ascii_number(place);
        }
        let mut bytes = [0; 8];
        let used = &mut bytes[..kind.bytes()];
        self.input.read_exact(used).map_err(|cause| ContentError::truncated(cause, place))?;
        Ok(kind.value_of(used, self.encoding))
    }

    fn ascii_number(&mut self, place: &impl Fn() -> String) -> Result<f64, ContentError> {
        while self.words.is_empty() {
            let Some(line) = header_line(&mut self.input, &mut self.line_number)? else {
                return Err(ContentError::truncated(std::io::ErrorKind::UnexpectedEof.into(), place));
            };
            self.words = line.split_whitespace().rev().map(str::to_owned).collect();
        }
        let word = self.words.pop().unwrap_or_default();
        word.parse().map_err(|_| {
            ContentError::malformed(
                format!("line {} ({})", self.line_number, place()),
                format!("`{word}` is not a number"),
                "export the file again with a decimal point",
            )
        })
    }
}

fn place_of(element: &Element, idx: u64) -> String {
    format!("{} {idx} of {}", element.name, element.count)
}
