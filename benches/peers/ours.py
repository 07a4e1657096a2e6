"""Tasks of our own beside public suites: generated missions with the optimum by the generator's search, and our missions as PDDL."""

import itertools
import json
import subprocess
import sys
from pathlib import Path

import factored
from planners import CLASSICAL, NUMERIC, ROOT, TEMPORAL

sys.path.insert(0, str(ROOT / "data"))
from fetch import data_path  # noqa: E402

TOOLS = data_path("tools")
# Rows of a table of costs, at most.
ROWS = 300_000
# Family, waypoints or pipelines, designs of each function, functions, seed.
GENERATED = [("ugv", 20, 6, 1, 1), ("ugv", 50, 6, 2, 1), ("ugv", 100, 12, 2, 1), ("ugv", 200, 12, 3, 1), ("uuv", 4, 3, 1, 1),
             ("uuv", 5, 3, 2, 705), ("uuv", 6, 3, 2, 705), ("uuv", 7, 3, 2, 1)]
FACTORED = [(50, 6, 4, 1), (100, 6, 4, 1), (200, 12, 4, 1)]
# Waypoints from which on the search of `factored.py` takes minutes.
LARGE = 200


def generate(arguments, script="gen_ratpa.py"):
    done = subprocess.run([sys.executable, str(TOOLS / script), *arguments], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.strip().splitlines()[-1])


def ratpa(family, n, m, k, seed, encodings, directory):
    """The instance's name and facts; its files are `NAME.ENCODING.domain.pddl` and `.problem.pddl`."""
    name = f"{family}-n{n}-m{m}-k{k}" + (f"-s{seed}" if seed != 1 else "")
    return name, generate(["--family", family, "--n", str(n), "--m", str(m), "--k", str(k), "--seed", str(seed), "--metric",
                           "weighted", "--enc", encodings, "--out", str(directory), "--name", name, "--oracle"])


def factored_instances(size, seed, directory, search=True):
    """Name, size, kind, encodings and, with `search`, optimum; without encoding b, and without c where its table is too long."""
    made = factored.Map(*size, seed)
    name = "factored-n{}-m{}-k{}".format(*size)
    kinds = [(NUMERIC, "n", True)] + [(CLASSICAL, "c", False)] * (made.classical_rows() <= ROWS)
    for kind, encoding, battery in kinds:
        Path(directory, f"{name}.{encoding}.domain.pddl").write_text(made.domain(battery))
        Path(directory, f"{name}.{encoding}.problem.pddl").write_text(made.problem(battery))
        optimum = made.optimum(battery) if search else None
        yield name, size, kind, encoding, "none" if search and optimum is None else optimum


def tasks(directory, program):
    """Name, encoding, kind, domain, problem, optimum by the generator (a number, "none", or None where nothing is known)."""
    directory = Path(directory)
    files = lambda name, encoding: [str(directory / f"{name}.{encoding}.{part}.pddl") for part in ("domain", "problem")]
    for arguments in GENERATED:
        name, facts = ratpa(*arguments, "c,n", directory)
        for encoding, kind, known in [("c", CLASSICAL, "opt_c"), ("n", NUMERIC, "opt_bn")]:
            yield name, encoding, kind, *files(name, encoding), facts[known][0] if facts[known] else "none"
    for name, _, kind, encoding, optimum in itertools.chain.from_iterable(
            factored_instances(size[:3], size[3], directory, size[0] < LARGE) for size in FACTORED):
        yield name, encoding, kind, *files(name, encoding), optimum
    for mission in sorted((ROOT / "missions").glob("*.toml")):
        place = directory / mission.stem
        done = subprocess.run([str(program), "export", "--to", "pddl", str(mission), "-o", str(place), "--quiet"],
                              capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{mission.name}: not exported: {done.stderr.strip()}", file=sys.stderr)
            continue
        text = (place / "domain.pddl").read_text()
        kind = TEMPORAL if ":durative-action" in text else NUMERIC if "(decrease" in text else CLASSICAL
        yield mission.stem, "mission", kind, str(place / "domain.pddl"), str(place / "problem.pddl"), None
