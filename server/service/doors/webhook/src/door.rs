//! The door.

use std::sync::Arc;
use std::time::Duration;

use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered};
use async_trait::async_trait;
use ureq::tls::RootCerts;

use crate::address::Allowed;
use crate::authorities;
use crate::params::{GIVES_UP_AFTER, TIMEOUTS_S};
use crate::post::Sender;
use crate::resolver::{CheckedResolver, Lookup, system_lookup};
use crate::secret::SecretFile;
use crate::settings::Settings;
use crate::url;

/// The door of these settings; nothing is connected.
///
/// # Errors
/// A setting cannot be used.
pub fn open(settings: Settings) -> Result<Arc<dyn Door>, BadSetting> {
    Ok(Arc::new(Webhook::new(settings, system_lookup, RootCerts::WebPki)?))
}

/// A receiver of events.
pub struct Webhook {
    name: String,
    target: String,
    filter: EventFilter,
    sender: Arc<Sender>,
}

impl Webhook {
    /// `lookup`: how names are resolved; `public_authorities`: who vouches for receivers without `ca_file`.
    ///
    /// # Errors
    /// A setting cannot be used.
    pub fn new(settings: Settings, lookup: Lookup, public_authorities: RootCerts) -> Result<Self, BadSetting> {
        let Settings { name, url, secret_file, ca_file, events, recipes, allowed_private, timeout_s } = settings;
        let is_letter = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_".contains(&byte);
        if name.is_empty() || !name.bytes().all(is_letter) {
            let why = format!("\"{name}\" does not consist of lower-case letters, digits, - and _");
            return Err(BadSetting { setting: "name", why });
        }
        if !TIMEOUTS_S.contains(&timeout_s) {
            let (least, most) = TIMEOUTS_S.into_inner();
            let why = format!("{timeout_s} is not between {least} and {most}");
            return Err(BadSetting { setting: "timeout_s", why });
        }
        let allowed = Allowed::parse(&allowed_private)?;
        let uri = url::parse(&url, &allowed)?;
        let secrets = SecretFile::open(&secret_file)?;
        let root_certificates = match ca_file {
            Some(path) if uri.scheme_str() == Some("https") => authorities::read(&path)?,
            Some(_) => return Err(authorities::unused()),
            None => public_authorities,
        };
        let filter = EventFilter::new(events, recipes)?;
        let (target, timeout) = (url::shown(&uri), Duration::from_secs(timeout_s));
        let resolver = CheckedResolver { allowed, lookup };
        let sender = Arc::new(Sender::new(uri, secrets, timeout, resolver, root_certificates));
        Ok(Self { name, target, filter, sender })
    }
}

#[async_trait]
impl Door for Webhook {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> &'static str {
        "webhook"
    }

    fn target(&self) -> String {
        self.target.clone()
    }

    fn wants(&self, event: &EventRecord) -> bool {
        self.filter.matches(event)
    }

    fn gives_up_after(&self) -> Option<Duration> {
        Some(GIVES_UP_AFTER)
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        let (sender, id, body) = (self.sender.clone(), delivery.id(), delivery.message().to_string());
        // If this is cancelled, the attempt ends on its own by its time limit.
        let posted = tokio::task::spawn_blocking(move || sender.post(&id, body.as_bytes())).await;
        posted.unwrap_or_else(|_| Err(Undelivered::unreachable("the attempt was interrupted")))
    }
}
