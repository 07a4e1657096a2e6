#!/usr/bin/env python3
"""Metaplan beside other planners: the same instances, limits and core, to the proved optimum, as CSV and as a table.

    python3 benches/peers/run.py --venv DIR --install            # once: the peers, from PyPI, into a virtual environment
    python3 benches/peers/run.py --venv DIR --sizes 10,20 --csv peers.csv

Instances with one to three functions come from `../shared/tools/gen_ratpa.py`, those with four from `factored.py`. Every planner gets the encoding of an instance
that it reads: c and b are classical (b with a battery in discrete levels), n has numeric fluents; the optimum of b and n is
the same. Times are of the whole process and its children, from its start to its end, on one core (`taskset`). The
limit is on processor time, so that other load on the machine harms nobody; wall clock may be ten times as long. A planner
counts only if it ends by itself, claiming an optimum, and the claim is that of the generator's own search. A planner that
came to a limit is not run on instances of the same kind with at least as many waypoints, designs and functions
(`--all` runs it); these count as not proved, with status `skipped`. What the CSV file has already is not run again.
Standard library only.

`up-aries` 0.5.0 from PyPI is not among them: it proves no optimum of such problems by its own word (its `aries-opt` takes
hierarchical problems only, "optimality cannot be proven for generative planning").
"""

import argparse
import csv
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from ours import factored_instances, ratpa
from planners import CLASSICAL, NUMERIC, PACKAGES, planners
from process import run

# The encodings that a planner reads, by kind of instance.
ENCODINGS = {
    "metaplan": {NUMERIC: "n", CLASSICAL: "c"},
    "kairos": {NUMERIC: "n", CLASSICAL: "c"},
    "fd-lmcut": {NUMERIC: "b", CLASSICAL: "c"},
    "symk-bd": {NUMERIC: "b", CLASSICAL: "c"},
    "enhsp-hrmax": {NUMERIC: "n"},
}


def instances(options, directory):
    """Name, size, kind, the encodings of it, and the optimum by the generator's own search."""
    for k in options.functions:
        for m in options.designs:
            for n in options.sizes:
                size = (n, m, k)
                if k > 3:
                    yield from factored_instances(size, options.seed, directory)
                    continue
                name, facts = ratpa("ugv", n, m, k, options.seed, "c,b,n", directory)
                yield name, size, NUMERIC, "bn", facts["opt_bn"][0] if facts["opt_bn"] else "none"
                yield name, size, CLASSICAL, "c", facts["opt_c"][0] if facts["opt_c"] else "none"


def measure(options):
    rows, known, beyond = [], {}, []
    some = planners(options.venv)
    if Path(options.csv).exists():
        with open(options.csv, newline="") as file:
            known = {tuple(row[:3]): row for row in csv.reader(file)}
    with tempfile.TemporaryDirectory() as directory, open(options.csv, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["instance", "kind", "planner", "encoding", "status", "cost", "optimum", "wall_s", "cpu_s",
                         "peak_mb", "load"])
        for name, size, kind, written, optimum in instances(options, directory):
            for planner, encodings in ENCODINGS.items():
                if encodings.get(kind, "-") not in written or (options.only and planner not in options.only):
                    continue
                encoding = encodings[kind]
                hopeless = any(other == (planner, kind) and all(a <= b for a, b in zip(reached, size)) for other, reached in beyond)
                if (name, kind, planner) in known:
                    row = known[name, kind, planner]
                elif hopeless and not options.all:
                    row = [name, kind, planner, encoding, "skipped", None, optimum, "", "", "", ""]
                else:
                    files = [f"{name}.{encoding}.{part}.pddl" for part in ["domain", "problem"]]
                    row = [name, kind, planner, encoding, *one(some[planner], files, optimum, directory, options)]
                if row[4] == "limit":
                    beyond.append(((planner, kind), size))
                writer.writerow(row)
                file.flush()
                rows.append(dict(zip(["name", "kind", "planner", "encoding", "status", "cost", "optimum", "wall", "cpu"], row)))
                print(*row, flush=True)
    return rows


def one(planner, files, optimum, directory, options):
    """Status, cost found, optimum, times, peak memory and load of one run."""
    # Without a kind and a limit: Metaplan runs to the end as others do.
    command = planner.command(*files, None if planner.name == "metaplan" else options.seconds, None)
    done = run(command, directory, options.seconds, options.memory, core=0)
    try:
        answer = None if done.late else planner.read(done.output, done.code, directory)
    except (ValueError, KeyError):
        answer = None
    claims = answer is not None and answer.status in ("optimal", "unsolvable")
    found = None if not claims else "none" if answer.status == "unsolvable" else answer.cost
    right = found == optimum or (found not in (None, "none") and optimum != "none" and float(found) == optimum)
    status = "proved" if right else "wrong" if found is not None else "limit" if done.late else "failed"
    return [status, found, optimum, round(done.wall, 3), round(done.cpu, 3), done.peak, round(os.getloadavg()[0], 1)]


def table(rows):
    """By kind: instances proved, and how many times Metaplan's processor time each takes where both have proved it."""
    own = {(row["name"], row["kind"]): float(row["cpu"]) for row in rows
           if row["planner"] == "metaplan" and row["status"] == "proved"}
    lines = ["| instances | planner (encoding) | proved | wrong | processor time, Metaplan = 1 |", "|---|---|---|---|---|"]
    for kind in [NUMERIC, CLASSICAL]:
        for planner in dict.fromkeys(row["planner"] for row in rows if row["kind"] == kind):
            mine = [row for row in rows if row["planner"] == planner and row["kind"] == kind]
            proved = [row for row in mine if row["status"] == "proved"]
            ratios = [max(float(row["cpu"]), 1e-3) / max(own[key], 1e-3) for row in proved
                      if (key := (row["name"], kind)) in own]
            mean = f"{math.exp(sum(map(math.log, ratios)) / len(ratios)):.1f}" if ratios else "–"
            wrong = sum(row["status"] == "wrong" for row in mine)
            lines.append(f"| {kind} | {planner} ({mine[0]['encoding']}) | {len(proved)} of {len(mine)} | {wrong} | {mean} |")
    return "\n".join(lines)


def main():
    numbers = lambda text: [int(part) for part in text.split(",")]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--venv", type=Path, help="virtual environment of the peers")
    parser.add_argument("--install", action="store_true", help="make it, and install the peers from PyPI")
    parser.add_argument("--sizes", type=numbers, default=[10, 20, 50, 100, 200], help="waypoints")
    parser.add_argument("--designs", type=numbers, default=[3, 6, 12], help="designs of each function")
    parser.add_argument("--functions", type=numbers, default=[1, 2, 3, 4], help="functions of each move")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=60, help="limit on processor time")
    parser.add_argument("--memory", type=int, default=8192, help="limit on address space, in MB")
    parser.add_argument("--all", action="store_true", help="run hopeless instances, too")
    parser.add_argument("--only", type=lambda text: text.split(","), help="planners")
    parser.add_argument("--csv", default="peers.csv")
    parser.add_argument("--table", metavar="CSV", help="only the table of a file that was written before")
    options = parser.parse_args()
    if options.table:
        with open(options.table, newline="") as file:
            rows = [{**row, "name": row["instance"], "cpu": row["cpu_s"]} for row in csv.DictReader(file)]
        return print(table(rows))
    if options.venv is None:
        parser.error("--venv is needed")
    options.venv = options.venv.resolve()
    if options.install:
        subprocess.run([sys.executable, "-m", "venv", str(options.venv)], check=True)
        subprocess.run([str(options.venv / "bin" / "pip"), "install", "-q", *PACKAGES], check=True)
    print(table(measure(options)))


if __name__ == "__main__":
    main()
