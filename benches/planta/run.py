#!/usr/bin/env python3
"""PLANTA's scalability sweep: Metaplan's whole way beside PLANTA's own, and what PLANTA's least number of actions costs.

    python3 benches/planta/run.py --venv DIR --install        # once: Fast Downward, from PyPI, into a virtual environment
    python3 benches/planta/run.py --venv DIR [--csv FILE]

The problems are those of navigation_planta (`../shared/real/planta/grid`, made with its own generator), with both of its domains. Metaplan
reads the domain, the problem and the knowledge base, reasons, plans and proves. Fast Downward gets the merged files, as
`metaplan export --to pddl` writes them: what PLANTA's converter takes for that (0.34 to 0.73 s for a problem, as published) is not in its
times; its own translation is. Times are of whole processes, processor and wall, the least of `--runs`. `lama-first` proves nothing.

The second table takes Fast Downward's plan and the joint optimum, both under one measure: a corridor takes the design's rate of energy, as
PLANTA has it (trunc(length * 0.68 * rate * 0.01)), and length / 0.68 seconds, on Cámara's map the mean that was measured for the design;
a change of designs takes SWITCH_TIME seconds and SWITCH_ENERGY. Corridors of the grid have GRID_LENGTH metres. A design suits a corridor as
PLANTA says: its accuracy and light are at least those required. The optimum of energy, and that of time, is planned by Metaplan with the
choice of designs free, where PLANTA's domain admits only the suitable design with the greatest utility. Standard library only.
"""

import argparse
import csv
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "data"))
from fetch import data_path  # noqa: E402

SPEED, GRID_LENGTH, SWITCH_TIME, SWITCH_ENERGY = 0.68, 10.0, 5.0, 100
# Rate of energy, accuracy, light that it brings along: as in navigation.owl.
DESIGNS = {
    "fd_amcl_kinect": (17790, 1.0, 0.0),
    "fd_amcl_lidar": (19790, 0.7, 0.0),
    "fd_mrpt_kinect": (18942, 0.9, 0.0),
    "fd_mrpt_lidar": (20942, 0.6, 0.0),
    "fd_aruco": (16963, 0.8, 0.0),
    "fd_aruco_headlamp": (26963, 0.8, 1.0),
}
# Whose measured times on Cámara's map stand for those of a design without.
TIMES = {"fd_mrpt_lidar": "mrpt-kinect", "fd_aruco_headlamp": "aruco"}
SAFE, DARK = 0.8, 1.0


def timed(command, directory, runs, limit):
    """Least processor and wall time in seconds, and the last output; None where it takes longer than the limit."""
    best = (float("inf"), float("inf"))
    output = ""
    for _ in range(runs):
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        try:
            output = subprocess.run(command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                    timeout=limit).stdout
        except subprocess.TimeoutExpired:
            return None, None, ""
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        best = (min(best[0], used), min(best[1], time.monotonic() - started))
    return *best, output


def downward(python, program, merged, search, runs, limit):
    """Fast Downward on merged files: processor and wall time, cost, the plan's actions."""
    plan = Path(merged) / "sas_plan"
    plan.unlink(missing_ok=True)
    options = ["--alias", "lama-first"] if search == "lama-first" else []
    tail = [] if options else ["--search", search]
    command = [python, program, *options, "--plan-file", str(plan), "domain.pddl", "problem.pddl", *tail]
    used, wall, output = timed(command, merged, runs, limit)
    found = re.search(r"Plan cost: (\d+)", output)
    actions = [line.strip("()\n ").split() for line in plan.read_text().splitlines() if line.startswith("(")] if plan.exists() else []
    return used, wall, int(found.group(1)) if found else None, actions


class Grid:
    """Corridors with what they require, from one of PLANTA's problems."""

    def __init__(self, problem):
        text = problem.read_text()
        self.requires = {}
        for kind, a, b, value in re.findall(r"\((safety|light)_requirement (\S+) (\S+) ([\d.]+)_decimal\)", text):
            self.requires.setdefault((a, b), {})[kind] = float(value)
        self.start = re.search(r"\(robot_at (\S+)\)", text).group(1)
        self.goal = re.search(r":goal \(and\s*\(robot_at (\S+)\)", text).group(1)

    def length(self, _):
        return GRID_LENGTH

    def seconds(self, corridor, _):
        return self.length(corridor) / SPEED


class CamaraMap:
    """Cámara's map: a corridor is dark where the least light measured is below half of the range, unsafe where there were bumps."""

    def __init__(self):
        summary = json.loads(data_path("reference/p2cp3_summary.json").read_text())
        self.requires, self.lengths, self.times = {}, {}, {}
        for arc in summary["arcs"]:
            light = DARK if arc.get("illum") and arc["illum"][0] < 40 else 0.0
            safety = SAFE if arc.get("hit") else 0.0
            for a, b in [(arc["a"], arc["b"]), (arc["b"], arc["a"])]:
                corridor = f"l{a}", f"l{b}"
                self.requires[corridor] = {"safety": safety, "light": light}
                self.lengths[corridor] = arc["len"]
                self.times[corridor] = {name: mean for name, (mean, _) in arc.get("time", {}).items()}
        self.start, self.goal = "l1", "l18"

    def length(self, corridor):
        return self.lengths[corridor]

    def seconds(self, corridor, design):
        measured = self.times[corridor].get(TIMES.get(design, design.removeprefix("fd_").replace("_", "-")))
        return measured if measured is not None else self.length(corridor) / SPEED

    def problem(self):
        """The same in PLANTA's form."""
        places = sorted({place for corridor in self.requires for place in corridor})
        lines = ["(define (problem navigation-problem)", "(:domain navigation-domain)", f"(:objects {' '.join(places)} - waypoint)", "(:init"]
        for (a, b), requires in self.requires.items():
            lines += [f"(corridor {a} {b})"]
            lines += [f"({kind}_requirement {a} {b} {value}_decimal)" for kind, value in requires.items()]
        lines += [f"(robot_at {self.start}))", f"(:goal (and (robot_at {self.goal}))))"]
        return "\n".join(lines)


def suits(design, requires):
    _, accuracy, light = DESIGNS[design]
    return accuracy >= requires["safety"] and light >= requires["light"]


def energy(world, corridor, design):
    return int(world.length(corridor) * SPEED * DESIGNS[design][0] * 0.01)


def measure(world, actions):
    """Time and energy of a plan of PLANTA's: actions `reconfigure` and `move`."""
    design, seconds, used, switches = None, 0.0, 0, 0
    for name, *arguments in actions:
        if name == "reconfigure":
            if design is not None:
                seconds, used, switches = seconds + SWITCH_TIME, used + SWITCH_ENERGY, switches + 1
            design = arguments[-1]
        else:
            corridor = arguments[0], arguments[1]
            assert suits(design, world.requires[corridor]), (design, corridor)
            seconds += world.seconds(corridor, design)
            used += energy(world, corridor, design)
    return seconds, used, switches


DOMAIN = """(define (domain joint) (:requirements :typing :numeric-fluents :negative-preconditions)
(:types place design) (:predicates (robot_at ?p - place) (using ?d - design) (begun) (suits ?d - design ?a ?b - place))
(:functions (total_energy) (total_time) (energy ?d - design ?a ?b - place) (seconds ?d - design ?a ?b - place))
(:action begin :parameters (?d - design) :precondition (not (begun)) :effect (and (begun) (using ?d)))
(:action switch :parameters (?d ?e - design) :precondition (and (using ?d) (not (using ?e)))
 :effect (and (not (using ?d)) (using ?e) (increase (total_energy) SWITCH_ENERGY) (increase (total_time) SWITCH_TIME)))
(:action move :parameters (?d - design ?a ?b - place) :precondition (and (using ?d) (robot_at ?a) (suits ?d ?a ?b))
 :effect (and (not (robot_at ?a)) (robot_at ?b) (increase (total_energy) (energy ?d ?a ?b)) (increase (total_time) (seconds ?d ?a ?b)))))
"""


def joint(metaplan, world, directory, metric):
    """The least of `total_energy` or `total_time`, proved."""
    domain, problem = Path(directory) / "joint-domain.pddl", Path(directory) / "joint-problem.pddl"
    domain.write_text(DOMAIN.replace("SWITCH_ENERGY", str(SWITCH_ENERGY)).replace("SWITCH_TIME", str(SWITCH_TIME)))
    places = sorted({place for corridor in world.requires for place in corridor})
    lines = [f"(define (problem j) (:domain joint) (:objects {' '.join(places)} - place {' '.join(DESIGNS)} - design) (:init",
             f"(robot_at {world.start}) (= (total_energy) 0) (= (total_time) 0)"]
    for (a, b), requires in world.requires.items():
        for design in DESIGNS:
            if suits(design, requires):
                lines.append(f"(suits {design} {a} {b}) (= (energy {design} {a} {b}) {energy(world, (a, b), design)}) "
                             f"(= (seconds {design} {a} {b}) {world.seconds((a, b), design):.4f})")
    lines.append(f") (:goal (robot_at {world.goal})) (:metric minimize ({metric})))")
    problem.write_text("\n".join(lines))
    command = [metaplan, "plan", str(domain), str(problem), "--format", "json", "--quiet"]
    answer = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True).stdout)
    assert answer["status"] == "optimal", answer["status"]
    actions = [("reconfigure", step["arguments"][-1]) if step["action"] != "move"
               else ("move", step["arguments"][1], step["arguments"][2], step["arguments"][0]) for step in answer["steps"]]
    return measure(world, actions)


def table(rows):
    widths = [max(len(str(row[column])) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(str(cell).rjust(width) for cell, width in zip(row, widths)) for row in rows)


def shown(value):
    return "-" if value is None else f"{value:.3f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--venv", type=Path, required=True)
    parser.add_argument("--install", action="store_true")
    parser.add_argument("--csv", type=Path)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--limit", type=float, default=300, help="seconds of wall clock for each process")
    arguments = parser.parse_args()
    if arguments.install:
        subprocess.run([sys.executable, "-m", "venv", str(arguments.venv)], check=True)
        subprocess.run([str(arguments.venv / "bin/pip"), "install", "--quiet", "up-fast-downward"], check=True)
        return
    if not data_path("real/planta/grid").exists():
        sys.exit("skipped: PLANTA's problems are not there")
    found = list(arguments.venv.glob("lib/python3*/site-packages/up_fast_downward/downward/fast-downward.py"))
    if not found:
        sys.exit("Fast Downward is not there: run with --install first")
    python, program = str(arguments.venv / "bin/python"), str(found[0])
    metaplan = str(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "metaplan")
    base, kb = data_path("real/pddl/navigation_planta"), data_path("real/owl/navigation_planta/navigation.owl")
    knowledge = ["--kb", str(kb), "--directory", str(data_path("real/owl")), "--quiet"]
    maps = sorted(data_path("real/planta/grid").iterdir(), key=lambda folder: int(folder.name.split("-")[1]))
    header = ["map", "domain", "cost", "metaplan cpu", "wall", "export", "blind cpu", "wall", "ratio", "lama cpu", "cost"]
    rows, worth = [header], [["map", "plan", "seconds", "energy", "changes", "time +%", "energy +%"]]
    with tempfile.TemporaryDirectory() as scratch:
        camara = CamaraMap()
        own = Path(scratch) / "camara"
        own.mkdir()
        (own / "problem.pddl").write_text(camara.problem())
        for folder in [*maps, own]:
            kinds = [("domain_sas", "problem"), ("domain_no_sas", "problem_no_sas")]
            for domain, name in kinds if folder != own else kinds[:1]:
                files = [str(base / f"{domain}.pddl"), str(folder / f"{name}.pddl")]
                used, wall, output = timed([metaplan, "plan", *files, *knowledge, "--format", "json"], ROOT, arguments.runs, arguments.limit)
                answer = json.loads(output)
                assert answer["status"] == "optimal", (folder.name, domain, answer["status"])
                merged = Path(scratch) / f"{folder.name}-{domain}"
                export, _, said = timed([metaplan, "export", *files, *knowledge, "--to", "pddl", "-o", str(merged)], ROOT, 1, arguments.limit)
                assert (merged / "domain.pddl").exists(), said
                blind, blind_wall, cost, actions = downward(python, program, merged, "astar(blind())", arguments.runs, arguments.limit)
                lama, _, first, _ = downward(python, program, merged, "lama-first", arguments.runs, arguments.limit)
                assert cost is None or cost == answer["cost"], (folder.name, domain, cost, answer["cost"])
                rows.append([folder.name, domain.removeprefix("domain_"), answer["cost"], shown(used), shown(wall), shown(export), shown(blind),
                             shown(blind_wall), "-" if blind is None else f"{blind / used:.0f}", shown(lama), first])
                print(table([header, rows[-1]]), file=sys.stderr, flush=True)
                if domain == "domain_sas" and actions:
                    world = camara if folder == own else Grid(folder / "problem.pddl")
                    least = measure(world, actions)
                    cheap, quick = (joint(metaplan, world, scratch, metric) for metric in ["total_energy", "total_time"])
                    for kind, (seconds, energy_used, switches) in [("least actions", least), ("least energy", cheap), ("least time", quick)]:
                        more = [f"{100 * (value / best - 1):.1f}" for value, best in [(seconds, quick[0]), (energy_used, cheap[1])]]
                        worth.append([folder.name, kind, f"{seconds:.1f}", energy_used, switches, *more])
    print(table(rows))
    print()
    print(table(worth))
    if arguments.csv:
        partial = arguments.csv.with_suffix(".partial")
        with partial.open("w", newline="") as file:
            csv.writer(file).writerows(rows)
        partial.rename(arguments.csv)


if __name__ == "__main__":
    main()
