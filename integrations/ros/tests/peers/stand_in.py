"""A small manager and reasoner in the place of the program, to show that the peers and their oracle notice faults.

`--fault wrong` always takes the lowest spiral, `miss` ignores failures, `twice` asks for every mode twice, `slow` waits
50 ms. Without a fault it is right, by the rules that the oracle's definitions give.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

from oracle import FOLLOW, MOTION, PATH, SEARCH, UNGROUND, World
from ros2 import CANCELED, ActionServer, Node
from suave import FUNCTIONS
from transport import connect


class StandIn:
    """A manager that keeps its own `World` from the diagnostics and switches each function that has a wrong mode."""

    def __init__(self, node: Node, role: str, fault: str) -> None:
        self.node, self.role, self.fault = node, role, fault
        self.world, self.running = World(), {}
        self.wanted: set[str] = set()
        self.goals: dict[bytes, str] = {}
        node.subscribe("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", self.hear)
        if role == "manager":
            kind = "system_modes_msgs/srv/ChangeMode"
            self.clients = {
                f: node.client(f"/{f}/change_mode", kind) for f in (MOTION, PATH, FOLLOW, "generate_recharge_path")
            }
            node.serve("/task/request", "suave_msgs/srv/Task", self.task)
            node.serve("/task/cancel", "suave_msgs/srv/Task", self.end)
        else:
            self.bridge = node.client("/mros/request_configuration", "mros2_msgs/srv/MetacontrolFD")
            name, kind = "/mros/objective", "mros2_msgs/action/ControlQos"
            self.server = ActionServer(node, name, kind, self.goal, self.cancel)

    def ask(self, function: str, mode: str) -> None:
        """Requests a mode without waiting for the answer."""
        if self.fault == "slow":
            time.sleep(0.05)
        for _ in range(2 if self.fault == "twice" else 1):
            if self.role == "manager":
                self.clients[function].call({"mode_name": mode})
            else:
                self.bridge.call({"required_function_name": function, "required_fd_name": mode})
            if self.fault == "twice":
                time.sleep(0.01)
        self.running[function] = mode

    def adapt(self) -> None:
        """Switches each wanted function to its right mode."""
        self.world.task = SEARCH if PATH in self.wanted else "inspect_pipeline"
        right = self.world.right()
        for function in (MOTION, PATH, FOLLOW, "generate_recharge_path"):
            mode = right[function] if self.wanted else UNGROUND
            if self.role == "reasoner" and function not in self.wanted:
                continue
            if function == PATH and self.fault == "wrong" and mode != UNGROUND:
                mode = "fd_spiral_low"
            if mode is not None and self.running.get(function, UNGROUND) != mode:
                self.ask(function, mode)

    def hear(self, message: Any) -> None:
        """Processes a message of `/diagnostics`."""
        for status in message.status:
            for pair in status.values[:1]:
                if pair.key == "water_visibility":
                    self.world.visibility = float(pair.value)
                elif pair.key == "battery_level":
                    self.world.battery = float(pair.value)
                elif pair.value == "FALSE" and self.fault != "miss":
                    self.world.failed.add(int(pair.key[-1]))
                elif pair.value == "RECOVERED":
                    self.world.failed.discard(int(pair.key[-1]))
        if self.wanted:
            self.adapt()

    def task(self, request: Any) -> dict[str, Any]:
        """Serves `/task/request`."""
        self.wanted = set(FUNCTIONS[request.task_name])
        self.adapt()
        return {"success": True}

    def end(self, _: Any) -> dict[str, Any]:
        """Serves `/task/cancel`."""
        self.wanted = set()
        self.adapt()
        return {"success": True}

    def goal(self, goal: bytes, value: Any) -> bool:
        """Accepts a new objective."""
        self.goals[goal] = value.qos_expected.objective_type
        self.wanted.add(self.goals[goal])
        self.node.after(0.0, self.adapt)
        return True

    def cancel(self, goal: bytes) -> bool:
        """Cancels an objective."""
        function = self.goals.pop(goal)
        self.wanted.discard(function)
        self.ask(function, UNGROUND)
        self.node.after(0.01, lambda: self.server.finish(goal, CANCELED, {}))
        return True


def main() -> None:
    """Runs for ten minutes, unless it is killed earlier."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--as", dest="role", default="manager")
    parser.add_argument("--vendor", default="cyclonedds")
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--fault", default="")
    arguments = parser.parse_args()
    node = Node(connect(arguments.vendor, arguments.domain), "stand_in")
    StandIn(node, arguments.role, arguments.fault)
    node.spin(600)


if __name__ == "__main__":
    main()
