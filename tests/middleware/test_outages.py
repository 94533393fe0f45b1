"""A random walk over outages: no message has two fates, and afterwards everything flows again.

Whatever hosts stop or are kept apart, no message is heard twice, none goes astray, and nothing
spins. Once over a network where everything arrives at once, once over one that is slow and loses
frames.
"""

from __future__ import annotations

import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from models import ANY, MODELS, Model
from test_kit import Final, Sulking, Twice

from desim.middleware.multimaster.sync import Sync
from desim.ports import PASS, Drop
from desim.testing import Fleet
from netmodels.access_link import AccessLink

S = 10**9
MOST_EVENTS = 5000  # in a simulated second, all talk included

hosts = st.integers(0, 3)


class Walk(RuleBasedStateMachine):
    """Four hosts of the kit. Never fewer than one of them runs."""

    def __init__(self, middleware, patience, **network):
        super().__init__()
        self.fleet, self.patience = Fleet(middleware, **network), patience
        self.fleet.talk(S)

    def running(self):
        return [host.index for host in self.fleet.hosts if host.up]

    @precondition(lambda self: len(self.running()) > 1)
    @rule(which=hosts)
    def stop(self, which):
        stops = self.patience.stops
        self.fleet.stop(stops[which % len(stops)])

    @rule(host=hosts)
    def start(self, host):
        self.fleet.start(host)

    @rule(groups=st.tuples(*[st.integers(0, 1)] * 4))
    def part(self, groups):
        self.fleet.apart.groups[:] = groups

    @rule()
    def heal(self):
        self.fleet.apart.groups[:] = [0] * 4

    @rule(halves=st.integers(1, 6))
    def talk(self, halves):
        self.spend(self.fleet.talk, halves * S // 2)

    @rule(duration_s=st.integers(1, 40))
    def wait(self, duration_s):
        self.spend(self.fleet.run, duration_s * S)

    def spend(self, how, duration_ns):
        before = self.fleet.kernel.events
        how(duration_ns)
        assert self.fleet.kernel.events - before <= MOST_EVENTS * max(1, duration_ns // S)

    @invariant()
    def nothing_is_wrong(self):
        self.fleet.balance()
        assert not self.fleet.faults

    def excused(self):
        """The beginnings of lines about what may stay unheard."""
        return ()

    def teardown(self):
        fleet = self.fleet
        self.heal()
        for host in fleet.hosts:
            fleet.start(host.index)
        fleet.talk(S)
        self.spend(fleet.run, self.patience.again_ns)
        since = len(fleet.said)
        fleet.talk(3 * S)
        fleet.run(self.patience.arrive_ns)
        assert not [line for line in fleet.unheard(since) if not line.startswith(self.excused())]
        for host in fleet.hosts:
            fleet.stop(host.index)
        fleet.run(self.patience.again_ns)
        assert not fleet.open()
        self.nothing_is_wrong()


class Lossy:
    """A rule by which frames are lost, each with the probability ``share``."""

    reasons = ("lost",)

    def __init__(self):
        self.share = 0.3

    def start(self, context, hosts):
        self._stream = context.stream("losses")

    def judge(self, frame, receivers):
        return [Drop("lost") if draw < self.share else PASS
                for draw in self._stream.random(len(receivers))]


class RoughWalk(Walk):
    """The same over a network that takes its time and loses frames, until a moment after the
    outages. It is quicker, and over in a minute: roscpp never asks again for a topic when it had
    no answer for 127 s."""

    def __init__(self, middleware, patience):
        self.lossy = Lossy()
        super().__init__(middleware, patience, rules=[self.lossy],
                         model=AccessLink(AccessLink.Params(rate="10 Mb/s", latency="10 ms")))

    @rule(share=st.sampled_from([0.1, 0.3, 0.5]))
    def lose(self, share):
        self.lossy.share = share

    @rule(which=hosts, tenths=st.integers(1, 20))
    def flicker(self, which, tenths):
        """A host restarts twice, the second time before all have met it."""
        host = self.patience.stops[which % len(self.patience.stops)]
        for _ in range(2):
            self.fleet.stop(host)
            self.fleet.start(host)
            self.wait(tenths)

    @rule(tenths=st.integers(1, 40))
    def wait(self, tenths):
        self.spend(self.fleet.run, tenths * S // 10)

    def teardown(self):
        """A rospy process that has not found its master at first has ended (ROSInitException):
        somebody starts it again."""
        self.heal()
        self.talk(2)
        self.lossy.share = 0.0
        processes = getattr(self.fleet.graph.middleware, "processes", None)
        for host in [] if processes is None else [
                host for host, process in processes._processes.items() if process._ended]:
            self.fleet.stop(host)
        super().teardown()

    def excused(self):
        """With many masters of ROS 1, a subscription may have a list of publishers that came too
        late: it lacks some that its own master knows (docs/middleware/multimaster.md)."""
        processes = getattr(self.fleet.graph.middleware, "processes", None)
        if processes is None or len(processes.masters) == 1:
            return ()
        names = [host.name for host in self.fleet.hosts]
        return tuple(f"{names[host]} has not heard what {names[uri.host]} said on {topic} at "
                     for host, process in processes._processes.items()
                     for topic, subscription in process.subscriptions.items()
                     for uri in processes.masters[host].registry.publishers[topic].values()
                     if uri not in subscription.answer)


def walk(model, kind, examples):
    run_state_machine_as_test(
        lambda: kind(model.make(), model.patience),
        settings=settings(max_examples=examples, stateful_step_count=15, deadline=None,
                          derandomize=True, phases=[Phase.generate]))  # found is enough


@pytest.mark.parametrize("name", MODELS)
def test_a_walk_over_outages_ends_well(name):
    walk(MODELS[name], Walk, 4)


@pytest.mark.parametrize("name", MODELS)
def test_a_walk_over_a_rough_network_ends_well(name):
    walk(MODELS[name], RoughWalk, 8 if name == "fkie_1_3_groovy" else 3)


def test_only_lists_that_came_too_late_keep_hosts_deaf(monkeypatch):
    """Each list of sync comes 5 s late here, so that there are many. Twin: none is excused."""
    inform, groovy = Sync._update_publishers, MODELS["fkie_1_3_groovy"]
    monkeypatch.setattr(Sync, "_update_publishers", lambda sync, updates: sync._life.after(
        5 * S, lambda updates: inform(sync, updates), updates))
    walk(groovy, RoughWalk, 6)
    monkeypatch.setattr(RoughWalk, "excused", Walk.excused)
    with pytest.raises(AssertionError):
        walk(groovy, RoughWalk, 6)


@pytest.mark.parametrize("cls", [Twice, Sulking, Final])
def test_the_walk_finds_what_is_broken(cls):
    with pytest.raises(AssertionError):
        walk(Model(cls, ANY), Walk, 40)
