"""Scenarios about the ROS graph: names, states, parameters, logs, and the messages of the program for its user."""

from __future__ import annotations

import json
from typing import Any

from oracle import SEARCH
from program import Program
from ros2 import Call, Client, Node
from scenarios import CLEAR, DARK, Setting, check, play, scenario, see
from transport import Qos

STRING, INTEGER_PARAMETER, DOUBLE_PARAMETER = "std_msgs/msg/String", 2, 3
UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = 1, 2, 3, 4


def answer(node: Node, client: Client, value: dict[str, Any] | None = None, timeout: float = 3.0) -> Any:
    """Returns the answer of a service that has to be available; otherwise an assertion fails."""
    check(node.spin_until(client.ready, 5.0), "a service was not discovered within 5 s")
    node.spin(0.2)  # its writer may discover our reader a little later
    call: Call = client.call(value)
    node.spin_until(lambda: call.done, timeout)
    check(call.value is not None, f"no answer within {timeout} s: {call.failed or 'silence'}")
    return call.value


def timeout_of(node: Node, name: str) -> float:
    """Returns the parameter `call_timeout` of a node."""
    getter = node.client(f"{name}/get_parameters", "rcl_interfaces/srv/GetParameters")
    return answer(node, getter, {"names": ["call_timeout"]}).values[0].double_value


@scenario()
def graph(setting: Setting) -> str:
    """`ros2 node list`, `ros2 lifecycle get` and `ros2 param list` show the program. It publishes plans and events."""
    with play(setting) as (robot, _):
        node, plans, logs, about = robot.node, [], [], []
        node.subscribe("/metaplan/plan", STRING, lambda message: plans.append(message.data))
        node.subscribe("/rosout", "rcl_interfaces/msg/Log", logs.append, Qos(1000, transient_local=True))
        node.subscribe("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", about.append)
        changes: list[Any] = []
        node.subscribe("/parameter_events", "rcl_interfaces/msg/ParameterEvent", changes.append)
        node.spin(1.0)
        check("/metaplan" in node.nodes, f"`ros2 node list` shows {sorted(node.nodes)}")
        state = answer(node, node.client("/metaplan/get_state", "lifecycle_msgs/srv/GetState"))
        check(state.current_state.id == ACTIVE, f"the state is {state.current_state}")
        listed = answer(node, node.client("/metaplan/list_parameters", "rcl_interfaces/srv/ListParameters"))
        names = list(listed.result.names)
        check(bool(names), "no parameter is declared")
        values = answer(
            node, node.client("/metaplan/get_parameters", "rcl_interfaces/srv/GetParameters"), {"names": names}
        )
        check(len(values.values) == len(names), f"{len(names)} parameters, {len(values.values)} values")
        described = answer(
            node,
            node.client("/metaplan/describe_parameters", "rcl_interfaces/srv/DescribeParameters"),
            {"names": names},
        )
        check(all(d.description for d in described.descriptors), "a parameter has no description")
        unknown = {"name": "no_such_parameter", "value": {"type": INTEGER_PARAMETER, "integer_value": 1}}
        refused = answer(
            node,
            node.client("/metaplan/set_parameters", "rcl_interfaces/srv/SetParameters"),
            {"parameters": [unknown]},
        )
        check(len(refused.results) == 1 and not refused.results[0].successful, "an unknown parameter was set")
        check(bool(refused.results[0].reason), "a refusal has no reason")
        known = {"name": "call_timeout", "value": {"type": DOUBLE_PARAMETER, "double_value": 2.5}}
        setter = node.client("/metaplan/set_parameters", "rcl_interfaces/srv/SetParameters")
        done = answer(node, setter, {"parameters": [known]})
        check(bool(done.results[0].successful), f"call_timeout cannot be set: {done.results}")
        check(timeout_of(node, "/metaplan") == 2.5, "call_timeout is not what it was set to")
        see(robot, CLEAR)
        check(robot.request(SEARCH), "the task was not granted")
        see(robot, DARK)
        node.spin(1.5)
        changed = [p.name for event in changes if event.node == "/metaplan" for p in event.changed_parameters]
        check("call_timeout" in changed, f"/parameter_events tell of {changed}")
        check(bool(plans), "nothing on /metaplan/plan")
        check(bool(robot.events), "nothing on /metaplan/events")
        for text in plans + robot.events:
            json.loads(text)
        own = [status.name for message in about for status in message.status if "metaplan" in status.name.lower()]
        check(bool(own), "nothing about itself on /diagnostics")
        check(any("metaplan" in log.name for log in logs), "nothing on /rosout")
        return f"{len(names)} parameters, {len(plans)} plans, {len(robot.events)} events, {len(logs)} log lines"


@scenario()
def remapped(setting: Setting) -> str:
    """`--ros-args` set the node name, the namespace, the name of a service and parameters."""

    def words(program: Program) -> list[str]:
        file = program.directory / "parameters.yaml"
        file.write_text("/auv/boss:\n  ros__parameters:\n    call_timeout: 1.5\n")
        names = ["-r", "__node:=boss", "-r", "__ns:=/auv", "-r", "/task/request:=/bridge/request"]
        return ["--ros-args", *names, "--params-file", str(file), "--"]

    with play(setting, own_wait=False, prepare=words) as (robot, _):
        node = robot.node
        check(node.spin_until(lambda: "/auv/boss" in node.nodes, 20.0), f"nodes are {sorted(node.nodes)}")
        state = answer(node, node.client("/auv/boss/get_state", "lifecycle_msgs/srv/GetState"))
        check(state.current_state.id in (INACTIVE, ACTIVE), f"the state is {state.current_state}")
        request = node.client("/bridge/request", "suave_msgs/srv/Task")
        granted = answer(node, request, {"task_name": "no_such_task"})
        check(not granted.success, "an unknown task was granted")
        check(timeout_of(node, "/auv/boss") == 1.5, "the file of parameters does not count")
        return "/auv/boss"


@scenario()
def states(setting: Setting) -> str:
    """`ros2 lifecycle set` deactivates and activates the program. While it is inactive, it grants no task."""
    with play(setting) as (robot, _):
        node = robot.node
        change = node.client("/metaplan/change_state", "lifecycle_msgs/srv/ChangeState")
        state = node.client("/metaplan/get_state", "lifecycle_msgs/srv/GetState")
        see(robot, CLEAR)
        for number, label, after in ((4, "deactivate", INACTIVE), (3, "activate", ACTIVE)):
            done = answer(node, change, {"transition": {"id": number, "label": label}})
            check(bool(done.success), f"{label} failed")
            reached = answer(node, state).current_state.id
            check(reached == after, f"after {label} the state is {reached}")
            if after == INACTIVE:
                call = robot.task_request.call({"task_name": SEARCH})
                node.spin_until(lambda asked=call: asked.done, 1.0)
                check(call.value is None or not call.value.success, "inactive, it granted a task")
        wrong = answer(node, change, {"transition": {"id": 1, "label": "configure"}})
        check(not wrong.success, "an active node was configured")
        check(robot.request(SEARCH), "active again, it does not grant a task")
        return "deactivated, activated"
