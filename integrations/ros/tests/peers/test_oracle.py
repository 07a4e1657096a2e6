"""Tests of the oracle with values calculated by hand: thresholds, failures, and requests that it has to reject."""

import time
import unittest

from oracle import FOLLOW, INSPECT, MOTION, PATH, RECHARGE, SEARCH, UNGROUND, Oracle, World


class Right(unittest.TestCase):
    def test_thresholds(self) -> None:
        for metres, mode in (
            (3.75, "fd_spiral_high"),
            (3.25, "fd_spiral_high"),
            (3.2499999, "fd_spiral_medium"),
            (2.25, "fd_spiral_medium"),
            (2.2499999, "fd_spiral_low"),
            (1.25, "fd_spiral_low"),
            (1.2499999, None),
        ):
            self.assertEqual(World(SEARCH, visibility=metres).right()[PATH], mode, metres)

    def test_functions_of_tasks(self) -> None:
        world = World(INSPECT, visibility=1.5, failed={3})
        expected = {MOTION: "fd_recover_thrusters", PATH: UNGROUND, FOLLOW: "fd_follow_pipeline", RECHARGE: UNGROUND}
        self.assertEqual(world.right(), expected)
        world.failed.clear()
        world.battery = 0.25
        expected = {MOTION: "fd_all_thrusters", PATH: UNGROUND, FOLLOW: UNGROUND, RECHARGE: "normal"}
        self.assertEqual(world.right(), expected)


class Judgement(unittest.TestCase):
    def setUp(self) -> None:
        self.oracle = Oracle(World(SEARCH, visibility=3.5))
        self.oracle.running = {MOTION: "fd_all_thrusters", PATH: "fd_spiral_high"}

    def ask(self, function: str, mode: str) -> None:
        self.oracle.answered(function, mode, True, self.oracle.request(function, mode))

    def test_reaction(self) -> None:
        self.oracle.world.visibility = 2.5
        self.oracle.stimulus("v", time.time() - 1.0, diagnostic=True)
        self.ask(PATH, "fd_spiral_medium")
        self.assertEqual(len(self.oracle.reactions), 1)
        self.assertAlmostEqual(self.oracle.reactions[0].answered or 0, 1.0, delta=0.1)
        self.assertEqual((self.oracle.wrong, self.oracle.twice, self.oracle.due()), ([], [], {}))

    def test_wrong_twice_missed(self) -> None:
        self.ask(PATH, "fd_spiral_low")
        self.assertEqual(len(self.oracle.wrong), 1)
        self.ask(PATH, "fd_spiral_high")
        self.ask(PATH, "fd_spiral_high")
        self.assertEqual(len(self.oracle.twice), 1)
        self.oracle.world.failed.add(1)
        self.oracle.stimulus("f", time.time(), diagnostic=True)
        self.assertTrue(self.oracle.awaited())
        self.oracle.give_up()
        self.oracle.give_up()
        self.assertFalse(self.oracle.awaited())
        self.assertEqual(len(self.oracle.missed), 1)

    def test_an_unused_function_may_be_ungrounded_once(self) -> None:
        self.ask(FOLLOW, UNGROUND)
        self.ask(FOLLOW, UNGROUND)
        self.assertEqual((self.oracle.wrong, self.oracle.twice, self.oracle.reactions), ([], [], []))


if __name__ == "__main__":
    unittest.main()
