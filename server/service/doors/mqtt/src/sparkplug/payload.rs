//! Messages of Sparkplug B: those parts of `sparkplug_b.proto` of the Eclipse Foundation that are used here.

/// A message.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Payload {
    /// When it was sent, ms since 1970.
    #[prost(uint64, optional, tag = "1")]
    pub timestamp: Option<u64>,
    /// What it says.
    #[prost(message, repeated, tag = "2")]
    pub metrics: Vec<Metric>,
    /// Its number since the birth of the node, modulo 256.
    #[prost(uint64, optional, tag = "3")]
    pub seq: Option<u64>,
}

/// A metric.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Metric {
    /// Its name.
    #[prost(string, optional, tag = "1")]
    pub name: Option<String>,
    /// When it had this value, ms since 1970.
    #[prost(uint64, optional, tag = "3")]
    pub timestamp: Option<u64>,
    /// Number of its type.
    #[prost(uint32, optional, tag = "4")]
    pub datatype: Option<u32>,
    /// Whether it has no value now.
    #[prost(bool, optional, tag = "7")]
    pub is_null: Option<bool>,
    /// Its value.
    #[prost(oneof = "Value", tags = "10, 11, 12, 13, 14, 15")]
    pub value: Option<Value>,
}

/// A value, in the field of its type.
#[derive(Clone, PartialEq, prost::Oneof)]
pub enum Value {
    /// Up to 32 bits; a negative number as two's complement.
    #[prost(uint32, tag = "10")]
    Int(u32),
    /// 64 bits; a negative number as two's complement.
    #[prost(uint64, tag = "11")]
    Long(u64),
    /// Single precision.
    #[prost(float, tag = "12")]
    Float(f32),
    /// Double precision.
    #[prost(double, tag = "13")]
    Double(f64),
    /// Yes or no.
    #[prost(bool, tag = "14")]
    Boolean(bool),
    /// Text.
    #[prost(string, tag = "15")]
    Text(String),
}

/// Types of metrics, by number.
const INT64: u32 = 4;
const DOUBLE: u32 = 10;
const BOOLEAN: u32 = 11;
const STRING: u32 = 12;

impl Metric {
    /// An integer.
    pub fn integer(name: &str, at_ms: i64, value: Option<i64>) -> Self {
        Self::new(name, at_ms, INT64, value.map(|value| Value::Long(value.cast_unsigned())))
    }

    /// A number; one that is not finite has no value.
    pub fn number(name: &str, at_ms: i64, value: Option<f64>) -> Self {
        Self::new(name, at_ms, DOUBLE, value.filter(|value| value.is_finite()).map(Value::Double))
    }

    /// A yes or no.
    pub fn boolean(name: &str, at_ms: i64, value: Option<bool>) -> Self {
        Self::new(name, at_ms, BOOLEAN, value.map(Value::Boolean))
    }

    /// A text.
    pub fn text(name: &str, at_ms: i64, value: Option<&str>) -> Self {
        Self::new(name, at_ms, STRING, value.map(|value| Value::Text(value.to_owned())))
    }

    fn new(name: &str, at_ms: i64, datatype: u32, value: Option<Value>) -> Self {
        Self {
            name: Some(name.to_owned()),
            timestamp: Some(at_ms.cast_unsigned()),
            datatype: Some(datatype),
            is_null: value.is_none().then_some(true),
            value,
        }
    }
}
