//! Parser of the lines of the Zaber ASCII protocol, and formatting of commands with checksums.
//!
//! Sources: Zaber's "ASCII Protocol Manual" (firmware 6 and 7: message format, checksums, continuations, warning flags,
//! rejection reasons) and the test packets of Zaber's own library `zproto` 0.4.2.

/// A message from a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its kind, with the fields specific to it.
    pub kind: Kind,
    /// Address of the device, 1–99.
    pub address: u8,
    /// Number of the axis; 0 is the device.
    pub axis: u8,
    /// Id of the command.
    pub id: Option<u8>,
    /// The remaining text.
    pub text: String,
    /// Whether it is continued by another line.
    pub has_continuation: bool,
    /// Whether it had a checksum, which was correct.
    pub checked: bool,
}

/// Kinds of messages.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// `@`: the answer to a command.
    Reply {
        /// `OK`, else `RJ`.
        accepted: bool,
        /// State of the axis.
        status: Status,
    },
    /// `#`: free text, or the continuation of a line.
    Info {
        /// Whether it continues the previous line.
        continues: bool,
    },
    /// `!`: unsolicited, as at the end of a motion.
    Alert(Status),
}

/// Status of the axis in replies and alerts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// `BUSY`, else `IDLE`.
    pub busy: bool,
    /// The warning flag of highest priority, `--` for none.
    pub flag: String,
}

/// A command with its checksum and line ending.
pub fn command(address: u8, axis: u8, id: u8, text: &str) -> String {
    let body = format!("{address:02} {axis} {id:02} {text}");
    format!("/{body}:{:02X}\n", checksum(body.as_bytes()))
}

/// Two's complement of the sum of the bytes between the first character and the colon.
pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0_u8, |sum, &byte| sum.wrapping_add(byte)).wrapping_neg()
}

/// Parses one line, without its line ending; `None` if it is not part of the protocol, or its checksum is wrong.
pub fn message_from_line(line: &str) -> Option<Message> {
    let line = line.trim_end_matches(['\r', '\n']);
    let mark = line.chars().next().filter(|mark| "@#!".contains(*mark))?;
    let body = &line[1..];
    if !body.bytes().all(|byte| (0x20..0x7f).contains(&byte)) {
        return None;
    }
    let (body, checked) = match body.rsplit_once(':') {
        Some((body, sum)) if sum.len() == 2 => {
            (u8::from_str_radix(sum, 16).ok()? == checksum(body.as_bytes())).then_some((body, true))?
        }
        _ => (body, false),
    };
    let (body, has_continuation) = body.strip_suffix('\\').map_or((body, false), |body| (body, true));
    let mut tokens = body.split(' ').filter(|word| !word.is_empty()).peekable();
    let address = number(tokens.next()?, 2)?;
    let axis = number(tokens.next()?, 1)?;
    let id = tokens.peek().filter(|word| word.len() == 2).and_then(|word| number(word, 2));
    if id.is_some() {
        tokens.next();
    }
    let kind = match mark {
        '@' => {
            let accepted = match tokens.next()? {
                "OK" => true,
                "RJ" => false,
                _ => return None,
            };
            Kind::Reply { accepted, status: status(&mut tokens)? }
        }
        '!' => Kind::Alert(status(&mut tokens)?),
        _ => {
            let continues = tokens.next_if_eq(&"cont").is_some();
            if continues {
                // Newer firmware numbers its continuations.
                tokens.next_if(|word| word.len() == 2 && word.bytes().all(|byte| byte.is_ascii_digit()));
            }
            Kind::Info { continues }
        }
    };
    let text = tokens.collect::<Vec<_>>().join(" ");
    Some(Message { kind, address, axis, id, text, has_continuation, checked })
}

fn status<'a>(tokens: &mut impl Iterator<Item = &'a str>) -> Option<Status> {
    let busy = match tokens.next()? {
        "BUSY" => true,
        "IDLE" => false,
        _ => return None,
    };
    let flag = tokens.next().filter(|flag| flag.len() == 2)?;
    Some(Status { busy, flag: flag.to_owned() })
}

fn number(word: &str, digits: usize) -> Option<u8> {
    (word.len() == digits && word.bytes().all(|byte| byte.is_ascii_digit())).then(|| word.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_carries_the_sum_that_makes_its_bytes_zero() {
        let line = command(1, 1, 7, "move abs 10000");
        assert_eq!(line, "/01 1 07 move abs 10000:89\n");
        let (body, sum) = line[1..].trim_end().rsplit_once(':').unwrap();
        let total = body.bytes().fold(u8::from_str_radix(sum, 16).unwrap(), u8::wrapping_add);
        assert_eq!(total, 0);
    }

    #[test]
    fn lines_of_the_manual_are_read() {
        let status = |busy, flag: &str| Status { busy, flag: flag.to_owned() };
        let check = |line: &str, kind: Kind, id, text: &str, has_continuation| {
            let expected =
                Message { kind, address: 1, axis: 1, id, text: text.to_owned(), has_continuation, checked: false };
            assert_eq!(message_from_line(line), Some(expected), "{line}");
        };
        let ok = |busy, flag: &str| Kind::Reply { accepted: true, status: status(busy, flag) };
        check("@01 1 OK IDLE -- 10000\r\n", ok(false, "--"), None, "10000", false);
        check("@01 1 12 OK BUSY WR 0", ok(true, "WR"), Some(12), "0", false);
        let refused = Kind::Reply { accepted: false, status: status(false, "--") };
        check("@01 1 12 RJ IDLE -- BADDATA", refused, Some(12), "BADDATA", false);
        check("!01 1 IDLE FS ", Kind::Alert(status(false, "FS")), None, "", false);
        check("@01 1 OK IDLE -- part1\\", ok(false, "--"), None, "part1", true);
        check("#01 1 cont part2a part2b", Kind::Info { continues: true }, None, "part2a part2b", false);
        check("#01 1 Visit www.zaber.com", Kind::Info { continues: false }, None, "Visit www.zaber.com", false);
    }

    #[test]
    fn a_wrong_checksum_half_a_line_and_noise_are_not_the_protocol() {
        let sound = format!("@01 1 12 OK IDLE -- 10000:{:02X}", checksum(b"01 1 12 OK IDLE -- 10000"));
        assert!(message_from_line(&sound).is_some_and(|message| message.checked));
        for line in [
            sound.replace("10000", "10001").as_str(),
            &sound[8..],
            "@01 1 12 OK IDLE",
            "@01 1 12 OK LAZY -- 0",
            "@1 1 OK IDLE -- 0",
            "ok",
            "",
            "@01 1 OK IDLE -- \u{fffd}",
        ] {
            assert_eq!(message_from_line(line), None, "{line}");
        }
    }
}
