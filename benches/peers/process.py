"""A planner as a process: limits on processor time, wall clock and memory, and what it used. Standard library only."""

import math
import os
import resource
import shutil
import signal
import subprocess
import time
from collections import namedtuple
from pathlib import Path

# Wall-clock time over processor time, at most, if not told otherwise; seconds that a planner gets to end by itself after a request to.
PATIENCE, GRACE = 10, 5

Run = namedtuple("Run", "wall cpu peak code output late")


def run(command, directory, seconds, megabytes, core=None, ask=False, patience=PATIENCE):
    """Runs a command to its end or its limit.

    The limit is on the processor time of all its processes; wall clock may be `patience` times as long. `ask` is for a planner
    that answers SIGINT with the best plan so far: it gets `GRACE` seconds more, and the answer says that it was late. Wall clock and
    processor time are in seconds, the peak memory of the largest process in MB, where it is known.
    """
    if core is not None and shutil.which("taskset"):
        command = ["taskset", "-c", str(core), *command]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.monotonic()
    hard = seconds + GRACE if ask else seconds
    process = subprocess.Popen(command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace", start_new_session=True,
                               preexec_fn=lambda: limit(command, hard, megabytes))
    try:
        output, asked, killed, spent = wait(process, started, seconds, hard, patience, ask)
    finally:
        # Also where this program is stopped.
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
    wall = time.monotonic() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # Children whose parent was killed before them are not counted there.
    cpu = max(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, spent if killed else 0)
    # Who is stopped by the limit has used a little less than it, as far as the parent is told.
    late = asked or killed or cpu >= 0.9 * hard
    # The kernel tells the largest child so far only.
    peak = round(after.ru_maxrss / 1024) if after.ru_maxrss > before.ru_maxrss else ""
    return Run(wall, cpu, peak, 124 if killed else process.returncode, output, late)


def wait(process, started, seconds, hard, patience, ask):
    """A process's output, whether it was asked to end, whether it was killed, and the processor time that was seen last."""
    asked, killed, spent = False, False, 0
    while True:
        try:
            return process.communicate(timeout=0.2)[0], asked, killed, spent
        except subprocess.TimeoutExpired:
            if killed:
                continue
            spent, passed = used(process.pid), time.monotonic() - started
            if spent > hard or passed > patience * hard:
                killed = True
                os.killpg(process.pid, signal.SIGKILL)
            elif ask and not asked and (spent > seconds or passed > patience * seconds):
                asked = True
                os.kill(process.pid, signal.SIGINT)


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
