//! Announcement to Fast DDS that our participant leaves.
//!
//! `RustDDS` 0.15.1 announces the departure with the key of the participant as payload. Fast DDS up
//! to 3.2 ignores such a payload (`MessageReceiver::proc_Submsg_Data`), so that the services and
//! topics of an ended program remain until its lease expires. This announcement has the key in the
//! inline `QoS`, as that of Fast DDS itself.
//!
//! # References
//! OMG DDSI-RTPS 2.5: 8.5.3 (participant discovery), 9.4.5.4 (DATA), 9.6.4.8 (`KEY_HASH`), 9.6.4.9
//! (`STATUS_INFO`).

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

use ros2_client::dds::rustdds::{DomainParticipant, RTPSEntity as _};

use crate::node::rmw::Vendor;

/// Sends the announcement to the participants of Fast DDS that have known endpoints. Messages that cannot be sent are
/// lost.
pub(super) fn announce(participant: &DomainParticipant, loopback: bool) {
    let bind = if loopback { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
    let Ok(socket) = UdpSocket::bind((bind, 0)) else { return };
    let message = departure(participant.guid().to_bytes());
    for address in discovery_addresses(participant) {
        let _ = socket.send_to(&message, address);
    }
}

/// Returns the addresses at which the participants of Fast DDS receive discovery messages.
///
/// The library does not expose these addresses, but those of the endpoints. With the default ports,
/// the discovery port is the one before that of the endpoints (RTPS 2.5, table 9.8).
fn discovery_addresses(participant: &DomainParticipant) -> BTreeSet<SocketAddr> {
    let writers = participant.discovered_writers().into_iter().map(|data| {
        let guid = data.writer_proxy.remote_writer_guid.to_bytes();
        (guid, data.writer_proxy.unicast_locator_list)
    });
    let readers = participant.discovered_readers().into_iter().map(|data| {
        let guid = data.reader_proxy.remote_reader_guid.to_bytes();
        (guid, data.reader_proxy.unicast_locator_list)
    });
    let fast_dds =
        writers.chain(readers).filter(|(guid, _)| Vendor::new([guid[0], guid[1]]) == Vendor::FastDds);
    // A locator of another kind is converted to an IPv6 address.
    let addresses =
        fast_dds.flat_map(|(_, locators)| locators).map(SocketAddr::from).filter(SocketAddr::is_ipv4);
    addresses.map(|address| SocketAddr::new(address.ip(), address.port().saturating_sub(1))).collect()
}

/// Encodes the departure of the participant with this GUID.
///
/// The sequence number is greater than that of every announcement of the library, because Fast DDS ignores numbers
/// that are lower than the last one.
fn departure(guid: [u8; 16]) -> Vec<u8> {
    [
        // Header: protocol version 2.4, vendor of the library, prefix.
        &b"RTPS\x02\x04\x01\x12"[..],
        &guid[..12],
        // DATA in little endian with inline `QoS` and without payload: length, offset of the parameters.
        &[0x15, 0x03, 52, 0, 0, 0, 16, 0],
        // Reader and writer of participants, sequence number.
        &[0, 1, 0, 0xC7, 0, 1, 0, 0xC2, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0x7F],
        // KEY_HASH: the GUID.
        &[0x70, 0, 16, 0],
        &guid,
        // STATUS_INFO: disposed and unregistered; end of the list.
        &[0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0],
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::departure;

    #[test]
    fn lengths_agree_with_the_content() {
        let guid = *b"\x01\x12abcdefghij\0\0\x01\xC1";
        let message = departure(guid);
        let submessage = &message[20..];
        assert_eq!(usize::from(submessage[2]), submessage.len() - 4);
        // The offset counts from its own end to the first parameter.
        let parameters = &submessage[8 + usize::from(submessage[6])..];
        assert_eq!(parameters[..4], [0x70, 0, 16, 0]);
        assert_eq!(parameters[4..20], guid);
        assert_eq!(parameters[20..], [0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0]);
    }
}
