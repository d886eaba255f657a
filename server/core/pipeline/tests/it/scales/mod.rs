//! Stations of other sizes: 150 mm to 1 m working distance, 1.3 to 12 megapixels, one to nine orders; rendered,
//! calibrated and scanned, and compared with the truth.
//!
//! Not covered: other noise, blur or speckle than the twin's, and parts other than a ball and a block.

mod outcome;
mod station;

use outcome::Outcome;
use station::Station;

/// Accepted systematic depth error of a calibration, in its own predicted standard deviations.
const MODEL_SIGMAS: f64 = 3.0;
/// The same for the ball's radius; U is two of them. With two, one correct station in twenty would fail: the campaign
/// counts how many lie within U.
const BALL_SIGMAS: f64 = 3.0;
/// Accepted fraction of points with a wrong order.
const MAX_WRONG: f64 = 1e-4;
/// Fraction of the visible line columns that must be found; steep flanks and edges are rejected.
const MIN_COMPLETE: f64 = 0.9;

fn assert_within_uncertainty(station: &Station) {
    let outcome = Outcome::of(station).unwrap();
    eprintln!("{}\n{outcome}", station.name());
    assert!(outcome.model_mm <= MODEL_SIGMAS * outcome.predicted_mm, "{outcome}");
    assert!(outcome.wrong() <= MAX_WRONG, "{outcome}");
    assert!(outcome.complete() >= MIN_COMPLETE, "{outcome}");
    assert!(outcome.ball_error_mm.abs() <= BALL_SIGMAS * outcome.ball_u_mm / 2.0, "{outcome}");
}

#[test]
fn a_station_of_two_orders_at_150_mm_measures_within_uncertainty() {
    assert_within_uncertainty(&Station::seeded(9));
}

#[test]
fn a_station_of_six_orders_along_columns_at_1_m_measures_within_uncertainty() {
    assert_within_uncertainty(&Station::seeded(11));
}

#[test]
#[ignore = "takes minutes; the stations of FIRST_SEED to LAST_SEED"]
fn a_campaign_of_stations_of_all_sizes_measures_within_uncertainty() {
    let number =
        |name: &str, default: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default);
    eprintln!("{}", Outcome::HEADER);
    let mut failed = Vec::new();
    for seed in number("FIRST_SEED", 1)..=number("LAST_SEED", 27) {
        let station = Station::seeded(seed);
        match Outcome::of(&station) {
            Ok(outcome) => eprintln!("{}: {outcome}", station.name()),
            Err(failure) => {
                eprintln!("{}: {failure}", station.name());
                failed.push(seed);
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}
