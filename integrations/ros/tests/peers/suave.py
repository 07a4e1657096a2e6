"""Simulated SUAVE: the mission node, system_modes' mode manager, the monitors and, for a reasoner, MROS's bridges.

Plays a stream of stimuli at full speed: the next one is sent when the robot has settled after the last one. In the role
`manager` the system under test serves `/task/request` and calls `/<function>/change_mode`; in the role `reasoner` it
serves `/mros/objective` and calls `/mros/request_configuration`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from modes import MODES, ModeManager
from oracle import FOLLOW, INSPECT, MOTION, PATH, SEARCH, Oracle
from ros2 import ActionClient, Client, Goal, Node, Publisher, now
from streams import Stimulus, Stream
from transport import connect

OK, WARN, ERROR = 0, 1, 2
TASK_TIMEOUT = 5.0  # s, of SUAVE's mission node
REACTION_LIMIT = 2.0  # s, after which a stimulus counts as missed
HEARTBEAT = 3.2  # s, a little more than Fast DDS waits before it repeats a heartbeat
QUIET = 0.004  # s without a request after which the robot has settled
FOUND_AT = 200.0  # s of the stream, when the pipeline is detected; the rest of the stream is inspection
RECOVERY = 5.0  # s of the stream that the recovery of the thrusters takes
FUNCTIONS = {SEARCH: (MOTION, PATH), INSPECT: (MOTION, FOLLOW)}


class Monitors:
    """Publishes as SUAVE's water visibility observer, battery monitor and thruster monitor on `/diagnostics`."""

    def __init__(self, node: Node) -> None:
        self.topic = node.publisher("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        # The serialiser is compiled at its first use, which must not be part of a reaction time.
        self._send([], now())
        self._send([self._status(OK, "warm", "up", [("a", "b")])], now())

    @staticmethod
    def _status(level: int, name: str, message: str, values: list[tuple[str, str]]) -> dict[str, Any]:
        pairs = [{"key": key, "value": value} for key, value in values]
        return {"level": level, "name": name, "message": message, "hardware_id": "", "values": pairs}

    def _send(self, status: list[dict[str, Any]], stamp: dict[str, int]) -> None:
        self.topic.send({"header": {"stamp": stamp, "frame_id": ""}, "status": status})

    def nothing(self) -> None:
        """Publishes a message without a status."""
        self._send([], now())

    def visibility(self, metres: float, stamp: dict[str, int]) -> None:
        """Publishes the water visibility as water_visibility_observer does."""
        name = "water_visibility_observer: Water visibility measurement"
        self._send([self._status(OK, name, "QA status", [("water_visibility", str(metres))])], stamp)

    def battery(self, share: float, stamp: dict[str, int]) -> None:
        """Publishes the battery level as battery_monitor does."""
        name = "battery_monitor: Battery level"
        self._send([self._status(OK, name, "QA status", [("battery_level", str(share))])], stamp)

    def thruster(self, number: int, works: bool, stamp: dict[str, int]) -> None:
        """Publishes a thruster's state like thruster_monitor: Metacontrol's and PLANTA's words have the same key."""
        level, words = (OK, ("RECOVERED", "OK")) if works else (ERROR, ("FALSE", "ERROR"))
        values = [(f"c_thruster_{number}", word) for word in words]
        self._send([self._status(level, "thruster_monitor: Thruster status", "Component status", values)], stamp)


def seconds(stamp: dict[str, int]) -> float:
    """Converts a stamp to seconds since the epoch."""
    return stamp["sec"] + stamp["nanosec"] / 1e9


def streams_end(stream: Stream) -> float:
    """Returns the second after the last stimulus."""
    return stream.stimuli[-1].second + 1


@dataclass
class Options:
    """The options for playing a robot."""

    role: str = "manager"
    vendor: str = "cyclonedds"
    domain: int = 0
    found_at: float = FOUND_AT
    reaction_limit: float = REACTION_LIMIT
    own_modes: bool = True  # whether the mode manager is played here, and not in a process of its own


@dataclass
class Objectives:
    """Simulates MROS's task bridge: one ControlQos goal for each function of the task."""

    client: ActionClient
    goals: dict[str, Goal] = field(default_factory=dict)
    count: int = 0

    def send(self, function: str) -> Goal:
        """Requests a function, as SUAVE's task_bridge_metacontrol does."""
        self.count += 1
        wanted = {
            "objective_id": f"obj_{function}_{self.count}",
            "objective_type": function,
            "always_improve": function == PATH,
        }
        self.goals[function] = self.client.send({"qos_expected": wanted})
        return self.goals[function]


class Robot:
    """The simulated robot with its oracle."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self.oracle = Oracle()
        self.node = Node(connect(options.vendor, options.domain), "mission_node")
        self.modes = ModeManager(self.node, self.oracle, list(MODES) if options.own_modes else [])
        self.monitors = Monitors(self.node)
        self.detected = self._bool("/pipeline/detected")
        self.inspected = self._bool("/pipeline/inspected")
        self.recharged = self._bool("/battery_monitor/recharge/complete")
        self.state = self.node.publisher("/mavros/state", "mavros_msgs/msg/State")
        self.events: list[str] = []
        self.node.subscribe("/metaplan/events", "std_msgs/msg/String", lambda m: self.events.append(m.data))
        self.task_request: Client | None = None
        self.objectives: Objectives | None = None
        if options.role == "manager":
            self.task_request = self.node.client("/task/request", "suave_msgs/srv/Task")
            self.task_cancel = self.node.client("/task/cancel", "suave_msgs/srv/Task")
        else:
            self.objectives = Objectives(ActionClient(self.node, "/mros/objective", "mros2_msgs/action/ControlQos"))
            self.modes.serve_configuration()

    def _bool(self, name: str) -> Publisher:
        return self.node.publisher(name, "std_msgs/msg/Bool")

    def wait(self, timeout: float = 20.0) -> bool:
        """Returns `True` if the system under test was discovered before the timeout."""

        def there() -> bool:
            if self.objectives is not None:
                asked = self.objectives.client.ready() and self.modes.configuration_ready()
            else:
                asked = self.task_request.ready() and self.task_cancel.ready() and self.modes.ready()
            return asked and self.monitors.topic.matched() > 0

        found = self.node.spin_until(there, timeout)
        if self.options.vendor == "fastrtps":
            # A reader of RustDDS delivers nothing until it knows the first sequence number of the writer. If it was
            # discovered too late for the first heartbeat of Fast DDS, the next heartbeat follows a sample; earlier
            # samples are then delivered late, in order. So a message without effect is sent first, and its heartbeat is
            # awaited.
            self.monitors.nothing()
            self.node.spin(HEARTBEAT)
        return found

    def show(self, metres: float) -> None:
        """Publishes a measured water visibility that the oracle does not judge."""
        self.oracle.world.visibility = metres
        self.monitors.visibility(metres, now())

    def guided(self) -> None:
        """Publishes the autopilot mode GUIDED, which starts the mission."""
        header = {"stamp": now(), "frame_id": ""}
        fields = {"connected": True, "armed": True, "guided": True, "mode": "GUIDED", "system_status": 4}
        self.state.send({"header": header, **fields})

    def settle(self) -> bool:
        """Spins until all due switches are requested and answered, and then a short time longer."""
        done = self.node.spin_until(
            lambda: not self.oracle.awaited() and self.modes.idle(), self.options.reaction_limit
        )
        if not done:
            self.oracle.give_up()
        self.node.spin(QUIET)
        return done

    def request(self, task: str) -> bool:
        """Requests a task as the mission node. Returns `True` if it was granted in time."""
        self.oracle.world.task = task
        self.oracle.stimulus(f"request of {task}", time.time())
        if self.objectives is not None:
            goals = [self.objectives.send(function) for function in FUNCTIONS[task]]
            granted = all([self.objectives.client.wait_accepted(goal, TASK_TIMEOUT) for goal in goals])
        else:
            call = self.task_request.call({"task_name": task})
            self.node.spin_until(lambda: call.done, TASK_TIMEOUT)
            granted = call.value is not None and bool(call.value.success)
        self.settle()
        return granted

    def cancel(self, task: str) -> bool:
        """Ends a task as the mission node. Returns `True` if this was confirmed in time."""
        self.oracle.world.task = None
        self.oracle.stimulus(f"cancellation of {task}", time.time())
        if self.objectives is not None:
            confirmed = all([self._cancel_goal(function) for function in FUNCTIONS[task]])
        else:
            call = self.task_cancel.call({"task_name": task})
            self.node.spin_until(lambda: call.done, TASK_TIMEOUT)
            confirmed = call.value is not None and bool(call.value.success)
        self.settle()
        return confirmed

    def _cancel_goal(self, function: str) -> bool:
        goal = self.objectives.goals.pop(function)
        call = self.objectives.client.cancel(goal)
        self.node.spin_until(lambda: call.done, TASK_TIMEOUT)
        if call.value is None or call.value.return_code != 0 or not len(call.value.goals_canceling):
            return False
        return self.objectives.client.wait_result(goal, TASK_TIMEOUT) and goal.status == 5

    def play(self, stimulus: Stimulus) -> bool:
        """Sends one stimulus. Returns `True` if the robot settled."""
        world = self.oracle.world
        if stimulus.kind == "visibility":
            world.visibility = stimulus.value
        elif stimulus.kind == "battery":
            world.battery = stimulus.value
        elif stimulus.kind == "failure":
            world.failed.add(int(stimulus.value))
        else:
            world.failed.discard(int(stimulus.value))
        # The calculation of the right modes is not part of the reaction, so the stamp is taken after it.
        stamp = now()
        self.oracle.stimulus(
            f"{stimulus.kind} {stimulus.value:g} at {stimulus.second:g} s", seconds(stamp), diagnostic=True
        )
        if stimulus.kind == "visibility":
            self.monitors.visibility(stimulus.value, stamp)
        elif stimulus.kind == "battery":
            self.monitors.battery(stimulus.value, stamp)
        else:
            self.monitors.thruster(int(stimulus.value), stimulus.kind == "recovered", stamp)
        return self.settle()

    def recover(self, second: float) -> None:
        """Ends the recovery: the thrusters report it, one after the other."""
        for thruster in sorted(self.oracle.world.failed):
            self.play(Stimulus(second, "recovered", thruster))

    def done(self, what: str) -> None:
        """Ends the task: its functions may be ungrounded from here on, and must be when it is cancelled."""
        self.oracle.world.task = None
        self.oracle.stimulus(what, time.time())

    def mission(self, stream: Stream) -> dict[str, Any]:
        """Plays one mission with its own oracle: search, detection and inspection, with the stimuli of the stream."""
        started, tasks, current = time.monotonic(), [], SEARCH
        self.oracle = self.modes.oracle = self.oracle.next_run()
        self.guided()
        tasks.append(self.request(SEARCH))
        recovered_at: float | None = None
        for stimulus in stream.stimuli:
            if recovered_at is not None and stimulus.second >= recovered_at:
                self.recover(recovered_at)
                recovered_at = None
            if current == SEARCH and stimulus.second >= self.options.found_at:
                self.done("detection")
                self.detected.send({"data": True})
                tasks += [self.cancel(SEARCH), self.request(INSPECT)]
                current = INSPECT
            self.play(stimulus)
            if stimulus.kind == "failure" and self.modes.current(MOTION) == "fd_recover_thrusters":
                recovered_at = stimulus.second + RECOVERY
        self.recover(streams_end(stream))
        self.done("end of the inspection")
        self.inspected.send({"data": True})
        tasks.append(self.cancel(current))
        return self.summary(stream.name, tasks, time.monotonic() - started)

    def summary(self, name: str, tasks: list[bool], took: float) -> dict[str, Any]:
        """Returns the results of the oracle."""
        oracle = self.oracle
        diagnostic = [r for r in oracle.reactions if r.diagnostic and r.answered is not None]
        return {
            "stream": name,
            "role": self.options.role,
            "vendor": self.options.vendor,
            "stimuli": oracle.stimuli,
            "switches": len(oracle.reactions),
            "wrong": oracle.wrong,
            "missed": oracle.missed,
            "twice": oracle.twice,
            "tasks": {"asked": len(tasks), "granted": sum(tasks)},
            "requested_ms": [round(r.requested * 1e3, 3) for r in diagnostic],
            "answered_ms": [round(r.answered * 1e3, 3) for r in diagnostic],
            "seconds": round(took, 2),
        }

    def close(self) -> None:
        """Leaves the DDS domain."""
        self.node.close()
