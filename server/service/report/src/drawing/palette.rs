//! One colour per diffraction order, used everywhere, from the palette of Okabe and Ito for colour-blind readers.

/// Orders −2 … 2.
const INNER: [[u8; 3]; 5] =
    [[0x00, 0x72, 0xB2], [0x56, 0xB4, 0xE9], [0x00, 0x9E, 0x73], [0xE6, 0x9F, 0x00], [0xCC, 0x79, 0xA7]];

/// Further orders: (−3, 3), (−4, 4), …
const OUTER: [([u8; 3], [u8; 3]); 2] =
    [([0x7A, 0x5C, 0xC8], [0xD5, 0x5E, 0x00]), ([0x44, 0xAA, 0x99], [0xB5, 0xA6, 0x1E])];

/// The colour of an order.
pub fn order_rgb(order: i8) -> [u8; 3] {
    if (-2..=2).contains(&order) {
        return INNER[(order + 2) as usize];
    }
    let (negative, positive) = OUTER[(order.unsigned_abs() as usize - 3) % OUTER.len()];
    if order < 0 { negative } else { positive }
}

/// The colour of an order in CSS notation.
pub fn order_hex(order: i8) -> String {
    let [red, green, blue] = order_rgb(order);
    format!("#{red:02X}{green:02X}{blue:02X}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_orders_have_nine_colours() {
        let colours: std::collections::BTreeSet<_> = (-4..=4).map(order_rgb).collect();
        assert_eq!(colours.len(), 9);
        assert_eq!(order_hex(-2), "#0072B2");
    }
}
