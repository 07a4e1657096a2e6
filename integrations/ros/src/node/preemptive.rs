//! Preemptive ACKNACKs to writers of Fast DDS, so that a reader receives samples as soon as it has matched the
//! writer.
//!
//! A writer of Fast DDS often matches our reader before our reader matches the writer. The samples
//! of this interval are discarded, and later ones are withheld, until the reader receives a
//! HEARTBEAT. Fast DDS sends a HEARTBEAT at once for an ACKNACK with the base 0
//! (`StatefulWriter::process_acknack`). `RustDDS` 0.15.1 sends the base 1, for which Fast DDS waits
//! until its next periodic HEARTBEAT, after 3 s.
//!
//! For each match of a reader and a writer, this module sends an ACKNACK with the base 0. Its count must be greater
//! than that of the ACKNACK that the library has sent, and less than that of its next one, otherwise Fast DDS ignores
//! one of them. Therefore the count is taken from the library:
//!
//! 1. An empty HEARTBEAT on behalf of the writer is sent to our own participant. An `INFO_REPLY`
//!    directs the answer to a socket of this module.
//! 2. The library answers with an ACKNACK and its next count. If the reader has received a
//!    HEARTBEAT of the writer in the meantime, it does not answer, and nothing else is necessary.
//! 3. The base of the ACKNACK is set to 0, and the message is sent to the writer.
//!
//! Both messages are repeated, because they may be lost, and the writer may not have matched our
//! reader yet. Receivers ignore the repetitions by their counts.
//!
//! The built-in writers that announce endpoints have the same defect at the first contact: Fast DDS often sends
//! its HEARTBEAT before the library has matched these writers, and the next one follows after 1 s. They get the same
//! ACKNACK. The library does not expose their address, so that the ACKNACK is sent to the default ports of the
//! first participants of each known host. Other participants ignore it.
//!
//! # References
//! OMG DDSI-RTPS 2.5: 8.3.8.1 (ACKNACK), 8.3.8.6 (HEARTBEAT), 9.4.5 (wire format).

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ros2_client::dds::rustdds::DomainParticipant;
use smol::net::UdpSocket;
use smol::{Task, Timer};

/// Times after the individual attempts for one match, in milliseconds. The last attempt begins after 3.5 s, and the
/// match is removed after 8.5 s. On a busy machine, Fast DDS may match seconds later than the library.
const PAUSES: [u64; 10] = [5, 20, 75, 100, 200, 200, 400, 500, 2000, 5000];

/// Time after the discovery of a participant at which its endpoints are requested unless they are known. During this
/// time, a HEARTBEAT of the writer may arrive by itself. After a request, the library would ignore this HEARTBEAT.
const ENDPOINT_DELAY: Duration = Duration::from_millis(30);

/// Number of participant ids for which the ACKNACK is sent to the default port of a host.
const PARTICIPANTS: u16 = 32;

/// Entity ids of the built-in writer and the built-in reader for announcements of subscriptions (RTPS 2.5, table
/// 9.2).
const SUBSCRIPTIONS: [[u8; 4]; 2] = [[0, 0, 4, 0xC2], [0, 0, 4, 0xC7]];
const PUBLICATIONS: [[u8; 4]; 2] = [[0, 0, 3, 0xC2], [0, 0, 3, 0xC7]];

/// Greatest length of a message that contains an ACKNACK, in bytes.
const MAX_LENGTH: usize = 1500;

type Guid = [u8; 16];
type Prefix = [u8; 12];

/// A reader of our participant and the writer that it has matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Match {
    reader: Guid,
    writer: Guid,
}

#[derive(Debug)]
pub(crate) struct Preemptive {
    /// Receives the ACKNACKs of our own participant.
    socket: UdpSocket,
    sender: UdpSocket,
    /// Address at which our own participant receives discovery messages.
    own_address: SocketAddrV4,
    /// New matches with the ACKNACK to send to the writer, once its count is known.
    matches: Mutex<BTreeMap<Match, Pending>>,
}

#[derive(Debug)]
struct Pending {
    addresses: Vec<SocketAddr>,
    acknack: Option<Vec<u8>>,
}

impl Preemptive {
    /// Opens the sockets. The returned task must be kept as long as ACKNACKs are sent.
    pub(crate) fn open(participant: &DomainParticipant, loopback: bool) -> io::Result<(Arc<Self>, Task<()>)> {
        let bind = |address| smol::block_on(UdpSocket::bind((address, 0)));
        let own_port = discovery_port(participant.domain_id(), participant.participant_id());
        let preemptive = Arc::new(Self {
            socket: bind(Ipv4Addr::LOCALHOST)?,
            sender: bind(if loopback { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED })?,
            own_address: SocketAddrV4::new(Ipv4Addr::LOCALHOST, own_port),
            matches: Mutex::default(),
        });
        let receiver = Arc::clone(&preemptive);
        let task = smol::spawn(async move { receiver.receive().await });
        Ok((preemptive, task))
    }

    /// Makes a writer of Fast DDS send its HEARTBEAT to our reader, which has just matched the writer.
    pub(crate) fn request_heartbeat(
        self: &Arc<Self>,
        participant: &DomainParticipant,
        reader: Guid,
        writer: Guid,
    ) {
        let writers = participant.discovered_writers();
        let data = writers.into_iter().find(|data| data.writer_proxy.remote_writer_guid.to_bytes() == writer);
        let Some(data) = data else { return };
        let locators = data.writer_proxy.unicast_locator_list.into_iter().map(SocketAddr::from);
        // A locator of another kind is converted to an IPv6 address.
        let addresses: Vec<_> = locators.filter(SocketAddr::is_ipv4).collect();
        let matched = Match { reader, writer };
        self.matches().insert(matched, Pending { addresses, acknack: None });
        let preemptive = Arc::clone(self);
        smol::spawn(async move {
            for pause in PAUSES {
                preemptive.advance(matched).await;
                Timer::after(Duration::from_millis(pause)).await;
            }
            preemptive.matches().remove(&matched);
        })
        .detach();
    }

    /// Makes a participant of Fast DDS announce its endpoints, unless they are known after [`ENDPOINT_DELAY`].
    /// `is_known(true)` states whether a reader of the participant is known, `is_known(false)` whether a writer is.
    pub(crate) fn request_endpoints(
        self: &Arc<Self>,
        participant: &DomainParticipant,
        own: Prefix,
        other: Prefix,
        is_known: impl Fn(bool) -> bool + Send + 'static,
    ) {
        let (preemptive, participant) = (Arc::clone(self), participant.clone());
        smol::spawn(async move {
            Timer::after(ENDPOINT_DELAY).await;
            let kinds =
                [(true, SUBSCRIPTIONS), (false, PUBLICATIONS)].map(|(are_readers, [writer, reader])| {
                    (are_readers, Match { reader: guid(own, reader), writer: guid(other, writer) })
                });
            let mut unknown: Vec<(bool, Match)> =
                kinds.into_iter().filter(|(are_readers, _)| !is_known(*are_readers)).collect();
            if unknown.is_empty() {
                return;
            }
            let addresses = discovery_addresses(&participant);
            for (_, matched) in &unknown {
                let pending = Pending { addresses: addresses.clone(), acknack: None };
                preemptive.matches().insert(*matched, pending);
            }
            for pause in PAUSES {
                for (_, matched) in &unknown {
                    preemptive.advance(*matched).await;
                }
                Timer::after(Duration::from_millis(pause)).await;
                unknown.retain(|(are_readers, matched)| {
                    let is_known = is_known(*are_readers);
                    if is_known {
                        preemptive.matches().remove(matched);
                    }
                    !is_known
                });
            }
            for (_, matched) in unknown {
                preemptive.matches().remove(&matched);
            }
        })
        .detach();
    }

    fn matches(&self) -> MutexGuard<'_, BTreeMap<Match, Pending>> {
        self.matches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends the ACKNACK to the writer. If its count is still unknown, sends the HEARTBEAT to our
    /// own participant instead, whose answer contains the count.
    async fn advance(&self, matched: Match) {
        let ready = self.matches().get(&matched).and_then(|pending| {
            pending.acknack.as_ref().map(|acknack| (pending.addresses.clone(), acknack.clone()))
        });
        // If a message cannot be sent, the reader waits for the periodic HEARTBEAT of the writer.
        match ready {
            Some((addresses, acknack)) => {
                for address in addresses {
                    let _ = self.sender.send_to(&acknack, address).await;
                }
            }
            None => {
                if let Ok(SocketAddr::V4(reply_to)) = self.socket.local_addr() {
                    let _ = self.socket.send_to(&empty_heartbeat(matched, reply_to), self.own_address).await;
                }
            }
        }
    }

    async fn receive(&self) {
        let mut buffer = [0; MAX_LENGTH];
        loop {
            let Ok((length, _)) = self.socket.recv_from(&mut buffer).await else {
                // A repeated error must not consume all of the processor time.
                Timer::after(Duration::from_millis(1)).await;
                continue;
            };
            let Some((matched, acknack)) = preemptive_acknack(&buffer[..length]) else { continue };
            if let Some(pending) = self.matches().get_mut(&matched) {
                pending.acknack = Some(acknack);
            } else {
                continue;
            }
            self.advance(matched).await;
        }
    }
}

/// Default port of the unicast discovery traffic of a participant (RTPS 2.5, table 9.8). The port of the user traffic
/// may differ from its default, but this one always corresponds to the participant id.
const fn discovery_port(domain: u16, participant: u16) -> u16 {
    7400 + 250 * domain + 10 + 2 * participant
}

/// Length of the header of a message: `RTPS`, protocol version, vendor, prefix.
const HEADER_LENGTH: usize = 20;

/// Kinds of submessages (RTPS 2.5, table 9.16).
mod kind {
    pub(super) const ACKNACK: u8 = 0x06;
    pub(super) const HEARTBEAT: u8 = 0x07;
    pub(super) const INFO_SRC: u8 = 0x0C;
    pub(super) const INFO_DST: u8 = 0x0E;
    pub(super) const INFO_REPLY: u8 = 0x0F;
}

/// Flag of every submessage: the content is in little endian.
const LITTLE_ENDIAN: u8 = 0x01;

/// Flag of ACKNACK: the writer need not answer with a HEARTBEAT.
const FINAL: u8 = 0x02;

/// Protocol version 2.4 and the vendor of the library.
const VERSION_AND_VENDOR: [u8; 4] = [2, 4, 1, 0x12];

fn guid(prefix: Prefix, entity: [u8; 4]) -> Guid {
    let mut guid = [0; 16];
    guid[..12].copy_from_slice(&prefix);
    guid[12..].copy_from_slice(&entity);
    guid
}

/// Returns the addresses at which the first participants of this host, and of hosts with known endpoints, receive
/// discovery messages by default.
fn discovery_addresses(participant: &DomainParticipant) -> Vec<SocketAddr> {
    let writers = participant.discovered_writers().into_iter();
    let readers = participant.discovered_readers().into_iter();
    let locators = writers
        .flat_map(|data| data.writer_proxy.unicast_locator_list)
        .chain(readers.flat_map(|data| data.reader_proxy.unicast_locator_list));
    // A locator of another kind is converted to an IPv6 address.
    let mut hosts: BTreeSet<IpAddr> =
        locators.map(|locator| SocketAddr::from(locator).ip()).filter(IpAddr::is_ipv4).collect();
    hosts.insert(Ipv4Addr::LOCALHOST.into());
    let port = |index| discovery_port(participant.domain_id(), index);
    hosts
        .into_iter()
        .flat_map(|host| (0..PARTICIPANTS).map(move |index| (host, port(index)).into()))
        .collect()
}

/// Encodes a HEARTBEAT of a writer that has no samples. The answer is to be sent to `reply_to`.
///
/// The sender of the message is our own participant, because the library notes the network
/// interface on which a participant sends. The count is the lowest possible one.
fn empty_heartbeat(Match { reader, writer }: Match, reply_to: SocketAddrV4) -> Vec<u8> {
    let mut message = b"RTPS".to_vec();
    message.extend(VERSION_AND_VENDOR);
    message.extend(&reader[..12]);
    let mut append = |kind: u8, content: &[&[u8]]| {
        let content = content.concat();
        message.extend([kind, LITTLE_ENDIAN]);
        message.extend((content.len() as u16).to_le_bytes());
        message.extend(content);
    };
    append(kind::INFO_SRC, &[&[0; 4], &VERSION_AND_VENDOR, &writer[..12]]);
    // One locator of the kind UDPv4: kind, port, address. The library always reads one more byte after the list, even
    // if the flag for a second list is not set. The zeros at the end provide this byte.
    let port = u32::from(reply_to.port()).to_le_bytes();
    let number_one = 1_u32.to_le_bytes();
    append(kind::INFO_REPLY, &[&number_one, &number_one, &port, &[0; 12], &reply_to.ip().octets(), &[0; 4]]);
    // Readers and writers, first sequence number 1, last one 0, count 1.
    append(kind::HEARTBEAT, &[&reader[12..], &writer[12..], &[0; 4], &number_one, &[0; 8], &number_one]);
    message
}

/// Decodes a message with an ACKNACK of a reader that has received no sample. Returns the match, and the message with
/// the base 0 and without the final flag. Returns `None` for other messages.
fn preemptive_acknack(message: &[u8]) -> Option<(Match, Vec<u8>)> {
    if !message.starts_with(b"RTPS") {
        return None;
    }
    let reader_prefix: Prefix = message.get(8..HEADER_LENGTH)?.try_into().ok()?;
    let mut writer_prefix: Option<Prefix> = None;
    let mut start = HEADER_LENGTH;
    loop {
        let header: [u8; 4] = message.get(start..start + 4)?.try_into().ok()?;
        let [kind, flags, length @ ..] = header;
        if flags & LITTLE_ENDIAN == 0 {
            return None;
        }
        // The length 0 means that the submessage extends to the end. This is not true for PAD and
        // INFO_TS (RTPS 9.4.5.1.3): with the length 0, they are empty. An ACKNACK after such an empty
        // submessage is not recognised.
        let length = match u16::from_le_bytes(length) {
            0 => message.len() - start - 4,
            length => usize::from(length),
        };
        let content_start = start + 4;
        let content = message.get(content_start..content_start + length)?;
        match kind {
            kind::INFO_DST => writer_prefix = Some(content.get(..12)?.try_into().ok()?),
            kind::ACKNACK => {
                // Reader, writer, base, number of missing samples, count. The base is the first
                // sequence number that the reader has not received.
                let ids = content.get(..8)?;
                let is_empty = content.get(8..20)? == [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
                if !is_empty || content.len() != 24 {
                    return None;
                }
                let guid = |prefix: Prefix, entity: &[u8]| [&prefix, entity].concat().try_into().ok();
                let matched = Match {
                    reader: guid(reader_prefix, &ids[..4])?,
                    writer: guid(writer_prefix?, &ids[4..])?,
                };
                let mut acknack = message.to_vec();
                acknack[start + 1] &= !FINAL;
                acknack[content_start + 12] = 0;
                return Some((matched, acknack));
            }
            _ => {}
        }
        start = content_start + length;
    }
}

#[cfg(test)]
mod tests {
    use super::{Guid, Match, discovery_port, empty_heartbeat, preemptive_acknack};

    const OWN: [u8; 12] = [1, 0x12, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
    const OTHER: [u8; 12] = [1, 0x0F, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32];

    fn matched() -> Match {
        let guid = |prefix: [u8; 12], entity: [u8; 4]| -> Guid {
            [&prefix[..], &entity[..]].concat().try_into().expect("16 bytes")
        };
        Match { reader: guid(OWN, [0, 0, 5, 4]), writer: guid(OTHER, [0, 0, 6, 3]) }
    }

    #[test]
    fn the_port_is_that_of_the_specification() {
        assert_eq!(discovery_port(0, 0), 7410);
        assert_eq!(discovery_port(3, 2), 7400 + 750 + 10 + 4);
    }

    #[test]
    fn a_heartbeat_has_the_wire_format_of_rtps() {
        let message = empty_heartbeat(matched(), "127.0.0.1:7411".parse().expect("an address"));
        let expected = [
            &b"RTPS\x02\x04\x01\x12"[..],
            &OWN,
            // INFO_SRC: unused, version, vendor, prefix.
            &[0x0C, 1, 20, 0, 0, 0, 0, 0, 2, 4, 1, 0x12],
            &OTHER,
            // INFO_REPLY: one locator, UDPv4, port 7411, address in the last four of 16 bytes, padding.
            &[0x0F, 1, 32, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0xF3, 0x1C, 0, 0],
            &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0, 0, 1, 0, 0, 0, 0],
            // HEARTBEAT, not final: reader, writer, first 1, last 0, count 1. The more significant
            // half of a sequence number is first.
            &[0x07, 1, 28, 0, 0, 0, 5, 4, 0, 0, 6, 3],
            &[0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }

    /// Message with `INFO_DST` and an ACKNACK as the library sends it.
    fn answer(flags: u8, base: u8, bits: u8, bitmap: &[u8]) -> Vec<u8> {
        [
            &b"RTPS\x02\x04\x01\x12"[..],
            &OWN,
            &[0x0E, 1, 12, 0],
            &OTHER,
            &[0x06, flags, 24 + bitmap.len() as u8, 0, 0, 0, 5, 4, 0, 0, 6, 3],
            &[0, 0, 0, 0, base, 0, 0, 0, bits, 0, 0, 0],
            bitmap,
            &[7, 0, 0, 0],
        ]
        .concat()
    }

    #[test]
    fn the_base_of_an_acknack_becomes_zero() {
        assert_eq!(preemptive_acknack(&answer(3, 1, 0, &[])), Some((matched(), answer(1, 0, 0, &[]))));
    }

    #[test]
    fn other_messages_are_not_sent_on() {
        for (message, name) in [
            (answer(3, 2, 0, &[]), "a reader that has received samples"),
            (answer(3, 1, 1, &[0, 0, 0, 0x80]), "a reader that requests a sample"),
            (answer(2, 1, 0, &[]), "big endian"),
            (answer(3, 1, 0, &[])[..50].to_vec(), "a cut message"),
            (answer(3, 1, 0, &[])[..20].to_vec(), "a header"),
            ([&b"RTPX"[..], &answer(3, 1, 0, &[])[4..]].concat(), "another protocol"),
            ([&answer(3, 1, 0, &[])[..20], &answer(3, 1, 0, &[])[36..]].concat(), "no destination"),
        ] {
            assert_eq!(preemptive_acknack(&message), None, "{name}");
        }
    }
}
