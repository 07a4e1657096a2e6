"""Runs the tutorial docs/tutorial/ros-robot.md as printed, in a directory in which only `integrations` exists.

Usage: tutorial.py ROOT DIRECTORY install, with a network, and then tutorial.py ROOT DIRECTORY run, which needs only the loopback interface and
`metaplan-ros` in the path. The comment before a block says whether and when it is run. The settings that the page prints must be part of the
real ones, and the robot must print the same lines. Its nodes work in parallel, so the order of lines is compared only where it is certain.
"""

import collections
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

TIMEOUT = 90  # s, for the robot's round
BLOCK = re.compile(r"<!-- (?P<mark>[^\n]*\.ci/ros-real[^\n]*) -->\n```(?P<kind>\w+)\n(?P<text>.*?)```\n", re.DOTALL)


def fail(text: str) -> None:
    """Ends the test."""
    print(f"tutorial: {text}", flush=True)
    sys.exit(1)


def main() -> None:
    """Runs the page."""
    root, directory, phase = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3]
    blocks = list(BLOCK.finditer((root / "docs/tutorial/ros-robot.md").read_text()))
    if phase == "install":
        (directory / "integrations").symlink_to(root / "integrations")
        for block in blocks:
            if "installs with it" in block["mark"]:
                shell(block["text"], directory)
        return
    background: list[tuple[subprocess.Popen, pathlib.Path]] = []
    expected: list[str] = []
    try:
        for block in blocks:
            mark, text = block["mark"], block["text"]
            if mark.startswith("part of"):
                check_parts(directory / "discovered.toml", text)
            elif "compares the robot's output" in mark:
                expected += text.splitlines()
            elif "in the background" in mark:
                command, *lines = text.splitlines()
                expected += lines
                output = directory / f"output{len(background)}"
                with output.open("w") as file:
                    command = ["bash", "-c", f"exec {command.removeprefix('$ ')}"]
                    process = subprocess.Popen(command, cwd=directory, stdout=file, stderr=subprocess.STDOUT)
                background.append((process, output))
            elif "runs it" in mark:
                shell(text, directory)
        check_robot(background[0][1], expected, background[1][1])
    finally:
        for process, _ in background:
            process.send_signal(signal.SIGINT)
        for process, _ in background:
            process.wait(10)
    print("tutorial: ok", flush=True)


def shell(text: str, directory: pathlib.Path) -> None:
    """Runs the commands of a block."""
    subprocess.run(["bash", "-euo", "pipefail", "-c", text], cwd=directory, check=True, timeout=600)


def check_parts(file: pathlib.Path, text: str) -> None:
    """Compares each table of the page with the written settings."""
    written = file.read_text()
    for table in text.strip().split("\n\n"):
        if table not in written:
            fail(f"the settings lack\n{table}\nin\n{written}")


def check_robot(output: pathlib.Path, expected: list[str], manager: pathlib.Path) -> None:
    """Waits for the last line of the robot, and compares all lines."""
    until = time.monotonic() + TIMEOUT
    while expected[-1] not in output.read_text().splitlines():
        if time.monotonic() > until:
            fail(f"the robot has printed\n{output.read_text()}\nand the manager\n{manager.read_text()}")
        time.sleep(0.2)
    lines = output.read_text().splitlines()
    if collections.Counter(lines) != collections.Counter(expected):
        fail(f"the robot has printed\n{output.read_text()}\ninstead of\n" + os.linesep.join(expected))
    for kinds in (("move", "the round"), ("amcl", "the lidar breaks", "visual")):
        in_order = [line for line in expected if line.startswith(kinds)]
        if [line for line in lines if line.startswith(kinds)] != in_order:
            fail(f"the robot has printed\n{output.read_text()}\nin another order than\n{in_order}")


main()
