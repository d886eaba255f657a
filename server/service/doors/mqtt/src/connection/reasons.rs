//! What a user reads about failures.

use app::doors::Undelivered;
use rumqttc::v5::mqttbytes;
use rumqttc::v5::mqttbytes::v5::{ConnectReturnCode, DisconnectReasonCode, PubAck, PubAckReason};
use rumqttc::v5::{ConnectionError, StateError};

use crate::params::CONNECT_TIMEOUT_S;

/// Why a connection failed or ended, after "the broker is not connected".
pub fn of_connection(error: &ConnectionError) -> String {
    match error {
        ConnectionError::ConnectionRefused(code) => of_refused_connection(*code),
        ConnectionError::Timeout(_) => format!("no answer within {CONNECT_TIMEOUT_S} s"),
        ConnectionError::Io(error) => error.to_string(),
        ConnectionError::Tls(error) => format!("TLS failed: {error}"),
        ConnectionError::NotConnAck(_) => "the answer is not that of an MQTT 5 broker".to_owned(),
        ConnectionError::MqttState(
            StateError::Io(error) | StateError::Deserialization(mqttbytes::Error::Io(error)),
        ) => error.to_string(),
        ConnectionError::MqttState(StateError::Deserialization(error)) => format!("unreadable answer: {error}"),
        // Some brokers, mosquitto 2.0 among them, do not say so when another client takes the session over.
        ConnectionError::MqttState(StateError::ConnectionAborted) => {
            "the broker closed the connection; perhaps another client uses the same client id".to_owned()
        }
        ConnectionError::MqttState(StateError::AwaitPingResp) => "the broker no longer answers".to_owned(),
        ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, reason_string }) => {
            let why = of_disconnect(*reason_code);
            reason_string.as_ref().map_or(why.clone(), |words| format!("{why}: {words}"))
        }
        other => other.to_string(),
    }
}

fn of_refused_connection(code: ConnectReturnCode) -> String {
    match code {
        ConnectReturnCode::BadUserNamePassword | ConnectReturnCode::NotAuthorized => {
            "the broker refused the user name or the password (not authorised)".to_owned()
        }
        ConnectReturnCode::ClientIdentifierNotValid | ConnectReturnCode::BadClientId => {
            "the broker refused the client id, which is made of prefix and station".to_owned()
        }
        ConnectReturnCode::UnsupportedProtocolVersion | ConnectReturnCode::RefusedProtocolVersion => {
            "the broker does not support MQTT 5".to_owned()
        }
        ConnectReturnCode::RetainNotSupported => "the broker does not support retained messages".to_owned(),
        ConnectReturnCode::QoSNotSupported => QOS_MISSING.to_owned(),
        other => format!("the broker refused the connection ({other:?})"),
    }
}

/// Why a broker without QoS 1 is of no use.
pub const QOS_MISSING: &str = "the broker does not support QoS 1, without which it acknowledges nothing";

fn of_disconnect(code: DisconnectReasonCode) -> String {
    match code {
        DisconnectReasonCode::SessionTakenOver => {
            "another client with the same client id connected; each station needs its own name".to_owned()
        }
        DisconnectReasonCode::PacketTooLarge => "the broker does not accept packets of that size".to_owned(),
        DisconnectReasonCode::NotAuthorized => "the broker ended the connection as not authorised".to_owned(),
        DisconnectReasonCode::ServerShuttingDown => "the broker was shut down".to_owned(),
        other => format!("the broker ended the connection ({other:?})"),
    }
}

/// What the loss of a connection means for a message on its way. A broker that ends the connection because of what it
/// received would end the next one, too: then the message is refused, so that others can pass.
pub fn of_lost_message(error: &ConnectionError, broker: &str) -> Undelivered {
    let is_about_message = match error {
        ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, .. }) => matches!(
            reason_code,
            DisconnectReasonCode::PacketTooLarge
                | DisconnectReasonCode::TopicNameInvalid
                | DisconnectReasonCode::PayloadFormatInvalid
                | DisconnectReasonCode::MalformedPacket
                | DisconnectReasonCode::ProtocolError
                | DisconnectReasonCode::NotAuthorized
                | DisconnectReasonCode::QuotaExceeded
        ),
        // An acknowledgement with a reason that MQTT does not define for it, in the words of the library.
        ConnectionError::MqttState(StateError::Deserialization(mqttbytes::Error::InvalidConnectReturnCode(_))) => {
            true
        }
        _ => false,
    };
    let reason = format!("{broker} did not acknowledge: {}", of_connection(error));
    if is_about_message { Undelivered::Refused(reason) } else { Undelivered::unreachable(reason) }
}

/// Whether the broker has accepted a message; an acknowledgement without subscribers is one, too.
pub fn of_acknowledgement(acknowledgement: &PubAck, topic: &str) -> Result<(), Undelivered> {
    let why = match acknowledgement.reason {
        PubAckReason::Success | PubAckReason::NoMatchingSubscribers => return Ok(()),
        PubAckReason::NotAuthorized => "this user may not publish there (not authorised)",
        PubAckReason::QuotaExceeded => "a quota is exceeded",
        PubAckReason::TopicNameInvalid => "the topic is not accepted",
        PubAckReason::PayloadFormatInvalid => "the payload is not accepted",
        PubAckReason::PacketIdentifierInUse => "the packet id is in use",
        PubAckReason::ImplementationSpecificError => "an error specific to this broker",
        PubAckReason::UnspecifiedError => "no reason given",
    };
    let words = acknowledgement.properties.as_ref().and_then(|properties| properties.reason_string.as_ref());
    let words = words.map(|words| format!(": {words}")).unwrap_or_default();
    Err(Undelivered::Refused(format!("the broker refused the message to {topic}: {why}{words}")))
}
