//! Which addresses a door may connect to: public ones, and those listed.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::str::FromStr;

use app::doors::BadSetting;

/// IPv4 networks that are not reachable from everywhere, as of the special-purpose address registry of IANA, with
/// multicast and reserved addresses.
const NOT_PUBLIC_V4: [(Ipv4Addr, u8); 16] = [
    (Ipv4Addr::new(0, 0, 0, 0), 8),          // this network
    (Ipv4Addr::new(10, 0, 0, 0), 8),         // private
    (Ipv4Addr::new(100, 64, 0, 0), 10),      // behind a provider's address translation
    (Ipv4Addr::new(127, 0, 0, 0), 8),        // loopback
    (Ipv4Addr::new(169, 254, 0, 0), 16),     // link-local, metadata of cloud machines
    (Ipv4Addr::new(172, 16, 0, 0), 12),      // private
    (Ipv4Addr::new(192, 0, 0, 0), 24),       // protocol assignments
    (Ipv4Addr::new(192, 0, 2, 0), 24),       // documentation
    (Ipv4Addr::new(192, 88, 99, 0), 24),     // 6to4 relays
    (Ipv4Addr::new(192, 168, 0, 0), 16),     // private
    (Ipv4Addr::new(198, 18, 0, 0), 15),      // benchmarks
    (Ipv4Addr::new(198, 51, 100, 0), 24),    // documentation
    (Ipv4Addr::new(203, 0, 113, 0), 24),     // documentation
    (Ipv4Addr::new(224, 0, 0, 0), 4),        // multicast
    (Ipv4Addr::new(240, 0, 0, 0), 4),        // reserved
    (Ipv4Addr::new(255, 255, 255, 255), 32), // broadcast
];

/// IPv6 addresses that can be public at all: global unicast.
const GLOBAL_V6: (Ipv6Addr, u8) = (Ipv6Addr::new(0x2000, 0, 0, 0, 0, 0, 0, 0), 3);

/// Networks within them that are not.
const NOT_PUBLIC_V6: [(Ipv6Addr, u8); 3] = [
    (Ipv6Addr::new(0x2001, 0, 0, 0, 0, 0, 0, 0), 23), // protocol assignments, Teredo
    (Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 0), 32), // documentation
    (Ipv6Addr::new(0x3fff, 0, 0, 0, 0, 0, 0, 0), 20), // documentation
];

/// NAT64: the last 32 bits are an IPv4 address.
const NAT64: (Ipv6Addr, u8) = (Ipv6Addr::new(0x64, 0xff9b, 0, 0, 0, 0, 0, 0), 96);

/// 6to4: the 32 bits after the first 16 are an IPv4 address.
const SIX_TO_FOUR: (Ipv6Addr, u8) = (Ipv6Addr::new(0x2002, 0, 0, 0, 0, 0, 0, 0), 16);

/// Whether an address is reachable from everywhere: not a machine of the own network. Addresses that lead to an IPv4
/// address are as public as that one.
pub fn is_public(ip: IpAddr) -> bool {
    match ip.to_canonical() {
        IpAddr::V4(ip) => !NOT_PUBLIC_V4.iter().any(|&(network, bits)| is_within(ip, network, bits)),
        IpAddr::V6(ip) => is_public_v6(ip),
    }
}

fn is_public_v6(ip: Ipv6Addr) -> bool {
    let within = |(network, bits): (Ipv6Addr, u8)| is_within_v6(ip, network, bits);
    let embedded = |shift: u32| is_public(Ipv4Addr::from_bits((ip.to_bits() >> shift) as u32).into());
    if within(NAT64) {
        embedded(0)
    } else if within(SIX_TO_FOUR) {
        embedded(80)
    } else {
        within(GLOBAL_V6) && !NOT_PUBLIC_V6.into_iter().any(within)
    }
}

fn is_within(ip: Ipv4Addr, network: Ipv4Addr, bits: u8) -> bool {
    // A shift by all bits leaves nothing to compare: everything is within it.
    let differing = (ip.to_bits() ^ network.to_bits()).checked_shr(32 - u32::from(bits));
    differing.unwrap_or(0) == 0
}

fn is_within_v6(ip: Ipv6Addr, network: Ipv6Addr, bits: u8) -> bool {
    let differing = (ip.to_bits() ^ network.to_bits()).checked_shr(128 - u32::from(bits));
    differing.unwrap_or(0) == 0
}

/// The addresses that may be reached although they are not public.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Allowed(Vec<Range>);

impl Allowed {
    /// Single addresses, or ranges such as `10.1.0.0/16`.
    ///
    /// # Errors
    /// One is neither.
    pub fn parse(ranges: &[String]) -> Result<Self, BadSetting> {
        ranges.iter().map(|text| text.parse()).collect::<Result<_, _>>().map(Self)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the address is one of them.
    pub fn contains(&self, ip: IpAddr) -> bool {
        self.0.iter().any(|range| range.contains(ip))
    }
}

/// Addresses with the same first bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Range {
    network: IpAddr,
    bits: u8,
}

impl Range {
    fn contains(&self, ip: IpAddr) -> bool {
        match (ip.to_canonical(), self.network) {
            (IpAddr::V4(ip), IpAddr::V4(network)) => is_within(ip, network, self.bits),
            (IpAddr::V6(ip), IpAddr::V6(network)) => is_within_v6(ip, network, self.bits),
            _ => false,
        }
    }

    fn first(&self) -> IpAddr {
        let (unused_v4, unused_v6) = (32_u32.saturating_sub(self.bits.into()), 128 - u32::from(self.bits));
        match self.network {
            IpAddr::V4(ip) => {
                Ipv4Addr::from_bits(ip.to_bits() & u32::MAX.checked_shl(unused_v4).unwrap_or(0)).into()
            }
            IpAddr::V6(ip) => {
                Ipv6Addr::from_bits(ip.to_bits() & u128::MAX.checked_shl(unused_v6).unwrap_or(0)).into()
            }
        }
    }
}

impl FromStr for Range {
    type Err = BadSetting;

    fn from_str(text: &str) -> Result<Self, BadSetting> {
        let bad = |why: &str| BadSetting { setting: "allowed_private", why: format!("\"{text}\" {why}") };
        let (ip, bits) = text.split_once('/').map_or((text, None), |(ip, bits)| (ip, Some(bits)));
        let network: IpAddr =
            ip.parse().map_err(|_| bad("is no address or range; examples: 10.1.2.3, 10.1.0.0/16, fd00::/8"))?;
        if network.to_canonical() != network {
            return Err(bad("is an IPv4 address in IPv6 form; write it as IPv4"));
        }
        let most = if network.is_ipv4() { 32 } else { 128 };
        let bits = bits.map_or(Some(most), |bits| bits.parse().ok().filter(|bits| *bits <= most));
        let range = Self { network, bits: bits.ok_or_else(|| bad("has no valid number of bits after /"))? };
        match range.first() {
            first if first == network => Ok(range),
            first => Err(bad(&format!("is no range; meant is {first}/{}, or {network}", range.bits))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ip(text: &str) -> IpAddr {
        text.parse().unwrap()
    }

    fn allowed(ranges: &[&str]) -> Result<Allowed, BadSetting> {
        Allowed::parse(&ranges.iter().map(|range| (*range).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn the_ends_of_special_networks_are_not_public_and_their_neighbours_are() {
        let special = [
            ("0.0.0.0", "0.255.255.255"),
            ("10.0.0.0", "10.255.255.255"),
            ("100.64.0.0", "100.127.255.255"),
            ("127.0.0.0", "127.255.255.255"),
            ("169.254.0.0", "169.254.255.255"),
            ("172.16.0.0", "172.31.255.255"),
            ("192.0.0.0", "192.0.0.255"),
            ("192.0.2.0", "192.0.2.255"),
            ("192.88.99.0", "192.88.99.255"),
            ("192.168.0.0", "192.168.255.255"),
            ("198.18.0.0", "198.19.255.255"),
            ("198.51.100.0", "198.51.100.255"),
            ("203.0.113.0", "203.0.113.255"),
            ("224.0.0.0", "255.255.255.255"),
        ];
        let is_public_v4 = |bits: u32| is_public(Ipv4Addr::from_bits(bits).into());
        for (first, last) in special {
            let bits = |text: &str| text.parse::<Ipv4Addr>().unwrap().to_bits();
            assert!(!is_public(ip(first)) && !is_public(ip(last)), "{first} to {last}");
            let before = bits(first).checked_sub(1).is_none_or(is_public_v4);
            let after = bits(last).checked_add(1).is_none_or(is_public_v4);
            assert!(before && after, "{first} to {last}");
        }
    }

    #[test]
    fn ipv6_is_public_only_as_global_unicast() {
        for public in ["2606:4700::1111", "2001:200::", "2001:db7:ffff::", "2001:db9::", "2a00::1", "3ffe::1"] {
            assert!(is_public(ip(public)), "{public}");
        }
        let not_public = [
            "::",
            "::1",
            "::7f00:1",
            "64:ff9b:1::1",
            "100::1",
            "2001::1",
            "2001:1ff:ffff::",
            "2001:db8::1",
            "3fff::1",
            "3fff:fff::1",
            "4000::1",
            "5f00::1",
            "fc00::1",
            "fdff::1",
            "fe80::1",
            "febf::1",
            "fec0::1",
            "ff02::1",
        ];
        for address in not_public {
            assert!(!is_public(ip(address)), "{address}");
        }
    }

    #[test]
    fn addresses_that_lead_to_ipv4_are_as_public_as_that() {
        let forms: [fn(Ipv4Addr) -> String; 3] = [
            |ip| format!("::ffff:{ip}"),
            |ip| format!("64:ff9b::{ip}"),
            |ip| format!("2002:{:x}:{:x}::1", ip.to_bits() >> 16, ip.to_bits() & 0xffff),
        ];
        for (v4, expected) in
            [("8.8.8.8", true), ("10.0.0.1", false), ("127.0.0.1", false), ("169.254.1.1", false)]
        {
            for form in forms {
                let v6 = form(v4.parse().unwrap());
                assert_eq!(is_public(ip(&v6)), expected, "{v6}");
            }
        }
    }

    #[test]
    fn ranges_contain_exactly_their_addresses() {
        let some = allowed(&["10.1.0.0/16", "127.0.0.1", "fd00::/8"]).unwrap();
        for inside in ["10.1.0.0", "10.1.255.255", "::ffff:10.1.2.3", "127.0.0.1", "fd12::1"] {
            assert!(some.contains(ip(inside)), "{inside}");
        }
        for outside in ["10.0.255.255", "10.2.0.0", "127.0.0.2", "fc00::1", "fe00::1", "::1", "::10.1.2.3"] {
            assert!(!some.contains(ip(outside)), "{outside}");
        }
        let all = allowed(&["0.0.0.0/0"]).unwrap();
        assert!(all.contains(ip("255.1.2.3")) && !all.contains(ip("fd00::1")));
        assert!(allowed(&["::/0"]).unwrap().contains(ip("ffff::1")));
        assert!(!allowed(&[]).unwrap().contains(ip("10.1.2.3")));
    }

    #[test]
    fn what_is_no_range_is_refused() {
        let not_ranges = [
            "",
            "mes",
            "10.1.0.0/",
            "10.1.0.0/33",
            "10.1.0.0/-1",
            "10.1/16",
            "010.1.0.0/16",
            "10.1.2.3/16",
            "fd00::/129",
            "fd00::1/8",
            "::ffff:10.1.0.0/112",
            " 10.1.0.0/16",
        ];
        for text in not_ranges {
            assert_eq!(allowed(&[text]).unwrap_err().setting, "allowed_private", "{text}");
        }
        assert!(allowed(&["10.1.2.3/16"]).unwrap_err().why.contains("10.1.0.0/16"));
    }
}
