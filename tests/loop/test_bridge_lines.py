"""The lines between desim and the bridges to ROS."""

from __future__ import annotations

import io
import os
import sys
from types import SimpleNamespace

import pytest

from desim.errors import InputError
from desim.loop import bridge, bridges
from desim.scenario.load import from_mapping


def sent(capfd):
    """The lines that the bridge has written: to desim, and to its log."""
    return tuple(capfd.readouterr())


def twist(forward, turn):
    return SimpleNamespace(linear=SimpleNamespace(x=forward, y=0.25),
                           angular=SimpleNamespace(z=turn))


def goal(frame, x, y):
    return SimpleNamespace(header=SimpleNamespace(frame_id=frame),
                           pose=SimpleNamespace(position=SimpleNamespace(x=x, y=y)))


def test_a_velocity_and_a_goal_are_a_line_each(capfd):
    bridge.command(twist(0.5, -0.1))
    bridge.send_to(goal("map", 1.5, -2.0))
    bridge.send_to(goal("/map", 3.0, 4.0))
    assert sent(capfd) == ("cmd_vel 0.5 0.25 -0.1\ngoal 1.5 -2.0\ngoal 3.0 4.0\n", "")


@pytest.mark.parametrize(("say", "why"), [
    (lambda: bridge.send_to(goal("odom", 1.0, 1.0)),
     "no goal: its frame is 'odom'; allowed: map\n"),
    (lambda: bridge.send_to(goal("map", float("inf"), 1.0)),
     "no goal: not all of (inf, 1.0) are finite\n"),
    (lambda: bridge.command(twist(float("nan"), 0.0)),
     "no cmd_vel: not all of (nan, 0.25, 0.0) are finite\n")])
def test_what_a_robot_cannot_do_is_in_the_log_alone(capfd, say, why):
    say()
    assert sent(capfd) == ("", why)


def test_lines_of_messages_are_published_once_ros_is_joined(monkeypatch):
    """Those before that are gone, as a publisher's without subscribers."""
    joined, published = [], []

    class Lines(io.StringIO):
        def __next__(self):
            line = super().__next__()
            if "joined" in line:
                joined[0].publish = lambda *message: published.append(message)
            return line

    class Waiting(bridge.Joining):
        def start(self):
            joined.append(self)

    monkeypatch.setattr(bridge, "Joining", Waiting)
    monkeypatch.setattr(sys, "argv", ["bridge", "robot_0"])
    monkeypatch.setattr(sys, "stdout", sys.stdout)
    monkeypatch.setattr(sys, "stdin", Lines(
        '[["odom", {"early": 1}]]\n[["odom", {"joined": 1}], ["tf", {}]]\n'))
    bridge.serve(lambda robot: None)
    assert sys.stdout is sys.stderr  # so that no warning of rospy is taken for a command
    assert published == [("odom", {"joined": 1}), ("tf", {})]


LOOP = {"programs": [{"host": "robot_0", "run": "x"}]}


def scenario(**loop):
    return from_mapping({"name": "x", "deployment": "field", "fleet": {"size": 1},
                         "loop": {**LOOP, **loop}}).scenario


def test_a_robot_has_the_bridges_that_the_scenario_names():
    assert bridges.bridges_of(scenario()) == ()
    assert bridges.bridges_of(scenario(ros_master="robot_0")) == (bridges.ROS1,)
    assert bridges.bridges_of(scenario(ros_master="robot_0", dds_domain=7)) == (
        bridges.ROS1, bridges.ROS2)
    assert all(os.path.isfile(bridge.command("robot_0")[1])
               for bridge in (bridges.ROS1, bridges.ROS2))


@pytest.mark.parametrize(("name", "loop", "said"), [
    ("ROS1", {"ros_master": "robot_0"}, "loop.ros_master: the robots' topics need missing_one for "
     f"{sys.executable}: apt-get install python3-rospy python3-sensor-msgs python3-nav-msgs "
     "python3-tf2-msgs"),
    ("ROS2", {"dds_domain": 0}, "loop.dds_domain: the robots' topics need missing_one for "
     f"{sys.executable}: pip install 'desim[loop]'")])
def test_a_bridge_that_cannot_run_here_is_said_before_the_run(monkeypatch, name, loop, said):
    lacking = getattr(bridges, name)._replace(python=sys.executable, module="missing_one")
    monkeypatch.setattr(bridges, name, lacking)
    with pytest.raises(InputError) as refused:
        bridges.refuse_without_bridges(scenario(**loop))
    assert str(refused.value) == said
    bridges.refuse_without_bridges(scenario())
