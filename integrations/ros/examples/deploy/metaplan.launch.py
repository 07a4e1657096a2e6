"""Starts metaplan-ros with a mission, in one of its roles, and starts it again when it ends, except the controller.

    ros2 launch metaplan.launch.py mission:=/opt/robot/suave.toml journal:=/var/lib/robot/journal
    ros2 launch metaplan.launch.py role:=planner params_file:=metaplan.yaml

The program needs no ROS installation; this file needs `launch_ros`.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# Name, default and description of each argument.
ARGUMENTS = (
    ("program", "metaplan-ros", "the program: a path, or a name on PATH"),
    ("role", "manager", "manager, reasoner, planner or controller"),
    ("mission", "", "a mission's manifest; the planner can do without"),
    ("settings", "", "how the mission meets the robot; ros.toml beside the mission if empty"),
    ("journal", "", "a directory for the journal of a manager or reasoner; none if empty"),
    ("rmw", "auto", "auto, fastrtps or cyclonedds: how services are mapped"),
    ("namespace", "", "of the node"),
    ("params_file", str(Path(__file__).with_name("metaplan.yaml")), "parameters; none if empty"),
    ("diagnostics", "/diagnostics", "the topic on which the robot's monitors publish"),
    ("log_level", "info", "debug, info, warn, error or fatal"),
)


def start(context):
    """Returns the node, after the arguments are known. It keeps its own name, because PlanSys2 looks for `planner`."""
    value = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    words = ["--as", value["role"], "--rmw", value["rmw"]]
    for name in ("mission", "settings", "journal"):
        if value[name]:
            words += [f"--{name}", value[name]]
    return [
        Node(
            executable=value["program"],
            namespace=value["namespace"],
            arguments=words,
            ros_arguments=["--log-level", value["log_level"]],
            parameters=[value["params_file"]] if value["params_file"] else [],
            remappings=[("/diagnostics", value["diagnostics"])],
            output="screen",
            # With a journal, the program resumes where it ended. A controller ends when its plan is executed.
            respawn=value["role"] != "controller",
            respawn_delay=2.0,
        )
    ]


def generate_launch_description():
    """Returns the launch description for `ros2 launch`."""
    declared = [DeclareLaunchArgument(name, default_value=default, description=text) for name, default, text in ARGUMENTS]
    return LaunchDescription([*declared, OpaqueFunction(function=start)])
