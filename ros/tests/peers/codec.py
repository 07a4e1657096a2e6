"""Values of ROS types to CDR and back, by `rosbags`, and the types' RIHS01 hashes.

A value going in is a dictionary (absent fields are zero), a value coming out is an object with the fields as
attributes. The wrapper types of services and actions are messages like all others.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from definitions import ACTIONS, MESSAGES, SERVICES

PADDING = "structure_needs_at_least_one_member"
BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4
_NUMPY = {"bool": "bool", "float32": "float32", "float64": "float64", "byte": "uint8", "octet": "uint8", "char": "uint8"}
_NUMPY |= {f"{sign}int{width}": f"{sign}int{width}" for sign in ("", "u") for width in (8, 16, 32, 64)}


def _parts(text: str, count: int) -> list[str]:
    parts = [""]
    for line in text.splitlines():
        if line.strip() == "---":
            parts.append("")
        else:
            parts[-1] += line + "\n"
    if len(parts) != count:
        raise ValueError(f"{len(parts)} parts, expected {count}: {text!r}")
    return parts


def _texts() -> dict[str, str]:
    """All types as messages: what the middleware generates for services and actions is written out."""
    texts = dict(MESSAGES)
    for name, text in SERVICES.items():
        texts[f"{name}_Request"], texts[f"{name}_Response"] = _parts(text, 2)
    for name, text in ACTIONS.items():
        texts[f"{name}_Goal"], texts[f"{name}_Result"], texts[f"{name}_Feedback"] = _parts(text, 3)
        goal_id = "unique_identifier_msgs/UUID goal_id\n"
        texts[f"{name}_SendGoal_Request"] = goal_id + f"{name}_Goal goal"
        texts[f"{name}_SendGoal_Response"] = "bool accepted\nbuiltin_interfaces/Time stamp"
        texts[f"{name}_GetResult_Request"] = goal_id
        texts[f"{name}_GetResult_Response"] = f"int8 status\n{name}_Result result"
        texts[f"{name}_FeedbackMessage"] = goal_id + f"{name}_Feedback feedback"
    return texts


def _store() -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, Any] = {}
    for name, text in _texts().items():
        if name in store.types:
            continue
        # The parser knows no services: it is told that this is a message of the same package.
        package = name.split("/")[0]
        ((constants, fields),) = get_types_from_msg(text, f"{package}/msg/Any").values()
        if not fields:  # ROS puts a byte into structures without members
            fields = [(PADDING, (BASE, ("uint8", 0)))]
        found[name] = (constants, fields)
    store.register(found)
    return store


STORE = _store()


def fields(name: str) -> list[tuple[str, Any]]:
    """The fields of a type in the order of CDR."""
    return STORE.fielddefs[name][1]


def _zero(description: Any) -> Any:
    kind, detail = description
    if kind == BASE:
        return {"string": "", "wstring": "", "bool": False}.get(detail[0], 0)
    if kind == NAME:
        return {}
    if kind == ARRAY:
        return [_zero(detail[0])] * detail[1]
    return []


def _build(description: Any, value: Any) -> Any:
    kind, detail = int(description[0]), description[1]
    if kind == BASE:
        return value
    if kind == NAME:
        return build(detail, value)
    element = detail[0]
    if int(element[0]) == BASE and element[1][0] in _NUMPY:
        return numpy.array(value, dtype=_NUMPY[element[1][0]])
    return [_build(element, item) for item in value]


def build(name: str, value: dict[str, Any] | SimpleNamespace) -> Any:
    """The object of `rosbags` for a dictionary; an unknown key is a mistake of the test."""
    given = dict(value) if isinstance(value, dict) else vars(value)
    known = fields(name)
    unknown = set(given) - {field for field, _ in known}
    if unknown:
        raise KeyError(f"{name} has no field {sorted(unknown)}")
    return STORE.types[name](**{field: _build(kind, given.get(field, _zero(kind))) for field, kind in known})


def encode(name: str, value: dict[str, Any]) -> bytes:
    """Little-endian CDR with the encapsulation header of four octets."""
    return bytes(STORE.serialize_cdr(build(name, value), name))


def decode(name: str, octets: bytes) -> Any:
    """The value of a CDR text with its encapsulation header; raises where the text does not fit the type."""
    return STORE.deserialize_cdr(octets, name)


def type_hash(name: str) -> str:
    """RIHS01 of a message type."""
    return STORE.hash_rihs01(name)


def dds_name(name: str) -> str:
    """`pkg/msg/X` as DDS knows it: `pkg::msg::dds_::X_`."""
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"
