//! Access control for browsers: `Host` must name this server, `Origin` must be one of its own pages.
//!
//! Without these two checks any web page could control the visitor's station (DNS rebinding, cross-site requests).
//! Scripts send no `Origin` and are not affected.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use crate::HttpConfig;
use crate::edge::{Reached, STOP_PATH};
use crate::problem::{Problem, ProblemKind};

/// The allowed hosts and origins.
#[derive(Debug)]
pub struct Guard {
    hosts: Vec<String>,
    /// Loopback names of this machine: valid only if the client connected to a loopback address.
    own_names: [&'static str; 3],
    origins: Vec<String>,
}

impl Guard {
    /// This machine's own names, the address it listens on, and those from the configuration.
    pub fn new(config: &HttpConfig) -> Arc<Self> {
        let mut hosts = config.listen_ip.iter().map(ToString::to_string).collect::<Vec<_>>();
        hosts.extend(config.allowed_hosts.iter().map(|host| host.to_ascii_lowercase()));
        Arc::new(Self {
            hosts,
            own_names: ["localhost", "127.0.0.1", "::1"],
            origins: config.allowed_origins.clone(),
        })
    }

    /// Whether the request is allowed; `reached` is the local address it came in on.
    fn check(
        &self,
        method: &Method,
        headers: &HeaderMap,
        uri_host: Option<&str>,
        reached: Option<IpAddr>,
    ) -> Result<(), Problem> {
        let host = match (headers.get(header::HOST), uri_host) {
            (Some(host), _) => host.to_str().unwrap_or_default(),
            (None, Some(host)) => host,
            (None, None) => return Err(Problem::new(ProblemKind::BadRequest, "the request has no Host header")),
        };
        let name = name_of(host);
        let at_home = reached.is_none_or(|address| address.to_canonical().is_loopback());
        let known = self.hosts.contains(&name) || at_home && self.own_names.contains(&name.as_str());
        if !known {
            return Err(Problem::new(
                ProblemKind::Forbidden,
                format!("this server does not accept the host name \"{host}\""),
            )
            .remedy("add the name to http.allowed_hosts of the configuration"));
        }
        let upgrade = headers.contains_key(header::UPGRADE);
        if method.is_safe() && !upgrade {
            return Ok(());
        }
        self.check_origin(headers, host)
    }

    fn check_origin(&self, headers: &HeaderMap, host: &str) -> Result<(), Problem> {
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let origin = origin.to_str().unwrap_or_default();
        // A page of this server, itself or behind a proxy that does TLS; browsers write the host in lower case.
        let host = host.to_ascii_lowercase();
        let own = ["http", "https"].iter().any(|scheme| origin == format!("{scheme}://{host}"));
        let is_page = origin.starts_with("http://") || origin.starts_with("https://");
        if own || is_page && self.origins.iter().any(|allowed| allowed == origin) {
            return Ok(());
        }
        Err(Problem::new(ProblemKind::Forbidden, format!("pages of \"{origin}\" may not use this server"))
            .remedy("add the origin to http.allowed_origins of the configuration"))
    }
}

/// The name in `Host`, without port, brackets and capitals.
fn name_of(host: &str) -> String {
    let name = match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((address, _)) => address,
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    };
    // An address is the same however it is written.
    name.parse::<IpAddr>().map_or_else(|_| name.to_ascii_lowercase(), |address| address.to_string())
}

/// Rejects requests that are not allowed. Stop is always allowed: a stranger's Stop is a nuisance, a refused Stop is worse.
pub async fn guard(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    let stop = request.uri().path() == STOP_PATH && request.method() == Method::POST;
    let authority = request.uri().authority().map(|authority| authority.as_str());
    let reached = request.extensions().get::<Reached>().map(|reached| reached.0);
    match guard.check(request.method(), request.headers(), authority, reached) {
        Err(problem) if !stop => problem.into_response(),
        _ => next.run(request).await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(method: Method, pairs: &[(&'static str, &'static str)]) -> Option<u16> {
        check_at("127.0.0.1", method, pairs)
    }

    fn check_at(reached: &str, method: Method, pairs: &[(&'static str, &'static str)]) -> Option<u16> {
        let config = HttpConfig {
            listen_ip: Some("127.0.0.1".parse().unwrap()),
            allowed_hosts: vec!["Line3".to_owned()],
            allowed_origins: vec!["https://mes.example".to_owned(), "chrome-extension://x".to_owned()],
            trusted_proxy: false,
        };
        let headers = pairs.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap()));
        let reached = Some(reached.parse().unwrap());
        Guard::new(&config).check(&method, &headers.collect(), None, reached).err().map(|problem| problem.status)
    }

    #[test]
    fn loopback_names_are_refused_on_other_addresses() {
        for host in ["localhost:8080", "127.0.0.1", "[::1]:8080"] {
            assert_eq!(check_at("::ffff:127.0.0.1", Method::GET, &[("host", host)]), None, "{host}");
            let expected = if host == "127.0.0.1" { None } else { Some(403) };
            assert_eq!(check_at("192.168.1.7", Method::GET, &[("host", host)]), expected, "{host}");
        }
        assert_eq!(check_at("192.168.1.7", Method::GET, &[("host", "line3")]), None);
    }

    #[test]
    fn only_names_of_this_server_are_answered() {
        for host in ["localhost", "LOCALHOST:8080", "127.0.0.1:1", "[::1]:8080", "[0:0::1]", "line3:8080"] {
            assert_eq!(check(Method::GET, &[("host", host)]), None, "{host}");
        }
        for host in ["evil.example", "localhost.evil.example", "127.0.0.2", "", "[::2]:80"] {
            assert_eq!(check(Method::GET, &[("host", host)]), Some(403), "{host}");
        }
        assert_eq!(check(Method::GET, &[]), Some(400));
    }

    #[test]
    fn a_page_of_another_origin_may_read_but_not_change() {
        let foreign = [("host", "localhost:8080"), ("origin", "http://evil.example")];
        assert_eq!(check(Method::POST, &foreign), Some(403));
        assert_eq!(check(Method::GET, &foreign), None);
        let socket = [foreign[0], foreign[1], ("upgrade", "websocket")];
        assert_eq!(check(Method::GET, &socket), Some(403));
        assert_eq!(check(Method::PUT, &[foreign[0], ("origin", "null")]), Some(403));
        assert_eq!(check(Method::PUT, &[foreign[0], ("origin", "http://localhost:9")]), Some(403));
        assert_eq!(check(Method::PUT, &[foreign[0], ("origin", "http://localhost:8080")]), None);
        assert_eq!(check(Method::PUT, &[foreign[0], ("origin", "https://mes.example")]), None);
        assert_eq!(check(Method::PUT, &[foreign[0]]), None);
        for origin in [
            "javascript://localhost:8080",
            "file://localhost:8080",
            "http://localhost:8080/",
            "HTTP://localhost:8080",
        ] {
            assert_eq!(check(Method::PUT, &[foreign[0], ("origin", origin)]), Some(403), "{origin}");
        }
        assert_eq!(check(Method::PUT, &[("host", "LOCALHOST:8080"), ("origin", "http://localhost:8080")]), None);
    }
}
