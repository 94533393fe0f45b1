"""Loading: what was written, what it extends, what was laid over it, and everything spelled out."""

import copy
import json
import pickle
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.errors import InputError
from desim.ports import natural_key
from desim.scenario import yaml12
from desim.scenario.json_schema import json_schema
from desim.scenario.load import from_mapping, load
from desim.scenario.names import host_names, robot_names
from desim.scenario.resolved import resolved, scenario_id
from desim.scenario.schema.environment import MapFile
from desim.scenario.schema.fleet import StartList
from desim.scenario.schema.robot import Laser

SCENARIOS = Path(__file__).parents[2] / "scenarios"
MAZE_30, _ = yaml12.read(str(SCENARIOS / "maze_30.yaml"))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def scenario(text="", *overrides):
    data, _ = yaml12.parse(f"name: x\n{text}", "text")
    return from_mapping(data, overrides).scenario


def form(scenario):
    """The form in which robots send their maps."""
    sharing = scenario.coordination.exchange.params
    return sharing.content, sharing.encoding


def named(scenario, versions):
    return scenario_id(scenario, versions)(scenario.seed)


def test_the_smallest_scenario_is_the_papers_robot_in_the_papers_maze():
    smallest = scenario()
    assert smallest.fleet.size == 1
    assert smallest.environment.terrain == "maze"
    assert smallest.stop.elapsed_ns == 2000 * 10**9
    assert smallest.network.media["lan"].params.rate_bps == 10**9
    assert smallest.network.media["lan"].rules == ()
    assert form(smallest) == ("full", "raw")


def test_defaults_of_the_field():
    field = scenario("deployment: field")
    assert list(field.network.media) == ["air"]
    air = scenario("deployment: field\nnetwork: {media: {air: {model: radio, card: pi_4, "
                   "preset: indoor}}}").network.media["air"]
    assert field.network.media["air"] == air
    assert form(field) == ("changed_tiles", "zlib")


def test_the_workstation_has_its_processors_where_something_else_is_said_of_it():
    computer = scenario("testbed: {computer: {speed: 2}}").testbed.computer
    assert (computer.speed, computer.processors) == (2, 8)


def rungs(scenario):
    return {name: getattr(medium.params, "fidelity", medium.model)
            for name, medium in scenario.network.media.items()}


def test_fidelity_chooses_the_rung_of_every_radio():
    """Wires have none; what a medium says itself is for where the network says nothing."""
    media = ("network: {media: {air: {model: radio, rate: 6 Mb/s, fidelity: disk}, "
             "control: {model: radio}, lan: {model: link}}}")
    assert rungs(scenario(media)) == {"air": "disk", "control": "mac", "lan": "link"}
    walls = scenario(media, "network.fidelity=walls")
    assert rungs(walls) == {"air": "walls", "control": "walls", "lan": "link"}
    assert walls.network.media["air"].params.rate_bps == 6_000_000


def test_a_fidelity_laid_over_wires_takes_their_place():
    """As another model takes the parameters of the one below it; what is laid over radios or beside
    media of one's own leaves them."""
    wires = "deployment: field\nnetwork: {media: {lan: {model: switch}, bus: {model: bus}}}"
    assert rungs(scenario(wires, "network.fidelity=disk")) == {"air": "disk"}
    assert rungs(scenario(wires, "network={fidelity: disk, media: {a: {model: radio}}}")) == {
        "a": "disk"}
    one = wires.replace("{model: bus}", "{model: radio}")
    assert rungs(scenario(one, "network.fidelity=disk")) == {"bus": "disk", "lan": "switch"}
    maze = load(SCENARIOS / "maze_30.yaml", ["deployment=field", "network.fidelity=walls"])
    assert rungs(maze.scenario) == {"air": "walls"}


def test_a_field_with_a_fidelity_has_radios():
    text = resolved(scenario("deployment: field\nnetwork: {fidelity: disk}"))
    data, _ = yaml12.parse(text, "text")
    assert data["network"]["media"]["air"]["model"] == "radio"
    assert resolved(from_mapping(data).scenario) == text
    again = from_mapping(data, ["network.fidelity=mac"]).scenario
    assert again == scenario("deployment: field\nnetwork: {fidelity: mac}")
    assert rungs(again) == {"air": "mac"}


def test_what_is_written_wins_over_the_deployments_defaults():
    field = scenario("deployment: field\ncoordination: {exchange: {content: full}}\n"
                     "network: {media: {air: {model: ideal}}}")
    assert form(field) == ("full", "zlib")
    assert field.network.media["air"].model == "ideal"
    assert scenario("coordination: {exchange: null}").coordination.exchange is None


@pytest.mark.parametrize("file", sorted(SCENARIOS.glob("*.yaml")), ids=lambda file: file.name)
def test_a_resolved_scenario_is_the_same_scenario(file, here):
    first = load(file).scenario
    text = resolved(first, here)
    (here / "scenario.resolved.yaml").write_text(text)
    second = load("scenario.resolved.yaml").scenario
    assert second == first
    assert hash(second) == hash(first)
    assert resolved(second, here) == text
    assert named(second, {"desim": "1"}) == named(first, {"desim": "1"})


def test_a_resolved_scenario_leaves_nothing_to_be_decided():
    data, _ = yaml12.parse(resolved(scenario("robot: {laser: lms500}")), "text")
    assert data["robot"]["laser"]["beams"] == 180
    assert data["fleet"]["types"]["pioneer3dx"]["max_turn"] == "5.24 rad/s"
    assert data["coordination"]["exchange"]["period"] == "5 s"
    undecided = re.findall(r"^ *(\w+): null$", resolved(scenario()), re.MULTILINE)
    # each medium says itself what it is, and has all hosts; no condition, no such update; robots
    # that go to the nearest frontier announce no goals; their type has nothing of its own, and
    # localization runs on them; their antennas send as the medium says; maps in messages are as
    # large as the terrain's; robots are round and have no sonar, and move_base's oscillation
    # timeout is off; no host looks at carriers; computers have memory without a limit and clocks
    # that show the true time; robots' energy is not measured; there are no real programs
    assert undecided == ["memory", "clock", "footprint", "robot", "strategy", "host", "sonar",
                         "power", "memory", "clock", "power", "temporal_update",
                         "published_size", "oscillation_timeout", "fidelity", "hosts", "failover",
                         "team_state", "ros_master", "dds_domain", "when"]


def test_maze_30_is_table_4():
    maze = load(SCENARIOS / "maze_30.yaml").scenario
    assert maze.fleet.size == 30
    assert maze.fleet.start.origin_m == (-38.0, 38.0)
    assert maze.fleet.start.step_m == (0.0, -2.0)
    body = maze.fleet.types["pioneer3dx"]
    assert (body.max_speed_mps, body.max_turn_radps) == (1.2, 5.24)
    laser, odometry = maze.robot.laser, maze.robot.odometry
    assert (laser.beams, laser.max_range_m, laser.rate_hz) == (180, 26.0, 25)
    assert laser.field_of_view_rad == pytest.approx(3.31613, abs=1e-5)
    assert (odometry.rate_hz, odometry.position_noise_m, odometry.heading_noise_rad) == (
        10, 0.022, 0.02)
    lan = maze.network.media["lan"]
    assert (lan.model, lan.params.rate_bps) == ("switch", 10**9)
    assert [(rule.rule, rule.params.distance_m) for rule in lan.rules] == [("range", 200.0)]
    assert maze.testbed.robots_per_node == 4
    assert (maze.stop.explored, maze.stop.by, maze.stop.elapsed_ns) == (0.99, "any", 2000 * 10**9)
    assert maze.robot.localization.model == "ground_truth"


def test_every_line_of_maze_30_names_its_source():
    text = (SCENARIOS / "maze_30.yaml").read_text()
    values = [line for line in text.splitlines() if re.match(r"\s*(- \{)?\w+: \S", line)]
    assert [line for line in values if "#" not in line] == ["name: maze_30"]


def test_hello_is_short():
    lines = (SCENARIOS / "hello.yaml").read_text().splitlines()
    assert len([line for line in lines if not line.startswith("#")]) <= 16
    assert load(SCENARIOS / "hello.yaml").scenario.fleet.size == 3


# ------------------------------------------------------------------------------ extends, --set


def test_extends_merges_mappings_and_replaces_lists(here):
    (here / "base.yaml").write_text(
        "name: base\nseed: 3\nstop: {explored: 90 %, elapsed: 10 s}\n"
        "faults: [{at: 1 s, host: robot_0}, {at: 2 s, host: robot_0}]\n")
    (here / "child.yaml").write_text(
        "extends: base.yaml\nname: child\nstop: {elapsed: 20 s}\n"
        "faults: [{at: 3 s, host: robot_0}]\n")
    loaded = load("child.yaml")
    child = loaded.scenario
    assert (child.name, child.seed, child.stop.explored) == ("child", 3, 0.9)
    assert child.stop.elapsed_ns == 20 * 10**9
    assert [fault.at_ns for fault in child.faults] == [3 * 10**9]
    assert loaded.where("stop.elapsed") == "child.yaml:3:17: stop.elapsed"
    assert loaded.where("stop.explored") == "base.yaml:3:18: stop.explored"


def test_the_name_of_a_plug_in_may_stand_alone(here):
    (here / "short.yaml").write_text(
        "name: short\ntask: patrolling\nhosts: {base: {strategy: centralized}}\n"
        "middleware: ros1\nnetwork: {media: {lan: disk}}\n")
    (here / "longer.yaml").write_text("extends: short.yaml\ntask: {drawn: 3}\n")
    loaded = load("longer.yaml", ["coordination=expected_reactive"])
    scenario = loaded.scenario
    assert (scenario.task.model, scenario.task.params.drawn) == ("patrolling", 3)
    assert scenario.hosts["base"].strategy.strategy == "centralized"
    assert scenario.middleware.model == "ros1"
    assert scenario.network.media["lan"].model == "disk"
    assert (scenario.coordination.strategy, scenario.coordination.lost_after_ns) == (
        "expected_reactive", 30 * 10**9)
    assert loaded.where("task.model") == "short.yaml:2:7: task.model"
    assert load("short.yaml", ["task=exploration"]).scenario.task.model == "exploration"


def test_another_plugin_does_not_inherit_parameters_but_rules():
    maze = "network: {media: {lan: {model: switch, rate: 1 Gb/s, rules: [{rule: range, " \
           "distance: 9 m}]}}}"
    other = scenario(maze, "network.media.lan.model=ideal").network.media["lan"]
    assert other.model == "ideal"
    assert not hasattr(other.params, "rate_bps")
    assert [rule.rule for rule in other.rules] == ["range"]
    same = scenario(maze, "network.media.lan.rate=5 Mb/s").network.media["lan"]
    assert (same.model, same.params.rate_bps) == ("switch", 5_000_000)


def test_another_shape_of_terrain_or_start_replaces_the_whole():
    start = scenario("fleet: {start: {from: [1 m, 1 m], step: [1 m, 0 m]}}",
                     "fleet.start={poses: [{x: 0 m, y: 0 m}]}").fleet.start
    assert isinstance(start, StartList)
    snapped = scenario("fleet: {start: {poses: [{x: 0 m, y: 0 m}]}}", "fleet.start.snap=true")
    assert isinstance(snapped.fleet.start, StartList)
    assert snapped.fleet.start.snap


def test_null_takes_a_named_thing_away():
    field = scenario("network: {media: {lan: {model: switch}, air: {model: disk}}}\n"
                     "hosts: {base: {}}", "network.media.lan=", "hosts.base=null")
    assert list(field.network.media) == ["air"]
    assert field.hosts == {}


def test_null_takes_a_laser_away():
    two = "lasers: {high: {height: 0.6 m}, low: {height: 0.2 m}}"
    both = scenario(f"robot: {{{two}}}\nfleet: {{types: {{mapper: {{robot: {{{two}}}}}}}}}",
                    "robot.lasers.high=null", "fleet.types.mapper.robot.lasers.low=null")
    assert list(both.robot.lasers) == ["low"]
    assert list(both.fleet.types["mapper"].robot.lasers) == ["high"]


def test_overrides_are_yaml_1_2_and_the_last_wins():
    changed = scenario("faults: [{at: 1 s, host: robot_0}]", "fleet.size=2", "fleet.size=8",
                       "faults.0.host=robot_7", "robot.passive=[robot_1]",
                       "robot.laser.beams=90")
    assert changed.fleet.size == 8
    assert changed.faults[0].host == "robot_7"
    assert changed.robot.passive == ("robot_1",)
    assert changed.robot.laser == Laser(beams=90)


def test_the_seed_argument_wins(here):
    (here / "case.yaml").write_text("name: x\nseed: 1\n")
    assert load("case.yaml", ["seed=2"], seed=7).scenario.seed == 7


# ------------------------------------------------------------------------------ paths


@pytest.fixture
def mapped(here):
    (here / "maps").mkdir()
    (here / "maps" / "room.yaml").write_text("image: room.pgm\n")
    (here / "maps" / "room.pgm").write_bytes(b"P5 1 1 255 \xff")
    (here / "case.yaml").write_text("name: x\nenvironment: {terrain: maps/room.yaml}\n")
    return here


def test_a_map_is_found_beside_the_file_that_names_it(mapped):
    (mapped / "below").mkdir()
    (mapped / "below" / "child.yaml").write_text("extends: ../case.yaml\nseed: 5\n")
    loaded = load("below/child.yaml").scenario
    assert loaded.environment.terrain == MapFile(map=str(mapped / "maps" / "room.yaml"))


def test_a_resolved_scenario_names_its_map_from_where_it_lies(mapped):
    results = mapped / "results" / "run"
    results.mkdir(parents=True)
    first = load("case.yaml").scenario
    text = resolved(first, results)
    assert "map: ../../maps/room.yaml" in text
    (results / "scenario.resolved.yaml").write_text(text)
    assert load(results / "scenario.resolved.yaml").scenario == first


def test_the_id_follows_the_content_of_the_map_and_not_its_place(mapped):
    first = named(load("case.yaml").scenario, {})
    assert re.fullmatch("[0-9a-f]{12}", first)
    moved = mapped / "elsewhere"
    moved.mkdir()
    (mapped / "maps").rename(moved / "maps")
    (moved / "case.yaml").write_text((mapped / "case.yaml").read_text())
    assert named(load("elsewhere/case.yaml").scenario, {}) == first
    (moved / "maps" / "room.pgm").write_bytes(b"P5 1 1 255 \x00")
    assert named(load("elsewhere/case.yaml").scenario, {}) != first


def test_the_id_follows_seed_and_versions():
    ids = {named(scenario(text), versions) for text in ("", "seed: 1")
           for versions in ({"numpy": "1"}, {"numpy": "2"})}
    assert len(ids) == 4


# ------------------------------------------------------------------------------ who is there


@pytest.mark.parametrize("text, names", [
    ("", ["robot_0"]),
    ("fleet: {size: 11}", [f"robot_{i}" for i in range(11)]),
    ("fleet: {robots: [{type: pioneer3dx, count: 2}, {type: holonomic, count: 1}]}",
     ["robot_0", "robot_1", "robot_2"]),
    ("fleet: {start: {poses: [{x: 0 m, y: 0 m}, {x: 1 m, y: 0 m}]}}", ["robot_0", "robot_1"]),
    ("fleet: {start: {poses: [{name: b_10, x: 0 m, y: 0 m}, {name: b_9, x: 1 m, y: 0 m}]}}",
     ["b_9", "b_10"]),
])
def test_names_of_robots(text, names):
    assert list(robot_names(scenario(text))) == names
    assert scenario(text).fleet.size == len(names)


def test_names_of_hosts():
    assert host_names(scenario("hosts: {base: {}}")) == ("base", "robot_0", "workstation")
    assert host_names(scenario("hosts: {base: {}}\ndeployment: field")) == ("base", "robot_0")


def test_the_order_of_declaration_makes_no_difference():
    poses = [f"{{name: r_{i}, x: {i} m, y: 0 m}}" for i in range(12)]
    media = ["lan: {model: switch}", "air: {model: disk}"]

    hosts = ["base_10: {}", "base_9: {monitor: true}"]

    def declared(order):
        return scenario(f"hosts: {{{', '.join(order(hosts))}}}\n"
                        f"fleet: {{start: {{poses: [{', '.join(order(poses))}]}}}}\n"
                        f"network: {{media: {{{', '.join(order(media))}}}}}")

    forward, backward = declared(list), declared(lambda items: list(reversed(items)))
    assert forward == backward
    assert resolved(forward) == resolved(backward)


def test_starts_from_a_file(here):
    (here / "starts.csv").write_text("name, x_m, y_m, heading_rad\nb, 1.5, -2, 3.1\na, 0, 0,\n")
    (here / "case.yaml").write_text("name: x\nfleet: {start: {file: starts.csv, snap: true}}\n")
    start = load("case.yaml").scenario.fleet.start
    assert start.snap
    assert [(pose.name, pose.x_m, pose.y_m, pose.heading_rad) for pose in start.poses] == [
        ("a", 0.0, 0.0, 0.0), ("b", 1.5, -2.0, 3.1)]


@given(st.lists(st.integers(0, 10**6), unique=True))
def test_natural_order_is_that_of_the_numbers(numbers):
    names = sorted((f"robot_{number}" for number in numbers), key=natural_key)
    assert names == [f"robot_{number}" for number in sorted(numbers)]


# ------------------------------------------------------------------------------ values


def test_a_scenario_is_frozen_hashable_and_travels():
    one = scenario("faults: [{at: 1 s, host: robot_0}]")
    assert {one: 1}[scenario("faults: [{at: 1 s, host: robot_0}]")] == 1
    assert pickle.loads(pickle.dumps(one)) == one
    with pytest.raises(ValueError, match="frozen"):
        one.seed = 2


def test_loading_does_not_touch_the_mapping():
    data = {"name": "x", "network": {"media": {"lan": {"model": "switch"}}}}
    before = copy.deepcopy(data)
    from_mapping(data, ["network.media.lan.model=ideal"])
    assert data == before


def _paths(data, path=()):
    yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(
        data, list) else ()
    for step, value in items:
        yield from _paths(value, (*path, step))


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) |
    st.text(max_size=8) | st.sampled_from(["5 s", "-1 m", "1 Gb/s", "no", "a:b", "<a>"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(
        ["model", "rule", "rules", "map", "size", "poses", "from", "at", "x"]), inner, max_size=3),
    max_leaves=6)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(list(_paths(MAZE_30))[1:]), JUNK)
def test_anything_anywhere_loads_or_is_an_input_error(path, junk):
    data = copy.deepcopy(MAZE_30)
    node = data
    for step in path[:-1]:
        node = node[step]
    node[path[-1]] = junk
    try:
        loaded = from_mapping(data).scenario
    except InputError as error:
        assert error.args
        assert all(line.startswith("scenario: ") for line in error.args)
    else:
        assert from_mapping(yaml12.parse(resolved(loaded), "text")[0]).scenario == loaded


def test_the_json_schema_knows_keys_units_and_plugins():
    schema = json_schema()
    json.dumps(schema)
    assert set(MAZE_30) <= set(schema["properties"])
    media = {option["title"]: option for option in schema["$defs"]["MediumChoice"]["anyOf"]}
    rate = media["switch"]["properties"]["rate"]
    assert rate["default"] == "1 Gb/s"
    assert re.search(rate["pattern"], "54 Mb/s")
    assert not re.search(rate["pattern"], "54")
    assert "package.module:Class" in media
    # As in `network.media.lan: {rate: 10 Mb/s}`, where the deployment names the model.
    assert media["without model"]["not"] == {"required": ["model"]}
    assert "model" not in media["without model"]["properties"]
    via = schema["$defs"]["TeamStateParams"]["properties"]["via"]
    assert via["enum"] == ["unicast", "broadcast"]
