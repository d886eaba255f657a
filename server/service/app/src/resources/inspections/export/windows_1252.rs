//! The character set of Q-DAS files.
//!
//! Programs that read Q-DAS files take them for Windows-1252 unless they begin with a byte order mark. ASCII, and with it
//! every number, is the same in both. A text with characters that Windows-1252 lacks is written as UTF-8 with that mark:
//! a reader that does not know it refuses the file, which someone notices, whereas a question mark in a serial number
//! would be taken for the serial number.

/// The characters of Windows-1252 from 0x80 to 0x9F; a space where there is none.
const UPPER: [char; 32] = [
    '€', ' ', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', ' ', 'Ž', ' ', ' ', '‘', '’', '“', '”', '•',
    '–', '—', '˜', '™', 'š', '›', 'œ', ' ', 'ž', 'Ÿ',
];

/// What a file that is not Windows-1252 begins with.
pub const BYTE_ORDER_MARK: &str = "\u{feff}";

/// Windows-1252 if it has all the characters, else UTF-8 with a byte order mark.
pub fn encoded(text: &str) -> Vec<u8> {
    narrow(text).unwrap_or_else(|| format!("{BYTE_ORDER_MARK}{text}").into_bytes())
}

/// The text in Windows-1252; `None` if it has other characters.
pub fn narrow(text: &str) -> Option<Vec<u8>> {
    text.chars().map(byte).collect()
}

fn byte(letter: char) -> Option<u8> {
    match letter {
        '\0'..='\x7f' | '\u{a0}'..='\u{ff}' => u8::try_from(letter).ok(),
        _ => UPPER.iter().position(|upper| *upper == letter).and_then(|idx| u8::try_from(0x80 + idx).ok()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn western_texts_are_windows_1252_and_others_utf_8_with_a_mark() {
        assert_eq!(encoded("8.912\u{14}0\r\n"), b"8.912\x140\r\n");
        assert_eq!(encoded("Prüfling 5° €Ÿ"), b"Pr\xfcfling 5\xb0 \x80\x9f");
        assert_eq!(encoded("零件"), "\u{feff}零件".as_bytes());
        assert_eq!(encoded("\u{81}"), "\u{feff}\u{81}".as_bytes());
    }
}
