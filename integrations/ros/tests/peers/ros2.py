"""A ROS 2 node without ROS: publishers, subscriptions, services and actions over a transport, in one thread."""

from __future__ import annotations

import heapq
import itertools
import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import codec
from transport import LATCHED, VOLATILE, Qos, Transport

GRAPH_QOS = Qos(100, transient_local=True)
ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)


def now() -> dict[str, int]:
    """Returns the current time as a builtin_interfaces/Time."""
    sec, nanosec = divmod(time.time_ns(), 10**9)
    return {"sec": sec, "nanosec": nanosec}


@dataclass
class Later:
    """An answer that a service sends after `delay` seconds."""

    delay: float
    value: dict[str, Any]


class Publisher:
    """Publishes values of one type."""

    def __init__(self, node: Node, name: str, type_name: str, qos: Qos) -> None:
        self._type = type_name
        self._writer = node.transport.writer("rt/" + name.lstrip("/"), codec.dds_name(type_name), qos)

    def send(self, value: dict[str, Any]) -> None:
        """Publishes a value."""
        self._writer.write(codec.encode(self._type, value))

    def raw(self, octets: bytes) -> None:
        """Publishes octets, which include their encapsulation header, unchanged."""
        self._writer.write(octets)

    def matched(self) -> int:
        """Returns the number of discovered subscriptions."""
        return self._writer.matched()


@dataclass
class Call:
    """A pending request. When it is `done`, `value` is the answer, or `failed` is the reason why it is unreadable."""

    done: bool = False
    value: Any = None
    failed: str = ""


class Client:
    """A client of a service."""

    def __init__(self, node: Node, name: str, type_name: str) -> None:
        self._type, self._calls = type_name, {}  # type: str, dict[Any, Call]
        self._requester = node.transport.requester(name, type_name, self._take)

    def _take(self, key: Any, octets: bytes) -> None:
        call = self._calls.pop(key, None)
        if call is None:
            return
        try:
            call.value = codec.decode(f"{self._type}_Response", octets)
        except Exception as error:  # whatever the serialiser raises on a text that does not fit
            call.failed = repr(error)
        call.done = True

    def call(self, value: dict[str, Any] | None = None) -> Call:
        """Sends a request."""
        call = Call()
        self._calls[self._requester.request(codec.encode(f"{self._type}_Request", value or {}))] = call
        return call

    def raw(self, octets: bytes) -> Call:
        """Sends octets as a request."""
        call = Call()
        self._calls[self._requester.request(octets)] = call
        return call

    def ready(self) -> bool:
        """Returns `True` if a server was discovered."""
        return self._requester.ready()


class Node:
    """One participant with one node name. All callbacks run in `spin`."""

    def __init__(self, transport: Transport, name: str, namespace: str = "/") -> None:
        self.transport, self.name = transport, name
        self.undecodable: list[str] = []
        self._timers: list[tuple[float, int, Callable[[], None]]] = []
        self._count = itertools.count()
        self.nodes: set[str] = set()
        self._graph_of: dict[bytes, set[str]] = {}
        graph_type = "rmw_dds_common/msg/ParticipantEntitiesInfo"
        self.transport.reader("ros_discovery_info", codec.dds_name(graph_type), GRAPH_QOS, self._take_graph)
        writer = self.transport.writer("ros_discovery_info", codec.dds_name(graph_type), GRAPH_QOS)
        entry = {"node_namespace": namespace, "node_name": name}
        gid = {"data": list(transport.gid())}
        writer.write(codec.encode(graph_type, {"gid": gid, "node_entities_info_seq": [entry]}))
        self._graph = writer

    def _take_graph(self, octets: bytes) -> None:
        info = codec.decode("rmw_dds_common/msg/ParticipantEntitiesInfo", octets)
        names = {n.node_namespace.rstrip("/") + "/" + n.node_name for n in info.node_entities_info_seq}
        self._graph_of[bytes(info.gid.data)] = names
        self.nodes = set().union(*self._graph_of.values())

    def publisher(self, name: str, type_name: str, qos: Qos = VOLATILE) -> Publisher:
        """Returns a publisher of a topic."""
        return Publisher(self, name, type_name, qos)

    def subscribe(self, name: str, type_name: str, on_value: Callable[[Any], None], qos: Qos = VOLATILE) -> Any:
        """Calls `on_value` with each value of a topic. Unreadable samples are added to `undecodable`."""

        def take(octets: bytes) -> None:
            try:
                value = codec.decode(type_name, octets)
            except Exception as error:
                self.undecodable.append(f"{name}: {error!r}")
                return
            on_value(value)

        return self.transport.reader("rt/" + name.lstrip("/"), codec.dds_name(type_name), qos, take)

    def client(self, name: str, type_name: str) -> Client:
        """Returns a client of a service."""
        return Client(self, name, type_name)

    def serve(self, name: str, type_name: str, handler: Callable[[Any], dict[str, Any] | bytes | Later | None]) -> Any:
        """Serves requests. A dictionary is encoded, octets are sent unchanged, and `None` sends no answer."""

        def send(key: Any, value: dict[str, Any]) -> None:
            replier.reply(key, codec.encode(f"{type_name}_Response", value))

        def take(key: Any, octets: bytes) -> None:
            try:
                request = codec.decode(f"{type_name}_Request", octets)
            except Exception as error:
                self.undecodable.append(f"{name}: {error!r}")
                return
            answer = handler(request)
            if isinstance(answer, Later):
                late = answer.value
                self.after(answer.delay, lambda: send(key, late))
            elif isinstance(answer, bytes):
                replier.reply(key, answer)
            elif answer is not None:
                send(key, answer)

        # The serialiser is compiled at its first use, which must not delay a caller.
        codec.decode(f"{type_name}_Request", codec.encode(f"{type_name}_Request", {}))
        codec.encode(f"{type_name}_Response", {})
        replier = self.transport.replier(name, type_name, take)
        return replier

    def after(self, delay: float, action: Callable[[], None]) -> None:
        """Calls `action` once, `delay` seconds from now, while the node spins."""
        heapq.heappush(self._timers, (time.monotonic() + delay, next(self._count), action))

    def spin_once(self, timeout: float) -> None:
        """Waits for the next sample or timer, at most `timeout` seconds."""
        due = self._timers[0][0] - time.monotonic() if self._timers else timeout
        self.transport.poll(max(min(timeout, due), 0.0))
        while self._timers and self._timers[0][0] <= time.monotonic():
            heapq.heappop(self._timers)[2]()

    def spin(self, seconds: float) -> None:
        """Spins for this time."""
        self.spin_until(lambda: False, seconds)

    def spin_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Spins until the condition is true. Returns `False` on a timeout."""
        end = time.monotonic() + timeout
        while not condition():
            left = end - time.monotonic()
            if left <= 0:
                return False
            self.spin_once(min(left, 0.05))
        return True

    def close(self) -> None:
        """Leaves the DDS domain."""
        self._timers = []
        self.transport.close()


@dataclass
class Goal:
    """The goal of an action client, with the answers received."""

    goal_id: list[int]
    accepted: bool | None = None
    status: int | None = None
    result: Any = None
    feedback: list[Any] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)
    cancel: Call | None = None


class ActionClient:
    """A client of an action."""

    def __init__(self, node: Node, name: str, type_name: str) -> None:
        self._node, base = node, f"{name}/_action"
        self._goals: dict[bytes, Goal] = {}
        self._send = node.client(f"{base}/send_goal", f"{type_name}_SendGoal")
        self._result = node.client(f"{base}/get_result", f"{type_name}_GetResult")
        self._cancel = node.client(f"{base}/cancel_goal", "action_msgs/srv/CancelGoal")
        node.subscribe(f"{base}/feedback", f"{type_name}_FeedbackMessage", self._take_feedback)
        self.statuses: list[Any] = []
        status = "action_msgs/msg/GoalStatusArray"
        node.subscribe(f"{base}/status", status, self.statuses.append, LATCHED)

    def _take_feedback(self, message: Any) -> None:
        goal = self._goals.get(bytes(message.goal_id.uuid))
        if goal is not None:
            goal.feedback.append(message.feedback)

    def ready(self) -> bool:
        """Returns `True` if the three services were discovered."""
        return self._send.ready() and self._result.ready() and self._cancel.ready()

    def send(self, value: dict[str, Any]) -> Goal:
        """Sends a goal. `wait_accepted` and `wait_result` fill it in."""
        goal = Goal(list(uuid.uuid4().bytes))
        self._goals[bytes(goal.goal_id)] = goal
        goal.calls.append(self._send.call({"goal_id": {"uuid": goal.goal_id}, "goal": value}))
        return goal

    def wait_accepted(self, goal: Goal, timeout: float) -> bool:
        """Returns `True` if the goal was accepted. Then requests its result, as rclpy does."""
        call = goal.calls[0]
        self._node.spin_until(lambda: call.done, timeout)
        goal.accepted = bool(call.value.accepted) if call.value is not None else None
        if goal.accepted:
            goal.calls.append(self._result.call({"goal_id": {"uuid": goal.goal_id}}))
        return bool(goal.accepted)

    def cancel(self, goal: Goal) -> Call:
        """Requests the cancellation of a goal."""
        goal.cancel = self._cancel.call({"goal_info": {"goal_id": {"uuid": goal.goal_id}}})
        return goal.cancel

    def wait_result(self, goal: Goal, timeout: float) -> bool:
        """Returns `True` if the result was received in time."""
        call = goal.calls[1]
        self._node.spin_until(lambda: call.done, timeout)
        if call.value is not None:
            goal.status, goal.result = int(call.value.status), call.value.result
        return goal.status is not None


class ActionServer:
    """A server of an action. `on_goal` accepts or refuses a goal; the owner sends feedback and the result."""

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        on_goal: Callable[[bytes, Any], bool],
        on_cancel: Callable[[bytes], bool] = lambda _: True,
    ) -> None:
        base = f"{name}/_action"
        self._on_goal, self._on_cancel, self._type = on_goal, on_cancel, type_name
        self._results: dict[bytes, dict[str, Any]] = {}
        self._waiting: dict[bytes, list[Any]] = {}
        self._status: dict[bytes, int] = {}
        self._node = node
        node.serve(f"{base}/send_goal", f"{type_name}_SendGoal", self._goal)
        node.serve(f"{base}/cancel_goal", "action_msgs/srv/CancelGoal", self._cancel)
        self._result_replier = node.transport.replier(f"{base}/get_result", f"{type_name}_GetResult", self._get)
        self._feedback = node.publisher(f"{base}/feedback", f"{type_name}_FeedbackMessage")
        self._statuses = node.publisher(f"{base}/status", "action_msgs/msg/GoalStatusArray", LATCHED)

    def _goal(self, request: Any) -> dict[str, Any]:
        goal = bytes(request.goal_id.uuid)
        accepted = self._on_goal(goal, request.goal)
        if accepted:
            self._set(goal, EXECUTING)
        return {"accepted": accepted, "stamp": now()}

    def _cancel(self, request: Any) -> dict[str, Any]:
        goal = bytes(request.goal_info.goal_id.uuid)
        if goal not in self._status:
            return {"return_code": 2}
        if not self._on_cancel(goal):
            return {"return_code": 1}
        return {"return_code": 0, "goals_canceling": [{"goal_id": {"uuid": list(goal)}, "stamp": now()}]}

    def _get(self, key: Any, octets: bytes) -> None:
        request = codec.decode(f"{self._type}_GetResult_Request", octets)
        self._waiting.setdefault(bytes(request.goal_id.uuid), []).append(key)
        self._answer()

    def _answer(self) -> None:
        for goal, result in self._results.items():
            for key in self._waiting.pop(goal, []):
                self._result_replier.reply(key, codec.encode(f"{self._type}_GetResult_Response", result))

    def _set(self, goal: bytes, status: int) -> None:
        self._status[goal] = status
        entries = [{"goal_info": {"goal_id": {"uuid": list(g)}}, "status": s} for g, s in self._status.items()]
        self._statuses.send({"status_list": entries})

    def feedback(self, goal: bytes, value: dict[str, Any]) -> None:
        """Sends feedback for a goal."""
        self._feedback.send({"goal_id": {"uuid": list(goal)}, "feedback": value})

    def finish(self, goal: bytes, status: int, result: dict[str, Any]) -> None:
        """Ends a goal with a status and a result."""
        self._results[goal] = {"status": status, "result": result}
        self._set(goal, status)
        self._answer()
