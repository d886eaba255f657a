//! The OPC UA server.

mod certificates;
mod event;
mod health;
mod methods;
mod nodes;
mod publisher;
pub mod users;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use opcua::crypto::SecurityPolicy;
use opcua::server::address_space::AddressSpace;
use opcua::server::node_manager::ServerContext;
use opcua::server::node_manager::memory::InMemoryNodeManagerBuilder;
use opcua::server::{Server, ServerBuilder, ServerEndpoint};
use opcua::types::{BuildInfo, MessageSecurityMode};
use parking_lot::Mutex;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, watch};

use crate::line::{Condition, Line, ResultFilter};
use crate::server::nodes::{Manager, Nodes};
use crate::server::publisher::Publisher;
use crate::server::users::Users;
use crate::settings::Settings;

/// Delay after the server could not start.
const RETRY: Duration = Duration::from_secs(5);

/// How long clients get to close their connections at the end.
const GOODBYE: Duration = Duration::from_secs(1);

/// Policies of encrypted connections; older ones are broken.
const POLICIES: [SecurityPolicy; 3] =
    [SecurityPolicy::Aes256Sha256RsaPss, SecurityPolicy::Aes128Sha256RsaOaep, SecurityPolicy::Basic256Sha256];

/// Notifications queued for a slow client. Beyond that the oldest are dropped, and the overflow is reported to the client.
const QUEUED_NOTIFICATIONS: usize = 1000;

/// What deliveries and the server share.
pub struct Shared {
    running: Mutex<Result<Running, String>>,
}

/// A server that listens.
#[derive(Clone)]
pub struct Running {
    /// Publishes to its clients.
    pub publisher: Arc<Publisher>,
    /// Where results come from.
    pub line: Arc<dyn Line>,
}

impl Shared {
    /// For a server that does not listen yet.
    pub fn new() -> Self {
        Self { running: Mutex::new(Err("the server is starting".to_owned())) }
    }

    /// The server, or why there is none.
    pub fn running(&self) -> Result<Running, String> {
        self.running.lock().clone()
    }
}

/// What a server consists of.
pub struct Parts {
    /// The settings of the door.
    pub settings: Settings,
    /// Who may connect.
    pub users: Arc<Users>,
    /// What methods act on.
    pub line: Arc<dyn Line>,
    /// The station.
    pub condition: watch::Receiver<Condition>,
}

/// Serves until it is dropped or `closing` ends; a server that cannot start is tried again.
pub async fn serve(shared: &Shared, parts: Parts, closing: impl Future<Output = ()>) {
    let parts = Arc::new(parts);
    let serving = async {
        let mut is_first = true;
        loop {
            let Err(reason) = run(shared, &parts).await else { return };
            if std::mem::take(&mut is_first) {
                tracing::warn!("{reason}");
            }
            *shared.running.lock() = Err(reason);
            tokio::time::sleep(RETRY).await;
        }
    };
    let close = async {
        closing.await;
        if let Ok(running) = shared.running() {
            running.publisher.end();
        }
        tokio::time::sleep(GOODBYE).await;
    };
    tokio::select! {
        () = serving => {}
        () = close => {}
    }
    *shared.running.lock() = Err("the server has ended".to_owned());
}

async fn run(shared: &Shared, parts: &Arc<Parts>) -> Result<(), String> {
    let listen = parts.settings.listen;
    let listener = TcpListener::bind(listen)
        .await
        .map_err(|error| format!("the OPC UA server cannot listen on {listen}: {error}; {}", remedy(&error)))?;
    let (prepared_events, mut prepared) = mpsc::unbounded_channel();
    let (of, line) = (parts.clone(), parts.line.clone());
    let built = tokio::task::spawn_blocking(move || build(&of, prepared_events)).await;
    let (server, publisher) = built.map_err(|error| error.to_string())??;
    let publisher = Arc::new(publisher);
    if let Ok((newest, _)) = line.results(&ResultFilter::default(), 0, 1).await
        && let Some(newest) = newest.first()
    {
        publisher.show_result(newest);
    }
    let mut condition = parts.condition.clone();
    publisher.follow(&condition.borrow_and_update().clone());
    let follow = async {
        loop {
            tokio::select! {
                changed = condition.changed() => match changed {
                    Ok(()) => publisher.follow(&condition.borrow_and_update().clone()),
                    // The station is shut down before the doors: its last state stays.
                    Err(_) => std::future::pending().await,
                },
                Some(recipe) = prepared.recv() => publisher.publish_prepared(&recipe),
            }
        }
    };
    *shared.running.lock() = Ok(Running { publisher: publisher.clone(), line });
    tracing::info!(%listen, "the OPC UA server listens");
    tokio::select! {
        ended = server.run_with(listener) => ended,
        () = follow => Ok(()),
    }
}

fn build(parts: &Parts, prepared_events: mpsc::UnboundedSender<String>) -> Result<(Server, Publisher), String> {
    let settings = &parts.settings;
    let host = host(settings);
    let application_uri = format!("urn:{host}:sheaf:{}", settings.name);
    certificates::ensure(&settings.certificates, &application_uri, &host)?;
    let line = parts.line.clone();
    let nodes = move |context: ServerContext, space: &mut AddressSpace| {
        Nodes::build(&context, space, line, prepared_events)
            .expect("the nodeset is part of the program, and every test of the server reads it")
    };
    let mut builder = ServerBuilder::new()
        .application_name("Sheaf")
        .application_uri(application_uri)
        .product_uri("urn:sheaf")
        .build_info(BuildInfo { product_name: "Sheaf".into(), ..BuildInfo::default() })
        .pki_dir(&settings.certificates)
        .certificate_path(certificates::CERTIFICATE)
        .private_key_path(certificates::PRIVATE_KEY)
        .host(host)
        .port(settings.listen.port())
        .discovery_urls(vec!["/".to_owned()])
        .with_authenticator(parts.users.clone())
        .with_node_manager(InMemoryNodeManagerBuilder::new(nodes));
    let limits = &mut builder.limits_mut().subscriptions;
    limits.max_queued_notifications = QUEUED_NOTIFICATIONS;
    limits.max_monitored_item_queue_size = QUEUED_NOTIFICATIONS;
    for policy in POLICIES {
        let endpoint = ServerEndpoint::new("/", policy, MessageSecurityMode::SignAndEncrypt, &[]);
        builder = builder.add_endpoint(policy.to_str(), endpoint);
    }
    if settings.anonymous {
        builder = builder.add_endpoint("none", ServerEndpoint::new_none("/", &[]));
    }
    let (server, handle) = builder.build()?;
    let manager = handle.node_managers().get_of_type::<Manager>().ok_or("the node manager is missing")?;
    Ok((server, Publisher::new(handle, manager)))
}

/// The host name in the end points, to which clients connect.
fn host(settings: &Settings) -> String {
    let address = settings.listen.ip();
    match &settings.host {
        Some(host) => host.clone(),
        None if address.is_unspecified() => gethostname::gethostname().to_string_lossy().into_owned(),
        None => match settings.listen {
            SocketAddr::V4(v4) => v4.ip().to_string(),
            SocketAddr::V6(v6) => format!("[{}]", v6.ip()),
        },
    }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::AddrInUse => "end the other program that uses the port, or set another one in listen",
        io::ErrorKind::AddrNotAvailable => "set listen to an address of this computer, or to 0.0.0.0",
        _ => "check listen",
    }
}
