#!/usr/bin/env python3
"""Fetches the public files that tests and benchmarks read into a cache outside of the project.

    fetch.py [--directory DIR] [--check] [--pin] [LIST ...]

A list is a TOML file of this folder without its suffix, by default `sources`. It pins repositories by commit and
files by SHA-256. Files with the right digest are not fetched again. New files are collected in `DIR.partial` and
moved to DIR together, so that tests never read an incomplete set; after an interruption or an error, the next run
fetches only what is missing. All errors are reported. Needs Python 3.11 and git 2.29.

To fetch from a mirror, or without network from local repositories, configure git:
`git config --global url."BASE/".insteadOf https://github.com/`.
"""

import argparse
import hashlib
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path, PurePosixPath

try:
    import tomllib
except ModuleNotFoundError:
    sys.exit("data: Python 3.11 or newer is needed; run this script with a newer python3")

FOLDER = Path(__file__).resolve().parent
HOSTS = {"github": "https://github.com/"}


def default_directory():
    """Returns the directory in which tests look for data (crates/test-resources)."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "metaplan" / "data"


def data_path(relative):
    """Returns where tests find this test data (crates/test-resources)."""
    directories = [default_directory(), FOLDER.parent.parent / "shared"]
    if os.environ.get("METAPLAN_DATA"):
        directories = [FOLDER.parent / os.environ["METAPLAN_DATA"]]
    paths = [directory / relative for directory in directories]
    return next((path for path in paths if path.exists()), paths[0])


def digest(path):
    """Returns the SHA-256 of a file, or None if there is no such file."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def is_relative(path):
    """Returns True if a path stays within the directory that it is relative to."""
    return bool(path) and "\\" not in path and not PurePosixPath(path).is_absolute() and ".." not in PurePosixPath(path).parts


def read_list(name, errors):
    """Returns the sources of a list. Appends the faults of the list to `errors`."""
    path = FOLDER / f"{name}.toml"
    try:
        sources = tomllib.loads(path.read_text(encoding="utf-8")).get("source", [])
    except FileNotFoundError:
        lists = ", ".join(sorted(path.stem for path in FOLDER.glob("*.toml")))
        errors.append(f"{name}: no such list; the lists are {lists}")
        return []
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        errors.append(f"{path}: {error}")
        return []
    targets = set()
    for number, source in enumerate(sources, 1):
        where = f"{path.name}, source {number} ({source.get('repository', 'without a repository')})"
        host, _, repository = source.get("repository", "").partition(":")
        if host not in HOSTS or not re.fullmatch(r"[\w.-]+/[\w.-]+", repository):
            errors.append(f"{where}: the repository must be HOST:OWNER/NAME, with HOST one of {', '.join(HOSTS)}")
        if not re.fullmatch(r"[0-9a-f]{40}", source.get("commit", "")):
            errors.append(f"{where}: the commit must have 40 hexadecimal digits")
        for key in ["licence", "use"]:
            if not source.get(key):
                errors.append(f"{where}: `{key}` is missing")
        for entry in source.get("files", []):
            if len(entry) != 3 or not all(isinstance(part, str) for part in entry):
                errors.append(f"{where}: {entry} must be [path in the repository, path in the cache, SHA-256]")
                continue
            origin, target, sha256 = entry
            if not is_relative(origin) or not is_relative(target):
                errors.append(f"{where}: {origin}, {target}: paths must be relative, without `..`")
            if not re.fullmatch(r"[0-9a-f]{64}", sha256):
                errors.append(f"{where}: {target}: the digest must have 64 hexadecimal digits; --pin prints it")
            if target in targets:
                errors.append(f"{where}: {target} is listed twice")
            targets.add(target)
    return sources


def git(repository, *arguments, input=None):
    """Returns the output of git. Raises RuntimeError with its last line of errors."""
    command = ["git", "-C", str(repository), *arguments]
    result = subprocess.run(command, input=input, capture_output=True, env={**os.environ, "GIT_TERMINAL_PROMPT": "0"})
    if result.returncode != 0:
        lines = result.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
        raise RuntimeError(f"git {arguments[0]}: {lines[-1]}")
    return result.stdout


def contents(source, origins):
    """Returns the bytes of files of a source, None for files that its commit lacks. Raises RuntimeError."""
    host, _, repository = source["repository"].partition(":")
    with tempfile.TemporaryDirectory(prefix="metaplan-data-") as folder:
        git(folder, "init", "--quiet", "--bare")
        git(folder, "remote", "add", "origin", HOSTS[host] + repository)
        # Only the directories of one commit, then the listed files in one request.
        git(folder, "fetch", "--quiet", "--no-tags", "--depth=1", "--filter=blob:none", "origin", source["commit"])
        blobs = {}
        for entry in git(folder, "ls-tree", "-r", "-z", "--full-tree", source["commit"]).split(b"\0"):
            description, _, path = entry.partition(b"\t")
            if path:
                blobs[path.decode(errors="replace")] = description.split()[2].decode()
        names = sorted({blobs[origin] for origin in origins if origin in blobs})
        fetch = ["-c", "fetch.negotiationAlgorithm=noop", "fetch", "--quiet", "--no-tags", "--no-write-fetch-head"]
        fetch += ["--filter=blob:none", "--stdin", "origin"]
        git(folder, *fetch, input="".join(name + "\n" for name in names).encode())
        return {origin: git(folder, "cat-file", "blob", blobs[origin]) if origin in blobs else None for origin in origins}


def fetch_source(source, directory, partial, errors):
    """Fetches the missing files of a source to `partial`. Returns their number."""
    wrong = [entry for entry in source["files"] if entry[2] not in (digest(directory / entry[1]), digest(partial / entry[1]))]
    if not wrong:
        return 0
    try:
        files = contents(source, [origin for origin, _, _ in wrong])
    except (RuntimeError, OSError) as error:
        remedy = "check the network and git, or configure a mirror (head of data/fetch.py); then run the command again"
        errors.append(f"{source['repository']}: {error}; {remedy}")
        return 0
    count = 0
    for origin, target, expected in wrong:
        content, where = files[origin], f"{source['repository']} {origin}"
        if content is None:
            errors.append(f"{where}: not in commit {source['commit']}; correct the path or the commit")
        elif (actual := hashlib.sha256(content).hexdigest()) != expected:
            errors.append(f"{where}: the digest is {actual}, but the list pins {expected}; not stored")
        else:
            path = partial / target
            path.parent.mkdir(parents=True, exist_ok=True)
            unfinished = path.with_name(path.name + ".unfinished")
            unfinished.write_bytes(content)
            unfinished.replace(path)
            count += 1
    return count


def publish(sources, directory, partial):
    """Moves the fetched files to the directory that tests read, and removes the rest of earlier runs."""
    for source in sources:
        for _, target, expected in source["files"]:
            if digest(directory / target) != expected:
                (directory / target).parent.mkdir(parents=True, exist_ok=True)
                (partial / target).replace(directory / target)
    for root, folders, files in os.walk(partial, topdown=False):
        for name in files:
            os.remove(os.path.join(root, name))
        os.rmdir(root)


def pin(sources, errors):
    """Prints the entries of all files with the digests that they have at the pinned commits."""
    for source in sources:
        try:
            files = contents(source, [origin for origin, _, _ in source["files"]])
        except (RuntimeError, OSError) as error:
            errors.append(f"{source['repository']}: {error}")
            continue
        print(f"# {source['repository']} {source['commit']}")
        for origin, target, _ in source["files"]:
            if files[origin] is None:
                errors.append(f"{source['repository']} {origin}: not in commit {source['commit']}")
            else:
                print(f'    ["{origin}", "{target}", "{hashlib.sha256(files[origin]).hexdigest()}"],')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lists", nargs="*", default=["sources"], metavar="LIST", help="sources (default), benchmarks")
    parser.add_argument("--directory", type=Path, default=default_directory(), help="default: %(default)s")
    parser.add_argument("--check", action="store_true", help="only verify the files in the directory, without network")
    parser.add_argument("--pin", action="store_true", help="print the digests at the pinned commits, store nothing")
    arguments = parser.parse_args()
    directory = arguments.directory.absolute()
    partial = directory.with_name(directory.name + ".partial")
    errors = []
    sources = [source for name in arguments.lists for source in read_list(name, errors)]
    if arguments.pin:
        errors = [error for error in errors if "the digest must" not in error]
    if not errors and arguments.pin:
        pin(sources, errors)
    elif not errors and arguments.check:
        for source in sources:
            for _, target, expected in source["files"]:
                if (actual := digest(directory / target)) != expected:
                    state = "missing" if actual is None else f"the digest is {actual}, expected {expected}"
                    errors.append(f"{directory / target}: {state}; run the command without --check")
    elif not errors:
        count = sum(fetch_source(source, directory, partial, errors) for source in sources)
        if not errors:
            publish(sources, directory, partial)
        total = sum(len(source["files"]) for source in sources)
        print(f"{total} files of {len(sources)} repositories, {count} of them fetched now: {directory}")
    for error in errors:
        print(f"data: {error}", file=sys.stderr)
    if errors:
        sys.exit(1)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        # Such as a full disk. The next run continues.
        sys.exit(f"data: {error}; make room or choose another --directory, then run the command again")
