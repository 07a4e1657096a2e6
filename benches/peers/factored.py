#!/usr/bin/env python3
"""Maps on which every move takes k functions with m designs each, as PDDL, with the optimum by a search of its own.

`gen_ratpa.py` knows three functions; this has any number. A grid of about n waypoints with corridors left out; each function has
designs of different energy and time for each unit of distance, so that a move has m^k configurations. Encoding n has a
battery as a numeric fluent that is never recharged; c has none, and the time of each move with each configuration in a
table, as classical planners read it. The metric is the total time. Standard library only.

The optimum: Pareto label setting over (waypoint, energy, time). Energy and time of a move are sums over its functions, so the
undominated sums are built function by function.
"""

import functools
import heapq
import itertools
import math
import random


class Map:
    def __init__(self, n, m, k, seed):
        self.n, self.m, self.k = n, m, k
        for attempt in itertools.count():
            self.draw(random.Random(f"factored/{n}/{m}/{k}/{seed}/{attempt}"))
            if math.isfinite(shortest(self.arcs, n)):
                break

    def draw(self, rng):
        n, m, k = self.n, self.m, self.k
        width = max(2, int(n**0.5))
        self.arcs = []
        for i in range(n):
            for j in ([i + 1] if (i + 1) % width and i + 1 < n else []) + ([i + width] if i + width < n else []):
                for arc in [(i, j), (j, i)]:
                    if rng.random() < 0.85:
                        self.arcs.append((*arc, rng.randint(2, 9)))
        self.designs = []
        for _ in range(k):
            energies = [rng.randint(1, 20) for _ in range(m)]
            self.designs.append([(energy, 21 - energy + rng.randint(0, 4)) for energy in energies])
        least = sum(min(energy for energy, _ in designs) for designs in self.designs)
        length = shortest(self.arcs, n)
        self.battery = 2 * least * length if math.isfinite(length) else 0

    def optimum(self, battery):
        """The least total time, without a limit on energy if `battery` is false; None without a plan."""
        sums = [(0, 0)]
        for designs in self.designs:
            sums = undominated((e + f, t + u) for e, t in sums for f, u in designs)
        after = [[] for _ in range(self.n)]
        for source, target, distance in self.arcs:
            after[source].append((target, distance))
        queue, least_energy = [(0, 0, 0)], {}
        while queue:
            time, energy, place = heapq.heappop(queue)
            if place == self.n - 1:
                return time
            if energy >= least_energy.get(place, float("inf")):
                continue
            least_energy[place] = energy if battery else -1
            for target, distance in after[place]:
                for e, t in sums:
                    used = energy + distance * e if battery else 0
                    if used <= self.battery and used < least_energy.get(target, float("inf")):
                        heapq.heappush(queue, (time + distance * t, used, target))
        return None

    def classical_rows(self):
        """How long the table of encoding c is."""
        return len(self.arcs) * self.m**self.k

    def domain(self, battery):
        each = lambda form: " ".join(form.format(i=i) for i in range(self.k))
        # Sums of two: not every planner reads more.
        join = lambda left, right: f"(+ {left} {right})"
        total = lambda name: functools.reduce(join, (f"({name} ?fd{i})" for i in range(self.k)))
        product = lambda name: f"(* (distance ?from ?to) {total(name)})"
        functions = "(distance ?from ?to - waypoint) (energy ?fd - function_design) (time ?fd - function_design) (battery)"
        condition, effect = f"(>= (battery) {product('energy')})", f"(decrease (battery) {product('energy')})"
        time = product("time")
        if not battery:
            functions, condition, effect = f"(move_time ?from ?to - waypoint {each('?fd{i} - function_design')}) - number", "", ""
            time = f"(move_time ?from ?to {each('?fd{i}')})"
        return f"""(define (domain factored)
(:requirements :typing {":numeric-fluents" if battery else ":action-costs"})
(:types waypoint function function_design)
(:predicates (at ?w - waypoint) (corridor ?from ?to - waypoint) (fd_available ?fd - function_design) (fd_solve_f ?fd - function_design ?f - function)
  (requires {each("?f{i} - function")}))
(:functions (total-cost) {"" if battery else "- number"} {functions})
(:action move
  :parameters (?from ?to - waypoint {each("?f{i} - function ?fd{i} - function_design")})
  :precondition (and (requires {each("?f{i}")}) (at ?from) (corridor ?from ?to)
    {each("(fd_solve_f ?fd{i} ?f{i}) (fd_available ?fd{i})")} {condition})
  :effect (and (not (at ?from)) (at ?to) {effect} (increase (total-cost) {time}))))
"""

    def problem(self, battery):
        designs = [(i, f"fd_{i}_{j}", *design) for i, some in enumerate(self.designs) for j, design in enumerate(some)]
        lines = ["(at wp0)", "(= (total-cost) 0)"]
        lines += [f"(requires {' '.join(f'f_{i}' for i in range(self.k))})"]
        lines += [f"(fd_solve_f {name} f_{i}) (fd_available {name})" for i, name, _, _ in designs]
        lines += [f"(corridor wp{a} wp{b})" for a, b, _ in self.arcs]
        if battery:
            lines += [f"(= (energy {name}) {energy}) (= (time {name}) {time})" for _, name, energy, time in designs]
            lines += [f"(= (distance wp{a} wp{b}) {distance})" for a, b, distance in self.arcs]
            lines += [f"(= (battery) {self.battery})"]
        else:
            choices = list(itertools.product(*([(name, time) for i, name, _, time in designs if i == f] for f in range(self.k))))
            for a, b, distance in self.arcs:
                for choice in choices:
                    names, times = zip(*choice)
                    lines.append(f"(= (move_time wp{a} wp{b} {' '.join(names)}) {distance * sum(times)})")
        objects = f"{' '.join(f'wp{i}' for i in range(self.n))} - waypoint {' '.join(name for _, name, _, _ in designs)} - function_design"
        objects += f" {' '.join(f'f_{i}' for i in range(self.k))} - function"
        init = "\n".join(lines)
        return f"""(define (problem factored-{self.n}-{self.m}-{self.k}) (:domain factored)
(:objects {objects})
(:init {init})
(:goal (at wp{self.n - 1}))
(:metric minimize (total-cost)))
"""


def shortest(arcs, n):
    """The length of the shortest way from the first to the last waypoint; infinite if there is none."""
    length = [0] + [float("inf")] * (n - 1)
    for _ in range(n):
        for a, b, distance in arcs:
            length[b] = min(length[b], length[a] + distance)
    return length[n - 1]


def undominated(sums):
    """Of pairs (energy, time) those that no other is as good as in both."""
    best = []
    for energy, time in sorted(set(sums)):
        if not best or time < best[-1][1]:
            best.append((energy, time))
    return best
