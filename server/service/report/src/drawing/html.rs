//! Markup that text can only get into by being escaped.
//!
//! [`html!`] is the only way to make it: what stands in the literal is markup, what is filled in is text, unless it is
//! [`Html`] itself. Values are named in the call, because a captured one would not be escaped; so captures do not compile.

use std::fmt::{Display, Formatter, Result, Write as _};
use std::ops::{Add, AddAssign};

/// Markup.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Html(String);

impl Html {
    /// What the program itself says, such as a style sheet.
    pub fn of(own: &'static str) -> Self {
        Self(own.to_owned())
    }

    /// All of these, one after the other.
    pub fn joined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        Self(parts.into_iter().map(|part| part.0.as_str()).collect())
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The markup as text, to be written to a file.
    pub fn into_text(self) -> String {
        self.0
    }

    /// For [`html!`] alone.
    pub fn from_filled(filled: std::fmt::Arguments<'_>) -> Self {
        Self(filled.to_string())
    }
}

impl Add for Html {
    type Output = Self;

    fn add(mut self, more: Self) -> Self {
        self += more;
        self
    }
}

impl AddAssign for Html {
    fn add_assign(&mut self, more: Self) {
        self.0.push_str(&more.0);
    }
}

/// What can be filled into markup.
pub trait Piece {
    /// Writes it so that it stays what it is.
    fn put(&self, out: &mut Formatter<'_>) -> Result;
}

impl Piece for Html {
    fn put(&self, out: &mut Formatter<'_>) -> Result {
        out.write_str(&self.0)
    }
}

impl Piece for str {
    fn put(&self, out: &mut Formatter<'_>) -> Result {
        for letter in self.chars() {
            match letter {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                '"' => out.write_str("&quot;")?,
                '\'' => out.write_str("&#39;")?,
                letter => out.write_char(letter)?,
            }
        }
        Ok(())
    }
}

impl Piece for String {
    fn put(&self, out: &mut Formatter<'_>) -> Result {
        self.as_str().put(out)
    }
}

impl<T: Piece + ?Sized> Piece for &T {
    fn put(&self, out: &mut Formatter<'_>) -> Result {
        (**self).put(out)
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Piece for $number {
            fn put(&self, out: &mut Formatter<'_>) -> Result {
                Display::fmt(self, out)
            }
        }
    )*};
}

numbers!(f64, u32, usize);

/// A piece as the format macros take it.
pub struct Filled<'a, T: ?Sized>(pub &'a T);

impl<T: Piece + ?Sized> Display for Filled<'_, T> {
    fn fmt(&self, out: &mut Formatter<'_>) -> Result {
        self.0.put(out)
    }
}

/// Markup from a literal, with its named values filled in: `html!("<b>{name}</b>", name = text)`.
#[macro_export]
macro_rules! html {
    // A literal that comes out of `concat!` captures nothing from around it.
    ($literal:literal $(, $name:ident = $value:expr)* $(,)?) => {
        $crate::html::Html::from_filled(format_args!(
            concat!($literal) $(, $name = $crate::html::Filled(&$value))*
        ))
    };
}
pub use html;

#[cfg(test)]
mod tests {
    #[test]
    fn text_cannot_become_markup_and_markup_stays_what_it_is() {
        let name = "<a b=\"c&d\" e='f'>";
        let inner = html!("<i title=\"{name}\">{share:+.2}</i>", name = name, share = 0.5);
        let text = "<i title=\"&lt;a b=&quot;c&amp;d&quot; e=&#39;f&#39;&gt;\">+0.50</i>";
        assert_eq!(html!("<p>{inner}", inner = inner).into_text(), format!("<p>{text}"));
    }
}
