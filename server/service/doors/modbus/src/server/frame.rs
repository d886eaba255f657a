//! Messages of Modbus TCP, after the *Modbus Messaging on TCP/IP Implementation Guide* 1.0b and the *Modbus Application
//! Protocol Specification* 1.1b3: functions 3, 4, 6 and 16.

use std::io;

use tokio::io::{AsyncRead, AsyncReadExt as _};

use crate::codes::Exception;
use crate::registers::map::Table;

/// Length of the header, with the unit.
const HEADER_BYTES: usize = 7;

/// Longest message behind the header: function and data.
const LONGEST_PDU: usize = 253;

/// Most registers that can be read in one request.
const MOST_READ: u16 = 125;

/// Most registers that can be written in one request.
const MOST_WRITTEN: u16 = 123;

/// A message of a client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    header: [u8; HEADER_BYTES],
    pdu: Vec<u8>,
}

/// What a client asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// Read registers.
    Read {
        /// Of this table.
        table: Table,
        /// From here.
        address: u16,
        /// So many.
        count: u16,
    },
    /// Write holding registers.
    Write {
        /// From here.
        address: u16,
        /// The values.
        words: Vec<u16>,
    },
}

impl Message {
    /// Reads a message; `None` at the end of the connection.
    ///
    /// # Errors
    /// The connection failed, or this is not Modbus TCP: nothing that follows could be understood.
    pub async fn read(stream: &mut (impl AsyncRead + Unpin)) -> io::Result<Option<Self>> {
        let mut header = [0; HEADER_BYTES];
        if stream.read(&mut header[..1]).await? == 0 {
            return Ok(None);
        }
        stream.read_exact(&mut header[1..]).await?;
        let [_, _, protocol_high, protocol_low, length_high, length_low, _] = header;
        let length = usize::from(u16::from_be_bytes([length_high, length_low]));
        // The length counts the unit.
        let n_bytes = length.checked_sub(1).filter(|n_bytes| (1..=LONGEST_PDU).contains(n_bytes));
        let Some(n_bytes) = n_bytes.filter(|_| [protocol_high, protocol_low] == [0, 0]) else {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "this is no Modbus TCP"));
        };
        let mut pdu = vec![0; n_bytes];
        stream.read_exact(&mut pdu).await?;
        Ok(Some(Self { header, pdu }))
    }

    /// Whether it would write registers, well-formed or not.
    pub fn is_write(&self) -> bool {
        matches!(self.pdu.first(), Some(6 | 16))
    }

    /// What is asked for.
    ///
    /// # Errors
    /// There is no such function, or its data are malformed.
    pub fn request(&self) -> Result<Request, Exception> {
        let word = |idx: usize| match self.pdu.get(idx..idx + 2) {
            Some(&[high, low]) => Ok(u16::from_be_bytes([high, low])),
            _ => Err(Exception::Value),
        };
        let has_length = |n_bytes: usize| if self.pdu.len() == n_bytes { Ok(()) } else { Err(Exception::Value) };
        let in_range =
            |count: u16, most: u16| if (1..=most).contains(&count) { Ok(count) } else { Err(Exception::Value) };
        match self.pdu.first() {
            Some(function @ (3 | 4)) => {
                has_length(5)?;
                let table = if *function == 3 { Table::Holding } else { Table::Input };
                Ok(Request::Read { table, address: word(1)?, count: in_range(word(3)?, MOST_READ)? })
            }
            Some(6) => {
                has_length(5)?;
                Ok(Request::Write { address: word(1)?, words: vec![word(3)?] })
            }
            Some(16) => {
                let count = usize::from(in_range(word(3)?, MOST_WRITTEN)?);
                has_length(6 + 2 * count)?;
                if self.pdu.get(5).map(|n_bytes| usize::from(*n_bytes)) != Some(2 * count) {
                    return Err(Exception::Value);
                }
                let words = (0..count).map(|idx| word(6 + 2 * idx)).collect::<Result<_, _>>()?;
                Ok(Request::Write { address: word(1)?, words })
            }
            _ => Err(Exception::Function),
        }
    }

    /// The answer with the registers read.
    pub fn with_words(&self, words: &[u16]) -> Vec<u8> {
        let mut pdu = vec![self.function(), u8::try_from(2 * words.len()).unwrap_or(u8::MAX)];
        pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
        self.answer(&pdu)
    }

    /// The answer to a write: where, and what or how many.
    pub fn written(&self) -> Vec<u8> {
        self.answer(self.pdu.get(..5).unwrap_or_default())
    }

    /// The answer with an exception.
    pub fn refused(&self, exception: Exception) -> Vec<u8> {
        self.answer(&[self.function() | 0x80, exception.number()])
    }

    fn function(&self) -> u8 {
        self.pdu.first().copied().unwrap_or_default()
    }

    /// With the transaction and the unit of the request.
    fn answer(&self, pdu: &[u8]) -> Vec<u8> {
        let [transaction_high, transaction_low, .., unit] = self.header;
        let [length_high, length_low] = u16::try_from(pdu.len() + 1).unwrap_or(u16::MAX).to_be_bytes();
        let mut answer = vec![transaction_high, transaction_low, 0, 0, length_high, length_low, unit];
        answer.extend_from_slice(pdu);
        answer
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn message(pdu: &[u8]) -> Message {
        Message { header: [0x12, 0x34, 0, 0, 0, 6, 17], pdu: pdu.to_vec() }
    }

    fn read(bytes: &[u8]) -> io::Result<Option<Message>> {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(Message::read(&mut &bytes[..]))
    }

    #[test]
    fn requests_are_those_of_the_specification() {
        let of = |pdu: &[u8]| message(pdu).request();
        let read = |table, address, count| Ok(Request::Read { table, address, count });
        let write = |address, words: &[u16]| Ok(Request::Write { address, words: words.to_vec() });
        // The examples of sections 6.3, 6.4, 6.6 and 6.12.
        assert_eq!(of(&[0x03, 0x00, 0x6B, 0x00, 0x03]), read(Table::Holding, 0x6B, 3));
        assert_eq!(of(&[0x04, 0x00, 0x08, 0x00, 0x01]), read(Table::Input, 8, 1));
        assert_eq!(of(&[0x06, 0x00, 0x01, 0x00, 0x03]), write(1, &[3]));
        assert_eq!(of(&[0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02]), write(1, &[0x000A, 0x0102]));
    }

    #[test]
    fn counts_and_lengths_that_are_not_allowed_are_exception_3_and_other_functions_exception_1() {
        for pdu in [
            &[3, 0, 0, 0, 0][..],
            &[4, 0, 0, 0, 126],
            &[4, 0, 0, 0xFF, 0xFF],
            &[3, 0, 0, 0],
            &[3, 0, 0, 0, 1, 0],
            &[6, 0, 0],
            &[16, 0, 0, 0, 0, 0],
            &[16, 0, 0, 0, 124, 248],
            &[16, 0, 0, 0, 2, 4, 0, 0],
            &[16, 0, 0, 0, 1, 4, 0, 0],
            &[16],
        ] {
            assert_eq!(message(pdu).request(), Err(Exception::Value), "{pdu:?}");
        }
        for function in (0..=255).filter(|function| ![3, 4, 6, 16].contains(function)) {
            assert_eq!(message(&[function, 0, 0, 0, 1]).request(), Err(Exception::Function), "{function}");
        }
    }

    #[test]
    fn an_answer_repeats_transaction_and_unit() {
        let read = message(&[4, 0, 8, 0, 2]);
        assert_eq!(read.with_words(&[0x449A, 0x5000]), [0x12, 0x34, 0, 0, 0, 7, 17, 4, 4, 0x44, 0x9A, 0x50, 0]);
        assert_eq!(read.refused(Exception::Address), [0x12, 0x34, 0, 0, 0, 3, 17, 0x84, 2]);
        let write = message(&[16, 0, 1, 0, 1, 2, 0, 9]);
        assert_eq!(write.written(), [0x12, 0x34, 0, 0, 0, 6, 17, 16, 0, 1, 0, 1]);
    }

    #[test]
    fn another_protocol_and_lengths_beyond_the_limit_end_the_connection() {
        assert!(read(&[]).unwrap().is_none());
        assert!(read(&[0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1]).unwrap().is_some());
        for bytes in [
            &b"GET / HTTP/1.1\r\n"[..],
            &[0, 1, 0, 1, 0, 6, 1, 3, 0, 0, 0, 1],
            &[0, 1, 0, 0, 0, 0, 1],
            &[0, 1, 0, 0, 0, 1, 1],
            &[0, 1, 0, 0, 0, 255, 1],
            &[0, 1, 0, 0, 0, 6, 1, 3],
            &[0, 1],
        ] {
            assert!(read(bytes).is_err(), "{bytes:?}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_answered_or_refused_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            if let Ok(Some(message)) = read(&bytes) {
                let _ = message.request();
                prop_assert!(message.refused(Exception::Value).len() == 9);
                prop_assert!(message.written().len() <= 12);
            }
            let _ = message(&bytes).request();
        }
    }
}
