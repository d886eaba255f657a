//! The page around the plots: head, style, tiles, sections, tables.

use super::html::{Html, html};

/// The style sheet, light and dark.
const STYLE: &str = include_str!("style.css");

/// What the page may do wherever it is opened: no script, nothing from elsewhere.
pub const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// A page under construction.
pub struct Page {
    title: String,
    lead: String,
    body: Html,
}

impl Page {
    /// A page with its title and one sentence of what it is about.
    pub fn new(title: &str, lead: &str) -> Self {
        Self { title: title.to_owned(), lead: lead.to_owned(), body: Html::default() }
    }

    /// A row of headline figures.
    pub fn tiles(&mut self, tiles: &[Tile]) {
        let mut row = Html::default();
        for Tile { value, name, remark } in tiles {
            row += html!(
                "<div class=tile><b>{value}</b><span>{name}</span><small>{remark}</small></div>",
                value = value,
                name = name,
                remark = remark,
            );
        }
        self.body += html!("<div class=tiles>{row}</div>", row = row);
    }

    /// A part of the page.
    pub fn section(&mut self, title: &str, introduction: &str, content: Html) {
        self.body += html!(
            "<section><h2>{title}</h2><p>{introduction}</p>{content}</section>",
            title = title,
            introduction = introduction,
            content = content,
        );
    }

    /// The page as one HTML text.
    pub fn finish(self) -> String {
        let Self { title, lead, body } = self;
        html!(
            "<!doctype html><html lang=en><meta charset=utf-8><meta http-equiv=Content-Security-Policy \
             content=\"{policy}\"><meta name=viewport content=\"width=device-width,initial-scale=1\">\
             <meta name=color-scheme content=\"light dark\"><title>{title}</title><style>{style}</style><main>\
             <header><h1>{title}</h1><p>{lead}</p></header>{body}<footer>sheaf {version}</footer></main></html>\n",
            policy = Html::of(POLICY),
            title = title,
            style = Html::of(STYLE),
            lead = lead,
            body = body,
            version = env!("CARGO_PKG_VERSION"),
        )
        .into_text()
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

/// A plot or picture with its caption.
pub fn figure(drawing: Html, caption: &str) -> Html {
    html!("<figure>{drawing}<figcaption>{caption}</figcaption></figure>", drawing = drawing, caption = caption)
}

/// Figures side by side where the page is wide enough.
pub fn grid(figures: &[Html]) -> Html {
    html!("<div class=grid>{figures}</div>", figures = Html::joined(figures))
}

/// Many pictures, small.
pub fn gallery(figures: &[Html]) -> Html {
    html!("<div class=\"grid gallery\">{figures}</div>", figures = Html::joined(figures))
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
pub fn table(head: &[&str], rows: &[Vec<String>], marked: impl Fn(usize) -> bool) -> Html {
    let mut names = Html::default();
    for name in head {
        names += html!("<th>{name}</th>", name = name);
    }
    let mut body = Html::default();
    for (idx, row) in rows.iter().enumerate() {
        body += Html::of(if marked(idx) { "<tr class=marked>" } else { "<tr>" });
        for cell in row {
            body += html!("<td>{cell}</td>", cell = cell);
        }
        body += Html::of("</tr>");
    }
    html!(
        "<div class=scroll><table><thead><tr>{names}</tr></thead><tbody>{body}</tbody></table></div>",
        names = names,
        body = body,
    )
}

/// A sentence set apart.
pub fn verdict(sentence: &str) -> Html {
    html!("<p class=verdict>{sentence}</p>", sentence = sentence)
}

/// Colour keys: name and colour.
pub fn legend(keys: &[(String, String)]) -> Html {
    let mut spans = Html::default();
    for (name, colour) in keys {
        spans += html!("<span><i style=\"background:{colour}\"></i>{name}</span>", colour = colour, name = name);
    }
    html!("<p class=legend>{spans}</p>", spans = spans)
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
}
