"""CDR of every type that our program knows against `rosbags`, byte for byte and both ways, and the type hashes.

Random values, seeded by the type's name. One way: the same value is written by both, and the octets are compared. The
other way: what our program reads from the octets of `rosbags` is written by `rosbags` again. Hashes (RIHS01, Jazzy)
are compared with `rosbags` and, where it knows the type, with `ros2-pyterfaces`.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
from typing import Any

import numpy
import ros2_pyterfaces.core as pyterfaces
from ros2_pyterfaces.core import all_msgs, all_srvs

import codec

VALUES = 24
_INTEGERS = {f"int{n}": (-(2 ** (n - 1)), 2 ** (n - 1) - 1) for n in (8, 16, 32, 64)}
_INTEGERS |= {f"uint{n}": (0, 2**n - 1) for n in (8, 16, 32, 64)} | {"char": (0, 255)}
_INTEGERS |= {
    "byte": (0, 127)
}  # a single byte is signed for rosbags, and unsigned for others: what is the same in both
_FLOATS = {
    "float32": (0.0, -0.0, 1.0, -1.5, 2.0**-149, 3.4028234663852886e38, float(numpy.float32(0.1))),
    "float64": (0.0, -0.0, 0.1, 5e-324, -1.7976931348623157e308, 1 / 3),
}
_STRINGS = ("", "a", "ab", "abc", "abcd", "tiefe Gewässer", "水の視界", 'line\nbreak "quoted"', "x" * 70_001)


class Rust:
    """The example program of our crate: JSON lines in, JSON lines out."""

    def __init__(self, program: str) -> None:
        self._process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, **question: Any) -> dict[str, Any]:
        """Sends a question and returns the answer."""
        self._process.stdin.write(json.dumps(question) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the program ended at {json.dumps(question)[:200]}")
        return json.loads(line)

    def close(self) -> int:
        """Ends the program and returns its exit status."""
        self._process.stdin.close()
        return self._process.wait()


def value_of(description: Any, types: Any, draw: random.Random, plain: bool) -> Any:
    """Returns a random value. With `plain`, its strings are short."""
    kind, detail = int(description[0]), description[1]
    if kind == codec.NAME:
        return {name: value_of(field, types, draw, plain) for name, field in codec.fields(detail, types)}
    if kind == codec.ARRAY:
        return [value_of(detail[0], types, draw, plain) for _ in range(detail[1])]
    if kind == codec.SEQUENCE:
        return [value_of(detail[0], types, draw, True) for _ in range(draw.choice((0, 1, 2, 5)))]
    base = detail[0]
    if base == "bool":
        return draw.random() < 0.5
    if base in _FLOATS:
        return draw.choice(_FLOATS[base])
    if base in _INTEGERS:
        least, most = _INTEGERS[base]
        return draw.choice((least, most, 0, draw.randint(least, most)))
    return draw.choice(_STRINGS[:-1] if plain else _STRINGS)


def compare(rust: Rust, name: str, variant: str | None, types: Any) -> list[str]:
    """Returns the differences for all random values of a type."""
    draw, found = random.Random(f"{variant} {name}"), []
    for count in range(VALUES):
        value = value_of((codec.NAME, name), types, draw, False)
        ours = rust.ask(type=name, value=value, **({"variant": variant} if variant else {}))
        theirs = codec.encode(name, value, types)
        if ours.get("cdr") != theirs.hex():
            found.append(f"value {count}: ours {str(ours)[:300]}, rosbags {theirs.hex()[:300]}")
        read = rust.ask(type=name, cdr=theirs.hex(), **({"variant": variant} if variant else {}))
        if "value" not in read:
            found.append(f"value {count} cannot be read: {str(read)[:300]}")
        elif codec.encode(name, read["value"], types) != theirs:
            found.append(f"value {count} is read as {json.dumps(read['value'])[:300]}")
    return found


def rubbish(rust: Rust, name: str, variant: str | None, types: Any) -> list[str]:
    """Checks that shortened octets and very large lengths are refused or read, and never end the program."""
    octets = codec.encode(name, value_of((codec.NAME, name), types, random.Random(name), True), types)
    for length in sorted({4, 5, len(octets) // 2, max(len(octets) - 1, 4)}):
        rust.ask(type=name, cdr=octets[:length].hex(), **({"variant": variant} if variant else {}))
    huge = "00010000" + "ffffffff" * 8
    rust.ask(type=name, cdr=huge, **({"variant": variant} if variant else {}))
    return []


# `ros2-pyterfaces` has the Humble definitions of these types. Jazzy added `variance` to `Range`.
OUTDATED_IN_PYTERFACES = {"sensor_msgs/msg/Range"}


def of_pyterfaces(name: str) -> str | None:
    """Returns the hash of `ros2-pyterfaces`, or `None` if it does not have the current definition of the type."""
    if name in OUTDATED_IN_PYTERFACES:
        return None
    _, kind, short = name.split("/")
    module = all_msgs if kind == "msg" else all_srvs
    schema = getattr(module, short, None)
    if schema is None or schema.get("__typename") != name:
        return None
    return pyterfaces.hash_rihs01(schema)


def main() -> int:
    """Compares everything. The exit status is 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="the built example `cdr` of metaplan-ros")
    rust = Rust(parser.parse_args().program)
    stores: dict[str | None, Any] = {None: codec.STORE}
    failures, compared, hashed, twice = 0, 0, 0, 0
    for entry in rust.ask(list=True)["types"]:
        name, variant = entry["type"], entry.get("variant")
        types = stores.setdefault(variant, None) or codec.store(variant)
        stores[variant] = types
        if name not in types.types:
            print(f"FAILED {name} ({variant or 'jazzy'}): the peers have no definition of it")
            failures += 1
            continue
        problems = []
        if entry["structure"]:
            problems += compare(rust, name, variant, types) + rubbish(rust, name, variant, types)
            compared += 1
        expected = codec.type_hash(name, types)
        hashed += 1
        if entry["rihs01"] != expected:
            problems.append(f"hash {entry['rihs01']}, rosbags {expected}")
        independent = of_pyterfaces(name) if variant is None else None
        if independent is not None:
            twice += 1
            if entry["rihs01"] != independent:
                problems.append(f"hash {entry['rihs01']}, ros2-pyterfaces {independent}")
        for problem in problems:
            print(f"FAILED {name} ({variant or 'jazzy'}): {problem}")
        failures += bool(problems)
    if rust.close() != 0:
        print("FAILED the program did not end with status 0")
        failures += 1
    print(f"cdr: {compared} types, {VALUES} values each, both ways; {hashed} hashes with rosbags, {twice} of them also")
    print(f"with ros2-pyterfaces; {failures} types differ. Not comparable as JSON: NaN and infinities.")
    return 1 if failures or not compared else 0


if __name__ == "__main__":
    sys.exit(main())
