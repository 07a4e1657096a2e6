"""Nodes of a robot on rclpy: the functions of SUAVE with a mode manager like that of `system_modes`, and its monitors."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from lifecycle_msgs.msg import TransitionEvent
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from system_modes_msgs.msg import ModeEvent
from system_modes_msgs.srv import ChangeMode, GetAvailableModes, GetMode

UNGROUND = "fd_unground"
MODES = {
    "f_generate_search_path": ["fd_spiral_high", "fd_spiral_medium", "fd_spiral_low", UNGROUND],
    "f_follow_pipeline": ["fd_follow_pipeline", UNGROUND],
    "f_maintain_motion": ["fd_all_thrusters", "fd_recover_thrusters", UNGROUND],
    "generate_recharge_path": ["normal", UNGROUND],
}

NODE_DELAY = 0.01  # s until the node has changed its mode


@dataclass
class Function:
    """A function with its current mode, as `get_mode` returns it."""

    mode: str = UNGROUND
    requests: list[str] = field(default_factory=list)


class ModeManager(Node):
    """Answers `change_mode` before the node has changed; `get_mode` returns the old mode for `lag` seconds longer."""

    def __init__(self, lag: float) -> None:
        super().__init__("modes")
        self.lag = lag
        self.functions = {name: Function() for name in MODES}
        group = ReentrantCallbackGroup()
        for name in MODES:
            events = self.create_publisher(TransitionEvent, f"{name}_node/transition_event", 10)
            infos = self.create_publisher(ModeEvent, f"{name}/mode_request_info", 10)
            services: list[tuple[type, str, Callable]] = [
                (ChangeMode, "change_mode", self.change_mode(name, events, infos)),
                (GetMode, "get_mode", self.get_mode(name)),
                (GetAvailableModes, "get_available_modes", self.get_available_modes(name)),
            ]
            for kind, service, callback in services:
                self.create_service(kind, f"{name}/{service}", callback, callback_group=group)

    def change_mode(self, name: str, events, infos) -> Callable:
        """Callback that grants every mode."""

        def callback(request, response):
            function = self.functions[name]
            function.requests.append(request.mode_name)
            info = ModeEvent()
            info.goal_mode.label = request.mode_name
            infos.publish(info)
            response.success = True
            threading.Timer(NODE_DELAY, events.publish, [TransitionEvent()]).start()
            threading.Timer(NODE_DELAY + self.lag, setattr, [function, "mode", request.mode_name]).start()
            return response

        return callback

    def get_mode(self, name: str) -> Callable:
        """Callback that returns the current mode."""

        def callback(_, response):
            response.current_mode = self.functions[name].mode
            return response

        return callback

    def get_available_modes(self, name: str) -> Callable:
        """Callback that returns all modes."""

        def callback(_, response):
            response.available_modes = MODES[name]
            return response

        return callback

    def requests(self) -> dict[str, list[str]]:
        """Requested modes of each function that was requested to change, in order."""
        return {name: list(function.requests) for name, function in self.functions.items() if function.requests}


class Monitors(Node):
    """Publishes measurements as SUAVE's monitors do."""

    def __init__(self) -> None:
        super().__init__("monitors")
        self.publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def measure(self, attribute: str, value: float) -> None:
        """Publishes one measurement."""
        status = DiagnosticStatus(name=f"monitor: {attribute}", message="QA status")
        status.values = [KeyValue(key=attribute, value=str(value))]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self.publisher.publish(array)
