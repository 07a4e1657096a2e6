#!/usr/bin/env python3
"""Produces the tables with measured figures of the README and the book from pinned inputs, and runs the long test suites.

    reproduce.py              lists all tables and suites with their last run, and checks the figures that the README repeats
    reproduce.py NAME ...     runs the commands of tables or suites; `readme` names all tables that the README cites

A run records the machine, the load and a digest of all inputs. It writes the output of the last command to
`benches/results/NAME.txt`, one line to `benches/runs.tsv`, and the list of all tables to `benches/TABLES.md`. It does
not change the pages. `benches/tables.toml` has the tables:

- `page`: where the table is;
- `commands`: run in this order; the output of the last one is the result. `{python}` is this Python, `{scratch}` a
  directory in `target`, and `{data:PATH}` a path of the test data (CONTRIBUTING.md);
- `inputs`: files and directories, below the root of the project or, after `data:`, of the test data. If
  `data/fetch.py` fetches them, they must have the pinned digests;
- `measures`: code whose later change makes the figures old;
- `rows` (optional): pattern of the rows of the page that must occur in the output, because the figures do not depend
  on the machine;
- `duration` (optional): of a run, if it is long.

`benches/suites.toml` has the suites. They have the same keys, without `page` and `rows`, and also:

- `ignored`: files, or directories, whose ignored tests the suite runs. Every file with an ignored test must belong to a
  suite or a table, unless its reasons say that the tests are tools, parts of other tests, or need another program.

Needs Python 3.11 and git.
"""

import argparse
import csv
import datetime
import hashlib
import os
import platform
import re
import resource
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "data"))
import fetch  # noqa: E402
from fetch import data_path  # noqa: E402

COLUMNS = ["table", "date", "commit", "inputs", "machine", "load_before", "load_after", "other_cores", "seconds", "result"]
BENCHES = ROOT / "benches"


def git(*arguments):
    return subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True, text=True).stdout.strip()


def machine():
    """Returns processor, cores, memory and operating system."""
    processor = platform.processor() or platform.machine()
    memory = ""
    if Path("/proc/cpuinfo").exists():
        models = re.findall(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
        processor = models[0].strip() if models else processor
        kilobytes = int(re.search(r"MemTotal:\s*(\d+)", Path("/proc/meminfo").read_text())[1])
        memory = f", {kilobytes / 2**20:.0f} GiB"
    return f"{processor}, {os.cpu_count()} cores{memory}, {platform.system()}"


def busy_seconds():
    """Returns the processor time of all programs since the start of the machine, or None if unknown."""
    if not Path("/proc/stat").exists():
        return None
    times = [int(part) for part in Path("/proc/stat").read_text().split("\n")[0].split()[1:]]
    # All but idle time and waiting for devices; the time of guests is part of that of users.
    return (sum(times[:8]) - times[3] - times[4]) / os.sysconf("SC_CLK_TCK")


def own_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def pinned():
    """Returns the digests of all files that data/fetch.py fetches, by path."""
    errors = []
    sources = [source for path in sorted((ROOT / "data").glob("*.toml")) for source in fetch.read_list(path.stem, errors)]
    return {target: sha256 for source in sources for _, target, sha256 in source["files"]}


def input_digest(table, errors):
    """Returns a digest of all inputs of a table. Appends missing and changed inputs to `errors`."""
    digests, total = pinned(), hashlib.sha256()
    for name in table.get("inputs", []):
        is_data = name.startswith("data:")
        path = data_path(name[5:]) if is_data else ROOT / name
        if not path.exists():
            public = is_data and any(f"{target}/".startswith(f"{name[5:]}/") for target in digests)
            remedy = "run data/fetch.py sources benchmarks" if public else "it is not published; set METAPLAN_DATA to a directory with it"
            errors.append(f"{table['name']}: {path} does not exist" + (f"; {remedy}" if is_data else ""))
            continue
        if is_data:
            files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
        else:
            # Only committed files: others do not belong to the commit that the record names.
            files = [ROOT / file for file in git("ls-files", name).splitlines() if (ROOT / file).is_file()]
        for file in files:
            relative = name[5:] + file.as_posix()[len(path.as_posix()):] if is_data else file.relative_to(ROOT).as_posix()
            actual = fetch.digest(file)
            if is_data and digests.get(relative, actual) != actual:
                errors.append(f"{table['name']}: {file} does not have the pinned digest; run data/fetch.py")
            total.update(f"{relative} {actual}\n".encode())
    return total.hexdigest()[:16]


def runs():
    path = BENCHES / "runs.tsv"
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def last_runs():
    return {run["table"]: run for run in runs()}


def missing_rows(table, output):
    """Returns the rows of the page that the output lacks."""
    lines = (ROOT / table["page"].split("#")[0]).read_text().splitlines()
    produced = set(output.splitlines())
    return [line for line in lines if re.search(table["rows"], line) and line not in produced]


def reproduce(table, errors):
    """Runs a table and records the run."""
    before = len(errors)
    inputs = input_digest(table, errors)
    if len(errors) > before:
        return
    scratch = ROOT / "target" / "reproduce"
    scratch.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "METAPLAN_REQUIRE": "data,public-data" if any(name.startswith("data:") for name in table.get("inputs", [])) else ""}
    started, load, busy, own = datetime.datetime.now(datetime.UTC), os.getloadavg()[0], busy_seconds(), own_seconds()
    output, passed = "", 0
    for command in table["commands"]:
        command = re.sub(r"\{data:([^}]*)\}", lambda match: shlex.quote(str(data_path(match[1]))), command)
        command = command.replace("{python}", shlex.quote(sys.executable)).replace("{scratch}", shlex.quote(str(scratch)))
        print(f"$ {command}", file=sys.stderr, flush=True)
        process = subprocess.run(shlex.split(command), cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
        output = process.stdout
        passed += sum(int(count) for count in re.findall(r"^test result: .*? (\d+) passed", output, re.MULTILINE))
        if process.returncode != 0:
            print(output, file=sys.stderr)
            errors.append(f"{table['name']}: exit status {process.returncode}: {command}")
            break
    seconds = (datetime.datetime.now(datetime.UTC) - started).total_seconds()
    other = "" if busy is None else f"{max(0.0, (busy_seconds() - busy - (own_seconds() - own)) / max(seconds, 0.01)):.1f}"
    # Lines of the test harness are not figures.
    noise = r"(running \d+ tests?|test result: .*|test .* \.\.\. ok|ok)?"
    figures = [line for line in output.splitlines() if not re.fullmatch(noise, line)]
    if "rows" in table and len(errors) == before:
        errors.extend(f"{table['name']}: {table['page']} differs: {row}" for row in missing_rows(table, output))
    changed = "+changes" if git("status", "--porcelain", "--untracked-files=no", *table["measures"]) else ""
    run = dict(zip(COLUMNS, [
        table["name"], f"{started:%Y-%m-%d %H:%M}", git("rev-parse", "--short=10", "HEAD") + changed, inputs, machine(),
        f"{load:.1f}", f"{os.getloadavg()[0]:.1f}", other, f"{seconds:.0f}", result(table, passed, len(errors) > before),
    ]))
    record(run, figures)


def result(table, passed, has_failed):
    if has_failed:
        return "failed"
    return "ok" if "page" in table else f"ok: {passed} tests passed"


def record(run, figures):
    (BENCHES / "results").mkdir(exist_ok=True)
    head = [f"{key}: {run[key]}" for key in COLUMNS]
    if run["result"].startswith("ok"):
        (BENCHES / "results" / f"{run['table']}.txt").write_text("\n".join([*head, "", *figures]) + "\n")
    print("\n".join([*head, "", *figures]))
    path = BENCHES / "runs.tsv"
    is_new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, delimiter="\t", lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(run)


def last_run(table, last):
    """Returns the cells of the last run of a table."""
    run = last.get(table["name"])
    if not run:
        return ["never recorded", "", "", "", "", ""]
    return [run["date"], run["commit"], run["result"], f"{run['load_before']}, {run['load_after']}", run["other_cores"], run["machine"]]


def unlisted(tables):
    """Returns errors for files with ignored tests that no suite and no table runs."""
    paths = [path for table in tables for path in table.get("ignored", [])]
    errors = [f"suites.toml: {path} does not exist" for path in paths if not (ROOT / path).exists()]
    for file in git("ls-files", "*.rs").splitlines():
        reasons = re.findall(r'#\[ignore = "([^"]*)"\]', (ROOT / file).read_text())
        is_listed = any(file == path or file.startswith(f"{path}/") for path in paths)
        if not is_listed and not all(re.search(r"^a tool|part of|needs ", reason) for reason in reasons):
            errors.append(f"{file}: no suite of benches/suites.toml runs its ignored tests: {'; '.join(reasons)}")
    return errors


def markdown(tables):
    """Returns the list of tables as a page."""
    last = last_runs()
    lines = [
        "# Tables with measured figures", "",
        "`just reproduce NAME` writes this list (benches/reproduce.py). Load is the average of a minute, before and after the run;",
        "*other* is the mean number of cores that other programs used during the run. `benches/results` has the figures.", "",
        "| table | page | inputs | last run (UTC) | commit | result | load | other | machine |", "|---|---|---|---|---|---|---|---|---|",
    ]
    for table in tables:
        if "page" in table:
            inputs = ", ".join(f"`{name}`" for name in table["inputs"])
            lines.append("| " + " | ".join([table["name"], f"[{table['page']}](../{table['page']})", inputs, *last_run(table, last)]) + " |")
    suites = [table for table in tables if "page" not in table]
    if suites:
        lines += ["", "## Long test suites", "", "`just long NAME` runs a suite. Its tests are ignored by `cargo test`.", ""]
        lines += ["| suite | ignored tests in | last run (UTC) | commit | result | load | other | machine |", "|---|---|---|---|---|---|---|---|"]
    for suite in suites:
        lines.append("| " + " | ".join([suite["name"], ", ".join(f"`{path}`" for path in suite["ignored"]), *last_run(suite, last)]) + " |")
    for table in tables:
        lines += ["", f"## {table['name']}", "", *([f"A run takes {table['duration']}.", ""] if "duration" in table else []), "```text"]
        lines += [*(re.sub(r"\s+", " ", command) for command in table["commands"]), "```"]
    return "\n".join(lines) + "\n"


def wrong_figures(figures, tables):
    """Returns errors for figures of the README that differ from the page of their table."""
    pages = {table["name"]: table["page"].split("#")[0] for table in tables if "page" in table}
    readme = (ROOT / "README.md").read_text()
    errors = []
    for figure in figures:
        page = pages.get(figure["table"])
        if page is None:
            errors.append(f"tables.toml: no table {figure['table']}")
        elif figure["text"] not in readme:
            errors.append(f"README.md lacks \"{figure['text']}\", which tables.toml lists; change both")
        elif figure["row"] not in (ROOT / page).read_text():
            errors.append(f"README.md has \"{figure['text']}\", but {page} has no row \"{figure['row']}\"; correct the README and tables.toml")
    return errors


def print_list(tables):
    """Prints each table with its last run and the number of later commits to the code that it measures."""
    last = last_runs()
    for table in tables:
        run = last.get(table["name"])
        state = "never recorded"
        if run:
            commit = run["commit"].removesuffix("+changes")
            known = subprocess.run(["git", "-C", str(ROOT), "cat-file", "-e", commit], capture_output=True).returncode == 0
            later = git("rev-list", "--count", f"{commit}..HEAD", "--", *table["measures"]) if known else "unknown"
            state = f"{run['date']}, {run['result']}, load {run['load_before']}; later commits to what it measures: {later}"
        print(f"{table['name']:20} {table.get('page', 'long test suite')}\n{'':20} {state}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="*", metavar="NAME")
    parser.add_argument("--check", action="store_true", help="only check the figures of the README and the list of tables")
    arguments = parser.parse_args()
    content = tomllib.loads((BENCHES / "tables.toml").read_text())
    suites = BENCHES / "suites.toml"
    tables, figures = content["table"], content["figure"]
    tables += tomllib.loads(suites.read_text())["suite"] if suites.exists() else []
    by_name = {table["name"]: table for table in tables}
    names = [name for argument in arguments.tables for name in ([figure["table"] for figure in figures] if argument == "readme" else [argument])]
    errors = [f"{name}: no such table or suite; there are readme, {', '.join(by_name)}" for name in names if name not in by_name]
    if not errors and names:
        for name in dict.fromkeys(names):
            reproduce(by_name[name], errors)
        (BENCHES / "TABLES.md").write_text(markdown(tables))
    elif not errors:
        errors = wrong_figures(figures, tables)
        page = BENCHES / "TABLES.md"
        if not page.exists() or page.read_text() != markdown(tables):
            errors.append("benches/TABLES.md is not the list of benches/tables.toml and runs.tsv; `just reproduce public-tasks` writes it in a second")
        errors += [f"{table['name']}: {table['page'].split('#')[0]} does not exist" for table in tables if "page" in table and not (ROOT / table["page"].split("#")[0]).exists()]
        errors += [f"{table['name']}: {path} does not exist" for table in tables for path in table["measures"] if not (ROOT / path).exists()]
        errors += unlisted(tables)
        if not arguments.check:
            print_list(tables)
    for error in errors:
        print(f"reproduce: {error}", file=sys.stderr)
    if errors:
        sys.exit(1)


if __name__ == "__main__":
    main()
