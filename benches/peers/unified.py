#!/usr/bin/env python3
"""A planner that is reached through unified-planning only: `unified.py NAME DOMAIN PROBLEM`, the plan on standard output."""

import sys
import warnings

warnings.filterwarnings("ignore")

from unified_planning.io import PDDLReader, PDDLWriter  # noqa: E402
from unified_planning.shortcuts import OneshotPlanner, get_environment  # noqa: E402


def main():
    name, domain, problem = sys.argv[1:]
    get_environment().credits_stream = None
    task = PDDLReader().parse_problem(domain, problem)
    with OneshotPlanner(name=name) as planner:
        result = planner.solve(task)
    print(f"; status {result.status.name}")
    if result.plan is not None:
        print(PDDLWriter(task).get_plan(result.plan))


if __name__ == "__main__":
    main()
