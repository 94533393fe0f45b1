"""``desim robot``: robots in the files of other programs, as types of robots."""

import json

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.scenario.load import load

URDF = """\
<robot name="box">
  <link name="base_link">
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.4 0.2 0.2"/></geometry></collision>
  </link>
  <link name="mast"/>
  <link name="laser"/>
  <joint name="a" type="fixed"><parent link="base_link"/><child link="mast"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="b" type="fixed"><parent link="mast"/><child link="laser"/>
    <origin xyz="0.02 0 0.05"/></joint>
  <gazebo reference="laser"><sensor type="ray" name="scan"><update_rate>10</update_rate>
    <ray><scan><horizontal><samples>181</samples><min_angle>-1</min_angle><max_angle>1</max_angle>
    </horizontal></scan><range><min>0.1</min><max>8</max></range></ray></sensor></gazebo>
</robot>
"""
NAV2 = """\
controller_server:
  ros__parameters:
    controller_frequency: 20.0
    FollowPath: {max_vel_x: 0.4, max_vel_theta: 1.0, acc_lim_x: 3.0, vx_samples: 7}
    goal_checker: {xy_goal_tolerance: 0.3, yaw_goal_tolerance: 0.2}
velocity_smoother:
  ros__parameters: {max_velocity: [0.3, 0.0, 2.0], max_accel: [2.5, 0.0, 3.2]}
behavior_server:
  ros__parameters: {max_rotational_vel: 0.1}
docking_server:
  ros__parameters: {controller_frequency: 50.0}
local_costmap:
  local_costmap:
    ros__parameters:
      footprint: "[[0.2, 0.1], [0.2, -0.1], [-0.2, -0.1], [-0.2, 0.1]]"
      inflation_layer: {inflation_radius: 0.5}
      transform_tolerance: 0.4
global_costmap:
  global_costmap:
    ros__parameters: {robot_radius: 0.9, inflation_layer: {inflation_radius: 0.9},
                      transform_tolerance: 0.9}
amcl: {ros__parameters: {transform_tolerance: 1.0}}
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "box.urdf").write_text(URDF)
    (tmp_path / "nav2.yaml").write_text(NAV2)
    return tmp_path


def done(*words):
    result = CliRunner().invoke(app, ["robot", *words])
    assert result.exit_code == 0, result.stderr
    return result.stdout


def refused(*words):
    result = CliRunner().invoke(app, list(words))
    assert (result.exit_code, result.stdout) == (2, "")
    return result.stderr.strip()


def read(*words):
    return {key: value for key, (value, _) in json.loads(done(*words, "--json"))["read"].items()}


def test_what_it_prints_of_a_description():
    assert done("box.urdf") == """\
box.urdf: a robot description (URDF)

box:
  footprint                  (-0.2 m, -0.1 m), (0.2 m, -0.1 m), (0.2 m, 0.1 m), (-0.2 m, 0.1 m)  \
(box.urdf:1:1)
  height                     0.2 m  (box.urdf:1:1)
  robot.laser.beams          181  (box.urdf:11:1)
  robot.laser.field_of_view  2 rad  (box.urdf:11:1)
  robot.laser.max_range      8 m  (box.urdf:11:1)
  robot.laser.height         0.25 m  (box.urdf:11:1)
  robot.laser.x              0.1 m  (box.urdf:11:1)
  robot.laser.y              0.02 m  (box.urdf:11:1)
  robot.laser.yaw            1.5708 rad  (box.urdf:11:1)
  robot.laser.rate           10 Hz  (box.urdf:11:1)

at their defaults:
  body: drive, altitude, clearance, max_speed, max_turn, acceleration, turn_acceleration, \
command_timeout
  robot.navigation: control_rate, local_rate, local_size, local_resolution, inflation_radius, \
inflation_scaling, sim_time, speed_samples, turn_samples, goal_tolerance, local, recovery, \
transform_tolerance
  robot.laser: noise, pose
"""


def test_parameters_of_nav2():
    """The lowest limit, the local costmap, no limit of other manoeuvres."""
    assert read("nav2.yaml") == {
        "footprint": [["-0.2 m", "-0.1 m"], ["0.2 m", "-0.1 m"], ["0.2 m", "0.1 m"],
                      ["-0.2 m", "0.1 m"]],
        "max_speed": "0.3 m/s", "max_turn": "1 rad/s", "acceleration": "2.5 m/s^2",
        "turn_acceleration": "3.2 rad/s^2", "robot.navigation.control_rate": "20 Hz",
        "robot.navigation.speed_samples": 7, "robot.navigation.goal_tolerance": "0.3 m",
        "robot.navigation.inflation_radius": "0.5 m",
        "robot.navigation.transform_tolerance": "0.4 s"}


def test_keys_without_counterpart_have_their_places():
    unused = json.loads(done("nav2.yaml", "--json"))["no_counterpart"]
    assert unused == {
        "controller_server": [["goal_checker.yaw_goal_tolerance", "nav2.yaml:5:44"]],
        "behavior_server": [["max_rotational_vel", "nav2.yaml:9:21"]],
        "docking_server": [["controller_frequency", "nav2.yaml:11:21"]],
        "amcl": [["transform_tolerance", "nav2.yaml:22:26"]]}


def test_one_line_takes_the_file_into_a_scenario(here):
    done("box.urdf", "nav2.yaml", "--name", "my_box", "--to", "my_box.yaml")
    (here / "s.yaml").write_text("name: s\nextends: my_box.yaml\n")
    fleet = load("s.yaml").scenario.fleet
    kind = fleet.types["my_box"]
    assert (fleet.robots, kind.max_speed_mps, kind.height_m) == ("my_box", 0.3, 0.2)
    assert kind.robot.laser.max_range_m == 8.0


def test_move_base_and_explore(here):
    (here / "move.yaml").write_text("""\
controller_frequency: 5.0
base_local_planner: dwa_local_planner/DWAPlannerROS
TrajectoryPlannerROS: {max_vel_x: 0.1, holonomic_robot: false}
DWAPlannerROS: {max_vel_x: 0.5, controller_frequency: 20.0, oscillation_timeout: 0}
controller_patience: 3.0
""")
    (here / "explore.launch").write_text("""\
<launch><node pkg="explore_lite" type="explore" name="explore">
<param name="planner_frequency" value="0.33"/><param name="min_frontier_size" value="0.75"/>
</node></launch>
""")
    assert read("move.yaml", "explore.launch") == {
        "max_speed": "0.5 m/s", "robot.navigation.control_rate": "5 Hz",
        "robot.navigation.constants.controller_patience": "3 s",
        "robot.navigation.recovery": "move_base",
        "robot.exploration.rate": "0.33 Hz", "robot.exploration.min_frontier": "0.75 m"}


def laser(link, sensor, kind="ray"):
    return (f'<gazebo reference="{link}"><sensor type="gpu_ray" name="{sensor}"><{kind}><scan>'
            "<horizontal><samples>9</samples><min_angle>-1</min_angle><max_angle>1</max_angle>"
            f"</horizontal></scan><range><max>8</max></range></{kind}></sensor></gazebo>")


TWO = """
<?xml version="1.0"?>
<robot name="two">
  <link name="base_link"/><link name="lidar_mount"/><link name="lidar"/><link name="scan_back"/>
  <joint name="a"><parent link="base_link"/><child link="lidar_mount"/>
    <origin xyz="0.1 0 0.2"/></joint>
  <joint name="b"><parent link="lidar_mount"/><child link="lidar"/><origin xyz="0 0 0.1"/></joint>
  <joint name="c"><parent link="base_link"/><child link="scan_back"/>
    <origin xyz="-0.1 0 0.2" rpy="1.5707963 0 0"/></joint>
  %s
</robot>
"""


@pytest.mark.parametrize("sensors, names", [
    ("", ["lidar", "scan_back"]), (laser("lidar", "top"), ["top"]),
    (laser("lidar", "top") + laser("scan_back", "top", "gpu_ray"), ["top", "scan_back_top"])])
def test_no_laser_is_lost(here, sensors, names):
    """Of those without sensors of Gazebo each link counts that carries no other, of those with the
    same name each is one. A description may begin with an empty line."""
    (here / "two.urdf").write_text(TWO % sensors)
    heights = {key: value for key, value in read("two.urdf").items() if key.endswith("height")}
    assert heights == ({"robot.laser.height": "0.3 m"} if len(names) == 1 else {
        f"robot.lasers.{name}.height": high
        for name, high in zip(names, ("0.3 m", "0.2 m"), strict=True)})


def test_what_a_description_has_beside_is_said(here):
    camera = '<gazebo reference="lidar"><sensor type="depth" name="eye"/></gazebo>'
    (here / "two.urdf").write_text(TWO % (camera + laser("scan_back", "back")))
    assert json.loads(done("two.urdf", "--json"))["notes"] == [
        "two.urdf:10: this laser is tilted by 90 degrees; here its plane is level",
        "two.urdf: sensors left out: eye (depth)"]


def test_meshes_of_the_package_are_read(here):
    """A mesh in mm, of which the footprint is the hull; its package is the folder above."""
    (here / "meshes").mkdir()
    (here / "urdf").mkdir()
    (here / "meshes" / "plate.obj").write_text(
        "v 300 200 0\nv -300 200 0\nv -300 -200 0\nv 300 -200 0\nv 0 0 150\n"
        "f 1 2 5\nf 3 4 5\n")
    for name in ("package://my_robot/meshes/plate.obj", "file:///home/me/meshes/plate.obj",
                 "../meshes/plate.obj"):
        (here / "urdf" / "a.urdf").write_text(
            f"<robot><link name='a'><collision><geometry><mesh filename='{name}' "
            "scale='0.001 0.001 0.001'/></geometry></collision></link></robot>")
        assert read("urdf/a.urdf") == {
            "height": "0.15 m", "footprint": [["-0.3 m", "-0.2 m"], ["0.3 m", "-0.2 m"],
                                              ["0.3 m", "0.2 m"], ["-0.3 m", "0.2 m"]]}


def test_a_type_is_refused_with_the_notes_on_its_files(here):
    (here / "a.urdf").write_text(
        "<robot><link name='a'><collision><geometry><mesh filename='a.stl'/></geometry>"
        "</collision><collision><origin xyz='1 1 0'/><geometry><box size='1 1 1'/></geometry>"
        "</collision></link></robot>")
    assert refused("robot", "a.urdf").splitlines() == [
        "a.urdf:1:1: fleet.types.a.footprint: must have (0 m, 0 m) inside, the point around which "
        "the robot turns", "a.urdf: without the meshes that cannot be read, of: a"]


def test_of_two_equal_keys_the_last_one_counts_as_in_ros(here):
    (here / "05-base.yaml").write_text(
        "DWAPlannerROS:\n  max_vel_x: 0.5\n  max_vel_x: 0.3\n  acc_lim_x: .inf\n")
    known = json.loads(done("05-base.yaml", "--json"))
    assert known["name"] == "robot_05_base"
    assert {key: value for key, (value, _) in known["read"].items()} == {"max_speed": "0.3 m/s"}
    assert known["notes"] == [
        "05-base.yaml:3:3: the key 'max_vel_x' stands here a second time, first in line 2",
        "05-base.yaml:4:14: .inf is not a finite number"]


def test_the_planner_of_move_base_is_chosen_in_another_file(here):
    """A footprint comes before a radius, as in costmap_2d, wherever it stands."""
    for name, text in (("dwa", "DWAPlannerROS: {max_vel_x: 0.7, max_trans_vel: 0.5}"),
                       ("old", "TrajectoryPlannerROS: {max_vel_x: 0.3, xy_goal_tolerance: 0.9}"),
                       ("base", "base_local_planner: dwa_local_planner/DWAPlannerROS"),
                       ("map", "footprint: [[1, 1], [1, -1], [-1, 0]]\nrobot_radius: 0.2")):
        (here / f"{name}.yaml").write_text(f"{text}\n")
    known = json.loads(done("dwa.yaml", "old.yaml", "base.yaml", "map.yaml", "--json"))
    assert set(known["read"]) == {"max_speed", "footprint"}
    assert known["read"]["max_speed"] == ["0.5 m/s", "dwa.yaml:1:33"]
    assert known["notes"] == [
        "of the local planners DWAPlannerROS, TrajectoryPlannerROS, DWAPlannerROS counts "
        "(base_local_planner)", "map.yaml:1:1: footprint replaces that of map.yaml:2:1"]


def test_a_fleet_of_open_rmf(here):
    (here / "tiny.yaml").write_text(
        "# by hand\nrmf_fleet:\n  limits: {linear: [0.5, 0.75], angular: [0.6, 2.0]}\n"
        "  profile: {footprint: 0.3, vicinity: 0.5}\n")
    assert read("tiny.yaml") == {
        "max_speed": "0.5 m/s", "acceleration": "0.75 m/s^2", "max_turn": "0.6 rad/s",
        "turn_acceleration": "2 rad/s^2", "radius": "0.3 m"}
    (here / "tiny.yaml").write_text("rmf_fleet:\n  limits: {linear: [0.5]}\n  reversible: true\n")
    assert refused("robot", "tiny.yaml").startswith("tiny.yaml: has no key with a counterpart")


@pytest.mark.parametrize("kind, drive", [
    ("omni_wheel_drive_controller/OmniWheelDriveController", {"drive": "holonomic"}),
    ("mecanum_drive_controller/MecanumDriveController", {"drive": "holonomic"}),
    ("diff_drive_controller/DiffDriveController", {}), ("OmniCamera", {})])
def test_the_controller_of_a_base_says_how_it_drives(here, kind, drive):
    (here / "base.yaml").write_text(
        f"controller_manager:\n  ros__parameters:\n    base: {{type: {kind}}}\n"
        "    cmd_vel_timeout: 0.5\n")
    assert read("base.yaml") == {"command_timeout": "0.5 s", **drive}


def test_a_link_that_is_only_seen_is_no_part_of_the_body(here):
    """A marker beside the robot; without any collision what is seen counts."""
    marker = ("<link name='marker'><visual><geometry><sphere radius='0.1'/></geometry></visual>"
              "</link><joint name='c' type='fixed'><parent link='base_link'/>"
              "<child link='marker'/><origin xyz='0 -1 0'/></joint>")
    (here / "marked.urdf").write_text(URDF.replace("</robot>", marker + "</robot>"))
    assert read("marked.urdf")["footprint"] == read("box.urdf")["footprint"]
    assert json.loads(done("marked.urdf", "--json"))["notes"] == [
        "marked.urdf: links without a collision are no part of the body: marker"]
    (here / "seen.urdf").write_text((here / "marked.urdf").read_text().replace("collision>",
                                                                               "visual>"))
    assert min(float(y.split()[0]) for _, y in read("seen.urdf")["footprint"]) == -1.1


def test_ackermann_steering_has_no_drive(here):
    (here / "car.yaml").write_text("FollowPath: {motion_model: Ackermann, vx_max: 0.5}\n")
    assert read("car.yaml")["drive"] == "differential"
    assert json.loads(done("car.yaml", "--json"))["notes"] == [
        "car.yaml:1:14: motion_model is Ackermann; no drive of desim steers so: differential, "
        "which turns on the spot"]


WRONG = {
    "xacro": ("a.xacro", "<robot><xacro:include filename='b'/></robot>",
              "a.xacro: has xacro:include, which desim does not expand; make a URDF of it with: "
              "xacro a.xacro > robot.urdf"),
    "meshes": (
        "a.urdf", "<robot><link name='a'><visual><geometry><mesh filename='a.stl'/></geometry>"
        "</visual></link></robot>",
        "a.urdf: has no key with a counterpart in a type of robot (docs/robots.md), has none; "
        "a.urdf: without the meshes that cannot be read, of: a"),
    "number of xacro": (
        "a.urdf", "<robot><link name='a'><collision>\n<geometry><box size='${x} 1 1'/></geometry>"
        "</collision></link></robot>",
        "a.urdf:2: '${x} 1 1' is for xacro, which desim does not expand; make a URDF of it with: "
        "xacro a.urdf > robot.urdf"),
    "unknown link": (
        "a.urdf", "<robot><link name='a'/>\n<joint name='j'><parent link='a'/><child link='b'/>"
        "</joint></robot>", "a.urdf:2: joint j: there is no link 'b'"),
    "circle": (
        "a.urdf", "<robot><link name='a'/><joint name='j'><parent link='a'/><child link='a'/>"
        "</joint></robot>", "a.urdf: must have one link that is no joint's child, has none"),
    "circle beside the robot": (
        "a.urdf", "<robot><link name='a'/><link name='b'/><link name='c'/><joint name='j'><parent "
        "link='b'/><child link='c'/></joint><joint name='k'><parent link='c'/><child link='b'/>"
        "</joint></robot>", "a.urdf: joints in a circle, between b, c"),
    "no numbers": (
        "a.urdf", "<robot><link name='a'><visual><geometry><sphere/></geometry></visual></link>"
        "</robot>", "a.urdf:1: sphere: must have 1 number, got ''"),
    "footprint": (
        "a.yaml", 'footprint: "[[0.1, 0.2], x]"',
        "a.yaml:1:1: footprint: must be a list of at least 3 corners, e.g. [[0.2, 0.2], [0.2, "
        "-0.2], [-0.2, 0]], got '[[0.1, 0.2], x]'"),
    "footprint beside the robot": (
        "a.yaml", "footprint: [[1, 1], [2, 1], [2, 2]]",
        "a.yaml:1:1: fleet.types.a.footprint: must have (0 m, 0 m) inside, the point around which "
        "the robot turns"),
    "nothing known": (
        "a.yaml", "map_merge: {merging_rate: 0.5}",
        "a.yaml: has no key with a counterpart in a type of robot (docs/robots.md), has "
        "merging_rate"),
    "a building": (
        "a.yaml", "levels: {}",
        "a.yaml: no robot; it looks like a building of the traffic editor, which desim map reads; "
        "allowed: a robot description (URDF), a file of ROS parameters, a launch file of ROS 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files(here, case):
    name, content, message = WRONG[case]
    (here / name).write_text(content)
    assert refused("robot", name) == message


def test_parameters_in_place_of_a_scenario_are_one_complaint():
    assert refused("run", "nav2.yaml") == (
        "nav2.yaml: no scenario; it looks like a file of ROS parameters, which desim robot reads")
