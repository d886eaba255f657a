//! A door that posts signed events to a web server.
