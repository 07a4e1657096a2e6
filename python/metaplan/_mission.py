"""Missions: a knowledge base and a task, joined."""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections.abc import AsyncIterable, AsyncIterator, Callable, Iterable, Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from metaplan import _native
from metaplan._answers import Answer, Comparison, Front, LoopAnswer, Plan, Verdict, Verification, exact
from metaplan._errors import Message, messages_of

File = str | os.PathLike[str]
"""A path; a string that begins with ``(`` is PDDL itself."""


def _file(name: str, value: File) -> tuple[str, str | None]:
    if isinstance(value, str) and value.lstrip().startswith(("(", ";")):
        return name, value
    return os.fspath(value), None


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # Neither 1e-07 nor 0.1000000000000000055.
        return format(Decimal(repr(value)), "f")
    return str(value)


def _toml(value: Any) -> str:
    """A value of a manifest."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_toml(own)}" for key, own in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, (bool, int, float, Decimal)):
        return _value(value)
    return json.dumps(os.fspath(value) if isinstance(value, os.PathLike) else str(value))


class Mission:
    """A mission in its present situation.

    Changes (:meth:`fail`, :meth:`set`, :meth:`scenario`) count for all that is asked from then on; :meth:`copy` keeps a situation.
    Threads may plan for one mission at the same time.
    """

    def __init__(self, native: _native.Mission) -> None:
        self._native = native

    @classmethod
    def load(cls, manifest: File | Mapping[str, Any], directory: File = ".") -> Mission:
        """From a manifest: a path, its text, or a mapping with its sections, whose paths are relative to ``directory``.

        Raises :class:`metaplan.Error` with all that is wrong with the manifest and the files that it names.
        """
        if isinstance(manifest, Mapping):
            text = "".join(f"{key} = {_toml(value)}\n" for key, value in manifest.items())
            return cls(_native.Mission.parse("manifest", text, os.fspath(directory)))
        if isinstance(manifest, str) and "\n" in manifest:
            return cls(_native.Mission.parse("manifest", manifest, os.fspath(directory)))
        return cls(_native.Mission.load(os.fspath(manifest)))

    @classmethod
    def from_files(
        cls,
        domain: File,
        problem: File,
        knowledge: Iterable[File] = (),
        *,
        rules: Iterable[File] = (),
        bindings: Mapping[str, str] | None = None,
        names: Mapping[str, str] | None = None,
        name: str = "",
    ) -> Mission:
        """From a PDDL domain and problem, each a path or PDDL itself, and perhaps knowledge bases (OWL).

        ``rules`` are files of rules, ``coadaptation`` (unless any are given) or ``tomasys``; ``names`` says what individuals are called in the problem.
        """
        return cls(
            _native.Mission.join(
                name,
                (_file("domain", domain), _file("problem", problem)),
                [os.fspath(path) for path in knowledge],
                [os.fspath(rule) for rule in rules],
                dict(bindings or {}),
                list((names or {}).items()),
            )
        )

    def copy(self) -> Mission:
        """Another mission in the same situation."""
        return Mission(self._native.copy())

    __copy__ = copy

    @property
    def name(self) -> str:
        """The mission's name."""
        return self._native.name

    @property
    def description(self) -> str:
        """What the mission is about."""
        return self._native.description

    @property
    def scenarios(self) -> list[str]:
        """The names of the manifest's scenarios."""
        return self._native.scenarios

    @property
    def warnings(self) -> list[Message]:
        """What may be other than meant in its files."""
        return messages_of(self._native.warnings)

    def pddl(self) -> tuple[str, str]:
        """Domain and problem as they are planned with: with what the knowledge base contributes."""
        return self._native.pddl()

    def scenario(self, name: str) -> Mission:
        """Brings the mission into a scenario of its manifest; returns itself."""
        self._native.scenario(name)
        return self

    def fail(self, *components: str) -> Mission:
        """Components have failed; returns the mission itself."""
        for component in components:
            self._native.fail(component)
        return self

    def set(self, *args: Any, **values: Any) -> Mission:
        """``set("ambient_light", 0.9)`` or ``set(battery=30, robot_at="wp2")``: measured attributes, numeric fluents and facts have
        values; returns the mission itself. ``True`` and ``False`` are those of attributes."""
        if args:
            name, value = args
            values = {name: value, **values}
        for name, value in values.items():
            self._native.set(name, _value(value))
        return self

    def plan(
        self,
        *,
        minimize: str | Iterable[str] = (),
        pareto: tuple[str, str] | None = None,
        alternatives: int | None = None,
        concurrent: bool | float | str | Decimal = False,
        horizon: int | None = None,
        engine: str | None = None,
        strategy: str | None = None,
        confirm: bool = False,
        time_limit: float | None = None,
        memory_limit: int | None = None,
        certificate: File | None = None,
        on_improvement: Callable[[Decimal, Decimal, float, int], bool | None] | None = None,
    ) -> Plan | Front:
        """The best plan with its configuration, and what is proved of it.

        :param minimize: what counts in place of the problem's metric, the most important first
        :param pareto: two objectives; the answer is a :class:`Front`
        :param alternatives: up to so many further plans that are as good
        :param concurrent: actions may overlap; a number says how far apart those lie that interfere (0.001), in the domain's time unit
        :param horizon: only plans with at most so many steps
        :param engine: ``auto``, ``sat`` or ``search``
        :param time_limit: in seconds; the best plan so far is the answer then, as it is after Ctrl-C
        :param memory_limit: in megabytes that searches store
        :param certificate: a directory that does not exist yet, to check the answer with :func:`metaplan.verify`
        :param on_improvement: hears cost, lower bound, gap (0 to 1) and steps of each better plan; planning ends when it returns ``False``

        Raises :class:`metaplan.Error`; ``KeyboardInterrupt`` only if there is no plan yet.
        """
        separation = None
        if concurrent is not False:
            separation = "0.001" if concurrent is True else _value(concurrent)
        listener = None
        if on_improvement:
            def listener(cost: str, bound: str, gap: float, steps: int) -> bool | None:
                return on_improvement(_number(cost), _number(bound), gap, steps)

        found = self._native.plan(
            minimize=[minimize] if isinstance(minimize, str) else list(minimize),
            pareto=pareto,
            alternatives=alternatives,
            concurrent=separation,
            horizon=horizon,
            engine=engine,
            strategy=strategy,
            confirm=confirm,
            time_limit=time_limit,
            memory_limit=memory_limit,
            certificate=certificate and os.fspath(certificate),
            on_improvement=listener,
        )
        return Front(found.json, found) if pareto else Plan(found.json, found)

    def certify(self, directory: File, **options: Any) -> Verification:
        """Plans, writes a certificate into a directory that does not exist yet, and checks it. ``options`` are those of :meth:`plan`."""
        self.plan(certificate=directory, **options)
        return verify(directory, self)

    def explain(self, design: str | None = None, *, time_limit: float | None = None) -> Answer:
        """Why a design is available or not, chosen or not, and what that is worth; without one, the smallest changes of measurements that lead to another plan."""
        return Answer(self._native.explain(design, time_limit))

    def compare(
        self,
        *,
        loss: tuple[str, float] | None = None,
        battery_unit: int | None = None,
        penalty: float | None = None,
        state_limit: int = 20_000_000,
    ) -> Comparison:
        """The plan beside the policies of probabilistic model checking (Cámara et al. 2020), all evaluated in one process.

        :param loss: the component that may be lost on the way, and with which probability at each move
        :param battery_unit: how much battery a level of the process stands for
        :param penalty: the time that a mission costs which does not get to its goal; ten times our plan's unless given
        """
        return Comparison(self._native.compare(loss, battery_unit, penalty, state_limit))

    def validate(self, plan: Plan | File, *, concurrent: bool = False, tolerance: float | str | Decimal = "0.001") -> Verdict:
        """What a plan does by the definition of PDDL: a :class:`Plan`, its text, a path, or a ``metaplan-plan/1`` document.

        ``tolerance`` says how far times may lie from the exact ones, in the domain's time unit.
        """
        if isinstance(plan, Plan):
            text = plan.to_json()
        elif isinstance(plan, str) and (plan.lstrip()[:1] in ("(", "{", ";", "") or ":" in plan):
            text = plan
        else:
            text = Path(plan).read_text()
        return Verdict(self._native.validate(text, concurrent, _value(tolerance)))

    def run(self, events: Iterable[Mapping[str, Any] | str], *, time_limit: float | None = None) -> Iterator[LoopAnswer]:
        """The loop: the first plan and request, then what follows from each event.

        An event is a line of JSON or a mapping with its fields. Where it has no ``time``, it is heard at the time that has passed since the start.
        """
        loop = Loop(self, time_limit=time_limit)
        yield from loop.start()
        for event in events:
            yield from loop.handle(event)

    async def arun(
        self, events: AsyncIterable[Mapping[str, Any] | str], *, time_limit: float | None = None
    ) -> AsyncIterator[LoopAnswer]:
        """As :meth:`run`, for `asyncio`: the event loop goes on while plans are made."""
        loop = Loop(self, time_limit=time_limit)
        for answer in await asyncio.to_thread(loop.start):
            yield answer
        async for event in events:
            for answer in await asyncio.to_thread(loop.handle, event):
                yield answer

    def __repr__(self) -> str:
        return f"<Mission {self.name}>"


class Loop:
    """The adaptation loop of one robot, which begins in a mission's present situation."""

    def __init__(self, mission: Mission, *, time_limit: float | None = None) -> None:
        self._native = _native.Loop(mission._native, time_limit)
        self._began = time.monotonic()

    def start(self) -> list[LoopAnswer]:
        """The first plan and the first request."""
        return list(map(_answer, self._native.start()))

    def handle(self, event: Mapping[str, Any] | str, now: float | None = None) -> list[LoopAnswer]:
        """What follows from an event, heard ``now`` seconds after the start."""
        line = event if isinstance(event, str) else json.dumps(dict(event))
        return list(map(_answer, self._native.handle(line, time.monotonic() - self._began if now is None else now)))


def _answer(line: str) -> LoopAnswer:
    fields = json.loads(line)
    return LoopAnswer(fields["answer"], fields)


def _number(text: str) -> Decimal:
    numerator, _, denominator = text.partition("/")
    return Decimal(numerator) / Decimal(denominator or 1)


def verify(certificate: File, mission: Mission | None = None, *, time_limit: float | None = None) -> Verification:
    """Checks a certificate without trusting the planner, and whether it is about a mission in its present situation."""
    return Verification(*_native.verify(os.fspath(certificate), mission and mission._native, time_limit))


def validate(domain: File, problem: File, plan: Plan | File, **options: Any) -> Verdict:
    """What a plan does by the definition of PDDL; ``options`` are those of :meth:`Mission.validate`."""
    return Mission.from_files(domain, problem).validate(plan, **options)


def reason(
    *documents: File,
    rules: Iterable[File] = (),
    fail: Iterable[str] = (),
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line has it
) -> Answer:
    """What follows from knowledge bases and rules: inferred assertions, availability of designs, objectives in error."""
    return Answer(
        _native.reason(
            [os.fspath(path) for path in documents],
            [os.fspath(rule) for rule in rules],
            list(fail),
            [(name, _value(value)) for name, value in (set or {}).items()],
        )
    )


def check(model: File, property: str, *, constants: Mapping[str, Any] | None = None, exact: bool | None = None) -> Answer:  # noqa: A002
    """The value of a property of a model in the PRISM language, a path or the model itself, with bounds that are proved.

    ``exact`` is whether to solve in rational numbers; while that is cheap, unless it is said.
    """
    if isinstance(model, str) and "\n" in model:
        name, text = "model", model
    else:
        name, text = os.fspath(model), Path(model).read_text()
    own = {key: _value(value) for key, value in (constants or {}).items()}
    return Answer(_native.check(name, text, property, own, exact))


def explain_code(code: str) -> Answer:
    """What a code of a message means, what causes it and what to do."""
    return Answer(_native.explain_code(code))


__all__ = ["File", "Loop", "Mission", "check", "exact", "explain_code", "reason", "validate", "verify"]
