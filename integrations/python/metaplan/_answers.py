"""Answers as objects; each keeps the JSON document that it was read from."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, cast

from metaplan._errors import Message, messages_of

if TYPE_CHECKING:
    import pandas

    from metaplan._native import Planned

Number = int | Decimal | Fraction
"""An exact number: ``int`` or ``Decimal``. If a value of a plan has no finite decimal (1/3), all its numbers are ``int`` or ``Fraction``.

So the numbers of one plan can be added and compared with each other.
"""


def exact(value: Any) -> Number | None:
    """Converts a number of a JSON document without loss; ``None`` stays ``None``."""
    return value if value is None or isinstance(value, int) else Decimal(value)


def _load(text: str) -> dict[str, Any]:
    """Parses a JSON object; numbers with decimals become ``Decimal``."""
    return cast("dict[str, Any]", json.loads(text, parse_float=Decimal))


def _frame(rows: list[dict[str, Any]]) -> pandas.DataFrame:
    """Returns a table with the given rows; raises ``ImportError`` if pandas is not installed."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("`to_df` needs pandas: pip install 'metaplan[data]'") from error
    return pandas.DataFrame(rows)


class Answer:
    """An answer in one of the program's JSON formats."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._fields = _load(text)

    def to_dict(self) -> dict[str, Any]:
        """Returns the JSON document; its ``format`` names the format and its version."""
        return cast("dict[str, Any]", json.loads(self._text))

    def to_json(self) -> str:
        """Returns the JSON document as text."""
        return self._text

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._fields.get('format', '')}>"


@dataclass(frozen=True)
class Step:
    """An action of a plan with its configuration."""

    action: str
    """Name of the action."""
    arguments: tuple[str, ...]
    """Arguments in the order of the action's parameters."""
    configuration: dict[str, str]
    """Design of each function."""
    start: Number
    """Start time in the domain's time unit."""
    duration: Number
    """Duration in the domain's time unit; 0 for actions without duration."""
    cost: Number
    """Contribution of the step to the metric."""
    reconfigured: tuple[str, ...] = ()
    """Functions whose design changes at this step."""

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"


class _Numbers:
    """Reads the exact numbers of a plan: ``int`` and ``Fraction`` if one of them has no finite decimal, else ``int`` and ``Decimal``."""

    def __init__(self, texts: Iterable[str | None]) -> None:
        self._fractions = any(text is not None and "/" in text for text in texts)

    def read(self, text: str) -> Number:
        """Parses ``3``, ``3.5`` or ``1/3``."""
        if self._fractions:
            value = Fraction(text)
            return value.numerator if value.denominator == 1 else value
        return Decimal(text) if "." in text else int(text)

    def maybe(self, text: str | None) -> Number | None:
        """Parses a number; ``None`` stays ``None``."""
        return None if text is None else self.read(text)

    def steps(self, steps: list[dict[str, Any]], numbers: list[list[str]]) -> list[Step]:
        """Builds the steps of a plan from their JSON objects and the exact texts of start, duration and cost."""
        return [
            Step(
                action=step["action"],
                arguments=tuple(step["arguments"]),
                configuration=dict(step["configuration"]),
                start=self.read(start),
                duration=self.read(duration),
                cost=self.read(cost),
                reconfigured=tuple(step["reconfigured"]),
            )
            for step, (start, duration, cost) in zip(steps, numbers, strict=True)
        ]


def _texts(value: Any) -> Iterator[str]:
    """Yields all strings in nested lists and dictionaries."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for own in value.values() if isinstance(value, dict) else value:
            yield from _texts(own)


class Plan(Answer):
    """A plan with its proof; ``steps`` is empty if there is no plan."""

    def __init__(self, text: str, exact_numbers: dict[str, Any], planned: Planned | None = None) -> None:
        super().__init__(text)
        answer, numbers = self._fields, _Numbers(_texts(exact_numbers))
        self.mission: str = answer["mission"]
        """Name of the mission."""
        self.status: str = answer["status"]
        """``optimal``, ``feasible``, ``unsolvable``, ``unsolvable_within_horizon`` or ``unknown``."""
        self.cost: Number | None = numbers.maybe(exact_numbers["cost"])
        """Value of the metric, or of the first objective; ``None`` without a plan."""
        self.lower_bound: Number | None = numbers.maybe(exact_numbers["lower_bound"])
        """Bound on the metric: no plan has a better value. ``None`` if nothing is proved."""
        self.steps: list[Step] = numbers.steps(answer["steps"], exact_numbers["steps"])
        """Actions in order of execution."""
        self.proof: dict[str, Any] | None = answer["proof"]
        """Proof of the status; ``None`` if there is none."""
        self.horizon: int = answer["horizon"]
        """Number of steps up to which better plans are excluded; 0 if no such number was determined."""
        self.makespan: Number | None = numbers.maybe(exact_numbers["makespan"])
        """End of the last action if actions may overlap, in the domain's time unit; otherwise ``None``."""
        names = [objective["minimize"] for objective in answer.get("objectives") or []]
        self.objectives: dict[str, Number] = {
            name: numbers.read(value) for name, value in zip(names, exact_numbers["objectives"], strict=True)
        }
        """Value of each objective of ``minimize`` or ``pareto``."""
        self.blocking: list[str] = answer.get("blocking") or []
        """If no plan exists: a minimal list of unavailable designs, at least one of which has to become available."""
        self.statistics: dict[str, Any] = answer["statistics"]
        """Counters and times of the search."""
        self.verdict: str = planned.verdict if planned else self.status
        """The status and its proof in a sentence; for a point of a front, the status only."""
        self.text: str | None = planned.text if planned else None
        """The plan as validators read it, a step on each line; ``None`` without a plan and for a point of a front."""
        self.warnings: list[Message] = messages_of(planned.warnings) if planned else []
        """Warnings about the mission's files."""
        self._alternatives = [
            numbers.steps(plan, own)
            for plan, own in zip(
                (answer.get("alternatives") or {"plans": []})["plans"], exact_numbers["alternatives"], strict=True
            )
        ]
        self._planned = planned
        self._svg: str | None = None

    @property
    def optimal(self) -> bool:
        """``True`` if it is proved that no plan is better."""
        return self.status == "optimal"

    @property
    def alternatives(self) -> list[list[Step]]:
        """Further plans with the same cost, for ``plan(alternatives=N)``."""
        return self._alternatives

    def __bool__(self) -> bool:
        return self.cost is not None

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[Step]:
        return iter(self.steps)

    def __repr__(self) -> str:
        return f"<Plan of {self.mission or 'a problem'}: {self.verdict}>"

    def __str__(self) -> str:
        return self.text or self.verdict

    def to_df(self) -> pandas.DataFrame:
        """Returns a row for each step: start, duration and cost as floats, and a column for each function's design."""
        return _frame(
            [
                {
                    "start": float(step.start),
                    "duration": float(step.duration),
                    "action": step.action,
                    "arguments": " ".join(step.arguments),
                    "cost": float(step.cost),
                    **step.configuration,
                }
                for step in self.steps
            ]
        )

    def svg(self) -> str | None:
        """Returns the plan as a timeline in SVG; ``None`` without a plan, and for a point of a front."""
        if self._svg is None and self._planned:
            self._svg = self._planned.svg()
        return self._svg

    def _repr_html_(self) -> str:
        head = f"<p><b>{html.escape(self.mission)}</b>: {html.escape(self.verdict)}</p>"
        # HTML does not allow an XML declaration.
        return head + (self.svg() or "").partition("?>\n")[2]

    def __getstate__(self) -> dict[str, Any]:
        # The native object cannot be pickled. Only the picture needs it.
        return {**self.__dict__, "_svg": self.svg(), "_planned": None}


class Front(Answer):
    """The Pareto front of two objectives: plans that no other plan dominates."""

    def __init__(self, text: str, exact_numbers: dict[str, Any], planned: Planned) -> None:
        super().__init__(text)
        self.mission: str = self._fields["mission"]
        """Name of the mission."""
        self.status: str = self._fields["status"]
        """``optimal`` if it is proved that the front is complete; otherwise as :attr:`Plan.status`."""
        self.objectives: list[str] = self._fields["objectives"]
        """The two objectives."""
        points = json.loads(text)["points"]
        self.points: list[Plan] = [
            Plan(json.dumps(point), own) for point, own in zip(points, exact_numbers["points"], strict=True)
        ]
        """A plan for each point of the front, sorted from the best by the first objective."""
        self.verdict: str = planned.verdict
        """The status in a sentence."""
        self.warnings: list[Message] = messages_of(planned.warnings)
        """Warnings about the mission's files."""

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self) -> Iterator[Plan]:
        return iter(self.points)

    def to_df(self) -> pandas.DataFrame:
        """Returns a row for each plan: the value of each objective as a float, and the number of steps."""
        return _frame(
            [
                {**{name: float(value) for name, value in point.objectives.items()}, "steps": len(point)}
                for point in self.points
            ]
        )

    def _repr_html_(self) -> str:
        cells = "".join(
            "<tr>" + "".join(f"<td>{value}</td>" for value in point.objectives.values()) + f"<td>{len(point)}</td></tr>"
            for point in self.points
        )
        head = "".join(f"<th>{html.escape(name)}</th>" for name in [*self.objectives, "steps"])
        return f"<table><tr>{head}</tr>{cells}</table>"


class Comparison(Answer):
    """The plan and the policies of probabilistic model checking, all evaluated in the same Markov decision process."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """Plans and policies: ``kind`` (`a` to `f`), ``name``, and each measure; ``None`` for a measure without a value."""
        return cast("list[dict[str, Any]]", self.to_dict()["comparisons"][0]["candidates"])

    @property
    def front(self) -> list[tuple[float, float]]:
        """Pareto front of the policies: expected time, and probability of reaching the goal without a collision."""
        return [(first, second) for first, second in self.to_dict()["comparisons"][0]["front"]]

    def to_df(self) -> pandas.DataFrame:
        """Returns a row for each candidate and a column for each measure."""
        return _frame(self.candidates)

    def _repr_html_(self) -> str:
        measures = [name for name in self.candidates[0] if name not in ("kind", "name")]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in ["", *measures])
        rows = []
        for own in self.candidates:
            cells = ("" if own[name] is None else f"{own[name]:.4g}" for name in measures)
            rows.append(f"<tr><td>{html.escape(own['name'])}</td>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
        return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


class Verdict(Answer):
    """The validator's verdict on a plan."""

    @property
    def valid(self) -> bool:
        """``True`` if the plan can be executed and reaches the goal."""
        return bool(self._fields["valid"])

    @property
    def metric(self) -> Number | None:
        """Value of the problem's metric; ``None`` for a plan that is not valid."""
        return exact(self._fields.get("metric"))

    @property
    def violation(self) -> dict[str, Any] | None:
        """First violation, with ``step``, ``action`` and ``message``; ``None`` for a valid plan."""
        return self._fields.get("violation")

    def __bool__(self) -> bool:
        return self.valid


class Verification(Answer):
    """The result of checking a certificate."""

    def __init__(self, text: str, shown: str) -> None:
        super().__init__(text)
        self._shown = shown

    @property
    def verified(self) -> bool:
        """``True`` if the claim is proved."""
        return bool(self._fields["verified"])

    @property
    def claim(self) -> Any:
        """The claim of the certificate."""
        return self._fields["claim"]

    @property
    def parts(self) -> list[dict[str, Any]]:
        """The result for each part of the certificate: ``part``, ``verified`` and ``message``."""
        return cast("list[dict[str, Any]]", self._fields["parts"])

    def __bool__(self) -> bool:
        return self.verified

    def __str__(self) -> str:
        return self._shown


@dataclass(frozen=True, repr=False)
class LoopAnswer:
    """An answer of the adaptation loop; the fields of its JSON object are attributes."""

    kind: str
    """Type of the answer, the field ``answer`` of its JSON object."""
    fields: dict[str, Any] = field(hash=False)
    """All fields of the JSON object."""

    def to_dict(self) -> dict[str, Any]:
        """Returns the JSON object."""
        return dict(self.fields)

    def __getattr__(self, name: str) -> Any:
        # Copies are created without `__init__`, and look up special methods before they have
        # fields.
        fields = self.__dict__.get("fields", {})
        if name not in fields:
            raise AttributeError(f"an answer {self.__dict__.get('kind')!r} has no {name!r}")
        return fields[name]

    def __repr__(self) -> str:
        content = {name: value for name, value in self.fields.items() if name != "answer"}
        return f"LoopAnswer({', '.join([repr(self.kind), *(f'{name}={value!r}' for name, value in content.items())])})"
