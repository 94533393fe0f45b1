"""Wrong parameters and vectors, and what is said about them: see test_bad_designs."""

P = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\n"

PARAMETERS = {
    "unknown key of a parameter": ("parameters: {robots: {key: fleet.size, "
        "vals: [1]}}",
        "3:40: parameters.robots.vals: unknown key (did you mean 'values'?); allowed: key, "
        "values"),
    "no shape": ("parameters: {robots: 5}",
        "3:22: parameters.robots: must be a mapping with key, values, or a mapping with "
        "levels, or a mapping with key, from, to, step, count, scale, got 5"),
    "unknown path": ("parameters: {robots: {key: fleet.siz, values: [1, 2]}}",
        "3:48: fleet.siz: unknown key (did you mean 'size'?); allowed: size, robots, types, "
        "start"),
    "unknown family": ("parameters: {robots: {key: flet.size, values: [1, 2]}}",
        "3:48: flet: unknown key (did you mean 'fleet'?); allowed: name, seed, deployment, "
        "testbed, physics, environment, fleet, robot, hosts, network, topics, "
        "middleware, computers, coordination, task, faults, loop, stop, measure, trace"),
    "below a number": ("parameters: {robots: {key: fleet.size.x, values: [1, 2]}}",
        "3:51: fleet.size: must be a whole number, got a mapping"),
    "empty key": ("parameters: {robots: {key: '', values: [1, 2]}}",
        "3:41: parameters.robots.values.0: '' is not a key of the scenario, e.g. fleet.size"),
    "wrong value": ("parameters: {robots: {key: fleet.size, values: [1, two]}}",
        "3:52: fleet.size: must be a whole number, got 'two'"),
    "unit missing": ("parameters: {range: {key: robot.laser.max_range, from: "
        "1, to: 5}}",
        "3:21: robot.laser.max_range: 1 has no unit; allowed: m, km, cm, mm, e.g. '200 m'"),
    "empty range": ("parameters: {robots: {key: fleet.size, from: 5, to: 1}}",
        "3:22: parameters.robots: the range from 5 to 1 is empty"),
    "reversed range": ("parameters: {robots: {key: fleet.size, from: 5, to: 1, step: -1}}",
        "3:22: parameters.robots: the range from 5 to 1 is empty"),
    "step negative": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, step: -1}}",
        "3:22: parameters.robots: the step -1 must be above zero"),
    "step without unit": ("parameters: {r: {key: robot.laser.max_range, from: 1 m, to: 5 m, "
        "step: 1}}",
        "3:17: parameters.r: '1 m' and 1 have different units; write them in one"),
    "a range of one value": ("parameters: {robots: {key: fleet.size, from: 2, to: 2, count: 3}}",
        "3:22: parameters.robots: the value 2 stands there twice"),
    "count between": ("parameters: {robots: {key: fleet.size, from: 1, to: 4, count: 3}}",
        "3:22: fleet.size: must be a whole number, got 2.5"),
    "count 1": ("parameters: {robots: {key: fleet.size, from: 1, to: 4, count: 1}}",
        "3:63: parameters.robots.count: must be at least 2, got 1"),
    "no end": ("parameters: {robots: {key: fleet.size, from: 1}}",
        "3:14: parameters.robots: the key 'to' is missing: the last value, in the same unit"),
    "range and values": ("parameters: {robots: {key: fleet.size, from: 1, to: 2, values: [1]}}",
        "3:56: parameters.robots.values: unknown key; allowed: key, from, to, step, count, scale"),
    "one key twice": (P.rstrip("}\n") + "}, n: {key: fleet.size, values: [3]}}",
        "3:60: parameters.n: sets fleet.size, which robots sets, too; one of them is enough"),
    "different units": ("parameters: {robots: {key: robot.laser.max_range, "
        "from: 5 m, to: 100 cm}}",
        "3:22: parameters.robots: '5 m' and '100 cm' have different units; write them in one"),
    "no number": ("parameters: {robots: {key: fleet.size, from: one, to: 5}}",
        "3:22: parameters.robots: 'one' is not a number, e.g. 8 or '10 Mb/s'"),
    "step zero": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: 0}}",
        "3:22: parameters.robots: the step 0 must be above zero"),
    "step text": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: x}}",
        "3:22: parameters.robots: 'x' is not a number, e.g. 8 or '10 Mb/s'"),
    "step and count": ("parameters: {robots: {key: fleet.size, from: 1, to: "
        "5, step: 1, count: 3}}",
        "3:22: parameters.robots: has step and count; one of them is enough"),
    "log from zero": ("parameters: {robots: {key: fleet.size, from: 0, to: "
        "5, count: 3, scale: log}}",
        "3:22: parameters.robots: a logarithmic range begins above zero"),
    "log step": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: 2, scale: log}}",
        "3:22: parameters.robots: a logarithmic range has a count, not a step"),
    "scale": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, scale: "
        "lg, count: 2}}",
        "3:63: parameters.robots.scale: 'lg' is not allowed (did you mean 'log'?); allowed: "
        "linear, log"),
    "too many values": ("parameters: {robots: {key: fleet.size, from: 1, to: "
        "1000000000}}",
        "3:22: parameters.robots: has more than 100,000 values"),
    "count huge": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "count: 1000000000}}",
        "3:63: parameters.robots.count: must be at most 10000, got 1000000000"),
    "infinite": ("parameters: {robots: {key: fleet.size, from: 1, to: .inf}}",
        "3:53: .inf is not a finite number"),
    "huge exp": ("parameters: {robots: {key: fleet.size, from: 1 m, to: 1e99 "
        "m, step: 1 m}}",
        "3:22: parameters.robots: has more than 100,000 values"),
    "no values": ("parameters: {robots: {key: fleet.size}}",
        "3:22: parameters.robots: has no values; give it values, a step or a count, or let "
        "the vectors name them"),
    "no values in all": ("parameters: {range: {key: robot.laser.max_range, "
        "from: 1 m, to: 5 m}}",
        "3:21: parameters.range: has no values; give it values, a step or a count, or let the "
        "vectors name them"),
    "twice": ("parameters: {robots: {key: fleet.size, values: [1, 2, 1]}}",
        "3:22: parameters.robots: the value 1 stands there twice"),
    "two levels of one name": ("parameters: {how: {levels: {a: {fleet.size: "
        "1}, a: {fleet.size: 2}}}}",
        "3:49: the key 'a' stands here a second time, first in line 3"),
    "levels empty": ("parameters: {how: {levels: {}}}",
        "3:19: parameters.how: has no levels"),
    "level no mapping": ("parameters: {how: {levels: {a: 5}}}",
        "3:32: parameters.how.levels.a: must be a mapping, got 5"),
    "name": ("parameters: {'my robots': {key: fleet.size, values: [1]}}",
        "3:14: parameters.my robots: 'my robots' is not allowed; allowed: text that matches "
        "^[A-Za-z][A-Za-z0-9_]{0,59}$"),
    "sets nothing": ("parameters: {robots: {values: [1, 2]}}",
        "3:22: parameters.robots: sets nothing: give it a key, or use $robots in set or in "
        "levels"),
    "dollar": (P + "set: {robot.laser.beams: $robts}",
        "4:26: set.robot.laser.beams: there is no parameter 'robts' (did you mean 'robots'?); "
        "allowed: $robots"),
    "fixed column": ("parameters: {seed: {key: fleet.size, values: [1]}}",
        "3:20: parameters.seed: seed is a column of every campaign in runs.parquet, too; "
        "choose another name"),
    "metric column": ("parameters: {explored: {key: fleet.size, values: [1]}}",
        "3:24: parameters.explored: explored is a column of a metric in runs.parquet, too; "
        "choose another name"),
    "two columns": ("parameters: {t: {key: stop.elapsed, values: [1 s]}, "
        "t_s: {key: fleet.size, values: [1]}}",
        "3:58: parameters.t_s: t_s is a column of the parameter t in runs.parquet, too; "
        "choose another name"),
    "metric run_id": ("metrics: {seed: explored / 2}",
        "3:17: metrics.seed: is a column that runs.parquet always has; choose another name"),
    "metric like a parameter": (P + "metrics: {robots: explored / 2}",
        "3:22: parameters.robots: robots is a column of a metric in runs.parquet, too; choose "
        "another name"),
    "seed key": ("parameters: {s: {key: seed, values: [1, 2]}}",
        "3:38: parameters.s.values.0: sets the scenario's seed, which is the design's: see "
        "seed, iterations and random_numbers"),
    "name key": ("set: {name: foo}",
        "3:13: set.name: sets the scenario's name, which is the design's: runs of all vectors "
        "lie in one folder"),
    "vectors word": (P + "vectors: al",
        "4:10: vectors: 'al' is not allowed (did you mean 'all'?); allowed: all, zip, a list "
        "of mappings, function, latin_hypercube, sobol, saltelli"),
    "vectors number": (P + "vectors: 5",
        "4:10: vectors: must be text, or a list, or a mapping with function, or a mapping "
        "with latin_hypercube, or a mapping with sobol, or a mapping with saltelli, got 5"),
    "vectors mapping": (P + "vectors: {sobl: 8}",
        "4:11: vectors.sobl: unknown key (did you mean 'sobol'?); allowed: sobol"),
    "zip lengths2": ("parameters: {robots: {key: fleet.size, values: [1, "
        "2]}, b: {key: robot.laser.beams, values: [1]}}\nvectors: zip",
        "4:10: vectors: zip needs as many values of each parameter, but there are 2 of "
        "robots, 1 of b"),
    "vectors empty": (P + "vectors: []",
        "4:10: vectors: there are none"),
    "vector no mapping": (P + "vectors: [5]",
        "4:11: vectors.0: must be a mapping, got 5"),
    "vector unknown": (P + "vectors: [{robts: 1}]",
        "4:10: vectors: vector 0 has an unknown parameter 'robts' (did you mean 'robots'?); "
        "allowed: robots"),
    "vector missing": (P + "vectors: [{}]",
        "4:10: vectors: vector 0 has no robots"),
    "vector level": ("parameters: {how: {levels: {near: {fleet.size: "
        "1}}}}\nvectors: [{how: neer}]",
        "4:10: vectors: vector 0: how: 'neer' is not one of its levels (did you mean "
        "'near'?); allowed: near"),
    "vector unhashable": ("parameters: {how: {levels: {near: {fleet.size: "
        "1}}}}\nvectors: [{how: [near]}]",
        "4:10: vectors: vector 0: how: ['near'] is not one of its levels (did you mean "
        "'near'?); allowed: near"),
    "function none": (P + "vectors: {function: 'no_such:f'}",
        "4:10: vectors: cannot load function 'no_such:f': No module named 'no_such'; "
        "looked beside the file that names it, where Python finds modules, and in the current "
        "directory"),
    "function raises": (P + "vectors: {function: 'bad_functions:raises'}",
        "4:10: vectors: bad_functions:raises raised ValueError: oh no"),
    "function not callable": (P + "vectors: {function: 'bad_functions:THING'}",
        "4:10: vectors: 'bad_functions:THING' is not a function"),
    "function endless": (P + "vectors: {function: 'bad_functions:endless'}",
        "4:10: vectors: bad_functions:endless gives more than 1,000,000"),
    "function odd": (P + "vectors: {function: 'bad_functions:odd'}",
        "4:10: vectors: vector 0: robots: Object of type object is not JSON serializable"),
    "function gives nothing": (P + "vectors: {function: 'bad_functions:nothing'}",
        "4:10: vectors: bad_functions:nothing raised TypeError: 'NoneType' object is not "
        "iterable"),
    "function gives a mapping": (P + "vectors: {function: 'bad_functions:a_mapping'}",
        "4:10: vectors: vector 0 is 'robots'; it must be a mapping from parameter to value"),
    "function wants arguments": (P + "vectors: {function: 'bad_functions:words'}",
        "4:10: vectors: bad_functions:words raised TypeError: words() missing 1 required "
        "positional argument: 'run'"),
    "function quits": (P + "vectors: {function: 'bad_functions:quits'}",
        "4:10: vectors: bad_functions:quits raised SystemExit: bye"),
    "function says much": (P + "vectors: {function: 'bad_functions:says_much'}",
        "4:10: vectors: bad_functions:says_much raised ValueError: first"),
    "function says nothing": (P + "vectors: {function: 'bad_functions:says_nothing'}",
        "4:10: vectors: bad_functions:says_nothing raised ValueError"),
    "function not a number": (P + "vectors: {function: 'bad_functions:not_a_number'}",
        "4:10: fleet.size: must be a whole number, got nan"),
    "function not there": (P + "vectors: {function: 'bad_functions:gone'}",
        "4:10: vectors: cannot load function 'bad_functions:gone': module 'bad_functions' has no "
        "attribute 'gone'; it defines: raises, number, endless, odd, ..."),
    "module raises": (P + "vectors: {function: 'bad_module:f'}",
        "4:10: vectors: cannot load function 'bad_module:f': first at bad_module.py:1"),
    "function no colon": (P + "vectors: {function: 'bad_functions'}",
        "4:10: vectors: function: 'bad_functions' is not 'package.module:function'"),
    "sobol 0": (P + "vectors: {sobol: 0}",
        "4:18: vectors.sobol: must be at least 1, got 0"),
    "sobol huge": (P + "vectors: {sobol: 1000000000}",
        "4:18: vectors.sobol: must be at most 1000000, got 1000000000"),
    "sobol text": (P + "vectors: {sobol: four}",
        "4:18: vectors.sobol: must be a whole number, got 'four'"),
    "two samplings": (P + "vectors: {sobol: 4, latin_hypercube: 4}",
        "4:11: vectors.sobol: unknown key; allowed: latin_hypercube"),
    "saltelli 1": (P + "vectors: {saltelli: 1}",
        "4:21: vectors.saltelli: must be at least 2, got 1"),
    "saltelli many": (P + "vectors: {saltelli: 524288}",
        "4:10: vectors: saltelli: 524,288 points of 1 parameters are 1,572,864 vectors; at most "
        "1,000,000"),
    "saltelli 3": (P + "vectors: {saltelli: 3}",
        "4:10: vectors: saltelli: the number of points must be a power of two, got 3"),
    "samples none": ("vectors: {sobol: 4}",
        "3:10: vectors: there are no parameters to take samples of"),
    "samples no values": ("parameters: {robots: {key: fleet.size}}\nvectors: "
        "{sobol: 4}",
        "3:22: parameters.robots: has no values to take samples of; give it values, or from "
        "and to"),
    "combinations": ("parameters:\n  p0: {key: robot.laser.beams, from: 1, "
        "to: 1000}\n  p1: {key: fleet.size, from: 1, to: 1000}\n  p2: {key: "
        "testbed.robots_per_node, from: 1, to: 1000}",
        "1:1: vectors: all combinations are 1,000,000,000 (1000 of p0 x 1000 of p1 x 1000 of "
        "p2); at most 1,000,000: leave out values, or take samples (latin_hypercube)"),
}
