"""The common part of the bridges between desim's lines and ROS; see ``facade.py``. Needs no desim.
"""

import json
import math
import os
import sys
import threading

COMMANDS, LOG = 1, 2  # descriptors: of the standard output, and of errors
MAP = "map"  # the frame of goals


class Joining(threading.Thread):
    """Joins ROS by ``join(robot)``, which may wait. ``publish(topic, fields)`` is what that
    returns, and None until then."""

    def __init__(self, join, robot):
        super().__init__(daemon=True)
        self._join, self._robot = join, robot
        self.publish = None

    def run(self):
        self.publish = self._join(self._robot)


def serve(join):
    """Publish what the lines of desim say once ROS is joined; see ``Joining``. What libraries print
    from now on goes to the log."""
    sys.stdout = sys.stderr
    joining = Joining(join, sys.argv[1])
    joining.start()
    for line in sys.stdin:  # at once: desim waits for room in the pipe
        if joining.publish is not None:
            for topic, fields in json.loads(line):
                joining.publish(topic, fields)


def command(velocity):
    """Pass on a geometry_msgs/Twist."""
    _pass_on("cmd_vel", velocity.linear.x, velocity.linear.y, velocity.angular.z)


def send_to(goal):
    """Pass on a geometry_msgs/PoseStamped on the map. Its heading does not count."""
    frame, place = goal.header.frame_id, goal.pose.position
    if frame.lstrip("/") == MAP:
        _pass_on("goal", place.x, place.y)
    else:
        say(f"no goal: its frame is {frame!r}; allowed: {MAP}")


def say(line):
    """Write a line to the log."""
    os.write(LOG, f"{line}\n".encode())


def _pass_on(topic, *numbers):
    if all(map(math.isfinite, numbers)):
        os.write(COMMANDS, f"{topic} {' '.join(map(repr, numbers))}\n".encode())
    else:
        say(f"no {topic}: not all of {numbers} are finite")
