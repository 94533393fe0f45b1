"""``strategy: follow``: whole runs of robots that move as a recording says."""

import numpy as np
import pytest
from recorded import made, quiet
from runs import HELLO, SCENARIOS, built, call_often, finished
from typer.testing import CliRunner

from desim.advice.warnings import warnings
from desim.api import recording_of
from desim.cli import app
from desim.export.csv_tables import write_csv
from desim.monitor.summary import summarize
from desim.units import NS_PER_S

FOLLOW = SCENARIOS / "follow.yaml"
SHORT = ("stop.elapsed=12 s", "deployment=field")
HEAD = "time_s,robot,x_m,y_m,yaw_rad"


@pytest.fixture(scope="module")
def driven(repository, tmp_path_factory):
    """A run of robots that drive by themselves, with a bag and the tables of it."""
    folder = tmp_path_factory.mktemp("driven")
    run = made(repository, folder, *SHORT)
    write_csv(run, folder / "csv", quiet)
    return recording_of(run), folder / "csv"


def following(file, *more):
    return *SHORT, "coordination.strategy=follow", f"coordination.file={file}", *more


LED = "strategy: follow, file: walk.csv"


def scenario(path, *rows, fleet="size: 1", coordination=LED, more=""):
    """A scenario of 4 s in an empty room of 24 m; ``rows`` are in walk.csv beside it."""
    (path / "walk.csv").write_text("\n".join([HEAD, *rows]) + "\n")
    (path / "case.yaml").write_text(
        "name: x\nenvironment: {terrain: {size: [24 m, 24 m]}}\ndeployment: field\n"
        f"stop: {{elapsed: 4 s}}\ncoordination: {{{coordination}}}\nfleet: {{{fleet}}}\n{more}")
    return path / "case.yaml"


def test_a_run_is_followed_to_the_millimetre(driven, repository, tmp_path):
    recording, tables = driven
    again = recording_of(made(repository, tmp_path, *following(tables / "poses.csv")))
    assert again.poses.times_ns.tolist() == recording.poses.times_ns.tolist()
    assert (again.poses.xy_mm == recording.poses.xy_mm).all()
    assert (again.poses.yaw_mrad == recording.poses.yaw_mrad).all()
    # Only between the poses, and below a millimetre, do sensors see anything else.
    was, now = recording.run.metrics, again.run.metrics
    assert now["exploration_cost_m"] == pytest.approx(was["exploration_cost_m"], rel=0.01)
    assert now["explored_area_m2"] == pytest.approx(was["explored_area_m2"], rel=0.02)


def test_a_pose_a_second_is_not_enough_for_that(driven, repository, tmp_path):
    """The twin: robots.csv cuts corners."""
    recording, tables = driven
    again = recording_of(made(repository, tmp_path, *following(tables / "robots.csv")))
    apart_mm = np.abs(again.poses.xy_mm.astype(int) - recording.poses.xy_mm)
    assert apart_mm[::10].max() <= 1 < 20 < apart_mm.max()


@pytest.mark.parametrize("kind", ["bag", "mcap"])
def test_a_recording_of_ros_is_imported_and_followed(driven, repository, tmp_path, kind):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    pytest.importorskip("mcap", reason="mcap is not installed")
    from desim.export.ros.recording_files import write_bag, write_mcap
    from desim.imports.imported_run import import_recording

    recording, tables = driven
    file = tmp_path / f"lab.{kind}"
    (write_bag if kind == "bag" else write_mcap)(recording, file, quiet)
    imported = import_recording(file, tmp_path / "results").run
    write_csv(imported, tmp_path / "csv", quiet)
    runs = [made(repository, tmp_path / place.name, *following(place / "poses.csv"))
            for place in (tables, tmp_path / "csv")]
    assert runs[0].manifest["digest"] == runs[1].manifest["digest"]


def test_trajectories_of_tum_are_imported_and_followed(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    (tmp_path / "robot_0.tum").write_text(
        "".join(f"{1305031102 + k} {k} {2 * k} 0 0 0 0 1\n" for k in range(5)))
    call = CliRunner().invoke
    done = call(app, ["import", str(tmp_path / "robot_0.tum"), "--out", str(tmp_path / "out")])
    run = done.stdout.splitlines()[-1].removeprefix("results in ")
    assert call(app, ["export", run, "--csv", str(tmp_path / "csv")]).exit_code == 0
    file = scenario(tmp_path)
    found = places(built(file, f"coordination.file={tmp_path / 'csv' / 'poses.csv'}"))
    assert found[:, 0].tolist() == pytest.approx([k / 10 for k in range(41)])


def places(simulation):
    """[k, 3] the pose of robot 0 ten times a second; the run ends with an audit."""
    found = []
    call_often(simulation, lambda: found.append(simulation.world.snapshot().poses[0]))
    finished(simulation)
    return np.array(found)


MIXED = ("robots: [{type: led, count: 1}, {type: pioneer3dx, count: 1}, {type: led, count: 1}], "
         "types: {led: {radius: 0.26 m, strategy: {" + LED + "}}}, "
         "start: {from: [0 m, 0.1 m], step: [0 m, 0 m]}")


def test_neither_walls_nor_robots_hold_it_and_contacts_count(tmp_path):
    """robot_1 stands in the way of robot_0, at 1.5 m/s; robot_2 is in a wall."""
    file = scenario(tmp_path, "0,robot_0,-3,0,0", "4,robot_0,3,0,0", "0,robot_2,5,-11.9,0",
                    fleet=MIXED, coordination="strategy: minpos", more=(
                        "robot: {passive: [robot_1]}\n"))
    simulation = built(file)
    assert places(simulation) == pytest.approx(np.column_stack([
        np.linspace(-3, 3, 41), np.zeros((41, 2))]))
    poses = simulation.world.snapshot().poses
    assert np.hypot(*(poses[1, :2] - (0.0, 0.1))) > 0.3  # pushed aside
    assert poses[2].tolist() == [5.0, -11.9, 0.0]
    assert simulation.world.travelled_m()[[0, 2]].tolist() == pytest.approx([6.0, 0.0])
    metrics = summarize(simulation.monitor, simulation.kernel.now_ns)
    assert metrics["collisions"] == 2
    walk = tmp_path / "walk.csv"
    assert [text for text in warnings(simulation.monitor) if str(walk) in text] == [
        f"{walk}:4: robot_2: it stands from 0 s on, when the recording ends; the run ends at 4 s "
        "(stop.elapsed)",
        f"{walk}:4: robot_2: in a wall, in 1 of 1 poses; is the map in the frame of the recording?"]


def test_velocities_and_poses_between_ticks_are_those_of_the_recording(tmp_path):
    simulation = built(scenario(tmp_path, "0,robot_0,0,0,1.5", "4,robot_0,4,-3,1.9"))
    world = simulation.world
    world.advance(NS_PER_S)
    forward, left, turn = world.velocities[0]
    yaw = world.snapshot().poses[0, 2]
    assert (forward * np.cos(yaw) - left * np.sin(yaw),
            forward * np.sin(yaw) + left * np.cos(yaw), turn) == pytest.approx((1, -0.75, 0.1))
    assert world.snapshot_at(1_007_000_000).poses[0] == pytest.approx(
        (1.007, -0.75525, 1.6007))


def test_doubts_are_warnings(tmp_path):
    file = scenario(tmp_path, "0,robot_0,0,0,0", "1,robot_0,9,0,0", "2,robot_0,0,0,0",
                    "0,robot_1,4,4,0", "3,robot_1,4,4.1,0", "0,robot_7,0,0,0",
                    "99,robot_2,0,1,0", fleet="size: 3")
    walk, simulation = tmp_path / "walk.csv", built(file)
    simulation.run()
    assert [text for text in warnings(simulation.monitor) if str(walk) in text] == [
        f"{walk}: nobody follows robot_7",
        f"{walk}:4: robot_0 and 1 more: it stands from 2 s on, when the recording ends; the run "
        "ends at 4 s (stop.elapsed)",
        f"{walk}:3: robot_0: a jump of 9.00 m within 1 s, the first of 2; max_speed is 1.2 m/s",
        f"{walk}:8: robot_2: it stands until 99 s, but the run ends at 4 s (stop.elapsed); begin "
        "says at which moment of the recording the run begins"]


def test_a_whole_recording_leaves_no_doubt(driven):
    simulation = built(HELLO, *following(driven[1] / "poses.csv"))
    assert simulation.world.doubts() == ()


@pytest.mark.parametrize("row, more, complaint", [
    ("0,robot_0,44,3,0", "", "case.yaml: walk.csv:2: robot_0 is at (44, 3) m, outside the terrain; "
     "allowed: x between -12 and 12 m, y between -12 and 12 m, the edges themselves left out"),
    ("0,robot_0,4,east,0", "", "case.yaml:5:40: coordination.file: walk.csv:2: y_m is 'east'; "
     "allowed: a place"),
    ("0,robot_0,4,3,0", "faults: [{at: 1 s, host: robot_0, kind: stuck}]",
     "case.yaml:7:41: faults.0.kind: robot_0 moves as a recording says (follow), and cannot be "
     "stuck; allowed: stop")])
def test_what_is_wrong_has_its_place(tmp_path, monkeypatch, row, more, complaint):
    monkeypatch.chdir(tmp_path)
    scenario(tmp_path, row, more=more)
    done = CliRunner().invoke(app, ["run", "case.yaml"])
    assert done.exit_code == 2
    assert done.stderr.replace(f"{tmp_path}/", "").strip() == complaint


def test_places_that_a_recording_overrules_are_warned_of(tmp_path):
    def said(**more):
        simulation = built(scenario(tmp_path, "0,robot_0,4,3,0", "4,robot_0,4,3,0", **more),
                           "fleet.start={poses: [{x: 1 m, y: 1 m}]}")
        simulation.run()
        return [text for text in warnings(simulation.monitor) if "fleet.start" in text]

    assert said() == ["fleet.start.poses: no effect, because robots start where the recording "
                      "begins"]
    assert said(coordination="strategy: nearest_frontier") == []


def test_a_fault_of_the_host_does_not_hold_the_body(tmp_path):
    file = scenario(tmp_path, "0,robot_0,0,0,0", "4,robot_0,4,0,0",
                    more="faults: [{at: 1 s, host: robot_0, down_for: 1 s}]")
    assert places(built(file))[:, 0] == pytest.approx(np.linspace(0, 4, 41))


def digest(file, *overrides):
    return finished(built(file, *overrides)).digest


def test_the_digest_is_that_of_the_poses(tmp_path):
    """Neither the order of rows nor other columns, but a millimetre matters."""
    header, *rows = (SCENARIOS / "recordings/house.csv").read_text().splitlines()
    other, (time_s, who, x_m, rest) = tmp_path / "house.csv", rows[30].split(",", 3)
    moved = f"{time_s},{who},{float(x_m) + 0.001:.3f},{rest}"
    digests = []
    for head, lines in ((header, rows[::-1]), (f"{header},who", [f"{row},me" for row in rows]),
                        (header, [*rows[:30], moved, *rows[31:]])):
        other.write_text("\n".join([head, *lines]) + "\n")
        digests.append(digest(FOLLOW, "stop.elapsed=8 s", f"coordination.file={other}"))
    assert digest(FOLLOW, "stop.elapsed=8 s") == digests[0] == digests[1] != digests[2]


RADIOS = ("network.media.air={model: radio}", "network.media.air={model: disk, range: 2.5 m}")


def drive(*overrides):
    """The places of all robots in ten samples a second, and the summary."""
    simulation = built(FOLLOW, *overrides)
    found = []
    call_often(simulation, lambda: found.append(simulation.world.snapshot().poses))
    finished(simulation)
    return np.array(found), summarize(simulation.monitor, simulation.kernel.now_ns)


def test_the_network_sees_them_where_they_are_and_does_not_move_them():
    (radio, _), (disk, summary) = map(drive, RADIOS)
    assert (radio == disk).all()
    # Three robots are connected if two of their distances are in range.
    rows = np.array([line.split(",")[2:4] for line in (SCENARIOS / "recordings/house.csv")
                     .read_text().splitlines()[1:]], float).reshape(-1, 3, 2)[::2]  # a second
    near = np.hypot(*(rows - rows[:, [1, 2, 0]]).transpose(2, 0, 1)) <= 2.5
    parted = {second for begin, end in summary["partitions"]["episodes_s"]
              for second in range(int(begin), int(end))}
    assert parted == set(np.flatnonzero(near.sum(axis=1) < 2).tolist()) != set()


def test_robots_that_drive_by_themselves_go_elsewhere_when_they_hear_less():
    """The twin."""
    free = "coordination={strategy: minpos}"
    (radio, _), (disk, _) = (drive(medium, free, "stop.elapsed=20 s") for medium in RADIOS)
    assert not (radio == disk).all()


@pytest.mark.parametrize("kind", ["gmapping", "scan_matching"])
def test_slam_works_on_what_they_see(kind):
    _, found = drive(f"robot.localization={kind}", "robot.odometry.model=random_walk")
    assert found["ate_m"] < 0.1
    assert found["explored_area_m2"] > 500
