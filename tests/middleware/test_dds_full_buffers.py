"""Discovery on a network that is too slow for it: the send buffers of participants bound it."""

import pytest
from configured import configured
from graphs import Net, S, silent

from desim.middleware.dds.dds import Dds
from desim.middleware.dds.event_thread import EventThread
from netmodels.access_link import AccessLink

LIMIT, PART = 212_992, 16 * 2304  # B: of a socket; the last part of a train may exceed it
HOSTS, COUNT = 3, 5


def crowd(preset):
    """Hosts of five participants at lines of 200 kb/s: each second the packets that wait, and the
    memory taken, of each participant's socket."""
    net = Net({f"robot_{k}": silent for k in range(HOSTS)},
              AccessLink(AccessLink.Params(rate="200 kb/s")),
              middleware=Dds(configured(Dds.Params, preset=preset, participants=COUNT)))
    waiting, used = [], []
    for second in range(1, 31):
        net.run(second * S)
        for host in range(HOSTS):
            for number in range(COUNT):
                socket = net.graph.middleware.on(host, number).socket
                waiting.append(sum(train.packets for queue in socket._waiting.values()
                                   for _, train in queue))
                used.append(socket.used_bytes)
    return waiting, used


@pytest.mark.parametrize("preset", ["fastdds", "cyclonedds"])
def test_a_participant_sends_no_more_than_its_buffer_holds(preset):
    """Timers wait while the buffer is full; the rest of what one of them sends waits before it."""
    waiting, used = crowd(preset)
    assert max(used) <= LIMIT + PART
    assert max(waiting) < 400


def test_with_a_thread_that_never_stands_it_queues_without_bound(monkeypatch):
    """The twin."""
    monkeypatch.setattr(EventThread, "stands", False)
    waiting, used = crowd("fastdds")
    assert max(used) <= LIMIT + PART
    assert max(waiting) > 4000
