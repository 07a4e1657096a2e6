"""Plays the scenarios against the program under test, each in a process and a DDS domain of its own, on loopback only.

One line for each scenario; exit status 1 if one failed. Without a network namespace of its own it makes one (`unshare
-rn`), so that nothing leaves the machine and nothing comes in.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from program import MISSION, ROOT, STAND_IN

INSIDE = "METAPLAN_PEERS_NAMESPACE"
TIMEOUT = 180  # s, of a quick scenario; the eighteen streams take longer
LONG_TIMEOUT = 900
MEASURING = ("mission", "published", "flood", "earlier")
AT_ONCE = 3
SETUP = 'ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'


def enter_namespace() -> None:
    """Restarts this program in its own network namespace."""
    if os.environ.get(INSIDE):
        return
    missing = [tool for tool in ("unshare", "ip") if shutil.which(tool) is None]
    if missing:
        sys.exit(f"a network namespace needs {' and '.join(missing)}")
    probe = subprocess.run(
        ["unshare", "-rn", "sh", "-c", SETUP, "sh", "true"], check=False, capture_output=True, text=True
    )
    if probe.returncode != 0:
        sys.exit(f"no network namespace can be had here: {probe.stderr.strip()}")
    os.environ[INSIDE] = "1"
    os.execvp("unshare", ["unshare", "-rn", "sh", "-c", SETUP, "sh", sys.executable, __file__, *sys.argv[1:]])


def play_one(arguments: argparse.Namespace) -> int:
    """Plays one scenario in this process and prints its report as a line of JSON."""
    from catalogue import SCENARIOS, Setting

    name, vendor = arguments.one, arguments.vendor
    setting = Setting(arguments.program, vendor, arguments.domain, arguments.median)
    report: dict[str, object] = {"scenario": name, "vendor": vendor, "passed": False}
    try:
        report["said"] = SCENARIOS[name](setting)
        report["passed"] = True
    except AssertionError as error:
        report["said"] = str(error)
    except Exception:
        report["said"] = traceback.format_exc()
    report["results"] = setting.results
    if not report["passed"] and setting.programs:
        report["output"] = setting.programs[-1].last_words()
    for used in setting.programs:
        used.clean()
    print(json.dumps(report), flush=True)
    return 0


def play(name: str, arguments: argparse.Namespace, vendor: str, domain: int) -> dict[str, object]:
    """Plays one scenario in its own process and returns its report."""
    command = [sys.executable, __file__, "--one", name, "--program", arguments.program]
    command += ["--vendor", vendor, "--domain", str(domain), "--median", str(arguments.median)]
    started = time.monotonic()
    limit = LONG_TIMEOUT if name.startswith("published") else TIMEOUT
    failed: dict[str, object] = {"scenario": name, "vendor": vendor, "passed": False, "results": []}
    try:
        done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        report = {**failed, "said": f"not done within {limit} s"}
    else:
        lines = done.stdout.splitlines()
        said = f"status {done.returncode}: {done.stderr[-2000:]}"
        report = json.loads(lines[-1]) if lines and done.returncode == 0 else {**failed, "said": said}
    report["seconds"] = round(time.monotonic() - started, 1)
    mark = "ok    " if report["passed"] else "FAILED"
    line = f"{mark} {name:<20} {vendor:<10} {report['seconds']:>6} s  {report['said']}"
    if report.get("output") and not arguments.program.startswith(STAND_IN):
        line += f"\n{report['output']}"
    print(line, flush=True)
    return report


def chosen(arguments: argparse.Namespace) -> list[tuple[str, str]]:
    """Returns the selected scenarios with their vendors, in order."""
    from catalogue import QUICK, SCENARIOS

    unknown = sorted(set(arguments.scenario) - set(SCENARIOS))
    if unknown:
        sys.exit(f"no such scenario: {', '.join(unknown)}; there are {', '.join(SCENARIOS)}")
    names = arguments.scenario or (QUICK if arguments.quick else list(SCENARIOS))
    pairs = [(name, "cyclonedds") for name in names if arguments.vendor != "fastrtps"]
    if arguments.vendor in (None, "fastrtps"):
        from fast import available

        why = available()
        if why:
            print(f"not played on Fast DDS: {why}", flush=True)
        elif arguments.quick and arguments.vendor is None:
            pairs += [(name, "fastrtps") for name in ("mission-manager", "mission-reasoner", "silent") if name in names]
        else:
            pairs += [(name, "fastrtps") for name in names]
    return pairs


def play_all(arguments: argparse.Namespace) -> list[dict[str, object]]:
    """Plays scenarios that measure times, or have a fixed domain, one after the other, and the others concurrently."""
    numbered = [(name, vendor, 1 + at % 100) for at, (name, vendor) in enumerate(chosen(arguments))]
    alone = [each for each in numbered if each[0].startswith(MEASURING)]
    reports = [play(name, arguments, vendor, domain) for name, vendor, domain in alone]
    together = [each for each in numbered if each not in alone]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        others = [pool.submit(play, name, arguments, vendor, domain) for name, vendor, domain in together]
        results = [other.result() for other in others]
    # On a busy machine, robots that are played concurrently miss their own deadlines, so a failed one is played again
    # alone.
    for (name, vendor, domain), report in zip(together, results, strict=True):
        if not report["passed"]:
            print(f"{name} is played again alone", flush=True)
            report = play(name, arguments, vendor, domain)
        reports.append(report)
    return reports


def self_test(arguments: argparse.Namespace) -> int:
    """Checks that missions pass with a correct stand-in, and fail with each fault. Returns the exit status."""
    fooled = []
    for fault, name, expected in (
        ("", "mission-manager", True),
        ("", "mission-reasoner", True),
        ("wrong", "mission-reasoner", False),
        ("miss", "mission-reasoner", False),
        ("twice", "mission-reasoner", False),
        ("slow", "mission-reasoner", False),
    ):
        arguments.program = f"{STAND_IN}:{fault}"
        print(f"stand-in {fault or 'without a fault'}, has to {'pass' if expected else 'fail'}:", flush=True)
        if play(name, arguments, arguments.vendor or "cyclonedds", 90)["passed"] != expected:
            fooled.append(fault or "none")
    print(f"the scenarios are fooled by: {', '.join(fooled) or 'none of the stand-ins'}")
    return 1 if fooled else 0


def main() -> int:
    """Plays the selected scenarios. The exit status is 1 if one of them failed or none was played."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = ROOT / "target" / "debug" / "metaplan-ros"
    parser.add_argument("scenario", nargs="*", help="names; all without one")
    parser.add_argument("--program", default=str(default), help=f"program under test; `{STAND_IN}` is ours")
    parser.add_argument("--quick", action="store_true", help="only what takes less than three minutes")
    parser.add_argument("--vendor", choices=("cyclonedds", "fastrtps"))
    parser.add_argument("--median", type=float, default=20.0, help="greatest median of the reactions in ms")
    parser.add_argument("--report", type=Path, help="writes all results there, as JSON")
    parser.add_argument("--self-test", action="store_true", help="plays against stand-ins with and without faults")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("--domain", type=int, default=0, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    enter_namespace()
    if arguments.one:
        return play_one(arguments)
    if arguments.self_test:
        return self_test(arguments)
    if not arguments.program.startswith(STAND_IN):
        for needed in (Path(arguments.program), MISSION):
            if not needed.exists():
                sys.exit(f"{needed} does not exist")
    started = time.monotonic()
    reports = play_all(arguments)
    failed = [report for report in reports if not report["passed"]]
    print(f"{len(reports)} scenarios, {len(failed)} failed, {time.monotonic() - started:.0f} s")
    if arguments.report:
        arguments.report.write_text(json.dumps(reports, indent=1) + "\n")
    return 1 if failed or not reports else 0


if __name__ == "__main__":
    sys.exit(main())
