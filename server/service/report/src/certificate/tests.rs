//! Certificates against expectations written by hand after the schema: the order of the elements, values with units and
//! uncertainties, what is stated and what is refused. Whether the schema itself accepts them is not tested here;
//! `docs/service/certificates.md` names the program that did.

use calibration::CalibrationDocument;
use quick_xml::Reader;
use quick_xml::events::Event;
use serde_json::{Value, json};
use time::{Date, Month};

use super::{Certificate, CertificateError, Contact, Issuer, Place, StationPart, calibration_certificate};

/// Elements with children, and these in the order of the schema; `!`: required.
const ORDER: [(&str, &str); 33] = [
    ("dcc:digitalCalibrationCertificate", "!administrativeData !measurementResults"),
    (
        "dcc:administrativeData",
        "!dccSoftware !coreData !items !calibrationLaboratory !respPersons !customer statements",
    ),
    ("dcc:dccSoftware", "!software"),
    ("dcc:software", "!name !release type description"),
    (
        "dcc:coreData",
        "!countryCodeISO3166_1 !usedLangCodeISO639_1 !mandatoryLangCodeISO639_1 !uniqueIdentifier identifications \
         receiptDate !beginPerformanceDate !endPerformanceDate !performanceLocation issueDate",
    ),
    ("dcc:identifications", "!identification"),
    ("dcc:identification", "!issuer !value name"),
    ("dcc:items", "name description identifications !item"),
    ("dcc:subItems", "name description identifications !item"),
    ("dcc:item", "!name description manufacturer model !identifications subItems"),
    ("dcc:manufacturer", "!name"),
    ("dcc:calibrationLaboratory", "!contact"),
    ("dcc:contact", "!name eMail !location"),
    ("dcc:customer", "!name eMail !location"),
    ("dcc:location", "street postCode !city !countryCode"),
    ("dcc:respPersons", "!respPerson"),
    ("dcc:respPerson", "!person mainSigner"),
    ("dcc:person", "!name"),
    ("dcc:statements", "!statement"),
    ("dcc:statement", "name traceable declaration"),
    ("dcc:measurementResults", "!measurementResult"),
    (
        "dcc:measurementResult",
        "!name !usedMethods !usedSoftware !influenceConditions !results measurementMetaData",
    ),
    ("dcc:usedMethods", "!usedMethod"),
    ("dcc:usedMethod", "!name description norm"),
    ("dcc:usedSoftware", "!software"),
    ("dcc:influenceConditions", "!influenceCondition"),
    ("dcc:influenceCondition", "!name !data"),
    ("dcc:results", "!result"),
    ("dcc:result", "!name !data"),
    ("dcc:data", "text quantity"),
    ("dcc:quantity", "!name real realListXMLList"),
    ("dcc:measurementMetaData", "!metaData"),
    ("dcc:metaData", "declaration"),
];

/// The same for quantities in D-SI.
const QUANTITIES: [(&str, &str); 4] = [
    ("si:real", "!value !unit measurementUncertaintyUnivariate"),
    ("si:measurementUncertaintyUnivariate", "!expandedMU"),
    ("si:expandedMU", "!valueExpandedMU !coverageFactor !coverageProbability distribution"),
    ("si:realListXMLList", "labelXMLList !valueXMLList !unitXMLList"),
];

/// Texts in a language.
const TEXTS: [&str; 4] = ["dcc:name", "dcc:description", "dcc:declaration", "dcc:text"];

fn document() -> Value {
    json!({
        "format": "sheaf-calibration/1", "id": "0123456789abcdef",
        "camera": { "width_px": 640, "height_px": 480, "fx_px": 812.345_678, "fy_px": 812.4, "cx_px": 319.5,
            "cy_px": 239.5, "k1": -0.123_456, "k2": 0.01, "p1": 0.0, "p2": 0.0, "k3": 0.0 },
        "orders": [1, -1],
        "light": { "model": "planes", "planes": [] },
        "stage": { "direction_mm_per_mm": [0.001, 0.999, 0.01],
            "tilt": { "sigmas_rad": [[0.0, 3e-4, 4e-4], [1e-4, 0.0, 0.0], [0.0, 0.0, 0.0]], "centre_mm": [0.0, 0.0, 300.0],
                "first_mm": -20.0, "last_mm": 20.0, "n_nodes": 3 } },
        "depth_range": { "near_mm": 250.0, "far_mm": 400.0 },
        "covariance": { "parameters": [], "matrix": [] },
        "software": { "name": "sheaf", "version": "0.0.9" },
        "inputs": [], "parameters": {},
        "report": {
            "camera": { "rms_px": 0.071, "corner_sigma_px": 0.05, "k3": "not significant",
                "sigma": [0.0311, 0.031, 0.05, 0.05, 0.0002, 0.001, 0.0, 0.0, 0.0],
                "views": [{ "name": "board 0.png", "rms_px": 0.07, "n_corners": 88 },
                    { "name": "board 1.png", "rms_px": 0.072, "n_corners": 80 }] },
            "light": { "model": "grating", "rms_px": 0.08, "systematic_sigma_mm": 0.0123,
                "wavelength_over_period": [0.325, 0.000_1, 0.3251],
                "lines": [
                    { "pose": "a", "order": -1, "n_points": 300, "mean_px": 0.0, "rms_px": 0.1,
                        "normalised_rms": 1.0, "n_outliers": 0 },
                    { "pose": "b", "order": -1, "n_points": 100, "mean_px": 0.0, "rms_px": 0.02,
                        "normalised_rms": 1.0, "n_outliers": 0 },
                    { "pose": "a", "order": 1, "n_points": 0, "mean_px": 0.0, "rms_px": 0.0,
                        "normalised_rms": 0.0, "n_outliers": 9 }],
                "rejected_off_board": 0, "rejected_square_edge": 0, "rejected_unlabelled": 0, "rejected_outlier": 9 },
            "cross_validation": { "recommended": "grating", "reason": "best", "models": [
                { "model": "grating", "held_out_rms_px": 0.1, "held_out_rms_mm": 0.02, "held_out_bias_mm": 0.004,
                    "fit_rms_px": 0.08, "failure": null }] },
            "stage": { "sigma": [0.0001, 0.0001, 0.0002], "scale_error": -0.000_95, "scale_sigma": 0.000_1,
                "straightness_rms_um": 4.2, "straightness": [[0.0, 1.0, 2.0, 3.0]] },
            "warnings": ["few poses & little tilt"],
        },
    })
}

fn certificate() -> Certificate {
    let contact = |name: &str| Contact {
        name: name.to_owned(),
        street: "Weg 1".to_owned(),
        post_code: String::new(),
        city: "Ort".to_owned(),
        country: "DE".to_owned(),
        email: "lab@example.org".to_owned(),
    };
    let day = |day| Date::from_calendar_date(2026, Month::November, day).unwrap();
    Certificate {
        issuer: Issuer {
            laboratory: contact("Labor & Co"),
            customer: contact("Works"),
            responsible: vec!["A. Person".to_owned(), "B. Person".to_owned()],
            station_number: "INV-7".to_owned(),
            place: Place::Laboratory,
        },
        begun: day(25),
        ended: day(26),
        issued: day(27),
        parts: Vec::new(),
        simulated: None,
    }
}

fn xml(document: Value, certificate: &Certificate) -> String {
    let document: CalibrationDocument = serde_json::from_value(document).unwrap();
    calibration_certificate(&document, certificate).unwrap()
}

/// The children of every element, in order; fails if the document is not well-formed.
fn families(xml: &str) -> Vec<(String, Vec<String>)> {
    let mut reader = Reader::from_str(xml);
    let (mut open, mut families): (Vec<(String, Vec<String>)>, Vec<_>) = (Vec::new(), Vec::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Start(start) => {
                let name = String::from_utf8(start.name().as_ref().to_vec()).unwrap();
                if let Some((_, children)) = open.last_mut() {
                    children.push(name.clone());
                }
                open.push((name, Vec::new()));
            }
            Event::End(_) => families.push(open.pop().unwrap()),
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty());
    families
}

/// Whether every element has the children that the tables allow, in their order.
fn check_order(xml: &str) {
    let tables = ORDER.iter().chain(&QUANTITIES);
    for (name, children) in families(xml).iter().filter(|(_, children)| !children.is_empty()) {
        if TEXTS.contains(&name.as_str()) {
            assert!(children.iter().all(|child| child == "dcc:content"), "{name}: {children:?}");
            continue;
        }
        let row = tables.clone().find(|(known, _)| known == name);
        let (_, allowed) = row.unwrap_or_else(|| panic!("{name} has children {children:?}"));
        let local = |child: &str| child.split_once(':').unwrap().1.to_owned();
        let place = |child: &String| {
            let is = |entry: &str| entry.trim_start_matches('!') == local(child);
            allowed.split_whitespace().position(is).unwrap_or_else(|| panic!("{child} in {name}"))
        };
        assert!(children.iter().map(place).is_sorted(), "{name}: {children:?}");
        for required in allowed.split_whitespace().filter_map(|entry| entry.strip_prefix('!')) {
            assert!(children.iter().any(|child| local(child) == required), "{name} without {required}");
        }
    }
}

/// The line of a quantity's value, and of its expanded uncertainty.
fn value_of<'x>(xml: &'x str, name: &str) -> [&'x str; 2] {
    let quantity = xml.split("<dcc:quantity").find(|part| part.contains(&format!(">{name}<"))).unwrap();
    let quantity = quantity.split("</dcc:quantity>").next().unwrap();
    ["value", "valueExpandedMU"].map(|tag| {
        let text = quantity.split(&format!("<si:{tag}>")).nth(1);
        text.and_then(|text| text.split('<').next()).unwrap_or_default()
    })
}

#[test]
fn the_elements_are_in_the_order_of_the_schema_whatever_was_calibrated() {
    check_order(&xml(document(), &certificate()));
    let mut camera_only = document();
    (camera_only["stage"], camera_only["report"]["light"]) = (Value::Null, Value::Null);
    camera_only["report"]["cross_validation"] = Value::Null;
    camera_only["report"]["warnings"] = json!([]);
    let camera_only = xml(camera_only, &certificate());
    check_order(&camera_only);
    assert_eq!(camera_only.matches("<dcc:measurementResult>").count(), 1);
    let mut rotary = document();
    rotary["stage"] = json!({ "kind": "rotary", "point_mm": [1.0, 2.0, 300.0], "direction": [0.0, 1.0, 0.0] });
    rotary["report"]["stage"] = Value::Null;
    rotary["report"]["axis"] = json!({ "tilt_sigma_deg": [0.01, 0.02], "shift_sigma_mm": [0.005, 0.006],
        "angle_sigma_deg": null, "angle_sigma_stated": false, "noise_ratio": 1.0, "deviations": [] });
    let rotary = xml(rotary, &certificate());
    check_order(&rotary);
    let name = "Deviation of the axis from its stated place, second direction across the axis";
    assert_eq!(value_of(&rotary, name), ["0.000", "0.012"]);
}

#[test]
fn results_have_units_and_expanded_uncertainties_with_k_2() {
    let xml = xml(document(), &certificate());
    for (name, value, expanded) in [
        ("Focal length fx, pixels", "812.346", "0.062"),
        ("Radial distortion k1", "-0.12346", "0.00040"),
        ("Radial distortion k3", "0", ""),
        ("Number of corners", "168", ""),
        ("Wavelength over grating period", "0.32500", "0.00020"),
        ("Travel per nominal travel", "0.99905", "0.00020"),
        ("Deviation across the travel, RMS", "4.20000", ""),
        ("Rotation about the first principal axis, standard deviation", "0.0286479", ""),
        ("Rotation about the second principal axis, standard deviation", "0.00572958", ""),
        ("Error of the depth on boards left out of the fit, RMS of points", "20.0000", ""),
    ] {
        assert_eq!(value_of(&xml, name), [value, expanded], "{name}");
    }
    assert_eq!(xml.matches("<si:coverageFactor>2<").count(), xml.matches("<si:coverageProbability>0.95<").count());
    for text in [
        r"<si:unit>\milli\metre</si:unit>",
        r"<si:unit>\micro\metre</si:unit>",
        "<si:valueXMLList>0.0700000 0.0720000</si:valueXMLList>",
        "<si:labelXMLList>board_0.png board_1.png</si:labelXMLList>",
        // √((300·0.1² + 100·0.02²) / 400); the order without points is left out.
        "<si:valueXMLList>0.0871780</si:valueXMLList>",
        "few poses &amp; little tilt",
        "<dcc:release>v0.0.9</dcc:release>",
    ] {
        assert!(xml.contains(text), "{text} in {xml}");
    }
}

#[test]
fn it_states_who_issued_it_for_what_and_that_it_is_not_accredited() {
    let mut known = certificate();
    known.simulated = Some("twin".to_owned());
    let part = |part: &str, serial: &str| StationPart {
        part: part.to_owned(),
        vendor: "Vendor <v>".to_owned(),
        model: "M1".to_owned(),
        serial: serial.to_owned(),
        firmware: String::new(),
    };
    known.parts = vec![part("camera", "S-4711"), part("stage", "")];
    let xml = xml(document(), &known);
    check_order(&xml);
    for text in [
        "schemaVersion=\"3.3.0\"",
        "xmlns:dcc=\"https://ptb.de/dcc\"",
        "xmlns:si=\"https://ptb.de/si\"",
        "<dcc:uniqueIdentifier>sheaf-0123456789abcdef-2026-11-27</dcc:uniqueIdentifier>",
        "<dcc:beginPerformanceDate>2026-11-25</dcc:beginPerformanceDate>",
        "<dcc:endPerformanceDate>2026-11-26</dcc:endPerformanceDate>",
        "<dcc:performanceLocation>laboratory</dcc:performanceLocation>",
        "Labor &amp; Co",
        "A. Person",
        "<dcc:value>INV-7</dcc:value>",
        "<dcc:value>S-4711</dcc:value>",
        "Devices that state no serial number: stage (Vendor &lt;v&gt; M1).",
        "not a certificate of an accredited calibration laboratory",
        "<dcc:traceable>false</dcc:traceable>",
        "simulated (twin)",
    ] {
        assert!(xml.contains(text), "{text} in {xml}");
    }
    assert_eq!(xml.matches("<dcc:mainSigner>").count(), 1);
}

#[test]
fn nothing_is_invented_what_is_not_set_is_named() {
    let parsed: CalibrationDocument = serde_json::from_value(document()).unwrap();
    let refused =
        |issuer: Issuer| calibration_certificate(&parsed, &Certificate { issuer, ..certificate() }).unwrap_err();
    let CertificateError::Missing { entries } = refused(Issuer::default()) else { panic!() };
    assert_eq!(entries.len(), 8);
    let mut issuer = certificate().issuer;
    (issuer.responsible, issuer.customer.city) = (vec![" ".to_owned()], String::new());
    let CertificateError::Missing { entries } = refused(issuer) else { panic!() };
    assert_eq!(entries, ["certificate.customer.city", "certificate.responsible"]);
    let mut issuer = certificate().issuer;
    issuer.customer.country = "Germany".to_owned();
    assert!(
        matches!(refused(issuer), CertificateError::NoCountry { entry, .. } if entry == "certificate.customer.country")
    );
}
