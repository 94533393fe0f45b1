"""Several DDS participants on a host: what they add to the air, and what they do not."""

import pytest
from configured import configured
from graphs import MS, Net, S, listener, silent, talker
from pydantic import ValidationError

from desim.middleware.dds.dds import Dds


def dds(preset, count, **params):
    return Dds(configured(Dds.Params, preset=preset, participants=count, **params))


def robots(hosts, count, preset="cyclonedds", **params):
    return Net({f"robot_{k}": silent for k in range(hosts)},
               middleware=dds(preset, count, **params))


def bytes_of_pairs(hosts, count):
    """Discovery's bytes in 15 s for each ordered pair of participants on different hosts, but for
    announcements to all. Heartbeats to all readers make it grow with the number of participants."""
    net = robots(hosts, count).run(15 * S)
    wire = net.graph.middleware.wire
    multicasts = hosts * count * (wire.announcement(2).size_bytes + wire.announcement().size_bytes)
    total = sum(net.graph.context.discovery_bytes.values())
    return (total - multicasts) / (hosts * (hosts - 1) * count * count)


def assert_only_pairs_of_different_hosts_cost_bytes():
    alone = bytes_of_pairs(8, 1)
    for hosts, count in ((2, 4), (4, 2)):
        assert bytes_of_pairs(hosts, count) == pytest.approx(alone, rel=0.05)


def test_only_pairs_of_different_hosts_cost_bytes():
    assert_only_pairs_of_different_hosts_cost_bytes()


def test_with_participants_that_do_not_hear_their_neighbours_the_pairs_cost_less(monkeypatch):
    """The twin: half of the messages between hosts are for participants that nobody hears."""
    whole = Dds.take
    monkeypatch.setattr(Dds, "take", lambda self, envelope, receiver, lost: (
        whole(self, envelope, receiver, lost) if envelope[1][2] % 2 == 0 else None))
    with pytest.raises(AssertionError):
        assert_only_pairs_of_different_hosts_cost_bytes()


@pytest.mark.parametrize("preset", ["cyclonedds", "fastdds"])
def test_the_participants_of_one_host_find_each_other_without_a_frame(preset):
    net = robots(1, 5, preset).run(5 * S)
    assert net.graph.context.discovery_frames == {}
    first = net.graph.middleware.participants[0]
    assert sorted(guid[2] for guid in first.remotes) == [1, 2, 3, 4]
    assert all(remote.got == 17 for remote in first.remotes.values())


@pytest.mark.parametrize("preset", ["cyclonedds", "fastdds"])
def test_all_find_all(preset):
    net = robots(3, 4, preset).run(15 * S)
    for host in range(3):
        for number in range(4):
            remotes = net.graph.middleware.on(host, number).remotes
            assert len(remotes) == 11 and all(remote.got == 17 for remote in remotes.values())


def test_topics_belong_to_the_first_participant_alone():
    heard = []
    net = Net({"robot_0": talker([(2 * S + k * MS, str(k)) for k in range(5)], "/t"),
               "robot_1": listener(heard, "/t", 5)}, middleware=dds("cyclonedds", 3)).run(5 * S)
    assert [text for *_, text in heard] == ["0", "1", "2", "3", "4"]
    assert net.graph.middleware.on(1, 2).readers == {}


def test_a_host_that_starts_again_has_all_of_its_participants_anew():
    net = robots(2, 3, lease="4 s").run(5 * S)
    model = net.graph.middleware
    net.graph.hosts[1].stop()
    net.run(10 * S)
    assert {guid[0] for guid in model.participants[0].remotes} == {0}
    net.graph.hosts[1].start()
    net.run(15 * S)
    assert sorted(model.participants[0].remotes) == [(0, 1, 1), (0, 1, 2), (1, 2, 0), (1, 2, 1),
                                                     (1, 2, 2)]


def test_the_host_of_a_server_has_one():
    net = robots(3, 4, "fastdds", discovery="server", server="robot_0").run(10 * S)
    model = net.graph.middleware
    assert model.on(0, 1) is None
    assert len(model.participants[0].remotes) == 8


def test_a_number_that_cannot_be_is_refused():
    with pytest.raises(ValidationError, match="greater than or equal to 1"):
        dds("fastdds", 0)

