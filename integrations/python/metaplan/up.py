"""Engines for unified-planning 1.3: ``metaplan`` plans, ``metaplan-val`` validates.

>>> import metaplan.up
>>> metaplan.up.register()
>>> from unified_planning.shortcuts import OneshotPlanner
>>> planner = OneshotPlanner(name="metaplan")

A problem is passed to Metaplan as the PDDL that unified-planning writes; names are mapped back. Actions overlap if a problem has time, and
follow one another otherwise. Fractions stay exact, and the optional goals of an oversubscription metric are preferences of PDDL 3.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from types import FunctionType
from typing import IO, Any

import unified_planning as up
from unified_planning.engines import (
    AnytimeGuarantee,
    CompilationKind,
    Credits,
    Engine,
    FailedValidationReason,
    LogLevel,
    LogMessage,
    OptimalityGuarantee,
    PlanGenerationResult,
    PlanGenerationResultStatus,
    ValidationResult,
    ValidationResultStatus,
)
from unified_planning.engines.compilers import BoundedTypesRemover
from unified_planning.engines.compilers.usertype_fluents_remover import UsertypeFluentsRemover
from unified_planning.engines.compilers.utils import get_fresh_name
from unified_planning.engines.mixins import AnytimePlannerMixin, OneshotPlannerMixin, PlanValidatorMixin
from unified_planning.io import PDDLWriter
from unified_planning.io.pddl_writer import ConverterToPDDLString
from unified_planning.model import DurativeAction, EndTiming, Fluent, FNode, Problem, ProblemKind, StartTiming
from unified_planning.model.fluent import get_all_fluent_exp
from unified_planning.model.metrics import MinimizeActionCosts
from unified_planning.plans import ActionInstance, PlanKind, SequentialPlan, TimeTriggeredPlan

from metaplan._answers import Plan, Step
from metaplan._errors import Error
from metaplan._mission import Mission

__all__ = ["MetaplanEngine", "MetaplanValidator", "compile", "register"]

SEPARATION = "0.001"
"""Distance in time of actions that interfere, for problems without ``epsilon``."""

_FEATURES: dict[str, tuple[str, ...]] = {
    "problem_class": ("ACTION_BASED",),
    # Products of changing numbers are not visible in the problem kind, so they are rejected on
    # reading.
    "problem_type": ("SIMPLE_NUMERIC_PLANNING", "GENERAL_NUMERIC_PLANNING"),
    "time": ("CONTINUOUS_TIME", "SELF_OVERLAPPING"),
    "expression_duration": ("STATIC_FLUENTS_IN_DURATIONS", "INT_TYPE_DURATIONS", "REAL_TYPE_DURATIONS"),
    "numbers": ("BOUNDED_TYPES",),
    "conditions_kind": (
        "NEGATIVE_CONDITIONS",
        "DISJUNCTIVE_CONDITIONS",
        "EQUALITIES",
        "EXISTENTIAL_CONDITIONS",
        "UNIVERSAL_CONDITIONS",
    ),
    "effects_kind": (
        "CONDITIONAL_EFFECTS",
        "INCREASE_EFFECTS",
        "DECREASE_EFFECTS",
        "STATIC_FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "STATIC_FLUENTS_IN_NUMERIC_ASSIGNMENTS",
        "STATIC_FLUENTS_IN_OBJECT_ASSIGNMENTS",
        "FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "FLUENTS_IN_NUMERIC_ASSIGNMENTS",
        "FLUENTS_IN_OBJECT_ASSIGNMENTS",
        "FORALL_EFFECTS",
    ),
    "typing": ("FLAT_TYPING", "HIERARCHICAL_TYPING"),
    "fluents_type": ("INT_FLUENTS", "REAL_FLUENTS", "OBJECT_FLUENTS"),
    "quality_metrics": ("ACTIONS_COST", "FINAL_VALUE", "MAKESPAN", "PLAN_LENGTH", "OVERSUBSCRIPTION"),
    "actions_cost_kind": (
        "STATIC_FLUENTS_IN_ACTIONS_COST",
        "FLUENTS_IN_ACTIONS_COST",
        "INT_NUMBERS_IN_ACTIONS_COST",
        "REAL_NUMBERS_IN_ACTIONS_COST",
    ),
    "oversubscription_kind": ("INT_NUMBERS_IN_OVERSUBSCRIPTION", "REAL_NUMBERS_IN_OVERSUBSCRIPTION"),
    "constraints_kind": ("TRAJECTORY_CONSTRAINTS", "STATE_INVARIANTS"),
    "initial_state": ("UNDEFINED_INITIAL_NUMERIC",),
}

_REASONS = {
    "TIMED_EFFECTS": "timed effects (after the end of a plan they count in unified-planning, and in PDDL they do not)",
    "UNDEFINED_INITIAL_SYMBOLIC": "fluents without an initial value (in PDDL they are false)",
}
"""Explanations for unsupported features whose names do not suffice as an explanation."""

_UNDECLARED = ("DURATION_INEQUALITIES", "FLUENTS_IN_DURATIONS")
"""Features that are supported only with ``skip_checks``, because planning with a metric may not terminate."""

_UNTIMED = ("TRAJECTORY_CONSTRAINTS", "STATE_INVARIANTS")
"""Features that are supported only in problems without time."""


def _kind(features: dict[str, tuple[str, ...]]) -> ProblemKind:
    kind = ProblemKind(version=up.model.problem_kind_versioning.LATEST_PROBLEM_KIND_VERSION)
    for group, names in features.items():
        for name in names:
            getattr(kind, f"set_{group}")(name)
    return kind


def _is_better(result: PlanGenerationResult, other: PlanGenerationResult, maximizes: bool) -> bool:
    """Compares the costs of two plans."""
    cost, other_cost = (Fraction(each.metrics["cost"]) for each in (result, other))
    return cost > other_cost if maximizes else cost < other_cost


def _is_timed(kind: ProblemKind) -> bool:
    return bool(kind.has_continuous_time() or kind.has_discrete_time())


def _refusals(kind: ProblemKind, supported: ProblemKind) -> list[str]:
    """Returns descriptions of the features of ``kind`` that are not in ``supported``."""
    own = set(kind.features)
    missing = [_REASONS.get(name, name.lower().replace("_", " ")) for name in sorted(own - set(supported.features))]
    if _is_timed(kind):
        missing += [f"{name.lower().replace('_', ' ')} in a problem with time" for name in _UNTIMED if name in own]
    return missing


class _Converter(ConverterToPDDLString):
    """Writes rational and truth values exactly; the converter of unified-planning rounds fractions to ten digits and rejects truth values."""

    def convert_fraction(self, frac: Fraction) -> str:
        """Returns a rational number as PDDL."""
        if frac.denominator == 1:
            return str(frac.numerator)
        return f"(/ {frac.numerator} {frac.denominator})"

    def walk_bool_constant(self, expression: FNode, args: list[str]) -> str:
        """Returns a truth value as PDDL: an empty conjunction or disjunction."""
        return "(and)" if expression.is_true() else "(or)"


def _exact(method: Any) -> FunctionType:
    """Returns a method of the writer that uses :class:`_Converter`; the writer has no parameter for the converter."""
    names = {**method.__globals__, "ConverterToPDDLString": _Converter}
    return FunctionType(method.__code__, names, method.__name__, method.__defaults__, method.__closure__)


def _is_positive(problem: Problem, number: FNode, or_zero: bool) -> bool:
    """Returns whether a number is shown to be greater than 0, or at least 0: a constant, or a fluent with such initial values."""
    values = [number]
    if number.is_fluent_exp() and number.fluent() in problem.get_static_fluents():
        found = [problem.initial_value(each) for each in get_all_fluent_exp(problem, number.fluent())]
        # An undefined number has no value, and an action with such a duration is never applicable.
        values = [value for value in found if value is not None]
    if not all(value.is_constant() for value in values):
        return False
    return all(value.constant_value() >= 0 if or_zero else value.constant_value() > 0 for value in values)


def _with_guards(problem: Problem) -> tuple[Problem, bool]:
    """Returns a copy in which an action cannot start while it is running with the same arguments; in PDDL it can.

    The second value is ``False`` if the copy lacks runs without duration that the problem may have.
    """
    guarded, is_complete = problem.clone(), True
    manager, fluents_of = problem.environment.expression_manager, problem.environment.free_vars_extractor
    static = problem.get_static_fluents()
    for action in guarded.actions:
        if not isinstance(action, DurativeAction):
            continue
        duration, lasts = action.duration, manager.TRUE()
        # Start and end of a run without duration are one happening, which cannot set the guard and reset it.
        if not _is_positive(problem, duration.lower, or_zero=duration.is_left_open()):
            if duration.lower == duration.upper and all(each.fluent() in static for each in fluents_of.get(duration.lower)):
                lasts = manager.GT(duration.lower, 0).simplify()
            else:
                is_complete = False
        if lasts.is_false():
            continue
        name = get_fresh_name(guarded, f"running_{action.name}")
        guard = Fluent(name, None, action.parameters, problem.environment)
        guarded.add_fluent(guard, default_initial_value=False)
        running = guard(*action.parameters)
        action.add_condition(StartTiming(), manager.Not(running))
        action.add_effect(StartTiming(), running, True, lasts)
        action.add_effect(EndTiming(), running, False, lasts)
    return guarded, is_complete


def _with_all_costs(problem: Problem, costs: MinimizeActionCosts) -> Problem:
    """Returns a copy with costs for actions of the same names; the writer requires a cost of each action, which is 0 by default."""
    problem = problem.clone()
    problem.clear_quality_metrics()
    by_action = {problem.action(action.name): cost for action, cost in costs.costs.items()}
    default = 0 if costs.default is None else costs.default
    problem.add_quality_metric(MinimizeActionCosts(by_action, default, problem.environment))
    return problem


class _Writer(PDDLWriter):
    """Writes problems as PDDL: with exact numbers, and with optional goals as preferences."""

    problem: Problem
    _write_domain = _exact(PDDLWriter._write_domain)
    _write_problem = _exact(PDDLWriter._write_problem)

    def __init__(self, problem: Problem, guards: bool = False) -> None:
        self._optional: list[tuple[FNode, Fraction]] = []
        if problem.kind.has_oversubscription():
            metric, *others = problem.quality_metrics
            if others:
                raise up.exceptions.UPUnsupportedProblemTypeError("Only one metric is supported!")
            problem = problem.clone()
            problem.clear_quality_metrics()
            manager = problem.environment.expression_manager
            for goal, gain in metric.goals.items():
                # A goal with a negative gain is replaced by its negation with a positive gain.
                goal = manager.auto_promote(goal)[0]
                self._optional.append((goal, Fraction(gain)) if gain >= 0 else (manager.Not(goal), -Fraction(gain)))
        self._unguarded, self.is_complete = problem, True
        metrics = problem.quality_metrics
        if guards:
            problem, self.is_complete = _with_guards(problem)
        # The writer rejects several metrics. Costs are defined for actions without guards.
        if len(metrics) == 1 and metrics[0].is_minimize_action_costs():
            if guards or any(metrics[0].get_action_cost(action) is None for action in problem.actions):
                problem = _with_all_costs(problem, metrics[0])
        PDDLWriter.__init__(self, problem, rewrite_bool_assignments=True)

    def get_problem(self) -> str:
        """Returns the problem as PDDL."""
        # Guards are false at the start, so they are not written. The writer would enumerate all their arguments.
        guarded = self.problem
        self.problem = self._unguarded
        text: str = PDDLWriter.get_problem(self)
        self.problem = guarded
        if not self._optional:
            return text
        converter = _Converter(self.problem.environment, self._get_mangled_name)
        mark = " (:goal (and \n"
        before, _, after = text.rpartition(mark)
        goals = "".join(f"  (preference p{number} {converter.convert(goal)})\n" for number, (goal, _) in enumerate(self._optional))
        losses = " ".join(
            f"(* {converter.convert_fraction(loss)} (is-violated p{number}))" for number, (_, loss) in enumerate(self._optional)
        )
        return f"{before}{mark}{goals}{after.rstrip().removesuffix(')')} (:metric minimize (+ 0 {losses}))\n)\n"


class _Written:
    """A problem of unified-planning written as PDDL, with the mapping from plans back to its actions."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.timed = _is_timed(problem.kind)
        self.separation = SEPARATION if problem.epsilon is None else str(problem.epsilon)
        self._back: list[Callable[[ActionInstance], ActionInstance | None]] = []
        # PDDL has no bounded types, so bounds become conditions. Fluents with objects as values
        # become predicates.
        if problem.kind.has_object_fluents():
            problem = self._compiled(UsertypeFluentsRemover(), problem, CompilationKind.USERTYPE_FLUENTS_REMOVING)
        if problem.kind.has_bounded_types():
            problem = self._compiled(BoundedTypesRemover(), problem, CompilationKind.BOUNDED_TYPES_REMOVING)
        self.written = problem
        self.writer = _Writer(problem, guards=self.timed and not self.problem.self_overlapping)

    def _compiled(self, compiler: Any, problem: Problem, kind: CompilationKind) -> Problem:
        result = compiler.compile(problem, kind)
        self._back.insert(0, result.map_back_action_instance)
        return result.problem

    def mission(self) -> Mission:
        return Mission.from_files(self.writer.get_domain(), self.writer.get_problem())

    def plan(self, found: Plan) -> up.plans.Plan:
        """Converts a plan of Metaplan to a plan of the original problem."""
        environment = self.problem.environment
        manager = environment.expression_manager

        def instance(step: Step) -> ActionInstance:
            objects = [manager.ObjectExp(self.writer.get_item_named(name)) for name in step.arguments]
            # The writer's action may have a guard.
            action = self.written.action(self.writer.get_item_named(step.action).name)
            own = ActionInstance(action, tuple(objects))
            for back in self._back:
                own = back(own)
            return own

        if not self.timed:
            return SequentialPlan([instance(step) for step in found], environment)

        def timed(step: Step) -> tuple[Fraction, ActionInstance, Fraction | None]:
            own = instance(step)
            lasts = isinstance(own.action, DurativeAction)
            return Fraction(step.start), own, Fraction(step.duration) if lasts else None

        return TimeTriggeredPlan([timed(step) for step in found], environment)

    def steps(self, plan: SequentialPlan) -> str:
        """Returns a plan of the original problem as text for the validator."""
        if self._back:
            actions = [
                ActionInstance(self.written.action(own.action.name), own.actual_parameters) for own in plan.actions
            ]
            plan = SequentialPlan(actions, self.problem.environment)
        return self.writer.get_plan(plan) or ";"


_STATUSES = {
    "optimal": PlanGenerationResultStatus.SOLVED_OPTIMALLY,
    "feasible": PlanGenerationResultStatus.SOLVED_SATISFICING,
    "unsolvable": PlanGenerationResultStatus.UNSOLVABLE_PROVEN,
    "unsolvable_within_horizon": PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY,
    "unknown": PlanGenerationResultStatus.TIMEOUT,
}

_CLAIMS = {
    PlanGenerationResultStatus.SOLVED_OPTIMALLY: PlanGenerationResultStatus.SOLVED_SATISFICING,
    PlanGenerationResultStatus.UNSOLVABLE_PROVEN: PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY,
}
"""Statuses that claim something about all plans, with those that remain if some plans are left out."""

_LEFT_OUT = "(among plans without runs of duration 0 of actions whose duration is chosen or changes)"

_UNPROVED = (
    PlanGenerationResultStatus.SOLVED_SATISFICING,
    PlanGenerationResultStatus.TIMEOUT,
    PlanGenerationResultStatus.MEMOUT,
)

_MAX_SHARE = 1e6
"""Maximum time limit of a search without a timeout, in seconds. Without it, the doubled limits could not be represented at some time."""


class MetaplanEngine(Engine, OneshotPlannerMixin, AnytimePlannerMixin):
    """Planner by search and SAT; a plan that it calls optimal is proved to be.

    :param memory_limit: in megabytes, for the states that searches store
    :param certificate: a directory that does not exist yet, for problems without time; :func:`metaplan.verify` checks what is written there
    :param options: further keywords of :meth:`metaplan.Mission.plan`
    """

    def __init__(self, memory_limit: int | None = None, certificate: str | None = None, **options: Any) -> None:
        Engine.__init__(self)
        OneshotPlannerMixin.__init__(self)
        AnytimePlannerMixin.__init__(self)
        self._options: dict[str, Any] = {"memory_limit": memory_limit, "certificate": certificate, **options}

    @property
    def name(self) -> str:
        """Name of the engine in unified-planning."""
        return "metaplan"

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Returns the supported features. Trajectory constraints are supported only without time, see :meth:`supports`."""
        return _kind(_FEATURES)

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Returns ``True`` if problems of this kind are planned for.

        Of general numeric problems, those with products of fluents that actions change are refused when they are read.
        """
        return not _refusals(problem_kind, MetaplanEngine.supported_kind())

    @staticmethod
    def satisfies(optimality_guarantee: OptimalityGuarantee) -> bool:
        """Returns ``True``: the engine gives both guarantees."""
        return True

    @staticmethod
    def ensures(anytime_guarantee: AnytimeGuarantee) -> bool:
        """Returns ``True`` for increasing quality: each intermediate plan is better than the one before.

        The final plan may be equal to the last one.
        """
        return bool(anytime_guarantee == AnytimeGuarantee.INCREASING_QUALITY)

    @staticmethod
    def get_credits(**_: Any) -> Credits | None:
        """Returns authors, licence and description."""
        about = "Task plans and robot architectures, adapted together, with proofs that they are optimal."
        return Credits("Metaplan", "The Metaplan developers", "", "", "MIT OR Apache-2.0", about, about)

    def _solve(
        self,
        problem: up.model.AbstractProblem,
        heuristic: Callable[[up.model.State], float | None] | None = None,
        timeout: float | None = None,
        output_stream: IO[str] | None = None,
    ) -> PlanGenerationResult:
        return self._answer(problem, timeout, output_stream)

    def _get_solutions(
        self, problem: up.model.AbstractProblem, timeout: float | None = None, output_stream: IO[str] | None = None
    ) -> Iterator[PlanGenerationResult]:
        began, share = time.monotonic(), 0.1
        best: PlanGenerationResult | None = None
        maximizes = any(metric.is_maximize_expression_on_final_state() for metric in problem.quality_metrics)
        while True:
            round_began = time.monotonic()
            left = None if timeout is None else max(timeout - (round_began - began), 0.0)
            is_last = left is not None and left <= share
            limit = share if left is None else min(left, share)
            result = self._answer(problem, limit, output_stream)
            # Without a metric, all plans are equally good.
            is_best = result.plan is not None and not problem.quality_metrics
            is_unproved = result.status in _UNPROVED
            # A search that ends without a proof long before its time limit has reached another limit, such as that on memory.
            is_ended = is_best or not is_unproved or time.monotonic() - round_began < limit / 2
            is_better = result.plan is not None and (best is None or _is_better(result, best, maximizes))
            if is_ended or is_last:
                if is_unproved and best is not None and not is_better:
                    best.status = PlanGenerationResultStatus.SOLVED_SATISFICING
                    result = best
                yield result
                return
            if is_better:
                best = result
                # The status of the caller's result must not change when `best` becomes the final result.
                yield replace(result, status=PlanGenerationResultStatus.INTERMEDIATE)
            share = min(2 * share, _MAX_SHARE)

    def _answer(self, problem: Any, timeout: float | None, output_stream: IO[str] | None) -> PlanGenerationResult:
        began = time.monotonic()
        supported = self.supported_kind()
        if self.skip_checks:
            supported = supported.union(_kind({"time": _UNDECLARED[:1], "expression_duration": _UNDECLARED[1:]}))
        if refusals := _refusals(problem.kind, supported):
            # Other features are rejected even with `skip_checks`, because PDDL would give them another
            # meaning.
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, f"not supported: {'; '.join(refusals)}")
        options = dict(self._options)
        try:
            written = _Written(problem)
            mission = written.mission()
            if written.timed:
                options["concurrent"] = written.separation
                options.pop("certificate")
            if not problem.quality_metrics and not options.get("certificate"):
                # Without a metric, all plans are equally good. A certificate needs the proof.
                options["on_improvement"] = lambda *_: False
            found = mission.plan(time_limit=timeout, **options)
        except Error as error:
            if error.code.startswith("M130") or (timeout is not None and time.monotonic() - began >= timeout):
                return self._none(self._limit_status(began, timeout), str(error))
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, str(error))
        except (up.exceptions.UPException, NotImplementedError) as error:
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, str(error) or repr(error))
        is_complete = written.writer.is_complete
        verdict = found.verdict if is_complete else f"{found.verdict} {_LEFT_OUT}"
        if output_stream is not None:
            output_stream.write(f"{verdict}\n")
        status = _STATUSES[found.status]
        if status == PlanGenerationResultStatus.TIMEOUT:
            status = self._limit_status(began, timeout)
        if found and status == PlanGenerationResultStatus.SOLVED_OPTIMALLY and not problem.quality_metrics:
            status = PlanGenerationResultStatus.SOLVED_SATISFICING
        if not is_complete:
            status = _CLAIMS.get(status, status)
        metrics = {"engine_internal_time": str(time.monotonic() - began), "horizon": str(found.horizon)}
        for name, value in (("cost", found.cost), ("lower_bound", found.lower_bound if is_complete else None)):
            if value is not None:
                metrics[name] = str(value)
        if options.get("certificate"):
            metrics["certificate"] = str(options["certificate"])
        return PlanGenerationResult(
            status,
            written.plan(found) if found else None,
            engine_name=self.name,
            metrics=metrics,
            log_messages=[LogMessage(LogLevel.INFO, verdict)],
        )

    def _limit_status(self, began: float, timeout: float | None) -> PlanGenerationResultStatus:
        """Returns the status of a search that a limit has ended now: that on memory if there is one and half of the time is left."""
        # A search may end a moment before its time limit.
        is_over = timeout is not None and time.monotonic() - began >= timeout / 2
        if is_over or self._options["memory_limit"] is None:
            return PlanGenerationResultStatus.TIMEOUT
        return PlanGenerationResultStatus.MEMOUT

    def _none(self, status: PlanGenerationResultStatus, text: str) -> PlanGenerationResult:
        return PlanGenerationResult(status, None, engine_name=self.name, log_messages=[LogMessage(LogLevel.ERROR, text)])

    def destroy(self) -> None:
        """Does nothing: the engine holds no resources."""


class MetaplanValidator(Engine, PlanValidatorMixin):
    """Validator that executes plans by the definition of PDDL, in exact numbers."""

    def __init__(self, **_: Any) -> None:
        Engine.__init__(self)
        PlanValidatorMixin.__init__(self)

    @property
    def name(self) -> str:
        """Name of the engine in unified-planning."""
        return "metaplan-val"

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Returns the supported features: those of the planner except time."""
        return _kind({**_FEATURES, "time": (), "expression_duration": ()})

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Returns ``True`` if plans for problems of this kind are validated."""
        return not _refusals(problem_kind, MetaplanValidator.supported_kind())

    @staticmethod
    def supports_plan(plan_kind: PlanKind) -> bool:
        """Returns ``True`` for sequential plans: PDDL 2.1 decides in another way whether timed steps interfere."""
        return bool(plan_kind == PlanKind.SEQUENTIAL_PLAN)

    def _validate(self, problem: up.model.AbstractProblem, plan: up.plans.Plan) -> ValidationResult:
        try:
            written = _Written(problem)
            verdict = written.mission().validate(written.steps(plan))
        except (Error, up.exceptions.UPException, NotImplementedError) as error:
            log = [LogMessage(LogLevel.ERROR, str(error) or repr(error))]
            return ValidationResult(ValidationResultStatus.UNKNOWN, self.name, log)
        if verdict:
            return ValidationResult(ValidationResultStatus.VALID, self.name, [])
        violation = verdict.violation or {}
        step = violation.get("step")
        reason = FailedValidationReason.UNSATISFIED_GOALS if step is None else FailedValidationReason.INAPPLICABLE_ACTION
        return ValidationResult(
            ValidationResultStatus.INVALID,
            self.name,
            [LogMessage(LogLevel.INFO, str(violation.get("message", "")))],
            None,
            reason,
            plan.actions[step - 1] if step and step <= len(plan.actions) else None,
        )


def compile(problem: Problem | Mission, *knowledge: str, **options: Any) -> Problem:  # noqa: A001 - as unified-planning has it
    """Returns the problem with the configurations of knowledge bases: designs become parameters of actions, and their availability facts.

    ``options`` are those of :meth:`metaplan.Mission.from_files`. For a situation with failures and measurements, pass a mission in place of
    the problem.
    """
    from unified_planning.io import PDDLReader

    if isinstance(problem, Mission):
        mission = problem
    else:
        writer = _Writer(problem)
        mission = Mission.from_files(writer.get_domain(), writer.get_problem(), knowledge, **options)
    compiled = PDDLReader().parse_problem_string(*mission.pddl())
    if isinstance(problem, Problem):
        compiled.self_overlapping = problem.self_overlapping
    return compiled


def register(environment: up.environment.Environment | None = None) -> None:
    """Adds the engines to an environment of unified-planning, by default to the global one."""
    factory = (environment or up.environment.get_environment()).factory
    factory.add_engine("metaplan", __name__, "MetaplanEngine")
    factory.add_engine("metaplan-val", __name__, "MetaplanValidator")
    preference = list(factory.preference_list)
    factory.preference_list = preference + [name for name in ("metaplan", "metaplan-val") if name not in preference]
