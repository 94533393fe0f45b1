"""DDS participants that fall silent, die, come back: leases, ghosts, new lives."""

import pytest
from configured import configured
from graphs import MS, Net, S, listener, silent, talker
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from desim.middleware.dds.dds import Dds
from desim.middleware.dds.participant import Participant
from desim.ports import PASS, Drop
from netmodels.rules.loss import Loss
from netmodels.rules.partition import Partition

PRESETS = pytest.mark.parametrize("preset", ["fastdds", "cyclonedds"])
LEASE_S = {"fastdds": 20, "cyclonedds": 10}


def dds(preset="cyclonedds", **params):
    return Dds(configured(Dds.Params, preset=preset, **{"start_spread": "0 ns", **params}))


def partition(start, until, *groups):
    return Partition(Partition.Params(groups=list(groups) or [["b"]],
                                      **{"from": start, "until": until}))


def seen(net, *states):
    return [(time, host, other) for time, _, host, other, state, _ in net.rows("sees")
            if state in states]


def talking(heard, until_s=100):
    says = [(k * S, str(k)) for k in range(1, until_s)]
    return {"a": talker(says, queue=1), "b": listener(heard)}


def detection_ns(preset, **params):
    """From the last word of a host that stops to its removal elsewhere."""
    net = Net({"a": silent, "b": silent}, middleware=dds(preset, **params))
    net.at(30 * S + MS, net.graph.host("b").stop)
    net.run(100 * S)
    ((removed_ns, host, other),) = seen(net, "removed")
    assert (host, other) == ("a", "b")
    last_ns = max(row[0] for row in net.rows("control") if row[2] == "b")
    return removed_ns - last_ns


@PRESETS
def test_a_silent_participant_is_removed_after_its_lease(preset):
    """20 s in fastdds, 10 s in cyclonedds, from the last that was heard of it."""
    assert detection_ns(preset) == LEASE_S[preset] * S
    assert detection_ns(preset, lease=f"{LEASE_S[preset] * 95 // 100} s") != LEASE_S[preset] * S


@pytest.mark.parametrize(("lease", "period_ns"), [
    ("5 s", 4 * S), ("10 s", 8 * S), ("60 s", 30 * S)])
def test_cyclonedds_says_that_it_is_there_in_80_percent_of_its_lease(lease, period_ns):
    """At most 30 s. b says 2 s of itself: 1.6 s."""
    net = Net({"a": silent, "b": silent}, middleware=dds(lease=lease, leases={"b": "2 s"}))
    net.run(200 * S)
    for host, wanted_ns in ("a", period_ns), ("b", 1600 * MS):
        times = [row[0] for row in net.rows("control")
                 if row[2:5] == (host, "medium/lan", "spdp")]
        assert {late - early for early, late in zip(times, times[1:], strict=False)} == {wanted_ns}
    assert seen(net, "removed") == []


def test_whatever_is_heard_renews_the_lease():
    """Announcements of a get lost for a minute, its messages do not: it stays."""
    class Quiet:
        reasons = ("quiet",)

        def start(self, context, hosts):
            self._context = context

        def judge(self, frame, receivers):
            if self._context.now_ns < 20 * S or frame.size_bytes == 238:
                return None
            return [Drop("quiet") if frame.source == 0 else PASS for _ in receivers]

    net = Net(talking([]), middleware=dds(), rules=[Quiet()]).run(80 * S)
    assert seen(net, "removed") == []


@PRESETS
def test_an_outage_shorter_than_the_leases_is_not_noticed(preset):
    """Of what is said meanwhile the history of one keeps the last, which a heartbeat brings up in
    cyclonedds (0.1 s) before the next message overwrites it, and in fastdds (3 s) after that."""
    heard = []
    net = Net(talking(heard), middleware=dds(preset), rules=[partition("30.5 s", "36.5 s")])
    net.run(60 * S)
    assert seen(net, "removed") == []
    resumed = {"fastdds": 37, "cyclonedds": 36}[preset]
    assert [int(text) for *_, text in heard] == [*range(1, 31), *range(resumed, 61)]
    assert net.counts("/talk").dropped == {"overwritten": resumed - 31}


@PRESETS
def test_after_a_longer_outage_all_is_discovered_anew(preset):
    """Both remove each other a lease after the last word, and meet at the next announcement."""
    heard = []
    net = Net(talking(heard), middleware=dds(preset), rules=[partition("30.5 s", "65 s")])
    net.run(100 * S)
    removed = seen(net, "removed")
    assert [(host, other) for _, host, other in removed] in ([("a", "b"), ("b", "a")],
                                                             [("b", "a"), ("a", "b")])
    assert all(30.5 * S + (LEASE_S[preset] - 8) * S <= t <= 30.5 * S + LEASE_S[preset] * S
               for t, *_ in removed)
    assert net.graph.context.beliefs.divergence == 0
    back_s = [t / S for t, *_ in heard if t > 31 * S]
    assert 65 < back_s[0] < 65 + 9 and len(back_s) > 25
    counts = net.counts("/talk")
    assert set(counts.dropped) <= {"overwritten", "link_closed"}


def between_two_leases(**params):
    """a says of itself 10 s, b 20 s; they are apart for 15 s. So b removes a, and a keeps b."""
    heard = []
    net = Net(talking(heard), middleware=dds("fastdds", leases={"a": "10 s"}, **params),
              rules=[partition("30.5 s", "45.5 s")])
    net.run(100 * S)
    assert [(host, other) for _, host, other in seen(net, "removed")] == [("b", "a")]
    return heard, net.graph.context.beliefs.divergence


def test_an_outage_between_two_leases_heals_because_readers_ask():
    heard, divergence = between_two_leases()
    assert divergence == 0
    assert len([t for t, *_ in heard if t > 50 * S]) > 45


def test_where_they_do_not_ask_the_endpoints_never_match_again():
    """As in Fast DDS of 2018 (its issues 155 and 457): a believes that b has had everything."""
    heard, divergence = between_two_leases(initial_acknack=None)
    assert divergence == 1
    assert [t for t, *_ in heard if t > 31 * S] == []


@PRESETS
def test_a_restarted_participant_is_another_one(preset):
    """b is off for a second: it is discovered anew at once, while its former life lasts until the
    end of its lease, which nobody notices."""
    heard = []
    net = Net(talking(heard), middleware=dds(preset))
    net.at(30_500 * MS, net.graph.host("b").stop)
    net.at(31_500 * MS, net.graph.host("b").start)
    net.run(31_400 * MS)
    assert net.graph.context.beliefs.ghosts == 0, "it is the reader's side that believes"
    assert len(list(net.graph.middleware.participants[0].of(1))) == 1
    net.run(33 * S)
    assert len(list(net.graph.middleware.participants[0].of(1))) == 2
    net.run(100 * S)
    assert len(list(net.graph.middleware.participants[0].of(1))) == 1
    assert seen(net, "removed") == []
    assert net.graph.context.beliefs.divergence == 0
    assert [int(text) for *_, text in heard] == [*range(1, 31), *range(32, 100)]


def a_death(preset):
    """a dies at 30.5 s. All that is seen and believed, in ms, and how many ghosts there are at 31 s
    and when a lease has passed since."""
    net, ghosts = Net(talking([]), middleware=dds(preset)), []
    net.at(30_500 * MS, net.graph.host("a").stop)
    for until_ns in 31 * S, 30_500 * MS + LEASE_S[preset] * S:
        net.run(until_ns)
        ghosts.append(net.graph.context.beliefs.ghosts)
    return [(row[0] // MS, *row[1:]) for row in net.rows("sees", "believes")], ghosts


ALIVE = [(0, "sees", "a", "b", "online", 0), (0, "sees", "b", "a", "online", 0),
         (35, "believes", "b", "a", "/talk", 1)]
# A lease after a's last word, what it said at 30 s.
END_MS = {"fastdds": 50_000, "cyclonedds": 40_000}


def death(preset):
    end_ms = END_MS[preset]
    return [*ALIVE, (end_ms, "sees", "b", "a", "removed", 0),
            (end_ms, "believes", "b", "a", "/talk", 0)], [1, 0]


@PRESETS
def test_a_dead_writer_is_a_ghost_until_its_lease_ends(preset):
    assert a_death(preset) == death(preset)


@PRESETS
def test_a_dead_writer_is_a_ghost_for_ever_where_leases_are_ignored(monkeypatch, preset):
    """A twin: nobody looks whether one has ended."""
    monkeypatch.setattr(Participant, "_check_lease", lambda participant, remote: None)
    assert a_death(preset) == (ALIVE, [1, 1]) != death(preset)


@PRESETS
def test_a_dead_writer_is_no_ghost_where_everybody_hears_of_it(monkeypatch, preset):
    """A twin: who stops is lost at once, by magic."""
    switched = Dds.switched

    def switch(model, host, up):
        switched(model, host, up)
        for participant in () if up else model.participants.values():
            for remote in list(participant.of(host)):
                participant.lose(remote)

    monkeypatch.setattr(Dds, "switched", switch)
    log, ghosts = a_death(preset)
    assert [row[0] for row in log[3:]] == [30_500, 30_500]
    assert ghosts == [0, 0]
    assert (log, ghosts) != death(preset)


class Outages(RuleBasedStateMachine):
    """Hosts stop and start, the network is cut and whole, packets get lost: at every moment each
    message has at most one fate at each receiver, and at rest everybody knows everybody."""

    def __init__(self):
        super().__init__()
        self.heard = []
        self.net = None

    @precondition(lambda self: self.net is None)
    @rule(preset=st.sampled_from(["fastdds", "cyclonedds"]), server=st.booleans(),
          transport=st.sampled_from(["stream", "datagram"]), depth=st.sampled_from([0, 1, 3]))
    def begin(self, preset, server, transport, depth):
        def life(node):
            node.advertise(f"/{node.host.name}", queue=depth, latch=True, transport=transport)
            node.timer(5, lambda k: node.publish(f"/{node.host.name}", Word(f"{k}")))
            for other in "abc":
                listener(self.heard, f"/{other}", queue=0)(node)

        options = {"discovery": "server", "server": "a"} if server else {}
        options["start_spread"] = "200 ms"
        self.cut = Cut()
        self.net = Net(dict.fromkeys("abc", life), middleware=dds(preset, **options),
                       rules=[self.cut, Loss(Loss.Params(probability="3 %"))])

    @precondition(lambda self: self.net is not None)
    @rule(host=st.sampled_from("abc"), up=st.booleans())
    def switch(self, host, up):
        target = self.net.graph.host(host)
        (target.start if up else target.stop)()

    @precondition(lambda self: self.net is not None)
    @rule(alone=st.sampled_from([None, 0, 1, 2]))
    def partition(self, alone):
        self.cut.alone = alone

    @precondition(lambda self: self.net is not None)
    @rule(seconds=st.sampled_from([1, 3, 12, 25]))
    def wait(self, seconds):
        self.net.run(self.net.kernel.now_ns + seconds * S)

    @invariant()
    def one_fate(self):
        if self.net is not None:
            fates = [(number, host) for number, host, *_ in self.net.fates]
            assert len(set(fates)) == len(fates)

    def teardown(self):
        if self.net is None:
            return
        self.cut.alone = None
        for host in self.net.graph.hosts:
            host.start()
        self.wait(120)
        assert self.net.graph.context.beliefs.divergence == 0
        talks = [f"/{host}" for host in "abc"]
        before = len(self.heard)
        self.wait(10)
        assert len(self.heard) > before
        for host in self.net.graph.hosts:
            host.stop()
        self.wait(60)
        for counts in map(self.net.counts, talks):
            assert counts.intended == counts.delivered + sum(counts.dropped.values())


class Word:
    def __init__(self, text):
        self.text, self.size_bytes = text, 30_000


class Cut:
    """Cuts one host off."""

    reasons = ("cut",)
    alone = None

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [Drop("cut") if self.alone in (frame.source, receiver) else PASS
                for receiver in receivers]


TestOutages = Outages.TestCase
TestOutages.settings = settings(max_examples=5, stateful_step_count=12)
