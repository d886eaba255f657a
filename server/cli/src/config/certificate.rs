//! `[certificate]`: who issues certificates of calibrations. Doc comments are the descriptions that users read.

use app::config::{Contact, Issuer, Place};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[certificate]`: who issues certificates of calibrations, and for whom.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct CertificateSettings {
    pub laboratory: ContactSettings,
    pub customer: ContactSettings,
    /// persons who answer for the results; the first one signs
    pub responsible: Vec<String>,
    /// inventory or serial number of the station
    pub station_number: String,
    /// where calibrations take place: laboratory, customer or other
    #[schemars(extend("enum" = ["laboratory", "customer", "other"]))]
    pub place: String,
}

/// `[certificate.laboratory]`, `[certificate.customer]`: name and address.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
pub struct ContactSettings {
    /// name; without it there are no certificates
    pub name: String,
    /// street and number
    pub street: String,
    /// post code
    pub post_code: String,
    /// city
    pub city: String,
    /// country: two capital letters of ISO 3166-1, such as DE
    pub country: String,
    /// e-mail address
    pub email: String,
}

impl Default for CertificateSettings {
    /// Nobody: names are never invented.
    fn default() -> Self {
        Self {
            laboratory: ContactSettings::default(),
            customer: ContactSettings::default(),
            responsible: Vec::new(),
            station_number: String::new(),
            place: "other".to_owned(),
        }
    }
}

impl From<CertificateSettings> for Issuer {
    fn from(settings: CertificateSettings) -> Self {
        let CertificateSettings { laboratory, customer, responsible, station_number, place } = settings;
        let place = match place.as_str() {
            "laboratory" => Place::Laboratory,
            "customer" => Place::Customer,
            _ => Place::Other,
        };
        Self { laboratory: laboratory.into(), customer: customer.into(), responsible, station_number, place }
    }
}

impl From<ContactSettings> for Contact {
    fn from(settings: ContactSettings) -> Self {
        let ContactSettings { name, street, post_code, city, country, email } = settings;
        Self { name, street, post_code, city, country, email }
    }
}
