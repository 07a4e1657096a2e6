"""Common parts of the scenarios: the program under test, nodes, checks, and the robot of `examples/nav2` with its manager."""

import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# Runs side by side need different domains, because the shared memory of Fast DDS ignores network namespaces.
os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 99)

import rclpy  # noqa: E402  (reads the environment)
from rclpy.context import Context  # noqa: E402
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from robot import ModeManager  # noqa: E402
from scout import STEPS, Equipment, Localization  # noqa: E402
from std_msgs.msg import Bool, String  # noqa: E402

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
SCOUT = EXAMPLES / "nav2" / "mission.toml"
START = 30.0  # s until the program must be ready
SETTLED = 3.0  # s without another request after which an adaptation is over
AT_ONCE = 0.1  # s, upper limit on the median of the first exchange with a new participant
# s, upper limit on each first exchange. Other processes delay some of them by 0.1 to 0.5 s. One that waits for the next announcement of Fast DDS
# takes 0.9 to 1.2 s, and one that waits for the next heartbeat 3 s.
LATEST = 0.8
ATTEMPTS = 5

ANOTHER_DEFINITION = "has another definition of"

PROGRAM = pathlib.Path(sys.argv[1]).resolve()


class Failure(AssertionError):
    """A failed check of a scenario."""


def check(found: object, expected: object, what: str) -> None:
    """Fails if two values differ."""
    if found != expected:
        raise Failure(f"{what}: found {found}, expected {expected}")


@contextlib.contextmanager
def program(*arguments: str) -> Iterator[tempfile._TemporaryFileWrapper]:
    """The program under test; yields its log."""
    with tempfile.NamedTemporaryFile("w+") as log:
        process = subprocess.Popen([PROGRAM, *arguments], stdout=log, stderr=log)
        try:
            yield log
            if process.poll() is not None:
                raise Failure(f"the program has ended with status {process.returncode}")
            # The hashes that real endpoints announce are those that the program has computed.
            if ANOTHER_DEFINITION in pathlib.Path(log.name).read_text():
                raise Failure("warnings about type hashes")
        except Failure as failure:
            text = pathlib.Path(log.name).read_text()
            raise Failure(f"{failure}\n{text[-3000:]}") from None
        finally:
            process.terminate()
            process.wait(10)


@contextlib.contextmanager
def nodes(*made: Node) -> Iterator[None]:
    """Spins nodes in the background."""
    executor = MultiThreadedExecutor()
    for node in made:
        executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        executor.shutdown()
        for node in made:
            node.destroy_node()


def request(node: Node, kind: type, service: str, content, within: float):
    """Calls a service of the program from a node that is spun elsewhere."""
    client = node.create_client(kind, service)
    if not client.wait_for_service(START):
        raise Failure(f"{service} is not there after {START} s")
    future = client.call_async(content)
    until = time.monotonic() + within
    while not future.done() and time.monotonic() < until:
        time.sleep(0.001)
    if not future.done():
        raise Failure(f"no answer from {service} within {within} s")
    return future.result()


def settle(modes: ModeManager) -> dict[str, list[str]]:
    """Requested modes once no request has come for a while."""
    before, since = modes.requests(), time.monotonic()
    while time.monotonic() - since < SETTLED:
        time.sleep(0.05)
        if modes.requests() != before:
            before, since = modes.requests(), time.monotonic()
    return before


@contextlib.contextmanager
def fresh(name: str) -> Iterator[tuple[Node, SingleThreadedExecutor]]:
    """A node of a new participant, with an executor that does not spin by itself."""
    context = Context()
    rclpy.init(context=context)
    node = Node(name, context=context, start_parameter_services=False, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield node, executor
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def poll(is_so: Callable[[], bool], what: str, within: float) -> float:
    """Waits for a condition with little delay; returns the time that it took, in s."""
    started = time.monotonic()
    while not is_so():
        if time.monotonic() > started + within:
            raise Failure(f"{what}: not within {within} s")
        time.sleep(0.0005)
    return time.monotonic() - started


def check_latencies(what: str, measure: Callable[[], list[float]]) -> None:
    """Fails if the median or the longest of several latencies exceeds its limit in every attempt."""
    for _ in range(ATTEMPTS):
        latencies = measure()
        median, longest, load = statistics.median(latencies), max(latencies), os.getloadavg()[0]
        figures = f"median {1000 * median:.1f} ms, longest {1000 * longest:.1f} ms, load {load:.1f}"
        print(f"  {len(latencies)} {what}: {figures}", flush=True)
        if median <= AT_ONCE and longest <= LATEST:
            return
    raise Failure(f"{what}: {figures} in the last of {ATTEMPTS} attempts")


class Scout:
    """The robot of `examples/nav2`, with the events of its manager."""

    def __init__(self) -> None:
        self.amcl, self.visual = Localization("amcl"), Localization("visual_localization")
        self.equipment = Equipment()
        self.started = [self.amcl, self.visual, self.equipment]
        self.events: list[dict] = []
        self.equipment.create_subscription(
            String, "/metaplan/events", lambda message: self.events.append(json.loads(message.data)), 100
        )

    def until(self, what: str, is_so: Callable[[], bool], within: float = 20.0) -> None:
        """Waits for a condition."""
        until = time.monotonic() + within
        while not is_so():
            if time.monotonic() > until:
                events = "\n".join(json.dumps(event)[:300] for event in self.events[-40:])
                raise Failure(f"{what}: not within {within} s; {self.states()}; last events:\n{events}")
            time.sleep(0.02)

    def states(self) -> tuple[str, str]:
        """States of both ways to localize."""
        return self.amcl.state, self.visual.state

    def until_states(self, amcl: str, visual: str, within: float = 20.0) -> None:
        """Waits for the states of both ways to localize."""
        self.until(f"amcl is {amcl}, visual localization is {visual}", lambda: self.states() == (amcl, visual), within)

    def until_moving(self) -> None:
        """Waits until the robot localizes with the lidar and the manager has recorded the success of its steps."""
        self.until_states("active", "inactive")
        states = lambda: [event["state"] for event in self.events if event["answer"] == "state"]
        self.until("the action is executed", lambda: states()[-1:] == ["EXECUTE"])

    def count(self, answer: str) -> int:
        """Number of events of a kind."""
        return sum(event["answer"] == answer for event in self.events)

    @contextlib.contextmanager
    def managed(self, settings: str = STEPS, *arguments: str) -> Iterator[tempfile._TemporaryFileWrapper]:
        """Starts the nodes and the manager, and yields the log. Does not wait until the manager is ready."""
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(settings)
            file.flush()
            command = ("--as", "manager", "--mission", str(SCOUT), "--settings", file.name, *arguments)
            with nodes(*self.started), program(*command) as log:
                yield log


def arrive(scout: Scout) -> bool:
    """Reports that a move has ended."""
    scout.equipment.arrived.publish(Bool(data=True))
    time.sleep(0.2)
    return True
