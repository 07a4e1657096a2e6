"""Rows of `field.py` as a table, and what in them cannot be right. Standard library only."""

import csv
import math

SUITES = ["classical", "unsolvable", "numeric", "temporal", "ours", "middle-classical", "middle-optimal", "middle-numeric",
          "middle-temporal"]
PROOFS = ("optimal", "unsolvable")
# Costs are printed in decimals of different length; epsilon is a thousandth and a planner uses it once for a happening at most.
ROUNDING, EPSILON = 1e-4, 0.001


def read(paths):
    """The last row for each suite, task, problem and planner."""
    rows = {}
    for path in paths:
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                rows[row["suite"], row["task"], row["problem"], row["planner"]] = row
    return rows


def table(rows):
    """By suite and planner: tasks, plans, proofs, and the geometric mean of processor time.

    The mean is over all tasks that the planner was run on, of the time until it ends. A task without a plan, or without a proof, counts with
    the limit, less than 0.01 s as 0.01 s.
    """
    lines = ["| suite | planner | tasks | plan | proof | refused | wrong | mean time to a plan [s] | mean time to a proof [s] | limit [s] |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for suite in SUITES:
        for planner in dict.fromkeys(key[3] for key in rows if key[0] == suite and key[3] != "oracle"):
            mine = [row for key, row in rows.items() if key[0] == suite and key[3] == planner]
            plans = [row for row in mine if row["status"] in ("optimal", "plan") and row["verdict"] != "invalid"]
            proofs = [row for row in mine if row["status"] in PROOFS and row["verdict"] != "invalid"]
            count = lambda status: sum(row["status"] == status for row in mine)
            wrong = sum(row["verdict"].startswith("invalid") for row in mine)
            limits = sorted({float(row["limit_s"]) for row in mine})
            soon = mean([float(row["cpu_s"]) if row in plans else float(row["limit_s"]) for row in mine])
            end = mean([float(row["cpu_s"]) if row in proofs else float(row["limit_s"]) for row in mine])
            cells = [suite, planner, len(mine), len(plans), len(proofs), count("refused"), wrong, soon if plans else "–",
                     end if proofs else "–", " to ".join(f"{limit:g}" for limit in {limits[0]: 0, limits[-1]: 0})]
            lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def quality(rows):
    """By suite and planner: tasks, plans, and the sum of the ratios of the best known cost to the plan's cost.

    The best known cost of a task is that of the best valid plan of all planners. If more is better, the ratio is the inverse.
    """
    lines = ["| suite | planner | tasks | plan | quality |", "|---|---|---|---|---|"]
    plans = {key: value(row) for key, row in rows.items() if row["status"] in ("optimal", "plan") and row["verdict"].startswith("valid")}
    for suite in SUITES:
        for planner in dict.fromkeys(key[3] for key in rows if key[0] == suite and key[3] != "oracle"):
            tasks = [key for key in rows if key[0] == suite and key[3] == planner]
            total = 0
            for key in tasks:
                costs = [cost for other, cost in plans.items() if other[:3] == key[:3]]
                if key in plans:
                    best = max(costs) if rows[key]["aim"] == "maximize" else min(costs)
                    low, high = sorted([best, plans[key]])
                    total += 1 if low == high else low / high if low > 0 else 0
            lines.append(f"| {suite} | {planner} | {len(tasks)} | {sum(key in plans for key in tasks)} | {total:.1f} |")
    return "\n".join(lines)


def mean(times):
    """The geometric mean, in three digits."""
    return f"{math.exp(sum(math.log(max(time, 0.01)) for time in times) / len(times)):.3g}" if times else "–"


def disagreements(rows):
    """Answers that cannot both be right, invalid plans, and, as notes, what epsilon may explain."""
    found = []
    by_task = {}
    for key, row in rows.items():
        by_task.setdefault(key[:3], []).append(row)
    for task, some in by_task.items():
        place = " ".join(task)
        found += [f"{place}: {row['planner']}'s plan: {row['verdict']}" for row in some if row["verdict"] not in ("", "valid", "unread")]
        # The oracle's costs need no plan to be judged by; others are taken as the validator measures them.
        plans = [(row["planner"], value(row)) for row in some
                 if row["status"] in ("plan", "optimal") and (row["verdict"].startswith("valid") or row["planner"] == "oracle")]
        none = [row["planner"] for row in some if row["status"] == "unsolvable"]
        if none and plans:
            found.append(f"{place}: unsolvable by {', '.join(none)}, but a plan by {', '.join(name for name, _ in plans)}")
        for row in some:
            if row["status"] == "optimal" and row["cost"] != "" and row["verdict"] != "invalid":
                found += worse(place, row, plans)
    return found


def worse(place, row, plans):
    """Plans that are cheaper than an optimum that is claimed, and claims that do not cost what the validator says."""
    claimed = value(row)
    sign = -1 if row.get("aim") == "maximize" else 1
    cheaper = [(name, cost) for name, cost in plans if cost is not None and claimed is not None
               and sign * (claimed - cost) > ROUNDING * max(1, abs(claimed))]
    told = float(row["cost"])
    if row["planner"] in ("metaplan", "oracle") and claimed is not None and abs(told - claimed) > ROUNDING * max(1, abs(told)):
        yield f"{place}: {row['planner']} says {told}, its plan costs {claimed}"
    for name, cost in cheaper:
        line = f"{place}: {row['planner']} claims {claimed} as optimal, {name} has a plan of {cost}"
        small = place.startswith(("temporal", "middle-temporal")) and abs(claimed - cost) < 200 * EPSILON
        yield f"note: {line} (as little as different epsilons make)" if small else line


def value(row):
    """What a plan costs by the validator; by its planner where there is no plan to execute."""
    told = row["measured"] or row["cost"]
    return float(told) if told != "" else None
