#!/usr/bin/env python3
"""What planners print, read; limits; and rows that contradict one another: `python3 benches/peers/test_peers.py`."""

import json
import tempfile
import unittest
from pathlib import Path

import planners
import process
import report


def row(planner, status, cost="", verdict="", measured="", cpu="1", limit="60"):
    return {"planner": planner, "status": status, "cost": cost, "verdict": verdict, "measured": measured, "cpu_s": cpu, "limit_s": limit}


def rows(suite, *some):
    return {(suite, "task", "p1", one["planner"]): one for one in some}


class Outputs(unittest.TestCase):
    def test_metaplan(self):
        steps = [{"action": "move", "arguments": ["a", "b"], "start": 0.5, "duration": 2}]
        told = {"status": "feasible", "cost": 2.5, "steps": steps, "makespan": 2.5, "statistics": {}}
        self.assertEqual(planners.metaplan_answer(json.dumps(told), 1), ("plan", 2.5, ["0.5: (move a b) [2]"]))
        told.pop("makespan")
        self.assertEqual(planners.metaplan_answer("warning\n" + json.dumps({**told, "status": "optimal"}), 0), ("optimal", 2.5, ["(move a b)"]))
        self.assertEqual(planners.metaplan_answer('{"status": "unsolvable"}', 10).status, "unsolvable")
        self.assertEqual(planners.metaplan_answer('{"status": "limit"}', 12).status, "limit")
        self.assertEqual(planners.metaplan_answer("error P113", 3).status, "refused")
        self.assertEqual(planners.metaplan_answer('{"status": "optimal"}', 70).status, "error")

    def test_kairos(self):
        line = '{"temporal":true,"cost":5,"makespan":5,"steps":[{"time":0.001,"duration":4.999,"action":"(light match0)"}]}\n'
        self.assertEqual(planners.kairos_answer(line, 0, False), ("plan", 5, ["0.001000: (light match0) [4.999000]"]))
        untimed = line.replace("true", "false")
        self.assertEqual(planners.kairos_answer(untimed, 0, True), ("optimal", 5, ["(light match0)"]))
        self.assertEqual(planners.kairos_answer(untimed, 11, True).status, "plan")
        self.assertEqual([planners.kairos_answer("", code, False).status for code in (10, 11, 13, 1)],
                         ["unsolvable", "limit", "refused", "error"])

    def test_quality(self):
        one = row("a", "plan", "4", "valid", "4")
        best = row("b", "plan", "", "valid", "2")
        wrong = row("c", "plan", "1", "invalid")
        some = {key: {**told, "aim": "minimize"} for key, told in rows("classical", one, best, wrong).items()}
        lines = report.quality(some).splitlines()[2:]
        self.assertEqual(lines, ["| classical | a | 1 | 1 | 0.5 |", "| classical | b | 1 | 1 | 1.0 |", "| classical | c | 1 | 0 | 0.0 |"])

    def test_ferroplan(self):
        steps = [{"index": 0, "action": "MOVE", "args": ["A", "B"], "time": 0.002, "duration": 5.0}]
        told = json.dumps({"solved": True, "mode": "temporal", "plan": {"steps": steps}})
        self.assertEqual(planners.ferroplan_answer(told, 0), ("plan", None, ["0.002000: (MOVE A B) [5.000000]"]))
        untimed = json.dumps({"solved": True, "plan": {"steps": [{"action": "MOVE", "args": ["A"]}]}})
        self.assertEqual(planners.ferroplan_answer(untimed, 0).plan, ["(MOVE A)"])
        self.assertEqual(planners.ferroplan_answer("", 124).status, "limit")
        self.assertEqual(planners.ferroplan_answer(json.dumps({"solved": False}), 0).status, "limit")
        self.assertEqual(planners.ferroplan_answer("error: unsupported requirement", 1).status, "refused")

    def test_downward(self):
        with tempfile.TemporaryDirectory() as place:
            Path(place, "sas_plan").write_text("(pick-up b)\n(stack b a)\n; cost = 2 (unit cost)\n")
            told = "Solution found!\n[t=0.002s, 10544 KB] Plan cost: 2\nsearch exit code: 0\n"
            self.assertEqual(planners.downward_answer(told, 0, place), ("optimal", 2.0, ["(pick-up b)", "(stack b a)"]))
            self.assertEqual(planners.downward_answer(told, 0, place, False).status, "plan")
        codes = {11: "unsolvable", 12: "limit", 22: "limit", 23: "limit", 34: "refused", 1: "error"}
        self.assertEqual({code: planners.downward_answer("", code, None).status for code in codes}, codes)

    def test_enhsp(self):
        told = "Problem Solved\n\nFound Plan:\n0.0: (pick item4 rooma)\n1.0: (move bot1)\n\nPlan-Length:2\nMetric (Search):22.0\n"
        self.assertEqual(planners.enhsp_answer(told, 0), ("optimal", 22.0, ["(pick item4 rooma)", "(move bot1)"]))
        self.assertEqual(planners.enhsp_answer(told, 0, None, False).status, "plan")
        self.assertEqual(planners.enhsp_answer("Problem unsolvable\n", 0).status, "unsolvable")
        self.assertEqual(planners.enhsp_answer("Exception in thread main java.lang.RuntimeException", 1).status, "refused")

    def test_lpg(self):
        with tempfile.TemporaryDirectory() as place:
            Path(place, "plan_1.SOL").write_text("; MakeSpan 91.00\n\n0.0002:   (WALK DRIVER2 S2 P1-2) [20.0000])\n")
            self.assertEqual(planners.lpg_answer("", 0, place), ("plan", 91.0, ["0.0002: (WALK DRIVER2 S2 P1-2) [20.0000]"]))
        with tempfile.TemporaryDirectory() as place:
            ends = {"Duration inequalities are not supported by this version": "refused", "...... search limit exceeded.": "limit",
                    "ff: goal can be simplified to FALSE. No plan will solve it": "unsolvable"}
            self.assertEqual({told: planners.lpg_answer(told, 0, place).status for told in ends}, ends)

    def test_unified(self):
        told = "; status SOLVED_SATISFICING\n0: (light_match match2)[5]\n0.01: (mend_fuse fuse1 match2)[4.5]\n"
        self.assertEqual(planners.unified_answer(told, 0),
                         ("plan", 5.0, ["0: (light_match match2)[5]", "0.01: (mend_fuse fuse1 match2)[4.5]"]))
        self.assertEqual(planners.unified_answer("; status TIMEOUT\n", 0).status, "limit")
        self.assertEqual(planners.unified_answer("UPUsageError: tamer cannot solve this kind of problem", 1).status, "refused")


class Limits(unittest.TestCase):
    def test_processor_time_ends_a_process(self):
        done = process.run(["sh", "-c", "while :; do :; done"], ".", 1, 1024)
        self.assertTrue(done.late)
        self.assertGreater(done.cpu, 0.8)

    def test_an_end_in_time_is_not_late(self):
        done = process.run(["sh", "-c", "echo told; exit 3"], ".", 5, 1024)
        self.assertEqual((done.code, done.output, done.late), (3, "told\n", False))

    def test_who_is_asked_may_answer(self):
        answers = "trap 'echo best so far; exit 1' INT; while :; do :; done"
        done = process.run(["sh", "-c", answers], ".", 1, 1024, ask=True)
        self.assertEqual((done.code, done.output, done.late), (1, "best so far\n", True))


class Reports(unittest.TestCase):
    def test_answers_that_contradict(self):
        optimal = row("one", "optimal", "10", "valid", "10")
        self.assertEqual(report.disagreements(rows("classical", optimal, row("two", "plan", "11", "valid", "11"))), [])
        self.assertEqual(len(report.disagreements(rows("classical", optimal, row("two", "plan", "9", "valid", "9")))), 1)
        self.assertEqual(len(report.disagreements(rows("classical", optimal, row("two", "unsolvable")))), 1)
        self.assertEqual(len(report.disagreements(rows("classical", row("two", "plan", "9", "invalid")))), 1)
        # An optimum that no plan shows: both claims are told, whichever is wrong.
        self.assertEqual(len(report.disagreements(rows("ours", optimal, row("oracle", "optimal", "9")))), 1)

    def test_more_may_be_better(self):
        optimal, worse = ({**one, "aim": "maximize"} for one in (row("one", "optimal", "5", "valid", "5"), row("two", "plan", "4", "valid", "4")))
        self.assertEqual(report.disagreements(rows("classical", optimal, worse)), [])
        self.assertEqual(len(report.disagreements(rows("classical", optimal, {**worse, "cost": "6", "measured": "6"}))), 1)

    def test_epsilon_is_a_note(self):
        claims = [row("one", "optimal", "10.004", "valid", "10.004"), row("two", "plan", "10.001", "valid", "10.001")]
        self.assertTrue(all(line.startswith("note:") for line in report.disagreements(rows("temporal", *claims))))
        self.assertFalse(any(line.startswith("note:") for line in report.disagreements(rows("classical", *claims))))

    def test_coverage(self):
        some = {("classical", name, "p1", "one"): one for name, one in
                [("a", row("one", "optimal", "1", "valid", cpu="0.1")), ("b", row("one", "plan", "1", "valid", cpu="10")),
                 ("c", row("one", "refused"))]}
        self.assertIn("| classical | one | 3 | 2 | 1 | 1 | 0 | 3.91 | 7.11 | 60 |", report.table(some))


if __name__ == "__main__":
    unittest.main()
