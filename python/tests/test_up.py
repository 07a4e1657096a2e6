"""Engines of unified-planning, on its own test cases."""

import random
import warnings
from fractions import Fraction

import pytest

up = pytest.importorskip("unified_planning", reason="unified-planning is not there")

from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.engines import ValidationResultStatus
from unified_planning.plans import SequentialPlan
from unified_planning.shortcuts import AnytimePlanner, OneshotPlanner, PlanValidator, Replanner
from unified_planning.test.examples import get_example_problems

import metaplan.up

up.shortcuts.get_environment().credits_stream = None
metaplan.up.register()
warnings.filterwarnings("ignore")
EXAMPLES = get_example_problems()
COVERED = sorted(name for name, own in EXAMPLES.items() if metaplan.up.MetaplanEngine.supports(own.problem.kind))
SOLVED = (Status.SOLVED_SATISFICING, Status.SOLVED_OPTIMALLY)


def is_valid(problem, plan):
    """What unified-planning's own validator says."""
    own = "sequential_plan_validator" if isinstance(plan, SequentialPlan) else "up_time_triggered_validator"
    with PlanValidator(name=own) as validator:
        return validator.validate(problem, plan).status == ValidationResultStatus.VALID


def test_enough_is_covered():
    assert len(COVERED) >= 33


@pytest.mark.parametrize("name", COVERED)
def test_problems_of_the_package(name):
    own = EXAMPLES[name]
    with OneshotPlanner(name="metaplan") as planner:
        result = planner.solve(own.problem, timeout=20)
    if own.solvable:
        assert result.status in SOLVED, result
        assert is_valid(own.problem, result.plan)
    else:
        assert result.status == Status.UNSOLVABLE_PROVEN, result


@pytest.mark.parametrize("name", COVERED)
def test_the_validator_agrees_with_that_of_the_package(name):
    own = EXAMPLES[name]
    problem = own.problem
    engine = metaplan.up.MetaplanValidator()
    for plan in [*own.valid_plans, *own.invalid_plans]:
        if engine.supports(problem.kind) and engine.supports_plan(plan.kind):
            status = engine.validate(problem, plan).status
            assert status != ValidationResultStatus.UNKNOWN
            assert (status == ValidationResultStatus.VALID) == is_valid(problem, plan), plan


def mutated(plan, rng):
    """A plan without a step, with one twice, or with two exchanged."""
    actions = list(plan.actions)
    at = rng.randrange(len(actions))
    match rng.randrange(3):
        case 0:
            del actions[at]
        case 1:
            actions.insert(rng.randrange(len(actions) + 1), actions[at])
        case _:
            other = rng.randrange(len(actions))
            actions[at], actions[other] = actions[other], actions[at]
    return SequentialPlan(actions)


def test_mutated_plans_are_judged_alike():
    rng, engine, tried = random.Random(1), metaplan.up.MetaplanValidator(), 0
    plans = [
        (own.problem, plan)
        for own in (EXAMPLES[name] for name in COVERED)
        for plan in own.valid_plans
        if isinstance(plan, SequentialPlan) and len(plan.actions) > 0
    ]
    while tried < 1000:
        problem, plan = plans[tried % len(plans)]
        changed = mutated(plan, rng)
        said = engine.validate(problem, changed).status
        assert said != ValidationResultStatus.UNKNOWN
        assert (said == ValidationResultStatus.VALID) == is_valid(problem, changed), (problem, changed)
        tried += 1


def test_what_is_optimal_is_called_so():
    own = EXAMPLES["basic_with_costs"]
    with OneshotPlanner(name="metaplan", optimality_guarantee="SOLVED_OPTIMALLY") as planner:
        result = planner.solve(own.problem)
    assert result.status == Status.SOLVED_OPTIMALLY
    assert Fraction(result.metrics["lower_bound"]) == Fraction(result.metrics["cost"])


def test_other_modes():
    problem = EXAMPLES["robot_loader_adv"].problem
    with AnytimePlanner(name="metaplan") as planner:
        results = list(planner.get_solutions(problem, timeout=20))
    assert results[-1].status in SOLVED and all(own.status == Status.INTERMEDIATE for own in results[:-1])
    with Replanner(problem, name="replanner[metaplan]") as replanner:
        assert replanner.resolve().status in SOLVED


def test_what_is_not_supported_is_refused_by_name():
    refused = [own.problem for name, own in EXAMPLES.items() if name not in COVERED]
    assert refused
    with OneshotPlanner(name="metaplan") as planner:
        planner.skip_checks = True
        for problem in refused[:10]:
            assert planner.solve(problem, timeout=5).status is not Status.INTERNAL_ERROR
