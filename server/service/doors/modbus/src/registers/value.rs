//! Values in registers: high word first, high byte first.

use crate::registers::map::{CHARACTERISTIC_WORDS, Kind, Register};

/// A value of one of the types of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// 16 bits, unsigned.
    U16(u16),
    /// 32 bits, unsigned.
    U32(u32),
    /// 32 bits, signed.
    I32(i32),
    /// IEEE 754, 32 bits.
    F32(f32),
    /// 64 bits, unsigned.
    U64(u64),
    /// Text, cut off at the end of its registers.
    Text(&'a str),
}

impl Register {
    /// Puts the value into the image of the table.
    pub fn put(&self, image: &mut [u16], value: Value) {
        self.put_nth(image, 0, value);
    }

    /// Puts the value of a characteristic; those without registers are ignored.
    pub fn put_nth(&self, image: &mut [u16], characteristic_idx: usize, value: Value) {
        let first = self.address + characteristic_idx * CHARACTERISTIC_WORDS;
        let Some(place) = image.get_mut(first..first + self.kind.words()) else { return };
        debug_assert!(self.takes(value), "{} is no {value:?}", self.name);
        match value {
            Value::U16(value) => put_bytes(place, &value.to_be_bytes()),
            Value::U32(value) => put_bytes(place, &value.to_be_bytes()),
            Value::I32(value) => put_bytes(place, &value.to_be_bytes()),
            Value::F32(value) => put_bytes(place, &value.to_be_bytes()),
            Value::U64(value) => put_bytes(place, &value.to_be_bytes()),
            Value::Text(text) => put_bytes(place, cut_off(text, 2 * self.kind.words()).as_bytes()),
        }
    }

    /// A number of up to 32 bits.
    pub fn number(&self, image: &[u16]) -> u32 {
        self.place(image).iter().fold(0, |number, word| number << 16 | u32::from(*word))
    }

    /// A text up to its first 0, without spaces at its end; `None`: not UTF-8.
    pub fn text(&self, image: &[u16]) -> Option<String> {
        let bytes = self.place(image).iter().flat_map(|word| word.to_be_bytes());
        let bytes: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
        String::from_utf8(bytes).ok().map(|text| text.trim_end_matches(' ').to_owned())
    }

    fn place<'a>(&self, image: &'a [u16]) -> &'a [u16] {
        image.get(self.address..self.address + self.kind.words()).unwrap_or_default()
    }

    /// Whether the type of the value is that of the map.
    fn takes(&self, value: Value) -> bool {
        matches!(
            (self.kind, value),
            (Kind::U16, Value::U16(_))
                | (Kind::U32, Value::U32(_))
                | (Kind::I32, Value::I32(_))
                | (Kind::F32, Value::F32(_))
                | (Kind::U64, Value::U64(_))
                | (Kind::Text(_), Value::Text(_))
        )
    }
}

/// Two bytes per word; missing ones are 0.
fn put_bytes(words: &mut [u16], bytes: &[u8]) {
    let mut pairs = bytes.chunks(2);
    for word in words {
        let pair = pairs.next().unwrap_or_default();
        let byte = |idx: usize| pair.get(idx).copied().unwrap_or(0);
        *word = u16::from_be_bytes([byte(0), byte(1)]);
    }
}

/// The text without what exceeds `n_bytes`, never within a character.
fn cut_off(text: &str, n_bytes: usize) -> &str {
    let end = (0..=n_bytes.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    &text[..end.unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registers::map::{INPUT_WORDS, SERIAL, TIME_US, VALUE, VALUE_F32, WORD_ORDER, WORD_ORDER_TEST};

    #[test]
    fn values_are_high_word_first() {
        let mut image = vec![0; INPUT_WORDS];
        WORD_ORDER.put(&mut image, Value::F32(WORD_ORDER_TEST));
        TIME_US.put(&mut image, Value::U64(0x0001_0002_0003_0004));
        VALUE.put_nth(&mut image, 2, Value::I32(-2));
        VALUE_F32.put_nth(&mut image, 159, Value::F32(1.0));
        VALUE_F32.put_nth(&mut image, 160, Value::F32(1.0));
        assert_eq!(image[8..10], [0x449A, 0x5000]);
        assert_eq!(image[32..36], [1, 2, 3, 4]);
        assert_eq!(image[52..54], [0xFFFF, 0xFFFE]);
        assert_eq!(image[998..], [0x3F80, 0]);
    }

    #[test]
    fn a_text_has_its_first_letter_in_the_high_byte_and_is_cut_off_between_letters() {
        let mut image = vec![0; INPUT_WORDS];
        SERIAL.put(&mut image, Value::Text("ABC"));
        assert_eq!((&image[16..18], SERIAL.text(&image)), (&[0x4142, 0x4300][..], Some("ABC".to_owned())));
        SERIAL.put(&mut image, Value::Text(&format!("{}µ", "x".repeat(31))));
        assert_eq!(SERIAL.text(&image), Some("x".repeat(31)));
        SERIAL.put(&mut image, Value::Text(&"x".repeat(100)));
        assert_eq!(SERIAL.text(&image), Some("x".repeat(32)));
        image[16..18].copy_from_slice(&[0x4120, 0x2000]);
        assert_eq!(SERIAL.text(&image), Some("A".to_owned()));
        image[16] = 0xFFFF;
        assert_eq!(SERIAL.text(&image), None);
    }
}
