"""unified-planning's own test cases beside other engines: `UP_TEST_CASES=DIRECTORY pytest -m peers -s`, with up-aries, up-symk, up-enhsp and
up-fast-downward; the directory is `up_test_cases` of unified-planning's source."""

import collections
import importlib
import os
import sys
import warnings
from fractions import Fraction

import pytest

up = pytest.importorskip("unified_planning", reason="unified-planning is not there")
CASES = os.environ.get("UP_TEST_CASES")
if not CASES:
    pytest.skip("UP_TEST_CASES is not set: `up_test_cases` of unified-planning's source", allow_module_level=True)
sys.path.insert(0, CASES)

from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.engines import ValidationResultStatus
from unified_planning.shortcuts import OneshotPlanner, PlanValidator
from unified_planning.test.examples import get_example_problems

import metaplan.up

PEERS = ("fast-downward-opt", "symk-opt", "enhsp-opt", "aries")
SECONDS = 30
SOLVED = (Status.SOLVED_SATISFICING, Status.SOLVED_OPTIMALLY)


def value(problem, plan):
    """Returns the value of a plan by the problem's only metric, computed by unified-planning."""
    from unified_planning.engines.plan_validator import SequentialPlanValidator

    metric = problem.quality_metrics[0]
    if metric.is_minimize_makespan():
        return max((start + (duration or 0) for start, _, duration in plan.timed_actions), default=Fraction(0))
    said = SequentialPlanValidator(environment=problem.environment).validate(problem, plan)
    return Fraction(said.metric_evaluations[metric])


def cases():
    """Yields test cases as pairs of name and case. Prints the modules whose cases cannot be read."""
    yield from get_example_problems().items()
    for folder, _, files in sorted(os.walk(CASES)):
        for file in sorted(files):
            if file.endswith(".py") and file not in ("utils.py", "report.py"):
                path = os.path.relpath(os.path.join(folder, file), CASES)
                name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
                module = importlib.import_module(name) if "." in name else None
                if getattr(module, "get_test_cases", None) and "partial" not in repr(module.get_test_cases):
                    try:
                        yield from ((f"{name}:{own}", case) for own, case in module.get_test_cases().items())
                    except Exception as missing:  # noqa: BLE001 - files that the distribution lacks, and others
                        print(f"{name}: {missing}")


@pytest.mark.peers
def test_every_case_that_the_kinds_cover():
    up.shortcuts.get_environment().credits_stream = None
    warnings.filterwarnings("ignore")
    metaplan.up.register()
    table, wrong = collections.Counter(), []
    for name, case in cases():
        problem = case.problem
        if not isinstance(problem, up.model.Problem) or not metaplan.up.MetaplanEngine.supports(problem.kind):
            table["refused"] += 1
            continue
        with OneshotPlanner(name="metaplan") as planner:
            result = planner.solve(problem, timeout=SECONDS)
        if result.plan is None:
            said = result.status.name
            if (result.status == Status.UNSOLVABLE_PROVEN) == case.solvable and said != "TIMEOUT":
                wrong.append((name, said, [own.message for own in result.log_messages or []]))
            table["unsolvable" if not case.solvable else said.lower()] += 1
            continue
        own = "sequential_plan_validator" if result.plan.kind.name == "SEQUENTIAL_PLAN" else "up_time_triggered_validator"
        with PlanValidator(name=own) as validator:
            verdict = validator.validate(problem, result.plan)
        if verdict.status != ValidationResultStatus.VALID or not case.solvable:
            wrong.append((name, "not valid", verdict.log_messages))
            continue
        table[result.status.name.lower()] += 1
        if result.status != Status.SOLVED_OPTIMALLY:
            continue
        cost = value(problem, result.plan)
        known = [("unified-planning", case.optimum)] if case.optimum is not None else []
        for peer in PEERS:
            try:
                with OneshotPlanner(name=peer) as planner:
                    if type(planner).supports(problem.kind):
                        found = planner.solve(problem, timeout=SECONDS)
                        if found.status == Status.SOLVED_OPTIMALLY:
                            known.append((peer, value(problem, found.plan)))
            except Exception as error:  # noqa: BLE001 - what a peer cannot do is not our concern
                table[f"{peer} raised {type(error).__name__}"] += 1
        for peer, other in known:
            table[f"as {peer}"] += cost == other
            if cost != other:
                wrong.append((name, f"{cost}, and {peer} has {other}"))
    for what, count in sorted(table.items()):
        print(f"{count:5} {what}")
    assert not wrong, wrong
