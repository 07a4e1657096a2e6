"""Eclipse Cyclone DDS in the conventions of rmw_cyclonedds.

Requests and replies carry the client's half GUID and a sequence number in front of the body. The library is told that
each type begins with an octet and no more: it checks samples against their type on both sides and hands on what
follows as it is, so that a peer sees, and can send, what no serialiser would make.
"""

from __future__ import annotations

import os
import random
import struct
import time
from typing import Any

# Loopback only, independently of the machine's network.
os.environ.setdefault(
    "CYCLONEDDS_URI",
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "<AllowMulticast>true</AllowMulticast></General></Domain></CycloneDDS>",
)

from cyclonedds.core import InstanceState, Policy, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.core import Qos as DdsQos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from transport import VOLATILE, OnKeyed, OnSample, Qos, service_names

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_HEADER = struct.Struct("<Qq")
_TYPES: dict[str, Any] = {}


def _raw_type(type_name: str) -> Any:
    """Returns a DDS type with this name whose samples are octets."""
    if type_name not in _TYPES:
        raw = make_idl_struct("Raw", type_name, {"first": types.uint8})

        def serialize(self: Any, *_: Any, **__: Any) -> bytes:
            return bytes(self.octets)

        def deserialize(cls: Any, data: bytes, **_: Any) -> Any:
            return with_octets(bytes(data))

        def with_octets(octets: bytes) -> Any:
            sample = raw(first=0)
            sample.octets = octets
            return sample

        raw.serialize = serialize
        raw.deserialize = raw.deserialize_key = classmethod(deserialize)
        raw.with_octets = staticmethod(with_octets)
        _TYPES[type_name] = raw
    return _TYPES[type_name]


def _qos(qos: Qos) -> DdsQos:
    durability = Policy.Durability.TransientLocal if qos.transient_local else Policy.Durability.Volatile
    return DdsQos(
        Policy.Reliability.Reliable(duration(milliseconds=100)), durability, Policy.History.KeepLast(qos.depth)
    )


class _Writer:
    def __init__(self, participant: DomainParticipant, topic: str, type_name: str, qos: Qos) -> None:
        self._raw = _raw_type(type_name)
        self._writer = DataWriter(participant, Topic(participant, topic, self._raw), qos=_qos(qos))

    def write(self, octets: bytes) -> None:
        self._writer.write(self._raw.with_octets(octets))

    def matched(self) -> int:
        return len(self._writer.get_matched_subscriptions())


class _Reader:
    def __init__(
        self, participant: DomainParticipant, topic: str, type_name: str, qos: Qos, on_sample: OnSample
    ) -> None:
        self.reader = DataReader(participant, Topic(participant, topic, _raw_type(type_name)), qos=_qos(qos))
        self.condition = ReadCondition(self.reader, _ANY)
        self.on_sample = on_sample

    def matched(self) -> int:
        return len(self.reader.get_matched_publications())

    def drain(self) -> None:
        for sample in self.reader.take(64):
            if hasattr(sample, "octets"):  # not the mere news that a writer has gone
                self.on_sample(sample.octets)


def _split(octets: bytes) -> tuple[tuple[int, int], bytes]:
    """Splits a request or reply into its header, and its body with an encapsulation header."""
    return _HEADER.unpack_from(octets, 4), octets[:4] + octets[4 + _HEADER.size :]


def _join(key: tuple[int, int], octets: bytes) -> bytes:
    return octets[:4] + _HEADER.pack(*key) + octets[4:]


class _Requester:
    def __init__(self, owner: Cyclone, service: str, type_name: str, on_reply: OnKeyed) -> None:
        self._guid, self._sequence = random.getrandbits(64), 0
        requests, replies = service_names(service, type_name)
        self._reader = owner.reader(*replies, VOLATILE, self._take)
        self._writer = owner.writer(*requests, VOLATILE)
        self._on_reply = on_reply

    def _take(self, octets: bytes) -> None:
        if len(octets) < 4 + _HEADER.size:
            return
        (guid, sequence), body = _split(octets)
        if guid == self._guid:
            self._on_reply(sequence, body)

    def request(self, octets: bytes) -> int:
        self._sequence += 1
        self._writer.write(_join((self._guid, self._sequence), octets))
        return self._sequence

    def ready(self) -> bool:
        return self._writer.matched() > 0 and self._reader.matched() > 0


class _Replier:
    def __init__(self, owner: Cyclone, service: str, type_name: str, on_request: OnKeyed) -> None:
        requests, replies = service_names(service, type_name)
        self._writer = owner.writer(*replies, VOLATILE)
        self._reader = owner.reader(*requests, VOLATILE, self._take)
        self._on_request = on_request

    def _take(self, octets: bytes) -> None:
        if len(octets) >= 4 + _HEADER.size:
            self._on_request(*_split(octets))

    def reply(self, key: tuple[int, int], octets: bytes) -> None:
        self._writer.write(_join(key, octets))

    def ready(self) -> bool:
        return self._writer.matched() > 0 and self._reader.matched() > 0


class Cyclone:
    """A participant of Cyclone DDS."""

    def __init__(self, domain: int) -> None:
        self._participant = DomainParticipant(domain)
        self._waitset = WaitSet(self._participant)
        self._readers: list[_Reader] = []
        self._writers: list[_Writer] = []

    def writer(self, topic: str, type_name: str, qos: Qos) -> _Writer:
        self._writers.append(_Writer(self._participant, topic, type_name, qos))
        return self._writers[-1]

    def reader(self, topic: str, type_name: str, qos: Qos, on_sample: OnSample) -> _Reader:
        reader = _Reader(self._participant, topic, type_name, qos, on_sample)
        self._waitset.attach(reader.condition)
        self._readers.append(reader)
        return reader

    def requester(self, service: str, type_name: str, on_reply: OnKeyed) -> _Requester:
        return _Requester(self, service, type_name, on_reply)

    def replier(self, service: str, type_name: str, on_request: OnKeyed) -> _Replier:
        return _Replier(self, service, type_name, on_request)

    def poll(self, timeout: float) -> None:
        if not self._readers:
            time.sleep(timeout)
            return
        self._waitset.wait(max(int(timeout * 1e9), 1))
        for reader in list(self._readers):
            reader.drain()

    def close(self) -> None:
        self._readers, self._writers = [], []
        self._waitset.__del__()
        self._participant.__del__()  # deletes what it contains, too, and takes leave of the others

    def gid(self) -> bytes:
        return self._participant.guid.bytes
