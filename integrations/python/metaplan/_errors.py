"""Errors with all problems of an input, each with its position."""

from __future__ import annotations

import json
from dataclasses import dataclass


@dataclass(frozen=True)
class Message:
    """A problem of an input: an error or a warning."""

    code: str
    """Stable code of the cause; :func:`metaplan.explain_code` explains it."""
    severity: str
    """``error`` or ``warning``."""
    message: str
    """The problem and its remedy."""
    file: str | None = None
    """File of the problem, if it has one."""
    line: int | None = None
    """Line, from 1."""
    column: int | None = None
    """Column, from 1, in characters."""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return f"{place + ': ' if place else ''}{self.severity}[{self.code}]: {self.message}"


def messages_of(text: str) -> list[Message]:
    """Returns the messages in a JSON answer."""
    fields = ("code", "severity", "message", "file", "line", "column")
    return [
        Message(**{name: own[name] for name in fields if own.get(name) is not None})
        for own in json.loads(text)["messages"]
    ]


class Error(Exception):
    """All problems of an input for which there is no answer.

    ``code``, ``file``, ``line`` and ``column`` are those of the first message.
    """

    messages: list[Message]
    """All messages, in the order of the input."""

    def __init__(self, messages: list[Message]) -> None:
        super().__init__("\n".join(map(str, messages)))
        self.messages = messages

    @classmethod
    def _of(cls, text: str) -> Error:
        return cls(messages_of(text))

    @property
    def code(self) -> str:
        """Code of the first message."""
        return self.messages[0].code

    @property
    def file(self) -> str | None:
        """File of the first message."""
        return self.messages[0].file

    @property
    def line(self) -> int | None:
        """Line of the first message, from 1."""
        return self.messages[0].line

    @property
    def column(self) -> int | None:
        """Column of the first message, from 1, in characters."""
        return self.messages[0].column

    def __reduce__(self) -> tuple[type[Error], tuple[list[Message]]]:
        return type(self), (self.messages,)
