//! The value of a setting, and how it is read from TOML, from the environment and from flags.

use toml::de::DeValue;

/// What a setting may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Any text.
    Text,
    /// One of these words.
    Word(&'static [&'static str]),
    /// Address and port.
    Address,
    /// A number of at least, of at most.
    Number(f64, f64),
    /// A whole number of at least, of at most.
    Whole(i64, i64),
    /// Yes or no.
    Switch,
    /// Several texts.
    Texts,
    /// Several whole numbers of at least, of at most.
    Wholes(i64, i64),
}

/// The value of a setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Text, word or address.
    Text(String),
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(i64),
    /// Yes or no.
    Switch(bool),
    /// Several texts.
    Texts(Vec<String>),
    /// Several whole numbers.
    Wholes(Vec<i64>),
}

impl Kind {
    /// What is expected, for people.
    pub fn expected(self) -> String {
        match self {
            Self::Text => "a text".to_owned(),
            Self::Word(words) => format!("one of {}", words.join(", ")),
            Self::Address => "an address and a port, such as 127.0.0.1:8080".to_owned(),
            Self::Number(least, most) => format!("a number from {least} to {most}"),
            Self::Whole(least, most) => format!("a whole number from {least} to {most}"),
            Self::Switch => "true or false".to_owned(),
            Self::Texts => "a list of texts".to_owned(),
            Self::Wholes(least, most) => format!("a list of whole numbers from {least} to {most}"),
        }
    }

    /// The value that `text` means in the environment or after a flag; lists are separated by commas.
    pub fn read_text(self, text: &str) -> Option<Value> {
        let items = || text.split(',').map(str::trim).filter(|item| !item.is_empty());
        let value = match self {
            Self::Text | Self::Word(_) | Self::Address => Value::Text(text.to_owned()),
            Self::Number(..) => Value::Number(text.trim().parse().ok()?),
            Self::Whole(..) => Value::Whole(text.trim().parse().ok()?),
            Self::Switch => Value::Switch(text.trim().parse().ok()?),
            Self::Texts => Value::Texts(items().map(str::to_owned).collect()),
            Self::Wholes(..) => Value::Wholes(items().map(|item| item.parse().ok()).collect::<Option<_>>()?),
        };
        self.holds(&value).then_some(value)
    }

    /// The value that a TOML value means.
    pub fn read_toml(self, toml: &DeValue<'_>) -> Option<Value> {
        let value = match self {
            Self::Text | Self::Word(_) | Self::Address => Value::Text(toml.as_str()?.to_owned()),
            Self::Number(..) => Value::Number(number(toml)?),
            Self::Whole(..) => Value::Whole(whole(toml)?),
            Self::Switch => Value::Switch(toml.as_bool()?),
            Self::Texts => Value::Texts(
                toml.as_array()?
                    .iter()
                    .map(|item| Some(item.get_ref().as_str()?.to_owned()))
                    .collect::<Option<_>>()?,
            ),
            Self::Wholes(..) => {
                Value::Wholes(toml.as_array()?.iter().map(|item| whole(item.get_ref())).collect::<Option<_>>()?)
            }
        };
        self.holds(&value).then_some(value)
    }

    fn holds(self, value: &Value) -> bool {
        match (self, value) {
            (Self::Word(words), Value::Text(text)) => words.contains(&text.as_str()),
            (Self::Address, Value::Text(text)) => text.parse::<std::net::SocketAddr>().is_ok(),
            (Self::Number(least, most), Value::Number(number)) => (least..=most).contains(number),
            (Self::Whole(least, most), Value::Whole(number)) => (least..=most).contains(number),
            (Self::Wholes(least, most), Value::Wholes(numbers)) => {
                !numbers.is_empty() && numbers.iter().all(|number| (least..=most).contains(number))
            }
            _ => true,
        }
    }
}

fn whole(toml: &DeValue<'_>) -> Option<i64> {
    let integer = toml.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

fn number(toml: &DeValue<'_>) -> Option<f64> {
    match toml.as_float() {
        Some(float) => float.as_str().parse().ok(),
        None => whole(toml).map(|whole| whole as f64),
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => write!(f, "{text}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Whole(number) => write!(f, "{number}"),
            Self::Switch(on) => write!(f, "{on}"),
            Self::Texts(texts) => write!(f, "{}", texts.join(",")),
            Self::Wholes(numbers) => {
                write!(f, "{}", numbers.iter().map(i64::to_string).collect::<Vec<_>>().join(","))
            }
        }
    }
}

impl Value {
    /// As JSON.
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Self::Text(text) => text.as_str().into(),
            Self::Number(number) => (*number).into(),
            Self::Whole(number) => (*number).into(),
            Self::Switch(on) => (*on).into(),
            Self::Texts(texts) => texts.clone().into(),
            Self::Wholes(numbers) => numbers.clone().into(),
        }
    }
}
