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
import json
import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import factored

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ROOT.parent / "shared" / "tools"
PACKAGES = ["up-fast-downward", "up-enhsp", "kairos-planner", "up-symk"]
NUMERIC, CLASSICAL = "numeric", "classical"
# Wall-clock time over processor time, at most; rows of a table of costs, at most.
PATIENCE, ROWS = 10, 300_000


def planners(venv, seconds):
    """Name, the encodings that it reads by kind of instance, its command, and how its cost is read."""
    python = str(venv / "bin" / "python")
    found = list(venv.glob("lib/python3*/site-packages"))
    site = found[0] if found else venv
    downward = str(site / "up_fast_downward/downward/fast-downward.py")
    symk = str(site / "up_symk/symk/fast-downward.py")
    enhsp = ["java", "-Xmx4g", "-jar", str(site / "up_enhsp/ENHSP/enhsp.jar")]
    kairos = [str(venv / "bin" / "kairos"), "solve"]
    options = ["--timeout", str(PATIENCE * seconds), "--threads", "1", "--format", "json"]
    metaplan = str(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "metaplan")
    both = {NUMERIC: "n", CLASSICAL: "c"}
    return [
        ("metaplan", both, lambda d, p: [metaplan, "plan", d, p, "--format", "json", "--quiet"], metaplan_cost),
        ("kairos", both, lambda d, p: [*kairos, d, p, *options], kairos_cost),
        ("fd-lmcut", {NUMERIC: "b", CLASSICAL: "c"},
         lambda d, p: [python, downward, d, p, "--search", "astar(lmcut())"], downward_cost),
        ("symk-bd", {NUMERIC: "b", CLASSICAL: "c"},
         lambda d, p: [python, symk, d, p, "--search", "sym_bd()"], downward_cost),
        ("enhsp-hrmax", {NUMERIC: "n"},
         lambda d, p: [*enhsp, "-o", d, "-f", p, "-planner", "opt-hrmax", "-npm"], enhsp_cost),
    ]


def metaplan_cost(output, _):
    answer = json.loads(output)
    return {"optimal": answer["cost"], "unsolvable": "none"}.get(answer["status"])


def kairos_cost(output, code):
    """It goes on improving until it has searched everything; then it ends before its time is up."""
    costs = [json.loads(line)["cost"] for line in output.splitlines() if line.startswith("{") and '"cost"' in line]
    if code == 10:
        return "none"
    return costs[-1] if code == 0 and costs else None


def downward_cost(output, _):
    if "Search stopped without finding a solution" in output or "proved the task unsolvable" in output:
        return "none"
    found = re.search(r"Plan cost: (\d+)", output)
    return float(found.group(1)) if found else None


def enhsp_cost(output, _):
    if "Problem unsolvable" in output or "Unsolvable" in output:
        return "none"
    found = re.search(r"Metric \(Search\):\s*([\d.]+)", output)
    return float(found.group(1)) if found else None


def run(command, directory, seconds, megabytes):
    """Wall clock and processor time in seconds, peak memory of the largest process in MB, exit code, output."""
    if shutil.which("taskset"):
        command = ["taskset", "-c", "0", *command]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.monotonic()
    process = subprocess.Popen(command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               start_new_session=True, preexec_fn=lambda: limit(command, seconds, megabytes))
    late = False
    while True:
        try:
            output, _ = process.communicate(timeout=0.2)
            break
        except subprocess.TimeoutExpired:
            if not late and (used(process.pid) > seconds or time.monotonic() - started > PATIENCE * seconds):
                late = True
                os.killpg(process.pid, signal.SIGKILL)
    if late:
        process.returncode = 124
    wall = time.monotonic() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, processor, after.ru_maxrss / 1024, process.returncode, output


def used(group):
    """Processor time in seconds of a process group and of those of its children that have ended."""
    ticks = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[2]) == group:
            ticks += sum(map(int, fields[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def limit(command, seconds, megabytes):
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
    # The virtual machine of Java reserves far more address space than it uses; its heap is limited by its own option.
    if "java" not in command:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))


def generate(arguments, script):
    done = subprocess.run([sys.executable, str(TOOLS / script), *arguments], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.strip().splitlines()[-1])


def instances(options, directory):
    """Name, size, kind, the encodings of it, and the optimum by the generator's own search."""
    for k in options.functions:
        for m in options.designs:
            for n in options.sizes:
                size = (n, m, k)
                if k > 3:
                    yield from factored_instances(size, options.seed, directory)
                    continue
                name = f"ugv-n{n}-m{m}-k{k}"
                facts = generate(["--family", "ugv", "--n", str(n), "--m", str(m), "--k", str(k), "--seed",
                                  str(options.seed), "--metric", "weighted", "--enc", "c,b,n", "--out", directory,
                                  "--name", name, "--oracle"], "gen_ratpa.py")
                yield name, size, NUMERIC, "bn", facts["opt_bn"][0] if facts["opt_bn"] else "none"
                yield name, size, CLASSICAL, "c", facts["opt_c"][0] if facts["opt_c"] else "none"


def factored_instances(size, seed, directory):
    """Without encoding b, and without c where its table is too long."""
    made = factored.Map(*size, seed)
    name = "factored-n{}-m{}-k{}".format(*size)
    kinds = [(NUMERIC, "n", True)] + [(CLASSICAL, "c", False)] * (made.classical_rows() <= ROWS)
    for kind, encoding, battery in kinds:
        Path(directory, f"{name}.{encoding}.domain.pddl").write_text(made.domain(battery))
        Path(directory, f"{name}.{encoding}.problem.pddl").write_text(made.problem(battery))
        optimum = made.optimum(battery)
        yield name, size, kind, encoding, "none" if optimum is None else optimum


def measure(options):
    rows, known, beyond = [], {}, []
    if Path(options.csv).exists():
        with open(options.csv, newline="") as file:
            known = {tuple(row[:3]): row for row in csv.reader(file)}
    with tempfile.TemporaryDirectory() as directory, open(options.csv, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["instance", "kind", "planner", "encoding", "status", "cost", "optimum", "wall_s", "cpu_s",
                         "peak_mb", "load"])
        for name, size, kind, written, optimum in instances(options, directory):
            for planner, encodings, command, cost in planners(options.venv, options.seconds):
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
                    row = [name, kind, planner, encoding, *one(command(*files), cost, optimum, directory, options)]
                if row[4] == "limit":
                    beyond.append(((planner, kind), size))
                writer.writerow(row)
                file.flush()
                rows.append(dict(zip(["name", "kind", "planner", "encoding", "status", "cost", "optimum", "wall", "cpu"], row)))
                print(*row, flush=True)
    return rows


def one(command, cost, optimum, directory, options):
    """Status, cost found, optimum, times, peak memory and load of one run."""
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    wall, processor, peak, code, output = run(command, directory, options.seconds, options.memory)
    # Who is stopped by the limit has used a little less than it, as far as the parent is told.
    late = code == 124 or processor >= 0.9 * options.seconds
    try:
        found = None if late else cost(output, code)
    except (ValueError, KeyError):
        found = None
    right = found == optimum or (found not in (None, "none") and float(found) == optimum)
    status = "proved" if right else "wrong" if found is not None else "limit" if late else "failed"
    # The kernel tells the largest child so far only.
    peak = round(peak) if peak > largest else ""
    return [status, found, optimum, round(wall, 3), round(processor, 3), peak, round(os.getloadavg()[0], 1)]


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
