//! Posts messages to a receiver. It blocks.

use std::time::{Duration, SystemTime};

use app::doors::Undelivered;
use ureq::Agent;
use ureq::config::AutoHeaderValue;
use ureq::http::Uri;
use ureq::tls::{RootCerts, TlsConfig};
use ureq::unversioned::transport::DefaultConnector;

use crate::answer::outcome;
use crate::failure::reason;
use crate::params::ANSWER_LIMIT_BYTES;
use crate::resolver::{CheckedResolver, host_of};
use crate::secret::SecretFile;

/// Signs messages and posts them to one receiver.
pub struct Sender {
    agent: Agent,
    uri: Uri,
    secrets: SecretFile,
    timeout: Duration,
}

impl Sender {
    /// `timeout`: of an attempt from the name to the end of the answer.
    pub fn new(
        uri: Uri,
        secrets: SecretFile,
        timeout: Duration,
        resolver: CheckedResolver,
        root_certificates: RootCerts,
    ) -> Self {
        let config = Agent::config_builder()
            .tls_config(TlsConfig::builder().root_certs(root_certificates).build())
            // A proxy of the environment would resolve names itself, without the check.
            .proxy(None)
            .max_redirects(0)
            .max_redirects_will_error(false)
            .http_status_as_error(false)
            .timeout_global(Some(timeout))
            .max_response_header_size(ANSWER_LIMIT_BYTES as usize)
            // Events are seconds apart at least. A connection kept open may have been closed by the receiver, and its
            // address was checked earlier.
            .max_idle_connections(0)
            .user_agent(concat!("sheaf/", env!("CARGO_PKG_VERSION")))
            .accept_encoding(AutoHeaderValue::None)
            .build();
        let agent = Agent::with_parts(config, DefaultConnector::default(), resolver);
        Self { agent, uri, secrets, timeout }
    }

    /// Posts once.
    ///
    /// # Errors
    /// The receiver cannot be reached, or does not accept the message.
    pub fn post(&self, id: &str, body: &[u8]) -> Result<(), Undelivered> {
        // A clock before 1970 makes signatures that no receiver accepts, and they say so.
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let timestamp_s = since_1970.as_secs();
        let request = self
            .agent
            .post(&self.uri)
            .header("content-type", "application/json")
            .header("connection", "close")
            .header("webhook-id", id)
            .header("webhook-timestamp", timestamp_s.to_string())
            .header("webhook-signature", self.secrets.sign(id, timestamp_s, body));
        match request.send(body) {
            Ok(answer) => outcome(answer),
            Err(error) => Err(Undelivered::unreachable(reason(&error, host_of(&self.uri), self.timeout))),
        }
    }
}
