//! A receiver on this machine whose responses are set by the test.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;

use parking_lot::Mutex;
use rcgen::{
    BasicConstraints, CertificateParams, CertifiedIssuer, CertifiedKey, IsCa, KeyPair, generate_simple_self_signed,
};
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};

/// A request as received.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Method, path and version.
    pub line: String,
    headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Request {
    /// Empty if it is missing.
    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(known, _)| known == name).map_or("", |(_, value)| value)
    }

    fn read(from: &mut dyn Read) -> Option<Self> {
        let mut from = BufReader::new(from);
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            from.read_line(&mut line).ok().filter(|n_bytes| *n_bytes > 0)?;
            match line.trim_end() {
                "" => break,
                line => lines.push(line.to_owned()),
            }
        }
        let header = |line: &String| {
            let (name, value) = line.split_once(':').unwrap();
            (name.to_lowercase(), value.trim().to_owned())
        };
        let headers: Vec<_> = lines[1..].iter().map(header).collect();
        let mut request = Self { line: lines.swap_remove(0), headers, body: Vec::new() };
        request.body = vec![0; request.header("content-length").parse().unwrap()];
        from.read_exact(&mut request.body).ok()?;
        Some(request)
    }
}

/// It serves until the end of the test.
pub struct Receiver {
    pub address: SocketAddr,
    requests: Arc<Mutex<Vec<Request>>>,
    n_connections: Arc<Mutex<usize>>,
}

impl Receiver {
    /// `answer`: writes the answer to a request, then the connection is closed.
    pub fn start(mut answer: impl FnMut(&mut dyn Write) + Send + 'static) -> Self {
        Self::serve(move |mut stream, requests| serve(&mut stream, requests, &mut answer))
    }

    /// One that speaks first, and hears nothing.
    pub fn start_speaking(greeting: &'static str) -> Self {
        let mut open = Vec::new();
        Self::serve(move |mut stream, _| {
            write(&mut stream, greeting);
            open.push(stream);
        })
    }

    /// One that accepts every message, over TLS; with its certificate.
    pub fn start_encrypted(host: &str) -> (Self, CertificateDer<'static>) {
        let CertifiedKey { cert, signing_key } = generate_simple_self_signed([host.to_owned()]).unwrap();
        let certificate = cert.der().clone();
        (Self::serve_encrypted(certificate.clone(), signing_key), certificate)
    }

    /// The same with a certificate of an authority; with that of the authority.
    pub fn start_vouched(host: &str) -> (Self, CertificateDer<'static>) {
        let mut authority = CertificateParams::new([]).unwrap();
        authority.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let authority = CertifiedIssuer::self_signed(authority, KeyPair::generate().unwrap()).unwrap();
        let key = KeyPair::generate().unwrap();
        let receiver = CertificateParams::new([host.to_owned()]).unwrap().signed_by(&key, &authority).unwrap();
        (Self::serve_encrypted(receiver.der().clone(), key), authority.as_ref().der().clone())
    }

    fn serve_encrypted(certificate: CertificateDer<'static>, signing_key: KeyPair) -> Self {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let config = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
        let key = PrivateKeyDer::from(signing_key);
        let config = config.with_no_client_auth().with_single_cert(vec![certificate], key).unwrap();
        let config = Arc::new(config);
        Self::serve(move |stream, requests| {
            let mut stream = StreamOwned::new(ServerConnection::new(config.clone()).unwrap(), stream);
            serve(&mut stream, requests, &mut |to| write(to, "HTTP/1.1 204 No Content\r\n\r\n"));
        })
    }

    fn serve(mut connected: impl FnMut(TcpStream, &Mutex<Vec<Request>>) + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (requests, n_connections) = (Arc::<Mutex<Vec<Request>>>::default(), Arc::<Mutex<usize>>::default());
        let (log, count) = (requests.clone(), n_connections.clone());
        thread::spawn(move || {
            for stream in listener.incoming() {
                *count.lock() += 1;
                connected(stream.unwrap(), &log);
            }
        });
        Self { address, requests, n_connections }
    }

    /// What it has received.
    pub fn requests(&self) -> Vec<Request> {
        self.requests.lock().clone()
    }

    /// Connections made to it.
    pub fn n_connections(&self) -> usize {
        *self.n_connections.lock()
    }
}

fn serve(
    stream: &mut (impl Read + Write),
    requests: &Mutex<Vec<Request>>,
    answer: &mut dyn FnMut(&mut dyn Write),
) {
    if let Some(request) = Request::read(stream) {
        requests.lock().push(request);
        answer(stream);
    }
}

/// Writes, whether or not it is read.
pub fn write(to: &mut dyn Write, text: &str) {
    let _ = to.write_all(text.as_bytes()).and_then(|()| to.flush());
}

/// Status line, headers and body.
pub fn answer_with(head: &str, body: &str) -> impl FnMut(&mut dyn Write) + Send + 'static {
    let text = format!("HTTP/1.1 {head}\r\ncontent-length: {}\r\n\r\n{body}", body.len());
    move |to| write(to, &text)
}
