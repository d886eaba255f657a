//! The address of the broker.

use std::fmt;

use app::doors::BadSetting;

/// Host and port of a broker.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Name or IP address; an IPv6 address in brackets.
    pub host: String,
    /// Port.
    pub port: u16,
    /// Whether the connection uses TLS.
    pub has_tls: bool,
}

impl Address {
    /// From `mqtt://host[:port]` or `mqtts://host[:port]`.
    ///
    /// # Errors
    /// It is something else.
    pub fn parse(url: &str) -> Result<Self, BadSetting> {
        let bad = |why: &str| {
            let why = format!("\"{url}\" {why}; examples: mqtt://broker.example, mqtts://10.0.0.5:8883");
            BadSetting { setting: "url", why }
        };
        let (has_tls, rest) = match (url.strip_prefix("mqtt://"), url.strip_prefix("mqtts://")) {
            (Some(rest), _) => (false, rest),
            (_, Some(rest)) => (true, rest),
            (None, None) => return Err(bad("does not begin with mqtt:// or mqtts://")),
        };
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        if rest.contains('@') {
            return Err(bad("contains a user; use username and password_file"));
        }
        let end_of_host = rest.rfind(']').map_or(0, |end| end + 1);
        let (host, port) = match rest[end_of_host..].find(':') {
            Some(colon) => (&rest[..end_of_host + colon], Some(&rest[end_of_host + colon + 1..])),
            None => (rest, None),
        };
        let is_ipv6 = host.starts_with('[') && host.ends_with(']');
        let is_host = |byte: u8| byte.is_ascii_alphanumeric() || b".-_".contains(&byte);
        if host.is_empty() || !(is_ipv6 || host.bytes().all(is_host)) {
            return Err(bad("contains no host name, or a path"));
        }
        if is_ipv6 && has_tls {
            return Err(bad("has an IPv6 address, which no certificate of a broker names; use its host name"));
        }
        let port = match port.map(str::parse) {
            None if has_tls => 8883,
            None => 1883,
            Some(Ok(port)) if port > 0 => port,
            Some(_) => return Err(bad("has no valid port")),
        };
        Ok(Self { host: host.to_owned(), port, has_tls })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.has_tls { "mqtts" } else { "mqtt" };
        write!(text, "{scheme}://{}:{}", self.host, self.port)
    }
}
