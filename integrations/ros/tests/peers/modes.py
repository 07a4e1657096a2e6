"""system_modes' mode manager, with the ways in which it can fail; alone, it is a program that can be killed.

Serves `/<function>/change_mode`, `get_mode`, `get_available_modes` and the lifecycle of the nodes below; tells what
it does on `mode_request_info`, `mode_event`, `transition_event` and `/parameter_events`.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import Any

from oracle import FOLLOW, MOTION, PATH, RECHARGE, UNGROUND, Oracle
from ros2 import Later, Node, now
from transport import connect

# function -> mode -> (whether its node is active, spiral_altitude); as in suave_modes.yaml
MODES: dict[str, dict[str, tuple[bool, float | None]]] = {
    PATH: {
        "fd_spiral_high": (True, 3.0),
        "fd_spiral_medium": (True, 2.0),
        "fd_spiral_low": (True, 1.0),
        UNGROUND: (False, None),
    },
    FOLLOW: {"fd_follow_pipeline": (True, None), UNGROUND: (False, None)},
    MOTION: {
        "fd_all_thrusters": (False, None),
        "fd_recover_thrusters": (True, None),
        UNGROUND: (False, None),
    },
    RECHARGE: {"normal": (True, None), "inactive": (False, None), UNGROUND: (False, None)},
}
INACTIVE, ACTIVE = {"id": 2, "label": "inactive"}, {"id": 3, "label": "active"}
ACTIVATE, DEACTIVATE = {"id": 3, "label": "activate"}, {"id": 4, "label": "deactivate"}
DOUBLE = 3
RUBBISH = b"\x00\x01\x00\x00" + bytes(range(250, 256)) * 5  # an answer of 30 octets that no type has


@dataclass
class Faults:
    """The faults that the mode manager simulates."""

    refuses: set[str] = field(default_factory=set)  # modes that are answered with false
    delay: float = 0.0  # s before an answer
    silent: bool = False  # no answer at all
    rubbish: bool = False  # an answer that is not CDR of the type
    skips: set[str] = field(default_factory=set)  # modes that are granted, and not entered


class System:
    """A function with its node."""

    def __init__(self, node: Node, name: str, manager: ModeManager) -> None:
        self.name, self._manager = name, manager
        self.mode, self.active = UNGROUND, False
        prefix, below = f"/{name}", f"/{name}_node"
        service = "system_modes_msgs/srv"
        self.replier = node.serve(f"{prefix}/change_mode", f"{service}/ChangeMode", self._change_mode)
        node.serve(f"{prefix}/get_mode", f"{service}/GetMode", lambda _: {"current_mode": self.mode})
        available = {"available_modes": list(MODES[name])}
        node.serve(f"{prefix}/get_available_modes", f"{service}/GetAvailableModes", lambda _: available)
        node.serve(f"{below}/get_state", "lifecycle_msgs/srv/GetState", lambda _: {"current_state": self._state()})
        node.serve(f"{below}/change_state", "lifecycle_msgs/srv/ChangeState", self._change_state)
        event = "system_modes_msgs/msg/ModeEvent"
        self._requested = node.publisher(f"{prefix}/mode_request_info", event)
        self._entered = node.publisher(f"{prefix}/mode_event", event)
        self._transitions = node.publisher(f"{below}/transition_event", "lifecycle_msgs/msg/TransitionEvent")

    def _state(self) -> dict[str, Any]:
        return ACTIVE if self.active else INACTIVE

    def _change_state(self, request: Any) -> dict[str, Any]:
        activate = request.transition.id == 3 or request.transition.label == "activate"
        self._set_active(activate)
        return {"success": True}

    def _change_mode(self, request: Any) -> dict[str, Any] | bytes | Later | None:
        return self._manager.asked(self.name, request.mode_name)

    def _event(self, goal: str) -> dict[str, Any]:
        return {"timestamp": time.time_ns(), "start_mode": {"label": self.mode}, "goal_mode": {"label": goal}}

    def _set_active(self, active: bool) -> None:
        if active == self.active:
            return
        before, self.active = self._state(), active
        transition = ACTIVATE if active else DEACTIVATE
        stamp = {"timestamp": time.time_ns(), "transition": transition}
        self._transitions.send({**stamp, "start_state": before, "goal_state": self._state()})

    def enter(self, mode: str) -> None:
        """Enters a mode and publishes the same events as system_modes and the node below."""
        active, altitude = MODES[self.name][mode]
        event = self._event(mode)
        self._requested.send(event)
        if altitude is not None:
            self._manager.set_altitude(f"/{self.name}_node", altitude)
        self._set_active(active)
        self._entered.send(event)
        self.mode = mode


class ModeManager:
    """The mode manager of all functions. Reports each request to the oracle."""

    def __init__(self, node: Node, oracle: Oracle, functions: list[str]) -> None:
        self.node, self.oracle, self.faults = node, oracle, Faults()
        self.requests: list[tuple[float, str, str]] = []
        self._under_way = 0
        self._configuration: Any = None
        self._parameters = node.publisher("/parameter_events", "rcl_interfaces/msg/ParameterEvent")
        self.systems = {name: System(node, name, self) for name in functions}

    def current(self, function: str) -> str:
        """Returns the current mode of a function."""
        return self.systems[function].mode

    def ready(self) -> bool:
        """Returns `True` if a client of each function was discovered."""
        return all(system.replier.ready() for system in self.systems.values())

    def serve_configuration(self) -> None:
        """Serves mros2_system_modes_bridge: a function and a design become a node and a mode of the same name."""

        def configure(request: Any) -> dict[str, Any] | bytes | Later | None:
            return self.asked(request.required_function_name, request.required_fd_name)

        name = "/mros/request_configuration"
        self._configuration = self.node.serve(name, "mros2_msgs/srv/MetacontrolFD", configure)

    def configuration_ready(self) -> bool:
        """Returns `True` if a client of the bridge was discovered."""
        return self._configuration is not None and self._configuration.ready()

    def idle(self) -> bool:
        """Returns `True` if no request is pending. Requests without a valid answer are not counted."""
        return self._under_way == 0

    def set_altitude(self, node: str, metres: float) -> None:
        """Publishes on `/parameter_events` the parameter that a mode sets on the node below."""
        value = {"type": DOUBLE, "double_value": metres}
        changed = [{"name": "spiral_altitude", "value": value}]
        self._parameters.send({"stamp": now(), "node": node, "changed_parameters": changed})

    def asked(self, function: str, mode: str) -> dict[str, Any] | bytes | Later | None:
        """Handles a request for a mode from either interface, and returns the answer."""
        self.requests.append((time.time(), function, mode))
        reaction = self.oracle.request(function, mode)
        if self.faults.silent:
            return None
        if self.faults.rubbish:
            return RUBBISH
        known = function in MODES and mode in MODES[function]
        success = known and mode not in self.faults.refuses
        if self.faults.delay:
            # The mode is also entered late; the oracle is notified then.
            self._under_way += 1
            self.node.after(self.faults.delay, lambda: self._done(function, mode, success, reaction))
            return Later(self.faults.delay, {"success": success})
        # The answer is sent before the mode is entered, because the measured time ends with the answer.
        self._under_way += 1
        self.node.after(0.0, lambda: self._done(function, mode, success, reaction))
        return {"success": success}

    def _done(self, function: str, mode: str, success: bool, reaction: Any) -> None:
        self._under_way -= 1
        self.oracle.answered(function, mode, success, reaction)
        if success and mode not in self.faults.skips:
            self.systems[function].enter(mode)

    def switch(self, function: str, mode: str) -> None:
        """Switches a mode without a request, with the same events, as another node would."""
        self.systems[function].enter(mode)
        self.oracle.running[function] = mode


class Remote:
    """A mode manager in its own process."""

    def __init__(self, vendor: str, domain: int, modes: dict[str, str] | None = None) -> None:
        command = [sys.executable, __file__, "--vendor", vendor, "--domain", str(domain)]
        command += ["--modes", json.dumps(modes or {})]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        os.set_blocking(self._process.stdout.fileno(), False)
        self._rest = b""
        self.requests: list[tuple[str, str]] = []

    def poll(self) -> None:
        """Reads the requests since the last call."""
        chunk = self._process.stdout.read(1 << 16) or b""
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        self.requests += [tuple(json.loads(line)) for line in lines if line]

    def kill(self) -> None:
        """Kills the process, so that it does not leave the DDS domain properly."""
        self.poll()
        self._process.kill()
        self._process.wait()

    def leave(self) -> None:
        """Ends the process, so that it leaves the DDS domain properly."""
        self._process.stdin.close()
        self._process.wait(10)
        self.poll()


def main() -> None:
    """Serves until the standard input ends. Prints each request as one line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vendor", default="cyclonedds")
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--modes", type=json.loads, default={}, help="modes at the start, as JSON")
    arguments = parser.parse_args()
    node = Node(connect(arguments.vendor, arguments.domain), "modes")
    manager = ModeManager(node, Oracle(), list(MODES))
    for function, mode in arguments.modes.items():
        manager.systems[function].mode = mode
        manager.systems[function].active = MODES[function][mode][0]
    told = 0
    while not select.select([sys.stdin], [], [], 0)[0]:
        node.spin(0.02)
        for _, function, mode in manager.requests[told:]:
            print(json.dumps([function, mode]), flush=True)
        told = len(manager.requests)
    node.close()


if __name__ == "__main__":
    main()
