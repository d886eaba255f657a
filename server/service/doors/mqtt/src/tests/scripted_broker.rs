//! A broker that answers as a test says, for what mosquitto never does.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The answer to a PUBLISH.
pub enum Reply {
    Bytes(Vec<u8>),
    /// The connection is closed.
    Closed,
}

/// Accepts every client; ends with its value.
pub struct ScriptedBroker {
    pub port: u16,
    is_over: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl ScriptedBroker {
    /// `session_present`: whether it claims to know the session; `connack`: the properties of its CONNACK; `answer`: what
    /// it does with a message, given its packet id and topic.
    pub fn start(
        session_present: bool,
        connack: &'static [u8],
        answer: impl Fn([u8; 2], &str) -> Reply + Send + 'static,
    ) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let is_over = Arc::new(AtomicBool::new(false));
        let ending = is_over.clone();
        let thread = std::thread::spawn(move || {
            for client in listener.incoming() {
                if ending.load(Ordering::SeqCst) {
                    return;
                }
                // Ends with an error when the client leaves.
                let _ = serve(client.unwrap(), session_present, connack, &answer);
            }
        });
        Self { port, is_over, thread: Some(thread) }
    }

    pub fn url(&self) -> String {
        format!("mqtt://127.0.0.1:{}", self.port)
    }
}

impl Drop for ScriptedBroker {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::SeqCst);
        let _ = TcpStream::connect(("127.0.0.1", self.port));
        // The door of the test may still be connected; then the thread ends with the process.
        if let Some(thread) = self.thread.take().filter(|thread| thread.is_finished()) {
            thread.join().unwrap();
        }
    }
}

fn serve(
    mut client: TcpStream,
    session_present: bool,
    connack: &[u8],
    answer: &impl Fn([u8; 2], &str) -> Reply,
) -> std::io::Result<()> {
    loop {
        let (kind, body) = read_packet(&mut client)?;
        match kind >> 4 {
            // CONNECT
            1 => {
                let n_properties = u8::try_from(connack.len()).unwrap();
                let head = [0x20, 3 + n_properties, u8::from(session_present), 0, n_properties];
                client.write_all(&[&head, connack].concat())?;
            }
            // PUBLISH
            3 => {
                let n_topic = usize::from(u16::from_be_bytes([body[0], body[1]]));
                let topic = std::str::from_utf8(&body[2..2 + n_topic]).unwrap();
                match answer([body[2 + n_topic], body[3 + n_topic]], topic) {
                    Reply::Bytes(bytes) => client.write_all(&bytes)?,
                    Reply::Closed => return client.shutdown(Shutdown::Both),
                }
            }
            // PINGREQ
            12 => client.write_all(&[0xD0, 0])?,
            _ => {}
        }
    }
}

fn read_packet(client: &mut TcpStream) -> std::io::Result<(u8, Vec<u8>)> {
    let mut byte = || -> std::io::Result<u8> {
        let mut one = [0];
        client.read_exact(&mut one)?;
        Ok(one[0])
    };
    let (kind, mut length, mut shift) = (byte()?, 0_usize, 0);
    loop {
        let next = byte()?;
        length |= usize::from(next & 0x7F) << shift;
        shift += 7;
        if next < 0x80 {
            break;
        }
    }
    let mut body = vec![0; length];
    client.read_exact(&mut body)?;
    Ok((kind, body))
}

/// PUBACK with this reason code.
pub fn puback([high, low]: [u8; 2], reason: u8) -> Vec<u8> {
    vec![0x40, 4, high, low, reason, 0]
}
