"""Scenarios with services, actions and topics of types that the program does not know by itself."""

import itertools
import pathlib
import tempfile
import time

from action_msgs.msg import GoalStatus  # noqa: F401  (the action type needs it)
from controller_manager_msgs.srv import SwitchController
from harness import ANOTHER_DEFINITION, SETTLED, Failure, Scout, check, nodes
from nav2_msgs.action import DockRobot
from nav2_msgs.srv import LoadMap
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from scout import STEPS
from std_msgs.msg import String

DEFINITIONS = pathlib.Path(__file__).resolve().parent / "definitions"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# One definition is a file, one a text; those of `nav_msgs` come from the installation in AMENT_PREFIX_PATH.
TYPES = f"""
[types]
"controller_manager_msgs/srv/SwitchController" = {{ file = "{DEFINITIONS}/controller_manager_msgs/srv/SwitchController.srv" }}
"nav2_msgs/srv/LoadMap" = '''
{(DEFINITIONS / "nav2_msgs/srv/LoadMap.srv").read_text()}'''
"""


def switch(start: str, stop: str) -> str:
    """Keys of a step that switches controllers."""
    request = f'activate_controllers = ["{start}", "arm"], deactivate_controllers = ["{stop}"]'
    return (
        'service = "/controller_manager/switch_controller", type = "controller_manager_msgs/srv/SwitchController", '
        f'request = {{ {request}, strictness = "STRICT", timeout = 1.25 }}, expect = {{ ok = true }}'
    )


def load(name: str) -> str:
    """A step that loads a map."""
    return (
        '{ service = "/map_server/load_map", type = "nav2_msgs/srv/LoadMap", '
        f'request = {{ map_url = "/maps/{name}.yaml" }}, expect = {{ result = "RESULT_SUCCESS" }} }}'
    )


def select(planner: str) -> str:
    """A step that selects a planner of Nav2."""
    return (
        f'{{ publish = "/planner_selector", type = "std_msgs/msg/String", message = {{ data = "{planner}" }}, '
        "subscribers = 1 }"
    )


DRIVING = """
[functions.f_drive.designs.fd_drive_fast]
steps = [{ node = "/controller", parameters = { max_speed = 1, smooth = false } }]

[functions.f_drive.designs.fd_drive_slowly]
steps = [{ node = "/controller", parameters = { max_speed = 0.25, smooth = true } }]
"""

SWITCHING = f"""
[functions.f_drive.designs.fd_drive_fast]
steps = [
    {{ {switch("fast", "slow")}, undo = {{ {switch("slow", "fast")} }} }},
    {load("hall")},
]

[functions.f_drive.designs.fd_drive_slowly]
steps = [{{ {switch("slow", "fast")} }}]
"""

SELECTING = f"""
[functions.f_drive.designs.fd_drive_fast]
steps = [{select("GridBased")}]
verify = [{{ topic = "/planner", type = "std_msgs/msg/String", expect = {{ data = "GridBased" }} }}]
timeout = 3.0

[functions.f_drive.designs.fd_drive_slowly]
steps = [{select("SmacLattice")}]
"""


class Controllers(Node):
    """A controller manager, a map server, and a planner that is selected by a topic."""

    def __init__(self) -> None:
        super().__init__("controller_manager", enable_rosout=False)
        self.switched: list[tuple] = []
        self.maps: list[str] = []
        self.planners: list[str] = []
        self.result = LoadMap.Response.RESULT_SUCCESS
        self.selects = True
        self.create_service(SwitchController, "/controller_manager/switch_controller", self.switch)
        self.create_service(LoadMap, "/map_server/load_map", self.load)
        self.planner = self.create_publisher(String, "/planner", LATCHED)
        self.create_subscription(String, "/planner_selector", self.select, LATCHED)

    def switch(self, request, response):
        """Notes a request."""
        timeout = request.timeout.sec + request.timeout.nanosec * 1e-9
        names = (list(request.activate_controllers), list(request.deactivate_controllers))
        self.switched.append((*names, request.strictness, request.activate_asap, timeout))
        response.ok = True
        return response

    def load(self, request, response):
        """Answers with a large map, which comes before the result."""
        self.maps.append(request.map_url)
        response.map.info.width, response.map.info.height = 500, 401
        response.map.data = [-1] * 200_500
        response.map.header.frame_id = "map"
        response.result = self.result
        return response

    def select(self, message: String) -> None:
        """Selects a planner, and publishes which one is selected."""
        self.planners.append(message.data)
        if self.selects:
            self.planner.publish(message)


def fast(start: str, stop: str) -> tuple:
    """A request as the controller manager notes it."""
    return ([start, "arm"], [stop], SwitchController.Request.STRICT, False, 1.25)


def any_service() -> None:
    """Controllers are switched and a map is loaded; if the map is refused, the switch is undone."""
    settings = TYPES + STEPS.replace(DRIVING, SWITCHING)
    scout, controllers = Scout(), Controllers()
    with nodes(controllers), scout.managed(settings):
        scout.until_moving()
        scout.until("the map is loaded", lambda: controllers.maps == ["/maps/hall.yaml"])
        time.sleep(SETTLED)
        check(controllers.switched, [fast("fast", "slow")], "switched controllers")
        check(scout.count("steps_failed"), 0, "failures")
    scout, controllers = Scout(), Controllers()
    controllers.result = LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST
    with nodes(controllers), scout.managed(settings):
        scout.until("the slow design is used", lambda: len(controllers.switched) == 3)
        expected = [fast("fast", "slow"), fast("slow", "fast"), fast("slow", "fast")]
        check(controllers.switched, expected, "step, undo, other design")
        scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
        failed = [event["because"] for event in scout.events if event["answer"] == "steps_failed"]
        check(failed, ["/map_server/load_map has refused: `result` is 1, and should be 0"], "reasons of failures")


def selector() -> None:
    """A latched message selects a planner. A message of another node is detected, and a planner that does not follow is a failure."""
    settings = STEPS.replace(DRIVING, SELECTING)
    scout, controllers = Scout(), Controllers()
    with nodes(controllers), scout.managed(settings):
        scout.until_moving()
        scout.until("the planner is selected", lambda: controllers.planners == ["GridBased"])
        time.sleep(SETTLED)
        check(controllers.planners, ["GridBased"], "selections")
        late: list[str] = []
        node, other = Node("late"), Node("other")
        node.create_subscription(String, "/planner_selector", lambda message: late.append(message.data), LATCHED)
        with nodes(node, other):
            scout.until("a late subscriber has the selection", lambda: late == ["GridBased"])
            publisher = other.create_publisher(String, "/planner_selector", LATCHED)
            scout.until("the manager reads it", lambda: publisher.get_subscription_count() >= 3)
            publisher.publish(String(data="Straight"))
            expected = ["GridBased", "Straight", "GridBased"]
            # A selection that is observed twice is made twice.
            changes = lambda: [name for name, _ in itertools.groupby(controllers.planners)]
            scout.until("the planner is selected again", lambda: changes() == expected)
            time.sleep(SETTLED)
            check(changes(), expected, "selections")
        check(scout.count("steps_failed"), 0, "failures")
    scout, controllers = Scout(), Controllers()
    controllers.selects = False
    with nodes(controllers), scout.managed(settings):
        scout.until("the other design is used", lambda: controllers.planners[-1:] == ["SmacLattice"])
        scout.until("the failure is reported", lambda: scout.count("steps_failed") == 1)
        failed = [event["because"] for event in scout.events if event["answer"] == "steps_failed"]
        check(failed, ["not seen afterwards: the expected values on /planner"], "reasons of failures")


DOCKING = f"""
[types]
"nav2_msgs/action/DockRobot" = {{ file = "{DEFINITIONS}/nav2_msgs/action/DockRobot.action" }}

[actions.move]
by = "action"
server = "/dock_robot"
type = "nav2_msgs/action/DockRobot"
goal = {{ dock_id = "at_{{2}}", dock_pose = "{{pose_stamped 2}}" }}
expect = {{ success = true, error_code = "NONE" }}

[actions.inspect]
by = "service"
service = "/camera/reset"
type = "std_srvs/srv/Trigger"

[poses]
dock = {{ x = 0.0, y = 0.0 }}
gate = {{ x = 4.0, y = 0.5 }}
shelf_1 = {{ x = 4.0, y = 3.0 }}
shelf_2 = {{ x = 6.0, y = 3.0 }}
"""


class Docks(Node):
    """An action server whose first goal fails by its result."""

    def __init__(self) -> None:
        super().__init__("docking_server", enable_rosout=False)
        self.goals: list[tuple] = []
        self.server = ActionServer(self, DockRobot, "/dock_robot", self.dock)

    def dock(self, handle):
        """Notes a goal."""
        goal = handle.request
        position = (goal.dock_pose.header.frame_id, goal.dock_pose.pose.position.x, goal.dock_pose.pose.position.y)
        self.goals.append((goal.dock_id, position, goal.use_dock_id, goal.max_staging_time))
        handle.publish_feedback(DockRobot.Feedback(state=1))
        is_first = len(self.goals) == 1
        handle.succeed()
        code = DockRobot.Result.DOCK_NOT_IN_DB if is_first else DockRobot.Result.NONE
        return DockRobot.Result(success=not is_first, error_code=code, error_msg="")


def any_action() -> None:
    """Actions of the plan are goals and service calls of any type; a result that is not expected is a failure."""
    movement = '[actions.move]\nby = "topic"\ntopic = "/arrived"\n\n[actions.inspect]\nby = "topic"\ntopic = "/shelf/inspected"\n'
    check(movement in STEPS, True, "the settings have the actions that are replaced")
    scout, docks = Scout(), Docks()
    with nodes(docks), scout.managed(STEPS.replace(movement, DOCKING)):
        scout.until("all moves are made", lambda: len(docks.goals) == 6, 60.0)
        gate = ("at_gate", ("map", 4.0, 0.5), True, 1000.0)
        check(docks.goals[:2], [gate, gate], "the failed goal, and its repetition")
        names = [goal[0] for goal in docks.goals[1:]]
        check(names, ["at_gate", "at_shelf_1", "at_shelf_2", "at_gate", "at_dock"], "goals")
    check(scout.equipment.resets > 1, True, "the inspections are service calls")


def other_definition() -> None:
    """A definition that is not the robot's is named in a warning, and the service is called."""
    definition = (DEFINITIONS / "controller_manager_msgs/srv/SwitchController.srv").read_text()
    name = '"controller_manager_msgs/srv/SwitchController"'
    settings = STEPS.replace(DRIVING, SWITCHING.replace(load("hall") + ",\n", ""))
    scout, controllers = Scout(), Controllers()
    with nodes(controllers), tempfile.NamedTemporaryFile("w", suffix=".srv") as file:
        file.write(definition.replace("string message", "string reason"))
        file.flush()
        try:
            with scout.managed(f'[types]\n{name} = {{ file = "{file.name}" }}\n{settings}') as log:
                scout.until("the controllers are switched", lambda: controllers.switched == [fast("fast", "slow")])
                text = lambda: pathlib.Path(log.name).read_text()
                kind = "controller_manager_msgs::srv::dds_::SwitchController"
                scout.until("the warning is logged", lambda: f"{ANOTHER_DEFINITION} {kind}_Response_" in text())
                check(f"{kind}_Request_" in text(), False, "a warning about the request, which is the same")
        except Failure as failure:
            # The harness has noticed the warning.
            if not str(failure).startswith("warnings about type hashes"):
                raise
        else:
            raise Failure("the harness does not notice a warning about type hashes")
