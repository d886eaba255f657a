//! A door that publishes events to an MQTT 5 broker.
