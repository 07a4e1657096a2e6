"""Engines for unified-planning 1.3: ``metaplan`` plans, ``metaplan-val`` validates.

>>> import metaplan.up
>>> metaplan.up.register()
>>> from unified_planning.shortcuts import OneshotPlanner
>>> planner = OneshotPlanner(name="metaplan")

A problem goes to Metaplan as the PDDL that unified-planning writes; names are mapped back. Actions overlap where a problem has time, and follow
one another where it has none.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from fractions import Fraction
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
from unified_planning.engines.mixins import AnytimePlannerMixin, OneshotPlannerMixin, PlanValidatorMixin
from unified_planning.io import PDDLWriter
from unified_planning.model import Problem, ProblemKind
from unified_planning.plans import ActionInstance, PlanKind, SequentialPlan, TimeTriggeredPlan

from metaplan._answers import Plan
from metaplan._errors import Error
from metaplan._mission import Mission

__all__ = ["MetaplanEngine", "MetaplanValidator", "compile", "register"]

SEPARATION = "0.001"
"""How far apart actions lie that interfere, where a problem does not say (``problem.epsilon``)."""

_FEATURES: dict[str, tuple[str, ...]] = {
    "problem_class": ("ACTION_BASED",),
    # Not GENERAL_NUMERIC_PLANNING: what is linear of it is planned for with `skip_checks`, and products of changing numbers are refused.
    "problem_type": ("SIMPLE_NUMERIC_PLANNING",),
    # Not TIMED_EFFECTS: those that come after a plan's end count there, and in PDDL they do not.
    "time": ("CONTINUOUS_TIME", "DISCRETE_TIME"),
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
        "FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "FLUENTS_IN_NUMERIC_ASSIGNMENTS",
        "FORALL_EFFECTS",
    ),
    "typing": ("FLAT_TYPING", "HIERARCHICAL_TYPING"),
    "fluents_type": ("INT_FLUENTS", "REAL_FLUENTS"),
    "quality_metrics": ("ACTIONS_COST", "FINAL_VALUE", "MAKESPAN", "PLAN_LENGTH"),
    "actions_cost_kind": (
        "STATIC_FLUENTS_IN_ACTIONS_COST",
        "FLUENTS_IN_ACTIONS_COST",
        "INT_NUMBERS_IN_ACTIONS_COST",
        "REAL_NUMBERS_IN_ACTIONS_COST",
    ),
    "initial_state": ("UNDEFINED_INITIAL_NUMERIC",),
}


def _epsilon(problem: Problem) -> str:
    return SEPARATION if problem.epsilon is None else str(problem.epsilon)


def _kind(features: dict[str, tuple[str, ...]]) -> ProblemKind:
    kind = ProblemKind(version=up.model.problem_kind_versioning.LATEST_PROBLEM_KIND_VERSION)
    for group, names in features.items():
        for name in names:
            getattr(kind, f"set_{group}")(name)
    return kind


def _is_timed(problem: Problem) -> bool:
    return problem.kind.has_continuous_time() or problem.kind.has_discrete_time()


class _Written:
    """A problem as Metaplan reads it."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.timed = _is_timed(problem)
        self.separation = _epsilon(problem)
        self._back: Callable[[ActionInstance], ActionInstance | None] | None = None
        if problem.kind.has_bounded_types():
            # PDDL has no bounds: they become conditions.
            unbounded = BoundedTypesRemover().compile(problem, CompilationKind.BOUNDED_TYPES_REMOVING)
            problem, self._back = unbounded.problem, unbounded.map_back_action_instance
        self.written = problem
        self.writer = PDDLWriter(problem, rewrite_bool_assignments=True)

    def mission(self) -> Mission:
        return Mission.from_files(self.writer.get_domain(), self.writer.get_problem())

    def plan(self, found: Plan) -> up.plans.Plan:
        """Steps to instances of the problem's own actions."""
        environment = self.problem.environment
        manager = environment.expression_manager

        def instance(step: Any) -> ActionInstance:
            objects = [manager.ObjectExp(self.writer.get_item_named(name)) for name in step.arguments]
            own = ActionInstance(self.writer.get_item_named(step.action), tuple(objects))
            return self._back(own) if self._back else own

        if not self.timed:
            return SequentialPlan([instance(step) for step in found], environment)

        def timed(step: Any) -> tuple[Fraction, ActionInstance, Fraction | None]:
            own = instance(step)
            lasts = isinstance(own.action, up.model.DurativeAction)
            return Fraction(step.start), own, Fraction(step.duration) if lasts else None

        return TimeTriggeredPlan([timed(step) for step in found], environment)


    def steps(self, plan: SequentialPlan) -> str:
        """A plan of the problem as text."""
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


class MetaplanEngine(Engine, OneshotPlannerMixin, AnytimePlannerMixin):
    """Plans by search and SAT, with a proof that the plan is optimal.

    :param memory_limit: in megabytes that searches store
    :param certificate: a directory that does not exist yet, to check the answer with :func:`metaplan.verify`; for problems without time
    :param options: further keywords of :meth:`metaplan.Mission.plan`
    """

    def __init__(self, memory_limit: int | None = None, certificate: str | None = None, **options: Any) -> None:
        Engine.__init__(self)
        OneshotPlannerMixin.__init__(self)
        AnytimePlannerMixin.__init__(self)
        self._options = {"memory_limit": memory_limit, "certificate": certificate, **options}

    @property
    def name(self) -> str:
        """What unified-planning calls it."""
        return "metaplan"

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Which problems are planned for."""
        return _kind(_FEATURES)

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Whether problems of a kind are planned for."""
        return problem_kind <= MetaplanEngine.supported_kind()

    @staticmethod
    def satisfies(optimality_guarantee: OptimalityGuarantee) -> bool:
        """Both guarantees: what is called optimal is proved."""
        return True

    @staticmethod
    def ensures(anytime_guarantee: AnytimeGuarantee) -> bool:
        """Each plan is better than the one before."""
        return anytime_guarantee == AnytimeGuarantee.INCREASING_QUALITY

    @staticmethod
    def get_credits(**_: Any) -> Credits | None:
        """Who made it."""
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
        began, share, best = time.monotonic(), 0.1, None
        while True:
            left = None if timeout is None else timeout - (time.monotonic() - began)
            is_last = left is not None and left <= share
            result = self._answer(problem, left if is_last else share, output_stream)
            is_ended = result.status not in (
                PlanGenerationResultStatus.SOLVED_SATISFICING,
                PlanGenerationResultStatus.TIMEOUT,
            )
            if is_ended or is_last:
                yield result
                return
            cost = None if result.metrics is None else result.metrics.get("cost")
            if result.plan is not None and (best is None or Fraction(cost) < best):
                best = Fraction(cost)
                result.status = PlanGenerationResultStatus.INTERMEDIATE
                yield result
            share *= 2

    def _answer(self, problem: Any, timeout: float | None, output_stream: IO[str] | None) -> PlanGenerationResult:
        began = time.monotonic()
        if not isinstance(problem, Problem):
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, "the problem is not a classical, numeric or temporal one")
        options = dict(self._options)
        try:
            written = _Written(problem)
            mission = written.mission()
            if written.timed:
                options["concurrent"] = written.separation
                options.pop("certificate")
            if not problem.quality_metrics:
                # Nothing is better than another plan.
                options["on_improvement"] = lambda *_: False
            found = mission.plan(time_limit=timeout, **options)
        except Error as error:
            if error.code.startswith("M130") or (timeout is not None and time.monotonic() - began >= timeout):
                return self._none(PlanGenerationResultStatus.TIMEOUT, str(error))
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, str(error))
        except (up.exceptions.UPException, NotImplementedError) as error:
            return self._none(PlanGenerationResultStatus.UNSUPPORTED_PROBLEM, str(error))
        if output_stream is not None:
            output_stream.write(f"{found.verdict}\n")
        status = _STATUSES[found.status]
        if found and status == PlanGenerationResultStatus.SOLVED_OPTIMALLY and not problem.quality_metrics:
            status = PlanGenerationResultStatus.SOLVED_SATISFICING
        metrics = {"engine_internal_time": str(time.monotonic() - began), "horizon": str(found.horizon)}
        for name, value in (("cost", found.cost), ("lower_bound", found.lower_bound)):
            if value is not None:
                metrics[name] = str(value)
        if options.get("certificate"):
            metrics["certificate"] = str(options["certificate"])
        return PlanGenerationResult(
            status,
            written.plan(found) if found else None,
            engine_name=self.name,
            metrics=metrics,
            log_messages=[LogMessage(LogLevel.INFO, found.verdict)],
        )

    def _none(self, status: PlanGenerationResultStatus, text: str) -> PlanGenerationResult:
        return PlanGenerationResult(status, None, engine_name=self.name, log_messages=[LogMessage(LogLevel.ERROR, text)])

    def destroy(self) -> None:
        """Nothing is left behind."""


class MetaplanValidator(Engine, PlanValidatorMixin):
    """Executes plans by the definition of PDDL, in exact numbers, and shares nothing with the planner."""

    def __init__(self, **_: Any) -> None:
        Engine.__init__(self)
        PlanValidatorMixin.__init__(self)

    @property
    def name(self) -> str:
        """What unified-planning calls it."""
        return "metaplan-val"

    @staticmethod
    def supported_kind() -> ProblemKind:
        """For which problems plans are executed: those without time."""
        return _kind({**_FEATURES, "time": (), "expression_duration": ()})

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Whether plans for problems of a kind are executed."""
        return problem_kind <= MetaplanValidator.supported_kind()

    @staticmethod
    def supports_plan(plan_kind: PlanKind) -> bool:
        """Sequences. Whether steps with times interfere is decided otherwise in PDDL 2.1."""
        return plan_kind == PlanKind.SEQUENTIAL_PLAN

    def _validate(self, problem: up.model.AbstractProblem, plan: up.plans.Plan) -> ValidationResult:
        try:
            written = _Written(problem)
            verdict = written.mission().validate(written.steps(plan))
        except (Error, up.exceptions.UPException, NotImplementedError) as error:
            log = [LogMessage(LogLevel.ERROR, str(error))]
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


def compile(problem: Problem, *knowledge: str, **options: Any) -> Problem:  # noqa: A001 - as unified-planning has it
    """The problem with the configurations that knowledge bases add: designs become parameters of actions, and their availability facts.

    ``options`` are those of :meth:`metaplan.Mission.from_files`. What has failed or was measured can be told to a mission instead:
    ``compile(mission)``.
    """
    from unified_planning.io import PDDLReader

    if isinstance(problem, Mission):
        mission = problem
    else:
        writer = PDDLWriter(problem, rewrite_bool_assignments=True)
        mission = Mission.from_files(writer.get_domain(), writer.get_problem(), knowledge, **options)
    return PDDLReader().parse_problem_string(*mission.pddl())


def register(environment: up.environment.Environment | None = None) -> None:
    """Makes the engines known to an environment of unified-planning, the global one unless another is given."""
    factory = (environment or up.environment.get_environment()).factory
    factory.add_engine("metaplan", __name__, "MetaplanEngine")
    factory.add_engine("metaplan-val", __name__, "MetaplanValidator")
    preference = list(factory.preference_list)
    factory.preference_list = preference + [name for name in ("metaplan", "metaplan-val") if name not in preference]
