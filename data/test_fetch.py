"""Tests of fetch.py with repositories on this machine: `python3 data/test_fetch.py`."""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
FILES = {"a.owl": b"first", "folder/b c.pddl": "zweite, ä".encode(), "binary": bytes(range(256)), "empty": b"", "other": b"other"}
# Paths in the cache.
TARGETS = {"a.owl": "real/a.owl", "folder/b c.pddl": "real/x/b.pddl", "binary": "real/binary", "empty": "real/empty"}


def sha256(content):
    return hashlib.sha256(content).hexdigest()


class Fetch(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        self.cache = self.folder / "cache" / "metaplan" / "data"
        shutil.copy(FOLDER / "fetch.py", self.folder)
        config = self.folder / "config"
        config.write_text(
            f'[url "file://{self.folder}/remote/"]\n\tinsteadOf = https://github.com/\n'
            "[uploadpack]\n\tallowFilter = true\n\tallowAnySHA1InWant = true\n[user]\n\tname = t\n\temail = t@t\n"
        )
        self.environment = {**os.environ, "GIT_CONFIG_GLOBAL": str(config), "XDG_CACHE_HOME": str(self.folder / "cache")}
        self.repository = self.folder / "remote" / "owner" / "name"
        for name, content in FILES.items():
            (self.repository / name).parent.mkdir(parents=True, exist_ok=True)
            (self.repository / name).write_bytes(content)
        self.git("init", "--quiet")
        self.commit = self.commit_all("first")
        self.write_list()

    def git(self, *arguments):
        command = ["git", "-C", str(self.repository), *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True, env=self.environment).stdout.strip()

    def commit_all(self, message):
        self.git("add", "--all")
        self.git("commit", "--quiet", "--message", message)
        return self.git("rev-parse", "HEAD")

    def write_list(self, name="sources", repository="github:owner/name", **changes):
        entries = [[origin, target, sha256(FILES[origin])] for origin, target in TARGETS.items()]
        source = {"repository": repository, "commit": self.commit, "licence": "none", "use": "tests", "files": entries, **changes}
        text = "[[source]]\n" + "".join(f"{key} = {value!r}\n" for key, value in source.items())
        (self.folder / f"{name}.toml").write_text(text)

    def run_script(self, *arguments):
        command = [sys.executable, str(self.folder / "fetch.py"), *arguments]
        result = subprocess.run(command, capture_output=True, text=True, env=self.environment)
        return result.returncode, result.stdout, result.stderr

    def stored(self):
        return {str(path.relative_to(self.cache)): path.read_bytes() for path in self.cache.rglob("*") if path.is_file()}

    def assert_complete(self):
        self.assertEqual(self.stored(), {target: FILES[origin] for origin, target in TARGETS.items()})
        self.assertFalse(self.cache.with_name("data.partial").exists())

    def assert_fails(self, *parts, arguments=()):
        status, _, errors = self.run_script(*arguments)
        self.assertEqual(status, 1, errors)
        for part in parts:
            self.assertIn(part, errors)
        self.assertNotIn("Traceback", errors)
        return errors

    def test_files_have_the_pinned_bytes_and_are_fetched_once(self):
        status, output, errors = self.run_script()
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("4 of them fetched now", output)
        self.assert_complete()
        # Nothing is fetched again, not even if the repository is gone.
        shutil.rmtree(self.repository)
        self.assertIn("0 of them fetched now", self.run_script()[1])
        self.assertEqual(self.run_script("--check")[0], 0)

    def test_a_later_commit_does_not_matter(self):
        (self.repository / "a.owl").write_bytes(b"later")
        self.commit_all("later")
        self.assertEqual(self.run_script()[0], 0)
        self.assert_complete()

    def test_servers_without_filters_are_supported(self):
        config = self.folder / "config"
        config.write_text(config.read_text().replace("allowFilter = true", "allowFilter = false"))
        self.assertEqual(self.run_script()[0], 0)
        self.assert_complete()

    def test_changed_and_missing_files_are_reported_and_repaired(self):
        self.run_script()
        (self.cache / "real/a.owl").write_bytes(b"changed")
        (self.cache / "real/empty").unlink()
        self.assert_fails("real/a.owl: the digest is", "real/empty: missing", arguments=["--check"])
        self.assertIn("2 of them fetched now", self.run_script()[1])
        self.assert_complete()

    def test_nothing_is_stored_until_everything_is_there(self):
        good = [["a.owl", "real/a.owl", sha256(FILES["a.owl"])]]
        bad = [["other", "real/other", "0" * 64], ["absent", "real/absent", "1" * 64]]
        self.write_list(files=good + bad)
        self.assert_fails("github:owner/name other: the digest is", "github:owner/name absent: not in commit")
        self.assertEqual(self.stored(), {})
        # A correct list goes on with what is there: only three files are fetched.
        self.write_list()
        self.assertIn("3 of them fetched now", self.run_script()[1])
        self.assert_complete()

    def test_an_unfinished_file_is_not_used(self):
        partial = self.cache.with_name("data.partial") / "real"
        partial.mkdir(parents=True)
        (partial / "a.owl").write_bytes(b"fir")
        (partial / "binary.unfinished").write_bytes(b"x")
        self.assertIn("4 of them fetched now", self.run_script()[1])
        self.assert_complete()

    def test_repositories_and_commits_that_do_not_exist_are_errors(self):
        self.write_list(repository="github:owner/absent")
        self.assert_fails("github:owner/absent: git fetch:", "check the network")
        self.write_list(commit="0" * 40)
        self.assert_fails("github:owner/name: git fetch:")

    def test_all_faults_of_a_list_are_reported(self):
        files = [["a.owl", "../a", sha256(b"")], ["/etc/x", "real/x", "12"], ["a.owl", "real/x", sha256(b"")], ["a"]]
        self.write_list(repository="owner/name", commit="main", licence="", files=files)
        errors = self.assert_fails("HOST:OWNER/NAME", "40 hexadecimal", "`licence`", "64 hexadecimal", "real/x is listed twice", "must be [path")
        self.assertEqual(errors.count("paths must be relative"), 2)
        self.assert_fails("no such list; the lists are sources", arguments=["absent"])
        (self.folder / "broken.toml").write_text("[[source")
        self.assert_fails("broken.toml", arguments=["broken"])

    def test_several_lists(self):
        self.write_list("more", files=[["other", "real/other", sha256(FILES["other"])]])
        self.assertEqual(self.run_script("sources", "more")[0], 0)
        self.assertEqual(len(self.stored()), 5)

    def test_digests_are_printed_for_new_entries(self):
        self.write_list(files=[["a.owl", "real/a.owl", ""], ["absent", "real/absent", ""]])
        status, output, errors = self.run_script("--pin")
        self.assertIn(f'["a.owl", "real/a.owl", "{sha256(b"first")}"],', output)
        self.assertIn("absent: not in commit", errors)
        self.assertEqual((status, self.stored()), (1, {}))

    def test_the_lists_of_the_project_are_correct(self):
        for path in FOLDER.glob("*.toml"):
            shutil.copy(path, self.folder)
        lists = sorted(path.stem for path in FOLDER.glob("*.toml"))
        self.assertIn("sources", lists)
        _, _, errors = self.run_script("--check", *lists)
        self.assertEqual([line for line in errors.splitlines() if not line.endswith("missing; run the command without --check")], [])


if __name__ == "__main__":
    unittest.main()
