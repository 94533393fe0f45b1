"""The kit checks cases of ``desim net``, and what becomes of a fleet's messages."""

from types import SimpleNamespace

import pytest

from desim import plugins
from desim.middleware.direct import Direct
from desim.testing import check_case
from desim.testing.fleet import Fleet

QUICK = {"senders": 2, "duration": "2 s", "load": 0.5}


def case(change):
    """The case of a bottleneck, whose setup is changed."""
    bottleneck = plugins.load("case", "bottleneck")
    return type("Changed", (bottleneck,), {"setup": lambda self: change(bottleneck.setup(self))})


def test_a_case_that_fits_together_passes():
    check_case(case(lambda setup: setup), **QUICK)


@pytest.mark.parametrize(("change", "advice"), [
    (lambda setup: setup._replace(places={}), "give a place to "),
    (lambda setup: setup._replace(flows=[flow._replace(receivers=(flow.source,))
                                         for flow in setup.flows]), "not let .* send to itself"),
    (lambda setup: setup._replace(warm_up_ns=setup.duration_ns),
     "measure after the warm-up, not 0 ns"),
    (lambda setup: setup._replace(flows=[], duration_ns=setup.warm_up_ns + 1),
     "last so long that frames are settled")])
def test_a_case_that_does_not_is_seen(change, advice):
    with pytest.raises(AssertionError, match=advice):
        check_case(case(change), **QUICK)


def test_a_case_that_goes_on_where_it_ended_is_seen():
    longer = [0]

    def change(setup):
        longer[0] += 100_000_000
        return setup._replace(duration_ns=setup.duration_ns + longer[0])

    with pytest.raises(AssertionError, match="give the same measures for the same seed"):
        check_case(case(change), **QUICK)


@pytest.fixture
def fleet():
    return Fleet(Direct())


def settle(fleet, receiver, reason=None, number=7):
    topic, = fleet.topics_of(0)[:1]
    fleet._fate(SimpleNamespace(number=number, topic=topic, source=0, origin=fleet.hosts[0]),
                receiver, 0, reason, 0, 0)
    return topic


def test_a_message_with_two_fates_is_a_fault(fleet):
    listener, = fleet.listeners(fleet.topics_of(0)[0], 0)[:1]
    topic = settle(fleet, listener, "outage")
    assert fleet.faults == []
    settle(fleet, listener)
    name = fleet.hosts[listener].name
    assert fleet.faults == [
        f"message 7 of {topic} has two fates at {name}: outage and delivered, at 0 s"]


def test_a_message_to_whoever_does_not_listen_or_run_is_a_fault(fleet):
    listeners = fleet.listeners(fleet.topics_of(0)[0], 0)
    deaf = next(host for host in range(len(fleet.hosts)) if host not in listeners)
    topic = settle(fleet, deaf)
    assert fleet.faults == [f"a message of {topic} by {fleet.hosts[0].name} was sent to "
                            f"{fleet.hosts[deaf].name}, which does not listen, at 0 s"]
    fleet.stop(listeners[0])
    fleet.faults.clear()
    settle(fleet, listeners[0], "host_down")
    assert fleet.faults == []
    settle(fleet, listeners[0], number=8)
    assert fleet.faults[0].startswith(
        f"message 8 of {topic} was delivered to {fleet.hosts[listeners[0]].name}, which does not "
        "run, at ")
