"""Tests of reproduce.py with a small project: `python3 benches/test_reproduce.py`."""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TABLES = """
[[table]]
name = "measured"
page = "page.md#a"
commands = ["{python} -c 'print(\\"not the result\\")'", "{python} -c 'print(\\"| 1 ms |\\"); print(\\"running 2 tests\\")'"]
inputs = ["input", "data:real/file"]
measures = ["src"]

[[table]]
name = "computed"
page = "page.md#a"
commands = ["cat rows"]
inputs = ["rows"]
measures = ["src"]
rows = "^\\\\| x"

[[figure]]
text = "7 of 9"
table = "computed"
row = "| x | 7 of 9 |"
"""
FILES = {
    "README.md": "Solves 7 of 9.\n", "page.md": "| x | 7 of 9 |\n| other |\n", "rows": "| x | 7 of 9 |\n", "input/file": "in", "src/code": "1",
    "benches/tables.toml": TABLES,
    "data/sources.toml": '[[source]]\nrepository = "github:a/b"\ncommit = "%s"\nlicence = "none"\nuse = "tests"\nfiles = [["f", "real/file", "%s"]]\n'
    % ("0" * 40, hashlib.sha256(b"public").hexdigest()),
}


class Reproduce(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.root = Path(temporary.name) / "project"
        self.data = Path(temporary.name) / "data" / "real"
        self.data.mkdir(parents=True)
        (self.data / "file").write_text("public")
        for name, text in FILES.items():
            self.write(name, text)
        for name in ["benches/reproduce.py", "data/fetch.py"]:
            shutil.copy(ROOT / name, self.root / name)
        self.git("init", "--quiet")
        self.commit()

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def git(self, *arguments):
        identity = ["-c", "user.name=t", "-c", "user.email=t@t"]
        subprocess.run(["git", "-C", str(self.root), *identity, *arguments], check=True, capture_output=True)

    def commit(self):
        self.git("add", "--all")
        self.git("commit", "--quiet", "--message", "change")

    def run_script(self, *arguments):
        command = [sys.executable, str(self.root / "benches/reproduce.py"), *arguments]
        environment = {**os.environ, "METAPLAN_DATA": str(self.data.parent)}
        result = subprocess.run(command, capture_output=True, text=True, env=environment)
        self.assertNotIn("Traceback", result.stderr)
        return result.returncode, result.stdout, result.stderr

    def assert_fails(self, part, *arguments):
        status, _, errors = self.run_script(*arguments)
        self.assertEqual(status, 1, errors)
        self.assertIn(part, errors)

    def test_a_run_records_figures_machine_and_load(self):
        self.assertEqual(self.run_script("measured")[0], 0)
        text = (self.root / "benches/results/measured.txt").read_text()
        head, figures = text.split("\n\n")
        self.assertEqual(figures, "| 1 ms |\n")
        for key in ["date: 20", "commit: ", "inputs: ", "machine: ", "load_before: ", "other_cores: ", "result: ok"]:
            self.assertIn(key, head)
        self.assertIn("| measured | [page.md#a](../page.md#a) | `input`, `data:real/file` | 20", (self.root / "benches/TABLES.md").read_text())
        self.assertIn("| computed | [page.md#a](../page.md#a) | `rows` | never recorded |", (self.root / "benches/TABLES.md").read_text())
        self.assertEqual(self.run_script("--check")[0], 0)

    def test_later_commits_to_the_measured_code_are_counted(self):
        self.run_script("measured")
        self.commit()
        self.assertIn("later commits to what it measures: 0", self.run_script()[1])
        self.write("src/code", "2")
        self.commit()
        self.assertIn("later commits to what it measures: 1", self.run_script()[1])
        self.write("src/code", "3")
        self.run_script("measured")
        self.assertIn("+changes", (self.root / "benches/runs.tsv").read_text())

    def test_the_digest_of_inputs_changes_with_them(self):
        self.run_script("measured")
        self.write("input/file", "other")
        self.run_script("measured")
        lines = (self.root / "benches/runs.tsv").read_text().splitlines()
        first, second = (line.split("\t")[3] for line in lines[1:])
        self.assertNotEqual(first, second)

    def test_missing_and_changed_inputs_are_errors(self):
        (self.data / "file").write_text("changed")
        self.assert_fails("does not have the pinned digest", "measured")
        (self.data / "file").unlink()
        self.assert_fails("run data/fetch.py", "measured")
        self.assertFalse((self.root / "benches/runs.tsv").exists())

    def test_a_command_that_fails_leaves_the_last_figures(self):
        self.run_script("computed")
        tables = TABLES.replace("cat rows", "cat absent")
        self.write("benches/tables.toml", tables)
        self.assert_fails("exit status 1", "computed")
        self.assertIn("7 of 9", (self.root / "benches/results/computed.txt").read_text())
        self.assertIn("\tfailed\n", (self.root / "benches/runs.tsv").read_text())

    def test_rows_that_differ_from_the_page_are_errors(self):
        self.assertEqual(self.run_script("computed")[0], 0)
        self.write("page.md", "| x | 8 of 9 |\n")
        self.assert_fails("page.md#a differs: | x | 8 of 9 |", "computed")
        self.assert_fails('page.md has no row "| x | 7 of 9 |"', "--check")
        self.write("README.md", "Solves 8 of 9.\n")
        self.assert_fails('README.md lacks "7 of 9"', "--check")

    def test_the_list_must_be_up_to_date(self):
        self.run_script("readme")
        self.assertEqual(self.run_script("--check")[0], 0)
        self.write("benches/tables.toml", TABLES.replace('["input", ', "["))
        self.assert_fails("TABLES.md is not the list", "--check")

    def test_suites_count_passed_tests_and_list_all_ignored_ones(self):
        self.write("src/tests/a.rs", '#[test]\n#[ignore = "takes minutes"]\nfn a() {}\n')
        self.write("src/tests/b.rs", '#[test]\n#[ignore = "a tool"]\nfn b() {}\n')
        self.commit()
        self.assert_fails("src/tests/a.rs: no suite of benches/suites.toml runs its ignored tests: takes minutes", "--check")
        self.write("summary", "test result: ok. 3 passed; 0 failed\ntest result: ok. 4 passed; 0 failed\n")
        self.write("benches/suites.toml", '[[suite]]\nname = "long"\ncommands = ["cat summary"]\nignored = ["src/tests"]\nmeasures = ["src"]\n')
        self.assertEqual(self.run_script("long")[0], 0)
        self.assertIn("\tok: 7 tests passed\n", (self.root / "benches/runs.tsv").read_text())
        self.assertIn("| long | `src/tests` | 20", (self.root / "benches/TABLES.md").read_text())
        self.assertEqual(self.run_script("--check"), (0, "", ""))
        self.assertIn("long test suite", self.run_script()[1])

    def test_unknown_tables_are_errors(self):
        self.assert_fails("no such table or suite; there are readme, measured, computed", "absent")


if __name__ == "__main__":
    unittest.main()
