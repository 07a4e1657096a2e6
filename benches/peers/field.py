#!/usr/bin/env python3
"""Metaplan beside other planners on public suites and on tasks of ours: a row for each task and planner, as CSV and as a table.

    python3 benches/peers/field.py --venv DIR --install                    # once: the peers, from PyPI, into a virtual environment
    python3 benches/peers/field.py --venv DIR --program target/release/metaplan --csv field.csv
    python3 benches/peers/field.py --table field.csv                       # coverage and times by suite, as Markdown
    python3 benches/peers/field.py --disagreements field.csv               # answers that cannot both be right

The suites (classical, numeric, temporal, unsolvable, and middle-... if asked for) are those below `--tasks`, one directory for each domain (`data/fetch.py sources benchmarks`
fetches them), paired by `tasks.csv`; `ours` is `ours.py`. A planner runs on what it reads; temporal tasks are planned with overlapping actions. The
limit is on processor time of the planner with all its processes, so that other load on the machine harms nobody; wall clock may be
ten times as long. Metaplan also gets that limit by its own option, on wall clock (`--slack` times as long on a loaded machine), and
answers with the best plan so far.

What the CSV has is not run again, except what came to a lower limit than `--seconds`. Later rows replace earlier ones. Each plan is
executed by `metaplan validate`, those of `ours` by Kairos' validator, too. Standard library only.
"""

import argparse
import csv
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections import namedtuple
from pathlib import Path

import ours
import report
from ours import data_path
from planners import CLASSICAL, FERROPLAN, NUMERIC, PACKAGES, ROOT, TEMPORAL, planners
from process import PATIENCE, run

FIELDS = ["suite", "task", "problem", "planner", "status", "cost", "verdict", "measured", "cpu_s", "wall_s", "limit_s",
          "exit", "load", "aim", "note"]
SUITES = {"classical": CLASSICAL, "unsolvable": CLASSICAL, "temporal": TEMPORAL, "numeric": NUMERIC, "ours": None}
# Run only if they are asked for.
MIDDLE = {"middle-classical": CLASSICAL, "middle-optimal": CLASSICAL, "middle-numeric": NUMERIC, "middle-temporal": TEMPORAL}
# How far apart a planner keeps interfering happenings at least, in the decimals that it prints, where that is less than a thousandth.
TOLERANCE = {"kairos": "0.00099", "kairos-first": "0.00099", "lpg": "0.0002", "ferroplan": "0.00099"}

Task = namedtuple("Task", "suite name problem kind files optimum")


def tasks(options, directory):
    """All tasks of the suites that are asked for."""
    with open(Path(__file__).with_name("tasks.csv"), newline="") as file:
        for row in csv.DictReader(file):
            if row["mode"] in options.suites:
                place = options.tasks / row["mode"] / row["task"]
                files = [str(place / row["domain"]), str(place / row["problem"])]
                yield Task(row["mode"], row["task"], row["problem"], {**SUITES, **MIDDLE}[row["mode"]], files, None)
    if "ours" in options.suites:
        for name, encoding, kind, domain, problem, optimum in ours.tasks(directory, options.program):
            yield Task("ours", name, encoding, kind, [domain, problem], optimum)


def measure(options):
    known = report.read([options.csv]) if Path(options.csv).exists() else {}
    some = planners(options.venv, options.program, options.slack, options.patience, options.memory)
    fresh = not known
    with tempfile.TemporaryDirectory() as directory, open(options.csv, "a", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        if fresh:
            writer.writeheader()
        wanted = [task for task in tasks(options, directory) if not options.names or any(name in task.name for name in options.names)]
        for task in wanted:
            if task.optimum is not None and (*task[:3], "oracle") not in known:
                status = "unsolvable" if task.optimum == "none" else "optimal"
                cost = "" if task.optimum == "none" else task.optimum
                writer.writerow(dict(zip(FIELDS, [*task[:3], "oracle", status, cost])))
        for name in options.planners or some:
            for task in wanted:
                if task.kind in some[name].kinds and wanting(known.get((*task[:3], name)), options.seconds):
                    row = one(some[name], task, options)
                    writer.writerow(row)
                    file.flush()
                    print(*(row[field] for field in FIELDS), flush=True)


def wanting(row, seconds):
    """Whether a task is to be run: it has not been, or it came to a lower limit."""
    if row is None:
        return True
    came_to_limit = row["status"] == "limit" or row["planner"] == "metaplan" and row["status"] == "plan"
    return came_to_limit and float(row["limit_s"]) < seconds


def one(planner, task, options):
    """Runs a planner on a task, and executes its plan."""
    with tempfile.TemporaryDirectory() as place:
        load = os.getloadavg()[0]
        command = planner.command(*task.files, options.seconds, task.kind)
        # Who minds a limit by itself needs room to end in.
        done = run(command, place, options.seconds, options.memory + (1024 if planner.ask else 0), options.core, planner.ask, options.patience)
        try:
            answer = planner.read(done.output, done.code, place)
        except (ValueError, KeyError, IndexError) as error:
            answer = planner.read("", 1, None)._replace(status="error", cost=None)
            done = done._replace(output=f"unreadable output: {error!r}")
        status = answer.status
        if status == "error" and done.late:
            status = "limit"
        verdict, measured = validate(answer.plan, planner.name, task, place, options) if answer.plan else ("", "")
    note = "" if status in ("optimal", "plan", "unsolvable") else last_words(done.output, status)
    cost = "" if answer.cost is None else answer.cost
    return dict(zip(FIELDS, [*task[:3], planner.name, status, cost, verdict, measured, round(done.cpu, 3), round(done.wall, 3),
                             options.seconds, done.code, round(load, 1), aim(task), note]))


def aim(task):
    """Whether more is better."""
    found = re.search(r":metric\s+(minimize|maximize)", Path(task.files[1]).read_text(), re.IGNORECASE)
    return found.group(1).lower() if found else "minimize"


def last_words(output, status):
    """What a planner says where it gives no answer; nothing for a limit."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    if status == "limit" or not lines:
        return ""
    told = ([line for line in lines if '"message"' in line]
            or [line for line in lines if "rror" in line or "support" in line or "xception" in line])
    return (told or lines)[-1][:160]


def validate(plan, name, task, place, options):
    """What Metaplan's validator says, by Kairos' too where the task is ours; and the plan's cost by the task's metric."""
    path = Path(place, "validated.plan")
    path.write_text("\n".join(plan) + "\n")
    command = [str(options.program), "validate", *task.files, str(path), "--format", "json", "--quiet", "--tolerance",
               TOLERANCE.get(name, "0.001"), *["--concurrent"] * (task.kind == TEMPORAL)]
    done = run(command, place, options.seconds, options.memory, patience=options.patience)
    if done.code not in (0, 30):
        return "unread", ""
    told = json.loads(done.output[done.output.index("{"):])
    verdict = "valid" if told["valid"] else "invalid"
    if task.suite == "ours" and options.venv is not None:
        second = run([str(options.venv / "bin" / "kairos"), "validate", *task.files, str(path)], place, options.seconds, options.memory)
        if ("valid" if second.code == 0 else "invalid") != verdict:
            verdict = f"{verdict}, Kairos differs"
    if not told["valid"]:
        return verdict, ""
    without = told["total_time"] if task.kind == TEMPORAL else len(plan)
    return verdict, without if told["metric"] is None else told["metric"]


def main():
    words = lambda text: text.split(",")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--venv", type=Path, help="virtual environment of the peers")
    parser.add_argument("--install", action="store_true", help="make it, and install the peers from PyPI")
    parser.add_argument("--program", type=Path, default=ROOT / "target" / "release" / "metaplan", help="Metaplan, which also validates")
    parser.add_argument("--tasks", type=Path, default=data_path("real/ipc"), help="the public suites")
    parser.add_argument("--suites", type=words, default=list(SUITES), help="of " + ", ".join([*SUITES, *MIDDLE]))
    parser.add_argument("--planners", type=words, help="these only, in this order")
    parser.add_argument("--names", type=words, help="tasks whose name contains one of these only")
    parser.add_argument("--seconds", type=float, default=60, help="limit on processor time")
    parser.add_argument("--memory", type=int, default=4096, help="limit on address space, in MB")
    parser.add_argument("--slack", type=float, default=1, help="Metaplan's limit on wall-clock time over that on processor time")
    parser.add_argument("--patience", type=float, default=PATIENCE, help="limit on wall-clock time over that on processor time")
    parser.add_argument("--core", type=int, help="run on this processor only")
    parser.add_argument("--csv", default="field.csv")
    parser.add_argument("--table", metavar="CSV", nargs="+", help="only the table of files that were written before")
    parser.add_argument("--disagreements", metavar="CSV", nargs="+", help="only what cannot be right in such files; status 1 if there is any")
    parser.add_argument("--quality", metavar="CSV", nargs="+", help="only the quality of the plans in such files")
    options = parser.parse_args()
    if options.quality:
        return print(report.quality(report.read(options.quality)))
    if options.table:
        return print(report.table(report.read(options.table)))
    if options.disagreements:
        found = report.disagreements(report.read(options.disagreements))
        print("\n".join(found) or "none")
        return sys.exit(1 if any(not line.startswith("note:") for line in found) else 0)
    if options.venv is not None:
        options.venv = options.venv.absolute()
        if options.install:
            subprocess.run([sys.executable, "-m", "venv", str(options.venv)], check=True)
            subprocess.run([str(options.venv / "bin" / "pip"), "install", "-q", *PACKAGES], check=True)
            subprocess.run(["cargo", "install", "-q", "--locked", "--root", str(options.venv), FERROPLAN], check=True)
    elif options.planners != ["metaplan"]:
        parser.error("--venv is needed")
    options.program = options.program.absolute()
    # Stopped, it stops its planner, too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    measure(options)
    print(report.table(report.read([options.csv])))


if __name__ == "__main__":
    main()
