"""The judge: one network for both sides, figures of both, and what is missing in one line."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.errors import InputError, ModelError
from desim.loop import guest_kernel
from desim.loop.gateway import STACK_NS
from desim.network.scoped_rule import scoped
from desim.ports import with_scope
from desim.scenario.load import from_mapping
from desim.testing.medium_bench import Bench
from desim.validation.real import dds, judge, media, ros1, sections, sides, tcp, zenoh
from desim.validation.real.cell import DRIVE, Act, Heard, Played, SentFrames, scenario_of
from desim.validation.real.figures import (
    Figure,
    arrived,
    delay,
    figures,
    frames,
    heard_again,
    mean_delay,
    silence,
)
from desim.validation.real.peers import (
    Listened,
    PeerNode,
    PeerSoftware,
    PeerTalk,
    Published,
    talk,
)
from desim.validation.real.peers import judged_row as peers_row
from desim.validation.real.sections import SECTIONS
from desim.validation.real.stack import Stack
from netmodels.ideal import Ideal

MESSAGES = tcp.LinkTalk("ten messages", media.wire(10, 20), 1000, 100, 1, nodelay=True)
CELL = tcp.cell_of(MESSAGES, "link")


@pytest.mark.parametrize("name", sorted(SECTIONS))
def test_both_sides_have_the_same_networks(name):
    for row in SECTIONS[name].rows(1):
        for cell in row.cells:
            real, model = (from_mapping(scenario_of([cell], 1, real)).scenario
                           for real in (True, False))
            (medium,), (ours,) = real.network.media.values(), model.network.media.values()
            *rules, stack = ours.rules
            assert stack.rule.endswith(":Stack")
            ours = ours.model_copy(update={"rules": medium.rules})
            assert real.network.media == {cell.name: ours}
            assert list(medium.rules) == rules
            assert real.hosts == model.hosts
            assert real.seed == model.seed
            assert len(real.loop.programs) == len(cell.acts) and not model.loop.programs


def test_new_networks_are_those_of_their_seed():
    first, again, other = ([row.what for row in SECTIONS["new"].rows(seed)] for seed in (1, 1, 2))
    assert first == again != other
    assert len(set(first)) == 20


def test_the_model_plays_a_cell():
    """A message of 1000 B has 70 B of headers: 856 us at 10 Mb/s, then 20 ms; and it sets out up to
    0.1 ms late, like real ones."""
    played = sides.modelled(CELL, 1)
    assert [heard.number for heard in played.heard] == list(range(10))
    late_ns = [(heard.late_s - 0.020856) * 1e9 for heard in played.heard]
    assert all(0 <= late < STACK_NS for late in late_ns) and len(set(late_ns)) == 10
    # A request of ARP, three segments of the call and its answer, and ten messages.
    assert played.sent["talker_0"].payload_bytes == pytest.approx(10_000, abs=20)
    assert played.sent["talker_0"].frames == pytest.approx(13, abs=1)


def late_ns(law, every_ns, segments):
    """The order in which 400 such frames set out, one every so often, and how late each."""
    params = with_scope(law.Params)(until="1 h")
    bench = Bench(Ideal(Ideal.Params(delay="0 ns")), 2, rules=[scoped(law(params), params)])
    for number in range(400):
        bench.send(number * every_ns, "host_1", "host_2", 1000 * segments, segments, number)
    found = bench.run()
    return ([number for _, number, *_ in found],
            [at_ns - number * every_ns for at_ns, number, *_ in found])


def test_models_set_out_as_real_frames_do():
    """Up to ``STACK_NS`` late, by an even law, in order; a train when the last of its packets does.
    A twin sets out in any order."""
    for segments in 1, 9:
        _, late = late_ns(Stack, 10**6, segments)
        mean, error = segments / (segments + 1), 1 / math.sqrt(12 * 400)
        assert sum(late) / 400 == pytest.approx(mean * STACK_NS, abs=4 * error * STACK_NS)
        assert all(0 <= one < STACK_NS for one in late)

    class AnyOrder(Stack):
        def judge(self, frame, receivers):
            self._last_ns.clear()
            return super().judge(frame, receivers)

    order, late = late_ns(Stack, 10_000, 1)
    assert order == list(range(400)) and max(late) < STACK_NS
    assert late_ns(AnyOrder, 10_000, 1)[0] != order


def test_the_model_is_what_is_judged():
    """A twin: with Nagle's algorithm messages wait for an acknowledgement."""
    slower = sides.modelled(tcp.cell_of(MESSAGES._replace(nodelay=False, every_ms=20), "link"), 1)
    assert slower.heard[-1].late_s > 0.03


def test_ros_plays_a_cell():
    row = ros1.ROWS[0]
    played = sides.modelled(next(iter(ros1.judged_row(row, "ros").cells)), 1)
    heard, = played.heard
    assert heard.host == "hearer_0" and heard.at_s > played.called_s["hearer_0"]
    assert played.sent["master"].frames > 0


def played_by(software, what, network, peers, seconds, **more):
    """The outcome of a row of peers on the model's side."""
    row = peers_row(PeerTalk(what, network, peers, seconds, **more), software, "peers")
    return sides.modelled(next(iter(row.cells)), 1)


@pytest.mark.parametrize("software", [dds.CYCLONE, zenoh.software("zenoh")])
def test_peers_play_a_cell(software):
    """Twenty messages, each 50 us late, and up to 0.1 ms of the guest's; they begin four seconds
    after the talker's start."""
    played = played_by(software, "a second", media.lan(), talk(1000, 20), 5, begin_s=4)
    assert [heard.number for heard in played.heard[:9]] == list(range(1, 10))
    assert [heard.late_s for heard in played.heard] == pytest.approx([1e-4] * 9, abs=5e-5)
    assert played.heard[0].born_s == pytest.approx(4.55)


def test_peers_say_more_where_they_lose_more():
    calm, lossy = (played_by(dds.CYCLONE, "loss", media.lan("2 ms", media.lost(loss, 4)),
                             talk(1000, 10), 20) for loss in (0, 0.3))
    assert max(heard.late_s for heard in calm.heard) < 0.003
    assert max(heard.late_s for heard in lossy.heard) > 0.1
    assert lossy.sent["writer"].size_bytes > 1.1 * calm.sent["writer"].size_bytes


def silence_of(hearer):
    """The ends of the longest silence at a hearer of ten messages a second."""
    talk_ = tcp.LinkTalk("drive", media.weak_radio(0), 1000, 100, 60, True, hearer=hearer)
    played = sides.modelled(tcp.cell_of(talk_, "drive"), 1)
    return [quantity.of([played]) for quantity in silence()]


def test_a_robot_is_not_heard_where_it_is_out_of_range():
    """It drives at 5 m/s from the 10th second on, and is 85 m away at 23 and at 33 s; then TCP has
    to try again."""
    last_s, again_s = silence_of(DRIVE)
    assert last_s == pytest.approx(23, abs=0.5)
    assert 33 <= again_s < 40


def test_a_host_that_stays_is():
    """The twin."""
    last_s, again_s = silence_of((20.0, 10.0))
    assert again_s - last_s < 0.2


def test_frames_count_from_an_instant_on():
    whole, rest = (played_by(dds.CYCLONE, "rest", media.lan(), dds.fleet(2, 0), 20, **since)
                   for since in ({}, {"since_s": 15.03}))
    assert whole.sent["peer_0"].frames > 20
    assert rest.sent["peer_0"].frames == 4  # at 16.5 s: announcements, liveliness, answer


def test_the_words_of_a_peer():
    row = peers_row(PeerTalk("two", media.lan(), {"a": PeerNode(
        [Published("/x", 100, 5, 0), Published("/y", reliable=False)], [Listened("/z", 1)])}, 5),
        PeerSoftware("some", "node", {"model": "dds"}), "some")
    act, = row.cells[0].acts
    assert act.run == "node a 2.0 /x:100:5:0:1 /y:0:0:10:0 /z:1:1"


class RunOfPrograms:
    """The rest of a run with real programs."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def table(self, name, names):
        import numpy as np

        assert name == "messages"
        columns = {"number": [1, 1, 2, 1, 3], "source": ["x_a", "x_a", "x_a", "x_b", "x_a"],
                   "born_ns": [0, 0, 5, 5, 10**12], "size_bytes": [42, 42, 1066, 66, 66]}
        return {name: np.array(columns[name]) for name in names}


def test_the_outcome_of_real_programs(tmp_path):
    """Their clock began at 1000 s; a broadcast to two is one frame, and short ones are padded; what
    comes after the cell's end does not count."""
    cell = CELL._replace(name="x", parts={"a": (0, 0), "b": (1, 0)}, since_s=0, acts=[
        Act("a", "talk", 1.0), Act("b", "hear", 0.5)])
    (tmp_path / "x_a.0.log").write_text("began 1001.25\ncalled 1002\n")
    (tmp_path / "x_b.1.log").write_text("noise\n\nbegan 1000.5\nheard 7 1003.5 1003.25\n"
                                     "heard 8 1900 1003.5\n")
    outcome = sides._outcomes([cell], RunOfPrograms(tmp_path))
    assert outcome == {"x": Played({"a": SentFrames(2, 64 + 1070, 1000), "b": SentFrames(1, 70, 0)},
                                   [Heard("b", 7, 3.5, 3.25)], {"a": 2.0})}


def test_a_program_that_ended(tmp_path):
    (tmp_path / "x_a.0.log").write_text("Traceback:\nNo module named 'zenoh'\n")
    run = RunOfPrograms(tmp_path)
    run.manifest = {"loop": {"programs": [
        {"host": "x_a", "run": "node", "log": "x_a.0.log", "code": 1}]}}
    with pytest.raises(ModelError, match="^x_a: node has ended with 1: No module named 'zenoh'$"):
        sides._require_all_ran(run)
    run.manifest["loop"]["programs"][0]["code"] = None
    sides._require_all_ran(run)


def test_figures_where_nothing_arrived():
    silent = Played({}, [], {})
    for quantity in mean_delay(), delay(50):
        assert math.isnan(quantity.of([silent]))


def test_figures():
    real = Played({"a": SentFrames(4, 400, 0), "b": SentFrames(2, 200, 0)}, [
        Heard("b", 0, 1.5, 1.0), Heard("b", 1, 7.0, 2.0)], {})
    model = Played({"a": SentFrames(5, 500, 0), "b": SentFrames(2, 200, 0)}, [
        Heard("b", 0, 1.5, 1.0)], {})
    found = {figure.quantity: figure for figure in figures("row", [
        frames(), frames("a"), arrived(), mean_delay(), heard_again(3.0)], [real], [model])}
    assert [figure.real for figure in found.values()] == [6, 4, 2, 2750, 4]
    assert found["frames of as"].ratio == 1.25 and not found["frames of as"].near
    assert found["heard again"].ratio != found["heard again"].ratio  # never: not a number
    assert Figure("row", "frames", "a run", 100, 104, ).near
    assert Figure("row", "frames", "a run", 0, 0).ratio == 1
    assert Figure("row", "frames", "a run", 0, 1).ratio == float("inf")
    assert Figure("row", "frames", "a run", 100, 106).line.endswith(" 1.060 *  frames, a run: row")


# What is missing.

def desim_(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.output


def test_an_unknown_program():
    assert desim_("validate", "--real", "ros2") == (
        2, "--real: there is no 'ros2' (did you mean 'ros1'?); known: "
           f"{', '.join(SECTIONS)}\n")


@pytest.mark.parametrize("test", [["no_such_program"], ["false"]])
def test_a_missing_program(test):
    with pytest.raises(InputError, match=r"^--real: there is no foo; apt-get install foo$"):
        judge.require([judge.Need("bar", ["true"], ""), judge.Need("foo", test,
                                                                   "apt-get install foo")])


def test_a_missing_guest_kernel(monkeypatch, tmp_path):
    monkeypatch.setattr(guest_kernel, "own_folder", lambda name: tmp_path)
    code, said = desim_("validate", "--real", "tcp")
    assert code == 2
    assert "there is no guest kernel yet" in said and said.count("\n") == 1


# The command's end.

def judging(monkeypatch, model):
    """The command where the real side sends 100 frames of 1 B, and ours ``model``."""
    sent = {"talker_0": SentFrames(100, 100), "hearer_0": SentFrames()}
    monkeypatch.setattr(guest_kernel, "guest_kernel", lambda: None)
    monkeypatch.setitem(SECTIONS, "tcp", sections.JudgedSection(lambda: (), lambda seed: [
        judge.JudgedRow("row", [CELL], [frames()])]))
    monkeypatch.setattr(judge, "really", lambda cells, seed, out: {"link": Played(sent, [], {})})
    monkeypatch.setattr(judge, "modelled", lambda cell, seed: Played(
        {"talker_0": SentFrames(model, model)}, [], {}))
    return desim_("validate", "--real", "tcp")


@pytest.mark.parametrize(("model", "code", "within"), [(104, 0, 1), (96, 0, 1), (106, 1, 0),
                                                       (94, 1, 0)])
def test_a_figure_that_is_off_fails(monkeypatch, model, code, within):
    found, said = judging(monkeypatch, model)
    assert found == code
    assert said.splitlines()[-1] == f"{within} of 1 within 5 %, the others have a *"


@pytest.mark.parametrize("kept", [False, True])
def test_an_interrupted_judge_names_what_stays(monkeypatch, tmp_path, kept):
    """Without a folder the run is gone with its temporary one."""
    def interrupted(order, *_):
        raise KeyboardInterrupt(f"{order.out}/judge/a1b2")

    monkeypatch.setattr(guest_kernel, "guest_kernel", lambda: None)
    monkeypatch.setattr(sides, "guest_kernel", lambda: None)
    monkeypatch.setattr(sides, "rehearse", lambda scenario: None)
    monkeypatch.setattr(sides, "run_virtually", interrupted)
    said = f"; what there is until then: {tmp_path}/judge/a1b2" if kept else ""
    code, found = desim_("validate", "--real", "tcp", *(["--out", tmp_path] if kept else []))
    assert code == 130
    assert found.endswith(f"interrupted{said}\n")


# The real side.

@pytest.fixture
def guest():
    """Skips a test where no guest kernel is."""
    try:
        guest_kernel.guest_kernel()
    except InputError as error:
        pytest.skip(str(error))


def test_real_tcp_sends_what_the_model_sends(guest):
    real, model = sides.really([CELL], 1)["link"], sides.modelled(CELL, 1)
    assert [heard.late_s for heard in real.heard] == pytest.approx(
        [heard.late_s for heard in model.heard], abs=1.1 * STACK_NS / 1e9)  # each has its draws
    assert real.sent["talker_0"].frames == pytest.approx(model.sent["talker_0"].frames, abs=2)
    assert sides.really([CELL], 1)["link"] == real  # exact repetition


def test_the_command(guest, monkeypatch):
    monkeypatch.setattr(tcp, "ROWS", (tcp.TcpRow(MESSAGES),))
    code, said = desim_("validate", "--real", "tcp", "--json")
    found = json.loads(said)
    assert code == (found["failed"] > 0)
    delay, = (row for row in found["rows"] if row["quantity"] == "delay, mean")
    assert abs(delay["real"] - delay["model"]) < STACK_NS / 1e6  # ms; each has its draws
