//! Powers of the orders, from the brightness of two orders at the same point, where the effect of the surface
//! cancels.

use crate::params::watches::POWER_PLACES;
use crate::watches::drift::Estimate;
use crate::watches::fit::{Difference, fit};
use crate::watches::places::OrderSamples;

/// Distribution of the light's power among the orders.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderPowers {
    /// The reference order: the one nearest to 0.
    pub reference_order: i8,
    /// Logarithm of each other order's power over that of `reference_order`, by order.
    pub log_ratios: Vec<(i8, Estimate)>,
    /// Mean logarithm of the power of all orders, ln(grey level · px): surface, laser and exposure together.
    pub log_total: f64,
    /// Number of points used.
    pub n_places: usize,
}

/// The powers of a scan; `None` if two orders observed too little common surface without saturation.
pub fn order_powers(samples_of_orders: &OrderSamples) -> Option<OrderPowers> {
    let orders = samples_of_orders.orders();
    let (reference_order, _) =
        orders.iter().enumerate().min_by_key(|(_, order)| (order.unsigned_abs(), **order))?;
    // Parameters: all orders except the reference.
    let column = |order: usize| (order != reference_order).then(|| order - usize::from(order > reference_order));
    let n = orders.len().checked_sub(1).filter(|n| *n > 0)?;
    let (mut differences, mut totals) = (Vec::new(), Vec::new());
    for place in samples_of_orders.places(POWER_PLACES) {
        let (Some(own), Some(other)) = (place.sample.log_power, place.surface.log_power) else { continue };
        let mut by_parameters = vec![0.0; n];
        column(place.order).into_iter().for_each(|idx| by_parameters[idx] = 1.0);
        column(place.other).into_iter().for_each(|idx| by_parameters[idx] = -1.0);
        differences.push(Difference { by_parameters, value: own - other, cluster: place.cluster });
        totals.push(0.5 * (own + other));
    }
    let observed: Vec<usize> =
        (0..n).filter(|idx| differences.iter().any(|of| of.by_parameters[*idx] != 0.0)).collect();
    let fitted = fit(&differences, &observed, &vec![false; n])?;
    let ratio = |(place, idx): (usize, &usize)| {
        let order = orders[idx + usize::from(*idx >= reference_order)];
        let sigma = fitted.covariance[(place, place)].max(0.0).sqrt();
        (order, Estimate { value: fitted.parameters[place], sigma })
    };
    Some(OrderPowers {
        reference_order: orders[reference_order],
        log_ratios: observed.iter().enumerate().map(ratio).collect(),
        log_total: totals.iter().sum::<f64>() / totals.len() as f64,
        n_places: differences.len(),
    })
}
