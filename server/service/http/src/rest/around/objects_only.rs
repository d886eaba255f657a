//! Where the API document says object, a body must hold an object: serde also reads a struct from an array, by field
//! order, which the document does not promise.

use serde::de::value::{MapAccessDeserializer, MapDeserializer, SeqDeserializer};
use serde::de::{DeserializeOwned, Deserializer, Error as _, Expected, IntoDeserializer, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::{Error, Value};

use crate::typed_json::{PathError, typed};

/// The expectation text of serde's derived code for an internally tagged enum, which also accepts an array.
const TAGGED: &str = "internally tagged enum";

/// Refuses a body that has an array where `T` has an object.
pub fn objects_only<T: DeserializeOwned>(body: Value) -> Result<(), PathError> {
    typed::<T>(Strict(body)).map(drop)
}

/// A JSON value that is read as a struct only if it is an object.
struct Strict(Value);

impl Strict {
    fn is_array(&self) -> bool {
        self.0.is_array()
    }
}

fn not_an_object() -> Error {
    Error::invalid_type(Unexpected::Seq, &"an object")
}

impl<'de> IntoDeserializer<'de, Error> for Strict {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Strict {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let asked = (&visitor as &dyn Expected).to_string();
        match self.0 {
            Value::Array(_) if asked.starts_with(TAGGED) => Err(not_an_object()),
            Value::Array(items) => {
                let mut items = SeqDeserializer::new(items.into_iter().map(Strict));
                let value = visitor.visit_seq(&mut items)?;
                items.end().map(|()| value)
            }
            Value::Object(fields) => {
                let mut fields = MapDeserializer::new(fields.into_iter().map(|(key, value)| (key, Strict(value))));
                let value = visitor.visit_map(&mut fields)?;
                fields.end().map(|()| value)
            }
            plain => plain.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        if self.is_array() { Err(not_an_object()) } else { self.deserialize_any(visitor) }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        if self.0.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            Value::Object(fields) => {
                let fields = MapDeserializer::new(fields.into_iter().map(|(key, value)| (key, Strict(value))));
                visitor.visit_enum(MapAccessDeserializer::new(fields))
            }
            plain => plain.deserialize_enum(name, variants, visitor),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}
