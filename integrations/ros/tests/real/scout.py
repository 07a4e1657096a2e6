"""Nodes of the robot of `examples/nav2` on rclpy, without `system_modes`: lifecycle nodes, parameters and services."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger

# Steps for the designs of the three functions. Tests replace parts of this text.
STEPS = """
[actions.move]
by = "topic"
topic = "/arrived"

[actions.inspect]
by = "topic"
topic = "/shelf/inspected"

[[diagnostics]]
name = "lidar: *"
component = "c_lidar"

[functions.f_localize.designs.fd_lidar_localization]
timeout = 3.0
steps = [
    { node = "/visual_localization", state = "inactive" },
    { node = "/amcl", state = "active" },
]

[functions.f_localize.designs.fd_visual_localization]
timeout = 3.0
steps = [
    { node = "/amcl", state = "inactive" },
    { node = "/visual_localization", state = "active" },
]

[functions.f_drive.designs.fd_drive_fast]
steps = [{ node = "/controller", parameters = { max_speed = 1, smooth = false } }]

[functions.f_drive.designs.fd_drive_slowly]
steps = [{ node = "/controller", parameters = { max_speed = 0.25, smooth = true } }]

[functions.f_look.designs.fd_look_by_light]
steps = [
    { service = "/lamp", type = "std_srvs/srv/SetBool", data = true, undo = { service = "/lamp", type = "std_srvs/srv/SetBool", data = false } },
    { service = "/camera/reset", type = "std_srvs/srv/Trigger" },
]

[functions.f_look.designs.fd_look_by_warmth]
steps = [{ service = "/lamp", type = "std_srvs/srv/SetBool", data = false }]
"""


class Localization(LifecycleNode):
    """A lifecycle node that records its transitions. It publishes while it is active unless it is mute."""

    def __init__(self, name: str) -> None:
        super().__init__(name, enable_rosout=False)
        self.transitions: list[str] = []
        self.can_activate = True
        self.is_mute = False
        self.output = self.create_lifecycle_publisher(Bool, f"{name}/pose", 10)
        self.create_timer(0.1, self.publish)

    def publish(self) -> None:
        """Publishes a pose; the publisher drops it while the node is not active."""
        if not self.is_mute:
            self.output.publish(Bool(data=True))

    def on_configure(self, state):
        """Configures."""
        self.transitions.append("configure")
        return super().on_configure(state)

    def on_activate(self, state):
        """Activates, if the test wants it."""
        self.transitions.append("activate")
        if not self.can_activate:
            return TransitionCallbackReturn.FAILURE
        return super().on_activate(state)

    def on_deactivate(self, state):
        """Deactivates."""
        self.transitions.append("deactivate")
        return super().on_deactivate(state)

    def on_cleanup(self, state):
        """Cleans up."""
        self.transitions.append("cleanup")
        return super().on_cleanup(state)

    @property
    def state(self) -> str:
        """Label of the current state."""
        return self._state_machine.current_state[1]


class Equipment(Node):
    """Speed of the controller as parameters, a lamp and a camera as services, and the driver of the lidar."""

    def __init__(self) -> None:
        super().__init__("controller", enable_rosout=False)
        self.declare_parameter("max_speed", 0.5)
        self.declare_parameter("smooth", True)
        self.fastest = 2.0
        self.settings: list[tuple[float, bool]] = []
        self.lamp: list[bool] = []
        self.resets = 0
        self.can_reset = True
        self.add_on_set_parameters_callback(self.check)
        self.create_service(SetBool, "/lamp", self.switch)
        self.create_service(Trigger, "/camera/reset", self.reset)
        self.diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.arrived = self.create_publisher(Bool, "/arrived", 10)

    def check(self, parameters) -> SetParametersResult:
        """Refuses speeds above the limit. Parameters of one atomic request arrive together."""
        values = {parameter.name: parameter.value for parameter in parameters}
        if values.get("max_speed", 0.0) > self.fastest:
            return SetParametersResult(successful=False, reason="too fast")
        self.settings.append((values.get("max_speed"), values.get("smooth")))
        return SetParametersResult(successful=True)

    def switch(self, request, response):
        """Switches the lamp."""
        self.lamp.append(request.data)
        response.success = True
        return response

    def reset(self, _, response):
        """Resets the camera, if the test wants it."""
        self.resets += 1
        response.success = self.can_reset
        response.message = "" if self.can_reset else "no camera"
        return response

    def lidar(self, level: bytes, message: str) -> None:
        """Publishes the driver's own diagnostic."""
        status = DiagnosticStatus(level=level, name="lidar: driver", message=message)
        self.diagnostics.publish(DiagnosticArray(status=[status]))
