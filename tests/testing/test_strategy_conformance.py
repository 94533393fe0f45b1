"""The kit's check of strategies: what it plays really happens, and what breaks is named."""

import pytest

import desim
from desim import ports
from desim.errors import ModelError
from desim.ports.arguments import checked_marks
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.scenario.load import from_mapping
from desim.testing import check_strategy

S = 10**9
NAN, INF = float("nan"), float("inf")


class Diary(NearestFrontier):
    """Notes all that happens to it."""

    def __init__(self, params):
        super().__init__(params)
        self.entries = []

    def note(self, context, *what):
        self.entries.append((context.now_ns // S, *what))

    def on_start(self, context):
        self.note(context, "start", context.pose)
        context.advertise("here")
        context.subscribe("here", self.hear)
        context.every(S, self.speak)

    def speak(self, context):
        context.publish("here", context.now_ns // S)
        self.note(context, "tick", context.pose is not None)

    def hear(self, context, message):
        self.note(context, "hears", message.source, message.content)

    def on_map(self, context):
        self.note(context, "map", len(context.frontiers()))

    def on_teammate(self, context, name, heard):
        self.note(context, "back" if heard else "lost", name,
                  context.now_ns - context.links()[name].heard_ns)

    def on_goal(self, context, place, end):
        self.note(context, "goal", end)

    def choose(self, context):
        self.note(context, "choose", [one.path_m for one in context.frontiers()])
        return super().choose(context)


@pytest.fixture(scope="module")
def entries():
    lives = []

    class Kept(Diary):
        def __init__(self, params):
            super().__init__(params)
            lives.append(self)

    check_strategy(Kept)
    return lives[0].entries


def of(entries, *kinds):
    return [entry[1:] for entry in entries if entry[1] in kinds]


def test_the_map_comes_late(entries):
    assert entries[0] == (10, "start", None)
    first = next(k for k, entry in enumerate(entries) if entry[1] == "map")
    assert of(entries[:first], "tick", "choose")[:3] == [("tick", False)] * 3
    assert of(entries, "map") == [("map", 3), ("map", 3), ("map", 0)]
    before, after = (next(entry[2] for entry in entries[k:] if entry[1] == "choose")
                     for k, entry in enumerate(entries) if entry[1:] == ("map", 3))
    assert before != after  # a frontier has gone, another one has come


def test_messages_are_lost_at_first_then_late_and_twice(entries):
    heard = [(entry[0], entry[3]) for entry in entries if entry[1] == "hears"]
    assert {entry[2] for entry in entries if entry[1] == "hears"} == {"robot_2"}
    said = [at_s for at_s, content in heard]
    contents = [content for _, content in heard]
    assert contents == contents[:len(contents) // 2] * 2  # each twice
    assert min(said) >= max(contents)  # when the last of them was sent
    assert heard[0][0] - heard[0][1] >= 10


def test_a_teammate_is_heard_lost_and_back(entries):
    events = of(entries, "back", "lost")
    assert [entry[:2] for entry in events] == [
        ("back", "robot_2"), ("lost", "robot_2"), ("back", "robot_2"), ("lost", "robot_2")]
    assert events[1][2] > 5 * S and events[2][2] <= S


def test_goals_end_in_every_way_and_frontiers_run_out(entries):
    assert [end for _, end in of(entries, "goal")] == list(ports.GoalEnd)
    assert of(entries, "choose")[-2:] == [("choose", [])] * 2


class Early(NearestFrontier):
    """Does not expect to have no pose."""

    def on_start(self, context):
        context.every(S, lambda context: context.path_lengths_m([context.pose[:2]]))


class Stubborn(NearestFrontier):
    """Drives to what was a frontier once."""

    def choose(self, context):
        self.first = getattr(self, "first", None) or super().choose(context)
        return self.first


class Credulous(NearestFrontier):
    """Does not expect a message twice."""

    def on_start(self, context):
        self.waiting = {"robot_1"}
        context.advertise("here")
        context.subscribe("here", lambda context, message: self.waiting.remove("robot_1"))
        context.after(S, lambda context: context.publish("here", None))


class Trusting(NearestFrontier):
    """Does not expect a teammate to come back."""

    def on_teammate(self, context, name, heard):
        self.team = {**getattr(self, "team", {}), name: heard} if heard is False or not hasattr(
            self, "team") else {}[name]


class Hopeful(NearestFrontier):
    """Expects that there is always a frontier."""

    def choose(self, context):
        return context.frontiers(limit=1)[0]


class Homing(NearestFrontier):
    """Drives home where there is nothing left."""

    def choose(self, context):
        return super().choose(context) or ports.Place(1.0, 1.0)


class Inventive(NearestFrontier):
    def choose(self, context):
        return ports.Frontier(1.0, 2.0, 3.0, 4)


class Board(NearestFrontier):
    """Reads what other robots have written into its class."""

    taken = []

    def choose(self, context):
        self.taken.append(context.name)
        return super().choose(context)


LOG = {}


class Logging(NearestFrontier):
    def choose(self, context):
        LOG[context.now_ns] = context.name
        return super().choose(context)


def doing(method, does):
    """A strategy that does this where it is called ``method``."""
    return type("Doing", (NearestFrontier,), {method: does, "__module__": __name__,
                                              "__doc__": "For a test."})


def answers(*replies):
    """A strategy that answers each message with these."""
    def start(self, context):
        context.advertise("a")
        context.subscribe("a", lambda context, message: [
            context.publish("a", reply) for reply in replies])
        context.after(5 * S, lambda context: context.publish("a", 0))
    return doing("on_start", start)


def doubles(context):
    context.after(10**6, doubles)
    context.after(10**6, doubles)


@pytest.mark.parametrize("cls, error, says", [
    (Early, TypeError, "'NoneType' object is not subscriptable"),
    (Stubborn, AssertionError, "return one of frontiers(), a Place or None, not Frontier(x_m=4.0"),
    (Credulous, KeyError, "'robot_1'"),
    (Trusting, KeyError, "'robot_2'"),
    (Hopeful, AssertionError, "return None when there is no frontier; choose raised IndexError"),
    (Inventive, AssertionError, "return one of frontiers(), a Place or None, not Frontier(x_m=1.0"),
    (Board, AssertionError, "keep its state in self: Board.taken changed, and all robots share it"),
    (Logging, AssertionError, "keep its state in self: test_strategy_conformance.LOG changed"),
    *((doing("choose", lambda self, context, chosen=chosen: chosen), ModelError,
       f"Doing chose {chosen!r}; wanted: one of frontiers(), a Place on the robot's map, or "
       "None") for chosen in (
           ports.Place(NAN, 0.0), ports.Place(INF, 0.0), ports.Place("a", None), "north",
           (1.0, 2.0), ports.Place(1e9, 1e9))),
    *((doing("on_map", does), error, says) for does, error, says in (
        (lambda self, context: context.go(ports.Place(NAN, NAN)), ModelError,
         "a robot drives to a place of two finite numbers, not to Place(x_m=nan, y_m=nan)"),
        (lambda self, context: context.frontiers(-3), ModelError,
         "a limit is an int >= 1 of frontiers, or None, not -3"),
        (lambda self, context: context.path_lengths_m("abc"), ModelError,
         "places are pairs of finite numbers, x and y in m, not 'abc'"),
        (lambda self, context: context.path_lengths_m([(0.0, 1.0)], (NAN, 0.0)), ModelError,
         "a place is a pair of finite numbers, x and y in m, not (nan, 0.0)"),
        (lambda self, context: context.gain_m2(None), ModelError,
         "a place is a pair of finite numbers, x and y in m, not None"),
        (lambda self, context: context.peers.clear(), AttributeError, "mappingproxy"),
        (lambda self, context: context.occupancy().fill(0), ValueError, "read-only"),
        (lambda self, context: context.costmap().fill(0), ValueError, "read-only"),
        (lambda self, context: context.publish("b", 1), ModelError,
         "topic 'b' is published but not advertised; advertised: nothing"),
        (lambda self, context: [context.advertise("b"), context.publish("b", NAN)], ModelError,
         "JSON cannot hold nan (ValueError: Out of range float values"),
        (lambda self, context: context.after(0.5, print), ModelError,
         "a timer's delay is an int >= 0 of ns, not 0.5"))),
    (doing("on_start", lambda self, context: context.frontiers()), ModelError,
     "ways begin somewhere: this host has no pose yet"),
    (doing("on_start", lambda self, context: doubles(context)), ModelError,
     "10000 timers of this strategy wait on this host"),
    (answers(1, 2), ModelError, "messages of one instant do not end (topic 'a')"),
    (answers(1), ModelError, "messages of one instant do not end (topic 'a')"),
])
def test_what_each_part_is_there_for(cls, error, says):
    with pytest.raises(error) as caught:
        check_strategy(cls)
    assert says in str(caught.value)


@pytest.mark.parametrize("cls", [Homing, answers()])
def test_a_strategy_may_drive_home_and_hear(cls):
    check_strategy(cls)


class ReadsGoals(NearestFrontier):
    """Keeps away from the goals of others, and takes for granted that they are known."""

    traits = ports.StrategyTraits(reads_team_state=True)

    def choose(self, context):
        taken = [peer.goal.x_m for peer in context.peers.values()]
        return None if 5.0 in taken else super().choose(context)


def test_goals_of_teammates_are_known_only_to_a_strategy_that_reads_their_state():
    check_strategy(ReadsGoals)
    undeclared = type("Undeclared", (ReadsGoals,), {"traits": ports.StrategyTraits()})
    with pytest.raises(AttributeError, match="'NoneType' object has no attribute 'x_m'"):
        check_strategy(undeclared)


def test_a_run_refuses_a_frontier_that_it_has_not_shown(tmp_path):
    scenario = from_mapping({"name": "one", "stop": {"elapsed": "5 s"}, "coordination": {
        "strategy": "test_strategy_conformance:Inventive"}})
    with pytest.raises(ModelError) as caught:
        desim.run(scenario, out=tmp_path)
    wrong = ("chose Frontier(x_m=1.0, y_m=2.0, path_m=3.0, cells=4); wanted: one of frontiers(), a "
             "Place on the robot's map, or None")
    assert str(caught.value).endswith(wrong)
    assert caught.value.__notes__[-1].endswith(f"{wrong} (robot_0, 0.605517 s)")


@pytest.mark.parametrize("marks", [[(1.0, 2.0)], [(1.0, NAN, "far")], [(1.0, 2.0, 3.0)]])
def test_a_mark_is_two_numbers_and_a_text(marks):
    with pytest.raises(ModelError) as caught:
        check_strategy(doing("on_map", lambda self, context: context.show("bid", marks)))
    assert str(caught.value) == f"a mark is two finite numbers and a text, not {marks[0]!r}"
    assert caught.value.__notes__ == [
        "in check_strategy: there is a map, and every message is lost"]
    assert checked_marks([(1.0, 2.0, "12 m")]) == [ports.Mark(1.0, 2.0, "12 m")]  # the twin
