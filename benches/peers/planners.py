"""How each planner is called, and what its output says. Standard library only.

An answer claims no more than the planner does: `optimal` and `unsolvable` are proofs by the planner's own word, `plan` is a plan.
What it prints for a task that it does not read is `refused`; any other end without an answer is `error`, or `limit` if it
was late.
"""

import json
import os
import re
from collections import namedtuple
from pathlib import Path

from process import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ["up-fast-downward", "up-enhsp", "kairos-planner", "up-symk", "up-lpg", "up-aries", "up-tamer", "unified-planning",
            "setuptools<81"]
FERROPLAN = "ferroplan-cli@0.30.0"
CLASSICAL, NUMERIC, TEMPORAL = "classical", "numeric", "temporal"
ALL = {CLASSICAL, NUMERIC, TEMPORAL}

# The kinds of tasks that it reads, its command (domain, problem, seconds, kind), how its output is read (output, exit code, working
# directory), and whether it answers SIGINT with its best plan so far.
Planner = namedtuple("Planner", "name kinds command read ask", defaults=[False])
# Status, cost by the planner's word, and the plan in the lines that a validator reads.
Answer = namedtuple("Answer", "status cost plan", defaults=[None, None])


def planners(venv, program=None, slack=1, patience=PATIENCE, megabytes=4096):
    """All planners by name. `slack`: Metaplan's limit on wall-clock time over that on processor time."""
    python = str(venv / "bin" / "python")
    found = list(venv.glob("lib/python3*/site-packages"))
    site = found[0] if found else venv
    downward = [python, str(site / "up_fast_downward/downward/fast-downward.py")]
    symk = [python, str(site / "up_symk/symk/fast-downward.py")]
    enhsp = ["java", f"-Xmx{megabytes}m", "-XX:+UseSerialGC", "-jar", str(site / "up_enhsp/ENHSP/enhsp.jar")]
    kairos = [str(venv / "bin" / "kairos"), "solve"]
    lpg = str(site / "up_lpg" / "lpg")
    ferroplan = [str(venv / "bin" / "ff"), "--json", "--threads", "1"]
    unified = [python, str(ROOT / "benches" / "peers" / "unified.py")]
    if program is None:
        program = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "metaplan"

    def metaplan(domain, problem, seconds, kind):
        limits = ["--time-limit", str(slack * seconds), "--memory-limit", str(megabytes)] if seconds else []
        return [str(program), "plan", domain, problem, "--format", "json", "--quiet", *limits, *["--concurrent"] * (kind == TEMPORAL)]

    def soon(domain, problem, seconds, _):
        return [*kairos, domain, problem, *improving(seconds), "--no-anytime"]

    def improving(seconds):
        return ["--timeout", str(patience * seconds), "--threads", "1", "--format", "json"]

    some = [
        Planner("metaplan", ALL, metaplan, metaplan_answer, True),
        Planner("kairos-first", ALL, soon, lambda output, code, _: kairos_answer(output, code, False)),
        Planner("kairos", ALL, lambda d, p, s, _: [*kairos, d, p, *improving(s)],
                lambda output, code, _: kairos_answer(output, code, True)),
        Planner("lama-first", {CLASSICAL}, lambda d, p, *_: [*downward, "--alias", "lama-first", d, p],
                lambda output, code, place: downward_answer(output, code, place, False)),
        Planner("fd-lmcut", {CLASSICAL}, lambda d, p, *_: [*downward, d, p, "--search", "astar(lmcut())"], downward_answer),
        Planner("symk-bd", {CLASSICAL}, lambda d, p, *_: [*symk, d, p, "--search", "sym_bd()"], downward_answer),
        Planner("ferroplan", ALL, lambda d, p, *_: [*ferroplan, "-o", d, "-f", p], ferroplan_answer),
        Planner("enhsp-hrmax", {NUMERIC}, lambda d, p, *_: [*enhsp, "-o", d, "-f", p, "-planner", "opt-hrmax", "-npm"],
                enhsp_answer),
        Planner("enhsp-hadd", {NUMERIC}, lambda d, p, *_: [*enhsp, "-o", d, "-f", p, "-planner", "sat-hadd", "-npm"],
                lambda output, code, place: enhsp_answer(output, code, place, False)),
        Planner("lpg", {TEMPORAL}, lambda d, p, s, _: [lpg, "-o", d, "-f", p, "-n", "1", "-seed", "1", "-out", "plan", "-cputime",
                                                       str(round(s) or 1)], lpg_answer),
        Planner("tamer", {TEMPORAL}, lambda d, p, *_: [*unified, "tamer", d, p], unified_answer),
        Planner("aries", {TEMPORAL}, lambda d, p, *_: [*unified, "aries", d, p], unified_answer),
    ]
    return {planner.name: planner for planner in some}


def metaplan_answer(output, code, _=None):
    if code == 70:
        return Answer("error")
    if "{" not in output:
        return Answer("refused" if code == 3 else "limit" if code == 12 else "error")
    told = json.loads(output[output.index("{"):])
    status = {"optimal": "optimal", "feasible": "plan", "unsolvable": "unsolvable"}.get(told.get("status"))
    if status is None:
        return Answer("refused" if code == 3 else "limit" if code == 12 else "error")
    if status == "unsolvable":
        return Answer(status)
    temporal = "makespan" in told
    lines = []
    for step in told["steps"]:
        action = f"({' '.join([step['action'], *step['arguments']])})"
        lines.append(f"{step['start']}: {action} [{step['duration']}]" if temporal else action)
    return Answer(status, told["cost"], lines)


def kairos_answer(output, code, anytime):
    """Anytime, it goes on improving until it has searched everything; then it ends before its time is up. Its times are sums of doubles."""
    answers = [json.loads(line) for line in output.splitlines() if line.startswith("{") and '"cost"' in line]
    if code == 10:
        return Answer("unsolvable")
    if answers:
        best = answers[-1]
        # `makespan` counts the steps of plans without time.
        timed = best["temporal"]
        lines = [f"{step['time']:.6f}: {step['action']} [{step['duration']:.6f}]" if timed else step["action"] for step in best["steps"]]
        return Answer("optimal" if anytime and code == 0 and not timed else "plan", best["cost"], lines)
    return Answer({11: "limit", 12: "limit", 14: "limit", 13: "refused", 2: "refused"}.get(code, "error"))


def ferroplan_answer(output, code, _=None):
    """It has no option for a limit, and says nothing about costs."""
    if code in (124, -9, 137) or code != 0 and not output.strip():
        return Answer("limit")
    if not output.lstrip().startswith("{"):
        return Answer("refused" if re.search(r"unsupported|not supported|parse", output, re.IGNORECASE) else "error")
    told = json.loads(output[:output.rindex("}") + 1])
    if not told.get("solved"):
        return Answer("limit")
    lines = []
    for step in told["plan"]["steps"]:
        action = f"({' '.join([step['action'], *step.get('args', [])])})"
        lines.append(f"{step['time']:.6f}: {action} [{step.get('duration', 0):.6f}]" if "time" in step else action)
    return Answer("plan", None, lines)


def downward_answer(output, code, place, proves=True):
    """Exit codes: 11 proved unsolvable (10 by the translator), 12 incomplete, 20 to 24 memory or time, 30 to 34 not supported."""
    if "proved the task unsolvable" in output or "Search stopped without finding a solution" in output and code in (10, 11, 12):
        return Answer("unsolvable")
    found = re.search(r"Plan cost: (\d+)", output)
    if found is None:
        return Answer("unsolvable" if code in (10, 11) else "limit" if code in (12, *range(20, 25))
                      else "refused" if 30 <= code <= 36 else "error")
    lines = []
    for path in sorted(Path(place).glob("sas_plan*")) if place else []:
        lines = [line.strip() for line in path.read_text().splitlines() if line.startswith("(")]
    return Answer("optimal" if proves else "plan", float(found.group(1)), lines)


def enhsp_answer(output, code, _=None, proves=True):
    if re.search(r"problem unsolvable|unsolvable problem|^unsolvable", output, re.IGNORECASE | re.MULTILINE):
        return Answer("unsolvable" if proves else "limit")
    found = re.search(r"Metric \(Search\):\s*([\d.E+-]+)", output)
    if found is None:
        unread = re.search(r"exception|not supported|unsupported|parsing|syntax", output, re.IGNORECASE)
        return Answer("limit" if "OutOfMemory" in output else "refused" if unread else "error")
    lines = [f"({action})" for action in re.findall(r"^[\d.]+: \((.*)\)\s*$", output, re.MULTILINE)]
    return Answer("optimal" if proves else "plan", float(found.group(1)), lines)


def lpg_answer(output, code, place):
    """Its plan file closes each line with one parenthesis too many."""
    for path in sorted(Path(place).glob("plan_*.SOL")):
        text = path.read_text()
        steps = re.findall(r"^([\d.]+):\s*(\(.*?\))\s*\[([\d.]+)\]", text, re.MULTILINE)
        cost = re.search(r"^; MakeSpan ([\d.]+)", text, re.MULTILINE)
        return Answer("plan", float(cost.group(1)) if cost else None, [f"{start}: {action} [{length}]" for start, action, length in steps])
    if re.search(r"not supported|syntax error|parse error|unknown", output, re.IGNORECASE):
        return Answer("refused")
    if re.search(r"can be simplified to false|no solution exists|unsolvable", output, re.IGNORECASE):
        return Answer("unsolvable")
    return Answer("limit" if re.search(r"search limit exceeded|no solution|max.*time", output, re.IGNORECASE) else "error")


def unified_answer(output, code, _=None):
    status = re.search(r"^; status (\w+)", output, re.MULTILINE)
    if status is None:
        unread = re.search(r"unsupported|not supported|cannot|UPUsageError|UPProblemDefinitionError|UPException|ParseException"
                           r"|Exception: .*|AssertionError|NotImplementedError|KeyError", output)
        return Answer("refused" if unread else "error")
    lines = re.findall(r"^\s*([\d.]+: \(.*\)\s*\[[\d.]+\])\s*$|^\s*([\d.]+: \(.*\))\s*$", output, re.MULTILINE)
    steps = [timed or untimed for timed, untimed in lines]
    if status.group(1).startswith("SOLVED"):
        proved = status.group(1) == "SOLVED_OPTIMALLY"
        return Answer("optimal" if proved else "plan", makespan(steps), steps)
    if status.group(1) == "UNSOLVABLE_PROVEN":
        return Answer("unsolvable")
    return Answer("limit" if status.group(1) in ("TIMEOUT", "MEMOUT", "UNSOLVABLE_INCOMPLETELY") else
                  "refused" if status.group(1) == "UNSUPPORTED_PROBLEM" else "error")


def makespan(lines):
    ends = [0.0]
    for line in lines:
        start, length = re.match(r"([\d.]+): \(.*\)\s*(?:\[([\d.]+)\])?", line).groups()
        ends.append(float(start) + float(length or 0))
    return round(max(ends), 6)
