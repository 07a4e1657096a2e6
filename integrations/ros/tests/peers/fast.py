"""eProsima Fast DDS in the conventions of rmw_fastrtps, through the bridge in `fastdds/`."""

from __future__ import annotations

import itertools
import os
import select
import subprocess
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from transport import VOLATILE, OnKeyed, OnSample, Qos, service_names

BRIDGE = Path(__file__).resolve().parents[4] / "target" / "ros" / "bridge"


def bridge_program() -> Path:
    """Returns the path of the built bridge. `METAPLAN_FASTDDS_BRIDGE` overrides it."""
    return Path(os.environ.get("METAPLAN_FASTDDS_BRIDGE", BRIDGE))


class _Endpoint:
    def __init__(self, owner: Fast) -> None:
        self._owner, self.id = owner, owner.next_id()
        owner.endpoints[self.id] = self
        self.count = 0
        self.take: Callable[[list[str]], None] = lambda _: None

    def matched(self) -> int:
        return self.count

    def write(self, octets: bytes) -> None:
        self._owner.tell(f"w {self.id} {octets.hex()}")


class _Requester:
    def __init__(self, owner: Fast, service: str, type_name: str, on_reply: OnKeyed) -> None:
        requests, replies = service_names(service, type_name)
        self._owner, self._on_reply = owner, on_reply
        self._reader = owner.open("R", *replies, VOLATILE, " 1")
        self._writer = owner.open("W", *requests, VOLATILE)
        self._reader.take = self._take
        self._mine: set[str] = set()

    def _take(self, words: list[str]) -> None:
        guid, number = words[0].split(":")
        # rmw_fastrtps accepts replies to its reader and, from older servers, to its writer.
        if guid in self._mine:
            self._on_reply(int(number), bytes.fromhex(words[1]))

    def request(self, octets: bytes) -> int:
        token = self._owner.next_id()
        self._owner.tell(f"q {self._writer.id} {self._reader.id} {token} {octets.hex()}")
        reader, writer, number = self._owner.wait_sent(token)
        self._mine = {reader, writer}
        return int(number)

    def ready(self) -> bool:
        return self._reader.count > 0 and self._writer.count > 0


class _Replier:
    def __init__(self, owner: Fast, service: str, type_name: str, on_request: OnKeyed) -> None:
        requests, replies = service_names(service, type_name)
        self._owner = owner
        self._writer = owner.open("W", *replies, VOLATILE)
        self._reader = owner.open("R", *requests, VOLATILE)
        self._reader.take = lambda words: on_request(words[1], bytes.fromhex(words[0]))

    def reply(self, key: str, octets: bytes) -> None:
        self._owner.tell(f"r {self._writer.id} {key} {octets.hex()}")

    def ready(self) -> bool:
        return self._reader.count > 0 and self._writer.count > 0


class Fast:
    """A participant of Fast DDS in its own process."""

    def __init__(self, domain: int) -> None:
        command = [str(bridge_program()), str(domain)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        os.set_blocking(self._process.stdout.fileno(), False)
        self._rest, self._lines = b"", deque()  # type: bytes, deque[str]
        self._ids = itertools.count()
        self.endpoints: dict[str, _Endpoint] = {}
        self._guid = self._wait(lambda line: line.startswith("g ")).split()[1]

    def next_id(self) -> str:
        return str(next(self._ids))

    def tell(self, line: str) -> None:
        self._process.stdin.write(line.encode() + b"\n")

    def open(self, verb: str, topic: str, type_name: str, qos: Qos, more: str = "") -> _Endpoint:
        endpoint = _Endpoint(self)
        self.tell(f"{verb} {endpoint.id} {topic} {type_name} {qos.depth} {int(qos.transient_local)}{more}")
        return endpoint

    def writer(self, topic: str, type_name: str, qos: Qos) -> _Endpoint:
        return self.open("W", topic, type_name, qos)

    def reader(self, topic: str, type_name: str, qos: Qos, on_sample: OnSample) -> _Endpoint:
        endpoint = self.open("R", topic, type_name, qos)
        endpoint.take = lambda words: on_sample(bytes.fromhex(words[0]))
        return endpoint

    def requester(self, service: str, type_name: str, on_reply: OnKeyed) -> _Requester:
        return _Requester(self, service, type_name, on_reply)

    def replier(self, service: str, type_name: str, on_request: OnKeyed) -> _Replier:
        return _Replier(self, service, type_name, on_request)

    def _read(self, timeout: float) -> None:
        ready, _, _ = select.select([self._process.stdout], [], [], timeout)
        if not ready:
            return
        chunk = self._process.stdout.read(1 << 20)
        if not chunk:
            raise RuntimeError(f"the Fast DDS bridge ended with {self._process.wait()}")
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        self._lines.extend(line.decode() for line in lines)

    def _wait(self, wanted: Callable[[str], bool], timeout: float = 10.0) -> str:
        """Returns the first line for which `wanted` is true. The other lines wait for the next `poll`."""
        end, seen = time.monotonic() + timeout, 0
        while time.monotonic() < end:
            for position in range(seen, len(self._lines)):
                if wanted(self._lines[position]):
                    line = self._lines[position]
                    del self._lines[position]
                    return line
            seen = len(self._lines)
            self._read(0.1)
        raise TimeoutError("the Fast DDS bridge does not answer")

    def wait_sent(self, token: str) -> list[str]:
        """Returns the GUIDs of the reader and the writer, and the sequence number, of a request."""
        return self._wait(lambda line: line.startswith(f"S {token} ")).split()[2:]

    def poll(self, timeout: float) -> None:
        self._read(0 if self._lines else timeout)
        while self._lines:
            verb, name, *words = self._lines.popleft().split()
            if verb == "m":
                self.endpoints[name].count = int(words[0])
            elif verb in ("d", "a"):
                self.endpoints[name].take(words)

    def close(self) -> None:
        self._process.stdin.close()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            self._process.kill()

    def gid(self) -> bytes:
        return bytes.fromhex(self._guid)


def available() -> str:
    """Returns the reason why Fast DDS is not available, or an empty string if it is available."""
    program = bridge_program()
    return "" if program.exists() else f"{program.name} is not built"


__all__: list[Any] = ["Fast", "available", "bridge_program"]
