//! The server: listens, reads requests, and applies each to the handshake under its lock.

mod commands;
mod connections;
mod frame;
pub mod params;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::io::AsyncWriteExt as _;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::JoinSet;

use crate::codes::Exception;
use crate::handshake::{Circumstances, Handshake};
use crate::line::Line;
use crate::server::connections::{Connections, Place};
use crate::server::frame::{Message, Request};
use crate::server::params::{ACCEPT_RETRY, BIND_RETRY};

/// What connections, commands and deliveries share.
pub struct Shared {
    /// The registers.
    pub handshake: Mutex<Handshake>,
    /// Changes with every request that may let a delivery go on.
    pub requests: watch::Sender<()>,
    /// Whether a PLC may write.
    writes: bool,
    contact: Mutex<Contact>,
}

/// What is known of the other side.
struct Contact {
    /// Time of the last request, or of the start.
    last: Instant,
    /// Whether there was a request.
    any: bool,
    /// Why the port is not open.
    not_listening: Option<String>,
}

impl Shared {
    /// For a server that does not listen yet.
    pub fn new(writes: bool) -> Arc<Self> {
        let now = Instant::now();
        let not_listening = Some("the server is starting".to_owned());
        Arc::new(Self {
            handshake: Mutex::new(Handshake::new(writes, now)),
            requests: watch::Sender::new(()),
            writes,
            contact: Mutex::new(Contact { last: now, any: false, not_listening }),
        })
    }

    /// Time of the last request, if there was one; else of the start.
    pub fn last_contact(&self) -> (Instant, bool) {
        let contact = self.contact.lock();
        (contact.last, contact.any)
    }

    /// Why no PLC can connect.
    pub fn not_listening(&self) -> Option<String> {
        self.contact.lock().not_listening.clone()
    }

    fn note_request(&self, now: Instant) {
        let mut contact = self.contact.lock();
        (contact.last, contact.any) = (now, true);
    }
}

/// Limits of the server.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Connections at a time.
    pub max_connections: usize,
    /// A connection that is silent for so long is closed; also the time that a client has to take an answer.
    pub idle: Duration,
}

/// Serves until it is dropped, with every connection.
pub async fn serve(shared: Arc<Shared>, line: Arc<dyn Line>, listen: SocketAddr, limits: Limits) {
    let Limits { max_connections, idle } = limits;
    let listener = bind(&shared, listen).await;
    let places = Connections::new(max_connections);
    let mut connections = JoinSet::new();
    loop {
        while connections.try_join_next().is_some() {}
        match listener.accept().await {
            Ok((stream, from)) => match places.place(Instant::now()) {
                Some(place) => {
                    let (shared, line) = (shared.clone(), line.clone());
                    let connection = Connection { shared, line, from, place, idle };
                    connections.spawn(connection.serve(stream));
                }
                None => tracing::warn!(%from, max_connections, "all connections are in use: one was closed"),
            },
            Err(error) => {
                tracing::warn!(%listen, %error, "a Modbus connection was not accepted");
                tokio::time::sleep(ACCEPT_RETRY).await;
            }
        }
    }
}

/// Tries until the port is open.
async fn bind(shared: &Shared, listen: SocketAddr) -> TcpListener {
    let mut is_first = true;
    loop {
        match TcpListener::bind(listen).await {
            Ok(listener) => {
                shared.contact.lock().not_listening = None;
                tracing::info!(%listen, "the Modbus server listens");
                return listener;
            }
            Err(error) => {
                let reason = format!("the Modbus server cannot listen on {listen}: {error}; {}", remedy(&error));
                if std::mem::take(&mut is_first) {
                    tracing::warn!("{reason}");
                }
                shared.contact.lock().not_listening = Some(reason);
            }
        }
        tokio::time::sleep(BIND_RETRY).await;
    }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::AddrInUse => "end the other program that uses the port, or set another one in listen",
        io::ErrorKind::PermissionDenied => {
            "ports below 1024 need the capability CAP_NET_BIND_SERVICE (systemd: AmbientCapabilities), or set listen to \
             a higher one such as 1502"
        }
        io::ErrorKind::AddrNotAvailable => "set listen to an address of this computer, or to 0.0.0.0",
        _ => "check listen",
    }
}

/// One connection.
struct Connection {
    shared: Arc<Shared>,
    line: Arc<dyn Line>,
    from: SocketAddr,
    place: Place,
    idle: Duration,
}

impl Connection {
    async fn serve(self, stream: TcpStream) {
        let ended = tokio::select! {
            ended = self.answer_all(stream) => ended,
            () = self.place.replaced() => Ok("a new connection took its place"),
        };
        let from = self.from;
        match ended {
            Ok(why) => tracing::debug!(%from, why, "a Modbus connection ended"),
            Err(error) => tracing::debug!(%from, %error, "a Modbus connection failed"),
        }
    }

    async fn answer_all(&self, mut stream: TcpStream) -> io::Result<&'static str> {
        stream.set_nodelay(true)?;
        loop {
            let Ok(message) = tokio::time::timeout(self.idle, Message::read(&mut stream)).await else {
                return Ok("it was idle");
            };
            let Some(message) = message? else { return Ok("the client closed it") };
            let now = Instant::now();
            self.place.note_request(now);
            self.shared.note_request(now);
            let answer = self.answer(&message, now).unwrap_or_else(|exception| message.refused(exception));
            match tokio::time::timeout(self.idle, stream.write_all(&answer)).await {
                Ok(written) => written?,
                Err(_) => return Ok("the client does not take the answer"),
            }
        }
    }

    fn answer(&self, message: &Message, now: Instant) -> Result<Vec<u8>, Exception> {
        if message.is_write() && !self.shared.writes {
            return Err(Exception::Function);
        }
        let request = message.request()?;
        let at = Circumstances { from: self.from.ip(), station: self.line.station(), now };
        let answer = match request {
            Request::Read { table, address, count } => {
                let words = self.shared.handshake.lock().read(table, address, count, at)?;
                message.with_words(&words)
            }
            Request::Write { address, words } => {
                let order = self.shared.handshake.lock().write(address, &words, at)?;
                if let Some(order) = order {
                    let source = self.from.to_string();
                    // It runs to completion whether or not the client stays connected.
                    tokio::spawn(commands::execute(self.shared.clone(), self.line.clone(), source, order));
                }
                message.written()
            }
        };
        self.shared.requests.send_replace(());
        Ok(answer)
    }
}
