"""Answers as objects; each keeps the JSON that it was made of."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from metaplan._errors import Message, messages_of

if TYPE_CHECKING:
    import pandas

    from metaplan._native import Planned

Number = int | Decimal
"""Exact: a fraction that is not a decimal is the nearest one."""


def exact(value: Any) -> Number | None:
    """A number of JSON that was read without loss."""
    return value if value is None or isinstance(value, int) else Decimal(value)


def load(text: str) -> dict[str, Any]:
    """JSON with exact numbers."""
    return json.loads(text, parse_float=Decimal)


def frame(rows: list[dict[str, Any]]) -> pandas.DataFrame:
    """A table, if pandas is there."""
    try:
        import pandas
    except ImportError as error:
        raise ImportError("`to_df` needs pandas: pip install 'metaplan[data]'") from error
    return pandas.DataFrame(rows)


class Answer:
    """What the program answers, with the fields of its JSON format."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._fields = load(text)

    def to_dict(self) -> dict[str, Any]:
        """The answer in its JSON format; ``format`` names that and its version."""
        return json.loads(self._text)

    def to_json(self) -> str:
        """The answer as text in its JSON format."""
        return self._text

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self._fields.get('format', '')}>"


@dataclass(frozen=True)
class Step:
    """An action of a plan, with its configuration."""

    action: str
    arguments: tuple[str, ...]
    configuration: dict[str, str]
    """The design of each function."""
    start: Number
    """In the domain's time unit."""
    duration: Number
    """In the domain's time unit."""
    cost: Number
    """What the step adds to the metric."""
    reconfigured: tuple[str, ...] = ()
    """Functions that change their design."""

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"

    @classmethod
    def _of(cls, own: dict[str, Any]) -> Step:
        return cls(
            action=own["action"],
            arguments=tuple(own["arguments"]),
            configuration=dict(own["configuration"]),
            start=exact(own["start"]),
            duration=exact(own["duration"]),
            cost=exact(own["cost"]),
            reconfigured=tuple(own["reconfigured"]),
        )


class Plan(Answer):
    """A plan, and what is proved of it; ``steps`` is empty where there is none."""

    def __init__(self, text: str, planned: Planned | None = None) -> None:
        super().__init__(text)
        own = self._fields
        self.mission: str = own["mission"]
        self.status: str = own["status"]
        """``optimal``, ``feasible``, ``unsolvable``, ``unsolvable_within_horizon`` or ``unknown``."""
        self.cost: Number | None = exact(own["cost"])
        """By the metric, or by the first objective."""
        self.lower_bound: Number | None = exact(own["lower_bound"])
        """No plan costs less."""
        self.steps: list[Step] = [Step._of(step) for step in own["steps"]]
        self.proof: dict[str, Any] | None = own["proof"]
        self.horizon: int = own["horizon"]
        self.makespan: Number | None = exact(own.get("makespan"))
        """Where actions overlap, in the domain's time unit."""
        self.objectives: dict[str, Number] = {
            objective["minimize"]: exact(objective["value"]) for objective in own.get("objectives") or []
        }
        self.blocking: list[str] = own.get("blocking") or []
        """Where there is no plan: designs without which there is none."""
        self.statistics: dict[str, Any] = own["statistics"]
        self.verdict: str = planned.verdict if planned else self.status
        """What is claimed, and what proves it."""
        self.text: str | None = planned.text if planned else None
        """The plan with a step on each line, as validators read it."""
        self.warnings: list[Message] = messages_of(planned.warnings) if planned else []
        self._planned = planned

    @property
    def optimal(self) -> bool:
        """Whether it is proved that no plan is better."""
        return self.status == "optimal"

    @property
    def alternatives(self) -> list[list[Step]]:
        """Further plans that are as good."""
        found = self._fields.get("alternatives") or {"plans": []}
        return [[Step._of(step) for step in plan] for plan in found["plans"]]

    def __bool__(self) -> bool:
        return self.cost is not None

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self):
        return iter(self.steps)

    def __repr__(self) -> str:
        return f"<Plan of {self.mission or 'a problem'}: {self.verdict}>"

    def __str__(self) -> str:
        return self.text or self.verdict

    def to_df(self) -> pandas.DataFrame:
        """A row for each step: start, duration and cost as floats, a column for each function's design."""
        return frame(
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
        """The plan as a timeline; ``None`` if there is none."""
        return self._planned.svg() if self._planned else None

    def _repr_html_(self) -> str:
        head = f"<p><b>{html.escape(self.mission)}</b>: {html.escape(self.verdict)}</p>"
        # A page has no place for the declaration of a file.
        return head + (self.svg() or "").partition("?>\n")[2]


class Front(Answer):
    """The plans of which no other one is better by one of two objectives and not worse by the other."""

    def __init__(self, text: str, planned: Planned | None = None) -> None:
        super().__init__(text)
        self.mission: str = self._fields["mission"]
        self.status: str = self._fields["status"]
        """``optimal`` if it is proved that there are no others."""
        self.objectives: list[str] = self._fields["objectives"]
        plain = json.loads(text)["points"]
        self.points: list[Plan] = [Plan(json.dumps(point)) for point in plain]
        self.warnings: list[Message] = messages_of(planned.warnings) if planned else []

    def __len__(self) -> int:
        return len(self.points)

    def __iter__(self):
        return iter(self.points)

    def to_df(self) -> pandas.DataFrame:
        """A row for each plan: the value of each objective, and the number of steps."""
        return frame(
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
    """The plan beside the policies of probabilistic model checking, all evaluated in one process."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """Ways to decide, ``kind`` `a` to `f` and ``name``, with the measures of each; ``None`` where one has no value."""
        return self.to_dict()["comparisons"][0]["candidates"]

    @property
    def front(self) -> list[tuple[float, float]]:
        """The front of the process's policies: probability of the goal, and time."""
        return [(first, second) for first, second in self.to_dict()["comparisons"][0]["front"]]

    def to_df(self) -> pandas.DataFrame:
        """A row for each candidate, a column for each measure."""
        return frame(self.candidates)

    def _repr_html_(self) -> str:
        measures = [name for name in self.candidates[0] if name not in ("kind", "name")]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in ["", *measures])
        rows = []
        for own in self.candidates:
            cells = ("" if own[name] is None else f"{own[name]:.4g}" for name in measures)
            rows.append(f"<tr><td>{html.escape(own['name'])}</td>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
        return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


class Verdict(Answer):
    """What the validator says of a plan."""

    @property
    def valid(self) -> bool:
        """Whether the plan can be executed and reaches the goal."""
        return self._fields["valid"]

    @property
    def metric(self) -> Number | None:
        """What it comes to by the problem's metric."""
        return exact(self._fields.get("metric"))

    @property
    def violation(self) -> dict[str, Any] | None:
        """Why it is not valid: step, action and message."""
        return self._fields.get("violation")

    def __bool__(self) -> bool:
        return self.valid


class Verification(Answer):
    """What came of checking a certificate."""

    def __init__(self, text: str, shown: str) -> None:
        super().__init__(text)
        self._shown = shown

    @property
    def verified(self) -> bool:
        """Whether the claim is proved."""
        return self._fields["verified"]

    @property
    def claim(self) -> Any:
        """What the certificate claims."""
        return self._fields["claim"]

    @property
    def parts(self) -> list[dict[str, Any]]:
        """Part by part: ``part``, ``verified`` and ``message``."""
        return self._fields["parts"]

    def __bool__(self) -> bool:
        return self.verified

    def __str__(self) -> str:
        return self._shown


@dataclass(frozen=True)
class LoopAnswer:
    """What the loop answers to an event; ``kind`` is its ``answer``."""

    kind: str
    fields: dict[str, Any] = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """The line in its JSON format."""
        return dict(self.fields)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.fields[name]
        except KeyError:
            raise AttributeError(f"an answer {self.kind!r} has no {name!r}") from None
