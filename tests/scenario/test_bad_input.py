"""Wrong scenarios: each gives its complaints, all at once, with their places, and nothing else."""

import sys

import pytest

from desim import plugins
from desim.errors import InputError
from desim.scenario.load import from_mapping, load
from desim.simulation.simulation import Simulation

TIMES = "allowed: s, ms, us, ns, min, h, µs, e.g."
RATES = ("allowed: b/s, kb/s, Mb/s, Gb/s, bit/s, kbit/s, Mbit/s, Gbit/s, B/s, kB/s, MB/s, GB/s, "
         "e.g. '54 Mb/s'")
LENGTHS = "allowed: m, km, cm, mm, e.g."
GRAMMAR = ("allowed: numbers, names, + - * /, comparisons, and, or, not, min(), max(), abs() and "
           "parentheses")
DOTTED = "or a dotted path 'package.module:Class'"
WANTED = ("it is not a plug-in for this place; wanted: a class with all methods of "
          "desim.ports.")
STRATEGIES = ", ".join(plugins.available("strategy"))  # other packages may bring their own
NETWORKS = ", ".join(plugins.available("network"))
RULES = ", ".join(plugins.available("rule"))
COMPUTERS = ", ".join(plugins.available("computers"))

# What follows "name: x\n", and the complaints without "case.yaml:" in front.
WRONG = {
    "unknown key": ("fleet: {siz: 3}", [
        "2:9: fleet.siz: unknown key (did you mean 'size'?); allowed: size, robots, types, start"]),
    "unknown task": ("task: patroling", [
        "2:7: task.model: unknown task 'patroling' (did you mean 'patrolling'?); known: "
        "coverage, delivery, exploration, formation, journeys, none, patrolling, pursuit, search, "
        f"{DOTTED}"]),
    "no task": ("task: 5", ["2:7: task: must be a plug-in's name, or a mapping with model, got 5"]),
    "no places": ("task: {model: patrolling, places: [[1 m]]}", [
        "2:36: task.places.0: must be a list of 2, got a list of 1"]),
    "an empty list of places": ("task: {model: patrolling, places: []}", [
        "2:35: task.places: must be a list of at least 1, got a list of 0"]),
    "teammates that are always lost": ("coordination: {lost_after: 0 s}", [
        "2:28: coordination.lost_after: '0 s' must be above zero"]),
    "a patrol without a task": ("coordination: {strategy: cyclic_patrol}", [
        "2:26: coordination.strategy: 'cyclic_patrol' needs a task that gives robots a Patrol; the "
        "task 'exploration' gives nothing"]),
    "a base without a task": ("hosts: {base: {strategy: cyclic_patrol}}", [
        "2:26: hosts.base.strategy: 'cyclic_patrol' needs a task that gives robots a Patrol; the "
        "task 'exploration' gives nothing"]),
    "robots without their coordinator": ("coordination: {strategy: centralized}", [
        "2:26: coordination.strategy: 'centralized' needs a host without a body that runs it, too; "
        "write hosts: {base: {strategy: centralized}}"]),
    "robots with another coordinator": (
        "fleet: {types: {scout: {strategy: centralized}}}\nhosts: {base: {strategy: minpos}}", [
            "2:35: fleet.types.scout.strategy: 'centralized' needs a host without a body that runs "
            "it, too; write hosts: {base: {strategy: centralized}}"]),
    "SLAM on a host that is not there": (
        "robot: {localization: {model: gmapping, host: bse}}\nhosts: {base: {}}", [
            "2:47: robot.localization.host: unknown host 'bse' (did you mean 'base'?); allowed: "
            "base, robot_0, workstation"]),
    "SLAM on a robot without software": (
        "robot: {localization: {model: gmapping, host: robot_1}, passive: [robot_1]}\n"
        "fleet: {size: 2}", [
            "2:47: robot.localization.host: unknown host 'robot_1' (did you mean 'robot_0'?); "
            "allowed: robot_0, workstation"]),
    "a sensor of the pose on another host": (
        "fleet: {types: {scout: {robot: {localization: {host: base}}}}}\nhosts: {base: {}}", [
            "2:54: fleet.types.scout.robot.localization.host: 'ground_truth' draws no map, so it "
            "runs on the robot; allowed on another host: gmapping, pose_graph, scan_matching"]),
    "scans that another host draws": (
        "robot: {localization: {model: gmapping, host: base}}\nhosts: {base: {}}\n"
        "coordination: {exchange: {model: submaps}}", [
            "2:47: robot.localization.host: 'submaps' shares scans as the robot draws them, and "
            "base draws them; allowed then: frontiers, own_maps, relayed"]),
    "poses without a common frame": (
        "coordination: {exchange: {model: registered_maps}, team_state: {period: 1 s}}", [
            "2:64: coordination.team_state: with 'registered_maps' robots do not know where the "
            "others started: their poses and goals mean nothing to them; set it to null"]),
    "a strategy without a common frame": (
        "coordination: {exchange: {model: registered_maps}, strategy: minpos}", [
            "2:62: coordination.strategy: 'minpos' wants its team's poses and goals every second, "
            "which mean nothing with 'registered_maps'; choose another "
            "coordination.exchange.model or, for a strategy without messages of its own, set "
            "coordination.team_state to null to do without"]),
    **{f"a coordinator that would get no map by {model}": (
        "hosts: {base: {strategy: {strategy: nearest_frontier}}, camp: {at: [0 m, 0 m]}}\n"
        f"coordination: {{exchange: {{model: {model}}}}}", [
            f"3:34: coordination.exchange.model: '{model}' merges into the map of a robot's own "
            "scans; base, with a strategy and without a body, would get no map; allowed with a "
            "coordinator: own_maps, relayed, scans, submaps"])
       for model in ("mrs_testbed", "registered_maps", "frontiers")},
    "a coordinator to which nobody sends a map": (
        "hosts: {base: {strategy: nearest_frontier}}\ncoordination: {exchange: null}", [
            "3:26: coordination.exchange: null means that nobody sends a map; base, with a "
            "strategy and without a body, would get no map; allowed with a coordinator: own_maps, "
            "relayed, scans, submaps"]),
    "a quantity of another task": ("stop: {when: idleness_s > 5}", [
        "2:14: stop.when: unknown quantity 'idleness_s'; allowed: time_s, explored, "
        "explored_union, explored_all, collisions, recoveries, messages_sent, messages_delivered, "
        "messages_dropped, bytes_on_air, distance_m, partitions, robots_moving"]),
    "unknown family": ("networks: {}", [
        "2:1: networks: unknown key (did you mean 'network'?); allowed: name, seed, deployment, "
        "testbed, physics, environment, fleet, robot, hosts, network, topics, middleware, "
        "computers, coordination, task, faults, loop, stop, measure, trace"]),
    "no merge keys in YAML 1.2": ("robot: {<<: {passive: []}}", [
        "2:9: robot.<<: unknown key; allowed: localization, laser, lasers, sonar, bumper, antenna, "
        "computer, clock, power, odometry, mapping, navigation, exploration, publishes, tf, "
        "passive"]),
    "what robots publish": (
        "fleet: {size: 2}\n"
        "robot: {publishes: [{topic: low/scan, size: 1 kB, rate: 1 Hz},\n"
        "  {topic: strategy/bid, size: 1 kB, rate: 1 Hz},\n"
        "  {topic: scan/copy_2, size: 1 kB, rate: 1 Hz}]}", [
            "3:29: robot.publishes.0.topic: 'low/scan' is a topic of the robot's own; choose "
            "another",
            "4:11: robot.publishes.1.topic: 'strategy/bid' is a topic of the robot's own; choose "
            "another",
            "5:11: robot.publishes.2.topic: 'scan/copy_2' is a topic of the robot's own; choose "
            "another"]),
    "receivers of what robots publish": (
        "fleet: {size: 2}\n"
        "robot: {publishes: [{topic: a, size: 1 kB, rate: 1 Hz, to: other},\n"
        "  {topic: a, size: 1 kB, rate: 1 Hz, to: [base, 'robot_*']}]}", [
            "3:60: robot.publishes.0.to: unknown host 'other' (did you mean 'others'?); allowed: "
            "others, robot_0, robot_1, workstation",
            "4:11: robot.publishes.1.topic: 'a' is published already, by another of this list",
            "4:43: robot.publishes.1.to.0: unknown host 'base'; allowed: others, robot_0, robot_1, "
            "workstation"]),
    "what a robot publishes is for nobody": (
        "robot: {publishes: [{topic: a, size: 1 kB, rate: 1 Hz, to: []}]}", [
            "2:60: robot.publishes.0.to: must name at least one host, or be left out"]),
    "maps that no message can hold": (
        "robot: {mapping: {published_size: [10 km, 5 km]}}", [
            "2:35: robot.mapping.published_size: makes maps of 1.25e+09 cells, a byte each; "
            "allowed: 1 GB"]),
    "more topics than a master has": (
        "middleware: {model: ros1, polling: 100 ms, polled_topics: 1001,\n"
        "constants: {workers: 1001}}", [
            "2:59: middleware.polled_topics: must be at most 1000, got 1001",
            "3:22: middleware.constants.workers: must be at most 1000, got 1001"]),
    "nobody to receive what a type publishes": (
        "deployment: field\nfleet: {types: {a: {robot: {publishes: [{topic: a, size: 1 kB, "
        "rate: 1 Hz}]}}}}", [
            "3:41: fleet.types.a.robot.publishes.0: the key 'to' is missing: its default are the "
            "hosts that collect maps and distances, and there is none (hosts.<name>.monitor)"]),
    "a topic, and a size": (
        "robot: {publishes: [{topic: /a, size: 2 GB, rate: 1 Hz}, {topic: b, rate: 1 Hz}]}", [
            "2:29: robot.publishes.0.topic: '/a' is not allowed; allowed: text that matches "
            "^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*$",
            "2:39: robot.publishes.0.size: '2 GB' is too large; at most 1 GB",
            "2:58: robot.publishes.1: the key 'size' is missing: of a message, without headers"]),
    "the media of topics": (
        "topics: {scan: {medium: lann}, /map_exchange/*: {medium: [lan, wifi]}, tf: {medium: []}}",
        ["2:25: topics.scan.medium: unknown medium 'lann' (did you mean 'lan'?); allowed: lan",
         "2:64: topics./map_exchange/*.medium.1: unknown medium 'wifi'; allowed: lan",
         "2:85: topics.tf.medium: must name at least one medium; allowed: lan"]),
    "patterns of topics": ("topics: {'a b': {medium: lan}, odom: {}}", [
        "2:10: topics.a b: 'a b' is not allowed; allowed: text that matches "
        "^/?[A-Za-z0-9_*?]+(/[A-Za-z0-9_*?]+)*$"]),
    "marks of topics": ("topics: {odom: {}, cmd: {dscp: 64}}", [
        "2:32: topics.cmd.dscp: must be at most 63, got 64"]),
    "media to forward between": (
        "network: {media: {lan: {model: switch, hosts: [workstation, robot_0]}, air: {model: disk, "
        "range: 9 m}}}\nhosts: {a: {forwards: [lan, air]}, b: {forwards: [ari, air]}, "
        "c: {forwards: [air]}}", [
            "3:24: hosts.a.forwards.0: a is not attached to lan (network.media.lan.hosts)",
            "3:51: hosts.b.forwards.0: unknown medium 'ari' (did you mean 'air'?); allowed: lan, "
            "air",
            "3:77: hosts.c.forwards: must be at least two media, or none"]),
    "names that a list has already": (
        "network: {media: {lan: {model: link, hosts: [base, robot_0, base]}}}\n"
        "hosts: {base: {forwards: [lan, lan]}}\ntopics: {scan: {medium: [lan, lan]}}", [
            "2:61: network.media.lan.hosts.2: base is named already; allowed: once",
            "3:32: hosts.base.forwards.1: lan is named already; allowed: once",
            "4:31: topics.scan.medium.1: lan is named already; allowed: once"]),
    "failover": ("network: {failover: {announce_every: 0 s, metric: -1}}", [
        "2:38: network.failover.announce_every: '0 s' must be above zero",
        "2:43: network.failover.metric: unknown key; allowed: noticed_after, announce_every"]),
    "background traffic": (
        "fleet: {size: 2}\nnetwork: {others: {nas: {}, robot_1: {}}, background: [\n"
        "  {medium: lam, between: [nas, robot_0], rate: 1 Mb/s},\n"
        "  {medium: lan, between: [nasa, nas], rate: 1 Mb/s},\n"
        "  {medium: lan, between: [nas, nas], rate: 1 Mb/s},\n"
        "  {medium: lan, between: [nas, workstaton], rate: 1 Mb/s}]}", [
            "3:38: network.others.robot_1: 'robot_1' is the name of another host",
            "4:12: network.background.0.medium: unknown medium 'lam' (did you mean 'lan'?); "
            "allowed: lan",
            "4:32: network.background.0.between.1: 'robot_0' is a robot, whose traffic is the "
            "fleet's (robot.publishes)",
            "5:27: network.background.1.between.0: unknown host of others 'nasa' (did you mean "
            "'nas'?); allowed: nas, robot_1",
            "6:26: network.background.2.between: must be two hosts, got 'nas' twice",
            "7:32: network.background.3.between.1: unknown host 'workstaton' (did you mean "
            "'workstation'?); allowed: nas, robot_1, workstation"]),
    "traffic of nobody": (
        "network: {background: [{medium: lan, between: [a, workstation], rate: 1 Mb/s, "
        "from: 2 s, until: 1 s},\n  {medium: lan, between: [a, b], rate: 1 b/s}]}", [
            "2:48: network.background.0.between.0: 'a' is not one of network.others, of which "
            "there are none",
            "2:97: network.background.0.until: must be later than from, got 2 s to 1 s",
            "3:27: network.background.1.between.0: 'a' is not one of network.others, of which "
            "there are none",
            "3:30: network.background.1.between.1: unknown host 'b'; allowed: workstation"]),
    "packets of others": (
        "network: {background: [{medium: lan, between: [a], rate: 0 b/s, size: 2 kB}]}", [
            "2:47: network.background.0.between: must be a list of 2, got a list of 1",
            "2:58: network.background.0.rate: '0 b/s' must be above zero",
            "2:71: network.background.0.size: must be at most 1518 B, got '2 kB'"]),
    "a bus inside hosts": (
        "network: {media: {bus: {model: link, inside: true, hosts: []}, lan: {model: switch, "
        "hosts: [workstation]}},\n  others: {nas: {}}, background: [{medium: bus, between: "
        "[nas, workstation], rate: 1 Mb/s}]}\nhosts: {a: {forwards: [bus, lan]}}", [
            "2:59: network.media.bus.hosts: must be at least one host, or left out",
            "2:92: network.media.lan.hosts: must be a list of at least 2, got a list of 1",
            "3:44: network.background.0.medium: unknown medium 'bus'; allowed: lan",
            "4:24: hosts.a.forwards.0: unknown medium 'bus'; allowed: lan",
            "4:29: hosts.a.forwards.1: a is not attached to lan (network.media.lan.hosts)"]),
    "unknown key where null is allowed": ("coordination: {exchange: {contents: full}}", [
        "2:27: coordination.exchange.contents: unknown key (did you mean 'content'?); allowed: "
        "model, fusion, encoding, period, via, content"]),
    "wrong unit": ("network: {media: {lan: {model: switch, rate: 1 m}}}", [
        f"2:46: network.media.lan.rate: unknown unit 'm' for a bit rate; {RATES}"]),
    "bare number": ("stop: {elapsed: 2000}", [
        f"2:17: stop.elapsed: 2000 has no unit; {TIMES} '5 s'"]),
    "bare zero": ("faults: [{at: 0, host: robot_0}]", [
        f"2:15: faults.0.at: 0 has no unit; {TIMES} '20 ms'"]),
    "number in quotes": ("robot: {laser: {max_range: '26'}}", [
        f"2:28: robot.laser.max_range: '26' has no unit; {LENGTHS} '200 m'"]),
    "negative rate": ("network: {media: {lan: {model: switch, rate: -1 Gb/s}}}", [
        "2:46: network.media.lan.rate: '-1 Gb/s' must be above zero"]),
    "negative length": ("robot: {laser: {noise: -1 cm}}", [
        "2:24: robot.laser.noise: '-1 cm' must not be negative"]),
    "huge": ("stop: {elapsed: 1e20 s}", [
        "2:17: stop.elapsed: '1e20 s' is too large; at most 1000000000 s"]),
    "NaN": ("stop: {explored: .nan}", ["2:18: .nan is not a finite number"]),
    "NaN with a unit": ("stop: {elapsed: nan s}", [
        f"2:17: stop.elapsed: 'nan s' is not a period; {TIMES} '5 s'"]),
    "infinity": ("stop: {elapsed: .inf}", ["2:17: .inf is not a finite number"]),
    "share above one": ("stop: {explored: 120 %}", [
        "2:18: stop.explored: '120 %' is too large; at most 100 %"]),
    "zero period": ("measure: {every: 0 s}", ["2:18: measure.every: '0 s' must be above zero"]),
    "zero extent": ("robot: {mapping: {resolution: 0 m}}", [
        "2:31: robot.mapping.resolution: must be above 0 m, got '0 m'"]),
    "fleet of -1": ("fleet: {size: -1}", ["2:15: fleet.size: must be at least 0, got -1"]),
    "half a robot": ("fleet: {size: 2.5}", [
        "2:15: fleet.size: must be a whole number, got 2.5"]),
    "text for a number": ("seed: one", ["2:7: seed: must be a whole number, got 'one'"]),
    "no is text": ("hosts: {base: {monitor: no}}", [
        "2:25: hosts.base.monitor: must be true or false, got 'no'"]),
    "number for text": ("stop: {when: 5}", ["2:14: stop.when: must be text, got 5"]),
    "list for a mapping": ("network: {media: [lan]}", [
        "2:18: network.media: must be a mapping, got a list of 1"]),
    "mapping for a list": ("faults: {at: 5 s, host: robot_0}", [
        "2:9: faults: must be a list, got a mapping"]),
    "text for a mapping": ("network: lan", [
        "2:10: network: must be a mapping with fidelity, media, others, background, sockets, "
        "failover, got 'lan'"]),
    "not of the allowed words": ("robot: {odometry: {model: random_wlk}}", [
        "2:27: robot.odometry.model: 'random_wlk' is not allowed (did you mean 'random_walk'?); "
        "allowed: independent, random_walk"]),
    "no localization": ("robot: {localization: ground_truh}", [
        "2:23: robot.localization.model: unknown localization 'ground_truh' (did you mean "
        "'ground_truth'?); known: gmapping, ground_truth, odometry, pose_graph, "
        "scan_matching, or a dotted path 'package.module:Class'"]),
    "no local planner": ("robot: {navigation: {local: regulated_pure_persuit}}", [
        "2:29: robot.navigation.local.model: unknown local_planner 'regulated_pure_persuit' (did "
        "you mean 'regulated_pure_pursuit'?); known: LOCAL_PLANNERS, or a dotted path "
        "'package.module:Class'".replace("LOCAL_PLANNERS", ", ".join(
            plugins.available("local_planner")))]),
    "parameters of a local planner": (
        "robot: {navigation: {local: {model: regulated_pure_pursuit, lookahead: -1 m, "
        "max_sped: 1 m/s, constants: {approach: 0 m}}}}", [
            "2:72: robot.navigation.local.lookahead: '-1 m' must not be negative",
            "2:78: robot.navigation.local.max_sped: unknown key (did you mean 'max_speed'?); "
            "allowed: model, max_speed, lookahead, scaled_lookahead, constants",
            "2:117: robot.navigation.local.constants.approach: must be above 0 m, got '0 m'"]),
    "parameters of dwb": (
        "robot: {navigation: {local: {model: dwb, vx_samples: 1, max_turn: 0 rad/s, "
        "constants: {forward: 0.1}}}}", [
            "2:54: robot.navigation.local.vx_samples: must be at least 2, got 1",
            "2:67: robot.navigation.local.max_turn: must be above 0 rad/s, got '0 rad/s'",
            "2:97: robot.navigation.local.constants.forward: 0.1 has no unit; allowed: m, km, cm, "
            "mm, e.g. '200 m'"]),
    "parameters of orca": (
        "robot: {navigation: {local: {model: orca, horizon: 0.5 ms, offset: 0 m, neighbors: 3}}}",
        ["2:52: robot.navigation.local.horizon: '0.5 ms' is too small; at least 1 ms",
         "2:68: robot.navigation.local.offset: must be above 0 m, got '0 m'",
         "2:73: robot.navigation.local.neighbors: unknown key (did you mean 'neighbours'?); "
         "allowed: model, horizon, obstacle_horizon, offset, lookahead, neighbours"]),
    "a parameter of another localization": (
        "robot: {localization: {model: scan_matching, particles: 5}}", [
            "2:46: robot.localization.particles: unknown key; allowed: model, host, map_period, "
            "redraw_every"]),
    "a localization's parameter out of range": (
        "robot: {localization: {model: gmapping, particles: 0}}", [
            "2:52: robot.localization.particles: must be at least 1, got 0"]),
    "localization of a type": (
        "fleet: {types: {scout: {robot: {localization: {model: gmapping, particle: 5}}}}}", [
            "2:65: fleet.types.scout.robot.localization.particle: unknown key (did you mean "
            "'particles'?); allowed: model, host, map_period, redraw_every, particles, "
            "least_particles"]),
    "a word in a list": ("measure: {on: [collison]}", [
        "2:16: measure.on.0: 'collison' is not allowed (did you mean 'collision'?); allowed: "
        "explored_10pct, collision, recovery, partition"]),
    "missing key": ("faults: [{host: robot_0}]", [
        "2:10: faults.0: the key 'at' is missing: when it begins"]),
    "misspelt required key": ("fleet: {start: {fil: a.csv}}", [
        "2:17: fleet.start.fil: unknown key (did you mean 'file'?); allowed: file, snap"]),
    "one coordinate": ("hosts: {base: {at: [1 m]}}", [
        "2:20: hosts.base.at: must be a list of 2, got a list of 1"]),
    "too many coordinates": ("fleet: {start: {from: [0 m, 0 m, 0 m]}}", [
        "2:23: fleet.start.from: must be a list of at most 2, got a list of 3"]),
    "a way of one point": ("environment: {moving_obstacles: [{path: [[0 m, 0 m]]}]}", [
        "2:41: environment.moving_obstacles.0.path: must be a list of at least 2, got a list of "
        "1"]),
    "bad name": ("hosts: {my base: {}}", [
        "2:9: hosts.my base: 'my base' is not allowed; allowed: text that matches "
        "^[A-Za-z][A-Za-z0-9_]*$"]),
    "unknown terrain": ("environment: {terrain: mase}", [
        "2:24: environment.terrain: unknown terrain 'mase' (did you mean 'maze'?); allowed: loop, "
        "cross, zigzag, maze, a map_server file (*.yaml), a shape, or a generated maze, office or "
        "warehouse"]),
    "no generator of terrains": ("environment: {terrain: {warehous: {size: [9 m, 9 m]}}}", [
        "2:25: environment.terrain.warehous: unknown key (did you mean 'warehouse'?); allowed: "
        "warehouse"]),
    "a generator nearly as long as another key": (
        "environment: {terrain: {maz: {size: [9 m, 9 m]}}}", [
            "2:25: environment.terrain.maz: unknown key (did you mean 'maze'?); allowed: maze"]),
    "a key of no terrain": ("environment: {terrain: {castle: {size: [9 m, 9 m]}}}", [
        "2:24: environment.terrain: must be text, or a mapping with map, image, offset, height, "
        "material, or a mapping with size, centre, rectangles, polygons, walls, drawing, or "
        "a mapping with maze, or a mapping with office, or a mapping with warehouse, got a "
        "mapping with castle"]),
    "a warehouse without a size": ("environment: {terrain: {warehouse: {seed: 2}}}", [
        "2:25: environment.terrain.warehouse: the key 'size' is missing: width and depth, centred "
        "on the origin"]),
    "a maze without a cell": ("environment: {terrain: {maze: {size: [9 m, 7 m]}}}", [
        "2:38: environment.terrain.maze.size: has no space for one cell, got 9 m x 7 m; allowed: "
        "at least 8 m x 8 m"]),
    "a maze of too many cells": (
        "environment: {terrain: {maze: {size: [5 km, 5 km], cell: 1 m}}}", [
            "2:38: environment.terrain.maze.size: has space for 25000000 cells; "
            "allowed: at most 100000"]),
    "a warehouse without a rack": ("environment: {terrain: {warehouse: {size: [9 m, 30 m]}}}", [
        "2:43: environment.terrain.warehouse.size: has no space for one rack with its aisles, got "
        "9 m x 30 m; allowed: at least 8.4 m x 34 m"]),
    "racks without length": (
        "environment: {terrain: {warehouse: {size: [9 m, 30 m], rack: [1 m, 0 m]}}}", [
            "2:62: environment.terrain.warehouse.rack: must be above zero, got 1 m x 0 m"]),
    "an office without a corridor": ("environment: {terrain: {office: {size: [9 m, 30 m]}}}", [
        "2:40: environment.terrain.office.size: has no space for a corridor between two rooms, got "
        "9 m x 30 m; allowed: both sides at least 10.4 m, the longer one above 10 m"]),
    "an office that is no longer than a room": (
        "environment: {terrain: {office: {size: [12 m, 12 m], room: [4 m, 12 m]}}}", [
            "2:40: environment.terrain.office.size: has no space for a corridor between two rooms, "
            "got 12 m x 12 m; allowed: both sides at least 10.4 m, the longer one above 12 m"]),
    "rooms that cannot be cut": (
        "environment: {terrain: {office: {size: [9 m, 9 m], room: [3 m, 5 m]}}}", [
            "2:58: environment.terrain.office.room: the largest side must be at least twice the "
            "least, which is above zero, got 3 m to 5 m"]),
    "a door wider than a room": (
        "environment: {terrain: {office: {size: [20 m, 20 m], door: 5 m}}}", [
            "2:60: environment.terrain.office.door: must be at most the least side of a room, "
            "4 m, got 5 m"]),
    "doors too narrow for the widest robot": (
        "environment: {terrain: {office: {size: [20 m, 20 m], door: 0.8 m}}}\n"
        "fleet: {robots: [{type: pioneer3dx, count: 1}, {type: truck, count: 1}], "
        "types: {truck: {radius: 0.5 m}}}", [
            "2:60: environment.terrain.office.door: 0.8 m is too narrow for truck; allowed: at "
            "least its width of 1 m"]),
    "missing map": ("environment: {terrain: no/map.yaml}", [
        "2:24: environment.terrain: no such map: no/map.yaml"]),
    "missing map with parameters": ("environment: {terrain: {map: no.yaml, offset: [1 m, 1 m]}}", [
        "2:30: environment.terrain.map: no such map: no.yaml"]),
    "no shape of terrain": ("environment: {terrain: 3}", [
        "2:24: environment.terrain: must be text, or a mapping with map, image, offset, height, "
        "material, or a mapping with size, centre, rectangles, polygons, walls, drawing, or "
        "a mapping with maze, or a mapping with office, or a mapping with warehouse, got 3"]),
    "one complaint for a union": ("environment: {terrain: {size: [1 m, 1 m], wals: []}}", [
        "2:43: environment.terrain.wals: unknown key (did you mean 'walls'?); allowed: size, "
        "centre, rectangles, polygons, walls, drawing"]),
    "rectangle inside out": (
        "environment: {terrain: {size: [9 m, 9 m], rectangles: [{x: [3 m, 1 m], y: [0 m, 1 m]}]}}",
        ["2:60: environment.terrain.rectangles.0.x: must go from a lower to a higher value, got "
         "3 m to 1 m"]),
    "door closes before it opens": (
        "environment: {doors: [{from: [0 m, 0 m], to: [1 m, 0 m], open: [[5 s, 2 s]]}]}", [
            "2:65: environment.doors.0.open.0: must open before it closes, got 5 s to 2 s"]),
    "door intervals out of order": (
        "environment: {doors: [{from: [0 m, 0 m], to: [1 m, 0 m], "
        "open: [[5 s, 9 s], [1 s, 2 s]]}]}",
        ["2:77: environment.doors.0.open.1: must begin after the interval before it has ended "
         "(9 s), got 1 s"]),
    "unknown model": ("network: {media: {lan: {model: swich}}}", [
        "2:32: network.media.lan.model: unknown network 'swich' (did you mean 'switch'?); known: "
        f"{NETWORKS}, {DOTTED}"]),
    "unknown parameter of a model": ("network: {media: {air: {model: disk, rang: 5 m}}}", [
        "2:38: network.media.air.rang: unknown key (did you mean 'range'?); allowed: model, rules, "
        "hosts, inside, metric, range, rate"]),
    "a medium of nobody": ("network: {media: {air: {model: disk, hosts: [robot_0, robot_9]}}}", [
        "2:55: network.media.air.hosts.1: unknown host 'robot_9' (did you mean 'robot_0'?); "
        "allowed: robot_0, workstation"]),
    "a robot called like another host": (
        "fleet: {start: {poses: [{x: 1 m, y: 1 m, name: workstation}]}}", [
            "2:16: fleet.start: a robot is called 'workstation', which is the name of another host "
            "in a testbed"]),
    "a channel that no radio has": (
        "network: {media: {air: {model: radio, channels: {robot_0: -5, workstation: 9999}}}}", [
            "2:59: network.media.air.channels.robot_0: must be at least 1, got -5",
            "2:76: network.media.air.channels.workstation: must be at most 196, got 9999"]),
    "nothing goes at once": (
        "network: {media: {air: {model: ideal, rules: [\n"
        "{rule: bandwidth, rate: 1 Mb/s, burst: 0 B}]}}}", [
            "3:40: network.media.air.rules.0.burst: must be at least 1 B, got '0 B'"]),
    "unknown rule and parameter of a rule": (
        "network: {media: {lan: {model: ideal, rules: [{rule: rang}, {rule: range, dist: 3 m}]}}}",
        ["2:54: network.media.lan.rules.0.rule: unknown rule 'rang' (did you mean 'range'?); "
         f"known: {RULES}, {DOTTED}",
         "2:75: network.media.lan.rules.1.dist: unknown key (did you mean 'distance'?); allowed: "
         "rule, distance, hosts, links, topics, from, until, every"]),
    "a rule that is no mapping, and one without its name": (
        "network: {media: {lan: {model: ideal, rules: [3, {distance: 3 m}]}}}", [
            "2:47: network.media.lan.rules.0: must be a mapping with rule, got 3",
            "2:50: network.media.lan.rules.1: the key 'rule' is missing: a rule plug-in: "
            "range, latency, loss, bandwidth, partition, ..."]),
    "rules that cannot be": (
        "network: {media: {lan: {model: ideal, rules: [\n"
        "{rule: partition, groups: [[robot_0]], from: 5 s, until: 2 s},\n"
        "{rule: outage, hosts: [robot_0], until: 5 s, every: 5 s},\n"
        "{rule: outage, hosts: [robot_0], every: 5 s},\n"
        "{rule: outage, from: 5 s},\n"
        "{rule: flapping, links: [[robot_0]], up: 5 s, down: 1 us},\n"
        "{rule: jamming, at: [0 m, 0 m], radius: 0 m},\n"
        "{rule: gilbert_elliott, p: 0, r: 0 %},\n"
        "{rule: latency, delay: 0 s, jitter: 1 ms, distribution: gamma},\n"
        "{rule: latency, delay: 1 s, distribution: weibull},\n"
        "{rule: reordering, probability: 110 %, delay: 0 s}]}}}", [
            "3:1: network.media.lan.rules.0: until must be later than from, got 5 s to 2 s",
            "4:1: network.media.lan.rules.1: every must be longer than what lies between from and "
            "until, 5 s, got 5 s",
            "5:1: network.media.lan.rules.2: what happens every so often needs until",
            "6:1: network.media.lan.rules.3: hosts or links must be given",
            "7:26: network.media.lan.rules.4.links.0: must be a list of 2, got a list of 1",
            "7:53: network.media.lan.rules.4.down: '1 us' is too small; at least 1 ms",
            "8:41: network.media.lan.rules.5.radius: must be above 0 m, got '0 m'",
            "9:1: network.media.lan.rules.6: p or r must be above zero",
            "10:1: network.media.lan.rules.7: gamma needs a delay above zero",
            "11:43: network.media.lan.rules.8.distribution: 'weibull' is not allowed; allowed: "
            "uniform, normal, exponential, gamma, pareto",
            "12:33: network.media.lan.rules.9.probability: '110 %' is too large; at most 100 %",
            "12:47: network.media.lan.rules.9.delay: '0 s' must be above zero"]),
    "fidelity of a wire": ("network: {fidelity: disk}", [
        "2:21: network.fidelity: no medium has one to choose: lan is a switch; allowed with a "
        "model that has a parameter fidelity, as radio has"]),
    "fidelity of other models": (
        "network: {fidelity: mac, media: {air: {model: disk}, lan: {model: link}}}", [
            "2:21: network.fidelity: no medium has one to choose: air is a disk, lan is a link; "
            "allowed with a model that has a parameter fidelity, as radio has"]),
    "unknown card": ("deployment: field\nnetwork: {media: {air: {card: pi4}}}", [
        "3:31: network.media.air.card: 'pi4' is not allowed (did you mean 'pi_4'?); allowed: pi_4, "
        "intel_8265, intel_ax200, 11g_2008, esp_now"]),
    "unknown fidelity": ("deployment: field\nnetwork: {fidelity: wall}", [
        "3:21: network.fidelity: 'wall' is not allowed (did you mean 'walls'?); allowed: ideal, "
        "disk, walls, mac, multihop"]),
    "fidelity of an unknown model": ("network: {fidelity: mac, media: {air: {model: radoi}}}", [
        "2:47: network.media.air.model: unknown network 'radoi' (did you mean 'radio'?); known: "
        f"{NETWORKS}, {DOTTED}"]),
    "unknown strategy": ("coordination: {strategy: nearest_frontiers}", [
        "2:26: coordination.strategy: unknown strategy 'nearest_frontiers' (did you mean "
        f"'nearest_frontier'?); known: {STRATEGIES}, {DOTTED}"]),
    "unknown computers": ("computers: tabel", [
        "2:12: computers.model: unknown computers 'tabel' (did you mean 'table'?); known: "
        f"{COMPUTERS}, {DOTTED}"]),
    "wrong costs": (
        "computers: {model: table, callbacks: {slam: {odom: {fixed: 1, per: {beam: 1 us}}}},\n"
        "            send: {bytes: 1 ns}}", [
            "2:60: computers.callbacks.slam.odom.fixed: 1 has no unit; allowed: ms, us, ns, ps, s, "
            "µs, e.g. '0.4 ns'",
            "2:75: computers.callbacks.slam.odom.per.beam: no quantity of work (did you mean "
            "'beams'?); allowed: bytes, scans, beams, particles, cells, candidates, plans",
            "3:20: computers.send.bytes: unknown key (did you mean 'byte'?); allowed: message, "
            "byte, link, link_byte"]),
    "costs where there are none": ("computers: {model: ideal, send: {link: 1 us}}", [
        "2:27: computers.send: unknown key; allowed: model"]),
    "a computer that cannot be": (
        "robot: {computer: {processors: 0, speed: 0, scheduling: edf, priorities: {slam: 0.5}}}\n"
        "hosts: {base: {computer: {cores: 2}}}", [
            "2:32: robot.computer.processors: must be at least 1, got 0",
            "2:42: robot.computer.speed: must be above 0, got 0",
            "2:57: robot.computer.scheduling: 'edf' is not allowed; allowed: processor_sharing, "
            "fixed_priority, fifo",
            "2:81: robot.computer.priorities.slam: must be a whole number, got 0.5",
            "3:27: hosts.base.computer.cores: unknown key; allowed: processors, speed, "
            "scheduling, priorities, memory, respawn_delay"]),
    "memory that cannot be": (
        "robot: {computer: {memory: 0 B, respawn_delay: 0 s}}\n"
        "computers: {model: table, memory: {processes: {slam: {per: {patch: 16 kB}}}}}", [
            "2:28: robot.computer.memory: must be above 0 B, got '0 B'",
            "2:48: robot.computer.respawn_delay: '0 s' must be above zero",
            "3:68: computers.memory.processes.slam.per.patch: no quantity that nodes keep (did "
            "you mean 'patches'?); allowed: bytes, cells, patches, scans"]),
    "unknown middleware": ("middleware: {model: ros}", [
        "2:21: middleware.model: unknown middleware 'ros' (did you mean 'ros1'?); known: dds, "
        f"direct, multimaster, ros1, zenoh, {DOTTED}"]),
    "times of TCP": (
        "middleware: {model: ros1, tcp: {constants: {keepalive_interval: 1 ns,\n"
        "retries: 256, window: 1 kB, buffer: 0 B}}}", [
            "2:65: middleware.tcp.constants.keepalive_interval: '1 ns' is too small; at least 1 ms",
            "3:10: middleware.tcp.constants.retries: must be at most 255, got 256",
            "3:23: middleware.tcp.constants.window: must be at least 2896 B, got '1 kB'",
            "3:37: middleware.tcp.constants.buffer: must be at least 1 B, got '0 B'"]),
    "a constant beside the keys, and one misspelt": (
        "middleware: {model: ros1, workers: 4, tcp: {rto_min: 1 s}, constants: {worker: 4}}", [
            "2:27: middleware.workers: unknown key: it is one of the constants, so write "
            "constants: {workers: ...}",
            "2:45: middleware.tcp.rto_min: unknown key: it is one of the constants, so write "
            "constants: {rto_min: ...}",
            "2:72: middleware.constants.worker: unknown key (did you mean 'workers'?); allowed: "
            "master_retry, reconnect_first, reconnect_most, connect_timeout, poll, parameters, "
            "start, workers, worker_poll, local_call"]),
    "timeouts of TCP out of order": (
        "middleware: {model: zenoh, tcp: {constants: {rto_min: 200 s}}}", [
            "2:45: middleware.tcp.constants: rto_min must not be above rto_max, got 200 s and "
            "120 s"]),
    "retries of ROS 1": (
        "middleware: {model: ros1, constants: {master_retry: 1 ns, reconnect_first: 0 s}}", [
        "2:53: middleware.constants.master_retry: '1 ns' is too small; at least 1 ms",
        "2:76: middleware.constants.reconnect_first: '0 s' must be above zero"]),
    "retries of ROS 1 out of order": (
        "middleware: {model: ros1, client: rospy, constants: {reconnect_most: 100 ms}}", [
            "2:53: middleware.constants: reconnect_first must not be above reconnect_most, got 1 s "
            "and 0.1 s"]),
    "a patience without end": (
        "middleware: {model: multimaster, constants: {timeout_factor: 1e300,\n"
        "measurement_intervals: 10000000}}",
        ["2:62: middleware.constants.timeout_factor: must be at most 1e+06, got 1e+300",
         "3:24: middleware.constants.measurement_intervals: must be at most 1000000, got "
         "10000000"]),
    "masters that nobody hears": ("middleware: {model: multimaster, multicast: false}", [
        "2:13: middleware: nobody is found with multicast: false and no robot_hosts; name hosts, "
        "or take multicast: true"]),
    "batches of nothing": (
        "middleware: {model: zenoh, lease: 1 ns,\n"
        "constants: {batch: 0 B, scout_first: 1 us, retry_first: 0 s}}",
        ["2:35: middleware.lease: '1 ns' is too small; at least 1 ms",
         "3:20: middleware.constants.batch: must be at least 64 B, got '0 B'",
         "3:38: middleware.constants.scout_first: '1 us' is too small; at least 1 ms",
         "3:57: middleware.constants.retry_first: '0 s' must be above zero"]),
    "too many keepalives": (
        "middleware: {model: zenoh, keep_alive: 1000000000000}", [
            "2:13: middleware: lease / keep_alive must be at least 1 ms, got 60 s / "
            "1000000000000"]),
    "scouts out of order": ("middleware: {model: zenoh, constants: {scout_last: 100 ms}}", [
        "2:39: middleware.constants: scout_first must not be above scout_last, got 1 s and 0.1 s"]),
    "unknown world": ("physics: {model: plan}", [
        f"2:18: physics.model: unknown world 'plan' (did you mean 'plane'?); known: plane, {DOTTED}"
    ]),
    "dotted path that leads nowhere": ("network: {media: {lan: {model: 'nowhere.at:All'}}}", [
        "2:32: network.media.lan.model: cannot load network 'nowhere.at:All': No module named "
        "'nowhere'; looked beside the file that names it, where Python finds modules, and in the "
        "current directory"]),
    "dotted path to something else": ("network: {media: {lan: {model: 'fractions:Fraction'}}}", [
        "2:32: network.media.lan.model: the network 'fractions:Fraction' has no start(), send(): "
        f"{WANTED}NetworkModel"]),
    "plug-in of another kind": ("coordination: {strategy: 'netmodels.access_link:AccessLink'}", [
        "2:26: coordination.strategy: the strategy 'netmodels.access_link:AccessLink' has no "
        "choose(): "
        f"{WANTED}Strategy"]),
    "contract in place of a world": ("physics: {model: 'desim.ports:World'}", [
        "2:18: physics.model: the world 'desim.ports:World' has no build(), advance(), body(), "
        "grid(), ground(), travelled_m(), command(), snapshot(), snapshot_at(), scan(), "
        f"odometry(), contacts(), obstacles(): {WANTED}World"]),
    "unknown type of robot": ("fleet: {robots: [{type: pioner3dx, count: 2}]}", [
        "2:25: fleet.robots.0.type: unknown type 'pioner3dx' (did you mean 'pioneer3dx'?); "
        "allowed: pioneer3dx, holonomic, "
        "turtlebot3_burger, turtlebot3_waffle, turtlebot4, husky, jackal"]),
    "unknown key of a type's laser": (
        "fleet: {robots: scout, types: {scout: {robot: {laser: {range: 5 m}}}}}", [
            "2:56: fleet.types.scout.robot.laser.range: unknown key (did you mean 'max_range'?); "
            "allowed: beams, field_of_view, max_range, height, rate, noise, pose, x, y, yaw"]),
    "unknown laser of a type": ("fleet: {types: {scout: {robot: {laser: lms50}}}}", [
        "2:40: fleet.types.scout.robot.laser: unknown laser 'lms50' (did you mean 'lms500'?); "
        "allowed: lms500, lds01, rplidar_a1, lms111, or its parameters"]),
    "laser beside lasers": ("robot: {laser: lms500, lasers: {low: lms500}}", [
        "2:16: robot.laser: must be null, or left out, beside lasers"]),
    "no laser": ("robot: {laser: null}", [
        "2:16: robot.laser: null is allowed beside lasers alone: a robot has at least one"]),
    "no lasers": ("robot: {lasers: {}}", [
        "2:17: robot.lasers: must be one laser at least, or left out beside laser, the only one"]),
    "a laser faster than the world": ("robot: {laser: {rate: 1 kHz}}", [
        "2:23: robot.laser.rate: must be at most that of physics, 60 Hz, got 1 kHz: scans see "
        "the pose of the last tick; allowed with pose: interpolated"]),
    "a world slower than its lasers": (
        "physics: {rate: 20 Hz}\nrobot: {laser: {pose: interpolated}}\nfleet: {types: {"
        "a: {robot: {laser: {rate: 50 Hz}}}, b: {robot: {laser: lms500}},"
        " c: {robot: {lasers: {low: {}, high: {pose: interpolated}}}}, d: {robot: {}}}}", [
            f"4:{column}: fleet.types.{laser}.rate: must be at most that of physics, 20 Hz, got "
            "25 Hz: scans see the pose of the last tick; allowed with pose: interpolated"
            for column, laser in ((65, "b.robot.laser"), (103, "c.robot.lasers.low"))]),
    "an odometer and sonars faster than the world": (
        "physics: {rate: 30 Hz}\nrobot: {sonar: {}, odometry: {rate: 31 Hz}}\nfleet: {types: {"
        "a: {robot: {sonar: {rate: 40 Hz}}}, b: {robot: {odometry: {position_noise: 1 cm}}}}}", [
            "3:37: robot.odometry.rate: must be at most that of physics, 30 Hz, got 31 Hz: it "
            "measures at the pose of the last tick",
            "4:43: fleet.types.a.robot.sonar.rate: must be at most that of physics, 30 Hz, got "
            "40 Hz: it measures at the pose of the last tick"]),
    "unknown one of several lasers": ("robot: {lasers: {low: lms50}}", [
        "2:23: robot.lasers.low: unknown laser 'lms50' (did you mean 'lms500'?); allowed: lms500, "
        "lds01, rplidar_a1, lms111, or its parameters"]),
    "two lasers of one name": ("robot: {lasers: {low: lms500, low: lms500}}", [
        "2:31: the key 'low' stands here a second time, first in line 2"]),
    "laser without a beam": ("robot: {lasers: {low: {beams: 0}}}", [
        "2:31: robot.lasers.low.beams: must be at least 2, got 0"]),
    "laser beside the body": ("robot: {lasers: {low: {x: 0.3 m, y: 0.4 m}}}", [
        "2:23: robot.lasers.low: is mounted 0.5 m from the middle of a pioneer3dx, whose radius is "
        "0.26 m; allowed: on the body"]),
    "sonar beside the body": ("robot: {sonar: {transducers: [[1 m, 0 m, 0 deg]]}}", [
        "2:16: robot.sonar: transducer 0 is not on the body of a pioneer3dx, whose radius is "
        "0.26 m; allowed: on the body"]),
    "sonar without transducers": ("robot: {sonar: {transducers: []}}", [
        "2:30: robot.sonar.transducers: must be a list of at least 1, got a list of 0"]),
    "laser turned too often": ("robot: {laser: {yaw: 400 deg}}", [
        "2:22: robot.laser.yaw: must be at most 360 deg, got 400 deg"]),
    "more than a full turn": ("robot: {lasers: {low: {field_of_view: 361 deg}}}", [
        "2:39: robot.lasers.low.field_of_view: must be at most 360 deg, got 361 deg"]),
    "maps of two resolutions": (
        "fleet: {types: {scout: {robot: {mapping: {resolution: 0.1 m}}}}}", [
            "2:55: fleet.types.scout.robot.mapping.resolution: must be that of the fleet, 0.2 m, "
            "got 0.1 m: robots share their maps"]),
    "maps of two sizes in messages": (
        "robot: {mapping: {published_size: [160 m, 160 m]}}\n"
        "fleet: {types: {scout: {robot: {mapping: {published_size: null}}}}}", [
            "3:59: fleet.types.scout.robot.mapping.published_size: must be that of the fleet, "
            "[160 m, 160 m], got null: robots share their maps"]),
    "unknown parameter of a type's strategy": (
        "fleet: {types: {scout: {strategy: {strategy: nearest_frontier, k: 1}}}}", [
            "2:64: fleet.types.scout.strategy.k: unknown key; allowed: strategy"]),
    "a type without software": ("fleet: {types: {scout: {robot: {passive: [robot_0]}}}}", [
        "2:33: fleet.types.scout.robot.passive: unknown key; allowed: localization, laser, lasers, "
        "sonar, bumper, antenna, computer, clock, power, odometry, mapping, navigation, "
        "exploration, publishes"]),
    "an aerial type on the ground": ("fleet: {types: {drone: {drive: aerial}}}", [
        "2:17: fleet.types.drone.altitude: must be above 0 m with drive: aerial, and 0 m with any "
        "other, got 0 m with drive: aerial"]),
    "a type of the ground in the air": ("fleet: {types: {rover: {altitude: 1 m}}}", [
        "2:35: fleet.types.rover.altitude: must be above 0 m with drive: aerial, and 0 m with any "
        "other, got 1 m with drive: differential"]),
    "a body above itself": ("fleet: {types: {rover: {clearance: 0.3 m}}}", [
        "2:36: fleet.types.rover.clearance: must be below the top of the body, its height, 0.24 m, "
        "got 0.3 m"]),
    "size against groups": ("fleet: {size: 3, robots: [{type: pioneer3dx, count: 2}]}", [
        "2:15: fleet.size: must be the sum of the groups' counts, 2, got 3"]),
    "size against poses": ("fleet: {size: 2, start: {poses: [{x: 1 m, y: 1 m}]}}", [
        "2:33: fleet.start.poses: must be as many as there are robots, 2, got 1; for any number of "
        "robots let fleet.start be {from: [x, y], step: [dx, dy]}"]),
    "one pose with a name": (
        "fleet: {start: {poses: [{x: 1 m, y: 1 m, name: a}, {x: 2 m, y: 1 m}]}}", [
            "2:52: fleet.start.poses.1: the key 'name' is missing; all poses have one or none"]),
    "two robots of one name": (
        "fleet: {start: {poses: [{x: 1 m, y: 1 m, name: a}, {x: 2 m, y: 1 m, name: a}]}}", [
            "2:75: fleet.start.poses.1.name: 'a' is the name of another robot"]),
    "missing file of starts": ("fleet: {start: {file: no.csv}}", [
        "2:23: fleet.start.file: no.csv: cannot be read: No such file or directory"]),
    "unknown laser": ("robot: {laser: lms50}", [
        "2:16: robot.laser: unknown laser 'lms50' (did you mean 'lms500'?); allowed: lms500, "
        "lds01, rplidar_a1, lms111, or its parameters"]),
    "fault on an unknown host": ("fleet: {size: 3}\nfaults: [{at: 5 s, host: robot_30}]", [
        "3:26: faults.0.host: unknown host 'robot_30' (did you mean 'robot_0'?); allowed: robot_0, "
        "robot_1, robot_2, workstation"]),
    "two faults at once": (
        "faults: [{at: 5 s, host: robot_0}, {at: 5 s, host: robot_0, down_for: 1 s}]", [
            "2:36: faults.1: robot_0 is to stop at 5 s, but faults.0 has stopped it at 5 s for "
            "good; allowed: one after the other"]),
    "a host that is stuck": ("faults: [{kind: stuck, at: 5 s, host: workstation}]", [
        "2:39: faults.0.host: unknown robot 'workstation'; allowed: robot_0"]),
    "stuck twice at once": (
        "faults: [{kind: stuck, at: 5 s, host: robot_0, down_for: 9 s}, {at: 6 s, host: robot_0}, "
        "{kind: stuck, at: 8 s, host: robot_0}]", [
            "2:90: faults.2: robot_0 is to be stuck at 8 s, but faults.0 holds it at 5 s until "
            "14 s; allowed: one after the other"]),
    "no software and no host": (
        "faults: [{kind: software, at: 5 s, host: robot_0}, {at: 6 s, host: robot_0}]", [
            "2:52: faults.1: robot_0 is to stop at 6 s, but faults.0 has stopped it at 5 s for "
            "good; allowed: one after the other"]),
    "overlapping faults": (
        "faults: [{at: 9 s, host: robot_0}, {at: 5 s, host: robot_0, down_for: 4 s}, "
        "{at: 6 s, host: workstation}]", [
            "2:10: faults.0: robot_0 is to stop at 9 s, but faults.1 has stopped it at 5 s until "
            "9 s; allowed: one after the other"]),
    "nothing to explore": ("stop: {explored: 0 %}", [
        "2:18: stop.explored: must be above 0, got '0 %'"]),
    "a seed of more than 63 bits": ("seed: 9223372036854775808", [
        "2:7: seed: must be at most 9223372036854775807, got 9223372036854775808"]),
    "too many robots": ("fleet: {size: 1001}", ["2:15: fleet.size: must be at most 1000, got 1001"
                                                ]),
    "too many robots together": (
        "fleet: {robots: [{type: holonomic, count: 999}, {type: pioneer3dx, count: 2}]}", [
            "2:17: fleet.robots: must be at most 1000 robots together, got 1001"]),
    "too many beams": ("robot: {laser: {beams: 100001}}", [
        "2:24: robot.laser.beams: must be at most 100000, got 100001"]),
    "too fast a laser": ("robot: {laser: {rate: 11 kHz}}", [
        "2:23: robot.laser.rate: '11 kHz' is too large; at most 10 kHz"]),
    "too fast a world": ("physics: {rate: 1e6 Hz}", [
        "2:17: physics.rate: '1e6 Hz' is too large; at most 10 kHz"]),
    "too many samples": ("measure: {every: 1 ns}", [
        "2:18: measure.every: '1 ns' is too small; at least 1 ms"]),
    "a period without a unit": ("measure: {periods: {ghosts: 1}}", [
        "2:29: measure.periods.ghosts: 1 has no unit; allowed: s, ms, us, ns, min, h, µs, e.g. "
        "'5 s'"]),
    "periods of what is not measured": (
        "measure: {periods: {cpu_percnt: 1 s, robots: 1500 ms}}", [
            "2:33: measure.periods.cpu_percnt: unknown measurement 'cpu_percnt' (did you mean "
            "'cpu_percent'?); allowed: explored, explored_union, explored_all, collisions, "
            "recoveries, messages_sent, messages_delivered, messages_dropped, bytes_on_air, "
            "distance_m, partitions, robots_moving, energy_j, cpu_s, missed_ticks, ram_mb, "
            "memory_kills, max_cpu_percent, max_ram_percent, parts, map_age_s, stale_age_s, "
            "registry_divergence, ghosts, matched_pairs, cpu_percent, node_cpu_percent, "
            "ram_percent, rx_kBps, tx_kBps, bytes_per_s, robots",
            "2:46: measure.periods.robots: must be whole seconds, got 1.5 s"]),
    "too many maps": (
        "coordination: {exchange: {period: 999 us}}\ntestbed: {monitor_period: 1 us}", [
            "2:35: coordination.exchange.period: '999 us' is too small; at least 1 ms",
            "3:27: testbed.monitor_period: '1 us' is too small; at least 1 ms"]),
    "too fine a local window": ("robot: {navigation: {local_resolution: 1 mm}}", [
        "2:40: robot.navigation.local_resolution: makes the local window 6000 cells wide; allowed: "
        "1000"]),
    "unknown passive robot": ("robot: {passive: [r2d2]}", [
        "2:19: robot.passive.0: unknown robot 'r2d2'; allowed: robot_0"]),
    "unknown time server": ("robot: {clock: {ntp: {server: bas}}}\nhosts: {base: {}}", [
        "2:31: robot.clock.ntp.server: unknown host 'bas' (did you mean 'base'?); allowed: base, "
        "robot_0, workstation"]),
    "time servers that follow themselves": (
        "testbed: {clock: {ntp: {server: workstation}}}\nhosts: {base: {clock: {ntp: {server: base}"
        "}}}\nrobot: {clock: {ntp: {server: robot_0}}}", [
            "2:33: testbed.clock.ntp.server: 'workstation' is the host itself; allowed: another "
            "one",
            "3:38: hosts.base.clock.ntp.server: 'base' is the host itself; allowed: another one"]),
    "a time server that no frame can reach": (
        "robot: {clock: {ntp: {server: office}}}\nhosts: {base: {}, office: {}}\n"
        "fleet: {size: 2}\ndeployment: field\n"
        "network: {media: {air: {model: radio, hosts: [robot_0, robot_1, base]}, lan: {model: "
        "switch, hosts: [base, office]}}}", [
            "2:31: robot.clock.ntp.server: robot_0 and office have no medium in common "
            "(network.media.*.hosts), and no hosts forward from one to the other; allowed: a host "
            "that robot_0 can reach"]),
    "time servers in a circle": (
        "testbed: {clock: {ntp: {server: robot_0}}}\n"
        "robot: {clock: {ntp: {server: workstation}}}\nfleet: {size: 3}", [
            "3:31: robot.clock.ntp.server: a circle: robot_0 -> workstation -> robot_0; allowed: "
            "one of them without ntp, or with a server outside of it"]),
    "time servers in a circle of hosts": (
        "hosts: {base: {clock: {ntp: {server: office}}}, office: {clock: {ntp: {server: base}}}}", [
            "2:38: hosts.base.clock.ntp.server: a circle: base -> office -> base; allowed: one of "
            "them without ntp, or with a server outside of it"]),
    "two types of robots that follow each other": (
        "robot: {clock: {ntp: {server: robot_2}}}\nhosts: {base: {clock: {ntp: {server: robot_1}"
        "}}}\nfleet: {types: {scout: {robot: {clock: {ntp: {server: robot_0}}}}}, robots: "
        "[{type: pioneer3dx, count: 2}, {type: scout, count: 1}]}", [
            "2:31: robot.clock.ntp.server: a circle: robot_0 -> robot_2 -> robot_0; allowed: one "
            "of them without ntp, or with a server outside of it"]),
    "clocks that are ahead and behind": (
        "robot: {clock: {ahead: 1 s}}\n"
        "fleet: {types: {late: {robot: {clock: {behind: 20 ms}}}}}\n"
        "hosts: {base: {clock: {ahead: 1 s, behind: 1 s}}}", [
            "3:39: fleet.types.late.robot.clock: must be ahead or behind, not both, got 1 s ahead "
            "and 20 ms behind",
            "4:23: hosts.base.clock: must be ahead or behind, not both, got 1 s ahead and 1 s "
            "behind"]),
    "host with a robot's name": ("hosts: {robot_0: {}}", [
        "2:18: hosts.robot_0: 'robot_0' is the name of another host"]),
    "power without a unit": ("robot: {power: {base: {idle: 3}}}", [
        "2:30: robot.power.base.idle: 3 has no unit; allowed: W, mW, kW, e.g. '22 W'"]),
    "a part that draws nothing here": ("robot: {power: {motors: 3 W}}", [
        "2:17: robot.power.motors: unknown key; allowed: base, sensors, computer, radio, battery"]),
    "an empty battery": ("robot: {power: {battery: 0 Wh}}", [
        "2:26: robot.power.battery: '0 Wh' must be above zero"]),
    "a radio that draws less when it receives": (
        "robot: {power: {radio: {receive: 0.5 W}}}\n"
        "fleet: {types: {idler: {robot: {power: {radio: {idle: 1 W}}}}}}", [
            "2:34: robot.power.radio.receive: must be at least that of an idle radio, which "
            "listens, too: 0.82 W, got 0.5 W",
            "3:41: fleet.types.idler.robot.power.radio.receive: must be at least that of an idle "
            "radio, which listens, too: 1 W, got 0.5 W"]),
    "energy that nobody measures": (
        "measure: {cost: energy_j, when: [energy_j > 5 or explored > 0.5]}\n"
        "stop: {when: energy_j > 9}", [
            *(f"{place}: energy_j is measured where robot.power says what robots draw, e.g. {{}} "
              "(a Pioneer 3-DX)" for place in (
                  "2:17: measure.cost", "2:34: measure.when.0", "3:14: stop.when"))]),
    "energy of a type that is not used": (
        "fleet: {types: {other: {robot: {power: {}}}}}\nmeasure: {cost: energy_j}", [
            "3:17: measure.cost: energy_j is measured where robot.power says what robots draw, "
            "e.g. {} (a Pioneer 3-DX)"]),
    "work of ideal computers": ("measure: {when: [missed_ticks > 5, explored > cpu_s]}", [
        *(f"2:{column}: measure.when.{i}: {name} is measured where computers get busy, e.g. "
          "computers: measured" for i, (column, name) in enumerate(
              [(18, "missed_ticks"), (36, "cpu_s")]))]),
    "a load over no time": ("computers: measured\nmeasure: {when: [cpu_percent > 90]}", [
        "3:18: measure.when.0: unknown quantity 'cpu_percent' (did you mean 'max_cpu_percent'?); "
        "allowed: time_s, explored, explored_union, explored_all, collisions, recoveries, "
        "messages_sent, messages_delivered, messages_dropped, bytes_on_air, distance_m, "
        "partitions, robots_moving, cpu_s, missed_ticks, ram_mb, memory_kills, max_cpu_percent, "
        "max_ram_percent"]),
    "computers that are none": ("computers: 5\nmeasure: {when: [cpu_s > 1]}", [
        "2:12: computers: must be a plug-in's name, or a mapping with model, got 5"]),
    "a cost that is no number": ("measure: {cost: explored > 1}", [
        "2:17: measure.cost: 'explored > 1' is a condition where a number is needed, e.g. "
        "'distance_m'"]),
    "a trigger that is no condition": ("measure: {when: [explored]}", [
        "2:18: measure.when.0: 'explored' is a number, not a condition; compare it with something, "
        "e.g. 'explored > 0.9'"]),
    "a trigger that is a function": ("measure: {when: ['module:function']}", [
        f"2:18: measure.when.0: 'module:function' is not an expression; {GRAMMAR}"]),
    "unknown quantity": ("stop: {when: explord > 0.9}", [
        "2:14: stop.when: unknown quantity 'explord' (did you mean 'explored'?); allowed: time_s, "
        "explored, explored_union, explored_all, collisions, recoveries, messages_sent, "
        "messages_delivered, messages_dropped, bytes_on_air, distance_m, partitions, "
        "robots_moving"]),
    "half an expression": ("stop: {when: explored >}", [
        f"2:14: stop.when: 'explored >' is not an expression; {GRAMMAR}"]),
    "code": ("stop: {when: '__import__(\"os\")'}", [
        "2:14: stop.when: '__import__(\"os\")' is not allowed in an expression; " + GRAMMAR]),
    "no condition": ("stop: {when: explored}", [
        "2:14: stop.when: 'explored' is a number, not a condition; compare it with something, e.g. "
        "'explored > 0.9'"]),
    "duplicate key": ("seed: 1\nseed: 2", [
        "3:1: the key 'seed' stands here a second time, first in line 2"]),
    "tab": ("fleet:\n\tsize: 1", ["3:1: not YAML: a tab; indent with spaces"]),
    "number as a key": ("5: 3", ["2:1: the key '5' must be text"]),
    "two documents": ("---\nname: y", [
        "2:1: not YAML: expected a single document in the stream, but found another document"]),
    "python object": ("seed: !!python/name:os.system x", [
        "2:7: the tag 'tag:yaml.org,2002:python/name:os.system' is not allowed for 'x'"]),
    "circular alias": ("faults: &a [*a]", [
        "2:9: an alias that contains itself"]),
    "extends no file": ("extends: 5", ["2:10: extends: must be the path of a file, got 5"]),
    "missing parent": ("extends: ../no.yaml", ["2:10: extends: no such file: ../no.yaml"]),
    "extends itself": ("extends: case.yaml", [
        "2:10: extends: a circle: case.yaml -> case.yaml"]),
    "all at once, in the order of the file": (
        "stop: {elapsed: 5, when: explord > 1}\nseed: -1\nnetwork: {media: {lan: {model: swich}}}\n"
        "environment: {terrain: no.yaml}", [
            f"2:17: stop.elapsed: 5 has no unit; {TIMES} '5 s'",
            "2:26: stop.when: unknown quantity 'explord' (did you mean 'explored'?); allowed: "
            "time_s, explored, explored_union, explored_all, collisions, recoveries, "
            "messages_sent, messages_delivered, messages_dropped, bytes_on_air, distance_m, "
            "partitions, robots_moving",
            "3:7: seed: must be at least 0, got -1",
            "4:32: network.media.lan.model: unknown network 'swich' (did you mean 'switch'?); "
            f"known: {NETWORKS}, {DOTTED}",
            "5:24: environment.terrain: no such map: no.yaml"]),
}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def complaints_about(source, *overrides):
    with pytest.raises(InputError) as caught:
        load(source, overrides)
    return list(caught.value.args)


@pytest.mark.parametrize("case", WRONG)
def test_wrong_scenario(here, case):
    text, complaints = WRONG[case]
    (here / "case.yaml").write_text(f"name: x\n{text}\n")
    assert complaints_about("case.yaml") == [f"case.yaml:{line}" for line in complaints]


@pytest.mark.parametrize("content, complaint", [
    (b"", "case.yaml: is empty; a scenario is a mapping, e.g. 'name: hello'"),
    (b"# nothing\n", "case.yaml: is empty; a scenario is a mapping, e.g. 'name: hello'"),
    (b"- a\n", "case.yaml:1:1: is a list; a scenario is a mapping, e.g. 'name: hello'"),
    (b"hello\n", "case.yaml:1:1: is a single value; a scenario is a mapping, e.g. 'name: hello'"),
    (b"\x7fELF\xff\xfe", "case.yaml: not a text file (UTF-8)"),
    (b"name: \x00\n", "case.yaml: not YAML: special characters are not allowed"),
    (b"name: [\n", "case.yaml:2:1: not YAML: expected the node content, but found '<stream end>'"),
    (b"name: " + b"[" * 5000, "case.yaml: nested too deeply; at most 100 lists and "
                               "mappings"),
    (b"seed: 1\n", "case.yaml:1:1: the key 'name' is missing: of the run; its results are in "
                    "results/<name>/<run id>"),
    (b"name: a b\n", "case.yaml:1:7: name: 'a b' is not allowed; allowed: text that matches "
                     "^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"),
])
def test_wrong_file(here, content, complaint):
    (here / "case.yaml").write_bytes(content)
    assert complaints_about("case.yaml") == [complaint]


def test_no_file(here):
    assert complaints_about("no.yaml") == ["no.yaml: no such file"]
    (here / "folder").mkdir()
    assert complaints_about("folder") == ["folder: cannot be read: Is a directory"]


def test_errors_in_a_parent_point_into_the_parent(here):
    (here / "sub").mkdir()
    (here / "base.yaml").write_text("name: x\nstop:\n  elapsed: 5\nfleet: {size: 0}\n")
    (here / "sub" / "child.yaml").write_text("extends: ../base.yaml\nfleet: {size: 2}\nseed: -1\n")
    assert complaints_about("sub/child.yaml") == [
        f"base.yaml:3:12: stop.elapsed: 5 has no unit; {TIMES} '5 s'",
        "sub/child.yaml:3:7: seed: must be at least 0, got -1"]


def test_a_file_of_another_program_is_named_with_the_command_that_reads_it(here):
    (here / "plan.dxf").write_text("0\nSECTION\n")
    (here / "case.yaml").write_text("name: x\nenvironment: {terrain: plan.dxf}\n")
    assert complaints_about("case.yaml") == [
        "case.yaml:2:24: environment.terrain: plan.dxf: no map_server file; it looks like a DXF "
        "drawing, which desim map reads"]


def test_a_circle_is_named(here):
    for name, parent in (("a", "b"), ("b", "c"), ("c", "b")):
        (here / f"{name}.yaml").write_text(f"extends: {parent}.yaml\n")
    assert complaints_about("a.yaml") == [
        "c.yaml:1:10: extends: a circle: b.yaml -> c.yaml -> b.yaml"]


@pytest.mark.parametrize("override, complaint", [
    ("fleet.size=-1", "fleet.size: must be at least 0, got -1"),
    ("fleet.siz=3", "fleet.siz: unknown key (did you mean 'size'?); allowed: size, robots, types, "
                    "start"),
    ("seed.first=3", "seed: must be a whole number, got a mapping"),
    ("fleet", "must look like a.b.c=value, e.g. fleet.size=8"),
    ("a..b=3", "must look like a.b.c=value, e.g. fleet.size=8"),
    ("fleet.size=[1", "not YAML: expected ',' or ']', but got '<stream end>'"),
    ("faults.3.at=5 s", "faults: is a list of 1; allowed: an index from 0 to 0, not 3"),
    ("faults.0.at=5", f"faults.0.at: 5 has no unit; {TIMES} '20 ms'"),
    ("environment.terrain=no.yaml", "environment.terrain: no such map: no.yaml"),
])
def test_wrong_override(here, override, complaint):
    (here / "case.yaml").write_text("name: x\nfaults: [{at: 1 s, host: robot_0}]\n")
    assert complaints_about("case.yaml", override) == [f"--set {override}: {complaint}"]


LOST = ("what is set after it chooses another plug-in or shape, which takes this away; set this "
        "after that")


@pytest.mark.parametrize("before, after", [
    ("network.media.air.range=20 m", "network.media.air.model=disk"),
    ("network.media.lan.ports.1=[a, b]", "network.media.lan.model=switch"),
    ("network.media.lan.model=switch", "network.fidelity=mac"),
    ("fleet.start.columns=3", "fleet.start={file: starts.csv}"),
])
def test_an_override_that_a_later_one_takes_away(here, before, after):
    (here / "case.yaml").write_text("name: x\n")
    path = before.partition("=")[0]
    assert complaints_about("case.yaml", before, after) == [f"--set {before}: {path}: {LOST}"]


def test_an_override_that_a_later_one_replaces(here):
    (here / "case.yaml").write_text("name: x\nnetwork: {media: {lan: {model: switch}}}\n")
    loaded = load("case.yaml", ["network.media.lan.model=disk", "network.media.lan.range=9 m",
                                "network.media.lan={model: disk, range: 7 m}"])
    assert loaded.scenario.network.media["lan"].params.range_m == 7.0


def test_a_plug_in_that_keeps_its_contract_in_part(here, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))
    (here / "case.yaml").write_text("name: x\n")
    (here / "in_part.py").write_text(
        "from desim.ports import Strategy, World\n"
        "Half = type('Half', (World,), {name: print for name in vars(World)\n"
        "                               if name[0] != '_' and name != 'build'})\n"
        "class Mute(Strategy):\n    def choose(self, view): return None\n")
    assert complaints_about("case.yaml", "physics.model=in_part:Half") == [
        "--set physics.model=in_part:Half: physics.model: the world 'in_part:Half' has no build(): "
        f"{WANTED}World"]
    assert complaints_about("case.yaml", "coordination.strategy=in_part:Mute") == [
        "--set coordination.strategy=in_part:Mute: coordination.strategy: the strategy "
        "'in_part:Mute' has no class Params, a desim.ports.Params: it needs one, if only "
        "an empty one"]


@pytest.mark.parametrize("data, complaint", [
    ({"name": "x", "seed": -1}, "scenario: seed: must be at least 0, got -1"),
    ({"name": "x", "seed": object}, "scenario: must be made of mappings, lists, text, finite "
     "numbers, true, false and null: Object of type type is not JSON serializable"),
    (["name"], "scenario: must be a mapping"),
])
def test_wrong_mapping(data, complaint):
    with pytest.raises(InputError) as caught:
        from_mapping(data)
    assert list(caught.value.args) == [complaint]


@pytest.mark.parametrize("content, complaint", [
    ("x_m,y_m,heading\n1,2,3\n", "starts.csv:1: unknown column 'heading' (did you mean "
                                 "'heading_rad'?); allowed: x_m, y_m, heading_rad, name"),
    ("x_m,y_m,yaw_rad\n1,2,3\n", "starts.csv:1: unknown column 'yaw_rad'; allowed: x_m, y_m, "
                                 "heading_rad, name"),
    ("x_m\n1\n", "starts.csv:1: the column 'y_m' is missing; there are x_m"),
    ("x_m,y_m\n1,2,3\n", "starts.csv:2: 3 cells; allowed: at most 2, one for each column"),
    ("x_m,y_m\n", "starts.csv: has no poses"),
    ("x_m,y_m\n1,2\n1,nan\n", "starts.csv:3: x_m, y_m and heading_rad must be finite numbers and "
                              "name a name, got 1, nan"),
])
def test_wrong_file_of_starts(here, content, complaint):
    (here / "starts.csv").write_text(content)
    (here / "case.yaml").write_text("name: x\nfleet: {start: {file: starts.csv}}\n")
    assert complaints_about("case.yaml") == [f"case.yaml:2:23: fleet.start.file: {complaint}"]


@pytest.mark.parametrize(("model", "name"), [
    ("ros1", "ROS 1"), ("multimaster", "ROS 1"), ("zenoh", "zenoh")])
def test_who_has_no_broadcast_says_where_it_is_wanted(here, model, name):
    (here / "case.yaml").write_text(
        f"name: x\nfleet: {{size: 1}}\nmiddleware: {{model: {model}}}\n"
        "coordination: {exchange: {via: broadcast}}\n")
    loaded = load("case.yaml")
    with pytest.raises(InputError) as caught:
        Simulation(loaded.scenario).run()
    assert list(loaded.placed(caught.value).args) == [
        f"case.yaml:4:32: coordination.exchange.via: {name} has no broadcast; allowed: unicast"]


def test_what_is_found_later_gets_its_place_too(here):
    (here / "case.yaml").write_text("name: x\nfleet:\n  start:\n    from: [0 m, 0 m]\n")
    loaded = load("case.yaml")
    placed = loaded.placed(InputError("fleet.start: robot_0 stands in a wall", "another: thing"))
    assert list(placed.args) == ["case.yaml:4:5: fleet.start: robot_0 stands in a wall",
                                 "case.yaml: another: thing"]
    assert loaded.where("fleet.start.from.1") == "case.yaml:4:17: fleet.start.from.1"
    assert loaded.where("fleet.size") == "case.yaml:2:1: fleet.size"
