"""The package as a whole: types, documentation, extras."""

import ast
import importlib
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import metaplan

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "integrations" / "python"
PAGES = [ROOT / "docs/how-to/python.md", PACKAGE / "README.md"]
BLOCKS = {
    f"{page.stem.lower()}_{number}": block
    for page in PAGES
    for number, block in enumerate(re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL))
    # The client runs the program instead of using the package.
    if "metaplan" in block and "class Loop" not in block
}
USES = """
from decimal import Decimal
from fractions import Fraction
from typing_extensions import assert_type
import metaplan

mission = metaplan.Mission.load("missions/ugv.toml")
assert_type(mission.plan(), metaplan.Plan)
assert_type(mission.plan(minimize="total-cost", time_limit=5, certificate="proof"), metaplan.Plan)
assert_type(mission.plan(pareto=("a", "b"), engine="search"), metaplan.Front)
assert_type([step for step in mission.plan()], list[metaplan.Step])
assert_type([step for plan in mission.plan(pareto=("a", "b")) for step in plan], list[metaplan.Step])
assert_type(mission.plan().cost, int | Decimal | Fraction | None)
assert_type([answer.kind for answer in mission.run([])], list[str])
"""
WRONG = """
import metaplan

mission = metaplan.Mission.load("missions/ugv.toml")
mission.plan(pareto=("a", "b")).cost  # a front has no cost
mission.plan(engine="fast")
mission.plan(time=5)
"""


def mypy(*words):
    pytest.importorskip("mypy", reason="mypy is not there")
    cache = ROOT / "target/python/mypy"
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", PACKAGE / "pyproject.toml", "--cache-dir", cache, *words]
    return subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, check=False)


def test_the_package_and_the_examples_pass_mypy(tmp_path):
    for name, block in {**BLOCKS, "uses": USES}.items():
        (tmp_path / f"block_{name}.py").write_text(block)
    out = mypy("metaplan", *sorted(tmp_path.glob("*.py")))
    assert out.returncode == 0, out.stdout
    (tmp_path / "wrong.py").write_text(WRONG)
    assert mypy(tmp_path / "wrong.py").stdout.count(": error: ") == 3


def test_the_stub_of_the_native_module_is_true():
    pytest.importorskip("mypy", reason="mypy is not there")
    command = [sys.executable, "-m", "mypy.stubtest", "metaplan._native", "--ignore-disjoint-bases", "--mypy-config-file", "pyproject.toml"]
    out = subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, check=False)
    assert out.returncode == 0, out.stdout + out.stderr


def public(name):
    module = importlib.import_module(name)
    for own in module.__all__:
        value = getattr(module, own)
        yield f"{name}.{own}", value
        if inspect.isclass(value):
            yield from ((f"{name}.{own}.{member}", member_of) for member, member_of in vars(value).items() if member[0] != "_")


@pytest.mark.parametrize("name", ["metaplan", "metaplan.up", "metaplan.kb"])
def test_public_members_are_documented(name):
    if name != "metaplan":
        pytest.importorskip({"metaplan.up": "unified_planning", "metaplan.kb": "rdflib"}[name])
    is_code = lambda own: inspect.isroutine(own) or inspect.isclass(own) or isinstance(own, (property, staticmethod, classmethod))  # noqa: E731
    # unified-planning adds methods to its engines.
    is_own = lambda own: getattr(own, "__module__", name).startswith("metaplan")  # noqa: E731
    missing = [own for own, value in public(name) if is_code(value) and is_own(value) and not inspect.getdoc(value)]
    assert not missing


def attributes(body):
    """Yields the attributes that statements assign, each with ``True`` if a documentation string follows."""
    for own, after in zip(body, [*body[1:], None]):
        targets = own.targets if isinstance(own, ast.Assign) else [own.target] if isinstance(own, ast.AnnAssign) else []
        for target in targets:
            name = ast.unparse(target).removeprefix("self.")
            if not name.startswith("_"):
                yield name, isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)


@pytest.mark.parametrize("path", sorted((PACKAGE / "metaplan").glob("*.py")), ids=lambda path: path.stem)
def test_attributes_are_documented(path):
    """A string follows each public attribute. Documentation tools read it from the source; :func:`inspect.getdoc` does not."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ClassDef) and node.name[0] != "_" and "TypedDict" not in map(ast.unparse, node.bases):
            made = [own for own in node.body if isinstance(own, ast.FunctionDef) and own.name == "__init__"]
            own = [statement for statement in (made[0].body if made else []) if "self." in ast.unparse(statement).partition("=")[0] or isinstance(statement, ast.Expr)]
            found = [*attributes(node.body), *attributes(own)]
            documented = {name for name, is_documented in found if is_documented}
            assert {name for name, _ in found} == documented, node.name


def requirements():
    tomllib = pytest.importorskip("tomllib", reason="of Python 3.11")
    extras = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    return {extra: {re.match(r"[\w-]+", own)[0].replace("-", "_") for own in names} for extra, names in extras.items()}


def imports(text):
    for node in ast.walk(ast.parse(text)):
        names = [own.name for own in node.names] if isinstance(node, ast.Import) else [node.module] if isinstance(node, ast.ImportFrom) else []
        yield from (name.partition(".")[0] for name in names)


def test_extras_have_what_is_imported():
    extras = requirements()
    for notebook in (ROOT / "docs/notebooks").glob("*.ipynb"):
        cells = json.loads(notebook.read_text())["cells"]
        used = {name for cell in cells if cell["cell_type"] == "code" for name in imports("".join(cell["source"]))}
        used |= {"pandas"} if "to_df" in notebook.read_text() else set()
        assert used - set(sys.stdlib_module_names) - {"metaplan"} <= extras["notebook"], notebook
    for extra, module in (("unified-planning", "up"), ("up", "up"), ("kb", "kb"), ("data", "_answers")):
        used = set(imports((PACKAGE / f"metaplan/{module}.py").read_text())) - set(sys.stdlib_module_names) - {"metaplan"}
        assert used <= extras[extra], extra


def test_the_version_is_that_of_the_workspace():
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
    assert metaplan.__version__ == version
