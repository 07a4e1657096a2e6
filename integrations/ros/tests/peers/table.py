"""Compares the published mean reaction times of other managers in SUAVE with those of our runs.

    python table.py ../shared/real/suave_results report.json

The report is what `run.py published-manager published-reasoner --report report.json` writes.
"""

from __future__ import annotations

import argparse
import csv
import json
import statistics
import sys
from pathlib import Path

MANAGERS = ("bt", "metacontrol", "planta", "rosa_bt")
EXPERIMENTS = {1: "thrusters", 2: "water visibility", 3: "both"}
DIFFERENCE = """\
Theirs: 30 runs of the whole simulation (Gazebo and ArduSub) for each row; each number of the CSV is the mean of
one run, from the stamp of the diagnostic to the lifecycle event of the thrusters' node or to the parameter event of the
spiral's altitude; monitors publish at 1 Hz and managers may run with a period (MROS's
reasoner 1.5 s). Ours: the same stimuli without the simulation, at full speed on loopback, one run for each draw; from the
stamp to the answer of change_mode (as manager) or of /mros/request_configuration (as reasoner), by the machine's clock;
also the recovery of the thrusters counts. A lifecycle transition of the node below takes place after this answer. So the
two compare the time that a manager needs, not the time that a robot needs."""


def recorded(directory: Path, experiment: int, manager: str) -> list[float]:
    """Returns the mean reaction time (s) of each published run with at least one reaction."""
    path = directory / f"exp{experiment}-{manager}.csv"
    with path.open(newline="") as file:
        values = [float(row["mean reaction time (s)"]) for row in csv.DictReader(file)]
    return [value for value in values if value > 0]


def ours(report: list[dict[str, object]], experiment: int, role: str, vendor: str) -> list[list[float]]:
    """Returns the reaction times (ms) of each of our runs."""
    return [
        result["answered_ms"]
        for scenario in report
        for result in scenario["results"]
        if result["stream"].startswith(f"exp{experiment}/") and result["role"] == role and result["vendor"] == vendor
    ]


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="directory of the published CSV files")
    parser.add_argument("report", type=Path, help="report of our runs")
    arguments = parser.parse_args()
    report = json.loads(arguments.report.read_text())
    print("| experiment | manager | runs | mean ms | median ms | least ms | most ms |")
    print("|---|---|---|---|---|---|---|")
    for experiment, what in EXPERIMENTS.items():
        for manager in MANAGERS:
            values = [1e3 * value for value in recorded(arguments.results, experiment, manager)]
            row(experiment, what, f"{manager} (published)", len(values), values)
        for vendor in ("cyclonedds", "fastrtps"):
            for role in ("manager", "reasoner"):
                runs = ours(report, experiment, role, vendor)
                # The mean of each run, as in the published results.
                means = [statistics.mean(run) for run in runs if run]
                if means:
                    row(experiment, what, f"Metaplan as {role}, {vendor}", len(means), means)
    every = [ms for scenario in report for result in scenario["results"] for ms in result["answered_ms"]]
    if every:
        print(
            f"\nAll {len(every)} reactions of ours: median {statistics.median(every):.2f} ms, most {max(every):.2f} ms."
        )
    print(f"\n{DIFFERENCE}")
    return 0


def row(experiment: int, what: str, manager: str, runs: int, values: list[float]) -> None:
    """Prints one line of the table."""
    figures = (statistics.mean(values), statistics.median(values), min(values), max(values))
    print(f"| {experiment} {what} | {manager} | {runs} | " + " | ".join(f"{figure:.1f}" for figure in figures) + " |")


if __name__ == "__main__":
    sys.exit(main())
