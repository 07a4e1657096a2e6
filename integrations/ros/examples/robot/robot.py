"""A small robot of rclpy nodes for the tutorial docs/tutorial/ros-robot.md. It needs the wheels of requirements.txt and no ROS installation.

The robot drives and takes pictures as `metaplan-ros --as manager` requests. Its nodes know nothing of Metaplan, except for `base`, which reads from
the topic of events which actions begin.
"""

import argparse
import json
import threading
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, LaserScan
from std_msgs.msg import Bool, String

# Distances in metres, as in the mission.
DISTANCES = {("dock", "gate"): 4, ("gate", "shelf_1"): 3, ("shelf_1", "shelf_2"): 2, ("gate", "shelf_2"): 5}


def say(text: str) -> None:
    """Prints a line and flushes it."""
    # In one piece: nodes print from several threads.
    print(f"{text}\n", end="", flush=True)


class Localization(LifecycleNode):
    """A method of localization. The robot knows its position while the node is active."""

    def on_activate(self, state):
        """Activates."""
        say(f"{self.get_name()} is active")
        return super().on_activate(state)

    def on_deactivate(self, state):
        """Deactivates."""
        say(f"{self.get_name()} is inactive")
        return super().on_deactivate(state)


class Controller(Node):
    """Follows paths at the speed of its parameter."""

    def __init__(self) -> None:
        super().__init__("controller")
        self.declare_parameter("max_speed", 0.0)
        self.add_post_set_parameters_callback(
            lambda parameters: [say(f"the speed is {parameter.value} m/s") for parameter in parameters]
        )


class Camera(Node):
    """Takes pictures with a normal or a thermal camera."""

    def __init__(self) -> None:
        super().__init__("camera")
        self.declare_parameter("picture", "none")
        self.add_post_set_parameters_callback(
            lambda parameters: [say(f"pictures by {parameter.value}") for parameter in parameters]
        )


class Lidar(Node):
    """The driver of the lidar, with scans and its own diagnostics."""

    def __init__(self) -> None:
        super().__init__("lidar")
        self.is_broken = False
        self.scans = self.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(0.1, self.scan)
        self.create_timer(0.5, self.diagnose)

    def scan(self) -> None:
        """Publishes a scan."""
        if not self.is_broken:
            self.scans.publish(LaserScan(ranges=[1.0] * 90))

    def diagnose(self) -> None:
        """Publishes the state of the driver."""
        level, message = (DiagnosticStatus.ERROR, "no echo") if self.is_broken else (DiagnosticStatus.OK, "scanning")
        self.diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(level=level, name="lidar: driver", message=message)]))


class Battery(Node):
    """The battery, which loses 1 % in 5 s."""

    def __init__(self) -> None:
        super().__init__("battery")
        self.charge = 0.9
        self.state = self.create_publisher(BatteryState, "/battery_state", 10)
        self.create_timer(1.0, self.publish)

    def publish(self) -> None:
        """Publishes the charge, from 0 to 1."""
        self.charge -= 0.002
        self.state.publish(BatteryState(percentage=self.charge))


class Base(Node):
    """Drives and takes pictures: performs the requested actions, and reports their ends."""

    def __init__(self, controller: Controller, lidar: Lidar, failure: float | None) -> None:
        super().__init__("base")
        self.controller, self.lidar, self.failure = controller, lidar, failure
        self.action: int | None = None
        self.arrived = self.create_publisher(Bool, "/arrived", 10)
        self.inspected = self.create_publisher(Bool, "/shelf/inspected", 10)
        self.create_subscription(String, "/metaplan/events", self.hear, 100)

    def hear(self, message: String) -> None:
        """Begins an action in a thread of its own, and stops it. After a restart, the manager begins the present action again."""
        event = json.loads(message.data)
        if event["answer"] == "begin_action" and event["action"] != self.action:
            self.action = event["action"]
            threading.Thread(target=self.perform, args=(self.action, event["name"], event["arguments"]), daemon=True).start()
        elif event["answer"] == "stop_action" and event["action"] == self.action:
            self.action = None
        elif event["answer"] == "goal_reached":
            say("the round is done")

    def perform(self, number: int, action: str, arguments: list[str]) -> None:
        """Performs an action, and reports its end unless it is stopped."""
        say(f"{action} {' '.join(arguments)}")
        if action == "inspect":
            time.sleep(2.0)
            self.report(number, self.inspected)
            return
        if self.failure is not None:
            threading.Timer(self.failure, self.fail).start()
            self.failure = None
        distance = DISTANCES.get((arguments[0], arguments[1])) or DISTANCES[(arguments[1], arguments[0])]
        while distance > 0 and self.action == number:
            time.sleep(0.1)
            distance -= 0.1 * self.controller.get_parameter("max_speed").value
        self.report(number, self.arrived)

    def report(self, number: int, done) -> None:
        """Reports the end of an action that was not stopped."""
        if self.action == number:
            self.action = None
            done.publish(Bool(data=True))

    def fail(self) -> None:
        """Breaks the lidar."""
        say("the lidar breaks")
        self.lidar.is_broken = True


def main() -> None:
    """Runs the nodes until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lidar-fails-after", type=float, metavar="SECONDS", help="breaks the lidar this long after the first move has begun")
    options = parser.parse_args()
    rclpy.init()
    controller, lidar = Controller(), Lidar()
    nodes = [Localization("amcl"), Localization("visual_localization"), controller, Camera(), lidar, Battery()]
    nodes.append(Base(controller, lidar, options.lidar_fails_after))
    executor = MultiThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    say("the robot is ready")
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


main()
