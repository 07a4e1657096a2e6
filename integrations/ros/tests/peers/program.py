"""The program under test as a process, with its output for the report."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
MISSION = Path(os.environ.get("METAPLAN_ROS_MISSION", ROOT / "integrations" / "ros" / "examples" / "suave" / "suave.toml"))
STAND_IN = "stand-in"


@dataclass
class Program:
    """The program with its command line. Its journal is kept between starts."""

    path: str
    role: str
    vendor: str
    domain: int
    rmw: str = "auto"
    mission: Path = MISSION
    more: list[str] = field(default_factory=list)
    environment: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.directory = Path(tempfile.mkdtemp(prefix="metaplan-ros-"))
        self.log = self.directory / "output"
        self._process: subprocess.Popen[bytes] | None = None

    def command(self) -> list[str]:
        """Returns the whole command line. The stand-in has fewer arguments."""
        if self.path.startswith(STAND_IN):
            fault = self.path.partition(":")[2]
            script = str(Path(__file__).with_name("stand_in.py"))
            vendor = ["--vendor", self.vendor, "--domain", str(self.domain), "--fault", fault]
            return [sys.executable, script, "--as", self.role, *vendor]
        # The other roles have no state to keep.
        journal = ["--journal", str(self.directory / "journal")] if self.role in ("manager", "reasoner") else []
        mission = ["--mission", str(self.mission)]
        return [self.path, *mission, "--as", self.role, "--rmw", self.rmw, *journal, *self.more]

    def start(self) -> Program:
        """Starts or restarts the program."""
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.domain), **self.environment}
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(self.command(), stdout=log, stderr=log, env=environment)
        return self

    def running(self) -> bool:
        """Returns `True` if the program runs."""
        return self._process is not None and self._process.poll() is None

    def status(self) -> int | None:
        """Returns the exit status, or `None` if the program was not started or still runs."""
        return None if self._process is None else self._process.poll()

    def kill(self) -> None:
        """Sends SIGKILL, which is like a failure of the machine."""
        self._process.kill()
        self._process.wait()

    def stop(self, timeout: float = 5.0) -> int | None:
        """Sends SIGINT, as Ctrl-C does. Returns the exit status, or `None` if the program did not end in time."""
        if self.running():
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(timeout)
            except subprocess.TimeoutExpired:
                self.kill()
                return None
        return self.status()

    def journal(self) -> str:
        """Returns the text of all files of the journal."""
        files = sorted(path for path in (self.directory / "journal").rglob("*") if path.is_file())
        return "\n".join(path.read_text(errors="replace") for path in files)

    def output(self) -> str:
        """Returns the standard output and standard error."""
        return self.log.read_text(errors="replace") if self.log.exists() else ""

    def last_words(self, lines: int = 15) -> str:
        """Returns the last lines of the output, for the report of a failure."""
        return "\n".join("    | " + line[:240] for line in self.output().splitlines()[-lines:])

    def clean(self) -> None:
        """Ends the program and removes its files, unless `METAPLAN_KEEP` is set."""
        if self.running():
            self.kill()
        if not os.environ.get("METAPLAN_KEEP"):
            shutil.rmtree(self.directory, ignore_errors=True)

    def wait_output(self, words: str, timeout: float) -> bool:
        """Returns `True` if the output contains `words` before the timeout."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            if words in self.output():
                return True
            time.sleep(0.05)
        return False
