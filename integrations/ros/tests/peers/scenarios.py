"""The registry of the scenarios, by name. A scenario raises `AssertionError` when a check fails."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import streams
from program import Program
from streams import Stimulus
from suave import Options, Robot

CLEAR, MURKY, DARK = 3.5, 2.5, 1.5  # m: high, medium and low spiral


@dataclass
class Setting:
    """The settings of a scenario. `results` becomes part of the report."""

    program: str
    vendor: str
    domain: int
    median: float = 20.0  # ms, the greatest median of the reactions
    results: list[dict[str, Any]] = field(default_factory=list)
    programs: list[Program] = field(default_factory=list)


Scenario = Callable[[Setting], str]
SCENARIOS: dict[str, Scenario] = {}
QUICK: list[str] = []


def scenario(quick: bool = True) -> Callable[[Scenario], Scenario]:
    """Registers a scenario under its function's name."""

    def register(function: Scenario) -> Scenario:
        name = function.__name__.replace("_", "-")
        SCENARIOS[name] = function
        if quick:
            QUICK.append(name)
        return function

    return register


@contextmanager
def play(
    setting: Setting,
    role: str = "manager",
    own_wait: bool = True,
    prepare: Callable[[Program], list[str]] = lambda _: [],
    **more: Any,
) -> Iterator[tuple[Robot, Program]]:
    """Yields a robot and the program. By default, they have discovered each other."""
    program = Program(setting.program, role, setting.vendor, setting.domain, **more)
    setting.programs.append(program)
    program.more += prepare(program)
    robot = Robot(Options(role=role, vendor=setting.vendor, domain=setting.domain))
    program.start()
    try:
        if own_wait:
            check(robot.wait(), "the program was not discovered within 20 s")
        robot.node.spin(0.5)  # the other side may discover a little later
        yield robot, program
        check(program.running(), f"the program ended with {program.status()}")
        if not setting.program.startswith("stand-in"):
            status = program.stop()
            check(status == 0, f"after SIGINT the program ended with {status}, within 5 s")
    finally:
        robot.close()
        if program.running():
            program.kill()


def check(condition: bool, message: str) -> None:
    """An assertion that `python -O` does not remove."""
    if not condition:
        raise AssertionError(message)


def faultless(result: dict[str, Any]) -> None:
    """Checks that no switch is wrong, missing or requested twice, and that every task was granted."""
    for what in ("wrong", "missed", "twice"):
        check(not result[what], f"{result['stream']}: {what}: {result[what][:5]}")
    tasks = result["tasks"]
    check(tasks["asked"] == tasks["granted"], f"{result['stream']}: {tasks}")
    check(len(result["answered_ms"]) > 0, f"{result['stream']}: nothing to react to")


def reactions(results: list[dict[str, Any]]) -> str:
    """Returns one line with the reaction times of several streams."""
    answered = [ms for result in results for ms in result["answered_ms"]]
    stimuli, switches = sum(r["stimuli"] for r in results), sum(r["switches"] for r in results)
    return (
        f"{stimuli} stimuli, {switches} switches, {len(answered)} reactions: mean {statistics.mean(answered):.2f},"
        f" median {statistics.median(answered):.2f}, max {max(answered):.2f} ms"
    )


def _missions(setting: Setting, role: str, chosen: list[streams.Stream]) -> str:
    done = []
    for stream in chosen:
        with play(setting, role) as (robot, _):
            result = robot.mission(stream)
        setting.results.append(result)
        faultless(result)
        done.append(result)
    median = statistics.median(ms for result in done for ms in result["answered_ms"])
    check(median < setting.median, f"the median reaction is {median:.1f} ms")
    return reactions(done)


@scenario()
def mission_manager(setting: Setting) -> str:
    """Plays two of the published streams with the program as task manager."""
    return _missions(setting, "manager", [streams.stream(3, 1), streams.stream(3, 6)])


@scenario()
def mission_reasoner(setting: Setting) -> str:
    """Plays one of the published streams with the program in place of MROS's reasoner."""
    return _missions(setting, "reasoner", [streams.stream(3, 6)])


@scenario(quick=False)
def published_manager(setting: Setting) -> str:
    """Plays all eighteen published streams with the program as task manager."""
    return _missions(setting, "manager", streams.published())


@scenario(quick=False)
def published_reasoner(setting: Setting) -> str:
    """Plays all eighteen published streams with the program in place of MROS's reasoner."""
    return _missions(setting, "reasoner", streams.published())


def see(robot: Robot, metres: float) -> bool:
    """Publishes a measured water visibility. Returns `True` if the robot settled."""
    return robot.play(Stimulus(0, "visibility", metres))


def no_fault(robot: Robot) -> None:
    """Checks that no switch is wrong, missing or requested twice."""
    oracle = robot.oracle
    for what, found in (("wrong", oracle.wrong), ("missed", oracle.missed), ("twice", oracle.twice)):
        check(not found, f"{what}: {found[:5]}")


def asked(robot: Robot, function: str) -> list[str]:
    """Returns the requested modes of a function, in order."""
    return [mode for _, of, mode in robot.modes.requests if of == function]
