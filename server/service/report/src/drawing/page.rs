//! HTML pages: head, style, tiles, sections, tables.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style sheet, light and dark.
const STYLE: &str = include_str!("style.css");

/// Content security policy of the page: no scripts, no external resources.
pub const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";

/// A page under construction.
pub struct Page {
    title: String,
    lead: String,
    parts: Vec<Markup>,
}

impl Page {
    /// A page with a title and an introductory sentence.
    pub fn new(title: &str, lead: &str) -> Self {
        Self { title: title.to_owned(), lead: lead.to_owned(), parts: Vec::new() }
    }

    /// Adds a row of headline figures.
    pub fn tiles(&mut self, tiles: &[Tile]) {
        self.parts.push(html! {
            div.tiles {
                @for Tile { value, name, remark } in tiles {
                    div.tile { b { (value) } span { (name) } small { (remark) } }
                }
            }
        });
    }

    /// Adds a section.
    pub fn section(&mut self, title: &str, introduction: &str, content: Markup) {
        self.parts.push(html! { section { h2 { (title) } p { (introduction) } (content) } });
    }

    /// The page as HTML.
    pub fn finish(self) -> String {
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    meta name="viewport" content="width=device-width,initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        header { h1 { (self.title) } p { (self.lead) } }
                        @for part in &self.parts { (part) }
                        footer { "sheaf " (env!("CARGO_PKG_VERSION")) }
                    }
                }
            }
        }
        .into_string()
    }
}

/// One headline figure.
pub struct Tile {
    /// The figure with its unit.
    pub value: String,
    /// Its name.
    pub name: String,
    /// Its meaning.
    pub remark: String,
}

impl Tile {
    /// A figure with its name and meaning.
    pub fn new(value: impl Into<String>, name: &str, remark: impl Into<String>) -> Self {
        Self { value: value.into(), name: name.to_owned(), remark: remark.into() }
    }
}

/// A plot or image with a caption.
pub fn figure(drawing: Markup, caption: &str) -> Markup {
    html! { figure { (drawing) figcaption { (caption) } } }
}

/// Figures side by side where the page is wide enough.
pub fn grid(figures: &[Markup]) -> Markup {
    html! { div.grid { @for figure in figures { (figure) } } }
}

/// A gallery of small images.
pub fn gallery(figures: &[Markup]) -> Markup {
    html! { div.grid.gallery { @for figure in figures { (figure) } } }
}

/// A message of the core as a sentence: with a capital letter, without backquotes.
pub fn sentence(clause: &str) -> String {
    let plain = clause.replace('`', "");
    let mut characters = plain.chars();
    match characters.next() {
        Some(first) => first.to_uppercase().chain(characters).collect(),
        None => plain,
    }
}

/// A table; the first column is text, the others are figures. `marked` rows are highlighted.
pub fn table(head: &[&str], rows: &[Vec<String>], marked: impl Fn(usize) -> bool) -> Markup {
    html! {
        div.scroll {
            table {
                thead { tr { @for name in head { th { (name) } } } }
                tbody {
                    @for (idx, row) in rows.iter().enumerate() {
                        tr.marked[marked(idx)] { @for cell in row { td { (cell) } } }
                    }
                }
            }
        }
    }
}

/// A highlighted sentence.
pub fn verdict(sentence: &str) -> Markup {
    html! { p.verdict { (sentence) } }
}

/// A legend: names and colours.
pub fn legend(keys: &[(String, String)]) -> Markup {
    html! {
        p.legend {
            @for (name, colour) in keys { span { i style={ "background:" (colour) } {} (name) } }
        }
    }
}

/// Bytes as a data URI, so that the page is self-contained.
pub fn data_uri(mime: &str, bytes: &[u8]) -> String {
    format!("data:{mime};base64,{}", BASE64_STANDARD.encode(bytes))
}
