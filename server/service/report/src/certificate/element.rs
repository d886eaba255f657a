//! A tree of XML elements, written by `quick-xml`.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// The only language of the texts.
pub const LANGUAGE: &str = "en";

/// An element with its attributes, and either text or children.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    content: Content,
}

#[derive(Debug, Clone, PartialEq)]
enum Content {
    Text(String),
    Children(Vec<Element>),
}

/// An element with children.
pub fn parent(name: &'static str, children: impl IntoIterator<Item = Element>) -> Element {
    Element { name, attributes: Vec::new(), content: Content::Children(children.into_iter().collect()) }
}

/// An element with text.
pub fn leaf(name: &'static str, text: impl AsRef<str>) -> Element {
    Element { name, attributes: Vec::new(), content: Content::Text(one_line(text.as_ref())) }
}

/// An element with a text in [`LANGUAGE`].
pub fn words(name: &'static str, text: impl AsRef<str>) -> Element {
    parent(name, [leaf("dcc:content", text).with("lang", LANGUAGE)])
}

/// Text on one line, without what XML cannot contain; the schema refuses spaces at either end.
fn one_line(text: &str) -> String {
    let is_allowed = |letter: &char| !matches!(letter, '\u{fffe}' | '\u{ffff}');
    let spaced = text.chars().filter(is_allowed).map(|letter| if letter.is_control() { ' ' } else { letter });
    spaced.collect::<String>().split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Element {
    /// Adds an attribute.
    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    /// The document with this element as its root, indented.
    pub fn to_xml(&self) -> String {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        write(&mut writer, Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)));
        self.write_to(&mut writer);
        let mut xml = writer.into_inner();
        xml.push(b'\n');
        String::from_utf8(xml).expect("names and texts are UTF-8")
    }

    fn write_to(&self, writer: &mut Writer<Vec<u8>>) {
        let attributes = self.attributes.iter().map(|(name, value)| (*name, value.as_str()));
        let start = BytesStart::new(self.name).with_attributes(attributes);
        write(writer, Event::Start(start));
        match &self.content {
            Content::Text(text) => write(writer, Event::Text(BytesText::new(text))),
            Content::Children(children) => children.iter().for_each(|child| child.write_to(writer)),
        }
        write(writer, Event::End(BytesEnd::new(self.name)));
    }
}

fn write(writer: &mut Writer<Vec<u8>>, event: Event<'_>) {
    writer.write_event(event).expect("memory can be written");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_cannot_add_elements_and_is_one_line() {
        let xml =
            parent("dcc:name", [leaf("dcc:content", " A<b/>\r\n & \u{1}co ").with("lang", "\"en\"")]).to_xml();
        let expected = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<dcc:name>\n  \
            <dcc:content lang=\"&quot;en&quot;\">A&lt;b/&gt; &amp; co</dcc:content>\n</dcc:name>\n";
        assert_eq!(xml, expected);
    }
}
