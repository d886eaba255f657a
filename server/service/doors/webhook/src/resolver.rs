//! Finds the addresses of a receiver, and lets only those pass that a door may connect to.
//!
//! A name is resolved once per attempt, all its addresses are checked, and the connection is made to one of them: a name
//! server cannot show one address to the check and another to the connection.

use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;

use ureq::Error;
use ureq::config::Config;
use ureq::http::Uri;
use ureq::unversioned::resolver::{ResolvedSocketAddrs, Resolver};
use ureq::unversioned::transport::NextTimeout;

use crate::address::{Allowed, is_public};

/// Number of addresses of a name that are tried; more are checked, too.
const ADDRESSES_TRIED: usize = 16;

/// Finds addresses by name and port.
pub type Lookup = fn(&str, u16) -> io::Result<Vec<SocketAddr>>;

/// Asks the system.
pub fn system_lookup(host: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    Ok((host, port).to_socket_addrs()?.collect())
}

/// Resolves names to addresses that a door may connect to.
pub struct CheckedResolver {
    /// What may be reached although it is not public.
    pub allowed: Allowed,
    /// How names are resolved.
    pub lookup: Lookup,
}

/// Why a door does not connect.
#[derive(Debug, thiserror::Error)]
pub enum Unconnectable {
    /// The name leads nowhere.
    #[error("{host} cannot be resolved: {cause}")]
    Unresolved {
        /// The name.
        host: String,
        /// Why.
        cause: io::Error,
    },
    /// The name has no address.
    #[error("{host} has no address")]
    NoAddress {
        /// The name.
        host: String,
    },
    /// A machine of the own network that is not listed.
    #[error("{host} leads to {ip}, which is not public; if that is right, add it to allowed_private")]
    NotPublic {
        /// The name or address.
        host: String,
        /// Where it leads.
        ip: IpAddr,
    },
    /// Anyone on the way could read the events.
    #[error("{host} leads to {ip}, which is not in allowed_private; use https:// for it")]
    Unencrypted {
        /// The name or address.
        host: String,
        /// Where it leads.
        ip: IpAddr,
    },
}

/// The host of a URL, an IPv6 address without brackets.
pub fn host_of(uri: &Uri) -> &str {
    uri.host().unwrap_or_default().trim_start_matches('[').trim_end_matches(']')
}

/// Whether a door may connect to this address of the host.
///
/// # Errors
/// It is not listed, and either not public or not encrypted.
pub fn check(uri: &Uri, ip: IpAddr, allowed: &Allowed) -> Result<(), Unconnectable> {
    let host = host_of(uri).to_owned();
    match uri.scheme_str() {
        _ if allowed.contains(ip) => Ok(()),
        Some("https") if is_public(ip) => Ok(()),
        Some("https") => Err(Unconnectable::NotPublic { host, ip }),
        _ => Err(Unconnectable::Unencrypted { host, ip }),
    }
}

impl CheckedResolver {
    /// All addresses, each checked.
    fn find(&self, uri: &Uri, timeout: NextTimeout) -> Result<Vec<SocketAddr>, Error> {
        let forbidden = |why: Unconnectable| Error::Other(Box::new(why));
        let port = uri.port_u16().unwrap_or(if uri.scheme_str() == Some("https") { 443 } else { 80 });
        let (host, lookup) = (host_of(uri).to_owned(), self.lookup);
        // The system's resolver has no time limit of its own: a thread waits for it.
        let (found, addresses) = sync_channel(1);
        let (name, limit) = (host.clone(), timeout.not_zero());
        thread::Builder::new().name("webhook-lookup".to_owned()).spawn(move || found.send(lookup(&name, port)))?;
        let addresses = match limit {
            Some(limit) => addresses.recv_timeout(*limit),
            None => addresses.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        let addresses = match addresses {
            Ok(Ok(addresses)) => addresses,
            Ok(Err(cause)) => return Err(forbidden(Unconnectable::Unresolved { host, cause })),
            Err(RecvTimeoutError::Timeout) => return Err(Error::Timeout(timeout.reason)),
            Err(RecvTimeoutError::Disconnected) => return Err(forbidden(Unconnectable::NoAddress { host })),
        };
        for address in &addresses {
            check(uri, address.ip(), &self.allowed).map_err(forbidden)?;
        }
        match addresses.is_empty() {
            true => Err(forbidden(Unconnectable::NoAddress { host })),
            false => Ok(addresses),
        }
    }
}

impl Resolver for CheckedResolver {
    fn resolve(&self, uri: &Uri, _: &Config, timeout: NextTimeout) -> Result<ResolvedSocketAddrs, Error> {
        let mut resolved = self.empty();
        for address in self.find(uri, timeout)?.into_iter().take(ADDRESSES_TRIED) {
            resolved.push(address);
        }
        Ok(resolved)
    }
}

impl fmt::Debug for CheckedResolver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CheckedResolver").field("allowed", &self.allowed).finish_non_exhaustive()
    }
}
