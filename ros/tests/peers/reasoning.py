"""Scenarios about MROS's side of the program: the action `/mros/objective`."""

from __future__ import annotations

from oracle import MOTION, PATH, SEARCH, UNGROUND
from scenarios import CLEAR, DARK, Setting, asked, check, no_fault, play, scenario, see


@scenario()
def objectives(setting: Setting) -> str:
    """Feedback tells the design of each objective; an objective is cancelled only when its function could be ungrounded."""
    with play(setting, "reasoner") as (robot, _):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "an objective was not accepted")
        robot.node.spin(2.0)
        goals, client = robot.objectives.goals, robot.objectives.client
        for function, mode in ((MOTION, "fd_all_thrusters"), (PATH, "fd_spiral_high")):
            check(bool(goals[function].feedback), f"no feedback of {function} within 2 s")
            status = goals[function].feedback[-1].qos_status
            check(status.objective_type == function, f"feedback of {function}: {status}")
            check(status.selected_mode == mode, f"feedback of {function}: {status}")
            check(status.objective_id.startswith(f"obj_{function}_"), f"feedback of {function}: {status}")
        see(robot, DARK)
        robot.node.spin(2.0)
        status = goals[PATH].feedback[-1].qos_status
        check(status.selected_mode == "fd_spiral_low", f"feedback after a switch: {status}")
        no_fault(robot)
        robot.modes.faults.refuses = {UNGROUND}
        call = client.cancel(goals[PATH])
        robot.node.spin_until(lambda: call.done, 6.0)
        check(call.value is not None, "no answer to a cancellation")
        check(len(call.value.goals_canceling) == 0, "cancelled, although the function could not be ungrounded")
        check(asked(robot, PATH)[-1] == UNGROUND, f"asked for {asked(robot, PATH)}")
        robot.modes.faults.refuses = set()
        robot.oracle.world.task = None
        robot.oracle.stimulus("cancellation", 0.0)
        check(robot._cancel_goal(PATH), "not cancelled, although the function can be ungrounded")
        check(robot.modes.current(PATH) == UNGROUND, f"{robot.modes.current(PATH)} runs after the cancellation")
        unknown = client.send({"qos_expected": {"objective_id": "obj_x_1", "objective_type": "f_no_such_function"}})
        answered = robot.node.spin_until(lambda: unknown.calls[0].done, 3.0)
        check(answered, "no answer to an objective of an unknown function")
        check(robot._cancel_goal(MOTION), "the other objective is not cancelled")
        return f"{len(asked(robot, PATH))} requests for {PATH}"
