"""Scenarios in which PlanSys2's executor carries out what the program plans: the action `execute_plan` and its feedback."""

from __future__ import annotations

from performers import Executor
from program import ROOT, Program
from ros2 import CANCELED, Node
from scenarios import Setting, check, scenario
from transport import connect

EXAMPLE = ROOT / "integrations" / "ros" / "examples" / "nav2"
# The path of the example's round: 18 m, and two pictures of 2 s. Each metre takes 1 or 2 s, depending on the design.
ROUND = [
    "(move dock gate)",
    "(move gate shelf_1)",
    "(inspect shelf_1)",
    "(move shelf_1 shelf_2)",
    "(inspect shelf_2)",
    "(move shelf_2 gate)",
    "(move gate dock)",
]
BY_LIDAR, BY_CAMERA = 22.0, 40.0


class Patient(Executor):
    """An executor that never ends its first plan, and cancels it on request."""

    def _goal(self, goal: bytes, value: object) -> bool:
        if self.plans:
            return super()._goal(goal, value)
        self.plans.append([(item.time, item.action, item.duration) for item in value.plan.items])
        self._server._on_cancel = self._cancel
        return True

    def _cancel(self, goal: bytes) -> bool:
        self.node.after(0.05, lambda: self._server.finish(goal, CANCELED, {}))
        return True


def experts(node: Node) -> None:
    """Serves PlanSys2's expert services with the domain and the problem of the example."""
    domain, problem = ((EXAMPLE / name).read_text() for name in ("domain.pddl", "problem.pddl"))
    node.serve(
        "/domain_expert/get_domain", "plansys2_msgs/srv/GetDomain", lambda _: {"success": True, "domain": domain}
    )
    node.serve(
        "/problem_expert/get_problem", "plansys2_msgs/srv/GetProblem", lambda _: {"success": True, "problem": problem}
    )


@scenario()
def controller(setting: Setting) -> str:
    """The executor gets the plan. When a design of the plan is lost, the plan is cancelled and another plan is sent."""
    program = Program(setting.program, "controller", setting.vendor, setting.domain, mission=EXAMPLE / "mission.toml")
    setting.programs.append(program)
    node = Node(connect(setting.vendor, setting.domain), "executor")
    try:
        experts(node)
        executor = Patient(node)
        said = node.publisher("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        program.more = ["--ros-args", "--log-level", "debug"]
        program.start()
        check(node.spin_until(lambda: bool(executor.plans), 20.0), "no plan for the executor within 20 s")
        lost = {"level": 2, "name": "monitor", "message": "Component status", "hardware_id": ""}
        said.send({"status": [lost | {"values": [{"key": "c_lidar", "value": "FALSE"}]}]})
        check(node.spin_until(lambda: len(executor.plans) == 2, 10.0), "no other plan within 10 s of a lost design")
        check(node.spin_until(lambda: not program.running(), 10.0), "the program does not end with the plan")
        check(program.status() == 0, f"the program ended with {program.status()}")
        for plan, seconds in zip(executor.plans, (BY_LIDAR, BY_CAMERA), strict=True):
            check([action for _, action, _ in plan] == ROUND, f"the plan is {plan}")
            check(abs(sum(duration for _, _, duration in plan) - seconds) < 1e-3, f"the plan is {plan}")
            ends = [start + duration for start, _, duration in plan]
            check(all(end < after[0] for end, after in zip(ends, plan[1:])), f"actions touch: {plan}")
        check("(inspect shelf_2)" in program.output(), "nothing of the feedback is in the log")
        return f"plans of {BY_LIDAR} s and, without the scanner, {BY_CAMERA} s"
    finally:
        node.close()
        if program.running():
            program.kill()
