//! The options of the client library.

use std::path::Path;

use app::doors::BadSetting;
use rumqttc::v5::MqttOptions;
use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::{LastWill, LastWillProperties};
use rumqttc::{TlsConfiguration, Transport};

use crate::connection::address::Address;
use crate::connection::message::Message;
use crate::connection::tls::client_config;
use crate::params::{
    CONNECT_TIMEOUT_S, INCOMING_PACKET_BYTES, KEEP_ALIVE, SESSION_EXPIRY_S, UNACKNOWLEDGED_MESSAGES,
};
use crate::settings::Settings;

/// Options for this broker, without a last will.
///
/// # Errors
/// A file cannot be read, or settings exclude each other.
pub fn options(settings: &Settings, address: &Address, client_id: String) -> Result<MqttOptions, BadSetting> {
    let mut options = MqttOptions::new(client_id, &address.host, address.port);
    options
        .set_keep_alive(KEEP_ALIVE)
        .set_clean_start(false)
        .set_session_expiry_interval(Some(SESSION_EXPIRY_S))
        .set_max_packet_size(Some(INCOMING_PACKET_BYTES))
        .set_connection_timeout(CONNECT_TIMEOUT_S)
        .set_outgoing_inflight_upper_limit(UNACKNOWLEDGED_MESSAGES);
    if settings.sparkplug_group.is_some() {
        // As Sparkplug demands: everything is announced again over the next connection.
        options.set_clean_start(true).set_session_expiry_interval(Some(0));
    }
    if let Some((username, password)) = credentials(settings)? {
        options.set_credentials(username, password);
    }
    if address.has_tls {
        let config = client_config(settings.ca_file.as_deref())?;
        options.set_transport(Transport::Tls(TlsConfiguration::Rustls(config)));
    } else if settings.ca_file.is_some() {
        let why = "certificates are checked for mqtts:// only; the url begins with mqtt://".to_owned();
        return Err(BadSetting { setting: "ca_file", why });
    }
    Ok(options)
}

/// What the broker publishes when the connection breaks.
pub fn last_will(will: Message) -> LastWill {
    let properties = LastWillProperties {
        delay_interval: None,
        payload_format_indicator: will.content_type.map(|_| 1),
        message_expiry_interval: None,
        content_type: will.content_type.map(str::to_owned),
        response_topic: None,
        correlation_data: None,
        user_properties: Vec::new(),
    };
    LastWill::new(will.topic, will.payload, QoS::AtLeastOnce, will.retained, Some(properties))
}

fn credentials(settings: &Settings) -> Result<Option<(String, String)>, BadSetting> {
    match (&settings.username, &settings.password_file) {
        (None, None) => Ok(None),
        (Some(username), None) => Ok(Some((username.clone(), String::new()))),
        (Some(username), Some(path)) => Ok(Some((username.clone(), password(path)?))),
        (None, Some(_)) => {
            Err(BadSetting { setting: "password_file", why: "there is no username for the password".to_owned() })
        }
    }
}

/// The content of the file without the end of its last line.
fn password(path: &Path) -> Result<String, BadSetting> {
    let bad = |why: &str| BadSetting { setting: "password_file", why: format!("{} {why}", path.display()) };
    let text = std::fs::read_to_string(path).map_err(|error| bad(&format!("cannot be read: {error}")))?;
    let text = text.strip_suffix('\n').unwrap_or(&text);
    let password = text.strip_suffix('\r').unwrap_or(text);
    if password.is_empty() { Err(bad("is empty")) } else { Ok(password.to_owned()) }
}
