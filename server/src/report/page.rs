//! The page around the plots: head, style, tiles, sections, tables.

use std::fmt::Write as _;

/// The style sheet, light and dark.
const STYLE: &str = include_str!("style.css");

/// A page under construction.
pub struct Page {
    title: String,
    lead: String,
    body: String,
}

impl Page {
    /// A page with its title and one sentence of what it is about.
    pub fn new(title: &str, lead: &str) -> Self {
        Self { title: escape(title), lead: escape(lead), body: String::new() }
    }

    /// A row of headline figures.
    pub fn tiles(&mut self, tiles: &[Tile]) {
        self.body.push_str("<div class=tiles>");
        for tile in tiles {
            let _ = write!(
                self.body,
                "<div class=tile><b>{}</b><span>{}</span><small>{}</small></div>",
                escape(&tile.value),
                escape(&tile.name),
                escape(&tile.remark)
            );
        }
        self.body.push_str("</div>");
    }

    /// A part of the page; `content` is HTML.
    pub fn section(&mut self, title: &str, introduction: &str, content: &str) {
        let _ = write!(
            self.body,
            "<section><h2>{}</h2><p>{}</p>{content}</section>",
            escape(title),
            escape(introduction)
        );
    }

    /// The page as one HTML text.
    pub fn finish(self) -> String {
        let Self { title, lead, body } = self;
        format!(
            "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport \
             content=\"width=device-width,initial-scale=1\"><meta name=color-scheme content=\"light dark\">\
             <title>{title}</title><style>{STYLE}</style><main><header><h1>{title}</h1><p>{lead}</p></header>\
             {body}<footer>sheaf {}</footer></main></html>\n",
            env!("CARGO_PKG_VERSION")
        )
    }
}

/// One headline figure.
pub struct Tile {
    /// The figure with its unit.
    pub value: String,
    /// What it is.
    pub name: String,
    /// What it means.
    pub remark: String,
}

impl Tile {
    /// A figure, what it is, what it means.
    pub fn new(value: impl Into<String>, name: &str, remark: impl Into<String>) -> Self {
        Self { value: value.into(), name: name.to_owned(), remark: remark.into() }
    }
}

/// A plot or picture with its caption; `drawing` is HTML.
pub fn figure(drawing: &str, caption: &str) -> String {
    format!("<figure>{drawing}<figcaption>{}</figcaption></figure>", escape(caption))
}

/// Figures side by side where the page is wide enough.
pub fn grid(figures: &[String]) -> String {
    format!("<div class=grid>{}</div>", figures.concat())
}

/// Many pictures, small.
pub fn gallery(figures: &[String]) -> String {
    format!("<div class=\"grid gallery\">{}</div>", figures.concat())
}

/// A clause of the core as a sentence of the page: capital first, no code quotes.
pub fn sentence(clause: &str) -> String {
    let plain = clause.replace('`', "");
    let mut characters = plain.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => plain,
    }
}

/// A table; the first column is text, the others are figures. `marked` rows stand out.
pub fn table(head: &[&str], rows: &[Vec<String>], marked: impl Fn(usize) -> bool) -> String {
    let mut html = "<div class=scroll><table><thead><tr>".to_owned();
    for name in head {
        let _ = write!(html, "<th>{}</th>", escape(name));
    }
    html.push_str("</tr></thead><tbody>");
    for (idx, row) in rows.iter().enumerate() {
        html.push_str(if marked(idx) { "<tr class=marked>" } else { "<tr>" });
        for cell in row {
            let _ = write!(html, "<td>{}</td>", escape(cell));
        }
        html.push_str("</tr>");
    }
    html.push_str("</tbody></table></div>");
    html
}

/// A sentence set apart.
pub fn verdict(sentence: &str) -> String {
    format!("<p class=verdict>{}</p>", escape(sentence))
}

/// Colour keys: name and colour.
pub fn legend(keys: &[(String, String)]) -> String {
    let mut html = "<p class=legend>".to_owned();
    for (name, colour) in keys {
        let _ = write!(html, "<span><i style=\"background:{colour}\"></i>{}</span>", escape(name));
    }
    html.push_str("</p>");
    html
}

/// Text made safe inside HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Bytes as a data URI, so that the page needs no other file.
pub fn data_uri(mime: &str, bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = format!("data:{mime};base64,");
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for digit in 0..4 {
            if digit <= chunk.len() {
                text.push(char::from(DIGITS[(word >> (18 - 6 * digit) & 63) as usize]));
            } else {
                text.push('=');
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_test_vectors_of_rfc_4648() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(data_uri("x", bytes.as_bytes()), format!("data:x;base64,{text}"));
        }
    }

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("<a b=\"c&d\">"), "&lt;a b=&quot;c&amp;d&quot;&gt;");
    }
}
