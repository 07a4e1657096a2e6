"""Scenarios in which the program replaces MROS's reasoner: the action `/mros/objective`."""

from __future__ import annotations

import subprocess
import sys
import time

from citizen import answer
from oracle import MOTION, PATH, SEARCH, UNGROUND
from program import ROOT, Program
from ros2 import Node
from scenarios import CLEAR, DARK, Setting, asked, check, no_fault, play, scenario, see
from transport import connect


@scenario()
def objectives(setting: Setting) -> str:
    """Feedback reports the design of each objective. A cancellation fails if the function cannot be ungrounded."""
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


@scenario()
def killed_reasoner(setting: Setting) -> str:
    """`kill -9` while there are objectives: they are kept, nothing is requested twice, and they can be cancelled."""
    with play(setting, "reasoner") as (robot, program):
        see(robot, CLEAR)
        check(robot.request(SEARCH), "an objective was not accepted")
        no_fault(robot)
        before = len(robot.modes.requests)
        program.kill()
        robot.node.spin(0.3)
        program.start()
        check(
            program.wait_output("continues from the journal with 2 objectives", 10.0),
            "it does not go on from the journal",
        )
        robot.node.spin(3.0)
        for _ in range(5):
            see(robot, CLEAR)
            robot.node.spin(0.1)
        check(len(robot.modes.requests) == before, f"asked again for {robot.modes.requests[before:]}")
        see(robot, DARK)
        no_fault(robot)
        heard = len(robot.objectives.goals[PATH].feedback)
        robot.node.spin(2.0)
        check(len(robot.objectives.goals[PATH].feedback) > heard, "no feedback after the restart")
        robot.oracle.world.task = None
        robot.oracle.stimulus("cancellation", 0.0)
        for function in (PATH, MOTION):
            call = robot.objectives.client.cancel(robot.objectives.goals[function])
            robot.node.spin_until(lambda answered=call: answered.done, 5.0)
            check(call.value is not None and len(call.value.goals_canceling) == 1, f"{function} is not cancelled")
        robot.settle()
        check(robot.modes.current(PATH) == UNGROUND, f"{robot.modes.current(PATH)} runs after the cancellation")
        no_fault(robot)
        return f"{len(robot.modes.requests)} requests, none twice"


EARLIER = ROOT.parent / "shared" / "tools" / "ros"


def _earlier_peer(vendor: str) -> list[str]:
    """Returns the command of a peer that is older than the program. It runs for 20 s in domain 0."""
    if vendor == "cyclonedds":
        return [sys.executable, str(EARLIER / "peer_cyclone.py"), "20"]
    built = ROOT / "target" / "ros" / "peer_fastdds"
    source = EARLIER / "peer_fastdds.cpp"
    if not built.exists() or built.stat().st_mtime < source.stat().st_mtime:
        command = ["g++", "-std=c++17", "-O1", str(source), "-lfastrtps", "-lfastcdr", "-o", str(built)]
        subprocess.run(command, check=True)
    return [str(built), "20"]


def _change_state() -> object:
    """A request of ChangeState with the type that the earlier peer knows: Cyclone DDS compares types among its own.

    What is returned has to be kept: the peer stumbles when a writer leaves.
    """
    from cyclonedds.core import Policy, Qos
    from cyclonedds.domain import DomainParticipant
    from cyclonedds.idl import make_idl_struct, types
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration

    fields = {"guid": types.uint64, "seq": types.int64, "id": types.uint8, "label": str}
    kind = make_idl_struct("Request", "lifecycle_msgs::srv::dds_::ChangeState_Request_", fields)
    participant = DomainParticipant(0)
    topic = Topic(participant, "rq/f_maintain_motion_node/change_stateRequest", kind)
    writer = DataWriter(participant, topic, qos=Qos(Policy.Reliability.Reliable(duration(seconds=1))))
    end = time.monotonic() + 5
    while not writer.get_matched_subscriptions() and time.monotonic() < end:
        time.sleep(0.05)
    writer.write(kind(guid=1, seq=1, id=3, label="activate"))
    return writer


@scenario()
def earlier_peer(setting: Setting) -> str:
    """The goal of the peer of the first experiments is accepted; on Cyclone DDS, it also gets feedback."""
    if not EARLIER.is_dir():
        return f"NOT PLAYED: {EARLIER.relative_to(ROOT.parent)} is not there"
    program = Program(setting.program, "reasoner", setting.vendor, 0)
    setting.programs.append(program)
    node = Node(connect(setting.vendor, 0), "bridge")
    node.serve("/mros/request_configuration", "mros2_msgs/srv/MetacontrolFD", lambda _: {"success": True})
    output = program.directory / "peer"
    with output.open("wb") as file:
        peer = subprocess.Popen(_earlier_peer(setting.vendor), stdout=file, stderr=file)
    program.start()
    writer: object = None
    try:
        node.spin(4.0)
        # The peer sends its goal after the state of its node was changed.
        if setting.vendor == "cyclonedds":
            writer = _change_state()
        else:
            change = node.client("/f_maintain_motion_node/change_state", "lifecycle_msgs/srv/ChangeState")
            answer(node, change, {"transition": {"id": 3, "label": "activate"}})
        end = time.monotonic() + 14
        accepted = "goal accepted True" if setting.vendor == "cyclonedds" else "goal accepted=1 correlated=1"
        wanted = [accepted] + (["feedback obj_f_generate_search_path_1"] * (setting.vendor == "cyclonedds"))
        while time.monotonic() < end and not all(words in output.read_text() for words in wanted):
            node.spin(0.2)
        said = output.read_text()
        check(all(words in said for words in wanted), f"the peer says {said[-600:]}")
        return "; ".join(wanted)
    finally:
        peer.kill()
        peer.wait()
        del writer
        node.close()
        program.stop()
