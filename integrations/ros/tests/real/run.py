"""Runs `metaplan-ros` against real ROS 2 nodes: rclpy on Fast DDS.

    python run.py METAPLAN_ROS [SCENARIO...]

Each scenario uses a ROS domain of its own and starts the program anew. Exits with 1 if a scenario fails.
"""

import contextlib
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["ROS_DOMAIN_ID"] = str(random.randrange(1, 100))

import rclpy  # noqa: E402  (reads the environment)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from lifecycle_msgs.srv import GetState  # noqa: E402
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue  # noqa: E402
from rcl_interfaces.srv import SetParameters  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from robot import ModeManager, Monitors  # noqa: E402
from suave_msgs.srv import Task  # noqa: E402

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
MISSION = EXAMPLES / "suave" / "suave.toml"
START = 30.0  # s until the program must be ready
SETTLED = 3.0  # s without another request after which an adaptation is over

PROGRAM = pathlib.Path(sys.argv[1]).resolve()


class Failure(AssertionError):
    """What a scenario has found."""


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


def manager(lag: float) -> None:
    """The manager calls real services, and requests each mode once, though the mode manager reports the old mode for `lag` seconds."""
    modes, monitors = ModeManager(lag), Monitors()
    with nodes(modes, monitors), program("--as", "manager", "--mission", str(MISSION)):
        time.sleep(2.0)
        monitors.measure("water_visibility", 3.5)
        answer = request(monitors, Task, "/task/request", Task.Request(task_name="search_pipeline"), 10.0)
        check(answer.success, True, "the task is accepted")
        first = {"f_generate_search_path": ["fd_spiral_high"], "f_maintain_motion": ["fd_all_thrusters"]}
        check(settle(modes), first, "requests after the task")
        monitors.measure("water_visibility", 2.5)
        second = first | {"f_generate_search_path": ["fd_spiral_high", "fd_spiral_medium"]}
        check(settle(modes), second, "requests after less visibility")
        monitors.measure("water_visibility", 3.5)
        found = settle(modes)["f_generate_search_path"]
        check(found, ["fd_spiral_high", "fd_spiral_medium", "fd_spiral_high"], "requests after more visibility")


def fresh_clients(count: int) -> None:
    """Each of many new participants gets an answer to a call made as soon as the service is discovered."""
    latencies, lost = [], 0
    with program("--as", "planner", "--mission", str(MISSION)):
        for index in range(count):
            context = Context()
            rclpy.init(context=context)
            node = Node(f"client{index}", context=context, start_parameter_services=False, enable_rosout=False)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(node)
            client = node.create_client(GetState, "/planner/get_state")
            until = time.monotonic() + START
            while not client.service_is_ready():
                if time.monotonic() > until:
                    raise Failure(f"/planner/get_state is not there after {START} s")
                time.sleep(0.0005)
            called = time.monotonic()
            future = client.call_async(GetState.Request())
            executor.spin_until_future_complete(future, 8.0)
            if future.done():
                latencies.append(time.monotonic() - called)
            else:
                lost += 1
            node.destroy_node()
            rclpy.shutdown(context=context)
    check(lost, 0, f"answers lost of {count}")
    median, longest = statistics.median(latencies), max(latencies)
    print(f"  {count} answers: median {1000 * median:.1f} ms, longest {1000 * longest:.1f} ms", flush=True)


def driver() -> None:
    """A driver's own diagnostic adapts the robot with three lines of configuration; without them a warning suggests them."""
    rule = '\n[[diagnostics]]\nname = "thruster_1: *"\ncomponent = "c_thruster_1"\n'
    for extra in (rule, ""):
        modes, monitors = ModeManager(0.0), Monitors()
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as settings:
            settings.write((MISSION.parent / "ros.toml").read_text() + extra)
            settings.flush()
            arguments = ("--as", "manager", "--mission", str(MISSION), "--settings", settings.name)
            with nodes(modes, monitors), program(*arguments) as log:
                time.sleep(2.0)
                monitors.measure("water_visibility", 3.5)
                request(monitors, Task, "/task/request", Task.Request(task_name="search_pipeline"), 10.0)
                settle(modes)
                status = DiagnosticStatus(
                    level=DiagnosticStatus.ERROR, name="thruster_1: motor driver", message="No current"
                )
                monitors.publisher.publish(DiagnosticArray(status=[status]))
                found = settle(modes)["f_maintain_motion"]
                expected = ["fd_all_thrusters", "fd_recover_thrusters"] if extra else ["fd_all_thrusters"]
                check(found, expected, f"modes after the diagnostic, with rule: {bool(extra)}")
                warned = "thruster_1: motor driver" in pathlib.Path(log.name).read_text()
                check(warned, not extra, f"a warning about the diagnostic, with rule: {bool(extra)}")


def waiting() -> None:
    """The manager reports on `/diagnostics` that it waits for the robot."""
    node, levels = Node("watchdog"), []
    node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda array: levels.extend(own.level for own in array.status), 10
    )
    with nodes(node), program("--as", "manager", "--mission", str(MISSION)):
        time.sleep(8.0)
    check(set(levels), {DiagnosticStatus.STALE}, "levels on /diagnostics")
    if not 3 <= len(levels) <= 9:
        raise Failure(f"{len(levels)} diagnostics in 8 s, one a second expected")


def parameters() -> None:
    """Values that cannot be used are refused."""
    node = Node("setter")
    with nodes(node), program("--as", "planner", "--mission", str(MISSION)):
        for seconds, is_accepted in ((-1.0, False), (0.0, False), (2.5, True)):
            value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=seconds)
            content = SetParameters.Request(parameters=[Parameter(name="plan_solver_timeout", value=value)])
            answer = request(node, SetParameters, "/planner/set_parameters", content, 10.0)
            check(answer.results[0].successful, is_accepted, f"plan_solver_timeout = {seconds}")


SCENARIOS = {
    "manager": lambda: manager(0.0),
    "manager_50ms": lambda: manager(0.05),
    "manager_500ms": lambda: manager(0.5),
    "fresh_clients": lambda: fresh_clients(8),
    "parameters": parameters,
    "driver": driver,
    "waiting": waiting,
}


def main() -> None:
    """Runs the scenarios that the command line names, or all."""
    rclpy.init()
    failed = 0
    for name in sys.argv[2:] or SCENARIOS:
        started = time.monotonic()
        try:
            SCENARIOS[name]()
            result = "ok"
        except Failure as failure:
            failed += 1
            result = f"FAILED\n{failure}"
        print(f"{name}: {result} ({time.monotonic() - started:.1f} s)", flush=True)
    rclpy.shutdown()
    print(f"{failed} of the scenarios failed" if failed else "all scenarios passed", flush=True)
    sys.stdout.flush()
    os._exit(1 if failed else 0)


main()
