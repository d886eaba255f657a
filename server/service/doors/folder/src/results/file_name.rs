//! Names of files by a template, safe on Windows shares.

use app::doors::{BadSetting, InspectionMessage};
use app::inspections::local;

use crate::params::{LONGEST_PART_BYTES, LONGEST_STEM_BYTES};

const PLACEHOLDERS: [&str; 8] =
    ["{serial}", "{seq}", "{recipe}", "{version}", "{verdict}", "{order}", "{date}", "{time}"];

/// Not allowed on Windows, besides control characters.
const RESERVED: [char; 9] = ['<', '>', ':', '"', '/', '\\', '|', '?', '*'];

/// Devices of Windows, with and without extension; COM and LPT have a digit.
const DEVICES: [&str; 6] = ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"];

/// A template of file names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileName(Vec<Part>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Field {
    Serial,
    Seq,
    Recipe,
    Version,
    Verdict,
    Order,
    Date,
    Time,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Text(String),
    Field(Field),
}

impl FileName {
    /// Parses a template such as `{serial}_{seq}`.
    ///
    /// # Errors
    /// It is empty, or has an unknown placeholder or a character that Windows reserves.
    pub fn parse(template: &str) -> Result<Self, BadSetting> {
        let bad = |why: String| BadSetting { setting: "file_name", why };
        let unknown =
            |shown: &str| bad(format!("\"{shown}\" is no placeholder; there are {}", PLACEHOLDERS.join(", ")));
        let (mut parts, mut rest) = (Vec::new(), template);
        while let Some(start) = rest.find(['{', '}']) {
            let (text, from_brace) = rest.split_at(start);
            let end = from_brace.find('}').filter(|end| *end > 0).ok_or_else(|| unknown(from_brace))?;
            let shown = &from_brace[..=end];
            parts.push(Part::Text(text.to_owned()));
            parts.push(Part::Field(Field::parse(shown).ok_or_else(|| unknown(shown))?));
            rest = &from_brace[end + 1..];
        }
        parts.push(Part::Text(rest.to_owned()));
        parts.retain(|part| *part != Part::Text(String::new()));
        let is_unsafe = |letter: char| RESERVED.contains(&letter) || letter.is_control();
        if parts.iter().any(|part| matches!(part, Part::Text(text) if text.contains(is_unsafe))) {
            let reserved: String = RESERVED.iter().flat_map(|letter| [*letter, ' ']).collect();
            return Err(bad(format!("file names on Windows cannot have {}", reserved.trim_end())));
        }
        if parts.is_empty() {
            return Err(bad("give a name, such as {serial}_{seq}".to_owned()));
        }
        if template.len() > LONGEST_STEM_BYTES {
            return Err(bad(format!("give at most {LONGEST_STEM_BYTES} bytes")));
        }
        Ok(Self(parts))
    }

    /// The name for an inspection, without extension; always the same for the same inspection.
    pub fn stem(&self, inspection: &InspectionMessage) -> String {
        let part = |part: &Part| match part {
            Part::Text(text) => text.clone(),
            Part::Field(field) => without_reserved(cut(&field.of(inspection), LONGEST_PART_BYTES)),
        };
        let stem: String = self.0.iter().map(part).collect();
        safe(&stem)
    }
}

impl Field {
    fn parse(shown: &str) -> Option<Self> {
        Some(match shown {
            "{serial}" => Self::Serial,
            "{seq}" => Self::Seq,
            "{recipe}" => Self::Recipe,
            "{version}" => Self::Version,
            "{verdict}" => Self::Verdict,
            "{order}" => Self::Order,
            "{date}" => Self::Date,
            "{time}" => Self::Time,
            _ => return None,
        })
    }

    fn of(self, inspection: &InspectionMessage) -> String {
        let at = || local(inspection.inspected_at_ms);
        match self {
            Self::Serial => inspection.serial.clone(),
            Self::Seq => inspection.seq.to_string(),
            Self::Recipe => inspection.recipe.id.clone(),
            Self::Version => inspection.recipe.version.to_string(),
            Self::Verdict => inspection.verdict.clone(),
            Self::Order => inspection.order.clone().unwrap_or_default(),
            Self::Date => at().map(|at| at.date().to_string()).unwrap_or_default(),
            Self::Time => at()
                .map(|at| format!("{:02}-{:02}-{:02}", at.hour(), at.minute(), at.second()))
                .unwrap_or_default(),
        }
    }
}

/// The longest beginning of at most `bytes` that ends between two characters.
fn cut(text: &str, bytes: usize) -> &str {
    &text[..text.floor_char_boundary(bytes)]
}

fn without_reserved(text: &str) -> String {
    let safe = |letter: char| if RESERVED.contains(&letter) || letter.is_control() { '_' } else { letter };
    text.chars().map(safe).collect()
}

/// Neither empty, hidden, too long, ending with a dot or a space, nor the name of a device. Names that become equal by
/// this get suffixes when they are written.
fn safe(stem: &str) -> String {
    let trimmed = cut(stem, LONGEST_STEM_BYTES).trim_start().trim_end_matches([' ', '.']);
    let device = trimmed.split('.').next().unwrap_or_default().trim_end().to_uppercase();
    let is_port = ["COM", "LPT"].iter().any(|port| {
        device.strip_prefix(port).is_some_and(|digit| {
            digit.chars().count() == 1
                && digit.contains(|digit: char| digit.is_ascii_digit() || "¹²³".contains(digit))
        })
    });
    let is_device = is_port || DEVICES.contains(&device.as_str());
    match trimmed.is_empty() || trimmed.starts_with('.') || is_device {
        true => format!("_{trimmed}"),
        false => trimmed.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::inspection;

    fn stem(template: &str, serial: &str) -> String {
        let inspection = InspectionMessage { serial: serial.to_owned(), ..inspection() };
        FileName::parse(template).unwrap().stem(&inspection)
    }

    #[test]
    fn every_placeholder_is_filled_in() {
        let filled = stem("{serial}-{seq}-{recipe}-{version}-{verdict}-{order} x", "S1");
        assert_eq!(filled, "S1-812-bracket-7-ok-A-7 x");
        let at = local(inspection().inspected_at_ms).unwrap();
        let (date, time) = (at.date().to_string(), format!("{:02}-03-07", at.hour()));
        assert_eq!(stem("{date}T{time}", "S1"), format!("{date}T{time}"));
    }

    #[test]
    fn names_are_safe_on_windows_shares() {
        let cases = [
            ("../../etc/passwd", "_.._.._etc_passwd"),
            ("a<b>c:d\"e/f\\g|h?i*j", "a_b_c_d_e_f_g_h_i_j"),
            ("two\r\nlines\u{0}", "two__lines_"),
            ("S1. . ", "S1"),
            ("...", "_"),
            ("", "_"),
            (".hidden", "_.hidden"),
            ("con", "_con"),
            ("NUL.txt", "_NUL.txt"),
            ("com1", "_com1"),
            ("LPT²", "_LPT²"),
            ("COM10", "COM10"),
            ("console", "console"),
            ("Prüfling 零", "Prüfling 零"),
        ];
        for (serial, expected) in cases {
            assert_eq!(stem("{serial}", serial), expected, "{serial:?}");
        }
    }

    #[test]
    fn a_long_serial_number_leaves_room_for_the_number_that_makes_the_name_unique() {
        let long = stem("{serial}_{seq}", &"零".repeat(100));
        assert_eq!(long, format!("{}_812", "零".repeat(20)));
        assert!(stem(&"{serial}".repeat(20), &"a".repeat(100)).len() <= LONGEST_STEM_BYTES);
    }

    #[test]
    fn what_is_no_template_is_refused() {
        for template in
            ["", "{part}", "{serial", "serial}", "{}", "{serial}/{seq}", "a:b", "{Serial}", "{serial}\n"]
        {
            let bad = FileName::parse(template).unwrap_err();
            assert_eq!(bad.setting, "file_name", "{template:?}");
        }
    }
}
