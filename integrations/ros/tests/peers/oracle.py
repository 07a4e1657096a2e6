"""Determines the right mode of each function of SUAVE, and finds wrong requests.

The definitions (SUAVE's knowledge base and exemplar): the three spirals need a water visibility of at least 3.25, 2.25
and 1.25 m, and a higher one is better; all thrusters are used while none has failed, and recovered otherwise; at a
quarter of the battery or less the robot recharges before anything else.

An assumption, because the definitions do not say it: below 1.25 m no spiral is right, and SUAVE's managers then either
keep the running one (as MROS does: its plan is empty) or unground the function; both are accepted, and nothing is
required. A function that the task does not need may be ungrounded again, or get no request.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

SEARCH, INSPECT = "search_pipeline", "inspect_pipeline"
MOTION, PATH, FOLLOW, RECHARGE = (
    "f_maintain_motion",
    "f_generate_search_path",
    "f_follow_pipeline",
    "generate_recharge_path",
)
UNGROUND = "fd_unground"
SPIRALS = ((3.25, "fd_spiral_high"), (2.25, "fd_spiral_medium"), (1.25, "fd_spiral_low"))
BATTERY_LIMIT = 0.25


@dataclass
class World:
    """The measured state of the world and the running task."""

    task: str | None = None
    visibility: float | None = None
    battery: float = 1.0
    failed: set[int] = field(default_factory=set)
    refused: set[str] = field(default_factory=set)  # designs that the mode manager does not grant

    def spiral(self) -> str | None:
        """Returns the best spiral that the water allows. Before the first measurement, all spirals are allowed."""
        seen = float("inf") if self.visibility is None else self.visibility
        return next((mode for least, mode in SPIRALS if seen >= least and mode not in self.refused), None)

    def right(self) -> dict[str, str | None]:
        """Returns the right mode of each function, or `None` if no mode is right."""
        modes: dict[str, str | None] = dict.fromkeys((MOTION, PATH, FOLLOW, RECHARGE), UNGROUND)
        if self.task is None:
            return modes
        modes[MOTION] = "fd_recover_thrusters" if self.failed else "fd_all_thrusters"
        if self.battery <= BATTERY_LIMIT:
            modes[RECHARGE] = "normal"
        elif self.task == SEARCH:
            modes[PATH] = self.spiral()
        else:
            modes[FOLLOW] = "fd_follow_pipeline"
        return modes


@dataclass
class Reaction:
    """A correct switch, with the times from the stamp of the stimulus to the request and to the answer (s)."""

    cause: str
    function: str
    mode: str
    diagnostic: bool
    since: float
    requested: float
    answered: float | None = None


@dataclass
class Oracle:
    """Judges every request. Times are seconds since the epoch, the clock of the stamps."""

    world: World = field(default_factory=World)
    running: dict[str, str] = field(default_factory=dict)
    stimuli: int = 0
    reactions: list[Reaction] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    twice: list[str] = field(default_factory=list)
    _cause: str = ""
    _diagnostic: bool = False
    _since: float = 0.0
    _late: set[tuple[str, str]] = field(default_factory=set)

    def stimulus(self, cause: str, stamp: float, diagnostic: bool = False) -> None:
        """Records a stimulus. Call it after the world has changed, before the system under test can know."""
        self.stimuli += diagnostic
        if self.due():
            self._cause, self._since, self._diagnostic = cause, stamp, diagnostic

    def next_run(self) -> Oracle:
        """Returns an oracle for the next run with the same robot. The measured values and running modes are kept."""
        return Oracle(world=self.world, running=self.running)

    def due(self) -> dict[str, str]:
        """Returns the correct switches that have not been made."""
        return {
            function: mode
            for function, mode in self.world.right().items()
            if mode is not None and self.running.get(function, UNGROUND) != mode
        }

    def awaited(self) -> bool:
        """Returns `True` if a switch is due and was not given up."""
        return any((function, mode) not in self._late for function, mode in self.due().items())

    def request(self, function: str, mode: str) -> Reaction | None:
        """Judges a request. Returns the reaction if the request is correct."""
        right = self.world.right().get(function)
        at = time.time()
        if self.running.get(function) == mode:
            if mode != UNGROUND:
                self.twice.append(f"{function} {mode}, asked for after {self._cause}")
            return None
        if right is None and mode == UNGROUND:
            return None
        if mode != right:
            self.wrong.append(f"{function} {mode} instead of {right} after {self._cause}")
            return None
        reaction = Reaction(self._cause, function, mode, self._diagnostic, self._since, at - self._since)
        if not (mode == UNGROUND and function not in self.running):
            self.reactions.append(reaction)
        return reaction

    def answered(self, function: str, mode: str, success: bool, reaction: Reaction | None) -> None:
        """Records the answer to a request."""
        if success:
            self.running[function] = mode
            self._late = {late for late in self._late if late[0] != function}
        if reaction is not None:
            reaction.answered = time.time() - reaction.since

    def give_up(self) -> None:
        """Records each switch that is still due as missed, once. Call it when their time has passed."""
        for function, mode in self.due().items():
            if (function, mode) not in self._late:
                self._late.add((function, mode))
                self.missed.append(f"{function} {mode} after {self._cause}")
