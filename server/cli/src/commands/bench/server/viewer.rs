//! A minimal viewer that only reads, so that the server is measured and not the client.

use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::net::{SocketAddr, TcpStream};

/// Bytes read at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Opcodes of RFC 6455, and the bit of a final fragment.
const TEXT: u8 = 1;
/// See [`TEXT`].
const BINARY: u8 = 2;
/// See [`TEXT`].
const PING: u8 = 9;
/// See [`TEXT`].
const PONG: u8 = 10;
/// See [`TEXT`].
const FIN: u8 = 0x80;

/// A connection of a viewer.
pub struct Viewer {
    stream: BufReader<TcpStream>,
    message: Vec<u8>,
}

impl Viewer {
    /// Connects and opens the live stream.
    pub fn open(address: SocketAddr) -> std::io::Result<Self> {
        let mut viewer = Self::connect(address)?;
        let request = format!(
            "GET /api/v1/stream HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Protocol: sheaf.v1\r\n\r\n"
        );
        viewer.stream.get_mut().write_all(request.as_bytes())?;
        let mut line = String::new();
        viewer.stream.read_line(&mut line)?;
        if !line.starts_with("HTTP/1.1 101") {
            return Err(std::io::Error::other(format!("the stream was refused: {}", line.trim_end())));
        }
        while line != "\r\n" {
            line.clear();
            viewer.stream.read_line(&mut line)?;
        }
        Ok(viewer)
    }

    /// Connects without a handshake.
    pub fn connect(address: SocketAddr) -> std::io::Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        Ok(Self { stream: BufReader::with_capacity(BUFFER_BYTES, stream), message: Vec::new() })
    }

    /// The connection, for closing it from another thread.
    pub fn stream(&self) -> &TcpStream {
        self.stream.get_ref()
    }

    /// Sends a text message of at most 64 kB.
    pub fn send_text(&mut self, text: &str) -> std::io::Result<()> {
        self.send(TEXT, text.as_bytes())
    }

    /// Sends at most 64 kB, masked with zeros.
    fn send(&mut self, opcode: u8, bytes: &[u8]) -> std::io::Result<()> {
        let length = (bytes.len() as u16).to_be_bytes();
        let frame = [&[FIN | opcode, 0xfe][..], &length, &[0; 4], bytes].concat();
        self.stream.get_mut().write_all(&frame)
    }

    /// The next message: whether it is binary, and its bytes. Pings are answered on the way; the server drops clients
    /// that do not answer.
    pub fn next(&mut self) -> std::io::Result<(bool, &[u8])> {
        loop {
            let opcode = self.receive()?;
            if opcode == PING {
                self.pong()?;
            } else {
                return Ok((opcode == BINARY, &self.message));
            }
        }
    }

    /// Answers a ping. Control messages have at most 125 bytes, so that the length takes one byte.
    fn pong(&mut self) -> std::io::Result<()> {
        let head = [FIN | PONG, 0x80 | self.message.len() as u8, 0, 0, 0, 0];
        let frame = [&head, self.message.as_slice()].concat();
        self.stream.get_mut().write_all(&frame)
    }

    /// Reads a message and returns its opcode.
    fn receive(&mut self) -> std::io::Result<u8> {
        let mut head = [0; 2];
        self.stream.read_exact(&mut head)?;
        let length = match head[1] {
            126 => u64::from(u16::from_be_bytes(read(&mut self.stream)?)),
            127 => u64::from_be_bytes(read(&mut self.stream)?),
            short => u64::from(short),
        };
        self.message.resize(length as usize, 0);
        self.stream.read_exact(&mut self.message)?;
        Ok(head[0] & !FIN)
    }
}

fn read<const N: usize>(input: &mut impl Read) -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    input.read_exact(&mut bytes)?;
    Ok(bytes)
}
