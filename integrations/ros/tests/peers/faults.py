"""Scenarios in which the robot, its mode manager or the network is faulty, and in which the program is killed."""

from __future__ import annotations

import time
from collections.abc import Callable

from modes import Remote
from oracle import MOTION, PATH, SEARCH, UNGROUND, World
from program import Program
from ros2 import Node
from scenarios import CLEAR, DARK, MURKY, Setting, asked, check, no_fault, play, scenario, see
from streams import Stimulus
from suave import Options, Robot
from transport import connect


@scenario()
def battery(setting: Setting) -> str:
    """The battery falls below a quarter: the robot recharges, and continues after the charge is reported."""
    with play(setting) as (robot, _):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        for share in (0.9, 0.5, 0.26):
            robot.play(Stimulus(0, "battery", share))
        no_fault(robot)
        robot.play(Stimulus(0, "battery", 0.24))
        no_fault(robot)
        # Either the end of the recharging or the new level can arrive first and let the robot continue.
        robot.oracle.world.battery = 1.0
        robot.oracle.stimulus("end of the recharging", time.time())
        robot.recharged.send({"data": True})
        robot.play(Stimulus(0, "battery", 1.0))
        no_fault(robot)
        return f"{len(robot.modes.requests)} requests, recharging and back"


@scenario()
def refuses(setting: Setting) -> str:
    """A design is refused: the program selects the next best one, and requests the refused one at most twice."""
    with play(setting) as (robot, _):
        robot.modes.faults.refuses = {"fd_spiral_high"}
        robot.oracle.world.refused = {"fd_spiral_high"}
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted although the medium spiral can be had")
        modes = asked(robot, PATH)
        check(modes[-1:] == ["fd_spiral_medium"], f"asked for {modes}")
        check(modes.count("fd_spiral_high") <= 2, f"a refused design is asked for again and again: {modes}")
        see(robot, DARK)
        check(asked(robot, PATH)[-1] == "fd_spiral_low", f"asked for {asked(robot, PATH)}")
        see(robot, CLEAR)
        robot.node.spin(0.5)
        check(robot.modes.current(PATH) in ("fd_spiral_medium", "fd_spiral_low"), "the refused design runs")
        return f"asked for {' '.join(mode.removeprefix('fd_spiral_') for mode in asked(robot, PATH))}"


def _unresponsive(setting: Setting, prepare: Callable[[Robot], None], limit: float) -> str:
    """The mode manager gives no valid answer in time: the program does not hang, reports this and recovers later."""
    with play(setting) as (robot, program):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        no_fault(robot)
        prepare(robot)
        robot.options.reaction_limit = 0.3
        see(robot, DARK)
        began = time.monotonic()
        alive = robot.node.client("/task/request", "suave_msgs/srv/Task")
        robot.node.spin_until(alive.ready, 5.0)
        robot.node.spin(0.3)
        call = alive.call({"task_name": "no_such_task"})
        answered = robot.node.spin_until(lambda: call.done, 1.0)
        check(answered, "while a service does not answer, /task/request does not answer either")
        check(not call.value.success, "an unknown task was granted")
        robot.node.spin(max(0.0, limit - (time.monotonic() - began)))
        check(program.running(), f"the program ended with {program.status()}")
        told = [event for event in robot.events if "change_mode" in event or "fd_spiral" in event]
        check(bool(told), f"nothing on /metaplan/events: {robot.events[-5:]}")
        faults = robot.modes.faults
        faults.silent, faults.rubbish, faults.delay = False, False, 0.0
        robot.oracle.running.update({name: system.mode for name, system in robot.modes.systems.items()})
        robot.oracle.wrong.clear(), robot.oracle.missed.clear(), robot.oracle.twice.clear()
        robot.options.reaction_limit = 12.0
        see(robot, CLEAR)
        see(robot, DARK)
        robot.node.spin_until(lambda: robot.modes.current(PATH) == "fd_spiral_low", 12.0)
        check(robot.modes.current(PATH) == "fd_spiral_low", f"did not recover: asked for {asked(robot, PATH)}")
        return f"asked for {' '.join(mode.removeprefix('fd_') for mode in asked(robot, PATH))}"


@scenario()
def silent(setting: Setting) -> str:
    """`change_mode` does not answer for some time."""
    return _unresponsive(setting, lambda robot: setattr(robot.modes.faults, "silent", True), 11.0)


@scenario(quick=False)
def late(setting: Setting) -> str:
    """`change_mode` answers after more than five seconds."""
    return _unresponsive(setting, lambda robot: setattr(robot.modes.faults, "delay", 6.0), 14.0)


@scenario()
def rubbish_reply(setting: Setting) -> str:
    """`change_mode` answers with octets that are not a valid response."""
    return _unresponsive(setting, lambda robot: setattr(robot.modes.faults, "rubbish", True), 11.0)


@scenario()
def rubbish_diagnostics(setting: Setting) -> str:
    """`/diagnostics` carries octets that are not a `DiagnosticArray`, between valid samples."""
    rubbish = [
        b"\x00\x01\x00\x00",
        b"\x00\x01\x00\x00" + b"\xff" * 40,
        b"\x00\x01\x00\x00" + bytes(range(64)),
        b"\x77\x77\x00\x00" + b"\x00" * 16,
        # a header, and then more statuses than there are octets
        b"\x00\x01\x00\x00" + b"\x00" * 8 + b"\x01\x00\x00\x00\x00\x00\x00\x00" + b"\xff\xff\xff\x7f" + b"\x00" * 12,
        b"\x00\x03\x00\x00" + b"\x01" * 33,  # a parameter list
    ]
    with play(setting) as (robot, _):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        for count, octets in enumerate(rubbish):
            if len(octets) > 4:
                robot.monitors.topic.raw(octets)
            robot.node.spin(0.02)
            see(robot, (DARK, MURKY, CLEAR)[count % 3])
        values = ("", "NaN", "inf", "3,5", "-1e400", "high", "１.5", "0x3", "1" * 5000)
        for value in values:
            status = robot.monitors._status(0, "x", "QA status", [("water_visibility", value)])
            robot.monitors._send([status], {"sec": -1, "nanosec": 4_000_000_000})
        for message in ("QA status", "Component status", "binding error", "", "qa status"):
            pairs = [("", ""), ("no_such_thing", "FALSE"), ("c_thruster_1", "BROKEN?"), ("c_thruster_99", "FALSE")]
            for pair in pairs:
                robot.monitors._send([robot.monitors._status(7, "", message, [pair])], {"sec": 0, "nanosec": 0})
        robot.node.spin(1.0)
        robot.oracle.running.update({name: system.mode for name, system in robot.modes.systems.items()})
        before = len(robot.oracle.missed)
        robot.oracle.wrong.clear(), robot.oracle.twice.clear()
        see(robot, DARK)
        see(robot, CLEAR)
        check(len(robot.oracle.missed) == before == 0, f"missed {robot.oracle.missed}")
        return f"{len(rubbish) + len(values)} rubbish samples"


@scenario()
def wrong_type(setting: Setting) -> str:
    """Other nodes use the same topic and service with another type: their data is not read as the expected type."""
    with play(setting) as (robot, _):
        see(robot, CLEAR)
        other = Node(connect(setting.vendor, setting.domain), "other")
        text = other.publisher("/diagnostics", "std_msgs/msg/String")
        detected = other.publisher("/pipeline/detected", "std_msgs/msg/Float32")
        task = other.client("/task/request", "std_srvs/srv/SetBool")
        other.spin(1.0)
        text.send({"data": "c_thruster_1 FALSE"})
        detected.send({"data": 1.0})
        task.call({"data": True})
        other.spin(0.5)
        check(robot.request(SEARCH), "the task was not granted")
        see(robot, DARK)
        no_fault(robot)
        other.close()
        return "no effect"


@scenario()
def someone_else(setting: Setting) -> str:
    """Another node switches a function: the program detects this and requests the better mode again."""
    with play(setting) as (robot, program):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        robot.modes.switch(PATH, "fd_spiral_low")
        robot.node.spin_until(lambda: robot.modes.current(PATH) == "fd_spiral_high", 3.0)
        robot.node.spin(0.3)
        see(robot, DARK)
        check(robot.modes.current(PATH) == "fd_spiral_low", f"asked for {asked(robot, PATH)}")
        no_fault(robot)
        told = program.journal() + "\n".join(robot.events)
        check("fd_spiral_low" in told, "neither the journal nor /metaplan/events know of it")
        return f"asked for {' '.join(mode.removeprefix('fd_spiral_') for mode in asked(robot, PATH))}"


@scenario()
def killed(setting: Setting) -> str:
    """`kill -9` in the middle of a mission, twice; the second time, a mode changes before the program runs again."""
    with play(setting) as (robot, program):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        for metres in (MURKY, CLEAR):
            see(robot, metres)
        no_fault(robot)
        before = len(robot.modes.requests)
        program.kill()
        robot.node.spin(0.3)
        program.start()
        check(_again(robot), "the program was not discovered again")
        for _ in range(5):
            see(robot, CLEAR)
            robot.node.spin(0.1)
        check(len(robot.modes.requests) == before, f"asked again for {robot.modes.requests[before:]}")
        see(robot, DARK)
        see(robot, CLEAR)
        no_fault(robot)
        before = len(robot.modes.requests)
        program.kill()
        robot.node.spin(0.3)
        # All spirals are allowed in this water, and the journal has the high one as running: the program must detect
        # the change.
        robot.modes.switch(PATH, "fd_spiral_low")
        program.start()
        check(_again(robot), "the program was not discovered again")
        robot.node.spin_until(lambda: not robot.oracle.due(), 3.0)
        for _ in range(5):
            see(robot, CLEAR)
            robot.node.spin(0.1)
        again = [(function, mode) for _, function, mode in robot.modes.requests[before:]]
        check(again == [(PATH, "fd_spiral_high")], f"asked again for {again}")
        see(robot, DARK)
        check(robot.cancel(SEARCH), "the task was not ended")
        no_fault(robot)
        check(robot.modes.current(MOTION) == UNGROUND, "a function is left running")
        return f"killed twice, {len(robot.modes.requests)} requests, none twice"


def _again(robot: Robot) -> bool:
    """Returns `True` if a restarted program answers; the previous one may still be in the discovery data."""
    probe = robot.node.client("/task/request", "suave_msgs/srv/Task")
    end = time.monotonic() + 25
    while time.monotonic() < end:
        call = probe.call({"task_name": "no_such_task"})
        robot.node.spin(0.5)
        if call.done:
            robot.node.spin(1.0)
            return True
    return False


def _remote(setting: Setting, part: Callable[[Remote, Robot], None], limit: float) -> str:
    """The mode manager ends and returns as a new process, with all functions ungrounded; the mission continues."""
    program = Program(setting.program, "manager", setting.vendor, setting.domain)
    setting.programs.append(program)
    modes = Remote(setting.vendor, setting.domain)
    robot = Robot(Options(vendor=setting.vendor, domain=setting.domain, own_modes=False))
    try:
        program.start()
        check(robot.wait(), "the program was not discovered within 20 s")
        robot.node.spin(2.0)
        robot.show(CLEAR)
        call = robot.task_request.call({"task_name": SEARCH})
        check(robot.node.spin_until(lambda: call.done, 6.0) and call.value.success, "the task was not granted")
        robot.node.spin(0.3)
        modes.poll()
        check((PATH, "fd_spiral_high") in modes.requests, f"asked for {modes.requests}")
        part(modes, robot)
        check(program.running(), f"the program ended with {program.status()}")
        modes = Remote(setting.vendor, setting.domain)
        began = time.monotonic()
        wanted = {(PATH, World(SEARCH, robot.oracle.world.visibility).spiral()), (MOTION, "fd_all_thrusters")}
        while not wanted <= set(modes.requests) and time.monotonic() < began + limit:
            robot.show(robot.oracle.world.visibility)
            robot.node.spin(0.5)
            modes.poll()
        check(wanted <= set(modes.requests), f"{limit:g} s after its return asked for {modes.requests}")
        return f"asked again {time.monotonic() - began:.1f} s after its return"
    finally:
        modes.kill()
        robot.close()
        program.stop()


@scenario()
def vanishes(setting: Setting) -> str:
    """The mode manager is killed, and the water becomes murky while it is absent."""

    def part(modes: Remote, robot: Robot) -> None:
        modes.kill()
        robot.show(DARK)
        robot.node.spin(12.0)
        check(any("fd_spiral" in e or "change_mode" in e for e in robot.events), "nothing on /metaplan/events")

    return _remote(setting, part, 25.0)


@scenario()
def restarts(setting: Setting) -> str:
    """The mode manager is restarted, and nothing else changes."""

    def part(modes: Remote, robot: Robot) -> None:
        modes.leave()
        robot.node.spin(1.0)

    return _remote(setting, part, 15.0)


@scenario()
def wrong_mapping(setting: Setting) -> str:
    """The service mapping of the other vendor is forced: calls time out, and the program names the right `--rmw`."""
    other = "fastrtps" if setting.vendor == "cyclonedds" else "cyclonedds"
    program = Program(setting.program, "manager", setting.vendor, setting.domain, rmw=other)
    setting.programs.append(program)
    robot = Robot(Options(vendor=setting.vendor, domain=setting.domain))
    try:
        program.start()
        said = robot.node.spin_until(lambda: f"--rmw {setting.vendor}" in program.output(), 25.0)
        check(program.running(), f"the program ended with {program.status()}")
        check(said, f"within 25 s nothing is said of `--rmw {setting.vendor}`")
        told = robot.node.spin_until(lambda: any("--rmw" in event for event in robot.events), 5.0)
        check(told, f"nothing on /metaplan/events: {robot.events[-3:]}")
        return next(event for event in robot.events if "--rmw" in event)[:160]
    finally:
        robot.close()
        program.stop()


@scenario()
def rubbish_requests(setting: Setting) -> str:
    """Services get invalid requests from clients that do not wait. The other clients are still served."""
    rubbish = [
        b"\x00\x01\x00\x00" + body for body in (b"", b"\xff" * 8, b"\xff\xff\xff\x7f", bytes(range(64)), b"\x01" * 3)
    ]
    with play(setting) as (robot, _):
        see(robot, CLEAR)
        services = {
            "/task/request": "suave_msgs/srv/Task",
            "/task/cancel": "suave_msgs/srv/Task",
            "/metaplan/change_state": "lifecycle_msgs/srv/ChangeState",
            "/metaplan/set_parameters": "rcl_interfaces/srv/SetParameters",
            "/metaplan/get_parameters": "rcl_interfaces/srv/GetParameters",
        }
        for name, kind in services.items():
            client = robot.node.client(name, kind)
            check(robot.node.spin_until(client.ready, 5.0), f"{name} was not discovered within 5 s")
            robot.node.spin(0.2)
            for octets in rubbish:
                client.raw(octets)
                robot.node.spin(0.02)
        robot.node.spin(0.5)
        check(robot.request(SEARCH), "the task was not granted")
        see(robot, DARK)
        no_fault(robot)
        return f"{len(rubbish) * len(services)} rubbish requests"


@scenario()
def flood(setting: Setting) -> str:
    """Diagnostics arrive faster than the program can switch: it soon uses the latest one."""
    with play(setting) as (robot, _):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        count = 3000
        for number in range(count):
            robot.show((CLEAR, MURKY, DARK)[number % 3])
            robot.node.spin_once(0.0)
        robot.show(DARK)
        began = time.monotonic()
        robot.node.spin_until(lambda: robot.modes.current(PATH) == "fd_spiral_low" and robot.modes.idle(), 5.0)
        took = time.monotonic() - began
        robot.node.spin(1.0)
        check(robot.modes.current(PATH) == "fd_spiral_low", f"a second later {robot.modes.current(PATH)} runs")
        check(took < 2.0, f"right after {took:.1f} s")
        return f"{count} samples, {len(robot.modes.requests)} requests, right {took * 1e3:.0f} ms after the last one"
