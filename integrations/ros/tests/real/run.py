"""Runs `metaplan-ros` against real ROS 2 nodes: rclpy on Fast DDS.

    python run.py METAPLAN_ROS [SCENARIO...]
    python run.py METAPLAN_ROS --cold-starts N

The second form starts each role N times, with a new client each time; it is not part of CI. All scenarios of a run use one ROS
domain; each starts new processes of the program. Exits with 1 if a scenario fails.
"""

import functools
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time

# The harness sets the environment of ROS before rclpy reads it.
from harness import (
    AT_ONCE,
    EXAMPLES,
    LATEST,
    PROGRAM,
    SCOUT,
    SETTLED,
    START,
    Failure,
    Scout,
    arrive,
    check,
    check_latencies,
    fresh,
    nodes,
    poll,
    program,
    request,
    settle,
)

import anything
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from robot import ModeManager, Monitors
from rosgraph_msgs.msg import Clock
from scout import STEPS, Localization
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Float64
from suave_msgs.srv import Task

MISSION = EXAMPLES / "suave" / "suave.toml"


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
    """Each of many new participants gets an answer at once to a call made as soon as the service is discovered."""

    def measure() -> list[float]:
        latencies = []
        for index in range(count):
            with fresh(f"client{index}") as (node, executor):
                client = node.create_client(GetState, "/planner/get_state")
                poll(client.service_is_ready, "/planner/get_state is there", START)
                called = time.monotonic()
                future = client.call_async(GetState.Request())
                executor.spin_until_future_complete(future, 8.0)
                check(future.done(), True, "an answer within 8 s")
                latencies.append(time.monotonic() - called)
        return latencies

    with program("--as", "planner", "--mission", str(MISSION)):
        check_latencies("answers", measure)


def fresh_publishers(count: int) -> None:
    """The first diagnostic of a new participant is received at once, though it is published as soon as the reader is discovered."""
    modes = ModeManager(0.0)

    def measure() -> list[float]:
        latencies = []
        with program("--as", "manager", "--mission", str(MISSION)) as log:
            output = pathlib.Path(log.name)
            poll(lambda: "every function answers" in output.read_text(), "every function answers", START)
            for index in range(count):
                with fresh(f"driver{index}") as (node, _):
                    publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
                    # Only the manager reads diagnostics.
                    poll(lambda: publisher.get_subscription_count() == 1, "the reader is there", START)
                    name = f"driver {index}"
                    status = DiagnosticStatus(level=DiagnosticStatus.ERROR, name=name, message="No current")
                    publisher.publish(DiagnosticArray(status=[status]))
                    # A diagnostic without a rule is named in a warning.
                    received = lambda: f"`{name}`" in output.read_text()
                    latencies.append(poll(received, f"the diagnostic of `{name}` is received", 8.0))
        return latencies

    with nodes(modes):
        check_latencies("diagnostics", measure)


def departure() -> None:
    """The endpoints of a program that ends disappear at once, not only when its lease expires."""
    monitors = Monitors()
    count = monitors.publisher.get_subscription_count
    with nodes(monitors):
        with program("--as", "manager", "--mission", str(MISSION)):
            poll(lambda: count() == 1, "the reader is there", START)
            # Discovery of the other endpoints may still be in progress.
            time.sleep(1.0)
        # The lease lasts for more than 20 s.
        poll(lambda: count() == 0, "the reader is gone", 8.0)


ROLES = {
    "planner": ("planner", MISSION),
    "manager": ("metaplan", MISSION),
    "reasoner": ("metaplan", MISSION),
    "controller": ("metaplan", MISSION),
}


def cold_starts(role: str, count: int) -> None:
    """A client that starts together with the program gets an answer at once when the service is discovered."""
    name, mission = ROLES[role]

    def measure() -> list[float]:
        latencies = []
        for index in range(count):
            with program("--as", role, "--mission", str(mission)), fresh(f"client{index}") as (node, executor):
                client = node.create_client(GetParameters, f"/{name}/get_parameters")
                poll(client.service_is_ready, f"/{name}/get_parameters is there", START)
                called = time.monotonic()
                future = client.call_async(GetParameters.Request(names=["use_sim_time"]))
                executor.spin_until_future_complete(future, 8.0)
                check(future.done(), True, f"an answer within 8 s, start {index}")
                latencies.append(time.monotonic() - called)
        return latencies

    latencies = sorted(measure())
    late = [round(1000 * latency) for latency in latencies if latency > AT_ONCE]
    median, load = 1000 * statistics.median(latencies), os.getloadavg()[0]
    print(f"  {count} starts of the {role}: median {median:.1f} ms, {len(late)} above 100 ms {late}, load {load:.1f}", flush=True)
    check(latencies[-1] <= LATEST, True, f"every first answer within {LATEST} s")


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


def steps() -> None:
    """Lifecycle transitions and parameters put designs into effect, once for each cause."""
    scout = Scout()
    with scout.managed():
        scout.until_moving()
        scout.until("the speed is set", lambda: scout.equipment.get_parameter("max_speed").value == 1.0)
        check(scout.equipment.settings, [(1.0, False)], "parameters, both at once")
        time.sleep(SETTLED)
        check(scout.amcl.transitions, ["configure", "activate"], "transitions of amcl")
        check(scout.visual.transitions, ["configure"], "transitions of visual localization")
        scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
        scout.until_states("inactive", "active")
        time.sleep(SETTLED)
        check(scout.amcl.transitions, ["configure", "activate", "deactivate"], "transitions of amcl")
        check(scout.visual.transitions, ["configure", "activate"], "transitions of visual localization")
        check(scout.equipment.settings, [(1.0, False)], "parameters stay")
        # The move ends, and the inspection needs the lamp and the camera.
        scout.until("the lamp is on", lambda: arrive(scout) and scout.equipment.lamp == [True])
        scout.until("the camera is reset", lambda: scout.equipment.resets == 1)


def rollback() -> None:
    """A node that refuses its activation: the steps before are undone, and the design counts as not realisable."""
    scout = Scout()
    scout.visual.can_activate = False
    with scout.managed():
        scout.until_moving()
        scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
        scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
        scout.until_states("active", "inactive")
        undone = [event["step"] for event in scout.events if event.get("outcome") == "undone"]
        check(undone, ["/visual_localization inactive", "/amcl active"], "undone steps, the last one first")
        time.sleep(SETTLED)
        check(scout.count("steps_failed"), 1, "attempts within the minute")


def refused_parameters() -> None:
    """Parameters that a node refuses: another design is used."""
    scout = Scout()
    scout.equipment.fastest = 0.6
    with scout.managed():
        scout.until("the slow design is used", lambda: scout.equipment.get_parameter("max_speed").value == 0.25)
        scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
        check(scout.equipment.settings, [(0.25, True)], "accepted parameters")
        failed = [event for event in scout.events if event["answer"] == "steps_failed"]
        check(["too fast" in event["because"] for event in failed], [True], "reasons of failures")


def refused_service() -> None:
    """A service that refuses after another one was called: the first call is undone by the stated call."""
    scout = Scout()
    scout.equipment.can_reset = False
    with scout.managed():
        scout.until_states("active", "inactive")
        scout.until("the lamp is switched back and the other design is used", lambda: arrive(scout) and len(scout.equipment.lamp) == 3)
        check(scout.equipment.lamp, [True, False, False], "calls of the lamp: step, undo, other design")
        check(scout.equipment.resets, 1, "calls of the camera")


def silent_topic() -> None:
    """A condition that is not seen afterwards: the steps are undone."""
    condition = '{ node = "/visual_localization", state = "active" },\n]\nverify = [{ topic = "/visual_localization/pose" }]'
    settings = STEPS.replace('{ node = "/visual_localization", state = "active" },\n]', condition)
    scout = Scout()
    scout.visual.is_mute = True
    with scout.managed(settings):
        scout.until_moving()
        scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
        scout.until("visual localization is tried", lambda: scout.visual.state == "active")
        scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
        scout.until_states("active", "inactive")
        failed = [event["because"] for event in scout.events if event["answer"] == "steps_failed"]
        check(failed, ["not seen afterwards: a message on /visual_localization/pose"], "reasons of failures")
    scout = Scout()
    with scout.managed(settings):
        scout.until_moving()
        scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
        scout.until_states("inactive", "active")
        time.sleep(SETTLED)
        check(scout.count("steps_failed"), 0, "failures if messages arrive")


def changed_by_others() -> None:
    """A node that another client deactivates is activated again."""
    scout = Scout()
    with scout.managed():
        scout.until_states("active", "inactive")
        time.sleep(SETTLED)
        scout.amcl.trigger_deactivate()
        scout.until_states("active", "inactive")
        time.sleep(SETTLED)
        check(scout.amcl.transitions, ["configure", "activate", "deactivate", "activate"], "transitions of amcl")
        check(scout.count("steps_failed"), 0, "failures")


def restarted() -> None:
    """A node that starts late is waited for; one that is started again is configured and activated again."""
    scout = Scout()
    scout.started.remove(scout.amcl)
    scout.started.remove(scout.visual)
    with scout.managed(), nodes(scout.visual):
        with nodes(scout.amcl):
            scout.until_states("active", "inactive")
            time.sleep(SETTLED)
        scout.amcl = Localization("amcl")
        with nodes(scout.amcl):
            scout.until_states("active", "inactive", 40.0)
            check(scout.amcl.transitions, ["configure", "activate"], "transitions of the new node")


def commands() -> None:
    """A command is a step if the command line allows it; its failure is undone, also if it has had a part of its effect."""
    with tempfile.TemporaryDirectory() as directory:
        made, part = pathlib.Path(directory) / "started", pathlib.Path(directory) / "part"
        command = f'{{ command = ["mkdir", "{made}"], undo = {{ command = ["rmdir", "{made}"] }} }}'
        fails = f'{{ command = ["mkdir", "{part}", "{made}"], undo = {{ command = ["rmdir", "{part}"] }} }}'
        failing = STEPS.replace(
            'steps = [{ node = "/controller", parameters = { max_speed = 1,',
            f'steps = [{command}, {fails}, {{ node = "/controller", parameters = {{ max_speed = 1,',
        )
        scout = Scout()
        with scout.managed(failing, "--allow-commands"):
            scout.until("the slow design is used", lambda: scout.equipment.get_parameter("max_speed").value == 0.25)
            scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
            check((made.exists(), part.exists()), (False, False), "directories after the rollback")
            failed = [event["because"] for event in scout.events if event["answer"] == "steps_failed"]
            check(["`mkdir" in because and "has ended with" in because for because in failed], [True], "reasons of failures")
        succeeding = failing.replace(f"{fails}, ", "")
        scout = Scout()
        with scout.managed(succeeding, "--allow-commands"):
            scout.until("the fast design is used", lambda: scout.equipment.get_parameter("max_speed").value == 1.0)
            check(made.exists(), True, "the directory")
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(failing)
            file.flush()
            command = [PROGRAM, "--as", "manager", "--mission", str(SCOUT), "--settings", file.name]
            ended = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
        check((ended.returncode, "N134" in ended.stderr), (2, True), "status and message without permission")


SIGNALS = """
[[signals]]
node = "/amcl"
state = "active"
component = "c_camera"
heal_time = 0

[[signals]]
topic = "/scan"
component = "c_lidar"
at_least = 5.0
period = 1.0
heal_time = 0.5

[[signals]]
topic = "/light"
type = "std_msgs/msg/Float64"
field = "data"
attribute = "light"
scale = 10.0
period = 1.0
"""


def rate_signal() -> None:
    """A topic that becomes too slow is a failed component; the other design is put into effect, and back when it is fast again."""
    settings = STEPS + SIGNALS.replace('node = "/amcl"', 'node = "/controller"').replace('state = "active"\n', "", 1)
    scout = Scout()
    period = [0.05]
    scans = scout.equipment.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
    running = threading.Event()

    def scan() -> None:
        while not running.wait(period[0]):
            scans.publish(LaserScan(ranges=[1.0] * 100))

    thread = threading.Thread(target=scan, daemon=True)
    thread.start()
    light = scout.equipment.create_publisher(Float64, "/light", 10)
    scout.equipment.create_timer(0.1, lambda: light.publish(Float64(data=30.0)))
    try:
        with scout.managed(settings):
            scout.until_states("active", "inactive")
            time.sleep(SETTLED)
            check(scout.visual.transitions, ["configure"], "transitions while scans arrive")
            period[0] = 0.5
            scout.until_states("inactive", "active")
            period[0] = 0.05
            scout.until_states("active", "inactive", 30.0)
            # Publishers end with the node, so that the thread has to end first.
            running.set()
            thread.join()
    finally:
        running.set()


def value_signal() -> None:
    """A value of a topic is a measurement in another unit, and the state of a lifecycle node is a component."""
    settings = STEPS + SIGNALS.replace('"/amcl"', '"/bumper"').replace('component = "c_camera"', 'component = "c_bumper"')
    scout, level, bumper = Scout(), [30.0], Localization("bumper")
    scans = scout.equipment.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
    scout.equipment.create_timer(0.05, lambda: scans.publish(LaserScan()))
    light = scout.equipment.create_publisher(Float64, "/light", 10)
    scout.equipment.create_timer(0.1, lambda: light.publish(Float64(data=level[0])))
    bumper.trigger_configure()
    bumper.trigger_activate()
    with nodes(bumper), scout.managed(settings):
        scout.until_states("active", "inactive")
        scout.until("the fast design is used", lambda: scout.equipment.settings == [(1.0, False)])
        time.sleep(SETTLED)
        check(scout.equipment.settings, [(1.0, False)], "designs while nothing changes")
        # The robot drives slowly while the node of the bumper is not active.
        bumper.trigger_deactivate()
        scout.until("the slow design is used", lambda: scout.equipment.settings[-1] == (0.25, True))
        bumper.trigger_activate()
        scout.until("the fast design is used", lambda: scout.equipment.settings[-1] == (1.0, False))
        # It becomes dark: inspections need the thermal camera, which switches the lamp off.
        level[0] = 5.0
        scout.until("the dark design is used", lambda: arrive(scout) and scout.equipment.lamp[-1:] == [False])
        check(scout.count("steps_failed"), 0, "failures")


def silent_signal() -> None:
    """A sensor that falls silent is reported; one that repeats its value is not."""
    settings = STEPS + SIGNALS.replace('node = "/amcl"', 'node = "/controller"').replace('state = "active"\n', "", 1)
    scout = Scout()
    level = [30.0]
    scans = scout.equipment.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
    scout.equipment.create_timer(0.05, lambda: scans.publish(LaserScan()))
    light = scout.equipment.create_publisher(Float64, "/light", 10)
    scout.equipment.create_timer(0.1, lambda: level[0] is not None and light.publish(Float64(data=level[0])))
    with scout.managed(settings):
        scout.until_states("active", "inactive")
        time.sleep(SETTLED)
        silences = lambda: [event for event in scout.events if event["answer"] == "silent" and "function" not in event]
        check(silences(), [], "reports of silence while the value is repeated")
        level[0] = None
        scout.until("silence is reported", lambda: len(silences()) == 1)


def simulated_time() -> None:
    """With `use_sim_time`, a filter waits for simulated seconds: the recovery of a component takes effect in simulated time."""
    scout, now, step = Scout(), [1000.0], [0.01]
    clock = scout.equipment.create_publisher(Clock, "/clock", qos_profile_sensor_data)
    stopped = threading.Event()

    def simulate() -> None:
        while not stopped.wait(0.01):
            now[0] += step[0]
            seconds = int(now[0])
            clock.publish(Clock(clock=Time(sec=seconds, nanosec=int((now[0] - seconds) * 1e9))))

    threading.Thread(target=simulate, daemon=True).start()
    stamps: list[int] = []
    scout.equipment.create_subscription(
        DiagnosticArray,
        "/diagnostics",
        lambda array: stamps.extend(
            array.header.stamp.sec for status in array.status if status.name == "metaplan: manager"
        ),
        10,
    )
    try:
        with scout.managed(STEPS, "--ros-args", "-p", "use_sim_time:=true"):
            scout.until_moving()
            scout.until("its status has a simulated stamp", lambda: any(999 < stamp < 3000 for stamp in stamps))
            scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
            scout.until_states("inactive", "active")
            # The clock stands still: 2 s of `heal_time` and 5 s of `settle` do not pass.
            step[0] = 0.0
            scout.equipment.lidar(DiagnosticStatus.OK, "scans")
            time.sleep(9.0)
            check(scout.states(), ("inactive", "active"), "states while the clock stands still")
            # Ten times as fast: both pass within about a second.
            step[0] = 0.1
            resumed = time.monotonic()
            scout.until_states("active", "inactive")
            elapsed = time.monotonic() - resumed
            if elapsed > 5.0:
                raise Failure(f"the recovery took {elapsed:.1f} s at tenfold speed, 7 simulated seconds are expected")
    finally:
        stopped.set()


def discover() -> None:
    """The written settings contain the parts of the robot, and the rule for the lidar can be used without changes."""
    scout = Scout()
    scans = scout.equipment.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
    scout.equipment.create_timer(0.1, lambda: scans.publish(LaserScan()))
    scout.equipment.create_publisher(Float64, "/light", 10)
    scout.equipment.create_timer(0.5, lambda: scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan"))
    with tempfile.TemporaryDirectory() as directory, nodes(scout.amcl, scout.visual, scout.equipment):
        file = pathlib.Path(directory) / "ros.toml"
        command = [PROGRAM, "--as", "discover", "--mission", SCOUT, "--seconds", "6", "--output", file]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
        check(ended.returncode, 0, f"the status\n{ended.stderr}")
        text = file.read_text()
        for part in (
            '# name = "lidar: driver"\n# component = "c_lidar"',
            '# node = "/amcl"\n# state = "active"  # now unconfigured',
            '# topic = "/scan"',
            '# topic = "/light"\n# type = "std_msgs/msg/Float64"',
            "# [functions.f_localize.designs.fd_lidar_localization]",
            'service = "/lamp", type = "std_srvs/srv/SetBool"',
        ):
            check(part in text, True, f"{part} in the settings\n{text}")
        again = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
        check((again.returncode, "not overwritten" in again.stderr), (2, True), "the existing file is kept")
        # The rule for the lidar adapts the robot at once.
        start = text.index("# [[diagnostics]]")
        rule = "\n".join(line.removeprefix("# ") for line in text[start:].split("\n\n")[0].splitlines())
        settings = STEPS.replace('[[diagnostics]]\nname = "lidar: *"\ncomponent = "c_lidar"\n', rule + "\n")
        check("lidar: *" in settings, False, "the rule is replaced")
    scout = Scout()
    with scout.managed(settings):
        scout.until_moving()
        scout.equipment.lidar(DiagnosticStatus.ERROR, "no scan")
        scout.until_states("inactive", "active")


SCENARIOS = {
    "manager": lambda: manager(0.0),
    "manager_50ms": lambda: manager(0.05),
    "manager_500ms": lambda: manager(0.5),
    "fresh_clients": lambda: fresh_clients(20),
    "fresh_publishers": lambda: fresh_publishers(20),
    "departure": departure,
    "parameters": parameters,
    "driver": driver,
    "waiting": waiting,
    "steps": steps,
    "rollback": rollback,
    "refused_parameters": refused_parameters,
    "refused_service": refused_service,
    "silent_topic": silent_topic,
    "changed_by_others": changed_by_others,
    "restarted": restarted,
    "commands": commands,
    "rate_signal": rate_signal,
    "value_signal": value_signal,
    "silent_signal": silent_signal,
    "simulated_time": simulated_time,
    "discover": discover,
    "any_service": anything.any_service,
    "selector": anything.selector,
    "any_action": anything.any_action,
    "other_definition": anything.other_definition,
}


def main() -> None:
    """Runs the scenarios that the command line names, or all. `--shard 2/3` runs every third one, from the second on."""
    rclpy.init()
    scenarios = SCENARIOS
    if sys.argv[2:3] == ["--shard"]:
        number, shards = map(int, sys.argv.pop().split("/"))
        sys.argv.pop()
        scenarios = dict(list(SCENARIOS.items())[number - 1 :: shards])
    if sys.argv[2:3] == ["--cold-starts"]:
        count = int(sys.argv.pop())
        sys.argv.pop()
        scenarios = {f"cold_starts_{role}": functools.partial(cold_starts, role, count) for role in ROLES}
    failed = 0
    for name in sys.argv[2:] or scenarios:
        started = time.monotonic()
        try:
            scenarios[name]()
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
