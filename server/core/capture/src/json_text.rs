//! Locates a position in a JSON text: line, and path of keys (`stage_views[1].position_mm`).
//!
//! Works on text that is valid JSON only up to that position, because it is used for error messages.

/// A bare `NaN`, `Infinity` or `-Infinity` outside of strings.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct NotFinite {
    /// Line, from 1.
    pub line: usize,
    /// Path of keys.
    pub entry: String,
    /// As written.
    pub found: String,
}

enum Level {
    Object { key: Option<String> },
    Array { idx: usize },
}

/// A tokenizer that tracks the path of keys.
struct Tokenizer<'t> {
    text: &'t str,
    at: usize,
    levels: Vec<Level>,
}

/// The path of keys at a position (line and column from 1, column in bytes, as `serde_json` counts them).
pub(crate) fn entry_at(text: &str, line: usize, column: usize) -> String {
    entry_before(text, line, column.saturating_sub(1)).unwrap_or_else(whole)
}

/// The path of keys of the object whose `}` is at a position; `None` for the whole document.
pub(crate) fn entry_ended_at(text: &str, line: usize, column: usize) -> Option<String> {
    entry_before(text, line, column)
}

/// The path of keys after `n_bytes` bytes of a line; `None` at the top.
fn entry_before(text: &str, line: usize, n_bytes: usize) -> Option<String> {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let end = (start + n_bytes).min(text.len());
    let mut tokenizer = Tokenizer { text, at: 0, levels: Vec::new() };
    while tokenizer.at < end {
        if tokenizer.step().is_none() {
            break;
        }
    }
    tokenizer.entry()
}

/// The name used for errors outside any entry.
fn whole() -> String {
    "the document".to_owned()
}

/// The first bare NaN or Infinity of the text.
pub(crate) fn first_not_finite(text: &str) -> Option<NotFinite> {
    let mut tokenizer = Tokenizer { text, at: 0, levels: Vec::new() };
    loop {
        let start = tokenizer.at;
        let word = tokenizer.step()?;
        if matches!(word.trim_start_matches('-'), "NaN" | "nan" | "Infinity" | "inf") {
            let line = text[..start].matches('\n').count() + 1;
            return Some(NotFinite {
                line,
                entry: tokenizer.entry().unwrap_or_else(whole),
                found: word.to_owned(),
            });
        }
    }
}

impl<'t> Tokenizer<'t> {
    /// Consumes one token and returns it; `None` at the end.
    fn step(&mut self) -> Option<&'t str> {
        let rest = &self.text[self.at..];
        let first = rest.chars().next()?;
        let length = match first {
            '"' => string_length(rest),
            c if is_word(c) => rest.find(|c: char| !is_word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        let token = &rest[..length];
        self.at += length;
        self.update_path(token);
        Some(token)
    }

    fn update_path(&mut self, token: &str) {
        match token {
            "{" => self.levels.push(Level::Object { key: None }),
            "[" => self.levels.push(Level::Array { idx: 0 }),
            "}" | "]" => {
                self.levels.pop();
            }
            "," => match self.levels.last_mut() {
                Some(Level::Object { key }) => *key = None,
                Some(Level::Array { idx }) => *idx += 1,
                None => {}
            },
            _ => {
                if let (Some(name), Some(Level::Object { key: key @ None })) =
                    (token.strip_prefix('"'), self.levels.last_mut())
                {
                    *key = Some(name.trim_end_matches('"').to_owned());
                }
            }
        }
    }

    /// The current path of keys; `None` at the top.
    fn entry(&self) -> Option<String> {
        let mut path = String::new();
        for level in &self.levels {
            match level {
                Level::Object { key: Some(key) } if path.is_empty() => path.push_str(key),
                Level::Object { key: Some(key) } => path.extend([".", key]),
                Level::Object { key: None } => {}
                Level::Array { idx } => path.push_str(&format!("[{idx}]")),
            }
        }
        Some(path).filter(|path| !path.is_empty())
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.')
}

/// Length in bytes of the string at the beginning of `text`, quotes included.
fn string_length(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_found_with_its_line_and_path() {
        let text = "{\n \"note\": \"NaN, is [fine here\",\n \"views\": [{\"at\": 1.0}, {\"at\": -Infinity}]\n}";
        let found = first_not_finite(text).unwrap();
        let expected = NotFinite { line: 3, entry: "views[1].at".to_owned(), found: "-Infinity".to_owned() };
        assert_eq!(found, expected);
    }

    #[test]
    fn an_escaped_quote_does_not_end_a_string() {
        assert_eq!(first_not_finite(r#"{"a": "\" NaN"}"#), None);
    }

    #[test]
    fn a_position_is_named_by_its_keys() {
        let text = "{\"a\": {\"b\": [1, 2,\n {\"c\": x}]}}";
        assert_eq!(entry_at(text, 2, 7), "a.b[2].c");
        assert_eq!(entry_at(text, 1, 1), "the document");
        assert_eq!(entry_ended_at(text, 2, 9).as_deref(), Some("a.b[2]"));
        assert_eq!(entry_ended_at(text, 2, 12), None);
    }
}
