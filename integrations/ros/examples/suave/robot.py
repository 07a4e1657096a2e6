"""A robot for a first run: SUAVE's mission node, mode manager and monitors, simulated on Cyclone DDS; no ROS is needed.

It requests the search in clear water; then the water becomes murky, a thruster fails, and the battery is low. It prints which modes it is
asked for. The robot is that of the tests (`integrations/ros/tests/peers`, with its `requirements.txt`); domain and network are those of the environment.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "peers"))

from ros2 import now
from suave import Options, Robot

SEARCH = "search_pipeline"


def tell(robot: Robot, what: str) -> None:
    """Spins for a second, and prints the mode requests of this time."""
    robot.node.spin(1.0)
    print(what)
    for event in map(json.loads, robot.events):
        if event["answer"] == "plan_found":
            actions = ", ".join(step["action"] for step in event["steps"])
            print(f"  the plan is {actions}, and takes {event['cost']} s")
    for _, function, mode in robot.modes.requests:
        print(f"  /{function}/change_mode {mode}")
    robot.events.clear()
    robot.modes.requests.clear()


def main() -> None:
    """Plays the robot."""
    robot = Robot(Options(domain=int(os.environ.get("ROS_DOMAIN_ID", "0"))))
    try:
        print("waits for metaplan-ros")
        if not robot.wait(120.0):
            sys.exit("nobody serves /task/request")
        # Metaplan waits for the functions before it handles tasks.
        robot.node.spin(6.0)
        robot.monitors.visibility(3.5, now())
        tell(robot, "the water is clear: 3.5 m")
        granted = robot.request(SEARCH)
        tell(robot, f"the search is requested, and {'granted' if granted else 'refused'}")
        robot.monitors.visibility(2.5, now())
        tell(robot, "the water is murky: 2.5 m")
        robot.monitors.thruster(1, False, now())
        tell(robot, "a thruster has failed")
        robot.monitors.battery(0.2, now())
        tell(robot, "the battery is low: 0.2")
        ended = robot.cancel(SEARCH)
        tell(robot, f"the search is cancelled, and {'has ended' if ended else 'goes on'}")
    finally:
        robot.close()


if __name__ == "__main__":
    main()
