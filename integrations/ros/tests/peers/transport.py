"""The interface of a DDS library for a peer: CDR octets in both directions, and the identification of requests.

Octets always include the encapsulation header. `key` identifies a request; its content is private to the transport.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from codec import dds_name


@dataclass(frozen=True)
class Qos:
    """The parts of ROS's QoS profiles that the peers use: reliable, keep last `depth`."""

    depth: int = 10
    transient_local: bool = False


VOLATILE = Qos()
LATCHED = Qos(1, transient_local=True)
OnSample = Callable[[bytes], None]
OnKeyed = Callable[[Any, bytes], None]


class Writer(Protocol):
    """Sends octets on one topic."""

    def write(self, octets: bytes) -> None: ...

    def matched(self) -> int:
        """Returns the number of discovered readers."""


class Requester(Protocol):
    """The client side of a service."""

    def request(self, octets: bytes) -> Any:
        """Sends a request and returns its key."""

    def ready(self) -> bool:
        """Returns `True` if a server was discovered in both directions."""


class Replier(Protocol):
    """The server side of a service."""

    def reply(self, key: Any, octets: bytes) -> None: ...

    def ready(self) -> bool:
        """Returns `True` if a client was discovered in both directions."""


class Transport(Protocol):
    """A participant of a DDS domain."""

    def writer(self, topic: str, type_name: str, qos: Qos) -> Writer: ...

    def reader(self, topic: str, type_name: str, qos: Qos, on_sample: OnSample) -> Any: ...

    def requester(self, service: str, type_name: str, on_reply: OnKeyed) -> Requester: ...

    def replier(self, service: str, type_name: str, on_request: OnKeyed) -> Replier: ...

    def poll(self, timeout: float) -> None:
        """Waits at most `timeout` seconds for data, and passes it to the callbacks."""

    def close(self) -> None:
        """Leaves the domain and announces this."""

    def gid(self) -> bytes:
        """Returns sixteen octets that identify the participant."""


def service_names(service: str, type_name: str) -> tuple[tuple[str, str], tuple[str, str]]:
    """Returns topic and DDS type of the requests, and of the replies, of `/service`."""
    name = service.lstrip("/")
    return (
        (f"rq/{name}Request", dds_name(f"{type_name}_Request")),
        (f"rr/{name}Reply", dds_name(f"{type_name}_Response")),
    )


def connect(vendor: str, domain: int) -> Transport:
    """Returns a participant of the vendor `cyclonedds` or `fastrtps`."""
    if vendor == "cyclonedds":
        from cyclone import Cyclone

        return Cyclone(domain)
    from fast import Fast

    return Fast(domain)
