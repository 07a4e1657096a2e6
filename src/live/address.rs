//! Address at which the web page is served, and the check of the `Host` header.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs as _};

use crate::message::Message;

/// Default port of the web page.
pub const DEFAULT_PORT: u16 = 8420;

/// An address and port at which the server listens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address(pub(super) SocketAddr);

impl Address {
    /// Parses `PORT`, `HOST` or `HOST:PORT`. The default host is the loopback address, which other
    /// machines cannot reach; the default port is [`DEFAULT_PORT`]. An empty text means both defaults. For port 0 the
    /// system chooses a port.
    ///
    /// # Errors
    /// The text has none of these forms, or the host does not exist.
    pub fn read(text: &str) -> Result<Self, Message> {
        if text.is_empty() {
            return Ok(Self((Ipv4Addr::LOCALHOST, DEFAULT_PORT).into()));
        }
        // Some resolvers accept a large number as a host.
        if text.bytes().all(|byte| byte.is_ascii_digit()) {
            let port: u16 = text.parse().map_err(|_| wrong(text, "there is no such port"))?;
            return Ok(Self((Ipv4Addr::LOCALHOST, port).into()));
        }
        if let Ok(host) = text.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>() {
            return Ok(Self((host, DEFAULT_PORT).into()));
        }
        let resolved = match text.rsplit_once(':') {
            Some(_) => text.to_socket_addrs(),
            None => (text, DEFAULT_PORT).to_socket_addrs(),
        };
        match resolved.map(|mut addresses| addresses.next()) {
            Ok(Some(address)) => Ok(Self(address)),
            Ok(None) => Err(wrong(text, "there is no such host")),
            Err(error) => Err(wrong(text, &error.to_string())),
        }
    }

    /// Returns `true` if only this machine can reach the address.
    pub fn is_loopback(self) -> bool {
        self.0.ip().is_loopback()
    }
}

fn wrong(text: &str, why: &str) -> Message {
    Message::error(
        "M332",
        format!("`{text}` is not an address to serve at: {why}; it should be PORT, HOST or HOST:PORT"),
    )
}

/// Returns `true` if a `Host` header names this machine as `localhost` or by a loopback address. This check prevents
/// DNS rebinding: if the name of another site resolves to this machine, the browser sends the name of that site in this
/// header.
pub(super) fn is_local_host(host: &str) -> bool {
    let without_port = |host: &str| host.rsplit_once(':').map_or(host, |(name, _)| name).to_owned();
    let name = match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((inner, _)) => inner.to_owned(),
        None => without_port(host),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::{Address, is_local_host};

    #[test]
    fn addresses_are_ports_hosts_or_both() {
        let check = |text: &str, expected: Option<(&str, bool)>| {
            let address = Address::read(text).ok();
            let address = address.map(|address| (address.0.to_string(), address.is_loopback()));
            assert_eq!(address, expected.map(|(text, own)| (text.to_owned(), own)), "{text}");
        };
        check("", Some(("127.0.0.1:8420", true)));
        check("0", Some(("127.0.0.1:0", true)));
        check("9000", Some(("127.0.0.1:9000", true)));
        check("0.0.0.0", Some(("0.0.0.0:8420", false)));
        check("192.168.0.7:80", Some(("192.168.0.7:80", false)));
        check("[::1]", Some(("[::1]:8420", true)));
        check("::1", Some(("[::1]:8420", true)));
        check("[::1]:9", Some(("[::1]:9", true)));
        check("[::]:9", Some(("[::]:9", false)));
        check("127.0.0.1:65536", None);
        check("127.0.0.1:x", None);
        check("99999", None);
        check("missions/ugv.toml", None);
    }

    #[test]
    fn loopback_hosts_are_recognised() {
        let check = |host: &str, expected: bool| assert_eq!(is_local_host(host), expected, "{host}");
        for host in
            ["localhost", "LocalHost:8420", "127.0.0.1", "127.0.0.1:80", "127.9.9.9", "[::1]", "[::1]:80"]
        {
            check(host, true);
        }
        for host in
            ["", "evil.example", "localhost.evil.example:80", "127.0.0.1.evil.example", "0.0.0.0", "[::]:80"]
        {
            check(host, false);
        }
    }
}
