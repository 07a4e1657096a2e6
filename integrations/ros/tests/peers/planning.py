"""Scenarios in which the program is PlanSys2's planner node."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from citizen import ACTIVE, INACTIVE, UNCONFIGURED, answer
from program import Program
from ros2 import Node
from scenarios import Setting, check, scenario
from transport import connect

DOMAIN = """(define (domain ways)
 (:requirements :strips :typing :action-costs)
 (:types place)
 (:predicates (at ?p - place) (way ?p ?q - place))
 (:functions (total-cost) (price ?p ?q - place))
 (:action go :parameters (?p ?q - place)
  :precondition (and (at ?p) (way ?p ?q))
  :effect (and (not (at ?p)) (at ?q) (increase (total-cost) (price ?p ?q)))))"""
# The direct path costs 10; the path through c costs 3 + 3.
PROBLEM = """(define (problem trip) (:domain ways)
 (:objects a b c d - place)
 (:init (at a) (way a b) (way a c) (way c b) (= (total-cost) 0)
        (= (price a b) 10) (= (price a c) 3) (= (price c b) 3))
 (:goal (at b))
 (:metric minimize (total-cost)))"""
CHEAPEST = ["(go a c)", "(go c b)"]
TIMED = """(define (domain timed)
 (:requirements :strips :typing :durative-actions)
 (:types place)
 (:predicates (at ?p - place) (way ?p ?q - place))
 (:durative-action go :parameters (?p ?q - place) :duration (= ?duration 7)
  :condition (and (at start (at ?p)) (at start (way ?p ?q)))
  :effect (and (at start (not (at ?p))) (at end (at ?q)))))"""
TRIP = """(define (problem trip) (:domain timed) (:objects a b c - place)
 (:init (at a) (way a b) (way b c)) (:goal (at c)))"""


@contextmanager
def planner(setting: Setting) -> Iterator[tuple[Node, Program]]:
    """Yields a node and the program as planner, in the state active, which plansys2_lifecycle_manager also sets."""
    program = Program(setting.program, "planner", setting.vendor, setting.domain)
    setting.programs.append(program)
    node = Node(connect(setting.vendor, setting.domain), "executor")
    program.start()
    try:
        state = node.client("/planner/get_state", "lifecycle_msgs/srv/GetState")
        check(node.spin_until(state.ready, 20.0), "the planner was not discovered within 20 s")
        change = node.client("/planner/change_state", "lifecycle_msgs/srv/ChangeState")
        reached = answer(node, state).current_state.id
        check(reached in (UNCONFIGURED, INACTIVE, ACTIVE), f"the state at the start is {reached}")
        if reached == UNCONFIGURED:
            check(bool(answer(node, change, {"transition": {"id": 1, "label": "configure"}}).success), "configure")
            reached = answer(node, state).current_state.id
            check(reached == INACTIVE, f"after configure the state is {reached}")
        if reached == INACTIVE:
            check(bool(answer(node, change, {"transition": {"id": 3, "label": "activate"}}).success), "activate")
        check(answer(node, state).current_state.id == ACTIVE, "not active")
        yield node, program
        check(program.running(), f"the program ended with {program.status()}")
        status = program.stop()
        check(status == 0, f"after SIGINT the program ended with {status}, within 5 s")
    finally:
        node.close()
        if program.running():
            program.kill()


def steps(plan: Any) -> list[str]:
    """Returns the actions of a plan in the order of their start."""
    return [item.action for item in sorted(plan.items, key=lambda item: item.time)]


@scenario()
def planner_node(setting: Setting) -> str:
    """`get_plan` uses the metric, and refuses unsolvable problems and invalid PDDL with a reason."""
    with planner(setting) as (node, _):
        get_plan = node.client("/planner/get_plan", "plansys2_msgs/srv/GetPlan")
        began = time.monotonic()
        found = answer(node, get_plan, {"domain": DOMAIN, "problem": PROBLEM}, 15.0)
        took = time.monotonic() - began
        check(bool(found.success), f"no plan: {found.error_info}")
        check(steps(found.plan) == CHEAPEST, f"the plan is {steps(found.plan)}")
        timed = answer(node, get_plan, {"domain": TIMED, "problem": TRIP}, 15.0)
        check(bool(timed.success), f"no plan: {timed.error_info}")
        check(steps(timed.plan) == ["(go a b)", "(go b c)"], f"the plan is {steps(timed.plan)}")
        check([item.duration for item in timed.plan.items] == [7.0, 7.0], f"durations of {timed.plan}")
        check(timed.plan.items[1].time >= 7.0, f"the second action starts at {timed.plan.items[1].time}")
        nowhere = answer(node, get_plan, {"domain": DOMAIN, "problem": PROBLEM.replace("(at b))", "(at d))")}, 15.0)
        check(not nowhere.success and bool(nowhere.error_info), f"unreachable: {nowhere.error_info!r}")
        broken = answer(node, get_plan, {"domain": DOMAIN, "problem": "(define (problem"}, 15.0)
        check(not broken.success and bool(broken.error_info), f"broken: {broken.error_info!r}")
        array = node.client("/planner/get_plan_array", "plansys2_msgs/srv/GetPlanArray")
        several = answer(node, array, {"domain": DOMAIN, "problem": PROBLEM}, 15.0)
        check(bool(several.success), f"no plan array: {several.error_info}")
        check([steps(plan) for plan in several.plan_array.plan_array][:1] == [CHEAPEST], f"{several.plan_array}")
        validate = node.client("/planner/validate_domain", "plansys2_msgs/srv/ValidateDomain")
        good = answer(node, validate, {"domain": DOMAIN}, 15.0)
        check(bool(good.success), f"a valid domain is refused: {good.error_info}")
        bad = answer(node, validate, {"domain": DOMAIN.replace("(not (at ?p))", "(not (was ?p))")}, 15.0)
        check(not bad.success and bool(bad.error_info), "an invalid domain is accepted, or refused without a reason")
        return f"cheapest plan in {took * 1e3:.0f} ms; refused: {nowhere.error_info.splitlines()[0][:80]}"
