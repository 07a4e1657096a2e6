"""Values of ROS types to CDR and back, by `rosbags`, and the types' RIHS01 hashes.

A value going in is a dictionary (absent fields are zero), a value coming out is an object with the fields as
attributes. The wrapper types of services and actions are messages like all others.
"""

from __future__ import annotations

from typing import Any

import numpy
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from definitions import ACTIONS, CORRECTED, MESSAGES, SERVICES, VARIANTS

PADDING = "structure_needs_at_least_one_member"
BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4
_NUMPY = {
    "bool": "bool",
    "float32": "float32",
    "float64": "float64",
    "byte": "uint8",
    "octet": "uint8",
    "char": "uint8",
}
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


def _texts(variant: str | None) -> dict[str, str]:
    """Returns the texts of all types as messages, including those that ROS generates for services and actions."""
    changed = CORRECTED | VARIANTS.get(variant or "", {})
    texts = {name: changed.get(name, text) for name, text in MESSAGES.items()}
    texts |= {name: text for name, text in changed.items() if "/msg/" in name}
    for name, text in SERVICES.items():
        request, response = _parts(changed.get(name, text), 2)
        texts |= _service(name, request, response)
    for name, text in ACTIONS.items():
        goal, result, feedback = _parts(changed.get(name, text), 3)
        texts |= {f"{name}_Goal": goal, f"{name}_Result": result, f"{name}_Feedback": feedback}
        goal_id = "unique_identifier_msgs/UUID goal_id\n"
        response = "bool accepted\nbuiltin_interfaces/Time stamp"
        texts |= _service(f"{name}_SendGoal", f"{goal_id}{name}_Goal goal", response)
        texts |= _service(f"{name}_GetResult", goal_id, f"int8 status\n{name}_Result result")
        texts[f"{name}_FeedbackMessage"] = f"{goal_id}{name}_Feedback feedback"
    return texts


def _service(name: str, request: str, response: str) -> dict[str, str]:
    return {f"{name}_Request": request, f"{name}_Response": response}


def _named(name: str) -> Any:
    return (NAME, name)


def _at_most_one(name: str) -> Any:
    return (SEQUENCE, (_named(name), 1))


def _described(texts: dict[str, str]) -> dict[str, Any]:
    """Returns the types that appear in type descriptions only: services, service events and actions."""
    found: dict[str, Any] = {}
    for name in [name.removesuffix("_Request") for name in texts if name.endswith("_Request")]:
        request, response = f"{name}_Request", f"{name}_Response"
        info = ("info", _named("service_msgs/msg/ServiceEventInfo"))
        found[f"{name}_Event"] = ([], [info, ("request", _at_most_one(request)), ("response", _at_most_one(response))])
        parts = (("request_message", request), ("response_message", response), ("event_message", f"{name}_Event"))
        found[name] = ([], [(field, _named(kind)) for field, kind in parts])
    for name in ACTIONS:
        parts = (
            ("goal", f"{name}_Goal"),
            ("result", f"{name}_Result"),
            ("feedback", f"{name}_Feedback"),
            ("send_goal_service", f"{name}_SendGoal"),
            ("get_result_service", f"{name}_GetResult"),
            ("feedback_message", f"{name}_FeedbackMessage"),
        )
        found[name] = ([], [(field, _named(kind)) for field, kind in parts])
    return found


def store(variant: str | None = None) -> Any:
    """Returns the store of all types of a distribution, by default Jazzy."""
    types = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, Any] = {}
    texts = _texts(variant)
    replaced = CORRECTED | VARIANTS.get(variant or "", {})
    for name, text in texts.items():
        if name in types.types and name not in replaced:
            continue
        # The parser does not support services, so this is declared as a message of the same package.
        package = name.split("/")[0]
        ((constants, fields),) = get_types_from_msg(text, f"{package}/msg/Any").values()
        if not fields:  # ROS puts a byte into structures without members
            fields = [(PADDING, (BASE, ("uint8", 0)))]
        found[name] = (constants, fields)
    for name in set(replaced) & set(types.types):
        types.types.pop(name), types.fielddefs.pop(name)
    types.register(found | _described(texts))
    return types


STORE = store()


def fields(name: str, types: Any = STORE) -> list[tuple[str, Any]]:
    """Returns the fields of a type in the order of CDR."""
    return types.fielddefs[name][1]


def _zero(description: Any) -> Any:
    kind, detail = description
    if kind == BASE:
        return {"string": "", "wstring": "", "bool": False}.get(detail[0], 0)
    if kind == NAME:
        return {}
    if kind == ARRAY:
        return [_zero(detail[0])] * detail[1]
    return []


def _build(description: Any, value: Any, types: Any) -> Any:
    kind, detail = int(description[0]), description[1]
    if kind == BASE:
        return value
    if kind == NAME:
        return build(detail, value, types)
    element = detail[0]
    if int(element[0]) == BASE and element[1][0] in _NUMPY:
        return numpy.array(value, dtype=_NUMPY[element[1][0]])
    return [_build(element, item, types) for item in value]


def build(name: str, value: dict[str, Any], types: Any = STORE) -> Any:
    """Returns the `rosbags` object for a dictionary. An unknown key is a mistake in the test."""
    known = fields(name, types)
    unknown = set(value) - {field for field, _ in known}
    if unknown:
        raise KeyError(f"{name} has no field {sorted(unknown)}")
    return types.types[name](**{field: _build(kind, value.get(field, _zero(kind)), types) for field, kind in known})


def encode(name: str, value: dict[str, Any], types: Any = STORE) -> bytes:
    """Returns little-endian CDR with the encapsulation header of four octets."""
    return bytes(types.serialize_cdr(build(name, value, types), name))


def decode(name: str, octets: bytes) -> Any:
    """Decodes CDR with its encapsulation header. Raises an exception if the octets do not fit the type."""
    return STORE.deserialize_cdr(octets, name)


def type_hash(name: str, types: Any = STORE) -> str:
    """Returns the RIHS01 hash of a type."""
    return types.hash_rihs01(name)


def dds_name(name: str) -> str:
    """Returns the DDS name of a type: `pkg::msg::dds_::X_` for `pkg/msg/X`."""
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"
