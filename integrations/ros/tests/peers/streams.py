"""The published stimuli of SUAVE's experiments, regenerated.

The runner of the recorded runs seeds Python's generator with 100 and draws, for each block of five runs, the start
x, y, z, the shift of the water visibility and the offset of the thruster failures, in this order; an experiment that
does not vary one of them still draws it, from `uniform(0, 0)`. The publishers are pure functions of these draws.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass

SEED = 100
DRAWS = 6
RUNS_PER_DRAW = 5
DURATION = 250  # s
PERIOD, LOWEST, HIGHEST = 120.0, 1.25, 3.75  # of the water visibility: s, m, m
BETWEEN_FAILURES = 100.0  # s, before the offset
FAILING = (1, 3)  # thrusters, in the order in which they fail


@dataclass(frozen=True)
class Draw:
    """A start (m) with its shift of the visibility (s) and offset of the failures (s)."""

    y: float
    shift: float
    offset: float


@dataclass(frozen=True)
class Stimulus:
    """A report `second` seconds after GUIDED: `visibility` (m), `battery` (share) or `failure` (thruster)."""

    second: float
    kind: str
    value: float


@dataclass(frozen=True)
class Stream:
    """A published run: an experiment (1 thrusters, 2 visibility, 3 both) and a draw (1 to 6)."""

    experiment: int
    draw: int
    stimuli: tuple[Stimulus, ...]

    @property
    def name(self) -> str:
        return f"exp{self.experiment}/draw{self.draw}"


def draws() -> list[Draw]:
    """Returns the draws of the recorded runs 1-5, 6-10, and so on."""
    generator = random.Random(SEED)
    found = []
    for _ in range(DRAWS):
        generator.uniform(0, 0)  # x is not varied, but drawn
        y = generator.uniform(2.0, 3.0)
        generator.uniform(0, 0)  # z
        found.append(Draw(y, generator.uniform(0, PERIOD), generator.uniform(-BETWEEN_FAILURES, BETWEEN_FAILURES)))
    return found


def visibility(second: int, shift: float) -> float:
    """Returns the water visibility (m) of SUAVE's observer, at whole seconds since GUIDED."""
    half = (HIGHEST - LOWEST) / 2
    return half * math.cos(2 * math.pi / PERIOD * (second + shift)) + half + LOWEST


def _at_second(second: int, experiment: int, draw: Draw) -> Iterator[Stimulus]:
    # Without variation the water stays clear. The battery is also reported, and never comes near its limit here.
    shown = HIGHEST if experiment == 1 else visibility(second, draw.shift)
    yield Stimulus(second, "visibility", shown)
    yield Stimulus(second, "battery", 1.0 - second / 1000)


def stream(experiment: int, number: int) -> Stream:
    """Returns the stimuli of one run in the order of time."""
    draw = draws()[number - 1]
    found = [stimulus for second in range(DURATION) for stimulus in _at_second(second, experiment, draw)]
    if experiment != 2:
        for count, thruster in enumerate(FAILING, start=1):
            at = count * (BETWEEN_FAILURES + draw.offset)
            if at < DURATION:
                found.append(Stimulus(at, "failure", thruster))
    return Stream(experiment, number, tuple(sorted(found, key=lambda stimulus: stimulus.second)))


def published() -> list[Stream]:
    """Returns all eighteen published streams."""
    return [stream(experiment, number) for experiment in (1, 2, 3) for number in range(1, DRAWS + 1)]
