"""Metaplan's engines for unified-planning, on the test cases of unified-planning and on random problems."""

import random
import time
import warnings
from fractions import Fraction

import pytest

up = pytest.importorskip("unified_planning", reason="unified-planning is not there")

from unified_planning.engines import PlanGenerationResult
from unified_planning.engines import PlanGenerationResultStatus as Status
from unified_planning.engines import ValidationResultStatus
from unified_planning.model.metrics import MaximizeExpressionOnFinalState, MinimizeExpressionOnFinalState
from unified_planning.model.walkers.state_evaluator import StateEvaluator
from unified_planning.plans import SequentialPlan
from unified_planning.shortcuts import AnytimePlanner, OneshotPlanner, PlanValidator, Problem, Replanner, SequentialSimulator
from unified_planning.test.examples import get_example_problems

import metaplan
import metaplan.up

up.shortcuts.get_environment().credits_stream = None
metaplan.up.register()
warnings.filterwarnings("ignore")
EXAMPLES = get_example_problems()
COVERED = sorted(name for name, own in EXAMPLES.items() if metaplan.up.MetaplanEngine.supports(own.problem.kind))
SOLVED = (Status.SOLVED_SATISFICING, Status.SOLVED_OPTIMALLY)


def is_valid(problem, plan):
    """Returns ``True`` if unified-planning's own validator accepts the plan."""
    own = "sequential_plan_validator" if isinstance(plan, SequentialPlan) else "up_time_triggered_validator"
    with PlanValidator(name=own) as validator:
        return validator.validate(problem, plan).status == ValidationResultStatus.VALID


def solve(problem, **options):
    with OneshotPlanner(name="metaplan", params=options) as planner:
        return planner.solve(problem, timeout=600)


def test_what_is_solved_is_declared():
    assert {
        "basic_oversubscription",
        "basic_with_default_values",
        "counter",
        "locations_connected_visited_oversubscription",
        "robot",
        "robot_fluent_of_user_type",
        "robot_int_battery",
        "robot_loader_weak_bridge",
        "robot_real_constants",
        "travel",
        "travel_with_consumptions",
    } <= set(COVERED)
    assert len(COVERED) >= 44


@pytest.mark.parametrize("name", sorted(EXAMPLES.keys() - set(COVERED)))
def test_what_is_not_supported_is_refused_with_its_name(name):
    """The engine returns neither an invalid plan nor an empty message, even if checks are skipped."""
    problem = EXAMPLES[name].problem
    with OneshotPlanner(name="metaplan") as planner:
        for planner.skip_checks in (False, True):
            result = planner.solve(problem, timeout=5)
            assert result.status == Status.UNSUPPORTED_PROBLEM and result.plan is None
            assert result.log_messages[0].message.startswith("not supported: ")


def test_products_of_changing_numbers_are_refused_with_their_place():
    problem = Problem("product")
    x, y = (problem.add_fluent(name, up.shortcuts.RealType(), default_initial_value=1) for name in "xy")
    grow = up.model.InstantaneousAction("grow")
    grow.add_increase_effect(x, up.shortcuts.Times(x, y))
    grow.add_increase_effect(y, 1)
    problem.add_action(grow)
    problem.add_goal(up.shortcuts.GE(x, 5))
    result = solve(problem)
    assert result.status == Status.UNSUPPORTED_PROBLEM and "domain:" in result.log_messages[0].message


def test_truth_values_are_conditions():
    problem = Problem("truth")
    done = problem.add_fluent("done", default_initial_value=False)
    for name, condition in (("never", up.shortcuts.FALSE()), ("always", up.shortcuts.TRUE())):
        action = up.model.InstantaneousAction(name)
        action.add_precondition(condition)
        action.add_effect(done, True)
        problem.add_action(action)
    problem.add_goal(done)
    assert [own.action.name for own in solve(problem).plan.actions] == ["always"]
    problem.add_goal(up.shortcuts.FALSE())
    assert solve(problem).status == Status.UNSOLVABLE_PROVEN


FRACTIONS = [Fraction(1, 3), Fraction(22, 7), Fraction(123456789012345678901, 10**19), Fraction(1, 10**9), Fraction(5, 2)]


@pytest.mark.parametrize("value", FRACTIONS, ids=str)
def test_fractions_stay_exact(value):
    """Fractions stay exact in durations, initial values, conditions, effects and costs, in both directions."""
    timed = Problem("timed")
    timed.epsilon = value / 2
    done = timed.add_fluent("done", default_initial_value=False)
    lasts = timed.add_fluent("lasts", up.shortcuts.RealType(), default_initial_value=value)
    for name, duration in (("constant", value), ("static", lasts)):
        action = up.model.DurativeAction(name)
        action.set_fixed_duration(duration)
        action.add_effect(up.shortcuts.EndTiming(), done, True)
        timed.add_action(action)
    timed.add_goal(done)
    timed.add_quality_metric(up.model.metrics.MinimizeMakespan())
    result = solve(timed)
    assert result.status == Status.SOLVED_OPTIMALLY and is_valid(timed, result.plan)
    assert [duration for _, _, duration in result.plan.timed_actions] == [value]

    numeric = Problem("numeric")
    level = numeric.add_fluent("level", up.shortcuts.RealType(), default_initial_value=value)
    add = up.model.InstantaneousAction("add")
    add.add_precondition(up.shortcuts.LE(level, 2 * value))
    add.add_increase_effect(level, value)
    numeric.add_action(add)
    numeric.add_goal(up.shortcuts.Equals(level, 3 * value))
    numeric.add_quality_metric(up.model.metrics.MinimizeActionCosts({add: up.shortcuts.Real(value)}))
    result = solve(numeric)
    assert result.status == Status.SOLVED_OPTIMALLY and is_valid(numeric, result.plan)
    assert len(result.plan.actions) == 2 and Fraction(result.metrics["cost"]) == 2 * value


def grid(rng):
    """Returns a random problem with Boolean fluents; each action changes some of them."""
    problem = Problem("random")
    fluents = [problem.add_fluent(f"f{index}", default_initial_value=rng.random() < 0.3) for index in range(4)]
    for index in range(4):
        action = up.model.InstantaneousAction(f"a{index}")
        for fluent in rng.sample(fluents, 2):
            action.add_precondition(fluent if rng.random() < 0.6 else up.shortcuts.Not(fluent))
        for fluent in rng.sample(fluents, 2):
            action.add_effect(fluent, rng.random() < 0.6)
        problem.add_action(action)
    return problem, fluents


def literal(fluents, rng):
    chosen = rng.choice(fluents)()
    return chosen if rng.random() < 0.6 else up.shortcuts.Not(chosen)


def traces(problem, steps):
    """Yields the state sequences of all plans up to a number of steps, the shortest first."""
    with SequentialSimulator(problem) as simulator:
        level = [[simulator.get_initial_state()]]
        for _ in range(steps + 1):
            yield from level
            level = [
                [*states, simulator.apply_unsafe(states[-1], action, ())]
                for states in level
                for action in problem.actions
                if simulator.is_applicable(states[-1], action, ())
            ]


def reachable(problem):
    """Returns all reachable states."""
    with SequentialSimulator(problem) as simulator:
        found, queue = {}, [simulator.get_initial_state()]
        while queue:
            state = queue.pop()
            key = tuple(state.get_value(fluent()).is_true() for fluent in problem.fluents)
            if found.setdefault(key, state) is state:
                queue += [simulator.apply_unsafe(state, own, ()) for own in problem.actions if simulator.is_applicable(state, own, ())]
        return list(found.values())


def holds(formula, state):
    return StateEvaluator(Problem()).evaluate(formula, state).is_true()


@pytest.mark.parametrize("seed", range(20))
def test_optional_goals_are_chosen_best(seed):
    """The oracle enumerates all reachable states; gains are fractions, and some are negative."""
    rng = random.Random(seed)
    problem, fluents = grid(rng)
    gains = {}
    for _ in range(4):
        goal = up.shortcuts.And(literal(fluents, rng), up.shortcuts.Or(literal(fluents, rng), literal(fluents, rng)))
        gains[goal] = Fraction(rng.randrange(-6, 20), rng.choice((1, 3, 4)))
    if rng.random() < 0.5:
        problem.add_goal(literal(fluents, rng))
    problem.add_quality_metric(up.model.metrics.Oversubscription(gains))
    gain = lambda state: sum(own for goal, own in gains.items() if holds(goal, state))  # noqa: E731
    ends = [gain(state) for state in reachable(problem) if all(holds(goal, state) for goal in problem.goals)]
    result = solve(problem)
    if not ends:
        assert result.status == Status.UNSOLVABLE_PROVEN
        return
    assert result.status == Status.SOLVED_OPTIMALLY and is_valid(problem, result.plan)
    with PlanValidator(name="sequential_plan_validator") as validator:
        evaluated = validator.validate(problem, result.plan).metric_evaluations[problem.quality_metrics[0]]
    assert evaluated == max(ends)


def production(duration, self_overlapping):
    """Returns a problem that needs two runs of an action, which do not interfere."""
    problem = Problem("production")
    problem.self_overlapping = self_overlapping
    count = problem.add_fluent("count", up.shortcuts.IntType(), default_initial_value=0)
    produce = up.model.DurativeAction("produce")
    produce.set_fixed_duration(duration)
    produce.add_increase_effect(up.shortcuts.EndTiming(), count, 1)
    problem.add_action(produce)
    problem.add_goal(up.shortcuts.Equals(count, 2))
    problem.add_quality_metric(up.model.metrics.MinimizeMakespan())
    return problem


@pytest.mark.parametrize(
    ("duration", "self_overlapping", "makespan"),
    [(5, True, 5), (5, False, 10 + Fraction(metaplan.up.SEPARATION)), (0, True, 0), (0, False, 0)],
)
def test_runs_of_an_action_overlap_only_if_the_problem_permits_it(duration, self_overlapping, makespan):
    problem = production(duration, self_overlapping)
    result = solve(problem)
    assert result.status == Status.SOLVED_OPTIMALLY and is_valid(problem, result.plan)
    assert max(start + duration for start, _, duration in result.plan.timed_actions) == makespan
    assert all(step.action == problem.action("produce") for _, step, _ in result.plan.timed_actions)


@pytest.mark.parametrize("durations", [(5, 3), (3, 0), (3, 7)])
def test_runs_with_different_arguments_overlap(durations):
    """The duration of a run depends on its argument, and is 0 for some."""
    problem = production(1, False)
    problem.clear_actions()
    machine = up.shortcuts.UserType("machine")
    lasts = problem.add_fluent("lasts", up.shortcuts.RealType(), machine=machine)
    produce = up.model.DurativeAction("produce", machine=machine)
    produce.set_fixed_duration(lasts(produce.machine))
    produce.add_increase_effect(up.shortcuts.EndTiming(), problem.fluent("count"), 1)
    problem.add_action(produce)
    for number, duration in enumerate(durations):
        problem.set_initial_value(lasts(problem.add_object(f"machine{number}", machine)), duration)
    result = solve(problem)
    assert result.status == Status.SOLVED_OPTIMALLY and is_valid(problem, result.plan)
    # Either one run of each machine, or two runs of one machine, one after the other.
    best = min(max(durations), *(2 * own + Fraction(metaplan.up.SEPARATION) if own else 0 for own in durations))
    assert max(start + duration for start, _, duration in result.plan.timed_actions) == best


def test_a_problem_with_many_arguments_is_written_fast():
    """A guard of an action with eight arguments has more than 10^10 atoms."""
    problem = production(5, False)
    place = up.shortcuts.UserType("place")
    problem.add_objects([up.model.Object(f"place{number}", place) for number in range(20)])
    visit = up.model.DurativeAction("visit", **{f"place{number}": place for number in range(8)})
    visit.set_fixed_duration(1)
    problem.add_action(visit)
    written = metaplan.up._Written(problem)
    assert "running_visit" in written.writer.get_domain()
    assert "running_visit" not in written.writer.get_problem()


def solve_undeclared(problem):
    with OneshotPlanner(name="metaplan") as planner:
        planner.skip_checks = True
        return planner.solve(problem, timeout=5)


def overlaps(plan):
    """Returns ``True`` if two runs with the same arguments overlap."""
    runs = sorted((start, start + duration, str(step)) for start, step, duration in plan.timed_actions if duration is not None)
    return any(own[2] == other[2] and other[0] < own[1] for index, own in enumerate(runs) for other in runs[index + 1 :])


@pytest.mark.parametrize(
    ("least", "is_open", "is_complete"),
    [(1, False, True), (0, False, False), (0, True, True), (-1, True, False)],
)
def test_chosen_durations_that_may_be_0_restrict_the_claims(least, is_open, is_complete):
    problem = production(5, False)
    interval = "left_open" if is_open else "closed"
    getattr(problem.action("produce"), f"set_{interval}_duration_interval")(least, 3)
    assert metaplan.up._Written(problem).writer.is_complete == is_complete
    result = solve_undeclared(problem)
    assert result.status in (SOLVED if is_complete else SOLVED[:1])
    assert is_valid(problem, result.plan) and not overlaps(result.plan)
    assert is_complete or "lower_bound" not in result.metrics
    assert ("without runs of duration 0" in result.log_messages[0].message) == (not is_complete)


@pytest.mark.parametrize(("durations", "is_complete"), [((5, 3), True), ((3, 0), False)])
def test_initial_values_show_that_chosen_durations_are_positive(durations, is_complete):
    problem = production(1, False)
    problem.clear_actions()
    machine = up.shortcuts.UserType("machine")
    lasts = problem.add_fluent("lasts", up.shortcuts.RealType(), machine=machine)
    produce = up.model.DurativeAction("produce", machine=machine)
    produce.set_closed_duration_interval(lasts(produce.machine), up.shortcuts.Times(2, lasts(produce.machine)))
    produce.add_increase_effect(up.shortcuts.EndTiming(), problem.fluent("count"), 1)
    problem.add_action(produce)
    for number, duration in enumerate(durations):
        problem.set_initial_value(lasts(problem.add_object(f"machine{number}", machine)), duration)
    assert metaplan.up._Written(problem).writer.is_complete == is_complete
    result = solve_undeclared(problem)
    assert result.status in SOLVED and is_valid(problem, result.plan) and not overlaps(result.plan)


@pytest.mark.parametrize("self_overlapping", [False, True])
@pytest.mark.parametrize("goal", ["count", "never"])
def test_durations_that_actions_change_are_solved(self_overlapping, goal):
    """The first run lasts 2, the second 3."""
    problem = Problem("wear")
    problem.self_overlapping = self_overlapping
    worn = problem.add_fluent("worn", up.shortcuts.RealType(), default_initial_value=2)
    reached = [problem.add_fluent(name, default_initial_value=False) for name in ("first", "count", "never")]
    produce = up.model.DurativeAction("produce")
    produce.set_fixed_duration(worn)
    produce.add_effect(up.shortcuts.EndTiming(), reached[1], True, reached[0])
    produce.add_effect(up.shortcuts.EndTiming(), reached[0], True)
    produce.add_effect(up.shortcuts.EndTiming(), worn, 3)
    problem.add_action(produce)
    problem.add_goal(problem.fluent(goal))
    problem.add_quality_metric(up.model.metrics.MinimizeMakespan())
    assert metaplan.up._Written(problem).writer.is_complete == self_overlapping
    result = solve_undeclared(problem)
    if goal == "never":
        proved = Status.UNSOLVABLE_PROVEN if self_overlapping else Status.UNSOLVABLE_INCOMPLETELY
        assert result.status == proved and result.plan is None
        return
    assert result.status in (SOLVED if self_overlapping else SOLVED[:1]) and is_valid(problem, result.plan)
    if not self_overlapping:
        assert [duration for _, _, duration in result.plan.timed_actions] == [2, 3] and not overlaps(result.plan)


@pytest.mark.parametrize(
    ("used", "memory_limit", "status"),
    [(0.9, 100, Status.TIMEOUT), (0.6, 100, Status.TIMEOUT), (0.3, 100, Status.MEMOUT), (0.3, None, Status.TIMEOUT)],
)
def test_memory_has_ended_a_search_only_if_time_was_left(used, memory_limit, status):
    engine = metaplan.up.MetaplanEngine(memory_limit=memory_limit)
    assert engine._limit_status(time.monotonic() - 100 * used, 100) == status
    assert memory_limit is None or engine._limit_status(time.monotonic() - 100 * used, None) == Status.MEMOUT


def test_discrete_time_is_refused():
    problem = production(5, False)
    problem.discrete_time = True
    with OneshotPlanner(name="metaplan") as planner:
        planner.skip_checks = True
        result = planner.solve(problem)
    assert result.status == Status.UNSUPPORTED_PROBLEM
    assert result.log_messages[0].message == "not supported: discrete time"


@pytest.mark.parametrize("is_timed", [False, True])
def test_actions_without_a_cost_cost_nothing(is_timed):
    problem = Problem("costs")
    done = problem.add_fluent("done", default_initial_value=False)
    for name in ("expensive", "free"):
        if is_timed:
            action = up.model.DurativeAction(name)
            action.set_fixed_duration(1)
            action.add_effect(up.shortcuts.EndTiming(), done, True)
        else:
            action = up.model.InstantaneousAction(name)
            action.add_effect(done, True)
        problem.add_action(action)
    problem.add_goal(done)
    costs = {problem.action("expensive"): up.shortcuts.Int(1)}
    problem.add_quality_metric(up.model.metrics.MinimizeActionCosts(costs))
    result = solve(problem)
    assert result.status == Status.SOLVED_OPTIMALLY and Fraction(result.metrics["cost"]) == 0
    steps = [own for _, own, _ in result.plan.timed_actions] if is_timed else result.plan.actions
    assert [own.action.name for own in steps] == ["free"]


def test_the_limit_that_ends_a_search_is_its_status():
    problem = Problem("walk")
    fluents = [problem.add_fluent(name, up.shortcuts.IntType(), default_initial_value=0) for name in "xyz"]
    for name, changes in (("a", (3, -2, 1)), ("b", (-2, 3, 1)), ("c", (1, 1, -3)), ("d", (-1, -1, 2))):
        action = up.model.InstantaneousAction(name)
        for fluent, change in zip(fluents, changes):
            action.add_increase_effect(fluent, change)
        problem.add_action(action)
    for fluent, value in zip(fluents, (30_000, 10_001, -77)):
        problem.add_goal(up.shortcuts.Equals(fluent, value))
    assert solve(problem, memory_limit=1, engine="search").status == Status.MEMOUT
    with OneshotPlanner(name="metaplan") as planner:
        assert planner.solve(problem, timeout=0.5).status == Status.TIMEOUT


def test_optional_goals_of_the_package_as_its_own_planner_has_them():
    for name in ("basic_oversubscription", "locations_connected_visited_oversubscription"):
        problem = EXAMPLES[name].problem
        with OneshotPlanner(name="oversubscription[metaplan]") as planner:
            plans = [planner.solve(problem).plan, solve(problem).plan]
        with PlanValidator(name="sequential_plan_validator") as validator:
            gains = [validator.validate(problem, plan).metric_evaluations[problem.quality_metrics[0]] for plan in plans]
        assert gains[0] == gains[1]


CONSTRAINTS = {
    "Always": lambda a, _: all(a),
    "Sometime": lambda a, _: any(a),
    "AtMostOnce": lambda a, _: sum(now and not before for before, now in zip([False, *a], a)) <= 1,
    "SometimeBefore": lambda a, b: all(any(b[:index]) for index, now in enumerate(a) if now),
    "SometimeAfter": lambda a, b: all(any(b[index:]) for index, now in enumerate(a) if now),
}
"""Definition of each constraint of PDDL 3 on a sequence of states."""


@pytest.mark.parametrize("seed", range(20))
def test_constraints_on_trajectories_hold(seed):
    """The oracle enumerates all plans of at most five steps."""
    rng = random.Random(seed)
    problem, fluents = grid(rng)
    problem.add_goal(literal(fluents, rng))
    free = problem.clone()
    required = []
    for name in rng.sample(list(CONSTRAINTS), 2):
        formulas = [literal(fluents, rng), literal(fluents, rng)]
        required.append((CONSTRAINTS[name], formulas))
        problem.add_trajectory_constraint(getattr(up.shortcuts, name)(*formulas[: 2 if "Before" in name or "After" in name else 1]))
    problem.add_quality_metric(up.model.metrics.MinimizeSequentialPlanLength())

    def is_solution(states):
        values = [[[holds(formula, state) for state in states] for formula in formulas] for _, formulas in required]
        is_goal = all(holds(goal, states[-1]) for goal in problem.goals)
        return is_goal and all(holds_on(*own) for (holds_on, _), own in zip(required, values))

    best = next((len(states) - 1 for states in traces(free, 5) if is_solution(states)), None)
    result = solve(problem)
    if result.plan is None:
        assert result.status == Status.UNSOLVABLE_PROVEN and best is None
        return
    assert result.status == Status.SOLVED_OPTIMALLY
    with SequentialSimulator(free) as simulator:
        states = [simulator.get_initial_state()]
        for own in result.plan.actions:
            states.append(simulator.apply(states[-1], free.action(own.action.name), ()))
    assert is_solution(states)
    assert len(states) - 1 == best or (best is None and len(states) > 6)


@pytest.mark.parametrize("name", COVERED)
def test_problems_of_the_package(name):
    own = EXAMPLES[name]
    with OneshotPlanner(name="metaplan") as planner:
        result = planner.solve(own.problem, timeout=600)
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
    """Returns a random variant of a plan: one step removed, one step repeated, or two steps exchanged."""
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
    while tried < 500:
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
        results = list(planner.get_solutions(problem, timeout=600))
    assert results[-1].status in SOLVED and all(own.status == Status.INTERMEDIATE for own in results[:-1])
    with Replanner(problem, name="replanner[metaplan]") as replanner:
        assert replanner.resolve().status in SOLVED


def test_without_a_metric_the_first_plan_ends_the_search():
    with AnytimePlanner(name="metaplan") as planner:
        results = list(planner.get_solutions(EXAMPLES["basic"].problem))
    assert [result.status for result in results] == [Status.SOLVED_SATISFICING]


@pytest.mark.parametrize(("metric", "yielded"), [(MinimizeExpressionOnFinalState, [5, 3]), (MaximizeExpressionOnFinalState, [5, 7])])
def test_only_better_plans_are_intermediate(metric, yielded):
    problem = EXAMPLES["basic"].problem.clone()
    problem.add_quality_metric(metric(problem.add_fluent("gain", up.shortcuts.RealType())()))
    costs = iter([5, 3, 7])

    def answer(_, limit, __):
        time.sleep(limit)
        cost = next(costs, None)
        if cost is None:
            return PlanGenerationResult(Status.UNSOLVABLE_PROVEN, None, engine_name="metaplan")
        plan = EXAMPLES["basic"].valid_plans[0]
        return PlanGenerationResult(Status.SOLVED_SATISFICING, plan, engine_name="metaplan", metrics={"cost": str(cost)})

    engine = metaplan.up.MetaplanEngine()
    engine._answer = answer
    results = list(engine._get_solutions(problem))
    assert [int(result.metrics["cost"]) for result in results if result.status == Status.INTERMEDIATE] == yielded


def test_the_best_plan_is_the_last_result_of_an_anytime_planner():
    problem = EXAMPLES["basic"].problem.clone()
    problem.add_quality_metric(MinimizeExpressionOnFinalState(problem.add_fluent("gain", up.shortcuts.RealType())()))
    plan = EXAMPLES["basic"].valid_plans[0]
    found = PlanGenerationResult(Status.SOLVED_SATISFICING, plan, engine_name="metaplan", metrics={"cost": "5"})
    answers = iter([found, PlanGenerationResult(Status.TIMEOUT, None, engine_name="metaplan")])

    def answer(_, limit, __):
        # Overhead of a round is not part of its limit.
        time.sleep(limit + 0.2)
        return next(answers)

    engine = metaplan.up.MetaplanEngine()
    engine._answer = answer
    results = list(engine._get_solutions(problem, timeout=0.4))
    assert [result.status for result in results] == [Status.INTERMEDIATE, Status.SOLVED_SATISFICING]
    assert all(result.plan == plan for result in results)


def test_an_anytime_planner_ends_at_a_limit_that_is_not_on_time():
    problem = EXAMPLES["basic"].problem.clone()
    problem.add_quality_metric(MinimizeExpressionOnFinalState(problem.add_fluent("gain", up.shortcuts.RealType())()))
    engine = metaplan.up.MetaplanEngine()
    engine._answer = lambda *_: PlanGenerationResult(Status.TIMEOUT, None, engine_name="metaplan")
    assert [result.status for result in engine._get_solutions(problem)] == [Status.TIMEOUT]


def test_a_problem_without_a_metric_gets_a_certificate(tmp_path):
    result = solve(EXAMPLES["basic"].problem, certificate=str(tmp_path / "certificate"))
    assert result.status in SOLVED
    assert metaplan.verify(result.metrics["certificate"])
