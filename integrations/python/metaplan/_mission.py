"""Missions (a knowledge base joined with a planning task), and the functions of the package."""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import threading
import time
from collections.abc import AsyncIterable, AsyncIterator, Callable, Iterable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, cast, overload

from metaplan import _native
from metaplan._answers import Answer, Comparison, Front, LoopAnswer, Plan, Verdict, Verification
from metaplan._errors import Message, messages_of

if TYPE_CHECKING:
    # Part of `typing` from Python 3.11 on.
    from typing_extensions import Unpack

File = str | os.PathLike[str]
"""A path, or for domains, problems and plans PDDL itself: a string that begins with ``(`` or ``;``."""


class PlanOptions(TypedDict, total=False):
    """Keywords of :meth:`Mission.plan` except ``pareto``, ``certificate`` and ``on_improvement``."""

    minimize: str | Iterable[str]
    alternatives: int | None
    concurrent: bool | float | str | Decimal | Fraction
    horizon: int | None
    engine: Literal["auto", "sat", "search"] | None
    strategy: str | None
    confirm: bool
    time_limit: float | None
    memory_limit: int | None


def _file(name: str, value: File) -> tuple[str, str | None]:
    if isinstance(value, str) and value.lstrip().startswith(("(", ";")):
        return name, value
    return os.fspath(value), None


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # Decimal notation of the shortest representation: neither 1e-07 nor 0.1000000000000000055. Classes derived from
        # `float`, for example that of numpy, have another `repr`.
        return format(Decimal(repr(float(value))), "f")
    return str(value)


def _absolute(path: File) -> str:
    return os.path.abspath(os.fspath(path))


def _document(path: File) -> str:
    """Returns the name of shipped rules unchanged, and any other path as an absolute path."""
    name = os.fspath(path)
    return name if name in ("coadaptation", "tomasys") else _absolute(name)


def _toml(value: Any) -> str:
    """Formats a value for a manifest (TOML)."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_text(str(key))} = {_toml(own)}" for key, own in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, (bool, int, float, Decimal)):
        return _value(value)
    return _text(os.fspath(value) if isinstance(value, os.PathLike) else str(value))


def _text(text: str) -> str:
    # TOML has no surrogate pairs, and permits no DEL.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


class Mission:
    """A mission in its present situation.

    :meth:`fail`, :meth:`set` and :meth:`scenario` change the situation; :meth:`copy` returns a mission that later changes do not affect.
    Threads may plan for one mission at the same time. A mission can be pickled: the copy reads the same files again, and
    :class:`pickle.UnpicklingError` is raised if they have changed.
    """

    def __init__(self, native: _native.Mission, source: _Source, changes: Iterable[tuple[str, ...]] = ()) -> None:
        self._native = native
        # Recipe for recreating the mission, because native objects cannot be pickled.
        self._source = source
        self._changes = list(changes)
        self._lock = threading.Lock()

    @classmethod
    def _of(cls, source: _Source) -> Mission:
        maker, arguments = source
        # The working directory may be another one when the mission is pickled.
        return cls(getattr(_native.Mission, maker)(*arguments), _portable(maker, arguments))

    def _change(self, *change: str) -> Mission:
        method, *arguments = change
        with self._lock:
            getattr(self._native, method)(*arguments)
            self._changes.append(change)
        return self

    def __reduce__(self) -> tuple[Callable[..., Mission], tuple[Any, ...]]:
        with self._lock:
            return _restored, (type(self), self._source, tuple(self._changes), self._native.digest())

    @classmethod
    def load(cls, manifest: File | Mapping[str, Any], directory: File = ".") -> Mission:
        """Reads a manifest: a path, its text, or a mapping with its sections.

        Paths in a text or mapping are relative to ``directory``, and in a file to the file's directory.

        :raises metaplan.Error: with all problems of the manifest and of the files that it names
        """
        if isinstance(manifest, Mapping):
            manifest = "".join(f"{key} = {_toml(value)}\n" for key, value in manifest.items()) + "\n"
        if isinstance(manifest, str) and "\n" in manifest:
            return cls._of(("parse", ("manifest", manifest, os.fspath(directory))))
        return cls._of(("load", (os.fspath(manifest),)))

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
        """Joins a PDDL domain and problem, each a path or PDDL itself, with knowledge bases (OWL), if there are any.

        :param rules: files of rules, ``coadaptation`` (the default) or ``tomasys``
        :param bindings: the manifest's section ``[bindings]``
        :param names: object of the problem for each individual of the knowledge bases that has another name
        :param name: name of the mission
        :raises metaplan.Error: with all problems of the files
        """
        files = (_file("domain", domain), _file("problem", problem))
        documents = [os.fspath(path) for path in knowledge]
        own_rules = [os.fspath(rule) for rule in rules]
        return cls._of(("join", (name, files, documents, own_rules, dict(bindings or {}), list((names or {}).items()))))

    def copy(self) -> Mission:
        """Returns another mission in the same situation."""
        with self._lock:
            return Mission(self._native.copy(), self._source, self._changes)

    __copy__ = copy

    @property
    def name(self) -> str:
        """Name of the mission."""
        return self._native.name

    @property
    def description(self) -> str:
        """Description of the mission, from its manifest."""
        return self._native.description

    @property
    def scenarios(self) -> list[str]:
        """Names of the manifest's scenarios."""
        return self._native.scenarios

    @property
    def warnings(self) -> list[Message]:
        """Warnings about the mission's files."""
        return messages_of(self._native.warnings)

    def pddl(self) -> tuple[str, str]:
        """Returns domain and problem as PDDL, with the objects and facts that the knowledge base contributes."""
        return self._native.pddl()

    def scenario(self, name: str) -> Mission:
        """Applies a scenario of the manifest; returns the mission itself."""
        return self._change("scenario", name)

    def fail(self, *components: str) -> Mission:
        """Marks components as failed; returns the mission itself."""
        for component in components:
            self._change("fail", component)
        return self

    def set(self, *args: Any, **values: Any) -> Mission:
        """Sets measured attributes, numeric fluents and facts; returns the mission itself.

        Write ``set("ambient_light", 0.9)`` or ``set(battery=30, robot_at="wp2")``.
        """
        if args:
            name, value = args
            values = {name: value, **values}
        for name, value in values.items():
            self._change("set", name, _value(value))
        return self

    @overload
    def plan(
        self,
        *,
        pareto: None = None,
        certificate: File | None = None,
        on_improvement: Callable[[Decimal, Decimal, float, int], bool | None] | None = None,
        **options: Unpack[PlanOptions],
    ) -> Plan: ...

    @overload
    def plan(
        self,
        *,
        pareto: tuple[str, str],
        certificate: File | None = None,
        on_improvement: Callable[[Decimal, Decimal, float, int], bool | None] | None = None,
        **options: Unpack[PlanOptions],
    ) -> Front: ...

    def plan(
        self,
        *,
        minimize: str | Iterable[str] = (),
        pareto: tuple[str, str] | None = None,
        alternatives: int | None = None,
        concurrent: bool | float | str | Decimal | Fraction = False,
        horizon: int | None = None,
        engine: Literal["auto", "sat", "search"] | None = None,
        strategy: str | None = None,
        confirm: bool = False,
        time_limit: float | None = None,
        memory_limit: int | None = None,
        certificate: File | None = None,
        on_improvement: Callable[[Decimal, Decimal, float, int], bool | None] | None = None,
    ) -> Plan | Front:
        """Returns a plan of least cost with its configuration and proof; with ``pareto`` the :class:`Front` of two objectives.

        :param minimize: objectives in place of the problem's metric, the most important first
        :param pareto: two objectives
        :param alternatives: maximum number of further plans of the same cost
        :param concurrent: actions may overlap; a number is the least distance in time of actions that interfere (0.001), in the
            domain's time unit
        :param horizon: maximum number of steps
        :param engine: ``auto``, ``sat`` or ``search``
        :param strategy: of the SAT solver: ``auto``, ``tighten`` or ``cores``
        :param confirm: let the SAT solver confirm what is proved without it, however long that takes
        :param time_limit: in seconds; the best plan until then is returned, as it is after Ctrl-C
        :param memory_limit: in megabytes, for the states that searches store
        :param certificate: a directory that does not exist yet; :func:`metaplan.verify` checks what is written there. A
            result without a proof that a certificate can express, for example at a limit, is an error; the plan is then
            not returned
        :param on_improvement: called with cost, bound, gap (their distance, divided by the cost) and number of steps for better plans and
            better bounds; planning ends when it returns ``False``
        :raises metaplan.Error: if the mission cannot be planned for
        :raises KeyboardInterrupt: after Ctrl-C, if there is no plan yet or no certificate for it, or with ``pareto``
        """
        separation = None
        if concurrent is not False:
            separation = "0.001" if concurrent is True else _value(concurrent)
        listener = None
        if on_improvement is not None:
            heard = on_improvement

            def listener(cost: str, bound: str, gap: float, steps: int) -> bool | None:
                return heard(_number(cost), _number(bound), gap, steps)

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
            certificate=None if certificate is None else os.fspath(certificate),
            on_improvement=listener,
        )
        numbers = json.loads(found.exact)
        return Front(found.json, numbers, found) if pareto else Plan(found.json, numbers, found)

    def certify(self, directory: File, **options: Unpack[PlanOptions]) -> Verification:
        """Plans, writes a certificate into a directory that does not exist yet, and checks it.

        ``options`` are those of :meth:`plan`.
        """
        self.plan(certificate=directory, **options)
        return verify(directory, self)

    def explain(self, design: str | None = None, *, time_limit: float | None = None) -> Answer:
        """Explains why a design is available or chosen, or why not, and the difference in cost.

        Without ``design``: the smallest changes of measurements that lead to another plan.
        """
        return Answer(self._native.explain(design, time_limit))

    def compare(
        self,
        *,
        loss: tuple[str, float] | None = None,
        battery_unit: int | None = None,
        penalty: float | None = None,
        state_limit: int = 20_000_000,
    ) -> Comparison:
        """Compares the plan with policies of probabilistic model checking (Cámara et al. 2020) in one Markov decision process.

        :param loss: a component that may fail, and the probability of its failure at each move
        :param battery_unit: battery charge of one level of the process
        :param penalty: time that is added for a mission that does not reach its goal; by default ten times the time of the plan, at least 10
        :param state_limit: maximum number of states of the process
        """
        return Comparison(self._native.compare(loss, battery_unit, penalty, state_limit))

    def validate(self, plan: Plan | File, *, concurrent: bool = False, tolerance: float | str | Decimal = "0.001") -> Verdict:
        """Executes a plan by the definition of PDDL: a :class:`Plan`, its text, a path, or a ``metaplan-plan/1`` document.

        A string is a path unless it is empty, begins with ``(``, ``{`` or ``;``, or has a colon. A
        :class:`pathlib.Path` is always a path.

        :param concurrent: actions may overlap
        :param tolerance: maximum difference of times from the exact ones, in the domain's time unit
        """
        if isinstance(plan, Plan):
            text = plan.to_json()
        elif isinstance(plan, str) and (plan.lstrip()[:1] in ("(", "{", ";", "") or ":" in plan):
            text = plan
        else:
            text = Path(plan).read_text()
        return Verdict(self._native.validate(text, concurrent, _value(tolerance)))

    def run(self, events: Iterable[Mapping[str, Any] | str], *, time_limit: float | None = None) -> Iterator[LoopAnswer]:
        """Runs the adaptation loop: yields the first plan and request, then the answers to each event.

        An event is a line of JSON or a mapping with its fields. An event without ``time`` has the time since the start of the loop.
        """
        loop = Loop(self, time_limit=time_limit)
        yield from loop.start()
        for event in events:
            yield from loop.handle(event)

    async def arun(
        self, events: AsyncIterable[Mapping[str, Any] | str], *, time_limit: float | None = None
    ) -> AsyncIterator[LoopAnswer]:
        """Runs the adaptation loop as :meth:`run` does, for `asyncio`: the event loop is not blocked while the planner works."""
        loop = Loop(self, time_limit=time_limit)
        for answer in await asyncio.to_thread(loop.start):
            yield answer
        async for event in events:
            for answer in await asyncio.to_thread(loop.handle, event):
                yield answer

    def __repr__(self) -> str:
        return f"<Mission {self.name}>"


class Loop:
    """The adaptation loop of one robot. It starts in a mission's present situation."""

    def __init__(self, mission: Mission, *, time_limit: float | None = None) -> None:
        self._native = _native.Loop(mission._native, time_limit)
        self._began = time.monotonic()

    def start(self) -> list[LoopAnswer]:
        """Returns the first plan and the first request."""
        return list(map(_answer, self._native.start()))

    def handle(self, event: Mapping[str, Any] | str, now: float | None = None) -> list[LoopAnswer]:
        """Returns the answers to an event that arrives ``now`` seconds after the start. Default: the present time."""
        line = event if isinstance(event, str) else json.dumps(dict(event))
        return list(map(_answer, self._native.handle(line, time.monotonic() - self._began if now is None else now)))


_Source = tuple[str, tuple[Any, ...]]
"""Name of the native constructor of a mission, and its arguments."""


def _portable(maker: str, arguments: tuple[Any, ...]) -> _Source:
    """Returns the source with absolute paths, so that it is valid in any working directory."""
    if maker == "load":
        return maker, (_absolute(arguments[0]),)
    if maker == "parse":
        name, text, directory = arguments
        return maker, (name, text, _absolute(directory))
    name, files, documents, rules, bindings, names = arguments
    files = tuple((path if text is not None else _absolute(path), text) for path, text in files)
    return maker, (name, files, list(map(_absolute, documents)), list(map(_document, rules)), bindings, names)


def _restored(cls: type[Mission], source: _Source, changes: tuple[tuple[str, ...], ...], digest: str) -> Mission:
    """Recreates a mission that was pickled, and checks that its files have not changed."""
    mission = cls._of(source)
    for change in changes:
        mission._change(*change)
    if mission._native.digest() != digest:
        raise pickle.UnpicklingError(
            f"the mission {mission.name!r} differs from the one that was pickled: its files or the version of metaplan have changed"
        )
    return mission


def _answer(line: str) -> LoopAnswer:
    fields = json.loads(line)
    return LoopAnswer(fields["answer"], fields)


def _number(text: str) -> Decimal:
    numerator, _, denominator = text.partition("/")
    return Decimal(numerator) / Decimal(denominator or 1)


def verify(certificate: File, mission: Mission | None = None, *, time_limit: float | None = None) -> Verification:
    """Checks a certificate without trusting the planner, and that it belongs to a mission in its present situation, if one is given.

    :param time_limit: in seconds
    """
    native = None if mission is None else mission._native
    return Verification(*_native.verify(os.fspath(certificate), native, time_limit))


def validate(
    domain: File,
    problem: File,
    plan: Plan | File,
    *,
    concurrent: bool = False,
    tolerance: float | str | Decimal = "0.001",
) -> Verdict:
    """Executes a plan by the definition of PDDL, as :meth:`Mission.validate` does."""
    return Mission.from_files(domain, problem).validate(plan, concurrent=concurrent, tolerance=tolerance)


def reason(
    *documents: File,
    rules: Iterable[File] = (),
    fail: Iterable[str] = (),
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line has it
) -> Answer:
    """Queries knowledge bases and rules: inferred assertions, availability of designs, objectives in error.

    :param rules: files of rules, ``coadaptation`` or ``tomasys``
    :param fail: components that have failed
    :param set: values of measured attributes
    """
    return Answer(
        _native.reason(
            [os.fspath(path) for path in documents],
            [os.fspath(rule) for rule in rules],
            list(fail),
            [(name, _value(value)) for name, value in (set or {}).items()],
        )
    )


def check(model: File, property: str, *, constants: Mapping[str, Any] | None = None, exact: bool | None = None) -> Answer:  # noqa: A002
    """Checks a property of a model in the PRISM language, a path or the model itself; the value has proved bounds.

    :param constants: values of the model's undefined constants
    :param exact: solve in rational numbers; by default only for models for which that is fast
    """
    if isinstance(model, str) and "\n" in model:
        name, text = "model", model
    else:
        name, text = os.fspath(model), Path(model).read_text()
    own = {key: _value(value) for key, value in (constants or {}).items()}
    return Answer(_native.check(name, text, property, own, exact))


def explain_code(code: str) -> Answer:
    """Explains a code of a message: its meaning, causes and remedies.

    :raises KeyError: if there is no such code
    """
    return Answer(_native.explain_code(code))

