"""``desim validate --only middleware`` agrees where it is quick to see.

Each family has twins: with one constant of the protocol changed the same rows fail.
"""

from collections.abc import Callable
from functools import partial
from itertools import islice
from typing import NamedTuple

import pytest

from desim.middleware.dds import parameters
from desim.middleware.dds.heartbeat_piggyback import WhenFull
from desim.middleware.dds.participant import Participant
from desim.middleware.dds.reader_proxy import ReaderProxy
from desim.middleware.multimaster.sync import Sync
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.ros1.xmlrpc import XmlrpcThread
from desim.middleware.udp.reassembly import Reassembly
from desim.middleware.zenoh import link, link_state_flood
from desim.middleware.zenoh import zenoh as zenoh_model
from desim.middleware.zenoh.link_queue import LinkQueue
from desim.validation import dds, multimaster, ros1, zenoh


class Twin(NamedTuple):
    """Some rows of a family, and what is made wrong."""

    rows: Callable
    wrong: Callable


def no_checksums(monkeypatch):
    """As multimaster_fkie before it asked for them."""
    monkeypatch.setattr(Sync, "_ask", lambda sync, method, remote, count, done=lambda ok, _: None:
                        done(True, None))


def no_rounds(monkeypatch):
    """Answers are noticed at once."""
    monkeypatch.setattr(XmlrpcThread, "round_end_ns", lambda thread, now_ns: now_ns)


def no_questions(monkeypatch):
    """Subscriptions are registered at once."""
    monkeypatch.setattr(Ros1, "Params", partial(
        Ros1.Params, constants={"parameters": 0}))


def longer_keep_alives(monkeypatch):
    monkeypatch.setattr(link, "KEEP_ALIVE_BYTES", 60)


def short_tokens(monkeypatch):
    """Names of topics, and nothing else."""
    monkeypatch.setattr(zenoh_model, "token_bytes", lambda node, topic: 15 + len(topic))


def changes_together(monkeypatch):
    """A state that has changed several times meanwhile is passed on once, as it is now."""
    whole = link_state_flood.LinkStateNews.until
    monkeypatch.setattr(link_state_flood.LinkStateNews, "until", lambda news, state: tuple(
        -(-part // max(whole(news, state)[0], 1)) for part in whole(news, state)))


def one_write(monkeypatch):
    """All that is passed on in one instant is one packet, if it fits."""
    whole = link.RouterLink.send
    monkeypatch.setattr(link.RouterLink, "send",
                        lambda end, kind, size_bytes, arrived, what=None, writes=1:
                        whole(end, kind, size_bytes, arrived, what))


def no_drain(monkeypatch):
    """An end that has expired is gone at once."""
    monkeypatch.setattr(LinkQueue, "flush", lambda self, flushed: flushed())


def small_zenoh_fleet():
    return islice(zenoh.discovery(), 1)


def twelve_zenoh_hosts():
    return zenoh.floods(slice(1))


def more_zenoh_hosts():
    return zenoh.floods(slice(1, None))


def zenoh_near_the_lease():
    return zenoh.received_again([("zenoh", 8)])


def small_fleet_of_fast_dds():
    return dds.discovery("fastdds_2_9", [(2, 10, 77.8), (4, 0, 226)])


def announced_by_multicast_alone(monkeypatch):
    whole = Participant._announce_to_all
    monkeypatch.setattr(Participant, "_announce_to_all",
                        lambda self, times, known: whole(self, times, []))


def fleet_of_cyclone_dds():
    return dds.discovery("cyclonedds_11_0", [(2, 10, 37.5), (8, 10, 1253)])


def greeted_one_by_one(monkeypatch):
    monkeypatch.setitem(parameters.CYCLONEDDS["constants"], "first_heartbeat_to_all", False)


def nobody_says_that_it_lives(monkeypatch):
    monkeypatch.setitem(parameters.CYCLONEDDS["constants"], "liveliness_period", "0 ns")


def large_samples():
    return dds.losses([dds.LOSSES[2]], 300)


def blocked_samples():
    return dds.blocked({0.03: dds.BLOCKED[0.03]}, 3)


def memory_without_end(monkeypatch):
    """Fragments wait in as much memory as they need."""
    whole = Reassembly.__init__
    monkeypatch.setattr(Reassembly, "__init__", lambda self, limit_bytes, time_ns: whole(
        self, 1 << 40, time_ns))


def trains_are_lost_whole(monkeypatch):
    monkeypatch.setattr(ReaderProxy, "arrived_in_part", lambda self, token, receiver, lost:
                        self.lost(token, receiver, next(iter(lost.values()))))


def a_heartbeat_on_every_sample(monkeypatch):
    monkeypatch.setattr(WhenFull, "new", lambda self, sizes: (True,) * len(sizes))


TWINS = [
    Twin(multimaster.discovery, no_checksums),
    Twin(ros1.first_messages, no_rounds),
    Twin(ros1.first_messages, no_questions),
    Twin(small_fleet_of_fast_dds, announced_by_multicast_alone),
    Twin(fleet_of_cyclone_dds, greeted_one_by_one),
    Twin(dds.at_rest, nobody_says_that_it_lives),
    Twin(large_samples, trains_are_lost_whole),
    Twin(blocked_samples, memory_without_end),
    Twin(dds.all_kept, a_heartbeat_on_every_sample),
    Twin(zenoh.at_rest, longer_keep_alives),
    Twin(small_zenoh_fleet, short_tokens),
    Twin(twelve_zenoh_hosts, one_write),
    Twin(more_zenoh_hosts, changes_together),
    Twin(zenoh_near_the_lease, no_drain),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = list(twin.rows())
    assert rows and [check for check in rows if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in twin.rows())


def test_heard_again_over_masters_that_fetch_in_half_the_time_is_too_soon():
    assert all(check.holds for check in multimaster.received_again())
    assert not any(check.holds for check in multimaster.received_again(sync_delay="1 s"))
