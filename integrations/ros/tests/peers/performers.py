"""Nodes that perform actions of a plan: a PlanSys2 performer on `actions_hub`, Nav2's server, PlanSys2's executor."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from oracle import INSPECT, MOTION, PATH, SEARCH, UNGROUND
from program import MISSION, Program
from ros2 import SUCCEEDED, ActionServer, Node
from scenarios import CLEAR, Setting, check, play, scenario, see
from transport import Qos

REQUEST, RESPONSE, CONFIRM, REJECT, FEEDBACK, FINISH, CANCEL = range(1, 8)
HUB_QOS = Qos(100)


@dataclass
class Performer:
    """A node of PlanSys2's ActionExecutorClient. It responds to a request, and works after the confirmation."""

    node: Node
    action: str
    name: str = "performer_1"
    heard: list[tuple[int, str, list[str]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        kind = "plansys2_msgs/msg/ActionExecution"
        self._hub = self.node.publisher("/actions_hub", kind, HUB_QOS)
        self.node.subscribe("/actions_hub", kind, self._take, HUB_QOS)

    def _take(self, message: Any) -> None:
        if message.action != self.action or message.type in (RESPONSE, FEEDBACK, FINISH):
            return  # of another action, or our own words
        arguments = list(message.arguments)
        self.heard.append((int(message.type), message.node_id, arguments))
        if message.type == REQUEST:
            self._say(RESPONSE, arguments)
        elif message.type == CONFIRM and message.node_id == self.name:
            for step in (1, 2, 3):
                self.node.after(0.1 * step, lambda done=step: self._say(FEEDBACK, arguments, done / 4))
            self.node.after(0.4, lambda: self._say(FINISH, arguments, 1.0, True))

    def _say(self, kind: int, arguments: list[str], completion: float = 0.0, success: bool = False) -> None:
        words = {"node_id": self.name, "action": self.action, "arguments": arguments, "status": "working"}
        self._hub.send({"type": kind, **words, "completion": completion, "success": success})

    def types(self) -> list[int]:
        """Returns the types of the received messages."""
        return [kind for kind, _, _ in self.heard]


@dataclass
class Navigator:
    """Nav2's bt_navigator, as a client sees it."""

    node: Node
    poses: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._server = ActionServer(self.node, "/navigate_to_pose", "nav2_msgs/action/NavigateToPose", self._goal)

    def _goal(self, goal: bytes, value: Any) -> bool:
        self.poses.append(value.pose)
        for step in (3.0, 2.0, 1.0):
            said = {"distance_remaining": step, "current_pose": {"header": {"frame_id": "map"}}}
            self.node.after(0.1 * (4 - step), lambda feedback=said: self._server.feedback(goal, feedback))
        self.node.after(0.5, lambda: self._server.finish(goal, SUCCEEDED, {}))
        return True


@dataclass
class Executor:
    """PlanSys2's executor. It accepts a plan, reports each action and ends."""

    node: Node
    plans: list[list[tuple[float, str, float]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._server = ActionServer(self.node, "/execute_plan", "plansys2_msgs/action/ExecutePlan", self._goal)

    def _goal(self, goal: bytes, value: Any) -> bool:
        items = [(item.time, item.action, item.duration) for item in value.plan.items]
        self.plans.append(items)
        for step, (_, action, _) in enumerate(items, start=1):
            info = {"status": 2, "action_full_name": f"{action}:0", "action": action, "completion": 0.5}
            said = {"action_execution_status": [info]}
            self.node.after(0.1 * step, lambda feedback=said: self._server.feedback(goal, feedback))
        result = {"success": True, "action_execution_status": []}
        self.node.after(0.1 * (len(items) + 1), lambda: self._server.finish(goal, SUCCEEDED, result))
        return True


def settings_with(program: Program, tables: dict[str, str]) -> str:
    """Writes the settings of the example, with other tables for some actions, to a file and returns its path."""
    kept, inside = [], ""
    for line in MISSION.with_name("ros.toml").read_text().splitlines():
        if line.startswith("["):
            inside = line.strip("[]")
        if inside.removeprefix("actions.") not in tables or not inside.startswith("actions."):
            kept.append(line)
    added = [f"[actions.{name}]\n{table}" for name, table in tables.items()]
    path = program.directory / "ros.toml"
    path.write_text("\n".join(kept + added) + '\n[poses]\nframe = "map"\npl1 = { x = 1.5, y = -2.5, yaw = 0.5 }\n')
    return str(path)


@scenario()
def performed(setting: Setting) -> str:
    """A PlanSys2 performer does the search and Nav2 goes to the pipeline. The tasks end with them."""
    tables = {"search_pipeline": 'by = "actions_hub"', "inspect_pipeline": 'by = "navigate_to_pose"\npose = 5'}
    with play(setting, prepare=lambda program: ["--settings", settings_with(program, tables)]) as (robot, _):
        node = robot.node
        performer, navigator = Performer(node, SEARCH), Navigator(node)
        node.spin(2.0)
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the search was not granted")
        check(node.spin_until(lambda: CONFIRM in performer.types(), 5.0), f"on actions_hub: {performer.heard}")
        check(performer.types()[:2] == [REQUEST, CONFIRM], f"on actions_hub: {performer.heard}")
        check("pl1" in performer.heard[0][2], f"arguments: {performer.heard[0][2]}")
        robot.done("end of the search")
        check(node.spin_until(lambda: robot.modes.current(PATH) == UNGROUND, 5.0), "the search does not end")
        robot.cancel(SEARCH)
        check(robot.request(INSPECT), "the inspection was not granted")
        check(node.spin_until(lambda: bool(navigator.poses), 5.0), "no goal for Nav2")
        pose = navigator.poses[0]
        where = (pose.header.frame_id, pose.pose.position.x, pose.pose.position.y)
        check(where == ("map", 1.5, -2.5), f"the goal is {where}")
        check(abs(pose.pose.orientation.z - 0.2474) < 1e-3, f"the orientation is {pose.pose.orientation}")
        robot.done("end of the inspection")
        check(node.spin_until(lambda: robot.modes.current(MOTION) == UNGROUND, 5.0), "the inspection does not end")
        return f"actions_hub {performer.types()}, Nav2 {where}"
